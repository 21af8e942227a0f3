"""Masks, boxes and COCO from ids, checked by hand against the format specifications."""

import json
import shutil
import tempfile
import unittest
from pathlib import Path

import numpy as np
from harness import png_pixels
from hotcoco.panoptic import pq_compute
from tessera_render import CocoFolder
from tessera_render.datasets import box_of, ids_of, masks, panoptic_png, run_lengths, segments

IDS = np.array([[0, 7, 7, 0], [0, 7, 300, 300], [0, 0, 300, 0]], dtype=np.float32)


def place(**more):
    return {"bounds": None, "visible": None, "amodal": None, **more}


OBJECTS = {
    "camera": {"type": "perspective", "fx": 10.0},
    "has_ids": True,
    "objects": [
        {"id": 2, "pointer": "/nodes/1", "name": "chair", "first_instance": 7, "instances": 1,
         **place()},
        {"id": 5, "pointer": "/nodes/4", "name": "chair#4", "first_instance": 300, "instances": 1,
         **place()},
    ],
    "instances": [
        {"id": 7, "object": 2, **place(amodal={"x": 1, "y": 0, "width": 3, "height": 2})},
        {"id": 300, "object": 5, **place()},
    ],
    "materials": [],
    "primitives": [],
}


def from_run_lengths(rle):
    """Decodes like pycocotools: column by column."""
    flat = []
    for i, count in enumerate(rle["counts"]):
        flat += [i % 2] * count
    height, width = rle["size"]
    return np.array(flat, dtype=bool).reshape(width, height).T


class Datasets(unittest.TestCase):
    def test_masks_and_boxes_match_the_pixels(self):
        found = masks(IDS)
        self.assertEqual(sorted(found), [7, 300])
        self.assertEqual(found[7].sum(), 3)
        self.assertEqual(box_of(found[7]), (1, 0, 2, 2))
        self.assertEqual(box_of(found[300]), (2, 1, 2, 2))

    def test_refuses_a_layer_without_ids(self):
        for wrong in (np.zeros((2, 2, 3)), np.array([[0.5]]), np.array([[-1.0]])):
            with self.assertRaises(ValueError):
                ids_of(wrong)

    def test_run_lengths_start_with_zeros_and_run_down_the_columns(self):
        mask = np.array([[True, False], [True, True]])
        self.assertEqual(run_lengths(mask), {"size": [2, 2], "counts": [0, 2, 1, 1]})
        numbers = np.random.default_rng(3)
        for shape in ((1, 1), (5, 3), (4, 9)):
            for share in (0.0, 0.5, 1.0):
                mask = numbers.random(shape) < share
                rle = run_lengths(mask)
                self.assertEqual(sum(rle["counts"]), mask.size)
                np.testing.assert_array_equal(from_run_lengths(rle), mask)

    def test_panoptic_image_holds_the_ids(self):
        rows = np.array(png_pixels(panoptic_png(IDS)))
        back = rows[:, :, 0] + 256 * rows[:, :, 1] + 65536 * rows[:, :, 2]
        np.testing.assert_array_equal(back, IDS)

    def test_segments_have_the_names_of_their_objects(self):
        first, second = segments(IDS, OBJECTS)
        self.assertEqual((first.id, first.object, first.name), (7, 2, "chair"))
        self.assertEqual(first.amodal_box, (1, 0, 3, 2))
        self.assertEqual((second.name, second.amodal_box, second.area), ("chair#4", None, 3))

    def test_folder_follows_the_coco_format(self):
        with tempfile.TemporaryDirectory() as place:
            folder = CocoFolder(place)
            folder.add("a", b"PNG", IDS, OBJECTS)
            folder.add("b", b"PNG", np.where(IDS == 7, IDS, 0), OBJECTS)
            folder.write()
            root = Path(place)
            data = json.loads((root / "annotations/instances.json").read_text())
            self.assertEqual([c["name"] for c in data["categories"]], ["chair"])
            self.assertEqual([a["image_id"] for a in data["annotations"]], [1, 1, 2])
            self.assertEqual(len({a["id"] for a in data["annotations"]}), 3)
            for annotation in data["annotations"]:
                mask = from_run_lengths(annotation["segmentation"])
                self.assertEqual(mask.sum(), annotation["area"])
                self.assertEqual(list(box_of(mask)), annotation["bbox"])
            self.assertEqual(data["images"][0]["camera"], OBJECTS["camera"])
            self.assertEqual((root / "images/a.png").read_bytes(), b"PNG")
            panoptic = json.loads((root / "annotations/panoptic.json").read_text())
            for each, kept in zip(panoptic["annotations"], ({7, 300}, {7}), strict=True):
                rows = np.array(png_pixels((root / "panoptic" / each["file_name"]).read_bytes()))
                shown = set(np.unique(rows @ np.array([1, 256, 65536]))) - {0}
                self.assertEqual(shown, kept)
                self.assertEqual({s["id"] for s in each["segments_info"]}, kept)

    def test_folder_holds_further_layers_as_arrays(self):
        with tempfile.TemporaryDirectory() as place:
            folder = CocoFolder(place)
            layers = {"depth": np.full(IDS.shape, 2.5), "normal": np.ones((*IDS.shape, 3)),
                      "motion": np.zeros((*IDS.shape, 2))}
            folder.add("a", b"png", IDS, OBJECTS, layers)
            with self.assertRaises(ValueError):
                folder.add("b", b"png", IDS, OBJECTS, {"depth": np.zeros((1, 1))})
            folder.write()
            data = json.loads((Path(place) / "annotations/instances.json").read_text())
            image = data["images"][0]
            self.assertEqual(set(image["layers"]), set(layers))
            for name, file in image["layers"].items():
                read = np.load(Path(place) / file)
                self.assertEqual(read.dtype, np.float32)
                self.assertTrue(np.array_equal(read, layers[name]))

    def test_panoptic_evaluation_accepts_the_folder(self):
        with tempfile.TemporaryDirectory() as place:
            for name, ids in (("true", IDS), ("spoilt", np.where(IDS == 7, 0, IDS))):
                folder = CocoFolder(Path(place) / name)
                # For whole segments; the second image has no annotation where nothing is visible.
                folder.add("a", b"PNG", ids, OBJECTS)
                folder.write()
            truth = Path(place) / "true"

            def quality(other):
                return pq_compute(
                    truth / "annotations/panoptic.json", other / "annotations/panoptic.json",
                    truth / "panoptic", other / "panoptic",
                )["All"]["pq"]  # fmt: skip

            self.assertEqual(quality(truth), 1)
            self.assertLess(quality(Path(place) / "spoilt"), 1)
            # Segments with missing pixels are refused.
            broken = Path(place) / "broken"
            shutil.copytree(truth, broken)
            shutil.copy(Path(place) / "spoilt/panoptic/a.png", broken / "panoptic/a.png")
            with self.assertRaises(Exception):
                quality(broken)

    def test_category_may_exclude_segments(self):
        with tempfile.TemporaryDirectory() as place:
            folder = CocoFolder(place, lambda s: None if s.id == 7 else "seat")
            self.assertEqual([s.id for s in folder.add("a", b"", IDS, OBJECTS)], [300])
