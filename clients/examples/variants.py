"""A product sheet: every variant of a product (KHR_materials_variants) side by side in one image.

    python variants.py [SCENE] [--out SHEET.png]

Without SCENE it uses a vase in four glazes. The variants share one upload and one seed, so the
images differ only in their materials.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import numpy as np
from tessera_render import Client, encode_png, srgb8

from product import studio, vase

CAMERA = {"position": [0.2, 0.28, 0.75], "target": [0, 0.15, 0], "vertical_fov_degrees": 26}


def main() -> None:
    parser = argparse.ArgumentParser(description="Renders all variants of a product on one sheet.")
    parser.add_argument("scene", nargs="?", type=Path)
    parser.add_argument("--out", type=Path, default=Path("variants.png"))
    parser.add_argument("--size", default="160x240")
    parser.add_argument("--samples", type=int, default=64)
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    with Client() as client:
        scene = client.upload(options.scene or vase())
        if not scene.variants:
            raise SystemExit("the scene has no variants")
        # It lights the product and reflects in it, but the background stays transparent.
        environment = {"asset": client.upload_asset(studio()), "visible": False}
        jobs = [
            client.submit(
                scene,
                name=f"variant {name}",
                variant=name,
                environment=environment,
                camera=None if options.scene else CAMERA,
                size=(width, height),
                layers=["albedo"],
                samples_per_pixel=options.samples,
            )
            for name in scene.variants
        ]
        pictures = []
        for name, job in zip(scene.variants, jobs, strict=True):
            job.wait()
            picture = job.image()  # RGBA; colours are associated with alpha
            pictures.append(picture[:, :, :3] + (1 - picture[:, :, 3:]))  # over white
            r, g, b = job.image("albedo")[height // 2, width // 2]
            print(f"{name}: albedo in the middle {r:.3f} {g:.3f} {b:.3f}, error {job.error}")
    options.out.write_bytes(encode_png(srgb8(np.concatenate(pictures, axis=1))))
    print(options.out)


if __name__ == "__main__":
    main()
