"""Local scene files, and the files beside them."""

from __future__ import annotations

import asyncio
import codecs
import contextlib
import hashlib
import io
import os
import posixpath
import re
import unicodedata
import zipfile
from collections.abc import AsyncIterator, Iterator
from pathlib import Path

from ._wire import PIECE_BYTES, Call
from .errors import MissingFiles, TesseraError

# The server reads a large scene and builds its trees within the request.
_LOADING_S = 600.0
_MEDIA = {
    ".glb": "model/gltf-binary",
    ".gltf": "model/gltf+json",
    ".zip": "application/zip",
    ".stl": "model/stl",
    ".obj": "model/obj",
    ".ply": "model/ply",
    ".3mf": "model/3mf",
}


def looks_like_file(scene: str | os.PathLike[str]) -> bool:
    """Returns whether this is a path to upload, rather than the name or id of a scene."""
    return not isinstance(scene, str) or scene.lower().endswith(tuple(_MEDIA)) or (os.sep in scene)


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
    if place.suffix.lower() not in _MEDIA:
        known = ", ".join(_MEDIA)
        raise TesseraError(f"{place}: a scene is a folder with one glTF, or a file of {known}")
    return place


def _params(name: str | None, strict: bool) -> dict[str, str]:
    named = {} if name is None else {"name": name}
    return named | {"strict": "1"} if strict else named


def single_file_call(content: Path | bytes, suffix: str, strict: bool = False) -> Call:
    """POST /v1/scenes with a single file; with an OBJ, also the files beside it that it names."""
    name = content.name if isinstance(content, Path) else None
    if isinstance(content, Path) and suffix == ".obj" and len(files := obj_files(content)) > 1:
        content, suffix = _zip_of(files), ".zip"
    headers = {"Content-Type": _MEDIA[suffix]}
    params = _params(name, strict)
    return Call(
        "POST", "/v1/scenes", params=params, content=content, headers=headers, timeout_s=_LOADING_S
    )


def scene_from_assets_call(
    gltf_id: str, files: dict[str, str], name: str, strict: bool = False
) -> Call:
    return Call(
        "POST", "/v1/scenes", params=_params(name, strict), json={"gltf": gltf_id, "files": files},
        timeout_s=_LOADING_S,
    )  # fmt: skip


def bytes_suffix(content: bytes) -> str:
    """Returns ".glb" or ".zip", judging by the first bytes."""
    if content[:4] == b"glTF":
        return ".glb"
    if content[:2] == b"PK":
        return ".zip"
    raise TesseraError("bytes of a scene are a GLB or a zip archive; these are neither")


_FILES = "/files/"


def missing_files(problem: MissingFiles) -> list[str]:
    """Returns the names of the files that the server lacks: pointers into `files` of a request."""
    return [
        error.pointer[len(_FILES) :].replace("~1", "/").replace("~0", "~")
        for error in problem.errors
        if error.pointer.startswith(_FILES)
    ]


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _find_inside(home: Path, name: str) -> Path | None:
    """Returns the file of that name, else the only one that Windows or macOS would take for it."""
    place = home
    for part in name.split("/"):
        if not (place / part).exists():
            inside = place.iterdir() if place.is_dir() else ()
            alike = [each for each in inside if _folded(each.name) == _folded(part)]
            if len(alike) != 1:
                return None
            place = alike[0]
        else:
            place /= part
    return place if place.is_file() else None


def side_file(document: Path, name: str) -> Path:
    """Returns the file beside a document, from its folder only. name: a uri, percent-decoded."""
    home = document.parent.resolve()
    outside = TesseraError(
        f"{document}: {name} lies outside the scene's folder: a scene may only use files in its "
        "own folder"
    )
    plain = [posixpath.normpath(spelled) for spelled in (name, name.replace("\\", "/"))]
    if "://" in name or any(each.startswith(("/", "../")) or each == ".." for each in plain):
        raise outside
    path = _find_inside(home, plain[0]) or _find_inside(home, plain[1])
    if path is not None and not path.resolve().is_relative_to(home):
        raise outside
    if path is None:
        raise FileNotFoundError(f"{document} refers to {name}, which does not exist")
    return path.resolve()


# `mtllib NAMES` of an OBJ; `map_Kd OPTIONS NAME` and the like of its materials. Names have spaces,
# and may be quoted.
_REFERENCE = re.compile(rb"^[ \t]*(mtllib|map_\w+|norm)[ \t]+(.*?)[ \t]*$", re.M)


def _text_of(path: Path) -> bytes:
    """Returns the text of a file: of UTF-16 as UTF-8, with \\n for each end of a line."""
    content = path.read_bytes().removeprefix(codecs.BOM_UTF8)
    if content.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)):
        content = content.decode("utf-16", errors="replace").encode(errors="replace")
    return content.replace(b"\r", b"\n")


def _referenced(path: Path, reference: str) -> tuple[str, Path] | None:
    """Returns the name in a reference, with slashes, and its file: the longest end that names
    one, or its last part, where the path is that of another machine."""
    last = re.split(r"[/\\]", reference)[-1]
    names = [reference[match.start() :] for match in re.finditer(r"\S+", reference)]
    for name in [*names, last]:
        with contextlib.suppress(FileNotFoundError, TesseraError):
            return name.replace("\\", "/"), side_file(path, name)
    return None


def obj_files(path: Path) -> dict[str, Path]:
    """Returns an OBJ, and the materials and textures that lie beside it: name, path.

    Names have no folders, unless another file has the same. The server names what is missing.
    """
    files = {path.name: path}
    waiting = [path]
    while waiting:
        for match in _REFERENCE.finditer(_text_of(waiting.pop())):
            whole = match[2].decode(errors="surrogateescape")
            quoted = re.findall('"([^"]+)"$', whole)
            words = whole.split() if match[1] == b"mtllib" else []
            for reference in (whole, *quoted, *words):
                name, found = _referenced(path, reference) or ("", path)
                if found not in (path, *files.values()):
                    last = name.rsplit("/", 1)[-1]
                    files[name if last in files else last] = found
                    waiting += [found] if last.lower().endswith(".mtl") else []
    return files


def _zip_of(files: dict[str, Path]) -> bytes:
    archive = io.BytesIO()
    with zipfile.ZipFile(archive, "w") as packed:
        for name, path in files.items():
            packed.writestr(zipfile.ZipInfo(name), path.read_bytes())  # without a date
    return archive.getvalue()


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
