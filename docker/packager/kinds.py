"""The kinds of packages: each function writes one file and returns its path."""

import gzip
import os
import shutil
import tarfile

from . import deb, tree, wheel


def _plain(info):
    """An entry of a tar file as every build writes it: no owner, no date."""
    info.uid = info.gid = 0
    info.uname = info.gname = "root"
    info.mtime = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    info.mode = 0o755 if info.isdir() or info.mode & 0o100 else 0o644
    return info


def write_tar(folder, name, file):
    """Writes a folder as `name` to a tar.gz with the same bytes each time."""
    with (
        open(file, "wb") as raw,
        gzip.GzipFile("", "wb", 9, raw, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as archive,
    ):
        archive.add(folder, name, filter=_plain)  # in the order of names


def tarball(build, work, out, machine):
    name = f"tessera-{tree.version()}-linux-{machine.arch}"
    folder = work / name
    tree.make(build, folder, machine)
    tree.check(folder, work, machine)
    shutil.copyfile(tree.ROOT / "docker/packager/README.tarball", folder / "README")
    file = out / f"{name}.tar.gz"
    write_tar(folder, name, file)
    return file


KINDS = {"tarball": tarball, "deb": deb.make, "wheel": wheel.make}
