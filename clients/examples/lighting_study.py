"""A lighting study: illuminance of a desk under a luminaire, read from pixels.

    python lighting_study.py [--heights 1.5 2.5] [--samples N]

A white Lambertian plane shows the irradiance E as the radiance L = E / pi, so pi times the mean of
a pixel is a reading, and pi times its interval the interval of the reading. (An irradiance meter,
`meter` in a job, needs no white plane.) The luminaire is a rectangle of constant luminance, for
which the illuminance has a closed form; the last column shows it.
"""

from __future__ import annotations

import argparse
import math

from tessera_render import Client, Job

from simple_glb import Glb

DESK_M = 4.0  # side of the plane, and of the camera's view
LAMP_M = (1.2, 0.3)  # along x and z
LUMINANCE = 1000.0  # cd/m^2, which is one W/(sr m^2) here
PIXELS = 64
POINTS_M = (0.03125, 0.53125, 1.03125, 1.53125)  # centres of pixels, from the centre along x


def room(height_m: float) -> bytes:
    """A desk at y = 0, a luminaire above it, and a camera that views the desk from above."""
    glb = Glb()
    white = glb.add_material(
        "white",
        pbrMetallicRoughness={"metallicFactor": 0, "roughnessFactor": 1},
        extensions={"KHR_materials_specular": {"specularFactor": 0}},  # Lambertian
    )
    lamp = glb.add_material(
        "luminaire",
        pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        emissiveFactor=[1, 1, 1],
        extensions={"KHR_materials_emissive_strength": {"emissiveStrength": LUMINANCE}},
    )

    def rectangle(x: float, y: float, z: float, up: bool, material: int) -> None:
        corners = [(-x, y, -z), (-x, y, z), (x, y, z), (x, y, -z)]
        triangles = [(0, 1, 2), (0, 2, 3)] if up else [(0, 2, 1), (0, 3, 2)]
        primitive = glb.add_primitive(corners, triangles, material)
        glb.add_node(mesh=glb.add("meshes", {"primitives": [primitive]}))

    rectangle(DESK_M / 2, 0, DESK_M / 2, True, white)
    rectangle(LAMP_M[0] / 2, height_m, LAMP_M[1] / 2, False, lamp)
    view = {"xmag": DESK_M / 2, "ymag": DESK_M / 2, "znear": 0.01, "zfar": 10}
    camera = glb.add("cameras", {"type": "orthographic", "orthographic": view})
    # Below the luminaire, looking down: a quarter turn about x.
    turn = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]
    glb.add_node(camera=camera, translation=[0, 1, 0], rotation=turn)
    return glb.bytes()


def illuminance(x: float, z: float, height_m: float) -> float:
    """Closed form for a rectangle parallel to the plane: four rectangles that share a corner."""

    def corner(a: float, b: float) -> float:
        p, q = math.hypot(a, height_m), math.hypot(b, height_m)
        return a / p * math.atan(b / p) + b / q * math.atan(a / q)

    x0, x1 = -LAMP_M[0] / 2 - x, LAMP_M[0] / 2 - x
    z0, z1 = -LAMP_M[1] / 2 - z, LAMP_M[1] / 2 - z
    return LUMINANCE / 2 * (corner(x1, z1) - corner(x0, z1) - corner(x1, z0) + corner(x0, z0))


def reading(job: Job, x_m: float) -> tuple[float, float, float]:
    """Illuminance at (x_m, 0) in lux, with its 95% interval."""
    column = math.floor((x_m / DESK_M + 0.5) * PIXELS)
    beauty = job.pixels(column, PIXELS // 2).beauty
    mean, low, high = (math.pi * float(v[1]) for v in (beauty.mean, beauty.low, beauty.high))
    return mean, low, high


def main() -> None:
    parser = argparse.ArgumentParser(description="Reads illuminance from a white plane.")
    parser.add_argument("--heights", type=float, nargs="+", default=[1.5, 2.5], metavar="M")
    parser.add_argument("--samples", type=int, default=256)
    options = parser.parse_args()
    with Client() as client:
        for height_m in options.heights:
            job = client.submit(
                client.upload(room(height_m)),
                name=f"luminaire at {height_m} m",
                environment=None,
                integrator={"type": "path", "max_depth": 1},
                film={"filter": {"type": "box", "radius": 0.5}},
                size=(PIXELS, PIXELS),
                layers=[],
                samples_per_pixel=options.samples,
            ).wait()
            print(f"luminaire at {height_m} m")
            readings = []
            for x_m in POINTS_M:
                value, low, high = reading(job, x_m)
                exact = illuminance(x_m, DESK_M / PIXELS / 2, height_m)
                readings.append(value)
                print(f"  {x_m:5.2f} m  {value:8.2f} lx  ({low:.2f} to {high:.2f})", end="")
                print(f"  exact {exact:8.2f}")
            print(f"  uniformity {min(readings) * len(readings) / sum(readings):.2f}")


if __name__ == "__main__":
    main()
