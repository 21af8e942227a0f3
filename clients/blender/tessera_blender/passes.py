"""Layers of a job as render passes of Blender, in Blender's axes. Needs no Blender."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from .exr import read_exr


@dataclass(frozen=True)
class Pass:
    """layer: of the server. recorded: only where the job asks for it."""

    layer: str
    name: str
    channels: str
    kind: str  # of Blender: COLOR, VECTOR or VALUE
    summary: str
    recorded: bool = True


PASSES = (
    Pass("albedo", "Albedo", "RGB", "COLOR", "Colour of surfaces without light"),
    Pass("normal", "Normal", "XYZ", "VECTOR", "Normals in world space"),
    Pass("depth", "Depth", "Z", "VALUE", "Distance along the optical axis, metres"),
    Pass("position", "Position", "XYZ", "VECTOR", "Position in world space, metres"),
    Pass("uv", "UV", "UVA", "VECTOR", "Texture coordinates"),
    Pass("irradiance", "Irradiance", "RGB", "COLOR", "Irradiance of surfaces"),
    Pass("object", "Object Id", "X", "VALUE", "Number of the object"),
    Pass("instance", "Instance Id", "X", "VALUE", "Number of the instance"),
    Pass("material", "Material Id", "X", "VALUE", "Number of the material"),
    Pass("primitive", "Primitive Id", "X", "VALUE", "Number of the primitive"),
    Pass("error", "Error", "X", "VALUE", "Relative standard error of each pixel", recorded=False),
    Pass("variance", "Variance", "RGB", "COLOR", "Variance of each pixel's mean", recorded=False),
    Pass("samples", "Samples", "X", "VALUE", "Samples of each pixel", recorded=False),
)
# Levels of a Cryptomatte layer of the server: six ids.
CRYPTOMATTES = {"cryptomatte:object": "CryptoObject", "cryptomatte:material": "CryptoMaterial"}
_LEVELS = 3
# What Blender and Cycles write where the camera sees nothing.
_FAR = 1e10


def recorded_layers(chosen: set[str]) -> list[str]:
    """The member `film.layers` for the chosen layers."""
    always = {each.layer for each in PASSES if not each.recorded}
    known = [each.layer for each in PASSES] + list(CRYPTOMATTES)
    return [layer for layer in known if layer in chosen and layer not in always]


def declared(chosen: set[str]) -> list[tuple[str, str, str]]:
    """Name, channels and kind of each pass besides Combined."""
    found = [(each.name, each.channels, each.kind) for each in PASSES if each.layer in chosen]
    for layer, name in CRYPTOMATTES.items():
        if layer in chosen:
            found += [(f"{name}{level:02}", "RGBA", "COLOR") for level in range(_LEVELS)]
    return found


def _z_up(vectors: np.ndarray) -> np.ndarray:
    """The server's axes to Blender's."""
    return np.stack([vectors[..., 0], -vectors[..., 2], vectors[..., 1]], axis=-1)


def _planar(distance: np.ndarray, camera: Mapping[str, Any], left: int, top: int) -> np.ndarray:
    """Distances along rays as those along the optical axis, which are Blender's.

    camera: as among the job's objects. left, top: corner of the crop, in pixels of the film.
    """
    if camera["type"] != "perspective":
        return distance
    height, width = distance.shape[:2]
    x = (np.arange(left, left + width) + 0.5 - camera["cx"]) / camera["fx"]
    y = (np.arange(top, top + height) + 0.5 - camera["cy"]) / camera["fy"]
    return distance / np.sqrt(1 + x[None, :, None] ** 2 + y[:, None, None] ** 2)


def values(
    layer: str, image: np.ndarray, camera: Mapping[str, Any], left: int, top: int
) -> np.ndarray:
    """A layer's values as its pass has them: (height, width, channels)."""
    image = image if image.ndim == 3 else image[..., None]
    if layer in ("normal", "position"):
        return _z_up(image)
    if layer == "depth":
        seen = (image > 0) & np.isfinite(image)
        return np.where(seen, _planar(image, camera, left, top), _FAR)
    # The error of a pixel with one half of its samples is unknown.
    return np.nan_to_num(image, posinf=np.inf) if layer in ("error", "variance") else image


def _hash(text: str) -> int:
    """MurmurHash3_x86_32 with seed 0, which names a Cryptomatte's metadata (its specification)."""

    def turned(value: int, bits: int) -> int:
        return (value << bits | value >> (32 - bits)) & 0xFFFFFFFF

    data, state = text.encode(), 0
    for at in range(0, len(data), 4):
        word = int.from_bytes(data[at : at + 4], "little") * 0xCC9E2D51 & 0xFFFFFFFF
        state ^= turned(word, 15) * 0x1B873593 & 0xFFFFFFFF
        if at + 4 <= len(data):
            state = (turned(state, 13) * 5 + 0xE6546B64) & 0xFFFFFFFF
    state ^= len(data)
    for shift, factor in ((16, 0x85EBCA6B), (13, 0xC2B2AE35), (16, 1)):
        state = (state ^ state >> shift) * factor & 0xFFFFFFFF
    return state


def mattes(
    layer: str, exr: bytes, view_layer: str
) -> tuple[dict[str, np.ndarray], dict[str, str]]:
    """Passes of a Cryptomatte layer, and the metadata that Cryptomatte nodes look for.

    Blender knows a matte by the names of its view layer and pass.
    """
    planes, attributes = read_exr(exr)
    base = CRYPTOMATTES[layer]
    found = {
        f"{base}{level:02}": np.stack(
            [planes[f"{base}{level:02}.{channel}"] for channel in "RGBA"], axis=-1
        )
        for level in range(_LEVELS)
    }
    name = f"{view_layer}.{base}"
    told = {
        f"cryptomatte/{_hash(name):08x}"[:19] + "/" + key.split("/")[2]: text.decode()
        for key, text in attributes.items()
        if key.startswith("cryptomatte/")
    }
    return found, {key: name if key.endswith("/name") else text for key, text in told.items()}


def combined(mean: np.ndarray, alpha: np.ndarray) -> np.ndarray:
    """RGBA, associated, as the pass Combined has it; black and clear where nothing is known."""
    known = np.isfinite(mean).all(axis=2)
    rgba = np.zeros((*known.shape, 4), np.float32)
    rgba[known] = np.concatenate([mean, alpha[..., None]], axis=2)[known]
    return rgba


def rect(image: np.ndarray) -> np.ndarray:
    """Pixels in Blender's order, the bottom row first: (height * width, channels)."""
    return np.ascontiguousarray(image[::-1], dtype=np.float32).reshape(-1, image.shape[2])
