"""Data of a job, independent of the connection: shared by Job and AsyncJob."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from ._wire import LONG_POLL_S, Call, Json
from .errors import JobFailed
from .events import Event
from .results import ErrorBar, Progress
from .tiles import TileImage

FINAL_STATES = frozenset({"finished", "failed", "cancelled"})
FORMATS = {
    "png": "png",
    "jpg": "jpg",
    "jpeg": "jpg",
    "webp": "webp",
    "avif": "avif",
    "exr": "exr",
    "hdr": "hdr",
    "tif": "tif",
    "tiff": "tif",
}
LINEAR = ("exr", "hdr", "tif")


class JobData:
    """The latest known data of a job, from the last response or event; makes no request."""

    def __init__(self, data: Json) -> None:
        self.data: Json = data

    @property
    def id(self) -> str:
        return str(self.data["id"])

    @property
    def path(self) -> str:
        return f"/v1/jobs/{self.id}"

    @property
    def state(self) -> str:
        """queued, loading, rendering, paused, finished, failed or cancelled."""
        return str(self.data.get("state", ""))

    @property
    def ended(self) -> bool:
        return self.state in FINAL_STATES

    @property
    def stop_reason(self) -> str | None:
        """The rule of `stop` that ended it, or limit, cancelled, failed; None before the end."""
        reason = self.data.get("stop_reason")
        return None if reason is None else str(reason)

    @property
    def spec(self) -> dict[str, Any]:
        """The request with all defaults filled in."""
        return dict(self.data.get("spec") or {})

    @property
    def name(self) -> str:
        return str(self.spec.get("name", ""))

    @property
    def labels(self) -> dict[str, str]:
        return dict(self.spec.get("labels") or {})

    @property
    def progress(self) -> Progress:
        return Progress.of(self.data.get("progress") or {})

    @property
    def error(self) -> ErrorBar:
        return ErrorBar.of(self.data.get("error") or {})

    @property
    def pause_reason(self) -> str | None:
        """Of a paused job: "requested", or "storage_full", after which it resumes by itself."""
        reason = self.data.get("pause_reason")
        return None if reason is None else str(reason)

    @property
    def failure(self) -> dict[str, Any] | None:
        return self.data.get("failure")

    @property
    def statistics(self) -> dict[str, Any]:
        """rays, rays_per_second, efficiency, rejected_samples, peak_bytes, split_count,
        radius_ratio."""
        return dict(self.data.get("statistics") or {})

    @property
    def revision(self) -> int:
        return int(self.data.get("revision") or 0)

    @property
    def available(self) -> list[str]:
        """Parts that can be requested now: image, denoised, meter."""
        return list(self.data.get("available") or [])

    @property
    def film_digest(self) -> str | None:
        """sha256 of the film's exact content, once finished."""
        digest = self.data.get("film_digest")
        return None if digest is None else str(digest)

    @property
    def doubted(self) -> bool:
        """A worker that rendered parts of the image unchecked returned wrong results later."""
        return bool(self.data.get("doubted"))

    @property
    def merged(self) -> bool:
        """Merged from samples that no single job renders: it cannot be extended or retried."""
        return bool(self.data.get("merged"))

    @property
    def warnings(self) -> list[str]:
        return list(self.data.get("warnings") or [])

    @property
    def warning_details(self) -> list[dict[str, str]]:
        """Warnings about the scene's file: `code`, `pointer` and `detail`."""
        return list(self.data.get("warning_details") or [])

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the image, or of the crop if there is one."""
        _, _, width, height = self._crop()
        return width, height

    def tile_image(self) -> TileImage:
        """Returns an empty image of the job's size, into which tiles can be put."""
        x, y, width, height = self._crop()
        return TileImage(width, height, x, y)

    def _crop(self) -> tuple[int, int, int, int]:
        film = self.spec["film"] or {"width": 0, "height": 0}  # only a meter
        crop = film.get("crop") or {"x": 0, "y": 0} | film
        return crop["x"], crop["y"], crop["width"], crop["height"]

    def apply(self, event: Event) -> None:
        """Updates the data from an event."""
        if event.type == "snapshot":
            self.data = event.data
        elif event.type in ("state", "progress", "end"):
            self.data = self.data | event.data
        elif event.type == "warning":
            # A resumed stream may repeat what the snapshot contained.
            told = {*self.warnings, None}
            if event.data.get("message") not in told:
                self.data = self.data | {"warnings": [*self.warnings, event.data["message"]]}

    def raise_if_failed(self) -> None:
        if self.state == "failed":
            raise JobFailed(self.id, self.failure or {})

    def look_call(self, wait_s: float = 0) -> Call:
        """GET of the job; wait_s: waits for its end, at most this long."""
        if wait_s <= 0:
            return Call("GET", self.path)
        wait_s = min(wait_s, LONG_POLL_S)
        return Call("GET", self.path, params={"wait": round(wait_s, 3)}, timeout_s=wait_s + 30)

    def patch_call(self, changes: Mapping[str, Any]) -> Call:
        return Call("PATCH", self.path, json=dict(changes))

    def cancel_call(self) -> Call:
        return Call("POST", self.path + "/cancel")

    def retry_call(self) -> Call:
        # Not repeated: a second one would be refused, because the job is queued.
        return Call("POST", self.path + "/retry", repeatable=False)

    def extend_call(self, stop: Mapping[str, Any]) -> Call:
        # Not repeated: a second one would be refused, because the job is running.
        return Call("POST", self.path + "/extend", json={"stop": dict(stop)}, repeatable=False)

    def picture_call(self, format: str, options: Mapping[str, Any]) -> Call:
        """options: layer, exposure, tonemap, denoise, revision, max_size, part; not None."""
        if format not in FORMATS:
            raise ValueError(f'"{format}" is no image format; there are {", ".join(FORMATS)}')
        params = {name: value for name, value in options.items() if value is not None}
        if FORMATS[format] in LINEAR:
            for name, plain in (("exposure", (0,)), ("tonemap", ("srgb", "linear"))):
                if params.get(name, plain[0]) not in plain:
                    raise ValueError(f"{name} is for png, jpg, webp and avif; {format} is linear")
        if "part" in params:
            params |= zip(("x", "y", "width", "height"), params.pop("part"), strict=True)
        headers = {"Accept": "*/*"}
        return Call(
            "GET", f"{self.path}/image.{FORMATS[format]}", params=params, headers=headers,
            timeout_s=120,
        )  # fmt: skip

    def film_call(self) -> Call:
        return Call("GET", self.path + "/film", headers={"Accept": "*/*"}, timeout_s=600)

    def __repr__(self) -> str:
        return f"<{type(self).__name__} {self.id} {self.state} {self.progress.fraction:.0%}>"
