"""Assets: files named by the hash of their content."""

import hashlib
import json
import re

from harness import ApiTest, TRIANGLE, hdr_image, job_body, triangle_document

BYTES = {"Content-Type": "application/octet-stream"}


def sha(data):
    return hashlib.sha256(data).hexdigest()


class Assets(ApiTest):
    def put(self, data, name=None):
        return self.server.request("PUT", f"/v1/assets/{name or sha(data)}", data, BYTES)

    def test_post_is_201_and_then_200(self):
        data = b"any file" * 1000
        first = self.server.post("/v1/assets", data, BYTES)
        again = self.server.post("/v1/assets", data, BYTES)
        self.assertEqual((first.status, again.status), (201, 200))
        for answer in (first, again):
            self.assertEqual(answer.json(), {"id": sha(data), "bytes": len(data)})
            self.assertEqual(answer.headers["Location"], "/v1/assets/" + sha(data))

    def test_put_checks_the_hash(self):
        data = b"named by its hash"
        self.assert_problem(self.put(data, sha(b"something else")), 422)
        self.assertEqual(self.server.get("/v1/assets/" + sha(b"something else")).status, 404)
        self.assertEqual(self.server.get("/v1/assets/" + sha(data)).status, 404)
        self.assertEqual([self.put(data).status, self.put(data).status], [201, 200])

    def test_put_with_an_invalid_hash_is_422(self):
        for name in ("a", "z" * 64, sha(b"").upper()):
            self.assert_problem(self.put(b"", name), 422)

    def test_accepts_chunked_and_empty_bodies(self):
        connection = self.server.connect()
        connection.request(
            "POST", "/v1/assets", iter([b"in ", b"pieces"]), BYTES, encode_chunked=True
        )
        response = connection.getresponse()
        self.assertEqual(response.status, 201)
        self.assertIn(sha(b"in pieces"), response.read().decode())
        connection.close()
        self.assertEqual(
            self.server.post("/v1/assets", b"", BYTES).json(), {"id": sha(b""), "bytes": 0}
        )

    def test_get_head_range_and_304(self):
        data = bytes(range(256)) * 4
        path = "/v1/assets/" + self.server.post("/v1/assets", data, BYTES).json()["id"]
        whole = self.server.get(path)
        self.assertEqual((whole.status, whole.body), (200, data))
        self.assertIn("immutable", whole.headers["Cache-Control"])
        head = self.server.request("HEAD", path)
        self.assertEqual((head.status, head.body), (200, b""))
        self.assertEqual(head.headers["Content-Length"], str(len(data)))
        for span, part in (("0-9", data[:10]), ("1000-", data[1000:]), ("-24", data[-24:]),
                           ("1000-99999", data[1000:])):
            answer = self.server.get(path, {"Range": "bytes=" + span})
            self.assertEqual((answer.status, answer.body), (206, part), span)
            self.assertTrue(answer.headers["Content-Range"].endswith(f"/{len(data)}"))
        self.assertEqual(
            self.server.get(path, {"If-None-Match": whole.headers["ETag"]}).status, 304
        )
        self.assertEqual(self.server.get(path, {"Range": "lines=1-2"}).status, 200)

    def test_range_outside_the_file_is_416(self):
        path = "/v1/assets/" + self.server.post("/v1/assets", b"short", BYTES).json()["id"]
        beyond = self.server.get(path, {"Range": "bytes=2-99999999999999999999"})
        self.assertEqual((beyond.status, beyond.body), (206, b"ort"))
        answer = self.server.get(path, {"Range": "bytes=5-"})
        self.assert_problem(answer, 416)
        self.assertEqual(answer.headers["Content-Range"], "bytes */5")

    def test_delete_is_204_and_then_404(self):
        path = "/v1/assets/" + self.server.post("/v1/assets", b"to be deleted", BYTES).json()["id"]
        self.assertEqual(self.server.request("DELETE", path).status, 204)
        self.assert_problem(self.server.request("DELETE", path), 404)
        self.assert_problem(self.server.get(path), 404)
        self.assertEqual(self.server.post("/v1/assets", b"to be deleted", BYTES).status, 201)

    def test_unknown_assets_are_404(self):
        for name in ("0" * 64, "a", "..%2f..%2ftessera.db"):
            self.assert_problem(self.server.get("/v1/assets/" + name), 404)

    def test_asset_of_a_scene_cannot_be_deleted(self):
        gltf = json.dumps(triangle_document("triangle.bin")).encode()
        ids = [
            self.server.post("/v1/assets", data, BYTES).json()["id"] for data in (gltf, TRIANGLE)
        ]
        scene = self.server.post("/v1/scenes", {"gltf": ids[0], "files": {"triangle.bin": ids[1]}})
        self.assertEqual(scene.status, 201, scene)
        for asset in ids:
            self.assert_problem(self.server.request("DELETE", "/v1/assets/" + asset), 409)
        self.assertEqual(
            self.server.request("DELETE", "/v1/scenes/" + scene.json()["id"]).status, 204
        )
        for asset in ids:
            self.assertEqual(self.server.request("DELETE", "/v1/assets/" + asset).status, 204)

    def test_environment_of_a_running_job_cannot_be_deleted(self):
        asset = self.server.post("/v1/assets", hdr_image(8, 4, (0.5, 0.5, 0.5)), BYTES).json()["id"]
        job = self.server.submit(job_body(samples=65536, environment={"asset": asset}))["id"]
        self.assert_problem(self.server.request("DELETE", "/v1/assets/" + asset), 409)
        self.server.post(f"/v1/jobs/{job}/cancel")

    def test_refuses_an_asset_that_is_not_an_image_as_environment(self):
        asset = self.server.post("/v1/assets", b"no image", BYTES).json()["id"]
        answer = self.server.post("/v1/jobs", job_body(environment={"asset": asset}))
        self.assert_problem(answer, 422, "/environment/asset")

    def test_refuses_a_damaged_environment_map_when_it_is_sent(self):
        flat = hdr_image(8, 4, (0.5, 0.5, 0.5))
        head = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 8\n"
        # Each of the four channels is one run of eight equal bytes.
        line = b"\x02\x02\x00\x08" + b"\x88\x80" * 4
        for whole in (flat, head + line * 2):
            self.assertIn(self.server.post("/v1/assets", whole, BYTES).status, (200, 201))
            for broken in (whole[:-1], whole[:60], whole[:30]):
                answer = self.server.post("/v1/assets", broken, BYTES)
                self.assert_problem(answer, 422)
                self.assertIn("cut short", answer.json()["detail"])
        # A run that leaves its channel.
        longer = head + b"\x02\x02\x00\x08" + b"\x89\x80" * 4 + line
        self.assert_problem(self.server.post("/v1/assets", longer, BYTES), 422)
        self.assert_problem(self.server.post("/v1/assets", b"\x76\x2f\x31\x01\x02", BYTES), 422)

    def test_refuses_a_damaged_image_when_it_is_sent(self):
        job = self.server.render(job_body(samples=2))["id"]
        for name in ("png", "jpg", "webp", "exr", "tif"):
            answer = self.server.get(f"/v1/jobs/{job}/image.{name}")
            kind, whole = {"Content-Type": answer.headers["Content-Type"]}, answer.body
            self.assertEqual(self.server.post("/v1/assets", whole, kind).status, 201, name)
            for cut in (len(whole) // 2, len(whole) - 20):
                self.assert_problem(self.server.post("/v1/assets", whole[:cut], kind), 422)
                if name != "jpg":  # Scenes accept a JPEG that ends early.
                    self.assert_problem(self.server.post("/v1/assets", whole[:cut], BYTES), 422)

    def test_a_known_image_is_not_decoded_again(self):
        def cpu():
            text = self.server.get("/metrics").body.decode()
            return float(re.search(r"^process_cpu_seconds_total (\S+)$", text, re.MULTILINE)[1])

        # 34 million pixels of 2 MB: longer to decode than to hash.
        run = b"\xff\x80" * 64 + b"\xc0\x80"  # 64 times 127, and 64
        lines = (b"\x02\x02\x20\x00" + run * 4) * 4096
        images = [b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n# %d\n\n-Y 4096 +X 8192\n" % i + lines
                  for i in range(8)]  # The clock counts hundredths of a second.
        spent = [cpu()]
        for status in (201, 200):
            for image in images:
                answer = self.server.post("/v1/assets", image,
                                          {"Content-Type": "image/vnd.radiance"})
                self.assertEqual(answer.status, status)
            spent.append(cpu())
        first, second = spent[1] - spent[0], spent[2] - spent[1]
        self.assertGreater(first, 5 * second, spent)

    def test_content_with_an_image_type_must_be_an_image(self):
        noise = bytes(7 * i * i % 251 for i in range(500))
        self.assertEqual(self.server.post("/v1/assets", noise, BYTES).status, 201)
        for kind in ("image/vnd.radiance", "image/x-exr", "IMAGE/PNG; x=y"):
            for content in (noise, b""):
                for method, path in (("POST", ""), ("PUT", "/" + sha(content))):
                    answer = self.server.request(method, "/v1/assets" + path, content,
                                                 {"Content-Type": kind})
                    problem = self.assert_problem(answer, 422)
                    self.assertIn("not an image", problem["detail"])


class SmallUploads(ApiTest):
    FLAGS = ("--max-upload", "1000")

    def test_upload_beyond_the_limit_is_413(self):
        self.assertEqual(self.server.post("/v1/assets", b"x" * 1000, BYTES).status, 201)
        self.assert_problem(self.server.post("/v1/assets", b"x" * 1001, BYTES), 413)
        connection = self.server.connect()
        connection.request("POST", "/v1/assets", iter([b"y" * 600] * 2), BYTES, encode_chunked=True)
        self.assertEqual(connection.getresponse().status, 413)
        connection.close()
