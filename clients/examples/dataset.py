"""A data set: labelled images of a scene from many sides, for COCO's and nerfstudio's readers.

    python dataset.py [SCENE] [--views random|sphere|helix|rooms] [--count N] [--format F[,F]]
                      [--size WxH] [--samples N] [--seed N] [--out FOLDER]
    python dataset.py chair.glb --views sphere --count 196 --format nerfstudio --out chair

SCENE: built-in name or a .glb, .gltf or .zip file. Views: random positions in random light, equal
areas of a sphere or a helix around the scene in its own light, or furnished rooms at random (no
SCENE), four images of each. Formats: coco, with exact masks and boxes (of the visible part, and of
the whole object), see annotations/; nerfstudio, transforms.json with points3D.ply.

Every image has its camera, and float32 arrays NAME.npy in a folder for each layer: beauty (linear
light), depth (along the ray) and z_depth (along the camera's axis, at pixel centres) [m], normal,
position [m], motion [pixels until the next frame], and error (relative standard error). The same
command again renders what is missing.
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import random
import tempfile
from collections.abc import Iterator
from pathlib import Path

from tessera_render import AsyncClient, AsyncJob, JobOptions, Scene, views
from tessera_render.datasets import CocoFolder, NerfstudioFolder

from rooms import room

#: Jobs that are on the server at a time.
AT_A_TIME = 8
VIEWS_OF_A_ROOM = 4
#: Layers that are written as arrays.
RECORDED = ("depth", "z_depth", "normal", "position", "motion")
PLANES = ("beauty", *RECORDED, "error")
FORMATS = {"coco": CocoFolder, "nerfstudio": NerfstudioFolder}


def random_light(numbers: random.Random) -> JobOptions:
    """A camera around the scene that looks at its centre, and a sky of a random colour."""
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
    }


def in_room(numbers: random.Random, half: tuple[float, float]) -> JobOptions:
    """A camera at the walls of a room, at the height of eyes, that looks across."""
    angle = numbers.uniform(0, 2 * math.pi)
    x, z = math.sin(angle), math.cos(angle)
    eye = [0.85 * half[0] * x, numbers.uniform(1.2, 1.9), 0.85 * half[1] * z]
    target = [-0.3 * half[0] * x, numbers.uniform(0.3, 0.9), -0.3 * half[1] * z]
    return {"camera": {"position": eye, "target": target, "vertical_fov_degrees": 60}}


def requests(options: argparse.Namespace) -> Iterator[tuple[bytes | None, JobOptions]]:
    """Yields a room, or None for the scene, and a job for each image."""
    numbers = random.Random(options.seed)
    width, height = (int(side) for side in options.size.split("x"))
    for index in range(options.count):
        made = None
        request: JobOptions = {}
        if options.views == "random":
            request = random_light(numbers)
        elif options.views == "rooms":
            own = random.Random(f"{options.seed} {index // VIEWS_OF_A_ROOM}")
            made, half = room(own)
            request = in_room(numbers, half)
        else:
            around = views.sphere if options.views == "sphere" else views.helix
            request = {"camera": around(options.count)[index]}
        request |= {
            "seed": numbers.randrange(2**31),
            "size": (width, height),
            "layers": ["instance", *RECORDED],
            "samples_per_pixel": options.samples,
        }
        yield made, request


def check_settings(options: argparse.Namespace) -> None:
    """Ends the program if the folder holds another data set."""
    same = {name: value for name, value in vars(options).items() if name != "out"}
    place = options.out / "settings.json"
    if place.exists() and json.loads(place.read_text()) != same:
        raise SystemExit(f"{options.out} holds a data set with other settings; name another --out")
    options.out.mkdir(parents=True, exist_ok=True)
    place.write_text(json.dumps(same))


async def main() -> None:
    parser = argparse.ArgumentParser(description="Renders labelled images of a scene.")
    parser.add_argument("scene", nargs="?", default="glass")
    parser.add_argument("--count", type=int, default=200)
    parser.add_argument("--views", choices=["random", "sphere", "helix", "rooms"], default="random")
    parser.add_argument("--format", default="coco")
    parser.add_argument("--size", default="320x240")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--out", type=Path, default=Path("dataset"))
    options = parser.parse_args()
    check_settings(options)
    folders = [FORMATS[name](options.out) for name in options.format.split(",")]
    missing = {
        f"{index:06}": wanted
        for index, wanted in enumerate(requests(options))
        if not all(f"{index:06}" in folder for folder in folders)
    }
    async with AsyncClient() as client:

        async def upload(path: str | Path) -> Scene:
            return await client.upload(str(path))

        turn = asyncio.Semaphore(AT_A_TIME)
        scene = None
        if options.views != "rooms":
            is_file = Path(options.scene).exists()
            scene = await (upload(options.scene) if is_file else client.scene(options.scene))

        async def render(made: bytes | None, request: JobOptions) -> AsyncJob:
            async with turn:
                of = scene
                if made is not None:
                    with tempfile.NamedTemporaryFile(suffix=".glb") as file:
                        Path(file.name).write_bytes(made)
                        of = await upload(file.name)
                assert of is not None
                return await (await client.submit(of, **request)).wait()

        tasks = {name: asyncio.create_task(render(*wanted)) for name, wanted in missing.items()}
        for name, task in tasks.items():
            job = await task
            ids, objects = await job.image("instance"), await job.objects()
            planes = {layer: await job.image(layer) for layer in PLANES}
            picture = await job.picture()
            for folder in folders:
                if name not in folder:
                    folder.add(name, picture, ids, objects, planes)
                    folder.write()
            print(f"{name}: {len(set(ids[ids != 0].tolist()))} instances", flush=True)
    print(options.out)


if __name__ == "__main__":
    asyncio.run(main())
