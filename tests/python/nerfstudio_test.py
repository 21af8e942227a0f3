"""Data sets for nerfstudio, read as its own parser reads them; views; rooms; going on."""

import json
import os
import random
import subprocess
import sys
import tempfile
from pathlib import Path

import cv2
import numpy as np
from plyfile import PlyData
from support import REPOSITORY, ServerTest
from tessera_render import CocoFolder, NerfstudioFolder, views

EXAMPLES = Path(REPOSITORY, "clients/examples")
sys.path.insert(0, str(EXAMPLES))
import rooms  # noqa: E402

LAYERS = ("beauty", "position", "z_depth")
LENS = {"type": "pinhole", "fx": 70.5, "fy": 68, "cx": 41, "cy": 29,
        "distortion": {"model": "opencv", "k": [-0.2, 0.05, 0.001, -0.002, 0.01]},
        "position": [0.25, 0.3, -0.6], "target": [0.28, 0.26, 0.28]}  # fmt: skip


def directions(cameras):
    """Unit vectors from the centre to the cameras, by the definition of orbits."""
    theta, phi = (np.radians([c["orbit"][name] for c in cameras])
                  for name in ("theta_degrees", "phi_degrees"))  # fmt: skip
    return np.stack([np.sin(phi) * np.sin(theta), np.cos(phi), np.sin(phi) * np.cos(theta)], 1)


class Views(ServerTest):
    def test_sphere_is_covered_evenly(self):
        at = directions(views.sphere(196))
        self.assertLess(np.abs(at.mean(axis=0)).max(), 0.01)
        # The second moments of a uniform sphere are 1 / 3.
        np.testing.assert_allclose(at.T @ at / 196, np.eye(3) / 3, atol=0.01)
        nearest = np.sort(np.linalg.norm(at[:, None] - at[None], axis=2), axis=1)[:, 1]
        # Squares of equal area are sqrt(4 pi / 196) wide.
        self.assertGreater(nearest.min(), 0.7 * np.sqrt(4 * np.pi / 196))
        half = directions(views.sphere(50, phi_degrees=(0, 90)))
        self.assertGreater(half[:, 1].min(), 0)

    def test_helix_goes_around(self):
        around = views.helix(8, turns=2, phi_degrees=(90, 30))
        self.assertEqual([c["orbit"]["theta_degrees"] for c in around[:3]], [0, 90, 180])
        self.assertEqual(around[-1]["orbit"]["phi_degrees"], 30)

    def test_path_has_equal_steps(self):
        found = views.path([[0, 1, 0], [3, 1, 0], [3, 1, 1]], [[0, 0, 0]], 9)
        self.assertEqual([c["position"] for c in found[:2]], [[0, 1, 0], [0.5, 1, 0]])
        self.assertEqual(found[-1]["position"], [3, 1, 1])
        self.assertEqual(found[4]["target"], [0, 0, 0])
        with self.assertRaises(ValueError):
            views.path([[0, 1, 0]], [[0, 0, 0]], 3)


class Nerfstudio(ServerTest):
    def setUp(self):
        super().setUp()
        self.folder = Path(tempfile.mkdtemp(prefix="tessera-nerfstudio-"))

    def add(self, folder, name, camera, **more):
        job = self.client.submit(
            "cornell-box", size=(80, 60), camera=camera, samples_per_pixel=4,
            layers=["object", "position", "z_depth"], **more,
        ).wait()  # fmt: skip
        layers = {layer: job.image(layer) for layer in LAYERS}
        folder.add(name, job.picture(), job.image("object"), job.objects(), layers)
        return layers

    def test_depth_and_poses_lead_back_to_the_points(self):
        """As nerfstudio makes rays: pixel centres, OpenCV's distortion, OpenGL's axes."""
        folder = NerfstudioFolder(self.folder)
        seen = {"a": self.add(folder, "a", LENS)}
        seen["b"] = self.add(folder, "b", {**LENS, "position": [0.4, 0.2, -0.5]})
        folder.write()
        data = json.loads((self.folder / "transforms.json").read_text())
        self.assertEqual(data["camera_model"], "OPENCV")
        for name, frame in zip("ab", data["frames"], strict=True):
            depth = cv2.imread(str(self.folder / frame["depth_file_path"]), cv2.IMREAD_ANYDEPTH)
            self.assertEqual(depth.dtype, np.uint16)
            self.assertEqual((frame["w"], frame["h"]), depth.shape[::-1])
            picture = cv2.imread(str(self.folder / frame["file_path"]))
            self.assertEqual(picture.shape[:2], depth.shape)
            rows, columns = np.nonzero(depth)
            self.assertGreater(len(rows), 1000)
            matrix = np.array([[frame["fl_x"], 0, frame["cx"]], [0, frame["fl_y"], frame["cy"]],
                               [0, 0, 1]])  # fmt: skip
            k = np.array([frame[n] for n in ("k1", "k2", "p1", "p2", "k3")])
            pixels = np.stack([columns + 0.5, rows + 0.5], axis=1)
            exact = (cv2.TERM_CRITERIA_COUNT | cv2.TERM_CRITERIA_EPS, 100, 1e-12)
            flat = cv2.undistortPoints(
                pixels.reshape(-1, 1, 2), matrix, k, criteria=exact
            ).reshape(-1, 2)
            ahead = np.stack([flat[:, 0], -flat[:, 1], -np.ones(len(flat))], axis=1)
            pose = np.array(frame["transform_matrix"])
            points = (ahead * depth[rows, columns, None] / 1000) @ pose[:3, :3].T + pose[:3, 3]
            wanted = seen[name]["position"][rows, columns]
            self.assertLess(np.abs(points - wanted).max(), 1e-3)  # half a millimetre, oblique

    def test_points_are_surface_points_with_their_colours(self):
        folder = NerfstudioFolder(self.folder, points_per_view=500)
        layers = self.add(folder, "a", LENS)
        folder.write()
        vertex = PlyData.read(str(self.folder / "points3D.ply"))["vertex"]
        self.assertEqual(len(vertex), 500)
        points = np.stack([vertex[axis] for axis in "xyz"], axis=1)
        position = layers["position"].reshape(-1, 3)
        for point in points[:20]:
            self.assertIn(0, np.abs(position - point).max(axis=1))
        colors = np.stack([vertex[c] for c in ("red", "green", "blue")], axis=1)
        self.assertGreater(len(np.unique(colors, axis=0)), 20)

    def test_goes_on_where_it_was(self):
        one = NerfstudioFolder(self.folder, points_per_view=10)
        self.add(one, "a", LENS)
        one.write()
        again = NerfstudioFolder(self.folder, points_per_view=10)
        self.assertIn("a", again)
        self.assertNotIn("b", again)
        self.add(again, "b", LENS)
        again.write()
        data = json.loads((self.folder / "transforms.json").read_text())
        self.assertEqual([f["file_path"] for f in data["frames"]], ["images/a.png", "images/b.png"])
        self.assertEqual(len(PlyData.read(str(self.folder / "points3D.ply"))["vertex"]), 20)

    def test_refuses_cameras_that_it_cannot_express(self):
        folder = NerfstudioFolder(self.folder)
        rational = {"model": "opencv", "k": [0.1, 0, 0, 0, 0, 0.1, 0, 0]}
        for camera in (
            {"type": "panorama"}, {"type": "orthographic"}, {**LENS, "distortion": rational}
        ):  # fmt: skip
            with self.assertRaises(ValueError):
                self.add(folder, "a", camera)
        self.add(folder, "a", LENS)
        with self.assertRaises(ValueError):
            self.add(folder, "b", {"vertical_fov_degrees": 40})

    def test_rooms_are_seen_from_inside(self):
        content, half = rooms.room(random.Random(3))
        self.assertEqual(content, rooms.room(random.Random(3))[0])
        file = self.folder / "room.glb"
        file.write_bytes(content)
        scene = self.client.upload(str(file), strict=True)
        job = self.client.submit(
            scene, size=(40, 30), layers=["object", "normal"], samples_per_pixel=16,
            camera={"position": [0.8 * half[0], 1.5, 0.8 * half[1]], "target": [0, 0.8, 0],
                    "vertical_fov_degrees": 60},
        ).wait()  # fmt: skip
        self.assertTrue((job.image("object") != 0).all())
        names = {each["name"].split("#")[0] for each in job.objects()["objects"]}
        self.assertLessEqual({"room", "lamp"}, names)
        self.assertTrue(names & {"box", "ball", "column"})
        self.assertGreater(job.image()[..., :3].mean(), 0)


class OneCommand(ServerTest):
    def run_example(self, folder, *arguments, **more):
        return subprocess.Popen(
            [sys.executable, EXAMPLES / "dataset.py", *arguments, "--out", folder],
            env={**os.environ, "TESSERA_SERVER": self.url()}, stdout=subprocess.PIPE, text=True,
        )  # fmt: skip

    def test_goes_on_after_being_killed(self):
        folder = Path(tempfile.mkdtemp(prefix="tessera-dataset-"))
        arguments = ("cornell-box", "--views", "sphere", "--count", "6", "--size", "40x30",
                     "--samples", "2", "--format", "coco,nerfstudio")  # fmt: skip
        first = self.run_example(folder, *arguments)
        first.stdout.readline()  # an image is in the folder
        first.kill()
        first.wait()
        first.stdout.close()
        picture = folder / "images/000000.png"
        made = picture.stat().st_mtime_ns
        second = self.run_example(folder, *arguments)
        told = second.communicate()[0]
        self.assertEqual(second.returncode, 0, told)
        self.assertEqual(picture.stat().st_mtime_ns, made)
        self.assertNotIn("000000:", told)
        data = json.loads((folder / "transforms.json").read_text())
        names = [f"images/{i:06}.png" for i in range(6)]
        self.assertEqual([f["file_path"] for f in data["frames"]], names)
        self.assertTrue(all(f"{i:06}" in CocoFolder(folder) for i in range(6)))
        for layer in ("beauty", "depth", "z_depth", "normal", "position", "motion", "error"):
            for i in range(6):
                self.assertEqual(np.load(folder / layer / f"{i:06}.npy").dtype, np.float32)
        other = self.run_example(folder, *arguments, "--seed", "9")
        other.communicate()
        self.assertNotEqual(other.returncode, 0)

    def test_rooms(self):
        folder = Path(tempfile.mkdtemp(prefix="tessera-rooms-"))
        done = self.run_example(folder, "--views", "rooms", "--count", "5", "--size", "40x30",
                                "--samples", "2")  # fmt: skip
        told = done.communicate()[0]
        self.assertEqual(done.returncode, 0, told)
        data = json.loads((folder / "annotations/instances.json").read_text())
        self.assertEqual(len(data["images"]), 5)
        self.assertIn("room", {each["name"] for each in data["categories"]})
