"""The add-on for Blender without Blender: stand-ins with the members that it reads.

tests/blender/run has the tests in Blender, and the comparison with Cycles.
"""

import ast
import json
import math
import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
from types import SimpleNamespace as Having

import numpy as np
import OpenEXR
import tomllib
from harness import PATIENCE_S, triangle_glb, wait_for
from support import REPOSITORY, ServerTest

HOME = pathlib.Path(REPOSITORY) / "clients/blender"
sys.path.insert(0, str(HOME))

from tessera_blender import (  # noqa: E402
    cameras,
    exr,
    lights,
    losses,
    passes,
    preview_process,
    worlds,
)

UPRIGHT = [[1, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]]  # looks along +y


def render(width=200, height=100, **more):
    return Having(**{"resolution_x": width, "resolution_y": height, "resolution_percentage": 100,
                     "use_border": False} | more)


def camera(**more):
    return Having(**{
        "name": "camera", "type": "PERSP", "lens": 50.0, "sensor_fit": "AUTO",
        "sensor_width": 36.0, "sensor_height": 24.0, "shift_x": 0.0, "shift_y": 0.0,
        "ortho_scale": 6.0, "dof": Having(use_dof=False)} | more)


class Socket(Having):
    def __init__(self, value=None, node=None, name=""):
        links = [] if node is None else [Having(from_node=node)]
        super().__init__(default_value=value, links=links, is_linked=bool(links), name=name)


class Node(Having):
    """inputs: by name; a node is linked, any other value is the socket's own."""

    def __init__(self, type, inputs=None, **more):
        sockets = {key: Socket(None, value, key) if isinstance(value, Node)
                   else Socket(value, None, key) for key, value in (inputs or {}).items()}
        super().__init__(**{"type": type, "name": type.title(), "inputs": Sockets(sockets)} | more)


class Sockets(dict):
    def __iter__(self):
        return iter(self.values())


def tree(*nodes):
    return {"use_nodes": True, "node_tree": Having(nodes=list(nodes))}


class Cameras(unittest.TestCase):
    def seen(self, data, frame, x, y, distance):
        """Pixel of a point by the job: the centre of the film is off the optical axis."""
        view, film = cameras.camera_and_film(data, UPRIGHT, frame)
        focal = film["height"] / (2 * math.tan(math.radians(view["vertical_fov_degrees"]) / 2))
        right, up = view["shift"]
        return ((0.5 - right) * film["width"] + focal * x / distance,
                (0.5 + up) * film["height"] - focal * y / distance)

    def test_points_fall_where_the_lens_equation_puts_them(self):
        # The side that fits the sensor has 1 unit; shift moves the frame by such units.
        for fit, size, sensor, side in (
            ("AUTO", (200, 100), 36, 200), ("AUTO", (100, 200), 36, 200),
            ("HORIZONTAL", (100, 200), 36, 100), ("VERTICAL", (200, 100), 24, 100),
        ):
            for shift_x, shift_y in ((0, 0), (0.3, 0), (-0.3, 0.2), (0.11, -0.27)):
                data = camera(sensor_fit=fit, shift_x=shift_x, shift_y=shift_y)
                column, row = self.seen(data, render(*size), 0.4, 0.2, 5)
                right = 50 * 0.4 / 5 / sensor - shift_x
                up = 50 * 0.2 / 5 / sensor - shift_y
                self.assertAlmostEqual(column, size[0] / 2 + right * side)
                self.assertAlmostEqual(row, size[1] / 2 - up * side)

    def test_a_region_is_a_crop_with_its_top_above(self):
        frame = render(use_border=True, border_min_x=0.25, border_max_x=0.5, border_min_y=0.1,
                       border_max_y=0.4)
        _, film = cameras.camera_and_film(camera(shift_x=0.1), UPRIGHT, frame)
        self.assertEqual(film, {"width": 200, "height": 100,
                                "crop": {"x": 50, "y": 60, "width": 50, "height": 30}})

    def test_pose_is_in_gltf_axes(self):
        place = [[1, 0, 0, 2], [0, 0, -1, 3], [0, 1, 0, 4], [0, 0, 0, 1]]
        view, _ = cameras.camera_and_film(camera(), place, render())
        self.assertEqual(view["position"], [2, 4, -3])
        self.assertEqual([b - a for a, b in zip(view["position"], view["target"], strict=True)],
                         [0, 0, -1])
        self.assertEqual(view["up"], [0, 1, 0])

    def test_lens_and_orthographic_height(self):
        # A 50 mm lens at f/2 is 25 mm wide; focus on an object counts along the axis.
        thing = Having(matrix_world=[[1, 0, 0, 3], [0, 1, 0, 7], [0, 0, 1, 1], [0, 0, 0, 1]])
        dof = Having(use_dof=True, aperture_fstop=2.0, focus_distance=9.0, focus_object=thing)
        view, _ = cameras.camera_and_film(camera(dof=dof), UPRIGHT, render())
        self.assertAlmostEqual(view["aperture_radius"], 0.0125)
        self.assertAlmostEqual(view["focus_distance"], 7)
        dof.focus_object = None
        view, _ = cameras.camera_and_film(camera(dof=dof, type="ORTHO"), UPRIGHT, render())
        self.assertEqual((view["type"], view["focus_distance"]), ("orthographic", 9))
        self.assertAlmostEqual(view["orthographic_height"], 3)
        # The upright camera has x to the right and z up; the scale of 6 m spans the frame's width.
        view, _ = cameras.camera_and_film(
            camera(type="ORTHO", shift_x=0.5, shift_y=-0.25), UPRIGHT, render())
        self.assertEqual(view["position"], [3, -1.5, 0])
        view, _ = cameras.camera_and_film(camera(type="PANO"), UPRIGHT, render())
        self.assertEqual(view["type"], "panorama")


class Viewports(unittest.TestCase):
    """Window and view matrices, as Blender's regions have them."""

    TURN, TIP = 0.7, 0.4
    # Rows: right, up and back of a camera that is turned about z, then tipped.
    AXES = np.array([
        [math.cos(TURN), math.sin(TURN), 0],
        [-math.sin(TIP) * math.sin(TURN), math.sin(TIP) * math.cos(TURN), math.cos(TIP)],
        [math.cos(TIP) * math.sin(TURN), -math.cos(TIP) * math.cos(TURN), math.sin(TIP)],
    ])  # fmt: skip
    EYE = np.array([3.0, -4.0, 2.0])
    WIDTH, HEIGHT = 320, 200
    POINTS = np.random.default_rng(1).uniform(-1, 1, (20, 3))

    def view(self):
        return np.block([[self.AXES, -self.AXES @ self.EYE[:, None]], [np.eye(4)[3:]]])

    def drawn(self, window, point):
        """Pixel, from the top left, at which a viewport draws a point."""
        clip = window @ self.view() @ [*point, 1]
        x, y = clip[:2] / clip[3]
        return (x + 1) / 2 * self.WIDTH, (1 - y) / 2 * self.HEIGHT

    def local(self, seen, point):
        """The point in the axes of the job's camera."""
        place = np.reshape(seen["pose"]["matrix"], (4, 4))
        self.assertEqual(seen["pose"]["convention"], "opengl")
        return place[:3, :3].T @ (np.array(cameras.y_up(*point)) - place[:3, 3])

    def test_a_pinhole_sees_what_a_perspective_viewport_draws(self):
        window = np.array([[1.8, 0, 0.3, 0], [0, 2.5, -0.2, 0], [0, 0, -1.01, -0.2], [0, 0, -1, 0]])
        seen = cameras.of_view(window.tolist(), self.view().tolist(), self.WIDTH, self.HEIGHT)
        self.assertEqual(seen["type"], "pinhole")
        for point in self.POINTS:
            x, y, z = self.local(seen, point)
            self.assertLess(z, 0)
            pixel = (seen["cx"] - seen["fx"] * x / z, seen["cy"] + seen["fy"] * y / z)
            np.testing.assert_allclose(pixel, self.drawn(window, point), atol=1e-9)

    def test_an_orthographic_viewport_begins_behind_its_eye(self):
        window = np.array([[0.25, 0, 0, 0.1], [0, 0.4, 0, -0.3], [0, 0, -0.01, 0.2], [0, 0, 0, 1]])
        seen = cameras.of_view(window.tolist(), self.view().tolist(), self.WIDTH, self.HEIGHT)
        self.assertEqual(seen["type"], "orthographic")
        scale = self.HEIGHT / seen["orthographic_height"]
        for point in self.POINTS:
            x, y, z = self.local(seen, point)
            np.testing.assert_allclose(
                (self.WIDTH / 2 + scale * x, self.HEIGHT / 2 - scale * y),
                self.drawn(window, point), atol=1e-9)
            depth = (window @ self.view() @ [*point, 1])[2]
            self.assertAlmostEqual(-z, (depth + 1) / 0.01)  # from the near plane, at depth -1


class PreviewProcess(ServerTest):
    """The process that talks to the server, with a folder and orders as of Blender."""

    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        self.process = subprocess.Popen(
            [sys.executable, "-m", "tessera_blender.preview_process", folder.name], text=True,
            stdin=subprocess.PIPE, env=os.environ | {"PYTHONPATH": os.pathsep.join(sys.path)})
        self.addCleanup(self.process.communicate)

    def order(self, **order):
        self.process.stdin.write(json.dumps(order) + "\n")
        self.process.stdin.flush()

    def ask(self, width, color):
        self.order(server=self.client.server, key="",
                   world={"color": color, "strength": 1.0, "image": None,
                          "rotation_degrees": 0.0, "losses": []},
                   request={"class": "preview", "preview_key": "view",
                            "film": {"width": width, "height": 16},
                            "stop": {"samples_per_pixel": 4}})

    def corner(self, width):
        """The colour of the lower left pixel, of an image of this width; empty before."""
        path = self.folder / preview_process.IMAGE
        image = preview_process.read_image(path) if path.exists() else np.zeros((0, 0, 4))
        return image[0, 0].tolist() if image.shape == (16, width, 4) else []

    def test_shows_the_newest_view_and_ends_with_its_input(self):
        scene = self.folder / "scene.glb"
        scene.write_bytes(triangle_glb())
        self.ask(24, [0.5, 0.25, 1.0])  # waits for a document
        self.order(document=str(scene))
        wait_for(lambda: self.corner(24) == [0.5, 0.25, 1.0, 1.0])
        self.ask(32, [0.25, 1.0, 0.5])
        wait_for(lambda: self.corner(32) == [0.25, 1.0, 0.5, 1.0])
        status = self.folder / preview_process.STATUS
        wait_for(lambda: status.exists() and "error" in status.read_text())
        self.process.stdin.close()
        self.assertEqual(self.process.wait(PATIENCE_S), 0)

    def test_a_fault_is_the_status(self):
        scene = self.folder / "scene.gltf"
        scene.write_text("{}")
        self.ask(24, [1.0, 1.0, 1.0])
        self.order(document=str(scene))
        status = self.folder / preview_process.STATUS
        wait_for(status.exists)
        self.assertIn("asset", status.read_text())


def light(kind, energy, **more):
    return Having(**{"name": kind, "type": kind, "energy": energy, "color": (1.0, 1.0, 1.0),
                     "use_nodes": False, "node_tree": None} | more)


class Lights(unittest.TestCase):
    def test_power_over_the_sphere_and_irradiance_of_a_sun(self):
        self.assertAlmostEqual(lights.intensity(light("POINT", 4 * math.pi), 0), 1)
        self.assertAlmostEqual(lights.intensity(light("SPOT", 8 * math.pi, exposure=1), 0), 4)
        self.assertEqual(lights.intensity(light("SUN", 3.5), 0), 3.5)
        # Only the exporter knows the surface of such a light.
        self.assertEqual(lights.intensity(light("POINT", 1, normalize=False), 7), 7)

    def test_nodes_and_temperature_multiply(self):
        falloff = Node("LIGHT_FALLOFF", {"Strength": 3.0})
        for strength, factor in ((2.0, 2), (falloff, 3)):
            shown = Node("EMISSION", {"Strength": strength, "Color": (0.5, 1, 1, 1)})
            lamp = light("SUN", 5, use_temperature=True, temperature_color=(1, 0.5, 0.25),
                         **tree(shown, Node("OUTPUT_LIGHT", {"Surface": shown})))
            self.assertEqual(lights.intensity(lamp, 0), 5 * factor)
            self.assertEqual(lights.color(lamp), [0.5, 0.5, 0.25])

    def test_a_panel_emits_its_power_downwards(self):
        lamp = light("AREA", 6 * math.pi, shape="RECTANGLE", size=1.0, size_y=2.0)
        scaled = [[3, 0, 0, 5], [0, 1, 0, 6], [0, 0, 1, 7], [0, 0, 0, 1]]
        corners, radiance = lights.panel(lamp, scaled)
        self.assertAlmostEqual(radiance, 1)  # 6 m2
        a, b, c = (np.array(corners[k]) for k in range(3))
        normal = np.cross(b - a, c - b)
        np.testing.assert_allclose(normal / np.linalg.norm(normal), [0, -1, 0], atol=1e-12)
        np.testing.assert_allclose(np.mean(corners, axis=0), [5, 7, -6], atol=1e-12)
        disc = light("AREA", 1, shape="DISK", size=2.0)
        corners, radiance = lights.panel(disc, np.eye(4).tolist())
        # The polygon's area times radiance is the power, to rounding; it is that of a disc to 1%.
        self.assertAlmostEqual(1 / (math.pi * radiance), math.pi, delta=0.01 * math.pi)
        self.assertLess(np.cross(np.subtract(corners[1], corners[0]),
                                 np.subtract(corners[2], corners[1]))[1], 0)


def world(node):
    return Having(**tree(node, Node("OUTPUT_WORLD", {"Surface": node}, is_active_output=True)))


class Worlds(unittest.TestCase):
    def test_a_colour_and_nothing(self):
        found = worlds.read_world(world(Node("BACKGROUND", {"Color": (0.1, 0.2, 0.3, 1),
                                                            "Strength": 2.0})))
        self.assertEqual(worlds.member(found, None), {
            "color": [0.1, 0.2, 0.3], "intensity": 2.0, "rotation_degrees": 0.0})
        self.assertIsNone(worlds.member(worlds.read_world(None), None))

    def test_a_mapping_turns_the_image(self):
        for kind, sign in (("POINT", -1), ("TEXTURE", 1)):
            mapping = Node("MAPPING", {"Vector": Node("TEX_COORD"), "Scale": (1, 1, 1),
                                       "Rotation": (0, 0, math.radians(30))}, vector_type=kind)
            image = Node("TEX_ENVIRONMENT", {"Vector": mapping}, image="sky",
                         projection="EQUIRECTANGULAR")
            found = worlds.read_world(world(Node("BACKGROUND", {"Color": image, "Strength": 1.0})))
            self.assertEqual((found.image, found.losses), ("sky", []))
            self.assertAlmostEqual(found.rotation_degrees, sign * 30)
            self.assertEqual(worlds.member(found, "id")["asset"], "id")

    def test_other_nodes_are_told(self):
        sky = Node("BACKGROUND", {"Color": Node("TEX_SKY"), "Strength": 1.0})
        self.assertIn("Tex_Sky", worlds.read_world(world(sky)).losses[0])
        self.assertIn("Mix", worlds.read_world(world(Node("MIX"))).losses[0])


class Losses(unittest.TestCase):
    def lost(self, surface, **outputs):
        links = {"Surface": surface, "Volume": None, "Displacement": None} | outputs
        made = Having(name="m", **tree(Node("OUTPUT_MATERIAL", links, is_active_output=True)))
        return list(losses.of_material(made))

    def test_what_gltf_has_is_not_listed(self):
        image = Node("TEX_IMAGE", {"Vector": Node("MAPPING", {"Vector": Node("UVMAP")})})
        self.assertEqual(self.lost(Node("BSDF_PRINCIPLED", {
            "Base Color": image, "Normal": Node("NORMAL_MAP", {"Color": image}),
            "Subsurface Weight": 0.0})), [])

    def test_what_gltf_lacks_is_listed_once(self):
        noise = Node("TEX_NOISE")
        found = self.lost(Node("BSDF_PRINCIPLED", {"Base Color": noise, "Roughness": noise,
                                                   "Subsurface Weight": 0.2}),
                          Displacement=Node("DISPLACEMENT"))
        self.assertEqual(len(found), 3)
        self.assertTrue(any("Tex_Noise" in text for text in found))
        self.assertIn("Bsdf_Glass", self.lost(Node("BSDF_GLASS"))[0])

    def test_soft_lights_and_other_panoramas(self):
        soft = light("POINT", 1, shadow_soft_size=0.1)
        self.assertIn("size", next(losses.of_light(soft)))
        soft.shadow_soft_size = 0
        self.assertEqual(list(losses.of_light(soft)), [])
        self.assertEqual(list(losses.of_camera(camera(type="PANO"))), [])
        fisheye = camera(type="PANO", panorama_type="FISHEYE_EQUIDISTANT")
        self.assertEqual(len(list(losses.of_camera(fisheye))), 1)


    def test_a_scene_lists_shared_data_once(self):
        glass = Node("BSDF_GLASS")
        made = Having(name="m", **tree(Node("OUTPUT_MATERIAL", {
            "Surface": glass, "Volume": None, "Displacement": None}, is_active_output=True)))
        balls = [Having(name=name, type="MESH", modifiers=[], material_slots=[
            Having(material=made), Having(material=None)]) for name in "ab"]
        scene = Having(render=Having(pixel_aspect_x=1, pixel_aspect_y=1, use_motion_blur=True,
                                     use_multiview=False),
                       view_layers=[Having(use=True)], world=None, camera=None)
        found = losses.of_scene(scene, balls)
        self.assertEqual(len(found), 2, found)
        self.assertIn("Motion blur", found)


class Spots(unittest.TestCase):
    def test_the_mean_of_the_cosine_over_a_cone(self):
        cosines = np.random.default_rng(1).uniform(math.cos(0.6), 1, 10_000)  # even over its sphere
        spot = Having(type="SPOT", spot_size=1.2)
        self.assertAlmostEqual(lights.mean_of_cone(spot), cosines.mean(), delta=0.003)
        self.assertEqual(lights.mean_of_cone(Having(type="POINT")), 1)


class Passes(unittest.TestCase):
    def test_depth_of_a_wall_is_even(self):
        # A wall 3 m in front: rays to its edges are longer.
        view = {"type": "perspective", "fx": 10.0, "fy": 10.0, "cx": 8.0, "cy": 6.0}
        row, column = np.mgrid[2:6, 3:9] + 0.5
        distance = 3 * np.sqrt(1 + ((column - 8) / 10) ** 2 + ((row - 6) / 10) ** 2)
        found = passes.values("depth", distance, view, 3, 2)
        np.testing.assert_allclose(found[..., 0], 3, rtol=1e-12)
        found = passes.values("depth", np.zeros((1, 1)), view, 0, 0)
        self.assertEqual(found.item(), 1e10)

    def test_vectors_and_rows_are_those_of_blender(self):
        found = passes.values("normal", np.array([[[1.0, 2, 3]]]), {}, 0, 0)
        self.assertEqual(found.ravel().tolist(), [1, -3, 2])
        image = np.arange(6.0).reshape(3, 2, 1)
        self.assertEqual(passes.rect(image).ravel().tolist(), [4, 5, 2, 3, 0, 1])
        mean = np.array([[[1.0, 2, 3], [np.nan, np.nan, np.nan]]])
        rgba = passes.combined(mean, np.ones((1, 2)))
        self.assertEqual(rgba.ravel().tolist(), [1, 2, 3, 1, 0, 0, 0, 0])

    def test_reads_what_openexr_writes(self):
        planes = {"A.R": np.arange(60, dtype=np.float32).reshape(20, 3) / 7,
                  "A.G": np.linspace(0, 1, 60, dtype=np.float16).reshape(20, 3)}
        for compression in (OpenEXR.ZIP_COMPRESSION, OpenEXR.ZIPS_COMPRESSION,
                            OpenEXR.NO_COMPRESSION):
            with tempfile.TemporaryDirectory() as folder:
                path = pathlib.Path(folder) / "a.exr"
                OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage,
                              "note": "seen"}, dict(planes)).write(str(path))
                found, attributes = exr.read_exr(path.read_bytes())
            for name, plane in planes.items():
                np.testing.assert_array_equal(found[name], plane.astype(np.float32))
            self.assertEqual(attributes["note"], b"seen")

    def test_openexr_reads_what_is_written(self):
        pixels = np.random.default_rng(1).random((5, 7, 3), dtype=np.float32)
        with tempfile.TemporaryDirectory() as folder:
            path = pathlib.Path(folder) / "a.exr"
            path.write_bytes(exr.write_exr(pixels))
            with OpenEXR.File(str(path)) as file:
                np.testing.assert_array_equal(file.channels()["RGB"].pixels, pixels)
        planes, _ = exr.read_exr(exr.write_exr(pixels))
        np.testing.assert_array_equal(planes["G"], pixels[..., 1])

    def test_hash_of_names(self):
        # MurmurHash3's own examples.
        self.assertEqual(passes._hash("test"), 0xBA6BD213)
        self.assertEqual(passes._hash("Hello, world!"), 0xC0363E43)


class Manifest(unittest.TestCase):
    def test_extension_and_add_on_say_the_same(self):
        manifest = tomllib.loads((HOME / "tessera_blender/blender_manifest.toml").read_text())
        source = ast.parse((HOME / "tessera_blender/__init__.py").read_text())
        info = next(ast.literal_eval(node.value) for node in source.body
                    if isinstance(node, ast.Assign) and node.targets[0].id == "bl_info")
        self.assertEqual(".".join(map(str, info["version"])),
                         manifest["version"].removesuffix("-dev"))
        self.assertEqual((info["name"], info["description"]),
                         (manifest["name"], manifest["tagline"]))
        self.assertEqual(manifest["id"], "tessera_blender")
        # Blender's rules for extensions.
        for text in (manifest["tagline"], *manifest["permissions"].values()):
            self.assertLessEqual(len(text), 64)
            self.assertNotRegex(text, r"\W$")
