"""Which form of body is meant: a shape by its name or a word for it, any other form by its key."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import partial
from importlib import import_module
from typing import Annotated, Any, TypeAlias

from pydantic import ValidationInfo

from rigidcli.bodies.form import Form
from rigidcli.bodies.shapes import SHAPES, MadeWhenAsked, Shape
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.section import Section, SectionChoice, by_key, refuse
from rigidcli.fields.words import (
    RELATIVES,
    bracketed,
    keys_called,
    lists_meant,
    not_one_of,
    other_form,
    shapes_called,
    with_colon,
)
from rigidcli.suggestions import did_you_mean, nearest

_CLASSES = {
    "points": "points.PointMasses",
    "parts": "composites.Composite",
    "mesh": "meshes.Mesh",
    "robot": "composites.RobotLink",
    "inertia": "composites.KnownTensor",
    "moments": "composites.KnownTensor",
}


def _loaded(key: str) -> type[Form]:
    module, _, name = _CLASSES[key].partition(".")
    form: type[Form] = getattr(import_module(f"rigidcli.bodies.{module}"), name)
    return form


FORMS = MadeWhenAsked(tuple(_CLASSES), _loaded)  # the forms besides the shapes, by the key that tells them


def shape_called(name: object, raw: Mapping[str, Any]) -> tuple[type[Shape] | None, ValueProblem | None]:
    """The shape of a name, or that for which it is a word; and its problem, unless it is that name.

    Of several the one that has most of the other keys in `raw` is meant, be it only a relative of the others.
    """
    if isinstance(name, dict):
        words = [word for pair in name.items() for word in pair if isinstance(word, str) and word in SHAPES]
        hint = f"write `shape: {words[0] if words else 'box'}`, and its dimensions beside it"
        return None, ValueProblem("read a mapping, expected the name of a shape", hint=hint)
    word = name if isinstance(name, str) else ""
    named = SHAPES.get(word)
    if named is not None and raw.keys() <= named.model_fields.keys():
        lists = (key for key, value in raw.items() if isinstance(value, list) and key in named.dimensions())
        if all(named.holds(key, raw[key]) for key in lists):
            return named, None
    form = f"mesh: {word}" if re.fullmatch(r"(?i).+\.(?:stl|obj|off|ply|glb)", word) else other_form(word)
    if word not in SHAPES and form is not None:
        return None, ValueProblem(f"{shown(name)} is no shape", hint=f"write `{form}` instead of `shape`")
    called = [word] if word in SHAPES else [shape for shape in shapes_called(word) if shape in SHAPES]
    if not called:
        near = nearest(word, SHAPES)
        return SHAPES[near] if near else None, ValueProblem(not_one_of(name, list(SHAPES)))
    called += [relative for shape in called for relative in RELATIVES.get(shape, "").split()]
    best = max((SHAPES[shape] for shape in called), key=lambda shape: _likeness(shape, raw))
    if best.word() in (word, word.replace("disc", "disk")):  # both spellings are English
        return best, None
    return best, ValueProblem(f"read {shown(name)}{did_you_mean(best.word())}", hint=best.summary())


def _likeness(shape: type[Shape], raw: Mapping[str, Any]) -> int:
    """How many of the keys in `raw` are dimensions of the shape in some word: twice where the value fits."""
    keys = {key: shape.key_for(key, value) for key, value in raw.items()}
    lists = [words for _, _, words in lists_meant(raw, shape.model_fields)]
    called = sum(1 + shape.holds(name, raw[key]) for key, name in keys.items() if name is not None)
    return called + 2 * sum(map(len, lists))


def _instead_of(raw: object) -> str | None:
    """How to write a body that stands as a text or a list; None for what may be one, or is refused later."""
    if isinstance(raw, str) and raw.strip() and with_colon(raw) is None:
        if (call := re.fullmatch(r"\s*(\w+)\((.*)\)\s*", raw)) and call[1] in SHAPES:
            return f"write `{{shape: {call[1]}, {re.sub(r' *= *', ': ', call[2])}}}`"
        shapes = (shape_called(word.strip(",.;"), {})[0] for word in (raw, *raw.split()))
        meant = next(filter(None, shapes), SHAPES["box"])
        return f"write `{{shape: {meant.word()}, ...}}`: {meant.summary()}"
    if isinstance(raw, list) and all(isinstance(entry, dict) for entry in raw):
        if all(entry.keys() & {"shape", *FORMS} for entry in raw):
            if len(raw) == 1:
                return "one body stands without a dash; for several write `body: {parts: [...]}`"
            return "bodies that are taken as one are its `parts`: write `body: {parts: [...]}`"
        return "the lines of one body begin without dashes; in one line it stands in braces: `{...}`"
    return None


class _AnyForm(SectionChoice):
    """Marks a field that takes a body of any form, which its key names; a shape is named under `shape`."""

    def read(self, raw: object, info: ValidationInfo) -> Section:
        """The form. All problems of a shape come at once, also where it is called by another word."""
        if (hint := _instead_of(raw)) is not None:
            raise ValueProblem(f"read {shown(raw)}, expected a mapping", hint=hint)
        if not isinstance(raw, dict) or raw.keys() & FORMS.keys():
            return super().read(raw, info)
        words = (word for word in raw if "shape" in keys_called(word))
        key, others = "shape" if "shape" in raw else next(words, None), list[str]()
        if key is None:
            strange = (word for word in raw if word not in Form.model_fields and not with_colon(word))
            others = [word for word in strange if FORMS.keys().isdisjoint(keys_called(word))]
            key = next((word for word in others if nearest(word, ["shape"])), None)
        for word in others if key is None else ():
            named = next((SHAPES[name] for name in shapes_called(word) if name in SHAPES), None)
            if isinstance(raw[word], dict) and (named is not None or raw[word].keys() & {"shape", *FORMS}):
                hint = "bodies that are taken as one are its `parts`: write `body: {parts: [{...}, {...}]}`"
                if named is not None:
                    hint = f"write `shape: {named.word()}`, and its dimensions beside it: {named.summary()}"
                raise ValueProblem("unknown key", path=(word,), hint=hint)
        if key is None:
            return super().read(raw, info)
        shape, problem = shape_called(raw[key], bracketed(raw)[0])
        if key != "shape":
            cure = None if problem is None else problem.hint
            problem = ValueProblem(f"unknown key{did_you_mean('shape')}", hint=cure)
        if shape is None or (problem is not None and problem.hint is None and key == "shape"):
            assert problem is not None
            raise problem.below(key)  # a guess by its letters alone says nothing of the other keys
        rest = {name: value for name, value in raw.items() if name != key} | {"shape": shape.word()}
        read = partial(shape.model_validate, rest, context=info.context)
        return read() if problem is None else refuse(shape.__name__, [problem.below(key)], read)


BODY = _AnyForm(
    by_key(MadeWhenAsked(("shape", *FORMS), lambda key: Form if key == "shape" else FORMS[key])).choose,
    lambda: (*SHAPES.values(), *dict.fromkeys(FORMS.values())),
)

Body: TypeAlias = Annotated[Form, BODY]
