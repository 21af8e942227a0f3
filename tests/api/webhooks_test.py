"""Webhooks: signed, made again, kept over a kill, and sent to nobody whom the operator would not."""

import base64
import hashlib
import hmac
import http.server
import json
import queue
import threading
import time
import unittest

from harness import PATIENCE_S, ApiTest, Server, job_body

SECRET = base64.b64encode(b"a secret of 24 bytes ok!").decode()


class Receiver:
    """Takes calls and answers them with the statuses that are prepared, else with 204."""

    def __init__(self):
        self.calls = queue.Queue()
        self.statuses = queue.Queue()
        receiver = self

        class Handler(http.server.BaseHTTPRequestHandler):
            def do_POST(self):
                body = self.rfile.read(int(self.headers["Content-Length"]))
                status = 204 if receiver.statuses.empty() else receiver.statuses.get()
                receiver.calls.put((self.path, dict(self.headers.items()), body, status))
                self.send_response(status)
                if status == 302:
                    self.send_header("Location", "/elsewhere")
                self.send_header("Content-Length", "0")
                self.end_headers()

            def log_message(self, *_):
                pass

        self.server = http.server.ThreadingHTTPServer(("127.0.0.1", 0), Handler)
        self.url = f"http://127.0.0.1:{self.server.server_port}/hook?who=me"
        threading.Thread(target=self.server.serve_forever, daemon=True).start()

    def next(self):
        return self.calls.get(timeout=PATIENCE_S)

    def close(self):
        self.server.shutdown()
        self.server.server_close()


class Webhooks(ApiTest):
    FLAGS = ("--webhook-private", "--webhook-secret", "whsec_" + SECRET, "--log-level", "info")

    def setUp(self):
        self.receiver = Receiver()
        self.addCleanup(self.receiver.close)

    def assert_signed(self, headers, body):
        headers = {name.lower(): value for name, value in headers.items()}
        message = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
        digest = hmac.new(base64.b64decode(SECRET), message, hashlib.sha256).digest()
        self.assertEqual(headers["webhook-signature"], "v1," + base64.b64encode(digest).decode())
        self.assertLess(abs(time.time() - int(headers["webhook-timestamp"])), 60)
        self.assertEqual(headers["content-type"], "application/json")
        return headers["webhook-id"]

    def wait_for_end_of(self, webhook_id):
        """The line of the log that says how the call ended: delivered or given up."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            with open(self.server.log, encoding="utf-8") as log:
                ends = [line for line in log if webhook_id in line and line.endswith("\n") and
                        ("webhook_delivered" in line or "webhook_given_up" in line)]
            if ends:
                return json.loads(ends[0])
            time.sleep(0.02)
        self.fail(f"{webhook_id} did not end")

    def test_the_end_is_told_signed_with_the_job(self):
        job = self.server.render(job_body(webhook={"url": self.receiver.url}))
        path, headers, body, _ = self.receiver.next()
        self.assertEqual(path, "/hook?who=me")
        webhook_id = self.assert_signed(headers, body)
        told = json.loads(body)
        self.assertEqual(told["type"], "job.end")
        self.assertEqual(told["data"]["id"], job["id"])
        self.assertEqual(told["data"]["state"], "finished")
        self.assertEqual(told["data"]["film_digest"], job["film_digest"])
        end = self.wait_for_end_of(webhook_id)
        self.assertEqual((end["event"], end["attempt"]), ("webhook_delivered", 1))
        self.assertTrue(self.receiver.calls.empty())

    def test_every_2xx_is_an_answer(self):
        for status in (200, 202, 204):
            self.receiver.statuses.put(status)
            self.server.render(job_body(webhook={"url": self.receiver.url}))
            call = self.receiver.next()
            end = self.wait_for_end_of(self.assert_signed(*call[1:3]))
            self.assertEqual((call[3], end["event"], end["attempt"]), (status, "webhook_delivered", 1))

    def test_states_are_told_when_asked_for(self):
        self.server.render(job_body(webhook={"url": self.receiver.url, "events": ["end", "state"]}))
        told = [json.loads(self.receiver.next()[2]) for _ in range(5)]
        self.assertEqual(sorted(t["data"]["state"] for t in told if t["type"] == "job.state"),
                         ["finished", "loading", "queued", "rendering"])
        self.assertEqual([t["type"] for t in told].count("job.end"), 1)

    def test_a_refused_call_is_made_again_with_the_same_id(self):
        self.receiver.statuses.put(500)
        self.server.render(job_body(webhook={"url": self.receiver.url}))
        first, second = self.receiver.next(), self.receiver.next()
        self.assertEqual((first[3], second[3]), (500, 204))
        self.assertEqual(self.assert_signed(*first[1:3]), self.assert_signed(*second[1:3]))
        self.assertEqual(first[2], second[2])

    def test_redirects_are_not_followed_and_410_is_final(self):
        self.receiver.statuses.put(302)
        self.receiver.statuses.put(410)
        self.server.render(job_body(webhook={"url": self.receiver.url}))
        first, second = self.receiver.next(), self.receiver.next()
        self.assertEqual([first[0], second[0]], ["/hook?who=me"] * 2)
        end = self.wait_for_end_of(self.assert_signed(*second[1:3]))
        self.assertEqual((end["event"], end["attempt"]), ("webhook_given_up", 2))
        self.assertTrue(self.receiver.calls.empty())

    def test_a_receiver_that_is_not_there_harms_nobody(self):
        self.server.render(job_body(webhook={"url": "http://127.0.0.1:1/"}))
        self.server.render(job_body(webhook={"url": "http://name.invalid/"}))
        self.server.render(job_body(webhook={"url": self.receiver.url}))
        self.assertEqual(json.loads(self.receiver.next()[2])["type"], "job.end")


class WebhooksStay(unittest.TestCase):
    def test_a_call_that_was_not_made_is_made_after_a_kill(self):
        receiver = Receiver()
        self.addCleanup(receiver.close)
        server = Server("--webhook-private")
        self.addCleanup(server.close)
        server.start()
        receiver.statuses.put(500)
        job = server.render(job_body(webhook={"url": receiver.url}))["id"]
        first = receiver.next()
        server.kill()
        server.start()
        second = receiver.next()
        self.assertEqual(second[2], first[2])
        self.assertEqual(json.loads(second[2])["data"]["id"], job)
        # The secret was made by the server, and is kept: both calls verify with it.
        with open(server.data + "/webhook.secret", encoding="ascii") as file:
            key = base64.b64decode(file.read().removeprefix("whsec_"))
        for _, headers, body, _ in (first, second):
            headers = {name.lower(): value for name, value in headers.items()}
            message = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
            self.assertEqual(headers["webhook-signature"],
                             "v1," + base64.b64encode(hmac.new(key, message, hashlib.sha256).digest()).decode())


class PrivateAddresses(ApiTest):
    def test_addresses_that_are_not_public_are_422(self):
        for host in ("127.0.0.1", "localhost", "10.1.2.3", "192.168.0.1", "172.16.0.1", "169.254.169.254",
                     "[::1]", "[fd00::1]", "[fe80::1]", "[::ffff:127.0.0.1]", "0.0.0.0", "127.1", "2130706433",
                     "0x7f000001", "100.64.0.1", "[64:ff9b::7f00:1]", "LOCALHOST", "a.localhost"):
            answer = self.server.post("/v1/jobs", job_body(webhook={"url": f"http://{host}/x"}))
            self.assert_problem(answer, 422, "/webhook/url")
        for host in ("8.8.8.8", "[2606:4700::1111]", "hooks.example"):
            body = job_body(samples=65536, webhook={"url": f"https://{host}/x"})
            answer = self.server.post("/v1/jobs?dry_run=1", body)
            self.assertEqual(answer.status, 200, answer)
