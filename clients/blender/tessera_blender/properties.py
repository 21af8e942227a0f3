"""Settings of a scene, and the add-on's preferences."""

from __future__ import annotations

import bpy
from bpy.props import EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty

from . import passes

_LAYERS = [(each.layer, each.name, each.summary) for each in passes.PASSES] + [
    ("cryptomatte:object", "Cryptomatte Object", "Mattes of objects by name"),
    ("cryptomatte:material", "Cryptomatte Material", "Mattes of materials by name"),
]
_INTEGRATORS = [
    ("path", "Path", "Path tracing: most scenes"),
    ("path-caustics", "Path and caustics", "Path tracing, with photons for caustics"),
    ("auto", "Automatic", "Short trials select the integrator"),
    ("bdpt", "Bidirectional", "Bidirectional path tracing: indirect light"),
    ("mlt", "Metropolis", "Metropolis light transport: light through small openings"),
    ("sppm", "Photons", "Progressive photon mapping: caustics"),
    ("vcm", "Connection and merging", "Bidirectional with photons: caustics beside other light"),
]
_DENOISE = [
    ("off", "Off", "The image as it was sampled"),
    ("mixed", "Mixed", "Denoised where that is better; converges to the plain image"),
    ("full", "Full", "The denoiser's own image, which may stay biased"),
]


def _new_layers(_settings: object, context: bpy.types.Context) -> None:
    """Lets the compositor's nodes show the passes that the engine offers now."""
    context.view_layer.update_render_passes()


class TesseraSettings(bpy.types.PropertyGroup):
    """Settings of a scene: `scene.tessera`."""

    error_percent: FloatProperty(
        name="Error", default=3.0, min=0.0, max=100.0, precision=2,
        description="Stop when the average pixel is at most this far off, in percent, with 95% "
        "confidence; 0: no such rule",
    )  # fmt: skip
    samples: IntProperty(
        name="Max Samples", default=4096, min=1, max=65536,
        description="Stop at this number of samples per pixel",
    )  # fmt: skip
    preview_samples: IntProperty(
        name="Viewport Samples", default=64, min=1, max=65536,
        description="Samples per pixel of Rendered shading in the viewport",
    )  # fmt: skip
    seconds: FloatProperty(
        name="Max Seconds", default=0.0, min=0.0, max=604800.0,
        description="Stop after this time; 0: no such rule",
    )  # fmt: skip
    denoise: EnumProperty(name="Denoise", items=_DENOISE, default="mixed")
    integrator: EnumProperty(name="Integrator", items=_INTEGRATORS, default="path")
    max_depth: IntProperty(
        name="Max Depth", default=16, min=0, max=1024,
        description="Scattering events on a path; Cycles' total bounces plus 1",
    )  # fmt: skip
    seed: IntProperty(name="Seed", default=0, min=0)
    layers: EnumProperty(
        name="Passes", items=_LAYERS, options={"ENUM_FLAG"}, default=set(), update=_new_layers
    )


class TesseraPreferences(bpy.types.AddonPreferences):
    """The server."""

    bl_idname = __package__

    address: StringProperty(
        name="Server", default="",
        description="Such as http://render:8080; empty: a private server on this computer",
    )  # fmt: skip
    key: StringProperty(
        name="Key", default="", subtype="PASSWORD", description="Key of the server, if it needs one"
    )
    program: StringProperty(
        name="Program", default="", subtype="FILE_PATH",
        description="The program tessera of a private server; empty: the one in PATH. A change "
        "takes effect when Blender starts",
    )  # fmt: skip

    def draw(self, _context: bpy.types.Context) -> None:
        for name in ("address", "key", "program"):
            self.layout.prop(self, name)


CLASSES = (TesseraSettings, TesseraPreferences)


def attach() -> None:
    bpy.types.Scene.tessera = PointerProperty(type=TesseraSettings)


def detach() -> None:
    del bpy.types.Scene.tessera
