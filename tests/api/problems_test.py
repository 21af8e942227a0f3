"""Every documented error: status, pointer and format; and the server keeps running."""

import json
import re

from harness import ApiTest, job_body

NO_JOB = "/v1/jobs/00000000-0000-4000-8000-000000000000"


class RequestProblems(ApiTest):
    FLAGS = ("--max-running", "1")

    def submit(self, **members):
        return self.server.post("/v1/jobs", {"scene": "cornell-box", **members})

    def test_broken_json_is_400(self):
        for text in ("", "{", '{"scene": }', '{"scene": "cornell-box"} x', "\xff\xfe", "[" * 100000,
                     '{"scene": "a", "scene": "b"}', '{"seed": 1e999, "scene": "cornell-box"}'):
            answer = self.server.request("POST", "/v1/jobs", text.encode("latin-1"),
                                         {"Content-Type": "application/json"})
            self.assertIn(answer.status, (400, 422), (text[:40], answer))
            self.assert_problem(answer, answer.status)
        answer = self.server.request("POST", "/v1/jobs", b"{", {"Content-Type": "application/json"})
        self.assert_problem(answer, 400)

    def test_body_that_is_not_an_object_is_422(self):
        for text in (b"[]", b"3", b'"text"', b"null"):
            answer = self.server.request(
                "POST", "/v1/jobs", text, {"Content-Type": "application/json"}
            )
            self.assert_problem(answer, 422)

    def test_wrong_values_are_422_at_their_pointer(self):
        cases = [
            ({"colour": 1}, "/colour"),
            ({"film": {"widht": 3}}, "/film/widht"),
            ({"film": {"width": 0}}, "/film/width"),
            ({"film": {"width": 16385}}, "/film/width"),
            ({"film": {"width": "wide"}}, "/film/width"),
            ({"film": {"width": 1.5}}, "/film/width"),
            ({"film": {"height": -1}}, "/film/height"),
            ({"film": {"filter": {"type": "sinc"}}}, "/film/filter/type"),
            ({"film": {"filter": {"radius": 0}}}, "/film/filter/radius"),
            ({"film": {"layers": ["colour"]}}, "/film/layers/0"),
            (
                {
                    "film": {
                        "width": 64,
                        "height": 64,
                        "crop": {"x": 60, "y": 0, "width": 5, "height": 5},
                    }
                },
                "/film/crop",
            ),
            ({"film": {"crop": {"x": 0, "y": 0, "width": 5}}}, "/film/crop/height"),
            ({"seed": -1}, "/seed"),
            ({"seed": 2**53}, "/seed"),
            ({"priority": 101}, "/priority"),
            ({"priority": -101}, "/priority"),
            ({"class": "urgent"}, "/class"),
            ({"preview_key": "a"}, "/preview_key"),
            ({"labels": {"k" * 64: "v"}}, "/labels/" + "k" * 64),
            ({"labels": {"k": "v" * 256}}, "/labels/k"),
            ({"labels": {"k": 3}}, "/labels/k"),
            ({"labels": {str(i): "" for i in range(17)}}, "/labels"),
            ({"integrator": {"type": "magic"}}, "/integrator/type"),
            ({"integrator": {"type": "ray-march"}}, "/integrator/type"),
            ({"integrator": {"max_depth": -1}}, "/integrator/max_depth"),
            ({"estimator": {"strategy": "guess"}}, "/estimator/strategy"),
            ({"estimator": {"mis": {"type": "least"}}}, "/estimator/mis/type"),
            (
                {"estimator": {"mis": {"type": "optimal"}}, "light_sampler": {"type": "ris"}},
                "/estimator/mis/type",
            ),
            ({"estimator": {"splitting": {"type": "often"}}}, "/estimator/splitting/type"),
            (
                {"estimator": {"splitting": {"type": "fixed", "count": 65}}},
                "/estimator/splitting/count",
            ),
            ({"estimator": {"roulette": {"delta": 1}}}, "/estimator/roulette/delta"),
            ({"light_sampler": {"type": "ris", "candidates": 0}}, "/light_sampler/candidates"),
            ({"light_sampler": {"type": "restir", "block": 0}}, "/light_sampler/block"),
            ({"light_sampler": {"type": "ris", "block": 2}}, "/light_sampler/block"),
            ({"light_sampler": {"type": "tree", "history": 2}}, "/light_sampler/history"),
            (
                {"light_sampler": {"type": "restir", "block": 5, "history": 3}},
                "/light_sampler/history",
            ),
            (
                {"light_sampler": {"type": "restir"}, "estimator": {"strategy": "cosine"}},
                "/light_sampler/type",
            ),
            (
                {
                    "light_sampler": {"type": "restir"},
                    "estimator": {"splitting": {"type": "measured"}},
                },
                "/estimator/splitting/type",
            ),
            (
                {
                    "light_sampler": {"type": "restir"},
                    "estimator": {"control_variate": {"type": "regression"}},
                },
                "/estimator/control_variate/type",
            ),
            (
                {"estimator": {"control_variate": {"type": "magic"}}},
                "/estimator/control_variate/type",
            ),
            ({"estimator": {"roulette": {"type": "russian"}}}, "/estimator/roulette/type"),
            ({"sampler": {"type": "dice"}}, "/sampler/type"),
            ({"sampler": {"replicates": 3}}, "/sampler/replicates"),
            ({"sampler": {"replicates": 0}}, "/sampler/replicates"),
            ({"light_sampler": {"type": "moon"}}, "/light_sampler/type"),
            ({"adaptive": {"type": "magic"}}, "/adaptive/type"),
            ({"spectral": True, "integrator": {"type": "bdpt"}}, "/spectral"),
            ({"spectral": 1}, "/spectral"),
            ({"medium": {"type": "fog"}}, "/medium/type"),
            ({"medium": {"g": 1}}, "/medium/g"),
            ({"medium": {}, "integrator": {"type": "sppm"}}, "/medium"),
            ({"film": {"layers": ["bounce:01"]}}, "/film/layers/0"),
            ({"film": {"layers": ["depth", "bounce:1"]}, "integrator": {"type": "mlt"}},
             "/film/layers/1"),
            ({"film": {"layers": ["bounce:1", "depth", "light:no such lamp"]}}, "/film/layers/2"),
            (
                {"film": {"layers": ["bounce:1"]}, "light_sampler": {"type": "restir"}},
                "/light_sampler/type",
            ),
            ({"stop": {}}, "/stop"),
            ({"stop": {"samples_per_pixel": 0}}, "/stop/samples_per_pixel"),
            ({"stop": {"samples_per_pixel": 65537}}, "/stop/samples_per_pixel"),
            ({"stop": {"relative_error": 0}}, "/stop/relative_error"),
            ({"stop": {"relative_error": 0.1, "confidence": 1}}, "/stop/confidence"),
            ({"stop": {"relative_error": 0.1, "scope": "pixel"}}, "/stop/scope"),
            ({"stop": {"seconds": -1}}, "/stop/seconds"),
            ({"stop": {"deadline": "tomorrow"}}, "/stop/deadline"),
            ({"stop": {"samples_per_pixel": 4, "minutes": 3}}, "/stop/minutes"),
            ({"camera": {"name": "nobody"}}, "/camera/name"),
            ({"camera": {"index": 99}}, "/camera/index"),
            ({"camera": {"position": [0, 0, 1]}}, "/camera/target"),
            ({"camera": {"target": [0, 0, 1]}}, "/camera/position"),
            ({"camera": {"position": [0, 0], "target": [0, 0, 0]}}, "/camera/position"),
            ({"camera": {"vertical_fov_degrees": 180}}, "/camera/vertical_fov_degrees"),
            ({"environment": {"colour": 1}}, "/environment/colour"),
            ({"environment": {"color": [1, 1]}}, "/environment/color"),
            ({"environment": {"intensity": -1}}, "/environment/intensity"),
            ({"environment": {"asset": "0" * 64}}, "/environment/asset"),
            ({"environment": {"asset": "sky.hdr"}}, "/environment/asset"),
            ({"variant": "red"}, "/variant"),
            ({"webhook": {}}, "/webhook/url"),
            ({"webhook": {"url": "ftp://example.org"}}, "/webhook/url"),
            ({"webhook": {"url": "http://user@example.org/"}}, "/webhook/url"),
            ({"webhook": {"url": "http://example.org", "events": []}}, "/webhook/events"),
            ({"webhook": {"url": "http://example.org", "events": ["tile"]}}, "/webhook/events/0"),
            ({"webhook": {"url": "http://example.org"}, "class": "preview"}, "/webhook"),
            ({"retention_seconds": -1}, "/retention_seconds"),
            ({"retention_seconds": 3, "class": "preview"}, "/retention_seconds"),
        ]
        for members, pointer in cases:
            with self.subTest(members=str(members)[:100]):
                for path in ("/v1/jobs", "/v1/jobs?dry_run=1"):
                    answer = self.server.post(path, {"scene": "cornell-box", **members})
                    self.assert_problem(answer, 422, pointer)

    def test_camera_by_name_and_index_is_422(self):
        problem = self.assert_problem(self.submit(camera={"name": "a", "index": 0}), 422)
        self.assertTrue(all(e["pointer"].startswith("/camera") for e in problem["errors"]))

    def test_reports_all_faults_at_once(self):
        answer = self.submit(film={"width": 0, "height": 0}, seed=-1, colour=3)
        self.assert_problem(answer, 422, "/film/width", "/film/height", "/seed", "/colour")

    def test_message_contains_the_value_and_the_allowed_range(self):
        problem = self.submit(film={"width": 0}).json()
        self.assertEqual(problem["errors"],
                         [{"pointer": "/film/width", "detail": "0 is outside [1, 16384]"}])

    def test_missing_scene_is_422(self):
        self.assert_problem(self.server.post("/v1/jobs", {}), 422, "/scene")

    def test_unknown_scene_is_404(self):
        for scene in ("nowhere", "0" * 64):
            for path in ("/v1/jobs", "/v1/jobs?dry_run=1"):
                self.assert_problem(self.server.post(path, {"scene": scene}), 404, "/scene")

    def test_too_large_film_is_413(self):
        self.assert_problem(self.submit(film={"width": 16384, "height": 16384}), 413)

    def test_too_large_body_is_413(self):
        self.assert_problem(self.submit(name="x" * (2 << 20)), 413)

    def test_wrong_media_type_is_415(self):
        for path in ("/v1/jobs", "/v1/scenes"):
            for kind in ("text/plain", "application/x-www-form-urlencoded", "image/png"):
                answer = self.server.request("POST", path, b"{}", {"Content-Type": kind})
                self.assert_problem(answer, 415)

    def test_wrong_method_is_405_with_allow(self):
        for method, path, allowed in (("PUT", "/v1/jobs", {"GET", "HEAD", "POST", "OPTIONS"}),
                                      ("POST", "/v1/server", {"GET", "HEAD", "OPTIONS"}),
                                      ("DELETE", "/v1/server", {"GET", "HEAD", "OPTIONS"}),
                                      ("POST", "/livez", {"GET", "HEAD", "OPTIONS"}),
                                      ("GET", NO_JOB + "/cancel", {"POST", "OPTIONS"})):
            answer = self.server.request(method, path, b"")
            self.assert_problem(answer, 405)
            named = {m.strip() for m in answer.headers["Allow"].split(",")}
            self.assertLessEqual(allowed - {"OPTIONS", "HEAD"}, named, path)
            self.assertLessEqual(named, allowed, path)
            self.assertNotIn(method, named)

    def test_unknown_paths_are_404(self):
        for path in ("/v1", "/v1/", "/v1/nothing", "/nothing", "/v1/jobs/", "/../etc/passwd",
                     "/v1/scenes/a/b/c", "/%2e%2e/%2e%2e/etc/passwd"):
            answer = self.server.get(path)
            self.assertEqual(answer.status, 404, (path, answer))
            self.assert_problem(answer, 404)

    def test_errors_of_the_http_layer_are_documented(self):
        """A maximum list of jobs, percent-encoded, exceeds the maximum length of a request line."""
        answer = self.server.get("/v1/events?jobs=" + "%F3%BE%84%B8" * 1184)
        self.assertEqual(answer.status, 414, answer)
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        document = self.server.get("/openapi.json").json()
        for path, methods in document["paths"].items():
            for method, operation in methods.items():
                for status in ("400", "408", "414", "431", "500"):
                    self.assertIn(status, operation["responses"], (method, path))
                    name = operation["responses"][status]["$ref"].rsplit("/", 1)[1]
                    self.assertIn(
                        "application/problem+json",
                        document["components"]["responses"][name]["content"],
                    )

    def test_wrong_host_is_421(self):
        for host in (
            "example.org",
            "example.org:80",
            "127.0.0.1.example.org",
            "169.254.169.254",
            "",
        ):
            answer = self.server.get("/v1/server", {"Host": host})
            self.assertIn(answer.status, (400, 421), host)
            if host:
                self.assert_problem(answer, 421)
        for host in ("localhost", "127.0.0.1", "localhost:1234", "[::1]:80"):
            self.assertEqual(self.server.get("/v1/server", {"Host": host}).status, 200, host)

    def test_foreign_origin_is_403(self):
        for origin in ("http://example.org", "null", "http://localhost:1", "file://"):
            self.assert_problem(self.server.get("/v1/server", {"Origin": origin}), 403)
        own = f"http://127.0.0.1:{self.server.port}"
        self.assertEqual(self.server.get("/v1/server", {"Origin": own}).status, 200)

    def test_refuses_unknown_query_parameters_at_their_pointer(self):
        for path, status in (
            ("/v1/server", 422),
            (NO_JOB, 422),
            ("/v1/scenes", 400),
            ("/v1/jobs", 400),
        ):
            self.assert_problem(self.server.get(path + "?colour=red"), status, "/colour")

    def test_unknown_query_parameters_get_a_documented_status_everywhere(self):
        seen = set()
        for path, methods in self.server.get("/openapi.json").json()["paths"].items():
            for method, operation in methods.items():
                with self.subTest(operation["operationId"]):
                    answer = self.server.request(
                        method.upper(), re.sub(r"\{.*?\}", "1", path) + "?colour=red"
                    )
                    self.assertIn(str(answer.status), operation["responses"], answer)
                    seen.add(answer.status)
        self.assertLessEqual({200, 400, 422}, seen)

    def test_job_without_a_sample_gets_documented_statuses_everywhere(self):
        release = self.hold()
        job = self.submit().json()
        self.assertEqual(self.server.post(f"/v1/jobs/{job['id']}/cancel").status, 200)
        release()
        self.assertEqual(self.server.job(job["id"])["progress"]["samples_per_pixel"]["max"], 0)
        parts = {"{id}": job["id"], "{.format}": ".png", "{x}": "0", "{y}": "0"}
        seen = []
        for path, methods in self.server.get("/openapi.json").json()["paths"].items():
            if path.startswith("/v1/jobs/{id}/") and "get" in methods:
                for name, value in parts.items():
                    path = path.replace(name, value)
                answer = self.server.get(path)
                self.assertIn(str(answer.status), methods["get"]["responses"], (path, answer))
                seen.append(answer.status)
        self.assertGreaterEqual(seen.count(409), 4, seen)

    def test_reports_list_parameters_out_of_range(self):
        for query in ("limit=0", "limit=201", "limit=x", "state=sleeping"):
            answer = self.server.get("/v1/jobs?" + query)
            self.assertIn(answer.status, (400, 422), (query, answer))
            self.assert_problem(answer, answer.status, "/" + query.split("=")[0])
        self.assert_problem(self.server.get("/v1/jobs?cursor=tomorrow"), 400, "/cursor")

    def test_unknown_job_is_404_everywhere(self):
        for base in (NO_JOB, "/v1/jobs/nobody"):
            for method, path, body in (
                ("GET", "", None),
                ("PATCH", "", {"priority": 1}),
                ("DELETE", "", None),
                ("POST", "/cancel", None),
                ("POST", "/extend", {"stop": {"samples_per_pixel": 9}}),
                ("GET", "/image.png", None),
                ("GET", "/pixels/0/0", None),
                ("GET", "/convergence", None),
                ("GET", "/events", None),
                ("GET", "/tiles", None),
                ("GET", "/film", None),
            ):
                self.assert_problem(self.server.request(method, base + path, body), 404)

    def test_bad_wait_is_422(self):
        for wait in ("-1", "61", "x", "nan"):
            self.assert_problem(self.server.get(f"{NO_JOB}?wait={wait}"), 422, "/wait")

    def test_broken_requests_are_harmless(self):
        host = f"Host: 127.0.0.1:{self.server.port}\r\n".encode()
        for data in (b"\r\n\r\n\r\n", b"GET\r\n\r\n", b"GET / HTTP/9.9\r\n" + host + b"\r\n",
                     b"POST /v1/jobs HTTP/1.1\r\n" + host + b"Content-Length: -1\r\n\r\n",
                     b"POST /v1/jobs HTTP/1.1\r\n" + host +
                     b"Content-Length: 3\r\nTransfer-Encoding: chunked\r\n\r\n",
                     b"GET / HTTP/1.1\r\n" + host + b"X: " + b"y" * 200000 + b"\r\n\r\n",
                     b"GET /" + b"z" * 200000 + b" HTTP/1.1\r\n" + host + b"\r\n"):
            received = self.server.raw(data)
            if received:
                status = int(received.split(b" ", 2)[1])
                self.assertTrue(400 <= status < 600, received[:100])
        self.assertEqual(self.server.get("/livez").status, 200)

    def test_problem_instance_is_the_path(self):
        problem = json.loads(self.server.get(NO_JOB).body)
        self.assertEqual(problem["instance"], NO_JOB)


class JobProblems(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.done = cls.server.render(job_body())
        cls.path = f"/v1/jobs/{cls.done['id']}"

    def test_pixel_outside_is_404(self):
        for place in ("48/0", "0/32", "-1/0", "x/0", "1.5/0", "99999999999999999999/0"):
            self.assert_problem(self.server.get(f"{self.path}/pixels/{place}"), 404)

    def test_unknown_image_format_is_406(self):
        self.assert_problem(self.server.get(f"{self.path}/image.gif"), 406)
        self.assert_problem(self.server.get(f"{self.path}/image", {"Accept": "image/gif"}), 406)
        self.assert_problem(self.server.get(f"{self.path}/image", {"Accept": "text/html;q=1"}), 406)

    def test_image_parameters_are_422_at_their_pointer(self):
        for query, pointer in (("layer=colour", "/layer"), ("exposure=31", "/exposure"),
                               ("exposure=x", "/exposure"), ("tonemap=film", "/tonemap"),
                               ("max_size=0", "/max_size"), ("colour=1", "/colour"),
                               ("revision=-1", "/revision"), ("layer=normal", "/layer")):
            self.assert_problem(self.server.get(f"{self.path}/image.png?{query}"), 422, pointer)
        self.assert_problem(
            self.server.get(f"{self.path}/image.png?x=40&y=0&width=9&height=1"), 422
        )
        self.assert_problem(self.server.get(f"{self.path}/image.png?x=0&y=0&width=9"), 422)

    def test_future_revision_is_409(self):
        self.assert_problem(self.server.get(f"{self.path}/image.png?revision=4000000000"), 409)

    def test_stop_of_a_final_job_is_409(self):
        answer = self.server.request("PATCH", self.path, {"stop": {"samples_per_pixel": 99}})
        self.assert_problem(answer, 409)

    def test_pause_of_a_final_job_is_409(self):
        self.assert_problem(self.server.request("PATCH", self.path, {"paused": True}), 409)

    def test_if_match_of_another_spec_is_412(self):
        for tag in ('"s99-r0-rendering"', '"nonsense"'):
            answer = self.server.request("PATCH", self.path, {"name": "other"}, {"If-Match": tag})
            self.assert_problem(answer, 412)
        self.assertEqual(self.server.job(self.done["id"])["spec"]["name"], "")

    def test_patch_of_an_immutable_member_is_422(self):
        for patch, pointer in (({"seed": 3}, "/seed"), ({"priority": 101}, "/priority"),
                               ({"film": {}}, "/film"), ({"paused": "yes"}, "/paused")):
            self.assert_problem(self.server.request("PATCH", self.path, patch), 422, pointer)

    def test_patch_of_another_media_type_is_415(self):
        answer = self.server.request("PATCH", self.path, b"{}", {"Content-Type": "text/plain"})
        self.assert_problem(answer, 415)

    def test_extend_to_less_is_422(self):
        answer = self.server.post(self.path + "/extend", {"stop": {"samples_per_pixel": 4}})
        self.assert_problem(answer, 422, "/stop/samples_per_pixel")
        self.assert_problem(self.server.post(self.path + "/extend", {"stop": {}}), 422, "/stop")
        self.assert_problem(self.server.post(self.path + "/extend", {}), 422, "/stop")

    def test_tiles_after_an_invalid_revision_is_422(self):
        self.assert_problem(self.server.get(self.path + "/tiles?after=x"), 422, "/after")

    def test_running_jobs_refuse_operations_on_final_jobs(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        self.server.wait_for_samples(job)
        self.assert_problem(self.server.request("DELETE", f"/v1/jobs/{job}"), 409)
        self.assert_problem(
            self.server.post(f"/v1/jobs/{job}/extend", {"stop": {"samples_per_pixel": 9}}), 409)
        self.assertEqual(self.server.post(f"/v1/jobs/{job}/cancel").status, 200)


class QueuedJobs(ApiTest):
    FLAGS = ("--max-running", "1")

    def test_queued_job_has_a_position_by_priority_and_no_image(self):
        first = self.server.submit(job_body(samples=65536, priority=1))["id"]
        self.server.wait_for_samples(first)
        jobs = [self.server.submit(job_body(samples=4))["id"] for _ in range(2)]
        self.assertEqual([self.server.job(j)["state"] for j in jobs], ["queued", "queued"])
        positions = [self.server.job(j)["queue_position"] for j in jobs]
        self.assertEqual(positions[1], positions[0] + 1)
        self.assertGreaterEqual(positions[0], 0)
        self.assertIsNone(self.server.job(first)["queue_position"])
        self.assert_problem(self.server.get(f"/v1/jobs/{jobs[0]}/image.png"), 409)
        self.assert_problem(self.server.get(f"/v1/jobs/{jobs[0]}/pixels/0/0"), 409)
        self.assertEqual(self.server.get(f"/v1/jobs/{jobs[0]}/convergence").json()["points"], [])
        self.server.request("PATCH", f"/v1/jobs/{jobs[0]}", {"priority": -5})
        self.assertLess(self.server.job(jobs[1])["queue_position"],
                        self.server.job(jobs[0])["queue_position"])
        self.server.post(f"/v1/jobs/{first}/cancel")
        for job in jobs:
            self.assertEqual(self.server.wait(job)["state"], "finished")


class FullQueue(ApiTest):
    FLAGS = ("--max-running", "1", "--max-queue", "1")

    def test_full_queue_is_429_with_retry_after(self):
        running = self.server.submit(job_body(samples=65536, priority=1))["id"]
        self.server.wait_for_samples(running)
        self.server.submit(job_body())
        answer = self.server.post("/v1/jobs", job_body())
        self.assert_problem(answer, 429)
        self.assertGreater(int(answer.headers["Retry-After"]), 0)
        self.assertIn("The queue is full: 1 job is waiting.", answer.json()["detail"])
        self.server.post(f"/v1/jobs/{running}/cancel")
