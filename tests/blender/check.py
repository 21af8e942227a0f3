"""Tests the add-on in Blender, or in the module bpy: see run.

    PYTHON check.py -- BINARY ZIP [PATTERN...]
"""

import os
import pathlib
import subprocess
import sys
import tempfile
import unittest
from importlib import import_module

import bpy
import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import scenes

BINARY, ZIP, *PATTERNS = sys.argv[sys.argv.index("--") + 1:]
BLOCK = 16


def install():
    """Installs the zip, and returns the name of the module."""
    if hasattr(bpy.ops, "extensions") and bpy.app.version >= (4, 2):
        bpy.ops.extensions.package_install_files(filepath=ZIP, repo="user_default",
                                                 enable_on_install=True)
        return "bl_ext.user_default.tessera_blender"
    bpy.ops.preferences.addon_install(filepath=ZIP, overwrite=True)
    bpy.ops.preferences.addon_enable(module="tessera_blender")
    return "tessera_blender"


def rendered(engine, folder):
    """Renders the scene and returns (height, width, 4), linear, top row first."""
    scene = bpy.context.scene
    scene.render.engine = engine
    path = folder / f"{engine}.exr"
    scene.render.filepath = str(path)
    scene.render.image_settings.file_format = "OPEN_EXR"
    scene.render.image_settings.color_mode = "RGBA"
    scene.render.image_settings.color_depth = "32"
    bpy.ops.render.render(write_still=True)
    image = bpy.data.images.load(str(path))
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    return pixels.reshape(height, width, 4)[::-1].copy()


def blocks(image):
    height, width = image.shape[:2]
    parts = image[: height // BLOCK * BLOCK, : width // BLOCK * BLOCK, :3]
    return parts.reshape(height // BLOCK, BLOCK, width // BLOCK, BLOCK, 3).mean(axis=(1, 3))


def apart(ours, cycles):
    """The largest relative difference of the blocks' means; dark blocks count as a tenth of the
    mean, below which nobody sees 2%."""
    a, b = blocks(ours), blocks(cycles)
    return float((np.abs(a - b) / np.maximum(b, 0.1 * b.mean())).max())


class BlenderTest(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)
        scenes.begin()

    def settings(self, samples=64, **more):
        settings = bpy.context.scene.tessera
        settings.samples, settings.error_percent, settings.denoise = samples, 0, "off"
        for name, value in more.items():
            setattr(settings, name, value)

    def cycles(self, samples):
        cycles = bpy.context.scene.cycles
        cycles.samples, cycles.use_denoising, cycles.use_adaptive_sampling = samples, False, False
        cycles.max_bounces = cycles.diffuse_bounces = cycles.glossy_bounces = 15
        cycles.sample_clamp_indirect = cycles.sample_clamp_direct = 0
        cycles.blur_glossy = 0  # blurs reflections seen by diffuse surfaces
        cycles.device = "CPU"


class AgainstCycles(BlenderTest):
    """Means of blocks of 16x16 pixels agree within 2%."""

    def check(self, make):
        make()
        self.settings(256)
        self.cycles(256)
        ours = rendered("TESSERA", self.folder)
        scenes.lambert()
        cycles = rendered("CYCLES", self.folder)
        keep = os.environ.get("TESSERA_KEEP")
        if keep:
            np.savez(pathlib.Path(keep) / f"{make.__name__}.npz", ours=ours, cycles=cycles)
        difference = apart(ours, cycles)
        print(f"{make.__name__}: blocks are at most {difference:.2%} apart", flush=True)
        self.assertLess(difference, 0.02)


class Rendering(BlenderTest):
    """What F12 does besides the picture."""

    def multilayer(self):
        """Renders to a file of all passes, and returns its channels and attributes."""
        scene = bpy.context.scene
        scene.render.engine = "TESSERA"
        settings = scene.render.image_settings
        if "media_type" in settings.bl_rna.properties:  # Blender 5
            settings.media_type = "MULTI_LAYER_IMAGE"
        settings.file_format = "OPEN_EXR_MULTILAYER"
        settings.color_depth, settings.exr_codec = "32", "ZIP"
        scene.render.use_stamp = False
        path = self.folder / "all.exr"
        scene.render.filepath = str(path)
        bpy.ops.render.render(write_still=True)
        if bpy.app.version < (5,):
            # In one part, and Debian's Blender breaks beside another OpenEXR library.
            planes, attributes = import_module(f"{MODULE}.exr").read_exr(path.read_bytes())
            return planes, {name: text.decode("latin-1") for name, text in attributes.items()}
        import OpenEXR

        planes, attributes = {}, {}
        with OpenEXR.File(str(path), separate_channels=True) as file:
            for part in file.parts:
                planes |= {name: channel.pixels for name, channel in part.channels.items()}
                attributes |= part.header
        return planes, attributes

    def test_passes_are_in_axes_of_blender(self):
        scenes.one_cube()
        self.settings(4, layers={"normal", "depth", "position", "cryptomatte:object", "error"})
        planes, attributes = self.multilayer()
        # "ViewLayer.Depth.Z"; before Blender 5 in one part.
        found = {".".join(name.split(".")[-2:]): plane for name, plane in planes.items()}
        # The floor fills the lower corners: z = 0 up to rounding, its normal points up.
        self.assertAlmostEqual(float(found["Position.Z"][-1, 0]), 0, delta=1e-3)
        self.assertAlmostEqual(float(found["Normal.Z"][-1, 0]), 1, delta=1e-3)
        eye = np.array(bpy.context.scene.camera.location)
        there = np.array([found[f"Position.{axis}"][-1, 0] for axis in "XYZ"])
        forward = -np.array(bpy.context.scene.camera.matrix_world.col[2])[:3]
        # A mean over a pixel's samples of each.
        self.assertAlmostEqual(float(found["Depth.Z"][-1, 0]), (there - eye) @ forward, delta=0.05)
        self.assertTrue((found["Error.X"] >= 0).all())
        # MurmurHash3 of the names, by which Cryptomatte finds objects.
        manifest = next(text for name, text in attributes.items() if name.endswith("/manifest"))
        self.assertIn('"box"', manifest)
        self.assertGreater(float(found["CryptoObject00.G"].max()), 0.99)

    def test_an_animation_shows_each_frame(self):
        scenes.one_cube()
        box = bpy.data.objects["box"]
        scene = bpy.context.scene
        for frame, x in ((1, -2.0), (2, 2.0)):
            box.location.x = x
            box.keyframe_insert("location", frame=frame)
        scene.frame_start, scene.frame_end = 1, 2
        scene.render.engine = "TESSERA"
        self.settings(4)
        scene.render.image_settings.file_format = "OPEN_EXR"
        scene.render.filepath = str(self.folder / "frame_")
        bpy.ops.render.render(animation=True)
        means = []
        for path in sorted(self.folder.glob("frame_*")):
            image = bpy.data.images.load(str(path))
            pixels = np.array(image.pixels[:]).reshape(scenes.HEIGHT, scenes.WIDTH, 4)
            blue = pixels[..., 2] > 1.5 * pixels[..., 0]
            means.append(np.nonzero(blue)[1].mean())
        self.assertEqual(len(means), 2)
        self.assertGreater(means[1] - means[0], 10)

    def test_a_region_is_the_part_of_the_frame(self):
        scenes.one_cube()
        self.settings(64)
        whole = rendered("TESSERA", self.folder)
        render = bpy.context.scene.render
        render.use_border = render.use_crop_to_border = True
        render.border_min_x, render.border_max_x = 0.25, 0.75
        render.border_min_y, render.border_max_y = 0.25, 0.5
        part = rendered("TESSERA", self.folder)
        self.assertEqual(part.shape, (16, 48, 4))
        self.assertLess(apart(part, whole[32:48, 24:72]), 0.05)

    def test_a_clear_background_and_a_denoised_image_have_alpha(self):
        scenes.one_cube()
        bpy.data.objects.remove(bpy.data.objects["floor"])
        bpy.context.scene.render.film_transparent = True
        for denoise in ("off", "mixed", "full"):
            self.settings(4, denoise=denoise)
            pixels = rendered("TESSERA", self.folder)
            self.assertEqual(pixels[0, 0].tolist(), [0, 0, 0, 0])
            self.assertAlmostEqual(float(pixels[32, 48, 3]), 1, delta=1e-3)

    def test_sends_only_what_changed(self):
        scenes.one_cube()
        texture = bpy.data.images.new("grid", 256, 256)
        texture.generated_type = "COLOR_GRID"
        texture.filepath_raw, texture.file_format = str(self.folder / "grid.png"), "PNG"
        texture.save()
        tree = bpy.data.materials["box"].node_tree
        node = tree.nodes.new("ShaderNodeTexImage")
        node.image = texture
        shader = next(n for n in tree.nodes if n.type == "BSDF_PRINCIPLED")
        tree.links.new(node.outputs["Color"], shader.inputs["Base Color"])
        # A mesh that no other test has sent.
        bpy.data.objects["box"].data.vertices[0].co.x += 0.123
        self.settings(2)
        client = import_module(f"{MODULE}.server").connect()
        sent = []
        client._http.event_hooks["request"] = [lambda request: sent.append(request)]
        self.addCleanup(client._http.event_hooks.update, request=[])
        counts = []
        for x in (0.0, 0.0, 1.0):
            bpy.data.objects["box"].location.x = x
            sent.clear()
            self.assertEqual(bpy.ops.tessera.send(), {"FINISHED"})
            counts.append(sum(r.method == "PUT" and "/v1/assets/" in r.url.path for r in sent))
        # Document, buffer and texture; nothing; the document alone, which has the new place.
        self.assertEqual(counts, [3, 0, 1])

    def test_a_server_by_address_and_key(self):
        scenes.one_cube()
        self.settings(2)
        clean = {name: text for name, text in os.environ.items() if not name.startswith("TESSERA_")}
        server = subprocess.Popen(
            [BINARY, "serve", "--port", "0", "--log-level", "warning"], text=True,
            env=clean | {"TESSERA_KEY": "k" * 32, "TESSERA_DATA": str(self.folder / "data")},
            stdout=subprocess.PIPE)
        self.addCleanup(server.communicate)
        self.addCleanup(server.terminate)
        chosen = bpy.context.preferences.addons[MODULE].preferences
        self.addCleanup(setattr, chosen, "address", "")
        chosen.address = server.stdout.readline().split()[-1].split("#")[0]
        chosen.key = "wrong"
        with self.assertRaisesRegex(RuntimeError, "401"):
            bpy.ops.tessera.send()
        chosen.key = "k" * 32
        self.assertGreater(rendered("TESSERA", self.folder)[..., 2].max(), 0)
        jobs = import_module(f"{MODULE}.server").connect().jobs()
        self.assertEqual(next(iter(jobs)).state, "finished")

    def test_lights_keep_their_colour_and_a_fault_is_told(self):
        scenes.one_cube()
        lamp = bpy.data.lights["point"]
        lamp.color = (1, 0.5, 0.25)
        if hasattr(lamp, "use_temperature"):
            lamp.use_temperature, lamp.temperature = True, 3000
        self.settings(2)
        for _ in range(2):
            self.assertEqual(bpy.ops.tessera.send(), {"FINISHED"})
        self.assertEqual([round(c, 6) for c in lamp.color], [1, 0.5, 0.25])
        bpy.context.scene.camera = None
        with self.assertRaisesRegex(RuntimeError, "no camera"):
            bpy.ops.tessera.send()


for scene in scenes.SCENES:
    setattr(AgainstCycles, f"test_{scene.__name__}",
            lambda self, scene=scene: self.check(scene))


if __name__ == "__main__":
    MODULE = install()
    bpy.context.preferences.addons[MODULE].preferences.program = BINARY
    # A test may load an empty file, which keeps the preferences.
    found = unittest.defaultTestLoader.loadTestsFromModule(sys.modules["__main__"])
    tests = [test for suite in found for test in suite
             if not PATTERNS or any(p in test.id() for p in PATTERNS)]
    result = unittest.TextTestRunner(verbosity=2).run(unittest.TestSuite(tests))
    bad = len(result.failures) + len(result.errors)
    print(f"{result.testsRun - bad} passed, {bad} failed", flush=True)
    # The module bpy 4.2 crashes when Python ends in the usual way.
    os._exit(1 if bad or not result.testsRun else 0)
