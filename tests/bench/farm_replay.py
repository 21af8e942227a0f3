"""Workers that replay recorded results: they take units, wait as long as the recorded tiles took to
render, and deliver results with the recorded values, as large and as plausible as real ones. They
cost the coordinator the same as real workers, and this machine nothing.

Standard library only.
"""

import array
import http.client
import json
import pickle
import struct
import sys
import threading
import time

sys.path.insert(0, str(__import__("pathlib").Path(__file__).resolve().parent.parent / "api"))
import farm  # noqa: E402  (after the path is set)

# core/render/units/slice_work.h: the head of a slice, and of a pixel and replicate.
HEAD, SLICE, PIXEL = 16, struct.Struct("<4i4ii2ii8IQQd i4i2i2i3IQQdQQd"), 24
TILE, FIRST, LAST = 0, 1, 2
RECT = slice(4, 8)
SAMPLES, PIXELS, AUX, CPU, IS_NEW = 8, 12, 13, 22, 34
assert SLICE.size == 200


def slices_of(work):
    """(head, start of its arrays) of each slice, for films without splats, plans and layers other
    than the auxiliary ones."""
    count, at = struct.unpack_from("<I", work, 8)[0], HEAD
    for _ in range(count):
        head = list(SLICE.unpack_from(work, at))
        begin = at + SLICE.size
        at = begin + (0 if head[IS_NEW] else head[PIXELS] * PIXEL + head[AUX] * 32)
        yield head, begin


class Recorder(farm.Proxy):
    """Keeps the newest arrays of each tile, and the time per sample."""

    def __init__(self, server_port):
        self.tiles = {}
        super().__init__(server_port)

    def changed(self, result):
        for head, at in slices_of(result):
            end = at + head[PIXELS] * PIXEL + head[AUX] * 32
            kept = self.tiles.get(head[TILE])
            if kept is None or kept["samples"] < head[SAMPLES]:
                self.tiles[head[TILE]] = {"samples": head[SAMPLES], "arrays": result[at:end],
                                          "pixels": head[PIXELS],
                                          "seconds": head[CPU] / head[SAMPLES]}
        return result

    def save(self, path):
        with open(path, "wb") as file:
            pickle.dump(self.tiles, file)


def load(path):
    with open(path, "rb") as file:
        return pickle.load(file)


class Replay:
    """Workers of one thread each, until stop()."""

    def __init__(self, rows, tiles, workers):
        self.rows, self.tiles = rows, tiles
        self.is_over = False
        self.units, self.bytes, self.rendered_s = 0, 0, 0.0
        self.mutex = threading.Lock()
        self.threads = [threading.Thread(target=self.work, args=(f"replay-{i}",), daemon=True)
                        for i in range(workers)]
        for thread in self.threads:
            thread.start()

    def stop(self):
        self.is_over = True
        for thread in self.threads:
            thread.join()

    def work(self, name):
        hand = farm.HandWorker(self.rows, name)
        link = http.client.HTTPConnection(self.rows.server.host, self.rows.server.port)

        def ask(method, path, body, kind="application/json"):
            link.request(method, path, body, {"Content-Type": kind})
            answer = link.getresponse()
            return answer.status, answer.read()

        def report(units):
            status, text = ask("PUT", f"/v1/workers/{name}",
                               json.dumps(hand.report_body | {"units": units}))
            assert status == 200, text
            return json.loads(text)["report_seconds"]

        pause = report({})
        told = time.monotonic()
        while not self.is_over:
            unit = hand.pull()
            if unit:
                status, work = ask("POST", f"/v1/work/units/{unit}/lease",
                                   json.dumps({"worker": name}))
                if status == 200:
                    result, seconds = self.result_of(work)
                    began = time.monotonic()
                    while (left := began + seconds - time.monotonic()) > 0:
                        time.sleep(min(left, pause))
                        report({unit: time.monotonic() - began})
                    told = time.monotonic()
                    status = 503
                    while status == 503:  # Another result of the unit is being received.
                        status, text = ask("PUT", f"/v1/work/units/{unit}/results/{name}", result,
                                           "application/octet-stream")
                    if status not in (204, 404, 409):
                        raise RuntimeError(f"{status} {text}")
                    with self.mutex:
                        self.units += 1
                        self.bytes += len(result)
                        self.rendered_s += seconds
            if time.monotonic() - told > pause:
                pause = report({})
                told = time.monotonic()
        link.close()

    def result_of(self, work):
        """The outcome of a unit, and its duration."""
        parts, seconds = [bytes(work[:HEAD])], 0.0
        for head, _ in slices_of(work):
            tile = self.tiles[head[TILE]]
            took = tile["seconds"] * (head[LAST] - head[SAMPLES])
            seconds += took
            head[CPU] += took
            head[SAMPLES], head[IS_NEW] = head[LAST], 0
            values = array.array("I", tile["arrays"])
            for replicate in (0, 1):
                count = (head[LAST] + 1 - replicate) // 2
                own = array.array("I", [count]) * (tile["pixels"] // 2)
                end = tile["pixels"] * PIXEL // 4
                values[5 + 6 * replicate:end:12] = own
            # No pixel has more hits than samples.
            values[tile["pixels"] * PIXEL // 4 + 7::8] = (
                array.array("I", [head[LAST]]) * head[AUX])
            parts += [SLICE.pack(*head), values.tobytes()]
        return farm.sealed(b"".join(parts)), seconds
