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
import venv
import zipfile

import numpy
from support import REPOSITORY

import tessera_render


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
        self.assertEqual([re.match("[a-z]+", extra).group() for extra in extras],
                         ["pyoidn", "mcp"])
        for need in needs:
            self.assertRegex(need, r">=[0-9.]+", need)
            self.assertRegex(need, r"<[0-9.]+", need)
        self.assertEqual(importlib.metadata.version("tessera-render"),
                         tessera_render.__version__)

    def test_tessera_is_a_second_name(self):
        script = ("import sys, tessera, tessera.events, tessera_render\n"
                  "assert tessera is tessera_render\n"
                  "assert tessera.events.Event is tessera_render.Event\n"
                  "import tessera.mcp\n")
        self.assertEqual(run_python("-I", "-c", script), (0, ""))

    def test_another_distribution_may_be_called_tessera(self):
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder)
            own = self.wheel(place)
            other = place / "tessera-9-py3-none-any.whl"
            with zipfile.ZipFile(other, "w") as files:
                files.writestr("tessera/__init__.py", "name = 'another'\n")
                files.writestr("tessera-9.dist-info/METADATA",
                               "Metadata-Version: 2.1\nName: tessera\nVersion: 9\n")
                files.writestr("tessera-9.dist-info/WHEEL",
                               "Wheel-Version: 1.0\nRoot-Is-Purelib: true\nTag: py3-none-any\n")
                files.writestr("tessera-9.dist-info/RECORD", "")
            for order in ((own, other), (other, own)):
                with self.subTest(first=order[0].name):
                    self.live_together(place / f"venv of {order[0].name}", order)

    def wheel(self, place):
        code, told = run("pip", "wheel", "--quiet", "--no-deps", "--wheel-dir", str(place),
                         "./clients/python")
        self.assertEqual(code, 0, told)
        return next(place.glob("tessera_render-*.whl"))

    def live_together(self, home, wheels):
        venv.create(home)
        python = home / "bin/python"
        (site,) = home.glob("lib/*/site-packages")
        def prints(script):
            done = subprocess.run([python, "-c", script], cwd=home, capture_output=True, text=True)
            self.assertEqual(done.returncode, 0, done.stderr)
            return done.stdout.strip()

        def pip(*words):
            self.assertEqual(run("pip", "--python", python, "--quiet", *words), (0, ""))

        for wheel in wheels:
            pip("install", "--no-deps", "--no-index", wheel)
        self.assertEqual(prints("import tessera; print(tessera.name)"), "another")
        # What the package needs is found, last, where it is installed for this test.
        needed = site / "needed.pth"
        needed.write_text(f"{pathlib.Path(numpy.__file__).parents[1]}\n")
        found = prints("import tessera_render as t; t.Client; print(t.__file__)")
        self.assertTrue(pathlib.Path(found).is_relative_to(site), found)
        needed.unlink()
        pip("uninstall", "--yes", "tessera-render")
        self.assertEqual(prints("import tessera; print(tessera.name)"), "another")
        self.assertEqual(sorted(path.name for path in site.glob("*tessera*")),
                         ["tessera", "tessera-9.dist-info"])

    def test_is_marked_as_typed(self):
        self.assertTrue(importlib.resources.files("tessera_render").joinpath("py.typed").is_file())

    def test_public_names_exist_and_are_documented(self):
        for name in tessera_render.__all__:
            self.assertTrue(getattr(tessera_render, name).__doc__, name)

    def test_passes_strict_type_checks(self):
        code, told = run("mypy", "--config-file", "clients/python/pyproject.toml", "--cache-dir",
                         "build/python/mypy", "clients/python/src")
        self.assertEqual(code, 0, told)

    def test_synchronous_client_is_generated_from_the_asynchronous_one(self):
        script = pathlib.Path(REPOSITORY, "clients/synchronous.py")
        self.assertEqual(run_python(script, "--check"), (0, ""))
        with tempfile.TemporaryDirectory() as folder:
            place = pathlib.Path(folder, "clients")
            package = "python/src/tessera_render"
            shutil.copytree(script.parent / package, place / package)
            shutil.copy(script, place)
            with open(place / package / "job.py", "a", encoding="utf-8") as job:
                job.write("# by hand")
            code, told = run_python(place / script.name, "--check")
            self.assertEqual(code, 1, told)
            self.assertIn("job.py", told)
            self.assertNotIn("client.py,", told)

    def test_examples_pass_type_checks(self):
        code, told = run("mypy", "--strict", "--cache-dir", "build/python/mypy", "clients/examples")
        self.assertEqual(code, 0, told)

    def test_type_checks_detect_a_wrong_option(self):
        wrong = ("from tessera_render import Client\nClient().submit('glass', colour='red')\n"
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
