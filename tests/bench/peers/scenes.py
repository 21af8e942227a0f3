"""The benchmark's scenes as GLB files: built-in ones exported by the server, generated ones, and
files."""

import http.client
import math
import os
import struct
import subprocess
import tempfile
import zlib
from dataclasses import dataclass

import gltf
import numpy as np


@dataclass
class Case:
    name: str
    scene: str  # a GLB with a camera
    environment: str | None = None  # an equirectangular map
    sky: list | None = None  # a constant one


class Builder:
    """Collects meshes, materials and nodes of a glTF document."""

    def __init__(self):
        self.binary = bytearray()
        self.document = {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": []}],
            "nodes": [],
            "meshes": [],
            "materials": [],
            "accessors": [],
            "bufferViews": [],
        }

    def accessor(self, values, kind):
        values = np.ascontiguousarray(values)
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": values.nbytes})
        self.binary += values.tobytes()
        accessor = {"bufferView": len(self.document["bufferViews"]) - 1, "type": kind,
                    "componentType": 5125 if values.dtype == np.uint32 else 5126,
                    "count": values.size if kind == "SCALAR" else len(values)}
        if kind == "VEC3":
            accessor.update(min=values.min(axis=0).tolist(), max=values.max(axis=0).tolist())
        self.document["accessors"].append(accessor)
        return len(self.document["accessors"]) - 1

    def material(
        self,
        color,
        metallic=0.0,
        roughness=1.0,
        specular=None,
        emission=None,
        glass=False,
        texture=None,
        medium=None,
        ior=None,
    ):
        """medium: (attenuation distance, attenuation colour, multiscatter colour, g), for glass."""
        material = {
            "pbrMetallicRoughness": {
                "baseColorFactor": [*color, 1],
                "metallicFactor": metallic,
                "roughnessFactor": roughness,
            }
        }
        extensions = material.setdefault("extensions", {})
        if specular is not None:
            extensions["KHR_materials_specular"] = {"specularFactor": specular}
        if emission is not None:
            strength = max(emission)
            material["emissiveFactor"] = [e / strength for e in emission]
            extensions["KHR_materials_emissive_strength"] = {"emissiveStrength": strength}
        if glass:
            extensions["KHR_materials_transmission"] = {"transmissionFactor": 1}
            volume = extensions["KHR_materials_volume"] = {"thicknessFactor": 1}
        if medium is not None:
            volume.update(attenuationDistance=medium[0], attenuationColor=medium[1])
            extensions["KHR_materials_volume_scatter"] = {
                "multiscatterColorFactor": medium[2], "scatterAnisotropy": medium[3]}
        if ior is not None:
            extensions["KHR_materials_ior"] = {"ior": ior}
        if texture is not None:
            material["pbrMetallicRoughness"]["baseColorTexture"] = {"index": texture}
        self.document["extensionsUsed"] = sorted(
            {*self.document.get("extensionsUsed", ()), *extensions}
        )
        self.document["materials"].append(material)
        return len(self.document["materials"]) - 1

    def texture(self, pixels):
        png = write_png(pixels)
        self.document["bufferViews"].append(
            {"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(png)}
        )
        self.binary += png + b"\0" * (-len(png) % 4)
        images = self.document.setdefault("images", [])
        images.append(
            {"bufferView": len(self.document["bufferViews"]) - 1, "mimeType": "image/png"}
        )
        self.document.setdefault("textures", []).append({"source": len(images) - 1})
        return len(images) - 1

    def mesh(self, *parts):
        """Adds a primitive of (positions, normals, uv, indices, material)."""
        self.document["meshes"].append({"primitives": [
            {"attributes": {"POSITION": self.accessor(np.float32(positions), "VEC3"),
                            "NORMAL": self.accessor(np.float32(normals), "VEC3"),
                            "TEXCOORD_0": self.accessor(np.float32(uv), "VEC2")},
             "indices": self.accessor(np.uint32(indices).ravel(), "SCALAR"), "material": material}
            for positions, normals, uv, indices, material in parts]})
        return len(self.document["meshes"]) - 1

    def node(self, mesh, **place):
        self.document["scenes"][0]["nodes"].append(len(self.document["nodes"]))
        self.document["nodes"].append({"mesh": mesh, **place})

    def save(self, path, eye, target, fov):
        gltf.add_camera(self.document, eye, target, fov)
        with open(path, "wb") as file:
            file.write(gltf.write_glb(self.document, self.binary))
        return path


def write_png(pixels):
    """Adds an 8-bit RGB image."""
    height, width, _ = pixels.shape
    rows = np.concatenate([np.zeros((height, 1), np.uint8), pixels.reshape(height, -1)], axis=1)

    def chunk(kind, data):
        return (
            struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
        )

    return (
        b"\x89PNG\r\n\x1a\n"
        + chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0))
        + chunk(b"IDAT", zlib.compress(rows.tobytes(), 1))
        + chunk(b"IEND", b"")
    )


def quad(corner, along, up, material):
    """A parallelogram with front side towards along x up."""
    corner, along, up = (np.asarray(v, float) for v in (corner, along, up))
    normal = np.cross(along, up)
    return (
        np.array([corner, corner + along, corner + along + up, corner + up]),
        np.tile(normal / np.linalg.norm(normal), (4, 1)),
        np.array([[0, 0], [1, 0], [1, 1], [0, 1]]),
        np.array([[0, 1, 2], [0, 2, 3]]),
        material,
    )


def grid(columns, rows, at, material, repeat=1.0):
    """Columns x rows quads over [0, 1]^2, mapped by at(u, v) -> (..., 3); front side towards dv x
    du of `at`."""
    u, v = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, rows + 1), indexing="ij")
    e = 1e-4
    normals = np.cross(at(u + e, v) - at(u - e, v), at(u, v + e) - at(u, v - e)).reshape(-1, 3)
    sizes = np.linalg.norm(normals, axis=1, keepdims=True)
    positions = at(u, v).reshape(-1, 3)
    normals = np.where(sizes > 1e-12, normals / np.maximum(sizes, 1e-12), positions)
    i, k = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    a = (i * (rows + 1) + k).ravel()
    b = a + rows + 1
    triangles = np.concatenate([np.stack([a, b, b + 1], 1), np.stack([a, b + 1, a + 1], 1)])
    return positions, normals, np.stack([u, v], -1).reshape(-1, 2) * repeat, triangles, material


def ball(material, columns=96, rows=48):
    """A sphere of radius 1."""
    def at(u, v):
        phi, theta = 2 * math.pi * u, math.pi * (1 - v)
        return np.stack(
            [np.sin(theta) * np.sin(phi), np.cos(theta), np.sin(theta) * np.cos(phi)], -1
        )
    positions, _, uv, triangles, _ = grid(columns, rows, at, material)
    a, b, c = (positions[triangles[:, i]] for i in range(3))
    whole = (
        np.linalg.norm(np.cross(b - a, c - a), axis=1) > 1e-9
    )  # without those at a pole
    return positions, positions, uv, triangles[whole], material


def cornell_spheres(path):
    """The Cornell box with a metal and a glass ball instead of the blocks."""
    b = Builder()
    white = b.material((0.73, 0.73, 0.73), specular=0)
    red = b.material((0.65, 0.05, 0.05), specular=0)
    green = b.material((0.12, 0.45, 0.15), specular=0)
    lamp = b.material((0, 0, 0), specular=0, emission=(15, 15, 15))
    metal = b.material((0.95, 0.79, 0.53), metallic=1.0, roughness=0.15)
    glass = b.material((1, 1, 1), roughness=0.0, glass=True)
    b.node(
        b.mesh(
            quad((0, 0, 0), (0, 0, 1), (1, 0, 0), white),
            quad((0, 1, 0), (1, 0, 0), (0, 0, 1), white),
            quad((0, 0, 0), (1, 0, 0), (0, 1, 0), white),
            quad((0, 0, 0), (0, 1, 0), (0, 0, 1), red),
            quad((1, 0, 0), (0, 0, 1), (0, 1, 0), green),
        )
    )
    b.node(b.mesh(quad((0.35, 0.999, 0.35), (0.3, 0, 0), (0, 0, 0.3), lamp)))
    b.node(b.mesh(ball(metal)), translation=[0.3, 0.2, 0.3], scale=[0.2, 0.2, 0.2])
    b.node(b.mesh(ball(glass)), translation=[0.7, 0.2, 0.6], scale=[0.2, 0.2, 0.2])
    return b.save(path, (0.5, 0.5, 2.4), (0.5, 0.5, 0), math.radians(39))


def noise_texture(seed):
    """A checked and speckled 512x512 texture."""
    random = np.random.default_rng(seed)
    y, x = np.mgrid[0:512, 0:512]
    base = np.where((x // 64 + y // 64) % 2 == 0, 150, 210) + random.integers(0, 16, (512, 512))
    return (base[..., None] - random.integers(0, 46, 3)).astype(np.uint8)


def hall(path, fineness):
    """A hall of columns under ribs with open sky between them: about 400,000 triangles times
    fineness squared."""
    b = Builder()
    stuff = [b.material((1, 1, 1), metallic=float(i == 3), roughness=0.35 + 0.15 * i,
                        texture=b.texture(noise_texture(i))) for i in range(4)]

    def bump(x, y):
        return 0.02 * (np.sin(40 * x) * np.cos(33 * y) + 0.5 * np.sin(91 * x + 57 * y))

    def fine(n):
        return round(n * fineness)

    def wall(side):
        def at(u, v):
            along = u if side > 0 else 1 - u
            return np.stack([side * (10 + bump(u, v)), 5 * v, 40 * along - 20], -1)
        return at

    def rib(z):
        def at(u, v):
            radius = 10 + 0.3 * np.sin(math.pi * v)
            return np.stack(
                [-radius * np.cos(math.pi * u), 5 + 4 * np.sin(math.pi * u), z + 2 - 2 * v], -1
            )
        return at

    def column(x, z):
        def at(u, v):
            phi = 2 * math.pi * u
            radius = 0.6 + 0.06 * np.cos(16 * phi) + 0.15 * (2 * v - 1) ** 6
            return np.stack([x + radius * np.cos(phi), 6 * v, z - radius * np.sin(phi)], -1)
        return at

    parts = [
        grid(
            fine(200),
            fine(300),
            lambda u, v: np.stack([20 * u - 10, bump(u, v), 20 - 40 * v], -1),
            stuff[0],
            4,
        )
    ]
    parts += [grid(fine(150), fine(60), wall(side), stuff[1], 4) for side in (-1, 1)]
    parts += [grid(fine(120), fine(24), rib(6 * i - 18), stuff[2], 4) for i in range(7)]
    parts += [grid(fine(96), fine(64), column(-6 if i % 2 == 0 else 6, 6 * (i // 2) - 18),
                   stuff[3 if i % 4 == 3 else 1], 4) for i in range(14)]
    b.node(b.mesh(*parts))
    return b.save(path, (1, 2, 17), (1, 2, 0), 1.0)


def field(path, count=10_000):
    """Rotated and scaled copies of three bodies of a few hundred triangles on a plane, each a
    separate node."""
    b = Builder()
    random = np.random.default_rng(5)
    ground = b.material((0.5, 0.45, 0.38), specular=0)
    colors = ((0.7, 0.25, 0.2), (0.2, 0.4, 0.65), (0.85, 0.75, 0.5))
    bodies = []
    for i, color in enumerate(colors):
        stuff = b.material(color, metallic=float(i == 2), roughness=0.4)
        positions, normals, uv, triangles, _ = ball(stuff, 24, 12)
        radius = 1 + 0.2 * np.sin((3 + i) * np.arctan2(positions[:, :1], positions[:, 2:]))
        bodies.append(b.mesh((positions * radius, normals, uv, triangles, stuff)))
    side = math.isqrt(count)
    b.node(b.mesh(quad((-side, 0, side), (2 * side, 0, 0), (0, 0, -2 * side), ground)))
    for i in range(count):
        x, z = 0.9 * (i % side - side / 2), 0.9 * (i // side - side / 2)
        turn, size = random.uniform(0, math.pi), random.uniform(0.2, 0.55)
        b.node(
            bodies[i % 3],
            translation=[x + random.uniform(-0.2, 0.2), 0.9 * size, z + random.uniform(-0.2, 0.2)],
            rotation=[0, math.sin(turn / 2), 0, math.cos(turn / 2)],
            scale=[size, size, size],
        )
    return b.save(path, (0, 9, 0.45 * side + 8), (0, 0, 0.1 * side), math.radians(45))


def export_builtin(binary, names, folder):
    """Writes built-in scenes as exported by the server."""
    paths = {}
    with tempfile.TemporaryDirectory() as data:
        server = subprocess.Popen([binary, "serve", "--port", "0", "--data", data],
                                  stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        try:
            port = int(server.stdout.readline().rsplit(":", 1)[1])
            for name in names:
                connection = http.client.HTTPConnection("127.0.0.1", port, timeout=60)
                connection.request("GET", f"/v1/scenes/{name}/gltf")
                response = connection.getresponse()
                content = response.read()
                if response.status != 200:
                    raise RuntimeError(f"{name}: {response.status} {content[:200]!r}")
                paths[name] = os.path.join(folder, name + ".glb")
                with open(paths[name], "wb") as file:
                    file.write(content)
                without_layers(paths[name])
        finally:
            server.terminate()
            server.wait(30)
    return paths


# Removed from built-in scenes, for all engines: no two of them model these layers identically.
LAYERS = {"KHR_materials_sheen", "KHR_materials_clearcoat"}


def without_layers(path):
    document, buffers, _ = gltf.open_file(path)
    for material in document.get("materials", []):
        for name in LAYERS & set(material.get("extensions", {})):
            del material["extensions"][name]
    used = document.get("extensionsUsed", [])
    document["extensionsUsed"] = [name for name in used if name not in LAYERS]
    if len(document["extensionsUsed"]) < len(used):
        with open(path, "wb") as file:
            file.write(gltf.write_glb(document, buffers[0]))


def packed(path, folder, aspect):
    out = os.path.join(folder, os.path.splitext(os.path.basename(path))[0] + "-packed.glb")
    with open(out, "wb") as file:
        file.write(gltf.pack(path, aspect))
    return out


BUILTIN = ("cornell-box", "veach-mis", "interior", "many-lights")
# Only if named: for bidirectional engines, since path tracers hardly find their light.
HIDDEN_LIGHT = ("glass", "keyhole", "caustic-pool")
MADE = ("cornell-spheres", "hall", "instances", "triangles")
# Products under maps with different distributions of light: soft, a low sun, a small high one.
PRODUCTS = {"bottle": ("WaterBottle.glb", "env/chinese_garden_1k.hdr"),
            "bottle-sunset": ("WaterBottle.glb", "env/venice_sunset_256.hdr"),
            "engine": ("2CylinderEngine.glb", "env/venice_sunset_256.hdr"),
            "engine-sun": ("2CylinderEngine.glb", "env/qwantani_afternoon_puresky_1k.hdr")}


def names(assets):
    return [*BUILTIN, *MADE, *(PRODUCTS if assets else ())]


def prepare(wanted, binary, folder, aspect, assets):
    """Cases by name, in the requested order."""
    os.makedirs(folder, exist_ok=True)
    builtin = export_builtin(binary, [n for n in wanted if n in (*BUILTIN, *HIDDEN_LIGHT)], folder)
    cases = []
    for name in wanted:
        path = os.path.join(folder, name + ".glb")
        if name in builtin:
            cases.append(Case(name, builtin[name]))
        elif name == "cornell-spheres":
            cases.append(Case(name, cornell_spheres(path)))
        elif name == "hall":
            cases.append(Case(name, hall(path, 1.0), sky=[1.0, 1.0, 1.0]))
        elif name == "triangles":  # 2 million
            cases.append(Case(name, hall(path, 2.34), sky=[1.0, 1.0, 1.0]))
        elif name == "instances":
            cases.append(Case(name, field(path), sky=[1.0, 1.0, 1.0]))
        else:
            scene, environment = (os.path.join(assets, part) for part in PRODUCTS[name])
            cases.append(Case(name, packed(scene, folder, aspect), environment))
    return cases
