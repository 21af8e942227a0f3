"""Jobs, images, pixels, lists and errors against a real server."""

import asyncio
import math
import os
import sys
import tempfile
import zipfile
from unittest import mock

import numpy as np
from harness import png_size
from support import FAST, ServerTest

import tessera_render
from tessera_render import AsyncClient, Client

SMALL = {"size": (48, 32), "layers": []}
LONG = {**SMALL, "samples_per_pixel": 65536}


class Jobs(ServerTest):
    def test_submits_waits_for_and_describes_a_job(self):
        job = self.client.submit("cornell-box", name="a box", labels={"k": "v"}, seed=3,
                                 samples_per_pixel=8, **SMALL)
        self.assertFalse(job.ended)
        self.assertIs(job.wait(), job)
        self.assertEqual((job.state, job.stop_reason), ("finished", "samples_per_pixel"))
        self.assertEqual((job.name, job.labels, job.spec["seed"]), ("a box", {"k": "v"}, 3))
        self.assertEqual((job.progress.fraction, job.progress.samples_mean), (1, 8))
        self.assertLess(job.error.low, job.error.relative)
        self.assertLess(job.error.relative, job.error.high)
        self.assertEqual((job.error.confidence, job.error.bias), (0.95, "none"))
        self.assertRegex(job.film_digest, "^[0-9a-f]{64}$")
        self.assertGreater(job.statistics["rays"], 0)
        self.assertEqual(self.client.job(job.id).data, job.data)

    def test_measures_without_an_image_and_compares_two_meters(self):
        meter = {"points": [{"position": [0.1, 0.4, 0.1], "normal": [0, 1, 0]}]}
        a, b = (self.client.submit("cornell-box", film=None, meter=meter, samples_per_pixel=4096,
                                   meter_error=0.5, seed=seed).wait() for seed in (1, 2))
        self.assertEqual((a.stop_reason, a.available), ("meter_error", ["meter"]))
        readings = a.meter()
        self.assertLessEqual(readings.high[0] - readings.low[0], 0.5 * readings.illuminance_lux[0])
        self.assertEqual(readings.uniformity, 1)
        compared = self.client.compare_meters(a, b)
        self.assertEqual([compared[side]["job"] for side in "ab"], [a.id, b.id])
        self.assertLess(compared["points"][0]["low"], compared["points"][0]["difference_lux"])

    def test_refuses_an_error_target_above_one(self):
        with self.assertRaises(tessera_render.Invalid) as refused:
            self.client.submit("cornell-box", relative_error=5, **SMALL)
        self.assertIn("/stop/relative_error", str(refused.exception))

    def test_creates_waits_for_downloads_and_deletes_a_batch(self):
        matrix = {"camera.orbit.theta_degrees": [160, 180], "seed": [1, 2]}
        batch = self.client.submit_batch("cornell-box", matrix, pattern="{theta_degrees}-{seed}",
                                         samples_per_pixel=2, **SMALL)
        self.assertIs(batch.wait(), batch)
        self.assertEqual((batch.state, batch.fraction), ("finished", 1))
        names = ["160-1", "160-2", "180-1", "180-2"]
        self.assertEqual([job.name for job in batch.jobs()], names)
        self.assertEqual(self.client.batch(batch.id).data, batch.data)
        self.assertIn(batch.id, [each["id"] for each in self.client.batches(limit=5)])
        with tempfile.TemporaryDirectory() as folder:
            archive = batch.archive(os.path.join(folder, "all.zip"), "jpg", exposure=1)
            self.assertEqual(zipfile.ZipFile(archive).namelist(), [n + ".jpg" for n in names])
            sheet = batch.sheet(os.path.join(folder, "all.png"))
            self.assertEqual(png_size(sheet.read_bytes())[0], 2 * 248 + 8)
            self.check_video(batch, folder)
        with self.assertRaises(tessera_render.Conflict):
            batch.retry()
        batch.delete()
        with self.assertRaises(tessera_render.NotFound):
            batch.refresh()
        with self.assertRaises(tessera_render.Invalid):
            self.client.submit_batch("cornell-box", {"seed": [-1]})

    def check_video(self, batch, folder):
        """A program in ffmpeg's place writes down what it was given."""
        program = os.path.join(folder, "ffmpeg")
        with open(program, "w", encoding="utf-8") as file:
            file.write(f"#!{sys.executable}\n"
                       "import sys\n"
                       "images = sys.stdin.buffer.read().count(b'IHDR')\n"
                       "if '0.5' in sys.argv: sys.exit('no such codec')\n"
                       "with open(sys.argv[-1].removeprefix('file:'), 'w') as file:\n"
                       "    print(images, *sys.argv[1:-1], file=file)\n")
        os.chmod(program, 0o755)
        place = os.path.join(folder, "turn.mp4")
        with mock.patch.dict(os.environ, PATH=folder):
            video = batch.video(place, fps=12, denoise="off")
            words = video.read_text(encoding="utf-8").split()
            self.assertEqual((words[0], words[words.index("-framerate") + 1]), ("4", "12"))
            with self.assertRaisesRegex(tessera_render.FfmpegFailed, "no such codec"):
                batch.video(place, fps=0.5)
            self.assertFalse(os.path.exists(place))
            with self.assertRaises(tessera_render.Invalid):
                batch.video(place, exposure=1000)
            self.assertFalse(os.path.exists(place))
        with mock.patch.dict(os.environ, PATH="/nowhere"):
            with self.assertRaisesRegex(tessera_render.FfmpegFailed, "not on the PATH"):
                batch.video(place)

    def test_every_layer_equals_the_film_bit_for_bit(self):
        job = self.client.submit("cornell-box", size=(70, 40), samples_per_pixel=4)
        film = job.tile_image()
        for tile in job.tiles():
            film.put(tile)
        job.wait()
        self.assertTrue(film.complete)
        for layer, values in (("beauty", film.mean), ("variance", film.variance),
                              ("samples", film.samples), ("alpha", film.alpha)):
            self.assertEqual(job.image(layer).tobytes(), values.tobytes(), layer)
        self.assertEqual(job.image().dtype, np.float32)
        shapes = {layer: job.image(layer).shape for layer in self.client.info().layers}
        colours = {"beauty", "albedo", "normal", "variance", "denoised", "denoise_bias",
                   "denoise_bias_error"}
        self.assertEqual(
            shapes, {name: (40, 70, 3) if name in colours else (40, 70) for name in shapes}
        )
        self.assertLessEqual({"beauty", "albedo", "normal", "depth", "error"}, set(shapes))
        normal = job.image("normal")
        self.assertLess(abs(np.linalg.norm(normal[20, 35]) - 1), 1e-3)

    def test_crop_and_parts_have_the_requested_position(self):
        whole = self.client.submit("cornell-box", size=(96, 64), samples_per_pixel=2, layers=[])
        crop = self.client.submit("cornell-box", size=(96, 64), samples_per_pixel=2, layers=[],
                                  crop=(20, 10, 50, 40))
        pixels = whole.wait().image()
        self.assertEqual(crop.wait().size, (50, 40))
        np.testing.assert_array_equal(crop.image(), pixels[10:50, 20:70])
        film = crop.tile_image()
        for tile in crop.tiles():
            film.put(tile)
        np.testing.assert_array_equal(film.mean, pixels[10:50, 20:70])
        np.testing.assert_array_equal(crop.image(part=(30, 20, 5, 6)), pixels[20:26, 30:35])
        self.assertEqual(whole.image(max_size=24).shape, (16, 24, 3))

    def test_transparent_background_has_alpha(self):
        glb = self.client.scene_glb("furnace")
        environment = {"color": [1, 0, 0], "visible": False}
        job = self.client.submit(self.client.upload(glb), environment=environment,
                                 samples_per_pixel=4, **SMALL).wait()
        image, film = job.image(), job.tile_image()
        for tile in job.tiles():
            self.assertIsNotNone(tile.alpha)
            film.put(tile)
        self.assertEqual(image.shape, (32, 48, 4))
        np.testing.assert_array_equal(image[:, :, :3], film.mean)
        np.testing.assert_array_equal(image[:, :, 3], film.alpha)
        self.assertEqual((image[:, :, 3].min(), image[:, :, 3].max()), (0, 1))

    def test_image_files_have_their_formats(self):
        job = self.client.submit("cornell-box", samples_per_pixel=2, **SMALL).wait()
        starts = {"png": b"\x89PNG", "jpg": b"\xff\xd8", "webp": b"RIFF", "exr": b"v/1\x01",
                  "hdr": b"#?RADIANCE", "tif": b"II*\0", "avif": b"\0\0\0\x1cftypavif"}
        with tempfile.TemporaryDirectory() as folder:
            for name, start in starts.items():
                path = job.save(os.path.join(folder, "p." + name))
                self.assertTrue(path.read_bytes().startswith(start), name)
            with self.assertRaises(ValueError):
                job.save(os.path.join(folder, "p.bmp"))
        self.assertEqual(png_size(job.picture(max_size=12))[:2], (12, 8))
        self.assertNotEqual(job.picture(exposure=2), job.picture())
        self.assertNotEqual(job.picture(exposure="auto"), job.picture(exposure=9))
        with self.assertRaises(tessera_render.Invalid):
            job.picture(tonemap="sepia")
        for options in ({"exposure": 2}, {"tonemap": "aces"}):
            for format in ("exr", "hdr", "tiff"):
                with self.assertRaisesRegex(ValueError, "is linear"):
                    job.picture(format=format, **options)
        self.assertEqual(
            job.picture(format="exr", exposure=0, tonemap="linear"), job.picture(format="exr")
        )

    def test_pixel_has_its_interval_and_its_halves(self):
        job = self.client.submit("cornell-box", size=(48, 32), samples_per_pixel=8).wait()
        pixel = job.pixels(20, 10)
        np.testing.assert_array_equal(pixel.beauty.mean.astype(np.float32), job.image()[10, 20])
        np.testing.assert_allclose(pixel.beauty.halves.mean(axis=0), pixel.beauty.mean, rtol=1e-5)
        self.assertTrue((pixel.beauty.low <= pixel.beauty.mean).all())
        self.assertTrue((pixel.beauty.high >= pixel.beauty.mean).all())
        self.assertEqual((pixel.x, pixel.y, pixel.samples), (20, 10, 8))
        self.assertIsNone(pixel.layers["depth"].halves)
        with self.assertRaises(tessera_render.NotFound):
            job.pixels(48, 0)

    def test_convergence_ends_with_the_job(self):
        job = self.client.submit("cornell-box", samples_per_pixel=32, **SMALL).wait()
        curve = job.convergence()
        self.assertEqual(curve.samples_per_pixel[-1], 32)
        self.assertEqual(curve.relative[-1], job.error.relative)
        self.assertTrue((np.diff(curve.samples_per_pixel) > 0).all())
        self.assertEqual(len(curve), len(curve.rays))
        self.assertTrue(math.isfinite(curve.slope.value))

    def test_meets_an_error_target(self):
        job = self.client.submit("cornell-box", relative_error=0.3, **SMALL).wait()
        self.assertEqual(job.stop_reason, "relative_error")
        self.assertLessEqual(job.error.relative, 0.3)

    def test_meets_a_target_of_the_denoised_image(self):
        job = self.client.submit("cornell-box", denoised_error=0.3, **SMALL).wait()
        self.assertEqual(job.stop_reason, "denoised_error")
        comparison = self.client.compare(job, job, a_denoise="mixed")
        self.assertGreater(comparison.mse, 0)

    def test_extension_gives_the_digest_of_a_longer_job(self):
        job = self.client.submit("cornell-box", samples_per_pixel=4, **SMALL).wait()
        before = job.film_digest
        job.extend(samples_per_pixel=16).wait()
        longer = self.client.submit("cornell-box", samples_per_pixel=16, **SMALL).wait()
        self.assertEqual(job.film_digest, longer.film_digest)
        self.assertNotEqual(job.film_digest, before)

    def test_pauses_resumes_changes_cancels_and_deletes_a_job(self):
        job = self.client.submit("cornell-box", **LONG)
        with self.assertRaises(tessera_render.Conflict):
            job.delete()
        self.server.wait_for_samples(job.id)
        self.assertEqual(job.pause().state, "paused")
        self.assertEqual(self.client.job(job.id).state, "paused")
        self.assertIn(job.resume().state, ("queued", "loading", "rendering"))
        job.update(name="new", priority=7, labels={"a": "b"})
        self.assertEqual((job.name, job.spec["priority"], job.labels), ("new", 7, {"a": "b"}))
        with self.assertRaises(tessera_render.WaitTimeout):
            job.wait(timeout=0.1)
        job.cancel()
        self.assertEqual(job.wait().state, "cancelled")
        self.assertEqual(job.cancel().stop_reason, "cancelled")
        self.assertEqual(job.image().shape, (32, 48, 3))
        job.delete()
        with self.assertRaises(tessera_render.NotFound):
            job.refresh()

    def test_request_errors_have_their_pointers(self):
        with self.assertRaises(tessera_render.Invalid) as caught:
            self.client.submit("cornell-box", size=(0, 32), request={"colour": 1})
        self.assertEqual({fault.pointer for fault in caught.exception.errors},
                         {"/film/width", "/colour"})
        self.assertTrue(caught.exception.request_id)
        with self.assertRaises(tessera_render.NotFound):
            self.client.submit("no-such-scene")
        with self.assertRaises(tessera_render.NotFound):
            self.client.job("no-such-job")

    def test_estimate_submits_nothing(self):
        before = len(list(self.client.jobs()))
        self.assertTrue(self.client.estimate("cornell-box", **LONG))
        with self.assertRaises(tessera_render.Invalid):
            self.client.estimate("cornell-box", size=(0, 1))
        self.assertEqual(len(list(self.client.jobs())), before)

    def test_lists_filter_by_state_and_label(self):
        jobs = [self.client.submit("cornell-box", labels={"batch": "lists", "n": str(i)},
                                   samples_per_pixel=1, **SMALL) for i in range(5)]
        for job in jobs:
            job.wait()
        ids = [job.id for job in reversed(jobs)]
        found = self.client.jobs(label={"batch": "lists"}, state="finished")
        self.assertEqual([job.id for job in found], ids)
        found = self.client.jobs(label=["batch", "n=3"], state=["finished", "failed"])
        self.assertEqual([job.id for job in found], [jobs[3].id])
        self.assertEqual([job.id for job in self.client.jobs(label="batch", limit=2)], ids[:2])
        # The server's pages are shorter than the list.
        pages = self.client._pages("/v1/jobs", {"label": "batch", "limit": 2}, "jobs", None)
        self.assertEqual(len(list(pages)), 5)

    def test_missing_objects_have_clear_errors(self):
        info = self.client.info()
        self.assertIn("cornell-box", info.scenes)
        self.assertIn("path", info.integrators)
        paths = self.server.get("/openapi.json").json()["paths"]
        jobs = [self.client.submit("cornell-box", samples_per_pixel=4, seed=seed, **SMALL).wait()
                for seed in (1, 2)]
        if "/v1/comparisons" in paths:
            comparison = self.client.compare(*jobs)
            a, b = (job.image().astype(np.float64) for job in jobs)
            self.assertAlmostEqual(
                comparison.mse, ((a - b) ** 2).mean(), delta=1e-4 * comparison.mse
            )
            self.assertAlmostEqual(comparison.relmse, ((a - b) ** 2 / (b**2 + 0.01)).mean(),
                                   delta=1e-4 * comparison.relmse)
        else:
            with self.assertRaises(tessera_render.NotOffered):
                self.client.compare(*jobs)
        if "/v1/lab/runs" in paths:
            run = self.client.lab("pi", n=[16, 64, 256], replicates=64, seed=1)
            self.assertEqual([point.n for point in run.points], [16, 64, 256])
            self.assertLess(run.slope, 0)
        else:
            with self.assertRaises(tessera_render.NotOffered):
                self.client.lab("pi", n=[16])


class Waiting(ServerTest):
    FLAGS = ("--max-running", "1")

    def test_no_image_exists_before_the_first_sample(self):
        first = self.client.submit("cornell-box", **LONG, priority=1)
        self.server.wait_for_samples(first.id)
        job = self.client.submit("cornell-box", **LONG)
        with self.assertRaises(tessera_render.Conflict):
            job.image()
        with self.assertRaises(tessera_render.Conflict):
            job.picture()
        self.assertIsNone(job._repr_png_())
        self.assertIn("queued", job._repr_html_())


class ManyJobs(ServerTest):
    def test_waits_for_many_jobs_at_once(self):
        async def one(client, seed):
            job = await client.submit("cornell-box", seed=seed, samples_per_pixel=2, **SMALL)
            events = [event.type async for event in job.events()]
            film = job.tile_image()
            async for tile in job.tiles():
                film.put(tile)
            image = await job.image()
            np.testing.assert_array_equal(image, film.mean)
            pixel = await job.pixels(5, 5)
            np.testing.assert_array_equal(pixel.beauty.mean.astype(np.float32), image[5, 5])
            return events[0], events[-1], image.tobytes()

        async def run():
            async with AsyncClient(self.url()) as client:
                results = await asyncio.gather(*(one(client, seed) for seed in range(6)))
                listed = [job.id async for job in client.jobs(state="finished")]
                await (await client.job(listed[0])).delete()
                with self.assertRaises(tessera_render.NotFound):
                    await client.job(listed[0])
                return results, listed

        results, listed = asyncio.run(run())
        self.assertEqual({(first, last) for first, last, _ in results}, {("snapshot", "end")})
        self.assertEqual(len({image for _, _, image in results}), 6)
        self.assertGreaterEqual(len(listed), 6)


class Keys(ServerTest):
    FLAGS = ("--key", "a-long-enough-secret-key")

    def setUp(self):
        self.client = Client(self.url(), key=self.FLAGS[1], retry=FAST)
        self.addCleanup(self.client.close)

    def tearDown(self):
        self.assertTrue(self.server.alive())

    def test_key_gives_access_to_the_server(self):
        job = self.client.submit("cornell-box", samples_per_pixel=2, **SMALL)
        self.assertEqual([e.type for e in job.events()][-1], "end")
        with self.assertRaises(tessera_render.Unauthorized):
            Client(self.url(), key="wrong").job(job.id)
        with self.assertRaises(tessera_render.Unauthorized):
            next(Client(self.url(), key="")._pages("/v1/jobs", {}, "jobs", 1))
