"""Entries of answers that hold many numbers: how they are read, and when one is the same as that of the key.

An entry is a number in SI units, or where the key has symbols a tree. Every comparison of vectors, matrices,
tensors and axes is made of questions about single entries.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.check.base import Asked, Finding, Tree, Unreadable
from rigidcli.check.lists import read_list
from rigidcli.check.numbers import Number, as_typed, beside, is_right, is_short, read_number, share
from rigidcli.check.question import RELATIVE, Tolerance
from rigidcli.check.reading import Names, exactly, names_of, plain, read_expression
from rigidcli.check.same import same, values
from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.language import tree
from rigidcli.language.evaluation import real
from rigidcli.language.text import text

Entry: TypeAlias = Number | tree.Node
"""An entry of an answer: a number as it was typed, or a tree."""

Right: TypeAlias = float | tree.Node
"""An entry of a key: a number in SI units, or a tree."""

Same: TypeAlias = bool | str
"""Whether two entries are the same, or the reason why that is open."""

Cell: TypeAlias = tuple[str, Tree]
"""The name of a place, and what was typed there."""

Layout: TypeAlias = tuple[tuple[int, ...], list[Cell]]
"""The shape of an answer, and its cells row by row."""

NOISE = 1e-12
"""A number below this, in units of the largest beside it, is zero but for rounding."""

EXACT = 1e-9
"""How far numbers that should be the same may be apart by rounding, relative to their size."""

MOST_ENTRIES = 400
"""The most entries of an answer: more than any matrix of a course has."""

WIDEST = 0.05
"""The largest angle (rad) that a relative tolerance leaves to a direction: beyond, axes would be mixed up."""

COMMA = "a comma may be a decimal comma, or separate thousands"


@dataclass(frozen=True, slots=True, eq=False)
class Ruler:
    """By what the entries of the question called `name` are read and compared.

    Numbers without a unit are in `unit`. `names` are the symbols; it is None where all entries are numbers.
    A reference that is zero is measured by the `largest` number (SI) beside it. Where `numbers_allowed` says
    so, the values of a document may stand for its symbols.
    """

    name: str
    tolerance: Tolerance
    unit: Unit | None = None
    names: Names | None = None
    largest: float = 0.0
    numbers_allowed: bool = False

    def read(self, typed: Tree, place: str = "") -> Entry:
        """An entry of an answer. Raises Unreadable."""
        if self.names is None:
            return read_number(typed, self.unit, place)
        return read_expression(typed, self.names, place)

    def same(self, entry: Entry, right: Right) -> Same:
        """Whether an entry is that of the key."""
        if self.names is not None:
            assert not isinstance(entry, Number)
            assert not isinstance(right, float)
            found = same(entry, right, self.names, self.name)
            if found is not False or not self.numbers_allowed:
                return found
            own, key = (
                tree.bound(self.names.without_derived(each), self.names.values) for each in (entry, right)
            )
            return same(own, key, self.names, self.name)
        assert isinstance(entry, Number)
        assert isinstance(right, float)
        if is_right(entry, right, self.tolerance, self.largest):
            return True
        grouped = None if entry.thousands is None else replace(entry, value=entry.thousands)
        return COMMA if grouped and is_right(grouped, right, self.tolerance, self.largest) else False

    def is_short(self, entry: Number, right: Right) -> bool:
        """Whether an entry is that of the key, rounded to one figure less than is asked."""
        return isinstance(right, float) and is_short(entry, right, self.tolerance, self.largest)

    def differ(self, one: Entry | Right, other: Entry | Right) -> bool:
        """Whether two entries of one answer, or of one key, are certainly not the same."""
        if self.names is not None:
            return same(one, other, self.names, self.name) is False  # type: ignore[arg-type]  # they are trees
        first, second = self.numbers([one, other])[:, 0].tolist()
        allowed = self.slack * max(abs(first), abs(second)) + EXACT * self.largest
        return bool(abs(first - second) > allowed)

    def are_zero(self, entries: Iterable[Right], besides: int = 0) -> list[bool]:
        """Which entries of the key are zero, or another whole number."""
        return [
            abs(each - besides) <= NOISE * self.largest
            if isinstance(each, float)
            else isinstance(each, tree.Number) and each.value == besides
            for each in entries
        ]

    def vanish(self, trees: Iterable[tree.Node]) -> Same:
        """Whether all trees are zero."""
        assert self.names is not None
        found = [same(node, NOTHING, self.names, self.name) for node in trees]
        if False in found:
            return False
        return next((each for each in found if isinstance(each, str)), True)

    def numbers(self, entries: Iterable[Entry | Right]) -> Floats:
        """Entries (n) as SI numbers (n by 1), trees by their values at some points (n by k); NaN for none."""
        rows = [self._numbers(entry) for entry in entries]
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1 if rows else 1)

    def _numbers(self, entry: Entry | Right) -> list[float]:
        if isinstance(entry, Number | float):
            return [entry.value if isinstance(entry, Number) else entry]
        assert self.names is not None
        return [
            math.nan if ball is None else float(ball.mid()) for ball in values(entry, self.names, self.name)
        ]

    def entries(self, value: Any) -> Array:
        """An array of numbers, exact numbers or trees as entries of a key. Raises ValueProblem."""
        array = np.asarray(value, dtype=object)
        found = [_entry(each) for each in array.flat]
        if self.names is None:
            return measured(self, np.array(list(map(_value, found))).reshape(array.shape))[1]
        return filled([exactly(each) if isinstance(each, float) else each for each in found], array.shape)

    def symbols(self, entries: Iterable[Right]) -> frozenset[str]:
        """The symbols in entries of a key."""
        return frozenset(
            name for each in entries if not isinstance(each, float) for name in tree.names_in(each)
        )

    @property
    def slack(self) -> float:
        """The tolerance as a share of a number."""
        figures = self.tolerance.significant_figures
        return max(share(self.tolerance), 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures))

    @property
    def angle(self) -> float:
        """The angle (rad) by which a direction may be off: what rounding of its components comes to."""
        return self.tolerance.angle or min(self.slack or RELATIVE, WIDEST)

    @property
    def has_units(self) -> bool:
        """Whether numbers have units here: angles are pure numbers, and symbols bring units of their own."""
        return self.unit is not None and self.unit.dimension not in (DIMENSIONLESS, ANGLE)


NOTHING = tree.Number("0", 0.0)


# --- reading


def opened(answer: Tree) -> Tree:
    """The list, table or mapping that was typed, with its factor and its unit moved into each entry."""
    listed = read_list(answer)

    def moved(entry: Tree) -> Tree:
        if isinstance(entry, list):
            return [moved(each) for each in entry]
        if isinstance(entry, dict):
            return {name: moved(each) for name, each in entry.items()}
        typed = f"({listed.factor})*({entry})" if listed.factor else entry
        return f"{typed} {listed.unit}" if listed.unit else typed

    return moved(listed.entries)


def read_cells(ruler: Ruler, cells: Sequence[Cell]) -> tuple[Entry, ...]:
    """The entries of cells. Raises Unreadable with all that cannot be read, a repeated problem once."""
    read, problems = list[Entry](), dict[tuple[str, str], Finding]()
    for place, typed in cells:
        try:
            read.append(ruler.read(typed, place))
        except Unreadable as unreadable:
            for each in unreadable.findings:
                problems.setdefault((each.code, each.detail), each)
    if problems:
        first, *others = problems.values()
        raise Unreadable(first.code, first.detail, place=first.place, also=tuple(others))
    return tuple(read)


def shown_as(entries: Iterable[Entry]) -> list[str]:
    """How entries were read."""
    return [entry.read_as if isinstance(entry, Number) else plain(entry) for entry in entries]


def is_constant(entry: Entry | Right) -> bool:
    """Whether an entry has no symbols."""
    return isinstance(entry, Number | float) or not tree.names_in(entry)


# --- keys


def literal(asked: Asked, layout: Callable[[Tree], Layout]) -> tuple[Ruler, Array]:
    """The ruler and the entries of a literal key, laid out as answers are. Raises Unreadable."""
    shape, cells = layout(asked.value)
    ruler = Ruler(asked.name, asked.question.tolerance)
    try:
        numbers = [as_typed(typed, place=place) for place, typed in cells]
    except Unreadable:
        trees = (
            [] if asked.question.symbols else [read_expression(typed, None, place) for place, typed in cells]
        )
        ruler = replace(ruler, names=names_of(asked, ruler.symbols(trees)))
        return ruler, filled(read_cells(ruler, cells), shape)
    unit = next((each.unit for each in numbers if each.unit is not None), None)
    read = (read_number(typed, unit, place).value for place, typed in cells)
    return measured(replace(ruler, unit=unit), np.array(list(read)).reshape(shape))


def computed(asked: Asked, value: Any) -> tuple[Ruler, Array]:
    """The ruler and the entries of a result. Raises ValueProblem."""
    ruler = Ruler(asked.name, asked.question.tolerance)
    array = np.asarray(value, dtype=object)
    used = ruler.symbols(_entry(each) for each in array.flat)
    if used:
        allowed = asked.question.numbers == "allowed"
        ruler = replace(ruler, names=names_of(asked, used), numbers_allowed=allowed)
        return ruler, ruler.entries(value)
    unit = parse_unit(asked.unit) if asked.unit else None
    return measured(replace(ruler, unit=unit), ruler.entries(value), beside(asked))


def measured(ruler: Ruler, entries: Floats, beside: float = 0.0) -> tuple[Ruler, Floats]:
    """The ruler that knows the largest of these numbers, and the numbers without rounding noise."""
    largest = float(np.abs(entries).max(initial=beside))
    return replace(ruler, largest=largest), np.where(np.abs(entries) <= NOISE * largest, 0.0, entries)


def _entry(value: Any) -> Right:
    """A number, exact number or tree as an entry. Raises ValueProblem for what is none of them."""
    if isinstance(value, Expr):
        return to_tree(value)
    if isinstance(value, tree.Node):
        return NOTHING if value == tree.ZERO else value
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise ValueProblem("this result is not made of numbers")
    return float(value)


def _value(entry: Right) -> float:
    try:
        return entry if isinstance(entry, float) else real(entry, {})
    except ExpressionError:
        raise ValueProblem("this result has no value, and cannot be compared") from None


def filled(entries: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Entries as an array of objects: a tree is no sequence."""
    array = np.empty(len(entries), dtype=object)
    array[:] = entries
    return array.reshape(shape)


def typed_as(ruler: Ruler, entry: Right) -> str:
    """An entry of a key as a student would type it, with all digits."""
    if not isinstance(entry, float):
        return text(entry)
    return repr(entry) if ruler.unit is None else f"{entry / ruler.unit.scale!r} {ruler.unit.text}"
