"""Too many connections: slow ones are closed, all others are served. tests/stress/flood is the full
form."""

import contextlib
import socket

from churn import metric
from harness import PATIENCE_S, ApiTest, job_body, wait_for

DRIPS = 600  # Well above the limit of waiting connections of one address (256).


class Flood(ApiTest):
    def drip(self, plugs):
        for plug in plugs:
            with contextlib.suppress(OSError):
                plug.sendall(b"X")

    def refused(self, limit):
        wanted = f'tessera_http_connections_refused_total{{limit="{limit}"}} '
        lines = self.server.get("/metrics").body.decode().splitlines()
        return float(next(line for line in lines if line.startswith(wanted)).rsplit(" ", 1)[1])

    def test_slow_connections_of_one_address_block_nobody(self):
        with contextlib.ExitStack() as stack:
            plugs = []
            for _ in range(DRIPS):
                plug = socket.create_connection(("127.0.0.1", self.server.port), timeout=PATIENCE_S)
                plugs.append(stack.enter_context(plug))
                plug.sendall(b"GET /livez HTTP/1.1\r\n")
                if len(plugs) % 50 == 0:
                    self.drip(plugs)
                    for path in ("/livez", "/readyz", "/metrics", "/v1/server", "/v1/jobs"):
                        self.assertEqual(self.server.get(path).status, 200, path)
            job = self.server.submit(job_body())["id"]
            self.assertEqual(self.server.get(f"/v1/jobs/{job}?wait=60").json()["state"], "finished")
            wait_for(lambda: self.refused("address") >= DRIPS - 256,
                     "slow connections are not closed")
            self.assertEqual(self.refused("served"), 0)


class Waits(ApiTest):
    FLAGS = ("--max-streams", "2")

    def test_waiting_for_a_job_counts_as_a_stream(self):
        job = self.server.submit(job_body(samples=65536))["id"]
        with contextlib.ExitStack() as stack:
            for _ in range(2):
                waiting = self.server.connect()
                stack.callback(waiting.close)
                waiting.request("GET", f"/v1/jobs/{job}?wait=60")
            wait_for(lambda: metric(self.server, "tessera_streams") >= 2,
                     "requests that wait do not count")
            answer = self.server.get(f"/v1/jobs/{job}?wait=1")
            self.assertEqual(answer.status, 503, answer)
            self.assertTrue(answer.headers["Retry-After"])
            self.assertEqual(self.server.get(f"/v1/jobs/{job}").status, 200)
            other = self.server.post("/v1/jobs", job_body(samples=65536), {"Prefer": "wait=60"})
            self.assertEqual(other.status, 202)
            self.assertNotIn("Preference-Applied", other.headers)
        self.server.post(f"/v1/jobs/{job}/cancel")
