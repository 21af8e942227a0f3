"""Each pool, lock and queue that tenants share, saturated by tenant b while tenant a sends its
smallest request.

Comparisons are in sharing_test; slots of jobs, streams and previews in quota_test; webhooks in
webhooks_test; tickets and stored comparisons in the unit tests.
"""

import contextlib
import itertools
import socket
import threading
import time
import unittest

from harness import (PATIENCE_S, glb, job_body, started, tessera, triangle_document, triangle_glb,
                     wait_for)

OPERATOR = "operator-key-0000"
# Requests wait 20 s for memory or their turn before they are refused.
TOO_LONG_S = 15


def furnace(width, height, samples=2, **members):
    return job_body("furnace", samples=samples) | {
        "integrator": {"type": "path", "max_depth": 1},
        "film": {"width": width, "height": height, "layers": []}} | members


class SaturationTest(unittest.TestCase):
    FLAGS = ()

    @classmethod
    def setUpClass(cls):
        cls.server = started(cls, *cls.FLAGS, key=OPERATOR)
        cls.keys = {}
        for name in ("a", "b"):
            code, said, fault = tessera("keys", "add", name, "--data", cls.server.data)
            assert code == 0, fault
            cls.keys[name] = {"Authorization": "Bearer " + said.split()[-1]}
        wait_for(lambda: cls.server.get("/v1/jobs", cls.keys["b"]).status == 200)

    def ask(self, name, method, path, body=None, timeout=PATIENCE_S, **headers):
        return self.server.request(method, path, body, self.keys[name] | headers, timeout=timeout)

    def finished(self, name, body):
        job = self.ask(name, "POST", "/v1/jobs", body, Prefer="wait=20")
        self.assertIn(job.status, (201, 202), job)
        deadline = time.monotonic() + PATIENCE_S
        while job.json()["state"] != "finished":
            self.assertLess(time.monotonic(), deadline, job)
            job = self.ask(name, "GET", f"/v1/jobs/{job.json()['id']}?wait=20")
        return job.json()["id"]

    @contextlib.contextmanager
    def busy(self, count, request):
        """Calls request(i) for i = 0, 1, ... on `count` threads until the end."""
        stop = threading.Event()
        numbers = iter(range(1_000_000))
        lock = threading.Lock()

        def loop():
            while not stop.is_set():
                with lock:
                    number = next(numbers)
                with contextlib.suppress(OSError):  # The server may refuse connections.
                    request(number)

        threads = [threading.Thread(target=loop) for _ in range(count)]
        for thread in threads:
            thread.start()
        time.sleep(1)
        try:
            yield
        finally:
            stop.set()
            for thread in threads:
                thread.join()

    def assert_prompt(self, status, method, path, body=None, **headers):
        before = time.monotonic()
        answer = self.ask("a", method, path, body, **headers)
        self.assertLess(time.monotonic() - before, TOO_LONG_S, answer)
        self.assertEqual(answer.status, status, answer)
        return answer


class Requests(SaturationTest):
    FLAGS = ("--max-running", "2", "--max-streams", "64", "--quota-streams", "32")

    def test_merges(self):
        small = [self.finished("a", furnace(16, 16, seed=seed)) for seed in (1, 2)]
        large = [self.finished("b", furnace(800, 600, seed=seed)) for seed in (1, 2)]
        with self.busy(6, lambda _: self.ask("b", "POST", "/v1/films/merge", {"films": large})):
            self.assert_prompt(201, "POST", "/v1/films/merge", {"films": small})

    def test_denoising(self):
        denoise = {"denoise": {"type": "statistical"}}
        small = self.finished("a", furnace(16, 16, **denoise))
        large = [self.finished("b", furnace(480, 360, seed=seed, **denoise)) for seed in range(6)]

        def look(number):
            self.ask("b", "GET", f"/v1/jobs/{large[number % 6]}/image.png?denoise=full")

        with self.busy(6, look):
            self.assert_prompt(200, "GET", f"/v1/jobs/{small}/image.png?denoise=full")

    def test_images(self):
        small = self.finished("a", furnace(16, 16))
        large = self.finished("b", furnace(1280, 720))
        with self.busy(24, lambda _: self.ask("b", "GET", f"/v1/jobs/{large}/image.exr")):
            self.assert_prompt(200, "GET", f"/v1/jobs/{small}/image.png")

    def test_dry_runs(self):
        def estimate(number):
            self.ask("b", "POST", "/v1/jobs?dry_run=1", furnace(1280, 720, seed=number))

        with self.busy(12, estimate):
            self.assert_prompt(200, "POST", "/v1/jobs?dry_run=1", furnace(16, 16))

    def test_uploads(self):
        def upload(number):
            # Each has other bytes, and 5,000 nodes to check.
            document = triangle_document(
                nodes=[{"mesh": 0, "translation": [i, number, 0]} for i in range(5000)],
                scenes=[{"nodes": list(range(5000))}])
            self.ask("b", "POST", "/v1/scenes", glb(document, triangle_glb()[-36:]),
                     **{"Content-Type": "model/gltf-binary"})

        with self.busy(8, upload):
            self.assert_prompt(201, "POST", "/v1/scenes", triangle_glb(),
                               **{"Content-Type": "model/gltf-binary"})

    def test_running_jobs(self):
        jobs = [self.ask("b", "POST", "/v1/jobs", furnace(640, 480, 20000, seed=seed)).json()["id"]
                for seed in range(12)]
        time.sleep(1)
        self.finished("a", furnace(16, 16, seed=2))
        states = [self.ask("b", "GET", f"/v1/jobs/{job}").json()["state"] for job in jobs]
        self.assertNotIn("finished", states)
        for job in jobs:
            self.assertEqual(self.ask("b", "POST", f"/v1/jobs/{job}/cancel").status, 200)

    def test_waiting_requests(self):
        job = self.ask("b", "POST", "/v1/jobs", furnace(640, 480, 20000)).json()["id"]
        head = (f"GET /v1/jobs/{job}?wait=20 HTTP/1.1\r\nHost: 127.0.0.1:{self.server.port}\r\n"
                f"Authorization: {self.keys['b']['Authorization']}\r\n\r\n").encode()
        with contextlib.ExitStack() as open_ones:
            for _ in range(100):  # Of which 32 wait, as streams, and the others are refused.
                sent = socket.create_connection(("127.0.0.1", self.server.port), PATIENCE_S)
                open_ones.enter_context(sent)
                sent.sendall(head)
            time.sleep(1)
            refused = self.ask("b", "GET", f"/v1/jobs/{job}?wait=20")
            self.assertIn(refused.status, (429, 503), refused)
            own = self.ask("a", "POST", "/v1/jobs", furnace(16, 16))
            self.assert_prompt(200, "GET", f"/v1/jobs/{own.json()['id']}?wait=1")
        self.assertEqual(self.ask("b", "POST", f"/v1/jobs/{job}/cancel").status, 200)


class Memory(SaturationTest):
    FLAGS = ("--memory", "400M")

    def test_images_that_are_not_read(self):
        small = self.finished("a", furnace(16, 16))
        large = self.finished("b", furnace(1600, 900))
        # Different images: equal ones are encoded once.
        head = (f"GET /v1/jobs/{large}/image.tif?x=0&y=%d&width=1600&height=840 HTTP/1.1\r\n"
                f"Host: 127.0.0.1:{self.server.port}\r\n"
                f"Authorization: {self.keys['b']['Authorization']}\r\n\r\n")
        with contextlib.ExitStack() as open_ones:
            slow = []
            for y in range(40):
                sent = socket.create_connection(("127.0.0.1", self.server.port), PATIENCE_S)
                slow.append(open_ones.enter_context(sent))
                sent.sendall((head % y).encode())
            stop = threading.Event()

            def trickle():  # Enough that the server does not close the connections.
                while not stop.wait(2):
                    for sent in slow:
                        sent.setblocking(False)
                        with contextlib.suppress(OSError):
                            sent.recv(100_000)

            reader = threading.Thread(target=trickle)
            reader.start()
            try:
                self.until_memory_is_short(large)
                self.assert_prompt(200, "GET", f"/v1/jobs/{small}/image.png")
                self.assert_prompt(200, "POST", "/v1/jobs?dry_run=1", furnace(16, 16))
                self.finished("a", furnace(16, 16, seed=1))
            finally:
                stop.set()
                reader.join()

    def until_memory_is_short(self, job):
        """Until b gets no memory for a further image within a second."""
        deadline = time.monotonic() + PATIENCE_S
        left = itertools.cycle(range(100))
        while time.monotonic() < deadline:
            try:
                part = f"x={next(left)}&y=0&width=1500&height=900"
                self.ask("b", "GET", f"/v1/jobs/{job}/image.tif?{part}", timeout=1)
            except TimeoutError:
                return
        self.fail("b does not use up the memory")
