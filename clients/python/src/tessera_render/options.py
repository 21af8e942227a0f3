"""The options of a job, and the request made from them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, TypedDict

from ._wire import Json


class JobOptions(TypedDict, total=False):
    """The options of `submit` besides the scene; omitted ones have the server's defaults.

    Short forms: size, crop, layers, samples_per_pixel, relative_error, denoised_error, meter_error,
    light_not_found, confidence, scope, seconds, cpu_seconds and deadline go into `film` and `stop`;
    integrator, sampler, light_sampler, adaptive, background and ground may be the name of a type,
    camera a name or an index, environment the path of an .hdr or .exr file. All other members are
    those of the request (described at the server's `/docs`). `request` is a whole request, which
    the options override: use it for members that are not listed here.
    """

    name: str
    labels: Mapping[str, str]
    priority: int
    seed: int
    camera: str | int | Mapping[str, Any] | None  # None: the scene's own
    environment: str | Path | Mapping[str, Any] | None
    variant: str | None
    time_seconds: float | None
    shutter_seconds: float
    motion_seconds: float
    medium: Mapping[str, Any] | None
    background: str | Mapping[str, Any]
    ground: str | Mapping[str, Any]
    job_class: str  # the member `class`
    preview_key: str | None
    integrator: str | Mapping[str, Any]
    estimator: Mapping[str, Any]
    sampler: str | Mapping[str, Any]
    light_sampler: str | Mapping[str, Any]
    adaptive: str | Mapping[str, Any]
    spectral: bool
    film: Mapping[str, Any] | None  # None: no image, only a meter
    meter: Mapping[str, Any] | None
    size: tuple[int, int] | str  # width and height, or "960x540"
    crop: Mapping[str, int] | tuple[int, int, int, int]  # x, y, width, height
    layers: Sequence[str]
    stop: Mapping[str, Any]
    samples_per_pixel: int
    relative_error: float
    denoised_error: float
    meter_error: float
    light_not_found: float
    confidence: float
    scope: str
    seconds: float
    cpu_seconds: float
    deadline: str
    request: Mapping[str, Any]


_STOP = (
    "samples_per_pixel",
    "relative_error",
    "denoised_error",
    "meter_error",
    "light_not_found",
    "confidence",
    "scope",
    "seconds",
    "cpu_seconds",
    "deadline",
)
_TYPED = ("integrator", "sampler", "light_sampler", "adaptive", "background", "ground")


def stop_rules(options: Mapping[str, Any]) -> Json:
    """Returns {"stop": ...} with the rules among the options."""
    return {name: options[name] for name in _STOP if name in options}


def _width_and_height(size: Any) -> tuple[Any, Any]:
    """Only checks that there are two numbers; the server checks their values."""
    pair = size.lower().split("x") if isinstance(size, str) else size
    try:
        width, height = pair
        return (int(width), int(height)) if isinstance(size, str) else (width, height)
    except (TypeError, ValueError):
        raise ValueError(f'size is (960, 540) or "960x540", not {size!r}') from None


def make_request(scene_id: str, options: Mapping[str, Any]) -> Json:
    """Returns the body of POST /v1/jobs. The server checks unknown names."""
    given = dict(options)
    body: Json = dict(given.pop("request", None) or {})
    body["scene"] = scene_id
    has_image = given.get("film", body.get("film", {})) is not None
    film: Json = dict(body.get("film") or {}) | dict(given.pop("film", None) or {})
    if "size" in given:
        film["width"], film["height"] = _width_and_height(given.pop("size"))
    if "crop" in given:
        crop = given.pop("crop")
        film["crop"] = (
            dict(zip(("x", "y", "width", "height"), crop, strict=True))
            if isinstance(crop, tuple)
            else crop
        )
    if "layers" in given:
        film["layers"] = list(given.pop("layers"))
    stop: Json = dict(body.get("stop") or {}) | dict(given.pop("stop", None) or {})
    stop |= stop_rules(given)
    for name in _STOP:
        given.pop(name, None)
    body |= {name: part for name, part in (("film", film), ("stop", stop)) if part}
    if not has_image:
        if film:
            raise ValueError(f"film is None: there is no image for {', '.join(film)}")
        body["film"] = None
    if "job_class" in given:
        body["class"] = given.pop("job_class")
    if "camera" in given:
        camera = given.pop("camera")
        if isinstance(camera, str):
            camera = {"name": camera}
        elif isinstance(camera, int):
            camera = {"index": camera}
        if camera is not None:
            body["camera"] = camera
    for name in _TYPED:
        if isinstance(given.get(name), str):
            body[name] = {"type": given.pop(name)}
    return body | given
