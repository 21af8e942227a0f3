"""Keys, tokens and certificates for a NATS server, made with openssl.

Formats: NATS ADR-14 (JWT) and github.com/nats-io/nkeys (seeds and public keys).
"""

import base64
import binascii
import hashlib
import json
import os
import subprocess
import tempfile

OPERATOR, ACCOUNT, USER, SEED = 14 << 3, 0, 20 << 3, 18 << 3


def openssl(*words, data=None):
    done = subprocess.run(["openssl", *words], input=data, capture_output=True, check=True)
    return done.stdout


def base32(data):
    # CRC-16/XMODEM, little endian, follows the encoded bytes.
    return base64.b32encode(data + binascii.crc_hqx(data, 0).to_bytes(2, "little")).decode(
        ).rstrip("=")


def base64url(data):
    return base64.urlsafe_b64encode(data).decode().rstrip("=")


class Key:
    def __init__(self, kind):
        self.pem = openssl("genpkey", "-algorithm", "ed25519")
        # The raw key is the last 32 bytes of either form.
        private = openssl("pkey", "-outform", "DER", data=self.pem)[-32:]
        public = openssl("pkey", "-pubout", "-outform", "DER", data=self.pem)[-32:]
        self.name = base32(bytes([kind]) + public)
        self.seed = base32(bytes([SEED | kind >> 5, (kind & 31) << 3]) + private)

    def sign(self, text):
        with tempfile.TemporaryDirectory() as folder:
            paths = [os.path.join(folder, name) for name in ("key", "text")]
            for path, data in zip(paths, (self.pem, text.encode()), strict=True):
                with open(path, "wb") as file:
                    file.write(data)
            return openssl("pkeyutl", "-sign", "-rawin", "-inkey", paths[0], "-in", paths[1])

    def token(self, subject, kind, **claims):
        """A JWT signed with this key."""
        body = {"iat": 1, "iss": self.name, "name": kind, "sub": subject.name,
                "nats": {"type": kind, "version": 2, **claims}}
        body["jti"] = base64.b32encode(hashlib.sha256(json.dumps(body).encode()).digest()
                                       ).decode().rstrip("=")
        head = {"typ": "JWT", "alg": "ed25519-nkey"}
        text = ".".join(base64url(json.dumps(part).encode()) for part in (head, body))
        return text + "." + base64url(self.sign(text))


def write_credentials(folder):
    """Returns lines for a server's configuration and a file for its clients."""
    operator, account, system, user = Key(OPERATOR), Key(ACCOUNT), Key(ACCOUNT), Key(USER)
    every = {name: -1 for name in ("subs", "data", "payload", "imports", "exports", "conn", "leaf",
                                   "mem_storage", "disk_storage", "streams", "consumer")}
    tokens = {
        account.name: operator.token(account, "account", limits=every | {"wildcards": True}),
        system.name: operator.token(system, "account", limits={k: -1 for k in (
            "subs", "data", "payload", "imports", "exports", "conn", "leaf")}),
    }
    lines = [f"operator: {operator.token(operator, 'operator')}",
             f"system_account: {system.name}", "resolver: MEMORY", "resolver_preload: {",
             *(f"  {name}: {token}" for name, token in tokens.items()), "}"]
    path = os.path.join(folder, "worker.creds")
    with open(path, "w", encoding="ascii") as file:
        file.write("-----BEGIN NATS USER JWT-----\n"
                   f"{account.token(user, 'user', subs=-1, data=-1, payload=-1)}\n"
                   "------END NATS USER JWT------\n\n-----BEGIN USER NKEY SEED-----\n"
                   f"{user.seed}\n------END USER NKEY SEED------\n")
    return lines, path


def write_certificate(folder):
    """Returns lines for a server's configuration and the certificate that verifies it."""
    key, certificate = (os.path.join(folder, name) for name in ("key.pem", "cert.pem"))
    openssl("req", "-x509", "-newkey", "ec", "-pkeyopt", "ec_paramgen_curve:prime256v1", "-nodes",
            "-keyout", key, "-out", certificate, "-days", "2", "-subj", "/CN=nats",
            "-addext", "subjectAltName=IP:127.0.0.1")
    return [f'tls: {{ cert_file: "{certificate}", key_file: "{key}" }}'], certificate
