"""The installed package: types, dependencies, style."""

import importlib.metadata
import importlib.resources
import pathlib
import re
import shutil
import subprocess
import sys
import tempfile
import unittest

from support import REPOSITORY

import tessera


def run_python(*command):
    done = subprocess.run(
        [sys.executable, *command], cwd=REPOSITORY, capture_output=True, text=True
    )
    return done.returncode, done.stdout + done.stderr


def run(*command):
    return run_python("-m", *command)


class Package(unittest.TestCase):
    def test_depends_only_on_httpx_and_numpy(self):
        needs = importlib.metadata.requires("tessera-render")
        extras = [need for need in needs if "extra ==" in need]
        names = sorted(re.match("[a-z]+", need).group() for need in needs if need not in extras)
        self.assertEqual(names, ["httpx", "numpy"])
        self.assertEqual([re.match("[a-z]+", extra).group() for extra in extras], ["mcp"])
        for need in needs:
            self.assertRegex(need, r">=[0-9.]+", need)
            self.assertRegex(need, r"<[0-9.]+", need)
        self.assertEqual(importlib.metadata.version("tessera-render"), tessera.__version__)

    def test_is_marked_as_typed(self):
        self.assertTrue(importlib.resources.files("tessera").joinpath("py.typed").is_file())

    def test_public_names_exist_and_are_documented(self):
        for name in tessera.__all__:
            self.assertTrue(getattr(tessera, name).__doc__, name)

    def test_passes_strict_type_checks(self):
        code, told = run("mypy", "--config-file", "clients/python/pyproject.toml", "--cache-dir",
                         "build/python/mypy", "clients/python/src/tessera",
                         "clients/python/src/tessera_render")
        self.assertEqual(code, 0, told)

    def test_synchronous_client_is_generated_from_the_asynchronous_one(self):
        script = pathlib.Path(REPOSITORY, "clients/synchronous.py")
        self.assertEqual(run_python(script, "--check"), (0, ""))
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder, "clients")
            shutil.copytree(script.parent / "python/src/tessera", place / "python/src/tessera")
            shutil.copy(script, place)
            with open(place / "python/src/tessera/job.py", "a", encoding="utf-8") as job:
                job.write("# by hand")
            code, told = run_python(place / script.name, "--check")
            self.assertEqual(code, 1, told)
            self.assertIn("job.py", told)
            self.assertNotIn("client.py,", told)

    def test_examples_pass_type_checks(self):
        code, told = run("mypy", "--strict", "--cache-dir", "build/python/mypy", "clients/examples")
        self.assertEqual(code, 0, told)

    def test_type_checks_detect_a_wrong_option(self):
        wrong = ("from tessera import Client\nClient().submit('glass', colour='red')\n"
                 "Client().submit('glass', size=3)\n")
        code, told = run("mypy", "--strict", "--cache-dir", "build/python/mypy", "-c", wrong)
        self.assertEqual((code, told.count("error:")), (1, 2), told)

    def test_passes_style_checks(self):
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
