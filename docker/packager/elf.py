"""What programs and libraries need: read by the tools of binutils and by dpkg."""

import pathlib
import re
import subprocess

# Part of every system for which a package is made: glibc and the compiler's run-time libraries.
SYSTEM = re.compile(r"(ld-linux.*|lib(c|m|dl|rt|pthread|resolv|util|anl|stdc\+\+|gcc_s))\.so\.\d+")


def output(*command, **options):
    return subprocess.run(
        [str(word) for word in command], check=True, text=True, stdout=subprocess.PIPE, **options
    ).stdout


def needed(file):
    """The names of the libraries that a file names itself, in its order."""
    return re.findall(r"\(NEEDED\).*\[(.+)\]", output("readelf", "-d", file))


def resolved(file, machine):
    """Name -> path of all libraries that the loader takes for a file, or may take."""
    if machine.root:
        found = (path for folder in machine.folders() for path in folder.glob("*.so*"))
        return {path.name: path.resolve() for path in found}
    lines = re.findall(r"^\s+(\S+) => (/\S+) ", output("ldd", file), re.M)
    return {name: pathlib.Path(path).resolve() for name, path in lines}


def closure(files, places, stop):
    """Name -> path of what files need, directly or not, except where stop(name)."""
    found = {}
    waiting = [name for file in files for name in needed(file)]
    while waiting:
        name = waiting.pop()
        if name in found or stop(name):
            continue
        if name not in places:
            raise SystemExit(f"package: the library {name} is not among those of this machine")
        found[name] = places[name]
        waiting += needed(places[name])
    return dict(sorted(found.items()))


def oldest_glibc(files, machine):
    """(2, n): the oldest glibc that has all the symbols that the files use."""
    versions = {(2, 17)}
    for file in files:
        symbols = output(machine.tool("objdump"), "-T", file)
        names = re.findall(r"\bGLIBC_(\d+)\.(\d+)", symbols)
        versions |= {(int(major), int(minor)) for major, minor in names}
    return max(versions)


def debian_packages(files, machine):
    """File -> Debian package, of the machine's libraries that belong to one."""
    asked = {}
    for file in files:
        for path in (file, file.parents[-1].joinpath(*file.parts[2:])):  # /usr/lib, once /lib
            asked[str(path)] = file
    # It exits with 1 if one of the paths is unknown.
    command = ["dpkg-query", *machine.dpkg(), "-S", *asked]
    done = subprocess.run(command, capture_output=True, text=True)
    found = {}
    for line in done.stdout.splitlines():
        package, _, path = line.rpartition(": ")
        if path in asked and not package.startswith("diversion "):
            found[asked[path]] = package.split(":")[0]
    return found
