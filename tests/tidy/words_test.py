#!/usr/bin/env python3
"""Checks texts for users (page, command line, API, README, guide): no wording of words.txt, and one
term per concept.

Run from the repository root; exits 1 and lists every fault. --self-test plants one fault of each
kind and exits 1 if one is not detected. Standard library only.
"""

import pathlib
import re
import sys

WORDINGS = pathlib.Path(__file__).with_name("words.txt")
ROOTS = ("README.md", "clients", "api", "server", "core/denoise", "core/film",
         "core/integrators", "core/lab", "core/layers", "core/render", "core/scene_io",
         "core/settings")
SUFFIXES = {".md", ".cpp", ".h", ".ts", ".tsx", ".py", ".html"}
NOT_OURS = {"node_modules", "__pycache__", "dist", ".venv", "build"}
# Term -> replacement, only in prose: names in code keep theirs. `--picture` is a flag, `panorama` a
# camera.
TERMS = {
    r"(?<![-.])\bpictures?\b(?![=(:]|[.-]\w)": "image",
    r"\bpanoramas? (?:file|map|image)|\blight around\b": "environment",
    r"\bknobs?\b": "setting",
    r"\bdice\b": "random numbers",
    r"\d %(?![a-z])": "the per cent sign right behind the number",
    r"\bas it says\b|\bhow wrong\b": "error",
}
# The same for documents alone: phrases that give a translation away.
PHRASES = {
    r"\bfor ever\b": "forever",
    r"\b(?:is|are) to be\b": "must or should be",
    r"\bso many\b(?! more)": "the number, or N",
    r"\bstands? (?:in|at|beside|under|below|there)\b": "is in, at, under",
    r"\bgoes? neither with\b": "cannot be combined with",
    r"\b(?:is|are) told\b": "is reported",
    r"\bwhoever\b": "users who, a client that",
    r"\bmatt\b": "diffuse or matte",
}
LITERAL = re.compile(r'"((?:[^"\\\n]|\\.)*)"' + r"|'((?:[^'\\\n]|\\.)*)'" + r"|`([^`\n]*)`")
COMMENT = re.compile(r"^\s*(//|\*|/\*|#)")
BETWEEN = r"""(?:\s+| ?["'`]\s*\+?\s*["'`] ?)"""


def wordings():
    """(pattern, forbidden, better) of each line."""
    for line in WORDINGS.read_text(encoding="utf-8").splitlines():
        if line and not line.startswith("#"):
            forbidden, better = line.split(" => ", 1)
            words = [re.escape(word).replace("’", "['’]") for word in forbidden.split()]
            yield re.compile(BETWEEN.join(words)), forbidden, better


def prose(path: str, text: str):
    """The lines of a document without code; the literals of a source that contain several words."""
    fenced = False
    for number, line in enumerate(text.splitlines(), 1):
        if path.endswith(".md"):
            fenced ^= line.startswith("```")
            if not fenced and not line.startswith("    "):
                yield number, re.sub(r"`[^`]*`|\]\([^)]*\)", "", line)
        elif not COMMENT.match(line):
            for match in LITERAL.finditer(re.sub(r"\$\{[^}]*\}", "0", line)):
                if " " in (words := next((w for w in match.groups() if w), "")):
                    yield number, words


def faults_in(path: str, text: str, forbidden):
    for pattern, wording, better in forbidden:
        for match in pattern.finditer(text):
            number = text.count("\n", 0, match.start()) + 1
            yield f"{path}:{number}: \"{wording}\": write \"{better}\""
    terms = TERMS | PHRASES if path.endswith(".md") else TERMS
    for number, line in prose(path, text):
        for term, better in terms.items():
            if found := re.search(term, line, re.IGNORECASE):
                yield f"{path}:{number}: \"{found.group()}\": write {better}"


def files_of_tree():
    for root in ROOTS:
        place = pathlib.Path(root)
        for file in [place] if place.is_file() else sorted(place.rglob("*")):
            if file.suffix in SUFFIXES and file.is_file() and not NOT_OURS & set(file.parts):
                yield file


PLANTED = [
    ("clients/web/src/view/a.tsx", "<p>Waiting\n  for its turn.</p>", "Queued."),
    ("api/a.cpp", '"The picture "\n    "so far. In the format of the extension."', "Get the image"),
    ("clients/web/src/view/a.tsx", "<legend>Stop when</legend>", "Stop rendering when"),
    ("README.md", "The picture is ready.", "image"),
    ("clients/web/src/guide/start.md", "At most 5 % of it.", "per cent"),
    ("README.md", "The layout stands in `/docs`.", "is in, at, under"),
    ("clients/cli/a.cpp", 'f("The picture of a job");', "image"),
    ("clients/web/src/view/a.tsx", "hint='What a panorama file is'", "environment"),
]
CLEAN = [
    ("README.md", "Draw it with `--picture`. It takes 5% of the time.\n\n    tessera picture %\n"),
    ("clients/cli/a.cpp", '// The picture.\nf("--picture=blocks draws an image");'),
]


def self_test(forbidden) -> int:
    missed = [f"not seen in {path}: {text!r}" for path, text, words in PLANTED
              if not any(words in fault for fault in faults_in(path, text, forbidden))]
    missed += [f"false alarm: {fault}" for path, text in CLEAN
               for fault in faults_in(path, text, forbidden)]
    print("\n".join(missed) or f"words self-test: {len(PLANTED)} planted faults seen")
    return 1 if missed else 0


def main() -> int:
    forbidden = list(wordings())
    if "--self-test" in sys.argv[1:]:
        return self_test(forbidden)
    found = [fault for file in files_of_tree()
             for fault in faults_in(file.as_posix(), file.read_text(encoding="utf-8"), forbidden)]
    print("\n".join(found) or f"words: ok ({len(forbidden)} wordings)")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
