"""Answers of many numbers, judged entry by entry: vectors, matrices, and what tensors share."""

from __future__ import annotations

import math
import re
from collections import defaultdict
from collections.abc import Collection, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import Any, ClassVar

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import ValueProblem, shown
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.entries import (
    Entry,
    Right,
    Ruler,
    Same,
    computed,
    filled,
    is_constant,
    literal,
    shown_as,
)
from rigidcli.homework.lists import earlier_members, read_list
from rigidcli.homework.mistakes import OTHER_PRODUCTS, Arrays, of_tensor, of_vector, shared_factor
from rigidcli.homework.numbers import CONTRADICTION, ROUNDING, TypedNumber
from rigidcli.homework.question import Question
from rigidcli.homework.same import all_same

MOST_ENTRIES = 400  # the most entries of an answer: more than any matrix of a course has
# The ends of the names of components, in their order: `x`, `L_x`, `omega1`.
AXES = {name: k for names in ("xyz", "123456789") for k, name in enumerate(names)}


@dataclass(frozen=True, slots=True, eq=False)
class ArrayKey:
    """The right `entries`: floats in SI units, or trees.

    `labels` name the entries. Entries with the same label (Ixy and Iyx) are one component, right only if all
    are. Labels that are `counted` earn points.
    """

    question: Question
    path: tuple[str, ...]
    ruler: Ruler
    entries: Array
    labels: tuple[str, ...]
    counted: frozenset[str]

    @property
    def right(self) -> list[Right]:
        """The entries one after the other."""
        right: list[Right] = self.entries.ravel().tolist()
        return right

    def named(self, *values: int) -> frozenset[str]:
        """The labels of the entries that are one of these whole numbers."""
        both = zip(self.labels, self.right, strict=True)
        return frozenset(label for label, right in both if self.ruler.has_value(right, *values))


class ArrayKind(AnswerKind):
    """A kind of many numbers in `dimensions` (1 for a list, 2 for rows). `word` names an entry.

    Entries of a key with one of the values `uncounted` earn no points, as most matrices have them.
    """

    options = frozenset({"symbols", "unit", "numbers"})
    word: ClassVar[str]
    dimensions: ClassVar[int] = 1
    uncounted: ClassVar[tuple[int, ...]] = ()

    def table(self, answer: Tree) -> Array:
        """What was typed for each entry, as a list or by names. Raises Unreadable."""
        return row(read_list(answer))

    def labels(self, shape: tuple[int, ...]) -> tuple[str, ...]:
        return numbered(self.word, shape[0])

    def key(self, source: KeySource) -> ArrayKey:
        if source.report is None:
            table = self.table(source.value)
            ruler, entries = literal(source, table, self.labels(table.shape))
        else:
            ruler, entries = computed(source, source.value)
        if entries.ndim != self.dimensions or not entries.size:
            raise ValueProblem(f"this is no {self.name}: a vector is a list, a matrix a list of rows")
        labels = self.labels(entries.shape)
        key = ArrayKey(source.question, source.path, ruler, entries, labels, frozenset(labels))
        return replace(key, counted=key.counted - key.named(*self.uncounted) or key.counted)

    def read(self, key: ArrayKey, answer: Tree) -> ReadAnswer:
        table = self.shaped(key, self.table(answer))
        if isinstance(answer, str) and table.shape != key.entries.shape:
            # `10, 17,32` has three entries, or two of which one has a decimal comma.
            with suppress(Unreadable):
                other = self.shaped(key, self.table(re.sub(r",\s", "; ", answer)))
                table = other if other.shape == key.entries.shape else table
        if not self.fits(key, table.shape):
            words = f"{shown(answer)} as one entry" if table.size == 1 else how_many(table.shape)
            raise Unreadable("wrong_shape", f"read {words}, expected {how_many(key.entries.shape)}")
        cells: list[Tree] = table.ravel().tolist()
        entries = key.ruler.read(cells, self.labels(table.shape), key.right)
        doubts = filter(None, map(key.ruler.doubt, cells, entries))
        doubt = next(doubts, "") or (CONTRADICTION if self._contradicts(key, answer, entries) else "")
        read_as = _bracketed(filled(shown_as(entries), table.shape).tolist())
        return ReadAnswer(entries, read_as, doubt)

    def _contradicts(self, key: ArrayKey, answer: Tree, entries: Sequence[Entry]) -> bool:
        """Whether one member of a chain is right and the last one is not, or the other way round."""
        for member in earlier_members(answer):
            with suppress(Unreadable):
                table = self.shaped(key, self.table(member))
                if table.size > 1 and table.shape == key.entries.shape:
                    other = key.ruler.read(table.ravel().tolist(), self.labels(table.shape), key.right)
                    verdicts = [self.judge(key, each).verdict for each in (other, entries)]
                    if verdicts.count("correct") == 1:
                        return True
        return False

    def shaped(self, key: ArrayKey, table: Array) -> Array:
        """What was typed in the shape of the key, where another one says the same."""
        return table

    def fits(self, key: ArrayKey, shape: tuple[int, ...]) -> bool:
        """Whether an answer of this shape can be judged."""
        return shape == key.entries.shape

    def judge(self, key: ArrayKey, value: Sequence[Entry]) -> Outcome:
        """Score: right components, minus wrong ones that are not counted, such as zeros."""
        components = compared(key, value)
        wrong = {name for name, same in components.items() if same is False}
        if not wrong:
            return settled(key, value, components.values())
        right, zero = {name for name, same in components.items() if same is True}, key.named(0)
        earned = len(right & key.counted) - len(wrong - key.counted)
        if right <= zero != set(components):
            earned = 0  # where only zeros are right, nothing is
        return Outcome.earning(earned / len(key.counted), *self.said(key, value, wrong, partly=earned > 0))

    def said(
        self, key: ArrayKey, value: Sequence[Entry], wrong: Collection[str], *, partly: bool
    ) -> list[Finding]:
        """Feedback for the wrong places; `partly`: some points were earned."""
        off = [each for each in zip(key.labels, value, key.right, strict=True) if each[0] in wrong]
        if all(key.ruler.is_short(own, right) for _, own, right in off):
            return [Finding("too_few_sig_figs", listed(wrong) if partly else "")]
        plain = [name for name, own, right in off if is_constant(own) and not is_constant(right)]
        if plain and key.ruler.formulas and not key.ruler.formulas.numbers:
            return [Finding("number_for_symbol", listed(plain))]
        if partly:
            return [Finding("component_wrong", listed(wrong))]
        numbers = key.ruler.numbers(value), key.ruler.numbers(key.right)
        code = shared_factor(*numbers, key.ruler.unit, key.path, max(key.ruler.slack, ROUNDING))
        return [Finding(code or "outside_tolerance")]

    def mistakes(self, source: KeySource, key: ArrayKey) -> Arrays:
        """The entries that come out under a mistake."""
        return iter(())

    def mistaken(self, source: KeySource, key: ArrayKey) -> Iterator[tuple[str, ArrayKey]]:
        for code, entries in self.mistakes(source, key):
            yield code, replace(key, entries=key.ruler.entries(entries))

    def typed(self, key: ArrayKey) -> Tree:
        return filled(list(map(key.ruler.typed, key.right)), key.entries.shape).tolist()


def compared(key: ArrayKey, entries: Sequence[Entry]) -> dict[str, Same]:
    """Whether the components of an answer are right, by their names."""
    components = defaultdict[str, list[Same]](list)
    for name, own, right in zip(key.labels, entries, key.right, strict=True):
        components[name].append(key.ruler.same(own, right))
    return {name: all_same(several) for name, several in components.items()}


def settled(key: ArrayKey, entries: Sequence[Entry], compared: Iterable[Same] = ()) -> Outcome:
    """The outcome of an answer in which no entry is wrong."""
    if isinstance(why := all_same(compared), str):
        return Outcome.review(why)
    if key.question.unit == "required" and key.ruler.has_units and are_bare(entries):
        return Outcome.earning(0.0, Finding("unit_missing"))
    return Outcome.correct()


def are_bare(entries: Sequence[Entry]) -> bool:
    """Whether a number that is not zero lacks a unit."""
    return any(isinstance(each, TypedNumber) and each.unit is None and each.value != 0 for each in entries)


def listed(names: Iterable[str]) -> str:
    """Places in a message: the first few, and how many more."""
    names = sorted(set(names), key=lambda name: (len(name), name))
    more = f" and {len(names) - 6} more" if len(names) > 6 else ""
    return ("; " if "," in names[0] else ", ").join(names[:6]) + more


def how_many(shape: tuple[int, ...]) -> str:
    """A shape in words: `3 numbers`, `2 by 2 numbers`."""
    return " by ".join(map(str, shape)) + (" number" if shape == (1,) else " numbers")


def _bracketed(texts: list[Any]) -> str:
    return f"[{', '.join(each if isinstance(each, str) else _bracketed(each) for each in texts)}]"


# --- tables of what is typed


def row(answer: Tree) -> Array:
    """A list, a column, or a mapping from the names of components, as it was typed. Raises Unreadable."""
    if isinstance(answer, dict):
        expected = "a list, or `{x: .., y: .., z: ..}`"
        try:
            cells = by_places(answer, 1, len(answer), expected)
            answer = [cells[k,] for k in range(len(cells))]
        except Unreadable:
            if list(answer) != sorted(answer):  # as in `A=3, B=5, C=7`
                raise
            answer = list(answer.values())
    table = rows(answer, "a list of numbers")
    return table.ravel() if 1 in table.shape else table


def rows(answer: Tree, expected: str = "rows of the same length") -> Array:
    """A list of rows of one length, or one row, as it was typed. Raises Unreadable."""
    lines = answer if isinstance(answer, list) else []
    if not any(isinstance(line, list) for line in lines):
        lines = [lines]
    is_table = all(isinstance(line, list) for line in lines)
    cells = [cell for line in lines for cell in line] if is_table else []
    if not cells or len(set(map(len, lines))) > 1 or any(isinstance(cell, list | dict) for cell in cells):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected {expected}")
    if len(cells) > MOST_ENTRIES:
        raise Unreadable("too_large", f"expected at most {MOST_ENTRIES} numbers")
    return filled(cells, (len(lines), len(lines[0])))


def by_places(
    answer: dict[str, Tree], dimensions: int, size: int, expected: str
) -> dict[tuple[int, ...], Tree]:
    """The entries of a mapping by the places that the ends of their names say: `L_x`, `I12`."""
    places: dict[tuple[int, ...], Tree] = {}
    for name, entry in answer.items():
        ends = re.sub(r"[\s_{}()]", "", name).lower()[-dimensions:]
        place = tuple(AXES.get(end, size) for end in ends)
        if len(place) != dimensions or max(place) >= size:
            raise Unreadable("wrong_shape", f"read {shown(name)}, expected {expected}")
        if place in places:
            raise Unreadable("duplicate_key", f"read {shown(name)}")
        places[place] = entry
    return places


def numbered(word: str, count: int) -> tuple[str, ...]:
    """The names of the entries of a list."""
    return tuple(f"{word} {k}" for k in range(1, count + 1))


# --- vectors


class VectorKind(ArrayKind):
    """The components of a vector, or a direction alone."""

    name = "vector"
    options = ArrayKind.options | {"direction", "normalized"}
    word = "component"

    def key(self, source: KeySource) -> ArrayKey:
        key = super().key(source)
        if source.question.direction in ("sense", "parallel") and key.named(0) == set(key.labels):
            raise ValueProblem("a vector of length zero has no direction", path=("direction",))
        return key

    def shaped(self, key: ArrayKey, table: Array) -> Array:
        """A vector in a plane may have a third component, which is zero."""
        is_in_plane = table.shape == (3,) and key.entries.shape == (2,) and table[2] == "0"
        return table[:2] if is_in_plane else table

    def mistakes(self, source: KeySource, key: ArrayKey) -> Arrays:
        return of_vector(source, key.entries)

    def judge(self, key: ArrayKey, value: Sequence[Entry]) -> Outcome:
        """The outcome of a vector; a direction is right as a whole."""
        way, opposite = key.question.direction, replace(key, entries=-key.entries)
        if way in ("exact", "sign_free"):
            is_turned = way == "sign_free" and False not in compared(opposite, value).values()
            return super().judge(opposite if is_turned else key, value)
        if not _along(key, value):
            code = "sign_error" if _along(opposite, value) else "outside_tolerance"
            return Outcome.earning(0.0, Finding(code))
        if key.question.normalized == "required" and not has_unit_length(key.ruler, value):
            return Outcome.earning(0.0, Finding("axis_not_normalised"))
        return settled(key, value)


def _along(key: ArrayKey, entries: Sequence[Entry]) -> bool:
    """Whether a vector has the direction of the key, or where that is free the opposite, at all points.

    The angle is 2 atan2(|u - v|, |u + v|) of the unit vectors u and v, which is accurate at all angles
    (W. Kahan, How Futile are Mindless Assessments of Roundoff, section 12).
    """
    u, v = unit_vectors(key.ruler.numbers(entries)), unit_vectors(key.ruler.numbers(key.right))
    apart = 2 * np.arctan2(np.linalg.norm(u - v, axis=0), np.linalg.norm(u + v, axis=0))
    if key.question.direction == "parallel":
        apart = np.minimum(apart, math.pi - apart)
    return bool((apart <= key.ruler.angle).all())  # nan, where a vector has no direction, is above any angle


def unit_vectors(vectors: Floats) -> Floats:
    """Columns (n by k) made unit vectors; nan where one has no direction."""
    with np.errstate(all="ignore"):
        small = vectors / np.abs(vectors).max(axis=0)  # so that squares stay within floats
        return np.asarray(small / np.linalg.norm(small, axis=0))


def has_unit_length(ruler: Ruler, entries: Sequence[Entry]) -> bool:
    """Whether a vector has the length 1, at all points."""
    lengths = np.linalg.norm(ruler.numbers(entries), axis=0)
    return bool((np.abs(lengths - 1) <= ruler.angle).all())


# --- matrices


class MatrixKind(ArrayKind):
    """The entries of a matrix of any shape; zeros and ones, which stand by themselves, are not counted."""

    name = "matrix"
    dimensions = 2
    uncounted: ClassVar[tuple[int, ...]] = (0, 1)

    def table(self, answer: Tree) -> Array:
        return rows(read_list(answer, is_square=True))

    def labels(self, shape: tuple[int, ...]) -> tuple[str, ...]:
        return tuple(f"row {i + 1}, column {j + 1}" for i, j in np.ndindex(*shape))

    def shaped(self, key: ArrayKey, table: Array) -> Array:
        """A matrix may be written row after row in one line; `[1,2; 3,4]` holds no decimal commas."""
        cells = [cell.split(",") for cell in table.ravel() if isinstance(cell, str)]
        if table.size == 2 and key.entries.shape == (2, 2) and list(map(len, cells)) == [2, 2]:
            return filled([*cells[0], *cells[1]], (2, 2))
        is_in_line = len(table) == 1 and table.size == key.entries.size
        return table.reshape(key.entries.shape) if is_in_line else table

    def is_right(self, key: ArrayKey, value: Sequence[Entry]) -> bool:
        """Whether all entries are right: a mistake makes many keys, and the first wrong entry is enough."""
        return all(key.ruler.same(*both) is True for both in zip(value, key.right, strict=True))

    def mistakes(self, source: KeySource, key: ArrayKey) -> Arrays:
        """Where it is square, the matrix with rows and columns exchanged."""
        if key.entries.shape[0] == key.entries.shape[-1]:
            yield "transposed", key.entries.T


# --- inertia tensors: products of inertia have a minus sign, Ixy = -sum m x y, unless a question says `plus`

# The components of a tensor, row by row; those with mirror images stand twice.
COMPONENTS = ("Ixx", "Ixy", "Ixz", "Ixy", "Iyy", "Iyz", "Ixz", "Iyz", "Izz")


class TensorKind(MatrixKind):
    """An inertia tensor, 3 by 3 or by its six components; zeros are not counted."""

    name = "tensor"
    options = ArrayKind.options | {"products"}
    uncounted = (0,)

    def table(self, answer: Tree) -> Array:
        entries = read_list(answer, is_square=True)
        if not isinstance(entries, dict):
            return rows(entries)
        given = by_places(entries, 2, 3, ", ".join(dict.fromkeys(COMPONENTS)))
        given = {(j, i): entry for (i, j), entry in given.items()} | given  # Ixy stands for Iyx, too
        places = dict(zip(np.ndindex(3, 3), COMPONENTS, strict=True))
        if missing := [name for place, name in places.items() if place not in given]:
            raise Unreadable("wrong_shape", f"{listed(missing)} missing")
        return filled([given[place] for place in places], (3, 3))

    def labels(self, shape: tuple[int, ...]) -> tuple[str, ...]:
        if shape != (3, 3):
            raise ValueProblem("this is not a tensor, which has 3 rows of 3")
        return COMPONENTS

    def key(self, source: KeySource) -> ArrayKey:
        key = super().key(source)
        if source.report is not None:
            key = replace(key, entries=key.ruler.entries(np.asarray(source.value) * products(source)))
        if _odd(key.ruler, key.right):
            raise ValueProblem("this tensor is not symmetric")
        return key

    def mistakes(self, source: KeySource, key: ArrayKey) -> Arrays:
        signs = products(source)
        usual = key.entries * signs if source.report is None else np.asarray(source.value)
        yield from ((code, tensor * signs) for code, tensor in of_tensor(source, usual))
        yield from super().mistakes(source, key)

    def said(
        self, key: ArrayKey, value: Sequence[Entry], wrong: Collection[str], *, partly: bool
    ) -> list[Finding]:
        """What is said of a wrong tensor: first, that it is not symmetric."""
        odd = _odd(key.ruler, value)
        others = {*wrong}.difference(odd)
        first = [Finding("not_symmetric", listed(odd))] if odd else []
        return first + (super().said(key, value, others, partly=partly) if others else [])

    def typed(self, key: ArrayKey) -> Tree:
        return {name: key.ruler.typed(each) for name, each in zip(key.labels, key.right, strict=True)}


def products(source: KeySource) -> Array:
    """The signs (3 by 3) that products of inertia have in a question, beside the usual ones."""
    return OTHER_PRODUCTS if source.question.products == "plus" else OTHER_PRODUCTS**2


def _odd(ruler: Ruler, entries: Sequence[Any]) -> list[str]:
    """The components of a tensor that differ from those across the diagonal."""
    return [COMPONENTS[i] for i, j in ((1, 3), (2, 6), (5, 7)) if ruler.differ(entries[i], entries[j])]


# --- moments


class MomentsKind(ArrayKind):
    """Numbers in any order, or in ascending order: each stands as often as it occurs."""

    name = "moments"
    options = ArrayKind.options | {"order"}
    word = "moment"

    def key(self, source: KeySource) -> ArrayKey:
        key = super().key(source)
        if key.ruler.formulas is None:
            return replace(key, entries=np.sort(key.entries))
        require_no_order(source.question)
        return replace(key, entries=key.entries[_ranks(key.ruler, key.right)])

    def mistakes(self, source: KeySource, key: ArrayKey) -> Arrays:
        if source.report is None or source.path[-1] != "moments" or key.ruler.formulas is not None:
            return
        if (tensor := source.report.get("tensor")) is not None:
            for code, other in of_tensor(source, np.asarray(tensor, dtype=float)):
                yield code, np.linalg.eigvalsh(np.asarray(other, dtype=float))

    def table(self, answer: Tree) -> Array:
        """Moments may have any names, as `slow: 10, fast: 17`; numbers are no names."""
        entries = read_list(answer)
        try:
            return row(entries)
        except Unreadable:
            if not isinstance(entries, dict) or any(re.match(r"[-+.\d]", name) for name in entries):
                raise
            return row(list(entries.values()))

    def fits(self, key: ArrayKey, shape: tuple[int, ...]) -> bool:
        """Moments may be missing, or too many."""
        return len(shape) == 1 and shape[0] <= 2 * key.entries.size

    def judge(self, key: ArrayKey, value: Sequence[Entry]) -> Outcome:
        """The outcome of moments in the order of the key: right ones are paired first, the rest by size."""
        count, ranks = len(key.right), _ranks(key.ruler, value)
        partners = matched([[key.ruler.same(entry, right) for right in key.right] for entry in value], ranks)
        own = {place: k for k, place in partners.items()}
        if len(value) != count:
            zero = {place for place, right in enumerate(key.right) if key.ruler.has_value(right, 0)}
            # Where only zeros are right, nothing is.
            share = 0 if own.keys() <= zero and len(zero) < count else len(own)
            detail = f"read {how_many((len(value),))}, expected {count}"
            surplus = max(0, len(value) - count)
            return Outcome.earning((share - surplus) / count, Finding("wrong_shape", detail=detail))
        rest = (k for k in ranks if k not in partners)
        order = [own[place] if place in own else next(rest) for place in range(count)]
        labels = tuple(f"moment {k + 1}" for k in order)  # each is called by its place in the answer
        ordered = replace(key, labels=labels, counted=frozenset(labels))
        outcome = super().judge(ordered, [value[k] for k in order])
        in_place = [same is not False for same in compared(key, value).values()]
        if key.question.order == "free" or all(in_place) or outcome.share < 1:
            return outcome
        return Outcome.earning(sum(in_place) / count, Finding("wrong_order"))


def require_no_order(question: Question) -> None:
    """Raise ValueProblem where moments with symbols must be sorted."""
    if question.order == "ascending":
        raise ValueProblem("the order of the moments depends on their symbols", path=("order",))


def _ranks(ruler: Ruler, entries: Sequence[Any]) -> list[int]:
    ranks: list[int] = np.argsort(np.abs(ruler.numbers(entries)[:, 0]), kind="stable").tolist()
    return ranks


def matched(same: Sequence[Sequence[Same]], ranks: Sequence[int]) -> dict[int, int]:
    """The columns with which rows are the same, no column twice, by the rows.

    Rows in the order of their `ranks`, and columns, are ascending numbers. As tolerances ascend, too, nothing
    is lost if each row takes the first column that is left.
    """
    columns: dict[int, int] = {}
    for row in ranks:
        free = (k for k, each in enumerate(same[row]) if each is True and k not in columns.values())
        if (column := next(free, None)) is not None:
            columns[row] = column
    return columns
