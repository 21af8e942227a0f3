"""tessera_render: a server that belongs to the process."""

import os
import pathlib
import signal
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.error
import urllib.request

from harness import BINARY

RENDER = """
from tessera_render import client, render
job = render("cornell-box", size=16, samples_per_pixel=2)
job.save("a.png")
print(client().server, client().info().version, job.size, flush=True)
"""


class PrivateServer(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        (self.folder / "tmp").mkdir()

    def start(self, script, path=f"{os.path.dirname(os.path.abspath(BINARY))}:/usr/bin:/bin",
              **settings):
        clean = {name: text for name, text in os.environ.items() if not name.startswith("TESSERA_")}
        environment = clean | {"PATH": path, "TMPDIR": str(self.folder / "tmp")} | settings
        process = subprocess.Popen([sys.executable, "-c", script], cwd=self.folder, text=True,
                                   env=environment, stdin=subprocess.PIPE, stdout=subprocess.PIPE,
                                   stderr=subprocess.PIPE)
        self.addCleanup(process.communicate)
        self.addCleanup(process.kill)
        return process

    def gone(self, address):
        """Whether the server does not answer, and its folder is away, within 20 s."""
        until = time.monotonic() + 20
        while time.monotonic() < until:
            try:
                urllib.request.urlopen(address + "/livez", timeout=5).close()
            except (urllib.error.URLError, ConnectionError):
                if not any((self.folder / "tmp").iterdir()):
                    return True
            time.sleep(0.05)
        return False

    def test_renders_and_ends_with_the_program(self):
        told, faults = self.start(RENDER).communicate(timeout=60)
        self.assertTrue((self.folder / "a.png").read_bytes().startswith(b"\x89PNG"), faults)
        self.assertTrue(self.gone(told.split()[0]), told)

    def test_ends_with_a_killed_program_and_needs_a_key(self):
        process = self.start(RENDER + "input()")
        address = process.stdout.readline().split()[0]
        with self.assertRaises(urllib.error.HTTPError) as refused:
            urllib.request.urlopen(address + "/v1/jobs", timeout=5)
        refused.exception.close()
        self.assertEqual(refused.exception.code, 401)
        process.send_signal(signal.SIGKILL)
        self.assertTrue(self.gone(address))

    def test_takes_settings_of_this_machine_but_of_no_other_server(self):
        program = self.folder / "tessera"
        program.write_text("#!/bin/sh\nenv >env\necho listening on http://127.0.0.1:9\n"
                           "exec sleep 60\n")
        program.chmod(0o755)
        kept = {"TESSERA_OIDN": "/oidn", "TESSERA_THREADS": "1"}
        others = {"TESSERA_KEY": "k", "TESSERA_DATA": "/data", "TESSERA_CONFIG": "/config",
                  "TESSERA_PORT": "1", "TESSERA_LISTEN": "0.0.0.0", "TESSERA_QUEUE": "nats://a"}
        _, faults = self.start("from tessera_render import client; client()",
                               path=f"{self.folder}:/usr/bin:/bin", **kept, **others
                               ).communicate(timeout=60)
        self.assertNotIn("Error", faults)
        lines = (self.folder / "env").read_text().splitlines()
        got = dict(line.split("=", 1) for line in lines if line.startswith("TESSERA_"))
        self.assertEqual({name: got.get(name) for name in kept}, kept)
        self.assertEqual(got.keys() - kept.keys(), {"TESSERA_KEY", "TESSERA_DATA"})
        self.assertFalse(got.items() & others.items())

    def test_says_what_is_missing(self):
        _, faults = self.start(RENDER, path="/nowhere").communicate(timeout=60)
        self.assertIn("there is no program `tessera`", faults)
