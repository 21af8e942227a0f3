#!/usr/bin/env python3
"""Checks that no object of core needs a function of a folder above its own: a declaration below and
a definition above make a circle that includes do not show.

link_test.py BUILD; --self-test plants one such need. Standard library and nm.
"""

import pathlib
import re
import shutil
import subprocess
import sys

from tidy_test import CORE_ORDER

SYMBOL = re.compile(r"^\s*[0-9a-f]*\s+([A-Za-z])\s+(\S+)")
ROOT = pathlib.Path(__file__).resolve().parents[2]


def source_of(path: str) -> str:
    """core/CMakeFiles/core.dir/film/film.cpp.o -> core/film/film.cpp"""
    return re.sub(r"CMakeFiles/[^/]*\.dir/", "", path).removesuffix(".o")


def folder_of(path: str) -> str:
    """core/CMakeFiles/core.dir/film/film.cpp.o -> film"""
    parts = [part for part in pathlib.PurePath(path).parts if part in CORE_ORDER]
    return parts[0] if parts else ""


def symbols_of(listing: str):
    """Names that an object defines for all, and those that it needs."""
    found = [match.groups() for line in listing.split("\n") if (match := SYMBOL.match(line))]
    return ({name for kind, name in found if kind in "TDBR"},
            {name for kind, name in found if kind == "U"})


def link_faults(objects):
    """objects: path of each, and what nm lists of it."""
    tables = [(path, folder_of(path), *symbols_of(listing)) for path, listing in objects]
    home = {name: folder for _, folder, defined, _ in tables for name in defined}
    for path, folder, _, needed in tables:
        for name in sorted(needed):
            above = home.get(name, folder)
            if CORE_ORDER.index(above) > CORE_ORDER.index(folder):
                yield f"{path}: needs {name} of {above}, which is above {folder}"


def objects_of(build: pathlib.Path):
    nm = shutil.which("gcc-nm") or "nm"  # objects may hold intermediate code alone
    for path in sorted((build / "core").rglob("*.cpp.o")):
        name = path.relative_to(build).as_posix()
        # An object whose source was removed stays in an older build.
        if folder_of(name) and (ROOT / source_of(name)).exists():
            yield name, subprocess.check_output([nm, str(path)], text=True)


PLANTED = [("core/film/film.cpp.o", "0000 T film_of\n     U make_path\n     U malloc\n"),
           ("core/integrators/path/path.cpp.o", "0000 T make_path\n     U film_of\n")]


def main() -> int:
    if "--self-test" in sys.argv[1:]:
        found = list(link_faults(PLANTED))
        good = len(found) == 1 and "film.cpp.o: needs make_path of integrators" in found[0]
        print("link self-test: planted fault seen" if good else f"not as planted: {found}")
        return 0 if good else 1
    objects = list(objects_of(pathlib.Path(sys.argv[1])))
    if not objects:
        print("no objects of core: build first")
        return 77
    found = list(link_faults(objects))
    print("\n".join(found) or f"link: {len(objects)} objects, no folder needs one above it")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
