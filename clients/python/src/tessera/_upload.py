"""Local scene files: the files that they refer to, and their paths."""

from __future__ import annotations

import asyncio
import hashlib
import json
import os
from collections.abc import AsyncIterator, Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote

from ._wire import PIECE_BYTES, Call
from .errors import TesseraError

# The server reads a large scene and builds its trees within the request.
_LOADING_S = 600.0
_MEDIA = {".glb": "model/gltf-binary", ".zip": "application/zip"}


def looks_like_file(scene: str | os.PathLike[str]) -> bool:
    """Returns whether this is a path to upload, rather than the name or id of a scene."""
    return (
        not isinstance(scene, str)
        or scene.lower().endswith((".glb", ".gltf", ".zip"))
        or (os.sep in scene)
    )


def scene_file(path: str | os.PathLike[str]) -> Path:
    """Returns the file to upload: the path itself, or the only glTF or GLB in a folder."""
    place = Path(path)
    if place.is_dir():
        found = sorted(p for p in place.iterdir() if p.suffix.lower() in (".gltf", ".glb"))
        if len(found) != 1:
            names = ", ".join(p.name for p in found) or "none"
            raise TesseraError(f"{place}: a folder needs one .gltf or .glb file, here: {names}")
        return found[0]
    if not place.is_file():
        raise FileNotFoundError(f"there is no scene file {place}")
    if place.suffix.lower() not in (".gltf", *_MEDIA):
        raise TesseraError(f"{place}: a scene is a .glb, .gltf or .zip file, or a folder with one")
    return place


def single_file_call(content: Path | bytes, suffix: str) -> Call:
    """POST /v1/scenes with a single file."""
    headers = {"Content-Type": _MEDIA[suffix]}
    params = {"name": content.name} if isinstance(content, Path) else {}
    return Call(
        "POST", "/v1/scenes", params=params, content=content, headers=headers, timeout_s=_LOADING_S
    )


def scene_from_assets_call(gltf_id: str, files: dict[str, str], name: str) -> Call:
    return Call(
        "POST", "/v1/scenes", params={"name": name}, json={"gltf": gltf_id, "files": files},
        timeout_s=_LOADING_S,
    )  # fmt: skip


def bytes_suffix(content: bytes) -> str:
    """Returns ".glb" or ".zip", judging by the first bytes."""
    if content[:4] == b"glTF":
        return ".glb"
    if content[:2] == b"PK":
        return ".zip"
    raise TesseraError("bytes of a scene are a GLB or a zip archive; these are neither")


@dataclass(frozen=True)
class SideFile:
    uri: str  # as written in the document
    path: Path


def side_files(gltf: Path) -> list[SideFile]:
    """Returns the files that a glTF document refers to, each once. They must be in its folder."""
    try:
        document = json.loads(gltf.read_bytes())
    except ValueError as error:
        raise TesseraError(f"{gltf}: is not JSON: {error}") from error
    if not isinstance(document, dict):
        raise TesseraError(f"{gltf}: is not a glTF document")
    home = gltf.parent.resolve()
    found: dict[str, SideFile] = {}
    for kind in ("buffers", "images"):
        items = document.get(kind)
        for item in items if isinstance(items, list) else []:
            uri = item.get("uri") if isinstance(item, dict) else None
            if not isinstance(uri, str) or uri.startswith("data:") or uri in found:
                continue
            path = (home / unquote(uri)).resolve()
            if "://" in uri or not path.is_relative_to(home):
                raise TesseraError(f"{gltf}: may only use files in its own folder, not {uri}")
            if not path.is_file():
                raise FileNotFoundError(f"{gltf} refers to {uri}, which does not exist")
            found[uri] = SideFile(uri, path)
    return list(found.values())


def pieces(path: Path) -> Iterator[bytes]:
    with path.open("rb") as file:
        while piece := file.read(PIECE_BYTES):
            yield piece


async def async_pieces(path: Path) -> AsyncIterator[bytes]:
    with path.open("rb") as file:
        while piece := await asyncio.to_thread(file.read, PIECE_BYTES):
            yield piece


def sha256_of(content: Path | bytes) -> str:
    digest = hashlib.sha256()
    for piece in pieces(content) if isinstance(content, Path) else [content]:
        digest.update(piece)
    return digest.hexdigest()


def find_asset_call(asset_id: str) -> Call:
    return Call("HEAD", f"/v1/assets/{asset_id}", missing_is_fine=True)


def put_asset_call(asset_id: str, content: Path | bytes) -> Call:
    headers = {"Content-Type": "application/octet-stream"}
    return Call(
        "PUT", f"/v1/assets/{asset_id}", content=content, headers=headers, timeout_s=_LOADING_S
    )
