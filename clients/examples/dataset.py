"""A data set: labelled images of a scene from random positions in random light, as a COCO folder.

    python dataset.py [SCENE] [--count N] [--size WxH] [--samples N] [--seed N] [--out FOLDER]

SCENE: built-in name or a .glb, .gltf or .zip file. Every image has exact masks, boxes (of the
visible part, and of the whole object) and the camera; see annotations/instances.json and
panoptic.json. Depth [m], normals and motion [pixels until the next frame] are float32 in
depth/*.npy, normal/*.npy and motion/*.npy.
"""

from __future__ import annotations

import argparse
import asyncio
import random
from pathlib import Path

from tessera import AsyncClient, AsyncJob, CocoFolder, JobOptions, Scene

#: Jobs that are on the server at a time.
AT_A_TIME = 8
#: Layers that are written as arrays.
PLANES = ("depth", "normal", "motion")


def chance(numbers: random.Random, options: argparse.Namespace) -> JobOptions:
    """A camera around the scene that looks at its centre, and a sky of a random colour."""
    width, height = (int(side) for side in options.size.split("x"))
    return {
        "camera": {
            "orbit": {
                "theta_degrees": numbers.uniform(0, 360),
                "phi_degrees": numbers.uniform(35, 85),
            },
            "vertical_fov_degrees": numbers.uniform(25, 55),
        },
        "environment": {
            "color": [numbers.uniform(0.6, 1) for _ in range(3)],
            "intensity": numbers.uniform(0.4, 1.6),
        },
        "seed": numbers.randrange(2**31),
        "size": (width, height),
        "layers": ["instance", *PLANES],
        "samples_per_pixel": options.samples,
    }


async def main() -> None:
    parser = argparse.ArgumentParser(description="Renders labelled images of a scene.")
    parser.add_argument("scene", nargs="?", default="glass")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("dataset"))
    options = parser.parse_args()
    numbers = random.Random(options.seed)
    jobs = [chance(numbers, options) for _ in range(options.count)]
    folder = CocoFolder(options.out)
    async with AsyncClient() as client:
        scene: Scene = (
            await client.upload(options.scene)
            if Path(options.scene).exists()
            else await client.scene(options.scene)
        )
        turn = asyncio.Semaphore(AT_A_TIME)

        async def render(request: JobOptions) -> AsyncJob:
            async with turn:
                return await (await client.submit(scene, **request)).wait()

        for index, task in enumerate([asyncio.create_task(render(each)) for each in jobs]):
            job = await task
            found = folder.add(
                f"{index:06}",
                await job.picture(),
                await job.image("instance"),
                await job.objects(),
                {layer: await job.image(layer) for layer in PLANES},
            )
            print(f"{index:06}: {len(found)} instances", flush=True)
    folder.write()
    print(options.out)


if __name__ == "__main__":
    asyncio.run(main())
