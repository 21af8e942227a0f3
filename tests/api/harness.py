"""Helpers of the API tests: a separate server process, requests, the two streams, and small files.

Standard library only. A test class derives from ApiTest, which starts one server for the class; the
tests of a class run one after another. Times are never asserted, only ratios.
"""

import http.client
import json
import math
import os
import shutil
import signal
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest
import zlib

BINARY = os.environ.get("TESSERA_BINARY", "build/release/tessera")

# Time limit of any step, for a busy machine. Never an expectation.
PATIENCE_S = 120

SMALL = {"width": 48, "height": 32, "layers": []}


def job_body(scene="cornell-box", samples=8, **members):
    body = {"scene": scene, "film": dict(SMALL), "stop": {"samples_per_pixel": samples}}
    body.update(members)
    return body


class Answer:
    def __init__(self, status, headers, body):
        self.status = status
        self.headers = headers
        self.body = body

    def json(self):
        return json.loads(self.body)

    def __repr__(self):
        return f"{self.status} {dict(self.headers)} {self.body[:2000]!r}"


class Server:
    """A server with a data directory, which survives kill() and stop() until close()."""

    def __init__(self, *flags, threads=2, data=None, key=None, preexec=None, scheme="http",
                 environ=None, host="127.0.0.1"):
        self.flags = list(flags)
        self.host = host
        self.environ = environ or {}  # Added to this process's variables, except TESSERA_*.
        self.scheme = scheme
        self.key = key  # Sent with every request.
        self.preexec = preexec  # Called in the child before exec.
        self.threads = threads
        self.data = data or tempfile.mkdtemp(prefix="tessera-api-")
        self.process = None
        self.port = None
        self.log = os.path.join(self.data, "stderr.log")

    def start(self, threads=None):
        command = [BINARY, "serve", "--listen", self.host, "--port", "0", "--data", self.data,
                   "--log-level", "warning", "--threads", str(threads or self.threads),
                   *self.flags]
        environ = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}
        with open(self.log, "ab") as log:
            self.process = subprocess.Popen(
                command, stdout=subprocess.PIPE, stderr=log, env={**environ, **self.environ},
                preexec_fn=self.preexec
            )
        line = self.process.stdout.readline().decode()
        if not line.startswith(f"listening on {self.scheme}://{self.host}:"):
            self.process.wait(10)
            raise RuntimeError(f"expected an address, not {line!r}; {self.log_text()}")
        self.port = int(line.rsplit(":", 1)[1])
        deadline = time.monotonic() + PATIENCE_S
        while self.request("GET", "/readyz").status != 200:
            if time.monotonic() > deadline:
                raise RuntimeError("not ready in time; " + self.log_text())
            time.sleep(0.01)
        return self

    def log_text(self):
        with open(self.log, encoding="utf-8", errors="replace") as log:
            return log.read()[-4000:]

    def logged(self, event):
        """Whether the log has the event, however long ago."""
        with open(self.log, encoding="utf-8", errors="replace") as log:
            return any(f'"event":"{event}"' in line for line in log)

    def checkpoints(self, job):
        """The number of a job's checkpoints; needs --log-level debug."""
        with open(self.log, encoding="utf-8") as log:
            return sum('"checkpoint"' in line and job in line for line in log)

    def alive(self):
        return self.process is not None and self.process.poll() is None

    def kill(self):
        """Simulates a power failure."""
        self.process.send_signal(signal.SIGKILL)
        self.process.wait()
        self.process.stdout.close()

    def stop(self):
        """Sends SIGTERM; returns the exit code."""
        self.process.send_signal(signal.SIGTERM)
        code = self.process.wait(PATIENCE_S)
        self.process.stdout.close()
        return code

    def close(self):
        if self.alive():
            self.kill()
        shutil.rmtree(self.data, ignore_errors=True)

    def connect(self, timeout=PATIENCE_S):
        return http.client.HTTPConnection(self.host, self.port, timeout=timeout)

    def request(self, method, path, body=None, headers=None, timeout=PATIENCE_S):
        connection = self.connect(timeout)
        headers = self.with_key(headers)
        if isinstance(body, (dict, list)):
            body = json.dumps(body)
            headers.setdefault("Content-Type", "application/json")
        try:
            connection.request(method, path, body=body, headers=headers)
            response = connection.getresponse()
            return Answer(response.status, response.headers, response.read())
        finally:
            connection.close()

    def with_key(self, headers):
        headers = dict(headers or {})
        if self.key:
            headers.setdefault("Authorization", "Bearer " + self.key)
        return headers

    def get(self, path, headers=None):
        return self.request("GET", path, headers=headers)

    def post(self, path, body=None, headers=None):
        return self.request("POST", path, body, headers)

    def raw(self, data):
        """Sends raw bytes; returns everything received until the server closes the connection."""
        with socket.create_connection(("127.0.0.1", self.port), timeout=PATIENCE_S) as plug:
            plug.sendall(data)
            received = b""
            while True:
                piece = plug.recv(65536)
                if not piece:
                    return received
                received += piece

    def submit(self, body, **headers):
        """Submits and returns the job; fails on any status except 201."""
        answer = self.post("/v1/jobs", body, {k.replace("_", "-"): v for k, v in headers.items()})
        if answer.status != 201:
            raise AssertionError(f"submit: {answer}")
        return answer.json()

    def job(self, job_id):
        return self.get(f"/v1/jobs/{job_id}").json()

    def wait(self, job_id):
        """Waits for the end of a job and returns it."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            job = self.get(f"/v1/jobs/{job_id}?wait=20").json()
            if job["state"] in ("finished", "failed", "cancelled"):
                return job
        raise AssertionError(f"did not end: {job}")

    def render(self, body):
        """Renders a job that must finish."""
        job = self.wait(self.submit(body)["id"])
        if job["state"] != "finished":
            raise AssertionError(f"not finished: {job}")
        return job

    def wait_until(self, job_id, condition, what="the condition"):
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            job = self.job(job_id)
            if condition(job):
                return job
            time.sleep(0.01)
        raise AssertionError(f"timed out waiting for {what}: {job}")

    def wait_for_samples(self, job_id, count=1):
        return self.wait_until(
            job_id,
            lambda job: job["progress"]["samples_per_pixel"]["min"] >= count,
            f"{count} samples",
        )


def wait_for(condition, failure="timed out", seconds=PATIENCE_S):
    """Returns the condition's first true value. failure: a text, or a function that returns it."""
    deadline = time.monotonic() + seconds
    while not (value := condition()):
        if time.monotonic() > deadline:
            raise AssertionError(failure() if callable(failure) else failure)
        time.sleep(0.05)
    return value


def started(case, *flags, **options):
    """Starts a Server that is closed at the end of the test, or of the class of tests."""
    server = Server(*flags, **options)
    clean_up = case.addClassCleanup if isinstance(case, type) else case.addCleanup
    clean_up(server.close)
    return server.start()


class Stream:
    """A GET, or another `method`, whose answer is read as it arrives."""

    def __init__(self, server, path, headers=None, timeout=PATIENCE_S, method="GET", body=None):
        self.connection = server.connect(timeout)
        headers = server.with_key(headers)
        if body is not None:
            headers.setdefault("Content-Type", "application/json")
        self.connection.request(
            method, path, body=None if body is None else json.dumps(body), headers=headers
        )
        self.response = self.connection.getresponse()
        self.status = self.response.status
        self.headers = self.response.headers

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.response.close()
        self.connection.close()


class Event:
    def __init__(self, name, event_id, data, retry):
        self.name = name
        self.id = event_id
        self.data = data
        self.retry = retry

    def json(self):
        return json.loads(self.data)

    def __repr__(self):
        return f"{self.name} id={self.id} {self.data[:200]}"


class EventStream(Stream):
    """Server-sent events, parsed according to the HTML standard."""

    def __init__(self, server, job_id, last=None):
        headers = {"Accept": "text/event-stream"}
        if last is not None:
            headers["Last-Event-ID"] = last
        super().__init__(server, self.path(job_id), headers)
        self.comments = []

    def path(self, job_id):
        return f"/v1/jobs/{job_id}/events"

    def __iter__(self):
        name, event_id, data, retry = "message", None, [], None
        while True:
            line = self.response.readline().decode()
            if line == "":
                return
            line = line.rstrip("\r\n")
            if line == "":
                if data:
                    yield Event(name, event_id, "\n".join(data), retry)
                name, event_id, data, retry = "message", None, [], None
                continue
            field, _, value = line.partition(":")
            value = value[1:] if value.startswith(" ") else value
            if field == "":
                self.comments.append(value)
            elif field == "event":
                name = value
            elif field == "id":
                event_id = value
            elif field == "data":
                data.append(value)
            elif field == "retry":
                retry = int(value)

    def all(self):
        return list(self)


class JobsStream(EventStream):
    """The events of several jobs on one connection."""

    def path(self, job_ids):
        return "/v1/events?jobs=" + ",".join(job_ids)


def tessera(*arguments, environ=None):
    """Runs a verb to its end; returns exit code, standard output and standard error."""
    variables = {k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")}
    done = subprocess.run([BINARY, *arguments], capture_output=True, text=True, timeout=PATIENCE_S,
                          env={**variables, **(environ or {})})
    return done.returncode, done.stdout, done.stderr


class Tile:
    END, CORRELATED, ALPHA, MEAN, DENOISED = 1, 2, 4, 8, 16

    def __init__(self, header, payload):
        (
            magic,
            size,
            self.revision,
            self.x,
            self.y,
            self.width,
            self.height,
            self.flags,
            self.error,
            self.crc,
        ) = struct.unpack("<4sIIHHHHIfI", header)
        if magic != b"TSR1":
            raise AssertionError(f"magic {magic!r}")
        if size != len(payload):
            raise AssertionError("payload is truncated")
        self.payload = payload
        self.is_end = bool(self.flags & self.END)

    def check(self):
        """Checks checksum and size; returns the planes."""
        if zlib.crc32(self.payload) != self.crc:
            raise AssertionError("CRC-32 differs")
        planes = (3 if self.flags & (self.MEAN | self.DENOISED) else 7) + (
            1 if self.flags & self.ALPHA else 0)
        kind, size = ("e", 2) if self.flags & self.MEAN else ("f", 4)
        if len(self.payload) != (0 if self.is_end else planes * size * self.width * self.height):
            raise AssertionError(f"{len(self.payload)} bytes for {self.width} x {self.height}")
        count = self.width * self.height
        values = struct.unpack(f"<{len(self.payload) // size}{kind}", self.payload)
        return [values[p * count:(p + 1) * count] for p in range(planes if not self.is_end else 0)]

    def place(self):
        return (self.x, self.y, self.width, self.height)


class TileStream(Stream):
    def __init__(self, server, job_id, query="", headers=None):
        super().__init__(server, f"/v1/jobs/{job_id}/tiles{query}", headers)

    def __iter__(self):
        while True:
            header = self.response.read(32)
            if not header:
                return
            if len(header) < 32:
                raise AssertionError("header is truncated")
            size = struct.unpack("<I", header[4:8])[0]
            tile = Tile(header, self.response.read(size))
            yield tile
            if tile.is_end:
                rest = self.response.read()
                if rest:
                    raise AssertionError(f"{len(rest)} bytes after the end frame")
                return

    def all(self):
        return list(self)


def tile_places(x, y, width, height, size=32):
    """Tile rectangles of a crop: aligned with the full film's origin."""
    places = set()
    for top in range(y // size * size, y + height, size):
        for left in range(x // size * size, x + width, size):
            x0, y0 = max(left, x), max(top, y)
            places.add((x0, y0, min(left + size, x + width) - x0, min(top + size, y + height) - y0))
    return places


class ApiTest(unittest.TestCase):
    """One server for the tests of a class; it must still run after each of them."""

    FLAGS = ()
    THREADS = 2
    UNFINISHED = "/v1/jobs?state=queued&state=loading&state=rendering&state=paused&limit=200"
    maxDiff = None

    @classmethod
    def setUpClass(cls):
        cls.server = started(cls, *cls.FLAGS, threads=cls.THREADS)

    def tearDown(self):
        if self.server.process is not None and not self.server.alive():
            self.fail(
                f"the server died ({self.server.process.returncode}): {self.server.log_text()}"
            )
        # Ends the jobs that a test leaves running, so that they do not slow the next one.
        for job in self.server.get(self.UNFINISHED).json()["jobs"]:
            self.server.post(f"/v1/jobs/{job['id']}/cancel")

    def hold(self):
        """With --max-running 1: submitted jobs wait until the returned function is called."""
        blocker = self.server.submit(job_body(samples=65536, priority=1))["id"]
        return lambda: self.server.post(f"/v1/jobs/{blocker}/cancel")

    def assert_ranges(self, path):
        """The resource has a length, and its parts are those of the whole (RFC 9110, 14)."""
        whole = self.server.get(path)
        self.assertEqual(whole.status, 200, whole)
        size = len(whole.body)
        self.assertEqual(int(whole.headers["Content-Length"]), size)
        self.assertEqual(whole.headers["Accept-Ranges"], "bytes")
        head = self.server.request("HEAD", path)
        self.assertEqual((head.status, head.headers["Content-Length"], head.body),
                         (200, str(size), b""))
        etag = whole.headers["ETag"]
        for ask, first, last in (("10-19", 10, 19), (f"{size - 5}-", size - 5, size - 1),
                                 ("-7", size - 7, size - 1), (f"3-{size + 9}", 3, size - 1)):
            part = self.server.get(path, {"Range": "bytes=" + ask, "If-Range": etag})
            self.assertEqual(part.status, 206, part)
            self.assertEqual(part.headers["Content-Range"], f"bytes {first}-{last}/{size}")
            self.assertEqual(int(part.headers["Content-Length"]), last + 1 - first)
            self.assertEqual(part.body, whole.body[first:last + 1])
            self.assertEqual(part.headers["Content-Type"], whole.headers["Content-Type"])
        beyond = self.server.get(path, {"Range": f"bytes={size}-"})
        self.assert_problem(beyond, 416)
        self.assertEqual(beyond.headers["Content-Range"], f"bytes */{size}")
        other = self.server.get(path, {"Range": "bytes=0-9", "If-Range": '"another"'})
        self.assertEqual((other.status, len(other.body)), (200, size))
        self.assertEqual(self.server.get(path, {"If-None-Match": etag}).status, 304)

    def assert_problem(self, answer, status, *pointers):
        """Expects an RFC 9457 problem with exactly these pointers (if any are given)."""
        self.assertEqual(answer.status, status, answer)
        self.assertEqual(answer.headers["Content-Type"].split(";")[0], "application/problem+json")
        self.assertTrue(answer.headers["X-Request-Id"])
        problem = answer.json()
        for member in ("type", "title", "status", "detail", "instance"):
            self.assertIn(member, problem)
        self.assertEqual(problem["status"], status)
        self.assertTrue(problem["title"] and problem["detail"] and problem["instance"])
        if pointers:
            self.assertEqual(
                sorted(e["pointer"] for e in problem["errors"]), sorted(pointers), problem
            )
            for error in problem["errors"]:
                self.assertTrue(error["detail"])
        return problem

    def assert_close(self, value, expected, tolerance):
        self.assertTrue(math.isfinite(value))
        self.assertLessEqual(abs(value - expected), tolerance)


def in_background(call):
    """Runs call() in a thread; the returned function waits and returns its result or raises its
    exception."""
    box = {}

    def work():
        try:
            box["value"] = call()
        except BaseException as error:  # Passed on to the caller.
            box["error"] = error

    thread = threading.Thread(target=work, daemon=True)
    thread.start()

    def result():
        thread.join(PATIENCE_S)
        if thread.is_alive():
            raise AssertionError("still running")
        if "error" in box:
            raise box["error"]
        return box["value"]

    return result


# Small files.

def glb(document, binary=b""):
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text
    if binary:
        binary += b"\0" * (-len(binary) % 4)
        chunks += struct.pack("<I4s", len(binary), b"BIN\0") + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


TRIANGLE = struct.pack("<9f", -1, -1, 0, 1, -1, 0, 0, 1, 0)


def triangle_document(uri=None, **members):
    """One white triangle, with its positions in the buffer of a GLB or in the file `uri`."""
    buffer = {"byteLength": len(TRIANGLE)}
    if uri is not None:
        buffer["uri"] = uri
    document = {
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
        "accessors": [{"bufferView": 0, "componentType": 5126, "count": 3, "type": "VEC3",
                       "min": [-1, -1, 0], "max": [1, 1, 0]}],
        "bufferViews": [{"buffer": 0, "byteLength": len(TRIANGLE)}],
        "buffers": [buffer],
    }
    document.update(members)
    return document


def triangle_glb(**members):
    return glb(triangle_document(**members), TRIANGLE)


def png_size(data):
    """Returns width, height and colour type (2: RGB, 6: RGBA) of a PNG."""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise AssertionError("not a PNG")
    width, height, _, colour = struct.unpack(">IIBB", data[16:26])
    return width, height, colour


def png_data(data):
    """The filtered samples, without metadata: equal for equal images of one encoder."""
    place, packed = 8, b""
    while place < len(data):
        size, kind = struct.unpack(">I4s", data[place:place + 8])
        if kind == b"IDAT":
            packed += data[place + 8:place + 8 + size]
        place += 12 + size
    return zlib.decompress(packed)


def png_pixels(data):
    """Rows of 8-bit pixels: tuples of 1, 3 or 4."""
    width, height, colour = png_size(data)
    channels = {0: 1, 2: 3, 6: 4}[colour]
    raw, stride = png_data(data), width * channels
    above, rows = bytes(stride), []
    for y in range(height):
        kind, line = raw[y * (stride + 1)], bytearray(
            raw[y * (stride + 1) + 1 : (y + 1) * (stride + 1)]
        )
        for i in range(stride):
            left = line[i - channels] if i >= channels else 0
            corner = above[i - channels] if i >= channels else 0
            if kind == 1:
                line[i] = (line[i] + left) & 255
            elif kind == 2:
                line[i] = (line[i] + above[i]) & 255
            elif kind == 3:
                line[i] = (line[i] + (left + above[i]) // 2) & 255
            elif kind == 4:
                guess = left + above[i] - corner
                best = min((left, above[i], corner), key=lambda v: abs(guess - v))
                line[i] = (line[i] + best) & 255
        rows.append([tuple(line[i:i + channels]) for i in range(0, stride, channels)])
        above = bytes(line)
    return rows


def hdr_image(width, height, rgb):
    """A Radiance file of one colour with channels below 1 (each pixel stored flat)."""
    exponent = 128
    pixel = bytes([min(255, round(c * 256)) for c in rgb] + [exponent])
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
    return head + pixel * (width * height)
