"""The tree of files that every package has: programs, libraries, licences, manual, completions.

    bin/tessera, bin/tessera-server
    lib/tessera/            their libraries; the programs look there first, relative to themselves
    share/doc/tessera/      licences and versions of what is included
    share/man, share/bash-completion, share/zsh, share/fish
"""

import gzip
import json
import pathlib
import re
import shutil
import subprocess

from . import absent, elf

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIBRARIES = "lib/tessera"
PROGRAMS = ("bin/tessera", "bin/tessera-server")
MODULE = LIBRARIES + "/libtessera-images.so"
COMPLETIONS = {
    "bash": "share/bash-completion/completions/tessera",
    "zsh": "share/zsh/site-functions/_tessera",
    "fish": "share/fish/vendor_completions.d/tessera.fish",
}


def version():
    """The project's version, from its only place."""
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    return re.search(r"^project\(tessera VERSION ([\d.]+)", text, re.M).group(1)


def formats():
    """The extensions of the images that Tessera writes, from their only place."""
    text = (ROOT / "core/image_io/image_formats.cpp").read_text(encoding="utf-8")
    return re.findall(r'ImageFormat\{"(\w+)"', text)


def make(build, tree, provided=None):
    """Fills the folder `tree` from a build.

    provided: a pattern of names of libraries that the system of the package has; None: only those
    of every system. Returns the Debian packages in place of which the tree has libraries.
    """

    def left_out(name):
        return elf.SYSTEM.fullmatch(name) or (provided and provided.fullmatch(name))

    for name in (*PROGRAMS, MODULE):
        source = build / pathlib.Path(name).name
        if not source.is_file():
            raise SystemExit(f"package: there is no {source}; build it, or name a build by --build")
        place = tree / name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, place)
        place.chmod(0o755)
        subprocess.run(["strip", "--strip-all", str(place)], check=True)
    # DT_RPATH, not DT_RUNPATH: it also applies to what the libraries need, which so stay as
    # Debian built them.
    for name in (*PROGRAMS, MODULE):
        where = "$ORIGIN" if name == MODULE else "$ORIGIN/../lib/tessera"
        subprocess.run(
            ["patchelf", "--force-rpath", "--set-rpath", where, tree / name], check=True
        )
    programs = [build / pathlib.Path(name).name for name in (*PROGRAMS, MODULE)]
    places = {}
    for file in programs:
        places |= elf.resolved(file)
    copied, replaced = _copy_libraries(programs, places, tree, left_out)
    _describe(copied, tree)
    _texts(tree)
    return set(elf.debian_packages([*copied.values(), *replaced]).values())


def _copy_libraries(programs, places, tree, left_out):
    """Copies libraries: name -> path, and makes stand-ins for others; returns both."""
    found = elf.closure(
        programs, places, lambda name: left_out(name) or absent.UNUSED.fullmatch(name)
    )
    for name, path in found.items():
        shutil.copyfile(path, tree / LIBRARIES / name)
    replaced = []
    for user in found.values():
        for name in filter(absent.UNUSED.fullmatch, elf.needed(user)):
            if (tree / LIBRARIES / name).exists():
                raise SystemExit(f"package: {name} is needed by two libraries: not provided for")
            absent.make(user, name, places[name], tree / LIBRARIES / name)
            replaced.append(places[name])
    return found, replaced


def _describe(files, tree):
    """Licences of the copied libraries, and what they are as an SPDX document."""
    doc = tree / "share/doc/tessera"
    (doc / "licences").mkdir(parents=True)
    shutil.copyfile(ROOT / "LICENSE", doc / "LICENSE")
    shutil.copyfile(ROOT / "docker/CHANGELOG.md", doc / "CHANGELOG.md")
    packages = {}
    owners = elf.debian_packages(files.values())
    for name, path in files.items():
        if path not in owners:
            raise SystemExit(f"package: {path} is of no Debian package: its licence is not known")
        packages.setdefault(owners[path], []).append(name)
    entries = []
    for package, names in sorted(packages.items()):
        shutil.copyfile(
            pathlib.Path("/usr/share/doc") / package / "copyright", doc / "licences" / package
        )
        fields = elf.output("dpkg-query", "-W", "-f", "${Version}\t${source:Package}", package)
        package_version, source = fields.split("\t")
        entries.append(
            {
                "SPDXID": "SPDXRef-" + re.sub(r"[^\w.-]", "-", package),
                "name": package,
                "versionInfo": package_version,
                "sourceInfo": f"Debian's source package {source}",
                "comment": "Files: " + ", ".join(names),
                "downloadLocation": "NOASSERTION",
                "licenseConcluded": "NOASSERTION",
                "licenseDeclared": "NOASSERTION",
                "copyrightText": f"See licences/{package}",
            }
        )
    text = {
        "spdxVersion": "SPDX-2.3",
        "dataLicense": "CC0-1.0",
        "SPDXID": "SPDXRef-DOCUMENT",
        "name": f"tessera-{version()}",
        "documentNamespace": f"https://spdx.org/spdxdocs/tessera-{version()}",
        "creationInfo": {"created": "1970-01-01T00:00:00Z", "creators": ["Tool: docker/package"]},
        "packages": entries,
    }
    (doc / "sbom.spdx.json").write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")


def _texts(tree):
    """Manual page and completions, as the program prints them; it must run on this machine."""
    program = tree / PROGRAMS[0]
    page = tree / "share/man/man1/tessera.1.gz"
    page.parent.mkdir(parents=True)
    page.write_bytes(gzip.compress(elf.output(program, "man").encode(), 9, mtime=0))
    for shell, name in COMPLETIONS.items():
        (tree / name).parent.mkdir(parents=True)
        (tree / name).write_text(elf.output(program, "completion", shell), encoding="utf-8")


def elf_files(tree):
    """The programs and libraries of a tree."""
    return [tree / name for name in PROGRAMS] + sorted((tree / LIBRARIES).iterdir())


def check(tree, work):
    """Renders an image of each format with the tree, so that a missing library is noticed here."""
    for extension in formats():
        picture = work / f"check.{extension}"
        subprocess.run(
            [tree / PROGRAMS[0], "render", "cornell-box", "-o", picture, "--size", "32x32",
             "--samples", "2"],
            check=True, stdout=subprocess.DEVNULL, env={"PATH": "/usr/bin:/bin"},
        )  # fmt: skip
        if picture.stat().st_size == 0:
            raise SystemExit(f"package: {picture.name} is empty")
