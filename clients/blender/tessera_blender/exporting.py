"""The scene as glTF, by Blender's own exporter, with lights in the server's units."""

from __future__ import annotations

import base64
import json
import math
import struct
from contextlib import nullcontext
from pathlib import Path
from typing import Any

import bpy

from . import lights

# Separate files, so that images that the server has already are not sent again. Without cameras,
# which are part of the job: a scene is then the same for every camera.
_OPTIONS = {
    "export_format": "GLTF_SEPARATE",
    "check_existing": False,
    "use_active_scene": True,
    "use_renderable": True,
    "export_apply": True,
    "export_cameras": False,
    "export_lights": True,
    "export_animations": False,
    "export_current_frame": True,
    "export_rest_position_armature": False,
    "export_skins": False,
    "export_morph": False,
    "export_gn_mesh": True,
    "export_yup": True,
}
# The exporter's names of the convention of lights: Blender 3.6 on, and before.
_CONVENTION = ("export_import_convert_lighting_mode", "convert_lighting_mode")


def _options() -> dict[str, Any]:
    """The options that this version has: those that later versions added only leave out less."""
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    options = {name: value for name, value in _OPTIONS.items() if name in known}
    convention = [name for name in _CONVENTION if name in known]
    if not convention:
        raise RuntimeError("Blender's glTF exporter has no convention of lights that is known here")
    return options | {convention[0]: "COMPAT"}


def _punctual_lights(document: dict[str, Any]) -> None:
    listed = document.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", [])
    for light in listed:
        source = bpy.data.lights[light["name"]]
        light["intensity"] = lights.intensity(source, light["intensity"])
        if bpy.app.version < (3, 6):
            light["intensity"] *= lights.mean_of_cone(source)
        light["color"] = lights.color(source)


def _add_panel(document: dict[str, Any], name: str, corners: Any, radiance: list[float]) -> None:
    """Adds an emissive polygon, a fan of triangles about its first corner."""
    flat = [value for corner in corners for value in corner]
    order = [i for k in range(1, len(corners) - 1) for i in (0, k, k + 1)]
    data = struct.pack(f"<{len(flat)}f{len(order)}I", *flat, *order)
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()

    def add(member: str, value: Any) -> int:
        document.setdefault(member, []).append(value)
        return len(document[member]) - 1

    buffer = add("buffers", {"byteLength": len(data), "uri": uri})
    size = 4 * len(flat)
    bounds = {key: [f(c[axis] for c in corners) for axis in range(3)]
              for key, f in (("min", min), ("max", max))}  # fmt: skip
    positions = add("accessors", {
        "bufferView": add("bufferViews", {"buffer": buffer, "byteLength": size}),
        "componentType": 5126, "type": "VEC3", "count": len(corners), **bounds,
    })  # fmt: skip
    indices = add("accessors", {
        "bufferView": add("bufferViews", {
            "buffer": buffer, "byteOffset": size, "byteLength": 4 * len(order)}),
        "componentType": 5125, "type": "SCALAR", "count": len(order),
    })  # fmt: skip
    strength = max(radiance)
    material: dict[str, Any] = {
        "name": name,
        "pbrMetallicRoughness": {"baseColorFactor": [0, 0, 0, 1], "metallicFactor": 0},
        "emissiveFactor": [value / strength for value in radiance],
        "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": strength},
                       "KHR_materials_specular": {"specularFactor": 0}},
    }  # fmt: skip
    used = document.setdefault("extensionsUsed", [])
    used += [each for each in material["extensions"] if each not in used]
    primitive = {
        "attributes": {"POSITION": positions},
        "indices": indices,
        "material": add("materials", material),
    }
    mesh = add("meshes", {"name": name, "primitives": [primitive]})
    node = add("nodes", {"name": name, "mesh": mesh})
    document["scenes"][document.get("scene", 0)].setdefault("nodes", []).append(node)


def _dull_materials(document: dict[str, Any]) -> None:
    """Before Blender 4, Specular 0 becomes black, which in glTF reflects at grazing angles."""
    for material in document.get("materials", []) if bpy.app.version < (4,) else ():
        specular = material.get("extensions", {}).get("KHR_materials_specular", {})
        if not any(specular.get("specularColorFactor", [1])):
            specular["specularFactor"] = 0


def _area_lights(document: dict[str, Any], depsgraph: Any) -> None:
    factor = math.pi if bpy.app.version >= (4,) else 4.0
    for instance in depsgraph.object_instances:
        thing = instance.object
        if thing.type == "LIGHT" and thing.data.type == "AREA" and instance.show_self:
            corners, radiance = lights.panel(thing.data, instance.matrix_world, factor)
            rgb = [max(0.0, radiance * c) for c in lights.color(thing.data)]
            if any(rgb):
                _add_panel(document, thing.name, corners, rgb)


def export(depsgraph: Any, folder: Path) -> Path:
    """Writes the scene of a dependency graph at its frame, and returns the .gltf file."""
    scene = depsgraph.scene.original
    path = folder / "scene.gltf"
    # The exporter of Blender 5.0 cannot write a light with a temperature: _punctual_lights() does.
    warm = [light for light in bpy.data.lights if getattr(light, "use_temperature", False)]
    for light in warm:
        light.use_temperature = False
    other = bpy.context.scene != scene
    try:
        with bpy.context.temp_override(scene=scene) if other else nullcontext():
            bpy.ops.export_scene.gltf(filepath=str(path), **_options())
    finally:
        for light in warm:
            light.use_temperature = True
    document = json.loads(path.read_text(encoding="utf-8"))
    _punctual_lights(document)
    _dull_materials(document)
    _area_lights(document, depsgraph)
    path.write_text(json.dumps(document), encoding="utf-8")
    return path
