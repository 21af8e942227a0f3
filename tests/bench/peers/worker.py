"""Runs one engine on one scene in a separate process, with that engine's interpreter.

usage: worker.py ADAPTER REPLIES

Reads one JSON request per line: {"do": "load", "job": {...}}, {"do": "render", "samples", "seed",
"output"}, {"do": "meter", "points", "samples", "seed"} and {"do": "end"}; answers with one line of
JSON each on the file descriptor REPLIES, since engines print to stdout.

An adapter is a module with a class Engine:
    Engine(job)   reads the scene; job: scene, environment (file or None), sky (RGB or None), width,
                  height, depth (scattering events), threads, variant, folder
    render(samples, seed)   (height, width, 3) linear floats; `samples` per pixel, independent for
                  each seed
    meter(points, samples, seed)   [[r, g, b], ...], irradiance at [position, normal]; optional
and, if they differ from those of this process: cpu_seconds(), peak_bytes(), rays() of the last
render, end().
"""
import importlib
import json
import os
import resource
import sys
import time
import traceback

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))

import numpy as np  # noqa: E402


def process_cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def process_peak_bytes(pid="self"):
    with open(f"/proc/{pid}/status") as file:
        return next(int(line.split()[1]) * 1024 for line in file if line.startswith("VmHWM:"))


def render(engine, request):
    cpu_seconds = getattr(engine, "cpu_seconds", process_cpu_seconds)
    cpu, wall = cpu_seconds(), time.monotonic()
    picture = engine.render(request["samples"], request["seed"])
    wall, cpu = time.monotonic() - wall, cpu_seconds() - cpu
    np.save(request["output"], np.ascontiguousarray(picture, dtype=np.float32))
    rays = engine.rays() if hasattr(engine, "rays") else None
    return {"wall": wall, "cpu": cpu, "rays": rays}


def main():
    adapter, replies = sys.argv[-2:]
    engine = None
    with os.fdopen(int(replies), "w") as out:
        for line in sys.stdin:
            request = json.loads(line)
            try:
                if request["do"] == "load":
                    job = request["job"]
                    os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:job["threads"]])
                    engine = importlib.import_module(adapter).Engine(job)
                    answer = {"version": engine.version}
                elif request["do"] == "render":
                    answer = render(engine, request)
                elif request["do"] == "meter":
                    answer = {"irradiance": engine.meter(request["points"], request["samples"],
                                                         request["seed"])}
                else:
                    answer = {"peak_bytes": getattr(engine, "peak_bytes", process_peak_bytes)()}
            except Exception as error:
                traceback.print_exc()
                answer = {"error": f"{type(error).__name__}: {error}"}
            out.write(json.dumps(answer) + "\n")
            out.flush()
            if request["do"] == "end":
                break
    if hasattr(engine, "end"):
        engine.end()
    os._exit(0)  # Skips the shutdown of engines, whose threads and modules may hang.


if __name__ == "__main__":
    main()
