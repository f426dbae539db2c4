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

_HALF = Fraction(1, 2)

Stability: TypeAlias = Literal["stable", "unstable", "marginal"]

_WORSE: tuple[Stability, ...] = ("stable", "marginal", "unstable")

BALANCING = 8
"""Rounds of balancing."""

ROUNDING = 1e-7
"""Real parts below this, in units of the largest eigenvalue, are rounding: of a double one it is its root."""


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Eigenvalues as pairs (re, im), frequencies (rad/s, each once, ascending), and stability.

    Symbols without values leave expressions; these hold where parameters are positive.
    """

    eigenvalues: tuple[tuple[float | Expr, float | Expr], ...]
    frequencies: tuple[float | Expr, ...]
    stability: Stability


def of_numbers(matrix: Floats) -> Spectrum:
    """The spectrum of A (2n by 2n); marginal where motion grows, but by a power of the time only.

    Variables that do not act on each other are judged apart, each by their own size.
    """
    blocks = mass_matrix.connected(len(matrix), lambda i, j: bool(matrix[i, j] or matrix[j, i]))
    found = [_of_block(matrix[np.ix_(block, block)]) for block in blocks]
    return Spectrum(
        tuple(sorted(pair for part in found for pair in part.eigenvalues)),
        tuple(sorted({f for part in found for f in part.frequencies})),  # type: ignore[type-var]
        max((part.stability for part in found), key=_WORSE.index),
    )


def _of_block(matrix: Floats) -> Spectrum:
    matrix = _balanced(matrix)
    values = np.linalg.eigvals(matrix)
    size = float(np.abs(values).max(initial=0.0))
    real = np.where(np.abs(values.real) > ROUNDING * size, values.real, 0.0)
    imaginary = np.where(np.abs(values.imag) > ROUNDING * size, values.imag, 0.0)
    order = np.lexsort((imaginary, real))
    pairs = tuple((float(real[i]), float(imaginary[i])) for i in order)
    frequencies = tuple(sorted(im for re, im in pairs if im > 0 and re == 0))
    if any(re > 0 for re, _ in pairs):
        return Spectrum(pairs, frequencies, "unstable")
    return Spectrum(pairs, frequencies, "stable" if _is_diagonable(matrix) else "marginal")


def _balanced(matrix: Floats) -> Floats:
    """The matrix in units of its variables, powers of 2, in which rows and columns are of a size."""
    result = matrix.astype(np.float64)
    for _ in range(BALANCING):
        for i in range(len(result)):
            row, column = (np.abs(np.delete(line, i)).sum() for line in (result[i], result[:, i]))
            if row and column:
                unit = 2.0 ** round(math.log2(row / column) / 2)
                result[i] /= unit
                result[:, i] *= unit
    return result


def _is_diagonable(matrix: Floats) -> bool:
    """Whether the eigenvectors span the space, but for rounding."""
    _, vectors = np.linalg.eig(matrix)
    return bool(np.linalg.svd(vectors, compute_uv=False).min() > ROUNDING)


def of_symbols(matrix: Sequence[Sequence[Expr]], fixed: Mapping[str, float]) -> Spectrum | None:
    """The spectrum of A (2n by 2n, coordinates first), where each freedom is by itself; else None.

    Signs are those for the `fixed` values of names, and any positive ones of the others.
    """
    size = len(matrix) // 2
    pairs: list[tuple[float | Expr, float | Expr]] = []
    frequencies: dict[Expr, None] = {}
    verdicts: list[Stability] = []
    blocks = mass_matrix.connected(2 * size, lambda i, j: not (matrix[i][j].is_zero and matrix[j][i].is_zero))
    if any({i % size for i in block} != {block[0] % size} for block in blocks):
        return None
    for i in range(size):
        # The trace of a freedom by itself is zero, so that lambda^2 = -determinant.
        square = tidy(-mass_matrix.minor(mass_matrix.part(matrix, (i, i + size), (i, i + size))))
        sign = _sign(square, fixed)
        if sign is None:
            return None
        root = tidy((square * sign) ** _HALF) if sign else ZERO
        pairs += [(ZERO, -root), (ZERO, root)] if sign < 0 else [(-root, ZERO), (root, ZERO)]
        if sign < 0:
            frequencies[root] = None
        still = sign == 0 and all(
            e.is_zero for row in mass_matrix.part(matrix, (i, i + size), (i, i + size)) for e in row
        )
        verdicts.append("stable" if sign < 0 or still else "unstable" if sign > 0 else "marginal")
    return Spectrum(tuple(pairs), tuple(frequencies), max(verdicts, key=_WORSE.index))


def _sign(e: Expr, fixed: Mapping[str, float]) -> int | None:
    """The sign that an expression has for any positive parameters, as far as random ones tell."""
    if e.is_zero:
        return 0
    known = {name: value for name, value in fixed.items() if name in e.names}
    found = samples.values([e], known, count=12)
    if found is None or (found.min() < 0 < found.max()):
        return None
    return 1 if found.min() > 0 else -1
