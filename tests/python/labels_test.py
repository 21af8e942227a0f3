"""Labelled images, read by third-party tools: OpenEXR and pycocotools."""

import contextlib
import io
import json
import tempfile
from pathlib import Path

import numpy as np
import OpenEXR
from cryptomatte_api import Cryptomatte
from hotcoco.panoptic import pq_compute
from pycocotools.coco import COCO
from support import ServerTest
from tessera_render import CocoFolder
from tessera_render.datasets import masks, segments

LAYERS = ["object", "instance", "material", "primitive", "cryptomatte:object",
          "cryptomatte:material"]


class Labelled(ServerTest):
    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        cls.folder = Path(tempfile.mkdtemp(prefix="tessera-labels-"))

    def job(self):
        return self.client.submit(
            "cornell-box", size=(64, 48), samples_per_pixel=16, layers=LAYERS,
            camera={"orbit": {"theta_degrees": 30, "phi_degrees": 70}},
            environment={"color": [1, 1, 1], "visible": False},
        ).wait()  # fmt: skip

    def test_openexr_reads_integer_ids_and_cryptomatte(self):
        job = self.job()
        place = job.save(self.folder / "all.exr")
        file = OpenEXR.File(str(place), separate_channels=True)
        header, channels = file.header(), file.channels()
        for layer in LAYERS[:4]:
            pixels = channels[f"{layer}.Y"].pixels
            self.assertEqual(pixels.dtype, np.uint32)
            np.testing.assert_array_equal(pixels, job.image(layer))
        alpha = channels["A"].pixels.astype(np.float64)
        self.assertGreater(((alpha > 0.01) & (alpha < 0.99)).sum(), 20)
        objects = job.objects()
        for name, rows in (("CryptoObject", "objects"), ("CryptoMaterial", "materials")):
            (key,) = [k for k, v in header.items() if k.endswith("/name") and v == name]
            manifest = json.loads(header[key.removesuffix("name") + "manifest"])
            self.assertEqual(set(manifest), {each["name"] for each in objects[rows]})
            known = {int(number, 16) for number in manifest.values()}
            total = np.zeros_like(alpha)
            for k in range(3):
                for identity, coverage in (("R", "G"), ("B", "A")):
                    ids = channels[f"{name}0{k}.{identity}"].pixels
                    share = channels[f"{name}0{k}.{coverage}"].pixels
                    self.assertEqual(ids.dtype, np.float32)
                    self.assertLessEqual(set(np.unique(ids.view(np.uint32)[share > 0])), known)
                    total += share
            # Alpha is a float here because of the ids: means of 16 samples, rounded.
            np.testing.assert_allclose(total, alpha, atol=1e-5)

    def test_pycocotools_reads_the_masks(self):
        job = self.job()
        ids, objects = job.image("instance"), job.objects()
        folder = CocoFolder(self.folder / "coco")
        folder.add("a", job.picture(), ids, objects)
        folder.write()
        with contextlib.redirect_stdout(io.StringIO()):
            coco = COCO(str(self.folder / "coco/annotations/instances.json"))
        annotations = coco.loadAnns(coco.getAnnIds())
        found = masks(ids)
        self.assertEqual({each["instance_id"] for each in annotations}, set(found))
        for each in annotations:
            np.testing.assert_array_equal(coco.annToMask(each), found[each["instance_id"]])
        self.assertEqual(
            {c["name"] for c in coco.loadCats(coco.getCatIds())},
            {segment.name.split("#")[0] for segment in segments(ids, objects)},
        )

    def test_parts_equal_a_single_part_file(self):
        job = self.job()
        one = OpenEXR.File(str(job.save(self.folder / "one.exr")), separate_channels=True)
        many = OpenEXR.File(
            str(job.save(self.folder / "parts.exr", parts=1)), separate_channels=True
        )
        names = [part.name() for part in many.parts]
        self.assertEqual(names[0], "beauty")
        self.assertEqual(len(set(names)), len(names))
        found = {}
        for part in many.parts:
            for channel, values in part.channels.items():
                prefix = "" if part.name() == "beauty" else part.name() + "."
                found[prefix + channel] = values.pixels
        whole = one.channels()
        self.assertEqual(set(found), set(whole))
        for name, pixels in found.items():
            expected = np.float16 if name in "RGBA" else whole[name].pixels.dtype
            self.assertEqual(pixels.dtype, expected)
            np.testing.assert_array_equal(pixels, whole[name].pixels.astype(pixels.dtype), name)
        for part in many.parts:
            is_matte = part.name().startswith("Crypto")
            has_names = any(key.endswith("/manifest") for key in part.header)
            self.assertEqual(has_names, is_matte or part.name() == "beauty", part.name())

    def test_cryptomatte_reader_finds_the_masks_by_name(self):
        job = self.job()
        place = job.save(self.folder / "mattes.exr")
        mattes = Cryptomatte.load(str(place))
        self.assertEqual(len(mattes), 2)
        channels = OpenEXR.File(str(place), separate_channels=True).channels()
        alpha = channels["A"].pixels
        told = job.objects()
        names = [{each["name"] for each in told[rows]} for rows in ("objects", "materials")]
        for matte in mattes:
            masks = matte.masks()
            self.assertTrue(any(set(masks) <= known for known in names), set(masks))
            total = sum(masks.values())
            np.testing.assert_allclose(total, alpha, atol=1e-5)
        # Compared with the ids: nearly everywhere the largest coverage of a pixel is the object at
        # its centre.
        (objects,) = [m.masks() for m in mattes if set(m.masks()) <= names[0]]
        ids = job.image("object")
        for each in job.objects()["objects"]:
            middle = ids == each["id"]
            if middle.sum() > 40:
                self.assertGreater(objects[each["name"]][middle].mean(), 0.7)
                self.assertLess(objects[each["name"]][~middle].mean(), 0.1)

    def test_panoptic_evaluation_reads_the_folder(self):
        job = self.job()
        folder = CocoFolder(self.folder / "panoptic")
        folder.add("a", job.picture(), job.image("instance"), job.objects())
        folder.write()
        table = self.folder / "panoptic/annotations/panoptic.json"
        pictures = self.folder / "panoptic/panoptic"
        self.assertEqual(pq_compute(table, table, pictures, pictures)["All"]["pq"], 1)
