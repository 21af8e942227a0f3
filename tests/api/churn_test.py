"""Cancelled and deleted jobs release their slot, their memory and their file."""

import unittest

import churn
from harness import ApiTest, job_body


class CancelAndDelete(ApiTest):
    FLAGS = ("--max-running", "2")

    def test_releases_the_slot(self):
        # Each of these rounds used to leak a slot whenever DELETE came before the last slice ended.
        for _ in range(30):
            job = self.server.submit(job_body(samples=65536))["id"]
            self.server.wait_until(job, lambda job: job["state"] == "rendering", "rendering")
            self.assertEqual(self.server.post(f"/v1/jobs/{job}/cancel").status, 200)
            self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job}").status, 204)
        self.server.render(job_body())
        churn.remove_all(self.server)
        churn.wait_until_empty(self.server, churn.EMPTY)

    def test_deletes_the_film_of_a_merge_with_its_job(self):
        jobs = [self.server.render(job_body(seed=seed))["id"] for seed in (1, 2)]
        self.assertEqual(self.server.post("/v1/films/merge", {"films": jobs}).status, 201)
        churn.remove_all(self.server)
        churn.wait_until_empty(self.server, churn.EMPTY)

    def test_id_can_be_reused_at_once(self):
        path = "/v1/jobs/01234567-89ab-4def-8123-456789abcdef"
        for _ in range(20):
            answer = self.server.request("PUT", path, job_body(samples=65536))
            self.assertEqual(answer.status, 201, answer)
            self.server.wait_until(
                path.split("/")[-1], lambda job: job["state"] == "rendering", "rendering"
            )
            self.server.post(path + "/cancel")
            self.assertEqual(self.server.request("DELETE", path).status, 204)
        self.assertEqual(self.server.request("PUT", path, job_body(samples=16)).status, 201)
        done = self.server.wait(path.split("/")[-1])
        self.assertEqual(done["state"], "finished", done)
        self.assertEqual(done["progress"]["samples_per_pixel"]["min"], 16)
        churn.wait_until_empty(self.server)


class Churn(unittest.TestCase):
    def test_leaves_nothing_behind(self):
        """The short form of tests/stress/churn."""
        churn.run(rounds=1, seconds=6, seed=20261122)
