"""Drake's glTF render protocol, by requests built from its text (render_gltf_client_doxygen.h)."""

import base64
import hashlib
import json
import math
import struct

from harness import ApiTest, png_pixels, png_size, started

WIDTH, HEIGHT = 64, 48
INTRINSICS = {"focal_x": 70.5, "focal_y": 66.25, "center_x": 30.75, "center_y": 26.5}
EYE = (0.25, -4.0, 1.5)
# The camera looks along the world's +y, with z up: columns are its x, y and z axes.
CAMERA = (1, 0, 0, 0, 0, 0, 1, 0, 0, -1, 0, 0, *EYE, 1)
WHITE = (255, 255, 255)


def colour_of(label):
    """As RenderEngine::MakeRgbFromLabel: the low byte is red, the high one green."""
    return (label & 255, label >> 8, 0)


class Scene:
    """Triangles with materials, one mesh and node each, as vtkGLTFExporter writes them."""

    def __init__(self):
        self.gltf = {
            "asset": {"generator": "VTK", "version": "2.0"}, "accessors": [], "buffers": [],
            "bufferViews": [], "materials": [], "meshes": [], "nodes": [], "scene": 0,
            "cameras": [{"type": "perspective", "perspective": {
                "aspectRatio": WIDTH / HEIGHT, "yfov": 2 * math.atan(HEIGHT / 2 / 66.25),
                "znear": 0.5, "zfar": 40}}],
        }
        self.triangles = []

    def add(self, corners, label, move=(0, 0, 0)):
        data = struct.pack("<9f", *(c for corner in corners for c in corner))
        index = len(self.triangles)
        uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
        self.gltf["buffers"].append({"byteLength": len(data), "uri": uri})
        self.gltf["bufferViews"].append({"buffer": index, "byteLength": len(data)})
        self.gltf["accessors"].append({
            "bufferView": index, "componentType": 5126, "count": 3, "type": "VEC3",
            **{name: [f(c[k] for c in corners) for k in range(3)]
               for name, f in (("min", min), ("max", max))}})
        self.gltf["materials"].append({"doubleSided": True, "pbrMetallicRoughness": {
            "baseColorFactor": [c / 255 for c in colour_of(label)] + [1],
            "metallicFactor": 0, "roughnessFactor": 1}})
        self.gltf["meshes"].append(
            {"primitives": [{"attributes": {"POSITION": index}, "material": index}]})
        self.gltf["nodes"].append(
            {"mesh": index, "matrix": [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, *move, 1]})
        self.triangles.append(
            ([tuple(c + m for c, m in zip(corner, move)) for corner in corners], label))

    def text(self):
        nodes = [*self.gltf["nodes"], {"camera": 0, "matrix": CAMERA, "name": "Camera Node"}]
        scenes = [{"nodes": list(range(len(nodes)))}]
        return json.dumps({**self.gltf, "nodes": nodes, "scenes": scenes}).encode()

    def seen(self, x, y):
        """Depth and label at a pixel's centre, and how near the ray passes an edge."""
        d = ((x + 0.5 - INTRINSICS["center_x"]) / INTRINSICS["focal_x"], 1.0,
             -(y + 0.5 - INTRINSICS["center_y"]) / INTRINSICS["focal_y"])
        nearest, edge = (math.inf, None), math.inf
        for corners, label in self.triangles:
            e1, e2 = (tuple(a - b for a, b in zip(c, corners[0])) for c in corners[1:])
            p, s = cross(d, e2), tuple(a - b for a, b in zip(EYE, corners[0]))
            det = dot(e1, p)
            if det == 0:
                continue
            u, q = dot(s, p) / det, cross(s, e1)
            v, t = dot(d, q) / det, dot(e2, q) / det
            least = min(u, v, 1 - u - v)
            edge = min(edge, abs(least))
            if least > 0 and 0 < t < nearest[0]:
                nearest = (t, label)
        return *nearest, edge


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def dot(a, b):
    return sum(x * y for x, y in zip(a, b))


def form(scene, image_type, **fields):
    """The protocol's fields in its order, with Drake's button at the end."""
    values = {"scene_sha256": hashlib.sha256(scene).hexdigest(), "image_type": image_type}
    if image_type == "depth":
        values |= {"min_depth": 0.75, "max_depth": 8.0}
    values |= {"width": WIDTH, "height": HEIGHT, "near": 0.5, "far": 40.0, **INTRINSICS,
               "fov_x": 2 * math.atan(WIDTH / 2 / INTRINSICS["focal_x"]),
               "fov_y": 2 * math.atan(HEIGHT / 2 / INTRINSICS["focal_y"]),
               "submit": "Render"} | fields
    parts = ['--sep\r\nContent-Disposition: form-data; name="scene"; filename="1.gltf"\r\n'
             "Content-Type: model/gltf+json\r\n\r\n".encode() + scene + b"\r\n"]
    for name, value in values.items():
        if value is not None:
            parts.append(f'--sep\r\nContent-Disposition: form-data; name="{name}"\r\n\r\n'
                         f"{value}\r\n".encode())
    return b"".join(parts) + b"--sep--\r\n"


def tiff_floats(data):
    """The values of an uncompressed TIFF of one float per pixel."""
    order = {b"II": "<", b"MM": ">"}[data[:2]]
    (at,) = struct.unpack(order + "I", data[4:8])
    (count,) = struct.unpack(order + "H", data[at:at + 2])
    tags = {}
    for i in range(count):
        entry = data[at + 2 + 12 * i:at + 14 + 12 * i]
        tag, kind, number = struct.unpack(order + "HHI", entry[:8])
        letter = {3: "H", 4: "I"}.get(kind)
        if letter:
            size = struct.calcsize(letter) * number
            place = entry[8:8 + size] if size <= 4 else None
            if place is None:
                (start,) = struct.unpack(order + "I", entry[8:12])
                place = data[start:start + size]
            tags[tag] = struct.unpack(order + str(number) + letter, place)
    if (tags[256], tags[257], tags[258], tags[339]) != ((WIDTH,), (HEIGHT,), (32,), (3,)):
        raise AssertionError(f"not {WIDTH} x {HEIGHT} floats: {tags}")
    raw = b"".join(data[o:o + n] for o, n in zip(tags[273], tags[279]))
    return struct.unpack(f"{order}{WIDTH * HEIGHT}f", raw)


class Drake(ApiTest):
    FLAGS = ("--drake",)

    def setUp(self):
        self.scene = Scene()
        self.scene.add([(-3, -1, 0), (3, -1, 0), (0, 3, 0)], 7)  # level
        self.scene.add([(-1, 0, 0), (1, 2.5, 0), (0, 1, 2)], 300, move=(0.5, 0.25, 0.1))  # slanted

    def ask(self, image_type, path="/render", scene=None, **fields):
        return self.server.post(
            path, form(scene or self.scene.text(), image_type, **fields),
            headers={"Content-Type": "multipart/form-data; boundary=sep"})

    def pixels(self):
        return ((x, y) for y in range(HEIGHT) for x in range(WIDTH))

    def expect_depths(self, values, least=0.75, most=8.0):
        checked = 0
        for (x, y), seen in zip(self.pixels(), values):
            depth, _, edge = self.scene.seen(x, y)
            if edge > 1e-5:
                depth = math.inf if depth >= most else 0 if depth <= least else depth
                if math.isinf(depth):
                    self.assertEqual(seen, depth, (x, y))
                else:
                    self.assertAlmostEqual(seen, depth, delta=2e-6 * 8, msg=(x, y))
                checked += depth not in (0, math.inf)
        return checked

    def test_depths_are_metres_along_the_axis(self):
        answer = self.ask("depth")
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/tiff"))
        self.assertGreater(self.expect_depths(tiff_floats(answer.body)), 300)

    def test_depths_out_of_range_are_zero_or_infinite(self):
        values = tiff_floats(self.ask("depth", min_depth=4.5, max_depth=5.0).body)
        self.expect_depths(values, 4.5, 5.0)
        self.assertTrue(0 in values and math.inf in values)

    def test_what_a_plane_clips_is_not_seen(self):
        self.scene.gltf["cameras"][0]["perspective"]["znear"] = 4.5
        values = tiff_floats(self.ask("depth").body)
        self.assertGreaterEqual(min(values), 4.5)

    def test_a_moved_node_is_seen_where_it_is(self):
        self.expect_depths(tiff_floats(self.ask("depth").body))
        moved = Scene()
        for corners, label in self.scene.triangles:
            moved.add(corners, label, move=(0.125, 0.5, -0.25))
        self.scene = moved
        self.assertGreater(self.expect_depths(tiff_floats(self.ask("depth").body)), 300)

    def test_labels_are_the_colours_of_the_materials(self):
        answer = self.ask("label")
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/png"))
        rows, found = png_pixels(answer.body), set()
        for x, y in self.pixels():
            _, label, edge = self.scene.seen(x, y)
            if edge > 1e-5:
                colour = WHITE if label is None else colour_of(label)
                self.assertEqual(rows[y][x][:3], colour, (x, y))
                found.add(label)
        self.assertEqual(found, {None, 7, 300})

    def test_both_paths_need_a_key_where_there_is_one(self):
        server = started(self, "--drake", "--key", "operators-own")
        for key, status in (("operators-own", 200), ("wrong", 401), (None, 401)):
            for path in ("/render", "/v1/drake/render"):
                answer = server.post(path, form(self.scene.text(), "label"), headers={
                    "Content-Type": "multipart/form-data; boundary=sep",
                    **({"Authorization": f"Bearer {key}"} if key else {})})
                self.assertEqual(answer.status, status, (key, path, answer))

    def test_a_colour_image_leaves_nothing_behind(self):
        before = self.server.get("/v1/scenes").json(), self.server.get("/v1/jobs").json()
        answer = self.ask("color", "/render?samples=8&seconds=5")
        self.assertEqual((answer.status, answer.headers["Content-Type"]), (200, "image/png"))
        self.assertEqual(png_size(answer.body)[:2], (WIDTH, HEIGHT))
        self.assertEqual(
            (self.server.get("/v1/scenes").json(), self.server.get("/v1/jobs").json()), before)

    def test_colours_are_lit_from_the_worlds_up(self):
        """Under a sun at the zenith, level ground is bright and a wall is not."""
        self.scene = Scene()
        self.scene.add([(-9, -9, 0), (9, -9, 0), (0, 3, 0)], 0x8080)
        self.scene.add([(-9, 3, 0), (9, 3, 0), (0, 3, 12)], 0x8080)
        # At the equator, at noon of an equinox.
        sun = {"latitude": 0, "longitude": 0, "time": "2026-03-20T12:07:00Z"}
        preset = {"job": {"environment": {"sun": sun}}}
        stored = self.server.request("PUT", "/v1/presets/zenith", json.dumps(preset).encode(),
                                     {"Content-Type": "application/json"})
        self.assertEqual(stored.status, 201, stored)
        answer = self.ask("color", "/render?samples=16&preset=zenith")
        self.assertEqual(answer.status, 200, answer)
        rows = png_pixels(answer.body)
        self.assertGreater(rows[HEIGHT - 2][WIDTH // 2][0], 1.5 * rows[10][WIDTH // 2][0])

    def test_refusals_name_the_field(self):
        for image_type, fields, pointer in (
            ("depth", {"max_depth": None}, "/max_depth"),
            ("color", {"scene_sha256": "0" * 64}, "/scene_sha256"),
            ("normal", {}, "/image_type"),
            ("label", {"width": 0}, "/width"),
            ("label", {"focal_x": None}, "/focal_x"),
        ):
            answer = self.ask(image_type, **fields)
            self.assertEqual(answer.status, 422, answer)
            self.assertIn(pointer, [e["pointer"] for e in answer.json()["errors"]])
        self.assertEqual(self.ask("depth", scene=b'{"asset":{"version":"2.0"}}').status, 422)
        self.assertEqual(self.ask("depth", scene=b"{").status, 422)
        answer = self.server.post("/render", b"{}", headers={"Content-Type": "application/json"})
        self.assertEqual(answer.status, 415)

    def test_the_short_path_needs_its_flag(self):
        server = started(self)
        headers = {"Content-Type": "multipart/form-data; boundary=sep"}
        body = form(self.scene.text(), "depth")
        self.assertEqual(server.post("/render", body, headers=headers).status, 404)
        answer = server.post("/v1/drake/render", body, headers=headers)
        self.assertEqual(answer.status, 200, answer)
