#!/usr/bin/env python3
"""Checks rules that a compiler cannot: includes by layer, file and line length, banned words,
citations.

Run from the repository root; exits 1 and lists every fault. --self-test plants one fault of each
kind and exits 1 if one is not detected. Standard library only.
"""

import os
import pathlib
import re
import sys

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
    "png.h": ["clients/cli/png.cpp"],
    "nats/": ["server/queue"],
    "sqlite3.h": ["server/store", "tests"],
    "gtest/": ["tests"],
}
# nlohmann inside core: sources of scene_io only, which check glTF before tinygltf sees it.
CONFINED_SOURCES = {"nlohmann/": ["core/scene_io"]}
LINES_MAX = 800  # of a C++ file
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
    r"\bextra_1d\(": "extra",
}
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
         "server/README.md": ["config", "observe", "http", "store", "auth", "webhooks", "scenes",
                              "queue", "workers", "jobs", "pictures", "routes", "commands", "main"]}
# Folders of installed packages and of build output.
NOT_OURS = {"node_modules", "__pycache__", "dist", ".venv"}
THIS = "tests/tidy/tidy_test.py"
ROOTS = ("core", "api", "server", "clients/cli", "clients/worker", "tests")
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


def room_faults(page: str, text: str, folders):
    """The page's first table has a row for each of these folders, in their order."""
    listed = re.findall(r"^\| `(\w+)` \|", text, re.MULTILINE)
    if listed != list(folders):
        yield f"{page}: lists {' '.join(listed)}; the folders are {' '.join(folders)}"


def number_table(text: str):
    """Rows of the table of core/samplers/dimensions.h: group, numbers, files."""
    rows = []
    columns = None
    for line in text.split("\n"):
        if line.startswith("///   group "):
            columns = [line.index(name) for name in ("group", "number", "use", "drawn in")]
            continue
        if columns is None or not line.startswith("///   "):
            continue
        group, numbers = (line[columns[i]:columns[i + 1]].split() for i in (0, 1))
        if group:
            rows.append((group[0], numbers, set()))
        rows[-1][2].update(line[columns[3]:].split())
    return rows


def number_faults(table: str, sources):
    """sources: path, and text of the files that draw random numbers of paths."""
    rows = number_table(table)
    uses = [(group, number) for group, numbers, _ in rows for number in numbers]
    for use in sorted({use for use in uses if uses.count(use) > 1}):
        yield f"{NUMBERS}: {' '.join(use)} has two uses"
    listed = {(group, name) for group, _, names in rows for name in names}
    drawn = set()
    for path, text in sources:
        name = pathlib.Path(path).stem
        for pattern, group in DRAWS.items():
            for found in re.finditer(pattern, text):
                drawn.add((group, name))
                number = re.match(r"\.([xyzw])\b", text[found.end():])
                if number and not any(group == row[0] and number.group(1) in row[1] and
                                      name in row[2] for row in rows):
                    yield f"{NUMBERS}: no row for {group} {number.group(1)} in {path}"
    for group, name in sorted(drawn - listed):
        yield f"{NUMBERS}: no row for {group} in {name}"
    for group, name in sorted(listed - drawn):
        yield f"{NUMBERS}: {name} does not draw from {group}"


def all_number_faults(files):
    sources = [(file.relative_to("core").as_posix(), file.read_text(encoding="utf-8"))
               for file in files
               if file.suffix in (".h", ".cpp") and inside(file.as_posix(), "core")
               and not any(inside(file.as_posix(), f"core/{f}") for f in ("samplers", "lab"))]
    yield from number_faults(pathlib.Path(NUMBERS).read_text(encoding="utf-8"), sources)


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
            if inside(name, "core") and not inside(name, "core/base"):
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
    found += all_number_faults(files)
    lists = "".join(file.read_text(encoding="utf-8") for file in files
                    if file.name == "CMakeLists.txt" or file.suffix == ".cmake")
    sources = [file.as_posix() for file in files if file.suffix == ".cpp"]
    # A loop names those of the fuzzers.
    found += unlisted_faults((s for s in sources if not s.startswith("tests/fuzz/")), lists)
    documents = {file.name for file in files if file.suffix == ".md"}
    tree = {file.as_posix() for file in files}
    for page, folders in ROOMS.items():
        found += room_faults(page, pathlib.Path(page).read_text(encoding="utf-8"), folders)
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
    ("render/a.cpp", "const Vec4 u = sampler.get_4d(kCameraGroup);"),
    ("integrators/b.cpp", "float u = s.get_4d(choice_group(path.depth)).x;"),
    ("integrators/c.cpp", "float u = s.get_4d(choice_group(path.depth)).x;"),
]
# Changed table or source, and the text that the report must contain.
PLANTED_NUMBERS = [
    (TABLE + "///   choice  x       again       a\n", DRAWN, "choice x has two uses"),
    (TABLE, DRAWN[:2], "c does not draw from choice"),
    (TABLE, DRAWN + [("wave/d.cpp", "get_4d(kCameraGroup)")], "no row for camera in d"),
    (TABLE, DRAWN + [("integrators/b.cpp", "s.get_4d(choice_group(depth)).w")],
     "no row for choice w in integrators/b.cpp"),
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
    if not any(top_level_faults(["notes.txt"])):
        missed.append("not seen: a stray file on the top level")
    for comment in ("// See core/math/b.h.", "// As b.cpp does."):
        if not any(path_faults("core/a.h", comment, {"core/math/a.h"})):
            missed.append(f"not seen: a comment that names no file: {comment}")
    missed += [f"false alarm: {fault}" for fault in path_faults(
        "core/a.h", "// See core/math/a.h. As a.h does.", {"core/math/a.h"})]
    if not any(unlisted_faults(["tests/a_test.cpp"], "  aa_test.cpp\n")):
        missed.append("not seen: a source in no list")
    if not any(room_faults("core/README.md", "| `math` | vectors |", ["math", "base"])):
        missed.append("not seen: a folder without a row")
    planted = len(PLANTED) + len(PLANTED_LINES) + len(PLANTED_CITATIONS)
    planted += len(PLANTED_NUMBERS) + 5
    print("\n".join(missed) or f"tidy self-test: {planted} planted faults seen")
    return 1 if missed else 0


def main() -> int:
    if "--self-test" in sys.argv[1:]:
        return self_test()
    found = all_faults()
    print("\n".join(found) or "tidy: ok")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
