"""A model with moving parts and a moving camera."""

import math
import struct

from harness import glb


def moving_triangles():
    """The camera moves by (-0.5, 0, 0) in one second, the first triangle by (1, 2, 0); the second
    one, farther away, is at rest."""
    corners = struct.pack("<9f", -1, -1, 0, 1, -1, 0, 0, 1, 0)
    times = struct.pack("<2f", 0, 1)
    of_camera = struct.pack("<6f", 0, 0, 5, -0.5, 0, 5)
    of_mesh = struct.pack("<6f", 0, 0, 0, 1, 2, 0)
    parts = [corners, times, of_camera, of_mesh]
    views, at = [], 0
    for part in parts:
        views.append({"buffer": 0, "byteOffset": at, "byteLength": len(part)})
        at += len(part)
    float_type = 5126
    return glb(
        {
            "asset": {"version": "2.0"},
            "scene": 0,
            "scenes": [{"nodes": [0, 1, 2]}],
            "nodes": [
                {"camera": 0, "translation": [0, 0, 5]},
                {"mesh": 0},
                {"mesh": 0, "translation": [0, 0, -5], "scale": [9, 9, 1]},
            ],
            "cameras": [
                {"type": "perspective", "perspective": {"yfov": math.atan(0.5) * 2, "znear": 0.1}}
            ],
            "meshes": [{"primitives": [{"attributes": {"POSITION": 0}}]}],
            "animations": [
                {
                    "samplers": [{"input": 1, "output": 2}, {"input": 1, "output": 3}],
                    "channels": [
                        {"sampler": i, "target": {"node": i, "path": "translation"}}
                        for i in range(2)
                    ],
                }
            ],
            "buffers": [{"byteLength": at}],
            "bufferViews": views,
            "accessors": [
                {"bufferView": 0, "componentType": float_type, "count": 3, "type": "VEC3",
                 "min": [-1, -1, 0], "max": [1, 1, 0]},
                {"bufferView": 1, "componentType": float_type, "count": 2, "type": "SCALAR",
                 "min": [0], "max": [1]},
                {"bufferView": 2, "componentType": float_type, "count": 2, "type": "VEC3"},
                {"bufferView": 3, "componentType": float_type, "count": 2, "type": "VEC3"},
            ],
        },
        b"".join(parts),
    )  # fmt: skip
