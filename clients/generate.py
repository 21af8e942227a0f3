#!/usr/bin/env python3
"""Writes the TypeScript client's types, the Python package's models, and the versions of both
and of the Blender add-on, from /openapi.json.

    clients/generate.py SOURCE [--check]

SOURCE: the address of a running server, or a file with its /openapi.json. --check writes nothing,
lists the files that would change, and exits 1 if there are any. Standard library only.
"""

import json
import keyword
import pathlib
import re
import sys
import textwrap
import urllib.request

HERE = pathlib.Path(__file__).resolve().parent
TYPESCRIPT = HERE / "js/src/types.ts"
NODE_PACKAGE = HERE / "js/package.json"
MODELS = HERE / "python/src/tessera_render/models.py"
VERSION = HERE / "python/src/tessera_render/_version.py"
BLENDER_ADD_ON = HERE / "blender/tessera_blender/__init__.py"
BLENDER_EXTENSION = HERE / "blender/tessera_blender/blender_manifest.toml"
WIDTH = 100
LONGEST_TUPLE = 4  # of longer lists only the type of the elements is said
PREFIX = "#/components/schemas/"
# Components, with their parts, whose names come from registries that differ between builds, so any
# text is allowed.
OPEN_NAMES = ("JobRequest", "JobPatch", "ExtendRequest", "JobSpec", "JobDefaults", "LabRequest")
# Components and parts of the same names hold the same settings, with other members required.
FAMILY = re.compile("^(JobRequest|JobSpec|JobDefaults|JobPatch|ExtendRequest)")


def are_twins(one, other):
    return FAMILY.sub("", one) == FAMILY.sub("", other)


def words(schema):
    """The description as one line."""
    return " ".join(schema.get("description", "").split())


def types_of(schema):
    kinds = schema.get("type", [])
    return kinds if isinstance(kinds, list) else [kinds]


def is_record(schema):
    return "object" in types_of(schema) and "properties" in schema


class Language:
    """Code shared by both languages. `names_are_open`: enumerations accept any text."""

    def __init__(self, schemas):
        self.schemas = schemas
        self.names_are_open = False
        self.records = {}  # earlier ones, by name
        self.same = {}  # the names of earlier ones that stand for these

    def type_of(self, schema):
        """The type of a value; objects with members are components."""
        if "$ref" in schema:
            name = schema["$ref"].removeprefix(PREFIX)
            return self.same.get(name, name)
        if "enum" in schema and not self.names_are_open:
            return self.union([self.literal(each) for each in schema["enum"]])
        if "anyOf" in schema and "type" not in schema:
            return self.union([self.type_of(each) for each in schema["anyOf"]])
        kinds = types_of(schema)
        return self.union([self.kind(kind, schema) for kind in kinds]) if kinds else self.ANY

    def kind(self, kind, schema):
        if kind == "array":
            return self.array(schema)
        if kind == "object":
            return self.map(schema)
        return self.SIMPLE[kind]


class TypeScript(Language):
    ANY = "unknown"
    SIMPLE = {"string": "string", "integer": "number", "number": "number", "boolean": "boolean",
              "null": "null"}  # fmt: skip

    def literal(self, value):
        return "null" if value is None else f"'{value}'" if isinstance(value, str) else str(value)

    def union(self, types):
        return " | ".join(dict.fromkeys(types))

    def array(self, schema):
        item = self.type_of(schema.get("items", {}))
        length = schema.get("minItems")
        if length is not None and length == schema.get("maxItems") and length <= LONGEST_TUPLE:
            return f"[{', '.join([item] * length)}]"
        return f"({item})[]" if " | " in item else f"{item}[]"

    def map(self, schema):
        values = schema.get("additionalProperties")
        return f"Record<string, {self.type_of(values) if values else self.ANY}>"

    def members(self, schema):
        text = ""
        for name, member in schema["properties"].items():
            text += self.comment(member, "  ")
            mark = "" if name in schema.get("required", []) else "?"
            text += self.statement(f"  {name}{mark}:", self.type_of(member))
        return text

    def statement(self, head, made):
        """One line, or one for each member of a union that is too long."""
        line = f"{head} {made};\n"
        if len(line) <= WIDTH + 1:
            return line
        indent = " " * (len(head) - len(head.lstrip()) + 2)
        parts = [self.broken(each, indent) for each in made.split(" | ")]
        if len(parts) == 1:
            return f"{head} {self.broken(made, indent[2:])};\n"
        return head + "".join(f"\n{indent}| {each}" for each in parts) + ";\n"

    @staticmethod
    def broken(made, indent):
        """A list of members that is too long for a line, on several."""
        if len(indent) + len(made) + 3 <= WIDTH or not made.startswith("["):
            return made
        inner = indent + "  "
        lines = textwrap.wrap(made[1:-1], WIDTH, initial_indent=inner, subsequent_indent=inner)
        return "[\n" + "\n".join(lines) + f",\n{indent}]"

    def comment(self, schema, indent):
        doc = words(schema).replace("*/", "* /")
        if not doc:
            return ""
        if len(indent) + len(doc) + 7 <= WIDTH:
            return f"{indent}/** {doc} */\n"
        lines = textwrap.wrap(doc, WIDTH - len(indent) - 3, break_long_words=False)
        return "".join(
            [f"{indent}/**\n", *(f"{indent} * {line}\n" for line in lines), f"{indent} */\n"]
        )

    def component(self, name, schema):
        self.names_are_open = name.startswith(OPEN_NAMES)
        text = self.comment(schema, "")
        if not is_record(schema):
            return text + self.statement(f"export type {name} =", self.type_of(schema))
        whole = f"export interface {name} {{\n{self.members(schema)}}}\n"
        short = min([whole, *self.shorter(name, schema)], key=lambda each: each.count("\n"))
        self.records[name] = (schema, self.types(schema))
        return text + short

    def types(self, schema):
        return {name: self.type_of(member) for name, member in schema["properties"].items()}

    def shorter(self, name, schema):
        """The interface as members of an earlier one, and its own."""
        types = self.types(schema)
        required = set(schema.get("required", []))
        for base, (of_base, base_types) in self.records.items():
            is_twin = are_twins(base, name)

            def is_shared(member, of_base=of_base, base_types=base_types, is_twin=is_twin):
                if base_types.get(member) != types[member]:
                    return False
                text = words(schema["properties"][member])
                return is_twin or (text and text == words(of_base["properties"][member]))

            shared = [member for member in types if is_shared(member)]
            if len(shared) < (1 if is_twin else 3):
                continue
            base_required = set(of_base.get("required", []))
            parts = []
            for is_required, change in ((True, "Required"), (False, "Partial")):
                some = [member for member in shared if (member in required) == is_required]
                if some:
                    picked = self.picked(base, base_types, some)
                    is_same = all((member in base_required) == is_required for member in some)
                    parts.append(picked if is_same else f"{change}<{picked}>")
            own = {
                member: inner
                for member, inner in schema["properties"].items()
                if member not in shared
            }
            body = self.members({**schema, "properties": own})
            end = "{\n" + body + "}\n" if own else "{}\n"
            head = f"export interface {name} extends {', '.join(parts)} "
            if len(head) + 2 > WIDTH:
                lines = ",\n".join(textwrap.indent(part, "    ") for part in parts)
                head = f"export interface {name} extends\n{lines} "
            yield head + end

    @staticmethod
    def picked(base, base_types, members):
        """Those members of an interface."""
        left = [member for member in base_types if member not in members]
        if not left:
            return base
        way, names = ("Omit", left) if len(left) < len(members) else ("Pick", members)
        line = f"{way}<{base}, {' | '.join(repr(name) for name in names)}>"
        if len(line) + 16 <= WIDTH:
            return line
        return f"{way}<\n  {base},\n" + "".join(f"  | {name!r}\n" for name in names) + ">"

    def document(self):
        head = (
            "/**\n * The bodies of the HTTP interface, as they are in JSON.\n"
            " * Made by clients/generate.py from /openapi.json; not edited by hand.\n */\n"
        )
        return "\n".join([head, *(self.component(*each) for each in self.schemas.items())])


class Python(Language):
    ANY = "Any"
    SIMPLE = {
        "string": "str",
        "integer": "int",
        "number": "float",
        "boolean": "bool",
        "null": "None",
    }

    def literal(self, value):
        return f"Literal[{'None' if value is None else json.dumps(value)}]"

    def union(self, types):
        literals = [each[8:-1] for each in types if each.startswith("Literal[")]
        others = [each for each in types if not each.startswith("Literal[")]
        if literals:
            others.insert(0, f"Literal[{', '.join(literals)}]")
        return " | ".join(dict.fromkeys(others))

    def array(self, schema):
        return f"list[{self.type_of(schema.get('items', {}))}]"

    def map(self, schema):
        values = schema.get("additionalProperties")
        return f"dict[str, {self.type_of(values) if values else self.ANY}]"

    def record(self, name, schema):
        """A TypedDict. Members that are keywords go into a base class of another syntax."""
        types = self.types(schema)
        for twin, of_twin in self.records.items():
            if self.is_same_part(twin, name) and self.allows(of_twin, types):
                self.same[name] = twin
                return ""
        base, inherited = "TypedDict", {}
        for twin, of_twin in self.records.items():
            if are_twins(twin, name) and of_twin.items() <= types.items():
                base, inherited = twin, of_twin
                break
        self.records[name] = types
        text, words_of_python = "", []
        for member, made in types.items():
            if member in inherited:
                continue
            if keyword.iskeyword(member):
                words_of_python.append(f'"{member}": "{made}"')
            else:
                text += self.annotation(member, made)
        if words_of_python:
            base = f"_{name}"
            base_text = f'{base} = TypedDict("{base}", {{{", ".join(words_of_python)}}})\n\n\n'
        else:
            base_text = ""
        doc = self.doc(schema)
        body = doc + text if text else doc.rstrip("\n") + "\n" if doc else "    pass\n"
        return f"{base_text}class {name}({base}):\n{body}"

    def is_same_part(self, twin, name):
        """Whether both are the same part of bodies of one family, with one description."""
        is_part = FAMILY.sub("", name) not in ("", name)
        texts = [words(self.schemas[each]) for each in (twin, name)]
        return is_part and are_twins(twin, name) and texts[0] == texts[1]

    @staticmethod
    def allows(one, other):
        """Whether the types of `one` are those of `other`, with perhaps fewer members required."""
        return one.keys() == other.keys() and all(
            text in (other[member], f"NotRequired[{other[member]}]") for member, text in one.items()
        )

    def types(self, schema):
        made = {member: self.type_of(inner) for member, inner in schema["properties"].items()}
        required = schema.get("required", [])
        return {
            member: text if member in required else f"NotRequired[{text}]"
            for member, text in made.items()
        }

    def annotation(self, name, made):
        line = f"    {name}: {made}\n"
        if len(line) <= WIDTH + 1:
            return line
        head, _, rest = made.partition("Literal[")
        names, _, tail = rest.partition("]")
        lines = "".join(f"        {each},\n" for each in names.split(", "))
        return f"    {name}: {head}Literal[\n{lines}    ]{tail}\n"

    def doc(self, schema):
        doc = words(schema).replace("\\", "\\\\")
        if not doc:
            return ""
        if len(doc) + 10 <= WIDTH:
            return f'    """{doc}"""\n\n'
        first, *lines = textwrap.wrap(doc, WIDTH - 7, initial_indent="   ", break_long_words=False)
        lines = [first.strip(), *lines]
        return '    """' + "\n    ".join(lines) + '\n    """\n\n'

    def component(self, name, schema):
        self.names_are_open = name.startswith(OPEN_NAMES)
        if is_record(schema):
            return self.record(name, schema)
        return self.alias(name, self.type_of(schema))

    def alias(self, name, made):
        line = f"{name}: TypeAlias = {made}\n"
        if len(line) <= WIDTH + 1:
            return line
        head, _, rest = made.partition("Literal[")
        names, _, tail = rest.partition("]")
        return f"{name}: TypeAlias = {head}Literal[\n    {names}\n]{tail}\n"

    def document(self):
        head = (
            '"""The bodies of the HTTP interface, as they are in JSON.\n\n'
            "Made by clients/generate.py from /openapi.json; not edited by hand.\n\n"
            "A part of a request is also that part of a job's spec, where the server fills in\n"
            "all defaults. Type checkers therefore do not know that its members are present\n"
            "there: mypy allows a subscript, pyright reports it.\n"
            '"""\n\n'
            "from __future__ import annotations\n\n"
            "from typing import TYPE_CHECKING, Any, Literal, TypeAlias, TypedDict\n\n"
            "if TYPE_CHECKING:\n"
            "    from typing_extensions import NotRequired\n"
        )
        parts = [self.component(*each) for each in self.schemas.items()]
        return "\n\n".join([head, *filter(None, parts)])


def load(source):
    if source.startswith(("http://", "https://")):
        with urllib.request.urlopen(source.rstrip("/") + "/openapi.json", timeout=30) as answer:
            return json.load(answer)
    return json.loads(pathlib.Path(source).read_text())


def generated(document):
    schemas = document["components"]["schemas"]
    version = document["info"]["version"]
    return {
        TYPESCRIPT: TypeScript(schemas).document(),
        NODE_PACKAGE: re.sub(
            r'(?<="version": ")[^"]*', version, NODE_PACKAGE.read_text(encoding="utf-8")
        ),
        MODELS: Python(schemas).document(),
        VERSION: '"""The version of the project."""\n\n'
        f'__version__ = "{version.replace("-dev", ".dev0")}"\n',
        BLENDER_EXTENSION: re.sub(
            r'(?m)(?<=^version = ")[^"]*', version, BLENDER_EXTENSION.read_text(encoding="utf-8")
        ),
        BLENDER_ADD_ON: re.sub(
            r'(?<="version": \()[^)]*', ", ".join(re.findall(r"\d+", version)),
            BLENDER_ADD_ON.read_text(encoding="utf-8"),
        ),
    }


def main():
    arguments = [each for each in sys.argv[1:] if each != "--check"]
    if len(arguments) != 1:
        sys.exit(__doc__)
    stale = [
        path
        for path, text in generated(load(arguments[0])).items()
        if not path.is_file() or path.read_text() != text
    ]
    if "--check" not in sys.argv:
        for path, text in generated(load(arguments[0])).items():
            path.write_text(text)
        return
    for path in stale:
        print(f"{path.relative_to(HERE.parent)} is stale: run clients/generate.py with this server")
    sys.exit(1 if stale else 0)


if __name__ == "__main__":
    main()
