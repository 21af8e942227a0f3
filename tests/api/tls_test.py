"""The same service over TLS, with a given certificate."""

import errno
import http.client
import json
import os
import shutil
import socket
import ssl
import subprocess
import tempfile
import unittest

from harness import PATIENCE_S, EventStream, Server, job_body


class SecureServer(Server):
    """Speaks https; its clients trust only its certificate."""

    def connect(self, timeout=PATIENCE_S):
        trust = ssl.create_default_context(cafile=self.certificate)
        return http.client.HTTPSConnection("localhost", self.port, timeout=timeout, context=trust)


class Tls(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.mkdtemp(prefix="tessera-tls-")
        cls.addClassCleanup(shutil.rmtree, cls.folder)
        cls.cert, cls.key = (os.path.join(cls.folder, name) for name in ("cert.pem", "key.pem"))
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
                cls.key,
                "-out",
                cls.cert,
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
        cls.server = SecureServer(
            "--tls-cert", cls.cert, "--tls-key", cls.key, "--key", "k", key="k", scheme="https"
        )
        cls.server.certificate = cls.cert
        cls.addClassCleanup(cls.server.close)
        cls.server.start()

    def test_uploads_jobs_streams_and_images_work(self):
        data = os.urandom(3 << 20)
        asset = self.server.post(
            "/v1/assets", data, {"Content-Type": "application/octet-stream"}
        ).json()["id"]
        self.assertEqual(self.server.get("/v1/assets/" + asset).body, data)
        part = self.server.get("/v1/assets/" + asset, {"Range": "bytes=1000000-1999999"})
        self.assertEqual((part.status, part.body), (206, data[1000000:2000000]))
        job = self.server.submit(job_body(samples=64))["id"]
        with EventStream(self.server, job) as stream:
            names = [event.name for event in stream]
        self.assertEqual((names[0], names[-1]), ("snapshot", "end"))
        self.assertEqual(self.server.get(f"/v1/jobs/{job}/image.png").body[:4], b"\x89PNG")

    def test_ciphers_are_authenticated_and_have_forward_secrecy(self):
        def cipher(names, version=ssl.TLSVersion.TLSv1_2):
            trust = ssl.create_default_context(cafile=self.cert)
            trust.maximum_version = version
            trust.set_ciphers(names)
            with socket.create_connection(("127.0.0.1", self.server.port)) as plain:
                with trust.wrap_socket(plain, server_hostname="localhost") as line:
                    return line.cipher()[0]

        weak = "ECDHE-ECDSA-AES128-SHA:ECDHE-ECDSA-AES256-SHA:ECDHE-ECDSA-AES128-SHA256"
        with self.assertRaises(ssl.SSLError):
            cipher(weak + ":@SECLEVEL=0")
        self.assertEqual(cipher(weak + ":ECDHE-ECDSA-AES128-GCM-SHA256"),
                         "ECDHE-ECDSA-AES128-GCM-SHA256")
        self.assertIn("CHACHA20", cipher("ECDHE-ECDSA-CHACHA20-POLY1305"))
        self.assertTrue(cipher(weak, ssl.TLSVersion.TLSv1_3).startswith("TLS_"))

    def test_one_connection_serves_many_requests(self):
        connection = self.server.connect()
        for _ in range(5):
            connection.request("GET", "/v1/server", headers=self.server.with_key({}))
            answer = connection.getresponse()
            self.assertEqual(answer.status, 200)
            json.loads(answer.read())
        connection.close()

    def test_cookie_is_for_secure_connections(self):
        cookie = self.server.post("/v1/session").headers["Set-Cookie"]
        self.assertIn("Secure", cookie)

    def test_closes_connections_without_tls(self):
        for data in (
            b"GET / HTTP/1.1\r\nHost: localhost\r\n\r\n",
            b"\x16\x03\x01\xff\xff" + b"\x00" * 100,
            b"\x00",
        ):
            with socket.create_connection(
                ("127.0.0.1", self.server.port), timeout=PATIENCE_S
            ) as plug:
                try:
                    plug.sendall(data)
                    plug.shutdown(socket.SHUT_WR)
                    while plug.recv(4096):
                        pass
                except OSError as error:  # closed with unread bytes, or before the shutdown
                    self.assertIn(error.errno, (errno.ECONNRESET, errno.EPIPE, errno.ENOTCONN))
        self.assertEqual(self.server.get("/livez").status, 200)

    def test_refuses_old_protocols(self):
        trust = ssl.SSLContext(ssl.PROTOCOL_TLS_CLIENT)
        trust.check_hostname, trust.verify_mode = False, ssl.CERT_NONE
        trust.set_ciphers("DEFAULT:@SECLEVEL=0")
        trust.minimum_version = ssl.TLSVersion.TLSv1
        trust.maximum_version = ssl.TLSVersion.TLSv1_1
        with socket.create_connection(("127.0.0.1", self.server.port), timeout=PATIENCE_S) as plug:
            with self.assertRaises((ssl.SSLError, ConnectionError)):
                trust.wrap_socket(plug, server_hostname="localhost")

    def test_refuses_files_that_are_not_certificates(self):
        for flags, code in (
            (("--tls-cert", self.cert), 2),
            (("--tls-cert", self.key, "--tls-key", self.key), 1),
            (("--tls-cert", self.cert, "--tls-key", self.folder + "/none"), 1),
        ):
            server = Server(*flags)
            self.addCleanup(server.close)
            with self.assertRaises(RuntimeError):
                server.start()
            server.process.stdout.close()
            self.assertEqual(server.process.wait(10), code, flags)
