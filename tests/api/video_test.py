"""Frames of a video: images of a batch, averaged along the motion with those beside them."""

from batches_test import LONG, BatchTest, batch_body
from harness import job_body

VIEWS = {"camera.orbit.theta_degrees": [176, 178, 180, 182]}
FILM = {"width": 160, "height": 120}  # Intervals come from tiles.


def template(samples=16, **members):
    return job_body(samples=samples, film=dict(FILM), denoise={"type": "statistical"}, **members)


class VideoTest(BatchTest):
    def image(self, job, denoise, status=200):
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise={denoise}")
        self.assertEqual(answer.status, status, answer)
        return answer

    def error(self, job, denoise, reference):
        body = {"a": job["id"], "b": reference["id"], "a_denoise": denoise}
        answer = self.server.post("/v1/comparisons", body)
        self.assertEqual(answer.status, 201, answer)
        return answer.json()["mse"]

    def test_frames_are_averaged_with_those_beside_them(self):
        batch = self.finished(batch_body(VIEWS, template=template()))
        self.assertIsNone(batch["flicker"])
        versions = set()
        for job, beside in zip(batch["jobs"], (1, 2, 2, 1), strict=True):
            answer = self.image(job, "video")
            self.assertIn(f"with {beside} more of the series, full",
                          answer.headers["X-Tessera-Denoiser"])
            self.assertEqual(answer.headers["X-Tessera-Bias"], "biased")
            self.assertNotEqual(answer.body, self.image(job, "full").body)
            versions.add(answer.headers["ETag"])
            again = self.image(job, "video")
            self.assertEqual((again.body, again.headers["ETag"]),
                             (answer.body, answer.headers["ETag"]))
        self.assertEqual(len(versions), 4)
        # Of three pairs, whatever the order of the requests.
        flicker = self.batch(batch["id"])["flicker"]
        self.assertLess(0, flicker["relative"])
        self.assertLessEqual(flicker["low"], flicker["relative"])
        self.assertLessEqual(flicker["relative"], flicker["high"])

    def test_they_are_nearer_to_the_truth(self):
        frames = self.finished(batch_body(VIEWS, template=template(16)))["jobs"]
        truths = self.finished(batch_body(VIEWS, template=template(64, seed=9)))["jobs"]
        error = {
            denoise: sum(self.error(frame, denoise, truth)
                         for frame, truth in zip(frames, truths, strict=True))
            for denoise in ("full", "video")
        }
        self.assertLess(error["video"], error["full"])

    def test_jobs_of_other_settings_are_no_frames(self):
        batch = self.finished(batch_body({"integrator.max_depth": [2, 3]}, template=template()))
        alone = self.server.post("/v1/jobs", template()).json()
        self.server.wait(alone["id"])
        for job in (batch["jobs"][0], alone):
            problem = self.image(job, "video", 422).json()
            self.assertEqual([each["pointer"] for each in problem["errors"]], ["/denoise"])
            self.assertIn(f"job {job['id']} has none beside it", problem["errors"][0]["detail"])
        # The other axis decides which are beside each other.
        both = {**VIEWS, "integrator.max_depth": [2, 3]}
        batch = self.finished(batch_body(both, template=template()))
        counts = [self.image(job, "video").headers["X-Tessera-Denoiser"].split(" more")[0][-1]
                  for job in batch["jobs"]]
        self.assertEqual(sorted(counts), ["1"] * 4 + ["2"] * 4)

    def test_they_wait_for_the_end_of_those_beside_them(self):
        batch = self.make(batch_body(
            {"camera.orbit.theta_degrees": [178, 180]}, template=template(LONG)))
        first, second = batch["jobs"]
        for job in (first, second):
            self.server.wait_for_samples(job["id"], 8)
            self.image(job, "video", 409)
        self.server.post(f"/v1/jobs/{first['id']}/cancel", None)
        self.assertIn("once all three have ended", self.image(first, "video", 409).json()["detail"])
        self.server.post(f"/v1/jobs/{second['id']}/cancel", None)
        self.image(first, "video")
