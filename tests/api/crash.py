"""A server that is killed repeatedly while clients upload, submit, watch, and change their jobs.

After each kill, all acknowledged changes exist. Every second kill is right after an answer. At the
end every film has the digest of an uninterrupted one, and the data directory is valid.
"""

import hashlib
import http.client
import json
import random
import threading
import time
import uuid

from changes import Owner
from harness import PATIENCE_S, Server, job_body, tessera, triangle_glb
from webhooks_test import Receiver

BYTES = {"Content-Type": "application/octet-stream"}
GLB = {"Content-Type": "model/gltf-binary"}
KINDS = 6
SAMPLES = (16, 32, 512)  # The last one takes long enough for checkpoints.


def body_of_kind(kind):
    body = job_body(samples=SAMPLES[kind % 3], seed=kind // 3)
    body["film"]["layers"] = ["normal"] if kind % 2 else []
    return body


class Clients:
    """Uploads and submits continuously, a half of the jobs with a webhook; remembers only
    acknowledged changes."""

    def __init__(self, server, seed, hook):
        self.server = server
        self.hook, self.hooked = hook, set()
        self.lock = threading.Lock()
        self.assets, self.scenes, self.jobs = {}, set(), {}
        self.stopped = threading.Event()
        self.resting = threading.Event()
        self.faults = []
        self.owner = Owner(server, seed)
        self.threads = [
            threading.Thread(
                target=self.work, args=(act, random.Random(f"{seed} {i}")), daemon=True
            )
            for i, act in enumerate(
                (self.upload, self.upload_scene, self.submit, self.put, self.look, self.change)
            )
        ]
        for thread in self.threads:
            thread.start()

    def work(self, act, chance):
        while not self.stopped.is_set():
            try:
                act(chance)
            except (OSError, http.client.HTTPException):
                time.sleep(0.02)  # The server was killed or is not ready yet.
            except BaseException as fault:  # Reported by the checking thread.
                self.faults.append(fault)
                return
            self.stopped.wait(chance.random() * 0.05)

    def upload(self, chance):
        data = chance.randbytes(chance.randrange(1, 1 << 20))
        answer = self.server.post("/v1/assets", data, BYTES)
        if answer.status in (200, 201):
            assert answer.json()["id"] == hashlib.sha256(data).hexdigest()
            with self.lock:
                self.assets[answer.json()["id"]] = len(data)

    def upload_scene(self, chance):
        glb = triangle_glb(nodes=[{"mesh": 0, "name": f"n{chance.random()}"}])
        answer = self.server.post("/v1/scenes", glb, GLB)
        if answer.status in (200, 201):
            with self.lock:
                self.scenes.add(answer.json()["id"])

    def remember(self, answer, kind):
        if answer.status in (200, 201):
            with self.lock:
                self.jobs[answer.json()["id"]] = kind
        else:
            assert answer.status == 429, answer

    def submit(self, chance):
        kind = chance.choice((0, 1, 3, 4, 0, 1, 3, 4, 2, 5))
        key = {"Idempotency-Key": str(chance.random())}
        body = body_of_kind(kind)
        if chance.random() < 0.5:
            body["webhook"] = {"url": self.hook}
        for _ in range(2):  # A client without an answer asks again, and there is one job.
            answer = self.server.post("/v1/jobs", body, key)
            self.remember(answer, kind)
            if "webhook" in body and answer.status in (200, 201):
                self.hooked.add(answer.json()["id"])

    def put(self, chance):
        kind = chance.choice((0, 1, 3, 4, 0, 1, 3, 4, 2, 5))
        name = uuid.UUID(int=chance.getrandbits(128), version=4)
        answer = self.server.request("PUT", f"/v1/jobs/{name}", body_of_kind(kind))
        self.remember(answer, kind)

    def look(self, chance):
        with self.lock:
            jobs = list(self.jobs)
        if jobs:
            self.server.get(f"/v1/jobs/{chance.choice(jobs)}/image.png")

    def change(self, chance):
        self.owner.act()

    def stop(self):
        self.stopped.set()
        for thread in self.threads:
            thread.join(PATIENCE_S)


def check_acknowledged(server, clients, chance):
    with clients.lock:
        assets, scenes, jobs = dict(clients.assets), set(clients.scenes), dict(clients.jobs)
    for asset in chance.sample(sorted(assets), min(20, len(assets))):
        answer = server.get("/v1/assets/" + asset)
        assert answer.status == 200 and len(answer.body) == assets[asset], (asset, answer.status)
        assert hashlib.sha256(answer.body).hexdigest() == asset
    for scene in chance.sample(sorted(scenes), min(20, len(scenes))):
        assert server.get("/v1/scenes/" + scene).status == 200, scene
    for job, kind in jobs.items():
        answer = server.get("/v1/jobs/" + job)
        assert answer.status == 200, (job, answer)
        spec = answer.json()["spec"]
        assert spec["seed"] == kind // 3, spec
        assert spec["stop"] == {"samples_per_pixel": SAMPLES[kind % 3]}, spec
        assert answer.json()["state"] != "failed", answer
    return len(assets), len(scenes), len(jobs), clients.owner.check()


def wait_for_all(server, jobs):
    """Waits for jobs to end. The machine may be slow: the timeout is for the next sample, not for
    the whole job."""
    ends, seen, deadline = {}, None, 0
    while len(ends) < len(jobs):
        now = {}
        for job in set(jobs) - set(ends):
            found = server.job(job)
            now[job] = (found["state"], found["progress"]["samples_per_pixel"]["mean"])
            if found["state"] in ("finished", "failed", "cancelled"):
                ends[job] = found
        if now != seen:
            seen, deadline = now, time.monotonic() + PATIENCE_S
        assert time.monotonic() < deadline, seen
        time.sleep(0.05)
    return ends


def check_webhooks(receiver, jobs):
    """Each job's end is reported: once, or several times under one name."""
    names = {}
    while not jobs <= set(names):
        _, headers, body, _ = receiver.next()
        names.setdefault(json.loads(body)["data"]["id"], set()).add(headers["webhook-id"])
    assert all(len(each) == 1 for each in names.values()), names


def run(kills, seed, say=lambda text: None):
    """Kills `kills` times; raises AssertionError on the first lost or different result."""
    chance = random.Random(seed)
    server = Server("--checkpoint", "0.2", "--max-queue", "8", "--webhook-private")
    server.start()
    receiver = Receiver()
    clients = None
    try:
        calm = {kind: server.render(body_of_kind(kind))["film_digest"] for kind in range(KINDS)}
        clients = Clients(server, seed, receiver.url)
        for kill in range(kills):
            time.sleep(chance.random() ** 2 * 1.5)
            if kill % 2:
                clients.owner.kill_next(timeout_s=5)
            server.kill()
            server.start(chance.randrange(1, 4))
            counts = check_acknowledged(server, clients, chance)
            assert not clients.faults, clients.faults
            say(
                f"kill {kill + 1}: {counts[0]} assets, {counts[1]} scenes, "
                f"{counts[2]} jobs are there, {counts[3]} more as their owner changed them"
            )
        clients.stop()
        clients.owner.leave()
        check_acknowledged(server, clients, chance)
        assert not clients.faults, clients.faults
        ends = wait_for_all(server, clients.jobs)
        for job, kind in clients.jobs.items():
            done = ends[job]
            assert done["state"] == "finished", done
            assert done["film_digest"] == calm[kind], (job, kind)
        check_webhooks(receiver, clients.hooked)
        listed, cursor = set(), None
        while True:
            page = server.get("/v1/jobs?limit=200" + (f"&cursor={cursor}" if cursor else "")).json()
            listed |= {job["id"] for job in page["jobs"]}
            cursor = page["next"]
            if cursor is None:
                break
        assert set(clients.jobs) <= listed
        server.stop()
        code, said, complaints = tessera("check", "--json", "--data", server.data)
        assert code == 0, said + complaints
        found = json.loads(said)
        say(f"{found['jobs']} jobs, {found['films']} films, {found['assets']} assets: sound; "
            f"left over: {len(found['leftovers'])}")
        return found
    finally:
        if clients is not None:
            clients.stopped.set()
        server.close()
        receiver.close()
