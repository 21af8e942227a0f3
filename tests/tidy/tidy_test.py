#!/usr/bin/env python3
"""Checks rules that a compiler cannot: includes by layer, file and line length, banned words,
citations, and files and functions that comments name.

Run from the repository root; exits 1 and lists every fault. --self-test plants one fault of each
kind and exits 1 if one is not detected. --numbers writes the last column of
core/samplers/dimensions.h. Standard library only.
"""

import itertools
import os
import pathlib
import re
import sys
import textwrap

# The folders of core, bottom to top: each may include only those before it.
CORE_ORDER = ["base", "math", "color", "settings", "image_io", "description", "sampling",
              "samplers", "textures", "accel", "geometry", "media", "bsdf", "materials", "lights",
              "camera", "scene", "light_samplers", "film", "error", "denoise", "layers",
              "compare", "transport", "aovs", "integrators", "wave", "render",
              "scene_io", "lab"]
# Folder -> folders (or headers) it may include in addition to itself. The longest matching folder
# counts.
LAYERS = {f"core/{name}": [f"core/{lower}" for lower in CORE_ORDER[:i]]
          for i, name in enumerate(CORE_ORDER)}
LAYERS |= {
    "api": ["api", "core"],
    "server/http": ["server/http", "server/access.h", "api/json/error_codes.h",
                    "api/json/errors.h",
                    "api/problem.h", "core/base"],
    "server/config": ["server/config", "server/store", "server/http", "server/access.h",
                      "server/origin.h", "api", "core"],
    "server/observe": ["server/observe", "server/config/config.h", "core/base"],
    "server/store": ["server/store", "server/access.h", "api", "core"],
    "server/scenes": ["server/scenes", "server/store", "server/access.h", "server/observe",
                      "server/http/text.h", "api", "core"],
    "server/queue": ["server/queue", "core/base"],
    "server/workers": ["server/workers", "server/observe", "api", "core"],
    "server/jobs": ["server/jobs", "server/workers", "server/queue", "server/scenes",
                    "server/store", "server/access.h", "server/observe", "api", "core"],
    "server/pictures": ["server/pictures", "server/scenes", "server/observe", "api", "core"],
    "server/routes": ["server", "api", "core", "clients/web"],
    "server": ["server", "clients/web", "api", "core"],
    "clients/cli": ["clients/cli", "api", "core"],
    "clients/worker": ["clients/worker", "clients/cli", "server/queue", "api", "core"],
    "api/flags": ["api/flags", "core/base"],
    "server/main": ["server", "clients/cli", "core/base"],
    "clients/web": ["clients/web", "core/base"],
    "tests": ["tests", "clients/cli", "clients/web", "clients/worker", "server", "api", "core"],
}
# Folder -> folders it must not include although the table above would allow it.
NEVER = {
    "core/integrators": ["core/image_io/image_io.h"],
    "core/render": ["core/image_io/image_io.h"],
    "core/scene_io": ["core/integrators", "core/render", "core/film"],
    "core/lab": ["core/scene_io", "core/image_io/image_io.h", "core/accel"],
    "api": ["core/accel", "core/scene_io"],
}
# Only these files of the client may link the renderer: the others start without its libraries.
RENDERS_LOCALLY = {"clients/cli/convert.cpp", "clients/cli/converted_model.cpp",
                   "clients/cli/converted_model.h", "clients/cli/denoise.cpp",
                   "clients/cli/lab.cpp", "clients/cli/render.cpp",
                   "clients/cli/file_inputs.cpp", "clients/cli/file_inputs.h",
                   "clients/cli/render_job.cpp", "clients/cli/render_job.h",
                   "clients/worker/worker.cpp", "clients/worker/worker_jobs.cpp",
                   "clients/worker/worker_jobs.h"}
NEEDS_NO_RENDERER = ["core/base", "core/color/srgb.h"]
# Third-party header -> the only folders (or files) that may include it.
CONFINED = {
    "httplib.h": ["server/http", "clients/cli", "clients/worker", "tests"],
    "curl/": ["server/http"],
    "nlohmann/": ["api", "clients/cli", "clients/worker", "server", "tests",
                  "core/scene_io/gltf_json.h"],
    "CLI/": ["clients/cli", "clients/worker", "api/flags", "server/config/config.cpp"],
    "embree": ["core/accel"],
    "tbb/": ["core/accel"],
    "tiny_gltf.h": ["core/scene_io"],
    "draco/": ["core/scene_io", "tests"],
    "meshoptimizer.h": ["core/scene_io", "tests"],
    "assimp/": ["core/scene_io/assimp"],
    "OpenImageIO/": ["core/image_io"],
    "utf8proc.h": ["core/base"],
    "webp/": ["core/image_io", "tests"],
    "zstd.h": ["core/image_io"],
    "jpeglib.h": ["core/image_io"],
    "png.h": ["clients/cli/png.cpp", "core/image_io"],
    "nats/": ["server/queue"],
    "sqlite3.h": ["server/store", "tests"],
    "gtest/": ["tests"],
}
# nlohmann inside core: sources of scene_io only, which check glTF before tinygltf sees it.
CONFINED_SOURCES = {"nlohmann/": ["core/scene_io"]}
LINES_MAX = 800  # of a C++ file
FUNCTION_LINES_MAX = 70
COLUMNS_MAX = 100
# The table of random numbers, and the functions that draw from a group.
NUMBERS = "core/samplers/dimensions.h"
DRAWS = {
    r"\bkCameraGroup\b\)?": "camera",
    r"\bkTimeGroup\b\)?": "time",
    r"\bBounceGroup::kLight\b\)*": "light",
    r"\bBounceGroup::kBsdf\b\)*": "bsdf",
    r"\bBounceGroup::kVolume\b\)*": "volume",
    r"\bchoice_group\([^()]*\)\)?": "choice",
    r"\bkStartGroup\b\)": "start",
    r"\bkAimGroup\b\)": "aim",
    r"\bvertex_group\([^()]*\)\)?": "vertex",
    r"\bstretch_group\([^()]*\)\)?": "stretch",
    r"\bhole_group\([^()]*\)\)?": "hole",
    r"\bextra_1d\(": "extra",
}
# Of the group "extra", where the numbers of a use begin.
EXTRA_NUMBERS = {"kShadowDraws": "2^29..", "kVolumeDraws": "2^30..", "kAnalogDraws": "2^31.."}
# Documents that may be cited; each must be in the tree.
DOCUMENT = re.compile(r"\b[A-Za-z][\w/-]*\.md\b")
# Names of documents without their extension, and numbers of issues, which the tree does not
# contain.
CITED = re.compile(r"\b(LIGHT_TRANSPORT|CONVENTIONS|ARCHITECTURE|FRONTIER|"
                   r"(?:HOUSE|DESIGN|SPEED|SERVICE|WORDS)(?='s\b| section| \d))|"
                   r"\b[Ii]ssue #?\d+")
# An address or a regular expression that cannot be broken.
LONG_WORD = re.compile(r"\S{90}")
# Words that end in .md and are not documents: generated ones and those of examples.
NO_DOCUMENT = {"notes.md"}
BANNED = {
    r"\busing namespace std\b": "using namespace std",
    r"\bstd::rand\b|(?<![\w:.>])rand\(\)": "rand(): use a Sampler",
    r"\b(TODO|FIXME|XXX)\b": "unfinished work left in",
    r"#\s*if 0\b": "code switched off with #if 0",
    r"\bDISABLED_": "a disabled test",
    r"-ffast-math": "fast-math",
}
BANNED_IN = {
    "core": {
        r"\bstd::random_device\b": "random_device: seeds come from the job",
        r"\bstd::(cout|cerr)\b|(?<!std::f)(?<!sn)\bprintf\(": "core does not print",
    },
    "api": {r"\bstd::(cout|cerr)\b": "api does not print"},
}
# In comments and test names: words that have a technical term, or that hide the actor.
WORDS = {
    r"matte?": "diffuse",
    r"rims?": "emitter boundary, or edge",
    r"dice": "random, or Russian roulette",
    r"knobs?": "setting",
    r"whoever": "the caller, the thread, the client",
    r"nobody": "no thread, no client, not",
    r"told": "reported, published, returned",
}
WORDS_IN = {"core": WORDS | {r"lamps?": "light, or emitter"},
            **dict.fromkeys(("server", "api", "clients/cli", "tests"), WORDS)}
COMMENT = re.compile(r"(?<![:\"])//(.*)$")
COMMENT_LINES = re.compile(COMMENT.pattern, re.MULTILINE)
# A comment, or a literal, which may contain the marks of one.
COMMENT_OR_LITERAL = re.compile(
    r"""//[^\n]*|/\*.*?\*/|R"(\w*)\(.*?\)\1"|"(?:[^"\\\n]|\\.)*"|'(?:[^'\\\n]|\\.)'""",
    re.DOTALL)
NAMED_FUNCTION = re.compile(r"(?<![\w:])((?:\w+::)*[A-Za-z_]\w*)\(\)")
FUNCTION = re.compile(r"\b(\w+)(?:<[^;{}()]*>)?\(")
# Functions that comments name and that other texts define.
FOREIGN_FUNCTIONS = {
    "hash52": "Khronos Data Format Specification",
    "select_partition": "Khronos Data Format Specification",
    "increase": "Prometheus",
}
TEST_NAME = re.compile(r"^TEST(?:_F|_P)?\(\w+, (\w+)\)")
# May print: stops the process if our own code is wrong.
PRINTS = {"core/base/check.h"}
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]', re.M)
SOURCES = {".h", ".cpp", ".py", ".ts", ".tsx", ".sh"}
NAMED_FILE = re.compile(r"(?<![\w./-])(?:core|api|server|clients|docker|tests)/"
                        r"[\w./-]*\w\.(?:h|cpp|py|tsx?|mjs|json|md|txt|cmake)\b")
# A source of ours without its folder, in a comment.
NAMED_SOURCE = re.compile(r"(?<![\w./<-])\w+\.(?:h|cpp)\b")
# Pages of architecture, and the folders that each explains, in the order of includes.
ROOMS = {"core/README.md": CORE_ORDER,
         "api/README.md": ["flags", "json", "job", "queries", "answers"],
         "server/README.md": ["config", "observe", "http", "store", "auth", "webhooks", "scenes",
                              "queue", "workers", "jobs", "pictures", "routes", "commands", "main"]}
# Words that say nothing of a folder, as stems() gives them.
GRAMMAR = {"and", "the", "for", "from", "with", "its", "their", "they", "them", "what", "which",
           "that", "how", "can", "out"}
# Folders of installed packages and of build output.
NOT_OURS = {"node_modules", "__pycache__", "dist", ".venv"}
# Lines at the depth of a function's head that begin something else.
NO_FUNCTION = re.compile(r"\s*(?:[{}]|(?:if|for|while|switch|else|do|try|case|default|return|"
                         r"namespace|class|struct|enum|union|extern)\b)")
THIS = "tests/tidy/tidy_test.py"
ROOTS = ("core", "api", "server", "clients/cli", "clients/worker", "tests")
PRODUCT = ("core", "api", "server", "clients")
TOP_LEVEL = {"CMakeLists.txt", "CMakePresets.json", "LICENSE", "README.md", "server", "core", "api",
             "clients", "tests", "docker", "build"}


def inside(path: str, place: str) -> bool:
    return path == place or path.startswith(place.rstrip("/") + "/")


def owner(path: str) -> str:
    fits = [k for k in LAYERS if inside(path, k)]
    return max(fits, key=len) if fits else ""


def confined_homes(path: str, name: str):
    for head, homes in CONFINED.items():
        if name.startswith(head):
            more = CONFINED_SOURCES.get(head, []) if path.endswith(".cpp") else []
            return homes + more
    return None


def width_faults(path: str, text: str):
    for number, line in enumerate(text.split("\n"), 1):
        if len(line) > COLUMNS_MAX and not LONG_WORD.search(line):
            yield f"{path}:{number}: {len(line)} columns; at most {COLUMNS_MAX}"


def function_faults(path: str, text: str):
    """Finds functions in sources as clang-format writes them. A function that only holds a table
    may be long: it has no statements of control flow."""
    lines = text.split("\n")
    for last, line in enumerate(lines):
        if line.strip() != "}":
            continue
        first = last - 1
        while first >= 0 and (not lines[first] or lines[first].startswith("#") or
                              len(lines[first]) - len(lines[first].lstrip()) >= len(line)):
            first -= 1
        body = next((i for i in range(max(first, 0), last) if lines[i].endswith("{")), last)
        if (last - body - 1 > FUNCTION_LINES_MAX and not NO_FUNCTION.match(lines[first]) and
                "(" in "".join(lines[first:body + 1]) and
                any(re.match(r" {%d}(if|for|while|switch) \(" % (len(line) + 1), inner)
                    for inner in lines[body + 1:last])):
            yield (f"{path}:{first + 1}: a function of {last - body - 1} lines; "
                   f"at most {FUNCTION_LINES_MAX}")


def citation_faults(path: str, text: str, documents: set):
    for found in CITED.finditer(text):
        yield f"{path}: cites {found.group()}, which is not in the tree"
    for found in DOCUMENT.finditer(text):
        name = found.group().rsplit("/", 1)[-1]
        if name not in documents and name not in NO_DOCUMENT:
            yield f"{path}: cites {found.group()}, which is not in the tree"


def path_faults(path: str, text: str, tree: set):
    """Files of the tree that comments and documents name."""
    named = {found.group() for found in NAMED_FILE.finditer(text)} - tree
    if path.endswith((".h", ".cpp")):
        comments = "\n".join(found.group(1) for found in COMMENT_LINES.finditer(text))
        named |= set(NAMED_SOURCE.findall(comments)) - {name.rsplit("/", 1)[-1] for name in tree}
    for name in sorted(named):
        yield f"{path}: names {name}, which is not in the tree"


def code_of(text: str) -> str:
    return COMMENT_OR_LITERAL.sub(" ", text)


def known_names(texts):
    """The functions in the code of all texts, and all words of each."""
    codes = [code_of(text) for text in texts]
    return ({name for code in codes for name in FUNCTION.findall(code)},
            [set(re.findall(r"\w+", code)) for code in codes])


def function_name_faults(path: str, text: str, functions: set, words):
    """Functions that comments name, as name() or scope::name(). The code of some file must contain
    the name together with its scope. functions, words: of known_names()."""
    for comment in COMMENT_OR_LITERAL.finditer(text):
        if not comment.group().startswith("/"):
            continue
        for name in NAMED_FUNCTION.findall(comment.group()):
            parts = name.split("::")
            is_known = parts[-1] in functions and any(file.issuperset(parts) for file in words)
            if not is_known and name not in FOREIGN_FUNCTIONS:
                number = text.count("\n", 0, comment.start()) + 1
                yield f"{path}:{number}: names {name}(), which is not in the code"


def stems(text: str):
    """Words without their endings, and without short ones and those of grammar."""
    return {re.sub(r"(?:ing|ion|ed|es|s|e)$", "", word)[:5]
            for word in re.findall(r"[a-z]{3,}", re.sub(r"`[^`]*`", "", text.lower()))
            } - GRAMMAR


def room_faults(page: str, text: str, rooms):
    """The page's first table has a row for each folder, in their order. A row says nothing of its
    folder that the comments at the beginning of its headers do not mention. rooms: these comments
    of each folder; none: it has no headers."""
    rows = dict(re.findall(r"^\| `(\w+)` \| (.*) \|$", text, re.MULTILINE))
    if list(rows) != list(rooms):
        yield f"{page}: lists {' '.join(rows)}; the folders are {' '.join(rooms)}"
    for folder in rows:
        unknown = stems(rows[folder]) - stems(rooms.get(folder, "")) if rooms.get(folder) else ()
        for word in sorted(unknown):
            yield f"{page}: no header of {folder} begins with a comment that says \"{word}...\""


def beginnings(folder: str) -> str:
    """The comments with which the headers in the folder begin."""
    texts = (file.read_text(encoding="utf-8") for file in sorted(pathlib.Path(folder).rglob("*.h")))
    return " ".join(re.match(r"(?:///.*\n)*", text).group() for text in texts)


def number_rows(text: str):
    """Rows of the table of core/samplers/dimensions.h: group, numbers, lines of their use, names of
    files. Returns them with the table's lines before and after, and its columns."""
    lines = text.split("\n")
    first = next(i for i, line in enumerate(lines) if line.startswith("///   group ")) + 1
    columns = [lines[first - 1].index(name) for name in ("group", "number", "use", "drawn in")]
    last = first
    rows = []
    while lines[last].startswith("///   "):
        group, numbers, use, names = (
            lines[last][start:end].strip() for start, end in zip(columns, columns[1:] + [None]))
        if group:
            rows.append((group, numbers.split(), [], []))
        rows[-1][2].extend([use] if use else [])
        rows[-1][3].extend(names.split())
        last += 1
    return rows, lines[:first], lines[last:], columns


def numbers_drawn(text: str):
    """Pairs of a group and a number that a file draws; the number "all" if a draw is passed on."""
    for pattern, group in DRAWS.items():
        for found in re.finditer(pattern, text):
            line = text[text.rfind("\n", 0, found.start()) + 1:found.start()]
            if line.lstrip().startswith("//"):
                continue
            rest = text[found.end():].split("\n}\n")[0]  # of the function
            statement = re.split(r"[;{}]", text[:found.start()])[-1]
            if group == "extra":
                argument = rest.split(";")[0]
                yield group, next((first for name, first in EXTRA_NUMBERS.items()
                                   if name in argument), "0..")
            elif number := re.match(r"[^;]*?\)\.([xyzw])\b|\.([xyzw])\b", rest.split(";")[0]):
                yield group, number.group(1) or number.group(2)
            elif kept := re.search(r"Vec4(?:s<N>)? (\w+) =", statement):
                rest = re.split(rf"Vec4(?:s<N>)? {kept.group(1)} =", rest)[0]
                uses = re.findall(rf"\b{kept.group(1)}\b(?:\.([xyzw])\b)?", rest)
                yield from ((group, number or "all") for number in uses)
            else:
                yield group, "all"


def numbers_by_file(sources):
    """sources: path, and text of the files that draw random numbers of paths."""
    drawn = {}
    for path, text in sources:
        drawn.setdefault(pathlib.Path(path).stem, set()).update(numbers_drawn(text))
    return drawn


def drawn_in(group: str, numbers, drawn):
    """Files that draw one of the numbers."""
    return sorted({name for name, draws in drawn.items()
                   if any((group, number) in draws for number in [*numbers, "all"])})


def number_faults(table: str, sources):
    rows = number_rows(table)[0]
    drawn = numbers_by_file(sources)
    uses = [(group, number) for group, numbers, _, _ in rows for number in numbers]
    for use in sorted({use for use in uses if uses.count(use) > 1}):
        yield f"{NUMBERS}: {' '.join(use)} has two uses"
    for name, draws in sorted(drawn.items()):
        for group, number in sorted(draws):
            if number != "all" and (group, number) not in uses:
                yield f"{NUMBERS}: no row for {group} {number} of {name}"
    for group, numbers, _, names in rows:
        if names != drawn_in(group, numbers, drawn):
            yield (f"{NUMBERS}: {group} {' '.join(numbers)} is drawn in "
                   f"{' '.join(drawn_in(group, numbers, drawn))}; write it with --numbers")


def with_names(table: str, sources) -> str:
    """The table with the files that draw each number."""
    rows, before, after, columns = number_rows(table)
    drawn = numbers_by_file(sources)
    out = []
    for group, numbers, use, _ in rows:
        names = textwrap.wrap(" ".join(drawn_in(group, numbers, drawn)), COLUMNS_MAX - columns[3],
                              break_on_hyphens=False)
        parts = itertools.zip_longest([group], [" ".join(numbers)], use, names, fillvalue="")
        for row in parts:
            line = "///"
            for column, part in zip(columns, row):
                line = line.ljust(column) + part if part else line
            out.append(line)
    return "\n".join(before + out + after)


def number_sources(files):
    return [(file.as_posix(), file.read_text(encoding="utf-8"))
            for file in files
            if file.suffix in (".h", ".cpp") and inside(file.as_posix(), "core")
            and not any(inside(file.as_posix(), f"core/{f}") for f in ("samplers", "lab"))]


def include_faults(path: str, text: str):
    me = owner(path)
    if not me:
        yield f"{path}: in no layer; add its folder to LAYERS"
        return
    for kind, name in INCLUDE.findall(text):
        homes = confined_homes(path, name)
        if homes is not None and not any(inside(path, h) for h in homes):
            yield f"{path}: <{name}> belongs to {', '.join(homes)}"
        if kind != '"':
            continue
        barred = any(inside(name, n) for n in NEVER.get(me, []))
        if barred or not any(inside(name, a) for a in [me] + LAYERS[me]):
            allowed = ", ".join(LAYERS[me]) or "nothing"
            yield f"{path}: may not include \"{name}\" ({me} -> {allowed})"
        if me == "clients/cli" and path not in RENDERS_LOCALLY:
            if inside(name, "core") and not any(inside(name, c) for c in NEEDS_NO_RENDERER):
                yield f"{path}: only the local render may include \"{name}\""


def faults_in(path: str, text: str):
    lines = text.count("\n")
    if lines > LINES_MAX:
        yield f"{path}: {lines} lines; at most {LINES_MAX}"
    if path.endswith(".h"):
        if "#pragma once" not in text:
            yield f"{path}: no #pragma once"
        if re.search(r"\bfloat pdf\b", text):
            yield f"{path}: pdf without its measure"
        if not text.startswith("///"):
            yield f"{path}: the first line must say what the header is (///)"
    banned = dict(BANNED)
    for root, patterns in BANNED_IN.items():
        if inside(path, root) and path not in PRINTS:
            banned.update(patterns)
    for pattern, why in banned.items():
        if re.search(pattern, text):
            yield f"{path}: {why}"
    if not inside(path, "tests"):
        yield from function_faults(path, text)
    yield from include_faults(path, text)
    yield from word_faults(path, text)


def word_faults(path: str, text: str):
    """Checks comments at the end of a line, and test names split at capitals."""
    words = next((words for root, words in WORDS_IN.items() if inside(path, root)), {})
    for number, line in enumerate(text.splitlines(), 1):
        comment = COMMENT.search(line)
        name = TEST_NAME.match(line)
        prose = (comment.group(1) if comment else "") + " " + (
            re.sub(r"([A-Z])", r" \1", name.group(1)) if name else "")
        for word, better in words.items():
            if re.search(rf"\b(?:{word})\b", prose, re.IGNORECASE):
                yield f"{path}:{number}: write {better}"


def top_level_faults(names):
    for name in sorted(names):
        if not name.startswith(".") and name not in TOP_LEVEL:
            yield f"{name}: does not belong to the top level"


def unlisted_faults(sources, lists: str):
    """A source that no build list names is not compiled, and a test in it never runs."""
    for path in sources:
        if not re.search(rf"(?<![\w.]){re.escape(path.rsplit('/', 1)[-1])}\b", lists):
            yield f"{path}: is in no CMake list"


def is_source(file: pathlib.Path) -> bool:
    """C++, Python, TypeScript, or a shell script, which may have no extension."""
    if file.suffix in SOURCES:
        return True
    if file.suffix or not file.is_file():
        return False
    with file.open("rb") as opened:
        return opened.read(9) == b"#!/bin/sh"


def files_of_tree():
    for folder, folders, names in os.walk("."):
        folders[:] = [f for f in folders if f not in NOT_OURS and
                      not (folder == "." and f in ("build", ".git"))]
        for name in names:
            yield pathlib.Path(folder, name)


def all_faults():
    found = list(top_level_faults(p.name for p in pathlib.Path(".").iterdir()))
    files = sorted(files_of_tree())
    numbers = pathlib.Path(NUMBERS).read_text(encoding="utf-8")
    found += number_faults(numbers, number_sources(files))
    lists = "".join(file.read_text(encoding="utf-8") for file in files
                    if file.name == "CMakeLists.txt" or file.suffix == ".cmake")
    sources = [file.as_posix() for file in files if file.suffix == ".cpp"]
    # A loop names those of the fuzzers.
    found += unlisted_faults((s for s in sources if not s.startswith("tests/fuzz/")), lists)
    documents = {file.name for file in files if file.suffix == ".md"}
    tree = {file.as_posix() for file in files}
    for page, folders in ROOMS.items():
        home = pathlib.Path(page).parent
        found += [f"{page}: {each} is in no list of {THIS}" for each in home.iterdir()
                  if each.is_dir() and each.name not in folders]
        found += room_faults(page, pathlib.Path(page).read_text(encoding="utf-8"),
                             {f: beginnings(f"{home}/{f}") for f in folders})
    product = {file.as_posix(): file.read_text(encoding="utf-8") for file in files
               if file.suffix in (".h", ".cpp") and any(
                   inside(file.as_posix(), root) for root in PRODUCT)}
    functions, words = known_names(product.values())
    for path, text in product.items():
        found += function_name_faults(path, text, functions, words)
    for file in files:
        path = file.as_posix()
        if not is_source(file) and file.suffix != ".md" and file.name != "CMakeLists.txt":
            continue
        text = file.read_text(encoding="utf-8")
        if path != THIS:
            found += citation_faults(path, text, documents)
            if not path.startswith("tests/tidy/"):
                found += path_faults(path, text, tree)
        if is_source(file):
            found += width_faults(path, text)
        if file.suffix in (".h", ".cpp") and any(inside(path, root) for root in ROOTS):
            found += faults_in(path, text)
    return found


HEADER = "/// A header.\n#pragma once\n"
# One planted fault each: path, text, words that the report must contain.
PLANTED = [
    ("core/math/a.h", HEADER + "// Whoever asks.\n", "write the caller"),
    ("core/math/a.h", HEADER + "// Under a lamp.\n", "write light"),
    ("tests/unit/a.cpp", "TEST(A, IsTold) {}\n", "write reported"),
    (
        "core/math/a.h",
        HEADER + '#include "core/bsdf/bsdf.h"\n',
        'may not include "core/bsdf/bsdf.h"',
    ),
    ("core/film/a.h", HEADER + '#include "core/render/task/render_task.h"\n', "may not include"),
    ("core/render/a.cpp", '#include "core/scene_io/gltf_load.h"\n', "may not include"),
    ("api/a.cpp", '#include "server/app.h"\n', "may not include"),
    ("server/http/a.cpp", '#include "api/json/json.h"\n', "may not include"),
    ("server/a.cpp", '#include "clients/cli/command.h"\n', "may not include"),
    ("clients/cli/watch.cpp", '#include "core/film/film.h"\n', "only the local render"),
    ("clients/cli/watch.cpp", '#include "server/app.h"\n', "may not include"),
    ("api/a.cpp", "#include <httplib.h>\n", "<httplib.h> belongs to"),
    ("core/film/a.cpp", "#include <nlohmann/json.hpp>\n", "belongs to"),
    ("core/scene_io/a.h", HEADER + "#include <nlohmann/json.hpp>\n", "belongs to"),
    ("core/lights/a.cpp", "#include <embree3/rtcore.h>\n", "belongs to core/accel"),
    ("core/scene/a.cpp", "#include <OpenImageIO/imageio.h>\n", "belongs to core/image_io"),
    ("server/jobs/a.cpp", "#include <sqlite3.h>\n", "belongs to server/store"),
    ("clients/cli/picture.cpp", "#include <png.h>\n", "belongs to clients/cli/png.cpp"),
    ("core/new_folder/a.cpp", "int x;\n", "in no layer"),
    ("core/math/a.h", "/// A header.\nint x;\n", "no #pragma once"),
    ("core/math/a.h", "#pragma once\n", "the first line must say"),
    ("core/math/a.cpp", "int x;\n" * (LINES_MAX + 1), "lines; at most"),
    ("core/math/a.cpp", "int f(int a,\n      int b) {\n  if (a > b) {\n" + "    ++a;\n" * 68 +
     "  }\n  return a;\n}\n", "a function of 71 lines"),
    ("core/math/a.h", HEADER + "class A {\n  int f() {\n    while (g()) {\n" +
     "      ++a_;\n" * 69 + "    }\n  }\n};\n", "a function of 71 lines"),
    ("core/math/a.cpp", "using namespace std;\n", "using namespace std"),
    ("core/math/a.cpp", "int x = std::rand();\n", "use a Sampler"),
    ("core/math/a.cpp", "std::random_device d;\n", "seeds come from the job"),
    ("core/math/a.cpp", "// TO" + "DO: later\n", "unfinished"),
    ("core/math/a.cpp", "#if 0\n#endif\n", "switched off"),
    ("core/math/a.cpp", 'void f() { std::cout << "x"; }\n', "does not print"),
    ("core/math/a.h", HEADER + "float pdf(int x);\n", "without its measure"),
    ("tests/unit/core/a.cpp", "TEST(A, DISA" + "BLED_B) {}\n", "disabled test"),
]
PLANTED_LINES = [
    "/// " + "long " * 20,
    "    parser.add_argument('--flag', help='" + "words " * 12 + "', default=None)",
]
PLANTED_CITATIONS = [
    "// Weights as in LIGHT_" + "TRANSPORT.md, section 3.",
    "/// The layout is DE" + "SIGN's.",
    "# As issue" + " 12 asks.",
    "See docs/layout.md.",
]
CLEAN = [
    ("core/math/a.cpp", "Rows rows() {\n  return {\n" + "      Row{1},\n" * 80 + "  };\n}\n"),
    ("core/math/a.cpp", "void f() {\n  if (a) {\n" + "    ++a;\n" * 68 + "  }\n}\n"),
    ("core/bsdf/a.h", HEADER + '#include "core/math/vec.h"\nfloat pdf_solid_angle(int x);\n'),
    ("core/scene_io/a.cpp", "#include <nlohmann/json.hpp>\n#include <tiny_gltf.h>\n"),
    ("clients/cli/render.cpp", '#include "core/render/task/render_task.h"\n'),
    ("server/routes/a.cpp", '#include "api/job/job_spec.h"\n#include "server/http/message.h"\n'),
]


TABLE = """///   group   number  use         drawn in
///   camera  x y     film        a
///   choice  x       candidate   b
///                               c
"""
DRAWN = [
    ("render/a.cpp", "const Vec4 u = sampler.get_4d(kCameraGroup);\nreturn {u.x, u.y};"),
    ("integrators/b.cpp", "float u = s.get_4d(choice_group(path.depth)).x;"),
    ("integrators/c.cpp", "const Vec4 u = s.get_4d(choice_group(path.depth));\nuse(u);"),
]
# Changed table or source, and the text that the report must contain.
PLANTED_NUMBERS = [
    (TABLE + "///   choice  x       again       b c\n", DRAWN, "choice x has two uses"),
    (TABLE, DRAWN[:2], "choice x is drawn in b;"),
    (TABLE, DRAWN + [("wave/d.cpp", "get_4d(kCameraGroup)")], "camera x y is drawn in a d;"),
    (TABLE, DRAWN + [("integrators/b.cpp", "s.get_4d(choice_group(depth)).w")],
     "no row for choice w of b"),
    (TABLE, DRAWN + [("render/a.cpp", "Vec4 u = s.get_4d(kCameraGroup);\nreturn u.z;")],
     "no row for camera z of a"),
]
CLEAN_TEXTS = [
    "/// Source: PBR 4th ed., section 9.2.",
    "See [the guide](clients/README.md). A colour: #123456.",
    "// https://example.org/" + "a" * 100,
]


def self_test() -> int:
    missed = [f"not seen in {path}: {words}" for path, text, words in PLANTED
              if not any(words in fault for fault in faults_in(path, text))]
    missed += [f"false alarm: {fault}" for path, text in CLEAN for fault in faults_in(path, text)]
    missed += [f"not seen: a line of {len(line)} columns" for line in PLANTED_LINES
               if not any(width_faults("core/a.h", line))]
    missed += [f"not seen: {text}" for text in PLANTED_CITATIONS
               if not any(citation_faults("core/a.h", text, {"README.md"}))]
    missed += [f"false alarm: {fault}" for text in CLEAN_TEXTS
               for fault in [*width_faults("core/a.h", text),
                             *citation_faults("core/a.h", text, {"README.md"})]]
    missed += [f"not seen: {words}" for table, drawn, words in PLANTED_NUMBERS
               if not any(words in fault for fault in number_faults(table, drawn))]
    missed += [f"false alarm: {fault}" for fault in number_faults(TABLE, DRAWN)]
    if with_names(TABLE.replace("b\n", "d\n"), DRAWN) != TABLE.replace("c\n", "").replace(
            "b\n///" + " " * 31, "b c\n"):
        missed.append("the last column is not written as it is checked")
    if not any(top_level_faults(["notes.txt"])):
        missed.append("not seen: a stray file on the top level")
    for comment in ("// See core/math/b.h.", "// As b.cpp does."):
        if not any(path_faults("core/a.h", comment, {"core/math/a.h"})):
            missed.append(f"not seen: a comment that names no file: {comment}")
    missed += [f"false alarm: {fault}" for fault in path_faults(
        "core/a.h", "// See core/math/a.h. As a.h does.", {"core/math/a.h"})]
    named = known_names(["class A { int f(); };  // old()\n",
                         'int g() { return "h()" != x; }\n'])
    for comment in ("// As old().", "/// As A::g().", "int f();  ///< h()", "/* See A::x(). */"):
        if not any(function_name_faults("core/a.h", comment, *named)):
            missed.append(f"not seen: a comment that names no function: {comment}")
    missed += [f"false alarm: {fault}" for fault in function_name_faults(
        "core/a.h", '// As g() and A::f(), by hash52() of f(x).\nauto s = "// old()";\n', *named)]
    if not any(unlisted_faults(["tests/a_test.cpp"], "  aa_test.cpp\n")):
        missed.append("not seen: a source in no list")
    for rooms in ({"math": "/// Vectors.", "base": ""}, {"math": "/// Vector. And matrices."}):
        if any(room_faults("core/README.md", "| `math` | vectors |", rooms)) != (len(rooms) == 2):
            missed.append(f"folders on the page: {rooms}")
    if not any(room_faults("core/README.md", "| `math` | vectors, hashes |",
                           {"math": "/// Vectors."})):
        missed.append("not seen: a folder whose headers do not say what the page says")
    planted = len(PLANTED) + len(PLANTED_LINES) + len(PLANTED_CITATIONS)
    planted += len(PLANTED_NUMBERS) + 10
    print("\n".join(missed) or f"tidy self-test: {planted} planted faults seen")
    return 1 if missed else 0


def main() -> int:
    if "--self-test" in sys.argv[1:]:
        return self_test()
    if "--numbers" in sys.argv[1:]:
        table = pathlib.Path(NUMBERS)
        table.write_text(with_names(table.read_text(encoding="utf-8"),
                                    number_sources(sorted(files_of_tree()))), encoding="utf-8")
        return 0
    found = all_faults()
    print("\n".join(found) or "tidy: ok")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
