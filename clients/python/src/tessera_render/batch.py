# Written by clients/synchronous.py from async_batch.py: do not edit.
"""Batch: jobs that were submitted together, with calls that wait."""

from __future__ import annotations

import time
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import models
from ._video import VideoWriter
from ._wire import Call, segment
from .errors import WaitTimeout

if TYPE_CHECKING:
    from ._client import Client
    from .job import Job

_LOOK_S = 0.5


class Batch:
    """A batch of jobs, with the data of the last response; `data` holds all of it.

    Comes from `Client.submit_batch`, `Client.batch` or `Client.batches`.
    """

    def __init__(self, client: Client, data: models.Batch) -> None:
        self._client = client
        self.data = data

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id} {self.state}>"

    @property
    def id(self) -> str:
        return self.data["id"]

    @property
    def path(self) -> str:
        return f"/v1/batches/{segment(self.id)}"

    @property
    def state(self) -> str:
        """queued, rendering, paused, failed, cancelled or finished."""
        return self.data["state"]

    @property
    def ended(self) -> bool:
        return self.state in ("failed", "cancelled", "finished")

    @property
    def fraction(self) -> float:
        """Completed fraction of all jobs."""
        return self.data["progress"]["fraction"]

    def refresh(self) -> Batch:
        """Requests the current state of the batch."""
        return self._take(Call("GET", self.path))

    def wait(self, timeout: float | None = None, *, check: bool = True) -> Batch:
        """Waits until all jobs have ended, even through restarts of the server.

        timeout: seconds; then WaitTimeout. check: raise JobFailed for the first failed job.
        """
        began = time.monotonic()
        while not self.ended:
            if timeout is not None and time.monotonic() - began > timeout:
                raise WaitTimeout(f"batch {self.id} is {self.state} after {timeout} s")
            time.sleep(_LOOK_S)
            self._take(Call("GET", self.path), patient=True)
        for each in self.data["jobs"] if check else []:
            if each["state"] == "failed":
                job = self._client.job(each["id"])
                job.raise_if_failed()
        return self

    def jobs(self) -> list[Job]:
        """Returns the current jobs in the order of the matrix."""
        self.refresh()
        return [self._client.job(job["id"]) for job in self.data["jobs"]]

    def cancel(self) -> Batch:
        """Cancels all jobs; images so far are kept."""
        return self._take(Call("POST", self.path + "/cancel"))

    def retry(self) -> Batch:
        """Queues the failed jobs again. Conflict if none has failed."""
        return self._take(Call("POST", self.path + "/retry"))

    def delete(self) -> None:
        """Deletes the batch with its jobs and their files. Conflict while one runs."""
        self._client.send(Call("DELETE", self.path))

    def archive(self, path: str | PathLike[str], format: str = "png", **look: Any) -> Path:
        """Writes a zip of all images. look: layer, exposure, tonemap, denoise, background."""
        call = Call("GET", self.path + "/archive.zip", params=look | {"format": format})
        return self._save(call, path)

    def sheet(self, path: str | PathLike[str], **look: Any) -> Path:
        """Writes a PNG of all images on one sheet. look: as for archive()."""
        return self._save(Call("GET", self.path + "/sheet.png", params=look), path)

    def video(self, path: str | PathLike[str], fps: float = 24, **look: Any) -> Path:
        """Writes the finished images as the frames of a video (.mp4, .webm); needs ffmpeg.

        Without ffmpeg it raises FfmpegFailed before it downloads anything. look: exposure,
        tonemap, denoise ("video" for frames that hold still), background (white, for a video has no
        alpha).
        """
        params = {"background": "ffffff"} | look
        with VideoWriter(path, fps) as writer:
            for each in self.data["jobs"]:
                if each["state"] == "finished":
                    call = Call("GET", f"/v1/jobs/{segment(each['id'])}/image.png", params=params)
                    response = self._client.send(call)
                    if params.get("exposure") == "auto":
                        # All frames get that of the first, so that the video does not flicker.
                        params["exposure"] = response.headers["X-Tessera-Exposure"]
                    writer.add(response.content)
        return Path(path)

    def _save(self, call: Call, path: str | PathLike[str]) -> Path:
        place = Path(path)
        # Many images take a while before the first byte.
        response = self._client.send(
            Call(call.method, call.path, params=call.params, timeout_s=600)
        )
        place.write_bytes(response.content)
        return place

    def _take(self, call: Call, *, patient: bool = False) -> Batch:
        self.data = self._client.ask(call, patient=patient)
        return self
