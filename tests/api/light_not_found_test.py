"""stop.light_not_found: jobs end only when little light may be missing."""

import json
import os

from harness import ApiTest, job_body, tessera, triangle_glb


def small(samples=16, scene="cornell-box", **members):
    film = {"width": 48, "height": 32}
    return job_body(samples=samples, **{"scene": scene, "film": film, **members})


class LightTargets(ApiTest):
    def test_job_ends_when_little_may_be_missing(self):
        stop = {"light_not_found": 0.5, "samples_per_pixel": 1024}
        job = self.server.render(small(stop=stop))
        self.assertEqual(job["stop_reason"], "light_not_found")
        self.assertLess(job["progress"]["samples_per_pixel"]["mean"], 1024)
        self.assertLessEqual(job["light_not_found"]["at_most"], 0.5)
        self.assertEqual(job["spec"]["stop"]["light_not_found"], 0.5)

    def test_error_target_waits_for_it(self):
        # Paths meet the caustics of the pool by chance alone, so they may always be missing.
        stop = {"relative_error": 1, "samples_per_pixel": 16}
        job = self.server.render(small(scene="caustic-pool", stop=stop))
        self.assertEqual(job["stop_reason"], "relative_error")
        stop["light_not_found"] = 1e-5
        job = self.server.render(small(scene="caustic-pool", stop=stop))
        self.assertEqual(job["stop_reason"], "samples_per_pixel")
        self.assertGreater(job["light_not_found"]["at_most"], 1e-5)

    def test_ends_the_same_after_a_restart(self):
        stop = {"light_not_found": 0.001, "samples_per_pixel": 256}
        whole = self.server.render(small(stop=stop))
        job = self.server.submit(small(stop=stop))
        self.server.wait_for_samples(job["id"], 4)
        self.server.kill()
        self.server.start()
        done = self.server.wait(job["id"])
        self.assertEqual(done["stop_reason"], whole["stop_reason"])
        self.assertEqual(done["film_digest"], whole["film_digest"])

    def test_refuses_jobs_without_a_bound(self):
        stop = {"light_not_found": 0.1}
        for members in ({"medium": {"scattering": [0.1, 0.1, 0.1]}}, {"shutter_seconds": 0.1}):
            answer = self.server.post("/v1/jobs", small(stop=stop, **members))
            self.assert_problem(answer, 422, "/stop/light_not_found")
            self.assertIn(b"has no bound", answer.body)
        job = self.server.render(small(medium={"scattering": [0.1, 0.1, 0.1]}))
        answer = self.server.post(f"/v1/jobs/{job['id']}/extend", {"stop": stop})
        self.assert_problem(answer, 422, "/stop/light_not_found")

    def test_refuses_it_later_in_a_scene_that_scatters(self):
        milk = {"KHR_materials_transmission": {"transmissionFactor": 1},
                "KHR_materials_volume": {"thicknessFactor": 1, "attenuationDistance": 0.1,
                                         "attenuationColor": [0.5, 0.5, 0.5]},
                "KHR_materials_volume_scatter": {"multiscatterColor": [0.9, 0.9, 0.9]}}
        glb = triangle_glb(materials=[{"extensions": milk}], extensionsUsed=list(milk))
        scene = self.server.post("/v1/scenes", glb, {"Content-Type": "model/gltf-binary"}).json()
        stop = {"light_not_found": 0.1}
        refused = self.server.post("/v1/jobs", small(scene=scene["id"], stop=stop))
        self.assert_problem(refused, 422, "/stop/light_not_found")
        running = self.server.submit(small(65536, scene=scene["id"]))
        answer = self.server.request("PATCH", f"/v1/jobs/{running['id']}", {"stop": stop})
        self.assert_problem(answer, 422, "/stop/light_not_found")
        self.assertEqual(answer.json()["errors"], refused.json()["errors"])
        self.assertNotIn("light_not_found", self.server.job(running["id"])["spec"]["stop"])
        self.server.post(f"/v1/jobs/{running['id']}/cancel")
        finished = self.server.render(small(4, scene=scene["id"]))
        answer = self.server.post(f"/v1/jobs/{finished['id']}/extend", {"stop": stop})
        self.assert_problem(answer, 422, "/stop/light_not_found")
        self.assertEqual(answer.json()["errors"], refused.json()["errors"])

    def test_names_the_integrators_that_find_it(self):
        job = self.server.render(small())
        self.assertIsNone(job["light_not_found"]["reason"])
        self.assertEqual(job["light_not_found"]["integrators"], [])

    def test_command_line_accepts_it(self):
        output = os.path.join(self.server.data, "found.png")
        code, printed, said = tessera(
            "render", "cornell-box", "-o", output, "--size", "48x32", "--light-not-found", "50%",
            "--json")
        self.assertEqual(code, 0, said)
        self.assertEqual(json.loads(printed)["stop_reason"], "light_not_found")
