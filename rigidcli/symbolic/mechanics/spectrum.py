"""Linear equations of motion z' = A z + b: eigenvalues of A, frequencies, and whether motion stays bounded.

The eigenvalues of a Hamiltonian matrix come in pairs lambda, -lambda. Source: H. Goldstein, C. Poole,
J. Safko, Classical Mechanics, 3rd edition, chapter 6; V. I. Arnold, Mathematical Methods of Classical
Mechanics, appendix 6.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.symbolic.algebra import samples
from rigidcli.symbolic.algebra.expressions import ZERO, Expr
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.mechanics import mass_matrix

Stability: TypeAlias = Literal["stable", "unstable", "marginal"]

_WORSE: tuple[Stability, ...] = ("stable", "marginal", "unstable")

BALANCING = 8
"""Rounds of balancing, after which units change no more."""

ROUNDING = 1e-7
"""Real parts below this, in units of the largest eigenvalue, are rounding: of a double one it is its root."""

SIGNS = 12
"""Random points at which an expression must have one sign, so that few of another sign are missed."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Eigenvalues as pairs (re, im), frequencies (rad/s, each once, ascending), and stability.

    Symbols without values leave expressions; these hold where parameters are positive.
    """

    eigenvalues: tuple[tuple[float | Expr, float | Expr], ...]
    frequencies: tuple[float | Expr, ...]
    stability: Stability


def numeric_spectrum(matrix: Floats) -> Spectrum:
    """The spectrum of A (2n by 2n); marginal where motion grows, but by a power of the time only.

    Variables that do not act on each other are judged apart, each by their own size.
    """
    pairs: list[tuple[float, float]] = []
    verdicts: list[Stability] = []
    for block in mass_matrix.connected(len(matrix), lambda i, j: bool(matrix[i, j] or matrix[j, i])):
        values, vectors = np.linalg.eig(_balanced(matrix[np.ix_(block, block)]))
        parts = np.array([values.real, values.imag])
        parts[np.abs(parts) <= ROUNDING * np.abs(values).max()] = 0.0
        pairs += [(re, im) for re, im in parts.T.tolist()]
        is_diagonable = np.linalg.svd(vectors, compute_uv=False).min() > ROUNDING
        verdicts.append("unstable" if parts[0].max() > 0 else "stable" if is_diagonable else "marginal")
    frequencies = sorted({im for re, im in pairs if im > 0 and re == 0})
    return Spectrum(tuple(sorted(pairs)), tuple(frequencies), max(verdicts, key=_WORSE.index))


def _balanced(matrix: Floats) -> Floats:
    """The matrix in units of its variables, powers of 2, in which rows and columns are of a size.

    scipy.linalg.matrix_balance does the same, but loading it takes longer than all else.
    """
    result = matrix.astype(np.float64)
    for _ in range(BALANCING):
        for i in range(len(result)):
            row, column = (np.abs(np.delete(line, i)).sum() for line in (result[i], result[:, i]))
            if row and column:
                unit = 2.0 ** round(math.log2(row / column) / 2)
                result[i] /= unit
                result[:, i] *= unit
    return result


def symbolic_spectrum(matrix: Sequence[Sequence[Expr]], fixed: Mapping[str, float]) -> Spectrum | None:
    """The spectrum of A (2n by 2n, coordinates first), where each freedom is by itself; else None.

    Signs are those for the `fixed` values of names, and any positive ones of the others.
    """
    size = len(matrix) // 2
    pairs: list[tuple[Expr, Expr]] = []
    frequencies: dict[Expr, None] = {}
    verdicts: list[Stability] = []
    blocks = mass_matrix.connected(2 * size, lambda i, j: not (matrix[i][j].is_zero and matrix[j][i].is_zero))
    if any(len({i % size for i in block}) > 1 for block in blocks):
        return None
    for i in range(size):
        own = mass_matrix.part(matrix, (i, i + size), (i, i + size))
        # Without friction the trace of a freedom by itself is zero, so that lambda^2 = -determinant.
        if not (own[0][0] + own[1][1]).is_zero:
            return None
        square = tidy(-mass_matrix.determinant(own))
        sign = sign_of(square, fixed)
        if sign is None:
            return None
        root = tidy((square * sign) ** Fraction(1, 2)) if sign else ZERO
        pairs += [(ZERO, e) if sign < 0 else (e, ZERO) for e in (-root, root)]
        if sign < 0:
            frequencies[root] = None
        bounded = sign < 0 or all(e.is_zero for row in own for e in row)
        verdicts.append("stable" if bounded else "unstable" if sign else "marginal")
    return Spectrum(tuple(pairs), tuple(frequencies), max(verdicts, key=_WORSE.index))


def sign_of(e: Expr, fixed: Mapping[str, float]) -> int | None:
    """The sign that an expression has for any positive parameters, as far as random ones tell."""
    if e.is_zero:
        return 0
    if e.unknown:
        return None
    known = {name: value for name, value in fixed.items() if name in e.names}
    found = samples.values([e], known, count=SIGNS)
    if found is None or (found.min() < 0 < found.max()):
        return None
    return 1 if found.min() > 0 else -1
