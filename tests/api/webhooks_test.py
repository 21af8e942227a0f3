"""Webhooks: signed, retried, kept over a kill, and only sent to addresses that the operator allows.
"""

import base64
import hashlib
import hmac
import http.server
import json
import queue
import socket
import threading
import time
import unittest

from harness import PATIENCE_S, ApiTest, Server, job_body, started, tessera

SECRET = base64.b64encode(b"a secret of 24 bytes ok!").decode()


class Receiver:
    """Receives calls and answers with the prepared statuses, then with 204."""

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
        """Returns the line of the log with the result of the call: delivered or given up."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            with open(self.server.log, encoding="utf-8") as log:
                ends = [line for line in log if webhook_id in line and line.endswith("\n") and
                        ("webhook_delivered" in line or "webhook_given_up" in line)]
            if ends:
                return json.loads(ends[0])
            time.sleep(0.02)
        self.fail(f"{webhook_id} did not end")

    def test_end_is_sent_signed_with_the_job(self):
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

    def test_every_2xx_is_success(self):
        for status in (200, 202, 204):
            self.receiver.statuses.put(status)
            self.server.render(job_body(webhook={"url": self.receiver.url}))
            call = self.receiver.next()
            end = self.wait_for_end_of(self.assert_signed(*call[1:3]))
            self.assertEqual(
                (call[3], end["event"], end["attempt"]), (status, "webhook_delivered", 1)
            )

    def test_sends_states_on_request(self):
        self.server.render(job_body(webhook={"url": self.receiver.url, "events": ["end", "state"]}))
        told = [json.loads(self.receiver.next()[2]) for _ in range(5)]
        self.assertEqual(sorted(t["data"]["state"] for t in told if t["type"] == "job.state"),
                         ["finished", "loading", "queued", "rendering"])
        self.assertEqual([t["type"] for t in told].count("job.end"), 1)

    def test_retries_a_refused_call_with_the_same_id(self):
        self.receiver.statuses.put(500)
        self.server.render(job_body(webhook={"url": self.receiver.url}))
        first, second = self.receiver.next(), self.receiver.next()
        self.assertEqual((first[3], second[3]), (500, 204))
        self.assertEqual(self.assert_signed(*first[1:3]), self.assert_signed(*second[1:3]))
        self.assertEqual(first[2], second[2])

    def test_does_not_follow_redirects_and_410_is_final(self):
        self.receiver.statuses.put(302)
        self.receiver.statuses.put(410)
        self.server.render(job_body(webhook={"url": self.receiver.url}))
        first, second = self.receiver.next(), self.receiver.next()
        self.assertEqual([first[0], second[0]], ["/hook?who=me"] * 2)
        end = self.wait_for_end_of(self.assert_signed(*second[1:3]))
        self.assertEqual((end["event"], end["attempt"]), ("webhook_given_up", 2))
        self.assertTrue(self.receiver.calls.empty())

    def test_unreachable_receiver_is_harmless(self):
        self.server.render(job_body(webhook={"url": "http://127.0.0.1:1/"}))
        self.server.render(job_body(webhook={"url": "http://name.invalid/"}))
        self.server.render(job_body(webhook={"url": self.receiver.url}))
        self.assertEqual(json.loads(self.receiver.next()[2])["type"], "job.end")


class SilentReceiver:
    """Accepts connections and never answers."""

    def __init__(self):
        self.socket = socket.create_server(("127.0.0.1", 0), backlog=64)
        self.url = f"http://127.0.0.1:{self.socket.getsockname()[1]}/"

    def close(self):
        self.socket.close()


class IndependentReceivers(ApiTest):
    FLAGS = ("--webhook-private",)

    def receiver(self, kind=Receiver):
        made = kind()
        self.addCleanup(made.close)
        return made

    def delivery(self, path, wanted):
        """Waits until the delivery is in that state and returns it."""
        deadline = time.monotonic() + PATIENCE_S
        while time.monotonic() < deadline:
            found = self.server.get(path).json()
            if found["state"] == wanted:
                return found
            time.sleep(0.02)
        self.fail(f"timed out waiting for {wanted}: {found}")

    def test_silent_receiver_does_not_delay_others(self):
        silent, other = self.receiver(SilentReceiver), self.receiver()
        for url in [silent.url] * 12 + [other.url]:
            self.server.post("/v1/webhooks/test", {"url": url})
        self.assertEqual(json.loads(other.next()[2])["type"], "test")
        # It arrived while the first call to the silent receiver was still open, which has the whole
        # deadline.
        calls = self.server.get("/v1/webhooks/deliveries").json()["deliveries"]
        self.assertEqual(
            [call["attempts"] for call in calls if call["url"] == silent.url], [0] * 12, calls
        )

    def test_many_silent_receivers_do_not_delay_others(self):
        other = self.receiver()
        silent = [self.receiver(SilentReceiver).url for _ in range(12)]
        for url in silent:
            self.server.post("/v1/webhooks/test", {"url": url})
        self.server.post("/v1/webhooks/test", {"url": other.url})
        self.assertEqual(json.loads(other.next()[2])["type"], "test")
        calls = self.server.get("/v1/webhooks/deliveries").json()["deliveries"]
        self.assertEqual([call["attempts"] for call in calls if call["url"] in silent], [0] * 12)

    def test_calls_to_one_receiver_are_sequential_and_in_order(self):
        receiver = self.receiver()
        jobs = [
            self.server.submit(job_body(webhook={"url": receiver.url, "events": ["state", "end"]}))[
                "id"
            ]
            for _ in range(3)
        ]
        told = [json.loads(receiver.next()[2]) for _ in range(15)]
        for job in jobs:
            states = [t["data"]["state"] for t in told if t["data"]["id"] == job]
            self.assertEqual(states, ["queued", "loading", "rendering", "finished", "finished"])

    def test_later_calls_wait_for_a_retried_call(self):
        receiver = self.receiver()
        receiver.statuses.put(500)
        self.server.render(job_body(webhook={"url": receiver.url, "events": ["state"]}))
        states = [json.loads(receiver.next()[2])["data"]["state"] for _ in range(5)]
        self.assertEqual(states, ["queued", "queued", "loading", "rendering", "finished"])

    def test_deliveries_can_be_listed_and_sent_again(self):
        receiver = self.receiver()
        receiver.statuses.put(410)
        job = self.server.render(job_body(webhook={"url": receiver.url}))["id"]
        first = receiver.next()
        (listed,) = self.server.get(f"/v1/webhooks/deliveries?job={job}").json()["deliveries"]
        path = "/v1/webhooks/deliveries/" + listed["id"]
        failed = self.delivery(path, "failed")
        self.assertEqual(
            (failed["event"], failed["url"], failed["attempts"], failed["status"], failed["job"]),
            ("end", receiver.url, 1, 410, job),
        )
        self.assertIn("410", failed["detail"])
        again = self.server.post(path + "/redeliver")
        self.assertEqual((again.status, again.json()["id"]), (202, failed["id"]))
        second = receiver.next()
        self.assertEqual((first[1]["webhook-id"], first[2]), (second[1]["webhook-id"], second[2]))
        delivered = self.delivery(path, "delivered")
        self.assertEqual(
            (delivered["status"], delivered["detail"], delivered["next_attempt_at"]),
            (204, None, None),
        )
        metrics = self.server.get("/metrics").body.decode()
        self.assertRegex(metrics, r'tessera_webhook_deliveries_total\{result="delivered"\} [1-9]')
        self.assertRegex(metrics, r'tessera_webhook_deliveries_total\{result="given_up"\} [1-9]')

    def test_lists_have_filters_and_pages(self):
        receiver = self.receiver()
        made = [
            self.server.post("/v1/webhooks/test", {"url": receiver.url}).json()["id"]
            for _ in range(3)
        ]
        for _ in made:
            receiver.next()
        for delivery in made:
            self.delivery("/v1/webhooks/deliveries/" + delivery, "delivered")
        page = self.server.get("/v1/webhooks/deliveries?limit=2&state=delivered").json()
        self.assertEqual([call["id"] for call in page["deliveries"]], made[:0:-1])
        rest = self.server.get(f"/v1/webhooks/deliveries?limit=1&cursor={page['next']}").json()
        self.assertEqual([call["id"] for call in rest["deliveries"]], made[:1])
        for query in ("state=lost", "job=x", "cursor=x", "limit=0", "colour=red"):
            self.assertIn(
                self.server.get("/v1/webhooks/deliveries?" + query).status, (400, 422), query
            )

    def test_test_call_is_made_once_and_reports_its_result(self):
        receiver = self.receiver()
        receiver.statuses.put(500)
        answer = self.server.post("/v1/webhooks/test", {"url": receiver.url})
        self.assertEqual(answer.status, 202, answer)
        self.assertEqual(
            answer.headers["Location"], "/v1/webhooks/deliveries/" + answer.json()["id"]
        )
        failed = self.delivery(answer.headers["Location"], "failed")
        self.assertEqual((failed["event"], failed["job"], failed["status"], failed["attempts"]),
                         ("test", None, 500, 1))
        self.assert_problem(self.server.post("/v1/webhooks/test", {"url": "ftp://h/"}), 422, "/url")


class TenantSecrets(unittest.TestCase):
    def test_each_tenant_signs_with_its_own_secret(self):
        receiver = Receiver()
        self.addCleanup(receiver.close)
        server = Server(
            "--key", "own", "--webhook-private", "--webhook-secret", "whsec_" + SECRET, key="own"
        )
        self.addCleanup(server.close)
        keys = [
            tessera("keys", "add", name, "--data", server.data)[1].strip() for name in ("a", "b")
        ]
        reader = tessera("keys", "add", "c", "--scope", "read", "--data", server.data)[1].strip()
        server.start()

        def ask(key, method, path, body=None):
            return server.request(method, path, body, {"Authorization": "Bearer " + key})

        def secret(key, method="GET"):
            answer = ask(key, method, "/v1/webhooks/secret")
            self.assertEqual(
                (answer.status, answer.headers["Cache-Control"]), (200, "no-store"), answer
            )
            return answer.json()["secret"]

        def check_call(key, wanted):
            ask(key, "POST", "/v1/webhooks/test", {"url": receiver.url})
            _, headers, body, _ = receiver.next()
            headers = {name.lower(): value for name, value in headers.items()}
            message = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
            digest = hmac.new(
                base64.b64decode(wanted.removeprefix("whsec_")), message, hashlib.sha256
            ).digest()
            self.assertEqual(
                headers["webhook-signature"], "v1," + base64.b64encode(digest).decode()
            )

        secrets = [secret(key) for key in (*keys, "own")]
        self.assertEqual(len(set(secrets)), 3)
        self.assertEqual(secrets[2], "whsec_" + SECRET)
        for key, wanted in zip((*keys, "own"), secrets):
            check_call(key, wanted)
        fresh = secret(keys[0], "POST")
        self.assertNotEqual(fresh, secrets[0])
        check_call(keys[0], fresh)
        check_call(keys[1], secrets[1])
        self.assertEqual(ask("own", "POST", "/v1/webhooks/secret").status, 409)
        self.assertEqual(ask(reader, "GET", "/v1/webhooks/secret").status, 403)


class WebhooksAfterAKill(unittest.TestCase):
    def test_pending_call_is_made_after_a_kill(self):
        receiver = Receiver()
        self.addCleanup(receiver.close)
        server = started(self, "--webhook-private")
        receiver.statuses.put(500)
        job = server.render(job_body(webhook={"url": receiver.url}))["id"]
        first = receiver.next()
        server.kill()
        server.start()
        second = receiver.next()
        self.assertEqual(second[2], first[2])
        self.assertEqual(json.loads(second[2])["data"]["id"], job)
        # The server generated the secret and keeps it: both calls verify with it.
        with open(server.data + "/webhook.secret", encoding="ascii") as file:
            key = base64.b64decode(file.read().removeprefix("whsec_"))
        for _, headers, body, _ in (first, second):
            headers = {name.lower(): value for name, value in headers.items()}
            message = f"{headers['webhook-id']}.{headers['webhook-timestamp']}.".encode() + body
            self.assertEqual(
                headers["webhook-signature"],
                "v1," + base64.b64encode(hmac.new(key, message, hashlib.sha256).digest()).decode(),
            )


class PrivateAddresses(ApiTest):
    def test_addresses_that_are_not_public_are_422(self):
        for host in (
            "127.0.0.1",
            "localhost",
            "10.1.2.3",
            "192.168.0.1",
            "172.16.0.1",
            "169.254.169.254",
            "[::1]",
            "[fd00::1]",
            "[fe80::1]",
            "[::ffff:127.0.0.1]",
            "0.0.0.0",
            "127.1",
            "2130706433",
            "0x7f000001",
            "100.64.0.1",
            "[64:ff9b::7f00:1]",
            "LOCALHOST",
            "a.localhost",
        ):
            answer = self.server.post("/v1/jobs", job_body(webhook={"url": f"http://{host}/x"}))
            self.assert_problem(answer, 422, "/webhook/url")
        for host in ("8.8.8.8", "[2606:4700::1111]", "hooks.example"):
            body = job_body(samples=65536, webhook={"url": f"https://{host}/x"})
            answer = self.server.post("/v1/jobs?dry_run=1", body)
            self.assertEqual(answer.status, 200, answer)
