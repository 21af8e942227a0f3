"""Archives with the same bytes each time."""

import gzip
import os
import tarfile


def plain(info):
    """An entry of a tar file as every build writes it: no owner, no date."""
    info.uid = info.gid = 0
    info.uname = info.gname = "root"
    info.mtime = int(os.environ.get("SOURCE_DATE_EPOCH", "0"))
    info.mode = 0o755 if info.isdir() or info.mode & 0o100 else 0o644
    return info


def write(folder, name, file):
    """Writes a folder as `name` to a tar.gz."""
    with (
        open(file, "wb") as raw,
        gzip.GzipFile("", "wb", 9, raw, mtime=0) as packed,
        tarfile.open(fileobj=packed, mode="w", format=tarfile.GNU_FORMAT) as archive,
    ):
        archive.add(folder, name, filter=plain)  # in the order of names
