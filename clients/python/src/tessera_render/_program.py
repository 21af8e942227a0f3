"""The command `tessera` of the wheel, and where the program is."""

from __future__ import annotations

import os
import shutil
import sys
from pathlib import Path

# docker/packager/wheel.py puts it there.
_INSIDE = Path(__file__).parent / "server/bin/tessera"


def program() -> str | None:
    """The program of this package, else the one in PATH, else None."""
    return str(_INSIDE) if _INSIDE.is_file() else shutil.which("tessera")


def main() -> None:
    """Becomes the program."""
    os.execv(_INSIDE, ["tessera", *sys.argv[1:]])
