"""The keys of documents, assignments and answer files, and the shapes, from the models that read them."""

from __future__ import annotations

from collections.abc import Collection, Iterator
from types import SimpleNamespace
from typing import NamedTuple

from pydantic.fields import FieldInfo

from rigidcli.algebra.arithmetic import EXACT
from rigidcli.bodies.shape import Shape
from rigidcli.bodies.shapes import SHAPES
from rigidcli.document.document import Document
from rigidcli.fields.section import Section, sections_in
from rigidcli.reference.fields import fields_of, first_sentence, holding, said
from rigidcli.reference.page import page, paragraph, rows, words


class Key(NamedTuple):
    """A key with its field, or a section that a key may hold; and where that is."""

    path: tuple[str, ...]
    field: FieldInfo | None
    sections: tuple[type[Section], ...]


def roots() -> list[type[Section]]:
    """What files may be: documents, assignments, answers."""
    from rigidcli.check.question import AnswerFile, Assignment

    return [Document, Assignment, AnswerFile]


def find(path: tuple[str, ...]) -> Key | None:
    """The key at a path from the top of a file; entries of lists and the names of shapes may be left out."""
    for root in roots():
        found = _below(Key((), None, (root,)), path)
        if found is not None:
            return found
    return None


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
        return page(head, paragraph(about), "" if key.field is None else holding(key.field))
    forms = [section for section in key.sections if not issubclass(section, Shape)]
    all_have = set.intersection(*(set(fields_of(section)) for section in forms)) if len(forms) > 1 else set()
    parts = [_section(section, len(forms) > 1, all_have) for section in forms]
    if all_have:
        shared = [(name, said(field)) for name, field in fields_of(forms[0]).items() if name in all_have]
        parts.append("All of them may have:\n" + rows(shared))
    if len(forms) < len(key.sections):
        parts.insert(0, page("A shape, by its name under `shape`:", words(SHAPES)).rstrip())
    return page(head, paragraph(about), *parts)


def top(place: int) -> str:
    """The page of a file, by its place among the `roots`: the keys at its top."""
    root = roots()[place]
    return page(root.__name__.lower(), _section(root))


def assignment() -> str:
    """The page of an assignment: its keys, and those of a question, a tolerance and an accepted answer."""
    from rigidcli.check.question import Accepted, Assignment, Question, Tolerance

    sections: tuple[type[Section], ...] = (Assignment, Question, Tolerance, Accepted)
    return page("assignment", *map(_section, sections))


def _section(section: type[Section], is_one_of_several: bool = False, besides: Collection[str] = ()) -> str:
    """What a section is, and its keys without those that stand elsewhere."""
    title = paragraph(first_sentence(section))
    if is_one_of_several:
        required = [name for name, field in section.model_fields.items() if field.is_required()]
        key = next(iter(required), "") or " or ".join(section.ONE_OF)
        title = paragraph(f"With `{key}`: {first_sentence(section)}") if key else title
    own = [(name, said(field)) for name, field in fields_of(section).items() if name not in besides]
    return title + "\n" + rows(own)


def shape_page(head: str, shape: type[Shape]) -> str:
    """What a shape is, its dimensions, and its anchors."""
    written = shape.dimensions()
    own = [(words, said(shape.model_fields[name])) for name, words in written.items()]
    symbols = {name: EXACT.symbol(name, True) for name in (*written, *"xyz")}
    lists = {name: tuple(symbols[axis] for axis in "xyz") for name, words in written.items() if words != name}
    sample = SimpleNamespace(**symbols | lists)
    anchors = [(name, f"({', '.join(map(str, place(sample)))})") for name, place in shape.ANCHORS.items()]
    shared = [(name, said(field)) for name, field in shape.model_fields.items() if name not in written]
    return page(
        head,
        paragraph(first_sentence(shape)),
        "dimensions\n" + rows(own),
        "anchors, in the shape's own axes\n" + rows([*anchors, ("com", "the centre of mass")]),
        "any shape has\n" + rows(shared),
    )


def dimension_page(name: str) -> str | None:
    """A dimension of shapes, and which have it; None for another name."""
    having = [
        (each.word(), said(each.model_fields[name])) for each in SHAPES.values() if name in each.dimensions()
    ]
    return page(f"{name}: a dimension of shapes", rows(having)) if having else None


def shapes_page(head: str = "shapes") -> str:
    """All shapes, each with its dimensions."""
    listed = [(name, ", ".join(shape.dimensions().values())) for name, shape in SHAPES.items()]
    return page(head, rows(listed), "`rigidcli explain cone` tells more of one.")
