"""Files of other formats: `tessera convert`, and uploads that are converted.

The truths are closed forms: a box of 2 x 3 x 5 in each format, in its unit and axes, has a known
size in metres with y up; colours are known numbers. What needs tessera-convert is skipped where it
was not built, since libassimp is not a build dependency.
"""

import io
import json
import os
import random
import re
import resource
import stat
import struct
import subprocess
import tempfile
import time
import unittest
import zipfile
import zlib
from pathlib import Path

from harness import BINARY, TRIANGLE, ApiTest, glb, started, tessera, triangle_document

HELPER = Path(BINARY).resolve().parent / "tessera-convert"
SIZE = (2, 3, 5)  # along x, y and z of the file
CORNERS = [(x, y, z) for z in (0, SIZE[2]) for y in (0, SIZE[1]) for x in (0, SIZE[0])]
QUADS = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
TRIANGLES = [t for a, b, c, d in QUADS for t in ((a, b, c), (a, c, d))]


def stl_binary():
    rows = [struct.pack("<12fH", 0, 0, 0, *(c for i in t for c in CORNERS[i]), 0)
            for t in TRIANGLES]
    return bytes(80) + struct.pack("<I", len(rows)) + b"".join(rows)


def stl_text():
    facets = "".join(
        "facet normal 0 0 0\nouter loop\n"
        + "".join("vertex {} {} {}\n".format(*CORNERS[i]) for i in t) + "endloop\nendfacet\n"
        for t in TRIANGLES)
    return f"solid box\n{facets}endsolid box\n".encode()


def obj(library="box.mtl"):
    lines = [f"mtllib {library}", *("v {} {} {}".format(*c) for c in CORNERS),
             "vt 0 0", "vt 1 0", "vt 1 1", "vt 0 1"]
    for name, quads in (("red", QUADS[:3]), ("picture", QUADS[3:])):
        lines += [f"usemtl {name}"] + [
            "f " + " ".join(f"{i + 1}/{k + 1}" for k, i in enumerate(q)) for q in quads]
    return ("\n".join(lines) + "\n").encode()


MTL = b"""newmtl red
Kd 0.8 0.1 0.2
Ns 250
d 0.5
newmtl picture
Kd 1 1 1
Ke 0.25 0.5 0
map_Kd -bm 1 wood.png
"""


def ply(extra="", values=lambda i: ""):
    return ("ply\nformat ascii 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
            f"property float z\n{extra}element face 12\nproperty list uchar int vertex_indices\n"
            "end_header\n" + "".join("{} {} {}".format(*c) + values(i) + "\n"
                                     for i, c in enumerate(CORNERS))
            + "".join("3 {} {} {}\n".format(*t) for t in TRIANGLES)).encode()


def coloured_ply():
    return ply("".join(f"property uchar {c}\n" for c in ("red", "green", "blue")),
               lambda _: " 188 55 0")


def threemf(unit="inch", colour="#BC3700", transform="1 0 0 0 1 0 0 0 1 0 0 0",
            path="3D/3dmodel.model", change=lambda model: model.encode()):
    vertices = "".join('<vertex x="{}" y="{}" z="{}"/>'.format(*c) for c in CORNERS)
    triangles = "".join('<triangle v1="{}" v2="{}" v3="{}"/>'.format(*t) for t in TRIANGLES)
    model = (f'<?xml version="1.0" encoding="UTF-8"?><model unit="{unit}" xml:lang="en-US" '
             'xmlns="http://schemas.microsoft.com/3dmanufacturing/core/2015/02"><resources>'
             f'<basematerials id="1"><base name="paint" displaycolor="{colour}"/></basematerials>'
             f'<object id="2" type="model" pid="1" pindex="0"><mesh><vertices>{vertices}</vertices>'
             f"<triangles>{triangles}</triangles></mesh></object></resources>"
             f'<build><item objectid="2" transform="{transform}"/></build></model>')
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("[Content_Types].xml", '<?xml version="1.0"?><Types xmlns="http://schemas.'
                         'openxmlformats.org/package/2006/content-types"><Default Extension="rels" '
                         'ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
                         '<Default Extension="model" ContentType="application/vnd.ms-package.'
                         '3dmanufacturing-3dmodel+xml"/></Types>')
        archive.writestr("_rels/.rels", '<?xml version="1.0"?><Relationships xmlns="http://schemas.'
                         'openxmlformats.org/package/2006/relationships"><Relationship Target='
                         f'"/{path}" Id="rel0" Type="http://schemas.microsoft.com/'
                         '3dmanufacturing/2013/01/3dmodel"/></Relationships>')
        archive.writestr(path, change(model))
    return out.getvalue()


def z_up(scale):
    """The box's size with y up, in metres."""
    return [SIZE[0] * scale, SIZE[2] * scale, SIZE[1] * scale]


Y_UP = list(SIZE)
FILES = {"binary.stl": (stl_binary(), z_up(0.001), "millimetres"),
         "text.stl": (stl_text(), z_up(0.001), "millimetres"),
         "box.obj": (obj(), Y_UP, "metres, y up"),
         "box.ply": (ply(), z_up(1), "metres, z up"),
         "box.3mf": (threemf(), z_up(0.0254), "inch")}


MARK = b"\xef\xbb\xbf"  # of UTF-8
TRIANGLE_OBJ = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n"
# Text that other programs read: name, content, triangles, words of a note.
MENDED = (
    ("comment.obj", TRIANGLE_OBJ + b"f 1 2 3 # a comment\nf 1 2 4#another\n", 2, ""),
    ("indented.obj", b" v 0 0 0\n\tv 1 0 0 # x\n v 0 1 0\n  f 1 2 3\n", 1, ""),
    ("continued.obj", TRIANGLE_OBJ + b"f 1 2 \\\n 3\n", 1, ""),
    ("short.obj", TRIANGLE_OBJ + b"f 1 2\nf 1\nf 1 2 3\n", 1, "three corners are left out: 2"),
    ("mark.obj", MARK + TRIANGLE_OBJ + b"f 2 3 4\n", 1, ""),
    ("wide.obj", (TRIANGLE_OBJ + b"f 1 2 3\n").decode().encode("utf-16"), 1, ""),
    ("mac.obj", (TRIANGLE_OBJ + b"f 1 2 3\nf 1 2 4\n").replace(b"\n", b"\r"), 2, ""),
    ("path.obj", b"# C:\\parts\\\n" + TRIANGLE_OBJ + b"f 1 2 4\n", 1, ""),
    ("zeros.obj", TRIANGLE_OBJ + b"f 01 +2 003\n", 1, ""),
    ("five.obj", b"v 0 0 0 1 1\nv 1 0 0\nv 0 1 0\nvt .5\nvn nan 0 1\nf 1/1/1 2/1/1 3/1/1\n", 1, ""),
    ("lines.obj", TRIANGLE_OBJ + b"p 1\nl 1 2\nf 1 2 3\n", 1, "Lines and points are left out: 2"),
    ("surface.obj", TRIANGLE_OBJ + b"cstype bezier\ndeg 3\nsurf 0 1 0 1 1 2 3 4\nend\nf 1 2 3\n", 1,
     "Curves and free-form surfaces are left out: 1"),
    ("far.obj", TRIANGLE_OBJ + b"vt 0 0\nf 1/1 2/1 3/9\n", 1, "texture coordinates up to 9 of 1"),
    ("BOX.OBJ", obj(), 12, "metres"),
    ("BOX.STL", stl_text(), 12, "millimetres"),
    ("BOX.PLY", ply(), 12, "metres"),
    ("upper.stl", stl_text().upper(), 12, ""),
    ("wide.stl", stl_text().decode().encode("utf-16"), 12, ""),
    ("longer.stl", stl_binary() + b"\xff" * 60, 12, ""),
    ("solid.stl", b"solid" + stl_binary()[5:] + b"\n", 12, ""),
    ("cut.stl", stl_text()[:-12], 12, "does not end in endsolid"),
    ("mark.ply", MARK + ply(), 12, ""),
    ("more.ply", ply().replace(b"\n3 0 2 3\n", b"\n\n3 0 2 3 255 0 0\n"), 12, ""),
    ("edge.ply", ply().replace(b"\n3 0 2 3\n", b"\n2 0 2\n"), 11, "three corners are left out: 1"),
    ("blank.stl", b"\n\n" + stl_text().replace(b"\n", b"\n  \n"), 12, ""),
    ("windows.3mf", threemf().replace(b"3D/3d", b"3D\\3d"), 12, "inch"),
)
BINARY_PLY = (
    b"ply\nformat binary_little_endian 1.0\nelement vertex 8\nproperty float x\nproperty float y\n"
    b"property float z\nelement face 12\nproperty list uchar int vertex_indices\nend_header\n"
    + b"".join(struct.pack("<3f", *c) for c in CORNERS)
    + b"".join(struct.pack("<B3i", 3, *t) for t in TRIANGLES))
NAN = struct.pack("<f", float("nan"))
# Files that are refused, and why.
REFUSED = (
    ("nan.obj", b"v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "line 2: nan is not a finite number"),
    ("inf.obj", b"\n v 0 0 -Inf\nf 1 1 1\n", "line 2: -Inf is not a finite number"),
    ("old.obj", TRIANGLE_OBJ + b"v 1.#QNAN 0 0\nf 1 2 3\n", "line 5: 1.#QNAN is not a finite"),
    ("flat.obj", b"\nv 0 0\n" + TRIANGLE_OBJ + b"f 1 2 3\n", "line 2: v has 2 of 3 numbers"),
    ("word.obj", TRIANGLE_OBJ + b"v 0 one 0\nf 1 2 3\n", "line 5: one is not a number"),
    ("far.obj", TRIANGLE_OBJ + b"f 1 2 3\nf 1 2 9\n", "line 6: there is no vertex 9, only 4"),
    ("back.obj", TRIANGLE_OBJ + b"f -1 -2 -5\n", "line 5: -5 is not a corner"),
    ("zero.obj", TRIANGLE_OBJ + b"f 0 1 2\n", "line 5: 0 is not a corner"),
    ("page.obj", b"<html>Not found</html>", "it has no vertex"),
    ("cut.stl", stl_binary()[:-1], "it ends in triangle 12 of the 12 of a binary STL"),
    ("cut.stl", b"solid" + stl_binary()[5:-1], "it ends in triangle 12 of the 12"),
    ("cut.stl", stl_text()[:150], "vertex has not three numbers"),
    ("word.stl", stl_text().replace(b"2 0 0", b"two 0 0", 1), "line 13: two is not a number"),
    ("none.stl", bytes(84), "it has no triangles"),
    ("nan.stl", stl_text().replace(b"2 0 0", b"NaN 0 0", 1), "line 13: NaN is not a finite number"),
    ("nan.stl", stl_binary()[:146] + NAN + stl_binary()[150:],
     "triangle 2: a coordinate is not a finite number"),
    ("nan.ply", ply().replace(b"\n2 0 0\n", b"\nnan 0 0\n", 1),
     "line 11: a coordinate is not a finite number"),
    ("nan.ply", BINARY_PLY[:-156 - 96] + NAN + BINARY_PLY[-156 - 92:],
     "row 1 of the 8 of element vertex: a coordinate is not a finite number"),
    ("cut.ply", BINARY_PLY[:60], "the file ends before its header does"),
    ("cut.ply", BINARY_PLY[:-156 - 1], "the file ends in row 8 of the 8 of element vertex"),
    ("cut.ply", BINARY_PLY[:-1], "the file ends in row 12 of the 12 of element face"),
    ("cut.ply", ply()[:-10], "the file ends in row 11 of the 12 of element face"),
    ("float.ply", ply().replace(b"list uchar", b"list float"), "has a float for the number"),
    ("axes.ply", ply().replace(b"float x", b"float a"), "its vertices have no x, y and z"),
    ("far.ply", ply()[:-2] + b"8\n", "line 29: a face names vertex 8, counted from 0, of 8"),
    ("far.ply", BINARY_PLY[:-4] + b"\xff\xff\xff\xff",
     "row 12 of the 12 of element face: a face names vertex -1"),
    ("short.ply", ply().replace(b"\n3 0 2 3\n", b"\n3 0 2\n"), "line 18: a face has fewer corners"),
    ("none.ply", ply().replace(b"\n3 0 2 3\n", b"\n0\n"), "line 18: a face has no corners"),
    ("word.ply", ply().replace(b"\n2 0 0\n", b"\n2 zero 0\n"), "line 11: its values are not"),
    ("head.ply", ply().replace(b"list uchar int", b"list uchar"),
     "line 8 of its header is not understood: property list uchar vertex_indices"),
    ("head.ply", ply().replace(b"end_header", b"end_header0"), "line 9 of its header"),
    ("strip.ply", ply().replace(b"element face", b"element tristrips"), "tristrips"),
    ("bare.ply", ply().replace(b"element face", b"element name 9999999999\nelement face"),
     "element name has no properties"),
    ("lines.obj", TRIANGLE_OBJ + b"f 1 2\n", "it has no triangles"),
    ("hidden.3mf", threemf(transform="1 0", path="3D/box.xml"), 'the transform "1 0" is not'),
    ("wide.3mf", threemf(change=lambda m: m.replace("UTF-8", "UTF-16").encode("utf-16")),
     "its model is not in UTF-8"),
    ("parts.3mf", threemf(change=lambda m: m.replace("<item", '<item p:path="/a"').encode()),
     "3MF Production Extension"),
    ("none.3mf", threemf(change=lambda m: b"no XML", path="a.txt"), "it has no 3D model"),
    ("text.3mf", b"hello", "zip archive: too short"),
    ("five.3mf", threemf(transform="1 0 0 0 1"), 'the transform "1 0 0 0 1" is not 12 numbers'),
    ("none.3mf", threemf(transform=""), 'the transform "" is not 12 numbers'),
    ("word.3mf", threemf(transform="1 0 0 0 1 0 0 0 x 0 0 0"), "is not 12 numbers"),
    ("cut.3mf", threemf()[:-1], "the file is cut short"),
    ("moved.3mf", b"PK" + threemf(), "the central directory is cut short"),
)


def png_image(width, height, rgb):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data
                + struct.pack(">I", zlib.crc32(kind + data)))

    rows = zlib.compress((b"\0" + bytes(rgb) * width) * height)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", rows)
            + chunk(b"IEND", b""))


def document_of(data):
    length = struct.unpack("<I", data[12:16])[0]
    return json.loads(data[20:20 + length])


def floats_of(data, accessor):
    document, start = document_of(data), 28 + struct.unpack("<I", data[12:16])[0]
    entry = document["accessors"][accessor]
    begin = start + document["bufferViews"][entry["bufferView"]].get("byteOffset", 0)
    width = {"VEC2": 2, "VEC3": 3, "VEC4": 4}[entry["type"]]
    return struct.unpack_from(f"<{width * entry['count']}f", data, begin)


def linear(byte):
    v = byte / 255
    return v / 12.92 if v <= 0.04045 else ((v + 0.055) / 1.055) ** 2.4


@unittest.skipUnless(HELPER.exists(), f"{HELPER} was not built: libassimp-dev is not installed")
class Convert(ApiTest):
    FLAGS = ("--convert-seconds", "2")  # Broken files can keep libassimp busy.

    def setUp(self):
        self.folder = Path(tempfile.mkdtemp(prefix="tessera-convert-"))
        self.address = f"http://127.0.0.1:{self.server.port}"

    def converted(self, name, content, **beside):
        for other, bytes_ in {name: content, **beside}.items():
            (self.folder / other).write_bytes(bytes_)
        out = self.folder / "out.glb"
        code, _, said = tessera("convert", self.folder / name, "-o", out)
        self.assertEqual(code, 0, said)
        return out.read_bytes(), said

    def upload(self, name, content, kind="application/octet-stream", server=None):
        return (server or self.server).post(f"/v1/scenes?name={name}", content,
                                            headers={"Content-Type": kind})

    def expect_size(self, scene, size):
        box = scene["bounds"]
        for low, high, length in zip(box["min"], box["max"], size):
            self.assertAlmostEqual(high - low, length, delta=1e-5 * max(size))

    def test_uploads_have_their_size_in_metres_and_say_what_was_assumed(self):
        for name, (content, size, words) in FILES.items():
            with self.subTest(name):
                answer = self.upload(name, content)
                self.assertIn(answer.status, (200, 201), answer)
                self.expect_size(answer.json(), size)
                self.assertEqual(answer.json()["triangles"], 12)
                self.assertTrue(any(words in w for w in answer.json()["warnings"]), answer)
                # Another test may have uploaded the file by another name.
                codes = [detail["code"] for detail in answer.json()["warning_details"]]
                self.assertLessEqual(len(codes) - codes.count("name"), 2, answer)

    def test_a_media_type_names_the_format_where_the_name_does_not(self):
        for kind, name in (("model/stl", "binary.stl"), ("model/obj", "box.obj"),
                           ("model/ply", "box.ply"), ("model/3mf", "box.3mf")):
            answer = self.upload("box", FILES[name][0], kind)
            self.assertIn(answer.status, (200, 201), answer)
            self.expect_size(answer.json(), FILES[name][1])

    def test_a_3mf_is_known_as_a_zip(self):
        answer = self.upload("box", threemf("centimeter"), "application/zip")
        self.assertIn(answer.status, (200, 201), answer)
        self.expect_size(answer.json(), z_up(0.01))

    def test_materials_of_an_obj(self):
        wood = png_image(2, 2, (10, 20, 30))
        data, _ = self.converted("box.obj", obj(), **{"box.mtl": MTL, "wood.png": wood})
        document = document_of(data)
        red, picture = (next(m for m in document["materials"] if m["name"] == name)
                        for name in ("red", "picture"))
        base = red["pbrMetallicRoughness"]
        for seen, given in zip(base["baseColorFactor"], (0.8, 0.1, 0.2, 0.5)):
            self.assertAlmostEqual(seen, given, places=6)
        self.assertAlmostEqual(base["roughnessFactor"], 1 - 0.25**0.5, places=6)
        self.assertEqual((base["metallicFactor"], red["alphaMode"]), (0, "BLEND"))
        self.assertEqual(picture["emissiveFactor"], [0.25, 0.5, 0])
        texture = picture["pbrMetallicRoughness"]["baseColorTexture"]["index"]
        view = document["bufferViews"][document["images"][document["textures"][texture]["source"]]
                                       ["bufferView"]]
        begin = 28 + struct.unpack("<I", data[12:16])[0] + view.get("byteOffset", 0)
        self.assertEqual(data[begin:begin + view["byteLength"]], wood)

    def material_of(self, mtl, **files):
        data, said = self.converted("box.obj", obj(), **{
            "box.mtl": b"newmtl red\nKd 0 0 0\n" + mtl, **files})
        return next(m for m in document_of(data)["materials"] if m["name"] == "red"), said

    def test_lamps_of_an_obj_keep_their_strength_and_textures(self):
        lamp, _ = self.material_of(b"Ke 17 12 4\n")
        strength = lamp["extensions"]["KHR_materials_emissive_strength"]["emissiveStrength"]
        for seen, given in zip(lamp["emissiveFactor"], (17, 12, 4)):
            self.assertAlmostEqual(seen * strength, given, places=5)
        for glow in (b"", b"Ke 1 1 1\n"):
            lamp, _ = self.material_of(glow + b"map_Ke glow.png\n",
                                       **{"glow.png": png_image(2, 2, (10, 20, 30))})
            self.assertEqual(lamp["emissiveFactor"], [1, 1, 1])
            self.assertIn("index", lamp["emissiveTexture"])

    def test_glass_and_metal_of_an_obj(self):
        glass, _ = self.material_of(b"Tf 0.5 0.75 1\nNi 1.33\nillum 7\n")
        made = glass["extensions"]
        self.assertEqual(made["KHR_materials_transmission"]["transmissionFactor"], 1)
        self.assertGreater(made["KHR_materials_volume"]["thicknessFactor"], 0)
        self.assertAlmostEqual(made["KHR_materials_ior"]["ior"], 1.33, places=6)
        base = glass["pbrMetallicRoughness"]
        self.assertEqual(base["baseColorFactor"], [0.5, 0.75, 1, 1])
        self.assertEqual(base["roughnessFactor"], 0)
        metal, _ = self.material_of(b"Ks 0.5 0.25 0.125\nNs 250\nillum 3\n")
        base = metal["pbrMetallicRoughness"]
        self.assertEqual((base["baseColorFactor"], base["metallicFactor"]),
                         ([0.5, 0.25, 0.125, 1], 1))
        self.assertNotIn("extensions", metal)

    def test_what_is_left_out_of_materials_is_named(self):
        wood = {"wood.png": png_image(2, 2, (9, 9, 9))}
        _, said = self.material_of(b"map_d wood.png\nmap_Bump wood.png\n"
                                   b"map_Kd -s 2 2 1 wood.png\nKa 1 1 1\n", **wood)
        self.assertIn("MTL: map_Bump, map_Kd -s, map_d left out.", said)
        _, said = self.material_of(b"map_Kd wood.png\nKa 1 1 1\nKs 1 1 1\nNi 1.45\nillum 2\n",
                                   **wood)
        self.assertNotIn("left out", said)

    def test_what_other_programs_read_is_read(self):
        for name, content, triangles, words in MENDED:
            with self.subTest(name):
                data, said = self.converted(name, content)
                document = document_of(data)
                counts = [document["accessors"][p["indices"]]["count"]
                          for m in document["meshes"] for p in m["primitives"]]
                self.assertEqual(sum(counts), 3 * triangles)
                self.assertIn(words, said)

    def test_materials_are_read_as_other_programs_write_them(self):
        wood = {"wood.png": png_image(2, 2, (10, 20, 30))}
        lines = b"newmtl red\nKd 0.25 0.5 0.75\nmap_Kd wood.png\n"
        for mtl in (MARK + lines, lines.decode().encode("utf-16"), lines.replace(b"\n", b"\r"),
                    lines.replace(b"\n", b"\r\n"), b"\t" + lines.replace(b"\n", b"\n\t"),
                    lines.replace(b" ", b"\t"), lines.lower(), b"Kd 1 0 0\n" + lines,
                    lines.replace(b"wood.png", b'"wood.png"'),
                    lines.replace(b"map_Kd", b"map_Kd -s 2 2 -clamp on"),
                    lines.replace(b"Kd 0", b"Kd spectral a.rfl\nKd 0").replace(b"75", b"75 # x")):
            with self.subTest(mtl=mtl):
                done = self.helped("obj", {"box.obj": obj(), "box.mtl": mtl, **wood})
                red = next(m for m in document_of(done.stdout)["materials"] if m["name"] == "red")
                base = red["pbrMetallicRoughness"]
                self.assertEqual(base["baseColorFactor"], [0.25, 0.5, 0.75, 1])
                self.assertIn("index", base["baseColorTexture"])
                self.assertEqual(b"left out" in done.stderr, b"-s" in mtl or b"spectral" in mtl)

    def test_a_colour_may_have_one_number_and_a_texture_none(self):
        wood = {"wood.png": png_image(2, 2, (10, 20, 30))}
        one, _ = self.material_of(b"Kd 0.5\n")
        self.assertEqual(one["pbrMetallicRoughness"]["baseColorFactor"], [0.5, 0.5, 0.5, 1])
        shown, _ = self.material_of(b"map_Kd wood.png\n", **wood)  # with Kd 0 0 0
        self.assertEqual(shown["pbrMetallicRoughness"]["baseColorFactor"], [1, 1, 1, 1])
        _, said = self.material_of(b"Ns nan\nKe 1e39 0 0\nd -halo 0.5\n")
        self.assertIn("MTL: Ke 1e39, Ns nan, d -halo left out.", said)

    def test_vertices_with_colours_keep_their_material(self):
        coloured = b"v 0 0 0 1 0 0\nv 1 0 0 1 0 0\nv 0 1 0 1 0 0\n"
        plain = b"v 0 0 1\nv 1 0 1\nv 0 1 1\n"
        mtl = MTL + b"newmtl plain\nKd 0 0.25 0\n"
        wood = png_image(2, 2, (10, 20, 30))
        for points, has, has_not in ((coloured + plain, b"1/1 2/1 3/1", b"4/1 5/1 6/1"),
                                     (plain + coloured, b"4/1 5/1 6/1", b"1/1 2/1 3/1")):
            content = (b"mtllib box.mtl\n" + points + b"vt 0 0\nusemtl red\nf " + has
                       + b"\nusemtl picture\nf " + has + b"\nusemtl plain\nf " + has_not + b"\n")
            data, _ = self.converted("box.obj", content, **{"box.mtl": mtl, "wood.png": wood})
            document = document_of(data)
            seen = {}
            for primitive in (p for m in document["meshes"] for p in m["primitives"]):
                material = document["materials"][primitive["material"]]
                seen[material["name"]] = ("COLOR_0" in primitive["attributes"],
                                          material["pbrMetallicRoughness"]["baseColorFactor"])
            self.assertEqual(seen["red"], (True, [1, 1, 1, 0.5]))
            self.assertEqual(seen["picture"], (False, [1, 1, 1, 1]))
            self.assertEqual(seen["plain"], (False, [0, 0.25, 0, 1]))

    def test_colours_of_vertices_may_be_bytes(self):
        points = b"v 0 0 0 188 55 0\nv 1 0 0 188 55 0\nv 0 1 0 188 55 0\nf 1 2 3\n"
        bright = points.replace(b"188 55 0", b"1.01 0 0.5")
        for content, expected in ((points, (188, 55, 0)), (bright, (255, 0, 127.5))):
            data, said = self.converted("box.obj", content)
            self.assertEqual("taken as parts of 255" in said, content == points)
            attributes = document_of(data)["meshes"][0]["primitives"][0]["attributes"]
            for seen, byte in zip(floats_of(data, attributes["COLOR_0"]), expected):
                self.assertAlmostEqual(seen, linear(byte), places=5)

    def test_names_may_be_in_any_encoding(self):
        name = os.fsdecode(b"m\xf6bel.png")
        mtl = b"newmtl m\xf6bel\nKd 1 1 1\nmap_Kd m\xf6bel.png\n"
        content = obj().replace(b"usemtl red", b"usemtl m\xf6bel")
        for beside in ({}, {name: png_image(2, 2, (9, 9, 9))}):
            data, _ = self.converted("box.obj", content, **{"box.mtl": mtl, **beside})
            self.assertEqual(len(document_of(data).get("images", [])), len(beside))
            (self.folder / name).unlink(missing_ok=True)
        picture = self.folder / os.fsdecode(b"m\xf6bel.png")
        done = subprocess.run([BINARY, "render", self.folder / "box.obj", "-o", picture, "--size",
                               "8x8", "--spp", "1", "--json"], capture_output=True, timeout=60,
                              check=False)
        self.assertEqual(done.returncode, 0, done)
        told = json.loads(done.stdout)
        self.assertIn("m\ufffdbel.png is missing", " ".join(told["warnings"]))
        self.assertIn("m\ufffdbel.png", told["output"])

    def helped(self, extension, files, **options):
        """Returns the helper's process, which has got the files as convert.cpp sends them."""
        sent = b"".join(struct.pack("<QQ", len(name), len(content)) + name.encode() + content
                        for name, content in files.items())
        return subprocess.run([HELPER, extension], input=sent, capture_output=True, timeout=60,
                              check=False, **options)

    def test_textures_with_one_name_are_told_apart_by_their_folders(self):
        mtl = b"newmtl red\nmap_Kd a/wood.png\nnewmtl picture\nmap_Kd b\\wood.png\n"
        pictures = [png_image(2, 2, rgb) for rgb in ((200, 0, 0), (0, 200, 0))]
        done = self.helped("obj", {"x/box.obj": obj(), "x/box.mtl": mtl,
                                   "x/b/wood.png": pictures[1], "x/a/wood.png": pictures[0]})
        self.assertEqual(done.returncode, 0, done)
        document = document_of(done.stdout)
        begin = 28 + struct.unpack("<I", done.stdout[12:16])[0]
        for name, picture in zip(("red", "picture"), pictures):
            material = next(m for m in document["materials"] if m["name"] == name)
            index = material["pbrMetallicRoughness"]["baseColorTexture"]["index"]
            image = document["images"][document["textures"][index]["source"]]
            view = document["bufferViews"][image["bufferView"]]
            start = begin + view.get("byteOffset", 0)
            self.assertEqual(done.stdout[start:start + view["byteLength"]], picture)

    def test_colours_of_an_stl(self):
        red, blue = 31, 31 << 10  # of Materialise; VisCAM and SolidView have them the other way
        head_of_red = b"COLOR=\xff\0\0\xff".ljust(80, b"\0")
        for head, bits, expected in (
                (bytes(80), [0x8000 | blue] * 11 + [0x8000 | red], [(1, 0, 0), (0, 0, 1)]),
                (head_of_red, [0x8000] * 11 + [blue], [(1, 0, 0), (0, 0, 1)]),
                (head_of_red, [0] * 12, [(1, 0, 0)])):
            content = bytearray(head + stl_binary()[80:])
            for i, value in enumerate(bits):
                content[84 + 50 * i + 48:84 + 50 * i + 50] = struct.pack("<H", value)
            data, _ = self.converted("box.stl", bytes(content))
            attributes = document_of(data)["meshes"][0]["primitives"][0]["attributes"]
            colours = floats_of(data, attributes["COLOR_0"])
            seen = {colours[i:i + 3] for i in range(0, len(colours), 4)}
            self.assertEqual(seen, set(expected))

    def test_colours_of_a_3mf(self):
        def base(**options):
            data, said = self.converted("box.3mf", threemf(**options))
            material = document_of(data)["materials"][0]["pbrMetallicRoughness"]
            return material["baseColorFactor"], said
        self.assertAlmostEqual(base(colour="#00FF0080")[0][3], 128 / 255, places=6)
        self.assertEqual(base(colour="#00FF00")[0], [0, 1, 0, 1])
        none, _ = base(change=lambda m: re.sub("<basem.*</basematerials>| pid=.1. pindex=.0.", "",
                                               m).encode())
        self.assertEqual(none, [0.8, 0.8, 0.8, 1])
        _, said = base(change=lambda m: m.replace('v1="0"', 'pid="1" p1="0" v1="0"').encode())
        self.assertIn("those of its triangles are left out", said)
        for change in (lambda m: m.replace("unit=", "unit = ").encode(),
                       lambda m: m.replace("unit=", 'my-unit="foot" unit=').encode()):
            self.assertIn("3MF: inch", base(change=change)[1])
        self.assertIn("3MF: inch", base(path="3D/box.model")[1])

    def test_a_lack_of_memory_is_told_as_such(self):
        rows = 8_000_000
        content = (b"ply\nformat binary_little_endian 1.0\nelement vertex %d\n" % rows
                   + b"".join(b"property uchar %s\n" % c for c in (b"x", b"y", b"z"))
                   + b"end_header\n" + bytes(3 * rows))
        limit = 96 << 20
        done = self.helped("ply", {"model.ply": content}, preexec_fn=lambda: resource.setrlimit(
            resource.RLIMIT_AS, (limit, limit)))
        self.assertEqual((done.returncode, done.stderr), (3, b""))

    def test_an_obj_may_name_several_libraries_at_once(self):
        both = TRIANGLE_OBJ + b"mtllib a.mtl b.mtl\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 2 4\n"
        libraries = {"a.mtl": b"newmtl red\nKd 1 0 0\n", "b.mtl": b"newmtl blue\nKd 0 0 1\n"}
        data, said = self.converted("both.obj", both, **libraries)
        self.assertNotIn("missing", said)
        colours = [m["pbrMetallicRoughness"]["baseColorFactor"]
                   for m in document_of(data)["materials"]]
        self.assertEqual(colours, [[1, 0, 0, 1], [0, 0, 1, 1]])
        spaced = both.replace(b"a.mtl b.mtl", b"my box.mtl")
        data, said = self.converted("one.obj", spaced,
                                    **{"my box.mtl": b"".join(libraries.values())})
        self.assertNotIn("missing", said)
        self.assertEqual(len(document_of(data)["materials"]), 2)

    def test_damaged_files_are_refused_with_the_place_of_the_damage(self):
        for name, content, why in REFUSED:
            with self.subTest(name=name, why=why):
                (self.folder / name).write_bytes(content)
                code, _, said = tessera("convert", self.folder / name, "-o", self.folder / "x.glb")
                self.assertEqual(code, 1, said)
                self.assertIn(why, said)
                answer = self.upload(name, content)
                self.assertEqual(answer.status, 422, answer)
                self.assertIn(why, answer.json()["detail"])

    def test_libraries_are_found_by_any_way_of_writing_their_name(self):
        for name in ("a.mtl # of Kd", '"a.mtl"', "./x/a.mtl b/b.mtl", "A.MTL", '"my a.mtl"'):
            library = "my a.mtl" if "my" in name else "a.mtl"
            done = self.helped("obj", {"box.obj": obj(name), library: MTL, "b.mtl": b""})
            self.assertNotIn(b"mtl", done.stderr, name)
            names = [m["name"] for m in document_of(done.stdout)["materials"]]
            self.assertEqual(names, ["red", "picture"])
            kd = document_of(done.stdout)["materials"][0]["pbrMetallicRoughness"]
            self.assertAlmostEqual(kd["baseColorFactor"][1], 0.1, places=6)

    def test_numbers_may_begin_with_a_dot(self):
        corners = b"v 0 0 0\nv 1 .5 0\nv 0 1 -.5\nv 5 5 5\nvt .5 .5\nf 1/1 2/1 3/1\n"
        data, _ = self.converted("flat.obj", corners)
        document = document_of(data)
        points = floats_of(data, document["meshes"][0]["primitives"][0]["attributes"]["POSITION"])
        self.assertEqual(sorted(zip(points[::3], points[1::3], points[2::3])),
                         [(0, 0, 0), (0, 1, -0.5), (1, 0.5, 0)])

    def test_textures_are_found_by_any_way_of_writing_their_name(self):
        wood = png_image(2, 2, (10, 20, 30))
        for wanted, name, change in (
                (b"WOOD.PNG", "wood.png", bytes), (b"C:\\maps\\wood.png", "wood.png", bytes),
                (b"my wood.png", "my wood.png", bytes), (b"-bm 1 wood.png", "wood.png", bytes),
                (b'"my wood.png"', "my wood.png", bytes),
                (b"a.png", "a.png", lambda mtl: mtl.decode().encode("utf-16")),
                (b"b.png", "b.png", lambda mtl: mtl.replace(b"\n", b"\r")),
                (b"c.png", "c.png", lambda mtl: mtl.replace(b" ", b"\t"))):
            with self.subTest(wanted=wanted):
                mtl = change(b"newmtl red\nKd 1 1 1\nmap_Kd " + wanted + b"\n")
                files = {"box.obj": obj(), "box.mtl": mtl, name: wood}
                archive = io.BytesIO()
                with zipfile.ZipFile(archive, "w") as packed:
                    for each, content in files.items():
                        packed.writestr(each, content)
                answer = self.upload("box.zip", archive.getvalue(), "application/zip")
                self.assertFalse(any("missing" in w for w in answer.json()["warnings"]), answer)
                folder = self.folder / wanted.hex()
                folder.mkdir()
                for each, content in files.items():
                    (folder / each).write_bytes(content)
                code, _, said = tessera("convert", folder / "box.obj", "-o", folder / "box.glb")
                self.assertEqual((code, "missing" in said), (0, False), said)
                self.assertEqual(len(document_of((folder / "box.glb").read_bytes())["images"]), 1)

    def test_textures_with_one_name_are_sent_with_their_folders(self):
        pictures = {"red": png_image(2, 2, (200, 0, 0)), "picture": png_image(2, 2, (0, 200, 0))}
        for name, picture in pictures.items():
            (self.folder / name).mkdir()
            (self.folder / name / "wood.png").write_bytes(picture)
        mtl = b"newmtl red\nmap_Kd red/wood.png\nnewmtl picture\nmap_Kd picture\\wood.png\n"
        data, _ = self.converted("box.obj", obj(), **{"box.mtl": mtl})
        self.assertEqual(len(document_of(data)["images"]), 2)

    def test_warnings_are_those_of_the_upload(self):
        for name in ("first.png", "second.png"):
            archive = io.BytesIO()
            with zipfile.ZipFile(archive, "w") as packed:
                packed.writestr("box.obj", obj())
                packed.writestr("box.mtl", f"newmtl red\nKd 1 1 0.5\nmap_Kd {name}\n")
            said = " ".join(self.upload("box.zip", archive.getvalue(),
                                        "application/zip").json()["warnings"])
            self.assertIn(name, said)
            self.assertEqual("first.png" in said, name == "first.png", said)

    def test_texture_coordinates_count_from_the_top(self):
        data, _ = self.converted("box.obj", obj(), **{"box.mtl": MTL})
        document = document_of(data)
        names = [m["name"] for m in document["materials"]]
        mesh = next(m for m in document["meshes"]
                    if names[m["primitives"][0]["material"]] == "picture")
        attributes = mesh["primitives"][0]["attributes"]
        points, uv = (floats_of(data, attributes[a]) for a in ("POSITION", "TEXCOORD_0"))
        first = QUADS[3][0]  # with (0, 0), the lower left of OBJ
        for i in range(len(points) // 3):
            if points[3 * i:3 * i + 3] == tuple(map(float, CORNERS[first])):
                if uv[2 * i] == 0:
                    self.assertIn(uv[2 * i + 1], (0, 1))
        self.assertIn((0.0, 1.0), set(zip(uv[::2], uv[1::2])))

    def test_missing_files_are_named(self):
        _, said = self.converted("box.obj", obj())
        self.assertIn("box.mtl is missing", said)
        _, said = self.converted("box.obj", obj(), **{"box.mtl": MTL})
        self.assertIn("wood.png is missing", said)

    def test_a_zip_has_an_obj_with_its_materials(self):
        out = io.BytesIO()
        with zipfile.ZipFile(out, "w") as archive:
            for name, content in (("box/box.obj", obj()), ("box/box.mtl", MTL),
                                  ("box/wood.png", png_image(2, 2, (9, 9, 9)))):
                archive.writestr(name, content)
        answer = self.upload("box.zip", out.getvalue(), "application/zip")
        self.assertEqual(answer.status, 201, answer)
        self.expect_size(answer.json(), Y_UP)
        self.assertIn("red", answer.json()["materials"])
        self.assertFalse(any("missing" in w for w in answer.json()["warnings"]), answer)

    def test_colours_of_vertices_and_of_3mf_are_made_linear(self):
        expected = [linear(v) for v in (188, 55, 0)]
        data, _ = self.converted("box.ply", coloured_ply())
        primitive = document_of(data)["meshes"][0]["primitives"][0]
        colours = floats_of(data, primitive["attributes"]["COLOR_0"])
        for i in range(0, len(colours), 4):
            for seen, given in zip(colours[i:i + 4], [*expected, 1]):
                self.assertAlmostEqual(seen, given, places=5)
        data, _ = self.converted("box.3mf", threemf())
        document = document_of(data)
        material = document["materials"][document["meshes"][0]["primitives"][0]["material"]]
        for seen, given in zip(material["pbrMetallicRoughness"]["baseColorFactor"], expected):
            self.assertAlmostEqual(seen, given, places=5)

    def test_one_request_renders_an_stl(self):
        body = (b'--sep\r\nContent-Disposition: form-data; name="scene"; filename="box.stl"\r\n'
                b"Content-Type: application/octet-stream\r\n\r\n" + stl_binary() + b"\r\n--sep--")
        headers = {"Content-Type": "multipart/form-data; boundary=sep"}
        answer = self.server.post("/v1/render?samples=1&size=16x16&format=png", body,
                                  headers=headers)
        self.assertEqual(answer.status, 200, answer)
        answer = self.server.post("/v1/render?samples=1&size=16x16&format=png", stl_binary(),
                                  headers={"Content-Type": "model/stl"})
        self.assertEqual(answer.status, 200, answer)

    def test_the_command_line_renders_and_submits(self):
        file = self.folder / "box.stl"
        file.write_bytes(stl_binary())
        out = self.folder / "out.png"
        code, _, said = tessera("render", file, "-o", out, "--size", "16x16", "--spp", "1")
        self.assertEqual(code, 0, said)
        self.assertIn("millimetres", said)
        code, _, said = tessera("upload", file, "--server", self.address)
        self.assertEqual(code, 0, said)
        self.assertIn("millimetres", said)

    def test_the_command_line_sends_an_obj_with_the_files_beside_it(self):
        file = self.folder / "box.obj"
        file.write_bytes(obj("parts\\Box.mtl"))  # as Windows finds it
        secret = self.folder.parent / f"{self.folder.name}.png"
        self.addCleanup(secret.unlink)
        secret.write_bytes(png_image(2, 2, (9, 9, 9)))
        (self.folder / "parts").mkdir()
        (self.folder / "parts/box.mtl").write_bytes(
            MTL.replace(b"0.8", b"0.7") + f"newmtl outside\nmap_Kd ../{secret.name}\n".encode())
        code, name, said = tessera("upload", file, "--server", self.address)
        self.assertEqual(code, 0, said)
        self.assertIn("wood.png is missing", said)
        (self.folder / "wood.png").write_bytes(png_image(2, 2, (9, 9, 9)))
        for verb in (("upload", file), ("submit", file, "--spp", "1", "--size", "16x16")):
            code, name, said = tessera(*verb, "--server", self.address)
            self.assertEqual((code, "wood.png" in said), (0, False), said)
            place = "scenes" if verb[0] == "upload" else "jobs"
            made = self.server.get(f"/v1/{place}/{name.split()[-1]}").json()
            scene = made if place == "scenes" else self.server.get(
                f"/v1/scenes/{made['spec']['scene']}").json()
            self.assertEqual(sorted(scene["materials"]), ["picture", "red"])
            self.assertEqual(scene["name"], "box.obj")

    def test_broken_files_are_refused_and_the_server_lives(self):
        """Cut and changed files, as a short fuzz: any answer but a failure of the server."""
        began = time.monotonic()
        source = random.Random(46)
        for name, (content, _, _) in {**FILES, "colours.ply": (coloured_ply(), 0, 0)}.items():
            for _ in range(10):
                if time.monotonic() - began > 30:
                    return
                broken = bytearray(content[:source.randrange(len(content))]
                                   if source.random() < 0.4 else content)
                for _ in range(source.randrange(6)):
                    if broken:
                        broken[source.randrange(len(broken))] = source.randrange(256)
                answer = self.upload(name, bytes(broken))
                self.assertIn(answer.status, (200, 201, 413, 422), (name, answer))

    def test_a_count_beyond_the_file_is_refused(self):
        claimed = bytes(80) + struct.pack("<I", 0xFFFFFFF0) + bytes(50)
        self.assertIn(self.upload("box.stl", claimed).status, (413, 422))
        many = ply().replace(b"element vertex 8", b"element vertex 4000000000")
        self.assertIn(self.upload("box.ply", many).status, (413, 422))


class Programs(ApiTest):
    """Formats of the operator's own programs, and none."""

    def program(self, text):
        path = Path(tempfile.mkdtemp(prefix="tessera-convert-")) / "program"
        path.write_text("#!/usr/bin/env python3\nimport sys\n" + text)
        path.chmod(path.stat().st_mode | stat.S_IXUSR)
        return path

    def answer(self, text, content=b"solid body"):
        server = started(self, "--converters", f"STEP={self.program(text)}")
        return server.post("/v1/scenes?name=part.step", content,
                           headers={"Content-Type": "application/octet-stream"})

    def test_a_program_makes_the_scene(self):
        made = glb(triangle_document(), TRIANGLE)
        answer = self.answer("assert open(sys.argv[1], 'rb').read() == b'solid body'\n"
                             "print('note: in feet', file=sys.stderr)\n"
                             f"open(sys.argv[2], 'wb').write({made!r})\n")
        self.assertEqual(answer.status, 201, answer)
        self.assertEqual(answer.json()["triangles"], 1)
        self.assertIn("in feet", answer.json()["warnings"])

    def test_a_program_has_no_network(self):
        answer = self.answer(
            "import socket\n"
            "try:\n  socket.socket()\n"
            "except OSError as e:\n  print('error: no socket', e.errno, file=sys.stderr)\n"
            "sys.exit(1)\n")
        self.assertEqual(answer.status, 422, answer)
        self.assertIn("no socket 13", answer.json()["detail"])

    def test_a_program_has_a_limit_of_memory(self):
        answer = self.answer(
            "try:\n  bytearray(2 << 30)\n"
            "except MemoryError:\n  print('error: no memory', file=sys.stderr)\n"
            "sys.exit(1)\n")
        self.assertIn("no memory", answer.json()["detail"])

    def test_what_a_program_says_is_the_answer(self):
        answer = self.answer("print('error: not a solid', file=sys.stderr)\nsys.exit(2)\n")
        self.assertEqual(answer.status, 422, answer)
        self.assertIn("not a solid", answer.json()["detail"])
        self.assertEqual(self.answer("pass").status, 422)

    def test_other_formats_are_refused_with_the_remedy(self):
        answer = self.server.post("/v1/scenes?name=part.step", b"ISO-10303-21;",
                                  headers={"Content-Type": "application/octet-stream"})
        self.assertEqual(answer.status, 415, answer)
        self.assertIn("--converters step=PROGRAM", answer.json()["detail"])

    def test_without_the_converter_the_answer_names_the_remedy(self):
        server = started(self, environ={"TESSERA_CONVERTER": "/nowhere"})
        answer = server.post("/v1/scenes?name=box.stl", stl_binary(),
                             headers={"Content-Type": "application/octet-stream"})
        self.assertEqual(answer.status, 415, answer)
        self.assertIn("server/run --with-converters", answer.json()["detail"])
