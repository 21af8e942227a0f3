"""Panels, and the operators that send a scene and list its losses."""

from __future__ import annotations

from typing import Any

import bpy
from tessera_render import TesseraError

from . import jobs, losses, server
from .engine import TesseraEngine

# Panels of other engines that hold settings of their own.
_OTHERS = {
    "VIEWLAYER_PT_filter", "VIEWLAYER_PT_layer_passes", "RENDER_PT_simplify",
    "RENDER_PT_freestyle", "RENDER_PT_gpencil",
}  # fmt: skip
# Panels of materials, lights and worlds that Blender keeps for each engine.
_BORROWED = (
    "EEVEE_MATERIAL_PT_context_material", "EEVEE_MATERIAL_PT_surface", "EEVEE_WORLD_PT_surface",
    "DATA_PT_EEVEE_light", "RENDER_PT_color_management",
)  # fmt: skip


class TESSERA_OT_losses(bpy.types.Operator):
    """Lists what a render by Tessera lacks of this scene"""

    bl_idname = "tessera.losses"
    bl_label = "Check Scene"

    def execute(self, context: Any) -> set[str]:
        found = losses.of_depsgraph(context.evaluated_depsgraph_get())
        for loss in found:
            self.report({"WARNING"}, loss)
        if not found:
            self.report({"INFO"}, "Tessera renders all of this scene")
        return {"FINISHED"}


class TESSERA_OT_send(bpy.types.Operator):
    """Submits this scene to the server and opens its page, whatever the render engine"""

    bl_idname = "tessera.send"
    bl_label = "Send to Tessera"

    def execute(self, context: Any) -> set[str]:
        depsgraph = context.evaluated_depsgraph_get()
        try:
            client = server.connect()
            uploaded = jobs.upload(client, depsgraph)
            job = jobs.submit(client, depsgraph, uploaded)
        except (TesseraError, OSError, ValueError, RuntimeError) as fault:
            self.report({"ERROR"}, f"Tessera: {fault}")
            return {"CANCELLED"}
        for text in [*losses.of_depsgraph(depsgraph), *uploaded.warnings, *job.warnings]:
            self.report({"WARNING"}, text)
        address = f"{client.server}/#/jobs/{job.id}"
        self.report({"INFO"}, f"Tessera: {address}")
        if not bpy.app.background:
            bpy.ops.wm.url_open(url=address)
        return {"FINISHED"}


class _Panel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"
    bl_context = "render"

    @classmethod
    def poll(cls, context: Any) -> bool:
        return context.engine == TesseraEngine.bl_idname


class TESSERA_PT_sampling(_Panel, bpy.types.Panel):
    """When to stop, and how light is traced"""

    bl_label = "Sampling"

    def draw(self, context: Any) -> None:
        self.layout.use_property_split = True
        for name in ("error_percent", "samples", "seconds", "denoise", "preview_samples",
                     "integrator", "max_depth", "seed"):  # fmt: skip
            self.layout.prop(context.scene.tessera, name)
        self.layout.prop(context.scene.render, "preview_pixel_size")


class TESSERA_PT_losses(_Panel, bpy.types.Panel):
    """What a render lacks of this scene"""

    bl_label = "Not Rendered"

    def draw(self, context: Any) -> None:
        found = losses.of_depsgraph(context.evaluated_depsgraph_get())
        for loss in found:
            self.layout.label(text=loss, icon="ERROR")
        if not found:
            self.layout.label(text="All of this scene is rendered")
        self.layout.operator("tessera.losses")
        self.layout.operator("tessera.send")


class TESSERA_PT_passes(_Panel, bpy.types.Panel):
    """Layers of the job as render passes"""

    bl_label = "Passes"
    bl_context = "view_layer"

    def draw(self, context: Any) -> None:
        self.layout.column().prop(context.scene.tessera, "layers")


CLASSES = (
    TESSERA_OT_losses, TESSERA_OT_send, TESSERA_PT_sampling, TESSERA_PT_losses, TESSERA_PT_passes,
)  # fmt: skip


def _menu(self: Any, _context: Any) -> None:
    self.layout.operator("tessera.send")


def _shared_panels() -> list[Any]:
    """Blender's panels that any engine can use."""
    return [
        panel for panel in bpy.types.Panel.__subclasses__()
        if hasattr(panel, "COMPAT_ENGINES") and panel.__name__ not in _OTHERS
        and ("BLENDER_RENDER" in panel.COMPAT_ENGINES or panel.__name__ in _BORROWED)
    ]  # fmt: skip


def attach() -> None:
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.add(TesseraEngine.bl_idname)
    # Without a window, as for a module of Python, there are no menus.
    if hasattr(bpy.types, "TOPBAR_MT_render"):
        bpy.types.TOPBAR_MT_render.append(_menu)


def detach() -> None:
    if hasattr(bpy.types, "TOPBAR_MT_render"):
        bpy.types.TOPBAR_MT_render.remove(_menu)
    for panel in _shared_panels():
        panel.COMPAT_ENGINES.discard(TesseraEngine.bl_idname)
