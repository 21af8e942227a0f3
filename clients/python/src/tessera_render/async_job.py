"""AsyncJob: a render job on the server, with calls to be awaited."""

from __future__ import annotations

import asyncio
import time
from collections.abc import AsyncGenerator
from contextlib import AsyncExitStack, suppress
from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

from . import display, models
from ._job_data import FORMATS, JobData
from ._wire import LONG_POLL_S, Call, Comeback, Json
from .errors import Conflict, Gone, WaitTimeout
from .events import Event, EventFeed
from .results import Convergence, Meter, Pixel
from .tiff import decode_tiff
from .tiles import FloatArray, Tile, TileFeed

if TYPE_CHECKING:
    from .async_client import AsyncClient


class AsyncJob(JobData):
    """A job, with the data (state, progress, error, ...) of the last response or event.

    Comes from `AsyncClient.submit`, `AsyncClient.job` or `AsyncClient.jobs`.
    """

    def __init__(self, client: AsyncClient, data: Json) -> None:
        super().__init__(data)
        self._client = client

    # State and events.

    async def refresh(self) -> AsyncJob:
        """Requests the current state of the job."""
        return await self._take(self.look_call())

    async def wait(self, timeout: float | None = None, *, check: bool = True) -> AsyncJob:
        """Waits until the job has ended, even through restarts of the server.

        timeout: seconds; then WaitTimeout. check: raise JobFailed if it failed. A cancelled job is
        returned like a finished one: it keeps its image so far.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self.ended:
            left = float(LONG_POLL_S) if deadline is None else deadline - time.monotonic()
            if left <= 0:
                raise WaitTimeout(f"job {self.id} is {self.state} after {timeout} s")
            await self._take(self.look_call(left), patient=True)
        if check:
            self.raise_if_failed()
        return self

    async def events(self, last_event_id: str | None = None) -> AsyncGenerator[Event, None]:
        """Yields the job's events until its end. Resumes interrupted connections.

        last_event_id: resumes after this event. The job itself is kept up to date. Raises
        ConnectionFailed when the server is unreachable for `Retry.patience_s`.
        """
        feed = EventFeed(self.path, last_event_id)
        comeback = Comeback(self._client.retry, self._client.server)
        while True:
            broken: Exception | None = None
            try:
                async with self._client.stream(feed.call()) as response:
                    if response.status_code == 204:
                        return  # last_event_id was the end
                    async for piece in response.aiter_bytes():
                        for event in feed.take(piece):
                            self.apply(event)
                            if feed.ended:
                                await self.refresh()  # the event omits the progress
                            yield event
                        if feed.ended:
                            return
                        if not feed.refused:
                            comeback.contact()
            except Exception as error:
                broken = error
            await asyncio.sleep(feed.pause_s(comeback.pause_s(broken)))

    async def tiles(self, after: int = 0, denoise: str = "off") -> AsyncGenerator[Tile, None]:
        """Yields tiles as they arrive, until the job's end; includes every tile of the final image.

        after: only tiles newer than this revision. denoise: mixed or full for tiles of the denoised
        image too. A slow reader gets the newest state of a tile, not a backlog.
        """
        feed = TileFeed(self.path, after, self._client.compressed, denoise)
        comeback = Comeback(self._client.retry, self._client.server)
        while True:
            broken: Exception | None = None
            try:
                async with self._client.stream(feed.call()) as response:
                    comeback.contact()
                    async for piece in response.aiter_bytes():
                        for tile in feed.take(piece):
                            yield tile
                        if feed.end is not None:
                            return
            except Exception as error:
                broken = error
            await asyncio.sleep(comeback.pause_s(broken))

    # The image.

    async def image(
        self, layer: str = "beauty", *, part: tuple[int, int, int, int] | None = None,
        max_size: int | None = None, denoise: str | None = None,
    ) -> FloatArray:  # fmt: skip
        """Returns the current values of a layer: float32, linear, (height, width[, channels]).

        layer: beauty (RGB; RGBA with an environment that is not visible), albedo, normal, depth
        [m], alpha, samples, variance (of the mean), error (relative), if the job records them;
        denoised, denoised_error, denoise_bias; object, instance, material, primitive (ids, see
        objects()), position [m], uv, motion [pixels]. part: x, y, width, height in pixels of the
        full film. max_size: longest side. denoise: mixed or full for the denoised image. Raises
        Conflict before the first sample.
        """
        options = {"layer": layer, "part": part, "max_size": max_size, "denoise": denoise}
        response = await self._client.send(self.picture_call("tif", options))
        return decode_tiff(response.content)

    async def picture(self, format: str = "png", **options: Any) -> bytes:
        """Returns the bytes of an image file: png, jpg, webp, avif, exr, hdr or tif.

        options: layer (by default beauty, or all layers for exr), exposure (stops, or auto),
        tonemap (srgb, linear, aces, agx, khronos-neutral), white_balance (kelvin of the light that
        is shown as white), contrast (stops for each stop), bits (16: of a png), denoise (off,
        mixed, full), revision (at least), part, max_size, parts (1: one part of an exr per layer).
        """
        response = await self._client.send(self.picture_call(format, options))
        return response.content

    async def save(self, path: str | PathLike[str], **options: Any) -> Path:
        """Writes the image; the extension determines the format. options: see picture()."""
        place = Path(path)
        format = place.suffix[1:].lower()
        if format not in FORMATS:
            raise ValueError(f"{place}: the name must end in one of {', '.join(FORMATS)}")
        content = await self.picture(format, **options)
        await asyncio.to_thread(place.write_bytes, content)
        return place

    async def film(self, path: str | PathLike[str]) -> Path:
        """Writes the film, the raw sums of a job that has ended: for merge(), here or elsewhere."""
        place = Path(path)
        async with self._client.stream(self.film_call()) as response, AsyncExitStack() as stack:
            file = stack.enter_context(await asyncio.to_thread(place.open, "wb"))
            async for piece in response.aiter_bytes():
                await asyncio.to_thread(file.write, piece)
        return place

    async def pixels(self, x: int, y: int) -> Pixel:
        """Returns one pixel with its intervals; x, y in pixels of the full film."""
        return Pixel.of(await self._client.ask(Call("GET", f"{self.path}/pixels/{x}/{y}")))

    async def convergence(self) -> Convergence:
        """Returns the error over samples and time."""
        return Convergence.of(await self._client.ask(Call("GET", self.path + "/convergence")))

    async def meter(self) -> Meter:
        """Returns the current readings of the job's meter."""
        return Meter.of(await self._client.ask(Call("GET", self.path + "/meter")))

    async def objects(self) -> models.SceneObjects:
        """Returns the meaning of the layers' ids (glTF paths, names, boxes) and the camera."""
        data: models.SceneObjects = await self._client.ask(Call("GET", self.path + "/objects"))
        return data

    # Changes.

    async def extend(self, **stop: Any) -> AsyncJob:
        """Extends a finished job: samples_per_pixel, relative_error, seconds, deadline, ..."""
        return await self._take(self.extend_call(stop))

    async def cancel(self) -> AsyncJob:
        """Cancels the job; the image so far is kept. Cancelling twice is not an error."""
        return await self._take(self.cancel_call())

    async def retry(self) -> AsyncJob:
        """Queues a failed job again: it resumes from its last checkpoint, if it has one."""
        return await self._take(self.retry_call())

    async def pause(self) -> AsyncJob:
        return await self.update(paused=True)

    async def resume(self) -> AsyncJob:
        return await self.update(paused=False)

    async def update(self, **changes: Any) -> AsyncJob:
        """A merge patch of priority, labels, name, stop, paused: None removes a label or a rule."""
        return await self._take(self.patch_call(changes))

    async def delete(self) -> None:
        """Deletes the job and its files. Conflict while it runs."""
        await self._client.send(Call("DELETE", self.path))

    # Notebooks.

    async def show(self, refresh_s: float = 1.0) -> None:
        """Draws the job in a notebook and keeps it up to date until it ends.

        Returns nothing, so that a notebook draws it only once.
        """
        page = display.Page()
        page.show(await self._html())
        drawn = time.monotonic()
        async for event in self.events():
            if event.type == "end" or time.monotonic() - drawn >= refresh_s:
                page.show(await self._html())
                drawn = time.monotonic()

    def _repr_html_(self) -> str:
        # A notebook does not await, so only show() draws the image.
        return display.job_html(self, None)

    async def _html(self) -> str:
        return display.job_html(self, await self._png())

    async def _png(self) -> bytes | None:
        with suppress(Conflict, Gone):  # nothing rendered yet; evicted
            return await self.picture("png", max_size=display.PICTURE_PX)
        return None

    async def _take(self, call: Call, *, patient: bool = False) -> AsyncJob:
        self.data = await self._client.ask(call, patient=patient)
        return self
