"""tessera backup: copies a data directory while a server uses it."""

import json
import os
import stat
import subprocess
import tempfile
import threading

from harness import BINARY, PATIENCE_S, ApiTest, Server, hdr_image, job_body, tessera, triangle_glb

BYTES = {"Content-Type": "application/octet-stream"}
GLB = {"Content-Type": "model/gltf-binary"}


class Backup(ApiTest):
    FLAGS = ("--checkpoint", "0.1")

    def copy(self):
        folder = tempfile.mkdtemp(prefix="tessera-backup-")
        code, said, complaints = tessera("backup", "--data", self.server.data, "--to", folder)
        self.assertEqual(code, 0, said + complaints)
        copy = Server(*self.FLAGS, data=folder)
        self.addCleanup(copy.close)
        return copy

    def test_copy_of_a_busy_server_is_valid_and_continues(self):
        scene = self.server.post("/v1/scenes", triangle_glb(), GLB).json()["id"]
        done = self.server.render(job_body(scene))
        body = job_body(samples=256)
        body["film"] = {"width": 128, "height": 128, "layers": []}
        calm = self.server.render(body)["film_digest"]
        busy = self.server.submit(body)["id"]
        self.server.wait_for_samples(busy, 64)
        stopped = threading.Event()

        def upload():
            number = 0
            while not stopped.wait(0.01):
                number += 1
                self.server.post("/v1/assets", hdr_image(4, 4, (number, 0, 0)), BYTES)

        uploading = threading.Thread(target=upload)
        uploading.start()
        copy = self.copy()
        stopped.set()
        uploading.join()
        self.assertEqual(stat.S_IMODE(os.stat(copy.data + "/tessera.db").st_mode), 0o600)
        code, said, complaints = tessera("check", "--json", "--data", copy.data)
        self.assertEqual((code, json.loads(said)["damages"]), (0, []), complaints)
        copy.start()
        self.assertEqual(copy.get(f"/v1/jobs/{done['id']}/image.png").body,
                         self.server.get(f"/v1/jobs/{done['id']}/image.png").body)
        self.assertEqual(copy.wait(busy)["film_digest"], calm)
        self.assertEqual(copy.render(job_body(scene))["film_digest"], done["film_digest"])

    def test_copy_can_be_checked_where_nothing_can_be_written(self):
        self.server.render(job_body())
        copy = self.copy()

        def check(*flags):
            # Root may write anywhere except to a file system that is mounted read-only.
            script = 'mount --bind "$1" "$1" && mount -o remount,bind,ro "$1" && shift && exec "$@"'
            return subprocess.run(
                ["unshare", "--mount", "sh", "-c", script, "sh", copy.data,
                 BINARY, "check", "--json", "--data", copy.data, *flags],
                capture_output=True, text=True, timeout=PATIENCE_S, check=False)

        if os.geteuid() != 0:
            self.skipTest("only root can mount a folder read-only")
        before = {name: os.stat(os.path.join(copy.data, name)).st_mtime_ns
                  for name in os.listdir(copy.data)}
        whole = check()
        self.assertEqual((whole.returncode, json.loads(whole.stdout)["damages"]), (0, []), whole)
        self.assertGreater(json.loads(whole.stdout)["films"], 0)
        after = {name: os.stat(os.path.join(copy.data, name)).st_mtime_ns
                 for name in os.listdir(copy.data)}
        self.assertEqual(after, before)
        self.assertEqual(check("--repair").returncode, 1)
        films = os.path.join(copy.data, "films")
        with open(os.path.join(films, os.listdir(films)[0]), "r+b") as film:
            film.seek(-100, os.SEEK_END)
            byte = film.read(1)
            film.seek(-1, os.SEEK_CUR)
            film.write(bytes([byte[0] ^ 1]))
        broken = check()
        self.assertEqual(broken.returncode, 1, broken)
        self.assertEqual(len(json.loads(broken.stdout)["damages"]), 1, broken)

    def test_damaged_film_is_named_and_copied_like_the_others(self):
        damaged = self.server.render(job_body())["id"]
        whole = self.server.render(job_body(samples=4))["id"]
        film = f"films/{damaged}.film"
        with open(f"{self.server.data}/{film}", "r+b") as file:
            size = os.path.getsize(file.name)
            for at in range(size - 2048, size, 64):  # of its last tile
                file.seek(at)
                byte = file.read(1)[0]
                file.seek(at)
                file.write(bytes([byte ^ 1]))
        with tempfile.TemporaryDirectory() as folder:
            code, said, complaints = tessera("backup", "--data", self.server.data, "--to", folder)
            self.assertEqual(code, 0, said + complaints)
            self.assertIn(damaged, complaints)
            self.assertNotIn(whole, complaints)
            with open(f"{folder}/{film}", "rb") as copy, \
                    open(f"{self.server.data}/{film}", "rb") as own:
                self.assertEqual(copy.read(), own.read())
            self.assertTrue(os.path.exists(f"{folder}/films/{whole}.film"))

    def test_film_that_lost_its_only_checkpoint_is_named(self):
        lost = {
            "cut": lambda _: b"",
            "changed": lambda content: bytes(byte ^ (byte != 0) for byte in content),
        }
        for name, lose in lost.items():
            job = self.server.render(job_body(samples=4))["id"]
            film = f"{self.server.data}/films/{job}.film"
            with open(film, "rb") as file:
                content = lose(file.read())
            with open(film, "wb") as file:
                file.write(content)
            with self.subTest(name), tempfile.TemporaryDirectory() as folder:
                code, said, complaints = tessera(
                    "backup", "--data", self.server.data, "--to", folder)
                self.assertEqual(code, 0, said + complaints)
                self.assertIn(job, complaints)

    def test_refuses_a_directory_that_is_not_empty(self):
        code, _, said = tessera("backup", "--data", self.server.data, "--to", self.server.data)
        self.assertEqual(code, 1)
        self.assertIn("not empty", said)
        self.assertEqual(tessera("backup", "--data", self.server.data)[0], 2)
        with tempfile.TemporaryDirectory() as empty:
            self.assertEqual(tessera("backup", "--data", empty, "--to", empty + "/copy")[0], 1)
