"""Estimators fitted to the samples of the image: optimal weights, regression."""

import unittest

from harness import ApiTest, job_body, started

KINDS = {"mis": "optimal", "control_variate": "regression"}


def body(group, samples, **members):
    wanted = job_body(samples=samples, estimator={group: {"type": KINDS[group]}}, **members)
    wanted["scene"] = "cornell-box"
    wanted["film"] = {"width": 64, "height": 48, "layers": []}
    return wanted


class Fitted(ApiTest):
    def test_server_lists_them_without_bias(self):
        rows = {row["name"]: row for row in self.server.get("/v1/server").json()["options"]}
        for group, kind in KINDS.items():
            row = rows[f"estimator.{group}.{kind}"]
            self.assertEqual(row["bias"], "none")
            self.assertEqual(row["patch"]["estimator"][group]["type"], kind)

    def test_extension_gives_the_film_of_a_longer_job(self):
        digests = set()
        for group, kind in KINDS.items():
            job = self.server.render(body(group, 24))
            self.assertEqual(job["spec"]["estimator"][group], {"type": kind})
            self.assertEqual((job["error"]["bias"], job["error"]["valid"]), ("none", True))
            answer = self.server.post(
                f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 64}}
            )
            self.assertEqual(answer.status, 202)
            extended = self.server.wait(job["id"])
            whole = self.server.render(body(group, 64))
            self.assertEqual(extended["film_digest"], whole["film_digest"])
            self.assertEqual(whole["statistics"]["rejected_samples"], 0)
            digests.add(whole["film_digest"])
        self.assertEqual(len(digests), 2)

    def test_refuses_incompatible_options_with_their_pointer(self):
        for members in (
            {"light_sampler": {"type": "ris"}},
            {"estimator": {"mis": {"type": "optimal"}, "expected_values": False}},
            {"estimator": {"mis": {"type": "optimal"}, "roulette": {"type": "threshold"}}},
            {"estimator": {"mis": {"type": "optimal"}, "control_variate": {"type": "analytic"}}},
        ):
            answer = self.server.post("/v1/jobs", {**body("mis", 1), **members})
            self.assert_problem(answer, 422, "/estimator/mis/type")
        answer = self.server.post("/v1/jobs", {**body("mis", 1), "estimator": {
            "strategy": "bsdf", "control_variate": {"type": "regression"}}})
        self.assert_problem(answer, 422, "/estimator/control_variate")


class Restart(unittest.TestCase):
    def test_fitted_coefficients_survive_a_kill(self):
        server = started(self, "--checkpoint", "0.1", "--log-level", "debug")
        calm = server.render(body("mis", 384))
        job = server.submit(body("mis", 384, name="killed"))["id"]
        server.wait_until(job, lambda now: now["progress"]["samples_per_pixel"]["max"] >= 64)
        # The checkpoint after the next began after those samples.
        least = server.checkpoints(job) + 2
        server.wait_until(job, lambda _: server.checkpoints(job) >= least, "a checkpoint")
        server.kill()
        server.start(1)
        self.assertGreater(server.job(job)["progress"]["samples_per_pixel"]["max"], 0)
        self.assertEqual(server.wait(job)["film_digest"], calm["film_digest"])
