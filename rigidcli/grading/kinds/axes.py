"""Principal axes: pairs of a moment and its axis, judged by the eigen-problem that they solve.

Mechanics leaves open the order of the pairs, the sign and length of each axis, and every turn among axes to
moments that cannot be told apart: none of it is held against an answer, unless the question asks for it. With
symbols, an answer must solve the problem at every point at which they are given values. Where
`ask: axes.axes` is asked, the axes alone are an answer, too.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import ceil, cos, log10, pi, sin
from pathlib import Path
from typing import ClassVar

import numpy as np

from rigidcli.core.arithmetic import Array
from rigidcli.errors import ValueProblem
from rigidcli.grading.arrays.entries import as_typed, times
from rigidcli.grading.arrays.reference import told as entries_told
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.outcome import Finding, Outcome, correct, review, wrong
from rigidcli.grading.principal.eigen import Answer, Match, are_moments, match
from rigidcli.grading.principal.key import Key
from rigidcli.grading.principal.key_making import key_of
from rigidcli.grading.principal.reading import read
from rigidcli.grading.principal.solution import is_proved, solution
from rigidcli.grading.proofs import are_numbers
from rigidcli.language.expression import Expression

INDEPENDENT = 0.02
"""Axes whose smallest singular value is above this span the space, however wide the tolerance is."""

PLACES = {1: "along", 2: "at right angles to", 3: "in any direction"}
"""Where axes are, by the dimension of their space."""


class Axes(Kind):
    """Principal moments with their axes, or axes alone."""

    name: ClassVar[str] = "axes"
    options: ClassVar[frozenset[str]] = frozenset(
        {"order", "normalized", "orthogonal", "handed", "symbols", "unit", "products"}
    )

    def read_key(self, asked: Asked) -> Key:
        """The eigen-problem of the tensor that is asked for, and its solution. Raises ValueProblem."""
        key = key_of(asked)
        found = solution(key)
        if found is not None and self.is_right(key, key.typed(found)):
            key = replace(key, solution=found)
            return replace(key, told=_told(key))
        if asked.question.order == "ascending":
            message = "the order of the moments depends on the symbols, or cannot be told"
            raise ValueProblem(message, path=("order",))
        entries = entries_told(key.reference).removeprefix("expected ")
        return replace(key, told=f"expected the moments and axes of {entries}")

    def read_answer(self, key: Key, answer: Tree, folder: Path) -> Answer:
        """A list of pairs, or of axes. Raises Unreadable."""
        return read(key, answer)

    def judge(self, key: Key, answer: Answer) -> Outcome:
        """The outcome of pairs: first as solutions, then as a set."""
        found = match(key.eigen, answer)
        said = [*self._of_pairs(key, answer, found), *_broken(key, answer, found)]
        if found.complete and not said:
            unsure = "it is right for some values of the symbols, but not proved for all"
            return correct() if is_proved(key, answer, found.places) else review(unsure)
        if key.question.order == "ascending":
            found = Match(found.moments, found.axes, np.sort(found.places, axis=1))
        first, *others = said or [Finding("outside_tolerance")]
        return wrong(replace(first, reference=key.told), *others, share=_share(key, answer, found))

    def is_right(self, key: Key, answer: Answer) -> bool:
        """Whether the pairs are the three solutions, and break no rule of the question."""
        if answer.moments is not None and not are_moments(key.eigen, answer.moments).any(axis=1).all():
            return False  # for speed: under most mistakes a moment is not told
        answer = replace(answer, axes=answer.axes.swapaxes(1, 2)) if key.columns else answer
        found = match(key.eigen, answer)
        return found.complete and not any(_broken(key, answer, found))

    def explanation(self, key: Key, answer: Answer) -> Finding | None:
        """The one named mistake that explains three pairs which are not just paired wrongly."""
        if len(answer) != 3 or not answer.units.any(axis=2).all() or match(key.eigen, answer).crossed:
            return None
        return super().explanation(key, answer)

    def _of_pairs(self, key: Key, answer: Answer, found: Match) -> Iterator[Finding]:
        """What is wrong with the pairs as solutions."""
        if found.complete:
            return
        if len(answer) < 3:
            yield Finding("missing_axis")
        if found.crossed:
            yield Finding("moment_axis_pairing")
        elif (named := self.explanation(key, answer)) is not None:
            yield named
        else:
            if found.miscounted:
                yield Finding("multiplicity")
            for index in range(len(answer)):
                yield from _of_pair(key, answer, found, index)

    def right_forms(self, key: Key) -> Iterator[tuple[str, Tree]]:
        """The key and its axes in other forms, as far as the question leaves them free."""
        if key.solution is None:
            return
        moments, axes = key.solution[:, 0], key.solution[:, 1:]
        axes = axes.T if key.columns else axes
        told, pairs = _moments_typed(key, moments), _typed(key, moments, axes)
        if key.alone:
            yield "the axes", as_typed(axes)
        yield "the key", pairs
        yield "moments and axes apart", {"moments": told, "axes": as_typed(axes)}
        by_name = [{"x": x, "y": y, "z": z} for x, y, z in as_typed(axes)]
        yield "axes by the names of their components", {"moments": told, "axes": by_name}
        places = max(ceil(-log10(key.angle)), 1)
        yield "axes rounded", {"moments": told, "axes": as_typed(axes, f".{places}f")}
        yield "two axes with the other sign", _typed(key, moments, times(axes, [[-1], [1], [-1]]))
        if key.question.unit == "optional":
            yield "moments without a unit", _typed(key, moments, axes, unit="")
        if key.question.order == "free":
            yield "in another order", [pairs[k] for k in (1, 2, 0)]
        if key.question.normalized == "optional":
            yield "axes of another length", _typed(key, moments, times(axes, 2.5))
        for one, other in zip(*np.triu(key.eigen.same[0], 1).nonzero(), strict=True):
            turned = _turned(axes, one, other, 0.6)
            yield "other axes to moments that are not told apart", _typed(key, moments, turned)

    def wrong_forms(self, key: Key) -> Iterator[Example]:
        """The key with one fault of any kind, as far as it is one there and no other comes with it."""
        if key.solution is None:
            return
        moments, axes = key.solution[:, 0], key.solution[:, 1:]
        for what, code, told, along in _wrong(moments, axes):
            unit = "" if code == "unit_missing" else None
            form = as_typed(along) if key.alone else _typed(key, told, along, unit)
            outcome = self.judge(key, self.read_answer(key, form, Path()))
            if {finding.code for finding in outcome.findings} == {code}:
                yield Example(what, form, code)


# --- what is wrong


def _of_pair(key: Key, answer: Answer, found: Match, index: int) -> Iterator[Finding]:
    """What is wrong with the axis and the moment of one pair."""
    place, slot = f"axis {index + 1}", found.places[0, index]
    right, known = found.right[:, index], found.known[:, index]
    expected = () if key.solution is None or slot < 0 else key.solution[slot]
    varies = [not are_numbers(np.array(each, dtype=object)) for each in (expected[:1], expected[1:])]
    if not answer.axes[:, index].any(axis=1).all():
        yield Finding("zero_vector", place)
    elif not known[1]:
        number = varies[1] and (answer.axes[:, index] == answer.axes[0, index]).all()
        yield Finding("number_for_symbol" if number else "not_an_eigenvector", place)
    elif found.is_misplaced(index):
        yield Finding("moment_axis_pairing", f"pair {index + 1}")
    # Of a moment that is told twice, one has no place.
    misplaced = slot >= 0 and not right[0] and not found.miscounted
    if answer.moments is not None and (misplaced or not known[0]):
        number = varies[0] and (answer.moments[:, index] == answer.moments[0, index]).all()
        yield Finding("number_for_symbol" if number else "outside_tolerance", f"moment {index + 1}")


def _broken(key: Key, answer: Answer, found: Match) -> Iterator[Finding]:
    """Which rules of the question an answer breaks."""
    for index in np.flatnonzero(found.known[1]).tolist():
        if not _has_length(key, answer, index):
            yield Finding("axis_not_normalised", f"axis {index + 1}")
    yield from map(Finding, _of_set(key, answer, range(len(answer))))
    if answer.bare and key.question.unit == "required":
        yield Finding("unit_missing", ", ".join(f"moment {index + 1}" for index in answer.bare))
    if key.question.order == "ascending" and len(answer) <= 3 and (np.diff(found.places) < 0).any():
        told = answer.moments
        if found.complete or (told is not None and (np.diff(told[0]) < -key.eigen.allowed[0].max()).any()):
            yield Finding("wrong_order")


def _has_length(key: Key, answer: Answer, index: int) -> bool:
    """Whether an axis is as long as it must be."""
    with np.errstate(over="ignore"):
        missed = np.abs(np.linalg.norm(answer.axes[:, index], axis=1) - 1)
    return key.question.normalized == "optional" or not (missed > key.length * (1 + ROUNDING)).any()


def _of_set(key: Key, answer: Answer, rows: Sequence[int]) -> list[str]:
    """Codes of what is wrong with two or three axes (`rows`) as a set: one of no direction says nothing."""
    units = answer.units[:, rows]
    if not 2 <= len(rows) <= 3 or not units.any(axis=2).all():
        return []
    # Two axes may each be off.
    angles = 2 * key.eigen.angles.max(axis=1)
    if (np.linalg.svd(units, compute_uv=False)[:, -1] <= np.minimum(angles, INDEPENDENT)).any():
        return ["axes_dependent"]
    cosines = np.abs(units @ units.swapaxes(1, 2))[:, *np.triu_indices(len(rows), 1)].max(axis=1)
    oblique = (cosines > np.sin(np.minimum(angles, pi / 2))).any() and key.question.orthogonal == "required"
    left = len(rows) == 3 and (np.linalg.det(units) < 0).any() and key.question.handed == "right"
    return ["axes_not_orthogonal"] * bool(oblique) + ["left_handed"] * bool(left)


def _share(key: Key, answer: Answer, found: Match) -> float:
    """The share of right pairs; one counts half where its moment or its axis alone is right."""
    sound: list[int] = []
    for index in np.flatnonzero(found.right[1]).tolist():
        if _has_length(key, answer, index) and not _of_set(key, answer, [*sound, index]):
            sound.append(index)
    moments, axes = found.right[0].copy(), np.isin(np.arange(len(answer)), sound)
    if key.eigen.isotropic.all():
        # Where every direction is an axis, one is worth nothing without its moment.
        axes &= moments
    moments[list(answer.bare)] = False
    earned = axes.sum() if answer.moments is None else (moments.sum() + axes.sum()) / 2
    return float(earned / max(3, len(answer)))


# --- the right answer, and examples


def _told(key: Key) -> str:
    """The right answer, for those who may see it."""
    assert key.solution is not None
    moments = ["", "", ""] if key.alone else [f"{m} " for m in _moments_typed(key, key.solution[:, 0], ".6g")]
    return f"expected {', '.join(moments[k] + _place(key, k) for k in range(3))}"


def _place(key: Key, slot: int) -> str:
    """Where an axis is: along it, or what the axes to moments that are not told apart have in common."""
    assert key.solution is not None
    same = key.eigen.same[0, slot]
    if same.all():
        return PLACES[3]
    own = slot if same.sum() == 1 else int(same.argmin())
    entries = (entry if isinstance(entry, Expression) else entry + 0.0 for entry in key.solution[own, 1:])
    return f"{PLACES[int(same.sum())]} ({', '.join(as_typed(entry, '.6g') for entry in entries)})"


def _moments_typed(key: Key, moments: Array, form: str = ".17g", unit: str | None = None) -> list[str]:
    """Moments as a student types them; symbols bring units of their own."""
    text = key.unit.text if unit is None else unit
    return [
        moment.text if isinstance(moment, Expression) else f"{moment / key.unit.scale:{form}} {text}".rstrip()
        for moment in moments
    ]


def _typed(key: Key, moments: Array, axes: Array, unit: str | None = None) -> list[Tree]:
    """Pairs as a student types them, with all digits."""
    told = _moments_typed(key, moments, unit=unit)
    return [{"moment": moment, "axis": axis} for moment, axis in zip(told, as_typed(axes), strict=True)]


def _turned(axes: Array, one: int, other: int, angle: float) -> Array:
    """Axes (rows) of which two are turned in their plane (rad), if they are numbers."""
    turned = axes.copy()
    if are_numbers(axes):
        turned[one] = cos(angle) * axes[one] + sin(angle) * axes[other]
        turned[other] = cos(angle) * axes[other] - sin(angle) * axes[one]
    return turned


def _wrong(moments: Array, axes: Array) -> Iterator[tuple[str, str, Array, Array]]:
    """What may be wrong with pairs, each by itself: what it is, its code, and moments and axes in entries."""
    yield "the first pair left out", "missing_axis", moments[1:], axes[1:]
    yield "the last pair left out", "missing_axis", moments[:2], axes[:2]
    yield "moments paired with other axes", "moment_axis_pairing", moments, times(axes[::-1], -1)
    yield "axes told twice", "axes_dependent", moments, axes[[0, 1, 1]]
    yield "axes of another length", "axis_not_normalised", moments, times(axes, 2)
    yield "a left-handed set", "left_handed", moments, times(axes, -1)
    yield "in descending order", "wrong_order", moments[::-1], times(axes[::-1], -1)
    yield "moments without a unit", "unit_missing", moments, axes
    for one, other in ((0, 1), (1, 2)):
        turned, oblique = _turned(axes, one, other, 0.3), axes.copy()
        oblique[one] = turned[one]
        yield "two axes turned out of their places", "not_an_eigenvector", moments, turned
        yield "axes that are not at right angles", "axes_not_orthogonal", moments, oblique
        yield "one moment told twice", "multiplicity", moments[[one, one, 2] if one == 0 else [0, 2, 2]], axes
    for code, factor in (("constant_factor", 2), ("power_of_ten", 10), ("sign_error", -1)):
        order = slice(None, None, -1) if factor < 0 else slice(None)
        told, along = times(moments, factor)[order], times(axes, 1 if factor > 0 else -1)[order]
        yield f"moments {factor} times as large", code, told, along
