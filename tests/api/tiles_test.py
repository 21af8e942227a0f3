"""The binary tile stream."""

import gzip
import math
import time

from harness import ApiTest, Tile, TileStream, job_body, png_pixels, tile_places


class Tiles(ApiTest):
    def submit(self, samples=16, **members):
        body = job_body(samples=samples, **members)
        body["film"] = {"width": 80, "height": 50, "layers": []}
        return self.server.submit(body)["id"]

    def newest(self, job, query=""):
        with TileStream(self.server, job, query) as stream:
            self.assertEqual(stream.status, 200)
            self.assertEqual(stream.headers["Content-Type"], "application/vnd.tessera.tiles")
            return stream.all()

    def test_stream_sends_every_tile_until_the_end(self):
        tiles = self.newest(self.submit())
        for tile in tiles:
            tile.check()
        self.assertEqual({tile.place() for tile in tiles[:-1]}, tile_places(0, 0, 80, 50))
        self.assertEqual([tile.is_end for tile in tiles], [False] * (len(tiles) - 1) + [True])

    def test_revisions_of_a_tile_increase(self):
        seen = {}
        for tile in self.newest(self.submit(64))[:-1]:
            self.assertGreater(tile.revision, seen.get(tile.place(), 0))
            seen[tile.place()] = tile.revision

    def test_finished_job_sends_every_tile_once(self):
        job = self.submit()
        done = self.server.wait(job)
        tiles = self.newest(job)
        self.assertEqual(len(tiles), 7)
        self.assertEqual({tile.place() for tile in tiles[:-1]}, tile_places(0, 0, 80, 50))
        end = tiles[-1]
        self.assertEqual((end.revision, end.payload, end.flags), (done["revision"], b"", Tile.END))
        self.assert_close(end.error, done["error"]["relative"], 1e-6)
        for tile in tiles[:-1]:
            planes = tile.check()
            self.assertEqual(tile.flags, 0)
            self.assertEqual(set(planes[6]), {16.0})
            self.assertGreaterEqual(tile.error, 0)
            for variance in planes[3] + planes[4] + planes[5]:
                self.assertGreaterEqual(variance, 0)

    def test_sends_frames_of_the_denoised_image_on_request(self):
        job = self.submit()
        self.server.wait(job)
        rows = png_pixels(
            self.server.get(f"/v1/jobs/{job}/image.png?tonemap=linear&denoise=full").body
        )
        tiles = self.newest(job, "?denoise=full")[:-1]
        plain = [tile for tile in tiles if not tile.flags & Tile.DENOISED]
        denoised = [tile for tile in tiles if tile.flags & Tile.DENOISED]
        for some in (plain, denoised):
            self.assertEqual({tile.place() for tile in some}, tile_places(0, 0, 80, 50))
        for tile in denoised:
            self.assertGreaterEqual(tile.error, 0)
            self.assert_shown(tile, rows)

    def test_sends_denoised_frames_during_rendering_and_at_the_end(self):
        job = self.submit(65536)
        revisions = set()
        with TileStream(self.server, job, "?denoise=mixed") as stream:
            for tile in stream:
                if tile.flags & Tile.DENOISED:
                    revisions.add(tile.revision)
                    if len(revisions) == 1:
                        # Not cancelled: slices in progress would still change the film.
                        self.server.request(
                            "PATCH", f"/v1/jobs/{job}", {"stop": {"samples_per_pixel": 64}}
                        )
        done = self.server.wait(job)
        self.assertEqual(done["state"], "finished")
        self.assertEqual(max(revisions), done["revision"])

    def test_refuses_values_other_than_off_mixed_and_full(self):
        job = self.submit()
        self.assert_problem(self.server.get(f"/v1/jobs/{job}/tiles?denoise=yes"), 422, "/denoise")

    def test_refuses_what_the_job_cannot_show(self):
        job = self.submit(denoise={"type": "none"})
        self.assert_problem(self.server.get(f"/v1/jobs/{job}/tiles?denoise=mixed"), 422, "/denoise")
        alone = self.submit()
        self.assert_problem(self.server.get(f"/v1/jobs/{alone}/tiles?denoise=video"), 422,
                            "/denoise")

    def assert_shown(self, tile, rows):
        """rows: bytes of the whole image, linear."""
        planes = tile.check()
        for y in range(tile.height):
            for x in range(tile.width):
                for c in range(3):
                    value = min(1, max(0, planes[c][y * tile.width + x]))
                    shown = rows[tile.y + y][tile.x + x][c] / 255
                    self.assertLessEqual(abs(value - shown), 1.01 / 255)

    def test_planes_are_the_pixels_of_the_image(self):
        job = self.submit()
        self.server.wait(job)
        path = f"/v1/jobs/{job}/image.png?tonemap=linear"
        rows = png_pixels(self.server.get(path + "&fireflies=keep").body)
        for tile in self.newest(job)[:-1]:
            self.assert_shown(tile, rows)
        calm = png_pixels(self.server.get(path).body)
        self.assertNotEqual(calm, rows)
        for tile in self.newest(job, "?planes=mean&fireflies=set_aside")[:-1]:
            self.assert_shown(tile, calm)

    def test_means_alone_are_half_floats(self):
        for hidden in (False, True):
            members = {"environment": {"visible": False}} if hidden else {}
            job = self.submit(**members)
            self.server.wait(job)
            full = {tile.place(): tile for tile in self.newest(job)[:-1]}
            small = self.newest(job, "?planes=mean")
            self.assertTrue(small[-1].is_end)
            self.assertEqual({tile.place() for tile in small[:-1]}, set(full))
            sent = sum(32 + len(tile.payload) for tile in small[:-1])
            self.assertLessEqual(sent, (9 if hidden else 7) * 80 * 50)
            for tile in small[:-1]:
                self.assertEqual(tile.flags, Tile.MEAN | (Tile.ALPHA if hidden else 0))
                means, planes = tile.check(), full[tile.place()].check()
                wanted = planes[:3] + ([planes[7]] if hidden else [])
                for plane, exact in zip(means, wanted, strict=True):
                    for a, b in zip(plane, exact, strict=True):
                        # Half a step of float16: 2^-11 of the value, 2^-25 near 0.
                        self.assertLessEqual(abs(a - b), max(abs(b) * 2**-11, 2**-25))
        refused = self.server.get(f"/v1/jobs/{job}/tiles?planes=some")
        self.assertEqual(refused.status, 422)

    def test_variance_is_that_of_the_halves(self):
        job = self.submit()
        self.server.wait(job)
        tile = self.newest(job)[0]
        planes = tile.check()
        pixel = self.server.get(f"/v1/jobs/{job}/pixels/{tile.x + 5}/{tile.y + 7}").json()
        a, b = pixel["layers"]["beauty"]["halves"]
        for c in range(3):
            expected = (a[c] - b[c]) ** 2 / 4
            self.assert_close(planes[3 + c][7 * tile.width + 5], expected, 1e-5 * expected + 1e-12)

    def test_single_half_has_no_variance(self):
        # With one sample in total only half A exists; with two, the first pass may or may not be
        # seen.
        tiles = self.newest(self.submit(1, sampler={"type": "independent"}))[:-1]
        for tile in tiles + self.newest(self.submit(2))[:-1]:
            planes = tile.check()
            for i, count in enumerate(planes[6]):
                if count == 1:
                    self.assertTrue(all(math.isnan(planes[c][i]) for c in (3, 4, 5)))
                else:
                    self.assertFalse(any(math.isnan(planes[c][i]) for c in (3, 4, 5)))

    def test_sends_only_tiles_newer_than_a_revision(self):
        job = self.submit()
        done = self.server.wait(job)
        everything = self.newest(job)[:-1]
        middle = sorted(tile.revision for tile in everything)[2]
        newer = self.newest(job, f"?after={middle}")
        self.assertEqual({t.place() for t in newer[:-1]},
                         {t.place() for t in everything if t.revision > middle})
        self.assertEqual(len(self.newest(job, f"?after={done['revision']}")), 1)

    def test_blue_noise_order_reports_correlated_errors(self):
        for sampler, flags in (("zsobol", Tile.CORRELATED), ("sobol", 0), ("halton", 0)):
            job = self.submit(16, sampler={"type": sampler})
            self.server.wait(job)
            for tile in self.newest(job)[:-1]:
                self.assertEqual(tile.flags, flags, sampler)
                self.assertGreater(tile.error, 0)
                tile.check()

    def test_shared_light_samples_report_correlated_errors(self):
        for block, history, flags in ((3, 1, Tile.CORRELATED), (2, 4, Tile.CORRELATED), (1, 4, 0)):
            job = self.submit(
                16, light_sampler={"type": "restir", "block": block, "history": history}
            )
            done = self.server.wait(job)
            self.assertEqual(
                done["spec"]["light_sampler"],
                {"type": "restir", "block": block, "history": history, "candidates_per_pixel": 1},
            )
            self.assertEqual(done["error"]["bias"], "none")
            for tile in self.newest(job)[:-1]:
                self.assertEqual(tile.flags, flags, block)
                self.assertGreater(tile.error, 0)
                tile.check()

    def test_hidden_environment_adds_an_alpha_plane(self):
        job = self.submit(environment={"visible": False}, samples=4)
        self.server.wait(job)
        for tile in self.newest(job)[:-1]:
            self.assertEqual(tile.flags, Tile.ALPHA)
            planes = tile.check()
            self.assertEqual(len(planes), 8)
            self.assertTrue(all(0 <= alpha <= 1 for alpha in planes[7]))

    def test_crop_keeps_the_positions_of_the_full_film(self):
        body = job_body(samples=2)
        body["film"] = {"width": 100, "height": 80, "layers": [],
                        "crop": {"x": 20, "y": 30, "width": 50, "height": 40}}
        job = self.server.render(body)["id"]
        tiles = self.newest(job)[:-1]
        self.assertEqual({tile.place() for tile in tiles}, tile_places(20, 30, 50, 40))

    def test_compresses_the_whole_stream(self):
        job = self.submit()
        self.server.wait(job)
        plain = self.server.get(f"/v1/jobs/{job}/tiles")
        packed = self.server.get(f"/v1/jobs/{job}/tiles", {"Accept-Encoding": "gzip"})
        self.assertEqual(plain.headers.get("Content-Encoding"), None)
        body = gzip.decompress(packed.body) if packed.headers.get("Content-Encoding") == "gzip" \
            else packed.body
        self.assertEqual(body, plain.body)

    def test_cancelled_job_ends_its_stream(self):
        job = self.submit(65536)
        with TileStream(self.server, job) as stream:
            tiles = iter(stream)
            next(tiles)
            self.server.post(f"/v1/jobs/{job}/cancel")
            last = None
            for last in tiles:
                last.check()
        self.assertTrue(last.is_end)

    def test_job_without_a_sample_also_ends_its_stream(self):
        job = self.submit(65536)
        self.server.post(f"/v1/jobs/{job}/cancel")
        self.assertTrue(self.newest(job)[-1].is_end)

    def test_slow_reader_gets_the_newest_of_each_tile(self):
        job = self.submit(65536)
        with TileStream(self.server, job) as stream:
            time.sleep(2)
            self.server.post(f"/v1/jobs/{job}/cancel")
            tiles = stream.all()
        final = {tile.place(): tile for tile in self.newest(job)[:-1]}
        last = {tile.place(): tile for tile in tiles[:-1]}
        self.assertEqual({p: t.revision for p, t in last.items()},
                         {p: t.revision for p, t in final.items()})
        self.assertEqual({p: t.payload for p, t in last.items()},
                         {p: t.payload for p, t in final.items()})
