"""The container image of docker/Dockerfile, which builds by itself, as a file for `docker load`."""

import gzip
import shutil
import subprocess
import sys

from . import tree


def engine():
    """The first of Docker and Podman that answers."""
    for name in ("docker", "podman"):
        found = shutil.which(name)
        if found and subprocess.run([found, "info"], capture_output=True).returncode == 0:
            return name
    raise SystemExit(
        "package: an image needs a running Docker engine, or Podman; without them, "
        "tests/docker/run builds and tests it by buildah"
    )


def make(engine, work, out, arch):
    name = f"tessera:{tree.version()}"
    # Podman's own format has no health check.
    form = ["--format", "docker"] if engine == "podman" else []
    for step in (["build", *form, "-f", "docker/Dockerfile", "-t", name, "."],
                 ["save", "-o", work / "image.tar", name]):  # fmt: skip
        if subprocess.run([engine, *step], cwd=tree.ROOT, stdout=sys.stderr).returncode:
            raise SystemExit(f"package: {engine} {step[0]} failed; see its messages above")
    file = out / f"tessera-{tree.version()}-image-{arch}.tar.gz"
    with open(work / "image.tar", "rb") as raw, gzip.open(file, "wb") as packed:
        shutil.copyfileobj(raw, packed)
    return file
