"""Damaged and lost files of the data directory are told, and nothing of them is served as good."""

import os
import unittest

from harness import Server, job_body, tessera, triangle_glb

GLB = {"Content-Type": "model/gltf-binary"}


def flip(path, at):
    with open(path, "r+b") as file:
        file.seek(at)
        byte = file.read(1)[0]
        file.seek(at)
        file.write(bytes([byte ^ 1]))


class LossesTest(unittest.TestCase):
    def setUp(self):
        self.server = Server().start()
        self.addCleanup(self.server.close)

    def films(self):
        return sorted(os.listdir(self.server.data + "/films"))

    def check(self, *flags):
        return tessera("check", *flags, "--data", self.server.data)

    def test_a_flipped_bit_of_the_log_is_told_and_removes_no_film(self):
        for seed in range(3):
            self.server.render(job_body(samples=2) | {"seed": seed})
        self.server.kill()
        log = self.server.data + "/tessera.db-wal"
        self.assertGreater(os.path.getsize(log), 4000)
        flip(log, 32 + 24 + 100)
        films = self.films()
        code, said, _ = self.check()
        self.assertEqual(code, 1)
        self.assertIn("write-ahead log is damaged", said)
        self.server.start()
        self.assertIn("database_damaged", self.server.log_text())
        self.server.stop()
        self.check("--repair")
        self.assertEqual(self.films(), films)

    def test_repair_moves_orphans_aside(self):
        self.server.render(job_body(samples=2))
        self.server.stop()
        with open(self.server.data + "/films/stray.film", "wb") as file:
            file.write(b"x")
        code, said, fault = self.check("--repair")
        self.assertEqual(code, 0, said + fault)
        self.assertEqual(os.listdir(self.server.data + "/orphaned"), ["stray.film"])

    def test_a_flipped_bit_of_a_scene_is_told_until_it_is_sent_again(self):
        body = triangle_glb()
        scene = self.server.post("/v1/scenes", body, GLB).json()["id"]
        good = self.server.render(job_body(scene, samples=2))
        self.server.stop()
        path = f"{self.server.data}/assets/{scene[:2]}/{scene}"
        flip(path, len(body) - 9)
        self.server.start()
        read = self.server.get("/v1/assets/" + scene)
        self.assertEqual(read.status, 500, read)
        self.assertIn("damaged", read.json()["detail"])
        job = self.server.wait(self.server.submit(job_body(scene, samples=2))["id"])
        self.assertEqual(job["state"], "failed")
        self.assertIn("upload it again", job["failure"]["detail"])
        self.assertNotIn(self.server.data, str(job))
        self.assertEqual(self.server.post("/v1/scenes", body, GLB).status, 200)
        self.assertEqual(self.server.render(job_body(scene, samples=2))["film_digest"],
                         good["film_digest"])
        os.remove(path)
        self.assertEqual(self.server.get("/v1/assets/" + scene).status, 500)

    def test_a_form_is_no_asset(self):
        form = b'--x\r\nContent-Disposition: form-data; name="file"\r\n\r\nabc\r\n--x--\r\n'
        for method, path in (("POST", "/v1/assets"), ("PUT", "/v1/assets/" + "0" * 64)):
            refused = self.server.request(method, path, form,
                                          {"Content-Type": "multipart/form-data; boundary=x"})
            self.assertEqual(refused.status, 415, refused)
            self.assertIn("--data-binary", refused.json()["detail"])


if __name__ == "__main__":
    unittest.main()
