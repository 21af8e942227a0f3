"""Restarts: kill -9 during work, SIGTERM, and their effect on clients."""

import os
import signal
import time
import unittest

from harness import (EventStream, Server, TileStream, hdr_image, in_background,
                     job_body, started, tile_places, triangle_glb)

FOG = {"type": "homogeneous", "scattering": [0.4, 0.4, 0.4]}


def kind(integrator, samples, layers=(), **members):
    wanted = job_body(samples=samples, integrator=integrator, **members)
    wanted["film"] = {"width": 40, "height": 24, "layers": list(layers)}
    return wanted


# Each integrator, and whatever else is stored with splats; about 0.3 s of one thread each.
KINDS = [
    kind({"type": "bdpt"}, 32),
    kind({"type": "bdpt"}, 32, medium=FOG),
    kind({"type": "bdpt"}, 32, ["st:2,3", "st:3,1"]),
    kind({"type": "mlt"}, 16),
    kind({"type": "light-trace"}, 96),
    kind({"type": "sppm", "photons": 2048}, 64),
    kind({"type": "vcm", "photons": 2048}, 32),
    kind({"type": "path-caustics", "photons": 2048}, 64),
    kind({"type": "photon-map", "photons": 2048}, 48),
    kind({"type": "irradiance-cache", "rays": 32, "records": 256}, 1024),
    kind({"type": "path"}, 192, spectral=True),
]


def body(samples, **members):
    wanted = job_body(samples=samples, **members)
    wanted["film"] = {"width": 96, "height": 64, "layers": ["albedo", "normal", "depth"]}
    return wanted


class RestartTest(unittest.TestCase):
    FLAGS = ("--checkpoint", "0.3", "--log-level", "debug")

    def setUp(self):
        self.server = started(self, *self.FLAGS)

    def wait_for_checkpoint(self, job, count=1):
        self.server.wait_until(job, lambda now: self.server.checkpoints(job) >= count
                               or now["state"] == "finished", "a checkpoint")


class EveryIntegrator(RestartTest):
    FLAGS = ("--checkpoint", "0.05", "--log-level", "debug")

    def kill(self, job, threads):
        """Kills the server after two checkpoints, and returns the job after the restart."""
        self.server.wait_for_samples(job)  # A prepass may come before them.
        # The checkpoint after the next holds samples: it began after them.
        self.wait_for_checkpoint(job, self.server.checkpoints(job) + 2)
        self.server.kill()
        self.server.start(threads)
        after = self.server.job(job)
        self.assertGreater(after["progress"]["samples_per_pixel"]["max"], 0, after["spec"])
        return after

    def test_films_are_unchanged_after_repeated_kills(self):
        for kind_of_job in KINDS:
            # A fast machine ends the shorter ones before the kill.
            for factor in (2, 4, 8, 16, 32):
                samples = factor * kind_of_job["stop"]["samples_per_pixel"]
                wanted = kind_of_job | {"stop": {"samples_per_pixel": samples}}
                job = self.server.submit(wanted)["id"]
                after = self.kill(job, 1)
                if after["state"] != "finished":
                    break
            self.assertNotEqual(after["state"], "finished", after["spec"])
            self.kill(job, 3)
            done = self.server.wait(job)
            self.assertEqual(done["film_digest"], self.server.render(wanted)["film_digest"],
                             done["spec"])


class Restart(RestartTest):
    def test_film_is_unchanged_after_repeated_kills(self):
        calm = self.server.render(body(384))
        job = self.server.submit(body(384, name="killed", labels={"k": "v"}))["id"]
        self.wait_for_checkpoint(job)
        for threads in (2, 1, 3):
            before = self.server.job(job)
            self.server.kill()
            self.server.start(threads)
            after = self.server.job(job)
            self.assertEqual(after["spec"], before["spec"])
            self.assertEqual(after["created_at"], before["created_at"])
            self.assertGreater(after["progress"]["samples_per_pixel"]["max"], 0)
            # The job continues from a checkpoint, and its revisions continue above those already
            # sent.
            self.server.wait_until(job, lambda now: now["revision"] > before["revision"]
                                   or now["state"] == "finished")
            if after["state"] == "finished":
                break
        done = self.server.wait(job)
        self.assertEqual(done["state"], "finished")
        self.assertEqual(done["film_digest"], calm["film_digest"])
        with TileStream(self.server, job) as stream:
            tiles = stream.all()
        self.assertEqual({tile.place() for tile in tiles[:-1]}, tile_places(0, 0, 96, 64))

    def test_kill_before_the_first_checkpoint_loses_nothing(self):
        calm = self.server.render(job_body(samples=64))
        jobs = [self.server.submit(job_body(samples=64, name=str(n)))["id"] for n in range(4)]
        self.server.kill()
        self.server.start()
        listed = [job["id"] for job in self.server.get("/v1/jobs").json()["jobs"]]
        self.assertEqual(listed[:4], jobs[::-1])
        for job in jobs:
            self.assertEqual(self.server.wait(job)["film_digest"], calm["film_digest"])

    def test_finished_jobs_scenes_and_assets_survive(self):
        asset = self.server.post("/v1/assets", hdr_image(8, 4, (0.9, 0.5, 0.1))).json()["id"]
        scene = self.server.post("/v1/scenes", triangle_glb(),
                                 {"Content-Type": "model/gltf-binary"}).json()["id"]
        job = self.server.render(job_body(scene, environment={"asset": asset}))
        picture = self.server.get(f"/v1/jobs/{job['id']}/image.png")
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.job(job["id"]), job)
        again = self.server.get(f"/v1/jobs/{job['id']}/image.png")
        self.assertEqual(
            (again.body, again.headers["ETag"]), (picture.body, picture.headers["ETag"])
        )
        self.assertEqual(self.server.get("/v1/assets/" + asset).status, 200)
        self.assertEqual(self.server.get("/v1/scenes/" + scene).status, 200)
        self.assertEqual(self.server.get(f"/v1/jobs/{job['id']}/convergence").json()["points"][-1]
                         ["samples_per_pixel"], 8)
        extended = self.server.post(
            f"/v1/jobs/{job['id']}/extend", {"stop": {"samples_per_pixel": 16}}
        )
        self.assertEqual(extended.status, 202)
        whole = job_body(scene, samples=16, environment={"asset": asset})
        self.assertEqual(self.server.wait(job["id"])["film_digest"],
                         self.server.render(whole)["film_digest"])

    def test_idempotency_key_survives(self):
        key = {"Idempotency-Key": "once"}
        first = self.server.post("/v1/jobs", job_body(), key)
        self.server.kill()
        self.server.start()
        again = self.server.post("/v1/jobs", job_body(), key)
        self.assertEqual((again.status, again.json()["id"]), (200, first.json()["id"]))

    def test_cancelled_and_paused_jobs_keep_their_state(self):
        cancelled = self.server.submit(body(65536))["id"]
        self.server.wait_for_samples(cancelled)
        self.server.post(f"/v1/jobs/{cancelled}/cancel")
        paused = self.server.submit(body(65536))["id"]
        self.server.wait_for_samples(paused)
        self.server.request("PATCH", f"/v1/jobs/{paused}", {"paused": True})
        deleted = self.server.render(job_body())["id"]
        self.server.request("DELETE", f"/v1/jobs/{deleted}")
        # The cancelled film is written after the answer; reading it waits for that.
        self.assertEqual(self.server.get(f"/v1/jobs/{cancelled}/film").status, 200)
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.job(cancelled)["state"], "cancelled")
        self.assertEqual(self.server.get(f"/v1/jobs/{cancelled}/image.png").status, 200)
        self.assertEqual(self.server.job(paused)["state"], "paused")
        self.assertEqual(self.server.get(f"/v1/jobs/{deleted}").status, 404)
        before = self.server.job(paused)["revision"]
        self.server.request("PATCH", f"/v1/jobs/{paused}", {"paused": False})
        self.server.wait_until(paused, lambda job: job["revision"] > before)

    def test_stream_resumed_after_a_kill_gets_reset_and_snapshot(self):
        job = self.server.submit(body(65536))["id"]
        with EventStream(self.server, job) as stream:
            for event in stream:
                if event.name == "tile":
                    last = event.id
                    break
        self.server.request("PATCH", f"/v1/jobs/{job}", {"name": "missed"})
        self.server.kill()
        self.server.start()
        with EventStream(self.server, job, last=last) as stream:
            names = []
            for event in stream:
                names.append(event.name)
                if event.name == "snapshot":
                    self.assertEqual(event.json()["spec"]["name"], "missed")
                    break
        self.assertEqual(names[-2:], ["reset", "snapshot"])
        self.assertIn("state", names[:-2])
        self.server.post(f"/v1/jobs/{job}/cancel")

    def test_end_is_known_after_a_kill(self):
        job = self.server.render(job_body())["id"]
        with EventStream(self.server, job) as stream:
            end = stream.all()[-1]
        self.server.kill()
        self.server.start()
        with EventStream(self.server, job, last=end.id) as stream:
            self.assertEqual(stream.status, 204)
        with EventStream(self.server, job) as stream:
            self.assertEqual([e.name for e in stream], ["snapshot", "end"])

    def test_sigterm_saves_and_closes_connections(self):
        calm = self.server.render(body(256))["film_digest"]
        job = self.server.submit(body(256))["id"]
        self.server.wait_for_samples(job)
        poll = self.server.connect()
        self.addCleanup(poll.close)
        poll.request("GET", f"/v1/jobs/{job}?wait=60")
        with EventStream(self.server, job) as stream:
            events = iter(stream)
            next(events)  # The poll was sent before, and the server is waiting on it now.
            rest = in_background(lambda: list(events))
            began = time.monotonic()
            self.assertEqual(self.server.stop(), 0)
            took = time.monotonic() - began
            names = [event.name for event in rest()]
        self.assertNotIn("reset", names)
        self.assertEqual(poll.getresponse().status, 200)
        self.assertLess(took, 20)  # The grace period is 10 s, on any machine.
        self.server.start()
        after = self.server.job(job)
        if after["state"] != "finished":
            # Everything that was rendered is stored.
            self.assertGreater(after["progress"]["samples_per_pixel"]["max"], 0)
        self.assertEqual(self.server.wait(job)["film_digest"], calm)

    def test_sigterm_is_fast_when_idle(self):
        self.assertEqual(self.server.stop(), 0)
        self.server.start()

    def test_interrupt_also_stops(self):
        self.server.process.send_signal(signal.SIGINT)
        self.assertEqual(self.server.process.wait(30), 0)

    def test_renders_a_torn_film_again(self):
        calm = self.server.render(body(256))["film_digest"]
        job = self.server.submit(body(256))["id"]
        self.wait_for_checkpoint(job)
        self.server.kill()
        path = os.path.join(self.server.data, "films", job + ".film")
        with open(path, "r+b") as film:
            film.truncate(os.path.getsize(path) // 2)
        self.server.start()
        self.assertEqual(self.server.wait(job)["film_digest"], calm)

    def test_reports_a_truncated_database_without_overwriting_it(self):
        self.server.render(job_body())
        self.server.stop()
        path = os.path.join(self.server.data, "tessera.db")
        for size in (os.path.getsize(path) // 2, 50):
            with open(path, "r+b") as database:
                database.truncate(size)
            with self.assertRaises(RuntimeError) as refused:
                self.server.start()
            self.server.process.stdout.close()
            self.assertEqual(self.server.process.returncode, 1)
            self.assertIn("tessera.db", str(refused.exception))
            self.assertEqual(os.path.getsize(path), size)

    def test_refuses_a_second_server_on_the_same_data(self):
        other = Server(data=self.server.data)
        with self.assertRaises(RuntimeError):
            other.start()
        other.process.stdout.close()
        self.assertEqual(self.server.get("/livez").status, 200)
