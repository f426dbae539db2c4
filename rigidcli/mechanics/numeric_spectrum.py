"""Rates of linear motion in numbers, with their vectors, and whether motion stays bounded.

Eigenvalues are worked out to some 70 digits, so that a zero mode differs from a slow one, and what neither
grows nor decays from what does, without any measure of rounding. Source: as of `spectrum`.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.values import enclosed
from rigidcli.core.arithmetic import Array
from rigidcli.mechanics.small_oscillations import LinearMotion
from rigidcli.mechanics.spectrum import Mode, Spectrum, verdict

BITS = 256
"""Bits of numbers: 77 digits, of which a double eigenvalue without a second vector leaves one half."""

ROUNDING = 1e-22
"""What is smaller than this, in units of the largest, is rounding; real modes are not so far apart."""

FOUND = 1e-6
"""What is rounding where the equilibrium was found in floats: squares of rates have errors of some 1e-14."""

INDEPENDENT = 1e-8
"""Vectors of length 1 that depend on each other but for this, are parallel."""

NOISE = 1e-12
"""Entries of a vector below this, in units of its largest one, are zero."""


class Eigenvalue(NamedTuple):
    """An eigenvalue s = `growth` + i `angular` of a matrix of numbers, with its `vectors` (k by n).

    Their length is 1, and they are as many as the eigenvalue is often a root; fewer may be independent.
    """

    growth: float
    angular: float
    vectors: Array

    @property
    def rank(self) -> int:
        """How many of the vectors are independent."""
        return int((np.linalg.svd(self.vectors, compute_uv=False) > INDEPENDENT).sum())


def _balls(matrix: Sequence[Sequence[Expr | float]]) -> Any:
    """A matrix of python-flint's numbers."""
    from flint import arb_mat

    return arb_mat(
        [[enclosed(e, {}, BITS).mid() if isinstance(e, Expr) else float(e) for e in row] for row in matrix]
    )


def _eigenvalues(
    matrix: Any, rounding: float = ROUNDING, square_root: bool = False, weights: Sequence[Any] = ()
) -> Iterator[Eigenvalue]:
    """The different eigenvalues of a matrix of python-flint's numbers (n by n), or the roots of these.

    Of the vectors there are as many entries as `weights`, in units of 1/weight.
    """
    from flint import acb_mat

    values, vectors = acb_mat(matrix).eig(right=True, algorithm="approx")
    groups: list[tuple[list[int], Any]] = []
    values = [value.sqrt() for value in values] if square_root else values
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
        yield Eigenvalue(growth, angular, columns / np.linalg.norm(columns, axis=1, keepdims=True))


def numeric_spectrum(matrix: Sequence[Sequence[Expr | float]]) -> Spectrum:
    """The spectrum of A (2n by 2n, coordinates first) in numbers; floats are the fractions that they are."""
    from flint import ctx

    size = len(matrix) // 2
    a, b, d, e = ([row[k : k + size] for row in matrix[i : i + size]] for i in (0, size) for k in (0, size))
    with ctx.workprec(BITS):
        # Where coordinates and momenta drive only each other, q'' = B D q. At a rate of zero they drift.
        is_natural = not any(entry for part in (a, e) for row in part for entry in row)
        is_natural = is_natural and not _balls(b).det().contains(0)
        whole = _balls(b) * _balls(d) if is_natural else _balls(matrix)
        found = list(_eigenvalues(whole, ROUNDING, is_natural, [1] * whole.nrows()))
    signs = (1, -1) if is_natural else (1,)
    pairs = sorted((s * x.growth + 0.0, s * x.angular + 0.0) for x in found for _ in x.vectors for s in signs)
    is_whole = all(
        x.growth or (x.rank == len(x.vectors) and not (is_natural and not x.angular)) for x in found
    )
    frequencies = sorted({im for re, im in pairs if im > 0 and not re})
    return Spectrum(tuple(pairs), tuple(frequencies), verdict(any(re > 0 for re, _ in pairs), is_whole))


def numeric_modes(motion: LinearMotion, is_free: bool, rounding: float = ROUNDING) -> list[Mode]:
    """The modes, by ascending rates; the matrices are exact numbers.

    Without forces (`is_free`) s and -s come in pairs, of which the growing one is listed.
    """
    from flint import arb, arb_mat, ctx

    size = len(motion.masses)
    is_natural = is_free and not any(entry for row in motion.rates for entry in row)
    with ctx.workprec(BITS):
        masses, rates, stiffness = map(_balls, motion.parts)
        back, damping = masses.solve(stiffness), masses.solve(rates)
        whole = -back
        if not is_natural:
            rows = [[int(j == i + size) for j in range(2 * size)] for i in range(size)]
            rows += [[-part[i, j] for part in (back, damping) for j in range(size)] for i in range(size)]
            whole = arb_mat(rows)
        # Of coordinates in different units, entries are compared in units of 1/sqrt(M_ii).
        weights = [abs(masses[i, i]).sqrt() if masses[i, i] != 0 else arb(1) for i in range(size)]
        scale = np.array([float(weight.mid()) for weight in weights])
        modes = [
            mode
            for value in _eigenvalues(whole, rounding, is_natural, weights)
            if value.angular >= 0 and (value.growth >= 0 or not is_free)
            for mode in _of_value(value, scale)
        ]
    return sorted(modes, key=lambda mode: (float(mode.rate), float(mode.angular)))


def _of_value(value: Eigenvalue, weights: Array) -> Iterator[Mode]:
    """The modes of one eigenvalue: as many as there are independent vectors, over their first entries."""
    growth, angular, vectors = value
    # With fewer vectors than there are equal eigenvalues, motion grows by powers of the time.
    whole = value.rank == len(vectors)
    is_stable = None if not growth and not angular else growth < 0 or (not growth and whole)
    for row in echelon(vectors)[: value.rank] / weights:
        first = np.flatnonzero(row)[0]
        row /= row[first]
        row[first] = 1.0
        yield Mode(growth, angular, tuple((float(e.real), float(e.imag)) for e in row), is_stable)


def echelon(rows: Array) -> Array:
    """The rows in reduced echelon form, by the first entry of each that is not zero."""
    rows = rows.astype(complex)
    place = 0
    for column in range(rows.shape[1]):
        best = place + int(np.argmax(np.abs(rows[place:, column]), axis=0)) if place < len(rows) else 0
        if place == len(rows) or abs(rows[best, column]) <= INDEPENDENT:
            continue
        rows[[place, best]] = rows[[best, place]]
        rows[place] /= rows[place, column]
        others = np.arange(len(rows)) != place
        rows[others] -= np.outer(rows[others, column], rows[place])
        place += 1
    parts = np.array([rows.real, rows.imag])
    parts[np.abs(parts) <= NOISE * np.abs(rows).max(axis=1, keepdims=True)] = 0.0
    return np.asarray(parts[0] + 1j * parts[1])
