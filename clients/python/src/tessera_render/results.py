"""Responses of the server as plain values. Unknown numbers (JSON null) are NaN."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from . import models

DoubleArray = npt.NDArray[np.float64]


def number(value: Any) -> float:
    return float(value) if isinstance(value, int | float) else math.nan


def numbers(values: Any) -> DoubleArray:
    return np.array([number(v) for v in values or ()], dtype=np.float64)


def triples(values: Sequence[Sequence[Any]]) -> DoubleArray:
    """Returns an array of shape (n, 3)."""
    return np.array([[number(v) for v in each] for each in values], dtype=np.float64).reshape(-1, 3)


@dataclass(frozen=True)
class Interval:
    """An estimate with its bounds: with 95% confidence unless stated otherwise."""

    value: float
    low: float
    high: float

    @staticmethod
    def of(data: Mapping[str, Any]) -> Interval:
        return Interval(
            number(data.get("value")), number(data.get("low")), number(data.get("high"))
        )


@dataclass(frozen=True)
class ErrorBar:
    """Error estimate of the current image: how far its average pixel is off, 0 to 1.

    relative is grain + doubt / 2. grain: relative difference of the halves, mean over the pixels.
    doubt: light that only one half has found. bias: `none`, `consistent` or `biased`. unreliable:
    doubt is above grain, so the interval may miss.
    """

    relative: float
    low: float
    high: float
    grain: float
    doubt: float
    confidence: float
    bias: str
    unreliable: bool

    @staticmethod
    def of(data: Mapping[str, Any]) -> ErrorBar:
        return ErrorBar(
            relative=number(data.get("relative")),
            low=number(data.get("low")),
            high=number(data.get("high")),
            grain=number(data.get("grain")),
            doubt=number(data.get("doubt")),
            confidence=number(data.get("confidence")),
            bias=str(data.get("bias", "none")),
            unreliable=bool(data.get("unreliable", False)),
        )

    @property
    def relative_rmse(self) -> float:
        """Deprecated: the same as `relative`; removed in version 2."""
        return self.relative

    def __str__(self) -> str:
        if math.isnan(self.relative):
            return "unknown"
        text = f"{self.relative:.2%}"
        if not (math.isnan(self.low) or math.isnan(self.high)):
            text += f" ({self.low:.2%} to {self.high:.2%})"
        return text + (", unreliable" if self.unreliable else "")


class SamplesPerPixel(NamedTuple):
    """Over the pixels of the crop."""

    min: int
    mean: float
    max: int


@dataclass(frozen=True)
class Progress:
    """fraction: 0 to 1, 1 only at the end. Times: seconds or NaN.

    eta_interval_seconds: lower and upper bound of eta_seconds at the current speed; NaN: unknown.
    """

    fraction: float
    samples_per_pixel: SamplesPerPixel
    elapsed_seconds: float
    cpu_seconds: float
    eta_seconds: float
    eta_interval_seconds: tuple[float, float]

    @property
    def samples_min(self) -> int:
        return self.samples_per_pixel.min

    @property
    def samples_mean(self) -> float:
        return self.samples_per_pixel.mean

    @property
    def samples_max(self) -> int:
        return self.samples_per_pixel.max

    @staticmethod
    def of(data: Mapping[str, Any]) -> Progress:
        samples = data.get("samples_per_pixel") or {}
        low, high = data.get("eta_interval_seconds") or (None, None)
        return Progress(
            fraction=float(data.get("fraction") or 0.0),
            samples_per_pixel=SamplesPerPixel(
                int(samples.get("min") or 0),
                float(samples.get("mean") or 0.0),
                int(samples.get("max") or 0),
            ),
            elapsed_seconds=number(data.get("elapsed_seconds")),
            cpu_seconds=number(data.get("cpu_seconds")),
            eta_seconds=number(data.get("eta_seconds")),
            eta_interval_seconds=(number(low), number(high)),
        )


@dataclass(frozen=True, eq=False)
class PixelLayer:
    """mean: one value per channel. standard_error, low, high: of the mean; NaN if unknown.

    halves: (2, channels), the means of the two independent halves of the samples; None if there are
    none.
    """

    mean: DoubleArray
    standard_error: DoubleArray
    low: DoubleArray
    high: DoubleArray
    halves: DoubleArray | None


@dataclass(frozen=True, eq=False)
class Pixel:
    x: int
    y: int
    samples: int
    layers: dict[str, PixelLayer]

    @property
    def beauty(self) -> PixelLayer:
        return self.layers["beauty"]

    @staticmethod
    def of(data: models.Pixel) -> Pixel:
        layers = {}
        for name, layer in data["layers"].items():
            halves = layer.get("halves")
            layers[name] = PixelLayer(
                mean=numbers(layer["mean"]),
                standard_error=numbers(layer["standard_error"]),
                low=numbers(layer["low"]),
                high=numbers(layer["high"]),
                halves=None if halves is None else np.stack([numbers(half) for half in halves]),
            )
        return Pixel(int(data["x"]), int(data["y"]), int(data["samples"]), layers)


@dataclass(frozen=True, eq=False)
class Convergence:
    """The error over the course of a job, one array element for each error check.

    slope: of log error over log samples; -0.5 is plain Monte Carlo.
    """

    samples_per_pixel: DoubleArray
    elapsed_seconds: DoubleArray
    cpu_seconds: DoubleArray
    rays: DoubleArray
    relative: DoubleArray
    low: DoubleArray
    high: DoubleArray
    grain: DoubleArray
    doubt: DoubleArray
    slope: Interval

    @property
    def relative_rmse(self) -> DoubleArray:
        """Deprecated: the same as `relative`; removed in version 2."""
        return self.relative

    def __len__(self) -> int:
        return len(self.samples_per_pixel)

    @staticmethod
    def of(data: models.Convergence) -> Convergence:
        points: Sequence[Mapping[str, Any]] = data["points"]

        def column(name: str) -> DoubleArray:
            return numbers([point.get(name) for point in points])

        return Convergence(
            samples_per_pixel=column("samples_per_pixel"),
            elapsed_seconds=column("elapsed_seconds"),
            cpu_seconds=column("cpu_seconds"),
            rays=column("rays"),
            relative=column("relative"),
            low=column("low"),
            high=column("high"),
            grain=column("grain"),
            doubt=column("doubt"),
            slope=Interval.of(data["slope"]),
        )


@dataclass(frozen=True, eq=False)
class Meter:
    """Light that arrives at the points of a job's meter, one array element for each.

    position, normal and irradiance_rgb have three columns. low, high: 95% interval of
    illuminance_lux; where unreliable is 1 instead of 0, only a guess. irradiance_w_m2:
    illuminance_lux / (683 lm/W). uniformity: least illuminance / mean_lux. outdoor_lux: on open
    ground under the job's environment. daylight_factor: mean_lux / outdoor_lux. NaN: unknown.
    """

    position: DoubleArray
    normal: DoubleArray
    irradiance_w_m2: DoubleArray
    illuminance_lux: DoubleArray
    low: DoubleArray
    high: DoubleArray
    unreliable: DoubleArray
    irradiance_rgb: DoubleArray
    samples: DoubleArray
    mean_lux: float
    uniformity: float
    outdoor_lux: float
    daylight_factor: float

    def __len__(self) -> int:
        return len(self.samples)

    @staticmethod
    def of(data: models.Meter) -> Meter:
        points: Sequence[Mapping[str, Any]] = data["points"]

        def column(name: str) -> DoubleArray:
            return numbers([point.get(name) for point in points])

        return Meter(
            position=triples([point["position"] for point in points]),
            normal=triples([point["normal"] for point in points]),
            irradiance_w_m2=column("irradiance_w_m2"),
            illuminance_lux=column("illuminance_lux"),
            low=column("low"),
            high=column("high"),
            unreliable=column("unreliable"),
            irradiance_rgb=triples([point["irradiance_rgb"] for point in points]),
            samples=column("samples"),
            mean_lux=number(data.get("mean_lux")),
            uniformity=number(data.get("uniformity")),
            outdoor_lux=number(data.get("outdoor_lux")),
            daylight_factor=number(data.get("daylight_factor")),
        )


@dataclass(frozen=True)
class Comparison:
    """Difference of two images.

    relmse: mean of (a-b)^2 / (b^2 + 0.01). bias: signed, mean of a - b. z_*: of the differences
    over their standard errors; about 0, 1 and 0.0027 if there is only noise. `data` is the whole
    response.
    """

    id: str
    mse: float
    relmse: float
    flip: float
    bias: Interval
    z_mean: float
    z_variance: float
    z_share_above_3: float
    data: models.Comparison = field(repr=False)

    @staticmethod
    def of(data: models.Comparison) -> Comparison:
        z = data["z"]
        return Comparison(
            id=str(data["id"]),
            mse=number(data["mse"]),
            relmse=number(data["relmse"]),
            flip=number(data["flip"]),
            bias=Interval.of(data["bias"]),
            z_mean=number(z["mean"]),
            z_variance=number(z["variance"]),
            z_share_above_3=number(z["share_above_3"]),
            data=data,
        )


@dataclass(frozen=True)
class LabPoint:
    """One line of an experiment; `data` is all of it."""

    n: int
    mean: float
    rmse: float
    standard_error: float
    seconds: float
    data: models.LabPoint = field(repr=False)

    @staticmethod
    def of(data: models.LabPoint) -> LabPoint:
        return LabPoint(
            n=int(data["n"]),
            mean=number(data["mean"]),
            rmse=number(data["rmse"]),
            standard_error=number(data["standard_error"]),
            seconds=number(data["seconds"]),
            data=data,
        )


@dataclass(frozen=True)
class LabRun:
    """A run of an experiment of the estimator laboratory: its points and outcome.

    `data` is the closing line: expected, slope, slope_interval, efficiency, verdict and more.
    """

    points: tuple[LabPoint, ...]
    expected: float
    slope: float
    verdict: str
    data: dict[str, Any] = field(repr=False)

    @staticmethod
    def of(lines: Sequence[Any]) -> LabRun:
        """lines: of the stream, the closing one last."""
        *points, last = lines
        return LabRun(
            points=tuple(LabPoint.of(each) for each in points),
            expected=number(last.get("expected")),
            slope=number(last.get("slope")),
            verdict=str(last.get("verdict", "")),
            data=last,
        )


@dataclass(frozen=True)
class Scene:
    """A scene on the server. materials, variants: names; data: the whole description."""

    id: str
    data: models.Scene = field(repr=False)

    @property
    def name(self) -> str:
        return self.data["name"]

    @property
    def triangles(self) -> int:
        return self.data["triangles"]

    @property
    def bounds(self) -> tuple[DoubleArray, DoubleArray] | None:
        """Smallest and largest corner in metres; None for a scene without surfaces."""
        box = self.data["bounds"]
        return (numbers(box["min"]), numbers(box["max"])) if box else None

    @property
    def cameras(self) -> list[models.SceneCamera]:
        return list(self.data["cameras"])

    @property
    def lights(self) -> list[models.SceneLight]:
        return list(self.data["lights"])

    @property
    def materials(self) -> list[str]:
        return list(self.data["materials"])

    @property
    def variants(self) -> list[str]:
        return list(self.data["variants"])

    @property
    def animations(self) -> list[str]:
        return list(self.data["animations"])

    @property
    def warnings(self) -> list[str]:
        return list(self.data["warnings"])

    @property
    def warning_details(self) -> list[models.Warning]:
        """The same as `code`, `pointer` into the glTF document, and `detail`."""
        return list(self.data["warning_details"])


@dataclass(frozen=True)
class ServerInfo:
    """Capabilities of the server; `data` is the whole of GET /v1/server."""

    data: models.Server = field(repr=False)

    @property
    def version(self) -> str:
        return self.data["version"]

    @property
    def scenes(self) -> list[str]:
        """Names of the built-in scenes."""
        return [each["name"] for each in self.data["scenes"]]

    @property
    def integrators(self) -> list[str]:
        return [each["type"] for each in self.data["integrators"]]

    @property
    def samplers(self) -> list[str]:
        return [each["type"] for each in self.data["samplers"]]

    @property
    def layers(self) -> list[str]:
        return list(self.data["layers"])

    @property
    def experiments(self) -> list[models.Experiment]:
        """Experiments of the laboratory."""
        return list(self.data["experiments"])

    @property
    def limits(self) -> dict[str, int]:
        return dict(self.data["limits"])

    @property
    def defaults(self) -> models.JobDefaults:
        """Default values of a job request."""
        return self.data["defaults"]
