"""Calibrated cameras against OpenCV: what a pixel's centre shows is projected to that pixel."""

import cv2
import numpy as np
from support import ServerTest
from tessera_render import datasets

WIDTH, HEIGHT = 320, 240
FX, FY, CX, CY = 256.25, 249.5, 165.75, 114.625
OPENCV = [-0.31, 0.14, -0.0008, 0.0017, -0.035]
RATIONAL = [0.3, -0.02, 0.0009, -0.0004, 0.004, 0.45, 0.02, 0.004]
PRISM = [*RATIONAL, 0.003, -0.0012, -0.0021, 0.0017]
FISHEYE = [0.031, -0.012, 0.0045, -0.0007]
# From the camera to the world, OpenCV's axes: before the box, along +z, turned and tilted.
TURN = cv2.Rodrigues(np.array([0.1, -0.12, 0.1]))[0] @ np.diag([-1.0, -1.0, 1.0])
EYE = np.array([0.35, 0.34, -0.25])
# Columns are the axes of the convention in OpenCV's.
AXES = {
    "opencv": np.eye(3),
    "opengl": np.diag([1.0, -1.0, -1.0]),
    "ros": np.array([[0, -1, 0], [0, 0, -1], [1, 0, 0]], float),
}
# Positions of float32 are rounded to 3e-8 m, and so 5e-5 pixels of things that are .2 m away.
TOLERANCE_PX = 1e-4


def pose(convention):
    matrix = np.eye(4)
    matrix[:3, :3] = TURN @ AXES[convention]
    matrix[:3, 3] = EYE
    return {"convention": convention, "matrix": matrix.ravel().tolist()}


def pinhole(model, k, convention="opencv"):
    camera = {"type": "pinhole", "fx": FX, "fy": FY, "cx": CX, "cy": CY, "pose": pose(convention)}
    return {**camera, "distortion": {"model": model, "k": k}} if k else camera


def projected(points, model, k):
    """By OpenCV, in pixels whose first centre is at (0, 0)."""
    rotation = TURN.T
    rvec, tvec = cv2.Rodrigues(rotation)[0], -rotation @ EYE
    matrix = np.array([[FX, 0, CX - 0.5], [0, FY, CY - 0.5], [0, 0, 1]])
    points = np.asarray(points, float).reshape(-1, 1, 3)
    if model == "fisheye":
        return cv2.fisheye.projectPoints(points, rvec, tvec, matrix, np.array(k))[0].reshape(-1, 2)
    return cv2.projectPoints(points, rvec, tvec, matrix, np.array(k or [0.0] * 4))[0].reshape(-1, 2)


class Cameras(ServerTest):
    def seen(self, camera, layers=("object", "position"), **more):
        more.setdefault("samples_per_pixel", 2)
        return self.client.submit(
            "cornell-box", size=(WIDTH, HEIGHT), camera=camera, layers=list(layers), **more
        ).wait()

    def expect_agreement(self, camera, model, k):
        job = self.seen(camera)
        shown = np.asarray(job.image("object")) != 0
        points = np.asarray(job.image("position"), float)[shown]
        rows, columns = np.nonzero(shown)
        self.assertGreater(len(rows), WIDTH * HEIGHT / 2)
        at = projected(points, model, k)
        worst = np.abs(at - np.stack([columns, rows], axis=1)).max()
        self.assertLess(worst, TOLERANCE_PX, (model, k))
        return job

    def test_pixels_are_where_opencv_projects_what_they_show(self):
        for model, k in (
            ("none", []),
            ("opencv", OPENCV[:4]),
            ("opencv", OPENCV),
            ("opencv", RATIONAL),
            ("opencv", PRISM),
            ("fisheye", FISHEYE),
        ):
            job = self.expect_agreement(pinhole(model, k), model, k)
            camera = job.objects()["camera"]
            self.assertEqual(
                [camera[name] for name in ("fx", "fy", "cx", "cy")], [FX, FY, CX, CY]
            )
            self.assertEqual(camera["distortion"], {"model": model, "k": k})

    def test_poses_are_those_of_their_conventions(self):
        for convention in AXES:
            self.expect_agreement(pinhole("opencv", OPENCV, convention), "opencv", OPENCV)

    def test_boxes_of_objects_contain_what_is_seen(self):
        for model, k in (("opencv", OPENCV), ("fisheye", FISHEYE)):
            objects = self.seen(pinhole(model, k)).objects()
            seen = [each for each in objects["objects"] if each["visible"]]
            self.assertGreater(len(seen), 2)
            for each in seen:
                visible, amodal = each["visible"], each["amodal"]
                for axis, side in (("x", "width"), ("y", "height")):
                    # Visible boxes are of whole pixels, half of which may be empty.
                    self.assertGreater(visible[axis], amodal[axis] - 1, each["name"])
                    self.assertLess(
                        visible[axis] + visible[side], amodal[axis] + amodal[side] + 1, each["name"]
                    )

    def test_light_paths_find_the_same_image(self):
        """bdpt connects light paths to the lens: means of 40x40 blocks are those of path."""
        for model, k in (("opencv", OPENCV), ("fisheye", FISHEYE)):
            camera = pinhole(model, k)
            camera |= {name: camera[name] / 2 for name in ("fx", "fy", "cx", "cy")}
            path, bdpt = (
                self.client.submit(
                    "cornell-box", size=(WIDTH // 2, HEIGHT // 2), camera=camera,
                    integrator=name, samples_per_pixel=32,
                ).wait().image()[..., :3].reshape(3, 40, 4, 40, 3).mean(axis=(1, 3))
                for name in ("path", "bdpt")
            )  # fmt: skip
            # 5e4 samples leave a noise of 1 %; a lost Jacobian is 10 % at the border.
            np.testing.assert_allclose(bdpt, path, rtol=0.05, atol=0.01 * path.mean())

    def test_depth_is_along_the_ray_and_z_depth_along_the_axis(self):
        camera = pinhole("opencv", OPENCV)
        job = self.seen(camera, ("object", "position", "depth", "z_depth"), samples_per_pixel=16)
        ids, position = job.image("object"), np.asarray(job.image("position"), float)
        axial = job.image("z_depth")
        shown = ids != 0
        self.assertFalse(axial[~shown].any())
        ahead = TURN[:, 2]  # OpenCV's z
        np.testing.assert_allclose(axial[shown], ((position - EYE) @ ahead)[shown], rtol=1e-5)
        along = np.linalg.norm(position - EYE, axis=2)
        # Within a pixel the depth varies; on the whole it does not.
        np.testing.assert_allclose(
            np.median((job.image("depth") / along)[shown]), 1, rtol=1e-3
        )
        self.assertTrue((axial[shown] < along[shown] + 1e-6).all())
