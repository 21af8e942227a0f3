#!/usr/bin/env python3
"""Writes _client.py, job.py and batch.py of the Python package from their async_ twins.

    clients/synchronous.py [--check]

Client, Job and Batch are their asynchronous twins without `await`: words are replaced.
--check writes nothing and exits 1, with the names, if a file is not what would be written.
Standard library only.
"""

import pathlib
import re
import sys

PACKAGE = pathlib.Path(__file__).resolve().parent / "python/src/tessera_render"
FILES = {
    "async_client.py": "_client.py",
    "async_job.py": "job.py",
    "async_batch.py": "batch.py",
}
HEAD = "# Written by clients/synchronous.py from {}: do not edit.\n"

# Applied one after another.
WORDS = (
    (r"calls to be awaited", "calls that wait"),
    (r"import asyncio\n", ""),
    (r"(?<=from \.)async_client", "_client"),  # tessera_render.client is a function
    (r"(?<=import )AsyncExitStack(?=, suppress)", "ExitStack"),
    (r"AsyncGenerator\[(\w+), None\]", r"Generator[\1, None, None]"),
    (r"await asyncio\.to_thread\(([\w.]+), ", r"\1("),
    (r"asyncio\.sleep", "time.sleep"),
    # A notebook may be answered at once.
    (r"    def _repr_html_.*?(?=    async def _html)", ""),
    (r"\b_html\b", "_repr_html_"),
    (r"\b_png\b", "_repr_png_"),
    (r"\basync([_ ]|(?=context))|\bAsync|\bawait ", ""),
    (r"(?<=__)a(?=enter__|exit__)|(?<=\.)a(?=iter_|read\(|close\()", ""),
    (r"(?m)^( *)for (\w+) in (.+):\n +yield \2$", r"\1yield from \3"),
)


def sorted_imports(text):
    """Names in an import of one line, and neighbouring imports from the package, in order."""

    def rank(name):  # Constants, classes, the rest.
        return (not name.isupper(), not name[0].isupper(), name)

    def names(match):
        return match[1] + ", ".join(sorted(match[2].split(", "), key=rank))

    text = re.sub(r"(?m)^(from \S+ import )([\w, ]+)$", names, text)
    return re.sub(
        r"(?m)(?:^from \.\w+ import [\w, ]+\n)+",
        lambda match: "".join(sorted(match[0].splitlines(keepends=True))),
        text,
    )


def synchronous(name):
    text = (PACKAGE / name).read_text(encoding="utf-8")
    for pattern, word in WORDS:
        text = re.sub(pattern, word, text, flags=re.DOTALL if "_repr_" in pattern else 0)
    return HEAD.format(name) + sorted_imports(text)


def main():
    stale = []
    for source, target in FILES.items():
        place, text = PACKAGE / target, synchronous(source)
        if not place.exists() or place.read_text(encoding="utf-8") != text:
            stale.append(target)
            if "--check" not in sys.argv[1:]:
                place.write_text(text, encoding="utf-8")
    if "--check" in sys.argv[1:] and stale:
        print("not what clients/synchronous.py writes: " + ", ".join(stale))
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
