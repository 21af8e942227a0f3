"""What one tenant does to another: loading, comparisons; and requests that can never fit."""

import threading
import time
import unittest

from harness import (ApiTest, glb, job_body, started, tessera, triangle_document, triangle_glb,
                     wait_for)

OPERATOR = "operator-key-0000"


def crowd(count):
    """A glTF whose triangle stands `count` times in the same place."""
    document = triangle_document(nodes=[{"mesh": 0}] * count,
                                 scenes=[{"nodes": list(range(count))}])
    whole = triangle_glb()
    binary = whole[-36:]
    return glb(document, binary)


class SharingTest(unittest.TestCase):
    def setUp(self):
        self.server = started(self, *self.flags, key=OPERATOR)
        self.keys = {}
        for name in ("a", "b"):
            code, said, fault = tessera("keys", "add", name, "--data", self.server.data)
            self.assertEqual(code, 0, fault)
            self.keys[name] = {"Authorization": "Bearer " + said.split()[-1]}
        wait_for(lambda: self.server.get("/v1/jobs", self.keys["b"]).status == 200, seconds=60)

    flags = ()

    def post(self, name, path, body=None, **headers):
        return self.server.request("POST", path, body, self.keys[name] | headers)

    def cpu_seconds(self):
        with open(f"/proc/{self.server.process.pid}/stat", encoding="ascii") as file:
            fields = file.read().rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / 100


class LoadingTest(SharingTest):
    # Rays meet all of them: pilots of a job take tens of seconds of processor time.
    COUNT = 30000

    def upload(self):
        scene = self.post("b", "/v1/scenes", crowd(self.COUNT),
                          **{"Content-Type": "model/gltf-binary"})
        self.assertEqual(scene.status, 201, scene)
        return scene.json()

    def test_cancelled_loads_end_and_hold_nothing(self):
        scene = self.upload()
        self.assertRegex(" ".join(scene["warnings"]), "in the same place")
        for seed in range(6):
            job = self.post("b", "/v1/jobs", job_body(scene["id"], samples=2) | {"seed": seed})
            self.assertEqual(job.status, 201, job)
            path = "/v1/jobs/" + job.json()["id"]
            time.sleep(0.1)
            self.assertEqual(self.post("b", path + "/cancel").status, 200)
            self.assertEqual(self.server.request("DELETE", path, None, self.keys["b"]).status, 204)
        ended = self.post("a", "/v1/jobs", job_body(samples=2), Prefer="wait=20")
        self.assertEqual(ended.json()["state"], "finished", ended)
        before = self.cpu_seconds()
        time.sleep(2)
        self.assertLess(self.cpu_seconds() - before, 1)

    def test_a_load_does_not_keep_the_server_from_stopping(self):
        scene = self.upload()
        self.post("b", "/v1/jobs", job_body(scene["id"], samples=2))
        self.post("b", "/v1/jobs", job_body(scene["id"], samples=2) | {"seed": 1})
        time.sleep(0.3)
        before = time.monotonic()
        self.assertEqual(self.server.stop(), 0)
        self.assertLess(time.monotonic() - before, 8)  # Below --grace.
        self.server.start()

    def test_a_dry_run_ends_with_its_client(self):
        scene = self.upload()
        with self.assertRaises(TimeoutError):
            self.server.request("POST", "/v1/jobs?dry_run=1", job_body(scene["id"], samples=2),
                                self.keys["b"], timeout=0.5)
        time.sleep(2)
        before = self.cpu_seconds()
        time.sleep(2)
        self.assertLess(self.cpu_seconds() - before, 1)


class ComparisonsTest(SharingTest):
    def finished(self, name, width, height, seed):
        body = job_body("furnace", samples=2) | {
            "seed": seed, "integrator": {"type": "path", "max_depth": 1},
            "film": {"width": width, "height": height, "layers": []}}
        job = self.post(name, "/v1/jobs", body, Prefer="wait=20")
        while job.json()["state"] != "finished":
            job = self.server.get(f"/v1/jobs/{job.json()['id']}?wait=20", self.keys[name])
        return job.json()["id"]

    def test_one_tenants_comparisons_do_not_stop_those_of_others(self):
        small = [self.finished("a", 32, 32, seed) for seed in (1, 2)]
        large = [self.finished("b", 1024, 576, seed) for seed in (1, 2)]
        stop = threading.Event()

        def loop():
            while not stop.is_set():
                self.post("b", "/v1/comparisons", {"a": large[0], "b": large[1]})

        threads = [threading.Thread(target=loop) for _ in range(6)]
        for thread in threads:
            thread.start()
        try:
            time.sleep(1)
            before = time.monotonic()
            made = self.post("a", "/v1/comparisons", {"a": small[0], "b": small[1]})
            waited = time.monotonic() - before
        finally:
            stop.set()
            for thread in threads:
                thread.join()
        self.assertEqual(made.status, 201, made)
        before = time.monotonic()
        self.post("b", "/v1/comparisons", {"a": large[0], "b": large[1]})
        # Six comparisons are before it; it waits for none of them.
        self.assertLess(waited, 4 * (time.monotonic() - before) + 1)


class TooLargeTest(ApiTest):
    FLAGS = ("--memory", "300M")

    def test_what_can_never_fit_is_refused_at_once(self):
        body = job_body("furnace", samples=2) | {
            "integrator": {"type": "path", "max_depth": 1}, "denoise": {"type": "statistical"},
            "film": {"width": 1400, "height": 1000, "layers": []}}
        job = self.server.render(body)
        before = time.monotonic()
        denoised = self.server.get(f"/v1/jobs/{job['id']}/image.png?denoise=full")
        compared = self.server.post("/v1/comparisons", {"a": job["id"], "b": job["id"]})
        self.assertLess(time.monotonic() - before, 15)  # Waiting for memory takes 20 s.
        for refused in (denoised, compared):
            self.assert_problem(refused, 413)
            self.assertRegex(refused.json()["detail"],
                             r"needs .* MB of memory; the limit .*--memory")
