"""Exact principal moments and axes: the characteristic polynomial factored, never solved by iteration."""

from __future__ import annotations

from dataclasses import replace
from functools import cmp_to_key
from itertools import combinations
from typing import Any

import numpy as np
import sympy
from sympy.functions.elementary.trigonometric import TrigonometricFunction

from rigidcli.core.arithmetic import Array
from rigidcli.core.principal import PrincipalFrame, canonical_axes
from rigidcli.errors import ComputationError
from rigidcli.symbolic.algebra.arithmetic import EXACT
from rigidcli.symbolic.algebra.exact import tidy, tidy_array

MAX_OPERATIONS_WITH_ANGLES = 200
"""Of a discriminant in which sines and cosines are still to cancel."""


def principal_frame(tensor: Array) -> PrincipalFrame:
    """The exact principal frame of a symmetric tensor (3 by 3, sympy expressions, kg m^2).

    Raises ComputationError when the moments are roots of an irreducible cubic: their closed form takes cube
    roots of complex numbers, which is no answer to a question about a body.
    """
    moments = _moments(tensor)
    order, ordered = _ascending(moments)
    distinct: list[Any] = []
    groups: list[tuple[int, ...]] = []
    for index, moment in enumerate(order):
        if distinct and EXACT.sign(moment - distinct[-1]) == 0:
            groups[-1] = (*groups[-1], index)
        else:
            distinct.append(moment)
            groups.append((index,))
    one = np.array(sympy.eye(3).tolist(), dtype=object)
    projectors = []
    for moment in distinct:
        projector = one
        for other in distinct:
            if other is not moment:
                projector = tidy_array(projector @ (tensor - other * one) / (moment - other))
        projectors.append(projector)
    axes = tidy_array(canonical_axes(projectors, groups, _SIGN_FREE))
    return PrincipalFrame(np.array(order, dtype=object), axes, tuple(groups), ordered)


def _moments(tensor: Array) -> list[Any]:
    """The three roots of the characteristic polynomial."""
    coupled = [pair for pair in combinations(range(3), 2) if tidy(tensor[pair]) != 0]
    if not coupled:
        return [tidy(tensor[k, k]) for k in range(3)]
    if len(coupled) == 1:
        ((i, j),) = coupled
        (alone,) = {0, 1, 2} - {i, j}
        trace = tensor[i, i] + tensor[j, j]
        product = tensor[i, i] * tensor[j, j] - tensor[i, j] ** 2
        return [tidy(tensor[alone, alone]), *_quadratic(1, -trace, product)]
    unknown = sympy.Dummy("lambda")
    matrix = sympy.Matrix(tensor.tolist())
    trace, minors = matrix.trace(), (matrix.trace() ** 2 - (matrix * matrix).trace()) / 2
    polynomial = sympy.expand(unknown**3 - trace * unknown**2 + minors * unknown - matrix.det())
    roots: list[Any] = []
    for factor, multiplicity in sympy.factor_list(polynomial, unknown)[1]:
        coefficients = sympy.Poly(factor, unknown).all_coeffs()
        if len(coefficients) == 4:
            raise ComputationError(
                "the principal moments have no exact form in square roots",
                hint="leave out `--exact` and give every parameter a value",
            )
        found = [-coefficients[1] / coefficients[0]] if len(coefficients) == 2 else _quadratic(*coefficients)
        roots += [tidy(root) for root in found] * multiplicity
    return roots


def _quadratic(a: Any, b: Any, c: Any) -> list[Any]:
    discriminant = sympy.factor(tidy(b**2 - 4 * a * c))
    if discriminant.has(TrigonometricFunction) and discriminant.count_ops() < MAX_OPERATIONS_WITH_ANGLES:
        discriminant = sympy.trigsimp(discriminant)
    root = _root_of_either_sign(discriminant)
    return [tidy((-b - root) / (2 * a)), tidy((-b + root) / (2 * a))]


def _root_of_either_sign(x: Any) -> Any:
    """A square root whose sign is free: of x^2 simply x, where sympy's own root is |x|."""
    return sympy.sqrt(x).replace(sympy.Abs, lambda inner: inner)


_SIGN_FREE = replace(EXACT, sqrt=_root_of_either_sign)


def _ascending(moments: list[Any]) -> tuple[list[Any], bool]:
    """The moments in ascending order, and whether that is their order for all values of the symbols."""
    doubtful = []

    def compare(first: Any, second: Any) -> int:
        difference = tidy(first - second)
        if difference.is_nonnegative or difference.is_nonpositive:
            # Nought at most where a symbol is nought, like 8 m a^2: the order holds all the same.
            return int(difference != 0) * (1 if difference.is_nonnegative else -1)
        sign = EXACT.sign(difference)
        if sign is None:
            doubtful.append(difference)
            sign = 1 if EXACT.size(difference) > 0 else -1
        return sign

    ordered = sorted(moments, key=cmp_to_key(compare))
    return ordered, not doubtful
