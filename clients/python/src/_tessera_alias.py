"""`import tessera` means tessera_render where nothing else is called so.

`tessera` on PyPI is another project, so this distribution has no file of that name, which would
overwrite one of the other. tessera_render.pth imports this module when Python starts; what it adds
is asked last, after all folders of sys.path.
"""

from __future__ import annotations

import sys
from importlib.machinery import ModuleSpec

TYPE_CHECKING = False  # that of `typing` would take time at each start
if TYPE_CHECKING:
    from collections.abc import Sequence
    from types import ModuleType


class _Alias:
    def find_spec(
        self, fullname: str, path: Sequence[str] | None, target: ModuleType | None = None
    ) -> ModuleSpec | None:
        if fullname != "tessera":
            return None
        return ModuleSpec(fullname, self)  # type: ignore[arg-type] # which has all of a Loader

    def create_module(self, spec: ModuleSpec) -> None:
        """Python makes an empty module, in place of which exec_module() puts another."""

    def exec_module(self, module: ModuleType) -> None:
        """Gives each loaded module of tessera_render a second name; none is loaded twice."""
        import tessera_render

        prefix = tessera_render.__name__
        for name, loaded in list(sys.modules.items()):
            if name == prefix or name.startswith(prefix + "."):
                sys.modules["tessera" + name.removeprefix(prefix)] = loaded


sys.meta_path.append(_Alias())
