"""Writes small GLB files: just enough for the examples to create their own scenes."""

from __future__ import annotations

import json
import struct
from typing import Any

import numpy as np
import numpy.typing as npt


class Glb:
    """A glTF document being built. `document` may be changed freely before bytes() is called."""

    def __init__(self) -> None:
        self.binary = b""
        self.document: dict[str, Any] = {
            "asset": {"version": "2.0", "generator": "Tessera examples"},
            "scene": 0,
            "scenes": [{"nodes": []}],
        }
        for name in ("nodes", "meshes", "materials", "accessors", "bufferViews"):
            self.document[name] = []

    def add(self, kind: str, item: dict[str, Any]) -> int:
        """Appends to a list of the document; returns the index."""
        self.document.setdefault(kind, []).append(item)
        return len(self.document[kind]) - 1

    def add_node(self, **members: Any) -> int:
        """Adds a node at the top level of the scene."""
        index = self.add("nodes", members)
        self.document["scenes"][0]["nodes"].append(index)
        return index

    def add_material(self, name: str, **members: Any) -> int:
        used = set(self.document.get("extensionsUsed", [])) | set(members.get("extensions", {}))
        if used:
            self.document["extensionsUsed"] = sorted(used)
        return self.add("materials", {"name": name} | members)

    def add_primitive(
        self, positions: npt.ArrayLike, triangles: npt.ArrayLike, material: int, **members: Any
    ) -> dict[str, Any]:
        """positions: (n, 3) in metres; triangles: (m, 3), counter-clockwise from outside."""
        points = np.asarray(positions, dtype="<f4")
        corners = np.asarray(triangles, dtype="<u4").reshape(-1)
        attributes = {
            "POSITION": self._accessor(points, "VEC3", 5126, low=points.min(0), high=points.max(0))
        }
        if "normals" in members:
            normals = np.asarray(members.pop("normals"), dtype="<f4")
            attributes["NORMAL"] = self._accessor(normals, "VEC3", 5126)
        indices = self._accessor(corners, "SCALAR", 5125)
        return {"attributes": attributes, "indices": indices, "material": material} | members

    def _accessor(
        self, values: npt.NDArray[Any], kind: str, component: int,
        low: npt.NDArray[Any] | None = None, high: npt.NDArray[Any] | None = None,
    ) -> int:  # fmt: skip
        view = {"buffer": 0, "byteOffset": len(self.binary), "byteLength": values.nbytes}
        self.binary += values.tobytes()
        accessor = {
            "bufferView": self.add("bufferViews", view),
            "componentType": component,
            "count": len(values),
            "type": kind,
        }
        if low is not None and high is not None:
            accessor |= {"min": low.tolist(), "max": high.tolist()}
        return self.add("accessors", accessor)

    def bytes(self) -> bytes:
        self.document["buffers"] = [{"byteLength": len(self.binary)}]
        text = json.dumps(self.document).encode()
        chunks = [(b"JSON", text, b" "), (b"BIN\0", self.binary, b"\0")]
        body = b""
        for name, data, filler in chunks:
            data += filler * (-len(data) % 4)
            body += struct.pack("<I4s", len(data), name) + data
        return struct.pack("<4sII", b"glTF", 2, 12 + len(body)) + body
