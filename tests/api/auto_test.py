"""Integrator auto: the job reports its choice and the reason, and renders like that integrator."""

from harness import ApiTest, job_body


def body(integrator, **members):
    wanted = job_body(samples=8, **members)
    wanted["film"] = {"width": 40, "height": 30, "layers": []}
    wanted["integrator"] = {"type": integrator, "max_depth": 4}
    return wanted


class Auto(ApiTest):
    def test_job_reports_the_choice_and_the_reason(self):
        job = self.server.render(body("auto"))
        chosen = job["spec"]["integrator"]["type"]
        self.assertIn(chosen, ("path", "bdpt"))
        said = [w for w in job["warnings"] if w.startswith("integrator.type:")]
        self.assertEqual(len(said), 1)
        self.assertIn(f"chose '{chosen}', since", said[0])
        named = self.server.render(body(chosen))
        self.assertEqual(job["film_digest"], named["film_digest"])
        other = self.server.render(body("bdpt" if chosen == "path" else "path"))
        self.assertNotEqual(job["film_digest"], other["film_digest"])

    def test_photons_only_without_an_error_target(self):
        job = self.server.render(body("auto", scene="caustic-pool"))
        chosen = job["spec"]["integrator"]["type"]
        self.assertIn(chosen, ("sppm", "path-caustics"), job["warnings"])
        self.assertEqual((job["error"]["bias"], job["error"]["valid"]), ("consistent", True))
        target = body("auto", scene="caustic-pool",
                      stop={"relative_error": 0.5, "samples_per_pixel": 8})
        job = self.server.render(target)
        self.assertIn(job["spec"]["integrator"]["type"], ("path", "bdpt"))
        self.assertTrue(job["error"]["valid"])

    def test_caustics_make_path_trace_photons_where_the_camera_sees_some(self):
        for scene, caustics, chosen in (("caustic-pool", "on", "path-caustics"),
                                        ("cornell-box", "auto", "path")):
            wanted = body("path", scene=scene)
            wanted["integrator"]["caustics"] = caustics
            job = self.server.render(wanted)
            said = [w for w in job["warnings"] if w.startswith("integrator.caustics:")]
            self.assertEqual(len(said), 1)
            self.assertEqual(job["spec"]["integrator"]["type"], chosen, said)
            self.assertNotIn("caustics", job["spec"]["integrator"])
            named = self.server.render(body(chosen, scene=scene))
            self.assertEqual(job["film_digest"], named["film_digest"])
            self.assertEqual(job["error"]["bias"], named["error"]["bias"])

    def test_path_has_its_own_defaults(self):
        # Fog is path's, so no pilot is needed.
        fog = {"type": "homogeneous", "scattering": [0.1, 0.1, 0.1], "absorption": [0, 0, 0]}
        job = self.server.render(body("auto", medium=fog))
        named = self.server.render(body("path", medium=fog))
        self.assertEqual(job["spec"]["estimator"], named["spec"]["estimator"])
        self.assertEqual(job["film_digest"], named["film_digest"])

    def test_parts_of_an_image_agree(self):
        parts = []
        for first in (0, 2):
            sampler = {"type": "sobol", "replicates": 2, "first_replicate": first}
            parts.append(self.server.render(body("auto", sampler=sampler))["id"])
        merged = self.server.post("/v1/films/merge", {"films": parts})
        self.assertEqual(merged.status, 201, merged)

    def test_refuses_options_of_a_single_integrator(self):
        wanted = body("auto", estimator={"strategy": "light"})
        self.assert_problem(self.server.post("/v1/jobs", wanted), 422, "/estimator/strategy")
        row = [r for r in self.server.get("/v1/server").json()["integrators"]
               if r["type"] == "auto"]
        self.assertEqual(row[0]["bias"], "none")

    def test_measured_light_sampler_is_the_default_and_survives_a_restart(self):
        for scene, chosen in (("cornell-box", "tree"), ("veach-mis", "ris")):
            wanted = body("path", scene=scene)
            queued = self.server.post("/v1/jobs", wanted).json()
            self.assertEqual(queued["spec"]["light_sampler"], {"type": "measured"})
            job = self.server.render(wanted)
            self.assertFalse([w for w in job["warnings"] if w.startswith("light_sampler")])
            self.assertEqual(job["spec"]["light_sampler"]["type"], chosen)
            named = body("path", scene=scene, light_sampler=job["spec"]["light_sampler"])
            self.assertEqual(job["film_digest"], self.server.render(named)["film_digest"])
            # Any part and any seed of the image makes the same choice.
            other = self.server.render(wanted | {"seed": 7})
            self.assertEqual(other["spec"]["light_sampler"]["type"], chosen)
        self.server.kill()
        self.server.start()
        self.assertEqual(self.server.job(job["id"])["spec"]["light_sampler"]["type"], chosen)

    def test_measured_needs_an_integrator_that_samples_lights(self):
        wanted = body("bdpt", light_sampler={"type": "measured"})
        self.assert_problem(self.server.post("/v1/jobs", wanted), 422, "/light_sampler")

    def test_dry_run_estimates_the_cost(self):
        answer = self.server.post("/v1/jobs?dry_run=1", body("auto"))
        self.assertEqual(answer.status, 200, answer)
