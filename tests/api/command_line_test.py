"""What the command line refuses by itself, what it fails at, and how it says so."""

import json
import os
import tempfile

from harness import ApiTest, job_body, tessera, triangle_glb


class CommandLine(ApiTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.picture = os.path.join(folder.name, "p.png")
        self.job_file = os.path.join(folder.name, "job.json")
        self.server_flags = ("--server", f"http://127.0.0.1:{self.server.port}")

    def write_job(self, text):
        with open(self.job_file, "w", encoding="utf-8") as file:
            file.write(text)

    def outcome(self, verb, *flags):
        """For render and submit alike; nothing is made of what is refused."""
        more = ("-o", self.picture) if verb == "render" else self.server_flags
        code, printed, said = tessera(verb, *flags, *more)
        self.assertEqual(printed, "", flags)
        self.assertNotEqual(said, "", flags)
        return code, said

    def test_numbers_out_of_range_and_wrong_forms_are_2(self):
        for verb in ("render", "submit"):
            for flags in (
                ("--size", "abc"),
                ("--size", "0x10"),
                ("--size", "10x0"),
                ("--spp", "-1"),
                ("--spp", "x"),
                ("--relative-error", "0%"),
                ("--seconds", "-1"),
                ("--seed", "-1"),
                ("--split", "0"),
            ):
                self.assertEqual(self.outcome(verb, "furnace", *flags)[0], 2, (verb, flags))
        self.assertEqual(self.outcome("submit", "furnace", "--priority", "101")[0], 2)
        for flags in (("--exposure", "31"), ("--exposure", "bright")):
            self.assertEqual(
                tessera("fetch", "-o", self.picture, *flags, *self.server_flags)[0], 2, flags
            )
        self.assertEqual(tessera("jobs", "--server", "localhost")[0], 2)

    def test_names_that_render_does_not_know_are_2(self):
        code, said = self.outcome("render", "furnace", "--sampler", "dice")
        self.assertEqual(code, 2)
        self.assertEqual(said.count("/sampler/type"), 1, said)
        code, said = self.outcome("render", "furnace", "--sampler", "dice", "--integrator", "guess")
        self.assertEqual(
            (said.count("/sampler/type"), said.count("/integrator/type")), (1, 1), said
        )

    def test_a_file_that_is_missing_or_wrong_is_1(self):
        for verb in ("render", "submit"):
            for flags in (
                ("none.glb",),
                ("furnace", "--job", self.job_file),
                ("furnace", "--environment", "none.hdr"),
            ):
                self.assertEqual(self.outcome(verb, *flags)[0], 1, (verb, flags))
            self.write_job("{")
            self.assertEqual(self.outcome(verb, "furnace", "--job", self.job_file)[0], 1)
            self.write_job('{"stop": {"samples_per_pixel": 0}}')
            self.assertEqual(self.outcome(verb, "furnace", "--job", self.job_file)[0], 1)
            os.remove(self.job_file)
        self.write_job("{}")
        self.assertEqual(self.outcome("render", "--sampler", "dice", "--job", self.job_file)[0], 2)

    def test_a_picture_has_an_error_with_an_interval(self):
        small = ("furnace", "-o", self.picture, "--size", "32x24", "--spp", "64", "--json")
        code, printed, said = tessera("render", *small)
        self.assertEqual(code, 0, said)
        error = json.loads(printed)["error"]
        self.assertTrue(error["valid"])
        self.assertLess(error["low"], error["high"])
        self.assertIn("unreliable", error)
        self.assertNotIn("without an interval", said)
        by_error = tessera(
            "render",
            "furnace",
            "-o",
            self.picture,
            "--size",
            "32x24",
            "--relative-error",
            "30%",
            "--json",
        )
        self.assertEqual(json.loads(by_error[1])["error"]["bias"], "consistent", by_error[2])

    def test_rules_of_the_laboratory_are_refused(self):
        code, _, said = tessera("render", "furnace", "-o", self.picture, "--adaptive", "crosshalf")
        self.assertEqual(code, 2, said)
        self.assertIn("laboratory", said)

    def test_what_the_server_refuses_is_1(self):
        code, said = self.outcome("submit", "furnace", "--sampler", "dice")
        self.assertEqual((code, said.count("/sampler/type")), (1, 1), said)

    def test_a_scene_is_called_by_its_file(self):
        model = os.path.join(os.path.dirname(self.picture), "red chair.glb")
        with open(model, "wb") as file:
            file.write(triangle_glb(extras={"made": "for the command line"}))
        code, printed, said = tessera("submit", model, "--spp", "2", "--json", *self.server_flags)
        self.assertEqual(code, 0, said)
        scene = json.loads(printed)["spec"]["scene"]
        self.assertEqual(self.server.get("/v1/scenes/" + scene).json()["name"], "red chair.glb")

    def test_a_percentage_is_a_relative_error(self):
        code, printed, said = tessera(
            "submit", "furnace", "--relative-error", "5%", "--json", *self.server_flags
        )
        self.assertEqual(code, 0, said)
        self.assertEqual(json.loads(printed)["spec"]["stop"]["relative_error"], 0.05)

    def test_a_look_for_a_linear_format_is_2(self):
        job = self.server.render(job_body())["id"]
        for suffix in ("exr", "hdr", "tif", "tiff"):
            file = self.picture[:-3] + suffix
            for flags in (("--exposure", "2"), ("--tonemap", "aces")):
                code, _, said = tessera("fetch", job, "-o", file, *flags, *self.server_flags)
                self.assertEqual(code, 2, said)
                self.assertIn(flags[0], said)
                self.assertFalse(os.path.exists(file))
            plain = ("--exposure", "0", "--tonemap", "linear")
            self.assertEqual(tessera("fetch", job, "-o", file, *plain, *self.server_flags)[0], 0)
        self.assertEqual(
            tessera("fetch", job, "-o", self.picture, "--exposure", "2", *self.server_flags)[0], 0
        )
