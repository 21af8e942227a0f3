"""The documented number of watchers at the same time, while the renderer is busy."""

import contextlib
import re
import resource
import select
import socket
import statistics
import time

from harness import PATIENCE_S, ApiTest, EventStream, job_body, wait_for

STREAMS = 2048


class MemoryTest(ApiTest):
    def memory(self):
        lines = self.server.get("/metrics").body.decode().splitlines()
        return int(float(next(line.split()[1] for line in lines
                              if line.startswith("tessera_memory_bytes "))))


class UnreadTiles(MemoryTest):
    def resident_bytes(self):
        with open(f"/proc/{self.server.process.pid}/status", encoding="ascii") as status:
            return int(re.search(r"RssAnon:\s+(\d+) kB", status.read()).group(1)) * 1024

    def test_client_that_does_not_read_costs_little_more_than_is_counted(self):
        job = self.server.submit(job_body(samples=65536, film={"width": 512, "height": 512}))["id"]
        self.server.wait_for_samples(job, 2)
        self.server.request("PATCH", f"/v1/jobs/{job}", {"paused": True})
        head = f"GET /v1/jobs/{job}/tiles HTTP/1.1\r\nHost: localhost\r\n\r\n".encode()
        with contextlib.ExitStack() as stack:
            def open_stream():
                plug = stack.enter_context(
                    socket.create_connection(("127.0.0.1", self.server.port)))
                plug.sendall(head)
                self.assertTrue(plug.recv(4096))
                return plug

            # Tiles are encoded once for all clients: by this one, which reads all of them.
            reader = open_stream()
            while select.select([reader], [], [], 1)[0]:
                self.assertTrue(reader.recv(1 << 20))
            costs = []
            for _ in range(7):
                before = self.resident_bytes()
                for _ in range(32):
                    open_stream()
                costs.append((self.resident_bytes() - before) / 32)
            self.assertLess(statistics.median(costs), 1.5 * 65536, costs)


class StreamMemory(MemoryTest):
    def test_open_streams_count_as_memory(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.wait_for_samples(job)
        self.server.request("PATCH", f"/v1/jobs/{job}", {"paused": True})
        before = self.memory()
        with contextlib.ExitStack() as stack:
            for _ in range(8):
                stream = stack.enter_context(EventStream(self.server, job))
                self.assertEqual(next(iter(stream)).name, "snapshot")
            self.assertEqual(self.memory() - before, 8 * 65536)
        wait_for(lambda: self.memory() == before)  # Clients that left are noticed within a second.
        self.server.post(f"/v1/jobs/{job}/cancel")


class ManyStreams(ApiTest):
    @classmethod
    def setUpClass(cls):
        hard = resource.getrlimit(resource.RLIMIT_NOFILE)[1]
        resource.setrlimit(resource.RLIMIT_NOFILE, (min(hard, 16384), hard))
        super().setUpClass()

    def open_stream(self, job):
        plug = socket.create_connection(("127.0.0.1", self.server.port), timeout=PATIENCE_S)
        plug.sendall(f"GET /v1/jobs/{job}/events HTTP/1.1\r\nHost: localhost\r\n\r\n".encode())
        return plug

    def read_until(self, plugs, word):
        """Reads from all streams until each has received the word, which may be split in two."""
        waiting = {plug.fileno(): (plug, b"") for plug in plugs}
        poll = select.poll()
        for number in waiting:
            poll.register(number, select.POLLIN)
        deadline = time.monotonic() + PATIENCE_S
        while waiting and time.monotonic() < deadline:
            for number, _ in poll.poll(1000):
                plug, before = waiting[number]
                piece = plug.recv(65536)
                self.assertTrue(piece, "a stream ended early")
                seen = before + piece
                if word in seen:
                    poll.unregister(number)
                    del waiting[number]
                else:
                    waiting[number] = (plug, seen[-len(word):])
        self.assertFalse(waiting, f"{len(waiting)} streams did not receive {word}")

    def test_2048_watchers_get_everything_from_snapshot_to_end(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.wait_for_samples(job)
        plugs = []
        try:
            for _ in range(STREAMS):
                plugs.append(self.open_stream(job))
            self.read_until(plugs, b"event: snapshot")
            with EventStream(self.server, job) as one_more:
                self.assertEqual([e.name for e in one_more], ["overloaded"])
            self.assertEqual(self.server.get("/livez").status, 200)
            self.assertIn(f"tessera_streams {STREAMS}", self.server.get("/metrics").body.decode())
            self.read_until(plugs, b"event: tile")
            self.server.post(f"/v1/jobs/{job}/cancel")
            self.read_until(plugs, b"event: end")
        finally:
            for plug in plugs:
                plug.close()
        # Their slots are free again.
        with EventStream(self.server, job) as stream:
            self.assertEqual(stream.all()[-1].name, "end")
