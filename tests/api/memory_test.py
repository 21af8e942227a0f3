"""Files that are made to take memory: the process is measured beside them."""

import io
import json
import re
import unittest
import zipfile

from harness import ApiTest, job_body, triangle_document

GLTF = {"Content-Type": "model/gltf+json"}
ZIP = {"Content-Type": "application/zip"}
BYTES = {"Content-Type": "application/octet-stream"}
MB = 1 << 20


def status_bytes(server, name):
    with open(f"/proc/{server.process.pid}/status", encoding="ascii") as status:
        return int(re.search(name + r":\s+(\d+) kB", status.read()).group(1)) * 1024


class Peak:
    """How far resident memory rises while something is done, in bytes."""

    def __init__(self, server):
        self.server = server

    def __enter__(self):
        with open(f"/proc/{self.server.process.pid}/clear_refs", "w", encoding="ascii") as clear:
            clear.write("5")
        self.before = status_bytes(self.server, "VmRSS")
        return self

    def __exit__(self, *_):
        self.bytes = status_bytes(self.server, "VmHWM") - self.before


def many_names(count, size):
    """A document whose `count` buffers are one file under many names, and the names."""
    uris = ["./" * i + "b.bin" for i in range(count)]
    return triangle_document(buffers=[{"byteLength": size, "uri": uri} for uri in uris]), uris


def zeros_document(count):
    """Positions without a buffer view: so many zeros from a few bytes."""
    document = triangle_document(accessors=[{"componentType": 5126, "count": count, "type": "VEC3",
                                             "min": [0, 0, 0], "max": [0, 0, 0]}])
    del document["buffers"], document["bufferViews"]
    return json.dumps(document).encode()


class Uploads(ApiTest):
    def test_zeros_without_a_buffer_are_bounded_before_they_are_made(self):
        with Peak(self.server) as peak:
            answer = self.server.post("/v1/scenes", zeros_document(400_000_000), GLTF)
        self.assert_problem(answer, 413)
        self.assertLess(peak.bytes, 40 * MB)

    def test_an_entry_of_a_zip_under_many_names_is_one_file(self):
        document, _ = many_names(60, 8 * MB)
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as files:
            files.writestr("a.gltf", json.dumps(document))
            files.writestr("b.bin", bytes(8 * MB))
        with Peak(self.server) as peak:
            answer = self.server.post("/v1/scenes", archive.getvalue(), ZIP)
        self.assertEqual(answer.status, 201, answer)
        self.assertLess(peak.bytes, 60 * MB)

    def test_an_asset_under_many_names_is_one_file(self):
        document, uris = many_names(200, 4 * MB)
        gltf = self.server.post("/v1/assets", json.dumps(document).encode(), BYTES).json()["id"]
        buffer = self.server.post("/v1/assets", bytes(4 * MB), BYTES).json()["id"]
        with Peak(self.server) as peak:
            answer = self.server.post("/v1/scenes",
                                      {"gltf": gltf, "files": {uri: buffer for uri in uris}})
        self.assertEqual(answer.status, 201, answer)
        self.assertLess(peak.bytes, 60 * MB)
        with Peak(self.server) as peak:
            job = self.server.render(job_body(answer.json()["id"], samples=1, time_seconds=1))
        self.assertEqual(job["state"], "finished")
        self.assertLess(peak.bytes, 60 * MB)

    def test_long_names_are_not_echoed(self):
        for uri in ("b" * 70_000, "http://" + "b" * 70_000, "data:" + "b" * 70_000):
            document = json.dumps(triangle_document(uri)).encode()
            answer = self.server.post("/v1/scenes", document, GLTF)
            self.assertIn(answer.status, (422, 424))
            self.assertLess(len(answer.body), 2000)
        buffers = [{"byteLength": 36, "uri": f"{i}" * 100} for i in range(1000)]
        document = triangle_document(buffers=buffers)
        answer = self.server.post("/v1/scenes", json.dumps(document).encode(), GLTF)
        self.assert_problem(answer, 424)
        self.assertLess(len(answer.body), 8000)
        self.assertIn("more", answer.json()["detail"])

    def test_a_primitive_without_attributes_is_refused(self):
        document = triangle_document("b.bin", meshes=[{"primitives": [{"attributes": {}}]}])
        answer = self.server.post("/v1/scenes", json.dumps(document).encode(), GLTF)
        problem = self.assert_problem(answer, 422)
        self.assertIn("/meshes/0/primitives/0/attributes", problem["detail"])


if __name__ == "__main__":
    unittest.main()
