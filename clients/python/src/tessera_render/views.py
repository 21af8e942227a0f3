"""Cameras for many images of one scene: members `camera` of jobs.

    for camera in views.sphere(196):
        client.submit(scene, camera=camera)

They are plain dictionaries, to which members such as a lens may be added.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import numpy.typing as npt

Camera = dict[str, Any]


def sphere(
    count: int, *, phi_degrees: tuple[float, float] = (0, 180), radius: float | str = "auto"
) -> list[Camera]:
    """Returns cameras at equal areas of a sphere around the scene's centre (Fibonacci lattice).

    phi_degrees: the highest and the lowest angle from above; (0, 90) is the upper half. radius:
    metres, or auto, which shows the whole scene.
    """
    top, bottom = (math.cos(math.radians(phi)) for phi in phi_degrees)
    golden = 180 * (3 - math.sqrt(5))
    return [
        {
            "orbit": {
                "theta_degrees": (golden * i) % 360,
                "phi_degrees": math.degrees(math.acos(top + (bottom - top) * (i + 0.5) / count)),
                "radius": radius,
            }
        }
        for i in range(count)
    ]


def helix(
    count: int, *, turns: float = 1, phi_degrees: tuple[float, float] = (75, 75),
    radius: float | str = "auto",
) -> list[Camera]:  # fmt: skip
    """Returns cameras that go around the scene, from the first angle from above to the second."""
    first, last = phi_degrees
    return [
        {
            "orbit": {
                "theta_degrees": 360 * turns * i / count,
                "phi_degrees": first + (last - first) * i / max(count - 1, 1),
                "radius": radius,
            }
        }
        for i in range(count)
    ]


def path(
    points: Sequence[Sequence[float]], targets: Sequence[Sequence[float]], count: int
) -> list[Camera]:
    """Returns cameras at equal distances along a line through points, looking at targets.

    points, targets: at least two, [m]; the n-th target is looked at from the n-th point. A single
    target is looked at from everywhere.
    """
    line: npt.NDArray[np.float64] = np.asarray(points, float)
    aims = np.broadcast_to(np.asarray(targets, float), line.shape)
    way = np.concatenate(([0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))))
    if len(line) < 2 or not way[-1] > 0:
        raise ValueError("a path needs two points that differ")
    at = np.linspace(0, way[-1], count)

    def along(values: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        return np.stack([np.interp(at, way, values[:, axis]) for axis in range(3)], axis=1)

    return [
        {"position": position.tolist(), "target": target.tolist()}
        for position, target in zip(along(line), along(aims), strict=True)
    ]
