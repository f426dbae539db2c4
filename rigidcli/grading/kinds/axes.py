"""Principal axes: pairs of a moment and its axis, judged by the eigen-problem that they solve.

Mechanics leaves open the order of the pairs, the sign of each axis, and every turn among axes to moments that
cannot be told apart: none of it is held against an answer, unless the question asks for it.
"""

from __future__ import annotations

from collections.abc import Iterator
from math import ceil, cos, degrees, log10, pi, sin
from pathlib import Path

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.asked import Tree
from rigidcli.grading.kinds import Example
from rigidcli.grading.mistakes import explained
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.outcome import Finding, Outcome, correct, wrong
from rigidcli.grading.principal import pairs
from rigidcli.grading.principal.eigen import Eigen, Match, angles_off, is_solved, match
from rigidcli.grading.principal.key import Key, explanations, read_key
from rigidcli.grading.principal.pairs import Pairs

__all__ = ["examples", "judge", "read_key"]

INDEPENDENT = 0.02
"""Axes whose smallest singular value is above this span the space, however wide the tolerance is."""

OF_SET = {"axes_dependent", "axes_not_orthogonal", "axis_not_normalised", "left_handed", "wrong_order"}
"""What may be wrong where each pair is a solution."""


# --- judging


@np.errstate(over="ignore", invalid="ignore")
def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of pairs. Raises Unreadable."""
    told = pairs.read(answer)
    found = match(key.eigen, told.moments, told.units)
    findings = [*_of_pairs(key, told, found), *_of_lengths(key, told, found), *_of_set(key, told.units)]
    if key.question.order == "ascending":
        ordered = match(key.eigen, told.moments, told.units, ordered=True)
        descending = bool((np.diff(told.moments) < -key.eigen.allowed.max()).any())
        if not ordered.complete and (found.complete or descending):
            findings.append(Finding("wrong_order"))
        found = ordered
    if not findings and found.complete:
        return correct()
    return wrong(*findings or [Finding("outside_tolerance")], share=_share(key, told, found))


def _share(key: Key, told: Pairs, found: Match) -> float:
    """The share of right pairs; one counts half where its moment or its axis alone is right."""
    right: list[int] = []
    for index, slot in found.places:
        together = told.units[[*right, index]]
        if found.axes[index, slot] and _has_length(key, told, index) and not list(_of_set(key, together)):
            right.append(index)
    halves = 0
    for index, slot in found.places:
        moment = bool(found.moments[index, slot])
        # Where every direction is an axis, one is worth nothing without its moment.
        halves += moment + (index in right and (moment or not key.eigen.isotropic))
    return halves / (2 * max(3, len(told.moments)))


def _has_length(key: Key, told: Pairs, index: int) -> bool:
    optional = key.question.normalized == "optional"
    return optional or abs(float(told.lengths[index]) - 1) <= key.length * (1 + ROUNDING)


# --- findings


def _of_pairs(key: Key, told: Pairs, found: Match) -> Iterator[Finding]:
    """What is wrong with the pairs as solutions."""
    if found.complete:
        return
    if len(told.moments) < 3:
        yield Finding("missing_axis")
    if found.crossed:
        yield Finding("moment_axis_pairing")
        return
    named = explained(
        explanations(key, told),
        lambda other: is_solved(other[0], told.moments, other[1]),
        "outside_tolerance",
    )
    if named.code != "outside_tolerance":
        yield named
        return
    if found.miscounted:
        yield Finding("multiplicity")
    slots = dict(found.places)
    for index, off in enumerate(angles_off(key.eigen, told.units).min(axis=1)):
        slot = slots.get(index)
        if not told.units[index].any():
            yield Finding("zero_vector", f"axis {index + 1}")
        elif not found.axes[index].any():
            detail = f"it is off by {degrees(off):.2g} degrees"
            yield Finding("not_an_eigenvector", f"axis {index + 1}", detail, _expected_axis(key.eigen, slot))
        elif found.is_misplaced(index):
            yield Finding("moment_axis_pairing", f"pair {index + 1}")
        # Of a moment that is told twice, one has no place.
        if not found.moments[index].any() or (
            slot is not None and not found.moments[index, slot] and not found.miscounted
        ):
            reference = "" if slot is None else f"expected {key.eigen.moments[slot]:.6g} kg m^2"
            yield Finding("outside_tolerance", f"moment {index + 1}", reference=reference)


def _expected_axis(eigen: Eigen, slot: int | None) -> str:
    """The axis in a place, or what the axes there have in common."""
    if slot is None:
        return ""
    space = next(space for space in eigen.spaces if slot in space)
    text, axis = "along", eigen.axes[slot]
    if len(space) == 2:
        text, axis = "at right angles to", eigen.axes[({0, 1, 2} - set(space)).pop()]
    return f"expected {text} ({', '.join(f'{component + 0.0:.6g}' for component in axis)})"


def _of_lengths(key: Key, told: Pairs, found: Match) -> Iterator[Finding]:
    for index in np.flatnonzero(found.axes.any(axis=1)).tolist():
        if not _has_length(key, told, index):
            yield Finding("axis_not_normalised", f"axis {index + 1}")


def _of_set(key: Key, units: Floats) -> Iterator[Finding]:
    """What is wrong with two or three axes as a set; one of length zero leaves nothing to say."""
    if not 2 <= len(units) <= 3 or not units.any(axis=1).all():
        return
    # Two axes may each be off.
    angle = 2 * float(key.eigen.angles.max())
    if np.linalg.svd(units, compute_uv=False)[-1] <= min(angle, INDEPENDENT):
        yield Finding("axes_dependent")
        return
    cosines = np.abs(units @ units.T)[np.triu_indices(len(units), 1)]
    if key.question.orthogonal == "required" and cosines.max() > sin(min(angle, pi / 2)):
        yield Finding("axes_not_orthogonal")
    if key.question.handed == "right" and len(units) == 3 and np.linalg.det(units) < 0:
        yield Finding("left_handed")


# --- examples


def examples(key: Key) -> Iterator[Example]:
    """The key, the same in other forms, and under the mistakes that change it."""
    yield from _right(key)
    for what, moments, axes, code in _wrong(key):
        if _is_clear(key, pairs.of(moments, axes), code):
            yield Example(what, pairs.written(moments, axes), code)


def _is_clear(key: Key, told: Pairs, code: str) -> bool:
    """Whether an answer is wrong in one way alone: no pair may be right by chance, nor for another reason."""
    found = match(key.eigen, told.moments, told.units)
    expected = (code in OF_SET, code == "moment_axis_pairing", code == "multiplicity")
    if (found.complete, found.crossed, found.miscounted) != expected:
        return False
    if found.complete or found.crossed:
        return True
    every = explanations(key, told)
    return {name for name, (eigen, units) in every if is_solved(eigen, told.moments, units)} <= {code}


def _right(key: Key) -> Iterator[Example]:
    moments, axes = key.eigen.moments, key.eigen.axes
    itself = pairs.written(moments, axes)
    yield Example("the key", itself)
    apart = {name: [pair[one] for pair in itself] for name, one in (("moments", "moment"), ("axes", "axis"))}
    yield Example("moments and axes apart", apart)
    yield Example("two axes with the other sign", pairs.written(moments, axes * [[-1.0], [1.0], [-1.0]]))
    places = ceil(-log10(key.angle))
    yield Example("axes rounded", pairs.written(moments, axes.round(max(places, 1))))
    if key.question.order == "free":
        yield Example("in another order", [itself[k] for k in (1, 2, 0)])
    if key.question.normalized == "optional":
        yield Example("axes of another length", pairs.written(moments, 2.5 * axes))
    for space in key.eigen.spaces:
        if len(space) > 1:
            turned = _turned(axes, space[0], space[-1], 0.6)
            yield Example("other axes to moments that are not told apart", pairs.written(moments, turned))


def _turned(axes: Floats, one: int, other: int, angle: float) -> Floats:
    """Axes of which two are turned in their plane (rad)."""
    turned = axes.copy()
    turned[one] = cos(angle) * axes[one] + sin(angle) * axes[other]
    turned[other] = cos(angle) * axes[other] - sin(angle) * axes[one]
    return turned


def _wrong(key: Key) -> Iterator[tuple[str, Floats, Floats, str]]:
    """Wrong answers (moments and axes), with the code of what is wrong."""
    question, eigen = key.question, key.eigen
    moments, axes = eigen.moments, eigen.axes
    alone = next((space[0] for space in eigen.spaces if len(space) == 1), None)
    if alone is not None:
        rest = [k for k in range(3) if k != alone]
        yield "one pair left out", moments[rest], axes[rest], "missing_axis"
        crossed = axes[[2, 1, 0]] * -1.0
        yield "moments paired with other axes", moments, crossed, "moment_axis_pairing"
        turned = _turned(axes, alone, rest[0], 0.3)
        yield "two axes turned out of their places", moments, turned, "not_an_eigenvector"
    plane = next((space for space in eigen.spaces if len(space) == 2), None)
    if plane is not None and alone is not None:
        told = moments.copy()
        told[1] = moments[alone]
        yield "another moment told twice", told, axes, "multiplicity"
    shared = next((space for space in eigen.spaces if len(space) > 1), None)
    if shared is not None:
        double, oblique = axes.copy(), axes.copy()
        double[shared[1]] = axes[shared[0]]
        yield "one axis told twice", moments, double, "axes_dependent"
        oblique[shared[1]] = _turned(axes, shared[0], shared[1], 0.3)[shared[0]]
        if question.orthogonal == "required":
            yield "axes that are not at right angles", moments, oblique, "axes_not_orthogonal"
    if question.normalized == "required":
        yield "axes of another length", moments, 2 * axes, "axis_not_normalised"
    if question.handed == "right":
        yield "a left-handed set", moments, -axes, "left_handed"
    if question.order == "ascending" and alone is not None:
        yield "in descending order", moments[::-1], -axes[::-1], "wrong_order"
    yield "moments twice as large", 2 * moments, axes, "constant_factor"
    yield "moments ten times as large", 10 * moments, axes, "power_of_ten"
    yield "moments with the other sign", -moments[::-1], -axes[::-1], "sign_error"
    yield "axes in columns", moments, axes.T, "transposed"
    for code, other in key.mistaken:
        yield f"worked with `{code}`", other.moments, other.axes, code
