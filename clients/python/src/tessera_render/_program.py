"""The command `tessera` of the wheel, and where the program is."""

from __future__ import annotations

import importlib.util
import os
import shutil
import sys
from pathlib import Path

# docker/packager/wheel.py puts it there.
_INSIDE = Path(__file__).parent / "server/bin/tessera"


def program() -> str | None:
    """The program of this package, else the one in PATH, else None."""
    return str(_INSIDE) if _INSIDE.is_file() else shutil.which("tessera")


def environment() -> dict[str, str]:
    """That of the program: with Open Image Denoise, if `pyoidn` is installed."""
    pyoidn = importlib.util.find_spec("pyoidn")
    if pyoidn is None or pyoidn.origin is None:
        return dict(os.environ)
    return {"TESSERA_OIDN": str(Path(pyoidn.origin).parent / "oidn"), **os.environ}


def main() -> None:
    """Becomes the program."""
    os.execve(_INSIDE, ["tessera", *sys.argv[1:]], environment())
