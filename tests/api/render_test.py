"""POST /v1/render: a scene in, an image out, by one request."""

import http.client
import io
import itertools
import json
import math
import shutil
import struct
import subprocess
import tempfile
import time
import unittest
import zipfile

from harness import (PATIENCE_S, TRIANGLE, ApiTest, Server, glb, hdr_image, in_background,
                     png_pixels, png_size, started, tessera, triangle_document, triangle_glb,
                     wait_for)


def white_glb(points, normals, triangles):
    """A rough mesh of albedo 0.8."""
    count = len(triangles) * 3
    chunks = [b"".join(struct.pack("<3f", *row) for row in rows) for rows in (points, normals)]
    chunks.append(struct.pack(f"<{count}H", *(i for each in triangles for i in each)))
    views, at = [], 0
    for chunk in chunks:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(chunk)})
        at += len(chunk) + -len(chunk) % 4
    box = {name: [f(p[c] for p in points) for c in range(3)]
           for name, f in (("min", min), ("max", max))}
    return glb({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.8, 0.8, 0.8, 1],
                                                "metallicFactor": 0, "roughnessFactor": 0.6}}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2,
                                    "material": 0}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(points), "type": "VEC3", **box},
            {"bufferView": 1, "componentType": 5126, "count": len(points), "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": count, "type": "SCALAR"}],
        "bufferViews": views, "buffers": [{"byteLength": at}]},
        b"".join(chunk + bytes(-len(chunk) % 4) for chunk in chunks))


def flat_glb(polygons):
    """Convex polygons, counter-clockwise from outside, each with its own normal."""
    points, normals, triangles = [], [], []
    for polygon in polygons:
        (ax, ay, az), (bx, by, bz), (cx, cy, cz) = polygon[:3]
        u, v = (bx - ax, by - ay, bz - az), (cx - ax, cy - ay, cz - az)
        normal = (u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])
        length = math.hypot(*normal)
        first = len(points)
        points += polygon
        normals += [tuple(x / length for x in normal)] * len(polygon)
        triangles += [(first, first + i, first + i + 1) for i in range(1, len(polygon) - 1)]
    return white_glb(points, normals, triangles)


def cube_glb(half=(1, 1, 1)):
    polygons = []
    for axis in range(3):
        for sign in (-1, 1):
            polygon = []
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1)):
                point = [0, 0, 0]
                point[axis], point[(axis + 1) % 3], point[(axis + 2) % 3] = sign, a * sign, b
                polygon.append(tuple(c * h for c, h in zip(point, half)))
            polygons.append(polygon)
    return flat_glb(polygons)


def house_glb():
    """Walls of 2 x 1.2 x 1.6 m below a gable roof whose ridge is along x, 2 m above the ground."""
    x, y, z, ridge = 1, 1.2, 0.8, 2
    return flat_glb([
        [(-x, 0, z), (x, 0, z), (x, y, z), (-x, y, z)],
        [(x, 0, -z), (-x, 0, -z), (-x, y, -z), (x, y, -z)],
        [(x, 0, z), (x, 0, -z), (x, y, -z), (x, ridge, 0), (x, y, z)],
        [(-x, 0, -z), (-x, 0, z), (-x, y, z), (-x, ridge, 0), (-x, y, -z)],
        [(-x, y, z), (x, y, z), (x, ridge, 0), (-x, ridge, 0)],
        [(x, y, -z), (-x, y, -z), (-x, ridge, 0), (x, ridge, 0)],
        [(-x, 0, -z), (x, 0, -z), (x, 0, z), (-x, 0, z)],
    ])


def torus_glb(around=48, across=24, radius=1, tube=0.4):
    """Lies on the ground: its axis is y."""
    points, normals, triangles = [], [], []
    for i in range(around):
        for k in range(across):
            a, b = 2 * math.pi * i / around, 2 * math.pi * k / across
            normal = (math.cos(b) * math.cos(a), math.sin(b), math.cos(b) * math.sin(a))
            normals.append(normal)
            points.append((radius * math.cos(a) + tube * normal[0], tube * normal[1],
                           radius * math.sin(a) + tube * normal[2]))
            right, up = (i + 1) % around * across, (k + 1) % across
            here = i * across
            triangles += [(here + k, here + up, right + up), (here + k, right + up, right + k)]
    return white_glb(points, normals, triangles)


QUICK = "size=24x16&samples=4"
GLB = {"Content-Type": "model/gltf-binary"}
OCTETS = {"Content-Type": "application/octet-stream"}


def form(*parts):
    """Body and headers of a form; parts are (name, content) or (name, content, filename)."""
    body = b""
    for name, content, *filename in parts:
        content = content if isinstance(content, bytes) else content.encode()
        file = f'; filename="{filename[0]}"' if filename else ""
        body += (b"--limit-of-parts\r\nContent-Disposition: form-data; "
                 + f'name="{name}"{file}\r\n\r\n'.encode() + content + b"\r\n")
    return (body + b"--limit-of-parts--\r\n",
            {"Content-Type": "multipart/form-data; boundary=limit-of-parts"})


def zipped(**files):
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in files.items():
            archive.writestr(name.replace("_", "."), content)
    return packed.getvalue()


class Render(ApiTest):
    def render(self, query, body=None, headers=None):
        return self.server.post(f"/v1/render?{query}", body, headers)

    def rendered(self, *arguments):
        answer = self.render(*arguments)
        self.assertEqual(answer.status, 200, answer)
        return answer

    def job_of(self, answer):
        return self.server.get(answer.headers["Location"]).json()

    def test_every_form_of_a_scene_gives_its_image(self):
        document = json.dumps(triangle_document("points.bin"))
        inside = json.dumps(triangle_document("points.bin"))
        for query, *sent in (
            (QUICK, triangle_glb(), GLB),
            (QUICK, triangle_glb(), OCTETS),
            (QUICK, triangle_glb(), {"Content-Type": "application/x-www-form-urlencoded"}),
            (QUICK, zipped(scene_gltf=inside, points_bin=TRIANGLE), {}),
            (QUICK, *form(("scene", triangle_glb(), "a.glb"))),
            (QUICK, *form(("scene", document, "a.gltf"), ("file", TRIANGLE, "points.bin"))),
            (QUICK, *form(("scene", "cornell-box"))),
            (QUICK + "&scene=cornell-box",),
            (QUICK, {"scene": "cornell-box"}),
            ("", *form(("scene", triangle_glb(), "a.glb"), ("size", "24x16"), ("samples", "4"))),
            ("samples=4", *form(("scene", triangle_glb(), "a.glb"),
                                ("job", json.dumps({"film": {"width": 24, "height": 16}})))),
        ):
            answer = self.rendered(query, *sent)
            self.assertEqual(answer.headers["Content-Type"], "image/png")
            self.assertEqual(png_size(answer.body)[:2], (24, 16), query)
            self.assertTrue(answer.headers["ETag"])
            error = [float(x) for x in answer.headers["X-Tessera-Error"].split(",")]
            self.assertEqual(len(error), 3)
            job = self.job_of(answer)
            self.assertEqual((job["state"], job["spec"]["stop"]),
                             ("finished", {"samples_per_pixel": 4}))

    def test_side_files_are_found_below_folders(self):
        document = json.dumps(triangle_document("models/points.bin"))
        scene = ("scene", document, "a.gltf")
        for name in ("models/points.bin", "Models\\\\POINTS.bin", "points.bin"):
            self.rendered(QUICK, *form(scene, ("file", TRIANGLE, name)))
        missing = self.render(QUICK, *form(scene, ("file", TRIANGLE, "other.bin")))
        self.assert_problem(missing, 424, "/files/models~1points.bin")

    def test_settings_of_the_query_are_those_of_the_job(self):
        answer = self.rendered(
            "size=40x20&error=50%25&seconds=20&samples=64&preset=studio&ground=catcher&theta=30"
            "&phi=60&format=png", triangle_glb(), GLB)
        spec = self.job_of(answer)["spec"]
        self.assertEqual((spec["film"]["width"], spec["film"]["height"]), (40, 20))
        self.assertEqual(spec["stop"]["relative_error"], 0.5)
        self.assertEqual(spec["stop"]["seconds"], 20)
        self.assertEqual(spec["stop"]["samples_per_pixel"], 64)
        self.assertEqual(spec["environment"]["preset"], "studio")
        self.assertEqual(spec["ground"]["type"], "catcher")
        self.assertEqual(spec["camera"]["orbit"]["theta_degrees"], 30)
        self.assertEqual(spec["camera"]["orbit"]["phi_degrees"], 60)
        self.assertEqual(png_size(answer.body), (40, 20, 6))

    def test_model_fills_the_image_except_for_a_margin(self):
        # From the front the triangle is as wide and as high as its box; 8% are free on each side.
        clear = ("job", json.dumps({"background": {"type": "transparent"}}))
        for size in ("100x100", "200x100", "100x200"):
            answer = self.rendered(f"size={size}&theta=0&phi=90&samples=16",
                                   *form(("scene", triangle_glb(), "a.glb"), clear))
            rows = png_pixels(answer.body)
            across = [x for x in range(len(rows[0])) if any(row[x][3] > 127 for row in rows)]
            down = [y for y, row in enumerate(rows) if any(p[3] > 127 for p in row)]
            for seen in (across, down):
                # Half a pixel of the edge's own, and the tip of the triangle.
                self.assertAlmostEqual(seen[-1] + 1 - seen[0], 84, delta=3, msg=size)

    def test_long_and_flat_models_come_as_close(self):
        clear = ("job", json.dumps({"background": {"type": "transparent"}}))
        for x, y, z in ((5, 0.1, 0.5), (0.2, 4, 0.2)):
            scene = ("scene", cube_glb((x, y, z)), "a.glb")
            answer = self.rendered("size=100x100&theta=30&phi=75&samples=4", *form(scene, clear))
            rows = png_pixels(answer.body)
            across = [x for x in range(100) if any(row[x][3] > 127 for row in rows)]
            down = [y for y, row in enumerate(rows) if any(p[3] > 127 for p in row)]
            free = min(across[0], 99 - across[-1], down[0], 99 - down[-1])
            self.assertAlmostEqual(free, 8, delta=1.5)

    def test_query_is_merged_into_the_job(self):
        job = {"seed": 7, "film": {"height": 12}, "stop": {"samples_per_pixel": 4},
               "environment": {"intensity": 2}}
        answer = self.rendered("size=20x10&preset=rim", *form(
            ("scene", triangle_glb(), "a.glb"), ("job", json.dumps(job))))
        spec = self.job_of(answer)["spec"]
        self.assertEqual((spec["seed"], spec["film"]["height"]), (7, 10))
        self.assertEqual(spec["stop"], {"samples_per_pixel": 4})
        self.assertEqual((spec["environment"]["preset"], spec["environment"]["intensity"]),
                         ("rim", 2))

    def test_job_without_a_stop_rule_ends_by_error_or_time(self):
        spec = self.job_of(self.rendered("size=16x16", triangle_glb(), GLB))["spec"]
        self.assertEqual((spec["stop"]["relative_error"], spec["stop"]["seconds"]), (0.03, 10))

    def test_percent_sign_of_an_error_need_not_be_encoded(self):
        head = b"POST /v1/render?%s HTTP/1.1\r\nHost: 127.0.0.1\r\nConnection: close\r\n\r\n"
        for query in (b"scene=cornell-box&size=16x16&error=40%",
                      b"scene=cornell-box&error=40%&size=16x16",
                      b"scene=cornell-box&size=16x16&error=40%25",
                      b"scene=cornell-box&size=16x16&error=0.4"):
            received = self.server.raw(head % query)
            self.assertTrue(received.startswith(b"HTTP/1.1 200 "), received[:400])
            location = received.split(b"Location: ")[1].split(b"\r\n")[0].decode()
            stop = self.server.get(location).json()["spec"]["stop"]
            self.assertEqual(stop["relative_error"], 0.4)
        self.assert_problem(self.render("scene=cornell-box&error=4%zz"), 400)

    @unittest.skipUnless(shutil.which("curl"), "curl is not installed")
    def test_example_of_the_documents_works_with_curl(self):
        with tempfile.TemporaryDirectory() as folder:
            with open(folder + "/chair.glb", "wb") as file:
                file.write(triangle_glb())
            url = f"http://127.0.0.1:{self.server.port}/v1/render?size=80x80&error=30%"
            subprocess.run(
                ["curl", "-fsS", "-F", "scene=@chair.glb", url, "-o", "chair.png"],
                cwd=folder, check=True, timeout=PATIENCE_S)
            with open(folder + "/chair.png", "rb") as file:
                self.assertEqual(png_size(file.read())[:2], (80, 80))

    def test_uploaded_environment_lights_the_scene(self):
        def mean(rgb):
            answer = self.rendered(QUICK + "&exposure=0&curve=linear", *form(
                ("scene", triangle_glb(), "a.glb"), ("environment", hdr_image(4, 2, rgb), "e.hdr")))
            pixels = [p for row in png_pixels(answer.body) for p in row]
            return [sum(p[c] for p in pixels) for c in range(3)]

        red, _, blue = mean((0.5, 0.25, 0.125))
        self.assertGreater(red, 3 * blue)  # 4 times: the colour of the environment
        red, _, blue = mean((0.125, 0.25, 0.5))
        self.assertGreater(blue, 3 * red)

    def test_format_is_that_of_the_query_or_of_accept(self):
        for query, accept, mime in (
            ("&format=jpg", "image/png", "image/jpeg"),
            ("&format=exr", "*/*", "image/x-exr"),
            ("", "image/webp", "image/webp"),
        ):
            answer = self.rendered(QUICK + query, triangle_glb(), {**GLB, "Accept": accept})
            self.assertEqual(answer.headers["Content-Type"], mime)
        self.assert_problem(self.render(QUICK + "&format=bmp", triangle_glb(), GLB), 422, "/format")
        self.assert_problem(
            self.render(QUICK, triangle_glb(), {**GLB, "Accept": "text/html"}), 406)

    def test_display_formats_are_exposed_automatically(self):
        bright = {"environment": {"color": [1000, 1000, 1000]}}
        parts = (("scene", triangle_glb(), "a.glb"), ("job", json.dumps(bright)))
        automatic = self.rendered(QUICK, *form(*parts))
        self.assertLess(float(automatic.headers["X-Tessera-Exposure"]), -8)  # 1000 is 10 stops
        plain = self.rendered(QUICK + "&exposure=0", *form(*parts))
        self.assertEqual(float(plain.headers["X-Tessera-Exposure"]), 0)
        linear = self.rendered(QUICK + "&format=exr", *form(*parts))
        self.assertNotIn("X-Tessera-Exposure", linear.headers)

    def test_white_product_keeps_its_shading_on_white(self):
        job = json.dumps({"camera": {"orbit": {"theta_degrees": 30, "phi_degrees": 60}},
                          "film": {"layers": ["object"]}})
        over_white = "catcher&background=ffffff"
        for shape, grounds in ((cube_glb, ("sweep", over_white)), (house_glb, (over_white,)),
                               (torus_glb, (over_white,))):
            scene = ("scene", shape(), "a.glb")
            for preset, ground in itertools.product(("studio", "tent", "rim"), grounds):
                answer = self.rendered(
                    f"size=48x48&samples=16&preset={preset}&ground={ground}&wait=60",
                    *form(scene, ("job", job)))
                shown = self.server.get(answer.headers["Location"] + "/image.png?layer=object")
                shades = sorted(
                    sum(pixel[:3]) / 3
                    for row, ids in zip(png_pixels(answer.body), png_pixels(shown.body))
                    for pixel, id in zip(row, ids) if any(id[:3]))
                self.assertGreater(len(shades), 300)
                told = (shape.__name__, preset, ground)
                clipped = sum(v >= 254 for v in shades) / len(shades)
                self.assertLessEqual(clipped, 0.01, told)
                # Not one shade; the brightest near the code of its albedo, 231.
                dark, bright = (shades[int(q * len(shades))] for q in (0.05, 0.95))
                self.assertGreater(bright - dark, 15, told)
                self.assertGreater(bright, 100 if preset == "rim" else 190, told)

    def test_cut_out_edges_have_the_colour_of_the_product(self):
        # It radiates 0.5 in all directions, of which the curve makes 188 (IEC 61966-2-1).
        document = triangle_document()
        document["materials"] = [{"emissiveFactor": [0.5] * 3, "pbrMetallicRoughness": {
            "baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0, "roughnessFactor": 1},
            "extensions": {"KHR_materials_specular": {"specularFactor": 0}}}]
        document["extensionsUsed"] = ["KHR_materials_specular"]
        document["meshes"][0]["primitives"][0]["material"] = 0
        clear = ("job", json.dumps({"background": {"type": "transparent"},
                                    "environment": {"color": [0, 0, 0]}}))
        scene = ("scene", glb(document, TRIANGLE), "a.glb")
        look = "size=48x48&samples=16&theta=0&phi=90&exposure=0&curve=srgb"
        pixels = [p for row in png_pixels(self.rendered(look, *form(scene, clear)).body)
                  for p in row]
        edges = [p for p in pixels if 0 < p[3] < 255]
        self.assertGreater(len(edges), 50)
        for *rgb, alpha in pixels:
            if alpha > 0:
                for value in rgb:  # of an edge: to half a code of the associated value
                    self.assertAlmostEqual(value, 188, delta=1, msg=alpha)
        over = [p for row in png_pixels(
            self.rendered(look + "&background=000000", *form(scene, clear)).body) for p in row]
        for (value, *_), (*_, alpha) in zip(over, pixels):
            self.assertAlmostEqual(value, 188 * alpha / 255, delta=2)

    def test_same_request_gets_the_image_of_the_same_job(self):
        first = self.rendered(QUICK, triangle_glb(), GLB)
        again = self.rendered(QUICK, triangle_glb(), GLB)
        self.assertEqual(again.headers["Location"], first.headers["Location"])
        self.assertEqual((again.body, again.headers["ETag"]), (first.body, first.headers["ETag"]))
        # The same job, said otherwise; another image of it; another job.
        said = self.rendered("samples=4", *form(("scene", triangle_glb(), "b.glb"),
                                                ("size", "24x16")))
        self.assertEqual(said.headers["Location"], first.headers["Location"])
        jpg = self.rendered(QUICK + "&format=jpg", triangle_glb(), GLB)
        self.assertEqual(jpg.headers["Location"], first.headers["Location"])
        other = self.rendered(QUICK + "&theta=5", triangle_glb(), GLB)
        self.assertNotEqual(other.headers["Location"], first.headers["Location"])
        self.assertNotEqual(other.headers["ETag"], first.headers["ETag"])

    def test_deleted_or_changed_job_is_made_again(self):
        query = QUICK + "&theta=77"
        first = self.rendered(query, triangle_glb(), GLB).headers["Location"]
        self.server.request("DELETE", first)
        second = self.rendered(query, triangle_glb(), GLB).headers["Location"]
        self.assertNotEqual(second, first)
        extended = self.server.post(second + "/extend", {"stop": {"samples_per_pixel": 8}})
        self.assertEqual(extended.status, 202, extended)
        self.server.wait(second.rsplit("/", 1)[1])
        third = self.rendered(query, triangle_glb(), GLB).headers["Location"]
        self.assertEqual(self.server.get(third).json()["spec"]["stop"], {"samples_per_pixel": 4})

    def test_beyond_the_wait_the_answer_is_the_job(self):
        query = "scene=cornell-box&size=32x32&samples=65536&wait=0"
        answer = self.render(query)
        self.assertEqual(answer.status, 202, answer)
        self.assertGreaterEqual(int(answer.headers["Retry-After"]), 1)
        self.assertEqual(answer.headers["Location"], "/v1/jobs/" + answer.json()["id"])
        self.assertFalse(answer.json()["state"] in ("cancelled", "failed"))
        # Asking again finds the same job, and the image that it left when it was cancelled is none.
        self.assertEqual(self.render(query).headers["Location"], answer.headers["Location"])
        waiting = in_background(lambda: self.render(query.replace("wait=0", "wait=60")))
        time.sleep(0.2)
        self.server.post(answer.headers["Location"] + "/cancel")
        self.assert_problem(waiting(), 409)

    def test_failing_requests_are_problems(self):
        two = json.dumps({"scene": "cornell-box"})
        part = ("scene", triangle_glb(), "a.glb")
        for status, pointer, query, *sent in (
            (422, "/scene", QUICK),
            (422, "/scene", "", *form(("size", "16x16"))),
            (422, "/scene", QUICK + "&scene=cornell-box", triangle_glb(), GLB),
            (422, "/scene", QUICK, *form(part, ("job", two))),
            (404, "/scene", QUICK + "&scene=" + 64 * "0"),
            (422, "/size", "size=800&scene=cornell-box"),
            (422, "/size", "size=0x9&scene=cornell-box"),
            (422, "/error", "error=3percent&scene=cornell-box"),
            (422, "/error", "error=0%&scene=cornell-box"),
            (422, "/preset", "preset=moon&scene=cornell-box"),
            (422, "/ground", "ground=sea&scene=cornell-box"),
            (422, "/exposure", "exposure=1&format=exr&scene=cornell-box"),
            (422, "/depth", "depth=5&scene=cornell-box"),
            (422, "/variant", "variant=red&scene=cornell-box"),
            (422, "/film", "samples=4", {"scene": "cornell-box", "film": None, "meter": {
                "points": [{"position": [0, 1, 0], "normal": [0, 1, 0]}]}}),
            (422, "/film/width", "", {"scene": "cornell-box", "film": {"width": 0}}),
            (422, "/photo", QUICK, *form(part, ("photo", b"x", "a.jpg"))),
            (422, "/scene", QUICK, *form(part, part)),
            (422, "/file", QUICK, *form(part, ("file", b"x", ""))),
            (422, "/file", QUICK + "&scene=cornell-box", *form(("file", b"x", "x.bin"))),
            (422, "/file", QUICK, *form(("scene", zipped(a_glb=triangle_glb()), "a.zip"),
                                        ("file", b"x", "x.bin"))),
        ):
            self.assert_problem(self.render(query, *sent), status, pointer)
        for texts in ((("job", " " * (1 << 20) + "{}"),), (("seed", "1" * 300_000),) * 4):
            self.assert_problem(self.render(QUICK, *form(part, *texts)), 413)
        self.assert_problem(self.render(QUICK, b"no scene at all", OCTETS), 422)
        self.assert_problem(self.render(QUICK, glb(triangle_document(nodes=[{"mesh": 7}])), GLB),
                            422)
        self.assert_problem(self.render(QUICK, *form(part, ("environment", b"no image", "e.hdr"))),
                            422)
        body, headers = form(part)
        for broken in (body[:-30], body.replace(b"form-data", b"file"), b"", body[40:60]):
            self.assert_problem(self.render(QUICK, broken, headers), 400)
        self.assert_problem(self.render(QUICK, body, {"Content-Type": "multipart/form-data"}), 400)
        self.assertEqual(self.server.get("/v1/render").status, 405)

    def test_content_is_taken_as_octets(self):
        # The binary chunk contains line ends and the dashes of the boundary.
        extra = b"\r\n--limit-of\r\n\r\n--\r\n" * 3
        document = triangle_document(buffers=[{"byteLength": len(TRIANGLE) + len(extra)}])
        scene = glb(document, TRIANGLE + extra)
        whole = self.rendered(QUICK, scene, GLB)
        part = self.rendered(QUICK, *form(("scene", scene, "a.glb")))
        self.assertEqual(part.headers["Location"], whole.headers["Location"])

    def wait_as_client(self, query):
        """Sends the request on a connection of its own, which is returned, and the job's id."""
        connection = http.client.HTTPConnection("127.0.0.1", self.server.port)
        connection.request("POST", "/v1/render?" + query, headers=self.server.with_key({}))
        jobs = wait_for(lambda: self.server.get(self.UNFINISHED).json()["jobs"])
        return connection, jobs[0]["id"]

    def check_goes_on(self, job):
        time.sleep(2)  # a lost client is seen within a second
        self.assertIn(self.server.job(job)["state"], ("queued", "loading", "rendering"))

    def test_job_ends_with_its_last_client(self):
        query = "scene=cornell-box&size=32x32&samples=65536&wait=60&theta=0"
        first, job = self.wait_as_client(query)
        second, same = self.wait_as_client(query)
        self.assertEqual(same, job)
        time.sleep(1)  # the second has entered
        first.close()
        self.check_goes_on(job)
        second.close()
        self.assertEqual(self.server.wait(job)["state"], "cancelled")

    def test_job_goes_on_for_a_client_that_was_answered_with_it(self):
        query = "scene=cornell-box&size=32x32&samples=65536&wait=60&theta=1"
        first, job = self.wait_as_client(query)
        second = self.render(query.replace("wait=60", "wait=0"))
        self.assertEqual(second.headers["Location"], "/v1/jobs/" + job)
        first.close()
        self.check_goes_on(job)
        self.server.post(f"/v1/jobs/{job}/cancel")


class Isolated(unittest.TestCase):
    def test_tenants_do_not_share_scenes_or_images(self):
        server = Server("--key", "operators-own", key="operators-own")
        self.addCleanup(server.close)
        keys = {}
        for name in ("ours", "theirs"):
            code, key, said = tessera("keys", "add", name, "--data", server.data)
            self.assertEqual(code, 0, said)
            keys[name] = {"Authorization": "Bearer " + key.strip()}
        server.start()
        asked = [server.post("/v1/render?" + QUICK, triangle_glb(), {**keys[name], **GLB})
                 for name in ("ours", "theirs", "ours")]
        self.assertEqual([a.status for a in asked], [200, 200, 200], asked)
        ours, theirs, again = (a.headers["Location"] for a in asked)
        self.assertNotEqual(ours, theirs)
        self.assertEqual(ours, again)
        self.assertEqual(server.get(ours, keys["theirs"]).status, 404)
        scene = server.get(ours, keys["ours"]).json()["spec"]["scene"]
        server.request("DELETE", theirs, headers=keys["theirs"])
        server.request("DELETE", f"/v1/scenes/{scene}", headers=keys["theirs"])
        named = f"/v1/render?{QUICK}&scene={scene}"
        self.assertEqual(server.post(named, headers=keys["ours"]).status, 200)
        self.assertEqual(server.post(named, headers=keys["theirs"]).status, 404)

    def test_key_must_be_allowed_to_write(self):
        server = started(self, "--key", "operators-own")
        self.assertEqual(server.post("/v1/render?scene=cornell-box").status, 401)
