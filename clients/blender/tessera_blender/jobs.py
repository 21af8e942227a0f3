"""A Blender scene as a job of the server."""

from __future__ import annotations

import tempfile
from pathlib import Path
from typing import Any

import bpy
from tessera_render import Client, Job, Scene

from . import cameras, exporting, passes, worlds
from .main_thread import in_main_thread


def _background(scene: Any) -> dict[str, Any]:
    if not scene.render.film_transparent:
        return {"type": "environment"}
    glass = getattr(getattr(scene, "cycles", None), "film_transparent_glass", False)
    return {"type": "transparent", "through_glass": bool(glass)}


def _integrator(settings: Any) -> dict[str, Any]:
    return {"type": settings.integrator, "max_depth": settings.max_depth}


def stop_rules(settings: Any) -> dict[str, Any]:
    """The first that is met ends the job. The error is that of the image that Blender shows."""
    rules: dict[str, Any] = {"samples_per_pixel": settings.samples}
    if settings.error_percent > 0:
        error = "denoised_error" if settings.denoise == "mixed" else "relative_error"
        rules[error] = settings.error_percent / 100
    if settings.seconds > 0:
        rules["seconds"] = settings.seconds
    return rules


def read_world(scene: Any) -> tuple[worlds.World, Path | bytes | None]:
    """The world and the content of its image, for environment()."""
    world = worlds.read_world(scene.world)
    if world.image is None:
        return world, None
    path = bpy.path.abspath(world.image.filepath, library=world.image.library)
    return world, worlds.image_content(world.image, path)


def environment(
    client: Client, world: worlds.World, content: Path | bytes | None
) -> dict[str, Any] | None:
    """The member `environment`; uploads the image. Needs no main thread."""
    return worlds.member(world, None if content is None else client.upload_asset(content))


def _evaluate(scene: Any, animation: bool) -> None:
    """Brings the objects that the exporter reads to the frame that is rendered. A still keeps
    changes without a key frame, as the viewport shows them."""
    if animation:
        scene.frame_set(scene.frame_current, subframe=scene.frame_subframe)
    else:
        bpy.context.view_layer.update()


def upload(client: Client, depsgraph: Any, animation: bool = False) -> Scene:
    """Exports and uploads the scene, without files that the server has already.

    animation: whether Blender renders its frames one after another.
    """
    with tempfile.TemporaryDirectory(prefix="tessera-") as folder:

        def export() -> Path:
            _evaluate(depsgraph.scene.original, animation)
            return exporting.export(depsgraph, Path(folder))

        return client.upload(in_main_thread(export))


def submit(client: Client, depsgraph: Any, uploaded: Scene) -> Job:
    """Submits the job of a scene's camera, world, frame and settings."""
    scene = depsgraph.scene
    if scene.camera is None:
        raise ValueError("The scene has no camera")
    settings = scene.original.tessera
    camera, film = cameras.camera_and_film(
        scene.camera.data, scene.camera.matrix_world, scene.render
    )
    film["layers"] = passes.recorded_layers(set(settings.layers))
    request = {
        "name": f"{Path(bpy.data.filepath).stem or 'Blender'} {scene.frame_current}",
        "seed": settings.seed,
        "camera": camera,
        "environment": environment(client, *read_world(scene)),
        "background": _background(scene),
        "film": film,
        "integrator": _integrator(settings),
        "stop": stop_rules(settings),
        "denoise": {"type": "none" if settings.denoise == "off" else "auto"},
    }
    return client.submit(uploaded, request=request)


def preview(scene: Any, camera: dict[str, Any], size: tuple[int, int], key: str) -> dict[str, Any]:
    """The request of a viewport's preview but for its environment. key: of the viewport, whose next
    preview supersedes this one."""
    settings = scene.tessera
    return {
        "class": "preview",
        "preview_key": key,
        "seed": settings.seed,
        "camera": camera,
        "background": _background(scene),
        "film": {"width": size[0], "height": size[1]},
        "integrator": _integrator(settings),
        "stop": {"samples_per_pixel": settings.preview_samples},
    }
