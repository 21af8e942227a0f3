"""Kills of a real process on a real disk: at random, and right after the answer to each kind of
change. tests/simulation kills for years."""

import json
import unittest

import changes
import crash
from harness import Server, job_body, tessera
from webhooks_test import Receiver


class Killed(unittest.TestCase):
    def test_nothing_acknowledged_is_lost_and_films_are_the_same(self):
        found = crash.run(kills=4, seed=20261121)
        self.assertGreater(found["jobs"], crash.KINDS)
        self.assertGreater(found["assets"], 0)

    def test_each_change_outlives_a_kill_right_after_its_answer(self):
        server = Server()
        server.start()
        self.addCleanup(server.close)
        for number, name in enumerate(changes.CHANGES):
            with self.subTest(name):
                changes.survives(server, name, number + 1)

    def test_each_object_outlives_a_kill_right_after_its_answer(self):
        server = Server("--key", "operators-own", key="operators-own")
        server.start()
        self.addCleanup(server.close)
        jobs = [server.render(job_body(samples=2, seed=seed))["id"] for seed in (1, 2)]
        for name in changes.OBJECTS:
            with self.subTest(name):
                changes.object_survives(server, name, jobs)

    def test_a_replaced_webhook_secret_outlives_a_kill_right_after_its_answer(self):
        server = Server("--key", "operators-own", key="operators-own")
        self.addCleanup(server.close)
        key = tessera("keys", "add", "tenant", "--data", server.data)[1].strip()
        server.start()

        def secret(method):
            answer = server.request(method, "/v1/webhooks/secret", None,
                                    {"Authorization": "Bearer " + key})
            self.assertEqual(answer.status, 200, answer)
            return answer.json()["secret"]

        for _ in range(2):
            before = secret("GET")
            server.kill()
            server.start()
            self.assertEqual(secret("GET"), before)
            fresh = secret("POST")
            server.kill()
            server.start()
            self.assertEqual(secret("GET"), fresh)
            self.assertNotEqual(fresh, before)

    def test_a_webhook_is_called_after_a_kill_right_after_the_answer(self):
        receiver = Receiver()
        self.addCleanup(receiver.close)
        server = Server("--webhook-private")
        server.start()
        self.addCleanup(server.close)
        answer = server.post("/v1/jobs", job_body(webhook={"url": receiver.url}))
        server.kill()
        self.assertEqual(answer.status, 201, answer)
        server.start()
        told = json.loads(receiver.next()[2])
        self.assertEqual((told["data"]["id"], told["data"]["state"]),
                         (answer.json()["id"], "finished"))
