#!/usr/bin/env python3
"""Measures the service: start-up, time to the first image, overhead. Prints, never asserts.

usage: service_bench.py BINARY [--short]
"""
import http.client
import json
import os
import statistics
import struct
import subprocess
import sys
import tempfile
import time

TILE_HEADER = struct.Struct("<4sIIHHHHIfI")


class Server:
    """The real binary on a free port, with a separate data directory."""

    def __init__(self, binary, data=None, arguments=()):
        self.data = data or tempfile.TemporaryDirectory()
        start = time.monotonic()
        self.process = subprocess.Popen(
            [binary, "serve", "--port", "0", "--data", self.data.name, *arguments],
            stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        line = self.process.stdout.readline()
        self.start_seconds = time.monotonic() - start
        self.port = int(line.rsplit(":", 1)[1])

    def request(self, method, path, body=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=300)
        headers = {"Content-Type": "application/json"} if body is not None else {}
        connection.request(method, path, None if body is None else json.dumps(body), headers)
        response = connection.getresponse()
        data = response.read()
        connection.close()
        if response.status >= 400:
            raise RuntimeError(f"{method} {path}: {response.status} {data[:300]!r}")
        return json.loads(data) if data else None

    def cpu_seconds(self):
        with open(f"/proc/{self.process.pid}/stat", encoding="ascii") as stat:
            fields = stat.read().rpartition(")")[2].split()
        return sum(int(ticks) for ticks in fields[11:15]) / os.sysconf("SC_CLK_TCK")

    def stop(self):
        self.process.terminate()
        self.process.wait(30)
        self.data.cleanup()


def cornell(width, height, samples):
    return {"scene": "cornell-box", "film": {"width": width, "height": height},
            "stop": {"samples_per_pixel": samples}}


def first_pass_seconds(server):
    """POST until the tile frames of a complete pass have been read."""
    start = time.monotonic()
    job = server.request("POST", "/v1/jobs", cornell(480, 270, 64))
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=60)
    connection.request("GET", f"/v1/jobs/{job['id']}/tiles?after=0")
    stream = connection.getresponse()
    seen = set()
    first = None
    while len(seen) < 15 * 9:
        head = stream.read(TILE_HEADER.size)
        if len(head) < TILE_HEADER.size:
            break
        magic, size, _, x, y, _, _, _, _, _ = TILE_HEADER.unpack(head)
        assert magic == b"TSR1"
        stream.read(size)
        first = first or time.monotonic() - start
        seen.add((x, y))
    whole = time.monotonic() - start
    connection.close()
    server.request("POST", f"/v1/jobs/{job['id']}/cancel")
    return first, whole


def denoised_seconds(server, after):
    """Time from POST to the first denoised image, requested as often as by the page; CPU seconds of
    the server in that time; and the fraction of the `after` seconds that follow spent on further
    ones."""
    start = time.monotonic()
    start_cpu = server.cpu_seconds()
    job = server.request("POST", "/v1/jobs", {
        "scene": "interior", "film": {"width": 960, "height": 540},
        "stop": {"samples_per_pixel": 65536}})
    path = f"/v1/jobs/{job['id']}"

    def picture():
        connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=300)
        connection.request("GET", path + "/image.png?denoise=mixed")
        response = connection.getresponse()
        response.read()
        connection.close()
        return response.status

    while picture() != 200:  # a pixel has no samples of one half yet
        time.sleep(0.3)
    first = time.monotonic() - start
    first_cpu = server.cpu_seconds() - start_cpu
    by_revision = {}
    begin = time.monotonic()
    while time.monotonic() - begin < after:
        picture()
        denoised = server.request("GET", path)["denoised"]
        by_revision[denoised["revision"]] = denoised["seconds"]
        time.sleep(0.3)
    spent = time.monotonic() - begin
    server.request("POST", path + "/cancel")
    del by_revision[min(by_revision)]
    return first, first_cpu, sum(by_revision.values()) / spent, len(by_revision)


def job_seconds(server, samples):
    start = time.monotonic()
    job = server.request("POST", "/v1/jobs", cornell(480, 270, samples))
    while True:
        job = server.request("GET", f"/v1/jobs/{job['id']}?wait=60")
        if job["state"] in ("finished", "failed", "cancelled"):
            return time.monotonic() - start


def main():
    binary = sys.argv[1]
    short = "--short" in sys.argv
    server = Server(binary)
    print(f"start        {server.start_seconds * 1e3:.0f} ms from process start to 'listening'")
    rounds = [first_pass_seconds(server) for _ in range(3 if short else 15)]
    for name, values in (
        ("first tile", [r[0] for r in rounds]),
        ("first pass", [r[1] for r in rounds]),
    ):
        values = sorted(v * 1e3 for v in values)
        print(
            f"{name:12s} {statistics.median(values):.0f} ms median, "
            f"{values[-1]:.0f} ms worst of {len(values)}, "
            "from POST to bytes read, cornell-box 480x270"
        )
    after = 10 if short else 60
    first, first_cpu, share, count = denoised_seconds(server, after)
    print(f"denoised     {first:.1f} s ({first_cpu:.1f} s of CPU) from POST to the first denoised "
          f"picture, interior 960x540; {100 * share:.1f} % of {after} s after for {count} more")
    samples = 32 if short else 256
    ratios = []
    for _ in range(1 if short else 3):  # interleaved: the machine is shared
        service = job_seconds(server, samples)
        with tempfile.TemporaryDirectory() as folder:
            start = time.monotonic()
            subprocess.run(
                [
                    binary,
                    "render",
                    "cornell-box",
                    "-o",
                    os.path.join(folder, "a.exr"),
                    "--spp",
                    str(samples),
                    "--size",
                    "480x270",
                ],
                check=True,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
            )
            ratios.append(service / (time.monotonic() - start))
    print(
        f"overhead     service / `tessera render` = {statistics.median(ratios):.3f} in wall time, "
        f"{samples} samples per pixel"
    )
    server.stop()


if __name__ == "__main__":
    main()
