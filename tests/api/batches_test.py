"""Batches: a template and a matrix become jobs, all of them or none; one end, one archive."""

import io
import json
import os
import sys
import tempfile
import threading
import time
import unittest
import zipfile

from harness import (PATIENCE_S, SMALL, ApiTest, EventStream, job_body, png_size, started, tessera,
                     triangle_glb)
from webhooks_test import Receiver

LONG = 65536


def batch_body(matrix=None, name="", template=None, **members):
    return {
        "template": template or job_body(),
        "matrix": matrix or {"camera.orbit.theta_degrees": [160, 180], "seed": [1, 2]},
        "name": name,
        **members,
    }


class BatchStream(EventStream):
    def path(self, batch):
        return f"/v1/events?batch={batch}"


class BatchTest(ApiTest):
    def make(self, body, **headers):
        answer = self.server.post("/v1/batches", body, headers)
        self.assertEqual(answer.status, 201, answer)
        return answer.json()

    def batch(self, batch_id):
        answer = self.server.get(f"/v1/batches/{batch_id}")
        self.assertEqual(answer.status, 200, answer)
        return answer.json()

    def ended(self, batch_id):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            batch = self.batch(batch_id)
            if batch["state"] in ("finished", "failed", "cancelled"):
                return batch
            time.sleep(0.02)
        self.fail(f"did not end: {batch}")

    def finished(self, body):
        batch = self.ended(self.make(body)["id"])
        self.assertEqual(batch["state"], "finished", batch)
        return batch

    def refused(self, body, pointer, status=422):
        before = len(self.server.get("/v1/jobs?limit=200").json()["jobs"])
        answer = self.server.post("/v1/batches", body)
        self.assertEqual(answer.status, status, answer)
        problem = answer.json()
        if pointer is not None:
            self.assertIn(pointer, [error["pointer"] for error in problem["errors"]])
        self.assertEqual(len(self.server.get("/v1/jobs?limit=200").json()["jobs"]), before)
        return problem


class Order(BatchTest):
    def test_jobs_have_images_early_and_end_one_after_the_other(self):
        template = job_body(samples=512)
        template["film"] = {"width": 96, "height": 64, "layers": []}
        made = self.make(batch_body({"seed": [1, 2, 3, 4]}, template=template))
        deadline = time.monotonic() + PATIENCE_S
        while made["jobs"][0]["state"] != "finished" and time.monotonic() < deadline:
            time.sleep(0.02)
            made = self.batch(made["id"])
        states = [(job["state"], job["revision"] > 0, job["fraction"] < 0.3)
                  for job in made["jobs"]]
        self.assertEqual(states[1:], 3 * [("rendering", True, True)], made)
        jobs = [self.server.wait(job["id"]) for job in made["jobs"]]
        ends = [job["finished_at"] for job in jobs]
        self.assertEqual(ends, sorted(ends))


    def test_all_of_24_views_have_images_before_one_ends(self):
        template = job_body(samples=LONG)
        template["film"] = {"width": 96, "height": 64, "layers": []}
        made = self.make(batch_body({"seed": list(range(1, 25))}, template=template))
        deadline = time.monotonic() + PATIENCE_S
        while any(job["revision"] == 0 for job in made["jobs"]) and time.monotonic() < deadline:
            time.sleep(0.02)
            made = self.batch(made["id"])
        self.assertEqual({(job["state"], job["revision"] > 0) for job in made["jobs"]},
                         {("rendering", True)})
        self.server.post(f"/v1/batches/{made['id']}/cancel", {})


class FewSlots(BatchTest):
    FLAGS = ("--max-running", "2")

    def test_all_views_have_images_before_one_ends_and_the_oldest_end_first(self):
        seeds = list(range(1, 8))
        template = job_body(samples=LONG)
        template["film"] = {"width": 96, "height": 64, "layers": []}
        made = self.make(batch_body({"seed": seeds}, template=template))
        deadline = time.monotonic() + PATIENCE_S
        while any(job["revision"] == 0 for job in made["jobs"]) and time.monotonic() < deadline:
            time.sleep(0.02)
            made = self.batch(made["id"])
        self.assertTrue(all(job["revision"] > 0 for job in made["jobs"]), made)
        self.assertLessEqual({job["state"] for job in made["jobs"]},
                             {"queued", "loading", "rendering"})
        oldest = [job["id"] for job in made["jobs"][:2]]
        for job in oldest:
            self.server.wait_until(job, lambda j: j["state"] == "rendering", "its turn")
        self.server.post(f"/v1/batches/{made['id']}/cancel", {})

    def test_films_are_those_of_jobs_that_were_never_interrupted(self):
        template = job_body(samples=64)
        batch = self.finished(batch_body({"seed": [1, 2, 3, 4]}, template=template))
        for seed, job in enumerate(batch["jobs"], 1):
            alone = self.server.render(job_body(samples=64, seed=seed))
            self.assertEqual(self.server.job(job["id"])["film_digest"], alone["film_digest"])


class Batches(BatchTest):
    def test_every_combination_is_a_job_with_its_name_and_values(self):
        body = batch_body(name="view-{theta_degrees} seed {seed} of {scene}")
        answer = self.server.post("/v1/batches", body)
        self.assertEqual(answer.status, 201, answer)
        made = answer.json()
        self.assertEqual(answer.headers["Location"], "/v1/batches/" + made["id"])
        self.assertEqual(made["name"], body["name"])
        self.assertEqual([job["name"] for job in made["jobs"]],
                         [f"view-{theta} seed {seed} of cornell-box"
                          for theta in (160, 180) for seed in (1, 2)])
        batch = self.ended(made["id"])
        self.assertEqual(batch["state"], "finished")
        self.assertEqual(batch["progress"]["fraction"], 1)
        self.assertEqual(batch["counts"]["finished"], 4)
        self.assertEqual(sum(batch["counts"].values()), 4)
        for member in batch["jobs"]:
            job = self.server.job(member["id"])
            self.assertEqual(job["spec"]["name"], member["name"])
            self.assertEqual(job["spec"]["seed"], member["values"]["seed"])
            orbit = job["spec"]["camera"]["orbit"]
            self.assertEqual(orbit["theta_degrees"], member["values"]["camera.orbit.theta_degrees"])
        digests = {self.server.job(job["id"])["film_digest"] for job in batch["jobs"]}
        self.assertEqual(len(digests), 4, "each has its own view and seed")
        listed = self.server.get("/v1/batches?limit=1").json()
        self.assertEqual([each["id"] for each in listed["batches"]], [made["id"]])
        self.assertNotIn("jobs", listed["batches"][0])

    def test_merges_objects_and_replaces_other_values(self):
        made = self.make(batch_body(
            {"film": [{"width": 32}, {"width": 16, "height": 64}], "time_seconds": [None, 0]},
            "{film}-{film.height}-{time_seconds}-{index}"))
        self.assertEqual([job["name"] for job in made["jobs"]],
                         ["32-32-default-1", "32-32-0-2", "16x64-64-default-3", "16x64-64-0-4"])
        specs = [self.server.job(job["id"])["spec"] for job in made["jobs"]]
        self.assertEqual([(s["film"]["width"], s["film"]["height"]) for s in specs],
                         [(32, 32), (32, 32), (16, 64), (16, 64)])
        self.assertEqual([s["time_seconds"] for s in specs], [None, 0, None, 0])
        self.assertTrue(all(s["film"]["layers"] == SMALL["layers"] for s in specs))

    def test_orbit_equals_the_view_of_its_angles(self):
        orbit = {"theta_degrees": 90, "phi_degrees": 90, "radius": 4, "target": [0, 1, 0]}
        camera = {"position": [4, 1, 0], "target": [0, 1, 0]}
        pictures = []
        for view in ({"orbit": orbit}, camera):
            job = self.server.render(job_body(samples=64, camera=view))
            pictures.append(job["id"])
        answer = self.server.post("/v1/comparisons", {"a": pictures[0], "b": pictures[1]})
        # The same view up to rounding of sine and cosine.
        self.assertLess(answer.json()["flip"], 0.02, answer)
        both = job_body(camera={"orbit": orbit, **camera})
        answer = self.server.post("/v1/jobs", both)
        self.assertEqual(answer.status, 422)
        self.assertEqual(answer.json()["errors"][0]["pointer"], "/camera/orbit")

    def test_reports_errors_with_their_pointer_and_creates_nothing(self):
        self.refused(batch_body({"seed": [1, -1]}), "/matrix/seed/1")
        self.refused(batch_body({"camera": [{"orbit": {"phi_degrees": 181}}]}),
                     "/matrix/camera/0/orbit/phi_degrees")
        self.refused(batch_body({"colour": [1]}), "/matrix/colour/0")
        self.refused(batch_body({"variant": ["red"]}), "/matrix/variant/0")
        self.refused(batch_body(template=job_body(film={"width": 0})), "/template/film/width")
        self.refused(batch_body(template=job_body("nowhere")), None, 404)
        self.refused(batch_body(template=job_body() | {"class": "preview"}), "/template/class")
        self.refused(batch_body({"seed": []}), "/matrix/seed")
        self.refused(batch_body({"film..width": [8]}), "/matrix/film..width")
        self.refused(batch_body({}) | {"matrix": {}}, "/matrix")
        self.refused({"template": job_body()}, "/matrix")
        most = self.server.get("/v1/server").json()["limits"]["batch_jobs"]
        self.refused(batch_body({"seed": list(range(most + 1))}), "/matrix")
        wrong = self.refused(batch_body(name="{theta_degrees}"), "/name")
        self.assertIn("two jobs", wrong["errors"][0]["detail"])
        self.refused(batch_body(name="{nothing}"), "/name")
        self.refused(batch_body(name="x" * 250 + "-{theta_degrees}-{seed}-{index}{index}"), "/name")
        private = {"url": "http://127.0.0.1:9/"}
        self.refused(batch_body(webhook=private), "/webhook/url")

    def test_dry_run_lists_the_jobs_and_creates_none(self):
        answer = self.server.post("/v1/batches?dry_run=1", batch_body())
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(answer.json()["names"], ["160-1", "160-2", "180-1", "180-2"])
        answer = self.server.post("/v1/batches?dry_run=1", batch_body({"variant": ["red"]}))
        self.assertEqual(answer.status, 422)

    def test_the_same_key_creates_one_batch(self):
        body = batch_body()
        headers = {"Idempotency-Key": "series 7"}
        made = self.make(body, **headers)
        again = self.server.post("/v1/batches", body, headers)
        self.assertEqual((again.status, again.json()["id"]), (200, made["id"]))
        other = self.server.post("/v1/batches", batch_body({"seed": [3]}), headers)
        self.assertEqual(other.status, 409, other)
        self.ended(made["id"])

    def test_archive_and_sheet_contain_the_images(self):
        batch = self.finished(batch_body(name="at {theta_degrees}/{seed}"))
        for extension in ("png", "jpg"):
            answer = self.server.get(
                f"/v1/batches/{batch['id']}/archive.zip?format={extension}&exposure=1")
            self.assertEqual((answer.status, answer.headers["Content-Type"]),
                             (200, "application/zip"))
            archive = zipfile.ZipFile(io.BytesIO(answer.body))
            self.assertIsNone(archive.testzip())
            self.assertEqual(archive.namelist(),
                             [f"at_{theta}_{seed}.{extension}" for theta in (160, 180)
                              for seed in (1, 2)])
            for name, job in zip(archive.namelist(), batch["jobs"]):
                alone = self.server.get(f"/v1/jobs/{job['id']}/image.{extension}?exposure=1")
                self.assertEqual(archive.read(name), alone.body)
            self.assert_ranges(f"/v1/batches/{batch['id']}/archive.zip?format={extension}&exposure=1")
        sheet = self.server.get(f"/v1/batches/{batch['id']}/sheet.png")
        self.assertEqual((sheet.status, sheet.headers["Content-Type"]), (200, "image/png"))
        # Two per row, cells of 240 with gaps of 8.
        self.assertEqual(png_size(sheet.body)[:2], (2 * 248 + 8, 2 * 248 + 8))
        self.assertEqual(sheet.headers["Accept-Ranges"], "bytes")
        part = self.server.request("GET", f"/v1/batches/{batch['id']}/sheet.png",
                                   headers={"Range": "bytes=8-99"})
        self.assertEqual((part.status, part.body), (206, sheet.body[8:100]))
        wrong = self.server.get(f"/v1/batches/{batch['id']}/archive.zip?format=gif")
        self.assertEqual(wrong.status, 422)
        # Refuses options that no image supports before the archive starts.
        wrong = self.server.get(
            f"/v1/batches/{batch['id']}/archive.zip?layer=normal&background=ff0000"
        )
        self.assert_problem(wrong, 422, "/background")

    def test_cancels_and_deletes_a_batch_as_a_whole(self):
        made = self.make(batch_body({"seed": [1, 2, 3]}, template=job_body(samples=LONG)))
        path = f"/v1/batches/{made['id']}"
        for what in ("", "/archive.zip"):
            method = "GET" if what else "DELETE"
            answer = self.server.request(method, path + what)
            self.assertEqual(answer.status, 409, answer)
        self.assertEqual(self.server.post(path + "/cancel").status, 200)
        batch = self.ended(made["id"])
        self.assertEqual((batch["state"], batch["counts"]["cancelled"]), ("cancelled", 3))
        self.assertEqual(self.server.post(path + "/retry").status, 409)
        # A job ends before its slot is released: until then it counts as running.
        deadline = time.monotonic() + PATIENCE_S
        while (gone := self.server.request("DELETE", path)).status == 409:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.02)
        self.assertEqual(gone.status, 204, gone)
        self.assertEqual(self.server.get(path).status, 404)
        for job in made["jobs"]:
            self.assertEqual(self.server.get(f"/v1/jobs/{job['id']}").status, 404)

    def test_batch_is_deleted_with_its_last_job(self):
        batch = self.finished(batch_body({"seed": [1, 2]}))
        first, second = (job["id"] for job in batch["jobs"])
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{first}").status, 204)
        self.assertEqual([job["id"] for job in self.batch(batch["id"])["jobs"]], [second])
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{second}").status, 204)
        self.assertEqual(self.server.get(f"/v1/batches/{batch['id']}").status, 404)

    def test_one_stream_reports_all_jobs(self):
        most = self.server.get("/v1/server").json()["limits"]["watched_jobs"]
        made = self.make(batch_body({"seed": list(range(most + 1))},
                                    template=job_body(samples=1)))
        ends = {event.json()["job"] for event in BatchStream(self.server, made["id"])
                if event.name == "end"}
        self.assertEqual(ends, {job["id"] for job in made["jobs"]})
        for query in (f"batch={made['id']}&jobs={made['jobs'][0]['id']}", ""):
            self.assertEqual(self.server.get("/v1/events?" + query).status, 422)

    def test_retries_failed_jobs(self):
        # From above, `up` is parallel to the direction of view: found after loading the scene.
        made = self.make(batch_body({"camera.orbit.phi_degrees": [90, 0]},
                                    template=job_body(camera={"up": [0, 1, 0]})))
        batch = self.ended(made["id"])
        self.assertEqual(batch["state"], "failed")
        self.assertEqual((batch["counts"]["finished"], batch["counts"]["failed"]), (1, 1))
        answer = self.server.post(f"/v1/batches/{made['id']}/retry")
        self.assertEqual(answer.status, 202, answer)
        self.assertEqual(self.ended(made["id"])["counts"]["failed"], 1)
        answer = self.server.get(f"/v1/batches/{made['id']}/archive.zip")
        self.assertEqual(zipfile.ZipFile(io.BytesIO(answer.body)).namelist(), ["90.png"])

    def test_command_line_creates_a_series_and_writes_its_images(self):
        with tempfile.TemporaryDirectory() as folder:
            model = os.path.join(folder, "triangle.glb")
            with open(model, "wb") as file:
                file.write(triangle_glb())
            request = os.path.join(folder, "batch.json")
            with open(request, "w", encoding="utf-8") as file:
                json.dump(batch_body({"camera.orbit.theta_degrees": [0, 90]},
                                     template=job_body(model)), file)
            archive, sheet = (os.path.join(folder, name) for name in ("all.zip", "sheet.png"))
            server = ["--server", f"http://127.0.0.1:{self.server.port}"]
            code, names, said = tessera("batch", request, "--dry-run", *server)
            self.assertEqual((code, names), (0, "0\n90\n"), said)
            code, table, said = tessera("batch", request, "-o", archive, "--sheet", sheet, *server)
            self.assertEqual(code, 0, said)
            self.assertEqual([line.split()[1:] for line in table.splitlines()],
                             [["finished", "0"], ["finished", "90"]])
            self.assertEqual(zipfile.ZipFile(archive).namelist(), ["0.png", "90.png"])
            with open(sheet, "rb") as file:
                self.assertEqual(png_size(file.read())[:2], (2 * 248 + 8, 248 + 8))
            code, _, said = tessera("batch", model, *server)
            self.assertEqual(code, 1)
            self.assertIn("a batch is JSON", said)


    def test_command_line_creates_a_video_with_ffmpeg(self):
        """Uses a program that replaces ffmpeg and records its input."""
        with tempfile.TemporaryDirectory() as folder:
            request = os.path.join(folder, "batch.json")
            with open(request, "w", encoding="utf-8") as file:
                json.dump(batch_body({"seed": [1, 2, 3]}), file)
            program = os.path.join(folder, "ffmpeg")
            with open(program, "w", encoding="utf-8") as file:
                file.write(f"#!{sys.executable}\n"
                           "import sys\n"
                           "images = sys.stdin.buffer.read().count(b'IHDR')\n"
                           "if '0.500000' in sys.argv: sys.exit(1)\n"
                           "with open(sys.argv[-1].removeprefix('file:'), 'w') as file:\n"
                           "    print(images, *sys.argv[1:-1], file=file)\n")
            os.chmod(program, 0o755)
            video = os.path.join(folder, "turn.mp4")
            server = ["--server", f"http://127.0.0.1:{self.server.port}"]
            verb = ["batch", request, "--video", video, *server]
            here = {"PATH": folder}
            code, _, said = tessera(*verb, "--fps", "12", environ=here)
            self.assertEqual(code, 0, said)
            with open(video, encoding="utf-8") as file:
                words = file.read().split()
            self.assertEqual(words[0], "3")
            self.assertEqual(words[words.index("-framerate") + 1], "12.000000")
            batch = said.split()[0]
            os.remove(video)
            before = self.server.get("/v1/batches").json()
            code, _, said = tessera("batch", batch, "--video", video, *server, environ=here)
            self.assertEqual((code, os.path.exists(video)), (0, True), said)
            self.assertEqual(self.server.get("/v1/batches").json(), before)
            self.assertEqual(tessera("batch", batch, "--dry-run", *server)[0], 2)
            code, _, said = tessera(*verb, "--fps", "0.5", environ=here)
            self.assertEqual((code, os.path.exists(video)), (1, False))
            self.assertIn("ffmpeg failed", said)
            code, _, said = tessera(*verb, environ={"PATH": "/nowhere"})
            self.assertEqual(code, 1)
            self.assertIn("a video needs ffmpeg", said)
            # Nothing was submitted: the first word of the output would be the batch's id.
            self.assertTrue(said.startswith("tessera batch:"), said)


class QueueLimit(BatchTest):
    FLAGS = ("--max-queue", "3")

    def test_refuses_a_batch_that_does_not_fit_the_queue_as_a_whole(self):
        body = batch_body({"seed": [1, 2, 3, 4]})
        self.refused(body, None, 429)
        self.finished(batch_body({"seed": [1, 2, 3]}))


class DiskLimit(BatchTest):
    FLAGS = ("--disk-limit", "1M")

    def test_archive_without_evicted_films_is_410_with_their_names(self):
        # A film of 96 x 64 pixels has 400 kB: three do not fit.
        template = job_body(film={"width": 96, "height": 64, "layers": []})
        batch = self.finished(batch_body({"seed": [1, 2, 3, 4, 5]}, "number {seed}", template))
        deadline = time.monotonic() + PATIENCE_S
        while True:
            answer = self.server.get(f"/v1/batches/{batch['id']}/archive.zip")
            if answer.status == 410:
                self.assertRegex(answer.json()["detail"], "number [1-5]")
                break
            self.assertLess(time.monotonic(), deadline, answer)
            time.sleep(0.1)
        self.assertEqual(self.server.get(f"/v1/batches/{batch['id']}/sheet.png").status, 200)


class EndWebhook(BatchTest):
    FLAGS = ("--webhook-private",)

    def setUp(self):
        self.receiver = Receiver()
        self.addCleanup(self.receiver.close)

    def test_sends_one_webhook_at_the_end_of_the_batch(self):
        batch = self.finished(batch_body(webhook={"url": self.receiver.url}))
        told = json.loads(self.receiver.next()[2])
        self.assertEqual((told["type"], told["data"]["id"]), ("batch.end", batch["id"]))
        self.assertEqual(told["data"]["counts"]["finished"], 4)
        time.sleep(0.5)
        self.assertTrue(self.receiver.calls.empty())


class Killed(unittest.TestCase):
    """kill -9 during a batch: all jobs exist, end with the digests of an undisturbed server, and
    the end is reported."""

    SAMPLES = 128

    def body(self, **members):
        # Twelve views into the box, which is open on one side.
        template = job_body(samples=self.SAMPLES, film={"width": 40, "height": 32, "layers": []})
        return batch_body({"camera.orbit.theta_degrees": list(range(136, 228, 8)),
                           "seed": [1, 2, 3]}, template=template, **members)

    def run_batch(self, server, webhook=None, interrupt=lambda: None):
        members = {"webhook": {"url": webhook}} if webhook else {}
        made = server.post("/v1/batches", self.body(**members)).json()
        interrupt()
        return made["id"], [server.wait(job["id"])["film_digest"] for job in made["jobs"]]

    def test_killed_batch_ends_with_the_same_digests(self):
        receiver = Receiver()
        self.addCleanup(receiver.close)
        server = started(self, "--webhook-private", "--checkpoint", "0.1")
        _, calm = self.run_batch(server)

        def kill_twice():
            for _ in range(2):
                time.sleep(0.35)
                server.kill()
                server.start()

        batch_id, digests = self.run_batch(server, receiver.url, kill_twice)
        self.assertEqual(digests, calm)
        batch = server.get(f"/v1/batches/{batch_id}").json()
        self.assertEqual((batch["state"], len(batch["jobs"])), ("finished", 36))
        self.assertEqual(len(set(digests)), 36, "each has its own view and seed")
        told = json.loads(receiver.next()[2])
        self.assertEqual(told["data"]["id"], batch_id)

    def test_submission_is_atomic_over_a_kill(self):
        server = started(self)
        body = batch_body({"seed": list(range(64))}, template=job_body(samples=LONG))
        acknowledged = []

        def submit():
            try:
                while True:
                    acknowledged.append(server.post("/v1/batches", body).json()["id"])
            except Exception:  # the server was killed
                return

        thread = threading.Thread(target=submit)
        thread.start()
        time.sleep(0.6)
        server.kill()
        thread.join()
        server.start()
        batches = server.get("/v1/batches").json()["batches"]
        self.assertLessEqual(set(acknowledged), {batch["id"] for batch in batches})
        for batch in batches:
            self.assertEqual(sum(batch["counts"].values()), 64)
        server.kill()
