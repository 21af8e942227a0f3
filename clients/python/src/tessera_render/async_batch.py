"""AsyncBatch: jobs that were submitted together, with calls to be awaited."""

from __future__ import annotations

import asyncio
import time
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import models
from ._video import VideoWriter
from ._wire import Call, segment
from .errors import WaitTimeout

if TYPE_CHECKING:
    from .async_client import AsyncClient
    from .async_job import AsyncJob

_LOOK_S = 0.5


class AsyncBatch:
    """A batch of jobs, with the data of the last response; `data` holds all of it.

    Comes from `AsyncClient.submit_batch`, `AsyncClient.batch` or `AsyncClient.batches`.
    """

    def __init__(self, client: AsyncClient, data: models.Batch) -> None:
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

    async def refresh(self) -> AsyncBatch:
        """Requests the current state of the batch."""
        return await self._take(Call("GET", self.path))

    async def wait(self, timeout: float | None = None, *, check: bool = True) -> AsyncBatch:
        """Waits until all jobs have ended, even through restarts of the server.

        timeout: seconds; then WaitTimeout. check: raise JobFailed for the first failed job.
        """
        began = time.monotonic()
        while not self.ended:
            if timeout is not None and time.monotonic() - began > timeout:
                raise WaitTimeout(f"batch {self.id} is {self.state} after {timeout} s")
            await asyncio.sleep(_LOOK_S)
            await self._take(Call("GET", self.path), patient=True)
        for each in self.data["jobs"] if check else []:
            if each["state"] == "failed":
                job = await self._client.job(each["id"])
                job.raise_if_failed()
        return self

    async def jobs(self) -> list[AsyncJob]:
        """Returns the current jobs in the order of the matrix."""
        await self.refresh()
        return [await self._client.job(job["id"]) for job in self.data["jobs"]]

    async def cancel(self) -> AsyncBatch:
        """Cancels all jobs; images so far are kept."""
        return await self._take(Call("POST", self.path + "/cancel"))

    async def retry(self) -> AsyncBatch:
        """Queues the failed jobs again. Conflict if none has failed."""
        return await self._take(Call("POST", self.path + "/retry"))

    async def delete(self) -> None:
        """Deletes the batch with its jobs and their files. Conflict while one runs."""
        await self._client.send(Call("DELETE", self.path))

    async def archive(self, path: str | PathLike[str], format: str = "png", **look: Any) -> Path:
        """Writes a zip of all images. look: layer, exposure, tonemap, denoise, background."""
        call = Call("GET", self.path + "/archive.zip", params=look | {"format": format})
        return await self._save(call, path)

    async def sheet(self, path: str | PathLike[str], **look: Any) -> Path:
        """Writes a PNG of all images on one sheet. look: as for archive()."""
        return await self._save(Call("GET", self.path + "/sheet.png", params=look), path)

    async def video(self, path: str | PathLike[str], fps: float = 24, **look: Any) -> Path:
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
                    response = await self._client.send(call)
                    if params.get("exposure") == "auto":
                        # All frames get that of the first, so that the video does not flicker.
                        params["exposure"] = response.headers["X-Tessera-Exposure"]
                    await asyncio.to_thread(writer.add, response.content)
        return Path(path)

    async def _save(self, call: Call, path: str | PathLike[str]) -> Path:
        place = Path(path)
        # Many images take a while before the first byte.
        response = await self._client.send(
            Call(call.method, call.path, params=call.params, timeout_s=600)
        )
        await asyncio.to_thread(place.write_bytes, response.content)
        return place

    async def _take(self, call: Call, *, patient: bool = False) -> AsyncBatch:
        self.data = await self._client.ask(call, patient=patient)
        return self
