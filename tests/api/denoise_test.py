"""Denoised images: made on demand, distinct from the plain ones, never part of the film."""

import hashlib
import json
import os

import harness
from harness import (ApiTest, EventStream, Server, in_background, job_body, png_pixels, png_size,
                     started, tessera)

# A library that follows FAKE_OIDN (tests/support/fake_oidn.cpp).
FAKE_OIDN = os.path.join(os.path.dirname(harness.BINARY), "tests", "fake_oidn")


def small(samples=16, **members):
    return job_body(samples=samples, **{"film": {"width": 70, "height": 40}, **members})


class DenoisedPictures(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        # Where Open Image Denoise is installed, `auto` chooses it.
        cls.job = cls.server.render(small(denoise={"type": "statistical"}))
        cls.path = f"/v1/jobs/{cls.job['id']}"

    def image(self, rest, job=None):
        answer = self.server.get((f"/v1/jobs/{job}" if job else self.path) + rest)
        self.assertEqual(answer.status, 200, answer)
        return answer

    def noise(self, rest, job=None):
        """Mean absolute difference of neighbours on a smooth wall of the box."""
        rows = png_pixels(self.image(rest, job).body)
        pairs = [(rows[y][x], rows[y][x + 1]) for y in range(8, 18) for x in range(30, 40)]
        return sum(abs(a[c] - b[c]) for a, b in pairs for c in range(3)) / len(pairs)

    def test_denoised_image_has_less_noise(self):
        plain = self.noise("/image.png")
        self.assertEqual(self.noise("/image.png?denoise=off"), plain)
        # mixed minimises the error, not the noise: it may be the plain image.
        self.assertLessEqual(self.noise("/image.png?denoise=mixed"), plain)
        self.assertLess(self.noise("/image.png?denoise=full"), 0.8 * plain)
        # The twelve tiles of a larger image agree on the gain.
        job = self.server.render(small(samples=4, film={"width": 128, "height": 96},
                                       denoise={"type": "statistical"}))["id"]
        plain = self.noise("/image.png", job)
        self.assertLess(self.noise("/image.png?denoise=mixed", job), plain)

    def test_headers_report_the_denoiser_and_the_error(self):
        mixed = self.image("/image.png?denoise=mixed")
        self.assertEqual(mixed.headers["X-Tessera-Denoiser"], "statistical 2, mixed")
        self.assertEqual(mixed.headers["X-Tessera-Bias"], "consistent")
        error, low, high = (float(x) for x in mixed.headers["X-Tessera-Error"].split(","))
        self.assertLessEqual(low, error)
        self.assertLessEqual(error, high)
        full = self.image("/image.png?denoise=full")
        self.assertEqual(full.headers["X-Tessera-Bias"], "biased")
        self.assertIsNone(self.image("/image.png").headers.get("X-Tessera-Denoiser"))

    def test_job_reports_the_same(self):
        # Enough samples to separate the error from the noise.
        job = self.server.render(small(samples=64, denoise={"type": "statistical"}))
        headers = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed").headers
        error = float(headers["X-Tessera-Error"].split(",")[0])
        denoised = self.server.job(job["id"])["denoised"]
        self.assert_close(denoised["relative"], error, 1e-5 * error)
        self.assertEqual(denoised["type"], "statistical")
        self.assertEqual([denoised[k] for k in ("sha256", "quality", "note")], [None] * 3)
        self.assertEqual(denoised["revision"], job["revision"])
        self.assertTrue(denoised["features"])
        plain = job["error"]["relative"]
        self.assert_close(denoised["gain"], (plain / error) ** 2, 0.01 * (plain / error) ** 2)

    def test_film_and_digest_are_unaffected(self):
        before = self.server.get(self.path + "/film").body
        self.image("/image.png?denoise=full")
        self.assertEqual(self.server.get(self.path + "/film").body, before)
        self.assertEqual(self.server.job(self.job["id"])["film_digest"], self.job["film_digest"])

    def test_equal_requests_have_equal_bytes_and_other_modes_other_etags(self):
        first = self.image("/image.exr?denoise=mixed")
        self.assertEqual(self.image("/image.exr?denoise=mixed").body, first.body)
        self.assertNotEqual(
            self.image("/image.exr?denoise=full").headers["ETag"], first.headers["ETag"]
        )

    def test_denoised_layers_have_names(self):
        for layer in ("denoised", "denoised_error", "denoise_bias", "denoise_bias_error"):
            size = png_size(self.image(f"/image.png?layer={layer}").body)[:2]
            self.assertEqual(size, (70, 40), layer)
        self.assertEqual(
            self.image("/image.png?layer=denoised").headers["X-Tessera-Error"],
            self.image("/image.png?denoise=mixed").headers["X-Tessera-Error"],
        )

    def test_part_equals_the_crop_of_the_whole(self):
        whole = png_pixels(self.image("/image.png?denoise=mixed").body)
        part = png_pixels(self.image("/image.png?denoise=mixed&x=33&y=5&width=20&height=30").body)
        self.assertEqual(part, [row[33:53] for row in whole[5:35]])

    def test_exr_names_the_denoiser_in_its_metadata(self):
        body = self.image("/image.exr?denoise=mixed").body
        self.assertIn(b"tessera:denoiser", body)
        self.assertNotIn(b"tessera:denoiser", self.image("/image.exr").body)

    def test_does_not_denoise_other_layers(self):
        answer = self.server.get(self.path + "/image.png?layer=depth&denoise=mixed")
        self.assert_problem(answer, 422, "/denoise")
        self.assert_problem(self.server.get(self.path + "/image.png?denoise=some"), 422, "/denoise")


class DenoisedJobs(ApiTest):
    def test_job_may_refuse_denoised_images(self):
        job = self.server.render(small(denoise={"type": "none"}))
        self.assertEqual(job["spec"]["denoise"], {"type": "none", "preview": True})
        path = f"/v1/jobs/{job['id']}"
        self.assert_problem(self.server.get(path + "/image.png?denoise=mixed"), 422, "/denoise")
        self.assertEqual(self.server.get(path + "/image.png").status, 200)
        self.assertIsNone(self.server.job(job["id"])["denoised"])

    def test_refuses_unknown_denoisers_with_their_pointer(self):
        answer = self.server.post("/v1/jobs", small(denoise={"type": "best"}))
        self.assert_problem(answer, 422, "/denoise/type")

    def test_does_not_denoise_a_single_half(self):
        job = self.server.render(small(samples=1))
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
        self.assert_problem(answer, 409)

    def test_films_whose_halves_share_their_bias_have_no_interval(self):
        for integrator, is_valid in (("bdpt", True), ("photon-map", False)):
            job = self.server.render(small(integrator={"type": integrator}))
            answer = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
            self.assertEqual(answer.status, 200, answer)
            denoised = self.server.job(job["id"])["denoised"]
            self.assertIsNotNone(denoised["relative"])
            self.assertEqual(denoised["low"] is not None, is_valid, denoised)
            self.assertEqual(denoised["high"] is not None, is_valid, denoised)

    def test_limits_the_rate_of_images_of_a_rendering_job(self):
        job = self.server.submit(small(samples=65536))
        self.server.wait_for_samples(job["id"], 4)
        path = f"/v1/jobs/{job['id']}/image.png?denoise=mixed"
        first = self.server.get(path)
        self.assertEqual(first.status, 200, first)
        again = self.server.get(path)
        self.assertEqual(again.headers["X-Tessera-Revision"], first.headers["X-Tessera-Revision"])
        self.server.post(f"/v1/jobs/{job['id']}/cancel")

    def test_ended_job_says_that_it_is_being_denoised(self):
        body = job_body(samples=4, film={"width": 800, "height": 600, "layers": []})
        job = self.server.render(body)
        self.assertFalse(job["denoising"])
        answer = in_background(
            lambda: self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed"))
        self.server.wait_until(job["id"], lambda now: now["denoising"], "denoising")
        self.assertEqual(answer().status, 200)
        now = self.server.job(job["id"])
        self.assertFalse(now["denoising"])
        self.assertEqual(now["denoised"]["revision"], now["revision"])

    def test_no_preview_means_none_before_the_end(self):
        job = self.server.submit(small(samples=65536, denoise={"preview": False}))
        self.server.wait_for_samples(job["id"], 4)
        path = f"/v1/jobs/{job['id']}/image.png?denoise=mixed"
        self.assert_problem(self.server.get(path), 409, "/denoise")
        self.server.post(f"/v1/jobs/{job['id']}/cancel")
        self.server.wait(job["id"])
        self.assertEqual(self.server.get(path).status, 200)

    def test_progress_events_report_previews(self):
        job = self.server.submit(small(samples=65536))
        self.server.wait_for_samples(job["id"], 4)
        with EventStream(self.server, job["id"]) as events:
            self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
            for event in events:
                if event.name == "progress" and event.json()["denoised"]:
                    self.assertGreaterEqual(event.json()["denoised"]["relative"], 0)
                    break
            else:
                self.fail("the stream ended")
        self.server.post(f"/v1/jobs/{job['id']}/cancel")


class DenoisedTargets(ApiTest):
    """stop.denoised_error."""

    STOP = {"denoised_error": 0.2, "samples_per_pixel": 4096}

    def test_job_ends_when_its_denoised_image_meets_the_target(self):
        job = self.server.render(small(stop=self.STOP))
        self.assertEqual(job["stop_reason"], "denoised_error")
        self.assertEqual(job["error"]["bias"], "consistent")
        self.assertEqual(job["spec"]["stop"]["denoised_error"], 0.2)
        denoised = job["denoised"]
        self.assertEqual(denoised["revision"], job["revision"])
        self.assertLessEqual(denoised["high"], 0.2)
        self.assertEqual(denoised["low"], 0, "only the upper bound is promised")
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
        self.assertEqual([float(x) for x in answer.headers["X-Tessera-Error"].split(",")[1:]],
                         [0, denoised["high"]])
        self.assertEqual(answer.headers["X-Tessera-Revision"], str(job["revision"]))

    def test_ends_the_same_after_a_restart(self):
        stop = {"denoised_error": 0.05, "samples_per_pixel": 65536}
        whole = self.server.render(small(stop=stop))
        self.assertEqual(whole["stop_reason"], "denoised_error")
        job = self.server.submit(small(stop=stop))
        self.server.wait_for_samples(job["id"], 4)
        self.server.kill()
        self.server.start()
        done = self.server.wait(job["id"])
        self.assertEqual(done["stop_reason"], "denoised_error")
        self.assertEqual(done["film_digest"], whole["film_digest"])

    def test_extends_a_finished_job_to_a_lower_error(self):
        job = self.server.render(small(stop=self.STOP))
        answer = self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": {"denoised_error": 0.1}})
        self.assertEqual(answer.status, 202, answer)
        done = self.server.wait(job["id"])
        self.assertEqual(done["stop_reason"], "denoised_error")
        self.assertLessEqual(done["denoised"]["high"], 0.1)

    def test_accepts_correlated_pixels(self):
        job = self.server.render(small(stop=self.STOP, sampler={"type": "zsobol"}))
        self.assertEqual(job["stop_reason"], "denoised_error")

    def test_refuses_jobs_without_an_interval(self):
        for members in (
            {"denoise": {"type": "none"}},
            {"integrator": {"type": "photon-map"}},
        ):
            answer = self.server.post("/v1/jobs", small(stop=self.STOP, **members))
            self.assert_problem(answer, 422, "/stop/denoised_error")
        job = self.server.render(small(denoise={"type": "none"}))
        answer = self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": self.STOP})
        self.assert_problem(answer, 422, "/stop/denoised_error")

    def test_failing_denoiser_leaves_the_other_rules(self):
        server = started(self, environ={"TESSERA_OIDN": FAKE_OIDN, "FAKE_OIDN": "crash"})
        job = server.render(small(stop={"denoised_error": 0.9, "samples_per_pixel": 8},
                                  denoise={"type": "oidn"}))
        self.assertEqual((job["state"], job["stop_reason"]), ("finished", "samples_per_pixel"))

    def test_command_line_accepts_it_and_reports_the_bound(self):
        output = os.path.join(self.server.data, "clean.png")
        code, printed, said = tessera(
            "render", "cornell-box", "-o", output, "--size", "70x40", "--denoised-error", "20%",
            "--denoise", "mixed", "--json", environ={"TESSERA_OIDN": "/no/such/folder"})
        self.assertEqual(code, 0, said)
        result = json.loads(printed)
        self.assertEqual(result["stop_reason"], "denoised_error")
        self.assertLessEqual(result["denoised"]["high"], 0.2)
        self.assertEqual(result["denoised"]["low"], 0)
        self.assertEqual(result["denoised"]["type"], "statistical")


class OpenImageDenoise(ApiTest):
    """A library that replaces Open Image Denoise works, and fails in every way."""

    def serve(self, fault="", folder=FAKE_OIDN):
        server = Server(environ={"TESSERA_OIDN": folder, "FAKE_OIDN": fault})
        self.addCleanup(server.close)
        return server.start()

    def refusal(self, fault, folder=FAKE_OIDN):
        """Checks the message of `oidn` for this failure, that `auto` falls back and reports the
        same, and that nothing else is affected."""
        server = self.serve(fault, folder)
        job = server.render(small(denoise={"type": "oidn"}))
        path = f"/v1/jobs/{job['id']}"
        film = server.get(path + "/film").body
        answer = server.get(path + "/image.png?denoise=mixed")
        self.assert_problem(answer, 503)
        why = answer.json()["detail"]
        self.assertEqual(server.get(path + "/image.png").status, 200)
        self.assertEqual(server.get(path + "/film").body, film)
        after = server.job(job["id"])
        self.assertEqual((after["state"], after["denoised"]), ("finished", None))
        other = server.render(small())
        answer = server.get(f"/v1/jobs/{other['id']}/image.png?denoise=mixed")
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(answer.headers["X-Tessera-Denoiser"], "statistical 2, mixed; " + why)
        denoised = server.job(other["id"])["denoised"]
        self.assertEqual((denoised["type"], denoised["note"]), ("statistical", why))
        return why

    def test_answers_report_version_quality_and_hash(self):
        server = self.serve()
        job = server.render(small())
        answer = server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
        with open(os.path.join(FAKE_OIDN, "lib", "libOpenImageDenoise.so.2"), "rb") as library:
            sha256 = hashlib.sha256(library.read()).hexdigest()
        text = f"oidn 2.5.1, balanced, sha256 {sha256}, mixed"
        self.assertEqual(answer.headers["X-Tessera-Denoiser"], text)
        denoised = server.job(job["id"])["denoised"]
        made = {"type": "oidn", "version": "2.5.1", "sha256": sha256, "quality": "balanced",
                "note": None}
        self.assertEqual({k: denoised[k] for k in made}, made)

    def test_makes_the_first_preview_with_the_faster_denoiser(self):
        server = self.serve()
        job = server.submit(small(samples=65536))
        server.wait_for_samples(job["id"], 4)
        path = f"/v1/jobs/{job['id']}"
        first = server.get(path + "/image.png?denoise=mixed")
        self.assertEqual(first.status, 200, first)
        self.assertTrue(first.headers["X-Tessera-Denoiser"].startswith("statistical 2, mixed; "))
        self.assertIn("faster denoiser", server.job(job["id"])["denoised"]["note"])
        server.post(f"{path}/cancel")
        server.wait(job["id"])
        last = server.get(path + "/image.png?denoise=mixed")
        self.assertTrue(last.headers["X-Tessera-Denoiser"].startswith("oidn 2.5.1, balanced"))
        self.assertIsNone(server.job(job["id"])["denoised"]["note"])

    def test_reports_a_crash(self):
        self.assertIn("ended without a result", self.refusal("crash"))

    def test_reports_another_major_version(self):
        self.assertIn("version 3 is not supported", self.refusal("version 3"))

    def test_reports_a_missing_library(self):
        why = self.refusal("", "/no/such/folder")
        self.assertIn("/no/such/folder/libOpenImageDenoise.so.2", why)

    def test_ends_a_hang_which_blocks_nothing_else(self):
        server = self.serve("hang")
        job = server.render(small(denoise={"type": "oidn"}))
        path = f"/v1/jobs/{job['id']}"
        denoised = in_background(lambda: server.get(path + "/image.png?denoise=mixed"))
        self.assertEqual(server.get(path + "/image.png").status, 200)
        self.assertEqual(server.render(small())["state"], "finished")
        answer = denoised()
        self.assert_problem(answer, 503)
        self.assertIn("took too long and was stopped", answer.json()["detail"])

    def test_command_line_reports_it_too(self):
        environ = {"TESSERA_OIDN": FAKE_OIDN, "FAKE_OIDN": "crash"}
        output = os.path.join(self.server.data, "fallback.png")
        code, _, said = tessera("render", "cornell-box", "-o", output, "--size", "48x32",
                                "--spp", "4", "--denoise", "mixed", environ=environ)
        self.assertEqual(code, 0, said)
        self.assertIn("ended without a result", said)
