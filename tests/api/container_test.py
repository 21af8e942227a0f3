"""The container's scripts and the alert rules, each run as it is there."""

import os
import shutil
import signal
import subprocess
import tempfile
import unittest

from harness import BINARY, Server

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
DOCKER = os.path.join(ROOT, "docker")
PROMTOOL = shutil.which("promtool") or "/usr/bin/promtool"


class EntrypointTest(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tessera-container-")
        self.addCleanup(shutil.rmtree, self.folder)

    def announced(self, **variables):
        """Returns the first two lines that the container prints."""
        environ = {"PATH": os.path.dirname(os.path.abspath(BINARY)) + ":/usr/bin:/bin",
                   "TESSERA_LISTEN": "0.0.0.0", "TESSERA_PORT": "0",
                   "TESSERA_DATA": self.folder + "/data", **variables}
        process = subprocess.Popen(["sh", DOCKER + "/entrypoint", "serve"], env=environ,
                                   stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        lines = process.stdout.readline() + process.stdout.readline()
        process.send_signal(signal.SIGTERM)
        process.communicate()
        return lines

    def test_a_given_address_is_announced_and_a_given_key_is_not_printed(self):
        lines = self.announced(TESSERA_KEY="given-key-000000",
                               TESSERA_ANNOUNCE="https://render.example.org/")
        self.assertIn("open https://render.example.org/ ", lines)
        self.assertNotIn("given-key", lines)
        self.assertNotIn("given-key", self.announced(TESSERA_KEY="given-key-000000"))

    def test_the_address_with_a_generated_key_is_announced(self):
        self.assertRegex(self.announced(TESSERA_PUBLISHED_PORT="81"),
                         "open http://localhost:81/#key=[0-9a-f]{36} ")

    def test_a_volume_of_another_user_is_told_with_the_remedy(self):
        data = self.folder + "/data"
        with open(data, "wb"):  # No folder can be made here, by any user.
            pass
        done = subprocess.run(["sh", DOCKER + "/entrypoint", "serve"], text=True,
                              env={"PATH": "/usr/bin:/bin", "TESSERA_DATA": data},
                              capture_output=True)
        self.assertEqual(done.returncode, 1)
        self.assertRegex(done.stderr, rf"user {os.getuid()} cannot write to .*chown -R")

    @unittest.skipUnless(os.getuid() == 0, "files of another user are made by root")
    def test_files_of_another_user_are_named_with_the_remedy(self):
        os.chmod(self.folder, 0o755)
        for name in ("lock", "tessera.db"):
            data = os.path.join(self.folder, name[0])
            os.mkdir(data)
            os.chown(data, 4321, 4321)
            os.close(os.open(os.path.join(data, name), os.O_CREAT, 0o600))
            with open(DOCKER + "/entrypoint", "rb") as script:
                done = subprocess.run(["sh", "-s", "serve"], stdin=script, capture_output=True,
                                      text=True, user=4321, group=4321,
                                      env={"PATH": "/usr/bin:/bin", "TESSERA_DATA": data})
            self.assertEqual(done.returncode, 1)
            self.assertRegex(done.stderr, f"user 4321 cannot write to .*/{name}; .*chown -R 4321:")

    def test_health_is_asked_at_the_port_of_the_flags(self):
        server = Server().start()
        self.addCleanup(server.close)
        path = os.path.dirname(os.path.abspath(BINARY)) + ":/usr/bin:/bin"
        with tempfile.NamedTemporaryFile("wb") as line:
            line.write(b"\0".join([b"tessera", b"serve", b"--port", str(server.port).encode()]))
            line.flush()
            done = subprocess.run(["sh", DOCKER + "/healthcheck", line.name], text=True,
                                  env={"PATH": path, "TESSERA_PORT": "1", "HOME": self.folder},
                                  capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)


class AlertsTest(unittest.TestCase):
    def test_rules_fire_when_they_should(self):
        folder = tempfile.mkdtemp(prefix="tessera-alerts-")
        self.addCleanup(shutil.rmtree, folder)
        shutil.copy(DOCKER + "/prometheus-alerts.yaml", folder)
        shutil.copy(os.path.join(os.path.dirname(__file__), "alerts_test.yaml"), folder)
        done = subprocess.run([PROMTOOL, "test", "rules", folder + "/alerts_test.yaml"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)


if __name__ == "__main__":
    unittest.main()
