"""A coordinator, its broker and its workers as separate processes, and a manual worker.

Standard library only; nats-server is from Debian.
"""

import contextlib
import http.client
import http.server
import os
import re
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import zlib

from harness import BINARY, PATIENCE_S, Server

NATS_SERVER = shutil.which("nats-server") or "/usr/sbin/nats-server"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def clean_environ():
    return {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}


class Place:
    """Where a process runs: an address, and a function for the child to call before exec."""

    def __init__(self, host="127.0.0.1", enter=None):
        self.host = host
        self.enter = enter


class Broker:
    """A NATS server; start() after kill() restarts it without its data."""

    def __init__(self, place=None, config=None, scheme="nats", user=""):
        self.place = place or Place()
        self.flags = ["-c", config] if config else []
        self.port = free_port()
        self.url = f"{scheme}://{user}{self.place.host}:{self.port}"
        self.process = None
        self.start()

    def start(self):
        self.folder = tempfile.mkdtemp(prefix="tessera-nats-")
        self.process = subprocess.Popen(
            [NATS_SERVER, "-js", "-a", self.place.host, "-p", str(self.port), "-sd", self.folder,
             *self.flags],
            stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, preexec_fn=self.place.enter)
        deadline = time.monotonic() + PATIENCE_S
        while True:
            try:
                socket.create_connection((self.place.host, self.port), timeout=1).close()
                return
            except OSError:
                if time.monotonic() > deadline:
                    raise
                time.sleep(0.02)

    def messages(self):
        """Returns the number of messages in the stream of units."""
        with socket.create_connection((self.place.host, self.port), timeout=PATIENCE_S) as plug:
            plug.sendall(b'CONNECT {"verbose":false}\r\nSUB inbox.count 1\r\n'
                         b"PUB $JS.API.STREAM.INFO.TESSERA_UNITS inbox.count 0\r\n\r\n")
            received = b""
            while not (found := re.search(rb'"messages":(\d+)', received)):
                received += plug.recv(4096)
            return int(found[1])

    def kill(self):
        self.process.kill()
        self.process.wait()
        shutil.rmtree(self.folder, ignore_errors=True)


def sealed(data):
    """Appends the checksum, core/render/units/slice_work.h."""
    return data + zlib.crc32(data).to_bytes(4, "little")


class Proxy(http.server.ThreadingHTTPServer):
    """A proxy between a worker and its server; calls changed() for each result."""

    def __init__(self, server_port):
        self.server_port_behind = server_port
        super().__init__(("127.0.0.1", 0), self.Handler)
        threading.Thread(target=self.serve_forever, daemon=True).start()

    class Handler(http.server.BaseHTTPRequestHandler):
        protocol_version = "HTTP/1.1"

        def forward(self):
            if self.server.refuses(self):
                return
            body = self.rfile.read(int(self.headers.get("Content-Length", 0)))
            if "/results/" in self.path:
                body = self.server.changed(body)
            if body is None:
                self.send_error(503)
                return
            link = http.client.HTTPConnection("127.0.0.1", self.server.server_port_behind,
                                              timeout=PATIENCE_S)
            skipped = ("host", "content-length", "expect", "connection")
            headers = {k: v for k, v in self.headers.items() if k.lower() not in skipped}
            link.request(self.command, self.path, body, headers)
            answer = link.getresponse()
            content = answer.read()
            self.send_response(answer.status)
            self.send_header("Content-Type", answer.getheader("Content-Type") or "text/plain")
            self.send_header("Content-Length", str(len(content)))
            self.end_headers()
            self.wfile.write(content)
            link.close()

        def refuse(self, status, **headers):
            self.rfile.read(int(self.headers.get("Content-Length", 0)))
            self.send_response(status)
            for name, value in headers.items():
                self.send_header(name.replace("_", "-"), value)
            self.send_header("Content-Length", "0")
            self.end_headers()

        do_GET = do_POST = do_PUT = forward

        def log_message(self, *_):
            pass


    def refuses(self, handler):
        """Answers the request itself if it is to fail; returns whether it has."""
        return False

    def changed(self, result):
        return result


class FlakyProxy(Proxy):
    """Fails the first attempts of each request: with each status, and by a cut connection."""

    def __init__(self, server_port, *statuses, of=""):
        self.failures = [*statuses, "cut"]
        self.part_of_path = of
        self.failed = {}
        super().__init__(server_port)

    def refuses(self, handler):
        if handler.path.startswith("/v1/workers/") or self.part_of_path not in handler.path:
            return False
        tried = self.failed.get(handler.path, 0)
        if tried == len(self.failures):
            return False
        self.failed[handler.path] = tried + 1
        failure = self.failures[tried]
        if failure == "cut":
            handler.rfile.read(1000 if "/results/" in handler.path else 0)
            handler.close_connection = True
            handler.connection.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER,
                                          struct.pack("ii", 1, 0))  # resets the connection
            handler.connection.close()
        else:
            handler.refuse(failure)
        return True


class BusyOnceProxy(Proxy):
    """Answers the first request for each input with 429; records the time of each attempt."""

    def __init__(self, server_port, retry_after):
        self.retry_after = retry_after
        self.times = {}
        super().__init__(server_port)

    def refuses(self, handler):
        times = self.times.setdefault(handler.path, [])
        times.append(time.monotonic())
        is_first = handler.command == "GET" and len(times) == 1
        if is_first:
            handler.refuse(429, Retry_After=str(self.retry_after))
        return is_first


class SlowProxy(Proxy):
    """Holds each result back for that time, as a server does that has no memory for it."""

    def __init__(self, server_port, seconds):
        self.seconds = seconds
        super().__init__(server_port)

    def changed(self, result):
        time.sleep(self.seconds)
        return result


class LyingProxy(Proxy):
    """Flips one bit of one pixel of each result."""

    def changed(self, result):
        head = 16 + 208  # core/render/units/slice_work.h; followed by the mean of the first pixel.
        data = bytearray(result[:-4])
        data[head] ^= 1
        return sealed(bytes(data))


class BusyProxy(Proxy):
    """Blocks all results; the first one sets `refused`."""

    def __init__(self, server_port):
        self.refused = threading.Event()
        super().__init__(server_port)

    def changed(self, _):
        self.refused.set()


class Worker:
    def __init__(self, broker, server, *flags, key=None, port=None, place=None):
        self.place = place or Place()
        self.cache = tempfile.mkdtemp(prefix="tessera-worker-")
        environ = clean_environ() | ({"TESSERA_KEY": key} if key else {})
        self.process = subprocess.Popen(
            [BINARY, "worker", "--queue", broker.url, "--server",
             f"http://{server.host}:{port or server.port}", "--threads", "1",
             "--cache", self.cache, *flags],
            stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, env=environ,
            preexec_fn=self.place.enter)
        self.id = self.process.stdout.readline().split()[-1]

    def kill(self):
        self.process.kill()
        return self.end()

    def stop(self):
        """Sends SIGTERM; returns the exit code."""
        self.process.send_signal(signal.SIGTERM)
        return self.end()

    def end(self):
        code = self.process.wait(PATIENCE_S)
        self.process.stdout.close()
        self.complaints = self.process.stderr.read()
        self.process.stderr.close()
        shutil.rmtree(self.cache, ignore_errors=True)
        return code


def request_report(broker, worker):
    """Asks a worker by NATS to report at once, as the coordinator does."""
    with socket.create_connection((broker.place.host, broker.port), timeout=PATIENCE_S) as plug:
        plug.sendall(b'CONNECT {"verbose":false}\r\nPUB tessera.workers.%s 0\r\n\r\nPING\r\n'
                     % worker.encode())
        lines = plug.makefile("rb")
        while lines.readline() != b"PONG\r\n":
            pass


class Farm:
    """A coordinator with its broker and workers; close() ends all remaining processes.

    verify: fraction of units that are verified; such a unit waits 10 s for a stopped worker.
    """

    def __init__(self, *flags, workers=0, key=None, lease=60, broker=None, place=None, data=None,
                 checkpoint=0.2, verify=0):
        self.broker = broker or Broker()
        place = place or Place()
        # A fixed port: workers find a restarted coordinator.
        self.server = Server("--queue", self.broker.url, "--lease", str(lease), "--port",
                             str(free_port()), "--checkpoint", str(checkpoint), "--verify",
                             str(verify), *flags, key=key, data=data, host=place.host,
                             preexec=place.enter)
        self.workers = []
        self.server.start()
        for _ in range(workers):
            self.add_worker()

    def add_worker(self, *flags, **options):
        self.workers.append(Worker(self.broker, self.server, *flags, **options))
        return self.workers[-1]

    def listed(self):
        return {w["id"]: w for w in self.server.get("/v1/workers").json()["workers"]}

    def wait_for_worker(self, worker, condition, what):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            seen = self.listed().get(worker)
            if seen and condition(seen):
                return seen
            time.sleep(0.02)
        raise AssertionError(f"timed out waiting for {what}: {seen}; {self.server.log_text()}")

    def metric(self, name):
        text = self.server.get("/metrics").body.decode()
        return float(re.search(rf"^{name} (\S+)$", text, re.MULTILINE)[1])

    def close(self):
        for worker in self.workers:
            if worker.process.poll() is None:
                worker.kill()
        self.server.close()
        self.broker.kill()


class HandWorker:
    """Speaks NATS and HTTP itself, to do what `tessera worker` never does."""

    def __init__(self, farm, name="hand", key=None, **report):
        self.farm = farm
        self.id = name
        self.headers = {"Authorization": "Bearer " + key} if key else {}
        build = farm.server.get("/v1/server").json()["build"]["id"]
        # The refusal of another arithmetic names that of the server.
        self.report_body = {"build": build, "arithmetic": "none"}
        own = re.search(r'the server\'s is "(.*)";', self.report().json()["reason"])[1]
        self.report_body = {"build": build, "arithmetic": own, **report}

    def report(self, **members):
        return self.farm.server.request("PUT", f"/v1/workers/{self.id}",
                                        self.report_body | members, self.headers)

    def next_unit(self):
        """Takes a unit from the queue; returns its name."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            self.report()
            if name := self.pull():
                return name
            time.sleep(0.05)
        raise AssertionError("received no unit")

    @contextlib.contextmanager
    def report_requests(self):
        """Yields a function that waits for the coordinator's request to report, by NATS."""
        broker = self.farm.broker
        with socket.create_connection((broker.place.host, broker.port), timeout=PATIENCE_S) as plug:
            lines = plug.makefile("rb")
            plug.sendall(b'CONNECT {"verbose":false}\r\nSUB tessera.workers.%s 1\r\nPING\r\n'
                         % self.id.encode())
            while lines.readline() != b"PONG\r\n":
                pass

            def wait():
                while not lines.readline().startswith(b"MSG tessera.workers.%s 1 "
                                                      % self.id.encode()):
                    pass

            yield wait

    def pull(self):
        """Acknowledges a unit at once; returns its name, or None if there was none or no answer.
        Keeps the number that the queue gave the message, by which it is acknowledged."""
        broker = self.farm.broker
        with socket.create_connection((broker.place.host, broker.port), timeout=1) as plug:
            inbox = b"inbox.%s" % self.id.encode()
            plug.sendall(b'CONNECT {"verbose":false,"headers":true,"no_responders":true}\r\n'
                         b"SUB %s 1\r\n"
                         b"PUB $JS.API.CONSUMER.MSG.NEXT.TESSERA_UNITS.tessera-workers %s 1\r\n"
                         b"1\r\n" % (inbox, inbox))
            received = b""
            while True:
                try:
                    received += plug.recv(4096)
                except TimeoutError:
                    return None
                if unit := re.search(rb"\r\nMSG \S+ 1 (\S+) \d+\r\n(.*)\r\n", received):
                    plug.sendall(b"PUB %s 4\r\n+ACK\r\nPING\r\n" % unit[1])
                    plug.recv(4096)  # PONG: the broker has received it.
                    # $JS.ACK, stream, consumer, deliveries, number in the stream, ...
                    self.message = int(unit[1].split(b".")[5])
                    return unit[2].decode()
                if re.search(rb"\r\nHMSG .*\r\n", received):
                    return None

    def lease(self, unit):
        return self.farm.server.request("POST", f"/v1/work/units/{unit}/lease",
                                        {"worker": self.id}, self.headers)

    def hand_back(self, unit, fault=""):
        return self.farm.server.request("POST", f"/v1/work/units/{unit}/hand-back",
                                        {"worker": self.id, "fault": fault}, self.headers)

    def deliver(self, unit, result):
        return self.farm.server.request(
            "PUT", f"/v1/work/units/{unit}/results/{self.id}", result,
            {"Content-Type": "application/octet-stream"} | self.headers)
