"""Scenes and environments from files: uploads, skipped uploads, refusals."""

import asyncio
import hashlib
import io
import json
import tempfile
import unittest
import zipfile
from pathlib import Path
from unittest import mock

from harness import BINARY, TRIANGLE, glb, hdr_image, triangle_document, triangle_glb
from support import ServerTest

import tessera_render
from tessera_render import AsyncClient, TesseraError, _upload

CONVERTER = Path(BINARY).resolve().parent / "tessera-convert"
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
        with self.assertRaises(tessera_render.NotFound):
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
        with self.assertRaisesRegex(TesseraError, "one .gltf or .glb file, here: none"):
            self.client.upload(self.folder)
        self.model()
        self.model("second.gltf")
        with self.assertRaisesRegex(tessera_render.TesseraError, "model.gltf, second.gltf"):
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
        with self.assertRaises(tessera_render.Problem):
            self.client.upload(empty.getvalue())

    def test_obj_takes_along_the_materials_and_textures_beside_it(self):
        folder = self.folder / "in"
        folder.mkdir()
        path = folder / "box.obj"
        path.write_bytes(b"mtllib parts\\Two Words.mtl \r\nv 0 0 0\nmtllib ../box.mtl\n")
        (self.folder / "box.mtl").write_bytes(b"newmtl outside\n")
        (folder / "parts").mkdir()
        (folder / "parts/two words.mtl").write_bytes(
            b"newmtl a\nKd 1 1 1\n  map_Kd -bm 1 wood.png\nnorm bumps.png\nmap_Ks missing.png\n"
        )
        for name in ("wood.png", "bumps.png", "of another.png"):
            (folder / name).write_bytes(name.encode())
        call = _upload.single_file_call(path, ".obj")
        self.assertEqual(
            (call.headers["Content-Type"], call.params["name"]), ("application/zip", "box.obj")
        )
        with zipfile.ZipFile(io.BytesIO(call.content)) as packed:
            self.assertEqual(
                packed.namelist(), ["box.obj", "Two Words.mtl", "wood.png", "bumps.png"]
            )
            self.assertEqual(packed.read("wood.png"), b"wood.png")
        for name in ("a.mtl", "b.mtl"):
            (folder / name).write_bytes(b"")
        path.write_bytes(b"mtllib a.mtl b.mtl\n")
        self.assertEqual(list(_upload.obj_files(path)), ["box.obj", "b.mtl", "a.mtl"])
        quoted = b'newmtl a\nmap_Kd "of another.png"\n'
        for text in (quoted, quoted.decode().encode("utf-16"), quoted.replace(b"\n", b"\r")):
            (folder / "a.mtl").write_bytes(text)
            path.write_bytes(b"\xef\xbb\xbfmtllib a.mtl\n")
            self.assertEqual(list(_upload.obj_files(path)), ["box.obj", "a.mtl", "of another.png"])
        for name in ("a", "b"):
            (folder / name).mkdir()
            (folder / name / "same.png").write_bytes(name.encode())
        (folder / "a.mtl").write_bytes(b"map_Kd a/same.png\nmap_Ke b\\same.png\nnorm ./a/same.png")
        self.assertEqual(
            list(_upload.obj_files(path)), ["box.obj", "a.mtl", "same.png", "b/same.png"]
        )
        path.write_bytes(b"v 0 0 0\n")
        self.assertEqual(_upload.single_file_call(path, ".obj").content, path)

    @unittest.skipUnless(CONVERTER.is_file(), "tessera-convert was not built")
    def test_obj_is_converted_by_the_server(self):
        path = self.folder / "box.obj"
        path.write_text("mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl red\nf 1 2 3\n")
        (self.folder / "a.mtl").write_text("newmtl red\nKd 1 0 0\n")
        scene = self.client.upload(path)
        self.assertEqual((scene.name, scene.triangles, scene.materials), ("box.obj", 1, ["red"]))

    def test_reports_missing_files(self):
        path = self.model()
        (self.folder / "the buffer.bin").unlink()
        with self.assertRaisesRegex(FileNotFoundError, "the buffer.bin"):
            self.client.upload(path)
        self.sent.clear()
        with self.assertRaises(FileNotFoundError):
            self.client.submit("no/such/file.glb")
        with self.assertRaisesRegex(TesseraError, "a scene is a folder with one glTF"):
            self.client.upload(__file__)
        with self.assertRaises(tessera_render.TesseraError):
            self.client.upload(b"neither")
        self.assertEqual(self.sent, [])

    def test_scene_may_not_refer_to_files_outside_its_folder(self):
        inner = self.folder / "inner"
        inner.mkdir()
        secret = self.folder / "secret.bin"
        secret.write_bytes(b"secret" + TRIANGLE)
        (inner / "link.bin").symlink_to(secret)
        for uri in (
            "../secret.bin", "../gone.bin", "%2e%2e/secret.bin", "..\\secret.bin", str(secret),
            "link.bin",
        ):
            path = inner / "model.gltf"
            path.write_text(json.dumps(triangle_document(uri=uri)))
            with self.assertRaisesRegex(tessera_render.TesseraError, "own folder"):
                self.client.upload(path)
        path.write_text(json.dumps(triangle_document(uri="file://" + str(secret))))
        with self.assertRaisesRegex(tessera_render.TesseraError, "not relative"):
            self.client.upload(path)
        secret_id = hashlib.sha256(secret.read_bytes()).hexdigest()
        self.assertEqual(self.server.get(f"/v1/assets/{secret_id}").status, 404)

    def test_sends_files_beside_a_glb_and_light_profiles(self):
        (self.folder / "the buffer.bin").write_bytes(TRIANGLE)
        path = self.folder / "beside.glb"
        path.write_bytes(glb(triangle_document(uri=BUFFER)))
        self.assertEqual(self.client.upload(path).triangles, 1)
        lamp = "IESNA:LM-63-1995\nTILT=NONE\n1 -1 1 2 1 1 2 0 0 0\n1 1 1\n0 90\n0\n100 100\n"
        (self.folder / "lamp.ies").write_text(lamp)
        model = self.model(extensionsUsed=["EXT_lights_ies"],
                           extensions={"EXT_lights_ies": {"lights": [{"uri": "lamp.ies"}]}})
        self.assertEqual(self.client.upload(model).triangles, 1)

    def test_finds_files_as_windows_and_macos_do(self):
        path = self.folder / "model.gltf"
        (self.folder / "Ku\u0308che.BIN").write_bytes(TRIANGLE)  # u and its dots
        for uri in ("K%C3%BCche.bin", ".\\K\u00fcche.Bin"):
            path.write_text(json.dumps(triangle_document(uri=uri)))
            self.assertEqual(self.client.upload(path).triangles, 1)

    def test_refuses_files_that_are_not_scenes_with_a_reason(self):
        path = self.folder / "bad.glb"
        path.write_bytes(b"glTF is not enough")
        with self.assertRaises(tessera_render.Problem) as caught:
            self.client.upload(path)
        self.assertEqual(caught.exception.status, 422)
        (self.folder / "bad.gltf").write_text("{")
        with self.assertRaisesRegex(tessera_render.TesseraError, "is not JSON"):
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
