"""Furnished rooms at random, made by code: a lamp on the ceiling, boxes, balls and columns."""

from __future__ import annotations

import random
from collections.abc import Callable

import numpy as np
import numpy.typing as npt

from simple_glb import Glb

Shape = tuple[npt.NDArray[np.float64], npt.NDArray[np.float64], npt.NDArray[np.int64]]
HEIGHT_M = 2.7


def _box() -> Shape:
    """Positions, normals and triangles; 1 m wide and high, standing on y = 0."""
    positions: list[npt.NDArray[np.float64]] = []
    normals: list[npt.NDArray[np.float64]] = []
    triangles: list[tuple[int, int, int]] = []
    for axis in range(3):
        for sign in (-1.0, 1.0):
            normal, u = np.zeros(3), np.zeros(3)
            normal[axis], u[(axis + 1) % 3] = sign, 1.0
            v = np.cross(normal, u)
            first = len(positions)
            positions += [0.5 * (normal + a * u + b * v)
                          for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]  # fmt: skip
            normals += [normal] * 4
            triangles += [(first, first + 1, first + 2), (first, first + 2, first + 3)]
    standing = np.array(positions) + np.array([0, 0.5, 0])
    return standing, np.array(normals), np.array(triangles)


def _turned(radius: npt.NDArray[np.float64], height: npt.NDArray[np.float64]) -> Shape:
    """A surface of revolution, from bottom to top, without caps."""
    around = 48
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    ring = np.stack([np.sin(angle), np.zeros(around), np.cos(angle)], axis=1)
    slope = np.gradient(height), -np.gradient(radius)
    points = [ring * r + [0, h, 0] for r, h in zip(radius, height, strict=True)]
    normals = [ring * a + [0, b, 0] for a, b in zip(*slope, strict=True)]
    triangles = []
    for row in range(len(radius) - 1):
        for i in range(around):
            a, b = row * around + i, row * around + (i + 1) % around
            triangles += [(a, b, b + around), (a, b + around, a + around)]
    normal = np.concatenate(normals)
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-9)
    return np.concatenate(points), normal, np.array(triangles)


def _ball() -> Shape:
    angle = np.linspace(0.01, np.pi - 0.01, 33)
    return _turned(0.5 * np.sin(angle), 0.5 - 0.5 * np.cos(angle))


def _column() -> Shape:
    # The lid's rings are narrower and narrower.
    edge = np.array([0.5, 0.499, 0.25, 0.001])
    return _turned(np.concatenate([np.full(9, 0.5), edge]), np.r_[np.linspace(0, 1, 9), [1.0] * 4])


SHAPES: dict[str, Callable[[], Shape]] = {"box": _box, "ball": _ball, "column": _column}


def room(numbers: random.Random) -> tuple[bytes, tuple[float, float]]:
    """Returns a room as GLB, and half its width and depth [m]; the floor's centre is (0, 0, 0)."""
    glb = Glb()
    half = numbers.uniform(2, 3.5), numbers.uniform(2, 3.5)

    def material(**members: object) -> int:
        color = [numbers.uniform(0.1, 0.85) for _ in range(3)]
        metal = numbers.random() < 0.2
        pbr = {
            "baseColorFactor": [*color, 1],
            "metallicFactor": float(metal),
            "roughnessFactor": numbers.uniform(0.2, 0.9),
        }
        return glb.add_material("paint", pbrMetallicRoughness=pbr, **members)

    def put(name: str, shape: Shape, paint: int, size: list[float], at: list[float]) -> None:
        positions, normals, triangles = shape
        primitive = glb.add_primitive(
            positions * size + at, triangles, paint, normals=normals / size
        )
        glb.add_node(name=name, mesh=glb.add("meshes", {"primitives": [primitive]}))

    # The walls are the inside of a box: triangles and normals are turned.
    positions, normals, triangles = _box()
    walls = glb.add_material(
        "walls", pbrMetallicRoughness={"baseColorFactor": [0.75, 0.72, 0.68, 1],
                                       "metallicFactor": 0, "roughnessFactor": 0.9},
    )  # fmt: skip
    inside = positions, -normals, triangles[:, ::-1]
    put("room", inside, walls, [2 * half[0], HEIGHT_M, 2 * half[1]], [0, 0, 0])
    lamp = glb.add_material(
        "lamp", emissiveFactor=[1, 0.95, 0.88],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 3000}},
    )  # fmt: skip
    put("lamp", _box(), lamp, [1.2, 0.05, 1.2], [0, HEIGHT_M - 0.06, 0])
    taken: list[tuple[float, float, float]] = []
    for _ in range(numbers.randint(5, 12)):
        kind = numbers.choice(list(SHAPES))
        width = numbers.uniform(0.3, 1)
        x, z = (numbers.uniform(-side + width, side - width) for side in half)
        if any(np.hypot(x - a, z - b) < 0.75 * (width + w) for a, b, w in taken):
            continue
        taken.append((x, z, width))
        height = width if kind == "ball" else numbers.uniform(0.3, 1.6)
        put(kind, SHAPES[kind](), material(), [width, height, width], [x, 0, z])
    return glb.bytes(), half
