"""Tenants: objects of one key are invisible to another, on every route and inside every request."""

import hashlib
import json
import os
import unittest
import uuid

from harness import (ApiTest, EventStream, Server, hdr_image, job_body, tessera, triangle_glb,
                     wait_for)

OPERATOR = "operators-own"
BYTES = {"Content-Type": "application/octet-stream"}
GLB = {"Content-Type": "model/gltf-binary"}
LONG = 65536
READY_PRESETS = {"hero", "packshot", "thumbnail", "turntable"}


def add_key(server, name, *flags):
    code, key, said = tessera("keys", "add", name, "--data", server.data, *flags)
    if code != 0:
        raise AssertionError(said)
    return key.strip()


METER = {"points": [{"position": [0, 0, 1], "normal": [0, 0, 1]}]}


class Tenants(unittest.TestCase):
    FLAGS = ()

    @classmethod
    def setUpClass(cls):
        cls.server = Server("--key", OPERATOR, *cls.FLAGS, key=OPERATOR)
        cls.addClassCleanup(cls.server.close)
        cls.ours = add_key(cls.server, "ours", "--tenant", "ours")
        cls.theirs = add_key(cls.server, "theirs")
        cls.server.start()

    def ask(self, key, method, path, body=None, headers=None):
        return self.server.request(
            method, path, body, {"Authorization": "Bearer " + key, **(headers or {})}
        )

    def made(self, key, method, path, body=None, headers=None):
        answer = self.ask(key, method, path, body, headers)
        self.assertEqual(answer.status, 201, answer)
        return answer.json()["id"]

    def rendered(self, key, **members):
        job = self.made(key, "POST", "/v1/jobs", job_body(**members))
        self.server.wait(job)
        return job

    def ids(self, key, path, name):
        answer = self.ask(key, "GET", path)
        self.assertEqual(answer.status, 200, answer)
        # Presets have names; the ready ones are everybody's.
        return [item.get("id", item.get("name")) for item in answer.json()[name]
                if item.get("name") not in READY_PRESETS]


class EveryRoute(Tenants):
    """Calls each operation of the API description as another tenant, with the objects of our
    tenant."""

    # Routes without objects of tenants.
    OF_NOBODY = {
        "getLiveness",
        "getReadiness",
        "getMetrics",
        "getOpenApi",
        "getDocs",
        "getPage",
        "getServer",
        "runExperiment",
        "createAsset",
        "getSceneGltf",
        "testWebhook",
        "getWebhookSecret",
        "replaceWebhookSecret",
        "getUsage",
        "listWorkers",
        "createSession",
        "deleteSession",
        "putPreset",  # of one's own name
        "createSigningKey",
        "getPicture",  # the signature is the key: tests/api/presets_test.py
        "renderDrake",  # the scene is in the request
    }
    # Routes of the scopes `admin` and `worker`: 403 for both.
    OF_ADMINS = {"listKeys", "createKey", "deleteKey", "getDrain", "startDrain", "endDrain",
                 "reportWorker", "getWorkInputs", "getWorkFile", "leaseUnit", "putUnitResult",
                 "handBackUnit"}
    # Routes that list: the other tenant gets its own list, which is empty.
    LISTS = {"listJobs": "jobs", "listScenes": "scenes", "listDeliveries": "deliveries",
             "listBatches": "batches", "listPresets": "presets", "listSigningKeys": "keys"}
    # References inside requests: the body, and the status for an unknown id there.
    BODIES = {
        "createJob": (lambda our: job_body(scene=our["scene"]), 404),
        "render": (lambda our: {"scene": our["scene"]}, 404),
        "createBatch": (lambda our: {"template": job_body(scene=our["scene"]),
                                     "matrix": {"seed": [1]}}, 404),
        "createScene": (lambda our: {"gltf": our["sha256"], "files": {}}, 422),
        "mergeFilms": (lambda our: {"films": [our["job"], our["other"]]}, 404),
        "createComparison": (lambda our: {"a": our["job"], "b": our["job"]}, 404),
        "createStreamTicket": (lambda our: {"jobs": [our["job"]]}, 404),
    }
    QUERIES = {"watchJobs": lambda our: f"?jobs={our['job']}",
               "compareMeters": lambda our: f"?a={our['job']}&b={our['other']}"}
    # Bodies for routes whose path contains the id.
    CHANGES = {"patchJob": {"name": "mine now"}, "extendJob": {"stop": {"samples_per_pixel": 16}},
               "putJob": job_body(), "putAsset": b"not these bytes"}
    # Their own upload under this hash has other bytes: 422 reveals nothing of ours.
    STATUS = {"putAsset": 422}

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.document = cls.server.get("/openapi.json").json()

    def setUp(self):
        asset = self.made(self.ours, "POST", "/v1/assets", hdr_image(4, 2, (0.5, 0.5, 0.5)), BYTES)
        self.our = {
            "sha256": asset,
            "scene": self.made(self.ours, "POST", "/v1/scenes", triangle_glb(), GLB),
            "job": self.rendered(self.ours, meter=METER),
            "x": "1",
            "y": "1",
            "format": "png",
            "map": "z.png",
            "worker": "w",
            "name": "preset-of-ours",
        }
        self.ask(self.ours, "PUT", "/v1/presets/preset-of-ours", {"job": {}})
        self.our["signing_key"] = self.made(self.ours, "POST", "/v1/signing-keys")
        other = self.rendered(self.ours, seed=2, meter=METER)
        self.our["other"] = other
        self.our["comparison"] = self.made(self.ours, "POST", "/v1/comparisons",
                                           {"a": self.our["job"], "b": other})
        self.our["batch"] = self.made(self.ours, "POST", "/v1/batches",
                                      {"template": job_body(), "matrix": {"seed": [5]}})
        receiver = "http://receiver.invalid/"
        self.rendered(self.ours, webhook={"url": receiver})
        self.our["delivery"] = self.ids(self.ours, "/v1/webhooks/deliveries", "deliveries")[0]
        self.nobodys = {
            **self.our,
            "delivery": "msg_" + "0" * 24,
            "sha256": "0" * 64,
            "scene": "1" * 64,
            "name": "preset-of-nobody",
            "signing_key": str(uuid.uuid4()),
            "job": str(uuid.uuid4()),
            "other": str(uuid.uuid4()),
            "comparison": str(uuid.uuid4()),
            "batch": str(uuid.uuid4()),
        }

    def tearDown(self):
        for job in self.ids(self.ours, "/v1/jobs", "jobs"):
            self.ask(self.ours, "DELETE", f"/v1/jobs/{job}")
        self.ask(self.ours, "DELETE", "/v1/scenes/" + self.our["scene"])
        self.ask(self.ours, "DELETE", "/v1/assets/" + self.our["sha256"])
        self.ask(self.ours, "DELETE", "/v1/signing-keys/" + self.our["signing_key"])

    def operations(self):
        for path, methods in self.document["paths"].items():
            for method, operation in methods.items():
                yield operation["operationId"], method.upper(), path

    @staticmethod
    def filled(path, ids):
        """The segment before `{id}` determines its kind."""
        kinds = {
            "jobs": "job",
            "scenes": "scene",
            "comparisons": "comparison",
            "deliveries": "delivery",
            "batches": "batch",
            "keys": "job",
            "signing-keys": "signing_key",
            "workers": "job",
            "units": "job",
        }
        parts = []
        for part in path.split("/"):
            if part == "{id}":
                part = ids[kinds[parts[-1]]]
            for name, value in ids.items():
                part = part.replace("{" + name + "}", value)
            parts.append(part)
        return "/".join(parts)

    def request(self, key, operation, method, path, ids):
        body = self.CHANGES.get(operation)
        if operation in self.BODIES:
            body = self.BODIES[operation][0](ids)
        query = self.QUERIES.get(operation, lambda _: "")(ids)
        return self.ask(
            key,
            method,
            self.filled(path, ids) + query,
            body,
            BYTES if body.__class__ is bytes else None,
        )

    def test_other_tenant_finds_nothing_of_ours(self):
        walked = 0
        for operation, method, path in self.operations():
            with self.subTest(operation):
                if operation in self.OF_NOBODY:
                    continue
                if operation in self.OF_ADMINS:
                    self.assertEqual(
                        self.request(self.theirs, operation, method, path, self.our).status, 403
                    )
                    continue
                if operation in self.LISTS:
                    self.assertNotEqual(self.ids(self.ours, path, self.LISTS[operation]), [])
                    self.assertEqual(self.ids(self.theirs, path, self.LISTS[operation]), [])
                    walked += 1
                    continue
                names_ours = "{" in path or operation in self.BODIES or operation in self.QUERIES
                self.assertTrue(names_ours, f"{operation} is missing from the tables of this test")
                wanted = self.BODIES.get(operation, (None, self.STATUS.get(operation, 404)))[1]
                answer = self.request(self.theirs, operation, method, path, self.our)
                self.assertEqual(answer.status, wanted, answer)
                # The answer also equals that for a nonexistent object; putJob would use the free
                # id.
                if operation != "putJob":
                    nothing = self.request(self.theirs, operation, method, path, self.nobodys)
                    self.assertEqual(nothing.status, wanted, nothing)
                    self.assertEqual(self.told(answer, self.our), self.told(nothing, self.nobodys))
                walked += 1
        self.assertGreater(walked, 20)

    @staticmethod
    def told(answer, ids):
        text = answer.body.decode()
        for name, value in ids.items():
            text = text.replace(value, name) if len(value) > 5 else text
        problem = json.loads(text)
        return problem["detail"].split(": ")[0], [
            error["pointer"] for error in problem.get("errors", [])
        ]

    def test_we_and_the_operator_find_it_on_the_same_routes(self):
        for key in (self.ours, OPERATOR):
            for operation, method, path in self.operations():
                # Deleted objects cannot be requested twice; an extended film is temporarily absent.
                if (operation in self.OF_NOBODY | self.OF_ADMINS or method == "DELETE" or
                        operation in ("extendJob", "putAsset")):
                    continue
                with self.subTest(operation, key=key):
                    answer = self.request(key, operation, method, path, self.our)
                    self.assertNotIn(answer.status, (401, 403, 404), answer)
        for job in self.ids(self.ours, "/v1/jobs", "jobs"):
            self.server.post(f"/v1/jobs/{job}/cancel")


class InsideRequests(Tenants):
    def test_our_environment_is_unknown_to_them(self):
        asset = self.made(self.ours, "POST", "/v1/assets", hdr_image(8, 4, (0.5, 0.5, 0.5)), BYTES)
        body = job_body(environment={"asset": asset})
        for query in ("", "?dry_run=1"):
            answer = self.ask(self.theirs, "POST", "/v1/jobs" + query, body)
            self.assertEqual(answer.status, 422, answer)
            self.assertEqual(
                [e["pointer"] for e in answer.json()["errors"]], ["/environment/asset"]
            )
        self.assertEqual(self.ask(self.ours, "POST", "/v1/jobs?dry_run=1", body).status, 200)

    def test_merges_comparisons_and_streams_refuse_a_foreign_part(self):
        ours, theirs = self.rendered(self.ours), self.rendered(self.theirs)
        for path, body in (("/v1/films/merge", {"films": [theirs, ours]}),
                           ("/v1/comparisons", {"a": theirs, "b": ours}),
                           ("/v1/stream-tickets", {"jobs": [theirs, ours]})):
            self.assertEqual(self.ask(self.theirs, "POST", path, body).status, 404, path)
        self.assertEqual(
            self.ask(self.theirs, "GET", f"/v1/events?jobs={theirs},{ours}").status, 404
        )
        self.assertEqual(self.ask(OPERATOR, "GET", f"/v1/events?jobs={theirs},{ours}").status, 200)

    def test_their_comparison_or_merge_cannot_use_our_asset(self):
        theirs = self.rendered(self.theirs)
        asset = self.made(self.ours, "POST", "/v1/assets", os.urandom(1000), BYTES)
        for path, body in (("/v1/comparisons", {"a": theirs, "b": asset}),
                           ("/v1/films/merge", {"films": [theirs, asset]})):
            self.assertEqual(self.ask(self.theirs, "POST", path, body).status, 404, path)

    def test_idempotency_keys_are_separate_per_tenant(self):
        name = {"Idempotency-Key": "order-17"}
        first = self.ask(self.ours, "POST", "/v1/jobs", job_body(), name)
        other = self.ask(self.theirs, "POST", "/v1/jobs", job_body(), name)
        again = self.ask(self.ours, "POST", "/v1/jobs", job_body(), name)
        self.assertEqual([first.status, other.status, again.status], [201, 201, 200])
        self.assertNotEqual(first.json()["id"], other.json()["id"])
        self.assertEqual(first.json()["id"], again.json()["id"])
        self.assertEqual(
            self.ask(self.theirs, "POST", "/v1/jobs", job_body(seed=9), name).status, 409
        )

    def test_preview_keys_are_separate_per_tenant(self):
        body = {**job_body(samples=LONG), "class": "preview", "preview_key": "camera"}
        first = self.made(self.ours, "POST", "/v1/jobs", body)
        other = self.made(self.theirs, "POST", "/v1/jobs", body)
        self.assertNotEqual(self.server.job(first)["state"], "cancelled")
        second = self.made(self.ours, "POST", "/v1/jobs", body)
        self.assertEqual(self.server.wait(first)["state"], "cancelled")
        self.assertNotEqual(self.server.job(other)["state"], "cancelled")
        self.assertEqual(self.ids(self.theirs, "/v1/jobs?class=preview", "jobs"), [other])
        for job in (other, second):
            self.server.post(f"/v1/jobs/{job}/cancel")

    def test_ticket_sees_the_objects_of_its_holder(self):
        job = self.rendered(self.ours)
        ticket = self.ask(self.ours, "POST", "/v1/stream-tickets", {"jobs": [job]}).json()["ticket"]
        self.assertEqual(
            self.ask("", "GET", f"/v1/jobs/{job}/image.png?ticket={ticket}").status, 200
        )


class SharedBytes(Tenants):
    def test_equal_uploads_share_bytes_and_each_tenant_has_a_reference(self):
        content = os.urandom(5000)
        path = "/v1/assets/" + hashlib.sha256(content).hexdigest()
        for key in (self.ours, self.theirs, OPERATOR):
            self.assertEqual(self.ask(key, "POST", "/v1/assets", content, BYTES).status, 201)
            self.assertEqual(self.ask(key, "POST", "/v1/assets", content, BYTES).status, 200)
            self.assertEqual(self.ask(key, "PUT", path, content, BYTES).status, 200)
        files = [name for _, _, names in os.walk(self.server.data + "/assets") for name in names]
        self.assertEqual(files.count(path.rsplit("/", 1)[1]), 1)
        self.assertEqual(self.ask(self.ours, "DELETE", path).status, 204)
        self.assertEqual(self.ask(self.ours, "GET", path).status, 404)
        self.assertEqual(self.ask(self.ours, "DELETE", path).status, 404)
        self.assertEqual(self.ask(self.theirs, "GET", path).body, content)
        self.assertEqual(self.ask(self.theirs, "DELETE", path).status, 204)
        self.assertEqual(self.ask(OPERATOR, "DELETE", path).status, 204)
        files = [name for _, _, names in os.walk(self.server.data + "/assets") for name in names]
        self.assertNotIn(path.rsplit("/", 1)[1], files)

    def test_equal_scenes_have_a_separate_name_per_tenant(self):
        scene = triangle_glb(extras={"of": "shared bytes"})
        first = self.ask(self.ours, "POST", "/v1/scenes?name=secret", scene, GLB)
        other = self.ask(self.theirs, "POST", "/v1/scenes?name=sofa", scene, GLB)
        self.assertEqual([first.status, other.status], [201, 201])
        path = "/v1/scenes/" + first.json()["id"]
        self.assertEqual(other.json()["name"], "sofa")
        self.assertEqual(self.ask(self.theirs, "GET", path).json()["name"], "sofa")
        self.assertEqual(self.ask(self.ours, "GET", path).json()["name"], "secret")
        self.assertEqual(self.ask(self.ours, "POST", "/v1/scenes", scene, GLB).status, 200)
        job = self.made(self.theirs, "POST", "/v1/jobs", job_body(scene=first.json()["id"]))
        # Their job does not hold our reference, and vice versa.
        self.assertEqual(self.ask(self.ours, "DELETE", path).status, 204)
        self.assertEqual(self.ask(self.ours, "GET", path).status, 404)
        self.assertEqual(self.server.wait(job)["state"], "finished")
        self.assertEqual(self.ask(self.theirs, "DELETE", path).status, 409)
        self.assertEqual(self.ask(self.theirs, "DELETE", f"/v1/jobs/{job}").status, 204)
        self.assertEqual(self.ask(self.theirs, "DELETE", path).status, 204)

    def test_files_of_a_scene_stay_while_another_tenant_uses_it(self):
        scene = triangle_glb(extras={"of": "files"})
        path = "/v1/scenes/" + self.made(self.ours, "POST", "/v1/scenes", scene, GLB)
        asset = "/v1/assets/" + hashlib.sha256(scene).hexdigest()
        self.assertEqual(self.ask(self.theirs, "GET", asset).status, 404)
        self.made(self.theirs, "POST", "/v1/scenes", scene, GLB)
        self.assertEqual(self.ask(self.ours, "DELETE", path).status, 204)
        self.assertEqual(self.ask(self.ours, "GET", asset).status, 404)
        self.assertEqual(self.ask(self.theirs, "GET", asset).body, scene)
        self.assertEqual(self.ask(self.theirs, "DELETE", asset).status, 409)

    def test_operator_deletes_for_all(self):
        path = "/v1/assets/" + self.made(self.ours, "POST", "/v1/assets", os.urandom(100), BYTES)
        scene = "/v1/scenes/" + self.made(
            self.ours, "POST", "/v1/scenes", triangle_glb(extras={"a": 1}), GLB
        )
        for each in (path, scene):
            self.assertEqual(self.ask(OPERATOR, "DELETE", each).status, 204)
            self.assertEqual(self.ask(self.ours, "GET", each).status, 404)

    def test_built_in_scenes_are_public(self):
        for key in (self.ours, self.theirs):
            self.assertEqual(self.ask(key, "GET", "/v1/scenes/cornell-box").status, 200)


class TenantKeys(Tenants):
    def test_rotated_key_keeps_its_work(self):
        job = self.rendered(self.theirs)
        tenant = self.theirs.split("_")[1]
        successor = add_key(self.server, "theirs, new", "--tenant", tenant)
        code, _, said = tessera("keys", "remove", tenant, "--data", self.server.data)
        self.assertEqual(code, 0, said)
        self.server.stop()
        self.server.start()
        self.assertEqual(self.ask(self.theirs, "GET", f"/v1/jobs/{job}").status, 401)
        self.assertEqual(self.ask(successor, "GET", f"/v1/jobs/{job}").status, 200)
        self.assertEqual(self.ids(successor, "/v1/jobs", "jobs"), [job])
        listed = json.loads(tessera("keys", "list", "--json", "--data", self.server.data)[1])[
            "keys"
        ]
        self.assertEqual(
            {key["name"]: key["tenant"] for key in listed}, {"ours": "ours", "theirs, new": tenant}
        )

    def test_scope_admin_sees_all(self):
        admin = add_key(self.server, "admin", "--scope", "admin", "--tenant", "office")
        job = self.rendered(self.ours)
        path = f"/v1/jobs/{job}"
        self.server.wait_until(job, lambda _: self.ask(admin, "GET", path).status == 200)
        self.assertIn(job, self.ids(admin, "/v1/jobs", "jobs"))
        own = self.rendered(admin)
        self.assertEqual(self.ask(self.ours, "GET", f"/v1/jobs/{own}").status, 404)

    def test_checks_the_name_of_a_tenant(self):
        for name in ("", "a b", "ä", "x" * 65):
            code, _, said = tessera(
                "keys", "add", "x", "--tenant", name, "--data", self.server.data
            )
            self.assertEqual(code, 2, said)


class Priorities(Tenants):
    def test_key_limits_the_priority_of_its_jobs(self):
        high = add_key(self.server, "high", "--max-priority", "5")
        job = self.rendered(self.ours)
        self.server.wait_until(job, lambda _: self.ask(high, "GET", "/v1/jobs").status == 200)
        for key, most in ((self.ours, 0), (high, 5), (OPERATOR, 100)):
            self.assertEqual(self.ask(key, "POST", "/v1/jobs", job_body(priority=most)).status, 201)
            if most < 100:
                answer = self.ask(key, "POST", "/v1/jobs", job_body(priority=most + 1))
                self.assertEqual(answer.status, 422, answer)
                self.assertEqual([e["pointer"] for e in answer.json()["errors"]], ["/priority"])
        path = f"/v1/jobs/{job}"
        self.assertEqual(self.ask(self.ours, "PATCH", path, {"priority": 1}).status, 422)
        self.assertEqual(self.ask(self.ours, "PATCH", path, {"priority": -1}).status, 200)
        # A priority set by the operator stays when another key changes other members.
        self.assertEqual(self.ask(OPERATOR, "PATCH", path, {"priority": 9}).status, 200)
        self.assertEqual(
            self.ask(self.ours, "PATCH", path, {"name": "sofa"}).json()["spec"]["priority"], 9
        )


class KeysOverHttp(Tenants):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.admin = add_key(cls.server, "admin", "--scope", "admin")

    def wait_for_status(self, key, status):
        wait_for(lambda: self.ask(key, "GET", "/v1/jobs").status == status,
                 f"timed out waiting for {status}")

    def test_admin_creates_lists_and_removes_keys(self):
        self.wait_for_status(self.admin, 200)
        for by in (self.admin, OPERATOR):
            body = {
                "name": "studio",
                "tenant": "ours",
                "scopes": ["read"],
                "max_priority": 3,
                "days": 2,
                "rate_limit": 600,
            }
            answer = self.ask(by, "POST", "/v1/keys", body)
            self.assertEqual(
                (answer.status, answer.headers["Cache-Control"]), (201, "no-store"), answer
            )
            made = answer.json()
            token = made.pop("key")
            self.assertEqual(
                (made["tenant"], made["scopes"], made["max_priority"], made["rate_limit"]),
                ("ours", ["read"], 3, 600),
            )
            listed = self.ask(by, "GET", "/v1/keys")
            self.assertNotIn(token, listed.body.decode())
            self.assertIn(made, listed.json()["keys"])
            self.wait_for_status(token, 200)
            self.assertEqual(self.ask(token, "POST", "/v1/jobs", job_body()).status, 403)
            self.assertEqual(self.ask(by, "DELETE", "/v1/keys/" + made["id"]).status, 204)
            self.wait_for_status(token, 401)
            self.assertEqual(self.ask(by, "DELETE", "/v1/keys/" + made["id"]).status, 404)

    def test_key_without_the_scope_is_403(self):
        for method, path, body in (("GET", "/v1/keys", None), ("POST", "/v1/keys", {"name": "x"}),
                                   ("DELETE", "/v1/keys/" + self.theirs.split("_")[1], None)):
            self.assertEqual(self.ask(self.ours, method, path, body).status, 403, path)

    def test_wrong_request_is_422_with_its_pointer(self):
        for body, pointer in (
            ({}, "/name"),
            ({"name": "x", "tenant": "a b"}, "/tenant"),
            ({"name": "x", "scopes": []}, "/scopes"),
            ({"name": "x", "scopes": ["root"]}, "/scopes/0"),
            ({"name": "x", "days": 0}, "/days"),
            ({"name": "x", "max_priority": 101}, "/max_priority"),
            ({"name": "x", "y": 1}, "/y"),
        ):
            answer = self.ask(OPERATOR, "POST", "/v1/keys", body)
            self.assertEqual(answer.status, 422, answer)
            self.assertEqual([e["pointer"] for e in answer.json()["errors"]], [pointer])

    def test_usage_shows_ones_own_and_all_for_the_operator(self):
        before = self.ask(self.ours, "GET", "/v1/usage").json()["tenants"][0]
        job = self.rendered(self.ours)
        asset = self.made(self.ours, "POST", "/v1/assets", os.urandom(1234), BYTES)
        (own,) = self.ask(self.ours, "GET", "/v1/usage").json()["tenants"]
        self.assertEqual(
            (own["tenant"], own["jobs"] - before["jobs"], own["unfinished_jobs"]), ("ours", 1, 0)
        )
        self.assertEqual(own["asset_bytes"] - before["asset_bytes"], 1234)
        self.assertGreater(own["film_bytes"], before["film_bytes"])
        self.assertGreater(own["cpu_seconds"], before["cpu_seconds"])
        usage = self.ask(OPERATOR, "GET", "/v1/usage").json()
        tenants = {row["tenant"]: row for row in usage["tenants"]}
        # The images that the page opens with are stored soon after the job's end.
        self.assertGreaterEqual(tenants["ours"]["film_bytes"], own["film_bytes"])
        self.assertEqual(tenants["ours"] | {"film_bytes": own["film_bytes"]}, own)
        self.assertLessEqual({"", "ours", self.theirs.split("_")[1]}, set(tenants))
        self.assertEqual((usage["quotas"]["jobs"], usage["quotas"]["streams"]), (500, 1024))
        # Work done still counts.
        self.ask(self.ours, "DELETE", f"/v1/jobs/{job}")
        self.ask(self.ours, "DELETE", f"/v1/assets/{asset}")
        (after,) = self.ask(self.ours, "GET", "/v1/usage").json()["tenants"]
        self.assertEqual(
            (after["jobs"], after["deleted_jobs"]), (before["jobs"], before["deleted_jobs"] + 1)
        )
        self.assertEqual(after["cpu_seconds"], own["cpu_seconds"])
        self.assertEqual(after["asset_bytes"], before["asset_bytes"])


class KeyFiles(unittest.TestCase):
    def start(self, text, *flags):
        server = Server("--listen", "127.0.0.1", *flags)
        self.addCleanup(server.close)
        path = os.path.join(server.data, "operator.key")
        with open(path, "w", encoding="ascii") as file:
            file.write(text)
        server.flags += ["--key-file", path]
        return server.start()

    def test_key_is_the_first_line_of_the_file(self):
        server = self.start("from-a-file\n")
        for key, status in ((None, 401), ("from-a-file", 200), ("other", 401)):
            server.key = key
            self.assertEqual(server.get("/v1/jobs").status, status, key)

    def test_refuses_an_empty_file_and_an_additional_key(self):
        for text, *flags in (("", ), ("x", "--key", "y")):
            with self.assertRaises(RuntimeError) as refused:
                self.start(text, *flags)
            self.assertIn("operator.key" if not text else "--key-file", str(refused.exception))


class Shared(Tenants):
    FLAGS = ("--shared",)

    def test_every_key_sees_the_objects_of_the_others(self):
        job = self.rendered(self.ours)
        self.assertEqual(self.ask(self.theirs, "GET", f"/v1/jobs/{job}").status, 200)
        self.assertIn(job, self.ids(self.theirs, "/v1/jobs", "jobs"))
        content = os.urandom(100)
        path = "/v1/assets/" + self.made(self.ours, "POST", "/v1/assets", content, BYTES)
        self.assertEqual(self.ask(self.theirs, "POST", "/v1/assets", content, BYTES).status, 200)
        self.assertEqual(self.ask(self.theirs, "DELETE", path).status, 204)
        self.assertEqual(self.ask(self.ours, "GET", path).status, 404)
        made = self.ask(self.ours, "PUT", "/v1/presets/shared",
                        {"job": {"stop": {"samples_per_pixel": 4}}})
        self.assertEqual(made.status, 201, made)
        other = self.rendered(self.ours)
        batch = {"template": job_body(), "matrix": {"seed": [1, 2]}}
        for path in (
            "/v1/presets/shared",
            "/v1/comparisons/" + self.made(self.ours, "POST", "/v1/comparisons",
                                           {"a": job, "b": other}),
            "/v1/batches/" + self.made(self.ours, "POST", "/v1/batches", batch),
        ):
            self.assertEqual(self.ask(self.theirs, "GET", path).status, 200, path)
        scene = triangle_glb(extras={"shared": 1})
        path = "/v1/scenes/" + self.made(self.ours, "POST", "/v1/scenes", scene, GLB)
        self.assertEqual(self.ask(self.theirs, "POST", "/v1/scenes", scene, GLB).status, 200)
        self.assertEqual(self.ask(self.theirs, "DELETE", path).status, 204)
        self.assertEqual(self.ask(self.ours, "GET", path).status, 404)


class Keyless(ApiTest):
    def test_first_key_cannot_be_created_over_http(self):
        answer = self.server.post("/v1/keys", {"name": "x"})
        self.assert_problem(answer, 403)
        self.assertEqual(self.server.get("/v1/keys").json(), {"keys": []})

    def test_server_without_keys_is_shared(self):
        job = self.server.render(job_body())["id"]
        with EventStream(self.server, job) as stream:
            self.assertEqual(stream.all()[-1].name, "end")
        self.assertEqual([each["id"] for each in self.server.get("/v1/jobs").json()["jobs"]], [job])
