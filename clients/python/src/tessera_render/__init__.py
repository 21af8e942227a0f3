"""Tessera with a server of its own: a picture by one call, with no service to run.

    from tessera_render import render

    job = render("chair.glb", size=800)
    print(job.error)                                   # 2.91% (2.70% to 3.12%)
    job.save("chair.png")

The other names are those of the package `tessera`, which another distribution may also have.
"""

import tessera
from tessera import *  # noqa: F403

from ._private import client, render

__all__ = [*tessera.__all__, "client", "render"]
__version__ = tessera.__version__
