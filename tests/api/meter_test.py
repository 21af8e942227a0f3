"""The irradiance meter of a job, and the irradiance layer."""

import csv
import io
import json
import math
import os
import re
import tempfile
import unittest

from harness import ApiTest, job_body, started, tessera

POINT = {"position": [2, 0, 0], "normal": [0, 2, 0]}
PLANE = {"origin": [0, 0, 0], "edge_u": [0, 0, 1], "edge_v": [1, 0, 0], "columns": 3, "rows": 2}
BOX = {"points": [{"position": [0, 0.001, 0], "normal": [0, 1, 0]}],
       "plane": {**PLANE, "origin": [-0.5, 0.5, -0.5]}}
# Above the blocks of the box, under its lamp.
LIT = {"plane": {"origin": [0, 0.4, 0.25], "edge_u": [0.2, 0, 0], "edge_v": [0, 0, -0.3],
                 "columns": 2, "rows": 2}}


def body(meter, samples=8, scene="cornell-box", **members):
    wanted = job_body(samples=samples, **members)
    wanted["scene"] = scene
    wanted["film"] = {"width": 24, "height": 20, "layers": []}
    wanted["meter"] = meter
    return wanted


class Meter(ApiTest):
    def readings(self, job):
        return self.server.get(f"/v1/jobs/{job['id']}/meter").json()["points"]

    def test_uniform_sky_gives_pi(self):
        # Lossless objects under a sky of radiance 1 absorb no light.
        job = self.server.render(body({"points": [POINT], "plane": None}, 64, "furnace",
                                      integrator={"type": "path", "max_depth": 128}))
        self.assertEqual(job["spec"]["meter"], {"points": [POINT], "plane": None})
        reading = self.readings(job)[0]
        self.assertEqual(reading["normal"], [0, 1, 0])
        self.assertEqual(reading["samples"], 64 * 16)
        self.assertLessEqual(reading["low"], reading["illuminance_lux"])
        self.assertLessEqual(reading["illuminance_lux"], reading["high"])
        spread = reading["high"] - reading["low"]
        self.assert_close(reading["illuminance_lux"], math.pi, 2 * spread + 1e-3 * math.pi)
        self.assert_close(reading["irradiance_w_m2"] * 683, reading["illuminance_lux"], 1e-6)

    def test_table_has_the_same_values(self):
        job = self.server.render(body(BOX))
        readings = self.readings(job)
        self.assertEqual(len(readings), 7)
        answer = self.server.get(f"/v1/jobs/{job['id']}/meter.csv")
        self.assertEqual(answer.headers["Content-Type"], "text/csv; charset=utf-8")
        rows = list(csv.DictReader(io.StringIO(answer.body.decode())))
        for row, reading in zip(rows, readings, strict=True):
            for name in ("irradiance_w_m2", "illuminance_lux", "low", "high", "samples"):
                self.assertEqual(float(row[name]), reading[name])
            self.assertEqual([float(row[c]) for c in "xyz"], reading["position"])
            self.assertEqual([float(row[f"irradiance_{c}"]) for c in "rgb"],
                             reading["irradiance_rgb"])
            self.assertEqual(row["unreliable"], "true" if reading["unreliable"] else "false")
        status, printed, complaint = tessera(
            "meter", job["id"], "--server", f"http://127.0.0.1:{self.server.port}")
        self.assertEqual(status, 0, complaint)
        self.assertEqual(printed.split(), answer.body.decode().split())

    def test_job_links_to_readings_with_their_confidence(self):
        job = self.server.render(body(BOX))
        meter = self.server.get(job["links"]["meter"]).json()
        self.assertEqual(meter["confidence"], 0.95)
        self.assertNotIn("meter", self.server.render(body(None))["links"])

    def test_local_render_prints_the_readings_of_the_server(self):
        expected = self.server.get(self.server.render(body(BOX))["links"]["meter"]).json()
        with tempfile.TemporaryDirectory() as folder:
            file = os.path.join(folder, "job.json")
            with open(file, "w", encoding="utf-8") as job:
                json.dump(body(BOX), job)
            verb = ["render", "--job", file, "-o", os.path.join(folder, "p.png")]
            status, printed, said = tessera(*verb, "--json")
            self.assertEqual(status, 0, said)
            self.assertEqual(json.loads(printed)["meter"], expected)
            status, printed, said = tessera(*verb)
            self.assertEqual((status, printed), (0, ""), said)
            lines = [line for line in said.splitlines() if line.startswith("meter at ")]
            self.assertEqual(len(lines), len(expected["points"]))
            for line, reading in zip(lines, expected["points"]):
                values = [float(v) for v in re.findall(r"[-+0-9.e]+(?= lux|\)| to )", line)]
                for value, member in zip(values, ("illuminance_lux", "low", "high"), strict=True):
                    self.assert_close(value, reading[member], 1e-3 * reading["high"])

    def test_image_is_unchanged_and_readings_do_not_depend_on_the_integrator(self):
        plain = self.server.render(body(None))
        self.assertNotIn("meter", plain["spec"])
        self.assert_problem(self.server.get(f"/v1/jobs/{plain['id']}/meter"), 404)
        job = self.server.render(body(BOX))
        self.assertEqual(job["film_digest"], plain["film_digest"])
        other = self.server.render(body(BOX, integrator={"type": "bdpt"}))
        self.assertEqual(self.readings(other), self.readings(job))

    def test_extension_gives_the_readings_of_a_longer_job(self):
        long = self.server.render(body(BOX, 16))
        job = self.server.render(body(BOX, 8))
        answer = self.server.post(f"/v1/jobs/{job['id']}/extend",
                                  {"stop": {"samples_per_pixel": 16}})
        self.assertEqual(answer.status, 202, answer)
        self.server.wait(job["id"])
        self.assertEqual(self.readings(job), self.readings(long))

    def test_refuses_an_invalid_meter_with_its_pointer(self):
        cases = (
            ({"points": [{"position": [0, 0, 0], "normal": [0, 0, 0]}]}, "/meter/points/0/normal"),
            ({"points": [{"position": [0, 0, 0]}]}, "/meter/points/0/normal"),
            ({"points": []}, "/meter"),
            ({"plane": {**PLANE, "edge_v": [0, 0, 3]}}, "/meter/plane"),
            ({"plane": {**PLANE, "rows": 0}}, "/meter/plane/rows"),
            ({"plane": {**PLANE, "columns": 4096}}, "/meter"),
            ({"points": 3}, "/meter/points"),
            ({"spots": []}, "/meter/spots"),
        )
        for meter, pointer in cases:
            with self.subTest(pointer=pointer):
                self.assert_problem(self.server.post("/v1/jobs", body(meter)), 422, pointer)

    def test_stops_when_every_interval_is_narrow_enough(self):
        wanted = body(LIT)
        wanted["stop"] = {"meter_error": 0.5, "samples_per_pixel": 4096}
        job = self.server.render(wanted)
        self.assertEqual(job["stop_reason"], "meter_error")
        readings = self.readings(job)
        widths = [(r["high"] - r["low"]) / r["illuminance_lux"] for r in readings]
        self.assertLessEqual(max(widths), 0.5)
        # A tenth of the width takes more samples: the rule is not met by chance at the first look.
        wanted["stop"]["meter_error"] = 0.05
        narrow = self.server.render(wanted)
        self.assertGreater(self.readings(narrow)[0]["samples"], readings[0]["samples"])
        wanted["meter"] = None
        self.assert_problem(self.server.post("/v1/jobs", wanted), 422, "/stop/meter_error")

    def test_needs_no_image(self):
        wanted = body(BOX) | {"film": None}
        job = self.server.render(wanted)
        self.assertIsNone(job["spec"]["film"])
        self.assertEqual(job["available"], ["meter"])
        self.assertIsNone(job["error"]["relative"])
        # The readings are those of the same job with an image.
        self.assertEqual(self.readings(job), self.readings(self.server.render(body(BOX))))
        for part in ("image.png", "pixels/0/0", "objects"):
            self.assert_problem(self.server.get(f"/v1/jobs/{job['id']}/{part}"), 404)
        self.assertEqual(self.server.get(f"/v1/jobs/{job['id']}/tiles").status, 204)
        self.assert_problem(self.server.post("/v1/jobs", body(None) | {"film": None}), 422, "/film")
        for rule in ("relative_error", "denoised_error"):
            answer = self.server.post("/v1/jobs", {**wanted, "stop": {rule: 0.1}})
            self.assert_problem(answer, 422, f"/stop/{rule}")

    def test_figures_of_the_whole_follow_from_the_points(self):
        meter = self.server.get(self.server.render(body(BOX))["links"]["meter"]).json()
        lux = [p["illuminance_lux"] for p in meter["points"]]
        mean = sum(lux) / len(lux)
        self.assert_close(meter["mean_lux"], mean, 1e-9 * mean)
        self.assert_close(meter["uniformity"], min(lux) / mean, 1e-9)
        self.assertIsNone(meter["outdoor_lux"], "the box has lamps and no sky")
        self.assertIsNone(meter["daylight_factor"])

    def test_open_ground_has_the_daylight_factor_of_its_horizon(self):
        # A sky of radiance 2 gives an upward surface 2 pi; the sphere beside it takes a part.
        far = {"points": [{**POINT, "position": [900, 0, 0]}]}
        job = self.server.render(body(far, 4, "furnace", environment={"color": [2, 2, 2]}))
        meter = self.server.get(job["links"]["meter"]).json()
        self.assert_close(meter["outdoor_lux"], 2 * math.pi, 1e-5)
        reading = meter["points"][0]
        spread = (reading["high"] - reading["low"]) / reading["illuminance_lux"]
        self.assert_close(meter["daylight_factor"], 1, 2 * spread + 1e-3)

    def test_compares_two_meters_point_by_point(self):
        dark, bright = (self.server.render(body(BOX, environment={"color": [c] * 3}))
                        for c in (0.5, 1))
        path = f"/v1/comparisons?a={bright['id']}&b={dark['id']}"
        compared = self.server.get(path).json()
        for side, job in (("a", bright), ("b", dark)):
            meter = self.server.get(job["links"]["meter"]).json()
            self.assertEqual(compared[side]["job"], job["id"])
            self.assertEqual(compared[side]["mean_lux"], meter["mean_lux"])
        for pair, a, b in zip(compared["points"], self.readings(bright), self.readings(dark),
                              strict=True):
            self.assertEqual(pair["position"], a["position"])
            off = a["illuminance_lux"] - b["illuminance_lux"]
            self.assert_close(pair["difference_lux"], off, 1e-9 * a["illuminance_lux"])
            reach = math.hypot(a["illuminance_lux"] - a["low"], b["high"] - b["illuminance_lux"])
            self.assert_close(pair["low"], off - reach, 1e-9 * a["illuminance_lux"])
        other = self.server.render(body({"points": [POINT]}))
        self.assert_problem(
            self.server.get(f"/v1/comparisons?a={bright['id']}&b={other['id']}"), 409)
        self.assert_problem(self.server.get(f"/v1/comparisons?a={bright['id']}"), 422, "/b")

    def test_merged_film_has_no_readings(self):
        parts = []
        for first in (0, 2):
            sampler = {"type": "sobol", "replicates": 2, "first_replicate": first}
            parts.append(self.server.render(body(BOX, sampler=sampler))["id"])
        merged = self.server.post("/v1/films/merge", {"films": parts})
        self.assertEqual(merged.status, 201, merged)
        self.assertTrue(any(w.startswith("meter:") for w in merged.json()["warnings"]))
        self.assert_problem(self.server.get(f"/v1/jobs/{merged.json()['id']}/meter"), 404)

    def test_error_target_of_the_meter_ends_the_job(self):
        wanted = body(LIT, stop={"meter_error": 0.2, "samples_per_pixel": 4096})
        job = self.server.render(wanted)
        self.assertEqual(job["stop_reason"], "meter_error")
        for point in self.server.get(f"/v1/jobs/{job['id']}/meter").json()["points"]:
            self.assertLessEqual(point["high"] - point["low"], 0.2 * point["illuminance_lux"])
        wanted = body(None, stop={"meter_error": 0.2})
        self.assert_problem(self.server.post("/v1/jobs", wanted), 422, "/stop/meter_error")

    def test_irradiance_is_a_data_layer(self):
        wanted = body(None)
        wanted["film"]["layers"] = ["irradiance"]
        job = self.server.render(wanted)
        pixel = self.server.get(f"/v1/jobs/{job['id']}/pixels/12/15").json()["layers"]["irradiance"]
        for c in range(3):
            self.assertGreater(pixel["mean"][c], 0)
            self.assertLessEqual(pixel["low"][c], pixel["high"][c])
        image = self.server.get(f"/v1/jobs/{job['id']}/image.png?layer=irradiance&range=auto")
        self.assertEqual(image.status, 200, image)
        self.assertIn(",", image.headers["X-Tessera-Range"])
        wanted["integrator"] = {"type": "sppm"}
        self.assert_problem(self.server.post("/v1/jobs", wanted), 422, "/film/layers/0")


class Restart(unittest.TestCase):
    def test_readings_survive_a_kill(self):
        server = started(self, "--checkpoint", "0.3")
        calm = server.render(body(BOX, 512))
        job = server.submit(body(BOX, 512, name="killed"))["id"]
        server.wait_until(job, lambda now: now["progress"]["samples_per_pixel"]["max"] >= 64)
        server.kill()
        server.start(1)
        server.wait(job)
        self.assertEqual(server.get(f"/v1/jobs/{job}/meter").json(),
                         server.get(f"/v1/jobs/{calm['id']}/meter").json())
