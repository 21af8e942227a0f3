"""Probes, the server's description, documents and the page."""

import json
import subprocess
import tempfile

from harness import BINARY, PATIENCE_S, ApiTest


class Service(ApiTest):
    def test_port_in_use_is_reported_with_a_remedy(self):
        with tempfile.TemporaryDirectory() as data:
            done = subprocess.run(
                [BINARY, "serve", "--port", str(self.server.port), "--data", data],
                capture_output=True, text=True, timeout=PATIENCE_S, check=False)
        self.assertEqual(done.returncode, 1)
        self.assertIn("another program uses this port", done.stderr)
        self.assertIn("--port 0", done.stderr)

    def test_probes_answer_in_text(self):
        for path in ("/livez", "/readyz", "/metrics"):
            answer = self.server.get(path)
            self.assertEqual(answer.status, 200, path)
            self.assertTrue(answer.headers["Content-Type"].startswith("text/plain"))
            self.assertTrue(answer.headers["X-Request-Id"])

    def test_probes_answer_under_any_host_name(self):
        self.assertEqual(self.server.get("/livez", {"Host": "10.0.0.1"}).status, 200)

    def test_every_metric_has_its_type(self):
        text = self.server.get("/metrics").body.decode()
        typed = {line.split()[2] for line in text.splitlines() if line.startswith("# TYPE ")}
        for line in text.splitlines():
            if line and not line.startswith("#"):
                name = line.split("{")[0].split(" ")[0]
                roots = {name, *(name.removesuffix(s) for s in ("_bucket", "_sum", "_count"))}
                self.assertTrue(roots & typed, line)
                float(line.rsplit(" ", 1)[1])

    def test_server_describes_its_capabilities(self):
        about = self.server.get("/v1/server").json()
        for member in ("version", "build", "limits", "integrators", "samplers", "light_samplers",
                       "adaptive", "options", "layers", "image_formats", "tone_maps", "filters",
                       "scenes", "experiments", "extensions"):
            self.assertIn(member, about)
        self.assertEqual(set(about["build"]), {"id", "commit", "compiler", "isa", "embree",
                                               "waves"})
        self.assertIn("path", [i["type"] for i in about["integrators"]])
        self.assertLessEqual({"KHR_materials_volume", "EXT_mesh_gpu_instancing"},
                             set(about["extensions"]))
        self.assertEqual(set(about["image_formats"]),
                         {"png", "jpg", "webp", "avif", "exr", "hdr", "tif"})
        self.assertEqual(set(about["filters"]),
                         {"box", "tent", "gaussian", "mitchell", "blackman-harris"})
        self.assertLessEqual({"srgb", "linear", "aces", "agx", "khronos-neutral"},
                             set(about["tone_maps"]))
        for name in ("cornell-box", "furnace", "veach-mis", "many-lights", "glass", "interior",
                     "keyhole", "caustic-pool", "still-life"):
            self.assertIn(name, [s["name"] for s in about["scenes"]])
        for entry in about["integrators"] + about["samplers"] + about["light_samplers"]:
            self.assertIn(entry["bias"], ("none", "consistent", "biased"))
            self.assertTrue(entry["summary"])
            self.assertIsInstance(entry["accepts"], list)

    def test_every_option_is_a_patch_that_a_job_accepts(self):
        for option in self.server.get("/v1/server").json()["options"]:
            body = {"scene": "cornell-box", **strip_nulls(option["patch"])}
            answer = self.server.post("/v1/jobs?dry_run=1", body)
            self.assertEqual(answer.status, 200, (option, answer))

    def test_openapi_lists_every_documented_path(self):
        answer = self.server.get("/openapi.json")
        self.assertEqual(answer.headers["Content-Type"].split(";")[0], "application/json")
        document = answer.json()
        self.assertTrue(document["openapi"].startswith("3.1"))
        paths = document["paths"]
        for path, method in (("/livez", "get"), ("/v1/server", "get"), ("/v1/assets", "post"),
                             ("/v1/assets/{sha256}", "put"), ("/v1/scenes", "post"),
                             ("/v1/scenes/{id}", "delete"), ("/v1/jobs", "post"),
                             ("/v1/jobs/{id}", "patch"), ("/v1/jobs/{id}/cancel", "post"),
                             ("/v1/jobs/{id}/extend", "post"), ("/v1/jobs/{id}/convergence", "get"),
                             ("/v1/jobs/{id}/events", "get"), ("/v1/jobs/{id}/tiles", "get"),
                             ("/v1/jobs/{id}/pixels/{x}/{y}", "get")):
            self.assertIn(method, paths[path], path)

    def test_openapi_references_resolve(self):
        document = self.server.get("/openapi.json").json()

        def walk(value):
            if isinstance(value, dict):
                if "$ref" in value:
                    place = document
                    for part in value["$ref"].removeprefix("#/").split("/"):
                        place = place[part]
                for member in value.values():
                    walk(member)
            elif isinstance(value, list):
                for member in value:
                    walk(member)

        walk(document)

    def test_documents_and_page_answer_304_to_their_etag(self):
        for path in ("/", "/docs", "/openapi.json"):
            first = self.server.get(path)
            self.assertEqual(first.status, 200, path)
            again = self.server.get(path, {"If-None-Match": first.headers["ETag"]})
            self.assertEqual((again.status, again.body), (304, b""), path)
            other = self.server.get(path, {"If-None-Match": '"other"'})
            self.assertEqual(other.status, 200, path)

    def test_page_and_docs_load_nothing_from_other_hosts(self):
        for path in ("/", "/docs"):
            answer = self.server.get(path)
            self.assertTrue(answer.headers["Content-Type"].startswith("text/html"))
            for attribute in (
                b'src="http',
                b'href="http://',
                b'src="//',
                b'rel="stylesheet" href="http',
            ):
                self.assertNotIn(attribute, answer.body, path)

    def test_request_id_is_returned_and_accepted(self):
        one = self.server.get("/v1/server").headers["X-Request-Id"]
        two = self.server.get("/v1/server").headers["X-Request-Id"]
        self.assertTrue(one)
        self.assertNotEqual(one, two)

    def test_head_is_get_without_the_body(self):
        answer = self.server.request("HEAD", "/v1/server")
        self.assertEqual((answer.status, answer.body), (200, b""))

    def test_json_is_utf_8(self):
        job = self.server.post("/v1/jobs?dry_run=1", {"scene": "cornell-box", "name": "Möbel 🪑"})
        self.assertEqual(json.loads(job.body.decode("utf-8"))["spec"]["name"], "Möbel 🪑")


def strip_nulls(patch):
    """A merge patch that removes all members of a body."""
    return {
        k: strip_nulls(v) if isinstance(v, dict) else v for k, v in patch.items() if v is not None
    }
