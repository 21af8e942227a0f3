"""Clients that submit, cancel, pause, extend and delete the same jobs at the same time.

Afterwards the server is as empty as a new one: no job, no reserved memory, no file, and it renders.
"""

import collections
import os
import random
import threading
import time
import uuid

from harness import PATIENCE_S, Server, job_body

CLIENTS = 4
IDS = 6  # Clients share a few ids, so that they interfere.
# Valid answers to a call while others change the same job.
ALLOWED = {
    "put": {200, 201, 409, 429},
    "preview": {201, 429},
    "cancel": {200, 404},
    "pause": {200, 404, 409},
    "resume": {200, 404, 409},
    "extend": {202, 404, 409, 422, 429},
    "delete": {204, 404, 409},
    "image": {200, 404, 409},
}


class Churn:
    def __init__(self, server, seed):
        self.server = server
        self.ids = [str(uuid.UUID(int=i + 1, version=4)) for i in range(IDS)]
        self.stopped = threading.Event()
        self.faults = []
        self.counts = collections.Counter()
        self.threads = [
            threading.Thread(target=self.work, args=(random.Random(f"{seed} {i}"),), daemon=True)
            for i in range(CLIENTS)
        ]
        for thread in self.threads:
            thread.start()

    def work(self, chance):
        while not self.stopped.is_set():
            try:
                self.act(chance)
            except BaseException as fault:  # Reported by the checking thread.
                self.faults.append(fault)
                return
            time.sleep(chance.random() ** 2 * 0.02)

    def act(self, chance):
        name = chance.choice(self.ids)
        path = "/v1/jobs/" + name
        what = chance.choices(list(ALLOWED), (6, 1, 4, 2, 2, 2, 4, 1))[0]
        if what == "put":
            # Half of them end on their own. Equal bodies for an id, so that a second PUT is a
            # replay.
            samples = 65536 if self.ids.index(name) % 2 else 4
            answer = self.server.request("PUT", path, job_body(samples=samples))
        elif what == "preview":
            answer = self.server.post(
                "/v1/jobs", job_body(samples=64, preview_key="churn", **{"class": "preview"})
            )
        elif what in ("pause", "resume"):
            answer = self.server.request("PATCH", path, {"paused": what == "pause"})
        elif what == "extend":
            answer = self.server.post(path + "/extend", {"stop": {"samples_per_pixel": 8}})
        elif what == "image":
            answer = self.server.get(path + "/image.png")
        else:
            method, path = ("POST", path + "/cancel") if what == "cancel" else ("DELETE", path)
            answer = self.server.request(method, path)
        assert answer.status in ALLOWED[what], (what, answer)
        self.counts[what, answer.status] += 1

    def stop(self):
        self.stopped.set()
        for thread in self.threads:
            thread.join(PATIENCE_S)
            assert not thread.is_alive(), "a client hangs"
        assert not self.faults, self.faults


def metric(server, name):
    for line in server.get("/metrics").body.decode().splitlines():
        if line.startswith(name + " "):
            return float(line.split()[1])
    raise AssertionError("missing metric " + name)


BUSY = ("tessera_queue_jobs", "tessera_rendering_jobs", "tessera_held_memory_bytes")
EMPTY = (*BUSY, "tessera_film_cache_bytes")


def wait_until_empty(server, names=BUSY):
    """Waits until no job waits, runs or holds memory and, with EMPTY, there is no film; else
    reports the remainder."""
    deadline = time.monotonic() + PATIENCE_S
    while True:
        left = {name: metric(server, name) for name in names}
        if not any(left.values()):
            return
        assert time.monotonic() < deadline, left
        time.sleep(0.02)


def remove_all(server):
    while jobs := server.get("/v1/jobs?limit=200").json()["jobs"]:
        for job in jobs:
            server.post(f"/v1/jobs/{job['id']}/cancel")
            answer = server.request("DELETE", f"/v1/jobs/{job['id']}")
            assert answer.status in (204, 404), answer


def run(rounds, seconds, seed, say=lambda text: None):
    """Raises AssertionError on the first invalid answer, or on any leftovers."""
    # Memory for about three of the films: paused ones are parked on the disk.
    server = Server(
        "--checkpoint", "0.1", "--max-running", "2", "--max-queue", "8", "--memory", "32M"
    )
    server.start()
    try:
        for number in range(rounds):
            churn = Churn(server, f"{seed} {number}")
            time.sleep(seconds)
            churn.stop()
            assert server.alive(), server.log_text()
            remove_all(server)
            wait_until_empty(server, EMPTY)
            left = os.listdir(server.data + "/films")
            assert not left, left
            server.render(job_body())
            remove_all(server)
            counts = " ".join(
                f"{what}:{status}={count}" for (what, status), count in sorted(churn.counts.items())
            )
            say(f"round {number + 1}: {counts}")
    finally:
        server.close()
