"""Ids of pixels, the objects they identify, and Cryptomatte."""

import json
import struct
import unittest

from harness import ApiTest, job_body, png_pixels, started

IDS = ["object", "instance", "material", "primitive"]
MATTES = ["cryptomatte:object", "cryptomatte:material"]


def body(layers, samples=4, **members):
    wanted = job_body(samples=samples, **members)
    wanted["scene"] = "cornell-box"
    wanted["film"] = {"width": 48, "height": 40, "layers": layers}
    return wanted


def exr_head(data):
    """Returns channels with their type (0: unsigned integers, 2: floats), and texts, by name: the
    OpenEXR file layout."""
    assert struct.unpack_from("<I", data)[0] == 20000630
    at, channels, texts = 8, {}, {}

    def word(at):
        end = data.index(b"\0", at)
        return data[at:end].decode(), end + 1

    while data[at]:
        name, at = word(at)
        kind, at = word(at)
        (size,) = struct.unpack_from("<I", data, at)
        value = data[at + 4 : at + 4 + size]
        at += 4 + size
        if kind == "string":
            texts[name] = value.decode()
        elif kind == "chlist":
            place = at - size
            while data[place]:
                channel, place = word(place)
                (channels[channel],) = struct.unpack_from("<i", data, place)
                place += 16
    return channels, texts


class Labels(ApiTest):
    def path(self, job, rest):
        return f"/v1/jobs/{job['id']}/{rest}"

    def pixel(self, job, x, y):
        return self.server.get(self.path(job, f"pixels/{x}/{y}")).json()["layers"]

    def test_ids_are_those_of_the_objects(self):
        job = self.server.render(body([*IDS, "position", "uv"]))
        objects = self.server.get(self.path(job, "objects")).json()
        self.assertTrue(objects["has_ids"])
        gltf = self.server.get("/v1/scenes/cornell-box/gltf").body
        (size,) = struct.unpack_from("<I", gltf, 12)
        document = json.loads(gltf[20 : 20 + size])
        for each in objects["objects"]:
            node = document["nodes"][int(each["pointer"].removeprefix("/nodes/"))]
            self.assertEqual(each["id"], document["nodes"].index(node) + 1)
            self.assertIn("mesh", node)
        self.assertEqual(
            len(objects["primitives"]), sum(len(m["primitives"]) for m in document["meshes"])
        )
        camera = objects["camera"]
        seen = 0
        for x in range(2, 48, 9):
            for y in range(2, 40, 9):
                pixel = self.pixel(job, x, y)
                number = int(pixel["object"]["mean"][0])
                if number == 0:
                    continue
                seen += 1
                (found,) = [o for o in objects["objects"] if o["id"] == number]
                box = found["visible"]
                self.assertTrue(box["x"] <= x < box["x"] + box["width"])
                self.assertTrue(box["y"] <= y < box["y"] + box["height"])
                amodal = found["amodal"]
                self.assertLessEqual(amodal["x"], box["x"] + 0.5)
                self.assertGreaterEqual(
                    amodal["x"] + amodal["width"], box["x"] + box["width"] - 0.5
                )
                # Seen by the camera, the position is at the pixel's centre.
                m, p = camera["to_world"], pixel["position"]["mean"]
                away = [p[i] - m[12 + i] for i in range(3)]
                local = [sum(m[4 * c + i] * away[i] for i in range(3)) for c in range(3)]
                self.assert_close(
                    camera["cx"] - camera["fx"] * local[0] / local[2], x + 0.5, 1e-3
                )
                self.assert_close(
                    camera["cy"] + camera["fy"] * local[1] / local[2], y + 0.5, 1e-3
                )
                for i in range(3):
                    self.assertGreaterEqual(p[i], found["bounds"]["min"][i] - 1e-5)
                    self.assertLessEqual(p[i], found["bounds"]["max"][i] + 1e-5)
        self.assertGreater(seen, 10)

    def test_job_without_the_option_has_boxes_but_no_ids(self):
        job = self.server.render(body(["depth"]))
        objects = self.server.get(self.path(job, "objects")).json()
        self.assertFalse(objects["has_ids"])
        self.assertIsNone(objects["objects"][0]["visible"])
        self.assertIsNotNone(objects["objects"][0]["amodal"])
        refused = self.server.get(self.path(job, "image.png?layer=object"))
        self.assert_problem(refused, 422, "/layer")
        unasked = self.server.render(
            {**body([]), "film": {"width": 16, "height": 16}}
        )
        self.assertEqual(unasked["spec"]["film"]["layers"], ["albedo", "normal", "depth"])

    def test_exr_holds_integers_and_the_manifest(self):
        job = self.server.render(body([*IDS, *MATTES]))
        channels, texts = exr_head(self.server.get(self.path(job, "image.exr")).body)
        for name in IDS:
            self.assertEqual(channels[name + ".Y"], 0, name)
        for name in ("CryptoObject", "CryptoMaterial"):
            for layer in range(3):
                for letter in "RGBA":
                    self.assertEqual(channels[f"{name}0{layer}.{letter}"], 2)
            (key,) = [k for k, v in texts.items() if k.endswith("/name") and v == name]
            prefix = key.removesuffix("name")
            self.assertEqual(texts[prefix + "hash"], "MurmurHash3_32")
            self.assertEqual(texts[prefix + "conversion"], "uint32_to_float32")
            manifest = json.loads(texts[prefix + "manifest"])
            self.assertTrue(manifest)
        names = {o["name"] for o in self.server.get(self.path(job, "objects")).json()["objects"]}
        (key,) = [k for k, v in texts.items() if v == "CryptoObject"]
        self.assertEqual(
            set(json.loads(texts[key.removesuffix("name") + "manifest"])), names
        )
        one, _ = exr_head(self.server.get(self.path(job, "image.exr?layer=object")).body)
        self.assertEqual(one, {"Y": 0})

    def test_displays_get_colors_without_averaging(self):
        job = self.server.render(body([*IDS, *MATTES]))
        for layer in IDS + MATTES:
            shown = self.server.get(self.path(job, f"image.png?layer={layer}"))
            self.assertEqual(shown.status, 200, shown)
            colors = {bytes(pixel) for row in png_pixels(shown.body) for pixel in row}
            self.assertGreater(len(colors), 1, layer)
        for query, where in (
            ("image.exr?layer=object&max_size=8", "/max_size"),
            ("image.exr?max_size=8", "/max_size"),
            ("image.hdr?layer=object", "/layer"),
            ("image.tif?layer=cryptomatte:object", "/layer"),
            ("image.png?layer=object&range=auto", "/range"),
        ):
            self.assert_problem(self.server.get(self.path(job, query)), 422, where)

    def test_ids_are_the_same_for_views_and_merges(self):
        replicates = {"type": "sobol", "replicates": 4}
        whole = self.server.render(body([*IDS, *MATTES], 8, sampler=replicates))
        ids = [
            self.server.render(
                body([*IDS, *MATTES], 4, sampler={"type": "sobol", "first_replicate": first})
            )["id"]
            for first in (0, 2)
        ]
        merged = self.server.post("/v1/films/merge", {"films": ids})
        self.assertEqual(merged.status, 201, merged)
        self.assertEqual(merged.json()["film_digest"], whole["film_digest"])

        def told(job):
            objects = self.server.get(self.path(job, "objects")).json()
            return [(o["id"], o["pointer"], o["name"]) for o in objects["objects"]]

        aside = self.server.render(
            {**body(IDS), "camera": {"orbit": {"theta_degrees": 40, "phi_degrees": 60}}}
        )
        self.assertEqual(told(aside), told(whole))


class Restart(unittest.TestCase):
    def test_labels_and_mattes_survive_a_kill(self):
        server = started(self, "--checkpoint", "0.3")
        calm = server.render(body([*IDS, *MATTES], 256))
        job = server.submit(body([*IDS, *MATTES], 256, name="killed"))["id"]
        server.wait_until(job, lambda now: now["progress"]["samples_per_pixel"]["max"] >= 16)
        server.kill()
        server.start(1)
        self.assertEqual(server.wait(job)["film_digest"], calm["film_digest"])
