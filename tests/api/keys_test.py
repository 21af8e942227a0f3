"""Keys: authentication, scopes, rates; the cookie of the page, tickets, CORS."""

import json
import unittest

from harness import EventStream, Server, job_body, started, tessera, wait_for

PAGE = "http://studio.example"


class Keyed(unittest.TestCase):
    """A server with an operator key and one other allowed origin."""

    @classmethod
    def setUpClass(cls):
        cls.server = started(
            cls, "--key", "operators-own", "--origins", PAGE, "--quota-jobs", "1",
            key="operators-own")

    def add_key(self, *flags):
        code, key, said = tessera("keys", "add", "test", "--data", self.server.data, *flags)
        self.assertEqual(code, 0, said)
        return key.strip()

    def status(self, path, key=None, method="GET", body=None, **headers):
        headers = {k.replace("_", "-"): v for k, v in headers.items()}
        headers["Authorization"] = f"Bearer {key}" if key else ""
        return self.server.request(method, path, body, headers).status

    def wait_for_status(self, status, path, key):
        wait_for(lambda: self.status(path, key) == status, f"timed out waiting for {status}")

    def test_without_the_key_is_401(self):
        for key in (None, "wrong", "operators-ow", "operators-own2"):
            for path in ("/v1/server", "/v1/jobs", "/v1/nothing", "/v1/events?jobs=" + "0" * 36):
                self.assertEqual(self.status(path, key), 401, (key, path))
        answer = self.server.request("GET", "/v1/jobs", headers={"Authorization": "Basic b3A6b3A="})
        self.assertEqual(answer.status, 401)
        self.assertTrue(answer.headers["WWW-Authenticate"].startswith("Bearer"))
        self.assertEqual(answer.json()["status"], 401)

    def test_distinguishes_a_missing_from_an_unknown_key(self):
        for authorization in ("", "Basic b3A6b3A=", "Bearer", "Bearer "):
            answer = self.server.request(
                "GET", "/v1/jobs", headers={"Authorization": authorization}
            )
            self.assertEqual(
                answer.headers["WWW-Authenticate"], 'Bearer realm="tessera"', authorization
            )
            self.assertIn("o key was given", answer.json()["detail"], authorization)
        for method, path in (("GET", "/v1/jobs"), ("POST", "/v1/session")):
            answer = self.server.request(method, path, headers={"Authorization": "Bearer wrong"})
            self.assertEqual(
                answer.headers["WWW-Authenticate"], 'Bearer realm="tessera", error="invalid_token"'
            )
            self.assertIn("is unknown or has expired", answer.json()["detail"])
        cookie = {"Authorization": "", "Cookie": f"tessera_session_{self.server.port}=old"}
        self.assertIn(
            "session", self.server.request("GET", "/v1/jobs", headers=cookie).json()["detail"]
        )

    def test_command_line_reports_whether_the_key_is_missing_or_wrong(self):
        flags = ("--server", f"http://127.0.0.1:{self.server.port}")
        code, _, said = tessera("jobs", *flags)
        self.assertEqual((code, "Give the key with --key" in said), (1, True), said)
        code, _, said = tessera("jobs", *flags, "--key", "wrong")
        self.assertEqual(
            (code, "Give the key" in said, "not one of this server's" in said),
            (1, False, True),
            said,
        )

    def test_page_description_and_probes_need_no_key(self):
        for path in ("/", "/docs", "/openapi.json", "/livez", "/readyz", "/metrics"):
            self.assertEqual(self.status(path), 200, path)

    def test_exchanges_a_key_for_a_cookie(self):
        self.assertEqual(self.status("/v1/session", method="POST"), 401)
        for key in ("operators-own", self.add_key()):
            self.wait_for_status(200, "/v1/server", key)
            answer = self.server.request(
                "POST", "/v1/session", headers={"Authorization": "Bearer " + key}
            )
            self.assertEqual(answer.status, 204)
            cookie = answer.headers["Set-Cookie"]
            for attribute in ("HttpOnly", "SameSite=Strict", "Path=/"):
                self.assertIn(attribute, cookie)
            self.assertNotIn(key, cookie)
            pair = cookie.split(";")[0]
            connection = self.server.connect()
            for value, status in ((pair, 200), ("a=b; " + pair, 200), (pair[:-1] + "x", 401)):
                connection.request("GET", "/v1/jobs", headers={"Cookie": value})
                answer = connection.getresponse()
                answer.read()
                self.assertEqual(answer.status, status, value)
            connection.close()

    def test_removed_key_stops_working(self):
        key = self.add_key()
        self.wait_for_status(200, "/v1/jobs", key)
        code, listed, _ = tessera("keys", "list", "--json", "--data", self.server.data)
        self.assertEqual(code, 0)
        self.assertNotIn(key, listed)
        self.assertNotIn(key.split("_")[2], listed)
        self.assertIn(key.split("_")[1], [row["id"] for row in json.loads(listed)["keys"]])
        code, _, _ = tessera("keys", "remove", key.split("_")[1], "--data", self.server.data)
        self.assertEqual(code, 0)
        self.wait_for_status(401, "/v1/jobs", key)
        code, _, said = tessera("keys", "remove", key.split("_")[1], "--data", self.server.data)
        self.assertEqual(code, 1, said)

    def test_store_contains_no_key(self):
        key = self.add_key()
        self.wait_for_status(200, "/v1/jobs", key)
        for name in ("tessera.db", "tessera.db-wal"):
            with open(f"{self.server.data}/{name}", "rb") as file:
                self.assertNotIn(key.split("_")[2].encode(), file.read())

    def test_missing_scope_is_403(self):
        reads, writes = self.add_key("--scope", "read"), self.add_key("--scope", "write")
        self.wait_for_status(200, "/v1/jobs", reads)
        self.assertEqual(self.status("/v1/jobs", reads, "POST", job_body()), 403)
        self.assertEqual(self.status("/v1/jobs?dry_run=1", reads, "POST", job_body()), 403)
        experiment = {"experiment": "pi", "n": [4], "replicates": 2}
        self.assertEqual(self.status("/v1/lab/runs", reads, "POST", experiment), 403)
        self.assertEqual(self.status("/v1/lab/runs", writes, "POST", experiment), 200)
        self.assertEqual(self.status("/v1/jobs", writes), 403)
        self.assertEqual(self.status("/v1/jobs", writes, "POST", job_body()), 201)

    def test_wrong_flags_are_2(self):
        for arguments in (
            ["add"],
            ["add", "a", "--scope", "all"],
            ["add", "a", "--rate", "-1"],
            ["change"],
            ["add", "a", "--days", "0"],
            ["list", "--colour"],
            [],
        ):
            self.assertEqual(
                tessera("keys", *arguments, "--data", self.server.data)[0], 2, arguments
            )

    def test_exceeding_the_rate_is_429(self):
        key = self.add_key("--rate", "3")
        self.wait_for_status(200, "/v1/jobs", key)  # the first of three
        seen = []
        for _ in range(3):
            answer = self.server.request(
                "GET", "/v1/jobs", headers={"Authorization": "Bearer " + key}
            )
            seen.append(answer.status)
            self.assertEqual(answer.headers["RateLimit-Policy"], '"key";q=3;w=60')
            self.assertRegex(answer.headers["RateLimit"], r'^"key";r=[0-3];t=\d+$')
        self.assertEqual(seen, [200, 200, 429])
        self.assertEqual(answer.headers["Content-Type"], "application/problem+json")
        self.assertTrue(
            1 <= int(answer.headers["Retry-After"]) <= 20, answer.headers["Retry-After"]
        )
        # Other keys are not delayed by it.
        self.assertEqual(self.status("/v1/jobs", "operators-own"), 200)

    def test_exceeding_the_job_quota_is_429(self):
        key = self.add_key()
        self.wait_for_status(200, "/v1/jobs", key)
        held = self.server.request("POST", "/v1/jobs", job_body(samples=65536),
                                   {"Authorization": "Bearer " + key}).json()["id"]
        self.assertEqual(self.status("/v1/jobs", key, "POST", job_body()), 429)
        self.assertEqual(self.status("/v1/jobs", "operators-own", "POST", job_body()), 201)
        self.server.post(f"/v1/jobs/{held}/cancel")
        self.assertEqual(self.status("/v1/jobs", key, "POST", job_body()), 201)

    def test_ticket_replaces_the_key_where_a_page_cannot_send_one(self):
        job, other = (self.server.render(job_body())["id"] for _ in range(2))
        self.assertEqual(self.status("/v1/stream-tickets", None, "POST", {"jobs": [job]}), 401)
        made = self.server.post("/v1/stream-tickets", {"jobs": [job]})
        self.assertEqual(made.status, 201, made)
        self.assertEqual(made.json()["jobs"], [job])
        ticket = made.json()["ticket"]
        for path in ("/events", "/tiles", "/image.png"):
            self.assertEqual(self.status(f"/v1/jobs/{job}{path}?ticket={ticket}"), 200, path)
            self.assertEqual(self.status(f"/v1/jobs/{other}{path}?ticket={ticket}"), 401, path)
            self.assertEqual(self.status(f"/v1/jobs/{job}{path}?ticket=x"), 401, path)
        self.assertEqual(self.status(f"/v1/events?jobs={job}&ticket={ticket}"), 200)
        self.assertEqual(self.status(f"/v1/events?jobs={job},{other}&ticket={ticket}"), 401)
        self.assertEqual(self.status(f"/v1/jobs/{job}?ticket={ticket}"), 401)
        self.assertEqual(self.status(f"/v1/jobs/{job}?ticket={ticket}", method="DELETE"), 401)

    def test_checks_tickets(self):
        nobody = "00000000-0000-4000-8000-000000000000"
        for body, status in (
            ({}, 422),
            ({"jobs": []}, 422),
            ({"jobs": ["x"]}, 422),
            ({"jobs": [nobody]}, 404),
            ({"jobs": [nobody] * 2}, 422),
            ({"jobs": [nobody], "for": 1}, 422),
        ):
            self.assertEqual(self.server.post("/v1/stream-tickets", body).status, status, body)

    def test_allowed_origins_get_cors_headers_and_others_403(self):
        answer = self.server.request("OPTIONS", "/v1/jobs", headers={
            "Origin": PAGE, "Access-Control-Request-Method": "POST", "Authorization": ""})
        self.assertEqual(answer.status, 204)
        self.assertEqual(answer.headers["Access-Control-Allow-Origin"], PAGE)
        self.assertIn("POST", answer.headers["Access-Control-Allow-Methods"])
        self.assertIn("Authorization", answer.headers["Access-Control-Allow-Headers"])
        answer = self.server.request("GET", "/v1/jobs", headers={"Origin": PAGE})
        self.assertEqual(
            (answer.status, answer.headers["Access-Control-Allow-Origin"]), (200, PAGE)
        )
        self.assertIn("Origin", answer.headers.get_all("Vary"))
        for origin in ("http://evil.example", PAGE + ":81", "https://studio.example"):
            answer = self.server.request("GET", "/v1/jobs", headers={"Origin": origin})
            self.assertEqual(answer.status, 403, origin)
            self.assertIsNone(answer.headers["Access-Control-Allow-Origin"])
        refused = self.server.request(
            "GET", "/v1/jobs", headers={"Origin": PAGE, "Authorization": "Bearer x"}
        )
        self.assertEqual(
            (refused.status, refused.headers["Access-Control-Allow-Origin"]), (401, PAGE)
        )


class StoredKeys(unittest.TestCase):
    def test_first_stored_key_closes_an_open_server(self):
        server = started(self)
        self.assertEqual(server.get("/v1/jobs").status, 200)
        key = tessera("keys", "add", "first", "--data", server.data)[1].strip()
        wait_for(lambda: server.get("/v1/jobs").status == 401)
        server.key = key
        job = server.render(job_body())["id"]
        with EventStream(server, job) as stream:
            self.assertEqual(stream.all()[-1].name, "end")
        server.stop()
        server.start()
        self.assertEqual(server.get("/v1/jobs").status, 200)

    def test_public_address_requires_a_key(self):
        server = Server("--listen", "0.0.0.0")
        self.addCleanup(server.close)
        with self.assertRaises(RuntimeError) as refused:
            server.start()
        server.process.stdout.close()
        self.assertIn("needs a key", str(refused.exception))
        self.assertEqual(server.process.returncode, 1)
