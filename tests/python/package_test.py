"""The installed package: types, dependencies, style."""

import importlib.metadata
import importlib.resources
import re
import subprocess
import sys
import unittest

from support import REPOSITORY

import tessera


def run(*command):
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=REPOSITORY, capture_output=True, text=True
    )
    return done.returncode, done.stdout + done.stderr


class Package(unittest.TestCase):
    def test_it_needs_httpx_and_numpy_and_nothing_else(self):
        needs = importlib.metadata.requires("tessera-client")
        self.assertEqual(
            sorted(re.match("[a-z]+", need).group() for need in needs), ["httpx", "numpy"]
        )
        for need in needs:
            self.assertRegex(need, r">=[0-9.]+", need)
            self.assertRegex(need, r"<[0-9.]+", need)
        self.assertEqual(importlib.metadata.version("tessera-client"), tessera.__version__)

    def test_it_says_that_it_is_typed(self):
        self.assertTrue(importlib.resources.files("tessera").joinpath("py.typed").is_file())

    def test_what_is_public_exists_and_is_documented(self):
        for name in tessera.__all__:
            self.assertTrue(getattr(tessera, name).__doc__, name)

    def test_types_hold_in_strict_mode(self):
        code, told = run("mypy", "--config-file", "clients/python/pyproject.toml", "--cache-dir",
                         "build/python/mypy", "clients/python/src/tessera")
        self.assertEqual(code, 0, told)

    def test_types_of_the_examples_hold(self):
        code, told = run("mypy", "--strict", "--cache-dir", "build/python/mypy", "clients/examples")
        self.assertEqual(code, 0, told)

    def test_a_wrong_option_is_seen_by_the_types(self):
        wrong = ("from tessera import Client\nClient().submit('glass', colour='red')\n"
                 "Client().submit('glass', size=3)\n")
        code, told = run("mypy", "--strict", "--cache-dir", "build/python/mypy", "-c", wrong)
        self.assertEqual((code, told.count("error:")), (1, 2), told)

    def test_the_style_holds(self):
        for step in (["check"], ["format", "--check"]):
            code, told = run(
                "ruff",
                *step,
                "--no-cache",
                "--config",
                "clients/python/pyproject.toml",
                "clients/python",
                "clients/examples"
            )
            self.assertEqual(code, 0, told)
