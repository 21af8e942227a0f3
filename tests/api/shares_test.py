"""Partial images of the light (layers bounce:N and light:NAME), and media around the scene."""

import unittest

from harness import ApiTest, job_body, png_pixels, started

BOUNCES = ["bounce:0", "bounce:1", "bounce:2", "bounce:3-"]


def body(layers, samples=8, **members):
    wanted = job_body(samples=samples, **members)
    wanted["scene"] = "cornell-box"
    wanted["film"] = {"width": 40, "height": 30, "layers": layers}
    return wanted


class Shares(ApiTest):
    def pixel(self, job, x=20, y=15):
        return self.server.get(f"/v1/jobs/{job['id']}/pixels/{x}/{y}").json()["layers"]

    def test_server_lists_the_patterns_and_scenes_their_groups(self):
        self.assertEqual(self.server.get("/v1/server").json()["layer_patterns"],
                         ["irradiance", "bounce:N", "bounce:N-", "light:NAME", "st:S,T",
                          "st:S,T:unweighted"])
        groups = self.server.get("/v1/scenes/cornell-box").json()["light_groups"]
        self.assertEqual(groups[0], "environment")
        self.assertGreater(len(groups), 1)

    def test_bounces_and_groups_add_up_to_the_image(self):
        groups = self.server.get("/v1/scenes/cornell-box").json()["light_groups"]
        for layers in (BOUNCES, ["light:" + name for name in groups]):
            job = self.server.render(body(layers))
            self.assertEqual(job["spec"]["film"]["layers"], layers)
            pixel = self.pixel(job)
            beauty = pixel["beauty"]["mean"]
            for c in range(3):
                total = sum(pixel[layer]["mean"][c] for layer in layers)
                self.assert_close(total, beauty[c], 1e-5 * max(1, beauty[c]))
                lacking = sum(pixel[layer]["mean"][c] for layer in layers[:-1])
                self.assertGreater(abs(lacking - beauty[c]), 1e-3)
            for layer in layers:
                share = pixel[layer]
                self.assertEqual(len(share["halves"]), 2)
                for c in range(3):
                    self.assertLessEqual(share["low"][c], share["mean"][c])

    def test_each_share_is_an_image_and_part_of_the_exr(self):
        job = self.server.render(body(BOUNCES))
        seen = set()
        for layer in BOUNCES:
            picture = self.server.get(f"/v1/jobs/{job['id']}/image.png?layer={layer}")
            self.assertEqual(picture.status, 200)
            seen.add(picture.body)
        self.assertEqual(len(seen), len(BOUNCES))
        exr = self.server.get(f"/v1/jobs/{job['id']}/image.exr").body
        for layer in BOUNCES:
            self.assertIn(layer.encode() + b".G\0", exr)
        other = self.server.get(f"/v1/jobs/{job['id']}/image.png?layer=bounce:7")
        self.assert_problem(other, 422, "/layer")
        none = self.server.get(f"/v1/jobs/{job['id']}/image.png?layer=bounce:x")
        problem = self.assert_problem(none, 422, "/layer")
        self.assertIn("bounce:N, bounce:N-, light:NAME", problem["errors"][0]["detail"])

    def test_mix_scales_shares(self):
        job = self.server.render(body(BOUNCES))
        path = f"/v1/jobs/{job['id']}/image.png?"
        def rows(query):
            answer = self.server.get(path + query)
            self.assertEqual(answer.status, 200, answer)
            return png_pixels(answer.body)
        self.assertEqual(rows("mix=0,1,0,0"), rows("layer=bounce:1"))
        self.assertEqual(rows("mix=1,1,1,1"), rows(""))
        self.assertNotEqual(rows("mix=1,1,1,0"), rows(""))
        self.assertNotEqual(rows("mix=1,1,1,0&layer=error"), rows("layer=error"))
        for query in ("mix=1,1", "mix=1,1,1,x", "mix=1,1,1,1&layer=albedo",
                      "mix=1,1,1,1&denoise=mixed"):
            self.assert_problem(self.server.get(path + query), 422, "/mix")

    def test_mix_weighs_only_parts_of_the_image(self):
        layers = ["bounce:0", "irradiance", "bounce:1-", "st:1,2:unweighted"]
        job = self.server.render(body(layers, integrator={"type": "bdpt"}))
        path = f"/v1/jobs/{job['id']}/image.png?"
        def rows(query):
            answer = self.server.get(path + query)
            self.assertEqual(answer.status, 200, answer)
            return png_pixels(answer.body)
        self.assertEqual(rows("mix=1,1"), rows(""))
        self.assertEqual(rows("mix=0,1"), rows("layer=bounce:1-"))
        self.assertNotEqual(rows("mix=0,1"), rows("layer=irradiance"))
        problem = self.assert_problem(self.server.get(path + "mix=1,0,1,0"), 422, "/mix")
        self.assertIn("the job records 2 light shares", problem["errors"][0]["detail"])

    def test_black_shares_are_warned_of(self):
        layers = ["bounce:4", "bounce:5", "st:4,2", "st:4,3"]
        job = self.server.render(body(layers, integrator={"type": "bdpt", "max_depth": 4}))
        said = [w for w in job["warnings"] if w.startswith("film.layers:")]
        self.assertEqual([w.split("'")[1] for w in said], ["bounce:5", "st:4,3"])
        pixel = self.pixel(job)
        for layer in ("bounce:5", "st:4,3"):
            self.assertEqual(pixel[layer]["mean"], [0, 0, 0])

    def test_parts_merge_to_the_shares_of_the_whole(self):
        replicates = {"type": "sobol", "replicates": 4}
        whole = self.server.render(body(BOUNCES, sampler=replicates))
        parts = []
        for first in (0, 2):
            sampler = {"type": "sobol", "replicates": 2, "first_replicate": first}
            parts.append(self.server.render(body(BOUNCES, samples=4, sampler=sampler))["id"])
        merged = self.server.post("/v1/films/merge", {"films": parts})
        self.assertEqual(merged.status, 201, merged)
        self.assertEqual(merged.json()["film_digest"], whole["film_digest"])
        self.assertEqual(self.pixel(merged.json()), self.pixel(whole))
        film = self.server.get(f"/v1/jobs/{whole['id']}/film").body
        octets = {"Content-Type": "application/octet-stream"}
        asset = self.server.request("POST", "/v1/assets", film, octets).json()["id"]
        again = self.server.post("/v1/films/merge", {"films": [asset]})
        self.assertEqual(again.status, 201, again)
        self.assertEqual(again.json()["film_digest"], whole["film_digest"])
        self.assertEqual(self.pixel(again.json()), self.pixel(whole))

    def test_fog_is_part_of_the_job(self):
        clear = self.server.render(body([]))
        fog = {"type": "homogeneous", "scattering": [0.2, 0.2, 0.2], "absorption": [0.1, 0.1, 0.4],
               "g": 0.5, "height_falloff": 0}
        job = self.server.render(body([], medium=fog))
        self.assertEqual(job["spec"]["medium"], fog)
        self.assertNotEqual(job["film_digest"], clear["film_digest"])
        answer = self.server.post("/v1/jobs", body([], medium=fog, integrator={"type": "mlt"}))
        self.assert_problem(answer, 422, "/medium")


class Restart(unittest.TestCase):
    def test_shares_survive_a_kill(self):
        server = started(self, "--checkpoint", "0.3")
        calm = server.render(body(BOUNCES, 1024))
        job = server.submit(body(BOUNCES, 1024, name="killed"))["id"]
        server.wait_until(job, lambda now: now["progress"]["samples_per_pixel"]["max"] >= 64)
        server.kill()
        server.start(1)
        self.assertEqual(server.wait(job)["film_digest"], calm["film_digest"])
