"""Vectors, and other lists of numbers: components, or a direction alone."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, filled
from rigidcli.grading.arrays.keys import reference
from rigidcli.grading.arrays.mistakes import (
    MOST_PLACES,
    Explanation,
    as_typed,
    constant_factor,
    earned,
    flipped,
    forms,
    is_factor,
    one_of,
    places_in,
    power_of_ten,
    times,
    told,
    too_few_digits,
    wrong_entries,
    wrong_forms,
)
from rigidcli.grading.arrays.reference import Reference, Typed, exactly
from rigidcli.grading.arrays.vectors import (
    RATE_FACTORS,
    angle_between,
    in_other_frames,
    length,
    rate_codes,
    without_noise,
)
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.numbers import MOST_ENTRIES, are_near, margin
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong

Direction: TypeAlias = Literal["exact", "sense", "sign_free", "parallel"]


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The components of a vector, how its `direction` is judged, to what `angle` (rad), and named mistakes.

    `causes` have codes with the components (k by n) that come out under them; `codes` name the factors
    of `RATE_FACTORS` that this vector may be wrong by.
    """

    reference: Reference
    direction: Direction
    angle: float
    causes: tuple[tuple[str, Floats], ...]
    codes: tuple[str, ...]

    @property
    def is_direction(self) -> bool:
        """Whether any length is right."""
        return self.direction in ("sense", "parallel")


def read_key(asked: Asked) -> Key:
    """The key of a question for a vector. Raises ValueProblem."""
    found = reference(asked, _listed)
    if len(found.shape) != 1 or not found.shape[0]:
        raise ValueProblem("this is not a list of numbers", hint="a matrix has a kind of its own")
    found = without_noise(found, asked)
    direction = asked.question.direction
    if direction in ("sense", "parallel") and not np.abs(found.values).max(axis=1).all():
        raise ValueProblem("a vector of length zero has no direction", path=("direction",))
    angle = asked.question.tolerance.angle or _angle(found)
    key = Key(found, direction, angle, (), rate_codes(found, asked))
    turned_frames = [("other_frame", values) for values in in_other_frames(found, asked)]
    return replace(
        key, causes=tuple((code, v) for code, v in turned_frames if not _is_right(key, exactly(v)))
    )


def _angle(key: Reference) -> float:
    """The angle (rad) by which a vector turns when it changes by the tolerance."""
    shortest = min(length(row) for row in key.values)
    return margin(shortest, key.tolerance) / shortest if shortest else 0.0


def _listed(answer: Tree) -> Array:
    """The cells of a list."""
    if not isinstance(answer, list) or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of numbers")
    return filled([Cell(entry, _place(k)) for k, entry in enumerate(answer)], (len(answer),))


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of numbers. Raises Unreadable."""
    expected = key.reference.shape[0]
    if isinstance(answer, list) and len(answer) != expected:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected {expected} numbers")
    typed = key.reference.read(answer, _listed)
    if _is_right(key, typed):
        return correct()
    if not typed.values.any() and key.reference.nonzero.any():
        return wrong(Finding("zero_vector", reference=told(key.reference)))
    right = _right(key, typed)
    share = 0.0 if key.is_direction else earned(key.reference, right)
    found = one_of(_causes(key, typed), _descriptions(key, typed))
    if found is not None:
        return wrong(replace(found, reference=told(key.reference)), share=share)
    if key.is_direction:
        return wrong(Finding("outside_tolerance", reference=told(key.reference)))
    return wrong(*wrong_entries(key.reference, typed, right, _place, share), share=share)


def _place(index: int) -> str:
    return f"component {index + 1}"


def _places(mask: Mask) -> str:
    return places_in(mask, _place)


# --- comparison


def _is_right(key: Key, answer: Typed) -> bool:
    return _is(key, answer, key.reference.values)


def _is(key: Key, answer: Typed, values: Floats) -> bool:
    """Whether the answer is this vector (k by n), as far as the question asks."""
    if key.is_direction:
        angles = [angle_between(answer.values[k], values[k]) for k in answer.rows]
        if key.direction == "parallel":
            angles = [min(angle, math.pi - angle) for angle in angles]
        return all(angle <= key.angle for angle in angles)
    return any(key.reference.same(answer.times(sign), values) for sign in _signs(key))


def _signs(key: Key) -> tuple[int, ...]:
    return (1, -1) if key.direction == "sign_free" else (1,)


def _right(key: Key, answer: Typed) -> Mask:
    """Which components are right, with the better of two signs where the sign is free."""
    masks = [key.reference.agree(answer.times(sign), key.reference.values) for sign in _signs(key)]
    return max(masks, key=lambda mask: int(mask.sum()))


# --- mistakes


def _causes(key: Key, answer: Typed) -> Iterator[Explanation]:
    ours = key.reference
    yield from ((Finding(code), _is(key, answer, values)) for code, values in key.causes)
    yield Finding("components_permuted"), _is_permuted(key, answer)
    if key.direction in ("exact", "sense"):
        yield Finding("opposite_direction"), _is(key, answer.times(-1), ours.values)
    if not key.is_direction:
        yield Finding("power_of_ten"), any(power_of_ten(ours, answer.times(sign)) for sign in _signs(key))
        for code in key.codes:
            factors = [sign * factor for factor in RATE_FACTORS[code] for sign in _signs(key)]
            yield Finding(code), is_factor(ours, answer, factors)


def _descriptions(key: Key, answer: Typed) -> Iterator[Explanation]:
    ours = key.reference
    if key.is_direction:
        answer = _resized(key, answer)
    else:
        yield Finding("constant_factor"), constant_factor(ours, answer)
    for sign in _signs(key):
        signed = answer.times(sign)
        right = ours.agree(signed, ours.values)
        if not key.is_direction:
            yield too_few_digits(ours, signed, right, _places)
        signs = flipped(ours, signed, right)
        if 0 < signs.sum() < max(2, ours.nonzero.sum()):
            yield Finding("sign_error", _places(signs)), True


def _resized(key: Key, answer: Typed) -> Typed:
    """The answer with the length of the right vector."""
    with np.errstate(all="ignore"):
        pairs = zip(answer.values, key.reference.values, strict=True)
        rows = [mine / length(mine) * length(own) for mine, own in pairs]
    return replace(answer, values=np.array(rows))


def _is_permuted(key: Key, answer: Typed) -> bool:
    """Whether the components are the right ones in another order."""
    ours = key.reference
    mine = (_resized(key, answer) if key.is_direction else answer).values
    signs = (1, -1) if key.direction in ("sign_free", "parallel") else (1,)
    return any(
        all(
            bool(are_near(np.sort(sign * mine[k]), np.sort(ours.values[k]), ours.tolerance).all())
            and not bool(are_near(sign * mine[k], ours.values[k], ours.tolerance).all())
            for k in answer.rows
        )
        for sign in signs
    )


# --- examples

LENGTHS = {"exact": (), "sense": (2.5,), "sign_free": (-1.0,), "parallel": (2.5, -0.4)}
"""By what a right vector may be multiplied."""


def examples(key: Key) -> Iterator[Example]:
    """The vector in several forms, and under each mistake."""
    ours = key.reference
    yield from (Example(what, answer) for what, answer in forms(ours))
    for factor in LENGTHS[key.direction]:
        yield Example(f"the key, {factor:g} times as long", as_typed(times(ours.entries, factor)))
    for what, code, answer in wrong_forms(ours, _mistaken(key)):
        typed = ours.read(answer, _listed)
        if not _is_right(key, typed):
            found = one_of(_causes(key, typed), _descriptions(key, typed))
            if found is not None and found.code == code:
                yield Example(what, answer, code)


def _mistaken(key: Key) -> Iterator[tuple[str, str, Array]]:
    entries = key.reference.entries
    if not key.reference.names:
        for code, values in key.causes:
            yield code.replace("_", " "), code, values[0].astype(object)
    yield "the components moved on by one", "components_permuted", np.roll(entries, 1)
    yield "the opposite vector", "opposite_direction", times(entries, -1)
    yield "a thousand times the vector", "power_of_ten", times(entries, 1000)
    yield "three times the vector", "constant_factor", times(entries, 3)
    for code in key.codes:
        yield code.replace("_", " "), code, times(entries, RATE_FACTORS[code][1])
    for k in np.flatnonzero(key.reference.nonzero)[:MOST_PLACES].tolist():
        signs = np.where(np.arange(len(entries)) == k, -1, 1)
        yield f"component {k + 1} with the wrong sign", "sign_error", times(entries, signs)
