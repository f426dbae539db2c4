"""What a key holds, in words, from its field in the model."""

from __future__ import annotations

import inspect
import re
from types import UnionType
from typing import Any, Literal, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from rigidcli.document.sampling import OrMany
from rigidcli.document.system import SystemExpression
from rigidcli.fields.quantities import Quantity
from rigidcli.fields.readers import Alternative, Choice, Elsewhere, ReadBy
from rigidcli.fields.section import Section, sections_in
from rigidcli.reference.page import rows


def fields_of(section: type[Section]) -> dict[str, FieldInfo]:
    """The keys of a section; those that hold bodies within bodies are known when it is built."""
    if any("ForwardRef" in repr(field.annotation) for field in section.model_fields.values()):
        section.model_rebuild()
    return section.model_fields


def first_sentence(section: type[Section]) -> str:
    """The first sentence of what a section's class says of itself."""
    return (inspect.getdoc(section) or "").partition("\n\n")[0].partition(". ")[0].rstrip(".")


def said(field: FieldInfo) -> str:
    """What a key is, and what it holds."""
    told = description(field)
    holds = kind(field)
    unit = re.search(r"\((.*)\)$", holds)
    if unit is not None and unit[0] in told:
        holds = ""
    inside = "" if told and "section" in holds else holds
    value = field.default
    usual = f"default {value}" if isinstance(value, str | float) and "default" not in told and value else ""
    return "; ".join(filter(None, [told, inside, usual, "needed" if field.is_required() else ""]))


def description(field: FieldInfo) -> str:
    """What the model says of a key; of a section, what its class says."""
    if field.description:
        return field.description
    sections = sections_in(field.annotation)
    return first_sentence(sections[0]) if len(sections) == 1 else ""


def holding(field: FieldInfo) -> str:
    """What a key holds, and what is taken where it is not given."""
    told = [("holds", kind(field))]
    if field.is_required():
        told.append(("needed", "yes"))
    elif field.default is not None:
        told.append(("default", str(field.default)))
    return rows(told)


def kind(field: FieldInfo) -> str:
    """What a key holds, in words."""
    marks = [word for mark in field.metadata if (word := _mark(mark))]
    return marks[0] if marks else _kind(field.annotation)


def _mark(mark: object) -> str:
    """What a mark on a field says of what it holds."""
    if isinstance(mark, Quantity):
        return mark.words
    if isinstance(mark, SystemExpression):
        return f"an expression: {mark.dimension}"
    if isinstance(mark, OrMany):
        return f"{_kind(mark.otherwise)}; or a list of such starts, or the name of a .csv file of them"
    if isinstance(mark, Alternative):
        return f"{_schema(mark.schema)}, or {_kind(mark.otherwise)}"
    if isinstance(mark, ReadBy):
        return _schema(mark.schema)
    return "a section of several forms" if isinstance(mark, Choice | Elsewhere) else ""


def _schema(schema: Any) -> str:
    """What a JSON Schema allows, in words."""
    if "description" in schema:
        return str(schema["description"])
    if "enum" in schema:
        return " or ".join(map(str, schema["enum"]))
    if "anyOf" in schema:
        return " or ".join(dict.fromkeys(map(_schema, schema["anyOf"])))
    plain = {"array": "a list", "object": "a mapping", "string": "a text", "integer": "a whole number"}
    types = schema.get("type", "object")
    several = types if isinstance(types, list) else [types]
    return " or ".join(plain.get(each, f"a {each}") for each in several)


def _kind(annotation: Any) -> str:
    marks = [word for mark in getattr(annotation, "__metadata__", ()) if (word := _mark(mark))]
    if marks:
        return marks[0]
    origin, entries = get_origin(annotation), get_args(annotation)
    if origin is Literal:
        return " or ".join(map(str, entries))
    if origin in (Union, UnionType):
        return " or ".join(_kind(each) for each in entries if each is not type(None))
    if origin is tuple:
        if Ellipsis in entries:
            return f"a list, each {_kind(entries[0])}"
        each = ", then each ".join(dict.fromkeys(map(_kind, entries)))
        return f"a list of {len(entries)}, each {each}" if "then" not in each else f"a list of {each}"
    if origin is dict:
        return "a mapping"
    if isinstance(annotation, type) and issubclass(annotation, Section):
        return "a section"
    if entries:
        return _kind(entries[0])
    return {str: "a text", bool: "true or false", int: "a whole number"}.get(annotation, "anything")
