"""Images that contain their job, and rendering it again from them."""

import json
import struct
import zlib

from harness import ApiTest, job_body

TYPES = {"png": "image/png", "exr": "image/x-exr"}


def png_texts(data):
    texts, at = {}, 8
    while at < len(data):
        size, kind = struct.unpack_from(">I4s", data, at)
        if kind == b"tEXt":
            name, _, value = data[at + 8:at + 8 + size].partition(b"\0")
            texts[name.decode()] = value.decode()
        at += size + 12
    return texts


def png_with(texts):
    def chunk(kind, body):
        return (
            struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))
        )
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", 1, 1, 8, 0, 0, 0, 0)) +
            b"".join(chunk(b"tEXt", k.encode() + b"\0" + v.encode()) for k, v in texts.items()) +
            chunk(b"IDAT", zlib.compress(b"\0\0")) + chunk(b"IEND", b""))


class Origin(ApiTest):
    def picture(self, job, kind="png"):
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.{kind}")
        self.assertEqual(answer.status, 200)
        return answer.body

    def post(self, picture, kind="png", path="/v1/jobs?from=image", **headers):
        headers = {
            "Content-Type": TYPES[kind],
            **{k.replace("_", "-"): v for k, v in headers.items()},
        }
        return self.server.request("POST", path, picture, headers)

    def again(self, picture, kind="png"):
        answer = self.post(picture, kind)
        self.assertEqual(answer.status, 201, answer)
        return self.server.wait(answer.json()["id"])

    def test_image_contains_its_job(self):
        job = self.server.render(job_body(seed=7, samples=16))
        texts = png_texts(self.picture(job))
        self.assertEqual(json.loads(texts["tessera:spec"]), job["spec"])
        self.assertEqual(texts["tessera:seed"], "7")
        self.assertEqual(texts["tessera:scene"], "cornell-box")
        self.assertEqual(texts["tessera:film_digest"], job["film_digest"])
        self.assertEqual(texts["tessera:stop_reason"], "samples_per_pixel")
        self.assertEqual(float(texts["tessera:error"]), job["error"]["relative"])
        self.assertEqual([float(x) for x in texts["tessera:error_interval"].split()],
                         [job["error"]["low"], job["error"]["high"]])
        build = json.loads(texts["tessera:build"])
        self.assertEqual(build["id"], self.server.get("/v1/server").json()["build"]["id"])
        self.assertEqual(build["arithmetic"], texts["tessera:arithmetic"])

    def test_image_reproduces_its_film(self):
        film = {"width": 48, "height": 32, "layers": []}
        for body in (
            job_body(
                seed=2**53 - 1,
                samples=16,
                film=dict(film, layers=["depth"]),
                name="ä \"b\"",
                camera={"vertical_fov_degrees": 31},
            ),
            job_body(scene="furnace", samples=24, sampler={"type": "halton", "replicates": 4}),
            job_body(samples=1),
            dict(job_body(), stop={"relative_error": 0.15}),
            dict(job_body(), stop={"seconds": 0.3}),
            dict(
                job_body(adaptive={"type": "pilot", "min_samples": 16}),
                stop={"relative_error": 0.06},
            ),
            job_body(adaptive={"type": "pilot", "min_samples": 16}, samples=128),
        ):
            job = self.server.render(body)
            for kind in TYPES:
                other = self.again(self.picture(job, kind), kind)
                self.assertNotEqual(other["id"], job["id"])
                self.assertEqual(other["film_digest"], job["film_digest"], body)
                self.assertEqual(other["spec"]["name"], job["spec"]["name"])
                self.assertEqual([w for w in other["warnings"] if "image" in w], [])

    def test_another_layer_or_a_part_reproduces_the_whole(self):
        job = self.server.render(job_body(samples=8))
        for query in ("layer=variance", "x=3&y=3&width=9&height=9", "max_size=16", "exposure=3"):
            picture = self.server.get(f"/v1/jobs/{job['id']}/image.png?{query}").body
            self.assertEqual(self.again(picture)["film_digest"], job["film_digest"], query)

    def test_image_of_a_running_job_reproduces_the_whole_job(self):
        job = self.server.submit(dict(job_body(), stop={"samples_per_pixel": 65536}))
        self.server.wait_for_samples(job["id"])
        answer = self.post(self.picture(job))
        self.server.post(f"/v1/jobs/{job['id']}/cancel")
        self.assertEqual(answer.status, 201, answer)
        self.assertEqual(answer.json()["spec"]["stop"], job["spec"]["stop"])
        self.assertIn("before its job had ended", " ".join(answer.json()["warnings"]))

    def test_image_contains_no_private_data(self):
        hook = {"url": "https://example.com/secret-path", "events": ["end"]}
        job = self.server.submit(job_body(webhook=hook, retention_seconds=600))
        self.server.wait(job["id"])
        picture = self.picture(job)
        self.assertNotIn(b"secret-path", picture)
        again = self.again(picture)
        self.assertNotIn("webhook", {k for k, v in again["spec"].items() if v is not None})
        self.assertIsNone(again["spec"].get("retention_seconds"))

    def test_refuses_images_without_a_job(self):
        job = self.server.render(job_body())
        good = self.picture(job)
        texts = png_texts(good)
        merged = self.server.post("/v1/films/merge", {"films": [
            job["id"], self.server.render(job_body(seed=1))["id"]]}).json()
        bad = [
            (b"", 422),
            (b"x", 422),
            (good[:40], 422),
            (png_with({}), 422),
            (self.picture(merged), 422),
            (png_with({**texts, "tessera:spec": "{"}), 400),
            (png_with({**texts, "tessera:samples_per_pixel": "1e9"}), 422),
            (png_with({**texts, "tessera:samples_per_pixel": "nan"}), 422),
            (png_with({**texts, "tessera:spec": '{"scene": "no-such-scene"}'}), 404),
            (png_with({**texts, "tessera:spec": '{"scene": "cornell-box", "colour": 1}'}), 422),
        ]
        for picture, status in bad:
            self.assert_problem(self.post(picture), status)
        exr = self.picture(job, "exr")
        for end in (3, 9, 60, 300):
            self.assert_problem(self.post(exr[:end], "exr"), 422)
        for path in ("/v1/jobs", "/v1/jobs?from=image&x=1", "/v1/jobs?from=film"):
            self.assertIn(self.post(good, path=path).status, (415, 422), path)
        answer = self.server.post("/v1/jobs?from=image", job_body())
        self.assert_problem(answer, 415)
        other = self.post(png_with({**texts, "tessera:arithmetic": "abacus"}))
        self.assertIn("abacus", " ".join(other.json()["warnings"]))

    def test_keys_dry_runs_and_waits_work_as_with_json(self):
        picture = self.picture(self.server.render(job_body()))
        first = self.post(picture, Idempotency_Key="k").json()
        self.assertEqual(self.post(picture, Idempotency_Key="k").json()["id"], first["id"])
        changed = png_with({**png_texts(picture), "tessera:job": "other"})
        self.assert_problem(self.post(changed, Idempotency_Key="k"), 409)
        self.assertEqual(self.post(picture, path="/v1/jobs?from=image&dry_run=1").status, 200)
        done = self.post(picture, Prefer="wait=60")
        self.assertEqual((done.status, done.json()["state"]), (201, "finished"))
