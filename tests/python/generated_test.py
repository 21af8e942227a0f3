"""Code generated from /openapi.json: our models and types, and a client by openapi-python-client.
"""

import os
import pathlib
import subprocess
import sys
import tempfile

from harness import PATIENCE_S
from support import REPOSITORY, ServerTest

# The generator supports octet streams and text; these are sent and received as such.
CONFIG = """
post_hooks: []
content_type_overrides:
  application/vnd.tessera.film: application/octet-stream
  application/vnd.tessera.tiles: application/octet-stream
  application/x-ndjson: text/plain
  image/png: application/octet-stream
  model/gltf-binary: application/octet-stream
  text/event-stream: text/plain
"""


def run(*command, **options):
    """Returns the exit code and all output."""
    done = subprocess.run(
        command,
        check=False,
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        cwd=REPOSITORY,
        **options,
    )
    return done.returncode, done.stdout + done.stderr


class Generated(ServerTest):
    def test_types_and_models_match_the_server(self):
        code, told = run(sys.executable, "clients/generate.py", self.url(), "--check")
        self.assertEqual(code, 0, told)

    def test_detects_a_stale_file(self):
        with tempfile.TemporaryDirectory() as folder:
            changed = pathlib.Path(folder, "openapi.json")
            text = self.server.get("/openapi.json").body.decode()
            changed.write_text(text.replace('"spec_version"', '"spec_number"'))
            code, told = run(sys.executable, "clients/generate.py", str(changed), "--check")
        self.assertEqual(code, 1, told)
        for name in ("types.ts", "models.py"):
            self.assertIn(name, told)

    def test_client_of_another_generator_renders_an_image(self):
        with tempfile.TemporaryDirectory() as folder:
            home = pathlib.Path(folder)
            (home / "openapi.json").write_bytes(self.server.get("/openapi.json").body)
            (home / "config.yml").write_text(CONFIG)
            code, told = run(
                sys.executable,
                "-m",
                "openapi_python_client",
                "generate",
                "--meta",
                "none",
                "--path",
                str(home / "openapi.json"),
                "--config",
                str(home / "config.yml"),
                "--output-path",
                str(home / "generated"),
            )
            self.assertEqual(code, 0, told)
            code, told = run(sys.executable, "-m", "compileall", "-q", str(home / "generated"))
            self.assertEqual(code, 0, told)
            tour = os.path.join(os.path.dirname(__file__), "generated_tour.py")
            code, told = run(
                sys.executable, tour, self.url(), env={**os.environ, "PYTHONPATH": folder}
            )
            self.assertEqual(code, 0, told)
