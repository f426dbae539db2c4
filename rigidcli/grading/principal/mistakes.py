"""Principal axes under the mistakes that people make, and under those that an answer itself suggests."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from math import isfinite, log10, pi
from typing import TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.principal import pairs
from rigidcli.grading.principal.eigen import Eigen, solve
from rigidcli.grading.principal.key import Key
from rigidcli.grading.principal.pairs import Pairs

NO_FACTOR = 0.1
"""A common factor as near to 1 as this is no mistake with a name."""

POWER_SLACK = 1e-2
"""How near a factor must be to a power of ten to be tried as one."""

FACTORS = (2.0, 3.0, 4.0, 5.0, 6.0, 12.0, 3 / 2, 4 / 3, 5 / 3, 5 / 2, pi, 2 * pi)
"""The factors that are named, as are their inverses, where one moment is all there is to tell them from."""

Explanation: TypeAlias = tuple[str, tuple[Sequence[Eigen], Sequence[Pairs]]]
"""The code of a mistake, with the solutions under it and the answer, both at each point."""


def explanations(key: Key, told: Sequence[Pairs]) -> Iterator[Explanation]:
    """What an answer of three pairs should be under each mistake: a solution, and with the axes so read."""
    if len(told[0]) != 3 or not all(each.units.any(axis=1).all() for each in told):
        return
    for code, eigens in key.mistaken:
        yield code, (eigens, told)
    yield "transposed", (key.eigens, [_transposed(each) for each in told])
    for code, factor in _factors(key.eigens[0], told[0].moments):
        tensors = [eigen.tensor * factor for eigen in key.eigens]
        if all(tensor.any() and np.isfinite(tensor).all() for tensor in tensors):
            solved = [solve(tensor, key.question.tolerance, key.angle) for tensor in tensors]
            yield code, (solved, told)


def _transposed(told: Pairs) -> Pairs:
    axes = told.axes.T
    return pairs.of(axes if told.moments is None else np.column_stack([told.moments, axes]))


def _factors(eigen: Eigen, moments: Floats | None) -> Iterator[tuple[str, float]]:
    """The common factor that moments may have, as the mistake that it is."""
    if moments is None:
        return
    factor = _largest(moments) / _largest(eigen.moments)
    if not isfinite(factor) or factor == 0 or abs(factor - 1) <= NO_FACTOR:
        return
    if abs(factor + 1) <= NO_FACTOR:
        yield "sign_error", -1.0
        return
    power = round(log10(abs(factor)))
    if abs(factor / 10.0**power - 1) <= POWER_SLACK:
        yield "power_of_ten", 10.0**power
        return
    different = len([space for space in eigen.spaces if eigen.moments[space[0]] != 0])
    named = [
        exact for size in FACTORS for exact in (size, 1 / size) if abs(factor / exact - 1) <= NO_FACTOR / 10
    ]
    for exact in [factor] if different > 1 else named:
        yield "constant_factor", exact


def _largest(moments: Floats) -> float:
    return float(moments[np.abs(moments).argmax()])
