"""Tile frames (`application/vnd.tessera.tiles`) as numpy arrays, and the image that they form.

A frame is a 32-byte header, little endian: bytes `T S R 1`, u32 payload bytes, u32 revision, u16 x,
y, width, height, u32 flags, f32 relative error, u32 CRC-32 of the payload; then planes of float32,
row by row: r g b, their variances, the sample count, and alpha if flagged; for denoised frames r g
b and, if flagged, alpha.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple, TypeAlias

import numpy as np
import numpy.typing as npt

from ._wire import Call
from .errors import CorruptData
from .png import encode_png, srgb8

FloatArray: TypeAlias = npt.NDArray[np.float32]

_HEADER = struct.Struct("<4sIIHHHHIfI")
_END, _CORRELATED, _ALPHA, _DENOISED = 1, 2, 4, 16
# The stream has no pings, so a dead line looks like a paused job: reconnects after this time.
_QUIET_S = 60.0


@dataclass(frozen=True, eq=False)
class Tile:
    """A part of the image at `revision`.

    x, y: its corner in pixels of the full film. mean: (height, width, 3), linear Rec.709. variance:
    of the mean, same shape; NaN while only one half has samples. samples: (height, width). alpha:
    (height, width), or None if the background is opaque; mean is associated with it.
    relative_error: of the tile, NaN if unknown. correlated: errors of neighbouring pixels are
    correlated, so `variance` must not be added over a block. denoised: of the denoised image, whose
    variance and samples are NaN.
    """

    x: int
    y: int
    width: int
    height: int
    revision: int
    relative_error: float
    correlated: bool
    mean: FloatArray
    variance: FloatArray
    samples: FloatArray
    alpha: FloatArray | None
    denoised: bool = False


@dataclass(frozen=True)
class EndFrame:
    """The last frame of the stream of a job that has ended."""

    revision: int
    relative_error: float


class _Header(NamedTuple):
    magic: bytes
    size: int
    revision: int
    x: int
    y: int
    width: int
    height: int
    flags: int
    relative_error: float
    crc: int

    def planes(self) -> int:
        if self.flags & _END:
            return 0
        return (3 if self.flags & _DENOISED else 7) + (1 if self.flags & _ALPHA else 0)

    def check(self) -> None:
        if self.magic != b"TSR1":
            raise CorruptData(f"a tile frame begins with {self.magic!r}, not b'TSR1'")
        expected = self.planes() * 4 * self.width * self.height
        if self.size != expected:
            raise CorruptData(
                f"a tile of {self.width} x {self.height} has {self.size} bytes, not {expected}"
            )


class FrameParser:
    """Parses bytes into frames. Raises CorruptData if they are invalid."""

    def __init__(self) -> None:
        self._pending = bytearray()

    def feed(self, piece: bytes) -> Iterator[Tile | EndFrame]:
        self._pending += piece
        while len(self._pending) >= _HEADER.size:
            header = _Header._make(_HEADER.unpack_from(self._pending))
            header.check()
            end = _HEADER.size + header.size
            if len(self._pending) < end:
                return
            payload = bytes(self._pending[_HEADER.size : end])
            del self._pending[:end]
            if zlib.crc32(payload) != header.crc:
                raise CorruptData(f"the checksum of the tile at {header.x}, {header.y} is wrong")
            yield _decode(header, payload)


def _decode(header: _Header, payload: bytes) -> Tile | EndFrame:
    if header.flags & _END:
        return EndFrame(header.revision, header.relative_error)
    shape = (header.planes(), header.height, header.width)
    planes = np.frombuffer(payload, dtype="<f4").astype(np.float32).reshape(shape)
    denoised = bool(header.flags & _DENOISED)
    if denoised:
        unknown = np.full((4, *shape[1:]), np.nan, dtype=np.float32)
        planes = np.concatenate([planes[:3], unknown, planes[3:]])
    return Tile(
        x=header.x,
        y=header.y,
        width=header.width,
        height=header.height,
        revision=header.revision,
        relative_error=header.relative_error,
        correlated=bool(header.flags & _CORRELATED),
        mean=np.ascontiguousarray(np.moveaxis(planes[0:3], 0, -1)),
        variance=np.ascontiguousarray(np.moveaxis(planes[3:6], 0, -1)),
        samples=planes[6],
        alpha=planes[7] if header.flags & _ALPHA else None,
        denoised=denoised,
    )


class TileFeed:
    """A job's tiles over any number of connections.

    A new connection sends every tile again; unchanged ones are dropped here.
    """

    def __init__(self, job_path: str, after: int, compressed: bool, denoise: str = "off") -> None:
        self._path = job_path + "/tiles"
        self._params: dict[str, str | int] = {"after": after}
        if denoise != "off":
            self._params["denoise"] = denoise
        self._compressed = compressed
        self._parser = FrameParser()
        self._seen: dict[tuple[int, int, bool], tuple[int, float]] = {}
        self.end: EndFrame | None = None

    def call(self) -> Call:
        self._parser = FrameParser()
        headers = {"Accept": "application/vnd.tessera.tiles"}
        if not self._compressed:
            headers["Accept-Encoding"] = "identity"
        return Call("GET", self._path, params=self._params, headers=headers, timeout_s=_QUIET_S)

    def take(self, piece: bytes) -> Iterator[Tile]:
        for frame in self._parser.feed(piece):
            if isinstance(frame, EndFrame):
                self.end = frame
                return
            mark = (frame.revision, 0.0 if frame.denoised else float(frame.samples.sum()))
            if self._seen.get((frame.x, frame.y, frame.denoised)) != mark:
                self._seen[frame.x, frame.y, frame.denoised] = mark
                yield frame


class TileImage:
    """The image so far: arrays over the job's crop, into which tiles are put.

    mean, variance: (height, width, 3); samples, alpha: (height, width). Pixels that no tile has
    covered yet are NaN, with 0 samples. x, y: corner of the crop in pixels of the full film.
    """

    def __init__(self, width: int, height: int, x: int = 0, y: int = 0) -> None:
        self.x, self.y, self.width, self.height = x, y, width, height
        self.mean: FloatArray = np.full((height, width, 3), np.nan, dtype=np.float32)
        self.variance: FloatArray = np.full((height, width, 3), np.nan, dtype=np.float32)
        self.samples: FloatArray = np.zeros((height, width), dtype=np.float32)
        self.alpha: FloatArray = np.ones((height, width), dtype=np.float32)

    def put(self, tile: Tile) -> None:
        left, top = tile.x - self.x, tile.y - self.y
        if left < 0 or top < 0 or left + tile.width > self.width or top + tile.height > self.height:
            raise ValueError(f"the tile at {tile.x}, {tile.y} reaches beyond the image")
        part = (slice(top, top + tile.height), slice(left, left + tile.width))
        self.mean[part] = tile.mean
        self.variance[part] = tile.variance
        self.samples[part] = tile.samples
        if tile.alpha is not None:
            self.alpha[part] = tile.alpha

    @property
    def complete(self) -> bool:
        """Returns whether every pixel has a sample."""
        return bool((self.samples > 0).all())

    def _repr_png_(self) -> bytes:
        return encode_png(srgb8(self.mean))
