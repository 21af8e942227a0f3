#!/usr/bin/env python3
"""Turns a built page into a C++ source.

    embed.py DIST_DIR OUT.cpp

Text is stored gzip-compressed, compressed files (fonts, pictures) as they are. The bytes become
string literals, which both compilers read many times faster than lists of numbers. The output
depends on the files alone: no times, no paths.
"""

import gzip
import hashlib
import mimetypes
import pathlib
import sys

MIME = {
    ".html": "text/html; charset=utf-8",
    ".js": "text/javascript; charset=utf-8",
    ".css": "text/css; charset=utf-8",
    ".svg": "image/svg+xml",
    ".json": "application/json",
    ".webmanifest": "application/manifest+json",
    ".woff2": "font/woff2",
    ".png": "image/png",
    ".webp": "image/webp",
    ".txt": "text/plain; charset=utf-8",
}
LITERAL_BYTES = 64
ESCAPES = [f"\\{byte:03o}" for byte in range(256)]
for plain in range(0x20, 0x7F):
    if chr(plain) not in '"\\?':
        ESCAPES[plain] = chr(plain)


def literal(data: bytes) -> str:
    lines = []
    for start in range(0, len(data), LITERAL_BYTES):
        lines.append(
            '    "' + "".join(ESCAPES[byte] for byte in data[start : start + LITERAL_BYTES]) + '"'
        )
    return "\n".join(lines) or '    ""'


def mime_of(path: pathlib.Path) -> str:
    return MIME.get(path.suffix) or mimetypes.guess_type(path.name)[0] or "application/octet-stream"


def main() -> int:
    if len(sys.argv) != 3:
        print(__doc__, file=sys.stderr)
        return 2
    root, out = pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2])
    files = sorted(path for path in root.rglob("*") if path.is_file())
    if not (root / "index.html").is_file():
        print(f"embed.py: there is no index.html in {root}", file=sys.stderr)
        return 1
    arrays, rows = [], []
    for number, path in enumerate(files):
        name = path.relative_to(root).as_posix()
        raw = path.read_bytes()
        packed = gzip.compress(raw, 9, mtime=0)
        is_gzip = len(packed) < len(raw) * 0.95
        data = packed if is_gzip else raw
        url = "/" + name.removesuffix("index.html").removesuffix(".html")
        etag = hashlib.sha256(raw).hexdigest()[:16]
        immutable = name.startswith("assets/")
        arrays.append(f"constexpr unsigned char kData{number}[] =\n{literal(data)};\n")
        rows.append(
            f'    File{{"{url}", "{mime_of(path)}", "\\"{etag}\\"", '
            f'kData{number}, {len(data)}, {len(raw)},\n'
            f"         {str(is_gzip).lower()}, {str(immutable).lower()}}},\n"
        )
    text = (
        "// Made by clients/web/embed.py.\n"
        '#include "clients/web/web_page.h"\n\n'
        "#if defined(__clang__)\n"
        '#pragma clang diagnostic ignored "-Woverlength-strings"\n'
        "#endif\n\n"
        "#include <array>\n\n"
        "namespace web_page {\nnamespace {\n\n" + "\n".join(arrays) + "\n"
        f"constexpr std::array<File, {len(rows)}> kFiles = {{\n" + "".join(rows) + "};\n\n"
        "}  // namespace\n\n"
        "std::span<const File> files() { return kFiles; }\n\n"
        "}  // namespace web_page\n"
    )
    if not out.is_file() or out.read_text() != text:
        out.write_text(text)
    return 0


if __name__ == "__main__":
    sys.exit(main())
