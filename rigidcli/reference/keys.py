"""The keys of documents, assignments and answer files, and the shapes, from the models that read them."""

from __future__ import annotations

import inspect
import re
from collections.abc import Collection, Iterator
from types import UnionType
from typing import Any, Literal, NamedTuple, Union, get_args, get_origin

from pydantic.fields import FieldInfo

from rigidcli.core.arithmetic import FLOAT
from rigidcli.model.base import Alternative, Choice, Elsewhere, Quantity, ReadBy, Section, sections_in
from rigidcli.model.document import Document
from rigidcli.model.shape import Shape
from rigidcli.model.shapes import SHAPES
from rigidcli.model.system import SystemExpression
from rigidcli.reference.page import page, paragraph, rows, words


class Key(NamedTuple):
    """A key with its field, or a section that a key may hold; and where that is."""

    path: tuple[str, ...]
    field: FieldInfo | None
    sections: tuple[type[Section], ...]


def roots() -> list[type[Section]]:
    """What files may be: documents, assignments, answers."""
    from rigidcli.grading.question import AnswerFile, Assignment

    return [Document, Assignment, AnswerFile]


def find(path: tuple[str, ...]) -> Key | None:
    """The key at a path from the top of a file; entries of lists and the names of shapes may be left out."""
    for root in roots():
        found = _below(Key((), None, (root,)), path)
        if found is not None:
            return found
    return None


def anywhere(name: str) -> list[Key]:
    """The keys of a name, wherever they stand."""
    return [key for key in every() if key.path[-1] == name]


def every() -> Iterator[Key]:
    """All keys, each once: a section within itself is not entered again."""
    seen = set[type[Section]]()

    def walk(sections: tuple[type[Section], ...], path: tuple[str, ...]) -> Iterator[Key]:
        # Those beside each other come first: bodies stand in `body` before they stand in `parts`.
        fresh = [each for each in sections if each not in seen and not issubclass(each, Shape)]
        seen.update(fresh)
        for section in fresh:
            for name, field in fields_of(section).items():
                key = Key((*path, name), field, tuple(sections_in(field.annotation)))
                yield key
                yield from walk(key.sections, key.path)

    for root in roots():
        yield from walk((root,), ())


def _below(key: Key, path: tuple[str, ...]) -> Key | None:
    if not path:
        return key
    step, *rest = path
    if step.isdecimal() or (step == "shape" and rest):
        return _below(key._replace(path=(*key.path, step)), tuple(rest))
    for section in key.sections:
        name = section.word() if issubclass(section, Shape) else None
        if step == name:
            return _below(Key((*key.path, step), key.field, (section,)), tuple(rest))
    for section in key.sections:
        if step in fields_of(section):
            field = fields_of(section)[step]
            below = Key((*key.path, step), field, tuple(sections_in(field.annotation)))
            found = _below(below, tuple(rest))
            if found is not None:
                return found
    return None


def explained(key: Key) -> str:
    """The page of a key: what it is, what it holds, and the keys below it."""
    head = ".".join(key.path)
    if len(key.sections) == 1 and issubclass(key.sections[0], Shape):
        return shape_page(head, key.sections[0])
    if key.path[-1:] == ("shape",):
        return shapes_page(head)
    about = "" if key.field is None else key.field.description or ""
    if key.field is None or not key.sections:
        return page(head, paragraph(about), "" if key.field is None else _holding(key.field))
    forms = [section for section in key.sections if not issubclass(section, Shape)]
    all_have = set.intersection(*(set(fields_of(section)) for section in forms)) if len(forms) > 1 else set()
    parts = [_section(section, len(forms) > 1, all_have) for section in forms]
    if all_have:
        shared = [(name, said(field)) for name, field in fields_of(forms[0]).items() if name in all_have]
        parts.append("All of them may have:\n" + rows(shared))
    if len(forms) < len(key.sections):
        parts.insert(0, page("A shape, by its name under `shape`:", words(SHAPES)).rstrip())
    return page(head, paragraph(about), *parts)


def top(root: type[Section]) -> str:
    """The page of a file: the keys at its top."""
    return page(root.__name__.lower(), _section(root))


def _section(section: type[Section], is_one_of_several: bool = False, besides: Collection[str] = ()) -> str:
    """What a section is, and its keys without those that stand elsewhere."""
    title = paragraph(_first(section))
    if is_one_of_several:
        required = [name for name, field in section.model_fields.items() if field.is_required()]
        key = next(iter(required), "") or " or ".join(section.ONE_OF)
        title = paragraph(f"With `{key}`: {_first(section)}") if key else title
    own = [(name, said(field)) for name, field in fields_of(section).items() if name not in besides]
    return title + "\n" + rows(own)


def fields_of(section: type[Section]) -> dict[str, FieldInfo]:
    """The keys of a section; those that hold bodies within bodies are known when it is built."""
    if any("ForwardRef" in repr(field.annotation) for field in section.model_fields.values()):
        section.model_rebuild()
    return section.model_fields


def _first(section: type[Section]) -> str:
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
    return _first(sections[0]) if len(sections) == 1 else ""


def _holding(field: FieldInfo) -> str:
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
        return " or ".join(map(_schema, schema["anyOf"]))
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


# --- shapes


class _Typed(str):
    """A dimension by its name, which anchors use as if it were a number."""

    __slots__ = ()

    def __neg__(self) -> _Typed:
        return _Typed(f"-{self}")

    def __truediv__(self, other: object) -> _Typed:
        return _Typed(f"{self}/{other}")

    def __iter__(self) -> Iterator[_Typed]:
        return map(_Typed, "xyz")

    def __getitem__(self, index: Any) -> _Typed:
        return _Typed("xyz"[index])


class _Dimensions:
    """A shape whose dimensions are their names."""

    def __getattr__(self, name: str) -> _Typed:
        return _Typed(name)


def shape_page(head: str, shape: type[Shape]) -> str:
    """What a shape is, its dimensions, and its anchors where they lie along z."""
    own = [(shape.dimensions()[name], said(shape.model_fields[name])) for name in shape.dimensions()]
    names = _Dimensions()
    anchors = [(name, f"({', '.join(map(str, place(names)))})") for name, place in shape.ANCHORS.items()]
    shared = {name: field for name, field in shape.model_fields.items() if name not in shape.dimensions()}
    return page(
        head,
        paragraph(_first(shape)),
        "dimensions\n" + rows(own),
        "anchors, in the shape's own axes\n"
        + rows([*anchors, ("com", "the centre of mass")])
        + _sketch(shape),
        "any shape has\n" + rows([(name, said(field)) for name, field in shared.items()]),
    )


def _sketch(shape: type[Shape]) -> str:
    """The origin, the centre of mass and the anchors in their order along z; nothing where these are one."""
    fields = {name: shape.model_fields[name] for name in shape.dimensions()}
    if any(name == "vertices" for name in fields):
        return ""
    sample: dict[str, Any] = {
        name: tuple(1.0 for _ in get_args(field.annotation)) if get_origin(field.annotation) is tuple else 1.0
        for name, field in fields.items()
    }
    sample |= {name: 0.5 for name in fields if name.startswith(("inner", "top", "minor", "cap"))}
    drawn = shape.model_construct(None, **sample)
    places = {"O": 0.0, "com": float(drawn.geometry(FLOAT).centre[2])}
    places |= {name: float(place(drawn)[2]) for name, place in shape.ANCHORS.items()}
    heights = sorted(set(places.values()))
    if len(heights) == 1:
        return ""
    points = ["=".join(name for name, z in places.items() if z == height) for height in heights]
    return f"\n  {' ---- '.join(points)} ---> z    (O is the origin of its own axes)"


def dimension_page(name: str) -> str | None:
    """A dimension of shapes, and which have it; None for another name."""
    having = [shape for shape in SHAPES.values() if name in shape.dimensions()]
    if not having:
        return None
    return page(
        f"{name}: a dimension of shapes",
        rows([(each.word(), said(each.model_fields[name])) for each in having]),
    )


def shapes_page(head: str = "shapes") -> str:
    """All shapes, each with its dimensions."""
    listed = [(name, ", ".join(shape.dimensions().values())) for name, shape in SHAPES.items()]
    return page(head, rows(listed), "`rigidcli explain cone` tells more of one.")
