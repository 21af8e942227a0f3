"""Rendered shading of a viewport: the server's previews, seen as the viewport looks.

A process of its own (preview_process.py) talks to the server, because Blender cannot stand threads
of Python while it draws. The two share a folder; orders go through the process's input.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
import time
import uuid
from dataclasses import asdict
from pathlib import Path
from typing import Any

import bpy
import gpu
import numpy as np
from gpu_extras.presets import draw_texture_2d
from tessera_render import TesseraError

from . import cameras, exporting, jobs, server
from .main_thread import with_window
from .preview_process import IMAGE, STATUS, read_image

# A look for news, and how long a scene must be left alone before it is exported, which holds
# Blender's window.
_LOOK_S = 0.05
_CALM_S = 0.3


def _changes_document(update: Any) -> bool:
    """Whether the exported document may differ. Cameras and worlds are part of the job."""
    changed = update.id
    is_camera = isinstance(changed, bpy.types.Object) and changed.type == "CAMERA"
    return not (
        is_camera or isinstance(changed, (bpy.types.Scene, bpy.types.World, bpy.types.Camera))
    )


def _start(folder: Path) -> subprocess.Popen[str]:
    home = Path(__file__).parent
    paths = os.pathsep.join([str(home.parent), *sys.path])
    return subprocess.Popen(
        [sys.executable, "-m", f"{home.name}.preview_process", str(folder)],
        stdin=subprocess.PIPE, text=True, env=os.environ | {"PYTHONPATH": paths},
        creationflags=getattr(subprocess, "CREATE_NO_WINDOW", 0),
    )  # fmt: skip


class Preview:
    """What one viewport shows."""

    def __init__(self, engine: Any) -> None:
        self._engine = engine
        self._key = f"blender {uuid.uuid4()}"
        self._home = tempfile.TemporaryDirectory(prefix="tessera-")
        self._folder = Path(self._home.name)
        self._process = _start(self._folder)
        self._export_at: float | None = time.monotonic()
        self._view: tuple[Any, ...] = ()
        self._ordered_view: tuple[Any, ...] = ()
        self._world: Any = None  # to be read
        self._exports = 0
        self._seen: dict[str, int] = {}
        self._image: np.ndarray | None = None
        self._status = "Tessera: exporting"
        bpy.app.timers.register(self._look)

    def scene_changed(self, depsgraph: Any) -> None:
        if any(_changes_document(update) for update in depsgraph.updates):
            self._export_at = time.monotonic() + _CALM_S
        self._world = None  # settings of the scene may have changed, too

    def draw(self, context: Any, scene: Any) -> None:
        """Draws the newest image over the region, whatever its size."""
        region, eye = context.region, context.region_data
        pixel = {"AUTO": 1, "1": 1, "2": 2, "4": 4, "8": 8}[scene.render.preview_pixel_size]
        size = (-(-region.width // pixel), -(-region.height // pixel))
        matrices = [[list(row) for row in m] for m in (eye.window_matrix, eye.view_matrix)]
        self._view = (*matrices, *size)
        self._engine.update_stats("", self._status)
        if self._image is None:
            return
        height, width = self._image.shape[:2]
        pixels = gpu.types.Buffer("FLOAT", height * width * 4, self._image.ravel())
        texture = gpu.types.GPUTexture((width, height), format="RGBA16F", data=pixels)
        gpu.state.blend_set("ALPHA_PREMULT")
        self._engine.bind_display_space_shader(scene)
        draw_texture_2d(texture, (0, 0), region.width, region.height)
        self._engine.unbind_display_space_shader()
        gpu.state.blend_set("NONE")

    def _look(self) -> float | None:
        try:
            self._engine.is_preview  # noqa: B018: raises where the viewport has ended
            try:
                self._order()
            except (TesseraError, OSError, ValueError, RuntimeError) as fault:
                self._status = f"Tessera: {fault}"
            if self._take_news():
                self._engine.tag_redraw()
        except ReferenceError:
            self._process.communicate()
            self._home.cleanup()
            return None
        return _LOOK_S

    def _order(self) -> None:
        """Has the scene uploaded and a preview submitted where they have changed."""
        is_busy = bpy.context.mode != "OBJECT"  # The exporter would leave that mode.
        if self._export_at is not None and time.monotonic() >= self._export_at and not is_busy:
            self._export_at = None
            self._send({"document": str(with_window(self._export))})
        if self._view and (self._world is None or self._view != self._ordered_view):
            self._ordered_view = self._view
            scene = bpy.context.scene
            if self._world is None:
                self._world = self._read_world(scene)
            camera = cameras.of_view(*self._view)
            request = jobs.preview(scene, camera, self._view[2:], self._key)
            client = server.connect()
            place = {"server": client.server, "key": client.key}
            self._send({"request": request} | self._world | place)

    def _send(self, order: dict[str, Any]) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(json.dumps(order) + "\n")
        self._process.stdin.flush()

    def _export(self) -> Path:
        self._exports += 1
        folder = self._folder / str(self._exports)
        folder.mkdir()
        return exporting.export(bpy.context.evaluated_depsgraph_get(), folder)

    def _read_world(self, scene: Any) -> dict[str, Any]:
        world, content = jobs.read_world(scene)
        if isinstance(content, bytes):
            path = self._folder / "world.exr"
            path.write_bytes(content)
            content = path
        image = None if content is None else str(content)
        return {"world": asdict(world) | {"image": image}}

    def _take_news(self) -> bool:
        """Whether the process has written an image or a status since the last look."""
        found = False
        for name in (IMAGE, STATUS):
            path = self._folder / name
            at = path.stat().st_mtime_ns if path.exists() else 0
            if at == self._seen.get(name, 0):
                continue
            self._seen[name], found = at, True
            if name == STATUS:
                self._status = path.read_text(encoding="utf-8")
            else:
                self._image = read_image(path)
        return found
