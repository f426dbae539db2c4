"""Right and wrong answers, made from the key."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import ceil, cos, log10, sin
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.grading.arrays.mistakes import as_typed
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.principal.eigen import is_solved, match
from rigidcli.grading.principal.findings import OF_SET
from rigidcli.grading.principal.key import Key
from rigidcli.grading.principal.mistakes import explanations
from rigidcli.grading.principal.pairs import Pairs
from rigidcli.grading.principal.writing import mixed, written

OF_PAIRS = {"missing_axis", "multiplicity", "not_an_eigenvector"}
"""What may be wrong where no mistake explains it."""

Wrong: TypeAlias = tuple[str, Array, Array, str]
"""What a wrong answer is, its moments (n) and axes (n by 3) in entries, and the code of what is wrong."""


def examples(key: Key) -> Iterator[Example]:
    """The key, the same in other forms, and under the mistakes that change it; none where it is not known."""
    if key.solution is None:
        return
    moments, axes = key.solution[:, 0], key.solution[:, 1:]
    yield from _right(key, moments, axes)
    for what, told, along, code in _wrong(key, moments, axes):
        answer = along if key.alone else _paired(told, along)
        if _is_clear(key, key.typed(answer), code):
            yield Example(what, written(answer), code)


def _paired(moments: Array, axes: Array) -> Array:
    return np.column_stack([moments, axes])


def _is_clear(key: Key, told: Sequence[Pairs], code: str) -> bool:
    """Whether an answer is wrong in one way alone: no pair may be right by chance, nor for another reason."""
    found = match(key.eigens, told)
    expected = (code in OF_SET, code == "moment_axis_pairing", code == "multiplicity")
    if (found.complete, found.crossed, found.miscounted) != expected:
        return False
    if found.complete or found.crossed:
        return True
    named = {name for name, other in explanations(key, told) if is_solved(*other)}
    return named == (set() if code in OF_PAIRS else {code})


def _right(key: Key, moments: Array, axes: Array) -> Iterator[Example]:
    itself = written(_paired(moments, axes))
    if key.alone:
        yield Example("the axes", written(axes))
    yield Example("the key", itself)
    yield Example("moments and axes apart", {"moments": as_typed(moments), "axes": as_typed(axes)})
    mirrored = mixed(np.diag([-1.0, 1.0, -1.0]), axes)
    yield Example("two axes with the other sign", written(_paired(moments, mirrored)))
    places = max(ceil(-log10(key.angle)), 1)
    rounded = [round(entry, places) if isinstance(entry, float) else entry for entry in axes.flat]
    yield Example(
        "axes rounded", written(_paired(moments, np.reshape(np.array(rounded, dtype=object), (3, 3))))
    )
    if key.question.order == "free":
        yield Example("in another order", [itself[k] for k in (1, 2, 0)])
    if key.question.normalized == "optional":
        yield Example("axes of another length", written(_paired(moments, mixed(2.5 * np.eye(3), axes))))
    for space in key.eigens[0].spaces:
        if len(space) > 1:
            turned = mixed(_turn(space[0], space[-1], 0.6), axes)
            yield Example("other axes to moments that are not told apart", written(_paired(moments, turned)))


def _turn(one: int, other: int, angle: float) -> Floats:
    """What turns two of three axes in their plane (rad)."""
    turn = np.eye(3)
    turn[[one, other], [one, other]] = cos(angle)
    turn[one, other], turn[other, one] = sin(angle), -sin(angle)
    return turn


def _wrong(key: Key, moments: Array, axes: Array) -> Iterator[Wrong]:
    question, spaces, eye = key.question, key.eigens[0].spaces, np.eye(3)
    alone = next((space[0] for space in spaces if len(space) == 1), None)
    if alone is not None:
        rest = [k for k in range(3) if k != alone]
        yield "one pair left out", moments[rest], axes[rest], "missing_axis"
        yield "moments paired with other axes", moments, mixed(-eye[[2, 1, 0]], axes), "moment_axis_pairing"
        turned = mixed(_turn(alone, rest[0], 0.3), axes)
        yield "two axes turned out of their places", moments, turned, "not_an_eigenvector"
    plane = next((space for space in spaces if len(space) == 2), None)
    if plane is not None and alone is not None:
        told = moments.copy()
        told[1] = moments[alone]
        yield "another moment told twice", told, axes, "multiplicity"
    shared = next((space for space in spaces if len(space) > 1), None)
    if shared is not None:
        double, oblique = axes.copy(), axes.copy()
        double[shared[1]] = axes[shared[0]]
        yield "one axis told twice", moments, double, "axes_dependent"
        oblique[shared[1]] = mixed(_turn(shared[0], shared[1], 0.3), axes)[shared[0]]
        if question.orthogonal == "required":
            yield "axes that are not at right angles", moments, oblique, "axes_not_orthogonal"
    if question.normalized == "required":
        yield "axes of another length", moments, mixed(2 * eye, axes), "axis_not_normalised"
    if question.handed == "right":
        yield "a left-handed set", moments, mixed(-eye, axes), "left_handed"
    if question.order == "ascending" and alone is not None:
        yield "in descending order", moments[::-1], mixed(-eye[::-1], axes), "wrong_order"
    yield "moments twice as large", mixed(2 * eye, moments), axes, "constant_factor"
    yield "moments ten times as large", mixed(10 * eye, moments), axes, "power_of_ten"
    yield "moments with the other sign", mixed(-eye[::-1], moments), mixed(-eye[::-1], axes), "sign_error"
    yield "axes in columns", moments, axes.T, "transposed"
    if not key.reference.names:
        for code, (other,) in key.mistaken:
            yield f"worked with `{code}`", other.moments.astype(object), other.axes.astype(object), code
