"""The image in every format and part, single pixels, the convergence curve."""

import itertools
import math
import pathlib
import re
import struct
import time

from churn import metric
from harness import PATIENCE_S, ApiTest, job_body, png_pixels, png_size, tessera, wait_for

MAGIC = {"png": b"\x89PNG", "jpg": b"\xff\xd8\xff", "webp": b"RIFF", "exr": b"\x76\x2f\x31\x01",
         "hdr": b"#?", "tif": (b"II*\0", b"MM\0*"), "avif": b"\0\0\0\x1cftypavif"}
MIME = {"png": "image/png", "jpg": "image/jpeg", "webp": "image/webp", "exr": "image/x-exr",
        "hdr": "image/vnd.radiance", "tif": "image/tiff", "avif": "image/avif"}


class Images(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        body = job_body(samples=8)
        body["film"] = {"width": 70, "height": 40}
        cls.job = cls.server.render(body)
        cls.path = f"/v1/jobs/{cls.job['id']}"

    def image(self, rest="/image.png", **headers):
        answer = self.server.get(
            self.path + rest, {k.replace("_", "-"): v for k, v in headers.items()}
        )
        self.assertEqual(answer.status, 200, answer)
        return answer

    def test_selects_every_format_by_suffix(self):
        for suffix, magic in MAGIC.items():
            answer = self.image("/image." + suffix)
            self.assertTrue(answer.body.startswith(magic), suffix)
            self.assertEqual(answer.headers["Content-Type"], MIME[suffix])

    def test_selects_every_format_by_accept(self):
        for suffix, mime in MIME.items():
            answer = self.image("/image", Accept=mime)
            self.assertEqual(answer.headers["Content-Type"], mime)
            self.assertTrue(answer.body.startswith(MAGIC[suffix]), suffix)
            self.assertIn("Accept", answer.headers["Vary"])

    def test_accept_has_weights_and_wildcards(self):
        for accept, mime in (("image/gif, image/webp;q=0.5, image/jpeg;q=0.9", "image/jpeg"),
                             ("image/*", "image/png"), ("*/*", "image/png"),
                             ("image/avif,image/webp,image/*,*/*;q=0.8", "image/avif"),
                             ("image/png;q=0, image/x-exr", "image/x-exr")):
            self.assertEqual(
                self.image("/image", Accept=accept).headers["Content-Type"], mime, accept
            )

    def test_png_has_sixteen_bits_if_asked(self):
        deep = self.image("/image.png?bits=16")
        self.assertEqual((png_size(deep.body)[:2], deep.body[24]), ((70, 40), 16))  # IHDR's depth
        self.assertEqual(self.image("/image.png?bits=8").body, self.image("/image.png").body)
        for rest in ("/image.jpg?bits=16", "/image.exr?bits=16", "/image.png?bits=12"):
            self.assert_problem(self.server.get(self.path + rest), 422, "/bits")

    def test_white_balance_and_contrast_change_the_image_only(self):
        def mean(query):
            rows = png_pixels(self.image("/image.png?curve=linear" + query).body)
            flat = [pixel for row in rows for pixel in row]
            return [sum(p[c] for p in flat) / len(flat) for c in range(3)]

        plain, warm = mean(""), mean("&white_balance=2700")
        self.assertLess(warm[0] / warm[2], plain[0] / plain[2])  # a lamp's light becomes bluer
        self.assertNotEqual(mean("&contrast=2"), plain)
        self.assertEqual(mean("&contrast=1"), plain)
        for name, bad, good in (("white_balance", 500, 3000), ("contrast", 0, 2)):
            for file in (f"png?{name}={bad}", f"exr?{name}={good}"):
                answer = self.server.get(f"{self.path}/image.{file}")
                self.assert_problem(answer, 422, "/" + name)

    def test_image_without_accept_is_png(self):
        self.assertEqual(self.image("/image").headers["Content-Type"], "image/png")

    def test_every_image_reports_its_bias(self):
        def bias(path):
            answer = self.server.get(path)
            self.assertEqual(answer.status, 200, answer)
            return answer.headers["X-Tessera-Bias"]

        about = self.server.get("/v1/server").json()
        for name in about["image_formats"]:
            self.assertEqual(bias(f"{self.path}/image.{name}"), "none", name)
        self.assertEqual(bias(self.path + "/image.png?denoise=full"), "biased")
        for row in about["integrators"]:
            if row["bias"] != "none":
                job = self.server.render(job_body(samples=2, integrator={"type": row["type"]}))
                self.assertEqual(bias(f"/v1/jobs/{job['id']}/image.png"), row["bias"])

    def test_reports_the_error_and_the_light_set_aside(self):
        error = self.job["error"]
        said = [float(x) for x in self.image().headers["X-Tessera-Error"].split(",")]
        self.assertEqual(said, [error["relative"], error["low"], error["high"]])
        self.assertRegex(self.image().headers["X-Tessera-Set-Aside"], r"^\d+\.\d\d%$")

    def test_fireflies_are_set_aside_for_display_only_and_on_request(self):
        shown = self.image()
        kept = self.image("/image.png?fireflies=keep")
        self.assertEqual(self.image("/image.png?fireflies=set_aside").body, shown.body)
        self.assertIsNone(kept.headers.get("X-Tessera-Set-Aside"))
        self.assertNotEqual(kept.body, shown.body, "single bright pixels")
        raw = self.image("/image.exr?layer=beauty")
        self.assertIsNone(raw.headers.get("X-Tessera-Set-Aside"))
        self.assertEqual(self.image("/image.exr?layer=beauty&fireflies=keep").body, raw.body)
        calm = self.image("/image.exr?layer=beauty&fireflies=set_aside")
        self.assertEqual(calm.headers["X-Tessera-Set-Aside"], shown.headers["X-Tessera-Set-Aside"])

    def test_fireflies_are_refused_where_they_do_not_apply(self):
        for rest in ("/image.png?layer=depth&fireflies=keep", "/image.exr?fireflies=set_aside",
                     "/image.png?denoise=mixed&fireflies=keep", "/image.png?fireflies=some"):
            self.assert_problem(self.server.get(self.path + rest), 422, "/fireflies")
        self.assert_problem(self.server.get(self.path + "/tiles?fireflies=set_aside"), 422,
                            "/fireflies")

    def test_every_layer_in_png_and_exr(self):
        for layer in self.server.get("/v1/server").json()["layers"]:
            self.assertEqual(
                png_size(self.image(f"/image.png?layer={layer}").body)[:2], (70, 40), layer
            )
            self.assertTrue(self.image(f"/image.exr?layer={layer}").body.startswith(MAGIC["exr"]))

    def test_exr_holds_all_layers(self):
        head = self.image("/image.exr").body[:4000]
        for channel in (b"R\0", b"G\0", b"B\0", b"albedo.", b"normal.", b"depth.", b"samples.",
                        b"variance.", b"error."):
            self.assertIn(channel, head)
        self.assertNotIn(b"albedo.", self.image("/image.exr?layer=beauty").body[:1000])

    def test_parts_of_the_bytes_can_be_requested(self):
        for name in ("image.png", "image.exr", "image.png?max_size=8"):
            self.assert_ranges(f"/v1/jobs/{self.job['id']}/{name}")

    def test_etag_gives_304_and_distinguishes_images(self):
        tags = set()
        for rest in ("/image.png", "/image.jpg", "/image.png?layer=alpha", "/image.png?exposure=1",
                     "/image.png?tonemap=aces", "/image.png?max_size=10"):
            first = self.image(rest)
            again = self.server.get(self.path + rest, {"If-None-Match": first.headers["ETag"]})
            self.assertEqual((again.status, again.body), (304, b""))
            tags.add(first.headers["ETag"])
        self.assertEqual(len(tags), 6)
        self.assertEqual(
            len({self.image("/image", Accept=m).headers["ETag"] for m in MIME.values()}), len(MIME)
        )

    def test_equal_images_have_equal_bytes(self):
        self.assertEqual(self.image("/image.exr").body, self.image("/image.exr").body)

    def test_returns_a_known_revision(self):
        self.assertEqual(self.image(f"/image.png?revision={self.job['revision']}").headers["ETag"],
                         self.image().headers["ETag"])

    def test_max_size_scales_down_but_never_up(self):
        for size, expected in ((35, (35, 20)), (1, (1, 1)), (70, (70, 40)), (500, (70, 40))):
            got = png_size(self.image(f"/image.png?max_size={size}").body)[:2]
            self.assertEqual(got, expected, size)

    def test_part_equals_the_crop_of_the_whole(self):
        whole = png_pixels(self.image().body)
        part = png_pixels(self.image("/image.png?x=33&y=5&width=20&height=30").body)
        self.assertEqual(part, [row[33:53] for row in whole[5:35]])

    def test_exposure_and_tone_maps_change_the_image(self):
        plain = self.image().body
        self.assertNotEqual(self.image("/image.png?exposure=1").body, plain)
        bodies = {self.image(f"/image.png?tonemap={t}").body
                  for t in self.server.get("/v1/server").json()["tone_maps"]}
        self.assertEqual(len(bodies), 5)
        self.assertNotEqual(self.image("/image.png?tonemap=srgb").body, plain)
        for query in ("tonemap=khronos-neutral", "curve=khronos-neutral", "curve=neutral"):
            self.assertEqual(self.image("/image.png?" + query).body, plain)
        self.assertEqual(self.image("/image.png?curve=srgb").body,
                         self.image("/image.png?tonemap=srgb").body)

    def test_default_tone_curve_is_khronos_neutral(self):
        # Of the formula in Khronos' specification: greys below 0.76 lose 0.04, here by sRGB codes.
        grey = {"scene": "furnace", "film": {"width": 8, "height": 8, "layers": []},
                "environment": {"color": [0.5, 0.5, 0.5]}, "camera": {
                    "position": [0, 1000, 0], "target": [0, 2000, 0], "up": [0, 0, 1]},
                "stop": {"samples_per_pixel": 2}}
        job = self.server.render(grey)["id"]

        def code(query):
            rows = png_pixels(self.server.get(f"/v1/jobs/{job}/image.png{query}").body)
            return rows[4][4]

        def srgb(linear):
            return round(255 * (1.055 * linear ** (1 / 2.4) - 0.055))

        self.assertEqual(set(code("?curve=srgb")), {srgb(0.5)})
        self.assertEqual(set(code("")), {srgb(0.46)})
        # 1.04 is compressed: 1 - 0.24^2 / (1 + 0.24 - 0.76) = 0.88.
        bright = code("?exposure=1.0566")  # log2(1.04 / 0.5)
        self.assertEqual(set(bright), {srgb(0.88)})

    def test_automatic_exposure_is_told_and_is_that_number(self):
        self.assertEqual(self.image().headers["X-Tessera-Exposure"], "0")
        auto = self.image("/image.png?exposure=auto")
        stops = float(auto.headers["X-Tessera-Exposure"])
        self.assertAlmostEqual(10 * stops, round(10 * stops), 5)
        for suffix in ("png", "jpg", "webp"):
            told = self.image(f"/image.{suffix}?exposure=auto")
            self.assertEqual(float(told.headers["X-Tessera-Exposure"]), stops)
            self.assertEqual(told.body, self.image(f"/image.{suffix}?exposure={stops}").body)
        # A property of the film: the same for parts, thumbnails and layers of colour.
        for query in ("x=3&y=3&width=9&height=9", "max_size=16", "layer=albedo"):
            told = self.image(f"/image.png?exposure=auto&{query}")
            self.assertEqual(float(told.headers["X-Tessera-Exposure"]), stops, query)
        data = self.image("/image.png?exposure=auto&layer=normal")
        self.assertIsNone(data.headers["X-Tessera-Exposure"])
        self.assert_problem(self.server.get(self.path + "/image.png?exposure=best"), 422,
                            "/exposure")

    def test_linear_formats_refuse_display_options(self):
        for suffix in ("exr", "hdr"):
            plain = self.image(f"/image.{suffix}").body
            for query, pointer in (
                ("exposure=2", "/exposure"),
                ("exposure=auto", "/exposure"),
                ("tonemap=aces", "/tonemap"),
                ("tonemap=agx&exposure=-1", "/exposure"),
                ("stream=1&exposure=2", "/exposure"),
            ):
                answer = self.server.get(f"{self.path}/image.{suffix}?{query}")
                self.assert_problem(answer, 422, pointer)
                self.assertIn("png, jpg, webp", answer.json()["detail"])
            for query in (
                "exposure=0",
                "tonemap=srgb",
                "tonemap=linear",
                "exposure=0&tonemap=srgb",
            ):
                self.assertEqual(self.image(f"/image.{suffix}?{query}").body, plain, query)
        answer = self.server.get(self.path + "/image?exposure=2", {"Accept": "image/x-exr"})
        self.assert_problem(answer, 422, "/exposure")

    def test_tiff_reports_options_without_effect(self):
        plain = self.image("/image.tif?exposure=0&tonemap=srgb")
        self.assertIsNone(plain.headers["X-Tessera-Ignored"])
        self.assertIsNone(self.image("/image.png?exposure=2").headers["X-Tessera-Ignored"])
        told = self.image("/image.tif?exposure=2&tonemap=aces")
        self.assertEqual(
            (told.headers["X-Tessera-Ignored"], told.body), ("exposure, tonemap", plain.body)
        )

    def test_one_stop_doubles_the_light(self):
        dark = png_pixels(self.image("/image.png?tonemap=linear").body)
        light = png_pixels(self.image("/image.png?tonemap=linear&exposure=1").body)
        for a_row, b_row in zip(dark, light):
            for a, b in zip(a_row, b_row):
                for c in range(3):
                    # Each is rounded to 8 bits: half a step of a doubled, half a step of b.
                    self.assertLessEqual(abs(min(255, 2 * a[c]) - b[c]), 2)

    def test_layers_of_data_are_shown_in_a_range(self):
        # The halves of [-1, 1]: a component that points away from an axis is darker than the
        # middle, not black.
        normal = self.image("/image.png?layer=normal&range=-1,1")
        self.assertEqual(normal.headers["X-Tessera-Range"], "-1,1")
        plain = png_pixels(self.image("/image.png?layer=normal").body)
        for row, plain_row in zip(png_pixels(normal.body), plain):
            for seen, raw in zip(row, plain_row):
                for c in range(3):
                    if raw[c]:  # n to 8 bits is 255 n, and 255 (n + 1) / 2 in the range
                        self.assertLessEqual(abs(seen[c] - (raw[c] + 255) / 2), 1)
        depth = self.image("/image.png?layer=depth&range=auto")
        low, high = map(float, depth.headers["X-Tessera-Range"].split(","))
        self.assertTrue(0 < low < high)
        tones = [v for row in png_pixels(depth.body) for pixel in row for v in pixel]
        self.assertEqual((min(tones), max(tones)), (0, 255))
        for rest in ("/image.png?range=auto", "/image.exr?layer=depth&range=auto"):
            answer = self.server.get(self.path + rest)
            self.assertEqual(answer.status, 422)
            self.assertEqual(answer.json()["errors"][0]["pointer"], "/range")

    def test_opaque_images_are_rgb(self):
        self.assertEqual(png_size(self.image().body)[2], 2)

    def test_tile_urls_of_a_crop_are_inside_the_crop(self):
        body = job_body(samples=2)
        body["film"]["crop"] = {"x": 10, "y": 5, "width": 30, "height": 20}
        path = f"/v1/jobs/{self.server.render(body)['id']}"
        self.assertEqual(png_size(self.server.get(path + "/image.png").body)[:2], (30, 20))
        inside = self.server.get(path + "/image.png?x=10&y=5&width=4&height=4")
        self.assertEqual(png_size(inside.body)[:2], (4, 4))
        self.assert_problem(self.server.get(path + "/image.png?x=0&y=0&width=4&height=4"), 422)
        self.assertEqual(self.server.get(path + "/pixels/10/5").status, 200)
        self.assert_problem(self.server.get(path + "/pixels/9/5"), 404)
        self.assert_problem(self.server.get(path + "/pixels/40/5"), 404)


class Transparency(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        body = job_body("furnace", samples=8, environment={"visible": False})
        body["film"] = {"width": 64, "height": 48}
        cls.path = f"/v1/jobs/{cls.server.render(body)['id']}"

    def test_hidden_environment_gives_rgba(self):
        rows = png_pixels(self.server.get(self.path + "/image.png").body)
        alphas = {pixel[3] for row in rows for pixel in row}
        self.assertIn(0, alphas)
        self.assertIn(255, alphas)

    def test_formats_without_alpha_composite_over_white(self):
        rows = png_pixels(self.server.get(self.path + "/image.png").body)
        x, y = next((x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row)
                    if pixel[3] == 0)
        hdr = self.server.get(f"{self.path}/image.hdr?x={x}&y={y}&width=1&height=1")
        self.assertEqual(hdr.status, 200)
        # Radiance: shared exponent 129, mantissas 128: 1 each.
        self.assertEqual(hdr.body[-4:], bytes((128, 128, 128, 129)))

    def empty_pixel(self):
        rows = png_pixels(self.server.get(self.path + "/image.png").body)
        return next((x, y) for y, row in enumerate(rows) for x, p in enumerate(row) if p[3] == 0)

    def test_jpeg_of_a_transparent_job_is_white_where_it_is_empty(self):
        x, y = self.empty_pixel()
        picture = self.server.get(f"{self.path}/image.jpg?x={x}&y={y}&width=1&height=1").body
        # Uploaded as an environment file it would be decoded; here the comparison decodes it.
        asset = self.server.post("/v1/assets", picture, {"Content-Type": "image/jpeg"}).json()["id"]
        body = job_body("furnace", samples=2, environment={"visible": False})
        crop = {"x": x, "y": y, "width": 1, "height": 1}
        body["film"] = {"width": 64, "height": 48, "crop": crop}
        dark = self.server.render(body)["id"]
        answer = self.server.post("/v1/comparisons", {"a": dark, "b": asset})
        self.assertEqual(answer.status, 201, answer)
        # The job's pixel is 0, the JPEG's 1 up to rounding.
        self.assertGreater(answer.json()["mse"], 0.95)

    def test_background_fills_and_removes_alpha(self):
        x, y = self.empty_pixel()
        seen = png_pixels(self.server.get(f"{self.path}/image.png?background=3366cc").body)
        self.assertEqual(tuple(seen[y][x]), (0x33, 0x66, 0xcc))
        plain = png_pixels(self.server.get(self.path + "/image.png").body)
        u, v = next((u, v) for v, row in enumerate(plain) for u, p in enumerate(row) if p[3] == 255)
        self.assertEqual(tuple(seen[v][u]), tuple(plain[v][u][:3]))
        part = f"x={x}&y={y}&width=1&height=1"
        hdr = self.server.get(f"{self.path}/image.hdr?background=000000&{part}")
        self.assertEqual(hdr.body[-4:], bytes(4))
        # A linear format has the linear colour: sRGB 0x80 is 0.2158, 221 / 256 times 2^-2.
        hdr = self.server.get(f"{self.path}/image.hdr?background=808080&{part}")
        self.assertEqual(hdr.body[-1], 126)
        self.assertLessEqual(abs(hdr.body[-4] - 221), 1)

    def test_refuses_wrong_backgrounds(self):
        for value in ("fff", "ffffff0", "gggggg", "-fffff", "white", ""):
            answer = self.server.get(f"{self.path}/image.png?background={value}")
            self.assert_problem(answer, 422, "/background")
        for rest in ("/image.png?layer=alpha&background=ffffff", "/image.exr?background=ffffff"):
            self.assert_problem(self.server.get(self.path + rest), 422, "/background")


class Pixels(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        body = job_body(samples=16)
        body["film"]["layers"] = ["albedo", "normal", "depth"]
        cls.job = cls.server.render(body)
        cls.path = f"/v1/jobs/{cls.job['id']}"

    def test_pixel_has_means_intervals_and_halves(self):
        pixel = self.server.get(self.path + "/pixels/24/30").json()
        self.assertEqual((pixel["x"], pixel["y"], pixel["samples"]), (24, 30, 16))
        beauty = pixel["layers"]["beauty"]
        self.assertEqual(set(beauty), {"mean", "standard_error", "low", "high", "halves"})
        self.assertEqual([len(half) for half in beauty["halves"]], [3, 3])
        for c in range(3):
            self.assertTrue(beauty["low"][c] <= beauty["mean"][c] <= beauty["high"][c])
            self.assertGreaterEqual(beauty["standard_error"][c], 0)
            middle = (beauty["halves"][0][c] + beauty["halves"][1][c]) / 2
            self.assert_close(beauty["mean"][c], middle, 1e-5 * max(1, abs(middle)))
        self.assertLessEqual({"albedo", "normal", "depth", "alpha"}, set(pixel["layers"]))

    def test_normal_has_at_most_unit_length_and_depth_is_positive(self):
        layers = self.server.get(self.path + "/pixels/24/30").json()["layers"]
        self.assertLessEqual(math.hypot(*layers["normal"]["mean"]), 1 + 1e-5)
        self.assertGreater(layers["depth"]["mean"][0], 0)

    def test_image_shows_the_mean_of_the_pixel(self):
        row = png_pixels(self.server.get(self.path + "/image.png?tonemap=linear").body)[30]
        mean = self.server.get(self.path + "/pixels/24/30").json()["layers"]["beauty"]["mean"]
        for c in range(3):
            # 8 bits, with any rounding.
            self.assert_close(row[24][c] / 255, min(1, max(0, mean[c])), 1.01 / 255)

    def test_curve_starts_early_and_ends_at_the_end(self):
        answer = self.server.get(self.path + "/convergence")
        curve = answer.json()
        self.assertEqual(set(curve), {"points", "slope"})
        self.assertEqual(set(curve["slope"]), {"value", "low", "high"})
        points = curve["points"]
        self.assertEqual(points[-1]["samples_per_pixel"], 16)
        self.assertEqual(points[-1]["relative"], self.job["error"]["relative"])
        for before, after in zip(points, points[1:]):
            for member in ("samples_per_pixel", "elapsed_seconds", "cpu_seconds", "rays"):
                self.assertLessEqual(before[member], after[member])
        for point in points:
            self.assertLessEqual({"samples_per_pixel", "elapsed_seconds", "cpu_seconds", "rays",
                                  "relative", "low", "high"}, set(point))

    def test_one_sample_has_unknown_errors(self):
        job = self.server.render(job_body(samples=1, sampler={"type": "independent"}))
        pixel = self.server.get(f"/v1/jobs/{job['id']}/pixels/3/3").json()
        if pixel["samples"] == 1:
            self.assertEqual(pixel["layers"]["beauty"]["standard_error"], [None] * 3)
            self.assertEqual(pixel["layers"]["beauty"]["halves"][1], [None] * 3)


class Furnace(ApiTest):
    def test_every_pixel_is_one_within_its_error(self):
        body = job_body("furnace", samples=64)
        body["film"] = {"width": 96, "height": 64, "layers": []}
        job = self.server.render(body)
        self.assertEqual(job["statistics"]["rejected_samples"], 0)
        data = self.server.get(f"/v1/jobs/{job['id']}/image.hdr?layer=beauty").body
        self.assertTrue(data.startswith(b"#?"))
        tiles = self.server.get(f"/v1/jobs/{job['id']}/tiles").body
        means, variances, place = [], [], 0
        while place < len(tiles):
            size, flags = struct.unpack("<I", tiles[place + 4:place + 8])[0], tiles[place + 20]
            payload = tiles[place + 32:place + 32 + size]
            place += 32 + size
            if flags & 1:
                break
            values = struct.unpack(f"<{size // 4}f", payload)
            count = len(values) // 7
            means += values[:count]
            variances += values[3 * count:4 * count]
        count = len(means)
        mean = sum(means) / count
        deviation = math.sqrt(sum(variances)) / count
        # Four deviations, plus the error of thousands of float sums: at most 2^-23 each.
        self.assert_close(mean, 1, 4 * deviation + 1e-4)


class KeptImages(ApiTest):
    FLAGS = ("--film-cache", "1M")  # less than the film of 128x128

    def test_an_image_of_an_ended_job_is_encoded_once(self):
        body = job_body(samples=2)
        body["film"] = {"width": 128, "height": 128}
        path = f"/v1/jobs/{self.server.render(body)['id']}"
        first = self.server.get(path + "/image.png")
        self.assertEqual(first.status, 200, first)
        films = pathlib.Path(self.server.data, "films")
        for film in films.iterdir():
            film.unlink()
        again = self.server.get(path + "/image.png")
        self.assertEqual((again.status, again.body), (200, first.body))
        self.assertEqual(again.headers["ETag"], first.headers["ETag"])
        # Images that are encoded when the job ends may hold its film for a moment.
        deadline = time.monotonic() + PATIENCE_S
        for exposure in itertools.count(1):
            other = self.server.get(f"{path}/image.png?exposure={exposure / 1000}")
            if other.status != 200 or time.monotonic() > deadline:
                break
            time.sleep(0.02)
        self.assert_problem(other, 410)


class FirstImages(ApiTest):
    FLAGS = ("--film-cache", "1M")  # less than the film of 128x128

    def wait_for_images(self, count):
        wait_for(lambda: metric(self.server, "tessera_cached_images") >= count)

    def test_images_that_the_page_opens_with_are_encoded_when_the_job_ends(self):
        # tests/e2e/series.test.mjs has the same queries.
        for background, extension in (("environment", "jpg"), ("transparent", "webp")):
            images = (f"image.{extension}?exposure=auto&tonemap=khronos-neutral",
                      "image.png?max_size=192")
            body = job_body(samples=2)
            body["film"] = {"width": 128, "height": 128}
            body["background"] = {"type": background}
            before = metric(self.server, "tessera_cached_images")
            path = f"/v1/jobs/{self.server.render(body)['id']}/"
            self.wait_for_images(before + 2)
            for film in pathlib.Path(self.server.data, "films").glob("*.film"):
                film.unlink()
            for image in images:
                self.assertEqual(self.server.get(path + image).status, 200, image)
            self.assert_problem(self.server.get(path + "image.jpg?exposure=3"), 410)

    def cpu_seconds(self):
        text = self.server.get("/metrics").body.decode()
        return float(re.search(r"^process_cpu_seconds_total (\S+)$", text, re.MULTILINE)[1])

    def test_they_are_stored_and_do_not_need_the_film_after_a_restart(self):
        body = job_body(samples=2)
        body["film"] = {"width": 1920, "height": 1080, "layers": []}
        films = 'tessera_stored_bytes{kind="films"}'
        stored = metric(self.server, films)
        job = self.server.render(body)["id"]
        looks = pathlib.Path(self.server.data, "looks")
        film = pathlib.Path(self.server.data, "films", job + ".film")
        deadline = time.monotonic() + PATIENCE_S
        while not (looks / job).exists() or metric(self.server, films) - stored != (
                512 * film.stat().st_blocks + (looks / job).stat().st_size):
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)
        paths = [f"/v1/jobs/{job}/{image}" for image in (
            "image.jpg?exposure=auto&tonemap=khronos-neutral", "image.png?max_size=192")]
        before = [self.server.get(path) for path in paths]
        self.server.kill()
        self.server.start()
        spent = self.cpu_seconds()
        after = [self.server.get(path) for path in paths]
        self.assertLess(self.cpu_seconds() - spent, 0.3)
        named = ("ETag", "X-Tessera-Exposure", "X-Tessera-Set-Aside", "X-Tessera-Error")
        for old, new in zip(before, after):
            self.assertEqual((new.status, new.body), (200, old.body))
            self.assertEqual([new.headers[n] for n in named], [old.headers[n] for n in named])
        # A flipped bit is noticed, and the image is made from the film.
        self.server.stop()
        content = bytearray((looks / job).read_bytes())
        content[-1000] ^= 1
        (looks / job).write_bytes(content)
        part = looks / (job + ".part")  # as a kill leaves it behind
        part.touch()
        code, said, _ = tessera("check", "--data", self.server.data)
        self.assertEqual(code, 1, said)
        self.assertIn(f"damaged: looks/{job}: ", said)
        self.assertIn(f"left over: look file {job}.part", said)
        self.server.start()
        self.assertFalse(part.exists())
        for path, old in zip(paths, before):
            self.assertEqual(self.server.get(path).body, old.body)
        self.assertTrue(self.server.logged("look_damaged"))
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job}").status, 204)
        self.assertFalse((looks / job).exists())


class RunningJob(ApiTest):
    def test_progress_changes_the_etag_of_the_image(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.wait_for_samples(job)
        tags = set()
        for _ in range(3):
            answer = self.server.get(f"/v1/jobs/{job}/image.png")
            tags.add(answer.headers["ETag"])
            seen = self.server.job(job)["revision"]
            self.server.wait_until(job, lambda now: now["revision"] > seen + 2)
        self.assertEqual(len(tags), 3)
        self.server.post(f"/v1/jobs/{job}/cancel")
