"""A server that belongs to this process."""

from __future__ import annotations

import atexit
import os
import secrets
import subprocess
import tempfile
import threading
from os import PathLike
from typing import Any

from ._client import Client
from ._program import environment, program
from .errors import TesseraError
from .job import Job
from .options import JobOptions

# When render() ends if its options have no stop rule; as POST /v1/render of the server.
_RELATIVE_ERROR = 0.03
_SECONDS = 10.0
_RULES = {*JobOptions.__annotations__} & {
    "stop", "samples_per_pixel", "relative_error", "denoised_error", "meter_error",
    "light_not_found", "seconds", "cpu_seconds", "deadline", "request",
}  # fmt: skip

# Settings of this machine. The others are of another server: its address, keys, data and the like.
_KEPT = {"TESSERA_OIDN", "TESSERA_ISA", "TESSERA_MEMORY", "TESSERA_THREADS"}

# Ends the server and removes its folder when this process closes the pipe, or dies.
_GUARD = '"$@" & child=$!; cat >&2; kill $child; wait $child; rm -rf "$TESSERA_DATA"'

_lock = threading.Lock()
_client: Client | None = None
_process: int | None = None  # that started the server: a forked one needs its own


def _start(binary: str | None) -> Client:
    if binary is None:
        raise TesseraError(
            "there is no program `tessera`: install the wheel that has it, or put it in PATH, "
            "or name a running server in TESSERA_SERVER"
        )
    data = tempfile.mkdtemp(prefix="tessera-")
    key = secrets.token_hex(16)
    guard = subprocess.Popen(
        ["/bin/sh", "-c", _GUARD, "sh", binary, "serve", "--port", "0", "--log-level", "warning"],
        stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**{name: value for name, value in environment().items()
                if name in _KEPT or not name.startswith("TESSERA_")},
             "TESSERA_KEY": key, "TESSERA_DATA": data},
        # Ctrl-C is for this process; the server ends with it.
        start_new_session=True,
    )  # fmt: skip
    assert guard.stdout is not None and guard.stdin is not None
    line = guard.stdout.readline()  # "listening on http://127.0.0.1:PORT"
    if "http://" not in line:
        guard.stdin.close()
        guard.wait()
        raise TesseraError(f"{binary} serve did not start; see its messages above")
    # The port of the address, which may name a path and the key.
    address = line.split()[-1].split("#")[0]

    def stop() -> None:
        if _process == os.getpid() and guard.stdin is not None:
            guard.stdin.close()
            guard.wait()

    atexit.register(stop)
    return Client(address, key)


def client(binary: str | None = None) -> Client:
    """The client of TESSERA_SERVER, else of a private server.

    binary: the program `tessera` of the private server, by default that of this package, else the
    one in PATH; only the first call counts.

    The private server starts at the first call, listens on this machine with a random key, and ends
    with this process; its jobs are not kept. Of the variables TESSERA_*, it takes those of this
    machine: TESSERA_OIDN, TESSERA_ISA, TESSERA_MEMORY and TESSERA_THREADS.
    """
    global _client, _process
    with _lock:
        if _client is None or _process != os.getpid():
            _process = os.getpid()
            _client = Client() if os.environ.get("TESSERA_SERVER") else _start(binary or program())
        return _client


def render(
    scene: str | PathLike[str], size: int | tuple[int, int] | str = (960, 540), **options: Any
) -> Job:
    """Renders a scene and returns the finished job: job.save("a.png"), job.image(), job.error.

    scene: a .glb, a .gltf or .obj with its files, a zip, a folder, .stl, .ply, .3mf, or a built-in
    name. size: pixels; one number is a square. options: see JobOptions. Without a stop rule it ends
    at a relative error of 3%, or after 10 seconds. Raises JobFailed if the job fails.
    """
    if not _RULES & options.keys():
        options["relative_error"] = _RELATIVE_ERROR
        options["seconds"] = _SECONDS
    options["size"] = (size, size) if isinstance(size, int) else size
    return client().submit(scene, **options).wait()
