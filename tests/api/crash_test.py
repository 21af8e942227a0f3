"""The short form of tests/stress/kill."""

import unittest

import crash


class Killed(unittest.TestCase):
    def test_nothing_acknowledged_is_lost_and_films_are_the_same(self):
        found = crash.run(kills=6, seed=20261121)
        self.assertGreater(found["jobs"], crash.KINDS)
        self.assertGreater(found["assets"], 0)
