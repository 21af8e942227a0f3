"""The rules that end a job."""

import time
from datetime import datetime, timedelta, timezone

from harness import ApiTest, job_body


def moment(seconds_from_now):
    return (datetime.now(timezone.utc) + timedelta(seconds=seconds_from_now)).isoformat()


class Stopping(ApiTest):
    def render(self, stop, **members):
        body = job_body(**members)
        body["film"] = {"width": 64, "height": 48, "layers": []}
        body["stop"] = stop
        return self.server.render(body)

    def assert_whole(self, job):
        samples = job["progress"]["samples_per_pixel"]
        self.assertEqual(samples["min"], samples["max"])
        self.assertGreaterEqual(samples["min"], 1)

    def test_reaches_a_relative_error(self):
        # Without a plan every pixel has the same number of samples at the end.
        job = self.render({"relative_error": 0.1}, adaptive={"type": "none"})
        self.assertEqual(job["stop_reason"], "relative_error")
        self.assertLessEqual(job["error"]["relative"], 0.1)
        self.assertEqual(job["error"]["bias"], "consistent")
        self.assert_whole(job)
        closer = self.render({"relative_error": 0.05}, adaptive={"type": "none"})
        self.assertGreater(closer["progress"]["samples_per_pixel"]["mean"],
                           job["progress"]["samples_per_pixel"]["mean"])

    def test_cpu_seconds_end_a_job_after_its_last_complete_pass(self):
        job = self.render({"cpu_seconds": 0.3}, adaptive={"type": "none"})
        self.assertEqual(job["stop_reason"], "cpu_seconds")
        self.assertEqual(job["spec"]["stop"], {"cpu_seconds": 0.3})
        self.assertGreaterEqual(job["progress"]["cpu_seconds"], 0.3)
        self.assert_whole(job)
        figures, error = job["statistics"], job["error"]
        for name, end in (("efficiency", "relative"), ("efficiency_low", "high"),
                          ("efficiency_high", "low")):
            self.assertAlmostEqual(
                figures[name] * error[end] ** 2 * job["progress"]["cpu_seconds"], 1, delta=1e-4
            )

    def extend(self, job, **stop):
        answer = self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": stop})
        self.assertEqual(answer.status, 202, answer)
        return self.server.wait(job["id"])

    def test_seconds_of_all_threads_do_not_decrease(self):
        job = self.render({"relative_error": 0.1})
        later = self.extend(job, seconds=0.01)
        self.assertEqual(later["film_digest"], job["film_digest"])
        self.assertGreaterEqual(later["progress"]["cpu_seconds"], job["progress"]["cpu_seconds"])
        self.server.stop()
        self.server.start()
        again = self.extend(
            job, samples_per_pixel=2 * int(job["progress"]["samples_per_pixel"]["mean"]) + 16
        )
        self.assertGreater(again["progress"]["cpu_seconds"], later["progress"]["cpu_seconds"])
        points = self.server.get(f"/v1/jobs/{job['id']}/convergence").json()["points"]
        seconds = [point["cpu_seconds"] for point in points]
        self.assertEqual(seconds, sorted(seconds))

    def test_samples_selected_by_an_error_stay_until_a_fixed_count_exceeds_them(self):
        job = self.render({"relative_error": 0.1})
        picture = self.server.get(f"/v1/jobs/{job['id']}/image.exr")
        self.assertEqual(picture.headers["X-Tessera-Bias"], "consistent")
        for stop in ({"deadline": "2020-01-01T00:00:00Z"}, {"seconds": 0.01}):
            later = self.extend(job, **stop)
            self.assertEqual(later["film_digest"], job["film_digest"])
            self.assertEqual(later["error"]["bias"], "consistent", stop)
        kept = self.server.get(f"/v1/jobs/{job['id']}/image.exr").body
        for body in (picture.body, kept):
            answer = self.server.request(
                "POST", "/v1/jobs?from=image", body, {"Content-Type": "image/x-exr"}
            )
            again = self.server.wait(answer.json()["id"])
            self.assertEqual(
                (again["film_digest"], again["stop_reason"]),
                (job["film_digest"], "samples_per_pixel"),
            )
            self.assertEqual(again["error"]["bias"], "consistent")
        merged = self.server.post("/v1/films/merge", {"films": [job["id"]]})
        self.assertEqual(merged.json()["error"]["bias"], "consistent", merged)
        self.server.stop()
        self.server.start()
        self.assertEqual(
            self.server.get(f"/v1/jobs/{job['id']}").json()["error"]["bias"], "consistent"
        )
        more = self.extend(
            job, samples_per_pixel=2 * int(job["progress"]["samples_per_pixel"]["mean"]) + 16
        )
        self.assertEqual(more["error"]["bias"], "none")
        self.assertEqual(self.extend(job, seconds=0.01)["error"]["bias"], "none")

    def test_removing_a_rule_removes_its_report(self):
        def about_samples(job):
            return [
                w
                for w in job["warnings"]
                if w.startswith(("stop.samples_per_pixel", "estimator.control_variate"))
            ]
        job = self.render(
            {"samples_per_pixel": 5}, estimator={"control_variate": {"type": "regression"}}
        )
        self.assertEqual(len(about_samples(job)), 2, job["warnings"])
        other = self.extend(job, samples_per_pixel=21)
        self.assertEqual([w.split(" ")[1] for w in about_samples(other)], ["21"])
        self.assertEqual(about_samples(self.extend(job, deadline="2020-01-01T00:00:00Z")), [])
        running = self.server.submit(job_body(samples=65533))
        self.assertEqual(len(about_samples(running)), 1)
        path = f"/v1/jobs/{running['id']}"
        kept = self.server.request(
            "PATCH",
            path,
            b'{"stop": {"seconds": 600}}',
            {"Content-Type": "application/merge-patch+json"},
        )
        self.assertEqual(len(about_samples(kept.json())), 1, kept)
        gone = self.server.request("PATCH", path, b'{"stop": {"samples_per_pixel": null}}',
                                   {"Content-Type": "application/merge-patch+json"})
        self.assertEqual(about_samples(gone.json()), [])
        self.server.post(path + "/cancel")

    def test_worst_tile_needs_more_samples_than_the_image(self):
        image = self.render({"relative_error": 0.12})
        worst = self.render({"relative_error": 0.12, "scope": "worst_tile"})
        self.assertEqual(worst["stop_reason"], "relative_error")
        self.assertGreaterEqual(worst["progress"]["samples_per_pixel"]["mean"],
                                image["progress"]["samples_per_pixel"]["mean"])

    def test_seconds_count_only_rendering(self):
        job = self.render({"seconds": 0.5})
        self.assertEqual(job["stop_reason"], "seconds")
        self.assertGreaterEqual(job["progress"]["elapsed_seconds"], 0.5)
        self.assert_whole(job)

    def test_deadline_ends_the_job(self):
        began = time.time()
        job = self.render({"deadline": moment(0.7)})
        self.assertEqual(job["stop_reason"], "deadline")
        self.assertGreaterEqual(time.time() - began, 0.7)
        self.assert_whole(job)

    def test_past_deadline_still_gives_one_pass(self):
        job = self.render({"deadline": "2020-01-01T00:00:00Z"})
        self.assertEqual((job["state"], job["stop_reason"]), ("finished", "deadline"))
        self.assert_whole(job)
        self.assertEqual(self.server.get(f"/v1/jobs/{job['id']}/image.png").status, 200)

    def test_first_rule_met_ends_the_job(self):
        self.assertEqual(self.render({"samples_per_pixel": 4, "seconds": 600})["stop_reason"],
                         "samples_per_pixel")
        self.assertEqual(self.render({"samples_per_pixel": 65536, "seconds": 0.2})["stop_reason"],
                         "seconds")


class SampleLimit(ApiTest):
    FLAGS = ("--max-samples", "8")

    def test_server_has_a_maximum(self):
        body = job_body()
        body["stop"] = {"seconds": 600}
        job = self.server.render(body)
        self.assertEqual(
            (job["stop_reason"], job["progress"]["samples_per_pixel"]["max"]), ("limit", 8)
        )
