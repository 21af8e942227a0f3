"""Blender's lights in the units of a job. Needs no Blender.

Blender's exporter writes candela and lux by one of three conventions: SPEC (683 lm/W), COMPAT
(watts over 4 pi, or W/m2 of a sun) and RAW (the number in Blender's field). Radiance that Blender
computes from emission and worlds has no such factor, and the server has one scale for all lights
of a file, so only COMPAT keeps their proportions. The exporter's figures also leave out strength
and colour of a light's nodes; those here have them.
"""

from __future__ import annotations

import math
from typing import Any

from .cameras import y_up

# Sides of the polygon that stands for a disc: its area, which the radiance takes into account, is
# 0.6% smaller.
_DISC_SIDES = 32


def emission_node(light: Any) -> Any:
    """The emission node that a light's output shows, or None."""
    if not light.use_nodes or light.node_tree is None:
        return None
    for node in light.node_tree.nodes:
        if node.type == "OUTPUT_LIGHT" and node.inputs["Surface"].is_linked:
            shown = node.inputs["Surface"].links[0].from_node
            return shown if shown.type == "EMISSION" else None
    return None


def power(light: Any) -> float:
    """Power [W] of a light; irradiance [W/m2] of a sun. With the strength of its nodes."""
    watts = light.energy * 2.0 ** getattr(light, "exposure", 0.0)
    node = emission_node(light)
    if node is not None:
        strength = node.inputs["Strength"]
        if not strength.is_linked:
            watts *= strength.default_value
        elif strength.links[0].from_node.type == "LIGHT_FALLOFF":
            watts *= strength.links[0].from_node.inputs["Strength"].default_value
    return watts


def color(light: Any) -> list[float]:
    """Linear Rec.709, with its temperature and the colour of its nodes."""
    rgb = list(light.color)
    if getattr(light, "use_temperature", False):
        rgb = [a * b for a, b in zip(rgb, light.temperature_color, strict=True)]
    node = emission_node(light)
    if node is not None and not node.inputs["Color"].is_linked:
        rgb = [a * b for a, b in zip(rgb, node.inputs["Color"].default_value[:3], strict=True)]
    return rgb


def intensity(light: Any, exported: float) -> float:
    """Intensity [W/sr] of a point or spot light, whatever the cone; irradiance [W/m2] of a sun.

    exported: the exporter's number by COMPAT, which alone has the surface of a light whose power
    is not normalized.
    """
    if not getattr(light, "normalize", True):
        return exported
    return power(light) if light.type == "SUN" else power(light) / (4 * math.pi)


def mean_of_cone(light: Any) -> float:
    """Mean over the cone of the cosine to a spot's axis, by which Cycles dims it before 3.6."""
    return (1 + math.cos(light.spot_size / 2)) / 2 if light.type == "SPOT" else 1.0


def outline(light: Any) -> list[tuple[float, float]]:
    """Corners of an area light in its plane, counter-clockwise from behind it (seen along -z)."""
    half_x = light.size / 2
    half_y = (light.size_y if light.shape in ("RECTANGLE", "ELLIPSE") else light.size) / 2
    if light.shape in ("SQUARE", "RECTANGLE"):
        return [(half_x, half_y), (half_x, -half_y), (-half_x, -half_y), (-half_x, half_y)]
    turn = -2 * math.pi / _DISC_SIDES
    return [
        (half_x * math.cos(k * turn), half_y * math.sin(k * turn)) for k in range(_DISC_SIDES)
    ]


def _area(points: list[list[float]]) -> float:
    """Area [m2] of a flat convex polygon: half the length of the sum of cross products."""
    total = [0.0, 0.0, 0.0]
    for a, b in zip(points, points[1:] + points[:1], strict=True):
        for axis in range(3):
            i, j = (axis + 1) % 3, (axis + 2) % 3
            total[axis] += a[i] * b[j] - a[j] * b[i]
    return math.sqrt(sum(t * t for t in total)) / 2


def panel(
    light: Any, matrix: Any, factor: float = math.pi
) -> tuple[list[list[float]], float]:
    """An area light as corners in the server's axes, and its radiance [W/(m2 sr)].

    The corners are counter-clockwise seen from the lit side. It emits evenly and by the cosine, on
    one side: power = factor * radiance * area, the area 1 for power that is not normalized.
    factor: pi; Cycles has 4 before Blender 4.
    """
    corners = [
        y_up(*(row[0] * x + row[1] * y + row[3] for row in matrix[:3])) for x, y in outline(light)
    ]
    surface = _area(corners) if getattr(light, "normalize", True) else 1.0
    return corners, (power(light) / (factor * surface) if surface > 0 else 0.0)
