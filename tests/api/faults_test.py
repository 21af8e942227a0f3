"""Failures on the server: a full disk, evicted films, deletions during other requests."""

import json
import os
import random
import resource
import threading
import time
import unittest

from harness import (PATIENCE_S, TRIANGLE, ApiTest, Server, hdr_image, in_background, job_body,
                     started, tessera, triangle_document, triangle_glb, wait_for)

BYTES = {"Content-Type": "application/octet-stream"}
GLB = {"Content-Type": "model/gltf-binary"}


class FullDisk(unittest.TestCase):
    """No file may exceed a limit: writes then fail as on a full disk."""

    LIMIT = 4 << 20

    def setUp(self):
        def limit_files():
            resource.setrlimit(resource.RLIMIT_FSIZE, (self.LIMIT, self.LIMIT))

        self.server = started(self, "--checkpoint", "0.2", preexec=limit_files)

    def assert_no_space(self, answer):
        self.assertEqual(answer.status, 507, answer)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        self.assertEqual(answer.json()["type"], "/docs#problem-no-space")

    def test_upload_is_507_and_leaves_nothing(self):
        big = os.urandom(1 << 20) * 6
        self.assert_no_space(self.server.post("/v1/assets", big, BYTES))
        self.assert_no_space(self.server.request("PUT", "/v1/assets/" + "0" * 64, big, BYTES))
        # The scene itself is valid, but its file cannot be stored.
        scene = triangle_glb(extras={"padding": "x" * (6 << 20)})
        self.assert_no_space(self.server.post("/v1/scenes", scene, GLB))
        left = [name for _, _, names in os.walk(self.server.data + "/assets") for name in names]
        self.assertEqual(left, [])
        self.assertEqual(self.server.post("/v1/assets", b"small", BYTES).status, 201)
        self.assertEqual(self.server.render(job_body())["state"], "finished")

    def test_film_that_does_not_fit_pauses_only_its_job(self):
        small = self.server.submit(job_body(samples=2048))["id"]
        large = job_body(samples=65536)
        large["film"] = {"width": 640, "height": 480, "layers": []}
        job = self.server.submit(large)["id"]
        paused = self.server.wait_until(job, lambda now: now["state"] == "paused")
        self.assertEqual(paused["pause_reason"], "storage_full")
        self.assertEqual(self.server.wait(small)["state"], "finished")
        self.assertEqual(self.server.get("/readyz").status, 200)


class Evicted(ApiTest):
    FLAGS = (
        "--disk-limit",
        "1M",
        "--film-cache",
        "0",
    )  # A film takes 0.3 M of blocks, and 0.8 M in total.

    def test_oldest_films_are_410_and_their_records_stay(self):
        jobs = []
        for seed in range(4):
            body = job_body(samples=2, seed=seed)
            body["film"] = {"width": 96, "height": 64, "layers": []}
            jobs.append(self.server.render(body))
        deadline = time.monotonic() + PATIENCE_S
        first = f"/v1/jobs/{jobs[0]['id']}"
        while self.server.get(first + "/image.png").status != 410:
            self.assertLess(time.monotonic(), deadline)
            time.sleep(0.05)
        for path in ("/image.png", "/image?stream=1", "/pixels/0/0", "/tiles"):
            self.assert_problem(self.server.get(first + path), 410)
        self.assertEqual(self.server.job(jobs[0]["id"])["film_digest"], jobs[0]["film_digest"])
        self.assert_problem(
            self.server.post(first + "/extend", {"stop": {"samples_per_pixel": 8}}), 409
        )
        self.assertEqual(self.server.get(f"/v1/jobs/{jobs[-1]['id']}/image.png").status, 200)


class Deletions(ApiTest):
    def test_keeps_the_files_that_a_finished_job_may_need(self):
        scene = self.server.post("/v1/scenes", triangle_glb(), GLB).json()["id"]
        sky = self.server.post("/v1/assets", hdr_image(8, 4, (0.5, 0.6, 0.7)), BYTES).json()["id"]
        job = self.server.render(job_body(scene, environment={"asset": sky}))["id"]
        for path in ("/v1/scenes/" + scene, "/v1/assets/" + sky):
            self.assert_problem(self.server.request("DELETE", path), 409)
        extended = self.server.post(f"/v1/jobs/{job}/extend", {"stop": {"samples_per_pixel": 16}})
        self.assertEqual(extended.status, 202)
        self.assertEqual(self.server.wait(job)["state"], "finished")
        self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job}").status, 204)
        for path in ("/v1/scenes/" + scene, "/v1/assets/" + sky):
            self.assertEqual(self.server.request("DELETE", path).status, 204)

    def test_running_preview_keeps_its_scene(self):
        scene = self.server.post("/v1/scenes", triangle_glb(nodes=[{"mesh": 0, "name": "preview"}]),
                                 GLB).json()["id"]
        job = self.server.submit(job_body(scene, samples=65536, **{"class": "preview"}))["id"]
        self.assert_problem(self.server.request("DELETE", "/v1/scenes/" + scene), 409)
        self.server.post(f"/v1/jobs/{job}/cancel")
        self.assertEqual(self.server.request("DELETE", "/v1/scenes/" + scene).status, 204)

    def test_if_match_protects_an_asset(self):
        asset = self.server.post("/v1/assets", b"content", BYTES).json()["id"]
        path = "/v1/assets/" + asset
        self.assert_problem(
            self.server.request("DELETE", path, headers={"If-Match": '"other"'}), 412
        )
        self.assertEqual(
            self.server.request("DELETE", path, headers={"If-Match": f'"{asset}"'}).status, 204
        )

    def test_accepted_job_keeps_its_environment_despite_deletion(self):
        image = hdr_image(16, 8, (0.3, 0.3, 0.9))
        stop = threading.Event()
        asset = self.server.post("/v1/assets", image, BYTES).json()["id"]

        counts = {}

        def delete_and_upload():
            while not stop.is_set():
                status = self.server.request("DELETE", "/v1/assets/" + asset).status
                counts[status] = counts.get(status, 0) + 1
                self.server.post("/v1/assets", image, BYTES)

        deleting = in_background(delete_and_upload)
        taken = []
        begun = time.monotonic()
        while time.monotonic() < begun + 3 or not taken or not counts.get(204):
            self.assertLess(time.monotonic(), begun + PATIENCE_S)
            answer = self.server.post("/v1/jobs", job_body(samples=2, environment={"asset": asset}))
            self.assertIn(answer.status, (201, 422), answer)
            if answer.status == 201:
                job = self.server.wait(answer.json()["id"])
                self.assertEqual(job["state"], "finished", job["failure"])
                taken.append(job["id"])
                self.server.request("DELETE", f"/v1/jobs/{job['id']}")
        stop.set()
        deleting()
        self.assertLessEqual(set(counts), {204, 404, 409})

    def test_accepted_scene_keeps_its_files_despite_deletion(self):
        gltf = json.dumps(triangle_document("triangle.bin")).encode()
        stop = threading.Event()

        def delete():
            while not stop.wait(pauses.uniform(0, 0.03)):
                self.server.request("DELETE", "/v1/assets/" + pauses.choice(ids))

        ids = [
            self.server.post("/v1/assets", data, BYTES).json()["id"] for data in (gltf, TRIANGLE)
        ]
        pauses = random.Random(1)
        deleting = in_background(delete)
        begun, taken = time.monotonic(), 0
        while time.monotonic() < begun + 2 or taken < 5:
            self.assertLess(time.monotonic(), begun + PATIENCE_S)
            for data in (gltf, TRIANGLE):
                self.server.post("/v1/assets", data, BYTES)
            answer = self.server.post(
                "/v1/scenes", {"gltf": ids[0], "files": {"triangle.bin": ids[1]}}
            )
            self.assertIn(answer.status, (200, 201, 422), answer)
            if answer.status == 422:
                continue
            scene = answer.json()["id"]
            job = self.server.wait(self.server.submit(job_body(scene, samples=2))["id"])
            self.assertEqual(job["state"], "finished", job["failure"])
            self.server.request("DELETE", f"/v1/jobs/{job['id']}")
            self.server.request("DELETE", "/v1/scenes/" + scene)
            taken += 1
        stop.set()
        deleting()


class Forgotten(ApiTest):
    def test_forgets_a_job_after_its_time(self):
        kept = self.server.render(job_body())["id"]
        long = self.server.render(job_body(retention_seconds=1000))["id"]
        short = self.server.render(job_body(retention_seconds=1))
        self.assertEqual(short["spec"]["retention_seconds"], 1)
        wait_for(lambda: self.server.get(f"/v1/jobs/{short['id']}").status == 404)
        # The film goes after the record.
        wait_for(lambda: not os.path.exists(f"{self.server.data}/films/{short['id']}.film"))
        for job in (kept, long):
            self.assertEqual(self.server.get(f"/v1/jobs/{job}").status, 200)


class Arithmetic(unittest.TestCase):
    def start(self, *flags):
        server = Server(*flags)
        self.addCleanup(server.close)
        return server.start()

    def test_instruction_set_can_be_pinned_and_is_in_build_and_images(self):
        for isa in ("sse4.2", "avx2"):
            server = self.start("--isa", isa)
            build = server.get("/v1/server").json()["build"]
            self.assertEqual((build["isa"], build["waves"]), (isa, isa == "avx2"))
            job = server.render(job_body())
            picture = server.get(f"/v1/jobs/{job['id']}/image.png").body
            self.assertIn(b"tessera:arithmetic", picture)
            self.assertIn(f", {isa}, ".encode(), picture)
            server.close()

    def test_default_is_one_of_the_names(self):
        server = self.start()
        self.assertIn(server.get("/v1/server").json()["build"]["isa"],
                      ("sse2", "sse4.2", "avx", "avx2", "avx512"))

    def test_refuses_an_unknown_one(self):
        with self.assertRaises(RuntimeError) as refused:
            self.start("--isa", "avx9000")
        self.assertIn("--isa", str(refused.exception))

    def test_continuing_with_another_arithmetic_is_a_warning(self):
        server = self.start("--isa", "avx2")
        done = server.render(job_body())
        server.stop()
        server.flags = ["--isa", "sse4.2"]
        server.start()
        server.post(f"/v1/jobs/{done['id']}/extend", {"stop": {"samples_per_pixel": 16}})
        extended = server.wait(done["id"])
        self.assertEqual(extended["state"], "finished")
        self.assertTrue(
            any("avx2" in w and "sse4.2" in w for w in extended["warnings"]), extended["warnings"]
        )
        # The same arithmetic again is not.
        other = server.render(job_body())
        server.post(f"/v1/jobs/{other['id']}/extend", {"stop": {"samples_per_pixel": 16}})
        self.assertFalse(any("bits" in w for w in server.wait(other["id"])["warnings"]))


class Check(unittest.TestCase):
    def setUp(self):
        self.server = started(self)
        self.scene = self.server.post("/v1/scenes", triangle_glb(), GLB).json()["id"]
        self.job = self.server.render(job_body(self.scene))["id"]

    def check(self):
        code, said, complaints = tessera("check", "--json", "--data", self.server.data)
        self.assertIn(code, (0, 1), complaints)
        return code, json.loads(said)

    def test_leaves_a_directory_in_use_alone(self):
        code, _, said = tessera("check", "--data", self.server.data)
        self.assertEqual(code, 1)
        self.assertIn("already in use by process", said)

    def test_accepts_a_valid_directory(self):
        self.server.stop()
        code, found = self.check()
        self.assertEqual((code, found["damages"]), (0, []))
        self.assertEqual(
            (found["jobs"], found["films"], found["scenes"], found["assets"]), (1, 1, 1, 1)
        )

    def test_finds_every_damage(self):
        self.server.stop()
        film = f"{self.server.data}/films/{self.job}.film"
        asset = next(
            os.path.join(place, name)
            for place, _, names in os.walk(self.server.data + "/assets")
            for name in names
            if len(name) == 64
        )
        for path, words in ((film, "job " + self.job), (asset, "asset ")):
            with open(path, "rb") as file:
                whole = file.read()
            for torn in (whole[:len(whole) // 2], None):
                if torn is None:
                    os.remove(path)
                else:
                    with open(path, "wb") as file:
                        file.write(torn)
                code, found = self.check()
                self.assertEqual(code, 1, (path, torn is None))
                self.assertTrue(any(words in damage for damage in found["damages"]), found)
            with open(path, "wb") as file:
                file.write(whole)
            self.assertEqual(self.check()[0], 0)
        with open(f"{self.server.data}/films/stray.film", "wb") as file:
            file.write(b"x")
        code, found = self.check()
        self.assertEqual(
            (code, found["leftovers"], found["removed"]), (0, ["film file stray.film"], 0)
        )
        code, said, _ = tessera("check", "--repair", "--json", "--data", self.server.data)
        self.assertEqual((code, json.loads(said)["removed"]), (0, 1))
        self.assertFalse(os.path.exists(f"{self.server.data}/films/stray.film"))
        code, found = self.check()
        self.assertEqual((code, found["leftovers"], found["films"]), (0, [], 1))

    def test_removes_nothing_when_there_is_damage(self):
        self.server.stop()
        stray, film = (f"{self.server.data}/films/{name}.film" for name in ("stray", self.job))
        with open(stray, "wb") as file:
            file.write(b"x")
        os.truncate(film, 1000)
        code, said, _ = tessera("check", "--repair", "--json", "--data", self.server.data)
        self.assertEqual((code, json.loads(said)["removed"]), (1, 0))
        self.assertTrue(os.path.exists(stray))

    def test_missing_directory_is_1(self):
        code, _, said = tessera("check", "--data", self.server.data + "/nowhere")
        self.assertEqual(code, 1)
        self.assertIn("not a data directory", said)
