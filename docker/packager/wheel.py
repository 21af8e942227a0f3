"""The Python package with the server inside: the wheel of clients/python and the tree.

A tree of libraries in a package is what auditwheel makes; here it exists already, so that only the
platform of the wheel is missing (PEP 600): that of the oldest glibc with the symbols used.
"""

import base64
import hashlib
import shutil
import subprocess
import sys
import zipfile

from . import elf, tree

# In the package tessera_render; _program.py looks there.
PLACE = "tessera_render/server"
ENTRY = "[console_scripts]\ntessera = tessera_render._program:main\n"


def _pure_wheel(work):
    """The wheel of the client as pip builds it from pyproject.toml, by the packages of Debian."""
    source = work / "client"
    shutil.copytree(tree.ROOT / "clients/python", source)
    version = source / "src/tessera_render/_version.py"
    version.write_text(f'__version__ = "{tree.python_version()}"\n')
    subprocess.run(
        ["/usr/bin/python3", "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation",
         "--wheel-dir", work, source],
        check=True, stdout=sys.stderr,
    )  # fmt: skip
    (wheel,) = work.glob("*.whl")
    return wheel


def _entry(name, mode):
    info = zipfile.ZipInfo(name)  # of 1980, the oldest date that a zip has
    info.compress_type = zipfile.ZIP_DEFLATED
    info.external_attr = (0o100000 | mode) << 16
    return info


def make(build, work, out, machine):
    folder = work / "tree"
    tree.make(build, folder, machine)
    tree.check(folder, work, machine)
    major, minor = elf.oldest_glibc(tree.elf_files(folder), machine)
    tag = f"py3-none-manylinux_{major}_{minor}_{machine.processor}"
    files = {}  # name -> (content, mode)
    with zipfile.ZipFile(_pure_wheel(work)) as pure:
        for name in pure.namelist():
            files[name] = (pure.read(name), 0o644)
    for path in sorted(path for path in folder.rglob("*") if path.is_file()):
        mode = 0o755 if path.stat().st_mode & 0o100 else 0o644
        files[f"{PLACE}/{path.relative_to(folder)}"] = (path.read_bytes(), mode)
    (record,) = (name for name in files if name.endswith(".dist-info/RECORD"))
    info = record.removesuffix("RECORD")
    del files[record]
    lines = files[info + "WHEEL"][0].decode().splitlines()
    kept = [line for line in lines if line and not line.startswith(("Root-Is-Purelib", "Tag"))]
    text = "\n".join([*kept, "Root-Is-Purelib: false", f"Tag: {tag}", ""])
    files[info + "WHEEL"] = (text.encode(), 0o644)
    files[info + "entry_points.txt"] = (ENTRY.encode(), 0o644)
    lines = []
    file = out / f"{info.removesuffix('.dist-info/')}-{tag}.whl"
    with zipfile.ZipFile(file, "w") as wheel:
        for name, (content, mode) in files.items():
            wheel.writestr(_entry(name, mode), content, compresslevel=9)
            sum256 = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=")
            lines.append(f"{name},sha256={sum256.decode()},{len(content)}\n")
        wheel.writestr(_entry(record, 0o644), "".join(lines) + f"{record},,\n", compresslevel=9)
    return file
