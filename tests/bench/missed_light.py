#!/usr/bin/env python3
"""Marked misses: how many images that miss light say so.

Renders built-in scenes whose caustics are rare by integrators that may not find them, at few
samples over seeds. An image misses light if its blocks of BLOCK pixels are darker than those of the
reference by more than MISSED of all light. It is marked if

  doubt     its error is `unreliable`: only one half has found some light,
  lacking   light_not_found.tiles is above 0: particles found light that it lacks, or
  bound     light_not_found.at_most is at least the light that it misses.

usage: tests/bench/missed_light.py [--binary FILE] [--seeds N] [--samples N,N] [--short]
  --short: three seeds at 8 samples; the status is 1 if less than LEAST of the images that miss
    light are marked, or if the planted fault, marks of doubt alone, is as good.
"""

import argparse
import json
import subprocess
import sys
import tempfile
from pathlib import Path

MISSED = 0.1  # An error of 10% is visible.
LEAST = 0.95
SIZE = "64x36"
BLOCK = (8, 9)
INTEGRATORS = ("path", "bdpt", "mlt")
# Integrators of the references find all light by design; sppm is biased, but loses none.
REFERENCES = {"glass": ("bdpt", 1024), "keyhole": ("bdpt", 1024), "caustic-pool": ("sppm", 512)}


def block_luminances(path):
    """The luminance of each block of a Radiance file (Ward 1991), scanlines plain or run-length
    coded."""
    data = path.read_bytes()
    head, _, rest = data.partition(b"\n\n")
    line, _, body = rest.partition(b"\n")
    _, height, _, width = line.split()
    height, width = int(height), int(width)
    at = 0
    blocks = {}
    for y in range(height):
        planes = [bytearray() for _ in range(4)]
        if body[at : at + 2] == b"\x02\x02":
            at += 4
            for plane in planes:
                while len(plane) < width:
                    count = body[at]
                    if count > 128:
                        plane += body[at + 1 : at + 2] * (count - 128)
                        at += 2
                    else:
                        plane += body[at + 1 : at + 1 + count]
                        at += 1 + count
        else:
            for x in range(width):
                for c, plane in enumerate(planes):
                    plane.append(body[at + 4 * x + c])
            at += 4 * width
        for x, (r, g, b, e) in enumerate(zip(*planes)):
            block = x // BLOCK[0], y // BLOCK[1]
            light = (0.2126 * r + 0.7152 * g + 0.0722 * b) * 2.0 ** (e - 136) if e > 0 else 0
            blocks[block] = blocks.get(block, 0) + light
    return blocks


def missed_of(blocks, truth):
    """The light that the blocks miss, as a fraction of all light."""
    return sum(max(0, truth[at] - blocks[at]) for at in truth) / sum(truth.values())


class Renderer:
    def __init__(self, binary):
        self.binary = binary
        self.folder = tempfile.TemporaryDirectory()

    def render(self, scene, integrator, samples, seed):
        """Returns the luminances of the blocks and the printed figures."""
        picture = Path(self.folder.name) / "image.hdr"
        done = subprocess.run(
            [self.binary, "render", scene, "--integrator", integrator, "--samples", str(samples),
             "--seed", str(seed), "--size", SIZE, "--json", "-o", str(picture)],
            capture_output=True, text=True, check=False,
        )
        if done.returncode != 0:
            raise SystemExit(f"{scene} by {integrator}: {done.stderr}")
        return block_luminances(picture), json.loads(done.stdout)


def marks_of(figures, missed):
    light = figures["light_not_found"] or {"tiles": 0, "at_most": 0}
    return {
        "doubt": bool(figures["error"]["unreliable"]),
        "lacking": light["tiles"] > 0,
        "bound": light["at_most"] >= missed,
    }


class Group:
    """Images of one scene by one integrator."""

    def __init__(self):
        self.images = 0
        self.missing = 0
        self.marked = 0
        self.by = {"doubt": 0, "lacking": 0, "bound": 0}
        self.alarms = 0  # doubt or lacking in images that miss less than a tenth of MISSED

    def add(self, missed, marks):
        self.images += 1
        if missed > MISSED:
            self.missing += 1
            self.marked += any(marks.values())
            for kind, is_so in marks.items():
                self.by[kind] += is_so
        elif missed < MISSED / 10:
            self.alarms += marks["doubt"] or marks["lacking"]

    def __str__(self):
        by = "  ".join(f"{kind} {count}" for kind, count in self.by.items())
        return (f"{self.images:4} images  {self.missing:4} miss light  {self.marked:4} marked  "
                f"({by})  {self.alarms} alarms")


def main():
    options = argparse.ArgumentParser(usage=__doc__)
    options.add_argument("--binary", default="build/release/tessera")
    options.add_argument("--seeds", type=int, default=20)
    options.add_argument("--samples", default="8,32")
    options.add_argument("--short", action="store_true")
    asked = options.parse_args()
    seeds = 3 if asked.short else asked.seeds
    counts = [8] if asked.short else [int(n) for n in asked.samples.split(",")]
    renderer = Renderer(asked.binary)
    total = Group()
    for scene, (integrator, samples) in REFERENCES.items():
        truth, _ = renderer.render(scene, integrator, samples // (4 if asked.short else 1), 999)
        for by in INTEGRATORS:
            for count in counts:
                group = Group()
                for seed in range(1, seeds + 1):
                    blocks, figures = renderer.render(scene, by, count, seed)
                    missed = missed_of(blocks, truth)
                    marks = marks_of(figures, missed)
                    group.add(missed, marks)
                    total.add(missed, marks)
                print(f"{scene:12} {by:5} {count:3} samples: {group}", flush=True)
    print(f"all: {total}")
    if not asked.short or total.missing == 0:
        return 0 if total.missing > 0 else 1
    is_good = total.marked >= LEAST * total.missing
    is_blind = total.by["doubt"] >= LEAST * total.missing  # the planted fault
    return 0 if is_good and not is_blind else 1


if __name__ == "__main__":
    sys.exit(main())
