"""Labelled images, from the layers of jobs: COCO (masks, boxes) and nerfstudio (poses, depth).

    job = client.submit("glass", layers=["instance"], samples_per_pixel=64).wait()
    folder = CocoFolder("out")
    folder.add("glass", job.picture(), job.image("instance"), job.objects())
    folder.write()

Both kinds of folder can be the same one, and are resumed where they were left: a name that is in a
folder need not be rendered again. For whole films only: with a crop, boxes refer to the full film,
but the image to the crop.
"""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from . import models
from .png import encode_png, srgb8

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


def _replace(path: Path, content: bytes) -> None:
    """Writes a file that is never seen half written."""
    part = path.with_name(path.name + ".part")
    part.write_bytes(content)
    os.replace(part, path)


def _write_files(
    folder: Path, name: str, picture: bytes, shape: tuple[int, ...],
    layers: Mapping[str, npt.ArrayLike] | None,
) -> dict[str, str]:  # fmt: skip
    """Writes images/NAME.png and LAYER/NAME.npy; returns the paths of the latter by layer."""
    planes = {layer: np.asarray(values, np.float32) for layer, values in (layers or {}).items()}
    for layer, values in planes.items():
        if values.shape[:2] != shape:
            raise ValueError(f"{layer} is {values.shape[:2]}, the image {shape}")
    (folder / "images").mkdir(parents=True, exist_ok=True)
    (folder / "images" / f"{name}.png").write_bytes(picture)
    for layer, values in planes.items():
        (folder / layer).mkdir(exist_ok=True)
        np.save(folder / layer / f"{name}.npy", values)
    return {layer: f"{layer}/{name}.npy" for layer in planes}


class CocoFolder:
    """Images and their labels in COCO's format: detection with masks, and panoptic.

    images/NAME.png, panoptic/NAME.png, annotations/instances.json, annotations/panoptic.json, and
    NAME.npy in a folder for each further layer, such as depth/NAME.npy. In addition to COCO's
    members, annotations have `amodal_bbox` and `instance_id`, images `camera` (intrinsics and pose)
    and `layers` (the paths of those files, by layer). What an existing folder holds is kept.
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
        if self._file("panoptic").exists():  # the last one that write() writes
            for part, found in (("instances", self._annotations), ("panoptic", self._panoptic)):
                data = json.loads(self._file(part).read_text())
                found.extend(data["annotations"])
            # A later write() may have ended before panoptic.json.
            self._images = data["images"]
            self._categories = {each["name"]: each["id"] for each in data["categories"]}
            known = {image["id"] for image in self._images}
            self._annotations = [each for each in self._annotations if each["image_id"] in known]

    def _file(self, part: str) -> Path:
        return self.folder / "annotations" / f"{part}.json"

    def __contains__(self, name: str) -> bool:
        """Returns whether the folder has this image and its labels."""
        return any(image["file_name"] == f"{name}.png" for image in self._images)

    def add(
        self, name: str, picture: bytes, ids: npt.ArrayLike, objects: models.SceneObjects,
        layers: Mapping[str, npt.ArrayLike] | None = None,
    ) -> list[Segment]:  # fmt: skip
        """Adds an image and returns its segments.

        name: of its files. picture: a PNG. ids: the layer instance. layers: further ones by name,
        as returned by Job.image(): depth [m], normal, motion [pixels]; written as float32.
        """
        whole = ids_of(ids)
        files = _write_files(self.folder, name, picture, whole.shape, layers)
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
        (self.folder / "panoptic" / file).write_bytes(panoptic_png(panoptic))
        self._images.append(
            {
                "id": image,
                "file_name": file,
                "width": int(whole.shape[1]),
                "height": int(whole.shape[0]),
                "camera": objects["camera"],
                "layers": files,
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
            _replace(self._file(name), json.dumps(data).encode())


class NerfstudioFolder:
    """Images with their poses in nerfstudio's format: transforms.json, points3D.ply, images/, and
    depth in depth_mm/ (16-bit PNG in millimetres, nerfstudio's default unit): along the axis, and
    of fisheyes along the ray, as nerfstudio multiplies it by the length of its rays' directions.

    The world is the scene's, y up. Pictures with transparency keep it. What an existing folder
    holds is kept.
    """

    #: Names of coefficients in the order of camera.distortion.k.
    COEFFICIENTS: Mapping[str, tuple[str, ...]] = {
        "none": (),
        "opencv": ("k1", "k2", "p1", "p2", "k3"),
        "fisheye": ("k1", "k2", "k3", "k4"),
    }
    MODELS: Mapping[str, str] = {
        "none": "PINHOLE",
        "opencv": "OPENCV",
        "fisheye": "OPENCV_FISHEYE",
    }
    POINT = np.dtype([("at", "<f4", 3), ("color", "u1", 3)])

    def __init__(self, folder: str | PathLike[str], points_per_view: int = 1000) -> None:
        """points_per_view: surface points that each image adds to points3D.ply."""
        self.folder = Path(folder)
        self._points_per_view = points_per_view
        self._data: dict[str, Any] = {"ply_file_path": "points3D.ply", "frames": []}
        self._points: list[npt.NDArray[Any]] = []
        if self._file.exists():
            self._data = json.loads(self._file.read_text())
            content = (self.folder / "points3D.ply").read_bytes()
            start = content.index(b"end_header\n") + len(b"end_header\n")
            self._points = [np.frombuffer(content[start:], self.POINT)]

    @property
    def _file(self) -> Path:
        return self.folder / "transforms.json"

    def __contains__(self, name: str) -> bool:
        """Returns whether the folder has this image and its pose."""
        return any(frame["file_path"] == f"images/{name}.png" for frame in self._data["frames"])

    def add(
        self, name: str, picture: bytes, ids: npt.ArrayLike, objects: models.SceneObjects,
        layers: Mapping[str, npt.ArrayLike],
    ) -> None:  # fmt: skip
        """Adds an image, as CocoFolder.add(). layers: among them beauty, position, z_depth."""
        camera = objects["camera"]
        distortion = camera["distortion"]
        k = [float(value) for value in distortion["k"]]
        names = self.COEFFICIENTS[distortion["model"]]
        if camera["type"] not in ("perspective", "pinhole"):
            raise ValueError(f"nerfstudio has no {camera['type']} cameras of this kind")
        if any(k[len(names) :]):
            raise ValueError("nerfstudio knows only the coefficients " + ", ".join(names))
        model = self.MODELS[distortion["model"]]
        if self._data.setdefault("camera_model", model) != model:
            raise ValueError(f"the folder's cameras are {self._data['camera_model']}, not {model}")
        shown = ids_of(ids) != 0
        _write_files(self.folder, name, picture, shown.shape, layers)
        depth = np.asarray(layers["z_depth"], float)
        if distortion["model"] == "fisheye":
            eye = np.asarray(camera["to_world"], float)[12:15]
            along = np.linalg.norm(np.asarray(layers["position"], float) - eye, axis=2)
            depth = np.where(shown, along, 0.0)
        depth_mm = np.round(1000 * depth)
        (self.folder / "depth_mm").mkdir(exist_ok=True)
        (self.folder / "depth_mm" / f"{name}.png").write_bytes(
            encode_png(np.clip(depth_mm, 0, 65535).astype(np.uint16))
        )
        self._add_points(shown, layers)
        self._data["frames"].append(
            {
                "file_path": f"images/{name}.png",
                "depth_file_path": f"depth_mm/{name}.png",
                "transform_matrix": np.asarray(camera["to_world"], float).reshape(4, 4).T.tolist(),
                "w": camera["width"],
                "h": camera["height"],
                "fl_x": camera["fx"],
                "fl_y": camera["fy"],
                "cx": camera["cx"],
                "cy": camera["cy"],
                **dict(zip(names, k, strict=False)),
            }
        )

    def _add_points(
        self, shown: npt.NDArray[np.bool_], layers: Mapping[str, npt.ArrayLike]
    ) -> None:
        pixels = np.flatnonzero(shown)
        numbers = np.random.default_rng(len(self._data["frames"]))
        chosen = numbers.permutation(pixels)[: self._points_per_view]
        points = np.zeros(len(chosen), self.POINT)
        points["at"] = np.reshape(np.asarray(layers["position"]), (-1, 3))[chosen]
        beauty = np.asarray(layers["beauty"])
        points["color"] = srgb8(np.reshape(beauty, (-1, beauty.shape[-1]))[chosen, :3])
        self._points.append(points)

    def write(self) -> None:
        """Writes transforms.json and points3D.ply of everything that was added."""
        points = np.concatenate([np.zeros(0, self.POINT), *self._points])
        head = f"ply\nformat binary_little_endian 1.0\nelement vertex {len(points)}\n"
        head += "".join(f"property float {axis}\n" for axis in "xyz")
        head += "".join(f"property uchar {color}\n" for color in ("red", "green", "blue"))
        _replace(self.folder / "points3D.ply", head.encode() + b"end_header\n" + points.tobytes())
        _replace(self._file, json.dumps(self._data, indent=1).encode())
