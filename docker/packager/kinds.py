"""The kinds of packages: each function writes one file and returns its path."""

import shutil

from . import deb, image, tar, tree, wheel


def tarball(build, work, out, machine):
    name = f"tessera-{tree.version()}-linux-{machine.arch}"
    folder = work / name
    tree.make(build, folder, machine)
    tree.check(folder, work, machine)
    shutil.copyfile(tree.ROOT / "docker/packager/README.tarball", folder / "README")
    file = out / f"{name}.tar.gz"
    tar.write(folder, name, file)
    return file


KINDS = {"tarball": tarball, "deb": deb.make, "wheel": wheel.make, "image": image.make}
