"""Adaptive sampling and stop rules together, through the API."""

import time
import unittest

from harness import PATIENCE_S, ApiTest, TileStream, job_body, started

FILM = {"width": 96, "height": 64, "layers": []}


def body(kind, samples, **adaptive):
    wanted = job_body(samples=samples, adaptive={"type": kind, "min_samples": 16, **adaptive})
    wanted["film"] = dict(FILM)
    return wanted


class Adaptive(ApiTest):
    def test_the_server_lists_the_types_with_their_bias(self):
        rows = {row["type"]: row for row in self.server.get("/v1/server").json()["adaptive"]}
        self.assertEqual({name: row["bias"] for name, row in rows.items()},
                         {"none": "none", "pilot": "none"})
        self.assertIn("/adaptive/min_samples", rows["pilot"]["accepts"])

    def test_refuses_laboratory_rules_and_names_their_experiment(self):
        experiments = {e["name"]: {m["name"] for m in e["estimators"]}
                       for e in self.server.get("/v1/server").json()["experiments"]}
        for kind, estimator in (("crosshalf", "cross-half"), ("sequential", "standard-error")):
            answer = self.server.post("/v1/jobs", job_body(samples=64, adaptive={"type": kind}))
            problem = self.assert_problem(answer, 422, "/adaptive/type")
            self.assertIn("laboratory", problem["errors"][0]["detail"])
            self.assertIn(
                f"'stopping-bias', estimator '{estimator}'", problem["errors"][0]["detail"]
            )
            self.assertIn(estimator, experiments["stopping-bias"])

    def test_spec_shows_the_effective_count_of_the_first_decision(self):
        def told(job):
            return [w for w in job["warnings"] if w.startswith("adaptive.min_samples")]
        job = self.server.render(body("pilot", 64, min_samples=33))
        self.assertEqual(job["spec"]["adaptive"]["min_samples"], 40)
        self.assertEqual(len(told(job)), 1)
        self.assertIn("33 was requested, 40 is used", told(job)[0])
        self.assertGreaterEqual(job["progress"]["samples_per_pixel"]["min"], 40)
        asked = self.server.render(body("pilot", 64, min_samples=40))
        self.assertEqual((asked["film_digest"], told(asked)), (job["film_digest"], []))
        # The default was not requested.
        plain = job_body(samples=96, sampler={"replicates": 6}, adaptive={"type": "pilot"})
        job = self.server.render(plain)
        self.assertEqual((job["spec"]["adaptive"]["min_samples"], told(job)), (36, []))

    def test_allocates_samples_to_noise_and_keeps_their_mean(self):
        job = self.server.render(body("pilot", 96))
        samples = job["progress"]["samples_per_pixel"]
        self.assert_close(samples["mean"], 96, 0.5)
        self.assertLess(samples["min"], samples["max"])
        self.assertEqual((job["error"]["valid"], job["error"]["bias"]), (True, "none"))
        self.assertEqual(
            job["spec"]["adaptive"],
            {"type": "pilot", "min_samples": 20, "granularity": "pixel", "dilation": 1},
        )
        layer = self.server.get(f"/v1/jobs/{job['id']}/image.exr?layer=samples")
        self.assertEqual(layer.status, 200)
        # Tile frames, pixels and progress report the same counts.
        with TileStream(self.server, job["id"]) as stream:
            tiles = [tile for tile in stream.all() if not tile.flags & 1]
        counts = [n for tile in tiles for n in tile.check()[6]]
        self.assertEqual((min(counts), max(counts)), (samples["min"], samples["max"]))
        self.assert_close(sum(counts) / len(counts), samples["mean"], 1e-6)
        pixel = self.server.get(f"/v1/jobs/{job['id']}/pixels/3/5").json()
        first = next(tile for tile in tiles if tile.place()[:2] == (0, 0))
        self.assertEqual(pixel["samples"], first.check()[6][5 * 32 + 3])
        self.assertIsNotNone(pixel["layers"]["beauty"]["low"][0])
        points = self.server.get(f"/v1/jobs/{job['id']}/convergence").json()["points"]
        self.assertEqual(points[-1]["samples_per_pixel"], 96)
        self.assertIsNotNone(points[-1]["low"])

    def test_extension_gives_the_film_of_a_longer_job(self):
        job = self.server.render(body("pilot", 40))
        answer = self.server.post(
            f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 40}}
        )
        self.assert_problem(answer, 422, "/stop/samples_per_pixel")
        answer = self.server.post(
            f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 96}}
        )
        self.assertEqual(answer.status, 202)
        self.assertEqual(self.server.wait(job["id"])["film_digest"],
                         self.server.render(body("pilot", 96))["film_digest"])

    def test_meets_an_error_target(self):
        wanted = body("pilot", 1)
        wanted["stop"] = {"relative_error": 0.1}
        job = self.server.render(wanted)
        self.assertEqual(job["stop_reason"], "relative_error")
        self.assertFalse(
            any("adaptive sampling" in warning for warning in job["warnings"]), job["warnings"]
        )
        self.assertLessEqual(job["error"]["high"], 0.1)


class StopRules(ApiTest):
    def render(self, stop, **adaptive):
        wanted = body("pilot", 1, **adaptive)
        wanted["stop"] = stop
        return self.server.render(wanted)

    def test_ends_with_the_first_rule_met_in_any_combination(self):
        far = {"samples_per_pixel": 65536, "relative_error": 1e-5, "seconds": 600,
               "deadline": "2999-01-01T00:00:00Z"}
        near = {"samples_per_pixel": 40, "relative_error": 1, "seconds": 0.05,
                "deadline": "2020-01-01T00:00:00Z"}
        for rule, value in near.items():
            job = self.render({**far, rule: value})
            self.assertEqual((job["state"], job["stop_reason"]), ("finished", rule))
            self.assertEqual(job["progress"]["fraction"], 1)
            self.assertIsNone(job["progress"]["eta_seconds"])
            self.assertIsNone(job["progress"]["eta_interval_seconds"])

    def test_a_clock_keeps_the_last_complete_pass_and_extends(self):
        job = self.render({"seconds": 0.4})
        self.assertEqual(job["stop_reason"], "seconds")
        mean = job["progress"]["samples_per_pixel"]["mean"]
        target = int(mean) + 40
        self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": target}})
        done = self.server.wait(job["id"])
        self.assertEqual(
            done["film_digest"],
            self.server.render(body("pilot", done["spec"]["stop"]["samples_per_pixel"]))[
                "film_digest"
            ],
        )

    def test_remaining_time_has_an_interval(self):
        wanted = body("pilot", 65536)
        job = self.server.submit(wanted)["id"]

        def known(now):
            return now["progress"]["eta_seconds"] is not None
        now = self.server.wait_until(job, known)
        low, high = now["progress"]["eta_interval_seconds"]
        self.assertTrue(0 <= low <= now["progress"]["eta_seconds"] <= high, now["progress"])
        self.assertLess(now["progress"]["fraction"], 1)
        self.server.post(f"/v1/jobs/{job}/cancel")


class AdaptiveRestart(unittest.TestCase):
    def test_film_is_unchanged_after_repeated_kills(self):
        self.killed_again_and_again({"pilot": body("pilot", 256)})

    def test_error_target_ends_at_the_same_sample_after_repeated_kills(self):
        self.killed_again_and_again(
            {
                f"{scene} {kind}": body(kind, 1)
                | {"scene": scene, "adaptive": {"type": kind}, "stop": {"relative_error": target}}
                for scene, target in (("veach-mis", 0.1), ("glass", 0.3))
                for kind in ("none", "pilot")
            }
        )

    def killed_again_and_again(self, jobs):
        server = started(self, "--checkpoint", "0.2", "--log-level", "debug")
        for kind, wanted in jobs.items():
            calm = server.render(wanted)
            job = server.submit(wanted | {"name": kind})["id"]
            for threads in (2, 1, 3):
                seen = server.job(job)["progress"]["samples_per_pixel"]["max"]
                deadline = time.monotonic() + PATIENCE_S
                while time.monotonic() < deadline:
                    now = server.job(job)
                    with open(server.log, encoding="utf-8") as log:
                        saved = sum('"checkpoint"' in line and job in line for line in log)
                    if now["state"] == "finished" or (
                        saved and now["progress"]["samples_per_pixel"]["max"] > seen
                    ):
                        break
                    time.sleep(0.02)
                server.kill()
                server.start(threads)
            done = server.wait(job)
            self.assertEqual(done["film_digest"], calm["film_digest"], kind)
            self.assertEqual(done["stop_reason"], calm["stop_reason"], kind)
            self.assertEqual(done["error"], calm["error"], kind)
