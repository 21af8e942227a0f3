"""A full disk: acknowledged changes are stored, and jobs continue when there is space."""

import os
import resource
import shutil
import subprocess
import tempfile
import time
import unittest

from harness import PATIENCE_S, Server, job_body, started

BYTES = {"Content-Type": "application/octet-stream"}


def body(samples, seed=0, width=256, height=192):
    wanted = job_body(samples=samples, seed=seed)
    # 3 MB, twice that while it renders.
    wanted["film"] = {"width": width, "height": height, "layers": []}
    return wanted


def large_body(samples, seed=0):
    return body(samples, seed, width=512, height=384)  # 13 MB


class FullDiskTest(unittest.TestCase):
    server: Server

    def is_paused_for_room(self, job):
        paused = self.server.wait_until(job, lambda now: now["state"] == "paused", "the pause")
        self.assertEqual(paused["pause_reason"], "storage_full")
        self.assertIsNone(paused["failure"])
        return paused

    def assert_no_space(self, answer):
        self.assertEqual(answer.status, 507, answer)
        self.assertEqual(answer.json()["type"], "/docs#problem-no-space")
        self.assertNotIn(self.server.data, answer.body.decode())

    def assert_ready_and_full(self, is_full):
        ready = self.server.get("/readyz")
        self.assertEqual(ready.status, 200)
        self.assertTrue(ready.body.startswith(b"ready\n"))
        self.assertEqual(b"\nstorage_full: " in ready.body, is_full, ready.body)


class SmallDisk(FullDiskTest):
    """A file system of a few megabytes, which a file of the test fills to the last byte."""

    BYTES = 24 << 20

    def setUp(self):
        self.data = tempfile.mkdtemp(prefix="tessera-disk-")
        self.addCleanup(shutil.rmtree, self.data, ignore_errors=True)
        mount = ["mount", "-t", "tmpfs", "-o", f"size={self.BYTES}", "none", self.data]
        mounted = subprocess.run(mount, capture_output=True, text=True, check=False)
        if mounted.returncode != 0:
            self.skipTest("no file system can be mounted here: " + mounted.stderr.strip())
        self.addCleanup(subprocess.run, ["umount", "-l", self.data], check=False)
        self.server = Server("--checkpoint", "1", data=self.data)
        self.server.log = tempfile.mktemp(prefix="tessera-log-")
        self.addCleanup(lambda: os.path.exists(self.server.log) and os.remove(self.server.log))
        self.addCleanup(self.server.close)
        self.server.start()

    def fill(self):
        with open(self.data + "/filler", "ab", buffering=0) as filler:
            piece = 1 << 20
            while piece > 0:
                try:
                    filler.write(bytes(piece))
                except OSError:
                    piece //= 2

    def make_room(self):
        os.remove(self.data + "/filler")

    def test_jobs_pause_and_continue_over_restarts_and_end_the_same(self):
        calm = self.server.render(body(32))
        gone = self.server.render(job_body())["id"]
        job = self.server.submit(body(65536))["id"]
        other = self.server.submit(body(65536, seed=1))["id"]
        self.server.wait_until(job, lambda now: now["state"] == "rendering")
        self.fill()
        for each in (job, other):
            self.is_paused_for_room(each)
        self.assert_ready_and_full(True)
        self.assert_no_space(self.server.post("/v1/assets", os.urandom(1 << 20), BYTES))
        # Acknowledged changes also survive a power failure.
        cancelled = self.server.post(f"/v1/jobs/{other}/cancel")
        self.assertEqual(cancelled.status, 200, cancelled)
        self.assertEqual(self.server.request("DELETE", "/v1/jobs/" + gone).status, 204)
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.job(other)["state"], "cancelled")
        self.assertEqual(self.server.get("/v1/jobs/" + gone).status, 404)
        self.fill()
        self.is_paused_for_room(job)
        self.assert_ready_and_full(True)
        self.make_room()
        self.server.wait_until(job, lambda now: now["state"] == "rendering", "room")
        self.assertIsNone(self.server.job(job)["pause_reason"])
        self.assert_ready_and_full(False)
        self.server.post(f"/v1/jobs/{job}/cancel")
        self.assertEqual(self.server.render(body(32, seed=0))["film_digest"], calm["film_digest"])

    def test_starts_after_an_orderly_stop_and_frees_space(self):
        job = self.server.render(body(2))["id"]
        other = self.server.render(body(2, seed=1))["id"]
        self.assertEqual(self.server.stop(), 0)
        self.fill()
        self.server.start()
        self.assertEqual(self.server.get(f"/v1/jobs/{job}/image.png").status, 200)
        for each in (job, other):
            self.assertEqual(self.server.request("DELETE", "/v1/jobs/" + each).status, 204)
        self.assertEqual(self.server.render(body(2))["state"], "finished")

    def test_jobs_can_be_deleted_until_there_is_space(self):
        jobs = [self.server.render(body(2, seed=seed))["id"] for seed in range(2)]
        self.fill()
        for job in jobs:
            answer = self.server.request("DELETE", "/v1/jobs/" + job)
            self.assertEqual(answer.status, 204, answer)
        self.assertEqual(self.server.render(body(2))["state"], "finished")


class FileSizeLimit(FullDiskTest):
    """No file may exceed a limit, which is lifted while the server runs."""

    # The journal of the database ends at 4 MB; the film is larger.
    BELOW_THE_FILM = 5_000_000

    def setUp(self):
        self.server = started(self, "--checkpoint", "0.3")

    def limit(self, bytes_of_a_file):
        resource.prlimit(self.server.process.pid, resource.RLIMIT_FSIZE,
                         (bytes_of_a_file, resource.RLIM_INFINITY))

    def test_job_continues_where_it_paused_and_ends_the_same(self):
        calm = self.server.render(large_body(8))
        self.limit(self.BELOW_THE_FILM)
        job = self.server.submit(large_body(8))["id"]
        self.is_paused_for_room(job)
        self.assert_ready_and_full(True)
        time.sleep(1)  # for the slices in progress
        revision = self.server.job(job)["revision"]
        time.sleep(1.5)  # longer than the interval at which the server checks for space
        self.assertEqual(self.server.job(job)["revision"], revision)
        self.limit(resource.RLIM_INFINITY)
        done = self.server.wait(job)
        self.assertEqual((done["state"], done["pause_reason"]), ("finished", None), done["failure"])
        self.assertEqual(done["film_digest"], calm["film_digest"])
        self.assert_ready_and_full(False)

    def test_end_that_cannot_be_stored_is_not_reported_until_it_is(self):
        self.limit(self.BELOW_THE_FILM)
        job = self.server.submit(large_body(2))["id"]
        self.is_paused_for_room(job)
        again = self.server.request("PATCH", "/v1/jobs/" + job, {"paused": False})
        self.assertEqual(again.json()["pause_reason"], "storage_full")
        self.limit(resource.RLIM_INFINITY)
        self.assertEqual(self.server.wait(job)["state"], "finished")

    def test_waiting_job_can_be_cancelled_or_kept_paused(self):
        self.limit(self.BELOW_THE_FILM)
        ended, held = (self.server.submit(large_body(2, seed))["id"] for seed in range(2))
        for job in (ended, held):
            self.is_paused_for_room(job)
        self.assertEqual(self.server.post(f"/v1/jobs/{ended}/cancel").json()["state"], "cancelled")
        kept = self.server.request("PATCH", "/v1/jobs/" + held, {"paused": True})
        self.assertEqual(kept.json()["pause_reason"], "requested")
        time.sleep(1)  # for an attempt to store it that is in progress
        self.limit(resource.RLIM_INFINITY)
        time.sleep(1.5)
        self.assertEqual(self.server.job(held)["state"], "paused")
        self.server.request("PATCH", "/v1/jobs/" + held, {"paused": False})
        self.assertEqual(self.server.wait(held)["state"], "finished")
        self.assertEqual(self.server.request("DELETE", "/v1/jobs/" + ended).status, 204)

    def test_does_not_acknowledge_changes_that_the_store_refuses(self):
        job = self.server.submit(body(65536))["id"]
        self.server.wait_for_samples(job)
        self.limit(0)
        for answer in (self.server.post(f"/v1/jobs/{job}/cancel"),
                       self.server.request("PATCH", "/v1/jobs/" + job, {"paused": True}),
                       self.server.request("PATCH", "/v1/jobs/" + job, {"priority": 5}),
                       self.server.post("/v1/jobs", body(2))):
            self.assert_no_space(answer)
        self.assertNotIn(self.server.job(job)["state"], ("cancelled", "failed"))
        self.limit(resource.RLIM_INFINITY)
        self.assertEqual(self.server.post(f"/v1/jobs/{job}/cancel").json()["state"], "cancelled")
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.job(job)["state"], "cancelled")


class Retry(unittest.TestCase):
    def setUp(self):
        self.server = started(self, "--checkpoint", "0.1", "--log-level", "debug")

    def restart_with(self, *flags):
        self.server.kill()
        flags, self.server.flags = self.server.flags, [*self.server.flags, *flags]
        self.server.start()
        self.server.flags = flags

    def fail_for_memory(self, job):
        """A server with too little memory for the film."""
        self.restart_with("--memory", "1M")
        failed = self.server.wait(job)
        self.assertEqual(failed["state"], "failed")
        self.restart_with()
        return failed

    def test_failed_job_continues_from_its_checkpoint_to_the_same_end(self):
        # Long enough for several checkpoints.
        calm = self.server.render(body(96))
        job = self.server.submit(body(96))["id"]
        deadline = time.monotonic() + PATIENCE_S
        while '"checkpoint"' not in self.server.log_text() and time.monotonic() < deadline:
            time.sleep(0.02)
        failed = self.fail_for_memory(job)
        self.assertIsNotNone(failed["failure"])
        answer = self.server.post(f"/v1/jobs/{job}/retry")
        self.assertEqual(answer.status, 202, answer)
        queued = answer.json()
        self.assertIn(queued["state"], ("queued", "loading", "rendering"))
        for member in ("failure", "finished_at", "stop_reason"):
            self.assertIsNone(queued[member])
        done = self.server.wait(job)
        self.assertEqual((done["state"], done["film_digest"]), ("finished", calm["film_digest"]))
        self.assertGreaterEqual(done["progress"]["elapsed_seconds"],
                                failed["progress"]["elapsed_seconds"])

    def test_restarts_without_a_checkpoint(self):
        calm = self.server.render(body(8))
        self.restart_with("--max-running", "1")
        self.server.submit(body(65536) | {"priority": 1})
        job = self.server.submit(body(8))["id"]  # It waits, and has no sample.
        self.fail_for_memory(job)
        self.assertEqual(self.server.post(f"/v1/jobs/{job}/retry").status, 202)
        self.assertEqual(self.server.wait(job)["film_digest"], calm["film_digest"])

    def test_retries_only_failed_jobs(self):
        job = self.server.render(job_body())["id"]
        refused = self.server.post(f"/v1/jobs/{job}/retry")
        self.assertEqual(refused.status, 409, refused)
        self.assertIn("finished", refused.json()["detail"])
        unknown = "00000000-0000-4000-8000-000000000000"
        self.assertEqual(self.server.post(f"/v1/jobs/{unknown}/retry").status, 404)


class Damaged(unittest.TestCase):
    def test_reports_a_lost_film_of_a_finished_job_without_rendering_again(self):
        server = started(self, "--film-cache", "0")
        for damage in (lambda path: os.truncate(path, 9000), lambda path: os.truncate(path, 0),
                       os.remove):
            job = server.render(job_body())["id"]
            path = f"{server.data}/films/{job}.film"
            server.stop()
            damage(path)
            size = os.path.exists(path) and os.path.getsize(path)
            server.start()
            for part in ("image.png", "pixels/0/0", "film"):
                self.assertEqual(server.get(f"/v1/jobs/{job}/{part}").status, 410)
            more = {"stop": {"samples_per_pixel": 16}}
            self.assertEqual(server.post(f"/v1/jobs/{job}/extend", more).status, 409)
            told = server.job(job)
            self.assertEqual(told["state"], "finished")
            damages = [each for each in told["warnings"] if "damaged" in each]
            self.assertEqual(len(damages), 1, told["warnings"])
            self.assertTrue(server.logged("film_damaged"))
            self.assertEqual(os.path.exists(path) and os.path.getsize(path), size)
            self.assertEqual(server.request("DELETE", f"/v1/jobs/{job}").status, 204)
