"""Changes of jobs, and other objects that clients make, each with what must be true once it is
acknowledged, for tests that kill."""

import dataclasses
import random
import threading
import uuid

from harness import job_body, triangle_glb

UNDER_WAY = frozenset({"queued", "loading", "rendering"})
ENDLESS = 65536  # samples per pixel, minutes of rendering; even, as both halves have the same


@dataclasses.dataclass(frozen=True)
class Facts:
    """What a job's owner knows about it. states is empty once the job is deleted."""

    states: frozenset
    name: str
    priority: int
    samples: int

    def hold(self, answer):
        if answer.status == 404:
            return not self.states
        job = answer.json()
        spec = job["spec"]
        return job["state"] in self.states and self == dataclasses.replace(
            self, name=spec["name"], priority=spec["priority"],
            samples=spec["stop"]["samples_per_pixel"],
        )


def patch(job, body):
    return "PATCH", f"/v1/jobs/{job}", body


# Name: (states in which it is tried, request for (job, number), the facts afterwards).
CHANGES = {
    "rename": (
        UNDER_WAY | {"paused", "finished", "cancelled"},
        lambda job, n: patch(job, {"name": f"name {n}", "priority": n % 4}),
        lambda facts, n: dataclasses.replace(facts, name=f"name {n}", priority=n % 4),
    ),
    "restrict": (
        UNDER_WAY | {"paused"},
        lambda job, n: patch(job, {"stop": {"samples_per_pixel": ENDLESS - 2 * n}}),
        lambda facts, n: dataclasses.replace(facts, samples=ENDLESS - 2 * n),
    ),
    "pause": (
        UNDER_WAY,
        lambda job, n: patch(job, {"paused": True}),
        lambda facts, n: dataclasses.replace(facts, states=frozenset({"paused"})),
    ),
    "resume": (
        frozenset({"paused"}),
        lambda job, n: patch(job, {"paused": False}),
        lambda facts, n: dataclasses.replace(facts, states=UNDER_WAY),
    ),
    "extend": (
        frozenset({"finished"}),
        lambda job, n: (
            "POST", f"/v1/jobs/{job}/extend", {"stop": {"samples_per_pixel": ENDLESS - 2 * n}}
        ),
        lambda facts, n: dataclasses.replace(facts, states=UNDER_WAY, samples=ENDLESS - 2 * n),
    ),
    "retry": (  # The job has failed for a want of memory that is over.
        frozenset({"failed"}),
        lambda job, n: ("POST", f"/v1/jobs/{job}/retry", None),
        lambda facts, n: dataclasses.replace(facts, states=UNDER_WAY),
    ),
    "cancel": (
        UNDER_WAY | {"paused"},
        lambda job, n: ("POST", f"/v1/jobs/{job}/cancel", None),
        lambda facts, n: dataclasses.replace(facts, states=frozenset({"cancelled"})),
    ),
    "delete": (
        frozenset({"cancelled", "finished"}),
        lambda job, n: ("DELETE", f"/v1/jobs/{job}", None),
        lambda facts, n: dataclasses.replace(facts, states=frozenset()),
    ),
}


def submit(server, job, samples=ENDLESS, **members):
    body = job_body(samples=samples, name="name 0", **members)
    return server.request("PUT", f"/v1/jobs/{job}", body)


def facts_of_new(samples=ENDLESS):
    return Facts(UNDER_WAY, "name 0", 0, samples)


class Owner:
    """Changes one job after another, and knows what each must be: one of several `facts` while a
    change has no answer. kill_next() kills the server right after the next acknowledged change."""

    def __init__(self, server, seed):
        self.server = server
        self.chance = random.Random(f"{seed} owner")
        self.lock = threading.Lock()
        self.jobs = {}  # id: the possible facts
        self.counts = dict.fromkeys(CHANGES, 0)
        self.armed, self.killed = threading.Event(), threading.Event()
        self.current, self.number = None, 0

    def act(self):
        """Makes one change. Raises OSError or HTTPException if the server is away."""
        with self.lock:
            if self.current is None:
                self.begin()
                return
            job, number = self.current, self.number + 1
            facts = self.settled(job)
            if not facts.states:
                self.current = None
                return
            names = [name for name, (states, *_) in CHANGES.items() if facts.states <= states]
            weights = [1 if name in ("cancel", "delete") else 3 for name in names]
            name = self.chance.choices(names, weights)[0]
            _, request, after = CHANGES[name]
            self.number = number
            self.jobs[job] = {facts, after(facts, number)}
            answer = self.server.request(*request(job, number))
            assert answer.status in (200, 202, 204, 429), (name, answer)
            done = answer.status != 429
            if done and self.armed.is_set():
                self.armed.clear()
                self.server.process.kill()
                self.killed.set()
            self.jobs[job] = {after(facts, number) if done else facts}
            self.counts[name] += done

    def begin(self):
        job = str(uuid.UUID(int=self.chance.getrandbits(128), version=4))
        answer = submit(self.server, job)
        assert answer.status in (201, 429), answer
        if answer.status == 201:
            self.jobs[job] = {facts_of_new()}
            self.current = job

    def settled(self, job):
        """The facts, after a look at the server if a change had no answer."""
        answer = self.server.get("/v1/jobs/" + job)
        self.jobs[job] = {f for f in self.jobs[job] if f.hold(answer)}
        assert self.jobs[job], (job, answer)
        return next(iter(self.jobs[job]))

    def check(self):
        """All acknowledged changes hold."""
        with self.lock:
            for job, possible in self.jobs.items():
                answer = self.server.get("/v1/jobs/" + job)
                assert any(f.hold(answer) for f in possible), (job, possible, answer)
            return len(self.jobs)

    def kill_next(self, timeout_s):
        self.killed.clear()
        self.armed.set()
        if not self.killed.wait(timeout_s):
            self.armed.clear()

    def leave(self):
        """Ends the current job."""
        with self.lock:
            if self.current is not None:
                _, request, after = CHANGES["cancel"]
                self.jobs[self.current] |= {after(f, 0) for f in self.jobs[self.current]}
                self.server.request(*request(self.current, 0))
                self.current = None


def restart_with(server, *flags):
    server.kill()
    kept = server.flags
    server.flags = [*kept, *flags]
    server.start()
    server.flags = kept


def survives(server, name, number):
    """Makes the change, kills the server right after the answer and checks the job afterwards."""
    states, request, after = CHANGES[name]
    job = str(uuid.UUID(int=random.Random(f"{name} {number}").getrandbits(128), version=4))
    samples = 8 if states == {"finished"} else ENDLESS
    # More than 1 MB of memory, for the change that needs a job that fails.
    film = {"film": {"width": 256, "height": 192, "layers": []}} if name == "retry" else {}
    assert submit(server, job, samples, **film).status == 201
    facts = facts_of_new(samples)
    if samples == ENDLESS:
        server.wait_for_samples(job)
    else:
        server.wait(job)
        facts = dataclasses.replace(facts, states=states)
    if name == "retry":
        restart_with(server, "--memory", "1M")
        assert server.wait(job)["state"] == "failed"
        restart_with(server)
        facts = dataclasses.replace(facts, states=states)
    if name in ("resume", "delete"):  # First into the state in which it is tried.
        first = "pause" if name == "resume" else "cancel"
        assert server.request(*CHANGES[first][1](job, number)).status == 200
        facts = CHANGES[first][2](facts, number)
    answer = server.request(*request(job, number))
    server.kill()
    assert answer.status in (200, 202, 204), (name, answer)
    server.start()
    now = server.get("/v1/jobs/" + job)
    assert after(facts, number).hold(now), (name, facts, now)
    server.post(f"/v1/jobs/{job}/cancel")


# Name: (makes it, of two finished jobs; path that shows it, from the answer; whether it can be
# deleted). Paths of lists show it by its id.
OBJECTS = {
    "asset": (
        lambda server, jobs: server.post(
            "/v1/assets", b"some bytes", {"Content-Type": "application/octet-stream"}
        ),
        lambda made: "/v1/assets/" + made["id"], True,
    ),
    "scene": (
        lambda server, jobs: server.post(
            "/v1/scenes", triangle_glb(), {"Content-Type": "model/gltf-binary"}
        ),
        lambda made: "/v1/scenes/" + made["id"], True,
    ),
    "preset": (
        lambda server, jobs: server.request(
            "PUT", "/v1/presets/p", {"job": {"stop": {"samples_per_pixel": 4}}}
        ),
        lambda made: "/v1/presets/p", True,
    ),
    "batch": (
        lambda server, jobs: server.post(
            "/v1/batches", {"template": job_body(), "matrix": {"seed": [1, 2]}}
        ),
        lambda made: "/v1/batches/" + made["id"], False,
    ),
    "comparison": (
        lambda server, jobs: server.post("/v1/comparisons", {"a": jobs[0], "b": jobs[1]}),
        lambda made: "/v1/comparisons/" + made["id"], False,
    ),
    "merged film": (
        lambda server, jobs: server.post("/v1/films/merge", {"films": jobs[:1]}),
        lambda made: f"/v1/jobs/{made['id']}/film", False,
    ),
    "key": (
        lambda server, jobs: server.post("/v1/keys", {"name": "x", "scopes": ["read"]}),
        lambda made: "/v1/keys", True,
    ),
    "signing key": (
        lambda server, jobs: server.post("/v1/signing-keys"),
        lambda made: "/v1/signing-keys", True,
    ),
}


def object_survives(server, name, jobs):
    """Makes the object, kills the server right after the answer and looks for it afterwards; then
    deletes it, kills the server right after that answer too, and looks again."""
    make, path_of, is_deleted = OBJECTS[name]
    answer = make(server, jobs)
    server.kill()
    server.start()
    assert answer.status in (200, 201, 202), (name, answer)
    made = answer.json()
    path = path_of(made)

    def is_there():
        found = server.get(path)
        is_list = path.endswith("keys")
        return found.status == 200 and (not is_list or made["id"] in found.body.decode())

    assert is_there(), (name, made)
    if is_deleted:
        one = f"{path}/{made['id']}" if path.endswith("keys") else path
        answer = server.request("DELETE", one)
        server.kill()
        server.start()
        assert answer.status == 204, (name, answer)
        assert not is_there(), (name, made)
