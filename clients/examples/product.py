"""The product of the examples, made by code: a vase in four glazes, and studio lighting."""

from __future__ import annotations

import numpy as np

from simple_glb import Glb

GLAZES = {
    "ivory": {"baseColorFactor": [0.85, 0.80, 0.68, 1], "roughnessFactor": 0.6}, "cobalt":
    {"baseColorFactor": [0.05, 0.10, 0.45, 1], "roughnessFactor": 0.15}, "oxblood":
    {"baseColorFactor": [0.40, 0.03, 0.03, 1], "roughnessFactor": 0.3}, "copper":
    {"baseColorFactor": [0.95, 0.55, 0.40, 1], "roughnessFactor": 0.25, "metallicFactor": 1},
}  # fmt: skip


def vase() -> bytes:
    """A surface of revolution, 30 cm high, whose primitive has a material for each variant."""
    rings, around = 48, 64
    height = np.linspace(0, 0.3, rings)
    radius = 0.06 + 0.03 * np.sin(height * 20) * (1 - height)
    angle = np.linspace(0, 2 * np.pi, around, endpoint=False)
    slope = np.gradient(radius, height)
    up, turn = np.meshgrid(np.arange(rings), angle, indexing="ij")
    ring = radius[up.astype(int)]
    points = np.stack([ring * np.sin(turn), height[up.astype(int)], ring * np.cos(turn)], axis=-1)
    normals = np.stack([np.sin(turn), -slope[up.astype(int)], np.cos(turn)], axis=-1)
    normals /= np.linalg.norm(normals, axis=-1, keepdims=True)
    triangles = []
    for row in range(rings - 1):
        for column in range(around):
            a, b = row * around + column, row * around + (column + 1) % around
            triangles += [(a, b, b + around), (a, b + around, a + around)]
    glb = Glb()
    materials = [
        glb.add_material(name, doubleSided=True, pbrMetallicRoughness={"metallicFactor": 0} | glaze)
        for name, glaze in GLAZES.items()
    ]
    primitive = glb.add_primitive(
        points.reshape(-1, 3), triangles, materials[0], normals=normals.reshape(-1, 3)
    )
    mappings = [{"material": m, "variants": [i]} for i, m in enumerate(materials)]
    primitive["extensions"] = {"KHR_materials_variants": {"mappings": mappings}}
    names = [{"name": name} for name in GLAZES]
    glb.document["extensions"] = {"KHR_materials_variants": {"variants": names}}
    glb.document["extensionsUsed"] = ["KHR_materials_variants"]
    glb.add_node(name="vase", mesh=glb.add("meshes", {"primitives": [primitive]}))
    return glb.bytes()


def studio() -> bytes:
    """An environment (Radiance format): a dim room with two large lamps, one warm, one cold."""
    height, width = 32, 64
    light = np.full((height, width, 3), 0.15)
    light[4:12, 4:16] = [9, 7.5, 6]
    light[8:18, 40:48] = [3, 3.6, 4.5]
    _, exponent = np.frexp(light.max(axis=-1))
    mantissa = light * np.exp2(8.0 - exponent)[..., np.newaxis]
    rgbe = np.concatenate([mantissa, exponent[..., np.newaxis] + 128], axis=-1).astype(np.uint8)
    head = f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n"
    return head.encode() + rgbe.tobytes()
