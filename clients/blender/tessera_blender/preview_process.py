"""The process that a viewport's preview talks to the server with. Needs no Blender.

    python -m tessera_blender.preview_process FOLDER

Each line of its input is an order in JSON: {"document": PATH of a .gltf file} uploads it;
{"request", "world", "server", "key"} asks for another preview. Writes into FOLDER the newest image
and a line on its state, and ends with its input.
"""

from __future__ import annotations

import json
import os
import queue
import sys
import threading
from pathlib import Path
from typing import Any

import numpy as np
from tessera_render import Client, Job, Scene, TesseraError

from . import passes, worlds
from .following import Following, status

IMAGE = "image.f32"
STATUS = "status.txt"
# A look for new tiles, and the time between two requests for error and samples.
_LOOK_S = 0.1
_REFRESH_LOOKS = 5


def write_image(path: Path, image: np.ndarray) -> None:
    """image: (height, width, 4), top row first. Blender's order is the bottom row first."""
    size = np.array(image.shape[:2], np.float32)
    _replace(path, size.tobytes() + passes.rect(image).tobytes())


def read_image(path: Path) -> np.ndarray:
    """(height, width, 4), bottom row first."""
    values = np.fromfile(path, np.float32)
    return values[2:].reshape(int(values[0]), int(values[1]), 4)


def _replace(path: Path, content: bytes) -> None:
    """A reader sees the old file or the new one."""
    new = path.with_suffix(".new")
    new.write_bytes(content)
    os.replace(new, path)


class Session:
    """Uploads and submits the newest orders, and writes what comes of them."""

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._client: Client | None = None
        self._document: str | None = None
        self._scene: Scene | None = None
        self._wish: dict[str, Any] = {}
        self._world: tuple[Any, ...] = ()
        self._environment: dict[str, Any] | None = None
        self._job: Job | None = None
        self._following: Following | None = None
        self._image: np.ndarray | None = None
        self._looks = 0

    def take(self, orders: list[dict[str, Any]]) -> None:
        for order in orders:
            if "document" in order:
                self._document, self._scene = order["document"], None
            else:
                self._wish = order
        if self._document is None or not self._wish:
            return
        place = (self._wish["server"], self._wish["key"])
        if self._client is None:
            self._client = Client(*place)
        self._scene = self._scene or self._client.upload(self._document)
        request = self._wish["request"] | {"environment": self._read_environment(self._client)}
        self._job = self._client.submit(self._scene, request=request)
        self._following = Following(self._job)
        self._following.start()

    def _read_environment(self, client: Client) -> dict[str, Any] | None:
        world = worlds.World(**self._wish["world"])
        image = Path(world.image) if world.image else None
        key = (self._wish["world"], image and image.stat().st_mtime_ns)
        if key != self._world:
            asset = client.upload_asset(image) if image else None
            self._environment = worlds.member(world, asset)
            self._world = key
        return self._environment

    def look(self) -> None:
        """Writes tiles that have come, and now and then the job's state."""
        if self._job is None or self._following is None:
            return
        news = self._following.news()
        if news is not None:
            image = passes.combined(*news)
            if self._image is not None and self._image.shape == image.shape:
                # Where no tile has come, the last preview stays.
                known = np.isfinite(news[0]).all(axis=2)[..., None]
                image = np.where(known, image, self._image)
            self._image = image
            write_image(self._folder / IMAGE, image)
        self._looks += 1
        if self._looks % _REFRESH_LOOKS == 0 and not self._job.ended:
            self._job.refresh()
            self.tell(status(self._job, False))

    def tell(self, text: str) -> None:
        _replace(self._folder / STATUS, text.encode())


def main() -> None:
    orders: queue.SimpleQueue[dict[str, Any] | None] = queue.SimpleQueue()

    def read() -> None:
        for line in sys.stdin:
            orders.put(json.loads(line))
        orders.put(None)

    threading.Thread(target=read, daemon=True).start()
    session = Session(Path(sys.argv[1]))
    while True:
        new: list[dict[str, Any]] = []
        try:
            order = orders.get(timeout=_LOOK_S)
            while order is not None:
                new.append(order)
                order = orders.get_nowait()
            return
        except queue.Empty:
            pass
        try:
            if new:
                session.take(new)
            session.look()
        except (TesseraError, OSError, ValueError) as fault:
            session.tell(f"Tessera: {fault}")


if __name__ == "__main__":
    main()
