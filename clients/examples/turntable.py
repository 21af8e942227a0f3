"""A turntable: views of a scene from all sides, as a batch of jobs.

    python turntable.py [SCENE] [--frames N] [--size WxH] [--out FOLDER]

SCENE: built-in name or a .glb, .gltf or .zip file; without it a vase in a studio. All frames are
submitted at once; the server renders them in order, and each is saved when it has ended. Running it
again renders no existing frame again: the jobs are found by their labels.
"""

from __future__ import annotations

import argparse
import asyncio
import math
from pathlib import Path

import numpy as np
from tessera_render import AsyncClient, AsyncJob, JobOptions, Scene

from product import studio, vase

FOV_DEGREES = 40.0


def camera(scene: Scene, angle: float, aspect: float) -> dict[str, object]:
    """Looks at the centre from `angle` (radians around the y axis) and slightly above."""
    if scene.bounds is None:
        raise SystemExit("the scene is empty")
    low, high = scene.bounds
    middle, radius = (low + high) / 2, float(np.linalg.norm(high - low)) / 2
    half = math.radians(FOV_DEGREES) / 2
    half = min(half, math.atan(math.tan(half) * aspect))  # it must fit the narrower side
    away = np.array([math.sin(angle), 0.35, math.cos(angle)])
    eye = middle + away / np.linalg.norm(away) * radius / math.sin(half)
    return {
        "position": eye.tolist(),
        "target": middle.tolist(),
        "vertical_fov_degrees": FOV_DEGREES,
    }


async def frame(
    client: AsyncClient, scene: Scene, index: int, light: str | None, options: argparse.Namespace
) -> AsyncJob:
    width, height = (int(side) for side in options.size.split("x"))
    labels = {"turntable": f"{scene.id[:16]}-{options.frames}-{options.size}", "frame": str(index)}
    known = [job async for job in client.jobs(label=labels, state="finished", limit=1)]
    if known:
        job = known[0]
    else:
        angle = 2 * math.pi * index / options.frames
        request: JobOptions = {
            "name": f"turntable {index + 1} of {options.frames}",
            "labels": labels,
            "camera": camera(scene, angle, width / height),
            "size": (width, height),
            "relative_error": options.error,
            "seconds": options.seconds,
        }
        if light:
            # It lights the product and reflects in it, but the background stays transparent.
            request["environment"] = {"asset": light, "visible": False}
        job = await client.submit(scene, **request)
    await job.wait()
    path = await job.save(options.out / f"turntable-{index:03}.png")
    print(f"{path.name}: {job.progress.samples_mean:g} samples, error {job.error}", flush=True)
    return job


async def main() -> None:
    parser = argparse.ArgumentParser(description="Renders a scene from all sides.")
    parser.add_argument("scene", nargs="?")
    parser.add_argument("--frames", type=int, default=12)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--error", type=float, default=0.1, help="relative error to stop at")
    parser.add_argument("--seconds", type=float, default=60, help="at most, for each frame")
    parser.add_argument("--out", type=Path, default=Path())
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    async with AsyncClient() as client:
        light = None
        if options.scene is None:
            scene = await client.upload(vase())
            light = await client.upload_asset(studio())
        elif Path(options.scene).exists():
            scene = await client.upload(options.scene)
        else:
            scene = await client.scene(options.scene)
        await asyncio.gather(
            *(frame(client, scene, i, light, options) for i in range(options.frames))
        )


if __name__ == "__main__":
    asyncio.run(main())
