"""A Blender world as the member `environment` of a job. Needs no Blender but for an image's pixels.

Both sides look an equirectangular image up alike, u = 0.5 - atan2(y, x) / 2 pi in Blender's axes,
so an image needs no turn of its own.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from .exr import write_exr


@dataclass
class World:
    """color: linear Rec.709, multiplies the image. image: bpy.types.Image or None. losses: what a
    job cannot express."""

    color: list[float]
    strength: float = 1.0
    image: Any = None
    rotation_degrees: float = 0.0
    losses: list[str] = field(default_factory=list)


def _source(socket: Any) -> Any:
    return socket.links[0].from_node if socket.is_linked else None


def _surface(tree: Any) -> Any:
    outputs = [node for node in tree.nodes if node.type == "OUTPUT_WORLD"]
    shown = [node for node in outputs if node.is_active_output] or outputs
    return _source(shown[0].inputs["Surface"]) if shown else None


def _turn(found: World, texture: Any) -> None:
    """Reads the mapping of an environment texture. A point mapping turns the direction that is
    looked up, so the image turns the other way; a texture mapping is its inverse."""
    mapping = _source(texture.inputs["Vector"])
    if mapping is None or mapping.type == "TEX_COORD":
        return
    if mapping.type != "MAPPING":
        found.losses.append(f'World: node "{mapping.name}" before the environment texture')
        return
    x, y, z = mapping.inputs["Rotation"].default_value
    angle = math.degrees(z)
    found.rotation_degrees = angle if mapping.vector_type == "TEXTURE" else -angle
    scaled = any(abs(s - 1) > 1e-6 for s in mapping.inputs["Scale"].default_value)
    linked = any(socket.is_linked for socket in mapping.inputs if socket.name != "Vector")
    if abs(x) > 1e-6 or abs(y) > 1e-6 or scaled or linked:
        found.losses.append("World: only a constant rotation about z of the environment texture")


def read_world(world: Any) -> World:
    """Reads one Background node with a colour or an environment texture; None is black."""
    if world is None:
        return World([0.0, 0.0, 0.0])
    if not world.use_nodes or world.node_tree is None:
        return World(list(world.color))
    node = _surface(world.node_tree)
    if node is None:
        return World([0.0, 0.0, 0.0])
    if node.type != "BACKGROUND":
        return World([0.0, 0.0, 0.0], losses=[f'World: node "{node.name}"; the world is black'])
    found = World([1.0, 1.0, 1.0], strength=node.inputs["Strength"].default_value)
    if node.inputs["Strength"].is_linked:
        found.losses.append("World: nodes that make its strength")
    texture = _source(node.inputs["Color"])
    if texture is None:
        found.color = list(node.inputs["Color"].default_value[:3])
    elif texture.type == "TEX_ENVIRONMENT" and texture.image is not None:
        if texture.projection != "EQUIRECTANGULAR":
            found.losses.append("World: a mirror ball is taken for an equirectangular image")
        found.image = texture.image
        _turn(found, texture)
    else:
        found.losses.append(f'World: node "{texture.name}"; the world is black')
        found.color = [0.0, 0.0, 0.0]
    return found


def member(world: World, asset: str | None) -> dict[str, Any] | None:
    """The member `environment`; asset: id of the uploaded image. Null is black."""
    if world.strength <= 0 or not any(world.color):
        return None
    # An intensity is at most 1e9 and colours are not negative; Blender has the same bounds but one.
    environment: dict[str, Any] = {
        "color": [max(0.0, c) for c in world.color],
        "intensity": world.strength,
        "rotation_degrees": world.rotation_degrees,
    }
    return environment | ({"asset": asset} if asset else {})


def linear(srgb: np.ndarray) -> np.ndarray:
    """IEC 61966-2-1."""
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)


def image_content(image: Any, path: str) -> Path | bytes:
    """What to upload for an image: its own file if the server reads it, else its pixels.

    image: bpy.types.Image. path: of its file, absolute.
    """
    own = image.source == "FILE" and image.file_format in ("HDR", "OPEN_EXR")
    if own and not image.is_dirty and image.packed_file is None and Path(path).is_file():
        return Path(path)
    width, height = image.size
    if width == 0 or height == 0:
        raise ValueError(f'the image "{image.name}" of the world cannot be read: {path}')
    values = np.empty(width * height * image.channels, np.float32)
    image.pixels.foreach_get(values)
    pixels = values.reshape(height, width, image.channels)[::-1]
    pixels = np.repeat(pixels[..., :1], 3, axis=2) if image.channels < 3 else pixels[..., :3]
    # The pixels of an image with 8 bits are those of its file.
    if not image.is_float and image.colorspace_settings.name == "sRGB":
        pixels = linear(pixels)
    return write_exr(pixels)
