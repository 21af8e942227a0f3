"""The short form of tests/stress/kill, and a kill right after the answer to each kind of change."""

import unittest

import changes
import crash
from harness import Server


class Killed(unittest.TestCase):
    def test_nothing_acknowledged_is_lost_and_films_are_the_same(self):
        found = crash.run(kills=6, seed=20261121)
        self.assertGreater(found["jobs"], crash.KINDS)
        self.assertGreater(found["assets"], 0)

    def test_each_change_outlives_a_kill_right_after_its_answer(self):
        server = Server()
        server.start()
        self.addCleanup(server.close)
        for number, name in enumerate(changes.CHANGES):
            with self.subTest(name):
                changes.survives(server, name, number + 1)
