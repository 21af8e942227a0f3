"""Draining without stopping, and the retention of ended jobs."""

import json
import unittest

from harness import ApiTest, job_body, started, tessera, wait_for


class Drain(ApiTest):
    FLAGS = ("--max-running", "1")

    def test_finishes_running_jobs_and_starts_no_new_ones(self):
        running = self.server.submit(job_body(samples=65536, priority=1))["id"]
        self.server.wait_for_samples(running)
        waiting = self.server.submit(job_body())["id"]
        state = self.server.request("PUT", "/v1/drain").json()
        self.assertEqual(state, {"draining": True, "running": 1, "queued": 1})
        self.assert_problem(self.server.post("/v1/jobs", job_body()), 503)
        ready = self.server.get("/readyz")
        self.assertEqual((ready.status, b"\ndraining: " in ready.body), (200, True))
        self.server.post(f"/v1/jobs/{running}/cancel")
        address = f"http://127.0.0.1:{self.server.port}"
        code, said, complaints = tessera("drain", "--wait", "--server", address)
        self.assertEqual((code, json.loads(said)["running"]), (0, 0), complaints)
        self.assertEqual(self.server.job(waiting)["state"], "queued")
        self.assertEqual(tessera("drain", "--end", "--server", address)[0], 0)
        self.assertFalse(self.server.get("/v1/drain").json()["draining"])
        self.assertEqual(self.server.wait(waiting)["state"], "finished")
        self.assertEqual(self.server.get("/readyz").body, b"ready\n")


class Retention(unittest.TestCase):
    def wait_for_404(self, server, job):
        wait_for(lambda: server.get(f"/v1/jobs/{job}").status == 404)

    def test_deletes_the_oldest_beyond_a_number(self):
        server = started(self, "--max-ended", "1")
        first, second = (server.render(job_body(seed=seed))["id"] for seed in range(2))
        self.wait_for_404(server, first)
        self.assertEqual(server.get(f"/v1/jobs/{second}").status, 200)
        limits = server.get("/v1/server").json()["limits"]
        self.assertEqual(limits["ended_jobs"], 1)

    def test_deletes_all_after_their_time(self):
        server = started(self, "--retention", "2")
        longer = server.submit(job_body(retention_seconds=1000))
        self.assertTrue([each for each in longer["warnings"] if "2 seconds" in each])
        self.wait_for_404(server, longer["id"])
