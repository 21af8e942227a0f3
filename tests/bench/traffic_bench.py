#!/usr/bin/env python3
"""Measures the service under traffic: small GETs, many streams, a large upload, a long list.
Prints, never asserts.

usage: traffic_bench.py BINARY HTTP_LOAD
"""

import http.client
import json
import os
import pathlib
import selectors
import socket
import sqlite3
import statistics
import subprocess
import sys
import tempfile
import time
import uuid

from service_bench import Server, cornell

STREAMS = 2000
UPLOAD_BYTES = 500_000_000
JOBS = 100_000


def load(program, server, path, connections, seconds=5):
    out = subprocess.run(
        [program, str(server.port), path, str(connections), str(seconds)],
        check=True,
        capture_output=True,
        text=True,
    ).stdout.split()
    return (
        f"{float(out[1]):9,.0f}/s   p50 {out[2]} ms   p99 {out[3]} ms   most {out[4]} ms   "
        f"({connections} connections)"
    )


def endless(server):
    return server.request("POST", "/v1/jobs", cornell(960, 540, 65536))["id"]


def status_kib(server, name):
    for line in pathlib.Path(f"/proc/{server.process.pid}/status").read_text().splitlines():
        if line.startswith(name + ":"):
            return int(line.split()[1])
    raise RuntimeError(name)


def gets(program, server):
    job = server.request("POST", "/v1/jobs", cornell(64, 36, 2))["id"]
    server.request("GET", f"/v1/jobs/{job}?wait=60")
    for path in ("/livez", f"/v1/jobs/{job}"):
        name = path.replace(job, "{id}")
        print(f"GET {name:14s} idle       {load(program, server, path, 64)}")
    busy = endless(server)
    for path in ("/livez", f"/v1/jobs/{job}", "/metrics"):
        name = path.replace(job, "{id}")
        print(f"GET {name:14s} rendering  {load(program, server, path, 8)}")
    server.request("POST", f"/v1/jobs/{busy}/cancel")


def samples_per_second(server, job, seconds=8):
    def now():
        view = server.request("GET", f"/v1/jobs/{job}")
        return view["progress"]["samples_per_pixel"]["mean"], time.monotonic()

    first, start = now()
    time.sleep(seconds)
    last, end = now()
    return (last - first) * 960 * 540 / (end - start)


def streams(program, server):
    job = endless(server)
    time.sleep(2)
    alone = samples_per_second(server, job)
    poll = selectors.DefaultSelector()
    lines = []
    for _ in range(STREAMS):
        line = socket.create_connection(("127.0.0.1", server.port))
        line.sendall(
            f"GET /v1/jobs/{job}/events HTTP/1.1\r\nHost: 127.0.0.1:{server.port}\r\n\r\n".encode()
        )
        line.setblocking(False)
        poll.register(line, selectors.EVENT_READ)
        lines.append(line)

    def drain(seconds):
        heard = {}
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            for key, _ in poll.select(0.1):
                heard[key.fd] = heard.get(key.fd, 0) + len(key.fileobj.recv(1 << 16))
        return heard

    drain(4)
    start = (
        server.request("GET", f"/v1/jobs/{job}")["progress"]["samples_per_pixel"]["mean"],
        time.monotonic(),
    )
    heard = drain(8)
    end = (
        server.request("GET", f"/v1/jobs/{job}")["progress"]["samples_per_pixel"]["mean"],
        time.monotonic(),
    )
    pace = (end[0] - start[0]) * 960 * 540 / (end[1] - start[1])
    print(
        f"streams      {len(heard)} of {STREAMS} heard something in 8 s, "
        f"{sum(heard.values()) / 8e6:.1f} MB/s; rendering at "
        f"{pace / alone:.2f} of its speed alone; {status_kib(server, 'VmRSS') / 1024:.0f} MB"
    )
    for line in lines:
        line.close()
    server.request("POST", f"/v1/jobs/{job}/cancel")


def upload(server, folder):
    path = os.path.join(folder, "large.bin")
    block = os.urandom(1 << 20)
    with open(path, "wb") as file:
        for at in range(0, UPLOAD_BYTES, len(block)):
            file.write(block[:UPLOAD_BYTES - at])
    copy = os.path.join(folder, "copy.bin")
    start = time.monotonic()
    with open(path, "rb") as source, open(copy, "wb") as file:
        while piece := source.read(1 << 20):
            file.write(piece)
        file.flush()
        os.fsync(file.fileno())
    disk = time.monotonic() - start
    before = status_kib(server, "VmRSS")
    connection = http.client.HTTPConnection("127.0.0.1", server.port, timeout=600)
    start = time.monotonic()
    with open(path, "rb") as file:
        connection.request("POST", "/v1/assets", file, {"Content-Type": "application/octet-stream",
                                                        "Content-Length": str(UPLOAD_BYTES)})
        response = connection.getresponse()
        response.read()
    taken = time.monotonic() - start
    if response.status != 201:
        raise RuntimeError(f"upload: {response.status}")
    print(
        f"upload       {UPLOAD_BYTES / taken / 1e6:.0f} MB/s with its SHA-256; "
        f"{UPLOAD_BYTES / disk / 1e6:.0f} MB/s is a copy with "
        f"fsync; memory +{max(status_kib(server, 'VmRSS') - before, 0) / 1024:.0f} MB"
    )


def listing(binary):
    """Copies the row of one finished job, as if that many had been submitted."""
    server = Server(binary)
    server.request(
        "GET", f"/v1/jobs/{server.request('POST', '/v1/jobs', cornell(64, 36, 2))['id']}?wait=60"
    )
    server.process.terminate()
    server.process.wait(30)
    database = next(
        path
        for path in pathlib.Path(server.data.name).rglob("*")
        if path.suffix in (".db", ".sqlite", ".sqlite3")
    )
    store = sqlite3.connect(database)
    columns = [row[1] for row in store.execute("PRAGMA table_info(jobs)")]
    row = list(store.execute("SELECT * FROM jobs").fetchone())
    record = json.loads(row[columns.index("record")])
    record |= {"film": 0, "film_bytes": 0, "film_digest": ""}
    for name, value in (("sequence", None), ("film", 0), ("film_bytes", 0),
                        ("record", json.dumps(record)), ("record_crc", -1)):
        row[columns.index(name)] = value
    key = columns.index("id")

    def rows():
        for _ in range(JOBS):
            row[key] = str(uuid.uuid4())
            yield row

    store.executemany(f"INSERT INTO jobs VALUES ({','.join('?' * len(columns))})", rows())
    store.commit()
    store.close()
    again = Server(binary, server.data)

    def delay(path):
        times = []
        for _ in range(20):
            begun = time.monotonic()
            again.request("GET", path)
            times.append(time.monotonic() - begun)
        return statistics.median(times) * 1e3

    cursor = again.request("GET", "/v1/jobs?limit=100").get("next_cursor")
    deep = f"/v1/jobs?limit=100&cursor={cursor}" if cursor else "/v1/jobs?limit=100"
    print(
        f"list         {JOBS:,} jobs: start {again.start_seconds:.2f} s; "
        f"100 newest {delay('/v1/jobs?limit=100'):.1f} ms, the next page "
        f"{delay(deep):.1f} ms, by state {delay('/v1/jobs?state=failed'):.1f} ms"
    )
    again.stop()


def main():
    binary, program = sys.argv[1:3]
    server = Server(binary)
    gets(program, server)
    streams(program, server)
    with tempfile.TemporaryDirectory(dir=os.path.dirname(server.data.name)) as folder:
        upload(server, folder)
    server.stop()
    listing(binary)


if __name__ == "__main__":
    main()
