"""Calls every operation of /openapi.json on a running server.

Status, media type and body of the answers must match the document, and so must the parameters.
"""

import json
import re
import uuid

import drake_test  # of tests/api
import httpx
from harness import ApiTest, EventStream, JobsStream, job_body, wait_for
from jsonschema import Draft202012Validator
from tessera_render import Problem, ServerFault
from tessera_render.errors import problem_of

# Valid values of query parameters whose schema does not define them.
VALUES = {
    "jobs": str(uuid.UUID(int=5)),
    "from": "image",
    "label": "a=b",
    "range": "auto",
    "cursor": "a",
}


def query_names(operation):
    return [each["name"] for each in operation.get("parameters", []) if each["in"] == "query"]


class Contract(ApiTest):
    FLAGS = ("--key", "k", "--webhook-private")

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server.key = "k"
        cls.document = cls.server.get("/openapi.json").json()
        cls.operations = {
            operation["operationId"]: operation
            for methods in cls.document["paths"].values()
            for operation in methods.values()
        }

    def test_each_problem_that_a_call_may_meet_has_its_exception(self):
        named = {int(status) for operation in self.operations.values()
                 for status in operation["responses"] if status >= "400"}
        plain = {
            status for status in named
            if type(problem_of(httpx.Response(status, json={"status": status})))
            in (Problem, ServerFault)
        }
        self.assertGreater(len(named), 10)
        # Of requests that this client does not make: too slow or too long, or of a range.
        self.assertEqual(plain - {500}, {408, 414, 416, 431})

    def resolved(self, node):
        while "$ref" in node:
            place = self.document
            for part in node["$ref"].removeprefix("#/").split("/"):
                place = place[part]
            node = place
        return node

    def faults(self, value, schema):
        """The pointers at which a value violates the schema, with the reason."""
        root = {"components": self.document["components"], "allOf": [schema]}
        return [
            f"{error.json_path}: {error.message}"
            for error in Draft202012Validator(root).iter_errors(value)
        ]

    def check(self, operation_id, answer):
        """Expects an answer that the operation documents."""
        responses = self.operations[operation_id]["responses"]
        self.assertIn(str(answer.status), responses, f"{operation_id}: {answer}")
        content = self.resolved(responses[str(answer.status)]).get("content", {})
        if answer.status < 400:
            self.answered.add(operation_id)
        if not content:
            self.assertEqual(answer.body, b"", operation_id)
            return answer
        media = answer.headers["Content-Type"].split(";")[0]
        self.assertIn(media, content, operation_id)
        schema = content[media]["schema"]
        if media == "application/x-ndjson":
            for line in answer.body.splitlines():
                self.assertEqual(
                    self.faults(json.loads(line), schema), [], f"{operation_id}: {line}"
                )
        elif media.endswith("json"):
            self.assertEqual(
                self.faults(json.loads(answer.body), schema),
                [],
                f"{operation_id}: {answer.body[:500]}",
            )
        else:
            self.assertEqual(schema["type"], "string", operation_id)
        return answer

    def ask(self, operation_id, method, path, body=None, headers=None):
        return self.check(operation_id, self.server.request(method, path, body, headers))

    def check_events(self, operation_id, stream):
        """Each event matches the schema of its name; the others also have `job`."""
        content = self.operations[operation_id]["responses"]["200"]["content"]
        shapes = content["text/event-stream"]["schema"]["x-events"]
        names = set()
        with stream:
            for event in stream:
                data = event.json()
                if operation_id == "watchJobs":
                    del data["job"]
                self.assertEqual(self.faults(data, shapes[event.name]), [], event)
                names.add(event.name)
        self.answered.add(operation_id)
        return names

    def test_answers_match_the_document(self):
        self.answered = set()
        for operation_id, path in (
            ("getLiveness", "/livez"),
            ("getReadiness", "/readyz"),
            ("getMetrics", "/metrics"),
            ("getOpenApi", "/openapi.json"),
            ("getDocs", "/docs"),
            ("getPage", "/"),
            ("getServer", "/v1/server"),
        ):
            self.ask(operation_id, "GET", path)
        self.ask("createSession", "POST", "/v1/session")
        self.ask("deleteSession", "DELETE", "/v1/session")
        self.files_and_scenes()
        self.jobs()
        self.laboratory()
        self.presets()
        self.keys_and_webhooks()
        self.assertEqual(
            sorted(set(self.operations) - self.answered), [], "operations without a test"
        )

    def files_and_scenes(self):
        bytes_ = {"Content-Type": "application/octet-stream"}
        asset = self.ask("createAsset", "POST", "/v1/assets", b"something", bytes_).json()
        path = f"/v1/assets/{asset['id']}"
        self.ask("putAsset", "PUT", path, b"something", bytes_)
        self.ask("getAsset", "GET", path)
        self.ask("getAsset", "GET", path, headers={"Range": "bytes=0-1"})
        self.ask("deleteAsset", "DELETE", path)
        self.ask("getAsset", "GET", path)
        glb = self.ask("getSceneGltf", "GET", "/v1/scenes/cornell-box/gltf").body
        media = {"Content-Type": "model/gltf-binary"}
        scene = self.ask("createScene", "POST", "/v1/scenes?name=box.glb", glb, media).json()
        self.ask("createScene", "POST", "/v1/scenes", glb, media)
        again = self.ask("createScene", "POST", "/v1/scenes", glb, bytes_).json()
        self.assertEqual(again["id"], scene["id"])
        self.ask("createScene", "POST", "/v1/scenes", b"{", media)
        self.ask("listScenes", "GET", "/v1/scenes?limit=1")
        self.ask("getScene", "GET", f"/v1/scenes/{scene['id']}")
        self.ask("deleteScene", "DELETE", f"/v1/scenes/{scene['id']}")

    def jobs(self):
        self.ask("createJob", "POST", "/v1/jobs?dry_run=1", job_body())
        self.ask("createJob", "POST", "/v1/jobs", {"scene": "cornell-box", "colour": 1})
        waited = {"Prefer": "wait=60"}
        environment = {
            "environment": {"color": [1, 1, 1]},
            "meter": {"points": [{"position": [0, 0.1, 0], "normal": [0, 1, 0]}]},
        }
        first = self.ask(
            "createJob", "POST", "/v1/jobs", job_body(seed=1, **environment), waited
        ).json()
        self.ask("render", "POST", "/v1/render?size=48x32&samples=4", {"scene": "cornell-box"})
        drake = drake_test.Scene()
        drake.add([(-3, -1, 0), (3, -1, 0), (0, 3, 0)], 7)
        form = {"Content-Type": "multipart/form-data; boundary=sep"}
        body = drake_test.form(drake.text(), "depth")
        self.ask("renderDrake", "POST", "/v1/drake/render", body, form)
        # Every member that depends on a choice is also in the schema of the spec.
        other = job_body(seed=2, **environment) | {
            "name": "second",
            "labels": {"a": "b"},
            "retention_seconds": 86400,
            "sampler": {"type": "sobol", "first_replicate": 0},
        }
        second = self.ask("putJob", "PUT", f"/v1/jobs/{uuid.uuid4()}", other).json()
        ids = [first["id"], second["id"]]
        for each in ids:
            self.server.wait(each)
            self.ask("getJob", "GET", f"/v1/jobs/{each}")
        self.ask("listJobs", "GET", "/v1/jobs?state=finished,failed&limit=1&class=normal")
        path = f"/v1/jobs/{ids[0]}"
        self.ask("patchJob", "PATCH", path, {"name": "first", "priority": 3})
        self.ask("patchJob", "PATCH", path, {"priority": 300})
        self.ask("retryJob", "POST", path + "/retry")  # 409: the job has not failed
        self.batches()
        self.retry_of_a_failed_job()
        self.ask("extendJob", "POST", path + "/extend", {"stop": {"samples_per_pixel": 16}})
        self.server.wait(ids[0])
        self.results(ids)
        self.assertIn("end", self.check_events("streamEvents", EventStream(self.server, ids[0])))
        self.assertIn("end", self.check_events("watchJobs", JobsStream(self.server, ids)))
        self.live_events()
        self.ask("createStreamTicket", "POST", "/v1/stream-tickets", {"jobs": ids})
        merged = self.ask("mergeFilms", "POST", "/v1/films/merge", {"films": ids}).json()
        self.ask("deleteJob", "DELETE", f"/v1/jobs/{merged['id']}")

    def batches(self):
        body = {"template": job_body(), "matrix": {"camera.orbit.theta_degrees": [0, 90]}}
        self.ask("createBatch", "POST", "/v1/batches?dry_run=1", body)
        self.ask("createBatch", "POST", "/v1/batches", body | {"matrix": {"seed": [-1]}})
        made = self.ask("createBatch", "POST", "/v1/batches", body).json()
        for job in made["jobs"]:
            self.server.wait(job["id"])
        path = "/v1/batches/" + made["id"]
        self.ask("listBatches", "GET", "/v1/batches?limit=1")
        self.ask("getBatch", "GET", path)
        self.ask("getBatchArchive", "GET", path + "/archive.zip?format=jpg")
        self.ask("getBatchSheet", "GET", path + "/sheet.png")
        self.ask("cancelBatch", "POST", path + "/cancel")
        self.ask("retryBatch", "POST", path + "/retry")  # 409: no job has failed
        self.ask("deleteBatch", "DELETE", path)

    def retry_of_a_failed_job(self):
        # `up` is parallel to the direction of view: found after loading the scene.
        above = job_body(camera={"up": [0, 1, 0], "orbit": {"phi_degrees": 0}})
        job = self.server.submit(above)["id"]
        self.assertEqual(self.server.wait(job)["state"], "failed")
        again = self.ask("retryJob", "POST", f"/v1/jobs/{job}/retry")
        self.assertEqual(again.status, 202, again)
        self.server.wait(job)
        self.server.request("DELETE", "/v1/jobs/" + job)
        batch = self.ask("createBatch", "POST", "/v1/batches",
                         {"template": above, "matrix": {"seed": [1]}}).json()
        job = batch["jobs"][0]["id"]
        self.assertEqual(self.server.wait(job)["state"], "failed")
        again = self.ask("retryBatch", "POST", f"/v1/batches/{batch['id']}/retry")
        self.assertEqual(again.status, 202, again)
        self.server.wait(job)
        self.server.request("DELETE", "/v1/jobs/" + job)

    def live_events(self):
        """Operations on a running job: progress and tiles, and its end by cancelling."""
        job = self.server.submit(job_body(samples=65536))
        stream = EventStream(self.server, job["id"])
        # Many samples, so that tiles arrive after the stream's snapshot.
        self.server.wait_for_samples(job["id"], 256)
        self.ask("cancelJob", "POST", f"/v1/jobs/{job['id']}/cancel")
        names = self.check_events("streamEvents", stream)
        self.assertLessEqual({"snapshot", "tile", "end"}, names)

    def results(self, ids):
        path = f"/v1/jobs/{ids[0]}"
        self.ask("getImage", "GET", path + "/image", headers={"Accept": "image/png"})
        for extension in self.server.get("/v1/server").json()["image_formats"]:
            self.ask("getImageInFormat", "GET", f"{path}/image.{extension}")
        self.ask("getImage", "GET", path + "/image?exposure=31")
        self.ask("getPixel", "GET", path + "/pixels/3/4")
        self.ask("getPixel", "GET", path + "/pixels/3/4000")
        self.ask("getConvergence", "GET", path + "/convergence")
        self.ask("getObjects", "GET", path + "/objects")
        self.ask("getFilm", "GET", path + "/film")
        self.ask("listWorkerTiles", "GET", path + "/workers")
        self.ask("getMeter", "GET", path + "/meter")
        self.ask("getMeterTable", "GET", path + "/meter.csv")
        self.ask("streamTiles", "GET", path + "/tiles")
        compared = self.ask(
            "createComparison", "POST", "/v1/comparisons", {"a": ids[0], "b": ids[1]}
        ).json()
        self.ask("compareMeters", "GET", f"/v1/comparisons?a={ids[0]}&b={ids[0]}")
        self.ask("getComparison", "GET", compared["links"]["self"])
        self.ask("getComparisonMap", "GET", compared["links"]["z"])

    def presets(self):
        self.ask("putPreset", "PUT", "/v1/presets/p", {
            "job": {"film": {"width": 48, "height": 32}, "stop": {"samples_per_pixel": 4}},
            "public": True})
        self.ask("putPreset", "PUT", "/v1/presets/p", {"job": {}, "public": 1})
        self.ask("getPreset", "GET", "/v1/presets/p")
        self.ask("listPresets", "GET", "/v1/presets")
        self.ask("getPicture", "GET", "/i/public/p/cornell-box/30,75.png")
        self.ask("getPicture", "GET", "/i/forged/p/cornell-box/30,75.png")
        self.ask("deletePreset", "DELETE", "/v1/presets/p")
        key = self.ask("createSigningKey", "POST", "/v1/signing-keys").json()
        self.ask("listSigningKeys", "GET", "/v1/signing-keys")
        self.ask("deleteSigningKey", "DELETE", "/v1/signing-keys/" + key["id"])

    def keys_and_webhooks(self):
        made = self.ask("createKey", "POST", "/v1/keys", {"name": "n", "tenant": "t"}).json()
        self.ask("createKey", "POST", "/v1/keys", {"name": ""})
        self.ask("listKeys", "GET", "/v1/keys")
        self.ask("getUsage", "GET", "/v1/usage")
        self.ask("listWorkers", "GET", "/v1/workers")
        report = {"build": "b", "arithmetic": "a", "units": {"u": 1.5}}
        self.ask("reportWorker", "PUT", "/v1/workers/w", report)
        self.ask("getWorkInputs", "GET", "/v1/work/jobs/j")
        self.ask("getWorkFile", "GET", "/v1/work/jobs/j/files/" + "0" * 64)
        self.ask("leaseUnit", "POST", "/v1/work/units/u/lease", {"worker": "w"})
        self.ask("handBackUnit", "POST", "/v1/work/units/u/hand-back", {"worker": "w"})
        self.ask("putUnitResult", "PUT", "/v1/work/units/u/results/w", b"")
        # This server has no queue, and reports that; tests/api/workers_test.py has one with a
        # queue.
        self.answered |= {
            "reportWorker",
            "getWorkInputs",
            "getWorkFile",
            "leaseUnit",
            "handBackUnit",
            "putUnitResult",
        }
        self.ask("startDrain", "PUT", "/v1/drain")
        self.ask("getDrain", "GET", "/v1/drain")
        self.ask("endDrain", "DELETE", "/v1/drain")
        tenant = {"Authorization": "Bearer " + made["key"]}
        wait_for(lambda: self.server.get("/v1/server", tenant).status == 200,
                 "the new key is not accepted")
        secret = "/v1/webhooks/secret"
        self.ask("getWebhookSecret", "GET", secret, headers=tenant)
        self.ask("replaceWebhookSecret", "POST", secret, headers=tenant)
        # No process listens at port 9 ("discard", RFC 863); the result of the call is irrelevant.
        body = {"url": "http://127.0.0.1:9/"}
        sent = self.ask("testWebhook", "POST", "/v1/webhooks/test", body).json()
        path = f"/v1/webhooks/deliveries/{sent['id']}"
        self.ask("getDelivery", "GET", path)
        self.ask("redeliver", "POST", path + "/redeliver")
        self.ask("listDeliveries", "GET", "/v1/webhooks/deliveries?limit=1")
        self.ask("deleteKey", "DELETE", f"/v1/keys/{made['id']}")

    def laboratory(self):
        request = {"experiment": "pi", "n": [16, 64], "replicates": 8}
        self.ask("runExperiment", "POST", "/v1/lab/runs", request)

    def test_document_is_valid_json_schema(self):
        for path, methods in self.document["paths"].items():
            for operation in methods.values():
                for each in operation.get("parameters", []):
                    with self.subTest(path=path, parameter=each["name"]):
                        Draft202012Validator.check_schema(each["schema"])

    def test_parameters_match_the_document(self):
        """Every documented parameter is accepted, and no other."""
        ids = {
            "id": str(uuid.UUID(int=4)),
            "sha256": "0" * 64,
            "x": "0",
            "y": "0",
            "format": "png",
            "map": "z.png",
            "worker": "w",
            "name": "p",
            "signature": "public",
            "preset": "p",
            "scene": "cornell-box",
            "view": "0,90.png",
        }
        for path, methods in self.document["paths"].items():
            place = re.sub(r"\{(\w+)\}", lambda match: ids[match[1]], path)
            for method, operation in methods.items():
                if operation.get("security") == []:
                    continue  # Pages and probes ignore a query.
                for name in [*query_names(operation), "nonsense"]:
                    with self.subTest(operation=operation["operationId"], parameter=name):
                        target = f"{place}?{name}={VALUES.get(name, '1')}"
                        self.assertEqual(self.told_unknown(method, target), name == "nonsense")

    def told_unknown(self, method, path):
        media = {"Content-Type": "application/json"}
        answer = self.server.request(
            method.upper(), path, b"{}" if method in ("post", "put", "patch") else None, media
        )
        return b"unknown query parameter" in answer.body

    def test_objects_are_closed(self):
        """Otherwise the schema would not have to list every member of an answer."""
        open_ones = []

        def walk(node, place):
            if isinstance(node, dict):
                if (
                    isinstance(node.get("properties"), dict)
                    and node.get("additionalProperties") is not False
                ):
                    open_ones.append(place)
                for key, inner in node.items():
                    walk(inner, f"{place}/{key}")
            elif isinstance(node, list):
                for i, inner in enumerate(node):
                    walk(inner, f"{place}/{i}")

        walk(self.document["components"]["schemas"], "")
        self.assertEqual(open_ones, [])

    def test_detects_an_extra_or_missing_member(self):
        asset = {"$ref": "#/components/schemas/Asset"}
        self.assertEqual(self.faults({"id": "a", "bytes": 1}, asset), [])
        self.assertEqual(len(self.faults({"id": "a", "bytes": 1, "more": 2}, asset)), 1)
        self.assertEqual(len(self.faults({"id": "a"}, asset)), 1)
