#!/usr/bin/env python3
"""Speed of features: million rays a CPU second, relative to the plain bottle under a map.

Renders one model with each feature, features in turn and in rounds, and prints the median over the
rounds. The model is the bottle of the folder of assets (TESSERA_ASSETS, ../shared/assets by
default); materials are written into copies of it.

usage: tests/bench/features_bench.py [--binary FILE] [--rounds N] [--samples N] [--size WxH]
                                     [--only PREFIX]
"""

import argparse
import json
import os
import statistics
import struct
import subprocess
import tempfile
from pathlib import Path

ASSETS = Path(os.environ.get("TESSERA_ASSETS",
                             Path(__file__).resolve().parents[2] / "../shared/assets"))
BOTTLE = ASSETS / "WaterBottle.glb"
MAP = ["--environment", str(ASSETS / "env/chinese_garden_1k.hdr")]
PLAIN = "plain"


def extension(name, **members):
    def change(document):
        for material in document["materials"]:
            material.setdefault("extensions", {})[name] = members
    return change


def members(**values):
    def change(document):
        for material in document["materials"]:
            for name, value in values.items():
                old = material.get(name)
                material[name] = {**old, **value} if isinstance(old, dict) else value
    return change


def glass(document):
    extension("KHR_materials_transmission", transmissionFactor=1)(document)
    extension("KHR_materials_volume", thicknessFactor=1)(document)
    for material in document["materials"]:
        pbr = material["pbrMetallicRoughness"]
        pbr.pop("metallicRoughnessTexture")
        pbr.update(metallicFactor=0, roughnessFactor=0)


def thin_wall(document):
    glass(document)
    for material in document["materials"]:
        material["extensions"].pop("KHR_materials_volume")


def soap(document):
    glass(document)
    extension("KHR_materials_iridescence", iridescenceFactor=1)(document)


def lamps(document):
    """Thirty-two point lights around the model."""
    lights = [{"type": "point", "intensity": 0.1}] * 32
    document.setdefault("extensions", {})["KHR_lights_punctual"] = {"lights": lights}
    for i in range(len(lights)):
        document["scenes"][0]["nodes"].append(len(document["nodes"]))
        at = [0.3 * (i % 4 - 1.5), 0.5 + 0.01 * i, 0.3 * (i // 4 % 4 - 1.5)]
        document["nodes"].append(
            {"translation": at, "extensions": {"KHR_lights_punctual": {"light": i}}})


# Name: flags, members of the job, change of the model.
LAYERS = ["beauty", "bounce:0", "bounce:1", "bounce:2-"]
FEATURES = {
    PLAIN: (MAP, {}, None),
    "direct": (MAP, {"integrator": {"type": "direct"}}, None),
    "depth of field": (MAP + ["--aperture", "0.01"], {}, None),
    "orthographic": (MAP, {"camera": {"type": "orthographic", "orthographic_height": 0.4}}, None),
    "panorama": (MAP, {"camera": {"type": "panorama", "position": [0.3, 0.1, 0.3],
                                  "target": [0, 0, 0]}}, None),
    "filter mitchell": (MAP, {"film": {"filter": {"type": "mitchell"}}}, None),
    "sun and sky": (["--sun", "48,11,2026-06-21T12:00:00+02:00"], {}, None),
    "sweep": (MAP + ["--ground", "sweep"], {}, None),
    "catcher": (MAP + ["--ground", "catcher"], {}, None),
    "studio, catcher": (["--preset", "studio", "--ground", "catcher"], {}, None),
    "polished catcher": (MAP + ["--ground", "catcher", "--ground-reflection", "1"], {}, None),
    "bounce layers": (MAP, {"film": {"layers": LAYERS}}, None),
    "light layers": (MAP, {"film": {"layers": ["beauty", "light:environment"]}}, None),
    "ris": (MAP + ["--light-sampler", "ris"], {}, None),
    "32 lamps": (MAP, {}, lamps),
    "1,000 lights": ("many-lights", {}, None),
    "blend": (MAP, {}, members(alphaMode="BLEND",
                               pbrMetallicRoughness={"baseColorFactor": [1, 1, 1, 0.6]})),
    "mask": (MAP, {}, members(alphaMode="MASK", alphaCutoff=0.5)),
    "clear coat": (MAP, {}, extension("KHR_materials_clearcoat", clearcoatFactor=1,
                                      clearcoatRoughnessFactor=0.05)),
    "sheen": (MAP, {}, extension("KHR_materials_sheen", sheenColorFactor=[0.5, 0.5, 0.5],
                                 sheenRoughnessFactor=0.5)),
    "iridescence": (MAP, {}, extension("KHR_materials_iridescence", iridescenceFactor=1)),
    "glass": (MAP, {}, glass),
    "glass with a film": (MAP, {}, soap),
    "thin wall": (MAP, {}, thin_wall),
    "leaf": (MAP, {}, extension("KHR_materials_diffuse_transmission",
                                diffuseTransmissionFactor=0.5)),
    "motion blur": (MAP + ["--shutter", "0.02"], {}, None),
    "fog": (MAP, {"medium": {"scattering": [1, 1, 1]}}, None),
    "spectral": (MAP + ["--spectral"], {}, None),
}


def changed_model(change, file):
    """Writes the bottle with a changed document; returns the file."""
    data = BOTTLE.read_bytes()
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20:20 + length])
    change(document)
    names = {name for part in [document, *document["materials"], *document["nodes"]]
             for name in part.get("extensions", {})}
    document["extensionsUsed"] = sorted(names)
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    rest = data[20 + length:]
    file.write_bytes(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text),
                                 0x4E4F534A) + text + rest)
    return file


def commands(binary, folder, options):
    out = {}
    for number, (name, (flags, job, change)) in enumerate(FEATURES.items()):
        if name != PLAIN and not name.startswith(options.only):
            continue
        job_file = folder / f"{number}.json"
        job_file.write_text(json.dumps(job))
        model = changed_model(change, folder / f"{number}.glb") if change else BOTTLE
        scene = [flags] if isinstance(flags, str) else [str(model), *flags]
        out[name] = [binary, "render", *scene, "--job", str(job_file), "--size", options.size,
                     "--samples", str(options.samples), "--threads", "1", "--json", "-o",
                     str(folder / "image.exr")]
    return out


def rate(command):
    """Million rays a CPU second."""
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise SystemExit(f"{' '.join(command)}: {done.stderr}")
    figures = json.loads(done.stdout)
    return figures["rays"] / figures["cpu_seconds"] / 1e6


def main():
    options = argparse.ArgumentParser(usage=__doc__)
    options.add_argument("--binary", default="build/release/tessera")
    options.add_argument("--rounds", type=int, default=3)
    options.add_argument("--samples", type=int, default=16)
    options.add_argument("--size", default="256x256")
    options.add_argument("--only", default="", metavar="PREFIX")
    options = options.parse_args()
    with tempfile.TemporaryDirectory() as name:
        all_commands = commands(options.binary, Path(name), options)
        rates = {feature: [] for feature in all_commands}
        for _ in range(options.rounds):
            for feature, command in all_commands.items():
                rates[feature].append(rate(command))
    medians = {feature: statistics.median(values) for feature, values in rates.items()}
    for feature, value in medians.items():
        print(f"{feature:18}{value:7.2f} Mrays/CPU s{value / medians[PLAIN]:7.2f}")


if __name__ == "__main__":
    main()
