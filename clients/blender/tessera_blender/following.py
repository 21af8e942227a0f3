"""Follows a job in a thread while Blender's own draws and looks for Esc. Needs no Blender."""

from __future__ import annotations

import threading

import numpy as np
from tessera_render import Job, TileImage
from tessera_render.results import ErrorBar


class Following(threading.Thread):
    """Puts a job's tiles into an image until its end; `fault` is what ended it early, or None."""

    def __init__(self, job: Job) -> None:
        super().__init__(daemon=True, name="tessera tiles")
        self._job, self._lock = job, threading.Lock()
        self._image: TileImage = job.tile_image()
        self._fresh = False
        self.fault: Exception | None = None

    def run(self) -> None:
        try:
            for tile in self._job.tiles():
                with self._lock:
                    self._image.put(tile)
                    self._fresh = True
        except Exception as fault:
            self.fault = fault

    def news(self) -> tuple[np.ndarray, np.ndarray] | None:
        """Mean and alpha if a tile has come since the last call."""
        with self._lock:
            if not self._fresh:
                return None
            self._fresh = False
            return self._image.mean.copy(), self._image.alpha.copy()


def status(job: Job, denoised: bool) -> str:
    """A line on the state of a job."""
    if job.state in ("queued", "loading"):
        return f"Tessera: {job.state}"
    told = [f"Tessera: {job.state}", f"error {job.error}"]
    hidden = job.data.get("denoised")
    if denoised and hidden:
        told.append(f"denoised: error {ErrorBar.of(hidden)}")
    samples = job.progress.samples_mean
    told.append(f"{samples:.0f} samples" if np.isfinite(samples) else "no sample yet")
    return " | ".join(told)
