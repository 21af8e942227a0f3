# Written by clients/synchronous.py from async_job.py: do not edit.
"""Job: a render job on the server, with calls that wait."""

from __future__ import annotations

import time
from collections.abc import Generator
from contextlib import ExitStack, suppress
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
    from ._client import Client


class Job(JobData):
    """A job, with the data (state, progress, error, ...) of the last response or event.

    Comes from `Client.submit`, `Client.job` or `Client.jobs`.
    """

    def __init__(self, client: Client, data: Json) -> None:
        super().__init__(data)
        self._client = client

    # State and events.

    def refresh(self) -> Job:
        """Requests the current state of the job."""
        return self._take(self.look_call())

    def wait(self, timeout: float | None = None, *, check: bool = True) -> Job:
        """Waits until the job has ended, even through restarts of the server.

        timeout: seconds; then WaitTimeout. check: raise JobFailed if it failed. A cancelled job is
        returned like a finished one: it keeps its image so far.
        """
        deadline = None if timeout is None else time.monotonic() + timeout
        while not self.ended:
            left = float(LONG_POLL_S) if deadline is None else deadline - time.monotonic()
            if left <= 0:
                raise WaitTimeout(f"job {self.id} is {self.state} after {timeout} s")
            self._take(self.look_call(left), patient=True)
        if check:
            self.raise_if_failed()
        return self

    def events(self, last_event_id: str | None = None) -> Generator[Event, None, None]:
        """Yields the job's events until its end. Resumes interrupted connections.

        last_event_id: resumes after this event. The job itself is kept up to date. Raises
        ConnectionFailed when the server is unreachable for `Retry.patience_s`.
        """
        feed = EventFeed(self.path, last_event_id)
        comeback = Comeback(self._client.retry, self._client.server)
        while True:
            broken: Exception | None = None
            try:
                with self._client.stream(feed.call()) as response:
                    if response.status_code == 204:
                        return  # last_event_id was the end
                    for piece in response.iter_bytes():
                        for event in feed.take(piece):
                            self.apply(event)
                            if feed.ended:
                                self.refresh()  # the event omits the progress
                            yield event
                        if feed.ended:
                            return
                        if not feed.refused:
                            comeback.contact()
            except Exception as error:
                broken = error
            time.sleep(feed.pause_s(comeback.pause_s(broken)))

    def tiles(self, after: int = 0, denoise: str = "off") -> Generator[Tile, None, None]:
        """Yields tiles as they arrive, until the job's end; includes every tile of the final image.

        after: only tiles newer than this revision. denoise: mixed or full for tiles of the denoised
        image too. A slow reader gets the newest state of a tile, not a backlog.
        """
        feed = TileFeed(self.path, after, self._client.compressed, denoise)
        comeback = Comeback(self._client.retry, self._client.server)
        while True:
            broken: Exception | None = None
            try:
                with self._client.stream(feed.call()) as response:
                    comeback.contact()
                    for piece in response.iter_bytes():
                        yield from feed.take(piece)
                        if feed.end is not None:
                            return
            except Exception as error:
                broken = error
            time.sleep(comeback.pause_s(broken))

    # The image.

    def image(
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
        response = self._client.send(self.picture_call("tif", options))
        return decode_tiff(response.content)

    def picture(self, format: str = "png", **options: Any) -> bytes:
        """Returns the bytes of an image file: png, jpg, webp, avif, exr, hdr or tif.

        options: layer (by default beauty, or all layers for exr), exposure (stops, or auto),
        tonemap (srgb, linear, aces, agx, khronos-neutral), white_balance (kelvin of the light that
        is shown as white), contrast (stops for each stop), bits (16: of a png), denoise (off,
        mixed, full), revision (at least), part, max_size, parts (1: one part of an exr per layer).
        """
        response = self._client.send(self.picture_call(format, options))
        return response.content

    def save(self, path: str | PathLike[str], **options: Any) -> Path:
        """Writes the image; the extension determines the format. options: see picture()."""
        place = Path(path)
        format = place.suffix[1:].lower()
        if format not in FORMATS:
            raise ValueError(f"{place}: the name must end in one of {', '.join(FORMATS)}")
        content = self.picture(format, **options)
        place.write_bytes(content)
        return place

    def film(self, path: str | PathLike[str]) -> Path:
        """Writes the film, the raw sums of a job that has ended: for merge(), here or elsewhere."""
        place = Path(path)
        with self._client.stream(self.film_call()) as response, ExitStack() as stack:
            file = stack.enter_context(place.open("wb"))
            for piece in response.iter_bytes():
                file.write(piece)
        return place

    def pixels(self, x: int, y: int) -> Pixel:
        """Returns one pixel with its intervals; x, y in pixels of the full film."""
        return Pixel.of(self._client.ask(Call("GET", f"{self.path}/pixels/{x}/{y}")))

    def convergence(self) -> Convergence:
        """Returns the error over samples and time."""
        return Convergence.of(self._client.ask(Call("GET", self.path + "/convergence")))

    def meter(self) -> Meter:
        """Returns the current readings of the job's meter."""
        return Meter.of(self._client.ask(Call("GET", self.path + "/meter")))

    def objects(self) -> models.SceneObjects:
        """Returns the meaning of the layers' ids (glTF paths, names, boxes) and the camera."""
        data: models.SceneObjects = self._client.ask(Call("GET", self.path + "/objects"))
        return data

    # Changes.

    def extend(self, **stop: Any) -> Job:
        """Extends a finished job: samples_per_pixel, relative_error, seconds, deadline, ..."""
        return self._take(self.extend_call(stop))

    def cancel(self) -> Job:
        """Cancels the job; the image so far is kept. Cancelling twice is not an error."""
        return self._take(self.cancel_call())

    def retry(self) -> Job:
        """Queues a failed job again: it resumes from its last checkpoint, if it has one."""
        return self._take(self.retry_call())

    def pause(self) -> Job:
        return self.update(paused=True)

    def resume(self) -> Job:
        return self.update(paused=False)

    def update(self, **changes: Any) -> Job:
        """A merge patch of priority, labels, name, stop, paused: None removes a label or a rule."""
        return self._take(self.patch_call(changes))

    def delete(self) -> None:
        """Deletes the job and its files. Conflict while it runs."""
        self._client.send(Call("DELETE", self.path))

    # Notebooks.

    def show(self, refresh_s: float = 1.0) -> None:
        """Draws the job in a notebook and keeps it up to date until it ends.

        Returns nothing, so that a notebook draws it only once.
        """
        page = display.Page()
        page.show(self._repr_html_())
        drawn = time.monotonic()
        for event in self.events():
            if event.type == "end" or time.monotonic() - drawn >= refresh_s:
                page.show(self._repr_html_())
                drawn = time.monotonic()

    def _repr_html_(self) -> str:
        return display.job_html(self, self._repr_png_())

    def _repr_png_(self) -> bytes | None:
        with suppress(Conflict, Gone):  # nothing rendered yet; evicted
            return self.picture("png", max_size=display.PICTURE_PX)
        return None

    def _take(self, call: Call, *, patient: bool = False) -> Job:
        self.data = self._client.ask(call, patient=patient)
        return self
