"""Drake's client (MakeRenderEngineGltfClient) against the server."""

import math
import unittest

import numpy as np
from harness import ApiTest
from pydrake.geometry import (
    Box,
    ClippingRange,
    ColorRenderCamera,
    DepthRange,
    DepthRenderCamera,
    GeometryInstance,
    MakeRenderEngineGltfClient,
    PerceptionProperties,
    RenderCameraCore,
    RenderEngineGltfClientParams,
    RenderLabel,
    Rgba,
    SceneGraph,
    Sphere,
)
from pydrake.math import RigidTransform, RollPitchYaw
from pydrake.systems.framework import DiagramBuilder
from pydrake.systems.sensors import CameraInfo, RgbdSensor

WIDTH, HEIGHT = 320, 240
FX, FY, CX, CY = 260.0, 250.0, 150.5, 110.25
NEAREST, FARTHEST = 0.5, 6.0
CAMERA = RigidTransform(RollPitchYaw(-math.pi / 2 - 0.35, 0, 0), [0.2, -4, 1.8])
BALL, RADIUS = np.array([1.2, 0, 0.4]), 0.4
# Corners of boxes along the axes, and labels; the ball's label takes both bytes.
BOXES = (((-0.5, -0.5, 0), (0.5, 0.5, 1), 7), ((-4, -4, -0.2), (4, 4, 0), 2))
BALL_LABEL = 300


def sensor_of(url, endpoint):
    builder = DiagramBuilder()
    graph = builder.AddSystem(SceneGraph())
    graph.AddRenderer("tessera", MakeRenderEngineGltfClient(
        RenderEngineGltfClientParams(base_url=url, render_endpoint=endpoint)))
    source = graph.RegisterSource("world")

    def add(shape, place, label, colour):
        instance = GeometryInstance(RigidTransform(np.array(place)), shape, f"shape {label}")
        properties = PerceptionProperties()
        properties.AddProperty("phong", "diffuse", Rgba(*colour))
        properties.AddProperty("label", "id", RenderLabel(label))
        instance.set_perception_properties(properties)
        graph.RegisterAnchoredGeometry(source, instance)

    for (low, high, label), colour in zip(BOXES, ((1, 0.2, 0.2, 1), (0.7, 0.7, 0.7, 1))):
        low, high = np.array(low), np.array(high)
        add(Box(*(high - low)), (low + high) / 2, label, colour)
    add(Sphere(RADIUS), BALL, BALL_LABEL, (0.2, 1, 0.2, 1))
    core = RenderCameraCore("tessera", CameraInfo(WIDTH, HEIGHT, FX, FY, CX, CY),
                            ClippingRange(0.1, 20), RigidTransform())
    sensor = builder.AddSystem(RgbdSensor(
        SceneGraph.world_frame_id(), CAMERA, ColorRenderCamera(core, False),
        DepthRenderCamera(core, DepthRange(NEAREST, FARTHEST))))
    builder.Connect(graph.get_query_output_port(), sensor.query_object_input_port())
    diagram = builder.Build()
    context = diagram.CreateDefaultContext()
    return sensor, sensor.GetMyContextFromRoot(context), diagram, context


def truth():
    """Depths and labels of the boxes at pixel centres, and pixels where the ball may be seen."""
    u, v = np.meshgrid(np.arange(WIDTH) + 0.5, np.arange(HEIGHT) + 0.5)
    rays = np.stack([(u - CX) / FX, (v - CY) / FY, np.ones_like(u)], -1)
    rays = rays @ CAMERA.rotation().matrix().T
    eye = CAMERA.translation()
    depth = np.full((HEIGHT, WIDTH), np.inf)
    label = np.full((HEIGHT, WIDTH), int(RenderLabel.kDontCare))
    for low, high, number in BOXES:
        with np.errstate(divide="ignore"):
            a, b = (np.array(low) - eye) / rays, (np.array(high) - eye) / rays
        enters, leaves = np.minimum(a, b).max(-1), np.maximum(a, b).min(-1)
        nearer = (enters <= leaves) & (enters > 0) & (enters < depth)
        depth[nearer], label[nearer] = enters[nearer], number
    # Drake sends a polyhedron inside the sphere.
    to_ball = BALL - eye
    along = (rays @ to_ball) / np.linalg.norm(rays, axis=-1)
    ball = to_ball @ to_ball - along**2 < (1.01 * RADIUS) ** 2
    return depth, label, ball


def edges(label):
    """Pixels beside one of another label, where rounding decides."""
    out = np.zeros(label.shape, bool)
    for axis in (0, 1):
        for step in (1, -1):
            out |= np.roll(label, step, axis) != label
    return out


class Drake(ApiTest):
    FLAGS = ("--drake",)

    @classmethod
    def setUpClass(cls):
        super().setUpClass()
        url = f"http://127.0.0.1:{cls.server.port}"
        cls.sensor, cls.context, *cls.kept = sensor_of(url, "render?samples=16")
        cls.depth, cls.label, cls.ball = truth()
        cls.free = ~edges(cls.label) & ~cls.ball

    def image(self, port):
        return np.array(port.Eval(self.context).data).squeeze()

    def test_depths_are_within_a_tenth_of_a_millimetre(self):
        seen = self.image(self.sensor.depth_image_32F_output_port())
        expected = np.where(self.depth >= FARTHEST, np.inf, self.depth)
        finite = self.free & np.isfinite(expected)
        self.assertLess(np.abs(seen - expected)[finite].max(), 1e-4)
        far = self.free & np.isinf(expected)
        self.assertTrue(np.isinf(seen[far]).all())
        self.assertGreater(finite.sum(), 20_000)
        self.assertGreater(far.sum(), 1_000)

    def test_labels_are_exact(self):
        seen = self.image(self.sensor.label_image_output_port())
        self.assertTrue((seen == self.label)[self.free].all())
        self.assertIn(BALL_LABEL, seen[self.ball])

    def test_colours_show_the_materials(self):
        seen = self.image(self.sensor.color_image_output_port()).astype(float)
        for label, channel in ((7, 0), (BALL_LABEL, 1)):
            where = self.label == 7 if label == 7 else self.ball & ~edges(self.ball)
            mean = seen[where & (self.free | self.ball)][:, :3].mean(0)
            self.assertEqual(int(np.argmax(mean)), channel, mean)


if __name__ == "__main__":
    unittest.main()
