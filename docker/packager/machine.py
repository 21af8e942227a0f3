"""The machine for which packages are made: its processor, tools and libraries.

For this machine's own processor these are those of the system. For arm64 on x86-64 they are a cross
compiler, and a folder with Debian's libraries, of which nothing is installed.
"""

import dataclasses
import os
import pathlib
import platform
import re
import shlex
import shutil
import subprocess
import sys
import tarfile
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROCESSORS = {"amd64": "x86_64", "arm64": "aarch64"}  # Debian's name -> uname -m
APT = """\
APT::Architecture "{arch}";
APT::Architectures {{ "{arch}"; }};
APT::Install-Recommends "false";
APT::Sandbox::User "root";
Dir::State "{folder}/state";
Dir::State::status "{folder}/state/status";
Dir::Cache "{folder}/cache";
"""


@dataclasses.dataclass(frozen=True)
class Machine:
    arch: str  # Debian's name
    root: pathlib.Path | None = None  # the folder with its libraries; None: of this system

    @property
    def processor(self):
        return PROCESSORS[self.arch]

    @property
    def triplet(self):
        return f"{self.processor}-linux-gnu"

    def tool(self, name):
        """A program of binutils, or the compiler."""
        return f"{self.triplet}-{name}" if self.root else name

    def running(self, program, *arguments):
        """The command that runs one of its programs here."""
        qemu = (f"qemu-{self.processor}-static", "-L", self.root) if self.root else ()
        return [str(word) for word in (*qemu, program, *arguments)]

    def running_with(self, sibling, program, folder):
        """The command of a program that starts another: a script does it, in a folder for both."""
        if not self.root:
            return [str(program)]
        copy = folder / program.name
        shutil.copy(program, copy)
        script = folder / sibling.name
        script.write_text(f'#!/bin/sh\nexec {shlex.join(self.running(sibling))} "$@"\n')
        script.chmod(0o755)
        return self.running(copy)

    def dpkg(self):
        """The option of dpkg's programs that names the database of the libraries' packages."""
        return (f"--admindir={self.root}/var/lib/dpkg",) if self.root else ()

    def folders(self):
        """Where its libraries are, if they are not of this system."""
        return [self.root / place / self.triplet for place in ("lib", "usr/lib")]

    def licence(self, package):
        return (self.root or pathlib.Path("/")) / "usr/share/doc" / package / "copyright"


def own():
    """Debian's name of this machine; None if no package is for it."""
    return next((arch for arch, name in PROCESSORS.items() if name == platform.machine()), None)


def _lines(*sections):
    """The lines of these sections of docker/packages.txt."""
    text = (ROOT / "docker/packages.txt").read_text(encoding="utf-8")
    found = rf"^\[(?:{'|'.join(sections)})\]\n(.*?)(?=\n\[|\n#|\Z)"
    return "\n".join(re.findall(found, text, re.M | re.S)).split()


def _known(lines, work_env):
    """Of each line a|b the first package that the package sources have."""
    for line in lines:
        for name in line.split("|"):
            shown = subprocess.run(["apt-cache", "show", name], capture_output=True, env=work_env)
            if shown.returncode == 0:
                yield name
                break
        else:
            raise SystemExit(f"package: the system's package sources have no {line}")


def _unpack(archive, root, database):
    """Unpacks a package, and writes what dpkg would about it, with its files where they are."""
    def output(*command):
        return subprocess.run(command, check=True, text=True, stdout=subprocess.PIPE).stdout

    subprocess.run(["dpkg-deb", "--extract", archive, root], check=True)
    fields = output("dpkg-deb", "--field", archive)
    package = re.search(r"^Package: (\S+)", fields, re.M).group(1)
    if re.search(r"^Multi-Arch: same$", fields, re.M):
        package += ":" + re.search(r"^Architecture: (\S+)", fields, re.M).group(1)
    with open(database / "status", "a", encoding="utf-8") as status:
        status.write(fields.rstrip("\n") + "\nStatus: install ok installed\n\n")
    with subprocess.Popen(["dpkg-deb", "--fsys-tarfile", archive], stdout=subprocess.PIPE) as tar:
        with tarfile.open(fileobj=tar.stdout, mode="r|") as files:
            names = [str(root / name) for name in files.getnames()]
    (database / "info" / f"{package}.list").write_text("\n".join(names) + "\n")
    with tempfile.TemporaryDirectory() as control:
        subprocess.run(["dpkg-deb", "--control", archive, control], check=True)
        for kind in ("shlibs", "symbols"):
            file = pathlib.Path(control, kind)
            if file.exists():
                shutil.copyfile(file, database / "info" / f"{package}.{kind}")


def _make_links_relative(root):
    """Links to absolute paths are meant from the root of a system, which this folder is not."""
    for folder, folders, files in os.walk(root):
        for link in (pathlib.Path(folder, name) for name in (*folders, *files)):
            if link.is_symlink() and os.path.isabs(target := os.readlink(link)):
                link.unlink()
                link.symlink_to(os.path.relpath(f"{root}{target}", folder))


def _move_cmake_files(root):
    """The same for absolute paths in CMake's descriptions of libraries (draco's, assimp's)."""
    for file in (root / "usr").rglob("cmake/**/*.cmake"):
        text = file.read_text(encoding="utf-8")
        file.write_text(re.sub(r'(?<=[";:])/usr(?=[/";])', f"{root}/usr", text), encoding="utf-8")


def fetch(arch, lines, root, alone=False):
    """Unpacks Debian's packages of an architecture, by the package sources of this system.

    alone: without those that they depend on. No root rights are needed, and no database of this
    system changes. The folder has one of its own.
    """
    shutil.rmtree(root, ignore_errors=True)
    database = root / "var/lib/dpkg"
    (database / "info").mkdir(parents=True)
    (database / "info/format").write_text("1\n")  # of lists: with :arch in their names
    with tempfile.TemporaryDirectory() as folder:
        archives = pathlib.Path(folder, "cache/archives")
        for name in (pathlib.Path(folder, "state/lists/partial"), archives / "partial"):
            name.mkdir(parents=True)
        pathlib.Path(folder, "state/status").touch()
        config = pathlib.Path(folder, "apt.conf")
        config.write_text(APT.format(arch=arch, folder=folder))
        env = os.environ | {"APT_CONFIG": str(config)}

        def apt(*command, **options):
            subprocess.run(["apt-get", "-qq", *command], check=True, stdout=sys.stderr, env=env,
                           **options)  # fmt: skip

        apt("update")
        if alone:
            apt("download", *_known(lines, env), cwd=archives)
        else:
            apt("--download-only", "install", *_known(lines, env))
        for archive in sorted(archives.glob("*.deb")):
            _unpack(archive, root, database)
    _make_links_relative(root)


def sysroot(arch, root):
    """Fills a folder with what a build for an architecture, and its unit tests, link."""
    lines = [
        line
        for line in _lines("build", "build-aarch64", "converters", "unit")
        if line.startswith("lib") or line.endswith("-dev")
    ]
    complete = root / "complete"  # with these lines
    if complete.exists() and complete.read_text().split() == lines:
        return
    fetch(arch, lines, root)
    _move_cmake_files(root)
    complete.write_text("\n".join(lines) + "\n")


def base(arch, root):
    """Fills a folder with the packages of a container."""
    fetch(arch, _lines("image"), root, alone=True)
