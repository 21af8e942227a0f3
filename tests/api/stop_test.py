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

    def test_a_relative_error_is_reached(self):
        job = self.render({"relative_error": 0.1})
        self.assertEqual(job["stop_reason"], "relative_error")
        self.assertLessEqual(job["error"]["relative_rmse"], 0.1)
        self.assertEqual(job["error"]["bias"], "consistent")
        self.assert_whole(job)
        closer = self.render({"relative_error": 0.05})
        self.assertGreater(closer["progress"]["samples_per_pixel"]["mean"],
                           job["progress"]["samples_per_pixel"]["mean"])

    def test_the_worst_tile_needs_more_than_the_image(self):
        image = self.render({"relative_error": 0.12})
        worst = self.render({"relative_error": 0.12, "scope": "worst_tile"})
        self.assertEqual(worst["stop_reason"], "relative_error")
        self.assertGreaterEqual(worst["progress"]["samples_per_pixel"]["mean"],
                                image["progress"]["samples_per_pixel"]["mean"])

    def test_seconds_are_seconds_of_rendering(self):
        job = self.render({"seconds": 0.5})
        self.assertEqual(job["stop_reason"], "seconds")
        self.assertGreaterEqual(job["progress"]["elapsed_seconds"], 0.5)
        self.assert_whole(job)

    def test_a_deadline_ends_the_job(self):
        began = time.time()
        job = self.render({"deadline": moment(0.7)})
        self.assertEqual(job["stop_reason"], "deadline")
        self.assertGreaterEqual(time.time() - began, 0.7)
        self.assert_whole(job)

    def test_a_past_deadline_still_delivers_one_pass(self):
        job = self.render({"deadline": "2020-01-01T00:00:00Z"})
        self.assertEqual((job["state"], job["stop_reason"]), ("finished", "deadline"))
        self.assert_whole(job)
        self.assertEqual(self.server.get(f"/v1/jobs/{job['id']}/image.png").status, 200)

    def test_the_first_rule_met_ends_the_job(self):
        self.assertEqual(self.render({"samples_per_pixel": 4, "seconds": 600})["stop_reason"],
                         "samples_per_pixel")
        self.assertEqual(self.render({"samples_per_pixel": 65536, "seconds": 0.2})["stop_reason"],
                         "seconds")


class SampleLimit(ApiTest):
    FLAGS = ("--max-samples", "8")

    def test_the_server_has_a_maximum(self):
        body = job_body()
        body["stop"] = {"seconds": 600}
        job = self.server.render(body)
        self.assertEqual((job["stop_reason"], job["progress"]["samples_per_pixel"]["max"]), ("limit", 8))
