"""What is said of pairs of a moment and an axis that are wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import degrees, pi, sin

import numpy as np

from rigidcli.grading.arrays.mistakes import told as entries_told
from rigidcli.grading.kinds.modules import explained
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.outcome import Finding
from rigidcli.grading.principal.eigen import Match, angles_off, is_solved
from rigidcli.grading.principal.key import Key
from rigidcli.grading.principal.mistakes import explanations
from rigidcli.grading.principal.pairs import Pairs
from rigidcli.grading.principal.writing import moment_shown, place_shown

INDEPENDENT = 0.02
"""Axes whose smallest singular value is above this span the space, however wide the tolerance is."""

OF_SET = {"axes_dependent", "axes_not_orthogonal", "axis_not_normalised", "left_handed", "wrong_order"}
"""What may be wrong where each pair is a solution."""


def findings(key: Key, told: Sequence[Pairs], found: Match) -> list[Finding]:
    """All that is wrong with an answer but its order."""
    return [*_of_pairs(key, told, found), *_of_lengths(key, told, found), *of_set(key, told)]


def with_reference(key: Key, findings: Sequence[Finding]) -> list[Finding]:
    """The findings, of which the first tells the right answer to those who may see it."""
    first, *others = findings
    return [replace(first, reference=first.reference or _reference(key)), *others]


def has_length(key: Key, told: Sequence[Pairs], index: int) -> bool:
    """Whether an axis is as long as it must be."""
    if key.question.normalized == "optional":
        return True
    return all(abs(float(each.lengths[index]) - 1) <= key.length * (1 + ROUNDING) for each in told)


def of_set(key: Key, told: Sequence[Pairs], rows: Sequence[int] | None = None) -> list[Finding]:
    """What is wrong with two or three axes as a set (of `rows`, or all): one of no direction says nothing."""
    every = range(len(told[0])) if rows is None else rows
    if not 2 <= len(every) <= 3 or not all(each.units[every].any(axis=1).all() for each in told):
        return []
    codes = [code for k, each in enumerate(told) for code in _codes(key, k, each.units[every])]
    return [Finding(code) for code in dict.fromkeys(codes)]


def _codes(key: Key, point: int, units: np.ndarray) -> Iterator[str]:
    # Two axes may each be off.
    angle = 2 * float(key.eigens[point].angles.max())
    if np.linalg.svd(units, compute_uv=False)[-1] <= min(angle, INDEPENDENT):
        yield "axes_dependent"
        return
    cosines = np.abs(units @ units.T)[np.triu_indices(len(units), 1)]
    if key.question.orthogonal == "required" and cosines.max() > sin(min(angle, pi / 2)):
        yield "axes_not_orthogonal"
    if key.question.handed == "right" and len(units) == 3 and np.linalg.det(units) < 0:
        yield "left_handed"


def _of_pairs(key: Key, told: Sequence[Pairs], found: Match) -> Iterator[Finding]:
    """What is wrong with the pairs as solutions."""
    if found.complete:
        return
    if len(told[0]) < 3:
        yield Finding("missing_axis")
    if found.crossed:
        yield Finding("moment_axis_pairing")
        return
    named = explained(explanations(key, told), lambda other: is_solved(*other), "outside_tolerance")
    if named.code != "outside_tolerance":
        yield named
        return
    if found.miscounted:
        yield Finding("multiplicity")
    for index in range(len(told[0])):
        yield from _of_axis(key, told, found, index)
        if told[0].moments is not None:
            yield from _of_moment(key, told, found, index)


def _of_axis(key: Key, told: Sequence[Pairs], found: Match, index: int) -> Iterator[Finding]:
    place, slot = f"axis {index + 1}", dict(found.places).get(index)
    if not all(each.lengths[index] for each in told):
        yield Finding("zero_vector", place)
    elif not found.axes[index].any():
        reference = "" if slot is None else _expected_axis(key, slot)
        if slot is not None and key.varies[1, slot] and _is_constant([t.axes[index] for t in told]):
            yield Finding("number_for_symbol", place, reference=reference)
        else:
            yield Finding("not_an_eigenvector", place, _angle_told(key, told, index), reference)
    elif found.is_misplaced(index):
        yield Finding("moment_axis_pairing", f"pair {index + 1}")


def _of_moment(key: Key, told: Sequence[Pairs], found: Match, index: int) -> Iterator[Finding]:
    slot = dict(found.places).get(index)
    # Of a moment that is told twice, one has no place.
    misplaced = slot is not None and not found.moments[index, slot] and not found.miscounted
    if found.moments[index].any() and not misplaced:
        return
    number = slot is not None and key.varies[0, slot]
    number = number and _is_constant([each.moments[index] for each in told if each.moments is not None])
    code = "number_for_symbol" if number else "outside_tolerance"
    reference = "" if slot is None else _expected_moment(key, slot)
    yield Finding(code, f"moment {index + 1}", reference=reference)


def _is_constant(values: Sequence[np.ndarray]) -> bool:
    """Whether what was typed is the same at all points."""
    return all(np.array_equal(value, values[0]) for value in values)


def _angle_told(key: Key, told: Sequence[Pairs], index: int) -> str:
    """By how much an axis is off, where it has a direction, and this does not depend on the symbols."""
    if not all(pairs.units[index].any() for pairs in told):
        return ""
    each = [
        angles_off(eigen, pairs.units[[index]]).min() for eigen, pairs in zip(key.eigens, told, strict=True)
    ]
    texts = {f"it is off by {degrees(off):.2g} degrees" for off in each}
    return texts.pop() if len(texts) == 1 else ""


def _of_lengths(key: Key, told: Sequence[Pairs], found: Match) -> Iterator[Finding]:
    for index in np.flatnonzero(found.axes.any(axis=1)).tolist():
        if not has_length(key, told, index):
            yield Finding("axis_not_normalised", f"axis {index + 1}")


# --- the right answer


def _reference(key: Key) -> str:
    if key.solution is None:
        entries = entries_told(key.reference).removeprefix("expected ")
        return f"expected the moments and axes of {entries}"
    moments = ["" if key.alone else f"{moment_shown(key.solution[k, 0])} " for k in range(3)]
    return "expected " + ", ".join(f"{moments[k]}{_place(key, k)}" for k in range(3))


def _expected_moment(key: Key, slot: int) -> str:
    return "" if key.solution is None else f"expected {moment_shown(key.solution[slot, 0])}"


def _expected_axis(key: Key, slot: int) -> str:
    return "" if key.solution is None else f"expected {_place(key, slot)}"


def _place(key: Key, slot: int) -> str:
    assert key.solution is not None
    space = next(space for space in key.eigens[0].spaces if slot in space)
    return place_shown(key.solution[:, 1:], space, slot)
