"""What a render by Tessera lacks of a Blender scene, in sentences. Needs no Blender."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

from . import cameras, lights, worlds

# Nodes that Blender's exporter understands before an input of Principled BSDF.
_UNDERSTOOD = {
    "TEX_IMAGE", "NORMAL_MAP", "SEPRGB", "SEPARATE_COLOR", "COMBRGB", "COMBINE_COLOR", "MAPPING",
    "UVMAP", "TEX_COORD", "RGB", "VALUE", "VERTEX_COLOR", "MIX", "MIX_RGB", "MATH", "REROUTE",
    "ATTRIBUTE",
}  # fmt: skip
# Inputs of Principled BSDF without a counterpart in glTF, by the names of Blender 4 and 3.
_ABSENT = ("Subsurface Weight", "Subsurface", "Diffuse Roughness", "Thin Film Thickness")
_DRAWN = {"MESH", "CURVE", "SURFACE", "FONT", "META"}
# Types of objects that the exporter leaves out.
_LEFT_OUT = {
    "CURVES": "hair curves", "VOLUME": "a volume", "POINTCLOUD": "a point cloud",
    "GPENCIL": "grease pencil", "GREASEPENCIL": "grease pencil", "LIGHT_PROBE": "a light probe",
}  # fmt: skip


def _behind(socket: Any) -> Iterator[Any]:
    """The nodes that a socket's value comes from."""
    waiting, seen = [link.from_node for link in socket.links], set()
    while waiting:
        node = waiting.pop()
        if node.name in seen:
            continue
        seen.add(node.name)
        yield node
        waiting += [link.from_node for each in node.inputs for link in each.links]


def of_material(material: Any) -> Iterator[str]:
    if not material.use_nodes or material.node_tree is None:
        return
    outputs = [node for node in material.node_tree.nodes if node.type == "OUTPUT_MATERIAL"]
    shown = [node for node in outputs if node.is_active_output] or outputs
    if not shown:
        return
    for name in ("Volume", "Displacement"):
        if shown[0].inputs[name].is_linked:
            yield f'Material "{material.name}": {name.lower()}'
    surface = shown[0].inputs["Surface"]
    if not surface.is_linked:
        return
    node = surface.links[0].from_node
    if node.type not in ("BSDF_PRINCIPLED", "EMISSION"):
        yield f'Material "{material.name}": node "{node.name}"; only Principled BSDF is sent whole'
        return
    for socket in node.inputs:
        if not socket.is_linked and socket.name in _ABSENT and socket.default_value > 0:
            yield f'Material "{material.name}": {socket.name.lower()}'
    odd = {each.name for socket in node.inputs for each in _behind(socket)
           if each.type not in _UNDERSTOOD}  # fmt: skip
    for name in sorted(odd):
        yield f'Material "{material.name}": node "{name}"; bake it into an image'


def of_light(light: Any) -> Iterator[str]:
    told = f'Light "{light.name}": '
    if light.type in ("POINT", "SPOT") and light.shadow_soft_size > 0:
        yield told + "its size; its shadows are sharp"
    if light.type == "SPOT" and light.spot_blend > 0:
        yield told + "the shape of its blend is that of glTF"
    # The real sun's disc is half a degree wide.
    if light.type == "SUN" and light.angle > 0.0175:
        yield told + "its angle; its shadows are sharp"
    if light.type == "AREA" and getattr(light, "spread", 3.15) < 3.1:
        yield told + "its spread"
    if not light.use_nodes or light.node_tree is None:
        return
    node = lights.emission_node(light)
    if node is None:
        if light.node_tree.nodes:
            yield told + "its nodes"
        return
    for each in _behind(node.inputs["Strength"]):
        if each.type != "LIGHT_FALLOFF":
            yield told + f'node "{each.name}"'
    for each in _behind(node.inputs["Color"]):
        yield told + f'node "{each.name}"'


def of_camera(camera: Any) -> Iterator[str]:
    told = f'Camera "{camera.name}": '
    if camera.type == "PANO":
        kind = cameras.panorama_type(camera)
        if kind != "EQUIRECTANGULAR":
            yield told + f"panorama {kind.lower()}; all directions are rendered instead"
    elif camera.type == "CUSTOM":
        yield told + "its own code"
    dof = camera.dof
    if dof.use_dof and camera.type != "PANO" and (
        dof.aperture_blades > 2 or abs(dof.aperture_ratio - 1) > 1e-6
    ):
        yield told + "blades and ratio of its aperture, which is round"


def _of_object(thing: Any) -> Iterator[str]:
    told = f'"{thing.name}": '
    if thing.type in _LEFT_OUT:
        yield told + f"{_LEFT_OUT[thing.type]} is left out"
    if getattr(thing, "particle_systems", None):
        yield told + "its particles and hair are left out"
    drawn = thing.type in _DRAWN
    apart = ("is_shadow_catcher", "is_holdout")
    if drawn and any(getattr(thing, name, False) for name in apart):
        yield told + "shadow catcher or holdout; it is an ordinary object"
    rays = ("visible_camera", "visible_shadow", "visible_diffuse", "visible_glossy")
    if drawn and not all(getattr(thing, name, True) for name in rays):
        yield told + "invisible to some rays; all rays see it"
    for modifier in thing.modifiers:
        if modifier.show_viewport != modifier.show_render or (
            modifier.type == "SUBSURF" and modifier.levels != modifier.render_levels
        ):
            yield told + f'modifier "{modifier.name}" is that of the viewport'


def of_scene(scene: Any, things: Any) -> list[str]:
    """Sentences on what a render lacks. things: the scene's objects that are rendered."""
    render = scene.render
    found: list[str] = []
    if render.pixel_aspect_x != render.pixel_aspect_y:
        found.append("Pixels are square")
    if render.use_motion_blur:
        found.append("Motion blur")
    if len([layer for layer in scene.view_layers if layer.use]) > 1:
        found.append("Each view layer shows all objects")
    if render.use_multiview:
        found.append("Stereo: the camera's own view is rendered")
    found += worlds.read_world(scene.world).losses
    if scene.camera is not None:
        found += of_camera(scene.camera.data)
    lamps: dict[str, Any] = {}
    materials: dict[str, Any] = {}
    for thing in things:
        found += _of_object(thing)
        if thing.type == "LIGHT":
            lamps[thing.data.name] = thing.data
        elif thing.type in _DRAWN:
            shown = [slot.material for slot in thing.material_slots if slot.material is not None]
            materials |= {material.name: material for material in shown}
    for lamp in lamps.values():
        found += of_light(lamp)
    for material in materials.values():
        found += of_material(material)
    return found


def of_depsgraph(depsgraph: Any) -> list[str]:
    scene = depsgraph.scene.original
    return of_scene(scene, [thing for thing in scene.objects if not thing.hide_render])
