"""The spectrum of linear motion in numbers.

Eigenvalues are worked out to some 70 digits, so that a zero mode differs from a slow one, and what neither
grows nor decays from what does, without any measure of rounding. Sources are those of `spectrum`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.values import enclosed
from rigidcli.core.arithmetic import Array
from rigidcli.core.elimination import echelon
from rigidcli.mechanics.linear_motion import LinearMotion, Root, Vector

BITS = 256
"""Bits of numbers: 77 digits, of which a double eigenvalue without a second vector leaves one half."""

ROUNDING = 1e-22
"""What is smaller than this, in units of the largest, is rounding; real modes are not so far apart."""

ROUNDING_OF_FLOATS = 1e-6
"""What is rounding where the equilibrium is known in floats: squares of rates have errors of some 1e-14."""

INDEPENDENT = 1e-8
"""Vectors of length 1 that depend on each other but for this, are parallel."""

NOISE = 1e-12
"""Entries of a vector below this, in units of its largest one, are zero."""


def numeric_spectrum(motion: LinearMotion, is_free: bool, rounding: float = ROUNDING) -> list[Root]:
    """The roots by ascending rates; the matrices are exact numbers.

    Raises:
        ZeroDivisionError: the mass matrix is singular.
    """
    from flint import arb, ctx

    with ctx.workprec(BITS):
        matrix, is_square = _companion(motion, is_free)
        is_paired, roots = is_free or is_square, list[Root]()
        # Of coordinates in different units, entries are compared in units of 1/sqrt(M_ii).
        sizes = [abs(enclosed(row[i], {}, BITS)) for i, row in enumerate(motion.masses)]
        weights = [size.sqrt() if size != 0 else arb(1) for size in sizes][: matrix.nrows()]
        for growth, angular, vectors in _eigenvalues(matrix, rounding, is_square, weights):
            if angular < 0 or (is_paired and growth < 0):
                continue
            rank = int((np.linalg.svd(vectors, compute_uv=False) > INDEPENDENT).sum())
            is_zero = not growth and not angular
            times = 2 * len(vectors) if is_square and is_zero else len(vectors)
            # With fewer vectors than there are equal roots, motion grows by powers of the time.
            whole = bool(growth) or rank == times
            stable = None if is_zero else growth < 0 or (not growth and whole)
            shown = tuple(_from_first(vectors, rank, np.array([float(weight) for weight in weights])))
            roots.append(Root(growth, angular, stable, None, times, whole, is_paired, shown))
    return sorted(roots, key=lambda root: (root.rate, root.angular))


def _companion(motion: LinearMotion, is_free: bool) -> tuple[Any, bool]:
    """A matrix whose eigenvalues are the roots; or their squares, where nothing depends on velocities."""
    from flint import arb_mat

    masses, rates, stiffness = map(_balls, motion.parts)
    size = len(motion.masses)
    if motion.is_of_first_order:
        first, second = range(size // 2), range(size // 2, size)
        still = [matrices.part(motion.stiffness, part, part) for part in (first, second)]
        below, beside = (
            _balls(matrices.part(motion.stiffness, *parts)) for parts in ((first, second), (second, first))
        )
        # Where coordinates and momenta drive only each other, q'' = B D q.
        drives = not any(e for part in still for row in part for e in row) and not below.det().contains(0)
        return (below * beside, True) if drives else (-stiffness, False)
    back, damping = masses.solve(stiffness), masses.solve(rates)
    if is_free and not any(e for row in motion.rates for e in row):
        return -back, True
    rows = [[int(j == i + size) for j in range(2 * size)] for i in range(size)]
    rows += [[-part[i, j] for part in (back, damping) for j in range(size)] for i in range(size)]
    return arb_mat(rows), False


def _balls(matrix: Sequence[Sequence[Expr]]) -> Any:
    """A matrix of python-flint's numbers."""
    from flint import arb_mat

    return arb_mat([[enclosed(e, {}, BITS).mid() for e in row] for row in matrix])


def _eigenvalues(
    matrix: Any, rounding: float, are_squares: bool, weights: Sequence[Any]
) -> Iterator[tuple[float, float, Array]]:
    """The different eigenvalues of a matrix (n by n), or the roots of these: real and imaginary parts.

    Behind them are vectors of length 1, as many as the eigenvalue is often a root; fewer may be independent.
    They have as many entries as `weights`, in units of 1/weight.
    """
    from flint import acb, acb_mat

    values, vectors = acb_mat(matrix).eig(right=True, algorithm="approx")
    groups: list[tuple[list[int], Any]] = []
    if are_squares:
        # What is left beside a negative square is rounding; the root of it would be of either sign.
        real = [abs(value.imag) <= rounding * abs(value) for value in values]
        values = [acb(v.real if is_real else v).sqrt() for v, is_real in zip(values, real, strict=True)]
    sizes = [float(abs(value).mid()) for value in values]
    for place, (value, size) in enumerate(zip(values, sizes, strict=True)):
        if size <= rounding * max(sizes):
            value = value * 0
        near = [places for places, other in groups if float(abs(value - other).mid()) <= rounding * size]
        if near:
            near[0].append(place)
        else:
            groups.append(([place], value))
    for places, value in groups:
        parts = [float(value.real.mid()), float(value.imag.mid())]
        growth, angular = (0.0 if abs(part) <= rounding * math.hypot(*parts) else part for part in parts)
        rows = [[vectors[i, j] * weight for i, weight in enumerate(weights)] for j in places]
        columns = np.array([[complex((e / max(map(abs, row))).mid()) for e in row] for row in rows])
        units = columns / np.linalg.norm(columns, axis=1, keepdims=True)
        yield growth, angular, units


def _from_first(rows: Array, rank: int, weights: Array) -> Iterator[Vector]:
    """As many independent vectors, over their first entries."""
    reduced = echelon(rows, rank, INDEPENDENT)[0][:rank]
    parts = np.array([reduced.real, reduced.imag])
    parts[np.abs(parts) <= NOISE * np.abs(reduced).max(axis=1, keepdims=True)] = 0.0
    for row in (parts[0] + 1j * parts[1]) / weights:
        first = np.flatnonzero(row)[0]
        row /= row[first]
        row[first] = 1.0
        yield tuple((float(e.real), float(e.imag)) for e in row)
