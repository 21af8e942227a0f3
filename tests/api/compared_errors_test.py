"""Errors of biased integrators, measured by comparison with unbiased images."""

import unittest

from harness import ApiTest, job_body, started

BIASED = ("path-caustics", "sppm", "vcm", "photon-map", "irradiance-cache")


def body(integrator, samples=8, **members):
    options = {"type": integrator, "max_depth": 3}
    options |= {"rays": 16, "records": 256} if integrator == "irradiance-cache" else {
        "photons": 1024}
    wanted = job_body(samples=samples, integrator=options, **members)
    wanted["film"] = {"width": 40, "height": 32, "layers": []}
    return wanted


class ComparedErrors(ApiTest):
    def test_rows_say_so(self):
        rows = self.server.get("/v1/server").json()["integrators"]
        compared = {row["type"] for row in rows if row["error"] == "by-comparison"}
        self.assertEqual(compared, set(BIASED))
        self.assertNotIn("none", {row["error"] for row in rows})

    def test_jobs_have_an_interval_everywhere(self):
        for integrator in BIASED:
            with self.subTest(integrator=integrator):
                job = self.server.render(body(integrator))
                error = job["error"]
                self.assertTrue(error["valid"])
                self.assertIn(error["bias"], ("consistent", "biased"))
                self.assertLessEqual(error["low"], error["relative"])
                self.assertLess(error["relative"], error["high"])
                self.assertEqual(error["relative"], error["grain"])
                points = self.server.get(f"/v1/jobs/{job['id']}/convergence").json()["points"]
                self.assertEqual(points[-1]["high"], error["high"])
                answer = self.server.get(f"/v1/jobs/{job['id']}/image.png")
                self.assertIn("X-Tessera-Error", answer.headers)
                self.assertIsNotNone(job["statistics"]["efficiency_low"])

    def test_error_targets_end_their_jobs(self):
        job = self.server.render(body("sppm", stop={"relative_error": 0.4,
                                                    "samples_per_pixel": 512}))
        self.assertEqual(job["stop_reason"], "relative_error")
        self.assertLessEqual(job["error"]["high"], 0.4)
        more = {"stop": {"relative_error": 0.35}}
        answer = self.server.post(f"/v1/jobs/{job['id']}/extend", more)
        self.assertEqual(answer.status, 202, answer)
        self.assertLessEqual(self.server.wait(job["id"])["error"]["high"], 0.35)

    def test_merged_films_have_none(self):
        halves = [self.server.render(body("sppm", sampler={"type": "sobol", "replicates": 2,
                                                           "first_replicate": first}))["id"]
                  for first in (0, 2)]
        merged = self.server.post("/v1/films/merge", {"films": halves})
        self.assertEqual(merged.status, 201, merged)
        error = merged.json()["error"]
        self.assertEqual((error["relative"], error["valid"]), (None, False))


class StoredComparedErrors(unittest.TestCase):
    def test_errors_are_the_same_after_a_restart_and_for_any_threads(self):
        server = started(self, threads=1)
        jobs = [server.render(body(integrator)) for integrator in BIASED]
        server.stop()
        server.start(threads=3)
        for job in jobs:
            with self.subTest(integrator=job["spec"]["integrator"]["type"]):
                path = f"/v1/jobs/{job['id']}"
                self.assertEqual(server.get(path).json()["error"], job["error"])
                again = server.render(body(job["spec"]["integrator"]["type"]))
                self.assertEqual(again["error"], job["error"])
                server.post(f"{path}/extend", {"stop": {"samples_per_pixel": 24}})
                extended = server.wait(job["id"])["error"]
                whole = server.render(body(job["spec"]["integrator"]["type"], samples=24))
                self.assertEqual(extended, whole["error"])
