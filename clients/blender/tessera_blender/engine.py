"""The render engine: exports, uploads, submits, and shows tiles until the job ends."""

from __future__ import annotations

import time
from typing import Any

import bpy
import numpy as np
from tessera_render import Job, TesseraError

from . import cameras, jobs, losses, passes, server
from .following import Following, status
from .preview import Preview

# A look for Esc, and the shortest time between two pictures in Blender's window.
_LOOK_S = 0.1
_DRAW_S = 0.5


class TesseraEngine(bpy.types.RenderEngine):
    """Renders on a Tessera server."""

    bl_idname = "TESSERA"
    bl_label = "Tessera"
    bl_use_postprocess = True
    bl_use_shading_nodes_custom = False
    bl_use_eevee_viewport = True
    bl_use_preview = False

    def update(self, _data: Any, depsgraph: Any) -> None:
        """Exports, uploads and submits."""
        self._job, self._fault = None, ""
        try:
            for loss in losses.of_depsgraph(depsgraph):
                self.report({"WARNING"}, loss)
            self.update_stats("", "Tessera: exporting and uploading")
            client = server.connect()
            uploaded = jobs.upload(client, depsgraph, self.is_animation)
            for warning in uploaded.warnings:
                self.report({"WARNING"}, f"Tessera: {warning}")
            self._job = jobs.submit(client, depsgraph, uploaded)
        except (TesseraError, OSError, ValueError, RuntimeError) as fault:
            self._fault = str(fault)

    def render(self, depsgraph: Any) -> None:
        scene = depsgraph.scene
        if self._job is None:
            self.error_set(f"Tessera: {self._fault}")
            return
        chosen = set(scene.original.tessera.layers)
        for name, channels, _ in passes.declared(chosen):
            self.add_pass(name, len(channels), channels)
        _, _, width, height = cameras.region(scene.render)
        result = self.begin_result(0, 0, width, height, layer=depsgraph.view_layer.name)
        try:
            self._follow(self._job, result, scene.original.tessera.denoise)
            if self._job.revision > 0:
                self._fill(self._job, result, scene.original.tessera.denoise, chosen)
        except TesseraError as fault:
            self.error_set(f"Tessera: {fault}")
        finally:
            self.end_result(result)

    def _follow(self, job: Job, result: Any, denoise: str) -> None:
        following = Following(job)
        following.start()
        shown, drawn = server.connect().job(job.id), 0.0
        while following.is_alive():
            following.join(_LOOK_S)
            if self.test_break() and not job.ended:
                job.cancel()
            if time.monotonic() - drawn < _DRAW_S:
                continue
            drawn = time.monotonic()
            shown.refresh()
            self.update_stats("", status(shown, denoise != "off"))
            self.update_progress(min(max(np.nan_to_num(shown.progress.fraction), 0.0), 1.0))
            news = following.news()
            if news is not None:
                self._set(result, "Combined", passes.combined(*news))
                self.update_result(result)
        if following.fault is not None:
            raise following.fault
        job.wait()
        self.update_stats("", status(job, denoise != "off"))
        for warning in job.warnings:
            self.report({"WARNING"}, f"Tessera: {warning}")
        news = following.news()
        if news is not None:
            self._set(result, "Combined", passes.combined(*news))

    @staticmethod
    def _set(result: Any, name: str, image: np.ndarray) -> None:
        """Sets a pass; image: (height, width, channels), top row first."""
        values = passes.rect(image)
        rect = result.layers[0].passes[name].rect
        try:
            rect.foreach_set(values.ravel())
        except TypeError:  # Blender 3: an array of pixels
            rect.foreach_set(values)

    def _fill(self, job: Job, result: Any, denoise: str, chosen: set[str]) -> None:
        """The denoised image, if it is asked for, and the other passes."""
        if denoise != "off" and job.state == "finished":
            image = job.image(denoise=denoise)
            alpha = image[..., 3] if image.shape[2] == 4 else np.ones(image.shape[:2], np.float32)
            self._set(result, "Combined", passes.combined(image[..., :3], alpha))
        found: dict[str, np.ndarray] = {}
        camera = job.objects()["camera"]
        corner = job.tile_image()
        for each in passes.PASSES:
            if each.layer in chosen:
                image = job.image(each.layer)
                found[each.name] = passes.values(each.layer, image, camera, corner.x, corner.y)
        for layer in passes.CRYPTOMATTES:
            if layer in chosen:
                exr = job.picture("exr", layer=layer)
                planes, told = passes.mattes(layer, exr, result.layers[0].name)
                found |= planes
                # The fields of the part that is filled here would be lost with it.
                for name, text in told.items():
                    self.get_result().stamp_data_add_field(name, text)
        for name, image in found.items():
            self._set(result, name, image)

    def view_update(self, _context: Any, depsgraph: Any) -> None:
        """Called where a viewport with Rendered shading begins, and where the scene changes."""
        if not hasattr(self, "_preview"):
            self._preview = Preview(self)
        self._preview.scene_changed(depsgraph)

    def view_draw(self, context: Any, depsgraph: Any) -> None:
        self._preview.draw(context, depsgraph.scene)

    def update_render_passes(self, scene: Any, view_layer: Any) -> None:
        self.register_pass(scene, view_layer, "Combined", 4, "RGBA", "COLOR")
        for name, channels, kind in passes.declared(set(scene.tessera.layers)):
            self.register_pass(scene, view_layer, name, len(channels), channels, kind)
