"""Files crafted to use memory: the memory of the server process is measured."""

import array
import io
import json
import random
import re
import time
import unittest
import zipfile

from harness import PATIENCE_S, ApiTest, glb, in_background, job_body, triangle_document

GLB = {"Content-Type": "model/gltf-binary"}
GLTF = {"Content-Type": "model/gltf+json"}
ZIP = {"Content-Type": "application/zip"}
BYTES = {"Content-Type": "application/octet-stream"}
MB = 1 << 20


def status_bytes(server, name):
    with open(f"/proc/{server.process.pid}/status", encoding="ascii") as status:
        return int(re.search(name + r":\s+(\d+) kB", status.read()).group(1)) * 1024


def maps(server):
    """The files that the process has loaded."""
    with open(f"/proc/{server.process.pid}/maps", encoding="utf-8") as loaded:
        return loaded.read()


class Peak:
    """Peak increase of resident memory during an action, in bytes."""

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
    """A document whose `count` buffers are one file with many names, and the names."""
    uris = ["./" * i + "b.bin" for i in range(count)]
    return triangle_document(buffers=[{"byteLength": size, "uri": uri} for uri in uris]), uris


def zeros_document(count):
    """Positions without a buffer view: `count` zeros from a few bytes."""
    document = triangle_document(accessors=[{"componentType": 5126, "count": count, "type": "VEC3",
                                             "min": [0, 0, 0], "max": [0, 0, 0]}])
    del document["buffers"], document["bufferViews"]
    return json.dumps(document).encode()


def soup_glb(triangles):
    """`count` triangles, all over the unit cube."""
    chance = random.Random(1)
    positions = array.array("f", (chance.random() for _ in range(9 * triangles)))
    count = 3 * triangles
    return glb(triangle_document(
        buffers=[{"byteLength": 12 * count}], bufferViews=[{"buffer": 0, "byteLength": 12 * count}],
        accessors=[{"bufferView": 0, "componentType": 5126, "count": count, "type": "VEC3",
                    "min": [0, 0, 0], "max": [1, 1, 1]}]), positions.tobytes())


def served(call):
    """The answer, asked for again while there is no memory or, on a slow machine, no time."""
    deadline = time.monotonic() + PATIENCE_S
    answer = call()
    while answer.status == 503 and time.monotonic() < deadline:
        answer = call()
    return answer


def all_served(calls):
    """The statuses of the answers to concurrent calls."""
    return [wait().status for wait in [in_background(lambda call=call: served(call))
                                       for call in calls]]


class Uploads(ApiTest):
    def test_limits_zeros_without_a_buffer_before_they_are_allocated(self):
        with Peak(self.server) as peak:
            answer = self.server.post("/v1/scenes", zeros_document(400_000_000), GLTF)
        self.assert_problem(answer, 413)
        self.assertLess(peak.bytes, 40 * MB)

    def test_zip_entry_with_many_names_is_one_file(self):
        document, _ = many_names(60, 8 * MB)
        archive = io.BytesIO()
        with zipfile.ZipFile(archive, "w", zipfile.ZIP_DEFLATED) as files:
            files.writestr("a.gltf", json.dumps(document))
            files.writestr("b.bin", bytes(8 * MB))
        with Peak(self.server) as peak:
            answer = self.server.post("/v1/scenes", archive.getvalue(), ZIP)
        self.assertEqual(answer.status, 201, answer)
        self.assertLess(peak.bytes, 60 * MB)

    def test_asset_with_many_names_is_one_file(self):
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

    def test_job_and_the_images_of_the_page_load_no_image_library(self):
        job = self.server.render(job_body(samples=1))["id"]
        for name in ("jpg", "png", "webp"):
            self.assertEqual(self.server.get(f"/v1/jobs/{job}/image.{name}").status, 200)
        self.assertNotIn("libOpenImageIO", maps(self.server))
        self.assertEqual(self.server.get(f"/v1/jobs/{job}/image.exr").status, 200)
        self.assertIn("libOpenImageIO", maps(self.server))

    def test_does_not_echo_long_names(self):
        for uri in ("b" * 70_000, "http://" + "b" * 70_000, "data:" + "b" * 70_000):
            document = json.dumps(triangle_document(uri)).encode()
            answer = self.server.post("/v1/scenes", document, GLTF)
            self.assertIn(answer.status, (422, 424))
            self.assertLess(len(answer.body), 2000)
        long = "b" * 70_000
        for members in ({"extensionsRequired": [long]}, {"asset": {"version": long}},
                        {"asset": {"version": "2.0", "minVersion": long}}):
            document = json.dumps(triangle_document(**members)).encode()
            answer = self.server.post("/v1/scenes", document, GLTF)
            self.assert_problem(answer, 422)
            self.assertLess(len(answer.body), 2000)
        for path in ("/v1/jobs/", "/v1/assets/", "/v1/scenes/"):
            answer = self.server.get(path + "b" * 8000)
            self.assertLess(len(answer.body), 8000 + 4096 + 500)  # Once, in its path.
        document = triangle_document("b.bin")
        [primitive] = document["meshes"][0]["primitives"]
        document["images"] = [{"uri": f"{i}" * 100} for i in range(1000)]
        document["textures"] = [{"source": i} for i in range(1000)]
        document["materials"] = [{"emissiveTexture": {"index": i}} for i in range(1000)]
        document["meshes"][0]["primitives"] = [
            {**primitive, "material": i} for i in range(1000)
        ]
        answer = self.server.post("/v1/scenes", json.dumps(document).encode(), GLTF)
        self.assert_problem(answer, 424)
        self.assertLess(len(answer.json()["detail"]), 4000)
        self.assertIn("more", answer.json()["detail"])

    def test_a_primitive_without_attributes_is_left_out_or_refused(self):
        document = triangle_document("b.bin", meshes=[{"primitives": [{"attributes": {}}]}])
        body = json.dumps(document).encode()
        answer = self.server.post("/v1/scenes", body, GLTF)
        self.assertEqual(answer.status, 201, answer)
        self.assertTrue(any("/meshes/0/primitives/0" in w for w in answer.json()["warnings"]),
                        answer)
        problem = self.assert_problem(self.server.post("/v1/scenes?strict=1", body, GLTF), 422)
        self.assertIn("/meshes/0/primitives/0/attributes", problem["detail"])


def told(answer):
    """Expects a refusal that states required and available memory."""
    text = answer.body.decode()
    return answer.status in (413, 422, 503) and "--memory" in text and "MB" in text


class Gate(ApiTest):
    """256 MB: jobs and requests share what the process itself does not use."""

    FLAGS = ("--memory", "256M")
    # The allocator keeps freed memory until it reaches a sixteenth.
    MOST = 192 * MB
    # Memory of a job's threads, and freed memory that is kept.
    REST = 16 * MB

    def film(self, side, **members):
        body = job_body(**{"samples": 2, **members})
        body["film"] = {"width": side, "height": side, "layers": []}
        return body

    def test_refuses_a_body_that_never_fits_before_reading_it(self):
        head = ("POST /v1/scenes HTTP/1.1\r\nHost: localhost\r\nContent-Type: model/gltf-binary\r\n"
                "Content-Length: 1000000000\r\nConnection: close\r\n\r\n")
        with Peak(self.server) as peak:
            answer = self.server.raw(head.encode())
        self.assertTrue(answer.startswith(b"HTTP/1.1 413"), answer[:300])
        self.assertIn(b"1 GB", answer)
        self.assertLess(peak.bytes, 20 * MB)

    def test_refuses_a_body_of_unknown_length_when_it_no_longer_fits(self):
        def pieces():
            for _ in range(400):
                yield bytes(MB)

        connection = self.server.connect()
        with Peak(self.server) as peak:
            try:
                connection.request("POST", "/v1/scenes", pieces(), GLTF, encode_chunked=True)
            except OSError:
                pass  # It was refused in the meantime.
            answer = connection.getresponse()
        self.assertIn(answer.status, (413, 503))
        self.assertIn(b"--memory", answer.read())
        self.assertLess(peak.bytes, self.MOST)
        connection.close()

    def test_bodies_wait_for_each_other(self):
        with Peak(self.server) as peak:
            found = all_served(
                [lambda: self.server.post("/v1/scenes", bytes(60 * MB), GLB)] * 8
            )
        self.assertLessEqual(set(found), {400, 422}, "read, and no GLB")
        self.assertLess(peak.bytes, self.MOST)

    def test_dry_runs_at_many_times_wait_for_each_other(self):
        # A loaded scene takes 18 MB, plus 13 MB for the file while it is loaded.
        scene = self.server.post("/v1/scenes", soup_glb(120_000), GLB).json()["id"]
        bodies = [job_body(scene, time_seconds=t) for t in range(12)]
        with Peak(self.server) as peak:
            found = all_served([
                lambda body=body: self.server.post("/v1/jobs?dry_run=1", body) for body in bodies
            ])
        self.assertEqual(found, [200] * 12)
        self.assertLess(peak.bytes, self.MOST)

    def test_images_are_encoded_by_rows_and_wait_for_each_other(self):
        job = self.server.render(self.film(800))["id"]
        paths = [f"/v1/jobs/{job}/image.{name}" for name in ("exr", "png", "tif", "webp")]
        self.server.get(paths[0])  # Loads 90 MB of libraries.
        with Peak(self.server) as peak:
            found = all_served([lambda path=path: self.server.get(path) for path in paths * 4])
        self.assertEqual(found, [200] * 16)
        self.assertLess(peak.bytes, self.MOST)

    def test_too_many_photons_or_records_are_named(self):
        for integrator, pointer in (
            ({"type": "sppm", "photons": 1 << 20}, "/integrator/photons"),
            ({"type": "irradiance-cache", "records": 1 << 18}, "/integrator/records"),
        ):
            refused = self.server.post("/v1/jobs", self.film(32, integrator=integrator))
            problem = self.assert_problem(refused, 413, pointer)
            self.assertTrue(told(refused), refused)
            self.assertIn("Reduce " + pointer.split("/")[-1], problem["errors"][0]["detail"])
        few = self.film(32, samples=2, integrator={"type": "sppm", "photons": 1 << 12})
        self.assertEqual(self.server.render(few)["state"], "finished")

    def test_comparisons_wait_for_each_other(self):
        jobs = [self.server.render(self.film(400, seed=seed))["id"] for seed in (1, 2)]
        body = {"a": jobs[0], "b": jobs[1]}
        with Peak(self.server) as peak:
            found = all_served([lambda: self.server.post("/v1/comparisons", body)] * 4)
        self.assertEqual(found, [201] * 4)
        self.assertLess(peak.bytes, self.MOST)


if __name__ == "__main__":
    unittest.main()


class JobMemory(ApiTest):
    """The same without kept films, and so without the images that are encoded when a job ends."""

    FLAGS = (*Gate.FLAGS, "--film-cache", "0")
    REST = Gate.REST
    film = Gate.film

    def test_job_uses_at_most_the_memory_of_the_dry_run(self):
        body = self.film(700)
        with Peak(self.server) as peak:
            most = self.foreseen(body)
            self.server.render(body)
        self.assertGreater(most, 700 * 700 * 48 + self.REST)
        self.assertLess(peak.bytes, most)
        refused = self.server.post("/v1/jobs", self.film(1600))
        self.assert_problem(refused, 413, "/film")
        self.assertTrue(told(refused), refused)
        preview = self.server.post("/v1/jobs", self.film(1600, **{"class": "preview"}))
        render = self.server.post("/v1/render", self.film(1600), {"Accept": "image/png"})
        for answer in (preview, render):
            self.assert_problem(answer, 413)
            self.assertTrue(told(answer), answer)

    def test_environment_that_can_never_fit_is_413(self):
        width, height = 8192, 4096
        line = b"\x02\x02" + width.to_bytes(2, "big") + (b"\xff\x80" * (width // 127) +
                                                        bytes([128 + width % 127, 128])) * 4
        head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n".encode()
        sent = self.server.post("/v1/assets", head + line * height, BYTES)
        self.assertEqual(sent.status, 201, sent)
        body = self.film(32, environment={"asset": sent.json()["id"]})
        refused = self.server.post("/v1/jobs", body)
        self.assert_problem(refused, 413)
        self.assertTrue(told(refused), refused)

    def foreseen(self, body):
        answer = served(lambda: self.server.post("/v1/jobs?dry_run=1", body))
        self.assertEqual(answer.status, 200, answer)
        return answer.json()["estimate"]["memory_bytes_high"] + self.REST

    def test_integrators_use_at_most_the_memory_of_the_dry_run(self):
        photons = {"photons": 1 << 18, "max_depth": 4}
        few = {"photons": 1 << 10, "max_depth": 4}
        records = {"records": 1 << 14, "rays": 16, "tolerance": 0.05}
        for side, integrator, too_few in (
            (32, {"type": "sppm", **photons}, {"type": "sppm", **few}),
            (32, {"type": "photon-map", **photons}, {"type": "photon-map", **few}),
            (96, {"type": "irradiance-cache", **records}, None),
            (256, {"type": "bdpt"}, None),
            (256, {"type": "mlt"}, None),
        ):
            body = self.film(side, integrator=integrator)
            with self.subTest(integrator["type"]):
                self.server.kill()  # Freed memory of earlier jobs would be used again.
                self.server.start()
                most = self.foreseen(body)
                with Peak(self.server) as peak:
                    self.server.render(body)
                self.assertLess(peak.bytes, most)
                if too_few:  # The planted fault: an estimate that does not count the photons.
                    most = self.foreseen(self.film(side, integrator=too_few))
                    self.assertGreater(peak.bytes, most)
