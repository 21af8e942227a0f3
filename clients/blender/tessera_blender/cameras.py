"""A Blender camera and frame as the members `camera` and `film` of a job. Needs no Blender.

The formulas are those of Blender's BKE_camera_params_compute_viewplane and of Cycles' camera.
Blender's axes are x, y, z up; glTF's and the server's are x, y up, z to the viewer.
"""

from __future__ import annotations

import math
from typing import Any


def y_up(x: float, y: float, z: float) -> list[float]:
    """Blender's coordinates as glTF's."""
    return [x, z, -y]


def frame_size(render: Any) -> tuple[int, int]:
    """Width and height of the frame in pixels, without the render region."""
    percent = render.resolution_percentage
    return render.resolution_x * percent // 100, render.resolution_y * percent // 100


def region(render: Any) -> tuple[int, int, int, int]:
    """Left, top, width and height of what Blender renders, in pixels of the frame."""
    width, height = frame_size(render)
    if not render.use_border:
        return 0, 0, width, height
    left, right = int(render.border_min_x * width), int(render.border_max_x * width)
    bottom, top = int(render.border_min_y * height), int(render.border_max_y * height)
    return left, height - top, right - left, top - bottom


def _fit(camera: Any, width: int, height: int) -> tuple[float, float]:
    """Pixels along the side that the sensor fits, and that side of the sensor in mm."""
    horizontal = camera.sensor_fit == "HORIZONTAL" or (
        camera.sensor_fit == "AUTO" and width >= height
    )
    sensor = camera.sensor_height if camera.sensor_fit == "VERTICAL" else camera.sensor_width
    return (width if horizontal else height), sensor


def _film(render: Any) -> dict[str, Any]:
    """The frame, of which the render region is a crop."""
    width, height = frame_size(render)
    left, top, crop_width, crop_height = region(render)
    film: dict[str, Any] = {"width": width, "height": height}
    if (crop_width, crop_height) != (width, height):
        film["crop"] = {"x": left, "y": top, "width": crop_width, "height": crop_height}
    return film


def panorama_type(camera: Any) -> str:
    """Blender 5 has it on the camera, earlier versions among the settings of Cycles."""
    kind = getattr(camera, "panorama_type", None)
    return kind or getattr(getattr(camera, "cycles", None), "panorama_type", "EQUIRECTANGULAR")


def _lens(camera: Any, position: Any, forward: list[float]) -> dict[str, float]:
    """Depth of field. focus_object's distance counts along the optical axis, as in Cycles."""
    if not camera.dof.use_dof:
        return {}
    focus = camera.dof.focus_distance
    if camera.dof.focus_object is not None:
        there = [row[3] for row in camera.dof.focus_object.matrix_world][:3]
        focus = abs(sum((a - b) * c for a, b, c in zip(there, position, forward, strict=True)))
    # An orthographic camera has no focal length; Cycles takes 1 m.
    focal_m = 1.0 if camera.type == "ORTHO" else camera.lens * 1e-3
    return {"aperture_radius": focal_m / (2 * camera.dof.aperture_fstop), "focus_distance": focus}


def camera_and_film(camera: Any, matrix: Any, render: Any) -> tuple[dict[str, Any], dict[str, Any]]:
    """Returns the members `camera` and `film` of a job.

    camera: bpy.types.Camera. matrix: the object's matrix_world, rows of 4. render: RenderSettings.
    """
    width, height = frame_size(render)
    film = _film(render)
    pixels, sensor_mm = _fit(camera, width, height)
    position = [row[3] for row in matrix][:3]
    right, up, back = ([row[k] for row in matrix[:3]] for k in range(3))
    length = math.sqrt(sum(x * x for x in back))
    forward = [-x / length for x in back]
    if camera.type == "ORTHO":  # A shift of 1 is the side that fits the scale.
        shift = (camera.shift_x * camera.ortho_scale, camera.shift_y * camera.ortho_scale)
        position = [a + (shift[0] * r + shift[1] * u) / length
                    for a, r, u in zip(position, right, up, strict=True)]  # fmt: skip
    target = [a + b for a, b in zip(position, forward, strict=True)]
    pose = {"position": y_up(*position), "target": y_up(*target), "up": y_up(*up)}
    if camera.type == "PANO":
        return {"type": "panorama", **pose}, film
    lens = _lens(camera, position, forward)
    if camera.type == "ORTHO":
        tall = camera.ortho_scale * height / pixels
        return {"type": "orthographic", "orthographic_height": tall, **pose, **lens}, film
    focal_pixels = camera.lens / sensor_mm * pixels
    fov = 2 * math.degrees(math.atan(height / (2 * focal_pixels)))
    moved = [camera.shift_x * pixels / width, camera.shift_y * pixels / height]
    return {
        "type": "perspective", "vertical_fov_degrees": fov, "shift": moved, **pose, **lens
    }, film  # fmt: skip


def of_view(window: Any, view: Any, width: int, height: int) -> dict[str, Any]:
    """Returns the member `camera` that sees what a viewport shows.

    window, view: the region's window_matrix and view_matrix, rows of 4. width, height: pixels of
    the film.
    """
    # The view is a rotation and a translation, whose inverse is the camera's place.
    right, up, back = ([view[row][k] for k in range(3)] for row in range(3))

    def world(x: float, y: float, z: float) -> list[float]:
        at = (x - view[0][3], y - view[1][3], z - view[2][3])
        return [sum(a * axis[k] for a, axis in zip(at, (right, up, back), strict=True))
                for k in range(3)]  # fmt: skip

    def posed(eye: list[float]) -> dict[str, Any]:
        columns = [y_up(*axis) for axis in (right, up, back, eye)]
        rows = [[column[k] for column in columns] for k in range(3)] + [[0.0, 0.0, 0.0, 1.0]]
        return {"pose": {"convention": "opengl", "matrix": [x for row in rows for x in row]}}

    across, along = window[0][0], window[1][1]
    if window[3][3] == 0:
        return {
            "type": "pinhole",
            "fx": across * width / 2,
            "fy": along * height / 2,
            "cx": (1 - window[0][2]) * width / 2,
            "cy": (1 + window[1][2]) * height / 2,
        } | posed(world(0, 0, 0))
    # An orthographic viewport shows the scene behind its eye, too: the camera is where it begins.
    near = (-1 - window[2][3]) / window[2][2]
    eye = world(-window[0][3] / across, -window[1][3] / along, near)
    return {"type": "orthographic", "orthographic_height": 2 / along} | posed(eye)
