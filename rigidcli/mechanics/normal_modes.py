"""Normal modes y = Re(v exp(s t)) of M y'' + C y' + K y = 0 in numbers: rates, mode vectors, stability.

The eigenvalues are worked out to some 70 digits by python-flint. So a zero mode is told from a slow one, and
one that neither grows nor decays from one that does, without any measure of what rounding may do.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, TypeAlias

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.values import enclosed
from rigidcli.core.arithmetic import Array
from rigidcli.mechanics.small_oscillations import LinearMotion

BITS = 256
"""Bits of the numbers: 77 digits, of which a double eigenvalue without a second vector leaves one half."""

ROUNDING = 1e-22
"""What is smaller than this, in units of the largest, is rounding; real modes are not so far apart."""

FOUND = 1e-6
"""The same where the equilibrium was found in floats: squares of rates have errors of some 1e-14."""

INDEPENDENT = 1e-8
"""Vectors of length 1 that depend on each other but for this, are parallel."""

NOISE = 1e-12
"""Entries of a vector below this, in units of its largest one, are zero."""

Pair: TypeAlias = "tuple[float | Expr, float | Expr]"
"""The real and the imaginary part of a number."""


@dataclass(frozen=True, slots=True)
class Mode:
    """One mode: s = `growth` + i `angular`, with its vector v, real and imaginary parts apart (n each).

    `growth` (1/s) is negative where it decays. `is_stable` is None of a zero mode, which is displaced to
    another equilibrium and drifts there, and where the signs of symbols decide: the mode is told for where
    the `condition` is positive.
    """

    growth: float | Expr
    angular: float | Expr
    vector: tuple[Pair, ...]
    is_stable: bool | None
    condition: Expr | None = None

    @property
    def rate(self) -> float | Expr:
        """The growth of an unstable mode; else the angular frequency, or the decay where it has none."""
        if self.is_stable is False and self.growth:
            return self.growth
        return -self.growth if self.growth and not self.angular else self.angular


def numeric_modes(motion: LinearMotion, is_free: bool, rounding: float = ROUNDING) -> list[Mode]:
    """The modes, by ascending rates; the matrices are exact numbers.

    Without forces (`is_free`) s and -s come in pairs, of which the growing one is told.
    """
    from flint import acb_mat, arb, ctx

    size = len(motion.masses)
    with ctx.workprec(BITS):
        masses, rates, stiffness = map(_balls, motion.parts)
        back, damping = masses.solve(stiffness), masses.solve(rates)
        if is_free and not any(entry for row in motion.rates for entry in row):
            squares, vectors = acb_mat(-back).eig(right=True, algorithm="approx")
            values = [square.sqrt() for square in squares]
        else:
            entries = [[int(j == i + size) for j in range(2 * size)] for i in range(size)]
            entries += [[-back[i, j] for j in range(size)] for i in range(size)]
            for i, row in enumerate(entries[size:]):
                row += [-damping[i, j] for j in range(size)]
            values, vectors = acb_mat(entries).eig(right=True, algorithm="approx")
        # Of coordinates in different units, entries are compared in units of 1/sqrt(M_ii).
        weights = [abs(masses[i, i]).sqrt() if masses[i, i] != 0 else arb(1) for i in range(size)]
        columns = [_column(vectors, j, weights) for j in range(len(values))]
        groups = _groups(values, rounding)
    modes = [
        mode
        for places, growth, angular in groups
        if angular >= 0 and (growth >= 0 or not is_free)
        for mode in _modes(growth, angular, [columns[place] for place in places], weights)
    ]
    return sorted(modes, key=lambda mode: (float(mode.rate), float(mode.angular)))


def _balls(matrix: Matrix) -> Any:
    from flint import arb_mat

    return arb_mat([[enclosed(entry, {}, BITS).mid() for entry in row] for row in matrix])


def _column(vectors: Any, j: int, weights: Sequence[Any]) -> Array:
    """The upper part (n) of a column times the weights, of length 1."""
    entries = [vectors[i, j] * weight for i, weight in enumerate(weights)]
    scale = max(abs(entry) for entry in entries)
    column = np.array([complex((entry / scale).mid()) for entry in entries])
    return np.asarray(column / np.linalg.norm(column))


def _groups(values: Sequence[Any], rounding: float) -> list[tuple[list[int], float, float]]:
    """Places of equal eigenvalues, with their real and imaginary parts; what is rounding there is zero."""
    sizes = [float(abs(value).mid()) for value in values]
    largest = max(sizes)
    found: list[tuple[list[int], Any]] = []
    for place, value in enumerate(values):
        if sizes[place] <= rounding * largest:
            value = value * 0
        limit = rounding * sizes[place]
        group = next((places for places, other in found if float(abs(value - other).mid()) <= limit), None)
        if group is None:
            found.append(([place], value))
        else:
            group.append(place)
    parts = [(places, float(value.real.mid()), float(value.imag.mid())) for places, value in found]

    def cleared(part: float, size: float) -> float:
        return 0.0 if abs(part) <= rounding * size else part

    return [
        (places, cleared(re, math.hypot(re, im)), cleared(im, math.hypot(re, im))) for places, re, im in parts
    ]


def _modes(growth: float, angular: float, columns: Sequence[Array], weights: Sequence[Any]) -> list[Mode]:
    """The modes of one eigenvalue: as many as there are independent vectors."""
    vectors = np.array(columns)
    rank = int((np.linalg.svd(vectors, compute_uv=False) > INDEPENDENT).sum())
    is_zero = not growth and not angular
    # With fewer vectors than there are equal eigenvalues, motion grows by powers of the time.
    is_stable = None if is_zero else growth < 0 or (not growth and rank == len(columns))
    rows = _reduced(vectors)[:rank] / np.array([float(weight.mid()) for weight in weights])
    for row in rows:
        first = np.flatnonzero(row)[0]
        row /= row[first]
        row[first] = 1.0
    return [
        Mode(growth, angular, tuple((float(e.real), float(e.imag)) for e in row), is_stable) for row in rows
    ]


def _reduced(rows: Array) -> Array:
    """The rows in reduced echelon form, by the first entry of each that is not zero."""
    rows = rows.copy()
    place = 0
    for column in range(rows.shape[1]):
        if place == len(rows):
            break
        best = place + int(np.argmax(np.abs(rows[place:, column])))
        if abs(rows[best, column]) <= INDEPENDENT:
            continue
        rows[[place, best]] = rows[[best, place]]
        rows[place] /= rows[place, column]
        for other in range(len(rows)):
            if other != place:
                rows[other] -= rows[other, column] * rows[place]
        place += 1
    parts = np.array([rows.real, rows.imag])
    parts[np.abs(parts) <= NOISE * np.abs(rows).max(axis=1, keepdims=True)] = 0.0
    return np.asarray(parts[0] + 1j * parts[1])
