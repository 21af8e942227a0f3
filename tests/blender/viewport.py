"""Tests Rendered shading in a window of Blender, by the colour of a cube on the screen: see run.

    blender --python viewport.py -- BINARY ZIP
"""

import os
import pathlib
import sys
import tempfile
import time
import traceback

import bpy
import numpy as np
from bpy_extras.view3d_utils import location_3d_to_region_2d

BINARY, ZIP = sys.argv[sys.argv.index("--") + 1:]
PATIENCE_S = 60
FOLDER = tempfile.TemporaryDirectory()


def viewport():
    window = bpy.context.window_manager.windows[0]
    area = next(a for a in window.screen.areas if a.type == "VIEW_3D")
    return window, area, next(r for r in area.regions if r.type == "WINDOW")


def cube_color():
    """The colour on the screen where the viewport draws the middle of the cube."""
    window, area, region = viewport()
    path = str(pathlib.Path(FOLDER.name) / "screen.png")
    with bpy.context.temp_override(window=window, area=area):
        bpy.ops.screen.screenshot(filepath=path)
    image = bpy.data.images.load(path)
    width, height = image.size
    pixels = np.empty(width * height * 4, np.float32)
    image.pixels.foreach_get(pixels)
    bpy.data.images.remove(image)
    place = bpy.data.objects["Cube"].location
    x, y = location_3d_to_region_2d(region, area.spaces[0].region_3d, place)
    # Beside the origin's dot and the cursor, which are drawn over the image.
    x, y = int(region.x + x) + 12, int(region.y + y) + 12
    return pixels.reshape(height, width, 4)[y, x, :3]


def paint(color):
    shader = bpy.data.materials["Material"].node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*color, 1)


def until(what, condition):
    end = time.monotonic() + PATIENCE_S
    while not condition(cube_color()):
        assert time.monotonic() < end, f"{what}: the cube is {cube_color()}"
        yield 0.5


def is_red(color):
    return color[0] > 2 * max(color[1], color[2])


def is_blue(color):
    return color[2] > 2 * max(color[0], color[1])


def steps():
    _, area, _ = viewport()
    space = area.spaces[0]
    paint((0.8, 0.02, 0.02))
    space.shading.type = "RENDERED"
    yield from until("a material", is_red)
    paint((0.02, 0.02, 0.8))
    yield from until("another material", is_blue)
    bpy.data.objects["Cube"].location.x += 3
    yield from until("another place", is_blue)
    for view in ("CAMERA", "ORTHO", "PERSP"):
        space.region_3d.view_perspective = view
        yield 1
        yield from until(view, is_blue)
    bpy.data.objects["Cube"].hide_render = True  # a document without it
    yield from until("nothing", lambda color: not is_blue(color))
    images = list(pathlib.Path(tempfile.gettempdir()).glob("tessera-*/image.f32"))
    assert images, "the preview's process writes one"
    space.shading.type = "SOLID"
    yield 1
    assert not any(path.exists() for path in images), "a preview that has ended is removed"


def main():
    bpy.context.preferences.view.show_splash = False
    bpy.ops.preferences.addon_install(filepath=ZIP, overwrite=True)
    bpy.ops.preferences.addon_enable(module="tessera_blender")
    bpy.context.preferences.addons["tessera_blender"].preferences.program = BINARY
    bpy.context.scene.render.engine = "TESSERA"
    running = steps()

    def step():
        try:
            return next(running)
        except StopIteration:
            print("viewport: passed", flush=True)
            os._exit(0)
        except BaseException:
            traceback.print_exc()
            os._exit(1)

    bpy.app.timers.register(step, first_interval=1)


main()
