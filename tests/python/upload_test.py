"""Scenes and environments from files: uploads, skipped uploads, refusals."""

import asyncio
import io
import json
import tempfile
import zipfile
from pathlib import Path
from unittest import mock

from harness import TRIANGLE, hdr_image, triangle_document, triangle_glb
from support import ServerTest

import tessera
from tessera import AsyncClient

BUFFER = "the%20buffer.bin"  # as glTF writes "the buffer.bin"
SMALL = {"size": (16, 16), "layers": [], "samples_per_pixel": 2}


class Uploads(ServerTest):
    def setUp(self):
        super().setUp()
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name).resolve()
        sent = []
        send = self.client._http.send
        self.sent = sent
        patch = mock.patch.object(
            self.client._http,
            "send",
            side_effect=lambda r, **k: sent.append((r.method, r.url.path)) or send(r, **k),
        )
        patch.start()
        self.addCleanup(patch.stop)

    def model(self, name="model.gltf", **members):
        path = self.folder / name
        path.write_text(json.dumps(triangle_document(uri=BUFFER, **members)))
        (self.folder / "the buffer.bin").write_bytes(TRIANGLE)
        return path

    def test_describes_and_renders_a_glb(self):
        path = self.folder / "one.glb"
        path.write_bytes(triangle_glb(materials=[{"name": "white"}]))
        scene = self.client.upload(path)
        self.assertEqual((scene.name, scene.triangles, scene.materials), ("one.glb", 1, ["white"]))
        low, high = scene.bounds
        self.assertEqual((low.tolist(), high.tolist()), ([-1, -1, 0], [1, 1, 0]))
        self.assertEqual(self.client.upload(path.read_bytes()).id, scene.id)
        self.assertEqual(self.client.scene(scene.id), scene)
        self.assertIn(scene.id, [each.id for each in self.client.scenes()])
        job = self.client.submit(str(path), **SMALL).wait()
        self.assertEqual((job.spec["scene"], job.name), (scene.id, "one.glb"))
        job.delete()
        self.client.delete_scene(scene)
        with self.assertRaises(tessera.NotFound):
            self.client.scene(scene.id)

    def test_gltf_sends_its_files_without_repeating_any(self):
        path = self.model(materials=[{"name": "of this test alone"}])
        # Other tests may have uploaded the plain buffer.
        (self.folder / "the buffer.bin").write_bytes(TRIANGLE + bytes(4))
        scene = self.client.upload(path)
        self.assertEqual((scene.name, scene.triangles), (path.name, 1))
        self.assertEqual([method for method, path in self.sent if "assets" in path],
                         ["HEAD", "PUT", "HEAD", "PUT"])
        self.sent.clear()
        self.assertEqual(self.client.upload(self.folder).id, scene.id)
        self.assertEqual(
            [method for method, path in self.sent if "assets" in path], ["HEAD", "HEAD"]
        )

    def test_folder_needs_exactly_one_document(self):
        with self.assertRaisesRegex(tessera.TesseraError, "one .gltf or .glb file, here: none"):
            self.client.upload(self.folder)
        self.model()
        self.model("second.gltf")
        with self.assertRaisesRegex(tessera.TesseraError, "model.gltf, second.gltf"):
            self.client.upload(self.folder)

    def test_accepts_a_zip_as_a_file_and_as_bytes(self):
        path = self.folder / "scene.zip"
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            archive.write(self.model(), "in/model.gltf")
            archive.write(self.folder / "the buffer.bin", "in/the buffer.bin")
        scene = self.client.upload(path)
        self.assertEqual(scene.triangles, 1)
        self.assertEqual(self.client.upload(path.read_bytes()).id, scene.id)
        empty = io.BytesIO()
        zipfile.ZipFile(empty, "w").close()
        with self.assertRaises(tessera.Problem):
            self.client.upload(empty.getvalue())

    def test_reports_missing_files_before_sending_anything(self):
        path = self.model()
        (self.folder / "the buffer.bin").unlink()
        with self.assertRaisesRegex(FileNotFoundError, BUFFER):
            self.client.upload(path)
        self.assertEqual(self.sent, [])
        with self.assertRaises(FileNotFoundError):
            self.client.submit("no/such/file.glb")
        with self.assertRaisesRegex(tessera.TesseraError, "a scene is a .glb"):
            self.client.upload(__file__)
        with self.assertRaises(tessera.TesseraError):
            self.client.upload(b"neither")

    def test_scene_may_not_refer_to_files_outside_its_folder(self):
        inner = self.folder / "inner"
        inner.mkdir()
        secret = self.folder / "secret.bin"
        secret.write_bytes(TRIANGLE)
        (inner / "link.bin").symlink_to(secret)
        for uri in (
            "../secret.bin",
            "%2e%2e/secret.bin",
            str(secret),
            "link.bin",
            "file://" + str(secret),
        ):
            path = inner / "model.gltf"
            path.write_text(json.dumps(triangle_document(uri=uri)))
            with self.assertRaisesRegex(tessera.TesseraError, "own folder"):
                self.client.upload(path)
        self.assertEqual(self.sent, [])

    def test_refuses_files_that_are_not_scenes_with_a_reason(self):
        path = self.folder / "bad.glb"
        path.write_bytes(b"glTF is not enough")
        with self.assertRaises(tessera.Problem) as caught:
            self.client.upload(path)
        self.assertEqual(caught.exception.status, 422)
        (self.folder / "bad.gltf").write_text("{")
        with self.assertRaisesRegex(tessera.TesseraError, "is not JSON"):
            self.client.upload(self.folder / "bad.gltf")

    def test_environment_lights_the_scene(self):
        path = self.folder / "sky.hdr"
        path.write_bytes(hdr_image(8, 4, (0.25, 0.5, 0.75)))
        glb = self.folder / "one.glb"
        glb.write_bytes(triangle_glb())
        job = self.client.submit(glb, environment=path, **SMALL).wait()
        # The corner shows the environment: RGBE represents these three numbers exactly.
        self.assertEqual(job.image()[0, 0].tolist(), [0.25, 0.5, 0.75])
        self.assertEqual(self.client.upload_asset(path), job.spec["environment"]["asset"])

    def test_asynchronous_client_uploads_the_same(self):
        glb = self.folder / "large.glb"
        glb.write_bytes(triangle_glb(extras={"filler": "x" * 3_000_000}))
        model = self.model("model.gltf")

        async def run():
            async with AsyncClient(self.url()) as client:
                scenes = [await client.upload(model), await client.upload(glb)]
                listed = {scene.id async for scene in client.scenes()}
                return scenes, listed, await client.upload_asset(glb)

        (first, second), listed, asset = asyncio.run(run())
        self.assertEqual((first.triangles, second.triangles), (1, 1))
        self.assertLessEqual({first.id, second.id}, listed)
        self.assertEqual(self.client.upload(model).id, first.id)
        self.assertEqual(self.client.upload(glb).id, second.id)
        self.assertEqual(self.server.get(f"/v1/assets/{asset}").body, glb.read_bytes())
