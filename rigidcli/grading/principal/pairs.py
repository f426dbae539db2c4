"""Pairs of a moment and an axis, as they are read from answers and from literal keys."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from math import hypot

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import shortfall
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.codes import CODES
from rigidcli.grading.numbers import ROUNDING, read_list, read_number, unit_of
from rigidcli.grading.outcome import Finding, Unreadable

UNIT = unit_of("kg m^2")

MOST = 6
"""Pairs of an answer; there are three, but an equal moment may be told too often."""

KEY_SLACK = 1e-2
"""How far a key that is typed with few digits may miss the laws, in units of its largest entry."""

NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Moments (n, kg m^2), axes (n by 3) as typed, their lengths (n), and unit vectors along them (n by 3).

    Where the length is zero, so is the unit vector.
    """

    moments: Floats
    axes: Floats
    lengths: Floats
    units: Floats


def of(moments: Floats, axes: Floats) -> Pairs:
    """Pairs of moments (n) and axes (n by 3)."""
    lengths = np.array([hypot(*axis) for axis in axes])
    # First by the largest component, so that squares stay within floats.
    largest = np.abs(axes).max(axis=1, keepdims=True)
    shorter = axes / np.where(largest > 0, largest, 1.0)
    norms = np.linalg.norm(shorter, axis=1, keepdims=True)
    return Pairs(moments, axes, lengths, shorter / np.where(norms > 0, norms, 1.0))


def read(answer: Tree) -> Pairs:
    """A list of `{moment, axis}`, or `{moments, axes}` with axes in rows. Raises Unreadable."""
    if isinstance(answer, dict) and set(answer) == {"moments", "axes"}:
        answer = _zipped(answer["moments"], answer["axes"])
    if not isinstance(answer, list):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of `{{moment, axis}}`")
    if len(answer) > MOST:
        raise Unreadable("wrong_shape", f"read {len(answer)} pairs of a moment and an axis")
    moments, axes = np.empty(len(answer)), np.empty((len(answer), 3))
    for k, pair in enumerate(answer):
        if not isinstance(pair, dict) or set(pair) != {"moment", "axis"}:
            detail = f"read {shown(pair)}, expected a mapping with `moment` and `axis`"
            raise Unreadable("wrong_shape", detail, place=f"pair {k + 1}")
        moments[k] = read_number(pair["moment"], UNIT, f"moment {k + 1}")
        axes[k] = read_list(pair["axis"], None, 3, f"axis {k + 1}")
    return of(moments, axes)


def _zipped(moments: Tree, axes: Tree) -> Tree:
    if not isinstance(moments, list) or not isinstance(axes, list) or len(moments) != len(axes):
        raise Unreadable("wrong_shape", "expected a list of `moments`, and as many `axes`")
    return [{"moment": moment, "axis": axis} for moment, axis in zip(moments, axes, strict=True)]


def written(moments: Floats, axes: Floats) -> Tree:
    """Pairs as a student types them, to all digits."""
    return [
        {"moment": repr(float(moment)), "axis": [repr(float(component)) for component in axis]}
        for moment, axis in zip(moments, axes, strict=True)
    ]


# --- keys


def numbers(value: object) -> Floats | None:
    """A number or an array as floats; None for what depends on symbols without a value."""
    try:
        return None if value is None else np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        return None


def reported_tensor(report: Mapping[str, object]) -> Floats:
    """The tensor (3 by 3, kg m^2) of a report, or the one with its moments and axes."""
    tensor, moments, axes = (numbers(report.get(name)) for name in ("tensor", "moments", "axes"))
    if tensor is not None:
        return tensor
    if moments is None or axes is None:
        raise ValueProblem("there are no principal axes in numbers")
    return np.array(axes.T * moments @ axes)


def are_in(key: Tree) -> bool:
    """Whether a literal key has pairs, not a tensor."""
    return isinstance(key, list) or (isinstance(key, dict) and "moments" in key)


def literal_tensor(key: Tree) -> Floats:
    """The tensor (3 by 3, kg m^2) of a key `{tensor: ...}`, or the one with its pairs."""
    try:
        if are_in(key):
            return _tensor_of_pairs(read(key))
        whole = isinstance(key, dict) and set(key) == {"tensor"}
        tensor = _tensor(key["tensor"] if whole else key)
    except Unreadable as unreadable:
        # Without its detail, which repeats what was typed.
        raise ValueProblem(Finding(unreadable.finding.code, unreadable.finding.place).message()) from None
    failure = shortfall(tensor)
    if failure is not None and failure[1] > KEY_SLACK * np.abs(tensor).max():
        raise ValueProblem("no body has this inertia tensor")
    return tensor


def _tensor(key: Tree) -> Floats:
    if isinstance(key, dict) and set(key) == set(NAMES):
        xx, yy, zz, xy, xz, yz = (read_number(key[name], UNIT, name) for name in NAMES)
        return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    if not isinstance(key, list) or len(key) != 3:
        raise ValueProblem(f"expected three rows of a tensor, or {', '.join(NAMES)}")
    tensor = np.array([read_list(row, UNIT, 3, f"row {k + 1}") for k, row in enumerate(key)])
    if np.abs(tensor - tensor.T).max() > ROUNDING * np.abs(tensor).max():
        raise ValueProblem(CODES["not_symmetric"])
    return tensor


def _tensor_of_pairs(pairs: Pairs) -> Floats:
    """I from I e = lambda e for three axes, which need be at right angles only where the moments differ."""
    if len(pairs.moments) != 3:
        raise ValueProblem("expected three pairs of a moment and an axis")
    if np.linalg.svd(pairs.units, compute_uv=False)[2] < KEY_SLACK:
        raise ValueProblem(CODES["axes_dependent"])
    tensor = np.array(np.linalg.solve(pairs.units, pairs.moments[:, None] * pairs.units), dtype=np.float64)
    if np.abs(tensor - tensor.T).max() > KEY_SLACK * np.abs(tensor).max():
        raise ValueProblem(CODES["axes_not_orthogonal"])
    half: Floats = (tensor + tensor.T) / 2
    return half
