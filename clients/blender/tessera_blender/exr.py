"""EXR files with numpy alone, by the OpenEXR File Layout.

Reads the plain files of the server (`image.exr`) for Cryptomatte, which only EXR can store: scan
lines of 32-bit or 16-bit floats, ZIP or not compressed; anything else is refused. Writes images of
worlds.
"""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np

_FLOATS = {1: np.dtype("<f2"), 2: np.dtype("<f4")}
_NONE, _ZIPS, _ZIP = 0, 2, 3
_LINES = {_NONE: 1, _ZIPS: 1, _ZIP: 16}


def _name(data: bytes, at: int) -> tuple[str, int]:
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def _header(data: bytes) -> tuple[dict[str, bytes], int]:
    if data[:4] != b"\x76\x2f\x31\x01" or data[5] & 0x1A:
        raise ValueError("not an EXR file of scan lines in one part")
    attributes, at = {}, 8
    while data[at]:
        name, at = _name(data, at)
        _, at = _name(data, at)
        (size,) = struct.unpack_from("<i", data, at)
        attributes[name] = data[at + 4 : at + 4 + size]
        at += 4 + size
    return attributes, at + 1


def _channels(data: bytes) -> list[tuple[str, np.dtype[Any]]]:
    found, at = [], 0
    while data[at]:
        name, at = _name(data, at)
        (kind,) = struct.unpack_from("<i", data, at)
        if kind not in _FLOATS:
            raise ValueError(f"channel {name} is not of floats")
        found.append((name, _FLOATS[kind]))
        at += 16
    return found


def _unzip(packed: bytes, size: int) -> bytes:
    """A block that compression does not make smaller is stored as it is."""
    if len(packed) == size:
        return packed
    deltas = np.frombuffer(zlib.decompress(packed), np.uint8).astype(np.int64)
    deltas[1:] -= 128
    halves = np.cumsum(deltas).astype(np.uint8)
    out = np.empty(size, np.uint8)
    out[0::2], out[1::2] = halves[: (size + 1) // 2], halves[(size + 1) // 2 :]
    return out.tobytes()


def read_exr(data: bytes) -> tuple[dict[str, np.ndarray], dict[str, bytes]]:
    """Returns the channels, each (height, width) of float32 with the top row first, and the
    attributes of the header."""
    attributes, at = _header(data)
    left, top, right, bottom = struct.unpack("<4i", attributes["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    compression = attributes["compression"][0]
    if compression not in _LINES:
        raise ValueError(f"EXR compression {compression} is not read here")
    lines = _LINES[compression]
    channels = _channels(attributes["channels"])
    planes = {name: np.empty((height, width), np.float32) for name, _ in channels}
    blocks = -(-height // lines)
    for place in struct.unpack_from(f"<{blocks}Q", data, at):
        first, stored = struct.unpack_from("<ii", data, place)
        rows = min(lines, bottom + 1 - first)
        size = rows * width * sum(kind.itemsize for _, kind in channels)
        block = _unzip(data[place + 8 : place + 8 + stored], size)
        offset = 0
        for row in range(first - top, first - top + rows):
            for name, kind in channels:
                planes[name][row] = np.frombuffer(block, kind, width, offset)
                offset += width * kind.itemsize
    return planes, attributes


def write_exr(pixels: np.ndarray) -> bytes:
    """A file, not compressed, of (height, width, 3) linear Rec.709 with the top row first."""
    height, width = pixels.shape[:2]
    head = struct.pack("<II", 20000630, 2)

    def attribute(name: str, kind: str, value: bytes) -> bytes:
        return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(value)) + value

    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = b"".join(name + struct.pack("<4i", 2, 0, 1, 1) for name in (b"B\0", b"G\0", b"R\0"))
    head += attribute("channels", "chlist", listed + b"\0")
    head += attribute("compression", "compression", bytes([_NONE]))
    head += attribute("dataWindow", "box2i", window)
    head += attribute("displayWindow", "box2i", window)
    head += attribute("lineOrder", "lineOrder", b"\0")
    head += attribute("pixelAspectRatio", "float", struct.pack("<f", 1))
    head += attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0))
    head += attribute("screenWindowWidth", "float", struct.pack("<f", 1)) + b"\0"
    size = 12 * width
    first = len(head) + 8 * height
    places = struct.pack(f"<{height}Q", *(first + y * (8 + size) for y in range(height)))
    planar = np.ascontiguousarray(pixels[..., ::-1].transpose(0, 2, 1), dtype="<f4")
    lines = [struct.pack("<ii", y, size) + planar[y].tobytes() for y in range(height)]
    return head + places + b"".join(lines)
