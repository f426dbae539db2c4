"""The keys of questions for many numbers, and the points at which they are worked out."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping
from contextlib import suppress
from hashlib import sha256
from typing import Any

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.core.arithmetic import Array
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.grading.arrays.entries import (
    Cell,
    Entry,
    Layout,
    Point,
    filled,
    is_quantity,
    opened,
    read_entries,
    value_at,
    worked,
)
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.asked import Asked
from rigidcli.grading.codes import CODES
from rigidcli.grading.numbers import read_written
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.units import read_unit
from rigidcli.language.expression import Expression, parse
from rigidcli.language.tree import Node

POINTS = 5
"""Points at which entries with symbols are compared."""

TRIES = 50
"""Random points among which those are looked for where the key has values."""

LOW, HIGH = 0.3, 1.7
"""Between what sizes random values lie."""

TENSORS = (("tensor",), ("tensor_com",))
"""The last names of the paths of inertia tensors."""


def reference(asked: Asked, layout: Layout) -> Reference:
    """The key of a question, literal (laid out as answers are) or computed. Raises ValueProblem."""
    question, beside = asked.question, 0.0
    if question.tolerance.figures != "value":
        raise ValueProblem("written figures are judged of a number or a quantity", path=("tolerance",))
    if question.modulo is not None:
        raise ValueProblem("a period is for a number or a quantity", path=("modulo",))
    if asked.report is None:
        try:
            unit, entries = _literal(layout(opened(asked.value)), frozenset(question.symbols or ()))
        except Unreadable as unreadable:
            place, code = unreadable.finding.place, unreadable.finding.code
            raise ValueProblem(f"{place}: {CODES[code]}" if place else CODES[code]) from None
    else:
        unit, entries = parse_unit(asked.unit) if asked.unit else None, computed(asked.value)
        beside = size_beside(asked)
    points, given, known = _points(asked, entries)
    values, labels = worked(entries, points), labelled("entry", entries.shape)
    rest = (points, given, known, unit, question.tolerance, labels, beside)
    return Reference(question, asked.path, entries, values, *rest, derived=_derived(asked))


def _derived(asked: Asked) -> dict[str, Node]:
    """The parameters of a document that hang on others; in exact results also those that have a value."""
    known = {} if asked.document is None else asked.document.definitions
    return {
        name: definition.root
        for name, definition in known.items()
        if definition is not None and (definition.names or _is_exact(asked))
    }


def labelled(word: str, shape: tuple[int, ...]) -> Array:
    """The names of the places of entries (...)."""
    names = [
        f"row {place[0] + 1}, column {place[1] + 1}" if len(shape) == 2 else f"{word} {place[-1] + 1}"
        for place in np.ndindex(*shape)
    ]
    return filled(names, shape)


def _literal(cells: Array, names: frozenset[str]) -> tuple[Unit | None, Array]:
    """The unit of the first entry that has one, and the entries. Raises Unreadable."""
    units = (_unit_of(cell, names) for cell in cells.flat)
    unit = next((unit for unit in units if unit is not None), None)
    return unit, filled([each.entry for each in read_entries(cells, unit, names)], cells.shape)


def _unit_of(cell: Cell, names: frozenset[str]) -> Unit | None:
    """The unit of an entry of a literal key, if it has one. Raises Unreadable."""
    if names and isinstance(cell.answer, str) and not is_quantity(cell.answer, names):
        return None
    written = read_written(cell.answer, cell.place)
    return None if written.unit is None else read_unit(written.unit, place=cell.place)


def computed(value: Any) -> Array:
    """The entries of a result: an array of floats, exact numbers or trees. Raises ValueProblem."""
    array = np.asarray(value, dtype=object)
    return filled([_entry(entry) for entry in array.flat], array.shape)


def _entry(value: Any) -> Entry:
    if isinstance(value, float | int | np.number) and not isinstance(value, bool):
        number = float(value)
        if not math.isfinite(number):
            raise ValueProblem("this result is not finite")
        return number
    if not isinstance(value, Expr):
        raise ValueProblem("this result is not made of numbers")
    try:
        expression = parse(str(value))
        return expression if expression.names else expression.evaluate({})
    except ExpressionError:
        raise ValueProblem("this result is too long, or has no value, and cannot be compared") from None


def is_product(path: tuple[str, ...]) -> bool:
    """Whether a result is one product of inertia of a tensor of a document."""
    return path[-3:-2] in TENSORS and path[-2] != path[-1]


def size_beside(asked: Asked) -> float:
    """The size (SI) beside which what is asked may be rounding noise; 0 where none is known.

    It is that of the largest number of the array from which an entry is taken. A centre of mass is at the
    origin beside the radius of gyration.
    """
    if asked.report is None or not asked.path:
        return 0.0
    counted = {field.key for field in asked.report.fields if field.counts}
    found: Any = asked.report.tree()
    with suppress(TypeError, ValueError):  # where results are no numbers
        if "center_of_mass" in asked.path:
            return math.sqrt(np.abs(np.array(found["tensor"], dtype=float)).max() / float(found["mass"]))
        for k, step in enumerate(asked.path[1:], start=2):
            found = found[int(step)] if step.isdecimal() else found[step]
            if isinstance(found, list | np.ndarray) and ".".join(asked.path[1:k]) not in counted:
                return float(np.abs(np.array(found, dtype=float)).max(initial=0.0))
    return 0.0


def _points(asked: Asked, entries: Array) -> tuple[tuple[Point, ...], frozenset[str], int]:
    """Where a key is worked out, the names with values from the document, and at how many points they are so.

    Other values are random, and follow from the key and the question's name. Raises ValueProblem where the
    key has hardly any values.
    """
    names = frozenset[str]().union(*(e.names for e in entries.flat if isinstance(e, Expression)))
    if not names:
        return ({},), frozenset(), 1
    seed = sha256("\n".join([asked.name, *map(str, entries.flat)]).encode(errors="replace")).digest()
    chance = random.Random(seed)  # noqa: S311 - nobody gains by foretelling it without the key
    if asked.document is None:
        points = _with_values(entries, lambda: _in_question(asked, chance))
        return points, frozenset(), len(points)
    values = {} if _is_exact(asked) else asked.document.values
    given = {name: float(value) for name, value in values.items()}
    free = _with_values(entries, lambda: _in_document(asked, names, {}, chance))
    if names.isdisjoint(given):
        return free, frozenset(), len(free)
    known = _with_values(entries, lambda: _in_document(asked, names, given, chance))
    if names <= given.keys():
        known = known[:1]
    return (*known, *free), frozenset(given), len(known)


def _with_values(entries: Array, draw: Callable[[], Point]) -> tuple[Point, ...]:
    """Points at which all entries have values."""
    found: list[Point] = []
    for _ in range(TRIES):
        point = draw()
        if np.isfinite(worked(entries, [point])).all():
            found.append(point)
        if len(found) == POINTS:
            return tuple(found)
    raise ValueProblem("this has no value for most values of its symbols")


def _in_question(asked: Asked, chance: random.Random) -> Point:
    """Random values for the symbols of a question."""
    return {
        name: chance.uniform(LOW, HIGH) * (1 if sign == "positive" else chance.choice((-1, 1)))
        for name, sign in (asked.question.symbols or {}).items()
    }


def _is_exact(asked: Asked) -> bool:
    """Whether results are exact numbers, in which parameters with a value do not appear."""
    return asked.document is not None and asked.document.arithmetic.exact and asked.path[0] != "hamilton"


def _in_document(
    asked: Asked, names: frozenset[str], given: Mapping[str, float], chance: random.Random
) -> Point:
    """Random values for the parameters of a document, and for what else a key has, but for those `given`.

    Parameters that hang on others follow them. In exact results those that have a value appear with it.
    """
    assert asked.document is not None
    definitions, fixed = asked.document.definitions, _is_exact(asked)
    point = {name: chance.uniform(LOW, HIGH) for name in sorted(names | definitions.keys())} | dict(given)
    for name, definition in definitions.items():
        if definition is not None and name not in given and (definition.names or fixed):
            point[name] = value_at(definition, point)
    return point
