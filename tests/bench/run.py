#!/usr/bin/env python3
"""Prints what the product costs: the renderer alone, the start of its programs, the service around it.

    tests/bench/run.py [--build DIR] [--short] [--threads N]

Prints, never asserts: times belong to a machine and a moment; ratios are of figures of one run. Exits
non-zero only when something could not be measured. Standard library only.
"""
import argparse
import http.client
import json
import os
import pathlib
import signal
import statistics
import struct
import subprocess
import sys
import tempfile
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
TILE_HEADER = struct.Struct("<4sIIHHHHIfI")


class Server:
    """`tessera serve` on a free port with a data folder of its own."""

    def __init__(self, binary, threads):
        self.data = tempfile.TemporaryDirectory(prefix="tessera-bench-")
        began = time.perf_counter()
        self.process = subprocess.Popen(
            [binary, "serve", "--port", "0", "--data", self.data.name, "--threads", str(threads),
             "--log-level", "off"], stdout=subprocess.PIPE, text=True)
        line = self.process.stdout.readline()
        self.start_seconds = time.perf_counter() - began
        self.host = line.rsplit("http://", 1)[1].strip()

    def request(self, method, path, body=None):
        connection = http.client.HTTPConnection(self.host, timeout=120)
        text = json.dumps(body) if body is not None else None
        connection.request(method, path, text, {"Content-Type": "application/json"})
        answer = connection.getresponse()
        data = answer.read()
        if answer.status >= 400:
            raise RuntimeError(f"{method} {path}: {answer.status} {data[:300]!r}")
        return json.loads(data) if data else None

    def finish(self, job_id):
        while True:
            job = self.request("GET", f"/v1/jobs/{job_id}?wait=20")
            if job["state"] in ("finished", "failed", "cancelled"):
                return job

    def stop(self):
        self.process.send_signal(signal.SIGTERM)
        self.process.wait(30)
        self.data.cleanup()


def start_seconds(command, repeats=10):
    times = []
    for _ in range(repeats):
        began = time.perf_counter()
        subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        times.append(time.perf_counter() - began)
    return statistics.median(times)


def job(samples, width, height, scene="cornell-box", layers=()):
    return {"scene": scene, "film": {"width": width, "height": height, "layers": list(layers)},
            "integrator": {"max_depth": 9}, "stop": {"samples_per_pixel": samples}}


def first_pass_seconds(server):
    """From the POST until every tile of cornell-box at 480x270 has come over the tile stream."""
    began = time.perf_counter()
    job_id = server.request("POST", "/v1/jobs", job(64, 480, 270))["id"]
    connection = http.client.HTTPConnection(server.host, timeout=60)
    connection.request("GET", f"/v1/jobs/{job_id}/tiles")
    stream = connection.getresponse()
    covered = set()
    pixels = 0
    while pixels < 480 * 270:
        head = TILE_HEADER.unpack(stream.read(TILE_HEADER.size))
        stream.read(head[1])
        place, size = head[3:5], head[5:7]
        if not head[7] & 1 and place not in covered:
            covered.add(place)
            pixels += size[0] * size[1]
        elif head[7] & 1:
            break
    seconds = time.perf_counter() - began
    connection.close()
    server.request("POST", f"/v1/jobs/{job_id}/cancel")
    server.finish(job_id)
    return seconds


def render_alone(binary, request, threads):
    """elapsed_seconds of `tessera render` for the same request."""
    with tempfile.TemporaryDirectory() as folder:
        path = pathlib.Path(folder, "job.json")
        path.write_text(json.dumps(request), encoding="utf-8")
        done = subprocess.run(
            [binary, "render", "--job", str(path), "-o", str(pathlib.Path(folder, "o.exr")), "--json",
             "--threads", str(threads)], capture_output=True, text=True, check=True)
        return json.loads(done.stdout)


def measure_service(binary, threads, samples):
    server = Server(binary, threads)
    try:
        print(f"serve        {server.start_seconds * 1000:.0f} ms from start to listening")
        server.finish(server.request("POST", "/v1/jobs", job(2, 64, 64))["id"])  # loads the scene
        times = sorted(first_pass_seconds(server) for _ in range(5))
        print(f"first pass   {times[2] * 1000:.0f} ms from POST to every tile on the wire, cornell-box "
              f"480x270 ({times[0] * 1000:.0f} to {times[-1] * 1000:.0f})")
        request = job(samples, 512, 512)
        ratios = []
        for _ in range(3):
            served = server.finish(server.request("POST", "/v1/jobs", request)["id"])
            alone = render_alone(binary, request, threads)
            ratios.append((served["progress"]["elapsed_seconds"] / alone["elapsed_seconds"],
                           served["progress"]["cpu_seconds"] / alone["cpu_seconds"]))
            if served.get("film_digest") != alone["film_digest"]:
                print("service      WARNING: not the same film as `tessera render`")
        wall = statistics.median(r[0] for r in ratios)
        cpu = statistics.median(r[1] for r in ratios)
        print(f"service      {(wall - 1) * 100:+.1f} % wall, {(cpu - 1) * 100:+.1f} % CPU against `tessera "
              f"render`, cornell-box 512x512, {samples} samples, median of 3")
        memory = pathlib.Path(f"/proc/{server.process.pid}/status").read_text(encoding="utf-8")
        peak = next(line.split()[1] for line in memory.splitlines() if line.startswith("VmHWM"))
        print(f"memory       {int(peak) / 1024:.0f} MB at most in the server")
    finally:
        server.stop()


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--build", default=str(ROOT / "build/release"))
    parser.add_argument("--threads", type=int, default=min(2, os.cpu_count() or 1))
    parser.add_argument("--short", action="store_true", help="a minute in all")
    args = parser.parse_args()
    binary = str(pathlib.Path(args.build, "tessera").resolve())
    core_bench = pathlib.Path(args.build, "tests/core_bench")
    samples = 16 if args.short else 64

    load = os.getloadavg()[0]
    print(f"{args.threads} threads, load {load:.1f}" + (" (busy: times are upper bounds)" if load > 1 else ""))
    if core_bench.exists():
        subprocess.run([core_bench, str(samples), str(args.threads)], check=True)
    print(f"start        {start_seconds([binary, '--version']) * 1000:.1f} ms for a client verb, "
          f"{start_seconds([binary, 'serve', '--help'], 5) * 1000:.0f} ms for serve --help")
    with tempfile.TemporaryDirectory() as folder:
        one = start_seconds([binary, "render", "cornell-box", "-o", f"{folder}/a.exr", "--size", "8x8",
                             "--spp", "1"], 5)
    print(f"render       {one * 1000:.0f} ms from start to the end of an 8x8 picture with one sample")
    measure_service(binary, args.threads, samples)
    return 0


if __name__ == "__main__":
    sys.exit(main())
