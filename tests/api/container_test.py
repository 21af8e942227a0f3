"""The container's scripts and the alert rules, each run as it is there."""

import http.client
import os
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

from farm import Broker
from harness import BINARY, PATIENCE_S, started, wait_for

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
        server = started(self)
        path = os.path.dirname(os.path.abspath(BINARY)) + ":/usr/bin:/bin"
        with tempfile.NamedTemporaryFile("wb") as line:
            line.write(b"\0".join([b"tessera", b"serve", b"--port", str(server.port).encode()]))
            line.flush()
            done = subprocess.run(["sh", DOCKER + "/healthcheck", line.name], text=True,
                                  env={"PATH": path, "TESSERA_PORT": "1", "HOME": self.folder},
                                  capture_output=True)
        self.assertEqual(done.returncode, 0, done.stderr)


def read(*names):
    return "\n---\n".join(open(os.path.join(DOCKER, name), encoding="utf-8").read()
                          for name in names)


class Pod:
    """A deployment of the manifests as the kubelet starts it: in the image's environment, that of
    the links to the services, and its own."""

    def __init__(self, name, secrets):
        documents = read("kubernetes.yaml", "kubernetes-workers.yaml").split("\n---\n")
        kinds = [re.search(r"^kind: (.*)$", text, re.M)[1] for text in documents]
        named = [re.search(r"^  name: (.*)$", text, re.M)[1] for text in documents]
        self.text = documents[list(zip(kinds, named)).index(("Deployment", name))]
        self.args = re.search(r"args: \[(.*)\]", self.text)[1].replace('"', "").split(", ")
        self.environ = {}
        for service, text in zip(named, documents if "enableServiceLinks: false" not in self.text
                                 else []):
            for port in re.findall(r"^.*\bport: (\d+)", text, re.M):
                self.environ[service.upper().replace("-", "_") + "_PORT"] = f"tcp://10.0.0.1:{port}"
        plain = r"- name: (\w+)\n +value: (.*)|- {name: (\w+), value: \"?(.*?)\"?}"
        for found in re.findall(plain, self.text):
            self.environ[found[0] or found[2]] = found[1] or found[3]
        for variable, key in re.findall(
                r"- name: (\w+)\n +valueFrom:\n.*, key: (\w+)}", self.text):
            self.environ[variable] = secrets[key]
        self.probes = re.findall(r"httpGet: {path: (\S+), port: http}", self.text)

    def start(self, *args, **image):
        image_environ = re.search(r"^ENV ((?:.*\\\n)*.*)", read("Dockerfile").split("useradd")[1],
                                  re.M)[1].replace("\\\n", "").split()
        environ = dict(pair.split("=") for pair in image_environ) | image | self.environ
        environ["PATH"] = os.path.dirname(os.path.abspath(BINARY)) + ":/usr/bin:/bin"
        return subprocess.Popen(["sh", DOCKER + "/entrypoint", *(args or self.args)], env=environ,
                                stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)


class ManifestsTest(unittest.TestCase):
    def started(self, process):
        self.addCleanup(process.communicate)
        self.addCleanup(process.send_signal, signal.SIGKILL)
        return process.stdout.readline()

    def test_pods_start_and_work_in_their_environment(self):
        folder = tempfile.mkdtemp(prefix="tessera-manifests-")
        self.addCleanup(shutil.rmtree, folder)
        broker = Broker()
        self.addCleanup(broker.kill)
        secrets = {"key": "key-of-the-secret", "TESSERA_WORKER_KEY": "key-of-the-workers",
                   "TESSERA_QUEUE": broker.url}
        server = Pod("tessera", secrets)
        # As `kubectl set env` adds them.
        server.environ |= {k: secrets[k] for k in ("TESSERA_WORKER_KEY", "TESSERA_QUEUE")}
        line = self.started(server.start(TESSERA_PORT="0", TESSERA_DATA=folder + "/data"))
        self.assertRegex(line, r"^listening on http://0\.0\.0\.0:\d+")
        port = int(re.search(r":(\d+)", line)[1])

        def ask(path, host, **headers):
            connection = http.client.HTTPConnection("127.0.0.1", port, timeout=PATIENCE_S)
            connection.request("GET", path, headers={"Host": host, **headers})
            answer = connection.getresponse()
            return answer.status, answer.read().decode()

        self.assertEqual(len(server.probes), 3)
        for probe in server.probes:  # The kubelet asks by the pod's address.
            wait_for(lambda: ask(probe, "10.1.2.3:8080")[0] == 200)
        for host in server.environ["TESSERA_HOSTS"].split(","):
            authorized = {"Authorization": "Bearer " + secrets["key"]}
            self.assertEqual(ask("/v1/workers", host, **authorized)[0], 200)
        worker = Pod("tessera-worker", secrets)
        args = [f"http://127.0.0.1:{port}" if arg == "http://tessera" else arg
                for arg in worker.args]
        self.assertNotEqual(args, worker.args)
        worker.environ["TESSERA_CACHE"] = folder + "/cache"  # The volume.
        self.started(worker.start(*args))
        wait_for(lambda: '"idle"' in ask("/v1/workers", "tessera", **authorized)[1])


class AlertsTest(unittest.TestCase):
    def test_rules_fire_when_they_should(self):
        folder = tempfile.mkdtemp(prefix="tessera-alerts-")
        self.addCleanup(shutil.rmtree, folder)
        shutil.copy(DOCKER + "/prometheus-alerts.yaml", folder)
        shutil.copy(os.path.join(os.path.dirname(__file__), "alerts_test.yaml"), folder)
        done = subprocess.run([PROMTOOL, "test", "rules", folder + "/alerts_test.yaml"],
                              capture_output=True, text=True)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
