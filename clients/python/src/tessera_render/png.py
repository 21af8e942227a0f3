"""Conversion of arrays to PNG, for notebooks and contact sheets; needs only zlib."""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt


def srgb8(linear: npt.ArrayLike, exposure_stops: float = 0.0) -> npt.NDArray[np.uint8]:
    """Converts linear values to sRGB bytes (IEC 61966-2-1), clipped to [0, 1]; NaN becomes 0."""
    value = np.asarray(linear, dtype=np.float64) * 2.0**exposure_stops
    value = np.clip(np.nan_to_num(value, nan=0.0, posinf=1.0, neginf=0.0), 0.0, 1.0)
    curve = np.where(value <= 0.0031308, value * 12.92, 1.055 * value ** (1 / 2.4) - 0.055)
    return np.asarray(np.round(curve * 255), dtype=np.uint8)


def encode_png(pixels: npt.NDArray[np.uint8] | npt.NDArray[np.uint16]) -> bytes:
    """Encodes (height, width) grey, (height, width, 3) RGB or (height, width, 4) RGBA.

    pixels: 8 or 16 bits.
    """
    if pixels.dtype not in (np.uint8, np.uint16):
        raise ValueError(f"a PNG is made of uint8 or uint16, not {pixels.dtype}; see srgb8()")
    cube = pixels[:, :, np.newaxis] if pixels.ndim == 2 else pixels
    if cube.ndim != 3 or cube.shape[2] not in (1, 3, 4) or 0 in cube.shape:
        raise ValueError(f"not an image: an array of shape {pixels.shape}")
    height, width, channels = cube.shape
    size = cube.dtype.itemsize
    rows = np.zeros((height, 1 + width * channels * size), dtype=np.uint8)  # filter 0, the row
    rows[:, 1:] = cube.astype(f">u{size}").reshape(height, -1).view(np.uint8)
    head = struct.pack(">IIBBBBB", width, height, 8 * size, {1: 0, 3: 2, 4: 6}[channels], 0, 0, 0)
    body = zlib.compress(rows.tobytes(), 6)
    chunks = [(b"IHDR", head), (b"IDAT", body), (b"IEND", b"")]
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        for kind, data in chunks
    )
