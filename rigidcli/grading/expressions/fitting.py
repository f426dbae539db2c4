"""Numbers for which an expression becomes another one: found by least squares, to be proved afterwards."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.expressions.estimate import Estimate
from rigidcli.grading.expressions.formula import Points
from rigidcli.symbolic.language.tree import Node

MOST_UNKNOWN = 12

MOST_TRIALS = 24

PATIENCE = 3
"""Trials that bring nothing, each with half the step of the one before; then the search is given up."""

BETTER = 0.9
"""By which a trial must reduce what is left."""

STEP = 1e-4
"""Of the differences that stand for slopes, where the whole range is 2."""

ROUNDING = 1e-13
"""Relative difference that is rounding."""

CLOSE = 1e-6
"""Relative difference above which nothing was found."""

LEAST_POINTS = 6


def fitted(
    tree: Node,
    points: Points,
    unknown: Mapping[str, Callable[[Floats], Floats]],
    target: Estimate,
    size: Floats,
    *,
    constant: bool = False,
    relative: float | None = None,
    stride: float = 1.0,
) -> dict[str, float] | None:
    """Values of the `unknown` names for which a tree has the values of the target, but for a `constant`.

    Each is a function of a number from -1 to 1, of which the middle is tried first, and which is changed by
    a `stride` at most. `size` is that of what is compared: of values at all points, or of changes within
    the pairs of an `agreement.Probe`. By the method of Gauss and Newton, with shorter steps where it leads
    away, and within the ranges. None where no values are near, by the tolerance `relative` to the size.
    """
    n, names = len(unknown), list(unknown)
    if not 0 < n <= MOST_UNKNOWN:
        return None

    def known(place: Floats) -> dict[str, Floats]:
        return {name: unknown[name](each) for name, each in zip(names, place.T, strict=True)}

    best, step, nearest, failed = np.zeros(n), np.zeros(n), np.inf, 0
    for _ in range(MOST_TRIALS):
        place = np.clip(best + step, -1.0, 1.0)
        tried = np.vstack([place, place + STEP * np.eye(n)])
        many = points.repeated(n + 1).but(
            {name: np.repeat(value, points.count) for name, value in known(tried).items()}
        )
        rows = np.asarray(many.at(tree).value, dtype=np.float64).reshape(n + 1, points.count)
        with np.errstate(all="ignore"):
            gaps = rows - target.value
            if constant:
                half = points.count // 2
                gaps = gaps[:, :half] - gaps[:, half:]
            gaps = gaps / size
        gaps = gaps[:, np.isfinite(gaps).all(axis=0)]
        if gaps.shape[1] < LEAST_POINTS:
            return None
        gap = float(np.sqrt(np.mean(gaps[0] ** 2)))
        if gap < BETTER * nearest:
            slopes = (gaps[1:] - gaps[0]).T / STEP
            change, *_ = np.linalg.lstsq(slopes, -gaps[0], rcond=None)
            best, step, nearest, failed = place, np.clip(change, -stride, stride), gap, 0
        else:
            step, failed = step / 2, failed + 1
        if nearest <= ROUNDING or failed == PATIENCE:
            break
    if nearest > max(CLOSE, relative or 0.0):
        return None
    return {name: float(value) for name, value in known(best).items()}
