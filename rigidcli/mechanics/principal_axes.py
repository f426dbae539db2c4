"""Exact principal moments and axes: the characteristic polynomial factored, never solved by iteration.

A tensor that has been turned keeps its moments, and its axes turn with it. So the moments are those of the
tensor in the body's own axes, where its entries are short.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cmp_to_key
from itertools import combinations, pairwise

import numpy as np

from rigidcli.algebra import arithmetic, matrices
from rigidcli.algebra.arithmetic import sign, size, sqrt, tidy, tidy_array
from rigidcli.algebra.atoms import Surd
from rigidcli.algebra.expressions import PI, ZERO, Expr, symbol
from rigidcli.algebra.functions import apply
from rigidcli.core.arithmetic import Array
from rigidcli.core.principal import PrincipalFrame, canonical_axes
from rigidcli.errors import ComputationError, ExpressionError

MOST_NODES = 250  # the most nodes of a component of an axis, in the body's axes: a dozen lines of text
MOST_NODES_OF_MOMENT = 50  # the most nodes of a moment: it stands several times in each component
MOMENT = symbol("moment s")  # the variable of characteristic polynomials: no name in a document has a blank

_ONE = tidy_array(np.eye(3, dtype=object))


def principal_frame(tensor: Array, turn: Array = _ONE) -> PrincipalFrame:
    """The exact principal frame of a symmetric tensor (3 by 3, kg m^2), with axes turned by `turn` (3 by 3).

    Raises ComputationError where moments are roots of a cubic with symbols, or axes are too long.
    """
    try:
        return _principal_frame(tensor, turn)
    except ExpressionError as error:
        raise ComputationError(
            f"the exact principal moments and axes are too long to print: {error.message}"
        ) from error


def _principal_frame(tensor: Array, turn: Array) -> PrincipalFrame:
    tensor = tidy_array(tensor)
    factor, rest = arithmetic.common_factor(tensor)
    if factor.names and sign(factor) == 1 and not any(entry.names for entry in rest.flat):
        # Of M times numbers, such as the box 1 x 2 x 3 of mass M, the numbers alone have to be solved.
        frame = _principal_frame(rest, turn)
        return frame._replace(moments=tidy_array(factor * frame.moments))
    _require_short(tensor, "moments")
    roots: list[Expr] = []
    for block in matrices.blocks(tensor.tolist()):
        shifted = matrices.part((tensor - MOMENT * _ONE).tolist(), block, block)
        for polynomial, times in arithmetic.polynomial_factors(matrices.determinant(shifted), str(MOMENT)):
            roots += _real_roots(*(polynomial.get(k, ZERO) for k in range(4))) * times
    moments, ordered = _ascending(roots)
    _require_short(np.array(moments), "moments", MOST_NODES_OF_MOMENT)
    ends = [0, *(k for k in (1, 2) if sign(moments[k] - moments[k - 1]) != 0), 3]
    groups = [tuple(range(begin, end)) for begin, end in pairwise(ends)]
    axes = _axes(tensor, moments, groups, turn)
    return PrincipalFrame(np.array(moments, dtype=object), axes, tuple(groups), ordered)


def _real_roots(d: Expr, c: Expr, b: Expr, a: Expr) -> list[Expr]:
    """The roots of a x^3 + b x^2 + c x + d, where they are real; of a quadratic the one with -sqrt first.

    Those of a cubic without symbols are -b/(3a) + 2 sqrt(p) cos((acos(q/p^(3/2)) + 2 pi j)/3), ascending for
    j = 1, 2, 0. Source: O. K. Smith, Communications of the ACM 4 (1961) 168. Raises ExpressionError for a
    cubic with symbols, whose roots fill pages.
    """
    if not a:
        if not b:
            return [tidy(-d / c)]
        root = arithmetic.root_of_either_sign(c**2 - 4 * b * d)
        return [tidy((-c - root) / (2 * b)), tidy((-c + root) / (2 * b))]
    p = tidy((b**2 - 3 * a * c) / (9 * a**2))
    b, c, d = (e / a for e in (b, c, d))
    if p.names or (q := tidy((9 * b * c - 2 * b**3 - 27 * d) / 54)).names:
        raise ExpressionError("they are roots of a cubic with symbols")
    radius = sqrt(p)
    angle = apply("acos", tidy(q / radius**3)) / 3
    return [2 * radius * apply("cos", angle + 2 * PI * j / 3) - tidy(b) / 3 for j in (1, 2, 0)]


def _require_short(array: Array, what: str, most: int = MOST_NODES) -> None:
    if max(entry.nodes for entry in array.flat) > most:
        raise ComputationError(f"the exact principal {what} are too long to print")


def _ascending(moments: Sequence[Expr]) -> tuple[list[Expr], bool]:
    """The moments in ascending order, and whether that is their order for all values of the symbols."""
    doubtful = []

    def compare(first: Expr, second: Expr) -> int:
        order = arithmetic.weak_sign(first - second)
        if order is not None:
            return order[0]
        is_larger = size(first - second) > 0
        doubtful.append(first if is_larger else second)
        return 1 if is_larger else -1

    *lower, highest = sorted(moments, key=cmp_to_key(compare))
    # The highest moment of a lamina is the sum of the others, whatever their symbols are.
    is_flat = bool(doubtful) and sign(highest - lower[0] - lower[1]) == 0
    return [*lower, highest], all(is_flat and moment == highest for moment in doubtful)


def _axes(tensor: Array, moments: Sequence[Expr], groups: Sequence[Sequence[int]], turn: Array) -> Array:
    """Rows e1, e2, e3 along those that `canonical_axes` makes of floats."""
    if len(groups) == 1:
        return _ONE
    rows = {g[0]: tidy_array(turn @ _eigenvector(tensor, moments, g[0])) for g in groups if len(g) == 1}
    known = {place: np.array(list(map(size, row))) for place, row in rows.items()}
    near = canonical_axes(np.array([known.get(place, np.zeros(3)) for place in range(3)]), groups)
    if len(groups) == 2:
        ((alone, axis),) = rows.items()
        first, second = (1, 2) if alone == 0 else (0, 1)
        # The coordinate axis that was projected on the plane across has the largest component there.
        pivot = int(np.argmax(np.abs(near[first])))
        across = _ONE[pivot] - axis[pivot] * axis
        rows[first] = tidy_array(across / sqrt(across[pivot]))
        rows[second] = tidy_array(np.cross(axis, rows[first]))
    signs = [sum(size(c) * x for c, x in zip(rows[k], near[k], strict=True)) for k in range(3)]
    return np.array([rows[k] if signs[k] > 0 else -rows[k] for k in range(3)])


def _eigenvector(tensor: Array, moments: Sequence[Expr], index: int) -> Array:
    """The unit vector along the axis of a moment that no other one equals; its sign is free."""
    axis = _unit_vector(tensor, moments[index], *_square(tensor, moments, index))
    _require_short(axis, "axes")
    if any(np.isnan(size(component)) for component in axis):
        # Differences of almost equal roots, of which floats cannot tell which is larger.
        message = "the exact principal axes have components too close to zero to tell their signs"
        raise ComputationError(message)
    return axis


def _square(tensor: Array, moments: Sequence[Expr], index: int) -> tuple[Array, Expr]:
    """The matrix e e^T of the axis e of a moment, times a factor, and that factor.

    Where the other two moments are both mu, it is I - mu, and the factor lambda - mu. Else, with B = I - t/3,
    nu = lambda - t/3 and q = tr(B^2)/2, it is the adjugate of I - lambda, B^2 + nu B + nu^2 - q, and the
    factor 3 nu^2 - q.
    """
    moment, other = moments[index], moments[index - 1]
    if sign(moments[index - 2] - other) == 0:
        return tidy_array(tensor - other * _ONE), tidy(moment - other)
    mean = tensor.trace() / 3
    rest, offset = tidy_array(tensor - mean * _ONE), tidy(moment - mean)
    half = tidy((rest * rest).sum() / 2)
    return rest @ rest + offset * rest + (offset**2 - half) * _ONE, tidy(3 * offset**2 - half)


def _unit_vector(tensor: Array, moment: Expr, square: Array, factor: Expr) -> Array:
    """The axis e of a moment, from `square` = `factor` e e^T."""
    pivot = max(range(3), key=lambda k: abs(size(square[k, k])))
    row = tidy_array(square[pivot])
    _require_short(row, "axes")
    products = [tensor[pair] for pair in combinations(range(3), 2) if tensor[pair] != 0]
    is_plane = len(products) == 1 and sign(products[0]) is not None
    has_signs = not any(entry.names for entry in row)
    if is_plane or (has_signs and all(isinstance(atom, Surd) for atom in moment.everywhere())):
        # Square roots of the squares are short: sqrt(2 - sqrt(2))/2 for sin(pi/8), or, where two axes alone
        # have a product of inertia, cos^2 = (lambda - Ijj)/(2 lambda - Iii - Ijj). A root forgets the sign of
        # a component, so that this is no way where a symbol decides it.
        roots = [sqrt(tidy(square[k, k] / factor)) for k in range(3)]
        return np.array([root if size(entry) > 0 else -root for root, entry in zip(roots, row, strict=True)])
    axis = row / arithmetic.root_of_either_sign(row[pivot] * factor)
    _require_short(axis, "axes", 2 * MOST_NODES)  # what is longer does not shrink so much
    return tidy_array(axis)
