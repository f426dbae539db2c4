"""Answers of many numbers, entry by entry: vectors and matrices, and what tensors and moments share."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import permutations
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from rigidcli.check.base import (
    Asked,
    Finding,
    Kind,
    Outcome,
    Reading,
    Tree,
    Unreadable,
    correct,
    earning,
    review,
)
from rigidcli.check.entries import (
    EXACT,
    MOST_ENTRIES,
    NOISE,
    Cell,
    Entry,
    Layout,
    Right,
    Ruler,
    Same,
    computed,
    is_constant,
    literal,
    opened,
    read_cells,
    shown_as,
    typed_as,
)
from rigidcli.check.factors import common_factor
from rigidcli.check.numbers import Number, is_right
from rigidcli.check.question import Question, Tolerance
from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import ValueProblem, shown

MOST_PLACES = 6
"""The most wrong entries that one message names."""

AXES = {name: k for names in ("xyz", "123456789") for k, name in enumerate(names)}
"""The ends of the names of components, in their order: `x`, `L_x`, `omega1`."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The right `entries`: floats in SI units, or trees. `mistaken` has others, with the codes of mistakes.

    `labels` name the entries; those that are `counted` earn points.
    """

    question: Question
    path: tuple[str, ...]
    ruler: Ruler
    entries: Array
    labels: tuple[str, ...] = ()
    counted: tuple[bool, ...] = ()
    mistaken: tuple[tuple[str, Array], ...] = ()

    @property
    def right(self) -> list[Right]:
        """The entries one after the other."""
        found: list[Right] = self.entries.ravel().tolist()
        return found

    @property
    def needs_units(self) -> bool:
        """Whether numbers must have a unit."""
        return self.question.unit == "required" and self.ruler.has_units


class Arrays(Kind):
    """A kind of many numbers. `word` names an entry in a message."""

    options: ClassVar[frozenset[str]] = frozenset({"symbols", "unit", "numbers"})
    word: ClassVar[str] = "entry"

    def layout(self, answer: Tree) -> Layout:
        """The shape of an answer, and its cells row by row. Raises Unreadable."""
        return row(answer, self.word)

    def _laid_out(self, answer: Tree) -> Layout:
        return self.layout(opened(answer))

    def key(self, asked: Asked) -> Key:
        """The key of a question, literal or computed. Raises ValueProblem."""
        is_literal = asked.report is None
        ruler, entries = literal(asked, self._laid_out) if is_literal else computed(asked, asked.value)
        size = entries.size
        labels = tuple(f"{self.word} {k + 1}" for k in range(size))
        return Key(asked.question, asked.path, ruler, entries, labels, (True,) * size)

    def read(self, key: Key, answer: Tree, folder: Path) -> Reading:
        """The entries of an answer of the shape that is asked. Raises Unreadable."""
        shape, cells = self._laid_out(answer)
        if not self.fits(key, shape):
            sizes = (" by ".join(map(str, each)) for each in (shape, key.entries.shape))
            raise Unreadable("wrong_shape", "read {} entries, expected {}".format(*sizes))
        entries = read_cells(key.ruler, cells)
        return Reading(entries, _shown(self.arranged(shown_as(entries), shape)))

    def fits(self, key: Key, shape: tuple[int, ...]) -> bool:
        """Whether an answer of this shape can be judged."""
        return shape == key.entries.shape

    def arranged(self, entries: list[Any], shape: tuple[int, ...]) -> list[Any]:
        """Entries in rows, where there are rows."""
        return nested(entries, shape)

    def judge(self, key: Key, value: Sequence[Entry]) -> Outcome:
        """The outcome of an answer, entry by entry."""
        found = self.compared(key, value)
        if False not in found:
            return settled(key, value, found)
        right = [same is True for same in found]
        zero = key.ruler.are_zero(key.right)
        earned = sum(same and counts for same, counts in zip(right, key.counted, strict=True))
        earned -= sum(same is False and not counts for same, counts in zip(found, key.counted, strict=True))
        if not any(same and not nothing for same, nothing in zip(right, zero, strict=True)):
            earned *= all(zero)  # where only zeros are right, nothing is
        wrong = [k for k, same in enumerate(found) if same is False]
        return earning(earned / sum(key.counted), *self.said(key, value, wrong, partly=earned > 0))

    def compared(self, key: Key, entries: Sequence[Entry]) -> list[Same]:
        """Whether each entry of an answer is right."""
        return [key.ruler.same(own, right) for own, right in zip(entries, key.right, strict=True)]

    def said(self, key: Key, entries: Sequence[Entry], wrong: list[int], *, partly: bool) -> list[Finding]:
        """What is said of an answer with wrong entries, of which others are right `partly`."""
        right = key.right
        if all(_is_short(key, entries[k], right[k]) for k in wrong):
            return [Finding("too_few_sig_figs", named(key, wrong) if partly else "")]
        plain = [k for k in wrong if is_constant(entries[k]) and not is_constant(right[k])]
        if plain and not key.ruler.numbers_allowed:
            return [Finding("number_for_symbol", named(key, plain))]
        if partly:
            return [Finding("component_wrong", named(key, wrong))]
        code = factor(key.ruler, key.path, key.ruler.numbers(entries), key.ruler.numbers(right))
        return [Finding(code or "outside_tolerance")]

    def typed(self, key: Key) -> Tree:
        """The key with all digits, each entry with its unit."""
        return nested([typed_as(key.ruler, entry) for entry in key.right], key.entries.shape)

    def names(self, key: Key) -> frozenset[str]:
        """The symbols of the key."""
        return key.ruler.symbols(key.right)


def settled(key: Key, entries: Sequence[Entry], found: Sequence[Same]) -> Outcome:
    """The outcome of an answer in which no entry is wrong."""
    for same in found:
        if isinstance(same, str):
            return review(same)
    return earning(0.0, Finding("unit_missing")) if key.needs_units and are_bare(entries) else correct()


def are_bare(entries: Sequence[Entry]) -> bool:
    """Whether a number that is not zero lacks a unit."""
    return any(isinstance(each, Number) and each.unit is None and each.value != 0 for each in entries)


def named(key: Key, places: Sequence[int]) -> str:
    """Places in a message: the first few, and how many more."""
    names = [key.labels[place] for place in places]
    more = f" and {len(names) - MOST_PLACES} more" if len(names) > MOST_PLACES else ""
    return ("; " if "," in names[0] else ", ").join(names[:MOST_PLACES]) + more


def factor(ruler: Ruler, path: tuple[str, ...], own: Floats, expected: Floats) -> str | None:
    """The code of the one factor by which all entries (n by k) are wrong; None where there is none."""
    used, slack = np.abs(expected) > NOISE * np.abs(expected).max(), max(ruler.slack, EXACT)
    if not used.any():
        return None
    with np.errstate(all="ignore"):
        ratios = (own / expected)[used]
        middle = float((ratios.min() + ratios.max()) / 2)
        is_shared = bool((np.abs(ratios / middle - 1) <= slack).all())
        zeros = bool((np.abs(own[~used]) <= slack * np.abs(own).max()).all())
    if not (math.isfinite(middle) and is_shared and zeros) or abs(middle - 1) <= slack:
        return None
    sizes = np.abs(expected[used])
    # Of entries of different sizes any shared factor is one; of one number it may be anything.
    differ = sizes.max() > sizes.min() * (1 + 2 * slack)
    return common_factor(middle, ruler.unit, path, slack) or ("constant_factor" if differ else None)


def _is_short(key: Key, entry: Entry, right: Right) -> bool:
    """Whether a number is that of the key, rounded to one figure less than is asked."""
    figures = (key.ruler.tolerance.significant_figures or 1) - 1
    if not figures or not isinstance(entry, Number) or entry.figures != figures:
        return False
    assert isinstance(right, float)
    return is_right(entry, right, Tolerance(significant_figures=figures), key.ruler.largest)


def nested(entries: list[Any], shape: tuple[int, ...]) -> list[Any]:
    """Entries in rows, where there are rows."""
    if len(shape) == 1:
        return entries
    return [entries[start : start + shape[1]] for start in range(0, len(entries), shape[1])]


def _shown(texts: list[Any]) -> str:
    return f"[{', '.join(each if isinstance(each, str) else _shown(each) for each in texts)}]"


# --- layouts


def row(answer: Tree, word: str) -> Layout:
    """The cells of a list, of a column, or of a mapping from the names of components. Raises Unreadable."""
    if isinstance(answer, dict):
        cells = _by_components(answer)
        return (len(cells),), cells
    if isinstance(answer, list) and answer and all(isinstance(each, list) for each in answer):
        # One row, or one column.
        answer = answer[0] if len(answer) == 1 else [each[0] if len(each) == 1 else each for each in answer]
    if not isinstance(answer, list) or not answer or any(isinstance(each, list | dict) for each in answer):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of numbers")
    return _limited((len(answer),)), [(f"{word} {k + 1}", entry) for k, entry in enumerate(answer)]


def _limited(shape: tuple[int, ...]) -> tuple[int, ...]:
    if math.prod(shape) > MOST_ENTRIES:
        raise Unreadable("too_large", f"expected at most {MOST_ENTRIES} numbers")
    return shape


def _by_components(answer: dict[str, Tree]) -> list[Cell]:
    """The cells of `{x: 0, y: 2, z: 12}`, or with other names that end so."""
    ends = [AXES.get(re.sub(r"[\s_{}()]", "", name).lower()[-1:]) for name in answer]
    if sorted(ends, key=str) != list(range(len(answer))):
        raise Unreadable(
            "wrong_shape", f"read {shown(answer)}, expected a list, or `{{x: .., y: .., z: ..}}`"
        )
    cells = [(shown(name), entry) for name, entry in answer.items()]
    return [cells[ends.index(k)] for k in range(len(cells))]


def rows(answer: Tree) -> Layout:
    """The cells of a list of rows of one length. Raises Unreadable."""
    table = answer if isinstance(answer, list) else []
    if table and not any(isinstance(each, list) for each in table):
        table = [table]
    widths = {len(each) if isinstance(each, list) else 0 for each in table}
    if (
        len(widths) != 1
        or 0 in widths
        or any(isinstance(entry, list | dict) for each in table for entry in each)
    ):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected rows of the same length")
    shape = _limited((len(table), widths.pop()))
    return shape, [(label(i, j), entry) for i, each in enumerate(table) for j, entry in enumerate(each)]


def label(i: int, j: int) -> str:
    """The name of a place in a matrix."""
    return f"row {i + 1}, column {j + 1}"


# --- vectors and matrices


class Vector(Arrays):
    """The components of a vector, or a direction alone."""

    name: ClassVar[str] = "vector"
    options: ClassVar[frozenset[str]] = Arrays.options | {"direction", "normalized"}
    word: ClassVar[str] = "component"

    def key(self, asked: Asked) -> Key:
        """The key of a question for a vector. Raises ValueProblem."""
        key = super().key(asked)
        if key.entries.ndim != 1 or not key.entries.size:
            raise ValueProblem("this is not a list of numbers", hint="a table of them is a `matrix`")
        if asked.question.direction in ("sense", "parallel") and all(key.ruler.are_zero(key.right)):
            raise ValueProblem("a vector of length zero has no direction", path=("direction",))
        return replace(key, mistaken=tuple(_other_vectors(asked, key)))

    def judge(self, key: Key, value: Sequence[Entry]) -> Outcome:
        """The outcome of a vector; a direction is right as a whole."""
        way, opposite = key.question.direction, replace(key, entries=-key.entries)
        if way == "exact":
            return super().judge(key, value)
        if way == "sign_free":
            found = self.compared(opposite, value)
            return super().judge(key, value) if False in found else settled(key, value, found)
        if not _along(key, value):
            return earning(0.0, Finding("sign_error" if _along(opposite, value) else "outside_tolerance"))
        if key.question.normalized == "required" and not has_unit_length(key.ruler, value):
            return earning(0.0, Finding("axis_not_normalised"))
        return settled(key, value, [])


def _along(key: Key, entries: Sequence[Entry]) -> bool:
    """Whether a vector has the direction of the key, or where that is free the opposite, at all points."""
    both = zip(key.ruler.numbers(entries).T, key.ruler.numbers(key.right).T, strict=True)
    apart = [angle(own, right) for own, right in both]
    if key.question.direction == "parallel":
        apart = [min(each, math.pi - each) for each in apart]
    return max(apart) <= key.ruler.angle


def has_unit_length(ruler: Ruler, entries: Sequence[Entry]) -> bool:
    """Whether a vector has the length 1, at all points."""
    lengths = np.linalg.norm(ruler.numbers(entries), axis=0)
    return bool((np.abs(lengths - 1) <= ruler.angle).all())


def angle(one: Floats, other: Floats) -> float:
    """The angle (0 to pi, rad) between two vectors of any size; pi where one of them has no direction.

    2 atan2(|u - v|, |u + v|) of the unit vectors is accurate at all angles (W. Kahan, How Futile are Mindless
    Assessments of Roundoff, section 12).
    """
    with np.errstate(all="ignore"):
        u, v = (each / np.abs(each).max() for each in (one, other))  # so that squares stay within floats
        u, v = u / math.hypot(*u), v / math.hypot(*v)
    found = 2 * math.atan2(math.hypot(*(u - v)), math.hypot(*(u + v)))
    return found if math.isfinite(found) else math.pi


def _other_vectors(asked: Asked, key: Key) -> Iterator[tuple[str, Array]]:
    """The vector along the axes of the document, turned the wrong way, and with components exchanged."""
    size = key.entries.size
    if asked.document is not None and asked.document.frame is not None and size == 3:
        axes, vector = asked.document.physical.axes, np.asarray(asked.value)
        yield "other_frame", key.ruler.entries(axes @ vector)
        yield "other_frame", key.ruler.entries(axes.T @ vector)
    if size <= 4:
        orders = list(permutations(range(size)))[1:]
        yield from (("components_permuted", key.entries[list(order)]) for order in orders)


class Matrix(Arrays):
    """The entries of a matrix of any shape."""

    name: ClassVar[str] = "matrix"

    def layout(self, answer: Tree) -> Layout:
        """The cells of a list of rows. Raises Unreadable."""
        return rows(answer)

    def key(self, asked: Asked) -> Key:
        """The key of a question for a matrix; zeros and ones, which stand by themselves, are not counted."""
        key = super().key(asked)
        if key.entries.ndim != 2:
            raise ValueProblem("this is not a matrix, which is a list of rows")
        plain = zip(key.ruler.are_zero(key.right), key.ruler.are_zero(key.right, besides=1), strict=True)
        counted = tuple(not (zero or one) for zero, one in plain)
        labels = tuple(label(i, j) for i, j in np.ndindex(*key.entries.shape))
        return replace(key, labels=labels, counted=counted if any(counted) else key.counted)

    def is_right(self, key: Key, value: Sequence[Entry]) -> bool:
        """Whether the outcome is `correct`, without a word on what is wrong."""
        return False not in self.compared(key, value) and super().is_right(key, value)


# --- what mistakes make of a key


def worked_out(code: str) -> Callable[[Key], Iterator[Key]]:
    """What makes the keys whose entries come out under this mistake."""

    def changes(key: Key) -> Iterator[Key]:
        for name, entries in key.mistaken:
            if name == code:
                yield replace(key, entries=entries, mistaken=())

    return changes


def transposed(key: Key) -> Iterator[Key]:
    """The key with rows and columns exchanged, where it is square."""
    if key.entries.shape[0] == key.entries.shape[-1]:
        yield replace(key, entries=key.entries.T, mistaken=())
