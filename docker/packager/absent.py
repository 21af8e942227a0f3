"""Stand-ins for libraries of OpenImageIO and libheif that Tessera never calls.

Debian's OpenImageIO reads forty formats and so loads 260 libraries, 300 MB with ffmpeg, OpenCV,
GDAL and OpenVDB. Tessera reads and writes few formats by it (core/image_io/image_formats.cpp). In
place of the libraries of other formats a package has libraries that define the same symbols, each
of which ends the process with a sentence. None of their code is copied, nor their licences.
"""

import re
import subprocess

from . import elf

# By the formats or functions that need them.
UNUSED = re.compile(
    r"lib(opencv_\w+"  # video capture
    r"|dcm\w+|of(log|std)"  # DICOM
    r"|av(codec|format|util)|swscale"  # video
    r"|gif|openjp2|openvdb|raw_r"  # GIF, JPEG 2000, volumes, camera raw
    r"|dav1d|de265|x265"  # libheif: reading AVIF, and HEIC; it writes AVIF by libaom
    r"|OpenColorIO"  # colour conversion; its own is in core/color
    r"|freetype"  # text in images
    r")(-[\d.]+)?\.so[\d.]*"
)
# Symbol -> what it does instead. These are called when OpenImageIO is loaded or ends (the DICOM
# reader registers colour models, libheif prepares its decoder) and when it lists the versions of
# its libraries.
AT_LOAD = {
    "_ZN10DiRegisterC1Ev": "nothing",
    "_ZN10DiRegisterD1Ev": "nothing",
    "de265_free": "nothing",
    "de265_init": "nothing",
    "libraw_version": "no_version",
    "opj_version": "no_version",
}
SOURCE = """
#include <stdlib.h>
#include <unistd.h>
static const char kWords[] =
    "tessera: %(name)s is not part of this package, because nothing should call it: a mistake\\n";
__attribute__((noreturn, used)) static void absent(void) {
  if (write(2, kWords, sizeof kWords - 1) < 0) abort();
  abort();
}
__attribute__((used)) static void nothing(void) {}
__attribute__((used)) static const char* no_version(void) { return "absent"; }
"""


def _symbols(file, which, machine):
    """(name, version, letter, bytes) of the dynamic symbols of a file."""
    nm = (machine.tool("nm"), "-D", "-P", "--with-symbol-versions", which)
    for line in elf.output(*nm, file).splitlines():
        name, letter, *numbers = line.split()
        name, _, version = name.partition("@")
        size = int(numbers[1], 16) if len(numbers) > 1 else 0
        yield name, version.strip("@"), letter, size


def make(user, name, library, place, machine):
    """Writes the stand-in for a library: the symbols of it that `user` uses."""
    used = _symbols(user, "--undefined-only", machine)
    wanted = {(symbol, version) for symbol, version, _, _ in used}
    versions = {}
    text = [SOURCE % {"name": name}]
    for symbol, version, letter, size in sorted(
        _symbols(library, "--defined-only", machine)
    ):
        if (symbol, version) not in wanted:
            continue
        versions.setdefault(version, []).append(symbol)
        if letter in "TtWi":
            text.append(
                f'__asm__(".globl \\"{symbol}\\"\\n.type \\"{symbol}\\",@function\\n'
                f'.set \\"{symbol}\\", {AT_LOAD.get(symbol, "absent")}");'
            )
        else:
            text.append(
                f'__asm__(".pushsection .bss\\n.balign 16\\n.globl \\"{symbol}\\"\\n'
                f'.type \\"{symbol}\\",@object\\n.size \\"{symbol}\\", {size}\\n'
                f'\\"{symbol}\\": .zero {max(size, 8)}\\n.popsection");'
            )
    command = [machine.tool("gcc"), "-x", "c", "-O1", "-shared", "-fPIC", "-s",
               "-Wl,--build-id=none", "-Wl,-z,noexecstack", f"-Wl,-soname,{name}",
               "-o", str(place)]  # fmt: skip
    script = place.with_suffix(".versions")
    named = {version: symbols for version, symbols in versions.items() if version}
    if named:
        script.write_text(
            "".join(
                f"{version} {{ global: {'; '.join(symbols)}; }};\n"
                for version, symbols in sorted(named.items())
            )
        )
        command.append(f"-Wl,--version-script={script}")
    subprocess.run([*command, "-"], input="\n".join(text) + "\n", text=True, check=True)
    script.unlink(missing_ok=True)
