"""The keys of documents, assignments and answer files, and the shapes: pages made of the JSON Schema."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping
from functools import cache
from types import SimpleNamespace
from typing import Any, NamedTuple, TypeAlias

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.bodies.shapes import SHAPES
from rigidcli.document.document import Document
from rigidcli.fields.section import Section
from rigidcli.reference.page import page, paragraph, rows, words
from rigidcli.reference.schema import json_schema

Schema: TypeAlias = Mapping[str, Any]
"""The JSON Schema of a value."""

_TYPES = {
    "array": "a list",
    "boolean": "true or false",
    "integer": "a whole number",
    "object": "a mapping",
    "string": "a text",
}
"""The types of JSON in the words of documents."""


class Key(NamedTuple):
    """The path to a key, and the schema of its value; the path of a whole file is empty."""

    path: tuple[str, ...]
    schema: Schema
    is_needed: bool = False


FILES = ("document", "assignment", "answers")
"""The files that people write."""

_DEFINITIONS: dict[str, Schema] = {}
"""The definitions to which the schemas of files refer, as far as these are loaded."""


@cache
def file(name: str) -> Schema:
    """The schema of one of the FILES, which is loaded when it is first used."""
    root: type[Section] = Document
    if name != "document":
        from rigidcli.check.question import AnswerFile, Assignment

        root = Assignment if name == "assignment" else AnswerFile
    schema = json_schema(root)
    _DEFINITIONS.update(schema["$defs"])
    return schema


def _referred(schema: Schema) -> Schema:
    """The definition to which a schema refers; a schema without a reference is its own."""
    return _DEFINITIONS[schema["$ref"].rpartition("/")[2]] if "$ref" in schema else schema


def sections(schema: Schema) -> list[Schema]:
    """The sections that a value may be, at any depth of its lists and choices."""
    schema = _referred(schema)
    if "properties" in schema:
        return [schema]
    entries = [schema.get("items"), schema.get("additionalProperties")]
    inner = [*schema.get("anyOf", ()), *schema.get("oneOf", ()), *schema.get("prefixItems", ())]
    inner += [entry for entry in entries if isinstance(entry, dict)]
    return list({id(section): section for entry in inner for section in sections(entry)}.values())


def keys_of(section: Schema, path: tuple[str, ...] = ()) -> list[Key]:
    """The keys of a section that stands at a path."""
    needed = section.get("required", ())
    return [Key((*path, name), schema, name in needed) for name, schema in section["properties"].items()]


def shape_of(section: Schema) -> str | None:
    """The name of the shape that a section describes, if it is one."""
    name: str | None = section["properties"].get("shape", {}).get("const")
    return name


def find(path: tuple[str, ...]) -> Key | None:
    """The key at a path from the top of a file; indices of lists and names of shapes may be left out."""
    places = (_below(Key((), file(name)), path) for name in FILES)
    return next((place for place in places if place is not None), None)


def _below(key: Key, path: tuple[str, ...]) -> Key | None:
    if not path:
        return key
    step, *rest = path
    if step.isdecimal() or (step == "shape" and rest):
        return _below(key._replace(path=(*key.path, step)), tuple(rest))
    choices = sections(key.schema)
    steps = [key._replace(path=(*key.path, step), schema=each) for each in choices if shape_of(each) == step]
    steps += [below for each in choices for below in keys_of(each, key.path) if below.path[-1] == step]
    return next((place for each in steps if (place := _below(each, tuple(rest))) is not None), None)


def every() -> Iterator[Key]:
    """All keys, each once: a section within itself is not entered again."""
    seen = set[str]()

    def walk(choices: list[Schema], path: tuple[str, ...]) -> Iterator[Key]:
        # Those beside each other come first: bodies stand in `body` before they stand in `parts`.
        fresh = [each for each in choices if each.get("title") not in seen and shape_of(each) is None]
        seen.update(each["title"] for each in fresh if "title" in each)
        for key in (key for section in fresh for key in keys_of(section, path)):
            yield key
            yield from walk(sections(key.schema), key.path)

    for name in FILES:
        yield from walk([file(name)], ())


def first_sentence(section: Schema) -> str:
    """The first sentence about a section."""
    text = " ".join(str(section.get("description", "")).partition("\n\n")[0].split())
    return text.partition(". ")[0].rstrip(".")


def _is_section(schema: Schema) -> bool:
    """Whether a value is a section, of one form or several, or a list of such sections."""
    schema = _referred(schema)
    choices = [*schema.get("anyOf", ()), *schema.get("oneOf", ())]
    choices += [schema["items"]] if "items" in schema else []
    return "properties" in schema or (bool(choices) and all(map(_is_section, choices)))


def about(key: Key) -> str:
    """The description of a key, or else the first sentence about the section that it holds."""
    choices = sections(key.schema)
    is_alone = len(choices) == 1 and _is_section(key.schema)
    return str(key.schema.get("description", "")) or (first_sentence(choices[0]) if is_alone else "")


def _default(key: Key) -> str:
    """The default of a key as a person would type it; none for an empty text or list."""
    default = key.schema.get("default")
    return str(default) if isinstance(default, str | int | float) else ""


def summary(key: Key) -> str:
    """A line on a key: the description, the kind of value, the default, and whether it is needed."""
    sentence, kind, default = about(key), holds(key.schema), _default(key)
    unit = kind[kind.rfind("(") :] if kind.endswith(")") else ""
    is_said = bool(sentence) and ((unit and unit in sentence) or _is_section(key.schema))
    usual = f"default {default}" if default not in ("", "0", "False") and "default" not in sentence else ""
    needed = "needed" if key.is_needed else ""
    return "; ".join(filter(None, [sentence, "" if is_said else kind, usual, needed]))


def holds(schema: Schema) -> str:
    """The kind of value that a schema allows, in words."""
    if "$ref" in schema:
        definition = _referred(schema)
        return "a mapping" if "properties" in definition else _small(definition["description"])
    if choices := schema.get("anyOf") or schema.get("oneOf"):
        words = dict.fromkeys(map(_entry, choices))
        return (", or " if any("list" in choice for choice in words) else " or ").join(words)
    if "const" in schema or "enum" in schema:
        return " or ".join(map(str, schema.get("enum", [schema.get("const")])))
    if entries := schema.get("prefixItems"):
        each = ", then each ".join(dict.fromkeys(map(_entry, entries)))
        return f"a list of {len(entries)}, each {each}" if "then" not in each else f"a list of {each}"
    if schema.get("type") == "array" and "items" in schema:
        return f"a list, each {_entry(schema['items'])}"
    types = schema.get("type", [])
    names = [types] if isinstance(types, str) else types
    return " or ".join(_TYPES.get(name, f"a {name}") for name in names) or "anything"


def _entry(schema: Schema) -> str:
    """The kind of an entry of a list, or of one of several choices: its description, if it has one."""
    return _small(schema.get("description")) or holds(schema)


def _small(text: str | None) -> str:
    """A description up to its first semicolon, as part of a sentence."""
    return (text[:1].lower() + text[1:]).partition(";")[0] if text else ""


def explained(key: Key) -> str:
    """The page of a key: the description, the kind of value, and the keys below it."""
    head, choices = ".".join(key.path), sections(key.schema)
    names = [shape for section in choices if (shape := shape_of(section)) is not None]
    if len(choices) == len(names) == 1:
        return shape_page(names[0], head)
    if key.path[-1:] == ("shape",):
        return shapes_page(head)
    needed = "yes" if key.is_needed else ""
    facts = {"holds": holds(key.schema), "needed": needed, "default": _default(key)}
    holding = "" if _is_section(key.schema) else rows([fact for fact in facts.items() if fact[1]])
    if not choices:
        return page(head, paragraph(about(key)), holding)
    forms = [section for section in choices if shape_of(section) is None]
    shared = set.intersection(*(set(form["properties"]) for form in forms)) if len(forms) > 1 else set()
    parts = [page("A shape, by its name under `shape`:", words(SHAPES)).rstrip()] if names else []
    parts += [_section(form, len(forms) > 1, shared) for form in forms]
    if shared:
        common = [key for key in keys_of(forms[0]) if key.path[-1] in shared]
        parts.append("All of them may have:\n" + _summaries(common))
    return page(head, paragraph(str(key.schema.get("description", ""))), holding, *parts)


def file_page(name: str) -> str:
    """The page of a file: the keys at its top; of an assignment also those of its sections."""
    top = file(name)
    return page(name, *map(_section, _with_sections(top) if name == "assignment" else [top]))


def _with_sections(section: Schema) -> Iterator[Schema]:
    """A section, and those that its keys hold."""
    yield section
    for key in keys_of(section):
        for inner in sections(key.schema):
            yield from _with_sections(inner)


def _summaries(keys: list[Key]) -> str:
    return rows([(key.path[-1], summary(key)) for key in keys])


def _section(section: Schema, is_one_of_several: bool = False, besides: Collection[str] = ()) -> str:
    """The first sentence about a section, and its keys without those `besides`."""
    title = first_sentence(section)
    needed = section.get("required", [])[:1] or [
        name for choice in section.get("oneOf", ()) for name in choice.get("required", ())
    ]
    if is_one_of_several and needed:
        title = f"With `{' or '.join(needed)}`: {title}"
    own = [key for key in keys_of(section) if key.path[-1] not in besides]
    return paragraph(title) + "\n" + _summaries(own)


def shape_page(name: str, head: str = "") -> str:
    """The page of a shape: a sentence, the dimensions, the anchors, and the keys that all shapes have."""
    shape = SHAPES[name]
    written, section = shape.dimensions(), file("document")["$defs"][shape.__name__]
    symbols = {key: EXACT.symbol(key, True) for key in (*written, *"xyz")}
    lists = {key: tuple(symbols[axis] for axis in "xyz") for key, words in written.items() if words != key}
    sample = SimpleNamespace(**symbols | lists)
    anchors = [(anchor, f"({', '.join(map(str, at(sample)))})") for anchor, at in shape.ANCHORS.items()]
    keys = {key.path[-1]: key for key in keys_of(section)}
    own = [(words, summary(keys.pop(key))) for key, words in written.items()]
    return page(
        head or name,
        paragraph(first_sentence(section)),
        "dimensions\n" + rows(own),
        "anchors, in the shape's own axes\n" + rows([*anchors, ("com", "the centre of mass")]),
        "any shape has\n" + _summaries([*keys.values()]),
    )


def dimension_pages(name: str) -> list[str]:
    """The page of a dimension, with the shapes that have it; none of another name."""
    having = []
    for shape in SHAPES.values():
        if name in shape.dimensions():
            schema = file("document")["$defs"][shape.__name__]["properties"][name]
            having.append((shape.word(), summary(Key((), schema, is_needed=True))))
    return [page(f"{name}: a dimension of shapes", rows(having))] if having else []


def shapes_page(head: str = "shapes") -> str:
    """The page of all shapes, each with its dimensions."""
    listed = [(name, ", ".join(shape.dimensions().values())) for name, shape in SHAPES.items()]
    return page(head, rows(listed), "`rigidcli explain cone` tells more of one.")
