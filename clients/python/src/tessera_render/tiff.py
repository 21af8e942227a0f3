"""Reads the float TIFF files that the server writes (`image.tif`), with numpy alone.

Little-endian TIFF 6.0 with strips of 32-bit floats, stored or deflated, with no predictor or the
floating-point one (Adobe Photoshop TIFF Technical Note 3). Anything else is refused.
"""

from __future__ import annotations

import struct
import zlib

import numpy as np
import numpy.typing as npt

from .errors import CorruptData

_WIDTH, _HEIGHT, _BITS, _COMPRESSION, _OFFSETS = 256, 257, 258, 259, 273
_CHANNELS, _ROWS, _COUNTS, _LAYOUT, _PREDICTOR, _FORMAT = 277, 278, 279, 284, 317, 339
_SIZES = {1: (1, "B"), 3: (2, "H"), 4: (4, "I")}
_DEFLATE = (8, 32946)


def _directory(data: bytes) -> dict[int, tuple[int, ...]]:
    """Returns the integer fields of the first directory."""
    magic, version, place = struct.unpack_from("<2sHI", data)
    if magic != b"II" or version != 42:
        raise CorruptData("not a little-endian TIFF")
    (count,) = struct.unpack_from("<H", data, place)
    fields = {}
    for i in range(count):
        at = place + 2 + 12 * i
        tag, kind, values = struct.unpack_from("<HHI", data, at)
        if kind not in _SIZES:
            continue
        size, code = _SIZES[kind]
        where = at + 8 if size * values <= 4 else struct.unpack_from("<I", data, at + 8)[0]
        fields[tag] = struct.unpack_from(f"<{values}{code}", data, where)
    return fields


def _undo_float_predictor(rows: npt.NDArray[np.uint8], channels: int) -> npt.NDArray[np.uint8]:
    """rows: (rows, bytes), differences of bytes, the most significant ones of a row first."""
    count, size = rows.shape
    summed = np.cumsum(rows.reshape(count, size // channels, channels), axis=1, dtype=np.uint8)
    planes = summed.reshape(count, 4, size // 4)
    return np.ascontiguousarray(np.moveaxis(planes[:, ::-1, :], 1, 2)).reshape(count, size)


def decode_tiff(data: bytes) -> npt.NDArray[np.float32]:
    """Returns (height, width) for one channel, else (height, width, channels)."""
    try:
        return _decode(data)
    except (struct.error, zlib.error, KeyError, IndexError, ValueError) as error:
        raise CorruptData(f"the TIFF is broken: {error}") from error


def _decode(data: bytes) -> npt.NDArray[np.float32]:
    fields = _directory(data)
    width, height = fields[_WIDTH][0], fields[_HEIGHT][0]
    channels = fields.get(_CHANNELS, (1,))[0]
    compression = fields.get(_COMPRESSION, (1,))[0]
    predictor = fields.get(_PREDICTOR, (1,))[0]
    rows_per_strip = fields.get(_ROWS, (height,))[0]
    is_float = set(fields[_BITS]) == {32} and set(fields[_FORMAT]) == {3}
    if not is_float or compression not in (1, *_DEFLATE) or predictor not in (1, 3):
        raise CorruptData("a TIFF of a kind that the server does not write")
    if channels > 1 and fields.get(_LAYOUT, (1,))[0] != 1:
        raise CorruptData("a TIFF with separate planes")
    parts = []
    for i, (offset, count) in enumerate(zip(fields[_OFFSETS], fields[_COUNTS], strict=True)):
        strip = data[offset : offset + count]
        if compression in _DEFLATE:
            strip = zlib.decompress(strip)
        rows = min(rows_per_strip, height - i * rows_per_strip)
        block = np.frombuffer(strip, dtype=np.uint8).reshape(rows, width * channels * 4)
        parts.append(_undo_float_predictor(block, channels) if predictor == 3 else block)
    image = np.concatenate(parts).view("<f4").astype(np.float32)
    shape = (height, width) if channels == 1 else (height, width, channels)
    return image.reshape(shape)
