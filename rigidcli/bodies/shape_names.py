"""Which shape a document means: by its name, by another word for it, and by the keys that stand beside it."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from rigidcli.bodies.shape import Shape
from rigidcli.bodies.shapes import SHAPES
from rigidcli.errors import ValueProblem, nearest, shown
from rigidcli.fields.words import RELATIVES, not_one_of, other_form, shapes_called


def shape_called(name: object, raw: Mapping[str, Any]) -> tuple[type[Shape] | None, ValueProblem | None]:
    """The shape of a name, or that for which it is a word; and its problem, unless it is that name.

    Of several the one that has most of the other keys in `raw` is meant, be it only a relative of the others.
    """
    word = name if isinstance(name, str) else ""
    named = SHAPES.get(word)
    if named is not None and raw.keys() <= named.model_fields.keys():
        lists = (key for key, value in raw.items() if isinstance(value, list) and key in named.dimensions())
        if all(named.holds(key, raw[key]) for key in lists):
            return named, None
    form = other_form(word)
    if word not in SHAPES and form is not None:
        return None, ValueProblem(f"{shown(name)} is no shape", hint=f"write `{form}` instead of `shape`")
    called = [word] if word in SHAPES else [each for each in shapes_called(word) if each in SHAPES]
    if not called:
        near = nearest(word, list(SHAPES))
        return (near and SHAPES[near]) or None, ValueProblem(not_one_of(name, list(SHAPES)))
    called += [other for each in called for other in RELATIVES.get(each, "").split()]
    best = max((SHAPES[each] for each in called), key=lambda shape: _likeness(shape, raw))
    if best.word() == word:
        return best, None
    return best, ValueProblem(f"read {shown(name)} (did you mean {best.word()}?)", hint=best.summary())


def _likeness(shape: type[Shape], raw: Mapping[str, Any]) -> int:
    """How many of the keys in `raw` are dimensions of the shape in some word: twice where the value fits."""
    found = [(shape.key_for(*item), item[1]) for item in raw.items()]
    return sum((name is not None) + shape.holds(name, value) for name, value in found)
