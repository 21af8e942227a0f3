"""The surroundings of a model: backgrounds, procedural light, ground."""

import re

from harness import ApiTest, job_body, png_pixels, triangle_glb


class Stage(ApiTest):
    def picture(self, query="", height=32, **members):
        body = job_body("furnace", samples=8, **members)
        body["film"] = {"width": 48, "height": height}
        job = self.server.render(body)
        self.assertEqual(job["state"], "finished", job)
        answer = self.server.get(f"/v1/jobs/{job['id']}/image.png{query}")
        return job, png_pixels(answer.body)

    def test_color_is_composited_behind_the_scene(self):
        job, rows = self.picture("?curve=srgb", background={"type": "color", "color": [0, 0, 1]})
        self.assertEqual(job["spec"]["background"], {"type": "color", "color": [0, 0, 1]})
        self.assertEqual(tuple(rows[0][0]), (0, 0, 255))

    def test_presets_and_the_sun_light_the_scene(self):
        sun = {"latitude": 52.5, "longitude": 13.4, "time": "2026-06-21T10:00:00Z"}
        for environment in ({"preset": "studio"}, {"preset": "tent"}, {"preset": "rim"},
                            {"sun": sun, "intensity": 1e-4}):
            job, rows = self.picture(environment=environment,
                                     background={"type": "blurred"})
            shades = {pixel for row in rows for pixel in map(tuple, row)}
            self.assertGreater(len(shades), 20, environment)
            for name, value in environment.items():
                self.assertEqual(job["spec"]["environment"][name], value)

    def test_catcher_has_alpha_in_its_shadow_and_composites_over_a_color(self):
        job, rows = self.picture(ground={"type": "catcher"}, environment={"preset": "studio"})
        self.assertEqual(job["spec"]["background"], {"type": "transparent"})
        alphas = [pixel[3] for row in rows for pixel in row]
        self.assertTrue(any(20 < a < 200 for a in alphas), "no shadow")
        self.assertTrue(job["error"]["valid"])
        self.assertLess(job["error"]["low"], job["error"]["high"])
        image = f"/v1/jobs/{job['id']}/image.png?denoise=full"
        denoised = [p[3] for row in png_pixels(self.server.get(image).body) for p in row]
        self.assertTrue(any(20 < a < 200 for a in denoised), "no shadow")
        # Denoising smooths the alpha of the shadow: smaller differences between neighbours.
        steps = [sum(abs(a - b) for a, b in zip(alpha, alpha[1:])) for alpha in (alphas, denoised)]
        self.assertLess(steps[1], steps[0])
        # As in the undenoised image: the shadow is darker than the white under it.
        white = png_pixels(
            self.server.get(f"/v1/jobs/{job['id']}/image.png?background=ffffff").body
        )
        self.assertEqual(len(white[0][0]), 3)

    def test_shadow_is_neutral_unless_physical_is_asked_for(self):
        sun = {"latitude": 52.5, "longitude": 13.4, "time": "2026-06-21T07:00:00Z"}
        pictures = {}
        for color in ("neutral", "physical"):
            shadow = {} if color == "neutral" else {"shadow": {"color": color}}
            job, rows = self.picture(
                ground={"type": "catcher", **shadow},
                environment={"sun": sun},
                query="?exposure=auto",
            )
            self.assertEqual("shadow" in job["spec"]["ground"], color == "physical")
            pictures[color] = [pixel for row in rows for pixel in row]
        # Others with an alpha are glass and edges of the model.
        shadow = [i for i, p in enumerate(pictures["neutral"]) if p[3] > 30 and p[:3] == (0, 0, 0)]
        self.assertGreater(len(shadow), 20)
        blue = [i for i in shadow if pictures["physical"][i][2] > pictures["physical"][i][0] + 20]
        self.assertGreater(len(blue), len(shadow) / 4, "the light of the sky is left")

    def test_refuses_shadows_and_glass_with_their_pointer(self):
        for members, pointer in (
            ({"ground": {"type": "sweep", "shadow": {"strength": 1}}}, "/ground/shadow"),
            ({"ground": {"type": "catcher", "shadow": {"strength": 2}}}, "/ground/shadow/strength"),
            ({"ground": {"type": "catcher", "shadow": {"softness": -1}}},
             "/ground/shadow/softness"),
            ({"ground": {"type": "catcher", "shadow": {"color": "blue"}}}, "/ground/shadow/color"),
            ({"background": {"type": "environment", "through_glass": True}},
             "/background/through_glass"),
            ({"background": {"type": "transparent", "through_glass": True},
              "integrator": {"type": "mlt"}}, "/background/through_glass"),
            ({"units": "radiometric"}, "/units"),
        ):
            answer = self.server.post("/v1/jobs", job_body("furnace", **members))
            self.assert_problem(answer, 422, pointer)

    def test_glass_lets_the_page_through(self):
        # A clear pane in the form of a triangle.
        primitive = {"attributes": {"POSITION": 0}, "material": 0}
        pane = {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0},
                "extensions": {"KHR_materials_transmission": {"transmissionFactor": 1}}}
        model = triangle_glb(meshes=[{"primitives": [primitive]}], materials=[pane],
                             extensionsUsed=["KHR_materials_transmission"])
        scene = self.server.post("/v1/scenes", model, {"Content-Type": "model/gltf-binary"})
        self.assertIn(scene.status, (200, 201), scene)

        def middle(**background):
            body = job_body(scene.json()["id"], samples=64,
                            background={"type": "transparent", **background},
                            environment={"color": [1, 1, 1]})
            body["film"] = {"width": 32, "height": 32}
            job = self.server.render(body)
            self.assertEqual(job["spec"]["background"], {"type": "transparent", **background})
            rows = png_pixels(self.server.get(f"/v1/jobs/{job['id']}/image.png").body)
            return rows[16][16][3]

        # Index 1.5 reflects 4%, a little more at the camera's angle: 10 of 255.
        self.assertLess(abs(middle() - 10), 25)
        self.assertEqual(middle(through_glass=False), 255)

    def test_a_clipped_picture_says_so_and_names_an_exposure(self):
        sun = {"latitude": 40, "longitude": 0, "time": "2026-06-21T12:00:00Z"}
        job, _ = self.picture(environment={"sun": sun})
        told = [w for w in job["warnings"] if "above 1" in w]
        self.assertEqual(len(told), 1, job["warnings"])
        exposure = float(re.search(r"exposure=(-[0-9.]+) shows", told[0])[1])
        auto = self.server.get(f"/v1/jobs/{job['id']}/image.png?exposure=auto")
        self.assertEqual(float(auto.headers["X-Tessera-Exposure"]), exposure)
        shades = {p for row in png_pixels(auto.body) for p in map(tuple, row)}
        self.assertGreater(len(shades), 20)
        # Told once, also after more samples.
        path = f"/v1/jobs/{job['id']}"
        self.assertEqual(self.server.post(f"{path}/extend", {"stop": {"samples_per_pixel": 16}})
                         .status, 202)
        again = self.server.wait(job["id"])
        self.assertEqual(len([w for w in again["warnings"] if "above 1" in w]), 1)
        dim, _ = self.picture(environment={"color": [1, 1, 1]})
        self.assertFalse([w for w in dim["warnings"] if "above 1" in w])

    def test_denoised_alpha_is_that_of_its_own_pixel(self):
        # Higher than the bands of 32 rows in which images are encoded.
        job, rows = self.picture(height=80, ground={"type": "catcher"},
                                 environment={"preset": "studio"})
        image = f"/v1/jobs/{job['id']}/image.png?denoise=full"
        denoised = png_pixels(self.server.get(image).body)
        wrong = [
            (x, y)
            for y in range(80)
            for x in range(48)
            if abs(rows[y][x][3] - denoised[y][x][3]) > 127
        ]
        # Shadows are noisy at 8 samples, the model is not: 1% of the pixels.
        self.assertLess(len(wrong), 80 * 48 // 100, wrong)

    def test_sweep_fills_the_image_but_is_not_part_of_the_model(self):
        job, rows = self.picture(ground={"type": "sweep"}, background={"type": "transparent"})
        self.assertEqual({pixel[3] for row in rows for pixel in row}, {255})
        self.assertEqual(job["spec"]["ground"],
                         {"type": "sweep", "height": None, "color": [0.8, 0.8, 0.8],
                          "reflection": 0})
        # A second job with another view has a separate sweep.
        camera = {"orbit": {"theta_degrees": 120, "phi_degrees": 70}}
        _, other = self.picture(ground={"type": "sweep"}, camera=camera,
                                background={"type": "transparent"})
        self.assertEqual({pixel[3] for row in other for pixel in row}, {255})

    def test_polished_ground_is_in_the_spec_and_in_the_image(self):
        # Seen at a low angle, where a clear coat reflects much.
        camera = {"orbit": {"theta_degrees": 0, "phi_degrees": 80}}
        pictures = [
            self.picture(ground={"type": "catcher", "reflection": polish}, camera=camera,
                         environment={"preset": "studio"})
            for polish in (0, 1)
        ]
        for (job, _), polish in zip(pictures, (0, 1)):
            self.assertEqual(job["spec"]["ground"]["reflection"], polish)
        # Scenes with different coats are distinct.
        self.assertNotEqual(pictures[0][1], pictures[1][1])
        self.assert_problem(
            self.server.post("/v1/jobs", job_body("furnace", ground={"type": "catcher",
                                                                     "reflection": 1.5})),
            422, "/ground/reflection")
        self.assert_problem(
            self.server.post("/v1/jobs", job_body("furnace", ground={"reflection": 1})),
            422, "/ground/reflection")

    def test_refuses_contradictions_with_their_pointer(self):
        for members, pointer in (
            ({"environment": {"visible": True}, "background": {"type": "transparent"}},
             "/environment/visible"),
            ({"ground": {"type": "catcher"}, "integrator": {"type": "sppm"}}, "/ground/type"),
            ({"environment": {"sun": {"latitude": 0, "longitude": 0,
                                      "time": "2026-06-21T00:00:00Z"}}},
             "/environment/sun/time"),
        ):
            body = job_body("furnace")
            body.update(members)
            answer = self.server.post("/v1/jobs", body)
            self.assert_problem(answer, 422)
            self.assertEqual([e["pointer"] for e in answer.json()["errors"]], [pointer])
