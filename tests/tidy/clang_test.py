#!/usr/bin/env python3
"""Runs clang-format and clang-tidy, both of version 14 (Debian 12), over the C++ of the tree.

    tests/tidy/clang_test.py format             every file is formatted according to .clang-format
    tests/tidy/clang_test.py tidy BUILD         quick checks of core and api
    tests/tidy/clang_test.py tidy BUILD --long  every check of .clang-tidy with the analyzer, also
                                                over server and client: takes an hour
    tests/tidy/clang_test.py tidy BUILD FILE... quick checks of these sources

BUILD is a folder that cmake has configured with Ninja. Exits 1 if there is a finding, and 77
(skipped) if the program is missing or has another version: other versions format and check
differently. Standard library only.
"""

import concurrent.futures
import json
import os
import pathlib
import re
import shlex
import subprocess
import sys

VERSION = "14"
LEFT_OUT = 77
ROOTS = ("core", "api", "server", "clients/cli", "clients/worker", "tests")
TIDIED = ("core", "api")
TIDIED_LONG = (*TIDIED, "server", "clients/cli")
# The quick checks combine this many sources into one: parsing the headers is most of their work.
# Names of unnamed namespaces are made different before. Sources that seem to have findings are
# combined again as they are, without the others, before each of them is compiled alone.
TOGETHER = 80
# Checks that cost little more than parsing the source (about 3 s each).
QUICK = (
    "-*",
    "bugprone-use-after-move",
    "google-build-using-namespace",
    "misc-definitions-in-headers",
    "misc-unused-parameters",
    "modernize-use-bool-literals",
    "modernize-use-nullptr",
    "modernize-use-override",
    "readability-braces-around-statements",
    "readability-container-size-empty",
    "readability-identifier-naming",
)
# Arguments of gcc that clang does not support, and those that include gcc's precompiled headers.
GCC_ONLY = {
    "-Winvalid-pch",
    "-Wduplicated-cond",
    "-Wduplicated-branches",
    "-Wlogical-op",
    "-Wno-restrict",
    "-Wno-maybe-uninitialized",
}


def has_version(program: str) -> bool:
    try:
        said = subprocess.run([program, "--version"], capture_output=True, text=True, check=True)
    except (OSError, subprocess.CalledProcessError):
        print(f"{program}: left out, it is not installed")
        return False
    found = re.search(r"version (\d+)", said.stdout)
    if not found or found.group(1) != VERSION:
        seen = found.group(1) if found else "unknown"
        print(f"{program}: left out, its version is {seen}, not {VERSION}")
        return False
    return True


def program_of(name: str):
    """The program of this version, or None; the plain name may be another version."""
    for program in (f"{name}-{VERSION}", name):
        if has_version(program):
            return program
    return None


def check_format() -> int:
    program = program_of("clang-format")
    if program is None:
        return LEFT_OUT
    files = [
        file.as_posix()
        for root in ROOTS
        for file in sorted(pathlib.Path(root).rglob("*"))
        if file.suffix in (".h", ".cpp") and "node_modules" not in file.parts
    ]
    done = subprocess.run([program, "--dry-run", "-Werror", *files], check=False)
    print("format: ok" if done.returncode == 0 else f"mend with {program} -i FILE")
    return 1 if done.returncode else 0


def arguments_of(command: str):
    """The compiler's arguments without those that only gcc supports."""
    words = shlex.split(command)
    while words and not re.search(r"(\+\+|gcc|cc|clang)(-\d+)?$", words[0]):
        words.pop(0)  # ccache
    out = []
    skip = False
    for word in words:
        if skip or word == "-include":
            skip = not skip
            continue
        if word not in GCC_ONLY and not word.startswith("-flto") and word != "-ffat-lto-objects":
            out.append(word)
    return out


def sources_of(entry):
    """The source of a compile command, or those that it combines."""
    file = pathlib.Path(entry["directory"], entry["file"])
    if file.parent.name != "Unity" or file.suffix != ".cxx":
        return [file]
    return re.findall(r'^#include "(.*)"', file.read_text(), re.MULTILINE)


def write_database(build: str, roots):
    """Writes compile_commands.json of our sources into a separate folder; returns folder and
    sources."""
    said = subprocess.run(["ninja", "-C", build, "-t", "compdb"], capture_output=True, text=True,
                          check=True).stdout
    here = os.getcwd()
    entries = {}
    for entry in json.loads(said[said.index("["):]):
        for file in sources_of(entry):
            path = os.path.relpath(file, here)
            is_ours = any(path.startswith(root + "/") for root in roots)
            if is_ours and path.endswith(".cpp") and path not in entries:
                command = entry["command"].replace(entry["file"], os.path.join(here, path))
                entries[path] = {
                    "directory": entry["directory"],
                    "file": os.path.join(here, path),
                    "arguments": arguments_of(command),
                }
    folder = pathlib.Path(build, "clang_tidy")
    folder.mkdir(exist_ok=True)
    (folder / "compile_commands.json").write_text(json.dumps(list(entries.values())))
    return folder, sorted(entries)


def private_names(text: str):
    """Names that a source declares in unnamed namespaces."""
    names = set()
    for block in re.findall(r"^namespace \{$(.*?)^\}  // namespace$", text, re.M | re.S):
        block = re.sub(r'"(?:[^"\\\n]|\\.)*"|\'.\'|//.*|^#.*', "", block, flags=re.M)
        for enumerators in re.findall(r"\benum (?:: \S+ )?\{([^}]*)\}", block):
            names.update(re.findall(r"\bk\w+", enumerators))
        found = 1
        while found:  # Leaves the outermost level: no bodies, parameters, initialisers.
            block, found = re.subn(r"(\{[^{}]*\})|(\([^()]*\))|<[^<>;]*>|\[[^][]*\]",
                                   lambda at: ";" if at[1] else "=" if at[2] else "", block)
        for statement in block.split(";"):
            name = re.search(r"\b(?:struct|class|enum(?: class)?|union|using) (\w+)\b(?!:)|"
                             r"[\w>&*] [&*]*(\w+)\s*$", statement.split("=")[0])
            if name and not re.match(r"\s*using \w*::", statement):
                names.add(name[1] or name[2])
    # A member of the same name keeps it.
    return names - set(re.findall(r"(?:\.|->)(\w+)", text))


def write_batches(folder: pathlib.Path, sources, is_renamed: bool):
    """Sources that include copies of neighbours with the same flags; if `is_renamed`, the private
    names of each end in its number. Returns the sources included by each."""
    database = folder / "compile_commands.json"
    entries = json.loads(database.read_text())
    alike = {}
    for entry in entries:
        if os.path.relpath(entry["file"]) in sources:
            flags = [word for word in entry["arguments"] if word.startswith(("-I", "-D"))]
            alike.setdefault(tuple(flags), []).append(entry)
    batches = {}
    for group in alike.values():
        count = -(-len(group) // TOGETHER)
        for part in range(count):
            some = group[part * len(group) // count : (part + 1) * len(group) // count]
            path = str(folder.resolve() / f"batch_{is_renamed:d}_{len(batches)}.cpp")
            members = [os.path.relpath(entry["file"]) for entry in some]
            for index, member in enumerate(members):
                text = pathlib.Path(member).read_text()
                names = "|".join(sorted(private_names(text)))
                if names and is_renamed:
                    text = re.sub(rf"^(#include .*)|(?<!:)\b({names})\b",
                                  lambda at: at[1] or f"{at[2]}{index}", text, flags=re.M)
                copy = folder / member
                copy.parent.mkdir(parents=True, exist_ok=True)
                copy.write_text(text)
            pathlib.Path(path).write_text("".join(f'#include "{file}"\n' for file in members))
            words = [path if word == some[0]["file"] else word for word in some[0]["arguments"]]
            entries.append({**some[0], "file": path, "arguments": words})
            batches[path] = members
    database.write_text(json.dumps(entries))
    return batches


def check_tidy(build: str, chosen, is_long: bool) -> int:
    program = program_of("clang-tidy")
    if program is None:
        return LEFT_OUT
    folder, sources = write_database(build, TIDIED_LONG if is_long or chosen else TIDIED)
    if chosen:
        sources = [path for path in sources if path in chosen]
    # Warnings come from the compilers, and fail the build.
    checks = ["--extra-arg=-w"] + ([] if is_long else ["--checks=" + ",".join(QUICK)])

    def findings(path: str, *more: str):
        done = subprocess.run([program, "-p", str(folder), "--quiet", *checks, *more, path],
                              capture_output=True, text=True, check=False)
        return done.stdout if done.returncode else ""

    def suspects(batch):
        """Sources of a batch that may have findings, or collide with others of it."""
        path, members = batch
        said = findings(path, "--header-filter=/(core|api)/", "--extra-arg=-ferror-limit=0")
        # An error in a header of the system is one of the source that instantiates it.
        named = {os.path.relpath(file, folder if str(folder.resolve()) in file else None)
                 for file in re.findall(r"^(/\S+):\d+:\d+: (?:error|warning): ", said, re.M)
                 if file.startswith(os.getcwd())}
        is_clear = not said or (named and named <= set(members))
        return [file for file in members if file in named] if is_clear else members

    alone = sources
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count()) as pool:
        for is_renamed in () if is_long or chosen else (True, False):
            batches = write_batches(folder, alone, is_renamed)
            alone = [file for some in pool.map(suspects, batches.items()) for file in some]
        found = [text for text in pool.map(findings, alone) if text]
    # A finding in a header is repeated for each source that includes it.
    seen = set()
    for text in found:
        for part in re.split(r"^(?=\S+:\d+:\d+: (?:error|warning): )", text, flags=re.M):
            if part and part not in seen:
                seen.add(part)
                print(part, end="")
    print(f"clang-tidy: {len(sources)} sources, {len(seen)} findings")
    return 1 if found or not sources else 0


def main() -> int:
    args = [arg for arg in sys.argv[1:] if arg != "--long"]
    if args == ["format"]:
        return check_format()
    if len(args) >= 2 and args[0] == "tidy":
        return check_tidy(args[1], args[2:], "--long" in sys.argv)
    print(__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main())
