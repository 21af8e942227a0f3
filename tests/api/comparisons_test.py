"""Comparisons of jobs and images over HTTP."""

import struct
import zlib

from harness import ApiTest, in_background, job_body


def wide_png(width, height, is_cut=False):
    """Grey, one bit per pixel, all black. is_cut: half of the pixels' data are missing, so that
    only the header can be read."""
    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )
    packed = zlib.compress((b"\0" + bytes((width + 7) // 8)) * height)
    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 1, 0, 0, 0, 0))
        + chunk(b"IDAT", packed[: len(packed) // 2] if is_cut else packed)
        + chunk(b"IEND", b"")
    )


class Comparisons(ApiTest):
    def compare(self, a, b, **members):
        return self.server.post("/v1/comparisons", {"a": a, "b": b, **members})

    def upload(self, data, kind="image/x-exr"):
        return self.server.request(
            "POST", "/v1/assets", data, {"Content-Type": kind}
        ).json()["id"]

    def test_two_jobs_that_differ_in_their_seed(self):
        a, b = (self.server.render(job_body(samples=32, seed=seed))["id"] for seed in (1, 2))
        answer = self.compare(a, b)
        self.assertEqual(answer.status, 201, answer)
        result = answer.json()
        self.assertLess(result["bias"]["low"], result["bias"]["value"])
        self.assertGreater(result["bias"]["high"], result["bias"]["value"])
        # 1,536 pixels: the standard error of the mean of z is 0.026; six of them.
        self.assertLess(abs(result["z"]["mean"]), 0.16)
        self.assertLess(result["z"]["share_above_3"], 0.02)
        self.assertGreater(result["flip"], 0)
        self.assertEqual(self.server.get(answer.headers["Location"]).json(), result)
        maps = []
        for name in ("difference", "z", "flip"):
            picture = self.server.get(result["links"][name])
            self.assertEqual((picture.status, picture.body[:8]), (200, b"\x89PNG\r\n\x1a\n"))
            self.assertEqual(struct.unpack_from(">II", picture.body, 16), (48, 32))
            maps.append(picture.body)
        self.assertEqual(len(set(maps)), 3)
        self.assert_problem(self.server.get(result["links"]["self"] + "/secrets.png"), 404)
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.get(result["links"]["self"]).json(), result)
        self.assertEqual(self.server.get(result["links"]["z"]).body, maps[1])

    def test_a_job_and_its_denoised_images(self):
        job = self.server.render(job_body(samples=32))["id"]
        path = f"/v1/jobs/{job}/image.exr?layer=denoised&denoise="
        for denoise in ("mixed", "full"):
            answer = self.compare(job, job, a_denoise=denoise)
            self.assertEqual(answer.status, 201, answer)
            result = answer.json()
            self.assertGreater(result["mse"], 0)
            self.assertEqual([result["bias"]["low"], result["z"]["mean"]], [None, None])
            own = self.upload(self.server.get(path + denoise).body)
            same = self.compare(job, own, a_denoise=denoise).json()
            # The file stores half floats, accurate to 2^-11.
            self.assertLess(same["relmse"], 2.0 ** -22)
        self.assert_problem(self.compare(job, own, b_denoise="full"), 422, "/b_denoise")
        self.assert_problem(self.compare(job, job, a_denoise="some"), 422, "/a_denoise")
        refuses = self.server.render(job_body(denoise={"type": "none"}))["id"]
        self.assert_problem(self.compare(job, refuses, b_denoise="full"), 422, "/b")

    def test_a_job_and_its_own_images(self):
        job = self.server.render(job_body(samples=32))["id"]
        exr = self.upload(self.server.get(f"/v1/jobs/{job}/image.exr").body)
        result = self.compare(job, exr).json()
        # Half floats are accurate to 2^-11.
        self.assertLess(result["relmse"], 2.0 ** -22)
        self.assertLess(result["flip"], 0.01)
        self.assertEqual(result["z"]["share_above_3"], 0)
        png = self.upload(self.server.get(f"/v1/jobs/{job}/image.png?curve=srgb").body)
        # Bytes clip values above white; FLIP compares display values.
        self.assertLess(self.compare(job, png).json()["flip"], 0.02)
        self.assertLess(self.compare(png, job).json()["flip"], 0.02)

    def test_finds_a_gain_of_a_hundredth(self):
        a = self.server.render(job_body(samples=512, seed=1))["id"]
        sky = {"intensity": 1.01}
        bright = self.server.render(
            job_body(scene="furnace", samples=256, seed=1, environment=sky)
        )["id"]
        plain = self.server.render(job_body(scene="furnace", samples=256, seed=2, environment={}))[
            "id"
        ]
        result = self.compare(bright, plain).json()
        mean = (
            sum(
                self.server.get(f"/v1/jobs/{plain}/pixels/24/16").json()["layers"]["beauty"]["mean"]
            )
            / 3
        )
        self.assertGreater(result["bias"]["low"], 0)
        self.assertLess(result["bias"]["low"], 0.0101 * max(mean, 1))
        self.assertGreater(result["z"]["mean"], 0.2)
        self.assertEqual(self.compare(a, a).json()["mse"], 0)

    def test_reports_incomparable_images(self):
        job = self.server.render(job_body())["id"]
        film = dict(job_body()["film"], width=50)
        wider = self.server.render(job_body(film=film))["id"]
        self.assert_problem(self.compare(job, wider), 422, "/b")
        text = self.upload(b"no image", "application/octet-stream")
        self.assert_problem(self.compare(job, text), 422, "/b")
        self.assert_problem(self.compare(text, job), 422, "/a")
        self.assert_problem(self.compare(text, text), 422, "/a")
        self.assert_problem(self.compare(job, "0" * 64), 404, "/b")
        self.assert_problem(self.compare("00000000-0000-4000-8000-000000000000", job), 404, "/a")
        self.assert_problem(self.compare("x", job), 422, "/a")
        self.assert_problem(self.server.get("/v1/comparisons/x"), 404)
        running = self.server.submit(job_body(samples=65536))["id"]
        self.assert_problem(self.compare(running, job), 409, "/a")
        self.server.post(f"/v1/jobs/{running}/cancel")

    def test_does_not_treat_a_job_without_a_complete_pass_as_black(self):
        film = {"width": 1600, "height": 1200, "layers": []}
        early = self.server.submit(job_body(samples=1024, film=film))["id"]
        self.server.wait_until(early, lambda now: now["progress"]["samples_per_pixel"]["mean"] > 0)
        self.server.post(f"/v1/jobs/{early}/cancel")
        self.assertEqual(self.server.wait(early)["progress"]["samples_per_pixel"]["min"], 0)
        problem = self.assert_problem(self.compare(early, early), 409, "/a")
        self.assertIn("before every pixel had a sample", problem["errors"][0]["detail"])

    def test_refuses_too_large_images_before_decoding(self):
        job = self.server.render(job_body())["id"]
        limit = self.server.get("/v1/server").json()["limits"]["comparison_pixels"]
        self.assertGreater(10000 * 1000, limit)
        for is_cut in (False, True):
            wide = self.upload(wide_png(10000, 1000, is_cut))
            problem = self.assert_problem(self.compare(job, wide), 413, "/b")
            self.assertIn(str(limit), problem["errors"][0]["detail"])
        # Only decoding tells that the pixels are cut.
        self.assertEqual(self.compare(job, self.upload(wide_png(48, 32))).status, 201)
        self.assert_problem(self.compare(job, self.upload(wide_png(48, 32, True))), 422, "/b")
        bad = (b"{", 400), (b"[]", 422), (b'{"a": "x"}', 422)
        for body, status in bad:
            answer = self.server.request(
                "POST", "/v1/comparisons", body, {"Content-Type": "application/json"}
            )
            self.assert_problem(answer, status)

    def test_comparison_of_an_adaptive_image_has_an_interval(self):
        plain = self.server.render(job_body(samples=64, seed=1))["id"]
        job = self.server.render(
            job_body(samples=64, seed=2, adaptive={"type": "pilot", "min_samples": 16})
        )["id"]
        result = self.compare(job, plain).json()
        self.assertIsNotNone(result["bias"]["low"])
        self.assertIsNotNone(result["z"]["mean"])
        self.assertGreater(result["mse"], 0)

    def test_replicates_bound_the_bias_of_correlated_images(self):
        sky = {"intensity": 1.05}
        for options in (
            {"sampler": {"type": "zsobol", "replicates": 16}},
            {"sampler": {"replicates": 16}, "light_sampler": {"type": "restir", "block": 4}},
        ):
            body = dict(scene="furnace", samples=64, **options)
            a, b = (
                self.server.render(job_body(seed=seed, environment={}, **body))["id"]
                for seed in (1, 2)
            )
            bias = self.compare(a, b).json()["bias"]
            self.assertLess(bias["low"], bias["value"], options)
            self.assertGreater(bias["high"], bias["value"], options)
            bright = self.server.render(job_body(seed=3, environment=sky, **body))["id"]
            self.assertGreater(self.compare(bright, a).json()["bias"]["low"], 0, options)
        # Two replicates leave one degree of freedom.
        two = [
            self.server.render(job_body(samples=64, seed=seed, sampler={"type": "zsobol"}))["id"]
            for seed in (1, 2)
        ]
        bias = self.compare(*two).json()["bias"]
        self.assertGreater(bias["high"] - bias["low"], 0)

    def test_downloads_maps_like_other_files(self):
        a, b = (self.server.render(job_body(samples=8, seed=seed))["id"] for seed in (1, 2))
        link = self.compare(a, b).json()["links"]["z"]
        whole = self.server.get(link)
        self.assertEqual(
            self.server.get(link, {"If-None-Match": whole.headers["ETag"]}).status, 304
        )
        piece = self.server.get(link, {"Range": "bytes=8-99"})
        self.assertEqual((piece.status, piece.body), (206, whole.body[8:100]))
        self.assert_problem(self.server.get(link, {"Range": "bytes=999999999-"}), 416)
        self.assert_problem(self.server.get(link + "?x=1"), 422)

    def test_jobs_may_be_deleted_during_and_after_a_comparison(self):
        film = {"width": 400, "height": 300, "layers": []}
        a, b = (
            self.server.render(job_body(samples=2, seed=seed, film=film))["id"] for seed in (1, 2)
        )
        kept = self.compare(a, b).json()
        several = [in_background(lambda: self.compare(a, b)) for _ in range(4)]
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{a}").status, 204)
        for answer in (result() for result in several):
            self.assertIn(answer.status, (201, 404), answer)
        self.assert_problem(self.compare(a, b), 404, "/a")
        self.assertEqual(self.server.get(kept["links"]["self"]).json(), kept)
        self.assertEqual(self.server.get(kept["links"]["flip"]).status, 200)
        self.assertEqual(self.server.get(kept["links"]["a"]).status, 404)
