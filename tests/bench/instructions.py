#!/usr/bin/env python3
"""Instructions per sample, counted by callgrind, for machines whose times are too noisy.

    instructions.py PROGRAM [--functions N] [--split N] [SCENE...]   PROGRAM: instructions_bench

SCENE: a built-in one, GLTF, GLTF,HDR or GLTF,white; by default cornell-box, many-lights and
interior. The count is the difference of two renders of 8 and 24 samples, so that loading cancels.
--functions lists the most expensive ones; --split sets fixed splitting. Needs valgrind.
"""

import argparse
import pathlib
import re
import subprocess
import tempfile

SAMPLES = (8, 24)
SCENES = ("cornell-box", "many-lights", "interior")


def run(program, scene, samples, split, folder):
    """Instructions by function, and the program's output."""
    out = pathlib.Path(folder, f"{samples}.out")
    done = subprocess.run(
        ["valgrind", "--tool=callgrind", f"--callgrind-out-file={out}", program, scene,
         str(samples), *split], capture_output=True, text=True, check=True)
    said = subprocess.run(["callgrind_annotate", "--threshold=100", str(out)],
                          capture_output=True, text=True, check=True).stdout
    counts = {}
    for line in said.splitlines():
        found = re.match(r"\s*([\d,]+) (?:\([ \d.]+%\) )?\s*(.*)", line)
        if found and "PROGRAM TOTALS" not in line:
            # File and object add little; template arguments are too long.
            name = re.sub(r"^\S*?:|\s*\[.*?\]$", "", found[2])
            counts[name] = counts.get(name, 0) + int(found[1].replace(",", ""))
    return counts, done.stdout


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("program")
    parser.add_argument("--functions", type=int, default=0, metavar="N")
    parser.add_argument("--split", type=int, metavar="N")
    parser.add_argument("scenes", nargs="*")
    options = parser.parse_intermixed_args()
    split = [str(options.split)] if options.split else []
    for scene in options.scenes or SCENES:
        with tempfile.TemporaryDirectory() as folder:
            (few, _), (many, said) = (
                run(options.program, scene, n, split, folder) for n in SAMPLES)
        samples = int(said.split()[0]) * (SAMPLES[1] - SAMPLES[0])
        each = {name: (count - few.get(name, 0)) / samples for name, count in many.items()}
        rays = said.split(", ")[1].strip()
        print(f"{scene}: {sum(each.values()):.0f} instructions a sample, {rays}", flush=True)
        for name in sorted(each, key=each.get, reverse=True)[: options.functions]:
            print(f"  {each[name]:8.1f}  {name[:120]}")


if __name__ == "__main__":
    main()
