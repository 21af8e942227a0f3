"""The Debian package: the tree under /usr, less the libraries that Debian itself keeps safe."""

import os
import re
import shutil
import subprocess

from . import elf, tree

# From the distribution, which replaces them when a fault is found: what reads files and connections
# of others. Their names are the same in Debian 12 and 13. The package includes the other libraries
# (Embree, OpenImageIO, Assimp, ...), whose names differ, so that one package suits both.
PROVIDED = re.compile(
    r"lib(crypto|curl|jpeg|png16|sqlite3|ssl|tiff|webp|webpdemux|z|zstd)\.so\.\d+"
)
CONTROL = """\
Package: tessera
Version: {version}
Architecture: {arch}
Maintainer: Tessera <tessera@localhost>
Installed-Size: {kilobytes}
Depends: passwd, {libraries}
Recommends: ca-certificates
Section: graphics
Priority: optional
Description: render server that reports the error of every image
 Renders glTF scenes by path tracing: a command, and a service with an HTTP API and a web page.
 The service is not started by the installation: systemctl enable --now tessera
"""
POSTINST = """\
#!/bin/sh
set -e
if [ "$1" = configure ]; then
  getent passwd tessera >/dev/null || useradd --system --user-group --home-dir /var/lib/tessera \\
    --no-create-home --shell /usr/sbin/nologin tessera
  install -d -m 700 -o tessera -g tessera /var/lib/tessera
  install -d -m 755 /etc/tessera
  if [ ! -e /etc/tessera/tessera.conf ]; then
    install -m 640 -g tessera /dev/null /etc/tessera/tessera.conf
  fi
  if [ -d /run/systemd/system ]; then
    systemctl daemon-reload
    systemctl try-restart tessera.service
  fi
fi
"""
PRERM = """\
#!/bin/sh
set -e
if [ "$1" = remove ]; then
  if [ -d /run/systemd/system ]; then systemctl disable --now tessera.service; fi
  rm -rf /usr/lib/tessera/oidn  # of tessera-fetch-denoiser
fi
"""
# Removing keeps data, settings and user; purging leaves nothing.
POSTRM = """\
#!/bin/sh
set -e
if [ -d /run/systemd/system ]; then systemctl daemon-reload; fi
if [ "$1" = purge ]; then
  rm -rf /var/lib/tessera /etc/tessera
  if getent passwd tessera >/dev/null; then userdel tessera; fi
fi
"""
SCRIPTS = {"postinst": POSTINST, "prerm": PRERM, "postrm": POSTRM}


def depends(work, usr, included, machine):
    """The packages, with the oldest version of each, that have what the tree needs.

    included: packages of which the tree has what it needs.
    """
    source = "Source: tessera\n\nPackage: tessera\nArchitecture: any\n"
    (work / "debian/control").write_text(source)
    places = [usr / tree.LIBRARIES, *(machine.folders() if machine.root else ())]
    line = elf.output(
        "dpkg-shlibdeps", "-O", f"-S{usr.parent}", *machine.dpkg(),
        *(f"-l{place}" for place in places), *(f"-x{package}" for package in included),
        *tree.elf_files(usr), cwd=work, env=os.environ | {"DEB_HOST_ARCH": machine.arch},
    )  # fmt: skip
    return line.strip().removeprefix("shlibs:Depends=")


def make(build, work, out, machine):
    root = work / "debian/tessera"  # where dpkg-shlibdeps looks for a package's own libraries
    usr = root / "usr"
    included = tree.make(build, usr, machine, PROVIDED)
    tree.check(usr, work, machine)
    doc = usr / "share/doc/tessera"
    (doc / "LICENSE").rename(doc / "copyright")
    vendor = usr / "share/zsh"
    (vendor / "site-functions").rename(vendor / "vendor-completions")  # where Debian's zsh looks
    unit = root / "usr/lib/systemd/system/tessera.service"
    unit.parent.mkdir(parents=True)
    text = (tree.ROOT / "docker/tessera.service").read_text(encoding="utf-8")
    head, _, rest = text.partition("[Unit]")
    del head  # how to install it by hand
    unit.write_text("[Unit]" + rest.replace("/usr/local/bin", "/usr/bin"), encoding="utf-8")
    thumbnailer = usr / "share/thumbnailers/tessera.thumbnailer"  # of file managers
    thumbnailer.parent.mkdir(parents=True)
    shutil.copyfile(tree.ROOT / "docker/tessera.thumbnailer", thumbnailer)
    control = root / "DEBIAN"
    control.mkdir()
    libraries = depends(work, usr, included, machine)
    kilobytes = sum(file.stat().st_size for file in usr.rglob("*") if file.is_file()) // 1024
    (control / "control").write_text(
        CONTROL.format(
            version=tree.debian_version(), arch=machine.arch, kilobytes=kilobytes,
            libraries=libraries,
        )
    )
    for name, script in SCRIPTS.items():
        (control / name).write_text(script)
        (control / name).chmod(0o755)
    file = out / f"tessera_{tree.debian_version()}_{machine.arch}.deb"
    # xz compresses better than dpkg's zstd and every dpkg reads it.
    subprocess.run(
        ["dpkg-deb", "--root-owner-group", "-Zxz", "--build", root, file],
        check=True, stdout=subprocess.DEVNULL, env={"SOURCE_DATE_EPOCH": "0"} | os.environ,
    )  # fmt: skip
    return file
