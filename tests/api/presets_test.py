"""Presets, and images by URL that are made from them."""

import base64
import hashlib
import hmac
import http.client
import time
import unittest

from harness import (PATIENCE_S, ApiTest, Server, in_background, png_pixels, png_size, started,
                     tessera, triangle_glb, wait_for)

SMALL = {"job": {"film": {"width": 24, "height": 12}, "stop": {"samples_per_pixel": 4}}}
LONG = {"job": {"film": {"width": 64, "height": 64}, "stop": {"samples_per_pixel": 65536}}}
GLB = {"Content-Type": "model/gltf-binary"}
FOREIGN = {"Origin": "https://shop.example"}
READY = ["hero", "packshot", "thumbnail", "turntable"]


def signed(key, rest):
    """HMAC-SHA256 of all that follows the signature, in unpadded base64url."""
    digest = hmac.new(key.encode(), rest.encode(), hashlib.sha256).digest()
    return "/i/" + base64.urlsafe_b64encode(digest).decode().rstrip("=") + rest


def settled(server, url):
    """The final image: those before are not to be stored, and 503 is to be repeated."""
    end = time.monotonic() + PATIENCE_S
    while time.monotonic() < end:
        answer = server.get(url)
        if answer.status == 503:
            assert int(answer.headers["Retry-After"]) >= 1, answer
        elif answer.status != 200 or "immutable" in answer.headers["Cache-Control"]:
            return answer
        time.sleep(0.1)
    raise AssertionError("no final image")


class Presets(ApiTest):
    def put(self, name, body, headers=None):
        return self.server.request("PUT", "/v1/presets/" + name, body, headers)

    def test_is_stored_replaced_listed_and_deleted(self):
        made = self.put("a.b-c_1", SMALL)
        self.assertEqual((made.status, made.headers["Location"]), (201, "/v1/presets/a.b-c_1"))
        again = self.put("a.b-c_1", {**SMALL, "public": True, "sizes": [[48, 24]]})
        self.assertEqual(again.status, 200)
        shown = {"name": "a.b-c_1", "job": SMALL["job"], "public": True, "sizes": [[48, 24]],
                 "deadline_seconds": 2, "turntable": False}
        self.assertEqual(again.json(), shown)
        self.assertEqual(self.server.get("/v1/presets/a.b-c_1").json(), shown)
        listed = self.server.get("/v1/presets").json()["presets"]
        self.assertEqual([each["name"] for each in listed], sorted(READY + ["a.b-c_1"]))
        self.assertEqual(listed[0], shown)
        self.assertEqual(self.server.request("DELETE", "/v1/presets/a.b-c_1").status, 204)
        self.assertEqual(self.server.get("/v1/presets/a.b-c_1").status, 404)
        self.assertEqual(self.server.request("DELETE", "/v1/presets/a.b-c_1").status, 404)

    def test_ready_ones_are_jobs_and_can_be_replaced(self):
        for name in READY:
            job = self.server.get("/v1/presets/" + name).json()["job"]
            answer = self.server.post("/v1/jobs?dry_run=1", {**job, "scene": "cornell-box"})
            self.assertEqual(answer.status, 200, answer)
        self.assertEqual(self.put("hero", SMALL).status, 201)
        self.assertEqual(self.server.get("/v1/presets/hero").json()["job"], SMALL["job"])
        self.assertEqual(self.server.request("DELETE", "/v1/presets/hero").status, 204)
        self.assertEqual(self.server.get("/v1/presets/hero").json()["job"]["film"],
                         {"width": 1600, "height": 900})

    def test_is_checked_as_a_job(self):
        for pointer, body in (
            ("/job", {}),
            ("/job", {"job": 5}),
            ("/job/scene", {"job": {"scene": "cornell-box"}}),
            ("/job/film/width", {"job": {"film": {"width": 0}}}),
            ("/job/camra", {"job": {"camra": {}}}),
            ("/sizes/0", {"job": {}, "sizes": [5]}),
            ("/sizes/1/0", {"job": {}, "sizes": [[1, 1], [0, 1]]}),
            ("/size", {"job": {}, "size": []}),
            ("/job/class", {"job": {"class": "preview"}}),
            ("/deadline_seconds", {"job": {}, "deadline_seconds": 0}),
            # No URL would have an image.
            ("/job/camera/orbit", {"job": {"camera": {"position": [0, 0, 5],
                                                      "target": [0, 0, 0]}}}),
            ("/sizes/1", {"job": {}, "sizes": [[8, 8], [16384, 16384]]}),
        ):
            self.assert_problem(self.put("a", body), 422, pointer)
        for name in ("studio", "a%20b", "x" * 65):
            self.assert_problem(self.put(name, SMALL), 422, "/name")

    def test_render_takes_it_below_the_job_and_the_query(self):
        self.put("product", {"job": {"film": {"width": 24, "height": 12}, "seed": 3,
                                     "stop": {"samples_per_pixel": 4}}})
        answer = self.server.post("/v1/render?preset=product&scene=cornell-box&size=16x8")
        self.assertEqual((answer.status, png_size(answer.body)[:2]), (200, (16, 8)))
        spec = self.server.get(answer.headers["Location"]).json()["spec"]
        self.assertEqual((spec["seed"], spec["stop"]["samples_per_pixel"]), (3, 4))
        self.assert_problem(self.server.post("/v1/render?preset=none&scene=cornell-box"), 422,
                            "/preset")

    def test_key_is_shown_once_and_signs_until_it_is_deleted(self):
        self.put("p", SMALL)
        made = self.server.post("/v1/signing-keys")
        self.assertEqual((made.status, made.headers["Cache-Control"]), (201, "no-store"))
        key = made.json()
        self.assertEqual(sorted(key), ["id", "key"])
        self.assertEqual(len(base64.urlsafe_b64decode(key["key"] + "=")), 32)
        listed = self.server.get("/v1/signing-keys")
        self.assertIn(key["id"], [each["id"] for each in listed.json()["keys"]])
        self.assertNotIn(key["key"].encode(), listed.body)
        url = signed(key["key"], "/p/cornell-box/0,90.png")
        self.assertEqual(settled(self.server, url).status, 200)
        self.assertEqual(self.server.request("DELETE", "/v1/signing-keys/" + key["id"]).status, 204)
        self.assert_problem(self.server.get(url), 403)
        self.assertEqual(self.server.request("DELETE", "/v1/signing-keys/" + key["id"]).status, 404)


class Pictures(ApiTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.server.request("PUT", "/v1/presets/p", SMALL)
        cls.key = cls.server.post("/v1/signing-keys").json()["key"]

    def picture(self, rest, headers=None):
        return self.server.get(signed(self.key, rest), headers)

    def final(self, rest):
        return settled(self.server, signed(self.key, rest))

    def jobs(self):
        return len(self.server.get("/v1/jobs?limit=200").json()["jobs"])

    def test_image_is_that_of_the_preset_and_immutable(self):
        rest = "/p/cornell-box/30,75.png?w=48&dpr=2"
        answer = self.final(rest)
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/png"))
        self.assertEqual(png_size(answer.body)[:2], (96, 48))
        self.assertNotIn("Vary", answer.headers)  # the URL names the format
        for each in (answer, self.picture(rest)):
            again = self.picture(rest, {"If-None-Match": each.headers["ETag"]})
            self.assertEqual((again.status, again.body), (304, b""))
            self.assertIn("immutable", again.headers["Cache-Control"])
            self.assertEqual(again.headers["ETag"], answer.headers["ETag"])
        self.assertEqual(self.picture(rest).body, answer.body)
        for rest, size in (("/p/cornell-box/0,90.webp", None), ("/p/cornell-box/0,90.exr", None),
                           ("/p/cornell-box/0,90.png", (24, 12)),
                           ("/p/cornell-box/0,90.png?h=6", (12, 6)),
                           ("/p/cornell-box/0,90.png?dpr=1.5", (36, 18)),
                           ("/p/cornell-box/-20.5,90.png?w=10&h=10", (10, 10))):
            answer = self.final(rest)
            self.assertEqual(answer.status, 200, rest)
            if size:
                self.assertEqual(png_size(answer.body)[:2], size)

    def test_each_image_is_rendered_once(self):
        before = self.jobs()
        asked = [in_background(lambda: self.final("/p/cornell-box/1,80.png")) for _ in range(8)]
        bodies = {each().body for each in asked}
        bodies.add(self.final("/p/cornell-box/1,80.png?w=24").body)
        bodies.add(self.final("/p/cornell-box/1,80.png?w=12&dpr=2").body)
        self.final("/p/cornell-box/1,80.jpg")
        self.server.stop()
        self.server.start()
        bodies.add(self.final("/p/cornell-box/1,80.png").body)
        self.assertEqual((len(bodies), self.jobs() - before), (1, 1))

    def test_forged_or_widened_urls_are_refused_before_any_work(self):
        rest = "/p/cornell-box/30,75.png?w=24"
        good = signed(self.key, rest)
        self.assertEqual(settled(self.server, good).status, 200)
        before = self.jobs()
        for bad in (good.replace("w=24", "w=25"), good + "&dpr=2", good.replace("30,", "31,"),
                    good.replace("?w=24", ""), good.replace("/p/", "/q/"),
                    good.replace(".png", ".exr"), good.replace("cornell-box", "glass"),
                    good.replace("30,75", "30%2C75"), good.replace("?w", "?w=24&w"),
                    good.replace(rest, "=" + rest), good.replace(rest, "")[:-1] + rest,
                    signed(self.key + "x", rest), signed("", rest), "/i/x" + rest):
            self.assert_problem(self.server.get(bad), 403)
        self.assertEqual(self.server.get("/i/" + rest).status, 404)
        self.assertEqual(self.server.get("/i/public" + rest).status, 404)
        self.assertEqual(self.jobs(), before)

    def test_wrong_urls_are_problems(self):
        for status, pointers, rest in (
            (422, ["/view"], "/p/cornell-box/30.png"),
            (422, ["/view"], "/p/cornell-box/30,181.png"),
            (422, ["/view"], "/p/cornell-box/30,75."),  # Accept may not choose: caches ask by URL
            (406, [], "/p/cornell-box/30,75.bmp"),
            (422, ["/w"], "/p/cornell-box/30,75.png?w=0"),
            (422, ["/w"], "/p/cornell-box/30,75.png?w=16384&h=100&dpr=4"),
            (422, ["/h"], "/p/cornell-box/30,75.png?h=16384&w=100&dpr=1.1"),
            (422, ["/dpr"], "/p/cornell-box/30,75.png?dpr=0"),
            (422, ["/seed"], "/p/cornell-box/30,75.png?seed=1"),
            (422, ["/variant"], "/p/cornell-box:red/30,75.png"),
            (404, ["/scene"], "/p/" + 64 * "0" + "/30,75.png"),
            (404, [], "/none/cornell-box/30,75.png"),
        ):
            self.assert_problem(self.picture(rest), status, *pointers)

    def test_variant_is_that_of_the_scene(self):
        names = [{"name": "red"}, {"name": "as new"}]
        glb = triangle_glb(extensionsUsed=["KHR_materials_variants"],
                           extensions={"KHR_materials_variants": {"variants": names}})
        scene = self.server.post("/v1/scenes", glb, GLB).json()["id"]
        for variant in ("red", "as%20new"):
            answer = self.final(f"/p/{scene}:{variant}/0,90.png")
            self.assertEqual(answer.status, 200, answer)
        self.assert_problem(self.picture(f"/p/{scene}:blue/0,90.png"), 422, "/variant")

    def test_images_of_a_deleted_scene_are_gone(self):
        scene = self.server.post("/v1/scenes", triangle_glb(asset={"version": "2.0", "generator":
                                                                   "gone"}), GLB).json()["id"]
        rest = f"/p/{scene}/0,90.png"
        self.assertEqual(self.final(rest).status, 200)
        for job in self.server.get("/v1/jobs?limit=200").json()["jobs"]:
            if job["spec"]["scene"] == scene:
                self.assertEqual(self.server.request("DELETE", f"/v1/jobs/{job['id']}").status, 204)
        self.assertEqual(self.server.request("DELETE", "/v1/scenes/" + scene).status, 204)
        self.assert_problem(self.picture(rest), 404, "/scene")

    def test_image_of_a_deleted_job_is_rendered_again(self):
        rest = "/p/cornell-box/2,81.png"
        first = self.final(rest)
        newest = self.server.get("/v1/jobs?limit=1").json()["jobs"][0]["id"]
        self.assertEqual(self.server.request("DELETE", "/v1/jobs/" + newest).status, 204)
        # The file names its job; the pixels are the same.
        self.assertEqual(png_pixels(self.final(rest).body), png_pixels(first.body))
        self.assertNotEqual(self.server.get("/v1/jobs?limit=1").json()["jobs"][0]["id"], newest)

    def test_first_answer_of_a_long_job_is_whole_and_not_stored(self):
        self.server.request("PUT", "/v1/presets/long", LONG)
        end = time.monotonic() + PATIENCE_S
        answer = self.picture("/long/cornell-box/0,90.png")
        while answer.status == 503 and time.monotonic() < end:  # before the first whole pass
            answer = self.picture("/long/cornell-box/0,90.png")
        self.assertEqual(answer.status, 200, answer)
        self.assertEqual(answer.headers["Cache-Control"], "no-store")
        self.assertGreaterEqual(float(answer.headers["X-Tessera-Samples"]), 1)
        self.assertEqual(png_size(answer.body)[:2], (64, 64))
        again = self.picture("/long/cornell-box/0,90.png")
        self.assertEqual(again.headers["Cache-Control"], "no-store")
        unfinished = self.server.get(self.UNFINISHED).json()["jobs"]
        self.assertEqual(len(unfinished), 1)  # it goes on
        job = unfinished[0]
        self.assertEqual(job["spec"]["stop"]["samples_per_pixel"], 65536)

    def test_client_that_leaves_takes_no_image_from_visitors(self):
        self.server.request("PUT", "/v1/presets/shown", {**LONG, "deadline_seconds": 3})
        sender = http.client.HTTPConnection("127.0.0.1", self.server.port)
        sender.request("POST", "/v1/render?preset=shown&scene=cornell-box&theta=9&phi=90&wait=60")
        jobs = wait_for(lambda: self.server.get(self.UNFINISHED).json()["jobs"])
        visitor = in_background(lambda: self.picture("/shown/cornell-box/9,90.png"))
        time.sleep(1)  # it waits now
        sender.close()
        visitor()
        time.sleep(2)  # a lost client is seen within a second
        left = self.server.get(self.UNFINISHED).json()["jobs"]
        self.assertEqual([job["id"] for job in left], [jobs[0]["id"]])

    def test_model_keeps_its_size_on_a_turntable(self):
        plate = self.server.post("/v1/scenes", triangle_glb(), GLB).json()["id"]
        self.server.request("PUT", "/v1/presets/turning", {**SMALL, "turntable": True})
        metres = {}
        for preset in ("p", "turning"):
            for theta in (0, 45, 90):
                image = self.final(f"/{preset}/{plate}/{theta},90.png")
                answer = self.server.post(
                    f"/v1/render?preset={preset}&scene={plate}&theta={theta}&phi=90")
                job = self.server.get(answer.headers["Location"]).json()
                metres[preset, theta] = job["spec"]["camera"]["orbit"]["radius"]
                shared = (preset, theta)  # by both routes: the tag is of the job
                self.assertEqual(answer.headers["ETag"], image.headers["ETag"], shared)
        self.assertEqual(len({metres["turning", theta] for theta in (0, 45, 90)}), 1)
        self.assertEqual(len({metres["p", theta] for theta in (0, 45, 90)}), 3)
        # At each angle alone, the triangle is in the middle of the image.
        self.assertGreater(metres["turning", 0], max(metres["p", theta] for theta in (0, 45, 90)))

    def test_deadline_is_the_presets(self):
        self.server.request("PUT", "/v1/presets/hasty", {**LONG, "deadline_seconds": 0.1})
        self.server.request("PUT", "/v1/presets/slow", {**LONG, "deadline_seconds": 4})
        begin = time.monotonic()
        self.picture("/slow/cornell-box/3,90.png")
        self.assertGreaterEqual(time.monotonic() - begin, 4)
        begin = time.monotonic()
        self.picture("/hasty/cornell-box/3,90.png")  # the same job
        self.assertLess(time.monotonic() - begin, 4)

    def test_public_presets_have_their_sizes_only(self):
        self.server.request("PUT", "/v1/presets/open", {
            **SMALL, "public": True, "sizes": [[48, 24]]})
        for query, status in (("", 200), ("?w=48", 200), ("?w=24&dpr=2", 200), ("?w=24", 200),
                              ("?w=49", 403), ("?w=48&h=25", 403)):
            answer = settled(self.server, "/i/public/open/cornell-box/5,75.png" + query)
            self.assertEqual(answer.status, status, query)
        before = self.jobs()
        for view in ("5.5,75", "5,75.25", "1e-9,75"):
            self.assert_problem(self.server.get(f"/i/public/open/cornell-box/{view}.png"), 403)
        self.assertEqual(self.jobs(), before)
        self.server.request("PUT", "/v1/presets/placed", {"public": True, "job": {
            **SMALL["job"], "camera": {"orbit": {"theta_degrees": 320.25, "phi_degrees": 75.5}}}})
        for view, status in (("-39.75,75.5", 200), ("320.25,75", 403), ("320,75.5", 403)):
            answer = settled(self.server, f"/i/public/placed/cornell-box/{view}.png")
            self.assertEqual(answer.status, status, view)

    def test_a_turn_is_the_same_image(self):
        for angles in (("-30.5", "329.5", "-390.5", "3.295e2"), ("180", "-180", "540"),
                       ("0", "-0", "360", "-360", "-1e-30")):
            tags = {self.final(f"/p/cornell-box/{theta},74.png").headers["ETag"]
                    for theta in angles}
            sent = [self.server.post(f"/v1/render?preset=p&scene=cornell-box&phi=74&theta={theta}")
                    for theta in angles]
            tags.update(answer.headers["ETag"] for answer in sent)
            self.assertEqual(len(tags), 1, angles)
        self.assertEqual(self.final("/p/cornell-box/0,0.png").headers["ETag"],
                         self.final("/p/cornell-box/0,-0.png").headers["ETag"])

    def test_pages_of_all_origins_may_use_it(self):
        rest = "/p/cornell-box/30,75.png"
        self.final(rest)
        plain, crossed = self.picture(rest), self.picture(rest, FOREIGN)  # crossorigin="anonymous"
        for answer in (plain, crossed):
            self.assertEqual((answer.status, answer.headers["Access-Control-Allow-Origin"]),
                             (200, "*"))
        # Nothing else is open to them.
        self.assertEqual(self.server.get("/v1/presets", FOREIGN).status, 403)

    def test_white_on_a_white_ground_is_not_grey(self):
        """The light is read from the camera's side, not metered from the image: the exposure of the
        image is the same whatever it shows, and depends on where the camera stands."""
        self.server.request("PUT", "/v1/presets/lit", {"job": {
            **SMALL["job"], "environment": {"preset": "rim"}, "ground": {"type": "sweep"}}})
        stops = {}
        for scene in ("cornell-box", "glass"):
            for theta in (0, 180):
                answer = self.final(f"/lit/{scene}/{theta},90.png")
                stops[scene, theta] = float(answer.headers["X-Tessera-Exposure"])
        self.assertEqual(stops["cornell-box", 0], stops["glass", 0])
        self.assertEqual(stops["cornell-box", 180], stops["glass", 180])
        self.assertLess(stops["glass", 180], stops["glass", 0])  # the rims shine from behind
        job = self.server.get("/v1/jobs?limit=1").json()["jobs"][0]["id"]
        plain = self.server.get(f"/v1/jobs/{job}/image.png?exposure=auto")
        self.assertEqual(float(plain.headers["X-Tessera-Exposure"]), stops["glass", 180])

    def test_command_line_signs(self):
        rest = "/p/cornell-box/30,75.png?w=24"
        code, told, said = tessera("sign", rest, "--key", self.key)
        self.assertEqual((code, told.strip()), (0, signed(self.key, rest)), said)
        code, told, _ = tessera("sign", rest, environ={"TESSERA_SIGNING_KEY": self.key})
        self.assertEqual((code, told.strip()), (0, signed(self.key, rest)))
        # Browsers would encode the last ones, and ask for another URL.
        for wrong in (rest[1:], "/p/a b/0,90.png", "/p/ä/0,90.png", rest + "&x='"):
            self.assertNotEqual(tessera("sign", wrong, "--key", self.key)[0], 0, wrong)


class Failures(unittest.TestCase):
    def test_image_that_fails_is_tried_once_until_someone_tries_again(self):
        server = started(self)
        server.request("PUT", "/v1/presets/p", SMALL)
        key = server.post("/v1/signing-keys").json()["key"]
        model = triangle_glb()
        scene = server.post("/v1/scenes", model, GLB).json()["id"]
        server.stop()
        with open(f"{server.data}/assets/{scene[:2]}/{scene}", "r+b") as file:
            file.write(b"damage")
        server.start()
        url = signed(key, f"/p/{scene}/0,90.png")
        self.assertEqual(settled(server, url).status, 500)
        server.stop()
        server.start()
        for each in (url, url, url.replace(".png", ".jpg")):
            each = signed(key, each[each.index("/p/"):])
            answer = server.get(each)
            self.assertEqual(answer.status, 500, answer)
            self.assertIn("upload it again", answer.json()["detail"])
            self.assertGreater(int(answer.headers["Retry-After"]), 200)
        jobs = server.get("/v1/jobs").json()["jobs"]
        self.assertEqual([job["state"] for job in jobs], ["failed"])
        # Who knows what has been mended need not wait.
        self.assertEqual(server.post("/v1/scenes", model, GLB).status, 200)
        self.assertEqual(server.get(url).status, 500)
        self.assertEqual(server.post(f"/v1/jobs/{jobs[0]['id']}/retry").status, 202)
        self.assertEqual(settled(server, url).status, 200)
        self.assertEqual(len(server.get("/v1/jobs").json()["jobs"]), 1)


class Bounds(unittest.TestCase):
    def start(self, *flags):
        self.server = started(self, *flags, threads=1)
        for name in ("open", "other"):
            self.server.request("PUT", "/v1/presets/" + name,
                                {**LONG, "public": True, "deadline_seconds": 0.001})

    def visit(self, preset, count, scene="cornell-box"):
        return [self.server.get(f"/i/public/{preset}/{scene}/{theta},90.webp")
                for theta in range(count)]

    def unfinished(self):
        return len(self.server.get(ApiTest.UNFINISHED).json()["jobs"])

    def test_visitors_leave_half_of_the_queue(self):
        self.start("--max-queue", "8", "--max-running", "1")
        limits = self.server.get("/v1/server").json()["limits"]
        self.assertEqual((limits["url_jobs_of_a_key"], limits["url_jobs_of_a_preset"]), (4, 64))
        for answer in self.visit("open", 12):
            self.assertEqual(answer.status, 503)
            self.assertGreaterEqual(int(answer.headers["Retry-After"]), 1)
        self.assertEqual(self.unfinished(), 4)
        self.assertEqual(self.visit("other", 1, "glass")[0].status, 503)
        self.assertEqual(self.unfinished(), 4)
        job = {"scene": "cornell-box", **LONG["job"]}
        for _ in range(4):
            self.assertEqual(self.server.post("/v1/jobs", job).status, 201)
        # An end makes room.
        ended = self.server.get(ApiTest.UNFINISHED).json()["jobs"][-1]["id"]
        self.server.post(f"/v1/jobs/{ended}/cancel")
        self.assertEqual(self.unfinished(), 7)
        self.visit("other", 3, "glass")
        self.assertEqual(self.unfinished(), 8)

    def test_visitors_of_a_preset_leave_room_to_those_of_others(self):
        self.start()
        self.visit("open", 70)
        self.assertEqual(self.unfinished(), 64)
        self.visit("other", 2, "glass")
        self.assertEqual(self.unfinished(), 66)


class Tenants(unittest.TestCase):
    def test_keys_sign_for_their_tenant_alone(self):
        server = Server("--key", "operators-own", "--max-queue", "1", "--max-running", "1",
                        key="operators-own")
        self.addCleanup(server.close)
        tenants = {}
        for name in ("ours", "theirs"):
            code, key, said = tessera("keys", "add", name, "--data", server.data)
            self.assertEqual(code, 0, said)
            tenants[name] = {"Authorization": "Bearer " + key.strip()}
        server.start()
        ours, theirs = tenants["ours"], tenants["theirs"]
        server.request("PUT", "/v1/presets/p", SMALL, ours)
        self.assertEqual(server.request("GET", "/v1/presets/p", headers=theirs).status, 404)
        self.assertEqual(server.request("DELETE", "/v1/presets/p", headers=theirs).status, 404)
        made, other = (server.request("POST", "/v1/signing-keys", headers=h).json()
                       for h in (ours, theirs))
        listed = server.request("GET", "/v1/signing-keys", headers=theirs).json()["keys"]
        self.assertEqual([each["id"] for each in listed], [other["id"]])
        gone = server.request("DELETE", "/v1/signing-keys/" + made["id"], headers=theirs)
        self.assertEqual(gone.status, 404)
        key, other = made["key"], other["key"]
        scene = server.post("/v1/scenes", triangle_glb(), {**GLB, **ours}).json()["id"]
        rest = f"/p/{scene}/0,90.png"
        server.key = None  # A browser has none.
        self.assertEqual(settled(server, signed(key, rest)).status, 200)
        self.assertEqual(server.get(signed(other, rest)).status, 404)  # no preset of theirs
        self.assertEqual(server.request("PUT", "/v1/presets/p", SMALL, theirs).status, 201)
        self.assertEqual(server.get(signed(other, rest)).status, 404)  # no scene of theirs
        jobs = server.request("GET", "/v1/jobs", headers=theirs).json()["jobs"]
        self.assertEqual(jobs, [])
        # Public names belong to one tenant.
        open_ = {**SMALL, "public": True}
        self.assertEqual(server.request("PUT", "/v1/presets/open", open_, ours).status, 201)
        self.assertEqual(server.request("PUT", "/v1/presets/open", open_, theirs).status, 409)
        answer = settled(server, f"/i/public/open/{scene}/0,90.png")
        self.assertEqual(answer.status, 200)
        # Whoever runs the server sees it, and can withdraw it.
        server.key = "operators-own"
        listed = [each["name"] for each in server.get("/v1/presets").json()["presets"]]
        self.assertEqual(listed, sorted(READY + ["open", "p"]))
        self.assertEqual(server.request("DELETE", "/v1/presets/open").status, 204)
        server.key = None
        self.assertEqual(server.get(f"/i/public/open/{scene}/0,90.png").status, 404)
        self.assertTrue(answer.headers["Cache-Control"].startswith("public"))
        # A full queue: later, not never.
        long = {"scene": "cornell-box", "stop": {"samples_per_pixel": 65536}}
        while server.request("POST", "/v1/jobs", long, ours).status == 201:
            pass
        busy = server.get(signed(key, f"/p/{scene}/7,90.png"))
        self.assertEqual(busy.status, 503)
        self.assertGreaterEqual(int(busy.headers["Retry-After"]), 1)
        self.assertEqual(server.get(signed(key, rest)).status, 200)  # rendered before

    def test_quota_and_priority_are_the_tenants(self):
        server = Server("--key", "operators-own", "--quota-jobs", "1", key="operators-own")
        self.addCleanup(server.close)
        code, key, said = tessera("keys", "add", "ours", "--max-priority", "0", "--data",
                                  server.data)
        self.assertEqual(code, 0, said)
        ours = {"Authorization": "Bearer " + key.strip()}
        server.start()
        server.request("PUT", "/v1/presets/p", SMALL, ours)
        first = {"job": {**SMALL["job"], "priority": 1}}
        self.assertEqual(server.request("PUT", "/v1/presets/q", first, ours).status, 422)
        signer = server.request("POST", "/v1/signing-keys", headers=ours).json()["key"]
        long = {"scene": "cornell-box", "stop": {"samples_per_pixel": 65536}}
        self.assertEqual(server.request("POST", "/v1/jobs", long, ours).status, 201)
        busy = server.get(signed(signer, "/p/cornell-box/7,90.png"))
        self.assertEqual(busy.status, 503)
        self.assertGreaterEqual(int(busy.headers["Retry-After"]), 1)

    def test_backup_has_presets_and_keys(self):
        server = started(self)
        server.request("PUT", "/v1/presets/p", SMALL)
        key = server.post("/v1/signing-keys").json()["key"]
        code, _, said = tessera("backup", "--data", server.data, "--to", server.data + "-copy")
        self.assertEqual(code, 0, said)
        server.stop()
        copy = started(self, data=server.data + "-copy")
        self.assertEqual(copy.get("/v1/presets/p").json()["job"], SMALL["job"])
        self.assertEqual(settled(copy, signed(key, "/p/cornell-box/1,90.png")).status, 200)
        copy.stop()
        code, _, said = tessera("check", "--data", copy.data)
        self.assertEqual(code, 0, said)
