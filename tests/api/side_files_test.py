"""Files beside a scene, in the command line; environments with texels that are no light; TIFF."""

import json
import os
import struct
import tempfile
import time

from harness import ApiTest, TRIANGLE, glb, job_body, tessera, triangle_document, triangle_glb

BYTES = {"Content-Type": "application/octet-stream"}
LAMP = "IESNA:LM-63-1995\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n100 100\n"


def exr(channels, width, height, value):
    """Floats, uncompressed ("OpenEXR File Layout", openexr.com). value(channel, x, y)."""

    def attribute(name, kind, content):
        return f"{name}\0{kind}\0".encode() + struct.pack("<i", len(content)) + content

    window = struct.pack("<4i", 0, 0, width - 1, height - 1)
    listed = b"".join(c.encode() + b"\0" + struct.pack("<4i", 2, 0, 1, 1) for c in channels)
    head = struct.pack("<2i", 20000630, 2) + b"".join((
        attribute("channels", "chlist", listed + b"\0"),
        attribute("compression", "compression", b"\0"),
        attribute("dataWindow", "box2i", window),
        attribute("displayWindow", "box2i", window),
        attribute("lineOrder", "lineOrder", b"\0"),
        attribute("pixelAspectRatio", "float", struct.pack("<f", 1)),
        attribute("screenWindowCenter", "v2f", struct.pack("<2f", 0, 0)),
        attribute("screenWindowWidth", "float", struct.pack("<f", 1)),
    )) + b"\0"
    row_bytes = len(channels) * width * 4
    table = b"".join(
        struct.pack("<q", len(head) + 8 * height + y * (8 + row_bytes)) for y in range(height)
    )
    rows = b""
    for y in range(height):
        values = [value(c, x, y) for c in channels for x in range(width)]
        rows += struct.pack(f"<2i{len(values)}f", y, row_bytes, *values)
    return head + table + rows


class SideFiles(ApiTest):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name
        self.server_flags = ("--server", f"http://127.0.0.1:{self.server.port}")

    def write(self, name, content):
        path = os.path.join(self.folder, name)
        with open(path, "wb") as file:
            file.write(content if isinstance(content, bytes) else content.encode())
        return path

    def assert_taken(self, path):
        """What `render` takes, `submit` takes."""
        size = ("--size", "8x8", "--spp", "2")
        picture = os.path.join(self.folder, "o.png")
        for verb, flags in (("render", ("-o", picture)), ("submit", self.server_flags)):
            code, _, said = tessera(verb, path, *size, *flags)
            self.assertEqual(code, 0, (verb, said))

    def test_light_profiles_are_sent(self):
        self.write("points.bin", TRIANGLE)
        self.write("lamp.ies", LAMP)
        self.assert_taken(self.write("scene.gltf", json.dumps(triangle_document(
            "points.bin", extensionsUsed=["EXT_lights_ies"],
            extensions={"EXT_lights_ies": {"lights": [{"uri": "lamp.ies"}]}}))))

    def test_files_beside_a_glb_are_sent(self):
        self.write("points.bin", TRIANGLE)
        self.assert_taken(self.write("scene.glb", glb(triangle_document("points.bin"))))

    def test_images_that_no_texture_uses_need_not_exist(self):
        self.write("points.bin", TRIANGLE)
        self.assert_taken(self.write("scene.gltf", json.dumps(
            triangle_document("points.bin", images=[{"uri": "gone.png"}]))))

    def test_names_are_decoded_once_and_found_as_on_other_systems(self):
        self.write("my%20points.bin", TRIANGLE)
        self.write("rate%ab.bin", TRIANGLE)
        self.write("Ku\u0308che.BIN", TRIANGLE)
        for uri in ("my%2520points.bin", "rate%25ab.bin", "k%C3%BCche.bin", ".\\K\u00fcche.bin"):
            self.assert_taken(self.write("scene.gltf", json.dumps(triangle_document(uri))))

    def test_a_missing_file_is_named(self):
        path = self.write("scene.gltf", json.dumps(triangle_document("gone%20away.bin")))
        code, _, said = tessera("submit", path, "--size", "8x8", *self.server_flags)
        self.assertEqual(code, 1)
        self.assertIn("gone away.bin", said)


class Environments(ApiTest):
    def job_under(self, content):
        asset = self.server.post("/v1/assets", content, BYTES).json()["id"]
        scene = self.server.post(
            "/v1/scenes", triangle_glb(), {"Content-Type": "model/gltf-binary"}
        ).json()["id"]
        return job_body(scene, environment={"asset": asset})

    def test_texels_that_are_no_light_are_zero_and_counted_in_a_warning(self):
        bad = {(1, 0): -0.5, (2, 1): float("inf"), (3, 1): float("nan")}
        job = self.server.render(
            self.job_under(exr(["B", "G", "R"], 8, 4, lambda c, x, y: bad.get((x, y), 1.0))))
        self.assertEqual(job["state"], "finished", job)
        self.assertTrue(any(w.startswith("3 texels of the environment") for w in job["warnings"]),
                        job["warnings"])

    def test_grey_lights_in_three_channels(self):
        job = self.server.render(self.job_under(exr(["Y"], 4, 2, lambda c, x, y: 0.5)))
        self.assertEqual(job["state"], "finished", job)
        self.assertFalse([w for w in job["warnings"] if "texel" in w])

    def test_layers_of_which_none_is_the_picture_are_refused_with_a_list(self):
        channels = ["fill.B", "fill.G", "fill.R", "key.B", "key.G", "key.R"]
        answer = self.server.post(
            "/v1/jobs", self.job_under(exr(channels, 4, 2, lambda c, x, y: 1.0)))
        problem = self.assert_problem(answer, 422, "/environment/asset")
        self.assertIn("fill: R G B", problem["detail"])
        self.assertIn("key: R G B", problem["detail"])


class Tiff(ApiTest):
    def test_has_the_same_bytes_a_second_later(self):
        job = self.server.render(job_body(film={"width": 16, "height": 16}))["id"]
        first = self.server.get(f"/v1/jobs/{job}/image.tif")
        time.sleep(1.1)  # its tag DateTime would count seconds
        again = self.server.get(f"/v1/jobs/{job}/image.tif")
        self.assertEqual(first.body, again.body)
