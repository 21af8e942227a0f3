"""Labelled images: masks, boxes, and COCO JSON, from the id layers of a job.

    job = client.submit("glass", layers=["instance"], samples_per_pixel=64).wait()
    folder = CocoFolder("out")
    folder.add("glass", job.picture(), job.image("instance"), job.objects())
    folder.write()

For whole films only: with a crop, boxes refer to the full film, but the image to the crop.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import models
from .png import encode_png

Mask = npt.NDArray[np.bool_]
Ids = npt.NDArray[np.uint32]
Box = tuple[float, float, float, float]


def ids_of(image: npt.ArrayLike) -> Ids:
    """Converts a layer of ids, as returned by Job.image(), to integers."""
    values = np.asarray(image)
    whole = values.astype(np.uint32)
    if values.ndim != 2 or not np.array_equal(whole, values):
        raise ValueError("not a layer of ids: use object, instance, material or primitive")
    return whole


def masks(ids: npt.ArrayLike) -> dict[int, Mask]:
    """Returns the mask of each id, except 0, which marks empty pixels."""
    whole = ids_of(ids)
    return {int(i): whole == i for i in np.unique(whole) if i != 0}


def box_of(mask: Mask) -> Box:
    """Returns x, y, width, height in pixels. The mask must not be empty."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x, y = int(columns[0]), int(rows[0])
    return (x, y, int(columns[-1]) - x + 1, int(rows[-1]) - y + 1)


def run_lengths(mask: Mask) -> dict[str, Any]:
    """Returns COCO's uncompressed RLE: column by column, runs of 0 and 1 in turn, 0 first."""
    flat = np.concatenate(([False], mask.T.ravel()))
    ends = np.flatnonzero(flat[1:] != flat[:-1])
    counts = np.diff(np.concatenate(([0], ends, [mask.size])))
    return {"size": list(mask.shape), "counts": [int(count) for count in counts]}


def panoptic_png(ids: npt.ArrayLike) -> bytes:
    """Encodes COCO's image of segments: id = R + 256 G + 256^2 B."""
    whole = ids_of(ids)
    return encode_png(
        np.stack([(whole >> shift & 255).astype(np.uint8) for shift in (0, 8, 16)], axis=2)
    )


@dataclass(frozen=True)
class Segment:
    """An instance that is visible in an image."""

    id: int  # of the layer instance
    object: int
    name: str
    mask: Mask
    box: Box
    amodal_box: Box | None  # of its part within the film, hidden or not

    @property
    def area(self) -> int:
        return int(self.mask.sum())


def segments(ids: npt.ArrayLike, objects: models.SceneObjects) -> list[Segment]:
    """Returns the visible instances. ids: the layer instance. objects: of Job.objects()."""
    instances = {each["id"]: each for each in objects["instances"]}
    names = {each["id"]: each["name"] for each in objects["objects"]}
    found = []
    for number, mask in masks(ids).items():
        instance = instances[number]
        amodal = instance["amodal"]
        found.append(
            Segment(
                id=number,
                object=instance["object"],
                name=names[instance["object"]],
                mask=mask,
                box=box_of(mask),
                amodal_box=None
                if amodal is None
                else (amodal["x"], amodal["y"], amodal["width"], amodal["height"]),
            )
        )
    return found


def name_without_number(segment: Segment) -> str:
    """Returns the object's name without the suffix that makes it unique."""
    return segment.name.split("#")[0]


class CocoFolder:
    """Images and their labels in COCO's format: detection with masks, and panoptic.

    images/NAME.png, panoptic/NAME.png, annotations/instances.json, annotations/panoptic.json, and
    NAME.npy in a folder for each further layer, such as depth/NAME.npy. In addition to COCO's
    members, annotations have `amodal_bbox` and `instance_id`, images `camera` (intrinsics and pose)
    and `layers` (the paths of those files, by layer).
    """

    def __init__(
        self,
        folder: str | PathLike[str],
        category: Callable[[Segment], str | None] = name_without_number,
    ) -> None:
        """category: returns the category of a segment; None omits it."""
        self.folder = Path(folder)
        self._category = category
        self._categories: dict[str, int] = {}
        self._images: list[dict[str, Any]] = []
        self._annotations: list[dict[str, Any]] = []
        self._panoptic: list[dict[str, Any]] = []
        for name in ("images", "panoptic", "annotations"):
            (self.folder / name).mkdir(parents=True, exist_ok=True)

    def add(
        self, name: str, picture: bytes, ids: npt.ArrayLike, objects: models.SceneObjects,
        layers: Mapping[str, npt.ArrayLike] | None = None,
    ) -> list[Segment]:  # fmt: skip
        """Adds an image and returns its segments.

        name: of its files. picture: a PNG. ids: the layer instance. layers: further ones by name,
        as returned by Job.image(): depth [m], normal, motion [pixels]; written as float32.
        """
        whole = ids_of(ids)
        planes = {layer: np.asarray(values, np.float32) for layer, values in (layers or {}).items()}
        for layer, values in planes.items():
            if values.shape[:2] != whole.shape:
                raise ValueError(f"{layer} is {values.shape[:2]}, the image {whole.shape}")
        image = len(self._images) + 1
        kept, infos = [], []
        panoptic = np.zeros_like(whole)
        for segment in segments(whole, objects):
            category = self._category(segment)
            if category is None:
                continue
            number = self._categories.setdefault(category, len(self._categories) + 1)
            common = {
                "category_id": number,
                "bbox": list(segment.box),
                "area": segment.area,
                "iscrowd": 0,
            }
            self._annotations.append(
                {
                    "id": len(self._annotations) + 1,
                    "image_id": image,
                    **common,
                    "segmentation": run_lengths(segment.mask),
                    "amodal_bbox": None if segment.amodal_box is None else list(segment.amodal_box),
                    "instance_id": segment.id,
                }
            )
            infos.append({"id": segment.id, **common})
            panoptic[segment.mask] = segment.id
            kept.append(segment)
        file = f"{name}.png"
        (self.folder / "images" / file).write_bytes(picture)
        (self.folder / "panoptic" / file).write_bytes(panoptic_png(panoptic))
        for layer, values in planes.items():
            (self.folder / layer).mkdir(exist_ok=True)
            np.save(self.folder / layer / f"{name}.npy", values)
        self._images.append(
            {
                "id": image,
                "file_name": file,
                "width": int(whole.shape[1]),
                "height": int(whole.shape[0]),
                "camera": objects["camera"],
                "layers": {layer: f"{layer}/{name}.npy" for layer in planes},
            }
        )
        self._panoptic.append({"image_id": image, "file_name": file, "segments_info": infos})
        return kept

    def write(self) -> None:
        """Writes the JSON of everything that was added."""
        categories: list[Mapping[str, Any]] = [
            {"id": number, "name": name, "supercategory": "object", "isthing": 1}
            for name, number in self._categories.items()
        ]
        parts = {"instances": self._annotations, "panoptic": self._panoptic}
        for name, found in parts.items():
            data = {
                "info": {"description": "Rendered by Tessera"},
                "images": self._images,
                "annotations": found,
                "categories": categories,
            }
            (self.folder / "annotations" / f"{name}.json").write_text(json.dumps(data))
