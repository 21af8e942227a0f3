"""Tessera as a render engine of Blender: F12 renders on a Tessera server."""

import sys
from pathlib import Path

bl_info = {
    "name": "Tessera",
    "description": "Renders on a server that tells how far the image is off",
    "version": (1, 1, 0),
    "blender": (3, 4, 0),
    "location": "Render Properties > Render Engine",
    "category": "Render",
}

# Blender installs the wheels of an extension (4.2 on); an add-on imports them where they are. They
# are of Python alone, which can import from a zip.
if not __package__.startswith("bl_ext."):
    sys.path += [str(path) for path in sorted((Path(__file__).parent / "wheels").glob("*.whl"))
                 if str(path) not in sys.path]  # fmt: skip


def _modules():  # type: ignore[no-untyped-def]
    """Imported late, so that modules that need no Blender can be imported without it."""
    from . import engine, main_thread, panels, properties

    return engine, main_thread, panels, properties


def register() -> None:
    import bpy

    engine, main_thread, panels, properties = _modules()
    for each in (*properties.CLASSES, engine.TesseraEngine, *panels.CLASSES):
        bpy.utils.register_class(each)
    properties.attach()
    panels.attach()
    main_thread.attach()


def unregister() -> None:
    import bpy

    engine, main_thread, panels, properties = _modules()
    main_thread.detach()
    panels.detach()
    properties.detach()
    for each in reversed((*properties.CLASSES, engine.TesseraEngine, *panels.CLASSES)):
        bpy.utils.unregister_class(each)
    from . import server

    server.close()
