"""Cycles through Blender's Python module (PyPI's bpy, or an installed Blender), with Blender's own
glTF reader: of all files that it reads, also of those with features that the other adapters refuse.
The differences of the long renders tell whether it understands them alike."""

import os

import bpy
import gltf
import numpy as np


class Engine:
    def __init__(self, job):
        self.job = job
        self.version = f"Cycles of Blender {bpy.app.version_string}"
        bpy.ops.wm.read_factory_settings(use_empty=True)
        # COMPAT: candela and lux are W/sr and W/m2, as in all other engines here.
        bpy.ops.import_scene.gltf(filepath=job["scene"], import_shading="NORMALS",
                                  export_import_convert_lighting_mode="COMPAT")
        scene = self.scene = bpy.context.scene
        camera = next(o for o in scene.objects if o.type == "CAMERA")
        scene.camera = camera
        camera.data.sensor_fit = "VERTICAL"
        camera.data.angle = gltf.vertical_fov(job["scene"])
        for material in bpy.data.materials:
            if not material.use_backface_culling or not hasattr(
                material.cycles, "emission_sampling"
            ):
                continue
            material.cycles.emission_sampling = (
                "FRONT"  # single-sided emitter; AUTO samples both sides
            )
        self.world(scene)
        self.settings(scene)

    def world(self, scene):
        world = scene.world = bpy.data.worlds.new("world")
        world.use_nodes = True
        nodes, links = world.node_tree.nodes, world.node_tree.links
        background = next(n for n in nodes if n.type == "BACKGROUND")
        background.inputs["Color"].default_value = (*(self.job["sky"] or (0, 0, 0)), 1)
        background.inputs["Strength"].default_value = 1
        if self.job["environment"]:
            image = nodes.new("ShaderNodeTexEnvironment")
            image.image = bpy.data.images.load(self.job["environment"])
            # Blender's directions are those of glTF, converted to its axes: +x is the centre.
            links.new(image.outputs["Color"], background.inputs["Color"])

    def settings(self, scene):
        render, cycles = scene.render, scene.cycles
        render.engine = "CYCLES"
        cycles.device = "CPU"
        render.threads_mode, render.threads = "FIXED", self.job["threads"]
        render.resolution_x, render.resolution_y = self.job["width"], self.job["height"]
        render.resolution_percentage = 100
        render.use_persistent_data = True
        cycles.use_adaptive_sampling = cycles.use_denoising = False
        cycles.pixel_filter_type = "BOX"
        cycles.filter_width = 1
        # Disables biased noise reduction: clamps, blurred caustics, skipped lights.
        cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
        cycles.blur_glossy = 0
        cycles.caustics_reflective = cycles.caustics_refractive = True
        cycles.light_sampling_threshold = 0
        # Blender counts bounces after the first surface.
        bounces = max(self.job["depth"] - 1, 0)
        for name in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
            setattr(cycles, name, bounces)
        render.film_transparent = False
        render.use_compositing = render.use_sequencer = False
        image = render.image_settings
        image.file_format, image.color_mode, image.color_depth = "OPEN_EXR", "RGB", "32"
        image.exr_codec = "NONE"

    def render(self, samples, seed):
        scene = self.scene
        scene.cycles.samples, scene.cycles.seed = samples, seed
        scene.render.filepath = os.path.join(self.job["folder"], "cycles.exr")
        bpy.ops.render.render(write_still=True)
        image = bpy.data.images.load(scene.render.filepath, check_existing=False)
        image.colorspace_settings.name = "Non-Color"
        values = np.empty(len(image.pixels), np.float32)
        image.pixels.foreach_get(values)
        width, height = image.size
        bpy.data.images.remove(image)
        return values.reshape(height, width, -1)[::-1, :, :3]
