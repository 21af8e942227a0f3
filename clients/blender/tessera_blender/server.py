"""The server that the add-on's preferences name, or a private one."""

from __future__ import annotations

import os
import shutil
from typing import Any

import bpy
import tessera_render
from tessera_render import Client

# One client for an address and key, so that connections are used again.
_clients: dict[tuple[str, str], Client] = {}


def preferences() -> Any:
    return bpy.context.preferences.addons[__package__].preferences


def connect() -> Client:
    """The client of the server in the preferences; without an address that of a private server,
    which starts at the first call and ends with Blender."""
    chosen = preferences()
    address = chosen.address.strip()
    if address:
        place = (address, chosen.key)
        if place not in _clients:
            _clients[place] = Client(address, chosen.key)
        return _clients[place]
    program = bpy.path.abspath(chosen.program) if chosen.program else shutil.which("tessera")
    if not program or not os.access(program, os.X_OK):
        raise FileNotFoundError(
            "There is no program tessera: set its path, or the address of a server, in the "
            "preferences of the add-on"
        )
    return tessera_render.client(program)


def close() -> None:
    for client in _clients.values():
        client.close()
    _clients.clear()
