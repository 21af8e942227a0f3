"""Renders a scenario of Khronos' glTF render fidelity comparison, as its external renderer.

    python render_fidelity.py [--root FOLDER] '{"scenario": {...}, "outputFile": "a.png"}'

The tools of model-viewer's package render-fidelity-tools call such a command with one JSON
argument: `renderers` of its config has {"command": {"executable": "python", "args":
["render_fidelity.py"]}}. Paths of model and lighting count from FOLDER, by default from here.
Images have Khronos' PBR Neutral tone curve.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path
from typing import Any

from tessera_render import Client

# The goldens have two pixels for each of a scenario's: DEVICE_PIXEL_RATIO of the tools' common.ts.
PIXEL_RATIO = 2
# What the tools' config-reader.ts fills in.
DEFAULTS: dict[str, Any] = {
    "dimensions": {"width": 768, "height": 768}, "target": {"x": 0, "y": 0, "z": 0},
    "orbit": {"theta": 0, "phi": 90, "radius": 1}, "verticalFoV": 45, "renderSkybox": False,
    "clearColor": {"r": 0, "g": 0, "b": 0, "a": 0},
}  # fmt: skip


def job_of(scenario: dict[str, Any], lighting: str) -> dict[str, Any]:
    """The job of a scenario; lighting: id of the uploaded environment."""
    seen = {name: {**value, **scenario.get(name, {})} if isinstance(value, dict)
            else scenario.get(name, value) for name, value in DEFAULTS.items()}  # fmt: skip
    size, target, orbit, clear = (seen[n] for n in ("dimensions", "target", "orbit", "clearColor"))
    background: dict[str, Any] = {"type": "transparent"}
    if seen["renderSkybox"]:
        background = {"type": "environment"}
    elif clear["a"] > 0:
        background = {"type": "color", "color": [clear[c] for c in "rgb"]}
    return {
        "name": scenario.get("name", ""),
        "camera": {
            "orbit": {"theta_degrees": orbit["theta"], "phi_degrees": orbit["phi"],
                      "radius": orbit["radius"], "target": [target[axis] for axis in "xyz"]},
            "vertical_fov_degrees": seen["verticalFoV"],
        },
        "environment": {"asset": lighting},
        "background": background,
        "film": {"width": size["width"] * PIXEL_RATIO, "height": size["height"] * PIXEL_RATIO},
        "stop": {"samples_per_pixel": scenario.get("pt", {}).get("numSamples", 1024)},
    }  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(description="Renders a scenario of the fidelity comparison.")
    parser.add_argument("--root", type=Path, default=Path())
    parser.add_argument("config", type=json.loads)
    options = parser.parse_args()
    scenario = options.config["scenario"]
    with Client() as client:
        lighting = client.upload_asset(options.root / scenario["lighting"])
        job = client.submit(options.root / scenario["model"], request=job_of(scenario, lighting))
        job.wait().save(options.config["outputFile"], tonemap="khronos-neutral")
        print(f"{scenario.get('name', '')}: error {job.error}")


if __name__ == "__main__":
    main()
