#!/usr/bin/env python3
"""Measures what clients cost a render: CPU time of the server's other threads while ten clients
send ten requests a second each, ten follow the events, and four receive the tiles. Prints, never
asserts.

usage: api_load_bench.py BINARY [--seconds N] [--rounds N]

The job is interior at 960x540 on two threads. CPU time is compared, so that neither other load nor
the clients themselves, which share the processors, change the figures. The parts alternate; each
figure is the median over the rounds.
"""
import argparse
import os
import selectors
import socket
import statistics
import time

from service_bench import Server

THREADS = 2
CLIENTS = 10
REQUESTS_PER_SECOND = 10  # of each client
EVENT_STREAMS = 10
TILE_STREAMS = 4
WARM_UP_SECONDS = 6
PARTS = ("alone", "requests", "events", "tiles", "all")


class Threads:
    """CPU seconds of the render threads and of the rest of the process."""

    def __init__(self, server):
        self.server = server
        first = self.by_thread()
        time.sleep(WARM_UP_SECONDS)
        spent = {tid: at - first.get(tid, 0) for tid, at in self.by_thread().items()}
        # Nobody asks for anything yet: the busiest threads are those that render.
        self.render = sorted(spent, key=spent.get)[-THREADS:]

    def by_thread(self):
        seconds = {}
        folder = f"/proc/{self.server.process.pid}/task"
        for tid in os.listdir(folder):
            try:
                with open(f"{folder}/{tid}/schedstat", encoding="ascii") as file:
                    seconds[tid] = int(file.read().split()[0]) * 1e-9
            except FileNotFoundError:
                pass  # ended meanwhile
        return seconds

    def now(self):
        seconds = self.by_thread()
        render = sum(seconds[tid] for tid in self.render)
        return render, self.server.cpu_seconds() - render


class Load:
    """Clients of a part on one thread, until run() returns."""

    def __init__(self, server, job, part):
        self.port, self.requests, self.received = server.port, 0, {"events": 0, "tiles": 0}
        self.poll = selectors.DefaultSelector()
        self.path = f"/v1/jobs/{job}"
        self.clients = [self.connect(None) for _ in range(CLIENTS if part in ("requests", "all")
                                                          else 0)]
        for name, count in (("events", EVENT_STREAMS), ("tiles", TILE_STREAMS)):
            for _ in range(count if part in (name, "all") else 0):
                self.send(self.connect(name), f"{self.path}/{name}")

    def connect(self, name):
        line = socket.create_connection(("127.0.0.1", self.port))
        line.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        self.poll.register(line, selectors.EVENT_READ, name)
        return line

    def send(self, line, path):
        line.sendall(f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{self.port}\r\n\r\n".encode())

    def run(self, seconds):
        start = time.monotonic()
        rate = CLIENTS * REQUESTS_PER_SECOND
        while (passed := time.monotonic() - start) < seconds:
            while self.clients and self.requests < passed * rate:
                self.send(self.clients[self.requests % CLIENTS], self.path)
                self.requests += 1
            for key, _ in self.poll.select(0.5 / rate):
                size = len(key.fileobj.recv(1 << 20))
                if size == 0:
                    raise RuntimeError(f"the server ended a connection: {key.data}")
                if key.data:
                    self.received[key.data] += size

    def close(self):
        for key in list(self.poll.get_map().values()):
            self.poll.unregister(key.fileobj)
            key.fileobj.close()


def samples(server, job):
    return server.request("GET", f"/v1/jobs/{job}")["progress"]["samples_per_pixel"]["mean"]


def measure(server, job, threads, part, seconds):
    load = Load(server, job, part)
    load.run(2)  # the streams catch up with the film
    load.requests, received = 0, dict(load.received)
    drawn, start, (render, others) = samples(server, job), time.monotonic(), threads.now()
    load.run(seconds)
    drawn, passed = samples(server, job) - drawn, time.monotonic() - start
    render, others = (after - before for after, before in zip(threads.now(), (render, others)))
    load.close()
    return {"others": others, "wall": passed, "pace": drawn / render, "requests": load.requests,
            "bytes": {name: load.received[name] - received[name] for name in received}}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("binary")
    parser.add_argument("--seconds", type=float, default=15)
    parser.add_argument("--rounds", type=int, default=3)
    options = parser.parse_args()
    server = Server(options.binary, arguments=("--threads", str(THREADS)))
    job = server.request("POST", "/v1/jobs", {
        "scene": "interior", "film": {"width": 960, "height": 540},
        "stop": {"samples_per_pixel": 65536}})["id"]
    threads = Threads(server)
    runs = {part: [] for part in PARTS}
    for _ in range(options.rounds):
        for part in PARTS:
            runs[part].append(measure(server, job, threads, part, options.seconds))
    server.stop()

    def median(part, figure):
        return statistics.median(figure(run) for run in runs[part])

    def cost(run):
        return run["others"] / (THREADS * run["wall"])

    alone, pace = median("alone", cost), median("alone", lambda run: run["pace"])
    for part in PARTS:
        share = median(part, cost)
        line = f"{part:9s} {100 * share:5.2f} % of {THREADS} processors outside the render threads"
        if part != "alone":
            line += f", {100 * (share - alone):5.2f} % more than alone"
        line += f"; samples per CPU second {median(part, lambda run: run['pace']) / pace:.3f}"
        extra = (share - alone) * THREADS
        if part == "requests":
            each = extra / median(part, lambda run: run["requests"] / run["wall"])
            line += f"; {1e3 * each:.3f} ms a request"
        if part in ("events", "tiles"):
            count = EVENT_STREAMS if part == "events" else TILE_STREAMS
            rate = median(part, lambda run, name=part: run["bytes"][name] / run["wall"])
            line += (f"; {1e3 * extra / count:.2f} ms a second a stream, {rate / count / 1e6:.2f} "
                     "MB/s each")
        print(line)


if __name__ == "__main__":
    main()
