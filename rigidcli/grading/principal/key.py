"""What a question for principal axes is judged by: the solution, and what mistakes make of it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from itertools import permutations
from math import isfinite, log10, pi

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.core.tensor import point_tensor, rotate
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.numbers import ROUNDING
from rigidcli.grading.principal import pairs
from rigidcli.grading.principal.eigen import Eigen, default_angle, match, solve
from rigidcli.grading.principal.pairs import Pairs
from rigidcli.grading.question import Question

NO_FACTOR = 0.1
"""A common factor as near to 1 as this is no mistake with a name."""

POWER_SLACK = 1e-2
"""How near a factor must be to a power of ten to be tried as one."""

FACTORS = (2.0, 3.0, 4.0, 5.0, 6.0, 12.0, 3 / 2, 4 / 3, 5 / 3, 5 / 2, pi, 2 * pi)
"""The factors that are named, as are their inverses, where one moment is all there is to tell them from."""

LARGEST_ANGLE = 0.5
"""An angle (rad) that a question may allow to an axis; what is more was hardly meant in radians."""

SMALLEST, LARGEST = 1e-290, 1e290
"""The range (kg m^2) in which the largest entry of a tensor must be."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The solution, how far off an axis may be in angle (rad) and length, and what mistakes lead to."""

    question: Question
    eigen: Eigen
    angle: float
    length: float
    mistaken: tuple[tuple[str, Eigen], ...]


def read_key(asked: Asked) -> Key:
    """The solution for the tensor of a report, for a literal one, or for the one with literal pairs."""
    question, tolerance = asked.question, asked.question.tolerance
    if tolerance.figures != "value":
        raise ValueProblem("is for numbers and quantities", path=("tolerance", "figures"))
    if tolerance.angle is not None and tolerance.angle > LARGEST_ANGLE:
        raise ValueProblem(f"is in radians, expected at most {LARGEST_ANGLE}", path=("tolerance", "angle"))
    report = asked.report
    tensor = pairs.literal_tensor(asked.value) if report is None else pairs.reported_tensor(report)
    # Nor may ten times as much, or its parts, be beyond floats.
    if not SMALLEST <= np.abs(tensor).max() <= LARGEST:
        raise ValueProblem(f"expected moments of any size from {SMALLEST:g} to {LARGEST:g} kg m^2")
    usual = default_angle(tolerance)
    angle = max(tolerance.angle or usual, ROUNDING)
    eigen = solve(tensor, tolerance, angle)
    if report is None and pairs.are_in(asked.value):
        typed = pairs.read(asked.value)
        if not match(eigen, typed.moments, typed.units).complete:
            raise ValueProblem("the axes are less precise than the tolerance")
    mistaken = [
        (code, solve(other, tolerance, angle)) for code, other in _mistaken(tensor, asked) if other.any()
    ]
    return Key(question, eigen, angle, max(angle, usual), tuple(mistaken))


def _mistaken(tensor: Floats, asked: Asked) -> Iterator[tuple[str, Floats]]:
    """The tensors (3 by 3) whose moments and axes come out under each mistake."""
    diagonal = np.diag(tensor.diagonal())
    yield "products_of_inertia_sign", 2 * diagonal - tensor
    yield "products_of_inertia_missing", diagonal
    for order in list(permutations(range(3)))[1:]:
        yield "axes_permuted", tensor[np.ix_(order, order)]
    if asked.document is not None and asked.document.frame is not None:
        frame = pairs.numbers(asked.document.axes)
        if frame is not None:
            # Not turned at all, and turned the other way.
            yield "other_frame", rotate(tensor, frame)
            yield "other_frame", rotate(tensor, frame @ frame)
    report: Mapping[str, object] = asked.report or {}
    mass, com, about, central = (
        pairs.numbers(report.get(name)) for name in ("mass", "center_of_mass", "about", "tensor_com")
    )
    if mass is None or com is None or about is None or central is None:
        return
    shift = mass * point_tensor(com - about)
    yield "parallel_axis_missing", central
    yield "parallel_axis_sign", central - shift
    yield "parallel_axis_off_diagonal_missing", central + np.diag(shift.diagonal())


# --- named mistakes of an answer


def explanations(key: Key, told: Pairs) -> Iterator[tuple[str, tuple[Eigen, Floats]]]:
    """What an answer of three pairs should be under each mistake: a solution, and with the axes so read."""
    if len(told.moments) != 3 or not told.units.any(axis=1).all():
        return
    for code, eigen in key.mistaken:
        yield code, (eigen, told.units)
    yield "transposed", (key.eigen, pairs.of(told.moments, told.axes.T).units)
    for code, factor in _factors(key.eigen, told.moments):
        tensor = key.eigen.tensor * factor
        if tensor.any():
            yield code, (solve(tensor, key.question.tolerance, key.angle), told.units)


def _factors(eigen: Eigen, moments: Floats) -> Iterator[tuple[str, float]]:
    """The common factor that moments may have, as the mistake that it is."""
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
