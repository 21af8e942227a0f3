"""The audit log: who changed what, and who was refused."""

import json
import os
import tempfile
import time
import unittest

from harness import PATIENCE_S, Server, job_body, tessera

TRACE = "4bf92f3577b34da6a3ce929d0e0e4736"


class Audit(unittest.TestCase):
    def server(self, *flags):
        server = Server("--key", "operators-own", *flags, key="operators-own")
        self.addCleanup(server.close)
        return server

    def start(self, *flags):
        return self.server(*flags).start()

    def add_key(self, server, name, *flags):
        code, key, said = tessera("keys", "add", name, "--data", server.data, *flags)
        self.assertEqual(code, 0, said)
        return key.strip()

    def lines(self, path):
        with open(path, encoding="utf-8") as file:
            text = file.read()
        return text, [
            line
            for line in map(json.loads, filter(None, text.splitlines()))
            if line["event"] == "audit"
        ]

    def test_logs_added_and_removed_keys(self):
        server = self.start("--log-level", "info")
        self.add_key(server, "studio", "--scope", "read")
        ids = [
            key["id"]
            for key in json.loads(tessera("keys", "list", "--json", "--data", server.data)[1])[
                "keys"
            ]
        ]
        self.assertEqual(len(ids), 1)

        def wait_for(action):
            deadline = time.monotonic() + PATIENCE_S
            while True:
                server.get("/v1/jobs")
                lines = [
                    json.loads(line)
                    for line in server.log_text().splitlines()
                    if '"action"' in line
                ]
                found = [line for line in lines if line["action"] == action]
                if found:
                    return found
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.1)

        (added,) = wait_for("key-added")
        self.assertEqual((added["event"], added["object"], added["object_name"], added["scopes"]),
                         ("audit", ids[0], "studio", "read"))
        self.assertEqual(tessera("keys", "remove", ids[0], "--data", server.data)[0], 0)
        (removed,) = wait_for("key-removed")
        self.assertEqual(removed["object"], ids[0])

    def test_logs_exactly_every_change_and_every_refusal(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = os.path.join(folder.name, "audit.log")
        server = self.server("--audit-log", path)
        writes, reads = self.add_key(server, "studio"), self.add_key(
            server, "viewer", "--scope", "read"
        )
        server.start()
        asked = []

        def ask(key, method, where, body=None, **headers):
            headers = {k.replace("_", "-"): v for k, v in headers.items()}
            answer = server.request(method, where, body,
                                    {"Authorization": f"Bearer {key}" if key else "", **headers})
            asked.append((answer.headers["X-Request-Id"], method, where, answer.status))
            return answer

        trace = f"00-{TRACE}-00f067aa0ba902b7-01"
        job = ask(writes, "POST", "/v1/jobs", job_body(), traceparent=trace).json()["id"]
        looked = ask(writes, "GET", f"/v1/jobs/{job}?wait=60")
        ask(writes, "PATCH", f"/v1/jobs/{job}", {"name": "sofa"})
        ask(reads, "DELETE", f"/v1/jobs/{job}")
        ask("a-wrong-key", "GET", "/v1/jobs?ticket=secret-ticket")
        ask(None, "POST", "/v1/jobs", job_body())
        ask(writes, "POST", "/v1/jobs", {"scene": 1})
        asset = ask("operators-own", "POST", "/v1/assets", b"bytes").json()["id"]
        ask("operators-own", "DELETE", "/v1/assets/" + asset)
        ask(writes, "GET", "/v1/jobs", Host="evil.example")
        server.stop()
        text, found = self.lines(path)
        for secret in (
            writes,
            reads,
            writes.split("_")[2],
            reads.split("_")[2],
            "operators-own",
            "a-wrong-key",
            "secret-ticket",
        ):
            self.assertNotIn(secret, text)
        by_id = {line["request_id"]: line for line in found}
        wanted = {  # requests in order, without reads
            0: ("done", job, "studio"), 2: ("done", job, "studio"), 3: ("refused", job, "viewer"),
            4: ("refused", "", ""), 5: ("refused", "", ""), 6: ("refused", "", "studio"),
            7: ("done", asset, "operator"), 8: ("done", asset, "operator"), 9: ("refused", "", "")}
        for at, (outcome, thing, name) in wanted.items():
            request_id, method, where, status = asked[at]
            line = by_id[request_id]
            self.assertEqual(
                (line["outcome"], line["object"], line["key_name"]), (outcome, thing, name), line
            )
            self.assertEqual(
                (line["method"], line["path"], line["status"]),
                (method, where.split("?")[0], status),
            )
            self.assertEqual(line["remote"], "127.0.0.1")
            self.assertGreater(line["time"], 1_600_000_000)
        self.assertEqual(by_id[asked[0][0]]["key"], writes.split("_")[1])
        self.assertEqual(by_id[asked[0][0]]["trace_id"], TRACE)
        self.assertNotIn(looked.headers["X-Request-Id"], by_id)
        self.assertEqual(len(found), len(wanted))
        self.assertEqual(os.stat(path).st_mode & 0o077, 0)

    def test_starts_a_new_file_after_the_file_was_moved(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        path = os.path.join(folder.name, "audit.log")
        server = self.start("--audit-log", path)
        for name in ("1", "2"):
            answer = server.post("/v1/assets", name.encode())
            deadline = time.monotonic() + PATIENCE_S
            while not os.path.exists(path) or not any(
                line["request_id"] == answer.headers["X-Request-Id"] for line in self.lines(path)[1]
            ):
                self.assertLess(time.monotonic(), deadline)
                time.sleep(0.05)
            self.assertEqual(len(self.lines(path)[1]), 1)
            os.rename(path, path + name)

    def test_without_a_file_the_lines_are_in_the_log(self):
        server = self.start("--log-level", "info")
        answer = server.post("/v1/assets", b"bytes")
        server.stop()
        _, found = self.lines(server.log)
        self.assertEqual([(line["request_id"], line["key_name"]) for line in found],
                         [(answer.headers["X-Request-Id"], "operator")])

    def test_refuses_to_start_if_the_file_cannot_be_written(self):
        with self.assertRaises(RuntimeError) as refused:
            self.start("--audit-log", "/nowhere/audit.log")
        self.assertIn("/nowhere/audit.log", str(refused.exception))
