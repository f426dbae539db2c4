"""Entries of answers that hold many numbers: how they are read, and when one is the same as that of the key.

An entry is a number in SI units, or where the key has symbols a tree. Every comparison of vectors, matrices,
tensors and axes is made of questions about single entries.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Collection, Iterable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, TypeAlias, TypeVar

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.units import Unit, parse_unit
from rigidcli.homework.base import Finding, KeySource, Tree, Unreadable
from rigidcli.homework.numbers import (
    CONTRADICTION,
    ROUNDING,
    SLIP,
    TypedNumber,
    in_dimension,
    is_product_in,
    no_name,
    read_numbers,
    readings_of,
    too_uncertain,
)
from rigidcli.homework.question import RELATIVE, Tolerance
from rigidcli.homework.reading import Names, exactly, names_of, read_expression, read_expressions
from rigidcli.homework.same import FormulaComparison, formulas_of
from rigidcli.language import tree
from rigidcli.language.expression import real
from rigidcli.language.latex import plain
from rigidcli.language.text import text, without_doubt
from rigidcli.language.typed import SECOND_NAME, TWO_ANSWERS, is_name, last_member, undecorated

Entry: TypeAlias = TypedNumber | tree.Node  # an entry of an answer: a number as it was typed, or a tree
Right: TypeAlias = float | tree.Node  # an entry of a key: a number in SI units, or a tree
Same: TypeAlias = bool | str  # whether two entries are the same, or the reason why that is open
NOISE_OF_ENTRIES = 1e-12  # a number below this, in units of the largest beside it, is zero but for rounding
# The largest angle (rad) that a relative tolerance leaves to a direction: beyond, axes would be mixed up.
WIDEST = 0.05
T = TypeVar("T")


def chosen(readings: Sequence[T], same: Callable[[T], Same]) -> T:
    """The reading that is right, else the first of which that is open, else the most usual one."""
    open_: list[T] = []
    for each in readings if len(readings) > 1 else ():
        truth = same(each)
        if truth is True:
            return each
        open_ += [each] if truth else []
    return [*open_, *readings][0]


@dataclass(frozen=True, slots=True, eq=False)
class Ruler:
    """Unit, tolerance and symbols with which the entries of a question are read and compared.

    Numbers without a unit are in `unit`. A reference that is zero is measured by the `largest` number (SI)
    beside it, and may be off by the `noise` (SI) of rounding. `formulas` is None where all are numbers.
    """

    tolerance: Tolerance
    unit: Unit | None = None
    formulas: FormulaComparison | None = None
    largest: float = 0.0
    noise: float = 0.0

    def read(
        self, cells: Iterable[Tree], places: Sequence[str], right: Sequence[Right] = ()
    ) -> tuple[Entry, ...]:
        """The entries that were typed in these places, of several readings one that is `right` somewhere.

        A unit behind the last number alone is that of all: `1, 2, 3 kg m^2`. Raises Unreadable with all that
        cannot be read, a repeated problem once.
        """
        entries, problems, cells = list[Entry](), dict[tuple[str, str], Finding](), list(cells)
        ruler = self.with_unit_of_last(cells)
        for count, (place, typed) in enumerate(zip(places, cells, strict=True)):
            try:
                several = ruler.readings(typed, place)
                near = [*right[count : count + 1], *right]
                entries.append(chosen(several, lambda each: any(self.same(each, r) is True for r in near)))  # noqa: B023
            except Unreadable as unreadable:
                for finding in unreadable.findings:
                    problems.setdefault((finding.code, finding.detail), finding)
        if problems:
            first, *others = problems.values()
            raise Unreadable(first.code, first.detail, place=first.place, also=tuple(others))
        return tuple(entries)

    def with_unit_of_last(self, cells: Sequence[Tree]) -> Ruler:
        """The ruler for numbers in the unit of the last of these, if no other one has a unit."""
        if self.formulas is None and len(cells) > 1:
            with suppress(Unreadable, ValueProblem):
                *others, last = (readings_of(cell)[0] for cell in cells)
                if last.unit is not None and not any(each.unit for each in others):
                    in_dimension(last, self.unit)
                    return replace(self, unit=last.unit)
        return self

    def readings(self, typed: Tree, place: str = "") -> Sequence[Entry]:
        """The readings of an entry. Raises Unreadable."""
        if self.formulas is None:
            return read_numbers(typed, self.unit, place)
        return read_expressions(typed, self.formulas.names, place)

    def doubt(self, typed: Tree, entry: Entry) -> str:
        """Why a person must look at an entry as it was read, or at a chain of equalities in its place.

        Raises Unreadable.
        """
        if self.may_be_a_slip(entry):
            return SLIP
        if isinstance(entry, TypedNumber) and (uncertain := too_uncertain(typed)):
            return uncertain
        if not re.search(r"[=≈≃]|\\approx", str(typed)):
            return ""

        for place, member in enumerate(last_member(plain(undecorated(str(typed))))[1]):
            own, shorter = self._values(member), SECOND_NAME.sub("", member)
            second = self._values(shorter) if place and shorter != member else []
            # the name behind it begins another answer, unless it is a unit of the same number
            if second and own in ([], second) and not self._is_among(second, entry):
                raise Unreadable("wrong_shape", TWO_ANSWERS)
            if own and not self._is_among(own, entry):
                return CONTRADICTION
            is_meant = is_name(member) or (self.unit is not None and is_product_in(member, self.unit))
            if not own and place == 0 and member.strip() and not is_meant:
                return no_name(member)
        return ""

    def _values(self, member: str) -> Sequence[Entry]:
        """The readings of a member of a chain of equalities; none where it has none."""
        with suppress(Unreadable):
            return self.readings(member)
        return []

    def _is_among(self, others: Sequence[Entry], entry: Entry) -> bool:
        """Whether one of these readings may be the entry; a name that does not occur in it only names it."""
        if isinstance(entry, TypedNumber):
            numbers = [each for each in others if isinstance(each, TypedNumber)]
            sure = [each.value for each in numbers if not self.may_be_a_slip(each)]
            return any(self.is_near(value, entry.value, entry.scale) for value in sure)
        used = tree.names_in(entry)
        only_names = any(isinstance(each, tree.Name) and each.name not in used for each in others)
        return only_names or not all(self.differ(each, entry) for each in others)

    def may_be_a_slip(self, entry: Entry) -> bool:
        """Whether a number is right only as one of thousands, in another unit than the one that is asked."""
        asked = 1.0 if self.unit is None else self.unit.scale
        return isinstance(entry, TypedNumber) and entry.may_be_a_slip(asked)

    def margin(self, reference: float, scale: float = 1.0) -> float:
        """How far (SI) a number may be from a reference: the largest of what the tolerance allows.

        Significant figures count in the unit of the answer, which is `scale` in SI units.
        """
        size, figures = abs(reference) or self.largest, self.tolerance.significant_figures
        allowed = max(self.relative * size, self.tolerance.absolute or 0.0, 0.0 if reference else self.noise)
        if figures is not None and size:
            power = math.floor(math.log10(size / scale) + ROUNDING) + 1 - figures
            allowed = max(allowed, 0.5 * 10.0**power * scale)
        return allowed * (1 + ROUNDING)

    def is_near(self, value: float, reference: float, scale: float = 1.0) -> bool:
        """Whether an SI value is within the tolerance; its unit as typed is `scale` in SI units."""
        return abs(value - reference) <= self.margin(reference, scale)

    def too_few(self, number: TypedNumber) -> bool:
        """Whether a decimal number has fewer significant figures than are asked for; zero needs none."""
        asked = self.tolerance.significant_figures
        return asked is not None and 0 < number.figures < asked and number.value != 0

    def same(self, entry: Entry, right: Right) -> Same:
        """Whether an entry is that of the key."""
        if isinstance(right, tree.Node):
            assert self.formulas is not None
            assert isinstance(entry, tree.Node)
            return self.formulas.same(entry, right)
        assert isinstance(entry, TypedNumber)
        if self.too_few(entry):
            return False
        return self.is_near(entry.value, right, entry.scale)

    def is_short(self, entry: Entry, right: Right) -> bool:
        """Whether an entry is the number of the key, rounded to one figure less than is asked."""
        figures = (self.tolerance.significant_figures or 1) - 1
        if not isinstance(entry, TypedNumber) or not 0 < figures == entry.figures:
            return False
        fewer = replace(self, tolerance=Tolerance(significant_figures=figures))
        return fewer.same(entry, right) is True

    def differ(self, one: Entry | Right, other: Entry | Right) -> bool:
        """Whether two entries of one answer, or of one key, are certainly not the same."""
        if isinstance(one, tree.Node) and isinstance(other, tree.Node):
            return self.formulas is not None and self.formulas.same(one, other) is False
        first, second = self.numbers([one, other])[:, 0].tolist()
        allowed = self.slack * max(abs(first), abs(second)) + ROUNDING * self.largest
        return bool(abs(first - second) > allowed)

    def has_value(self, right: Right, *values: int) -> bool:
        """Whether an entry of the key is one of these numbers, but for rounding."""
        if isinstance(right, float):
            return any(abs(right - value) <= NOISE_OF_ENTRIES * self.largest for value in values)
        return isinstance(right, tree.Number) and right.value in values

    def numbers(self, entries: Iterable[Entry | Right]) -> Floats:
        """Entries (n) as SI numbers (n by 1), trees by their values at some points (n by k); NaN for none."""
        rows = list[list[float]]()
        for entry in entries:
            if isinstance(entry, TypedNumber | float):
                rows.append([entry.value if isinstance(entry, TypedNumber) else entry])
            else:
                balls = self.formulas.values(entry) if self.formulas else []
                rows.append([math.nan if ball is None else float(ball.mid()) for ball in balls])
        return np.array(rows, dtype=np.float64).reshape(len(rows), -1 if rows else 1)

    def entries(self, value: Any) -> Array:
        """An array of numbers, exact numbers or trees as entries of a key. Raises ValueProblem."""
        array = np.asarray(value, dtype=object)
        entries = [_entry(each) for each in array.flat]
        if self.formulas is None:
            numbers = np.array(list(map(value_of, entries))).reshape(array.shape)
            largest = max(self.largest, float(np.abs(numbers).max(initial=0.0)))
            return np.where(np.abs(numbers) <= NOISE_OF_ENTRIES * largest, 0.0, numbers)
        return filled([exactly(each) if isinstance(each, float) else each for each in entries], array.shape)

    def typed(self, right: Right) -> str:
        """An entry of a key as a student would type it, with all digits."""
        if not isinstance(right, float):
            return text(right)
        return repr(right) if self.unit is None else f"{right / self.unit.scale!r} {self.unit.text}"

    @property
    def relative(self) -> float:
        """The relative tolerance, which holds where no other is given."""
        others = self.tolerance.absolute, self.tolerance.significant_figures
        return self.tolerance.relative or (RELATIVE if {self.tolerance.relative, *others} == {None} else 0.0)

    @property
    def slack(self) -> float:
        """The tolerance as a share of a number."""
        figures = self.tolerance.significant_figures
        return max(self.relative, 0.0 if figures is None else 0.5 * 10.0 ** (1 - figures))

    @property
    def angle(self) -> float:
        """The angle (rad) by which a direction may be off: what rounding of its components comes to."""
        return self.tolerance.angle or min(self.slack or RELATIVE, WIDEST)

    @property
    def has_units(self) -> bool:
        """Whether numbers have units here: angles are pure numbers, and symbols bring units of their own."""
        return self.unit is not None and self.unit.dimension not in (DIMENSIONLESS, ANGLE)


def shown_as(entries: Iterable[Entry]) -> list[str]:
    """The entries as they were read, in words for the student."""
    return [entry.read_as if isinstance(entry, TypedNumber) else without_doubt(entry) for entry in entries]


def is_constant(entry: Entry | Right) -> bool:
    """Whether an entry has no symbols."""
    return isinstance(entry, TypedNumber | float) or not tree.names_in(entry)


# --- keys


def literal(source: KeySource, table: Array, places: Sequence[str]) -> tuple[Ruler, Array]:
    """The ruler and the entries of a literal key, of a table of what is typed. Raises Unreadable."""
    cells = table.ravel().tolist()
    ruler, listed = Ruler(source.question.tolerance), source.question.symbols
    try:
        if listed and any(_holds(listed, cell, names_of(source)) for cell in cells):
            raise Unreadable("not_a_number")
        units = [each.unit for cell in cells if (each := readings_of(cell)[0]).unit is not None]
    except Unreadable:
        pairs = () if listed else zip(cells, places, strict=True)
        ruler = _with_symbols(ruler, source, [read_expression(cell, None, place) for cell, place in pairs])
        return ruler, filled(ruler.read(cells, places), table.shape)
    ruler = replace(ruler, unit=units[0] if units else None)
    return _measured(ruler, ruler.numbers(ruler.read(cells, places)).reshape(table.shape))


def _holds(listed: Collection[str], cell: Tree, names: Names) -> bool:
    """Whether an entry holds a letter that the question lists, though it may be a unit, too: `2 m`."""
    with suppress(Unreadable):
        return not tree.names_in(read_expression(cell, names)).isdisjoint(listed)
    return False


def computed(source: KeySource, value: Any) -> tuple[Ruler, Array]:
    """The ruler and the entries of a result. Raises ValueProblem."""
    entries = [_entry(each) for each in np.asarray(value, dtype=object).flat]
    ruler = Ruler(source.question.tolerance)
    if not all(map(is_constant, entries)):
        ruler = _with_symbols(ruler, source, [each for each in entries if isinstance(each, tree.Node)])
        return ruler, ruler.entries(value)
    ruler = replace(ruler, unit=parse_unit(source.unit) if source.unit else None, largest=beside(source))
    return _measured(ruler, value)


def _measured(ruler: Ruler, value: Any) -> tuple[Ruler, Array]:
    """The ruler with the largest of these numbers, and the numbers without rounding noise."""
    entries = ruler.entries(value)
    return replace(ruler, largest=float(np.abs(entries).max(initial=ruler.largest))), entries


def _with_symbols(ruler: Ruler, source: KeySource, trees: Iterable[tree.Node]) -> Ruler:
    """The ruler for entries with symbols, those of the question or of the key."""
    used = {name for node in trees for name in tree.names_in(node)}
    return replace(ruler, formulas=formulas_of(source, names_of(source, used)))


def beside(source: KeySource) -> float:
    """The largest number (SI) of the array that is asked, or whose entry is asked; 0 if there is none.

    A centre of mass may be at the origin, beside the radius of gyration.
    """
    result: Any = None if source.report is None else source.report.tree
    with suppress(TypeError, ValueError, KeyError, IndexError, ZeroDivisionError):  # it has no numbers
        if "center_of_mass" in source.path:
            return math.sqrt(np.abs(np.array(result["tensor"], dtype=float)).max() / float(result["mass"]))
        for step in source.path[1:]:
            result = result[step]
            if isinstance(result, list | np.ndarray):
                return float(np.abs(np.array(result, dtype=float)).max(initial=0.0))
    return 0.0


def _entry(value: Any) -> Right:
    """A number, exact number or tree as an entry. Raises ValueProblem for what is none of them."""
    if isinstance(value, Expr):
        return to_tree(value)
    if isinstance(value, tree.Node):
        return tree.Number("0", 0.0) if value == tree.ZERO else value
    if isinstance(value, bool) or not isinstance(value, int | float | np.number) or not math.isfinite(value):
        raise ValueProblem("this result is not made of numbers")
    return float(value)


def value_of(result: Any) -> float:
    """The number that a result is. Raises ValueProblem."""
    entry = _entry(result)
    try:
        return entry if isinstance(entry, float) else real(entry, {})
    except ExpressionError:
        raise ValueProblem("this result has no value, and cannot be compared") from None


def filled(entries: Sequence[Any], shape: tuple[int, ...]) -> Array:
    """Entries as an array of objects: a tree is no sequence."""
    array = np.empty(len(entries), dtype=object)
    array[:] = entries
    return array.reshape(shape)
