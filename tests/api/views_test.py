"""Cameras of all types with their intrinsics, motion vectors, and multi-part EXR."""

import math
import struct

from harness import ApiTest, job_body
from moving import moving_triangles

EYE, TARGET = [1.0, 2.0, 6.0], [0.5, 0.0, -1.0]


def looking(camera_type, **more):
    return {"type": camera_type, "position": EYE, "target": TARGET, **more}


def unit(v):
    size = math.sqrt(sum(x * x for x in v))
    return [x / size for x in v]


def cross(a, b):
    return [a[(i + 1) % 3] * b[(i + 2) % 3] - a[(i + 2) % 3] * b[(i + 1) % 3] for i in range(3)]


def expected_pose():
    """Rows of the world-to-camera matrix in OpenCV's convention: x to the right, y down, z ahead.
    """
    ahead = unit([t - e for t, e in zip(TARGET, EYE, strict=True)])
    right = unit(cross(ahead, [0, 1, 0]))
    down = cross(ahead, right)
    return [[*axis, -sum(a * e for a, e in zip(axis, EYE, strict=True))]
            for axis in (right, down, ahead)]  # fmt: skip


def seen_at(camera, point):
    """Projects a point to a pixel as documented for GET objects."""
    m = camera["world_to_camera"]
    x, y, z = (sum(m[4 * r + i] * point[i] for i in range(3)) + m[4 * r + 3] for r in range(3))
    if camera["type"] == "perspective":
        x, y = x / z, y / z
    elif camera["type"] == "panorama":
        x, y = math.atan2(x, z), math.atan2(y, math.hypot(x, z))
    return camera["cx"] + camera["fx"] * x, camera["cy"] + camera["fy"] * y


class Views(ApiTest):
    def path(self, job, rest):
        return f"/v1/jobs/{job['id']}/{rest}"

    def request(self, camera, layers, samples=2, **members):
        wanted = job_body(samples=samples, camera=camera, **members)
        wanted.setdefault("scene", "cornell-box")
        wanted["film"] = {"width": 64, "height": 32, "layers": layers}
        return wanted

    def upload(self, content):
        answer = self.server.post(
            "/v1/scenes", content, headers={"Content-Type": "model/gltf-binary"}
        )
        self.assertIn(answer.status, (200, 201), answer)
        return answer.json()["id"]

    def test_known_points_project_according_to_the_intrinsics(self):
        focal = 16 / math.tan(math.radians(20))
        scene = self.upload(moving_triangles())
        for camera, scale in (
            (looking("perspective", vertical_fov_degrees=40), [focal, focal]),
            (looking("orthographic", orthographic_height=4), [8, 8]),
            (looking("panorama"), [32 / math.pi, 32 / math.pi]),
        ):
            job = self.server.render(self.request(camera, ["object", "position"], scene=scene))
            told = self.server.get(self.path(job, "objects")).json()["camera"]
            self.assertEqual(told["type"], camera["type"])
            self.assertEqual((told["cx"], told["cy"]), (32, 16))
            self.assert_close(told["fx"], scale[0], 1e-4)
            self.assert_close(told["fy"], scale[1], 1e-4)
            for r, row in enumerate(expected_pose()):
                for c in range(4):
                    self.assert_close(told["world_to_camera"][4 * r + c], row[c], 1e-5)
            self.assertEqual(told["world_to_camera"][12:], [0, 0, 0, 1])
            seen = 0
            for x in range(20, 44):
                for y in range(4, 28):
                    layers = self.server.get(self.path(job, f"pixels/{x}/{y}")).json()["layers"]
                    if layers["object"]["mean"][0] == 0:
                        continue
                    seen += 1
                    px, py = seen_at(told, layers["position"]["mean"])
                    self.assert_close(px, x + 0.5, 2e-3)
                    self.assert_close(py, y + 0.5, 2e-3)
            self.assertGreater(seen, 3, camera["type"])

    def test_refuses_options_that_a_camera_does_not_use(self):
        for camera, where in (
            (looking("panorama", vertical_fov_degrees=40), "/camera/vertical_fov_degrees"),
            (looking("panorama", aperture_radius=0.1), "/camera/aperture_radius"),
            (looking("orthographic", vertical_fov_degrees=40), "/camera/vertical_fov_degrees"),
            (looking("perspective", orthographic_height=2), "/camera/orthographic_height"),
            ({"orthographic_height": 2}, "/camera/orthographic_height"),
            (looking("fisheye"), "/camera/type"),
        ):
            answer = self.server.post("/v1/jobs", self.request(camera, []))
            self.assert_problem(answer, 422, where)
        for integrator in ("bdpt", "light-trace", "mlt"):
            answer = self.server.post(
                "/v1/jobs",
                self.request(looking("panorama"), [], integrator={"type": integrator}),
            )
            self.assert_problem(answer, 422, "/camera/type")

    def test_panorama_along_x_shows_the_environment(self):
        # Above the horizon the sky is white, below it black: u is measured from the centre, +x.
        job = self.server.render(
            self.request(
                {"type": "panorama", "position": [99, 0, 0], "target": [100, 0, 0]}, ["position"], 4
            )
        )
        # The box is behind, at the seam.
        edge = self.server.get(self.path(job, "pixels/0/16")).json()["layers"]["position"]["mean"]
        self.assertLess(abs(edge[0]), 2)
        middle = self.server.get(self.path(job, "pixels/32/16")).json()["layers"]
        self.assertEqual(middle["position"]["mean"], [0, 0, 0])

    def test_motion_is_that_of_objects_and_of_the_file_camera(self):
        scene = self.upload(moving_triangles())
        job = self.server.render(
            {**self.request({}, ["object", "position", "motion"]), "scene": scene,
             "time_seconds": 0.25, "motion_seconds": 0.5}
        )  # fmt: skip
        self.assertEqual(job["spec"]["motion_seconds"], 0.5)
        seen = {2: 0, 3: 0, 0: 0}
        for x in range(0, 64, 3):
            for y in range(0, 32, 3):
                layers = self.server.get(self.path(job, f"pixels/{x}/{y}")).json()["layers"]
                number = int(layers["object"]["mean"][0])
                seen[number] += 1
                motion = layers["motion"]["mean"]
                if number == 0:
                    self.assertEqual(motion, [0, 0, 0])
                    continue
                p = layers["position"]["mean"]
                away = 5 - p[2]
                # The focal length equals the height; the camera moves left by half of 0.5.
                moved = [0.25 + (0.5 if number == 2 else 0), 1.0 if number == 2 else 0]
                for i in range(2):
                    self.assert_close(motion[i], 32 * moved[i] / away, 1e-3)
                self.assertEqual(motion[2], 0)
        self.assertGreater(min(seen.values()), 5)

    def test_second_time_is_a_frame_later_and_the_rest_pose_does_not_move(self):
        scene = self.upload(moving_triangles())
        film = {**self.request({}, ["motion"]), "scene": scene}
        job = self.server.render(film)
        self.assert_close(job["spec"]["motion_seconds"], 1 / 24, 1e-12)
        path = self.path(job, "pixels/32/16")
        motion = self.server.get(path).json()["layers"]["motion"]["mean"]
        self.assert_close(motion[0], 32 * 1.5 / 24 / 5, 1e-3)
        rest = self.server.render({**film, "time_seconds": None})
        self.assertTrue(any("rest pose" in text for text in rest["warnings"]))
        path = self.path(rest, "pixels/32/16")
        self.assertEqual(self.server.get(path).json()["layers"]["motion"]["mean"], [0, 0, 0])
        idle = self.server.render(
            {**self.request({}, []), "scene": scene, "motion_seconds": 0.5}
        )
        self.assertTrue(any("motion_seconds" in text for text in idle["warnings"]))

    def test_open_shutter_blurs_moving_objects(self):
        scene = self.upload(moving_triangles())
        request = {**self.request({}, []), "scene": scene, "stop": {"samples_per_pixel": 64}}
        still = self.server.render(request)
        shut = self.server.render({**request, "shutter_seconds": 0})
        opened = self.server.render({**request, "shutter_seconds": 1})
        self.assertNotIn("shutter_seconds", shut["spec"])
        self.assertEqual(opened["spec"]["shutter_seconds"], 1)
        images = [
            self.server.get(self.path(job, "image.hdr")).body for job in (still, shut, opened)
        ]
        self.assertEqual(images[0], images[1])
        self.assertNotEqual(images[0], images[2])
        refused = self.server.post(
            "/v1/jobs", {**request, "shutter_seconds": 1, "integrator": {"type": "mlt"}}
        )
        self.assert_problem(refused, 422, "/shutter_seconds")

    def test_object_list_is_reproducible(self):
        job = self.server.render(self.request(looking("perspective"), ["instance"]))
        first = self.server.get(self.path(job, "objects")).json()
        self.assertEqual(self.server.get(self.path(job, "objects")).json(), first)
        aside = self.server.render(
            self.request({**looking("perspective"), "position": [2, 2, 6]}, ["instance"])
        )
        other = self.server.get(self.path(aside, "objects")).json()
        self.assertNotEqual(other["objects"][0]["amodal"], first["objects"][0]["amodal"])

    def test_only_an_exr_of_all_layers_has_parts(self):
        job = self.server.render(self.request({}, ["depth", "object"]))
        for query in ("image.png?parts=1", "image.exr?parts=1&layer=depth"):
            self.assert_problem(self.server.get(self.path(job, query)), 422, "/parts")
        whole = self.server.get(self.path(job, "image.exr")).body
        parts = self.server.get(self.path(job, "image.exr?parts=1")).body
        multi_part = 0x1000  # of the version field: the OpenEXR file layout
        self.assertEqual(struct.unpack_from("<I", whole, 4)[0] & multi_part, 0)
        self.assertEqual(struct.unpack_from("<I", parts, 4)[0] & multi_part, multi_part)
