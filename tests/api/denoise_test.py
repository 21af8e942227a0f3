"""Denoised pictures: made on demand, told from the plain ones, never part of the film."""

from harness import ApiTest, job_body, png_pixels, png_size


def small(samples=16, **members):
    return job_body(samples=samples, film={"width": 70, "height": 40}, **members)


class DenoisedPictures(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.job = cls.server.render(small())
        cls.path = f"/v1/jobs/{cls.job['id']}"

    def image(self, rest):
        answer = self.server.get(self.path + rest)
        self.assertEqual(answer.status, 200, answer)
        return answer

    def noise(self, rest):
        """Mean absolute difference of neighbours on a smooth wall of the box."""
        rows = png_pixels(self.image(rest).body)
        pairs = [(rows[y][x], rows[y][x + 1]) for y in range(8, 18) for x in range(30, 40)]
        return sum(abs(a[c] - b[c]) for a, b in pairs for c in range(3)) / len(pairs)

    def test_a_denoised_picture_has_less_noise(self):
        plain = self.noise("/image.png")
        self.assertEqual(self.noise("/image.png?denoise=off"), plain)
        self.assertLess(self.noise("/image.png?denoise=mixed"), 0.8 * plain)
        self.assertLess(self.noise("/image.png?denoise=full"), 0.8 * plain)

    def test_its_headers_tell_what_made_it_and_how_wrong_it_is(self):
        mixed = self.image("/image.png?denoise=mixed")
        self.assertEqual(mixed.headers["X-Tessera-Denoiser"], "statistical 1, mixed")
        self.assertEqual(mixed.headers["X-Tessera-Bias"], "consistent")
        error, low, high = (float(x) for x in mixed.headers["X-Tessera-Error"].split(","))
        self.assertLessEqual(low, error)
        self.assertLessEqual(error, high)
        full = self.image("/image.png?denoise=full")
        self.assertEqual(full.headers["X-Tessera-Bias"], "biased")
        self.assertIsNone(self.image("/image.png").headers.get("X-Tessera-Denoiser"))

    def test_the_job_tells_the_same(self):
        headers = self.image("/image.png?denoise=mixed").headers
        error = float(headers["X-Tessera-Error"].split(",")[0])
        denoised = self.server.job(self.job["id"])["denoised"]
        self.assert_close(denoised["relative_rmse"], error, 1e-5 * error)
        self.assertEqual(denoised["type"], "statistical")
        self.assertEqual(denoised["revision"], self.job["revision"])
        self.assertTrue(denoised["features"])
        plain = self.job["error"]["relative_rmse"]
        self.assert_close(denoised["gain"], (plain / error) ** 2, 0.01 * (plain / error) ** 2)

    def test_film_and_digest_know_nothing_of_it(self):
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

    def test_its_layers_are_there_by_name(self):
        for layer in ("denoised", "denoised_error", "denoise_bias", "denoise_bias_error"):
            size = png_size(self.image(f"/image.png?layer={layer}").body)[:2]
            self.assertEqual(size, (70, 40), layer)
        self.assertEqual(
            self.image("/image.png?layer=denoised").headers["X-Tessera-Error"],
            self.image("/image.png?denoise=mixed").headers["X-Tessera-Error"],
        )

    def test_a_part_is_cut_out_of_the_whole(self):
        whole = png_pixels(self.image("/image.png?denoise=mixed").body)
        part = png_pixels(self.image("/image.png?denoise=mixed&x=33&y=5&width=20&height=30").body)
        self.assertEqual(part, [row[33:53] for row in whole[5:35]])

    def test_exr_names_the_denoiser_in_its_metadata(self):
        body = self.image("/image.exr?denoise=mixed").body
        self.assertIn(b"tessera:denoiser", body)
        self.assertNotIn(b"tessera:denoiser", self.image("/image.exr").body)

    def test_other_layers_are_not_denoised(self):
        answer = self.server.get(self.path + "/image.png?layer=depth&denoise=mixed")
        self.assert_problem(answer, 422, "/denoise")
        self.assert_problem(self.server.get(self.path + "/image.png?denoise=some"), 422, "/denoise")


class DenoisedJobs(ApiTest):
    def test_a_job_may_refuse_denoised_pictures(self):
        job = self.server.render(small(denoise={"type": "none"}))
        self.assertEqual(job["spec"]["denoise"], {"type": "none", "preview": True})
        path = f"/v1/jobs/{job['id']}"
        self.assert_problem(self.server.get(path + "/image.png?denoise=mixed"), 422, "/denoise")
        self.assertEqual(self.server.get(path + "/image.png").status, 200)
        self.assertIsNone(self.server.job(job["id"])["denoised"])

    def test_unknown_denoisers_are_refused_with_their_place(self):
        answer = self.server.post("/v1/jobs", small(denoise={"type": "best"}))
        self.assert_problem(answer, 422, "/denoise/type")

    def test_one_half_alone_is_not_denoised(self):
        job = self.server.render(small(samples=1))
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
        self.assert_problem(answer, 409)

    def test_splatted_films_have_no_interval(self):
        job = self.server.render(small(integrator={"type": "light-trace"}))
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=mixed")
        self.assertEqual(answer.status, 200, answer)
        denoised = self.server.job(job["id"])["denoised"]
        self.assertIsNotNone(denoised["relative_rmse"])
        self.assertIsNone(denoised["low"])
        self.assertIsNone(denoised["high"])

    def test_pictures_of_a_job_that_renders_are_paced(self):
        job = self.server.submit(small(samples=65536))
        self.server.wait_for_samples(job["id"], 4)
        path = f"/v1/jobs/{job['id']}/image.png?denoise=mixed"
        first = self.server.get(path)
        self.assertEqual(first.status, 200, first)
        again = self.server.get(path)
        self.assertEqual(again.headers["X-Tessera-Revision"], first.headers["X-Tessera-Revision"])
        self.server.post(f"/v1/jobs/{job['id']}/cancel")

    def test_no_preview_means_none_before_the_end(self):
        job = self.server.submit(small(samples=65536, denoise={"preview": False}))
        self.server.wait_for_samples(job["id"], 4)
        path = f"/v1/jobs/{job['id']}/image.png?denoise=mixed"
        self.assert_problem(self.server.get(path), 409, "/denoise")
        self.server.post(f"/v1/jobs/{job['id']}/cancel")
        self.server.wait(job["id"])
        self.assertEqual(self.server.get(path).status, 200)
