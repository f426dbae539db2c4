"""The eigenvalues of linear equations of motion with numbers for all symbols: see `spectrum`."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from itertools import pairwise

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import Expr, number, total
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import Floats
from rigidcli.mechanics.spectrum import WORSE, Spectrum, Stability, blocks
from rigidcli.mechanics.symbolic_spectrum import symbolic_spectrum

DEFINITE = 1e-9
"""Eigenvalues of S, with 1 in its diagonal, above this are positive, whatever the rounding."""

SPREAD = 1e-3
"""The ratio of two frequencies below which the smaller one has lost digits to the larger one in floats."""

CLOSE = 1e-6
"""Frequencies nearer to each other than this, in their own units, may be one."""

BITS = 200
"""Precision of the roots of polynomials, so that floats are right to their last digit."""


def numeric_spectrum(matrix: Sequence[Sequence[Expr | float]]) -> Spectrum | None:
    """The spectrum of A (2n by 2n, coordinates first); marginal where motion grows, but by a power of time.

    Floats are taken for the fractions that they are. Freedoms that do not act on each other are judged apart.
    None is for numbers that are not rational, and whose eigenvalues are no square roots.
    """
    exact = [[e if isinstance(e, Expr) else number(Fraction(float(e))) for e in row] for row in matrix]
    found = _of_definite(np.array([[float(e) for e in row] for row in exact]))
    if found is not None:
        return _together((i * x for x in found for i in (-1j, 1j)), ["stable"])
    if any(e.as_number is None for row in exact for e in row):
        closed = symbolic_spectrum(exact, {})
        if closed is None:
            return None
        return _together((complex(*map(float, pair)) for pair in closed.eigenvalues), [closed.stability])
    parts = [_of_rationals(matrices.part(exact, block, block)) for block in blocks(exact)]
    return _together((value for values, _ in parts for value in values), [verdict for _, verdict in parts])


def drifts(matrix: Matrix, offset: Sequence[Expr]) -> bool:
    """Whether z' = A z + b has no point of rest: then b drives a mode of rate zero, and motion grows.

    There is a point of rest if b is orthogonal to all that A^T takes to zero.
    """
    left = matrices.null_vectors([list(column) for column in zip(*matrix, strict=True)])
    return any(not is_zero(total(x * b for x, b in zip(v, offset, strict=True))) for v in left)


def _together(eigenvalues: Iterator[complex], verdicts: Sequence[Stability]) -> Spectrum:
    pairs = sorted((value.real + 0.0, value.imag + 0.0) for value in eigenvalues)
    frequencies = sorted({im for re, im in pairs if im > 0 and re == 0})
    return Spectrum(tuple(pairs), tuple(frequencies), max(verdicts, key=WORSE.index))


def _of_definite(matrix: Floats) -> list[float] | None:
    """The frequencies, where S is definite beyond doubt and they lie well apart; else None.

    With S = L L^T, the matrix L^T J L has the same eigenvalues as J S. It is antisymmetric.
    """
    size = len(matrix) // 2
    turn = np.block([[np.zeros((size, size)), np.eye(size)], [-np.eye(size), np.zeros((size, size))]])
    second = -turn @ matrix
    second = second if second[0, 0] > 0 else -second
    scale = np.diag(second)
    if not (second == second.T).all() or scale.min() <= 0:
        return None
    with np.errstate(all="ignore"):
        unit = second / np.sqrt(np.outer(scale, scale))
    if not np.isfinite(unit).all() or np.linalg.eigvalsh(unit).min() <= DEFINITE:
        return None
    lower = np.linalg.cholesky(second)
    found: list[float] = np.linalg.eigvalsh(1j * (lower.T @ turn @ lower))[size:].tolist()
    apart = all(a == b or b - a > CLOSE * b for a, b in pairwise(found))
    return found if apart and found[0] > SPREAD * found[-1] else None


def _of_rationals(matrix: Matrix) -> tuple[list[complex], Stability]:
    """The eigenvalues, each as often as it is one, and the verdict, by exact polynomials.

    An irreducible polynomial with an imaginary root has its negative, too, and is even.
    """
    from flint import ctx, fmpq, fmpq_mat

    entries = [[Fraction(e.as_number or 0) for e in row] for row in matrix]
    exact = fmpq_mat([[fmpq(e.numerator, e.denominator) for e in row] for row in entries])
    minimal = {str(factor): times for factor, times in exact.minpoly().factor()[1]}
    found: list[complex] = []
    verdicts: list[Stability] = ["stable"]
    for factor, times in exact.charpoly().factor()[1]:
        polynomial = factor.numer()
        with ctx.workprec(BITS):
            if polynomial.deflation()[1] % 2 == 0:
                squares = [root for root, _ in polynomial.deflate(2).complex_roots()]
                roots = [sign * square.sqrt() for square in squares for sign in (1, -1)]
                grows = any(not (square.imag == 0 and square.real < 0) for square in squares)
            else:
                roots = [root for root, _ in polynomial.complex_roots()]
                grows = any(root.real > 0 for root in roots)
            found += [complex(float(root.real), float(root.imag)) for root in roots] * times
        if grows:
            verdicts.append("unstable")
        elif minimal[str(factor)] > 1:
            verdicts.append("marginal")
    return found, max(verdicts, key=WORSE.index)
