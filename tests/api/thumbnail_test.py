"""tessera thumbnail: a small image of a file, with and without a server."""

import configparser
import tempfile
from pathlib import Path

from harness import ApiTest, png_pixels, png_size, tessera, triangle_glb

REPOSITORY = Path(__file__).resolve().parents[2]


class Thumbnail(ApiTest):
    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="tessera-thumbnail-"))
        self.model = self.folder / "model.glb"
        self.model.write_bytes(triangle_glb())

    def thumbnail(self, *arguments, server=None):
        return tessera("thumbnail", self.model, *arguments, "--seconds", "0.2",
                       "--server", server or f"http://127.0.0.1:{self.server.port}")

    def expect_framed(self, file):
        """The model takes most of the square and touches no side."""
        rows = png_pixels(file.read_bytes())
        seen = [(x, y) for y, row in enumerate(rows) for x, pixel in enumerate(row) if pixel[3]]
        side = len(rows)
        for axis in (0, 1):
            low, high = (f(at[axis] for at in seen) for f in (min, max))
            self.assertGreater(low, 0)
            self.assertLess(high, side - 1)
        widest = max(max(at[axis] for at in seen) - min(at[axis] for at in seen) for axis in (0, 1))
        self.assertGreater(widest, side / 2)

    def test_writes_a_square_and_leaves_nothing_on_the_server(self):
        file = self.folder / "out.png"
        before = self.server.get("/v1/scenes").json(), self.server.get("/v1/jobs").json()
        code, _, said = self.thumbnail("-o", file, "--size", "96")
        self.assertEqual(code, 0, said)
        self.assertEqual(png_size(file.read_bytes())[:2], (96, 96))
        self.expect_framed(file)
        self.assertEqual(
            (self.server.get("/v1/scenes").json(), self.server.get("/v1/jobs").json()), before
        )

    def test_keeps_a_scene_that_was_there(self):
        answer = self.server.post(
            "/v1/scenes", self.model.read_bytes(), headers={"Content-Type": "model/gltf-binary"}
        )
        code, _, said = self.thumbnail("-o", self.folder / "out.png", "--size", "32")
        self.assertEqual(code, 0, said)
        self.assertEqual(self.server.get(f"/v1/scenes/{answer.json()['id']}").status, 200)

    def test_renders_without_a_server(self):
        """Some file managers run thumbnailers without a network. The name has no extension."""
        file = self.folder / "out"
        code, _, said = self.thumbnail("-o", file, "--size", "64", server="http://127.0.0.1:1")
        self.assertEqual(code, 0, said)
        self.assertEqual(png_size(file.read_bytes())[:2], (64, 64))
        self.expect_framed(file)

    def test_refusals_of_the_server_are_told(self):
        self.model.write_bytes(b"glTF but not really")
        code, _, said = self.thumbnail("-o", self.folder / "out.png")
        self.assertEqual(code, 1)
        self.assertIn("thumbnail", said)
        self.assertFalse((self.folder / "out.png").exists())

    def test_entry_for_file_managers_runs(self):
        """The entry's command, with %i, %o and %s as the specification has them."""
        entry = configparser.ConfigParser(interpolation=None)
        entry.optionxform = str
        entry.read(REPOSITORY / "docker/tessera.thumbnailer")
        found = entry["Thumbnailer Entry"]
        self.assertEqual(
            found["MimeType"].strip(";").split(";"), ["model/gltf-binary", "model/gltf+json"]
        )
        file = self.folder / "of-entry"
        values = {"%i": str(self.model), "%o": str(file), "%s": "48"}
        program, *words = [values.get(word, word) for word in found["Exec"].split()]
        self.assertEqual(program, found["TryExec"])
        server = {"TESSERA_SERVER": f"http://127.0.0.1:{self.server.port}"}
        code, _, said = tessera(*words, environ=server)
        self.assertEqual(code, 0, said)
        self.assertEqual(png_size(file.read_bytes())[:2], (48, 48))
