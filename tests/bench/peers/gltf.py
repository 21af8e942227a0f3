"""Reads a glTF file for engines without a reader, and packs one as GLB.

Reads only features that the benchmark sets up equally in every engine; refuses any other feature
that would change the image by name (Unsupported), so that no engine silently renders a different
scene.
"""
import base64
import json
import math
import os
import struct
from dataclasses import dataclass, field
from urllib.parse import unquote

import numpy as np

TYPES = {
    5120: np.int8,
    5121: np.uint8,
    5122: np.int16,
    5123: np.uint16,
    5125: np.uint32,
    5126: np.float32,
}
WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
MATERIAL_EXTENSIONS = {
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_materials_volume_scatter",
}
TEXTURES = (
    "base_color_texture",
    "metallic_roughness_texture",
    "normal_texture",
    "emissive_texture",
)
JSON_CHUNK, BINARY_CHUNK = 0x4E4F534A, 0x004E4942


class Unsupported(Exception):
    """The scene uses a feature that the adapters do not support."""


@dataclass
class Primitive:
    positions: np.ndarray
    normals: np.ndarray | None
    uv: np.ndarray | None
    indices: np.ndarray  # (triangles, 3)
    material: int


@dataclass
class Medium:
    extinction: tuple  # per metre
    albedo: tuple  # of one scattering
    g: float  # mean cosine of Henyey and Greenstein's phase function


@dataclass
class Material:
    base_color: tuple = (1.0, 1.0, 1.0)
    alpha: float = 1.0
    metallic: float = 1.0
    roughness: float = 1.0
    specular: float = 1.0
    ior: float = 1.5
    emission: tuple = (0.0, 0.0, 0.0)
    transmission: float = 0.0
    alpha_mode: str = "OPAQUE"
    alpha_cutoff: float = 0.5
    double_sided: bool = False
    normal_scale: float = 1.0
    base_color_texture: int | None = None  # images
    metallic_roughness_texture: int | None = None
    normal_texture: int | None = None
    emissive_texture: int | None = None
    medium: Medium | None = None

    @property
    def is_emissive(self):
        return max(self.emission) > 0

    @property
    def is_lambertian(self):
        return self.metallic == 0 and self.specular == 0 and self.transmission == 0


@dataclass
class Light:
    kind: str
    radiance: tuple  # W/sr, or W/m2 of a directional light
    to_world: np.ndarray
    inner: float = 0.0
    outer: float = math.pi / 4


@dataclass
class Scene:
    meshes: list = field(default_factory=list)  # lists of primitives
    instances: list = field(default_factory=list)  # (mesh, 4x4)
    materials: list = field(default_factory=list)
    images: list = field(default_factory=list)  # file contents
    lights: list = field(default_factory=list)
    camera: np.ndarray | None = None
    vertical_fov: float = math.pi / 4

    def triangles(self):
        """Number of triangles, counting instances."""
        sizes = [sum(len(p.indices) for p in mesh) for mesh in self.meshes]
        return sum(sizes[mesh] for mesh, _ in self.instances)


def fetch(uri, folder):
    if uri.startswith("data:"):
        return base64.b64decode(uri.split(",", 1)[1])
    with open(os.path.join(folder, unquote(uri)), "rb") as file:
        return file.read()


def open_file(path):
    """The document and its buffers."""
    with open(path, "rb") as file:
        data = file.read()
    folder = os.path.dirname(path)
    binary = b""
    if data[:4] == b"glTF":
        at, document = 12, None
        while at + 8 <= len(data):
            size, kind = struct.unpack_from("<II", data, at)
            chunk = data[at + 8:at + 8 + size]
            if kind == JSON_CHUNK:
                document = json.loads(chunk)
            elif kind == BINARY_CHUNK:
                binary = chunk
            at += 8 + size
    else:
        document = json.loads(data)
    buffers = [
        fetch(b["uri"], folder) if "uri" in b else binary for b in document.get("buffers", [])
    ]
    return document, buffers, folder


def write_glb(document, binary):
    """Packs `document` with one buffer as a GLB."""
    document["buffers"] = [{"byteLength": len(binary)}] if binary else []
    if not binary:
        del document["buffers"]
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    binary = bytes(binary) + b"\0" * (-len(binary) % 4)
    chunks = struct.pack("<II", len(text), JSON_CHUNK) + text
    if binary:
        chunks += struct.pack("<II", len(binary), BINARY_CHUNK) + binary
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def pack(path, aspect):
    """Packs the file as one GLB with embedded images and a camera: if it has none, the default one
    that frames it."""
    document, buffers, folder = open_file(path)
    binary, starts = bytearray(), []
    for data in buffers:
        starts.append(len(binary))
        binary += data + b"\0" * (-len(data) % 4)
    for view in document.get("bufferViews", []):
        view["byteOffset"] = view.get("byteOffset", 0) + starts[view["buffer"]]
        view["buffer"] = 0
    for image in document.get("images", []):
        if "uri" in image:
            data = fetch(image.pop("uri"), folder)
            document.setdefault("bufferViews", []).append(
                {"buffer": 0, "byteOffset": len(binary), "byteLength": len(data)})
            image["bufferView"] = len(document["bufferViews"]) - 1
            image["mimeType"] = "image/png" if data[:4] == b"\x89PNG" else "image/jpeg"
            binary += data + b"\0" * (-len(data) % 4)
    if not document.get("cameras"):
        add_camera(document, *frame(bounds(document), aspect))
    return write_glb(document, binary)


def frame(box, aspect):
    """Position, target and vertical field of view of a camera that frames `box` like the renderer.
    """
    low, high = box
    centre, radius = (low + high) / 2, np.linalg.norm(high - low) / 2
    fov = math.radians(45)
    narrow = min(fov, 2 * math.atan(aspect * math.tan(fov / 2)))
    away = np.array([0, 0.25, 1]) / np.linalg.norm([0, 0.25, 1])
    return centre + away * radius / math.sin(narrow / 2), centre, fov


def add_camera(document, eye, target, fov):
    back = np.asarray(eye, float) - np.asarray(target, float)
    distance = np.linalg.norm(back)
    back /= distance
    right = np.cross([0, 1, 0], back)
    right /= np.linalg.norm(right)
    matrix = np.eye(4)
    matrix[:3, :4] = np.stack([right, np.cross(back, right), back, eye], axis=1)
    document["cameras"] = [
        {"type": "perspective", "perspective": {"yfov": fov, "znear": distance / 1000}}
    ]
    document.setdefault("nodes", []).append({"camera": 0, "matrix": matrix.T.ravel().tolist()})
    scene = document.setdefault("scenes", [{"nodes": []}])[document.get("scene", 0)]
    scene.setdefault("nodes", []).append(len(document["nodes"]) - 1)


def bounds(document):
    low, high = np.full(3, np.inf), np.full(3, -np.inf)
    for node, matrix in placed(document):
        for primitive in document["meshes"][node["mesh"]]["primitives"] if "mesh" in node else ():
            accessor = document["accessors"][primitive["attributes"]["POSITION"]]
            ends = np.array([accessor["min"], accessor["max"]])
            corners = np.array([[ends[i, 0], ends[j, 1], ends[k, 2], 1]
                                for i in (0, 1) for j in (0, 1) for k in (0, 1)])
            corners = (corners @ matrix.T)[:, :3]
            low, high = np.minimum(low, corners.min(axis=0)), np.maximum(high, corners.max(axis=0))
    return low, high


def local_matrix(translation, rotation, scale):
    x, y, z, w = rotation
    turn = np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])
    matrix = np.eye(4)
    matrix[:3, :3] = turn * np.asarray(scale)
    matrix[:3, 3] = translation
    return matrix


def placed(document):
    """The nodes of the scene, each with its matrix to world space."""
    nodes = document.get("nodes", [])
    if document.get("scenes"):
        roots = document["scenes"][document.get("scene", 0)].get("nodes", [])
    else:
        roots = range(len(nodes))
    stack = [(i, np.eye(4)) for i in reversed(roots)]
    while stack:
        index, parent = stack.pop()
        node = nodes[index]
        if "matrix" in node:
            own = np.array(node["matrix"], float).reshape(4, 4).T
        else:
            own = local_matrix(
                node.get("translation", (0, 0, 0)),
                node.get("rotation", (0, 0, 0, 1)),
                node.get("scale", (1, 1, 1)),
            )
        matrix = parent @ own
        yield node, matrix
        stack += [(child, matrix) for child in reversed(node.get("children", []))]


def single_scattering_albedo(color, g):
    """For the colour of a deep medium under diffuse light: Kulla and Conty, Revisiting Physically
    Based Shading at Imageworks, 2017."""
    s = 4.09712 + 4.20863 * color - math.sqrt(9.59217 + 41.6808 * color + 17.7126 * color * color)
    return (1 - s * s) / (1 - g * s * s)


class Reader:
    def __init__(self, path, reads_media):
        self.reads_media = reads_media
        self.document, self.buffers, self.folder = open_file(path)

    def accessor(self, index):
        accessor = self.document["accessors"][index]
        if "sparse" in accessor or "bufferView" not in accessor:
            raise Unsupported("sparse accessors")
        view = self.document["bufferViews"][accessor["bufferView"]]
        if "EXT_meshopt_compression" in view.get("extensions", {}):
            raise Unsupported("EXT_meshopt_compression")
        kind, width = np.dtype(TYPES[accessor["componentType"]]), WIDTHS[accessor["type"]]
        stride = view.get("byteStride", kind.itemsize * width)
        out = np.ndarray(
            (accessor["count"], width),
            kind,
            self.buffers[view["buffer"]],
            view.get("byteOffset", 0) + accessor.get("byteOffset", 0),
            (stride, kind.itemsize),
        )
        if accessor.get("normalized"):
            return np.maximum(out.astype(np.float32) / np.iinfo(kind).max, -1)
        return out

    def image(self, texture):
        """The image of a texture reference, or None."""
        if texture is None:
            return None
        if texture.get("texCoord", 0) != 0 or "KHR_texture_transform" in texture.get(
            "extensions", {}
        ):
            raise Unsupported("a second set of texture coordinates, or KHR_texture_transform")
        return self.document["textures"][texture["index"]]["source"]

    def medium(self, volume, scatter):
        """Of KHR_materials_volume and KHR_materials_volume_scatter; None: it is empty."""
        if "attenuationDistance" not in volume:
            if scatter:
                raise Unsupported("scattering without attenuation")
            return None
        if not self.reads_media:
            raise Unsupported("absorption or scattering of KHR_materials_volume")
        color = volume.get("attenuationColor", (1, 1, 1))
        g = scatter.get("scatterAnisotropy", 0)
        # The fit of single_scattering_albedo() is not exactly 0 for black.
        albedo = (single_scattering_albedo(c, g) if c > 0 else 0.0
                  for c in scatter.get("multiscatterColorFactor", (0, 0, 0)))
        return Medium(tuple(-math.log(c) / volume["attenuationDistance"] for c in color),
                      tuple(albedo), g)

    def material(self, data):
        extensions = data.get("extensions", {})
        unknown = set(extensions) - MATERIAL_EXTENSIONS
        if unknown:
            raise Unsupported(", ".join(sorted(unknown)))
        specular = extensions.get("KHR_materials_specular", {})
        transmission = extensions.get("KHR_materials_transmission", {})
        volume = extensions.get("KHR_materials_volume", {})
        if {"specularTexture", "specularColorTexture", "specularColorFactor"} & set(specular) or \
                "transmissionTexture" in transmission:
            raise Unsupported(
                "textures or colours of KHR_materials_specular or KHR_materials_transmission"
            )
        if (
            transmission.get("transmissionFactor", 0) > 0
            and not volume.get("thicknessFactor", 0) > 0
        ):
            raise Unsupported("thin-walled transmission")
        pbr = data.get("pbrMetallicRoughness", {})
        color = pbr.get("baseColorFactor", (1, 1, 1, 1))
        strength = extensions.get("KHR_materials_emissive_strength", {}).get("emissiveStrength", 1)
        return Material(
            base_color=tuple(color[:3]),
            alpha=color[3],
            metallic=pbr.get("metallicFactor", 1),
            roughness=pbr.get("roughnessFactor", 1),
            specular=specular.get("specularFactor", 1),
            ior=extensions.get("KHR_materials_ior", {}).get("ior", 1.5),
            emission=tuple(strength * e for e in data.get("emissiveFactor", (0, 0, 0))),
            transmission=transmission.get("transmissionFactor", 0),
            alpha_mode=data.get("alphaMode", "OPAQUE"),
            alpha_cutoff=data.get("alphaCutoff", 0.5),
            double_sided=data.get("doubleSided", False),
            normal_scale=data.get("normalTexture", {}).get("scale", 1),
            base_color_texture=self.image(pbr.get("baseColorTexture")),
            metallic_roughness_texture=self.image(pbr.get("metallicRoughnessTexture")),
            normal_texture=self.image(data.get("normalTexture")),
            emissive_texture=self.image(data.get("emissiveTexture")),
            medium=self.medium(volume, extensions.get("KHR_materials_volume_scatter", {})),
        )

    def primitive(self, data, materials):
        attributes = data["attributes"]
        if (
            data.get("mode", 4) != 4
            or data.get("targets")
            or "JOINTS_0" in attributes
            or "COLOR_0" in attributes
        ):
            raise Unsupported("strips, morphs, skins or vertex colours")
        if "KHR_draco_mesh_compression" in data.get("extensions", {}):
            raise Unsupported("KHR_draco_mesh_compression")

        def floats(name):
            return (
                self.accessor(attributes[name]).astype(np.float32) if name in attributes else None
            )

        positions = floats("POSITION")
        indices = (self.accessor(data["indices"]).astype(np.uint32) if "indices" in data
                   else np.arange(len(positions), dtype=np.uint32))
        return Primitive(positions, floats("NORMAL"), floats("TEXCOORD_0"), indices.reshape(-1, 3),
                         data.get("material", materials))

    def light(self, data, matrix):
        power = data.get("intensity", 1)
        spot = data.get("spot", {})
        return Light(data["type"], tuple(power * c for c in data.get("color", (1, 1, 1))), matrix,
                     spot.get("innerConeAngle", 0.0), spot.get("outerConeAngle", math.pi / 4))

    def instances(self, node, matrix):
        table = node.get("extensions", {}).get("EXT_mesh_gpu_instancing", {}).get("attributes")
        if table is None:
            return [(node["mesh"], matrix)]
        columns = {name: self.accessor(index).astype(float) for name, index in table.items()}
        count = len(next(iter(columns.values())))
        column = [columns.get(name, np.tile(default, (count, 1))) for name, default in
                  (("TRANSLATION", (0, 0, 0)), ("ROTATION", (0, 0, 0, 1)), ("SCALE", (1, 1, 1)))]
        return [(node["mesh"], matrix @ local_matrix(*row)) for row in zip(*column)]

    def scene(self):
        document, scene = self.document, Scene()
        if document.get("animations") or document.get("skins"):
            raise Unsupported("animations or skins")
        for image in document.get("images", []):
            if "bufferView" in image:
                view = document["bufferViews"][image["bufferView"]]
                start = view.get("byteOffset", 0)
                scene.images.append(
                    bytes(self.buffers[view["buffer"]][start : start + view["byteLength"]])
                )
            else:
                scene.images.append(fetch(image["uri"], self.folder))
        scene.materials = [self.material(m) for m in document.get("materials", [])] + [Material()]
        scene.meshes = [[self.primitive(p, len(scene.materials) - 1) for p in mesh["primitives"]]
                        for mesh in document.get("meshes", [])]
        lights = document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
        for node, matrix in placed(document):
            if "mesh" in node:
                scene.instances += self.instances(node, matrix)
            light = node.get("extensions", {}).get("KHR_lights_punctual", {}).get("light")
            if light is not None:
                scene.lights.append(self.light(lights[light], matrix))
            if "camera" in node and scene.camera is None:
                scene.camera, scene.vertical_fov = matrix, yfov(document, node)
        return scene


def yfov(document, node):
    camera = document["cameras"][node["camera"]]
    if camera["type"] != "perspective":
        raise Unsupported("orthographic cameras")
    return camera["perspective"]["yfov"]


def vertical_fov(path):
    """Of the first camera of the scene."""
    document, _, _ = open_file(path)
    return next(yfov(document, node) for node, _ in placed(document) if "camera" in node)


def read(path, reads_media=False):
    """reads_media: the caller renders Material.medium."""
    return Reader(path, reads_media).scene()
