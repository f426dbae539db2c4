"""The pairs that solve the eigen-problem of a key, in entries; and proofs that an answer does so, too."""

from __future__ import annotations

import numpy as np

from rigidcli.core.arithmetic import Array
from rigidcli.errors import ExpressionError, RigidError
from rigidcli.grading.arrays.entries import times, worked
from rigidcli.grading.arrays.keys import computed
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.principal.eigen import Answer
from rigidcli.grading.principal.key import Key
from rigidcli.grading.proofs import agree, are_numbers, exact, simple


def solution(key: Key) -> Array | None:
    """The answer (3 by 4), if its form is known: in numbers, or as the key, the report or algebra has it."""
    ours = key.reference
    if not ours.names:
        return key.eigen.solution
    if ours.shape == (3, 3):
        return _solved_exactly(key)
    pairs = _arranged(ours.entries, ours)
    if are_numbers(pairs[:, 1:]):
        pairs[:, 1:] = key.typed(pairs).units[0]
    return pairs


def _solved_exactly(key: Key) -> Array | None:
    """The moments and axes of a tensor in symbols, if they are short."""
    from rigidcli.mechanics.principal_axes import principal_frame

    try:
        frame = principal_frame(exact(key.reference, key.reference.entries))
        return _arranged(computed(np.column_stack([frame.moments, frame.axes])), key.reference)
    except RigidError:
        return None


def _arranged(pairs: Array, key: Reference) -> Array:
    """Pairs (3 by 4) with moments that ascend, and right-handed axes, both at the first point."""
    values = worked(pairs, key.points)[0]
    order = values[:, 0].argsort(kind="stable")
    pairs = pairs[order].copy()
    if np.linalg.det(values[order, 1:]) < 0:
        pairs[2, 1:] = times(pairs[2, 1:], -1)
    return pairs


def is_proved(key: Key, answer: Answer, places: np.ndarray) -> bool:
    """Whether three pairs that solve the problem at all points do so whatever values the symbols have.

    Moments must be those of their solutions (`places`), but for rounded coefficients, and axes in symbols at
    right angles to the axes of other moments.
    """
    if answer.entries is None or are_numbers(answer.entries):
        return True
    if key.solution is None:
        return False
    signs = (1,) if "real" not in (key.question.symbols or {}).values() else ()
    try:
        told, right = exact(key.reference, answer.entries), exact(key.reference, key.solution)
        for row, slot in zip(told, places[0], strict=True):
            others = right[~key.eigen.same[0, slot], 1:]
            axis, moment = row[-3:], row[0] if len(row) == 4 else right[slot, 0]
            zeros = [axis @ other for other in others] if any(entry.names for entry in axis) else []
            if zeros and key.question.normalized == "required":
                zeros.append(axis @ axis - 1)
            same = agree(moment, right[slot, 0], key.question.tolerance, signs=signs)
            if not same or any(simple(each).terms for each in zeros):
                return False
    except ExpressionError:
        return False
    return True
