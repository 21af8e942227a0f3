"""The pure functions of the benchmark against other engines: statistics, glTF, table and chart."""

import copy
import json
import math
import os
import random
import struct
import sys
import tempfile
import unittest
import xml.etree.ElementTree as xml

import numpy as np

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, os.path.join(os.path.dirname(HERE), "bench", "peers"))

import gltf  # noqa: E402
import measures  # noqa: E402
import report  # noqa: E402
import scenes  # noqa: E402


class Intervals(unittest.TestCase):
    def test_interval_of_three_numbers_is_students(self):
        # Mean 2, standard deviation 1, t = 4.303: 4.303 / sqrt(3).
        mean, half = measures.interval([1, 2, 3])
        self.assertEqual(mean, 2)
        self.assertAlmostEqual(half, 2.4843, places=3)

    def test_one_number_has_no_interval(self):
        mean, half = measures.interval([5])
        self.assertEqual(mean, 5)
        self.assertTrue(math.isnan(half))

    def test_intervals_contain_the_mean_in_95_of_100_cases(self):
        numbers = random.Random(3)
        rounds = 4000
        held = 0
        for _ in range(rounds):
            mean, half = measures.interval([numbers.gauss(7, 2) for _ in range(4)])
            held += abs(mean - 7) <= half
        # Five standard deviations of a fraction of 0.95 over 4000 rounds: 0.017.
        self.assertAlmostEqual(held / rounds, 0.95, delta=0.017)

    def test_ratio_is_computed_pair_by_pair(self):
        ratio, low, high = measures.ratio_interval([2, 20, 200], [1, 10, 100])
        self.assertAlmostEqual(ratio, 2)
        self.assertAlmostEqual(low, 2)
        self.assertAlmostEqual(high, 2)

    def test_interval_of_the_inverse_ratio_is_the_inverse(self):
        a, b = [3.0, 4.0, 6.0], [1.0, 2.5, 2.0]
        ratio, low, high = measures.ratio_interval(a, b)
        other, other_low, other_high = measures.ratio_interval(b, a)
        self.assertAlmostEqual(ratio * other, 1)
        self.assertAlmostEqual(low * other_high, 1)
        self.assertAlmostEqual(high * other_low, 1)

    def test_ratio_of_a_value_not_above_0_is_unknown(self):
        self.assertTrue(math.isnan(measures.ratio_interval([1, 2], [0, 1])[0]))


class Errors(unittest.TestCase):
    def setUp(self):
        self.numbers = np.random.default_rng(2)
        self.truth = self.numbers.uniform(0.2, 2, (64, 64, 3))

    def noisy(self, sigma):
        return self.truth + self.numbers.normal(0, sigma, self.truth.shape)

    def expected(self, sigma):
        return float((sigma ** 2 / (self.truth ** 2 + 0.01)).mean())

    def test_subtracts_the_noise_of_the_reference(self):
        reference = measures.Reference([self.noisy(0.1) for _ in range(8)])
        errors = [
            measures.relative_mse(reference.pixel_errors(self.noisy(0.05), self.truth))
            for _ in range(8)
        ]
        # Its own noise contributes half of the measurement: 0.1^2 / 8 against 0.05^2.
        self.assertAlmostEqual(np.mean(errors) / self.expected(0.05), 1, delta=0.05)

    def test_trimming_drops_the_worst_pixel_in_a_thousand(self):
        errors = np.ones(2000)
        errors[[3, 1999]] = 1e6
        self.assertEqual(measures.without_worst(errors), 1)
        errors[7] = 1e6
        self.assertGreater(measures.without_worst(errors), 1)

    def test_references_of_one_image_do_not_differ_beyond_their_noise(self):
        a, b = (measures.Reference([self.noisy(0.1) for _ in range(4)]) for _ in range(2))
        difference, doubt = measures.difference(a, b)
        self.assertLess(abs(difference), 5 * doubt)

    def test_detects_an_image_a_twentieth_brighter(self):
        a = measures.Reference([self.noisy(0.02) for _ in range(4)])
        b = measures.Reference([self.noisy(0.02) * 1.05 for _ in range(4)])
        difference, doubt = measures.difference(b, a)
        self.assertGreater(difference, 10 * doubt)
        self.assertAlmostEqual(difference, 0.05 ** 2, delta=0.0004)

    def test_common_reference_is_of_a_peer_that_agrees_with_others(self):
        truth = [self.noisy(0.02) for _ in range(9)]
        off = [picture * 1.3 for picture in truth[:3]]
        references = {
            "off": measures.Reference(off),
            "tessera": measures.Reference(truth[3:6]),
            "right": measures.Reference(truth[6:]),
        }
        self.assertEqual(measures.most_agreed(references), "right")
        self.assertEqual(measures.most_agreed({"tessera": references["tessera"]}), "tessera")
        self.assertIsNone(measures.most_agreed({}))

    def test_reference_does_not_differ_from_itself(self):
        a = measures.Reference([self.noisy(0.1) for _ in range(2)])
        self.assertEqual(measures.difference(a, a), (0.0, 0.0))

    def test_twice_the_samples_in_twice_the_time_are_as_efficient(self):
        self.assertEqual(measures.efficiency(0.5, 4, 2), measures.efficiency(0.25, 8, 2))
        self.assertEqual(measures.efficiency(0.5, 4, 2), 1)


class Files(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.folder = folder.name

    def path(self, name):
        return os.path.join(self.folder, name)

    def test_reads_back_a_generated_scene(self):
        builder = scenes.Builder()
        lamp = builder.material((0.2, 0.3, 0.4), specular=0, emission=(4, 8, 2))
        mesh = builder.mesh(scenes.quad((0, 0, 0), (2, 0, 0), (0, 3, 0), lamp))
        builder.node(mesh, translation=[5, 6, 7], scale=[2, 2, 2])
        scene = gltf.read(builder.save(self.path("a.glb"), (0, 0, 4), (0, 0, 0), 0.5))
        (primitive,) = scene.meshes[0]
        np.testing.assert_array_equal(
            primitive.positions, [[0, 0, 0], [2, 0, 0], [2, 3, 0], [0, 3, 0]]
        )
        np.testing.assert_array_equal(primitive.normals, [[0, 0, 1]] * 4)
        np.testing.assert_allclose(scene.materials[primitive.material].emission, (4, 8, 2))
        self.assertTrue(scene.materials[primitive.material].is_lambertian)
        (_, matrix), = scene.instances
        np.testing.assert_allclose(matrix @ [1, 1, 1, 1], [7, 8, 9, 1])
        np.testing.assert_allclose(
            scene.camera, [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 4], [0, 0, 0, 1]]
        )
        self.assertEqual(scene.vertical_fov, 0.5)

    def test_children_are_positioned_by_their_parents(self):
        half = math.sqrt(0.5)
        document = {
            "nodes": [
                {"children": [1], "rotation": [0, half, 0, half]},
                {"translation": [1, 0, 0]},
            ],
            "scenes": [{"nodes": [0]}],
        }
        matrices = [matrix for _, matrix in gltf.placed(document)]
        # A quarter turn about y maps +x to -z.
        np.testing.assert_allclose(matrices[1][:3, 3], [0, 0, -1], atol=1e-12)

    def test_balls_and_grids_face_outwards(self):
        for positions, normals, _, triangles, _ in (scenes.ball(0), scenes.ball(0, 24, 12)):
            a, b, c = (positions[triangles[:, i]] for i in range(3))
            faces = np.cross(b - a, c - a)
            self.assertTrue((np.einsum("ij,ij->i", faces, a + b + c) > 0).all())
            np.testing.assert_allclose(np.linalg.norm(normals, axis=1), 1)

    def test_file_without_a_camera_gets_one_that_sees_all_of_it(self):
        builder = scenes.Builder()
        builder.node(
            builder.mesh(
                scenes.quad((-1, -1, 0), (2, 0, 0), (0, 2, 0), builder.material((1, 1, 1)))
            )
        )
        plain = self.path("plain.glb")
        with open(plain, "wb") as file:
            file.write(gltf.write_glb(builder.document, builder.binary))
        packed = self.path("packed.glb")
        with open(packed, "wb") as file:
            file.write(gltf.pack(plain, 1.0))
        scene = gltf.read(packed)
        corners = np.c_[scene.meshes[0][0].positions, np.ones(4)] @ np.linalg.inv(scene.camera).T
        reach = math.tan(scene.vertical_fov / 2) * -corners[:, 2]
        self.assertTrue((corners[:, 2] < 0).all())
        self.assertTrue((np.abs(corners[:, :2]) < reach[:, None]).all())

    def test_packs_external_files_into_the_glb(self):
        pixels = np.arange(4 * 4 * 3, dtype=np.uint8).reshape(4, 4, 3)
        picture = scenes.write_png(pixels)
        with open(self.path("a b.png"), "wb") as file:
            file.write(picture)
        with open(self.path("a.bin"), "wb") as file:
            file.write(struct.pack("<9f", 0, 0, 0, 1, 0, 0, 0, 1, 0))
        document = {
            "asset": {"version": "2.0"}, "buffers": [{"uri": "a.bin", "byteLength": 36}],
            "bufferViews": [{"buffer": 0, "byteLength": 36}], "images": [{"uri": "a%20b.png"}],
            "accessors": [{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 3,
                           "min": [0, 0, 0], "max": [1, 1, 0]}],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "nodes": [{"mesh": 0}], "scenes": [{"nodes": [0]}]}
        with open(self.path("a.gltf"), "w") as file:
            json.dump(document, file)
        with open(self.path("a.glb"), "wb") as file:
            file.write(gltf.pack(self.path("a.gltf"), 1.0))
        scene = gltf.read(self.path("a.glb"))
        self.assertEqual(scene.images, [picture])
        np.testing.assert_array_equal(
            scene.meshes[0][0].positions, [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
        )

    def test_refuses_unsupported_features_by_name(self):
        builder = scenes.Builder()
        material = builder.material((1, 1, 1))
        builder.document["materials"][material]["extensions"]["KHR_materials_sheen"] = {}
        builder.node(builder.mesh(scenes.quad((0, 0, 0), (1, 0, 0), (0, 1, 0), material)))
        path = builder.save(self.path("sheen.glb"), (0, 0, 4), (0, 0, 0), 0.5)
        with self.assertRaisesRegex(gltf.Unsupported, "KHR_materials_sheen"):
            gltf.read(path)


def engine(cpu, relmse, reference="common"):
    rows = [
        {"cpu": c, "wall": c / 2, "rays": None, "relmse": relmse, "relmse_trimmed": relmse / 2}
        for c in cpu
    ]
    return {
        "version": "1",
        "start": 0.5,
        "peak_bytes": 3e8,
        "brightness": [0.5, 0.001],
        "difference": 0.0,
        "reference": reference,
        "runs": {16: rows, 64: copy.deepcopy(rows), 256: copy.deepcopy(rows)},
    }


def document():
    return {
        "size": [256, 256],
        "threads": 2,
        "samples": [16, 64, 256],
        "repeats": 3,
        "reference": [4, 64],
        "scenes": [
            {
                "name": "<box>",
                "common": "slow & old",
                "left_out": {"gone": "no wheel"},
                "engines": {
                    "tessera": engine([1, 2, 4], 0.01),
                    "slow & old": engine([4, 8, 16], 0.01),
                },
            }
        ],
    }


class Reports(unittest.TestCase):
    def test_peer_of_four_times_the_time_has_a_quarter_of_the_efficiency(self):
        data = document()
        ratio, low, high = report.ratios(data, data["scenes"][0], "slow & old")
        self.assertAlmostEqual(ratio, 0.25)
        self.assertAlmostEqual(low, 0.25)
        self.assertAlmostEqual(high, 0.25)

    def test_tables_show_values_their_reference_and_missing_engines(self):
        data = document()
        text = report.scene_table(data, data["scenes"][0])
        self.assertIn("0.25 [0.25, 0.25]", text)
        self.assertIn("common reference: slow & old, 4 renders of 64 samples", text)
        self.assertIn("left out: gone: no wheel", text)
        self.assertRegex(report.summary(data), r"<box> +0\.25 \(0\.25\)")

    def test_stored_results_give_the_same_tables(self):
        data = document()
        again = json.loads(json.dumps(data))
        self.assertEqual(
            report.scene_table(data, data["scenes"][0]),
            report.scene_table(again, again["scenes"][0]),
        )

    def test_compares_at_64_samples_or_the_most_below(self):
        data = document()
        self.assertEqual(report.compared(data), 64)
        self.assertEqual(report.compared(data | {"samples": [4, 16]}), 16)
        self.assertEqual(report.compared(data | {"samples": [128, 256]}), 128)

    def test_error_below_the_noise_of_its_reference_gives_no_ratio(self):
        data = document()
        for row in data["scenes"][0]["engines"]["slow & old"]["runs"][64]:
            row["relmse"] = -1e-6
        self.assertIsNone(report.ratios(data, data["scenes"][0], "slow & old"))
        self.assertIn("slow & old", report.scene_table(data, data["scenes"][0]))

    def test_chart_is_xml_with_a_bar_to_the_right_if_tessera_is_better(self):
        root = xml.fromstring(report.svg(document()))
        space = "{http://www.w3.org/2000/svg}"
        texts = [text.text for text in root.iter(space + "text")]
        self.assertIn("<box>", texts)
        (bar,) = (r for r in root.iter(space + "rect") if r.find(space + "title") is not None)
        (one,) = (line for line in root.iter(space + "line") if line.get("stroke") == "#333")
        self.assertEqual(bar.get("x"), one.get("x1"))
        self.assertTrue(bar.find(space + "title").text.startswith("slow & old: 4.00"))

    def test_numbers_are_short(self):
        self.assertEqual([report.short(v) for v in (0, 0.00123, 12.34, 1234567, 1.234e-6, None)],
                         ["0", "0.00123", "12.3", "1.23M", "1.23e-06", "-"])
