"""Inertia tensors: under the mistakes that people make, worked out anew from the body, and what no body has.

Products of inertia have a minus sign, Ixy = -sum m x y, unless a question says `products: plus`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from itertools import permutations
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import point_tensor, rotate
from rigidcli.grading.arrays.entries import worked
from rigidcli.grading.arrays.keys import computed
from rigidcli.grading.arrays.reference import Reference, Typed
from rigidcli.grading.asked import Asked
from rigidcli.grading.numbers import margin

EYE = np.eye(3)

OTHER_PRODUCTS = 2 * EYE - 1
"""By what a tensor is multiplied to have its products of inertia in the other convention."""

ROUNDED = 3
"""By how many tolerances moments may be off when each entry of a tensor is off by one."""

COINCIDENCE = 10
"""Equal moments tell that axes differ where the square of the difference is above so many tolerances."""

NEEDED = ("mass", "center_of_mass", "about", "tensor", "tensor_com")
"""Results without which the parallel-axis theorem cannot be applied."""


def convention(key: Reference) -> Floats:
    """What turns a tensor from the convention that is asked to the usual one, and back (3 by 3)."""
    return OTHER_PRODUCTS if key.question.products == "plus" else np.ones((3, 3))


def mistaken_tensors(asked: Asked, values: Floats, key: Reference) -> Iterator[tuple[str, Floats]]:
    """Codes with the tensors (k by 3 by 3, kg m^2) that come out under them, instead of the right `values`.

    All are at the points of the key, and with the usual signs.
    """
    yield "products_of_inertia_sign", values * OTHER_PRODUCTS
    yield "products_of_inertia_missing", values * EYE
    permuted = [values[:, order][:, :, order] for order in permutations(range(3))]
    yield from (("axes_permuted", each) for each in permuted[1:])
    if asked.document is None:
        return
    if asked.document.frame is not None:
        axes = worked(computed(asked.document.physical.axes), key.points)
        unturned = np.array([rotate(*each) for each in zip(values, axes, strict=True)])
        # A turn that only exchanges axes is told as that.
        largest = np.abs(values).max(axis=(1, 2), keepdims=True)
        if not any((np.abs(unturned - each) <= margin(largest, key.tolerance)).all() for each in permuted):
            yield "other_frame", unturned
    report = asked.report.tree() if asked.report is not None else {}
    if all(report.get(name) is not None for name in NEEDED):
        yield from _shifted(report, key, about_com=asked.path[-1] == "tensor_com")


def _shifted(report: Mapping[str, Any], key: Reference, *, about_com: bool) -> Iterator[tuple[str, Floats]]:
    """Steiner's parallel-axis theorem left out, with the wrong sign, and of the diagonal only."""
    mass, com, about, asked, central = (worked(computed(report[name]), key.points) for name in NEEDED)
    term = mass[:, np.newaxis, np.newaxis] * np.array([point_tensor(d) for d in about - com])
    start, sign = (asked, -1) if about_com else (central, 1)
    if not about_com:
        yield "parallel_axis_missing", central
    yield "parallel_axis_sign", start - sign * term
    yield "parallel_axis_off_diagonal_missing", start + sign * term * EYE


def turned(key: Reference, answer: Typed) -> Iterator[Reference]:
    """The key along the axes of an answer that has its moments, and is too far from it for this to be chance.

    A small wrong entry changes the moments by its square over their differences only.
    """
    signs = convention(key)
    with np.errstate(over="ignore", invalid="ignore"):
        for k in answer.rows:
            mine, own = answer.values[k], key.values[k]
            distance, largest = float(np.abs(mine - own).max()), float(np.abs(own).max())
            if not distance > math.sqrt(COINCIDENCE * key.slack) * largest:
                return
            right = moments_of(own * signs)
            gaps = np.abs(moments_of(mine * signs) - right)
            if not (gaps <= margin(np.maximum(np.abs(right), key.slack * largest), key.tolerance)).all():
                return
    yield key.valued(answer.values)


def moments_of(tensor: Floats) -> Floats:
    """The principal moments (3, ascending) of the symmetric part of a tensor (3 by 3); NaN if it has any."""
    scale = float(np.abs(tensor).max())
    if not np.isfinite(scale) or not scale:
        return np.full(3, scale)
    symmetric = tensor / scale / 2 + tensor.T / scale / 2
    with np.errstate(over="ignore"):
        return np.asarray(np.linalg.eigvalsh(symmetric) * scale)


def impossible(moments: Floats, key: Reference) -> str | None:
    """The code for moments (3) that no body has, allowing for rounding within the tolerance.

    None where a body has them, or where the right ones are not those of a body either.
    """
    right = [row if row.ndim == 1 else moments_of(row * convention(key)) for row in key.values]
    return None if any(_fails(each, key) for each in right) else _fails(moments, key)


def _fails(moments: Floats, key: Reference) -> str | None:
    if not np.isfinite(moments).all():
        return None
    low, middle, high = sorted(moments.tolist())
    slack = ROUNDED * margin(max(abs(low), abs(high)), key.tolerance)
    if low < -slack:
        return "not_physical"
    return "triangle_inequality" if high - low - middle > ROUNDED * slack else None
