"""The rule of A. Genz and A. Malik (J. Comput. Appl. Math. 6 (1980) 295) over many boxes at once."""

from __future__ import annotations

from collections.abc import Callable
from itertools import product
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Floats

BLOCK = 200_000
"""Points worked at a time, which bounds the memory."""


def blockwise(f: Callable[[Floats], Floats], points: Floats) -> Floats:
    """The values (c by n) of a function at points (d by n), some at a time."""
    size = points.shape[1]
    parts = [f(points[:, begin : begin + BLOCK]) for begin in range(0, size, BLOCK)]
    return np.concatenate(parts, axis=1)


class _Rule(NamedTuple):
    """Points (d by m) of a rule, from -1 to 1, its weights (m), and those of a rule of a lower degree (m)."""

    points: Floats
    weights: Floats
    lower: Floats
    fourth: Floats
    """Weights (d by m) of the fourth difference along each coordinate."""


def _genz_malik(depth: int) -> _Rule:
    """The rule of degree 7 with the one of degree 5 in it; for one coordinate, Gauss's of 15 and 7 nodes."""
    if depth == 1:
        (many, heavy), (few, light) = np.polynomial.legendre.leggauss(15), np.polynomial.legendre.leggauss(7)
        both = np.append(heavy / 2, 0 * few), np.append(0 * many, light / 2)
        return _Rule(np.append(many, few)[None], *both, np.zeros((1, 22)))
    near, far, corner = np.sqrt([9 / 70, 9 / 10, 9 / 19])
    unit = np.eye(depth)
    points: list[Floats] = [np.zeros(depth)]
    kinds = [0]
    for i in range(depth):
        points += [near * unit[i], -near * unit[i], far * unit[i], -far * unit[i]]
        kinds += [1, 1, 2, 2]
        for j in range(i):
            points += [far * (a * unit[i] + b * unit[j]) for a in (-1, 1) for b in (-1, 1)]
            kinds += [3] * 4
    points += [corner * np.array(signs) for signs in product((-1, 1), repeat=depth)]
    kinds += [4] * 2**depth
    d = depth
    weights = [
        (12824 - 9120 * d + 400 * d**2) / 19683,
        980 / 6561,
        (1820 - 400 * d) / 19683,
        200 / 19683,
        6859 / 19683 / 2**d,
    ]
    lower = [(729 - 950 * d + 50 * d**2) / 729, 245 / 486, (265 - 100 * d) / 1458, 25 / 729, 0.0]
    places = np.array(points).T
    # The fourth difference: of the near points less a seventh of that of the far ones, (9/70)/(9/10).
    fourth = np.zeros((depth, len(points)))
    fourth[:, 0] = -2 * (1 - 1 / 7)
    for column, kind in enumerate(kinds):
        if kind in (1, 2):
            fourth[np.flatnonzero(places[:, column])[0], column] = 1.0 if kind == 1 else -1 / 7
    return _Rule(places, np.array(weights)[kinds], np.array(lower)[kinds], fourth)


_RULES = {depth: _genz_malik(depth) for depth in (1, 2, 3)}


def over_boxes(f: Callable[[Floats], Floats], low: Floats, high: Floats) -> tuple[Floats, Floats, Floats]:
    """The integrals (c by n) over boxes, their errors (n), and the coordinate to halve each in (n)."""
    rule = _RULES[len(low)]
    half, middle = (high - low) / 2, (high + low) / 2
    points = (middle[:, :, None] + half[:, :, None] * rule.points[:, None]).reshape(len(low), -1)
    found = blockwise(f, points)
    values = np.where(np.isfinite(found), found, 0.0).reshape(len(found), low.shape[1], -1)
    sizes = (high - low).prod(axis=0)
    total = values @ rule.weights * sizes
    errors = np.abs(values @ rule.lower * sizes - total).max(axis=0)
    differences = np.abs(np.einsum("cnm,dm->cdn", values, rule.fourth)).max(axis=0)
    # Of equal differences the longest side is halved.
    return total, errors, np.argmax(differences * (1 + 1e-6 * half / half.max()) + 1e-300 * half, axis=0)
