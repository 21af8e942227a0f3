"""The tree of files that every package has: programs, libraries, licences, manual, completions.

    bin/tessera, bin/tessera-server, bin/tessera-fetch-denoiser
    lib/tessera/            tessera-convert and libraries; programs look there first, relative to
                            themselves
    share/doc/tessera/      licences and versions of what is included
    share/man, share/bash-completion, share/zsh, share/fish
"""

import functools
import gzip
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

from . import absent, elf
from .machine import ROOT

LIBRARIES = "lib/tessera"
PROGRAMS = ("bin/tessera", "bin/tessera-server")
# What they load and start.
PARTS = (LIBRARIES + "/libtessera-images.so", LIBRARIES + "/tessera-convert")
COMPLETIONS = {
    "bash": "share/bash-completion/completions/tessera",
    "zsh": "share/zsh/site-functions/_tessera",
    "fish": "share/fish/vendor_completions.d/tessera.fish",
}


@functools.cache
def version():
    """The project's version, from its only place: semantic versioning.

    Between two releases it ends in the time of the commit: 1.1.0-dev.202611281012 is older than
    the next commit's and than 1.1.0. (0 outside of a checkout.)
    """
    text = (ROOT / "CMakeLists.txt").read_text(encoding="utf-8")
    found = re.search(r"^set\(TESSERA_VERSION (\S+)\)", text, re.M).group(1)
    if not found.endswith("-dev"):
        return found
    command = "git log -1 --format=%cd --date=format-local:%Y%m%d%H%M 2>/dev/null || echo 0"
    time = elf.output("sh", "-c", command, cwd=ROOT, env=os.environ | {"TZ": "UTC"}).strip()
    return f"{found}.{time}"


def debian_version():
    """The same for dpkg, to which 1.1.0~dev is older than 1.1.0."""
    return version().replace("-", "~")


def python_version():
    """The same as PEP 440 has it."""
    return version().replace("-dev.", ".dev")


def formats():
    """The extensions of the images that Tessera writes, from their only place."""
    text = (ROOT / "core/image_io/image_formats.cpp").read_text(encoding="utf-8")
    return re.findall(r'ImageFormat\{"(\w+)"', text)


def make(build, tree, machine, provided=None):
    """Fills the folder `tree` from a build.

    provided: a pattern of names of libraries that the system of the package has; None: only those
    of every system. Returns the Debian packages in place of which the tree has libraries.
    """

    def left_out(name):
        return elf.SYSTEM.fullmatch(name) or (provided and provided.fullmatch(name))

    for name in (*PROGRAMS, *PARTS):
        source = build / name.rpartition("/")[2]
        if not source.is_file():
            raise SystemExit(f"package: there is no {source}; build it, or name a build by --build")
        place = tree / name
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(source, place)
        place.chmod(0o755)
        subprocess.run([machine.tool("strip"), "--strip-all", str(place)], check=True)
    fetcher = tree / "bin/tessera-fetch-denoiser"
    shutil.copyfile(ROOT / "docker/fetch-denoiser", fetcher)
    fetcher.chmod(0o755)
    # DT_RPATH, not DT_RUNPATH: it also applies to what the libraries need, which so stay as
    # Debian built them.
    for name in (*PROGRAMS, *PARTS):
        where = "$ORIGIN" if name in PARTS else "$ORIGIN/../lib/tessera"
        subprocess.run(
            ["patchelf", "--force-rpath", "--set-rpath", where, tree / name], check=True
        )
    programs = [build / name.rpartition("/")[2] for name in (*PROGRAMS, *PARTS)]
    places = {}
    for file in programs:
        places |= elf.resolved(file, machine)
    copied, replaced = _copy_libraries(programs, places, tree, left_out, machine)
    _describe(copied, tree, machine)
    with tempfile.TemporaryDirectory() as folder:
        server, client = tree / PROGRAMS[1], tree / PROGRAMS[0]
        _texts(tree, machine.running_with(server, client, pathlib.Path(folder)))
    return set(elf.debian_packages([*copied.values(), *replaced], machine).values())


def _copy_libraries(programs, places, tree, left_out, machine):
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
            absent.make(user, name, places[name], tree / LIBRARIES / name, machine)
            replaced.append(places[name])
    return found, replaced


def described(package, its_version, source, comment, licence):
    """The entry of one of Debian's packages in an SPDX document."""
    return {
        "SPDXID": "SPDXRef-" + re.sub(r"[^\w.-]", "-", package),
        "name": package,
        "versionInfo": its_version,
        "sourceInfo": f"Debian's source package {source}",
        "comment": comment,
        "downloadLocation": "NOASSERTION",
        "licenseConcluded": "NOASSERTION",
        "licenseDeclared": "NOASSERTION",
        "copyrightText": f"See {licence}",
    }


def _describe(files, tree, machine):
    """Licences of the copied libraries, and what they are as an SPDX document."""
    doc = tree / "share/doc/tessera"
    (doc / "licences").mkdir(parents=True)
    shutil.copyfile(ROOT / "LICENSE", doc / "LICENSE")
    shutil.copyfile(ROOT / "docker/CHANGELOG.md", doc / "CHANGELOG.md")
    packages = {}
    owners = elf.debian_packages(files.values(), machine)
    for name, path in files.items():
        if path not in owners:
            raise SystemExit(f"package: {path} is of no Debian package: its licence is not known")
        packages.setdefault(owners[path], []).append(name)
    entries = []
    for package, names in sorted(packages.items()):
        shutil.copyfile(machine.licence(package), doc / "licences" / package)
        query = ("dpkg-query", *machine.dpkg(), "-W", "-f", "${Version}\t${source:Package}")
        fields = elf.output(*query, package)
        package_version, source = fields.split("\t")
        files_text = "Files: " + ", ".join(names)
        entries.append(
            described(package, package_version, source, files_text, f"licences/{package}")
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


def _texts(tree, program):
    """Manual page and completions, as the command `program` prints them."""
    page = tree / "share/man/man1/tessera.1.gz"
    page.parent.mkdir(parents=True)
    page.write_bytes(gzip.compress(elf.output(*program, "man").encode(), 9, mtime=0))
    for shell, name in COMPLETIONS.items():
        (tree / name).parent.mkdir(parents=True)
        (tree / name).write_text(elf.output(*program, "completion", shell), encoding="utf-8")


def elf_files(tree):
    """The programs and libraries of a tree."""
    return [tree / name for name in PROGRAMS] + sorted((tree / LIBRARIES).iterdir())


def check(tree, work, machine):
    """Renders an image of each format with the tree, so that a missing library is noticed here."""
    for extension in formats():
        picture = work / f"check.{extension}"
        # The program that renders, which the other starts in its place: qemu would not know how.
        command = machine.running(
            tree / PROGRAMS[1], "render", "cornell-box", "-o", picture, "--size", "32x32",
            "--samples", "2",
        )  # fmt: skip
        bare = {"PATH": "/usr/bin:/bin"}
        subprocess.run(command, check=True, stdout=subprocess.DEVNULL, env=bare)
        if picture.stat().st_size == 0:
            raise SystemExit(f"package: {picture.name} is empty")
