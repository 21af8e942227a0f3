"""Quotas: storage and running jobs of a key, storage of the whole server, and their errors."""

import hashlib
import os
import unittest

from harness import Server, Stream, job_body, tessera, triangle_glb, wait_for

BYTES = {"Content-Type": "application/octet-stream"}
GLB = {"Content-Type": "model/gltf-binary"}
LONG = {"experiment": "pi", "n": [16, 100_000_000], "replicates": 8}
SHORT = {"experiment": "pi", "n": [4], "replicates": 2}


class Quotas(unittest.TestCase):
    FLAGS = ()

    def setUp(self):
        self.server = Server("--key", "operators-own", *self.FLAGS, key="operators-own")
        self.addCleanup(self.server.close)
        self.mine, self.other = self.add_key("mine"), self.add_key("other")
        self.server.start()

    def add_key(self, name):
        code, key, said = tessera("keys", "add", name, "--data", self.server.data)
        self.assertEqual(code, 0, said)
        return key.strip()

    def ask(self, key, method, path, body=None, headers=None):
        return self.server.request(
            method, path, body, {"Authorization": "Bearer " + key, **(headers or {})}
        )

    def assert_over_quota(self, answer, *pointers):
        self.assertEqual(answer.status, 507, answer)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        problem = answer.json()
        self.assertEqual(problem["type"], "/docs#problem-over-quota")
        self.assertEqual([e["pointer"] for e in problem.get("errors", [])], list(pointers), problem)

    def stored(self):
        """Bytes reported by the metrics, by kind."""
        lines = self.server.get("/metrics").body.decode().splitlines()
        return {
            line.split('"')[1]: int(line.split()[1])
            for line in lines
            if line.startswith("tessera_stored_bytes{")
        }


class AssetsOfAKey(Quotas):
    FLAGS = ("--quota-storage", "100K")

    def test_exceeding_the_quota_is_507_until_something_is_deleted(self):
        first, second = os.urandom(60_000), os.urandom(60_000)
        kept = self.ask(self.mine, "POST", "/v1/assets", first, BYTES)
        self.assertEqual(kept.status, 201, kept)
        self.assert_over_quota(self.ask(self.mine, "POST", "/v1/assets", second, BYTES))
        # Chunked, without a length.
        pieces = (second[at:at + 10_000] for at in range(0, len(second), 10_000))
        self.assert_over_quota(self.ask(self.mine, "POST", "/v1/assets", pieces, BYTES))
        named = "/v1/assets/" + hashlib.sha256(second).hexdigest()
        self.assert_over_quota(self.ask(self.mine, "PUT", named, second, BYTES))
        self.assertEqual(self.stored()["assets"], 60_000)
        # Existing content takes no more space.
        known = "/v1/assets/" + hashlib.sha256(first).hexdigest()
        self.assertEqual(self.ask(self.mine, "PUT", known, first, BYTES).status, 200)
        # Others have their own quota, and the operator has none.
        self.assertEqual(
            self.ask(self.other, "POST", "/v1/assets", os.urandom(100_000), BYTES).status, 201
        )
        self.assertEqual(
            self.ask("operators-own", "POST", "/v1/assets", os.urandom(300_000), BYTES).status, 201
        )
        self.assertEqual(self.ask(self.mine, "DELETE", known).status, 204)
        pieces = (second[at:at + 10_000] for at in range(0, len(second), 10_000))
        self.assertEqual(self.ask(self.mine, "POST", "/v1/assets", pieces, BYTES).status, 201)
        self.assertEqual(
            self.ask(self.mine, "POST", "/v1/assets", os.urandom(102_400 - 60_000), BYTES).status,
            201,
        )
        self.assert_over_quota(self.ask(self.mine, "POST", "/v1/assets", b"x", BYTES))

    def test_scene_counts_with_its_files(self):
        large = triangle_glb(extras={"padding": "x" * 110_000})
        self.assert_over_quota(self.ask(self.mine, "POST", "/v1/scenes", large, GLB))
        self.assertEqual(self.stored()["assets"], 0)
        small = triangle_glb(extras={"padding": "x" * 60_000})
        self.assertEqual(self.ask(self.mine, "POST", "/v1/scenes", small, GLB).status, 201)
        self.assertEqual(self.ask(self.mine, "POST", "/v1/scenes", small, GLB).status, 200)
        self.assert_over_quota(self.ask(self.mine, "POST", "/v1/assets", os.urandom(60_000), BYTES))

    def test_shows_the_limit(self):
        limits = self.server.get("/v1/server").json()["limits"]
        self.assertEqual(limits["stored_bytes_of_a_key"], 100 << 10)
        self.assertGreater(limits["stored_bytes"], 0)


class FilmsOfAKey(Quotas):
    FLAGS = ("--quota-storage", "700K")  # A film of 48 x 32 takes up to 0.45 M while it renders.

    def submit(self, key, **members):
        return self.ask(key, "POST", "/v1/jobs", job_body(**members))

    def test_job_whose_film_does_not_fit_is_507_at_film(self):
        held = self.submit(self.mine, samples=65536)
        self.assertEqual(held.status, 201, held)
        self.assert_over_quota(self.submit(self.mine, samples=2), "/film")
        name = "/v1/jobs/6f3c1b52-0a51-4b0e-9a55-000000000001"
        self.assert_over_quota(self.ask(self.mine, "PUT", name, job_body(samples=2)), "/film")
        self.assertEqual(self.ask(self.mine, "GET", name).status, 404)
        self.assertEqual(self.submit(self.other, samples=2).status, 201)
        self.assertEqual(self.submit("operators-own", samples=2).status, 201)
        job = "/v1/jobs/" + held.json()["id"]
        self.assertEqual(self.ask(self.mine, "POST", job + "/cancel").status, 200)
        # The job has ended.
        self.assertIn(self.ask(self.mine, "GET", job + "/film").status, (200, 409))
        self.assertEqual(self.ask(self.mine, "DELETE", job).status, 204)
        self.assertEqual(self.submit(self.mine, samples=2).status, 201)


class ServerLimit(Quotas):
    FLAGS = ("--disk-limit", "1M")

    def test_assets_beyond_the_disk_limit_are_507_for_all(self):
        self.assertEqual(self.server.get("/v1/server").json()["limits"]["stored_bytes"], 1 << 20)
        self.assertEqual(self.server.post("/v1/assets", os.urandom(600_000), BYTES).status, 201)
        self.assert_over_quota(self.server.post("/v1/assets", os.urandom(600_000), BYTES))
        self.assertEqual(self.server.post("/v1/assets", os.urandom(400_000), BYTES).status, 201)

    def test_one_key_may_use_half_of_it(self):
        self.assertEqual(
            self.server.get("/v1/server").json()["limits"]["stored_bytes_of_a_key"], 1 << 19
        )
        self.assert_over_quota(
            self.ask(self.mine, "POST", "/v1/assets", os.urandom(600_000), BYTES)
        )
        self.assertEqual(
            self.ask(self.mine, "POST", "/v1/assets", os.urandom(500_000), BYTES).status, 201
        )


class JobsOfAKey(Quotas):
    FLAGS = ("--quota-jobs", "1", "--quota-storage", "0")

    def test_extension_counts_as_a_job(self):
        done = self.ask(self.mine, "POST", "/v1/jobs", job_body(), {"Prefer": "wait=60"}).json()[
            "id"
        ]
        self.server.wait(done)
        held = self.ask(self.mine, "POST", "/v1/jobs", job_body(samples=65536)).json()["id"]
        more = {"stop": {"samples_per_pixel": 65536}}
        refused = self.ask(self.mine, "POST", f"/v1/jobs/{done}/extend", more)
        self.assertEqual(refused.status, 429, refused)
        self.assertIn("Retry-After", refused.headers)
        self.server.post(f"/v1/jobs/{held}/cancel")
        self.assertEqual(self.ask(self.mine, "POST", f"/v1/jobs/{done}/extend", more).status, 202)
        self.server.post(f"/v1/jobs/{done}/cancel")


class ExperimentsOfAKey(Quotas):
    def hold(self, key):
        stream = Stream(
            self.server,
            "/v1/lab/runs",
            {"Authorization": "Bearer " + key},
            method="POST",
            body=LONG,
        )
        self.addCleanup(stream.__exit__)
        self.assertEqual(stream.status, 200)
        return stream

    def test_one_key_leaves_a_slot_for_others(self):
        self.assertEqual(self.server.get("/v1/server").json()["limits"]["lab_runs_of_a_key"], 1)
        held = self.hold(self.mine)
        refused = self.ask(self.mine, "POST", "/v1/lab/runs", SHORT)
        self.assertEqual(refused.status, 429, refused)
        self.assertIn("Retry-After", refused.headers)
        self.assertEqual(self.ask(self.other, "POST", "/v1/lab/runs", SHORT).status, 200)
        held.__exit__()
        wait_for(lambda: self.ask(self.mine, "POST", "/v1/lab/runs", SHORT).status != 429)


class StreamsAndPreviewsOfAKey(Quotas):
    FLAGS = ("--quota-streams", "2", "--quota-previews", "2", "--quota-storage", "0")

    def test_one_key_leaves_streams_for_others(self):
        jobs = {key: self.ask(key, "POST", "/v1/jobs", job_body(samples=65536)).json()["id"]
                for key in (self.mine, self.other)}

        def watch(key):
            stream = Stream(
                self.server, f"/v1/jobs/{jobs[key]}/events", {"Authorization": "Bearer " + key}
            )
            self.addCleanup(stream.__exit__)
            return stream, stream.response.readline()

        held = [watch(self.mine) for _ in range(2)]
        for _, line in held:
            self.assertNotIn(b"overloaded", line)
        self.assertIn(b"overloaded", watch(self.mine)[1])
        self.assertEqual(
            self.ask(self.mine, "GET", f"/v1/jobs/{jobs[self.mine]}/tiles").status, 503
        )
        self.assertNotIn(b"overloaded", watch(self.other)[1])
        held[0][0].__exit__()
        wait_for(lambda: b"overloaded" not in watch(self.mine)[1])
        for job in jobs.values():
            self.server.post(f"/v1/jobs/{job}/cancel")

    def test_one_key_leaves_previews_for_others(self):
        def submit(key):
            return self.ask(
                key, "POST", "/v1/jobs", {**job_body(samples=65536), "class": "preview"}
            )

        held = [submit(self.mine).json()["id"] for _ in range(2)]
        self.server.wait_for_samples(held[0])  # Paused before it starts, it would hold nothing.
        self.server.request("PATCH", f"/v1/jobs/{held[0]}", {"paused": True})
        refused = submit(self.mine)
        self.assertEqual(refused.status, 429, refused)
        other = submit(self.other)
        self.assertEqual(other.status, 201, other)
        for job in (*held, other.json()["id"]):
            self.server.post(f"/v1/jobs/{job}/cancel")
