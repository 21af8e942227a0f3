"""Videos of images, written by ffmpeg."""

from __future__ import annotations

import contextlib
import shutil
import subprocess
import tempfile
from os import PathLike
from pathlib import Path
from typing import Any

from .errors import FfmpegFailed


class VideoWriter:
    """A context in which add() appends frames; a file that could not be completed is removed."""

    def __init__(self, path: str | PathLike[str], fps: float) -> None:
        program = shutil.which("ffmpeg")
        if program is None:
            raise FfmpegFailed("a video needs ffmpeg, which is not on the PATH")
        self._path = Path(path)
        # fmt: off
        self._command = [
            program, "-hide_banner", "-loglevel", "error", "-y",
            "-f", "image2pipe", "-framerate", str(fps), "-c:v", "png", "-i", "-",
            # Players want even sides and chroma of half the resolution.
            "-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", f"file:{self._path}",
        ]
        # fmt: on

    def __enter__(self) -> VideoWriter:
        self._errors = tempfile.TemporaryFile()  # A pipe that nobody reads could fill up.
        self._process = subprocess.Popen(
            self._command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=self._errors
        )
        return self

    def add(self, png: bytes) -> None:
        """Appends a frame. If ffmpeg has ended, the end of the context raises FfmpegFailed."""
        assert self._process.stdin is not None
        with contextlib.suppress(BrokenPipeError):
            self._process.stdin.write(png)

    def __exit__(self, kind: type[BaseException] | None, *_: Any) -> None:
        assert self._process.stdin is not None
        with self._errors:
            if kind is not None:
                self._process.kill()
            with contextlib.suppress(BrokenPipeError):
                self._process.stdin.close()
            code = self._process.wait()
            self._errors.seek(0)
            said = self._errors.read().decode(errors="replace").strip()
        if code != 0:
            self._path.unlink(missing_ok=True)
            if kind is None:
                raise FfmpegFailed(f"ffmpeg failed: {said or f'exit code {code}'}")
