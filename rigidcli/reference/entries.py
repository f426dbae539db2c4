"""All that can be explained, one entry each: keys, shapes, units, functions, results, mistakes and subjects.

Collecting them takes 0.3 s, so `python -m rigidcli.reference.entries` writes them to entries.json.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from typing import Any, TypeAlias

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.bodies.robots import ENDINGS
from rigidcli.bodies.shapes import SHAPES
from rigidcli.document.document import Document
from rigidcli.document.draft import BODY_FILES
from rigidcli.document.motion import TORQUE_VARIABLES
from rigidcli.document.yaml_reader import read_tree
from rigidcli.errors import EXIT_CODES
from rigidcli.fields.section import Section
from rigidcli.fields.units import PREFIXES, TABLE, parse_unit
from rigidcli.homework.base import CODES
from rigidcli.homework.question import AnswerFile, Assignment
from rigidcli.language.words import ALIASES, CONSTANTS, DEFINED, FUNCTIONS, NOTATION
from rigidcli.reference.pages import ENTRIES, Entry
from rigidcli.reference.schema import json_schema
from rigidcli.studies.common import RESULTS, WORDS

Schema: TypeAlias = Mapping[str, Any]  # the JSON Schema of a value
# The files that people write.
WRITTEN_FILES: Mapping[str, tuple[str, type[Section]]] = {
    "document": ("the keys at the top of a document", Document),
    "assignment": ("the keys of an assignment of `check`", Assignment),
    "answers": ("the keys of an answer file", AnswerFile),
}


def entries() -> list[Entry]:
    """All entries; the topics are those with a path of one name."""
    plain = [*_keys(), *_shapes(), *_results(), *_others()]
    examples = _examples()
    each = [entry._replace(example=_example_for(entry.path, examples)) for entry in plain]
    return [*each, *_subjects(plain)]


def _examples() -> dict[tuple[str, ...], str]:
    """The first example with each key, by the path of its entry, from examples.txt."""
    examples: dict[tuple[str, ...], str] = {}
    for text in _resource("examples.txt").split("\n\n"):
        tree = read_tree(text, "examples.txt")
        root = "answers" if "answers" in tree else "assignment" if "questions" in tree else "document"
        for path in _paths(tree, (root,)):
            examples.setdefault(path, text.strip())
    return examples


def _paths(tree: Any, above: tuple[str, ...]) -> Iterator[tuple[str, ...]]:
    """The paths of the keys in a tree, as entries have them: without indices, and through the shape."""
    if isinstance(tree, list):
        for entry in tree:
            yield from _paths(entry, above)
    if not isinstance(tree, dict):
        return
    if above == ("document", "body", "parts"):
        above = ("document", "body")
    if above in (("assignment", "questions"), ("answers", "answers")):
        yield above
        tree = {"": [*tree.values()]}  # its keys are names that people choose
    for key, value in tree.items():
        path = (*above, key) if key else above
        yield path
        if "shape" in tree:
            yield (*above, "shape", tree["shape"])
            yield (*above, "shape", tree["shape"], key)
        yield from _paths(value, path)


def _example_for(path: tuple[str, ...], examples: Mapping[tuple[str, ...], str]) -> str:
    """The example of a key, or of the nearest key above it."""
    above = (path[:end] for end in range(len(path), 1, -1))
    return next((examples[each] for each in above if each in examples), "")


def _subjects(every: Sequence[Entry]) -> Iterator[Entry]:
    """The words of a course, with the entries to which each leads."""
    texts: dict[str, str] = {}
    for entry in every:
        for path in (entry.path, entry.path[1:]):
            texts.setdefault(".".join(path), entry.text)
    yield Entry(("subjects",), "words of a course, and where each leads")
    for line in _resource("subjects.tsv").splitlines()[1:]:
        names, text, see = (cell.split(", ") if k != 1 else [cell] for k, cell in enumerate(line.split("\t")))
        facts = {path: texts[path] for path in see}
        yield Entry(("subjects", names[0]), text[0], facts=facts, other_names=names)


def _resource(name: str) -> str:
    return Path(__file__).with_name(name).read_text("utf-8")


def written() -> str:
    """The text of entries.json: a line for each entry."""
    return "[\n" + ",\n".join(json.dumps(entry, ensure_ascii=False) for entry in entries()) + "\n]\n"


def _results() -> Iterator[Entry]:
    common = "all have `schema`, `name`, `source` and `units`, too, and with `--sweep` also `swept`"
    yield Entry(("results",), "the results of each command: the fields of its json", facts={"json": common})
    for command, fields in RESULTS.items():
        keys = ", ".join(field.key for field in fields)
        yield Entry(("results", command), f"results of `rigidcli {command}`", row=keys)
        for group in dict.fromkeys(field.key.partition(".")[0] for field in fields if "." in field.key):
            if all(field.key != group for field in fields):
                yield Entry(("results", command, group), f"results of `{command}` under `{group}`")
        for field in fields:
            words = "; ".join(filter(None, [field.title.strip(), field.means]))
            words = words or f"the {field.key.rpartition('.')[2].replace('_', ' ')}"
            text = f"{words} ({field.unit})" if field.unit else words
            facts = {"symbol": field.symbol and f"{field.symbol} (LaTeX)", "csv": ", ".join(field.cells)}
            path = ("results", command, *field.key.split("."))
            yield Entry(path, text, "", facts, [*field.cells])
            for (key, value), meaning in WORDS.items():
                if key == field.key and value:
                    yield Entry((*path, value), meaning)


def _others() -> Iterator[Entry]:
    yield Entry(("files",), "the files that commands read, by the endings of their names")
    for form in dict.fromkeys(BODY_FILES.values()):
        endings = ", ".join(ending for ending in BODY_FILES if BODY_FILES[ending] == form)
        yield Entry(("files", endings), f"`body.{form}` by itself, which `--set body.density=7850` completes")
    yield Entry(("files", ", ".join(ENDINGS)), "a robot in URDF, SDF or MJCF: a result for each link")
    yield Entry(("files", "@files.txt"), "a list of names, one on a line")
    yield Entry(("files", "any other, and -"), "a document in YAML or JSON; - is standard input")
    prefixes = ", ".join(prefix for prefix in PREFIXES if len(prefix) <= 2 and prefix.isascii())
    remark = f"SI units may have a prefix ({prefixes}). Products and powers: `g cm^2`, `kg/m^3`, `N m`."
    yield Entry(("units",), "units of quantities such as `5 cm`", facts={"prefixes": remark})
    by_dimension: dict[str, list[str]] = {}
    for names, *_ in TABLE:
        first = names.split()[0]
        by_dimension.setdefault(str(parse_unit(first).dimension), []).append(first)
    for dimension, units in by_dimension.items():
        yield Entry(("units", dimension), ", ".join(units))
    operators = "+ - * / and ** or ^ for powers. `2 a` is a product."
    yield Entry(("functions",), "functions in expressions", facts={"operators": operators})
    says = {f"{name}({'x' if each.arity == 1 else 'y, x'})": each.says for name, each in FUNCTIONS.items()}
    says |= {f"{name}({', '.join(names)})": formula for name, (formula, *names) in DEFINED.items()}
    says |= {f"{alias}(x)": f"the same as {name}(x)" for alias, name in ALIASES.items() if alias != name}
    for call, text in says.items():
        yield Entry(("functions", call), text, other_names=[call.partition("(")[0]])
    for name, value in CONSTANTS.items():
        yield Entry(("functions", name), f"{value:.16g}")
    taken = "the first that is right; in a document the one whose names and dimension fit, if there is one"
    yield Entry(("notation",), "what people type, and its readings", facts={"taken": taken})
    for each in NOTATION:
        readings = "; or ".join(each.readings) + " (answers)" * (each.document == "refused")
        yield Entry(("notation", each.typed), readings, "typed, and read as (the most usual first)")
    yield Entry(("mistakes",), "what `check` may say")
    for code, sentence in CODES.items():
        yield Entry(("mistakes", code), sentence)
    for line in _resource("topics.tsv").splitlines()[1:]:
        topic, name, text = line.split("\t")
        yield Entry((topic, name) if name else (topic,), text)
    yield Entry(("exit-codes",), "what the exit codes mean")
    for number, meaning in EXIT_CODES.items():
        yield Entry(("exit-codes", str(number)), meaning)


def _shapes() -> Iterator[Entry]:
    yield Entry(("shapes",), "the shapes of bodies with their dimensions")
    for name, shape in SHAPES.items():
        written, section = shape.dimensions(), _file("document")["$defs"][shape.__name__]
        path = ("document", "body", "shape", name)
        others = ", ".join(key for key in section["properties"] if key not in (*written, "shape"))
        facts = {"also": f"{others}: `rigidcli explain body`"}
        dimensions = ", ".join(written.values())
        yield Entry(path, _first_sentence(section), facts=facts, row=dimensions)
        for key, schema, needed in _keys_in(section):
            if key in written:
                form = "" if written[key] == key else f"`{written[key]}`. "
                yield Entry((*path, key), form + _summary(schema, needed), "dimensions")
        symbols = {key: EXACT.symbol(key, True) for key in (*written, *"xyz")}
        lists = {key: tuple(symbols[axis] for axis in "xyz") for key in written if written[key] != key}
        sample = SimpleNamespace(**symbols | lists)
        for anchor, at in shape.ANCHORS.items():
            place = f"({', '.join(map(str, at(sample)))})"
            yield Entry((*path, anchor), place, "anchors, in the shape's own axes")


def _keys() -> Iterator[Entry]:
    for name, (text, _) in WRITTEN_FILES.items():
        yield Entry((name,), text)
        yield from _below((name,), _file(name), ())
    for name, text in TORQUE_VARIABLES.items():
        yield Entry(("document", "motion", "torque", name), text, "variables of the components")


def _below(path: tuple[str, ...], schema: Schema, above: Sequence[Schema]) -> Iterator[Entry]:
    """The entries of the keys below a value, unless it is a section within itself."""
    every = [section for section in _sections(schema) if not any(section is other for other in above)]
    shapes = [section for section in every if "const" in section["properties"].get("shape", {})]
    forms = [section for section in every if section not in shapes] + shapes[:1]
    shared = set.intersection(*(set(form["properties"]) for form in forms)) if len(forms) > 1 else set()
    for form in forms:
        is_shape, needed = form in shapes, form.get("required", [])[:1]
        needed = needed or [name for choice in form.get("oneOf", ()) for name in choice.get("required", ())]
        group = _first_sentence(form) if len(forms) > 1 else ""
        if group and needed:
            group = f"With `{' or '.join(needed)}`: {group}"
        for name, value, is_needed in _keys_in(form):
            inner, text = (*path, name), _summary(value, is_needed)
            if name in shared:
                if form is forms[-1]:
                    yield Entry(inner, text, "All of them may have")
            elif not is_shape:
                yield Entry(inner, text, group)
            elif name == "shape":
                names = ", ".join(SHAPES)
                yield Entry(inner, "the name of a shape, with its dimensions", "With `shape`", row=names)
            elif name not in SHAPES[form["properties"]["shape"]["const"]].dimensions():
                yield Entry(inner, value["description"], "With `shape`")
            if form is forms[-1] or name not in shared:
                yield from _below(inner, value, (*above, *every))


@cache
def _file(name: str) -> Schema:
    return json_schema(WRITTEN_FILES[name][1])


def _referred(schema: Schema) -> Schema:
    """The definition to which a schema refers; a schema without a reference is its own."""
    if "$ref" not in schema:
        return schema
    name = schema["$ref"].rpartition("/")[2]
    return next(definitions[name] for file in WRITTEN_FILES if name in (definitions := _file(file)["$defs"]))


def _leaves(schema: Schema) -> Iterator[Schema]:
    """The schemas of what a value may be, at any depth of its lists and choices: sections or plain values."""
    schema = _referred(schema)
    entries = [schema.get("items"), schema.get("additionalProperties")]
    inner = [*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("prefixItems", ())]
    inner += [entry for entry in entries if isinstance(entry, dict)]
    if "properties" in schema or not inner:
        yield schema
    else:
        for entry in inner:
            yield from _leaves(entry)


def _sections(schema: Schema) -> list[Schema]:
    return list({id(leaf): leaf for leaf in _leaves(schema) if "properties" in leaf}.values())


def _keys_in(section: Schema) -> list[tuple[str, Schema, bool]]:
    needed = section.get("required", ())
    return [(name, schema, name in needed) for name, schema in section["properties"].items()]


def _first_sentence(section: Schema) -> str:
    text = " ".join(str(section.get("description", "")).partition("\n\n")[0].split())
    return text.partition(". ")[0].rstrip(".")


def _summary(schema: Schema, is_needed: bool) -> str:
    """Sentences on a key: the description, the kind of value, the default, and whether it is needed."""
    sections, default = _sections(schema), schema.get("default")
    is_section = all("properties" in leaf for leaf in _leaves(schema))
    is_alone = len(sections) == 1 and is_section
    sentence = str(schema.get("description", "")) or (_first_sentence(sections[0]) if is_alone else "")
    kind = _kind(schema)
    unit = kind[kind.rfind("(") :] if kind.endswith(")") else ""
    is_said = kind in sentence or (bool(sentence) and ((unit and unit in sentence) or is_section))
    has_default = isinstance(default, str | int | float) and str(default) not in ("", "0", "False")
    usual = f"by default `{default}`" if has_default and "default" not in sentence else ""
    words = filter(None, [sentence, "" if is_said else kind, usual, "needed" if is_needed else ""])
    first, *others = (text[:1].upper() + text[1:] for text in words)
    return " ".join(f"{text}." for text in (first, *others)) if others else first


# The types of JSON in the words of documents.
_TYPES = {
    "array": "a list",
    "boolean": "true or false",
    "integer": "a whole number",
    "integer or string": "a whole number",
    "number or string": "an expression",
    "object": "a mapping",
    "string": "a text",
    "string or number": "a text",
}


def _kind(schema: Schema) -> str:
    if "$ref" in schema:
        definition = _referred(schema)
        return "a mapping" if "properties" in definition else _small(definition["description"])
    if choices := schema.get("anyOf") or schema.get("oneOf"):
        words = dict.fromkeys(map(_entry, choices))
        return (", or " if any("list" in choice for choice in words) else " or ").join(words)
    if "const" in schema or "enum" in schema:
        *values, last = (f"`{value}`" for value in schema.get("enum", [schema.get("const")]))
        return f"{', '.join(values)} or {last}" if values else last
    if entries := schema.get("prefixItems"):
        first, *others = dict.fromkeys(map(_entry, entries))
        further = "".join(f", then {other} each" for other in others)
        return f"a list of {len(entries)}{':' if others else ', each'} {first}{further}"
    if schema.get("type") == "array" and "items" in schema:
        return f"a list of entries, each {_entry(schema['items'])}"
    types = schema.get("type", [])
    name = types if isinstance(types, str) else " or ".join(types)
    return _TYPES.get(name, f"a {name}" if name else "")


def _entry(schema: Schema) -> str:
    """The kind of an entry of a list, or of one of several choices: its description, if it has one."""
    return _small(schema.get("description")) or _kind(schema)


def _small(text: str | None) -> str:
    """A description up to its first semicolon, as part of a sentence."""
    return (text[:1].lower() + text[1:]).partition(";")[0] if text else ""


if __name__ == "__main__":
    ENTRIES.write_text(written(), "utf-8")
