"""Runs the README's examples and those of clients/examples like a reader."""

import contextlib
import io
import json
import math
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path
from unittest import mock

import numpy as np
from harness import PATIENCE_S, png_pixels, png_size
from support import REPOSITORY, ServerTest

EXAMPLES = Path(REPOSITORY, "clients/examples")
sys.path.insert(0, str(EXAMPLES))
import product  # noqa: E402
import simple_glb  # noqa: E402

README = Path(REPOSITORY, "clients/python/README.md")


#: A client that remembers the verdicts of its runs.
RECORDED = """
import json
import tessera_render


class Recorded(tessera_render.Client):
    verdicts = []

    def lab(self, *arguments, **members):
        run = super().lab(*arguments, **members)
        self.verdicts.append(run.verdict)
        return run


"""


class Documents(ServerTest):
    def setUp(self):
        super().setUp()
        self.folder = Path(tempfile.mkdtemp(prefix="tessera-examples-"))
        self.addCleanup(shutil.rmtree, self.folder)
        self.environment = {**os.environ, "TESSERA_SERVER": self.url(),
                            "PATH": os.path.dirname(sys.executable) + ":" + os.environ["PATH"]}

    def run_example(self, name, *arguments, program=sys.executable):
        done = subprocess.run(
            [program, EXAMPLES / name, *arguments],
            env=self.environment,
            cwd=self.folder,
            capture_output=True,
            text=True,
            timeout=PATIENCE_S,
        )
        self.assertEqual((done.returncode, done.stderr), (0, ""), done.stdout)
        return done.stdout

    def test_readme_runs_from_top_to_bottom(self):
        blocks = re.findall(r"^```python\n(.*?)^```$", README.read_text(), re.S | re.M)
        self.assertGreaterEqual(len(blocks), 8)
        names = {"__name__": "readme"}
        shown = io.StringIO()
        home = os.getcwd()
        os.chdir(self.folder)
        try:
            with mock.patch.dict(os.environ, self.environment), contextlib.redirect_stdout(shown):
                for number, block in enumerate(blocks, 1):
                    exec(compile(block, f"README.md, example {number}", "exec"), names)
        finally:
            os.chdir(home)
        self.assertIn("/film/width 0 is outside [1, 16384]", shown.getvalue())
        self.assertIn("finished relative_error", shown.getvalue())
        self.assertEqual(png_size((self.folder / "cornell.png").read_bytes())[:2], (160, 90))
        self.assertTrue((self.folder / "cornell.exr").read_bytes().startswith(b"v/1\x01"))
        self.assertEqual(names["images"][0].shape, (64, 64, 3))

    def test_notebooks_draw_their_figures_from_runs_that_agree_with_theory(self):
        notebooks = sorted(Path(EXAMPLES, "notebooks").glob("*.ipynb"))
        self.assertGreaterEqual(len(notebooks), 5)
        for path in notebooks:
            with self.subTest(path.name):
                cells = [
                    "".join(cell["source"]) for cell in json.loads(path.read_text())["cells"]
                    if cell["cell_type"] == "code"
                ]
                code = (
                    "\n".join(cells)
                    .replace("client = Client()", "client = Recorded()")
                )  # fmt: skip
                program = Path(self.folder, path.stem + ".py")
                program.write_text(RECORDED + code + "\nprint(json.dumps(Recorded.verdicts))\n")
                done = subprocess.run(
                    [sys.executable, program], cwd=self.folder, capture_output=True, text=True,
                    env={**self.environment, "MPLBACKEND": "Agg"}, timeout=PATIENCE_S,
                )  # fmt: skip
                self.assertEqual(done.returncode, 0, done.stderr)
                verdicts = json.loads(done.stdout)
                self.assertGreater(len(verdicts), 3)
                self.assertNotIn("differs", verdicts)
                figure = Path(self.folder, path.stem + ".png").read_bytes()
                self.assertGreater(png_size(figure)[0], 600)
                pixels = np.asarray(png_pixels(figure))
                self.assertGreater(np.unique(pixels.reshape(-1, pixels.shape[-1]), axis=0).shape[0],
                                   8, "an empty figure")

    def test_every_example_has_a_test(self):
        here = Path(__file__).read_text()
        for path in EXAMPLES.iterdir():
            if path.suffix in (".py", ".sh", ".mjs") and path.name not in (
                "simple_glb.py",
                "product.py",
                "rooms.py",
            ):
                self.assertRegex(here, r'run_example\(\s*"' + re.escape(path.name) + '"')

    def test_curl_tour(self):
        told = self.run_example("curl_tour.sh", ".", program="sh")
        self.assertRegex(told, r"relative error 0\.\d+, 95% between 0\.\d+ and 0\.\d+")
        self.assertIn("finished with 64 samples", told)
        self.assertIn("'pointer': '/film/width'", told)
        for name in ("image.png", "error.png"):
            self.assertEqual(png_size((self.folder / name).read_bytes())[:2], (160, 90))
        pixel = json.loads((self.folder / "pixel.json").read_text())
        self.assertEqual((pixel["x"], pixel["y"]), (80, 45))

    def test_turntable(self):
        arguments = ("--frames", "3", "--size", "48x36", "--error", "0.3")
        self.run_example("turntable.py", *arguments)
        frames = [(self.folder / f"turntable-{i:03}.png").read_bytes() for i in range(3)]
        self.assertEqual({png_size(frame) for frame in frames}, {(48, 36, 6)})
        self.assertEqual(len(set(frames)), 3)
        jobs = len(list(self.client.jobs(label="turntable")))
        self.run_example("turntable.py", *arguments)
        self.assertEqual(
            len(list(self.client.jobs(label="turntable"))), jobs, "found by their labels"
        )

    def test_dataset(self):
        self.run_example("dataset.py", "--count", "3", "--size", "48x36", "--samples", "4")
        folder = self.folder / "dataset"
        for kind in ("instances", "panoptic"):
            data = json.loads((folder / f"annotations/{kind}.json").read_text())
            self.assertEqual(len(data["images"]), 3)
            self.assertGreater(len(data["annotations"]), 0)
        cameras = {str(image["camera"]["to_world"]) for image in data["images"]}
        self.assertEqual(len(cameras), 3)
        for image, seen in zip(data["images"], data["annotations"], strict=True):
            rows = np.array(png_pixels((folder / "panoptic" / seen["file_name"]).read_bytes()))
            ids = rows @ np.array([1, 256, 65536])
            self.assertEqual(ids.shape, (image["height"], image["width"]))
            for segment in seen["segments_info"]:
                self.assertEqual((ids == segment["id"]).sum(), segment["area"])

    def test_variants(self):
        told = self.run_example("variants.py", "--size", "40x60", "--samples", "16")
        names = re.findall(
            r"^(\w+): albedo in the middle ([0-9.]+) ([0-9.]+) ([0-9.]+)", told, re.M
        )
        albedos = {name: [float(v) for v in values] for name, *values in names}
        self.assertEqual(list(albedos), ["ivory", "cobalt", "oxblood", "copper"])
        # The metal's albedo is its base colour; the glazes add a small white reflection.
        np.testing.assert_allclose(albedos["copper"], [0.95, 0.55, 0.40], atol=0.01)
        self.assertEqual(np.argmax(albedos["cobalt"]), 2)
        self.assertEqual(np.argmax(albedos["oxblood"]), 0)
        sheet = png_pixels((self.folder / "variants.png").read_bytes())
        self.assertEqual((len(sheet), len(sheet[0])), (60, 160))
        self.assertEqual(sheet[0][0], (255, 255, 255))
        middles = {sheet[30][20 + 40 * i] for i in range(4)}
        self.assertEqual(len(middles), 4)

    def test_render_fidelity(self):
        # A red plate at z = -0.5: right of the middle seen from +x, left of it from -x. Half of the
        # frame's 32 pixels is 2 tan(22.5 degrees) 4 / 3 = 1.1 m wide.
        glb = simple_glb.Glb()
        red = glb.add_material("red", doubleSided=True, emissiveFactor=[1, 0, 0],
                               pbrMetallicRoughness={"baseColorFactor": [0, 0, 0, 1]})
        corners = [[0, -0.3, -0.2], [0, -0.3, -0.8], [0, 0.3, -0.8], [0, 0.3, -0.2]]
        glb.add_node(mesh=glb.add("meshes", {"primitives": [
            glb.add_primitive(corners, [0, 1, 2, 0, 2, 3], red)]}))
        (self.folder / "plate.glb").write_bytes(glb.bytes())
        (self.folder / "studio.hdr").write_bytes(product.studio())
        for theta, skybox, column in ((90, False, 23), (270, False, 8), (90, True, 23)):
            scenario = {
                "name": "plate", "model": "plate.glb", "lighting": "studio.hdr",
                "dimensions": {"width": 16, "height": 12}, "orbit": {"theta": theta, "radius": 2},
                "renderSkybox": skybox, "pt": {"numSamples": 4},
            }
            told = self.run_example("render_fidelity.py", "--root", str(self.folder), json.dumps(
                {"scenario": scenario, "outputFile": str(self.folder / "a.png")}))
            self.assertIn("plate: error", told)
            content = (self.folder / "a.png").read_bytes()
            self.assertEqual(png_size(content)[:2], (32, 24))
            rows = np.array(png_pixels(content))
            self.assertGreater(rows[12, column, 0], 2 * rows[12, column, 1:3].max())
            if skybox:
                self.assertTrue(rows.shape[2] == 3 or (rows[..., 3] == 255).all())
            else:
                self.assertEqual(rows[12, [column, 31 - column], 3].tolist(), [255, 0])

    def test_error_target(self):
        told = self.run_example(
            "error_target.py", "--error", "0.15", "--size", "64x36", "--out", "p.png"
        )
        ended, value, high = re.search(
            r"^(\w+): .* error ([0-9.]+)% \([0-9.]+% to ([0-9.]+)%\)", told, re.M
        ).groups()
        self.assertEqual(ended, "relative_error")
        self.assertLessEqual(float(value), 15)
        self.assertLess(float(high), 20)
        power = float(re.search(r"to the power (-?[0-9.]+)", told).group(1))
        self.assertLess(power, -0.3)
        self.assertEqual(png_size((self.folder / "p.png").read_bytes())[:2], (64, 36))

    def test_lighting_study(self):
        samples = 256
        told = self.run_example("lighting_study.py", "--samples", str(samples))
        rows = re.findall(
            r"^ +([0-9.]+) m +([0-9.]+) lx +\(([0-9.]+) to ([0-9.]+)\) +exact +([0-9.]+)",
            told,
            re.M,
        )
        self.assertEqual(len(rows), 8)
        for i, row in enumerate(rows):
            x, value, low, high, exact = map(float, row)
            # Four standard errors of independent samples, distributed uniformly over the luminaire:
            # the renderer is at least as accurate. 0.01 lx is the last digit; the curvature of E
            # within a pixel is below 2e-4.
            mean, deviation = self.illuminance(
                float(x) // 0.0625 * 0.0625 + 0.03125, (1.5, 2.5)[i // 4]
            )
            self.assertAlmostEqual(exact, mean, delta=0.01 + 1e-4 * mean)
            tolerance = 4 * deviation / math.sqrt(samples) + 0.01 + 2e-4 * exact
            self.assertLess(tolerance, 0.15 * exact)  # the tolerance is tight enough to matter
            self.assertLess(abs(value - exact), tolerance, row)
            self.assertTrue(low < value < high < 1.02 * low, row)

    @staticmethod
    def illuminance(x, height):
        """Mean and standard deviation of the irradiance over points of the luminaire, by the
        midpoint rule: 1.2 m by 0.3 m of 1000 cd/m^2, L cos^2 / r^2 per area, at (x, 0.03125)."""
        u = (np.arange(400) + 0.5) / 400 * 1.2 - 0.6 - x
        v = (np.arange(100) + 0.5) / 100 * 0.3 - 0.15 - 0.03125
        square = u[:, None] ** 2 + v[None, :] ** 2 + height**2
        given = 1000 * 1.2 * 0.3 * height**2 / square**2
        return float(given.mean()), float(given.std())

    def test_javascript(self):
        told = self.run_example("render.mjs", "cornell-box", "js.png", program="node")
        self.assertLess(float(re.search(r"^end: relative error (.*)$", told, re.M).group(1)), 0.15)
        self.assertEqual(png_size((self.folder / "js.png").read_bytes())[:2], (160, 90))
        self.assertLessEqual(len((EXAMPLES / "render.mjs").read_text().splitlines()), 30)
