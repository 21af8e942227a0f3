"""The container image: the tarball's tree on a few packages of Debian, as a file for `docker load`.

The file is an OCI image layout, with the list that older versions of Docker read, and is made
without Docker. What the container runs, and as whom, is in the last stage of docker/Dockerfile.
"""

import gzip
import hashlib
import json
import re
import shlex
import shutil
import subprocess
import sys
import tarfile

from . import machine as machines
from . import tar, tree

USER = 10001  # of docker/Dockerfile, too
# Of Debian's packages, what a container never reads.
EXCLUDED = ("usr/share/bug", "usr/share/info", "usr/share/lintian", "usr/share/locale",
            "usr/share/man", "usr/lib/*/gconv", "var/lib/dpkg/info")  # fmt: skip
SCRIPTS = ("entrypoint", "healthcheck")
FILES = {
    "etc/passwd": "root:x:0:0:root:/root:/bin/sh\n"
    f"tessera:x:{USER}:{USER}::/data:/usr/sbin/nologin\n",
    "etc/group": f"root:x:0:\ntessera:x:{USER}:\n",
    "etc/nsswitch.conf": "hosts: files dns\n",
}


def _base(root, machine):
    """Fills a folder with the packages, a shell, users, and the certificates."""
    machines.base(machine.arch, root)
    for pattern in EXCLUDED:
        for folder in root.glob(pattern):
            shutil.rmtree(folder)
    for file in (root / "usr/share/doc").rglob("*"):
        if file.is_file() and file.name != "copyright":
            file.unlink()
    for name, content in FILES.items():
        (root / name).write_text(content)
    applets = machine.running(root / "bin/busybox", "--list")
    listed = subprocess.run(applets, check=True, text=True, stdout=subprocess.PIPE).stdout
    for name in listed.split():
        if not (root / "bin" / name).exists():
            (root / "bin" / name).symlink_to("busybox")
    certificates = sorted((root / "usr/share/ca-certificates/mozilla").glob("*.crt"))
    bundle = root / "etc/ssl/certs/ca-certificates.crt"
    bundle.parent.mkdir(parents=True, exist_ok=True)
    bundle.write_bytes(b"".join(file.read_bytes() for file in certificates))


def _describe_base(base, usr):
    """Adds the packages of the base to the list of what is included."""
    sbom = usr / "share/doc/tessera/sbom.spdx.json"
    text = json.loads(sbom.read_text(encoding="utf-8"))
    for fields in (base / "var/lib/dpkg/status").read_text(encoding="utf-8").split("\n\n"):
        said = dict(re.findall(r"^(Package|Version|Source): (\S+)", fields, re.M))
        if said:
            text["packages"].append(
                tree.described(
                    said["Package"], said["Version"], said.get("Source", said["Package"]),
                    "Of the system", f"/usr/share/doc/{said['Package']}/copyright",
                )
            )  # fmt: skip
    sbom.write_text(json.dumps(text, indent=1) + "\n", encoding="utf-8")


def _nanoseconds(seconds):
    return int(seconds.removesuffix("s")) * 10**9


def configuration(has_denoiser):
    """What a container of the image runs: the instructions of the Dockerfile's last stage."""
    text = (tree.ROOT / "docker/Dockerfile").read_text(encoding="utf-8").replace("\\\n", " ")
    stage = text[text.rindex("\nFROM ") :]
    said = dict(re.findall(r"^([A-Z]+) +(.*)$", stage, re.M))
    variables = said["ENV"].split()
    if not has_denoiser:
        variables = [word for word in variables if not word.startswith("TESSERA_OIDN=")]
    options, _, command = said["HEALTHCHECK"].partition(" CMD ")
    health = dict(word.removeprefix("--").split("=") for word in shlex.split(options))
    return {
        "User": said["USER"],
        "ExposedPorts": {f"{said['EXPOSE']}/tcp": {}},
        "Env": ["PATH=/usr/local/bin:/usr/bin:/bin", *variables],
        "Entrypoint": json.loads(said["ENTRYPOINT"]),
        "Cmd": json.loads(said["CMD"]),
        "Volumes": {said["VOLUME"]: {}},
        "StopSignal": said["STOPSIGNAL"],
        "Healthcheck": {
            "Test": ["CMD", *json.loads(command)],
            "Interval": _nanoseconds(health["interval"]),
            "Timeout": _nanoseconds(health["timeout"]),
            "StartPeriod": _nanoseconds(health["start-period"]),
            "Retries": int(health["retries"]),
        },
    }


def _layer(folder, file):
    """Writes a folder as a layer. Returns the sha256 of the tar file in it."""

    def entry(info):
        info = tar.plain(info)
        if info.name == "data":  # the volume, which Docker fills like this
            info.uid = info.gid = USER
            info.uname = info.gname = "tessera"
            info.mode = 0o700
        elif info.name == "tmp":
            info.mode = 0o1777
        return info

    plain = file.with_suffix(".plain")
    with tarfile.open(plain, "w", format=tarfile.GNU_FORMAT) as archive:
        for path in sorted(folder.iterdir()):
            archive.add(path, path.name, filter=entry)
    content = plain.read_bytes()
    file.write_bytes(gzip.compress(content, 9, mtime=0))
    plain.unlink()
    return hashlib.sha256(content).hexdigest()


class _Layout:
    """The files of an OCI image layout."""

    def __init__(self, folder):
        self.folder = folder
        self.blobs = folder / "blobs/sha256"
        self.blobs.mkdir(parents=True)

    def add(self, kind, content):
        """Adds a blob. Returns its descriptor."""
        digest = hashlib.sha256(content).hexdigest()
        (self.blobs / digest).write_bytes(content)
        return {
            "mediaType": f"application/vnd.oci.image.{kind}",
            "digest": f"sha256:{digest}",
            "size": len(content),
        }

    def write(self, name, text):
        (self.folder / name).write_text(json.dumps(text))


def _json(text):
    return json.dumps(text, sort_keys=True).encode()


def make(build, work, out, machine):
    base, own = work / "base", work / "own"
    usr = own / "usr/local"
    tree.make(build, usr, machine)
    tree.check(usr, work, machine)
    _base(base, machine)
    _describe_base(base, usr)
    for name in SCRIPTS:
        shutil.copy(tree.ROOT / "docker" / name, usr / f"bin/tessera-{name}")
    (own / "data").mkdir()
    has_denoiser = machine.arch == "amd64"
    if has_denoiser:
        subprocess.run(["docker/fetch-denoiser", usr / "lib/tessera"], cwd=tree.ROOT, check=True,
                       stdout=sys.stderr)  # fmt: skip
    layout = _Layout(work / "layout")
    layers, sums = [], []
    for folder in (base, own):
        file = work / f"{folder.name}.tar.gz"
        sums.append(f"sha256:{_layer(folder, file)}")
        layers.append(layout.add("layer.v1.tar+gzip", file.read_bytes()))
    config = layout.add("config.v1+json", _json({
        "architecture": machine.arch,
        "os": "linux",
        "created": "1970-01-01T00:00:00Z",
        "config": configuration(has_denoiser),
        "rootfs": {"type": "layers", "diff_ids": sums},
    }))  # fmt: skip
    manifest = layout.add("manifest.v1+json", _json({
        "schemaVersion": 2,
        "mediaType": "application/vnd.oci.image.manifest.v1+json",
        "config": config,
        "layers": layers,
    }))  # fmt: skip
    manifest["platform"] = {"architecture": machine.arch, "os": "linux"}
    tags = (tree.version(), "latest")
    layout.write("oci-layout", {"imageLayoutVersion": "1.0.0"})
    layout.write("index.json", {
        "schemaVersion": 2,
        "mediaType": "application/vnd.oci.image.index.v1+json",
        "manifests": [
            manifest | {"annotations": {
                "org.opencontainers.image.ref.name": tag,
                "io.containerd.image.name": f"docker.io/library/tessera:{tag}",
            }}
            for tag in tags
        ],
    })  # fmt: skip

    def place(blob):
        return "blobs/" + blob["digest"].replace(":", "/")

    layout.write("manifest.json", [{
        "Config": place(config),
        "RepoTags": [f"tessera:{tag}" for tag in tags],
        "Layers": [place(layer) for layer in layers],
    }])  # fmt: skip
    file = out / f"tessera-{tree.version()}-image-{machine.arch}.tar"
    with tarfile.open(file, "w", format=tarfile.GNU_FORMAT) as archive:
        for path in sorted(layout.folder.iterdir()):
            archive.add(path, path.name, filter=tar.plain)
    return file
