"""Renders until the image meets an error target, and reports the progress.

    python error_target.py [SCENE] [--error 0.05] [--out PICTURE.png]

The job stops when its relative error is at most the target with the stated confidence, so the
interval in the last line is below the target.
"""

from __future__ import annotations

import argparse
from pathlib import Path

from tessera_render import Client


def main() -> None:
    parser = argparse.ArgumentParser(description="Renders to an error instead of a sample count.")
    parser.add_argument("scene", nargs="?", default="cornell-box")
    parser.add_argument("--error", type=float, default=0.05)
    parser.add_argument("--seconds", type=float, default=300, help="give up after so long")
    parser.add_argument("--size", default="320x180")
    parser.add_argument("--out", type=Path, default=Path("image.png"))
    options = parser.parse_args()
    width, height = (int(side) for side in options.size.split("x"))
    with Client() as client:
        job = client.submit(
            options.scene,
            size=(width, height),
            relative_error=options.error,
            seconds=options.seconds,
        )
        for event in job.events():
            if event.type == "progress":
                print(f"{job.progress.samples_mean:6g} samples  error {job.error}", flush=True)
        job.raise_if_failed()
        curve = job.convergence()
        for samples, error in zip(curve.samples_per_pixel, curve.relative, strict=True):
            print(f"{samples:6g} samples  {error:8.2%}")
        print(f"the error falls with the samples to the power {curve.slope.value:.2f}")
        print(f"{job.stop_reason}: {job.progress.samples_mean:g} samples, error {job.error}")
        print(job.save(options.out))


if __name__ == "__main__":
    main()
