"""Linear equations of motion z' = A z + b: eigenvalues of A, frequencies, and whether motion stays bounded.

Motion stays bounded if no eigenvalue has a positive real part, and those without a real part are simple
roots of the minimal polynomial. Of Hamilton's equations A = J S, with the matrix S of the second derivatives
of H, the eigenvalues come in pairs lambda, -lambda; where S is definite, they are +-i omega. Source:
H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, chapter 6; V. I. Arnold, Mathematical
Methods of Classical Mechanics, appendix 6.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import pairwise
from typing import Literal, TypeAlias

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.arithmetic import weak_sign
from rigidcli.symbolic.algebra.calculus import coefficients, substitute
from rigidcli.symbolic.algebra.expressions import ONE, ZERO, Expr, number, symbol, total
from rigidcli.symbolic.algebra.fractions import factors
from rigidcli.symbolic.algebra.simplification import shortest, tidy
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.mechanics import mass_matrix
from rigidcli.symbolic.mechanics.mass_matrix import Matrix

Stability: TypeAlias = Literal["stable", "unstable", "marginal"]

_WORSE: tuple[Stability, ...] = ("stable", "marginal", "unstable")

DEFINITE = 1e-9
"""Eigenvalues of S, with 1 in its diagonal, above this are positive, whatever the rounding."""

SPREAD = 1e-3
"""The ratio of two frequencies below which the smaller one has lost digits to the larger one in floats."""

CLOSE = 1e-6
"""Frequencies nearer to each other than this, in their own units, may be one."""

BITS = 200
"""Precision of the roots of polynomials, so that floats are right to their last digit."""

LARGEST = 4
"""The most freedoms that act on each other whose eigenvalues are looked for in symbols."""

MAX_STEPS = 60_000
"""Steps that factoring a polynomial in symbols may take: a few tenths of a second."""

_SQUARE = "lambda^2"
_HALF = Fraction(1, 2)


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Eigenvalues as pairs (re, im), frequencies (rad/s, each once, ascending), and stability.

    Symbols without values leave expressions; these hold where parameters are positive.
    """

    eigenvalues: tuple[tuple[float | Expr, float | Expr], ...]
    frequencies: tuple[float | Expr, ...]
    stability: Stability


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
    parts = [_of_rationals(mass_matrix.part(exact, block, block)) for block in _blocks(exact)]
    return _together((value for values, _ in parts for value in values), [verdict for _, verdict in parts])


def drifts(matrix: Matrix, offset: Sequence[Expr]) -> bool:
    """Whether z' = A z + b has no point of rest: then b drives a mode of rate zero, and motion grows.

    There is a point of rest if b is orthogonal to all that A^T takes to zero.
    """
    left = mass_matrix.null_vectors([list(column) for column in zip(*matrix, strict=True)])
    return any(not is_zero(total(x * b for x, b in zip(v, offset, strict=True))) for v in left)


def _together(eigenvalues: Iterator[complex], verdicts: Sequence[Stability]) -> Spectrum:
    pairs = sorted((value.real + 0.0, value.imag + 0.0) for value in eigenvalues)
    frequencies = sorted({im for re, im in pairs if im > 0 and re == 0})
    return Spectrum(tuple(pairs), tuple(frequencies), max(verdicts, key=_WORSE.index))


def _blocks(matrix: Matrix) -> list[list[int]]:
    """The places of coordinates and momenta of freedoms that act on each other."""
    size = len(matrix) // 2
    pairs = [(0, 0), (0, size), (size, 0), (size, size)]

    def linked(i: int, j: int) -> bool:
        return any(not (matrix[i + a][j + b].is_zero and matrix[j + a][i + b].is_zero) for a, b in pairs)

    groups = mass_matrix.connected(size, linked)
    return [[*group, *(i + size for i in group)] for group in groups]


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
    return found, max(verdicts, key=_WORSE.index)


def symbolic_spectrum(matrix: Matrix, known: Mapping[str, Expr]) -> Spectrum | None:
    """The spectrum of A = J S (2n by 2n, coordinates first) in symbols; None where it has no short form.

    Signs are those for the `known` values of names, and any positive ones of the others. The squares of the
    eigenvalues are the roots of a polynomial, whose factors must have degree 1 or 2.
    """
    pairs: list[tuple[Expr, Expr]] = []
    verdicts: list[Stability] = ["stable"]
    for block in _blocks(matrix):
        inner = mass_matrix.part(matrix, block, block)
        try:
            polynomials = _polynomials(inner) if len(block) <= 2 * LARGEST else []
            found = [_roots(polynomial, known, _is_natural(inner, known)) for polynomial, _ in polynomials]
        except ExpressionError:
            return None
        for (_, times), roots in zip(polynomials, found, strict=True):
            if not roots:
                return None
            pairs += roots * times
        if not found:
            return None
        if any(not re.is_zero for roots in found for re, _ in roots):
            verdicts.append("unstable")
        elif not _is_semisimple(inner, polynomials):
            verdicts.append("marginal")
    frequencies = dict.fromkeys(im for re, im in pairs[1::2] if re.is_zero and not im.is_zero)
    return Spectrum(tuple(pairs), tuple(frequencies), max(verdicts, key=_WORSE.index))


_Polynomial: TypeAlias = Mapping[int, Expr]
"""Coefficients by their powers, of a polynomial in the square of an eigenvalue."""


def _polynomials(matrix: Matrix) -> list[tuple[_Polynomial, int]]:
    """The irreducible factors of the polynomial of the squares of eigenvalues, each with its power.

    None are found for a matrix that is not Hamiltonian. The coefficients follow from the traces of the even
    powers of A by Newton's identities.
    """
    size = len(matrix) // 2
    second = [*([-e for e in row] for row in matrix[size:]), *matrix[:size]]
    if any(not is_zero(second[i][j] - second[j][i]) for i in range(2 * size) for j in range(i)):
        return []
    square = _times(matrix, matrix)
    sums, power = [], square
    for _ in range(size):
        sums.append(total(power[i][i] for i in range(2 * size)) / 2)
        power = _times(power, square)
    symmetric = [ONE]
    for k in range(1, size + 1):
        symmetric.append(total(symmetric[k - i] * sums[i - 1] * (-1) ** (i - 1) for i in range(1, k + 1)) / k)
    found = {size - k: tidy(e * (-1) ** k) for k, e in enumerate(symmetric) if not is_zero(e)}
    if size == 1:
        return [(found, 1)]
    whole = total(e * symbol(_SQUARE) ** k for k, e in found.items())
    parts = [
        (coefficients(e, [_SQUARE]), n) for e, n in factors(whole, Allowance(MAX_STEPS)) if _SQUARE in e.names
    ]
    return [({k: e for (k,), e in part.items()}, n) for part, n in parts if part is not None]


def _times(a: Matrix, b: Matrix) -> list[list[Expr]]:
    """The product of two square matrices."""
    places = range(len(a))
    return [[tidy(total(a[i][k] * b[k][j] for k in places)) for j in places] for i in places]


def _is_natural(matrix: Matrix, known: Mapping[str, Expr]) -> bool:
    """Whether H is a positive T of the momenta and a V of the coordinates: lambda^2 is real then."""
    size = len(matrix) // 2
    first, last = range(size), range(size, 2 * size)
    mixed = (mass_matrix.part(matrix, half, half) for half in (first, last))
    if any(not e.is_zero for part in mixed for row in part for e in row):
        return False
    minors = (mass_matrix.part(matrix, first[:k], last[:k]) for k in range(1, size + 1))
    return all(sign_of(mass_matrix.determinant(minor), known) == 1 for minor in minors)


def _roots(polynomial: _Polynomial, known: Mapping[str, Expr], real: bool) -> list[tuple[Expr, Expr]]:
    """The eigenvalues whose squares are the roots, those with opposite signs together; none if not known."""
    a, b, c = (polynomial.get(k, ZERO) for k in (2, 1, 0))
    if polynomial.keys() <= {0, 1}:
        return _of_square(-c / b, known)
    if not polynomial.keys() <= {0, 1, 2}:
        return []
    rest = tidy(b**2 - 4 * a * c)
    sign = 1 if real else sign_of(rest, known)
    half, product = tidy(-b / (2 * a)), tidy(c / a)
    if sign == -1:
        size = _root(product, known)
        re, im = (_root((size + s * half) / 2, known) for s in (1, -1))
        return [(-re, -im), (re, im), (-re, im), (re, -im)]
    signs = sign_of(product, known), sign_of(half, known)
    root = tidy(_root(rest, known) / (2 * a))
    if sign is None or None in signs or (signs[0] == 1 and signs[1] == 0):
        return []
    # Of two roots with a positive product both have the sign of their sum, else one has either.
    found = []
    for s in (1, -1):
        of_root = signs[1] if signs[0] == 1 else s * (sign_of(a, known) or 0)
        found.append(_of_square(half + s * root, known, of_root))
    return found[0] + found[1] if all(found) else []


def _of_square(square: Expr, known: Mapping[str, Expr], sign: int | None = None) -> list[tuple[Expr, Expr]]:
    """The two eigenvalues with a square of this sign; none if that depends on symbols."""
    square = tidy(square)
    sign = sign_of(square, known) if sign is None else sign
    if sign is None:
        return []
    root = _root(square * sign, known)
    return [(ZERO, e) if sign < 0 else (e, ZERO) for e in (-root, root)]


def _is_semisimple(matrix: Matrix, polynomials: Sequence[tuple[_Polynomial, int]]) -> bool:
    """Whether A is a root of a polynomial without multiple roots, which has all of its eigenvalues."""
    if all(times == 1 and 0 in polynomial for polynomial, times in polynomials):
        return True
    places = range(len(matrix))
    square = _times(matrix, matrix)
    unit = [[ONE if i == j else ZERO for j in places] for i in places]
    whole: Matrix = unit
    for polynomial, _ in polynomials:
        value: Matrix = [[ZERO] * len(matrix) for _ in places]
        for k in range(max(polynomial), -1, -1):
            value = _times(value, square)
            value = [[value[i][j] + polynomial.get(k, ZERO) * unit[i][j] for j in places] for i in places]
        whole = _times(whole, value if 0 in polynomial else matrix)
    return all(is_zero(e) for row in whole for e in row)


def sign_of(e: Expr, known: Mapping[str, Expr]) -> int | None:
    """The sign that an expression has for known values, and any positive ones of other names."""
    if e.is_zero:
        return 0
    try:
        positive = {name: symbol(name, positive=True) for name in e.names}
        found = weak_sign(substitute(e, {**positive, **known}))
    except ExpressionError:
        return None
    return None if found is None else found[0]


def _root(e: Expr, known: Mapping[str, Expr]) -> Expr:
    """The square root of what is not negative, where names are positive that have no known negative value."""
    names = [name for name in e.names if name not in known or sign_of(known[name], {}) == 1]
    root = substitute(e, {name: symbol(name, positive=True) for name in names}) ** _HALF
    return shortest([tidy(e**_HALF), tidy(substitute(root, {name: symbol(name) for name in names}))])
