"""The guide's recipes for proxies in front of the server, as they are written there."""

import contextlib
import http.client
import os
import pathlib
import re
import shutil
import signal
import socket
import subprocess
import tempfile
import time
import unittest
import urllib.parse

from harness import PATIENCE_S, Server

GUIDE = pathlib.Path(__file__).parents[2] / "clients/web/src/guide/operations.md"
ADDRESS = "127.0.0.1:8080"  # of the server, in the guide
FOLDERS = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")


def program(name):
    return shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Proxies(unittest.TestCase):
    def start(self):
        key = "key-of-the-proxies-test"
        self.server = Server("--trusted-proxies", "127.0.0.1", "--key", key, key=key).start()
        self.addCleanup(self.server.close)
        self.port = free_port()
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def run_proxy(self, *command):
        environ = os.environ | {"HOME": self.folder, "XDG_DATA_HOME": self.folder}
        proxy = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        self.addCleanup(proxy.wait)
        self.addCleanup(proxy.send_signal, signal.SIGTERM)
        deadline = time.monotonic() + PATIENCE_S
        while True:
            with contextlib.suppress(OSError):
                socket.create_connection(("127.0.0.1", self.port)).close()
                return
            self.assertLess(time.monotonic(), deadline)
            self.assertIsNone(proxy.poll())
            time.sleep(0.05)

    @contextlib.contextmanager
    def ask(self, method, path, body=None, headers=None):
        connection = http.client.HTTPConnection("127.0.0.1", self.port, timeout=PATIENCE_S)
        with contextlib.closing(connection):
            connection.request(method, path, body, headers or {})
            yield connection.getresponse()

    def check(self, prefix):
        with self.ask("GET", prefix) as page:
            self.assertEqual(page.status, 200)
            files = re.findall(r'(?:src|href)="([^"]+)"', page.read().decode())
        self.assertGreater(len(files), 1)
        for file in files:
            with self.ask("GET", urllib.parse.urljoin(prefix, file)) as answer:
                self.assertEqual(answer.status, 200, file)
        # A browser's own request names the origin of the page; the key comes from its cookie.
        host = f"127.0.0.1:{self.port}"
        session = {"Authorization": "Bearer " + self.server.key, "Origin": "http://" + host}
        with self.ask("POST", prefix + "v1/session", "", session) as answer:
            self.assertEqual(answer.status, 204)
            cookie = answer.headers["Set-Cookie"]
        self.assertIn(f"Path={prefix};", cookie)
        own = {"Cookie": cookie.split(";")[0], "Origin": "http://" + host,
               "Content-Type": "application/json"}
        job = '{"scene": "cornell-box", "stop": {"samples_per_pixel": 65536}}'
        with self.ask("POST", prefix + "v1/jobs", job, own) as answer:
            self.assertEqual(answer.status, 201, answer.read())
            location = answer.headers["Location"]
        self.assertTrue(location.startswith(prefix + "v1/jobs/"), location)
        # Events arrive while the job runs.
        with self.ask("GET", location + "/events", headers=own) as events:
            self.assertIn(b"event: progress\n", iter(events.readline, b""))
        with self.ask("POST", location + "/cancel", "", own) as answer:
            self.assertEqual(answer.status, 200)

    def recipe(self, name):
        text = GUIDE.read_text(encoding="utf-8")
        found = re.search(rf"\n{name}\b[^\n]*:\n\n(.*?\n    \}}\n)", text, re.DOTALL)
        return found[1].replace(ADDRESS, f"127.0.0.1:{self.server.port}")

    @unittest.skipUnless(program("nginx"), "nginx is missing")
    def test_nginx(self):
        self.start()
        paths = "".join(f"{name}_temp_path {self.folder}/{name};" for name in FOLDERS)
        config = pathlib.Path(self.folder, "nginx.conf")
        config.write_text(
            f"daemon off; pid {self.folder}/pid; error_log {self.folder}/log; events {{}}\n"
            f"http {{ access_log off; {paths}\n"
            f"server {{ listen 127.0.0.1:{self.port}; {self.recipe('nginx')} }} }}\n",
            encoding="utf-8")
        self.run_proxy(program("nginx"), "-c", str(config))
        self.check("/render/")

    @unittest.skipUnless(program("caddy"), "caddy is missing")
    def test_caddy(self):
        self.start()
        config = pathlib.Path(self.folder, "Caddyfile")
        site = self.recipe("Caddy").replace("render.example.org",
                                            f"http://127.0.0.1:{self.port}")
        config.write_text("{\n  admin off\n}\n" + site, encoding="utf-8")
        self.run_proxy(program("caddy"), "run", "--config", str(config), "--adapter", "caddyfile")
        self.check("/")


if __name__ == "__main__":
    unittest.main()
