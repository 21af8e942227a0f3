"""Operation of the server: reload, health checks, the units and files in docker/, warnings at the
start."""

import http.client
import json
import os
import re
import shutil
import signal
import ssl
import subprocess
import tempfile
import time
import unittest

from harness import BINARY, PATIENCE_S, ApiTest, Server, wait_for

HERE = os.path.dirname(os.path.abspath(__file__))
DOCKER = os.path.join(HERE, "..", "..", "docker")


def certificate(folder, name):
    """Returns paths of a new certificate for localhost and its key."""
    paths = [os.path.join(folder, f"{name}-{part}.pem") for part in ("cert", "key")]
    subprocess.run(
        [
            "openssl",
            "req",
            "-x509",
            "-newkey",
            "ec",
            "-pkeyopt",
            "ec_paramgen_curve:P-256",
            "-nodes",
            "-keyout",
            paths[1],
            "-out",
            paths[0],
            "-days",
            "2",
            "-subj",
            "/CN=localhost",
            "-addext",
            "subjectAltName=DNS:localhost",
        ],
        check=True,
        capture_output=True,
    )
    return paths


class SecureServer(Server):
    """Its clients trust only the certificate that was set last."""

    certificate = None

    def connect(self, timeout=PATIENCE_S):
        trust = ssl.create_default_context(cafile=self.certificate)
        return http.client.HTTPSConnection("localhost", self.port, timeout=timeout, context=trust)


class Reload(unittest.TestCase):
    def setUp(self):
        self.folder = tempfile.mkdtemp(prefix="tessera-reload-")
        self.addCleanup(shutil.rmtree, self.folder)
        self.config = os.path.join(self.folder, "tessera.conf")

    def write(self, **values):
        with open(self.config, "w", encoding="utf-8") as file:
            file.writelines(
                f"{name.replace('_', '-')} = {value}\n" for name, value in values.items()
            )

    def start(self, kind=Server, **settings):
        server = kind("--config", self.config, **settings)
        self.addCleanup(server.close)
        return server

    def reload(self, server, event):
        """Reloads; returns the line of the log that reports it."""
        known = server.log_text().count(event)
        server.process.send_signal(signal.SIGHUP)
        wait_for(lambda: server.log_text().count(event) != known, server.log_text)
        return json.loads(
            [line for line in server.log_text().splitlines() if f'"{event}"' in line][-1]
        )

    def status(self, server, key, **headers):
        return server.request(
            "GET", "/v1/server", headers={"Authorization": "Bearer " + key, **headers}
        ).status

    def test_keys_and_names_apply_at_once_and_the_rest_is_reported(self):
        self.write(key="old", max_queue="10")
        server = self.start().start()
        self.assertEqual((self.status(server, "old"), self.status(server, "new")), (200, 401))
        self.assertEqual(self.status(server, "old", Host="render.example"), 421)
        self.write(key="new", hosts="render.example", max_queue="20")
        line = self.reload(server, "reloaded")
        self.assertEqual((line["changed"], line["needs_restart"]), ("key, hosts", "max-queue"))
        self.assertNotIn("new", str(line))
        self.assertEqual((self.status(server, "old"), self.status(server, "new")), (401, 200))
        self.assertEqual(self.status(server, "new", Host="render.example"), 200)

    def test_unreadable_configuration_changes_nothing(self):
        self.write(key="old")
        server = self.start().start()
        self.write(key="new", trusted_proxies="not-a-network")
        self.assertIn("not-a-network", self.reload(server, "reload_refused")["detail"])
        self.assertEqual((self.status(server, "old"), self.status(server, "new")), (200, 401))

    def test_next_client_gets_a_renewed_certificate(self):
        (cert, key), (next_cert, next_key) = certificate(self.folder, "first"), certificate(
            self.folder, "next"
        )
        self.write(tls_cert=cert, tls_key=key, key="k")
        server = self.start(SecureServer, scheme="https", key="k")
        server.certificate = os.path.join(self.folder, "trusted.pem")
        shutil.copy(cert, server.certificate)
        server.start()
        kept = server.connect()
        self.addCleanup(kept.close)
        kept.request("GET", "/livez")
        kept.getresponse().read()
        shutil.copy(next_cert, cert)
        shutil.copy(next_key, key)
        self.reload(server, "reloaded")
        with self.assertRaises(ssl.SSLCertVerificationError):
            server.get("/livez")
        shutil.copy(next_cert, server.certificate)
        self.assertEqual(server.get("/livez").status, 200)
        kept.request("GET", "/livez")  # Existing connections stay open.
        self.assertEqual(kept.getresponse().status, 200)


class Health(unittest.TestCase):
    def health(self, server, *flags):
        return subprocess.run(
            [BINARY, "health", "--server", f"{server.scheme}://127.0.0.1:{server.port}", *flags],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            env={k: v for k, v in os.environ.items() if not k.startswith("TESSERA_")},
        )

    def test_container_health_check_works_with_and_without_tls(self):
        with open(f"{DOCKER}/Dockerfile", encoding="utf-8") as file:
            dockerfile = file.read()
        command = re.search(r"HEALTHCHECK .*\\\n +CMD \[\"([^\"]*)\"\]", dockerfile)[1]
        script = re.search(rf"COPY docker/(\S+) \S*/{command}\n", dockerfile)[1]
        folder = tempfile.mkdtemp(prefix="tessera-health-")
        self.addCleanup(shutil.rmtree, folder)
        line = f"{folder}/cmdline"  # Settings come from the variables.
        with open(line, "wb") as file:
            file.write(b"tessera\0serve\0")
        path = f"{os.path.dirname(os.path.abspath(BINARY))}:{os.environ['PATH']}"
        cert, key = certificate(folder, "it")
        secure = SecureServer(
            "--tls-cert", cert, "--tls-key", key, "--key", "k", key="k", scheme="https"
        )
        secure.certificate = cert
        pair = {"TESSERA_TLS_CERT": cert, "TESSERA_TLS_KEY": key}
        for server, certificates in ((Server(), {}), (secure, pair)):
            self.addCleanup(server.close)
            server.start()
            environ = {"PATH": path, "HOME": folder, "TESSERA_PORT": str(server.port),
                       **certificates}
            check = subprocess.run(
                ["sh", f"{DOCKER}/{script}", line],
                env=environ,
                check=False,
                capture_output=True,
                text=True,
                timeout=PATIENCE_S,
            )
            self.assertEqual((check.returncode, check.stdout), (0, "ready\n"), check.stderr)
        self.assertEqual(
            self.health(secure).returncode, 1, "accepted a certificate that is not trusted"
        )


class Proxy(ApiTest):
    FLAGS = ("--trusted-proxies", "127.0.0.0/8", "--key", "k")

    def cookie(self, **headers):
        return self.server.post(
            "/v1/session", headers={"Authorization": "Bearer k", **headers}
        ).headers["Set-Cookie"]

    def tearDown(self):
        pass  # Nothing here creates jobs, and listing them requires the key.

    def test_cookie_is_secure_if_the_proxy_uses_tls(self):
        self.assertNotIn("Secure", self.cookie())
        self.assertIn("Secure", self.cookie(**{"X-Forwarded-Proto": "https"}))

    def test_owner_can_end_a_session(self):
        pair = self.cookie().split(";")[0]
        self.assertEqual(self.server.get("/v1/jobs", {"Cookie": pair}).status, 200)
        ended = self.server.request("DELETE", "/v1/session", headers={"Cookie": pair})
        self.assertEqual(ended.status, 204)
        self.assertIn("Max-Age=0", ended.headers["Set-Cookie"])
        self.assertEqual(self.server.get("/v1/jobs", {"Cookie": pair}).status, 401)

    def test_sessions_survive_a_restart(self):
        pair = self.cookie().split(";")[0]
        self.server.stop()
        self.server.key = "k"
        self.server.start()
        self.server.key = None
        self.assertEqual(self.server.get("/v1/jobs", {"Cookie": pair}).status, 200)


class Headers(ApiTest):
    def test_no_answer_may_be_framed_or_execute_its_content(self):
        for path in ("/", "/docs", "/openapi.json", "/v1/server", "/v1/nothing", "/livez"):
            headers = self.server.get(path).headers
            policy = headers["Content-Security-Policy"]
            self.assertIn("frame-ancestors 'none'", policy, path)
            self.assertIn("default-src 'none'", policy, path)
            scripts = re.search(r"script-src ([^;]*)", policy)
            runs = path in ("/", "/docs", "/openapi.json")  # files of the page
            self.assertEqual(scripts and scripts[1], "'self'" if runs else None, path)
            self.assertEqual(headers["Referrer-Policy"], "no-referrer", path)

    def test_page_and_its_files_comply_with_the_policy(self):
        for path in ("/", "/docs"):
            text = self.server.get(path).body.decode()
            self.assertEqual(re.findall(r"<script(?![^>]*\bsrc=)[^>]*>", text), [], path)
            self.assertEqual(re.findall(r"\son[a-z]+=|\sstyle=|javascript:|<style", text), [], path)


class Start(unittest.TestCase):
    def test_warns_about_a_key_on_the_command_line_of_an_open_server(self):
        for listen, warned in (("0.0.0.0", True), ("127.0.0.1", False)):
            data = tempfile.mkdtemp(prefix="tessera-start-")
            self.addCleanup(shutil.rmtree, data, ignore_errors=True)
            process = subprocess.Popen(
                [
                    BINARY,
                    "serve",
                    "--port",
                    "0",
                    "--data",
                    data,
                    "--listen",
                    listen,
                    "--key",
                    "of-mine",
                ],
                stdout=subprocess.PIPE,
                stderr=subprocess.PIPE,
                text=True,
            )
            self.assertIn("listening on", process.stdout.readline())
            process.terminate()
            _, said = process.communicate(timeout=PATIENCE_S)
            self.assertEqual("can be read by every user" in said, warned, said)
            self.assertNotIn("of-mine", said)

    def test_invalid_networks_are_wrong_usage(self):
        said = subprocess.run(
            [BINARY, "serve", "--trusted-proxies", "10.0.0.0/8,nonsense"],
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
            check=False,
        )
        self.assertEqual(said.returncode, 2)
        self.assertIn("nonsense", said.stderr)


class Unit(unittest.TestCase):
    """The commands of the systemd unit, with test folders instead of system ones."""

    def test_unit_instructions_work(self):
        root = tempfile.mkdtemp(prefix="tessera-unit-")
        self.addCleanup(shutil.rmtree, root)
        with open(f"{DOCKER}/tessera.service", encoding="utf-8") as file:
            unit = file.read()
        self.assertNotIn("DynamicUser", unit)  # Nobody else could run as that user to add a key.
        group = subprocess.run(
            ["id", "-gn"], capture_output=True, text=True, check=True
        ).stdout.strip()
        paths = {"/etc/tessera": f"{root}/etc", "/var/lib/tessera": f"{root}/lib",
                 "/usr/local/bin/tessera": os.path.abspath(BINARY)}
        for name in ("etc", "lib"):
            os.mkdir(f"{root}/{name}")

        def here(text):
            for there, place in paths.items():
                text = text.replace(there, place)
            return text

        def setting(name):
            return re.search(rf"^{name}=(.*)$", unit, re.M)[1]

        self.assertEqual(setting("UMask"), "0077")
        prepare = here(setting("ExecStartPre").lstrip("+")).replace("-g tessera", f"-g {group}")
        subprocess.run(["sh", "-c", f"umask 077; {prepare}"], check=True)
        mode = os.stat(f"{root}/etc/tessera.conf").st_mode & 0o777
        self.assertEqual(
            mode, 0o640, "only the service, which is not root, must be able to read it"
        )
        environ = {"PATH": os.environ["PATH"], **dict([here(setting("Environment")).split("=", 1)])}
        with open(f"{root}/etc/tessera.conf", "w", encoding="utf-8") as file:
            file.write("port = 0\n")
        process = subprocess.Popen(
            here(setting("ExecStart")).split(),
            env=environ,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
            stdin=subprocess.DEVNULL,
            text=True,
        )
        self.addCleanup(process.kill)
        port = int(process.stdout.readline().rsplit(":", 1)[1])
        add = re.search(r"`runuser -u tessera -- (tessera keys add NAME .*?)`", unit)[1]
        added = subprocess.run(
            here(add).replace("tessera keys", f"{os.path.abspath(BINARY)} keys", 1).split(),
            env=environ,
            capture_output=True,
            text=True,
            check=True,
        ).stdout
        key = re.search(r"tsk_\w+", added)[0]
        statuses, deadline = {}, time.monotonic() + PATIENCE_S
        while statuses != {None: 401, key: 200}:
            self.assertLess(time.monotonic(), deadline, statuses)
            for bearer in (None, key):
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
                connection.request("GET", "/v1/server",
                                   headers={"Authorization": "Bearer " + bearer} if bearer else {})
                statuses[bearer] = connection.getresponse().status
                connection.close()
        reload = setting("ExecReload").replace("$MAINPID", str(process.pid))
        subprocess.run(reload.split(), check=True)
        while '"reloaded"' not in (line := process.stderr.readline()):
            self.assertTrue(line, "the service has ended")
        process.terminate()
        process.communicate(timeout=PATIENCE_S)
        self.assertEqual(process.returncode, 0)
