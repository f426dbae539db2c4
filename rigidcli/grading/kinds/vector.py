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
from rigidcli.grading.arrays.entries import (
    Reference,
    Typed,
    computed,
    exactly,
    filled,
    read_entry,
    reference,
    worked,
)
from rigidcli.grading.arrays.mistakes import (
    MOST_PLACES,
    Explanation,
    as_typed,
    constant_factor,
    earned,
    flipped,
    forms,
    is_factor,
    listed,
    one_of,
    power_of_ten,
    times,
    told,
    wrong_entries,
)
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds import Example
from rigidcli.grading.numbers import MOST_ENTRIES, NOISE, are_near, margin
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.model.units import Unit

Direction: TypeAlias = Literal["exact", "sense", "sign_free", "parallel"]

DEGREE = math.radians(1)

RATE_FACTORS = {
    "degrees_radians": (DEGREE, 1 / DEGREE),
    "frequency_vs_angular_frequency": (2 * math.pi, 1 / (2 * math.pi)),
}
"""By what a rate is wrong when the angles in it are counted in another unit."""


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
    found = reference(asked, _read)
    if len(found.shape) != 1 or not found.shape[0]:
        raise ValueProblem("this is not a list of numbers", hint="a matrix has a kind of its own")
    found = _without_noise(found, asked)
    direction = asked.question.direction
    if direction in ("sense", "parallel") and not np.abs(found.values).max(axis=1).all():
        raise ValueProblem("a vector of length zero has no direction", path=("direction",))
    angle = asked.question.tolerance.angle or _angle(found)
    key = Key(found, direction, angle, (), _codes(found, asked))
    turned_frames = [("other_frame", values) for values in _in_other_frames(found, asked)]
    return replace(
        key, causes=tuple((code, v) for code, v in turned_frames if not _is_right(key, exactly(v)))
    )


def _angle(key: Reference) -> float:
    """The angle (rad) by which a vector turns when it changes by the tolerance."""
    length = min(_length(row) for row in key.values)
    return margin(length, key.tolerance) / length if length else 0.0


def _without_noise(key: Reference, asked: Asked) -> Reference:
    """The key of a centre of mass at the origin as zeros: rounding leaves something of them."""
    size = _size(asked) if asked.path[-1:] == ("center_of_mass",) and not key.names else 0.0
    if not size or np.abs(key.values).max() > NOISE * size:
        return key
    tolerance = key.tolerance.model_copy(update={"absolute": margin(size, key.tolerance)})
    zeros = np.zeros_like(key.values)
    return replace(key, entries=zeros[0].astype(object), values=zeros, tolerance=tolerance)


def _size(asked: Asked) -> float:
    """The radius of gyration (m) of the body of a report; 0 where it is not known as a number."""
    report = asked.report
    if report is None or report.get("mass") is None:
        return 0.0
    numbers = worked(computed([*np.ravel(report["tensor"]), report["mass"]]), [{}])[0]
    *tensor, mass = np.abs(numbers).tolist()
    return math.sqrt(max(tensor) / mass) if np.isfinite(numbers).all() and mass else 0.0


def _codes(key: Reference, asked: Asked) -> tuple[str, ...]:
    """The factors of rates that a vector may be wrong by: none where no angle and no time is in its unit."""
    if key.unit is None:
        return () if asked.report is not None else tuple(RATE_FACTORS)
    dimension = key.unit.dimension
    if dimension.angle and dimension.time:
        return tuple(RATE_FACTORS)
    return ("degrees_radians",) if dimension.angle or dimension.time else ()


def _in_other_frames(key: Reference, asked: Asked) -> Iterator[Floats]:
    """The same vector along the axes of the document, and along the principal axes."""
    if asked.document is None or key.shape != (3,):
        return
    frames = [asked.document.axes] if asked.document.frame is not None else []
    principal = asked.report.get("axes") if asked.report is not None else None
    if isinstance(principal, np.ndarray):
        frames.append(principal)
    for frame in frames:
        yield np.einsum("kij,kj->ki", worked(computed(frame), key.points), key.values)


def _read(answer: Tree, unit: Unit | None, names: frozenset[str]) -> Array:
    if not isinstance(answer, list) or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of numbers")
    return filled(
        [read_entry(entry, unit, names, f"component {k + 1}") for k, entry in enumerate(answer)],
        (len(answer),),
    )


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of numbers. Raises Unreadable."""
    expected = key.reference.shape[0]
    if isinstance(answer, list) and len(answer) != expected:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected {expected} numbers")
    typed = key.reference.read(answer, _read)
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


def _length(vector: Floats) -> float:
    return math.hypot(*vector.tolist())


def angle_between(one: Floats, other: Floats) -> float:
    """The angle (0 to pi, rad) between two vectors of any size and dimension; NaN where one is zero.

    2 atan2(|u - v|, |u + v|) of the unit vectors is accurate at all angles (W. Kahan, How Futile are Mindless
    Assessments of Roundoff, section 12).
    """
    with np.errstate(all="ignore"):
        u, v = one / np.abs(one).max(), other / np.abs(other).max()
        u, v = u / _length(u), v / _length(v)
    return 2 * math.atan2(_length(u - v), _length(u + v))


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
        signs = flipped(ours, answer.times(sign), ours.agree(answer.times(sign), ours.values))
        if 0 < signs.sum() < max(2, ours.nonzero.sum()):
            yield Finding("sign_error", listed(map(_place, np.flatnonzero(signs).tolist()))), True


def _resized(key: Key, answer: Typed) -> Typed:
    """The answer with the length of the right vector."""
    with np.errstate(all="ignore"):
        pairs = zip(answer.values, key.reference.values, strict=True)
        rows = [mine / _length(mine) * _length(own) for mine, own in pairs]
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
    for what, code, mistaken in _mistaken(key):
        typed = ours.typed(mistaken)
        if not _is_right(key, typed):
            found = one_of(_causes(key, typed), _descriptions(key, typed))
            if found is not None and found.code == code:
                yield Example(what, as_typed(mistaken), code)


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
