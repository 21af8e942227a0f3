"""Errors that the command line reports: wrong usage, failures, and their messages."""

import http.server
import json
import math
import os
import re
import socket
import subprocess
import tempfile
import threading

from harness import (BINARY, ApiTest, hdr_image, job_body, png_data, png_pixels, started, tessera,
                     triangle_document, triangle_glb)


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

    def served_by(self, handler):
        """Starts a server of the standard library; returns its address."""
        server = http.server.HTTPServer(("127.0.0.1", 0), handler)
        self.addCleanup(server.server_close)
        self.addCleanup(server.shutdown)
        threading.Thread(target=server.serve_forever, daemon=True).start()
        return f"http://127.0.0.1:{server.server_port}"

    def outcome(self, verb, *flags):
        """For render and submit; a refused command creates nothing."""
        more = ("-o", self.picture) if verb == "render" else self.server_flags
        code, printed, said = tessera(verb, *flags, *more)
        self.assertEqual(printed, "", flags)
        self.assertNotEqual(said, "", flags)
        return code, said

    def test_keys_lose_the_line_break_of_their_file_and_are_no_other_header(self):
        server = started(self, "--key", "secret", key="secret")
        flags = ("--server", f"http://127.0.0.1:{server.port}")
        for key, code in (("secret\r\n", 0), (" secret", 0), ("wrong", 1), ("\n", 2),
                          ("secret\r\nX-Request-Id: 1", 2), ("secret\x1b", 2)):
            self.assertEqual(
                tessera("jobs", *flags, environ={"TESSERA_KEY": key})[0], code, repr(key))
        signing = {"TESSERA_SIGNING_KEY": "k\n"}
        self.assertEqual(tessera("sign", "/a/b/0,0.png", environ=signing),
                         tessera("sign", "/a/b/0,0.png", "--key", "k"))

    def test_output_that_cannot_be_written_is_1(self):
        job = self.server.render(job_body(samples=2))["id"]
        for words in (("jobs",), ("jobs", "--json"), ("show", job), ("scenes",), ("lab",),
                      ("submit", "furnace", "--size", "16x16", "--spp", "2"),
                      ("serve", "--print-config"), ("--version",)):
            server = self.server_flags if words[0] in ("jobs", "show", "scenes", "submit") else ()
            with open("/dev/full", "wb") as full:
                done = subprocess.run([BINARY, *words, *server], stdout=full,
                                      stderr=subprocess.PIPE, text=True)
            self.assertEqual(done.returncode, 1, words)
            self.assertIn("output could not be written", done.stderr, words)
            if words[0] == "submit":
                newest = self.server.get("/v1/jobs?limit=1").json()["jobs"][0]["id"]
                self.assertIn("the job is " + newest, done.stderr)

    def test_addresses_are_shown_without_their_password(self):
        for address in ("ftp://u:secretpw@x", "u:secretpw@host", "http//u:secretpw@x",
                        "http:/u:secretpw@x", "HTTP://u:secretpw@x", " http://u:secretpw@x",
                        "http:///u:secretpw@x", "http://u:a@secretpw@x", "http://u:a/secretpw@x:1"):
            code, _, said = tessera("jobs", "--server", address)
            self.assertNotEqual(code, 0, address)
            self.assertNotIn("secretpw", said)
            _, _, said = tessera("jobs", environ={"TESSERA_SERVER": address})
            self.assertNotIn("secretpw", said)
            if ":1" not in address:
                for verb in ("serve", "worker"):
                    code, printed, said = tessera(verb, "--queue", address)
                    self.assertNotEqual(code, 0, address)
                    self.assertNotIn("secretpw", printed + said)

    def test_announces_without_a_password(self):
        server = started(self, "--announce", "https://u:secretpw@render.example.org/")
        self.assertEqual(server.process.stdout.readline(),
                         b"open https://***@render.example.org/ in a browser\n")

    def test_errors_of_a_proxy_name_it_without_its_password(self):
        class Refusing(http.server.BaseHTTPRequestHandler):
            def do_CONNECT(self):
                self.send_error(502)

            def log_message(self, *_):
                pass

        proxy_port = int(self.served_by(Refusing).rsplit(":", 1)[1])
        with socket.create_server(("127.0.0.1", 0)) as closed:
            closed_port = closed.getsockname()[1]
        for variable, port, scheme, words in (
            ("HTTPS_PROXY", proxy_port, "https", "the proxy answers 502"),
            ("all_proxy", proxy_port, "https", "of ALL_PROXY: the proxy answers 502"),
            ("HTTPS_PROXY", closed_port, "https", "of HTTPS_PROXY: "),
            ("HTTP_PROXY", closed_port, "http", "of HTTP_PROXY: "),
        ):
            _, _, said = tessera("jobs", "--server", scheme + "://render.example.org", environ={
                variable: f"http://u:secretpw@127.0.0.1:{port}"})
            self.assertIn(f"through the proxy http://127.0.0.1:{port}", said)
            self.assertIn(words, said)
            self.assertNotIn("secretpw", said)
            self.assertNotIn("Start one", said)

    def test_control_characters_of_others_are_shown_as_text(self):
        name = "\x1b]0;title\x07"
        scene = self.server.post("/v1/scenes", triangle_glb(scenes=[{"nodes": [0], "name": name}]),
                                 {"Content-Type": "model/gltf-binary"})
        self.assertEqual(scene.status, 201, scene)
        for words in (("scenes",), ("show", name),
                      ("submit", "furnace", "--size", "16x16", "--camera", name)):
            _, printed, said = tessera(*words, *self.server_flags)
            self.assertNotIn("\x1b", printed + said, words)

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

    def test_error_above_one_without_percent_is_2_with_a_suggestion(self):
        for verb in ("render", "submit"):
            code, said = self.outcome(verb, "furnace", "--relative-error", "5")
            self.assertEqual(code, 2)
            self.assertIn("5 is 500%", said)
            self.assertIn("5% is more likely", said)

    def test_flags_set_the_view(self):
        def spec(*flags):
            code, printed, said = tessera("submit", "glass", "--spp", "1", "--size", "32x32",
                                          "--json", *flags, *self.server_flags)
            self.assertEqual(code, 0, said)
            return json.loads(printed)["spec"]

        placed = spec("--position", "-1,2,3", "--target", "0,0.5,0", "--fov", "30", "--aperture",
                      "0.01", "--focus", "3", "--crop", "4,4,16,8")
        camera = placed["camera"]
        self.assertEqual((camera["position"], camera["target"]), ([-1, 2, 3], [0, 0.5, 0]))
        self.assertEqual(
            (camera["vertical_fov_degrees"], camera["aperture_radius"], camera["focus_distance"]),
            (30, 0.01, 3))
        self.assertEqual(placed["film"]["crop"], {"x": 4, "y": 4, "width": 16, "height": 8})
        turned = spec("--orbit", "30,80", "--transparent", "--rotation", "45",
                      "--intensity", "0.03")
        orbit = turned["camera"]["orbit"]
        self.assertEqual((orbit["theta_degrees"], orbit["phi_degrees"], orbit["radius"]),
                         (30, 80, "auto"))
        sky = turned["environment"]
        self.assertEqual((sky["visible"], sky["rotation_degrees"], sky["intensity"]),
                         (False, 45, 0.03))
        self.assertEqual(spec("--orbit", "30,80,2.5")["camera"]["orbit"]["radius"], 2.5)
        for wrong in (("--position", "1,2,3"), ("--orbit", "1"), ("--crop", "1,2,3")):
            self.assertEqual(self.outcome("submit", "glass", *wrong)[0], 2, wrong)

    def test_the_stage_comes_from_flags(self):
        def spec(*flags):
            code, printed, said = tessera("submit", "glass", "--spp", "1", "--size", "32x32",
                                          "--json", *flags, *self.server_flags)
            self.assertEqual(code, 0, said)
            return json.loads(printed)["spec"]

        stage = spec("--preset", "studio", "--background", "3366cc", "--ground", "sweep",
                     "--ground-height", "-0.5", "--ground-reflection", "0.75")
        self.assertEqual(stage["environment"]["preset"], "studio")
        self.assertEqual(stage["background"]["type"], "color")
        # IEC 61966-2-1: the sRGB curve above its linear part.
        for value, byte in zip(stage["background"]["color"], (0x33, 0x66, 0xCC)):
            self.assertAlmostEqual(value, ((byte / 255 + 0.055) / 1.055) ** 2.4, places=5)
        ground = stage["ground"]
        self.assertEqual((ground["type"], ground["height"], ground["reflection"]),
                         ("sweep", -0.5, 0.75))
        self.assertEqual(spec("--ground", "catcher")["ground"]["reflection"], 0)
        code, said = self.outcome("submit", "glass", "--ground", "sweep",
                                  "--ground-reflection", "1.5")
        self.assertEqual(code, 1)
        self.assertIn("/ground/reflection", said)
        self.assertIn("1.5 is outside [0, 1]", said)
        self.assertEqual(self.outcome("submit", "glass", "--ground-reflection", "x")[0], 2)

    def test_any_member_of_the_request_can_be_set(self):
        code, printed, said = tessera(
            "submit", "glass", "--spp", "1", "--size", "32x32", "--json", "--set",
            "integrator.max_depth=4", "--set", "film.filter.radius=2", "--set", "variant=oak",
            *self.server_flags)
        self.assertEqual(code, 1, printed)  # the scene has no variants
        self.assertIn("/variant", said)
        code, printed, said = tessera(
            "submit", "glass", "--spp", "1", "--size", "32x32", "--json", "--set",
            "integrator.max_depth=4", "--set", "film.filter.radius=2", *self.server_flags)
        self.assertEqual(code, 0, said)
        spec = json.loads(printed)["spec"]
        self.assertEqual((spec["integrator"]["max_depth"], spec["film"]["filter"]["radius"],
                          spec["film"]["width"]), (4, 2, 32))
        code, said = self.outcome("render", "glass", "--set", "integrator.depth=4")
        self.assertNotEqual(code, 0)
        self.assertIn("/integrator/depth", said)
        choices = json.loads(tessera("render", "--describe")[1])["choices"]["--set"]
        self.assertIn("ground.shadow.softness=", choices)

    def test_tells_the_error_and_the_radius_of_sppm(self):
        wanted = job_body(samples=6)
        for integrator in ("sppm", "path"):
            wanted["integrator"] = {"type": integrator}
            self.write_job(json.dumps(wanted))
            code, said = self.outcome("render", "--job", self.job_file)
            self.assertEqual(code, 0, said)
            self.assertRegex(said, r"error [0-9.]+% \([0-9.]+ to [0-9.]+\)")
            job = self.server.render(wanted)
            code, shown, said = tessera("show", job["id"], *self.server_flags)
            self.assertEqual(code, 0, said)
            self.assertRegex(shown, r"error +[0-9.]+% \([0-9.]+ to [0-9.]+\)")
            ratio = job["statistics"]["radius_ratio"]
            self.assertEqual(ratio is not None, integrator == "sppm")
            if ratio is not None:
                # Knaus and Zwicker 2011, eq. 15: three samples of each of two replicates.
                alpha = job["spec"]["integrator"]["alpha"]
                self.assertEqual(job["spec"]["sampler"]["replicates"], 2)
                expected = math.sqrt((1 + alpha) / 2 * (2 + alpha) / 3)
                self.assertAlmostEqual(ratio, expected, places=6)
                self.assertIn(f"radius     {100 * expected:.1f}% of the first sample's\n", shown)

    def test_controls_jobs(self):
        def run(verb, *flags):
            code, printed, said = tessera(verb, *flags, *self.server_flags)
            self.assertEqual(code, 0, said)
            return printed

        job = self.server.submit(job_body(samples=65536, name="steered"))["id"]
        self.server.wait_for_samples(job)
        self.assertEqual(run("pause", job), f"{job} paused\n")
        shown = run("show", job)
        self.assertIn("name       steered\n", shown)
        self.assertIn("paused", shown)
        self.assertEqual(json.loads(run("show", job, "--json"))["id"], job)
        self.assertEqual(tessera("delete", job, *self.server_flags)[0], 1)
        self.assertNotIn("paused", run("resume", job))
        run("cancel", job)
        done = self.server.render(job_body())["id"]
        self.assertEqual(tessera("extend", done, *self.server_flags)[0], 2)
        run("extend", done, "--samples", "16")
        self.assertEqual(self.server.wait(done)["progress"]["samples_per_pixel"]["mean"], 16)
        self.assertEqual(run("delete", done), f"{done} deleted\n")
        self.assertEqual(self.server.get(f"/v1/jobs/{done}").status, 404)

    def test_list_of_jobs_heads_their_names(self):
        self.server.render(job_body(name="oak chair"))
        code, printed, said = tessera("jobs", "--limit", "1", *self.server_flags)
        self.assertEqual(code, 0, said)
        head, row = printed.splitlines()
        self.assertTrue(head.endswith("  NAME") and row.endswith("  oak chair"), printed)
        self.assertEqual(head.index("NAME"), row.index("oak chair"))

    def test_list_of_jobs_marks_unreliable_errors(self):
        jobs = [{"id": str(number), "state": "finished", "spec": {"scene": "glass"},
                 "error": {"relative": 0.02, "unreliable": number == 2}} for number in (1, 2)]

        class Listing(http.server.BaseHTTPRequestHandler):
            def do_GET(self):
                self.send_response(200)
                self.end_headers()
                self.wfile.write(json.dumps({"jobs": jobs, "next": None}).encode())

            def log_message(self, *_):
                pass

        code, printed, said = tessera("jobs", "--server", self.served_by(Listing))
        self.assertEqual(code, 0, said)
        _, reliable, unreliable = printed.splitlines()
        self.assertIn(" 2.00%  ", reliable)
        self.assertIn(" 2.00%?  ", unreliable)

    def test_samples_and_spp_are_one_flag(self):
        for flag in ("--samples", "--spp"):
            code, printed, said = tessera("submit", "furnace", "--size", "16x16", flag, "6",
                                          "--json", *self.server_flags)
            self.assertEqual(code, 0, said)
            stop = json.loads(printed)["spec"]["stop"]
            self.assertEqual(stop["samples_per_pixel"], 6)

    def test_uploads_files_and_lists_scenes(self):
        with tempfile.TemporaryDirectory() as folder:
            model, light = (os.path.join(folder, name) for name in ("a chair.glb", "sky.hdr"))
            with open(model, "wb") as file:
                file.write(triangle_glb())
            with open(light, "wb") as file:
                file.write(hdr_image(4, 2, (1, 1, 1)))
            code, printed, said = tessera("upload", model, light, *self.server_flags)
            self.assertEqual(code, 0, said)
            scene, asset = printed.split()
            code, _, said = tessera("upload", os.path.join(folder, "none.glb"), *self.server_flags)
            self.assertEqual(code, 1)
            self.assertIn("no such file", said)
        self.assertEqual(self.server.get("/v1/assets/" + asset).status, 200)
        code, printed, said = tessera("scenes", *self.server_flags)
        self.assertEqual(code, 0, said)
        self.assertIn("cornell-box  ", printed)
        self.assertIn(f"{scene}  a chair.glb\n", printed)

    def test_names_unknown_to_render_are_2(self):
        code, said = self.outcome("render", "furnace", "--sampler", "dice")
        self.assertEqual(code, 2)
        self.assertEqual(said.count("/sampler/type"), 1, said)
        code, said = self.outcome("render", "furnace", "--sampler", "dice", "--integrator", "guess")
        self.assertEqual(
            (said.count("/sampler/type"), said.count("/integrator/type")), (1, 1), said
        )

    def test_missing_or_wrong_file_is_1(self):
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

    def test_too_little_memory_is_1_and_said(self):
        limited = ("sh", "-c", 'ulimit -v 900000; exec "$@"', "sh", BINARY, "render")
        starts = subprocess.run([*limited, "--help"], capture_output=True, check=False)
        if starts.returncode != 0:
            self.skipTest("this build reserves more address space at its start")
        vertices = 30_000_000
        scene = os.path.join(os.path.dirname(self.picture), "large.gltf")
        document = triangle_document()
        document["accessors"] = [{"componentType": 5126, "count": vertices, "type": "VEC3",
                                  "min": [0, 0, 0], "max": [0, 0, 0]}]
        with open(scene, "w", encoding="utf-8") as file:
            json.dump({k: v for k, v in document.items() if not k.startswith("buffer")}, file)
        done = subprocess.run([*limited, scene, "-o", self.picture, "--size", "8x8"],
                              capture_output=True, text=True, check=False)
        self.assertEqual(done.returncode, 1, done.stderr)
        self.assertIn("memory", done.stderr)

    def test_image_has_an_error_with_an_interval(self):
        small = ("furnace", "-o", self.picture, "--size", "32x24", "--spp", "64", "--json")
        code, printed, said = tessera("render", *small)
        self.assertEqual(code, 0, said)
        error = json.loads(printed)["error"]
        self.assertTrue(error["valid"])
        self.assertLess(error["low"], error["high"])
        self.assertIn("unreliable", error)
        self.assertNotIn("noise alone", said)
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

    def test_refuses_rules_of_the_laboratory(self):
        code, _, said = tessera("render", "furnace", "-o", self.picture, "--adaptive", "crosshalf")
        self.assertEqual(code, 2, said)
        self.assertIn("laboratory", said)

    def test_refusal_by_the_server_is_1(self):
        code, said = self.outcome("submit", "furnace", "--sampler", "dice")
        self.assertEqual((code, said.count("/sampler/type")), (1, 1), said)

    def test_scene_has_the_name_of_its_file(self):
        model = os.path.join(os.path.dirname(self.picture), "red chair.glb")
        with open(model, "wb") as file:
            file.write(triangle_glb(extras={"made": "for the command line"}))
        code, printed, said = tessera("submit", model, "--spp", "2", "--json", *self.server_flags)
        self.assertEqual(code, 0, said)
        scene = json.loads(printed)["spec"]["scene"]
        self.assertEqual(self.server.get("/v1/scenes/" + scene).json()["name"], "red chair.glb")

    def test_accepts_a_percentage_as_relative_error(self):
        code, printed, said = tessera(
            "submit", "furnace", "--relative-error", "5%", "--json", *self.server_flags
        )
        self.assertEqual(code, 0, said)
        self.assertEqual(json.loads(printed)["spec"]["stop"]["relative_error"], 0.05)

    def test_render_shows_bright_light_with_an_exposure(self):
        noon = ("--sun", "40,0,2026-06-21T12:00:00Z", "--spp", "4", "--size", "32x18", "--json")

        def render(*flags):
            code, printed, said = tessera("render", "furnace", "-o", self.picture, *noon, *flags)
            self.assertEqual(code, 0, said)
            with open(self.picture, "rb") as file:
                return json.loads(printed), said, file.read()

        result, said, _ = render()
        self.assertEqual(result["exposure"], 0)
        told = re.search(r"([0-9]+) % of the pixels are above 1; --exposure (-[0-9.]+) shows", said)
        self.assertGreater(int(told[1]), 50, said)
        self.assertTrue(any("above 1" in warning for warning in result["warnings"]))
        auto, said, picture = render("--exposure", "auto")
        self.assertEqual(auto["exposure"], float(told[2]))
        self.assertNotIn("above 1", said)
        self.assertEqual(render("--exposure", told[2])[2], picture)
        self.assertGreater(len({p for row in png_pixels(picture) for p in row}), 20)

    def test_look_is_that_of_the_servers_images(self):
        job = self.server.render(job_body("cornell-box", samples=2))["id"]
        query = f"/v1/jobs/{job}/image.png?white_balance=3000&contrast=1.25"
        look = ("--white-balance", "3000", "--contrast", "1.25")
        size = ("--size", "48x32", "--spp", "2", "--adaptive", "none")

        def written(*command, file=self.picture):
            code, _, said = tessera(*command, "-o", file)
            self.assertEqual(code, 0, said)
            with open(file, "rb") as picture:
                return picture.read()

        deep = self.server.get(query + "&bits=16").body
        for command in (("fetch", job), ("submit", "cornell-box", *size)):
            picture = written(*command, *look, "--bits", "16", *self.server_flags)
            self.assertEqual(png_data(picture), png_data(deep))
        # Its images have alpha, which those of the server lose where all of it is 1.
        mine = [p for row in png_pixels(written("render", "cornell-box", *size, *look))
                for p in row]
        others = [p for row in png_pixels(self.server.get(query).body) for p in row]
        self.assertEqual([(a[:3], b) for a, b in zip(mine, others) if a[3] == 255 and a[:3] != b],
                         [])
        self.assertGreater(sum(p[3] == 255 for p in mine), 300)
        self.assertEqual(written("render", "cornell-box", *size, "--bits", "16")[24], 16)  # IHDR
        avif = written("render", "cornell-box", *size, file=self.picture[:-3] + "avif")
        self.assertEqual(avif[4:12], b"ftypavif")

    def test_display_options_for_a_linear_format_are_2(self):
        for flag in ("2", "auto"):
            file = self.picture[:-3] + "exr"
            code, _, said = tessera("render", "furnace", "-o", file, "--exposure", flag)
            self.assertEqual(code, 2, said)
            self.assertIn("--exposure", said)
        job = self.server.render(job_body())["id"]
        for flags in (("--white-balance", "999"), ("--contrast", "5"), ("--bits", "12")):
            for command in (("fetch", job), ("render", "furnace"), ("submit", "furnace")):
                code, _, said = tessera(*command, "-o", self.picture, *flags)
                self.assertEqual(code, 2, said)
        for command in (("render", "furnace"), ("submit", "furnace", *self.server_flags)):
            for suffix, flags in (("exr", ("--contrast", "2")), ("jpg", ("--bits", "16"))):
                code, _, said = tessera(*command, "-o", self.picture[:-3] + suffix, *flags)
                self.assertEqual(code, 2, said)
                self.assertIn(flags[0], said)
        for suffix in ("exr", "hdr", "tif", "tiff"):
            file = self.picture[:-3] + suffix
            for flags in (("--exposure", "2"), ("--tonemap", "aces"), ("--white-balance", "2700"),
                          ("--contrast", "2"), ("--bits", "16")):
                code, _, said = tessera("fetch", job, "-o", file, *flags, *self.server_flags)
                self.assertEqual(code, 2, said)
                self.assertIn(flags[0], said)
                self.assertFalse(os.path.exists(file))
            plain = ("--exposure", "0", "--tonemap", "linear")
            self.assertEqual(tessera("fetch", job, "-o", file, *plain, *self.server_flags)[0], 0)
        self.assertEqual(
            tessera("fetch", job, "-o", self.picture, "--exposure", "2", *self.server_flags)[0], 0
        )
