"""Roots of characteristic polynomials, exact or in numbers, and whether motion stays bounded.

The linear equations z' = A z have solutions exp(s t), where s is a root of det(A - s 1). Near an equilibrium
M y'' + C y' + K y = 0 has them where det(M s^2 + C s + K) vanishes. Exact polynomials are factored; factors
of degree 1 and 2 in s, and of degree 1 and 2 in s^2, have roots in closed form. In numbers the eigenvalues
are worked out to some 70 digits, so that a zero mode differs from a slow one, and what neither grows nor
decays from what does, without any measure of rounding.

Motion stays bounded if no root has a positive real part, and those without a real part are simple roots of
the minimal polynomial. Where M and K are positive definite, and C is antisymmetric, all roots are imaginary.
Sources: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, chapter 6; V. I. Arnold,
Mathematical Methods of Classical Mechanics, appendix 6.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra import matrices, samples
from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.arithmetic import MAX_STEPS, root_of_either_sign, tidy, weak_sign
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.simplification import shortest
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import enclosed, is_zero
from rigidcli.core.arithmetic import Array
from rigidcli.errors import ExpressionError

S = symbol("rate s")
"""The variable of characteristic polynomials; with a blank in it, it is no name of a document."""

MOST_PRODUCTS = 5_000
"""The most products of a determinant that is worked out in symbols: a tenth of a second."""

SIGNS = 12
"""Random points at which a root must have one sign, so that few of another sign are missed."""

BITS = 256
"""Bits of numbers: 77 digits, of which a double eigenvalue without a second vector leaves one half."""

ROUNDING = 1e-22
"""What is smaller than this, in units of the largest, is rounding; real modes are not so far apart."""

INDEPENDENT = 1e-8
"""Vectors of length 1 that depend on each other but for this, are parallel."""

Stability: TypeAlias = Literal["stable", "marginal", "unstable"]

Known: TypeAlias = Mapping[str, Expr]
"""The parameters that have values, with these."""


class Root(NamedTuple):
    """The real and imaginary part of s, and whether motion is bounded.

    Where that is open, the root is that for a positive `condition`.
    """

    growth: Expr
    angular: Expr
    is_stable: bool | None
    condition: Expr | None = None


@dataclass(frozen=True, slots=True)
class Spectrum:
    """Eigenvalues as pairs (re, im), frequencies (rad/s, each once, ascending), and stability."""

    eigenvalues: tuple[tuple[float | Expr, float | Expr], ...]
    frequencies: tuple[float | Expr, ...]
    stability: Stability


def factored_polynomial(e: Expr, unknown: str) -> list[tuple[dict[int, Expr], int]]:
    """The irreducible factors that hold a name, as coefficients by their powers, each with its exponent.

    Raises ExpressionError where the polynomial is too large.
    """
    found = []
    for factor, times in factors(e, Allowance(MAX_STEPS)):
        parts = coefficients(factor, [unknown]) if unknown in factor.names and times > 0 else None
        if parts is not None:
            found.append(({power: value for (power,), value in parts.items()}, times))
    return found


def determinant(matrix: Matrix) -> Expr:
    """The determinant of a matrix of few entries. Raises ExpressionError where it has too many products."""
    if math.prod(sum(1 for e in row if e) or 1 for row in matrix) > MOST_PRODUCTS:
        raise ExpressionError("the determinant is too large")
    return matrices.determinant(matrix)


def sign_of(e: Expr, known: Known) -> int | None:
    """The sign that an expression has for known values, and any positive ones of other names."""
    if e.is_zero:
        return 0
    try:
        positive = {name: symbol(name, positive=True) for name in e.names}
        found = weak_sign(substitute(e, {**positive, **known}))
    except ExpressionError:
        return None
    return None if found is None else found[0]


def is_positive_definite(matrix: Matrix, known: Known) -> bool:
    """Whether a symmetric matrix is positive definite, by its leading minors."""
    size = range(1, len(matrix) + 1)
    minors = (determinant(matrices.part(matrix, range(k), range(k))) for k in size)
    return all(sign_of(minor, known) == 1 for minor in minors)


def positive_root(square: Expr, known: Known) -> Expr:
    """The root of a square that no positive parameters make zero, in its shortest form."""
    free = root_of_either_sign(square)
    sizes = samples.values([free], {name: float(value) for name, value in known.items()}, count=SIGNS)
    root = square ** Fraction(1, 2)
    if sizes is None or sizes.min() < 0 < sizes.max():
        return root
    return shortest([root, tidy(free if sizes.min() >= 0 else -free)])


def roots(polynomial: Mapping[int, Expr], known: Known, bounded: bool) -> list[Root] | None:
    """The roots of a factor with Im s >= 0, and of s and -s the one that grows; None without a closed form.

    `bounded` says that all roots are imaginary.
    """
    highest = max(polynomial)
    a, b, c = (polynomial.get(highest * k // 2, ZERO) for k in (2, 1, 0))
    if highest == 1:
        s = tidy(-polynomial.get(0, ZERO) / polynomial[1])
        sign = sign_of(s, known)
        return None if sign is None else [Root(s, ZERO, sign < 0 if sign else None)]
    if highest not in (2, 4) or not polynomial.keys() <= {0, highest // 2, highest}:
        return None
    if highest == 2 and b:
        return _damped(a, b, c, known)
    if highest == 2:
        return [_of_square(tidy(-c / a), known, -1 if bounded else None)]
    return _biquadratic(a, b, c, known, bounded)


def _of_square(square: Expr, known: Known, sign: int | None = None) -> Root:
    """The root of s^2 = `square`; where the sign of that is open, it is taken to oscillate."""
    sign = sign_of(square, known) if sign is None else sign
    if sign == 1:
        return Root(positive_root(square, known), ZERO, False)
    angular = positive_root(-square, known)
    return Root(ZERO, angular, True) if sign else Root(ZERO, angular, None, tidy(-square))


def _biquadratic(a: Expr, b: Expr, c: Expr, known: Known, bounded: bool) -> list[Root] | None:
    """The roots of a s^4 + b s^2 + c; both s^2 are taken to be real where that is open."""
    middle, rest = tidy(-b / (2 * a)), tidy(b**2 - 4 * a * c)
    # Of two squares with a positive product both have the sign of their mean, else one has either.
    product, mean = sign_of(c / a, known), sign_of(middle, known)
    are_real = 1 if bounded or product == -1 else sign_of(rest, known)
    if are_real == 0:
        return None
    if are_real == -1:
        size = positive_root(tidy(c / a), known)
        growth, angular = (positive_root(tidy((size + side * middle) / 2), known) for side in (1, -1))
        return [Root(growth, angular, False)]
    signs = (mean, mean) if are_real and product == 1 else (1, -1) if product == -1 else (None, None)
    signs = (-1, -1) if bounded else signs
    width = positive_root(rest, known)
    squares = [
        shortest([(-b + side * width) / (2 * a), tidy((-b + side * width) / (2 * a))]) for side in (1, -1)
    ]
    found = [_of_square(square, known, sign) for square, sign in zip(squares, signs, strict=True)]
    if not are_real:
        discriminant = tidy(rest / (4 * a**2))
        found = [
            root._replace(is_stable=None, condition=discriminant) if root.is_stable else root
            for root in found
        ]
    if product != 1 or any(root.growth for root in found):
        return found
    # sqrt(m - d) = sqrt((m + r)/2) - sqrt((m - r)/2), where r^2 = m^2 - d^2, may be shorter, and m > r is
    # what both oscillate for.
    size = positive_root(tidy(c / a), known)
    condition = None if found[0].is_stable else tidy(-middle - size)
    first, second = (positive_root(tidy((side * size - middle) / 2), known) for side in (1, -1))
    forms = tidy(first - second), tidy(first + second)
    return [
        root._replace(angular=shortest([root.angular, form]), condition=condition)
        for root, form in zip(found, forms, strict=True)
    ]


def _damped(a: Expr, b: Expr, c: Expr, known: Known) -> list[Root] | None:
    """The roots of a s^2 + b s + c: two real ones, or one of two that are complex."""
    middle, discriminant = tidy(-b / (2 * a)), tidy((b**2 - 4 * a * c) / (4 * a**2))
    sign, decay = sign_of(discriminant, known), sign_of(middle, known)
    if decay is None:
        return None
    if sign is None or sign < 0:
        condition = None if sign else -discriminant
        return [Root(middle, positive_root(-discriminant, known), decay <= 0, condition)]
    width = positive_root(discriminant, known) if sign else ZERO
    values = [tidy(middle + side * width) for side in ((1, -1) if sign else (1,))]
    signs = [sign_of(value, known) for value in values]
    if None in signs:
        return None
    pairs = zip(values, signs, strict=True)
    return [Root(value, ZERO, own < 0 if own else None) for value, own in pairs if own is not None]


def blocks(matrix: Matrix) -> list[list[int]]:
    """The places of coordinates and momenta of freedoms that act on each other."""
    size = len(matrix) // 2
    pairs = [(0, 0), (0, size), (size, 0), (size, size)]

    def linked(i: int, j: int) -> bool:
        return any(not (matrix[i + a][j + b].is_zero and matrix[j + a][i + b].is_zero) for a, b in pairs)

    groups = matrices.connected(size, linked)
    return [[*group, *(i + size for i in group)] for group in groups]


def symbolic_spectrum(matrix: Matrix, known: Known) -> Spectrum | None:
    """The spectrum of A (2n by 2n, coordinates first) in symbols; None where it has no short form."""
    pairs: list[tuple[Expr, Expr]] = []
    verdicts: list[Stability] = ["stable"]
    for block in blocks(matrix):
        inner = matrices.part(matrix, block, block)
        try:
            found = _of_block(inner, known)
        except ExpressionError:
            return None
        if found is None:
            return None
        pairs += found[0]
        verdicts.append(found[1])
    frequencies = dict.fromkeys(im for re, im in pairs if not re and im and sign_of(im, known) == 1)
    return Spectrum(tuple(pairs), tuple(frequencies), _worst(verdicts))


def _worst(verdicts: Iterable[Stability]) -> Stability:
    return max(verdicts, key=("stable", "marginal", "unstable").index)


def _of_block(matrix: Matrix, known: Known) -> tuple[list[tuple[Expr, Expr]], Stability] | None:
    """The eigenvalues of freedoms that act on each other, as often as they are, and the verdict."""
    size = len(matrix) // 2
    unit = [[ONE if i == j else ZERO for j in range(2 * size)] for i in range(2 * size)]
    shifted = [[a - S * b for a, b in zip(*rows, strict=True)] for rows in zip(matrix, unit, strict=True)]
    # A = J S, with S the second derivatives of H: where these are definite, motion is bounded.
    second = [*([-e for e in row] for row in matrix[size:]), *matrix[:size]]
    is_hamiltonian = all(is_zero(second[i][j] - second[j][i]) for i in range(2 * size) for j in range(i))
    bounded = is_hamiltonian and is_positive_definite(second, known)
    parts = factored_polynomial(determinant(shifted), str(S))
    pairs: list[tuple[Expr, Expr]] = []
    grows = False
    for polynomial, times in parts:
        found = roots(polynomial, known, bounded)
        if found is None or any(root.condition is not None for root in found):
            return None
        is_even = all(power % 2 == 0 for power in polynomial)
        for growth, angular, is_stable, _ in found:
            grows |= is_stable is False
            signs = [(1, 1), (-1, -1)] if is_even or not growth else [(1, 1), (1, -1)]
            if is_even and growth and angular:
                signs = [(-1, -1), (1, 1), (-1, 1), (1, -1)]
            if (not growth and not angular) or (not is_even and not angular):
                signs = [(1, 1)]
            pairs += [(a * growth, b * angular) for a, b in sorted(signs)] * times
    if grows:
        return pairs, "unstable"
    return pairs, "stable" if _is_semisimple(matrix, unit, parts) else "marginal"


def _is_semisimple(matrix: Matrix, unit: Matrix, parts: Sequence[tuple[Mapping[int, Expr], int]]) -> bool:
    """Whether A is a root of the product of the different factors, so that it has all of its eigenvectors."""
    if all(times == 1 for _, times in parts):
        return True
    whole: Matrix = unit
    for polynomial, _ in parts:
        value: Matrix = [[ZERO] * len(matrix) for _ in matrix]
        for k in range(max(polynomial), -1, -1):
            value = _times(value, matrix)
            c = polynomial.get(k, ZERO)
            value = [
                [a + c * b for a, b in zip(*rows, strict=True)] for rows in zip(value, unit, strict=True)
            ]
        whole = _times(whole, value)
    return all(is_zero(e) for row in whole for e in row)


def _times(a: Matrix, b: Matrix) -> list[list[Expr]]:
    """The product of two matrices, its entries tidied."""
    return [[tidy(entry) for entry in row] for row in matrices.product(a, b)]


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


def eigenvalues(
    matrix: Any, rounding: float = ROUNDING, square_root: bool = False, weights: Sequence[Any] = ()
) -> list[Eigenvalue]:
    """The different eigenvalues of a matrix of python-flint's balls (n by n), or the roots of these.

    Of the vectors there are as many entries as `weights`, in units of 1/weight.
    """
    from flint import acb_mat, ctx

    with ctx.workprec(BITS):
        found, vectors = acb_mat(matrix).eig(right=True, algorithm="approx")
        values = [value.sqrt() for value in found] if square_root else found
        size = len(weights) or matrix.nrows()
        groups = list(_groups(values, rounding))
        return [
            Eigenvalue(re, im, np.array([_column(vectors, j, size, weights) for j in places]))
            for places, (re, im) in groups
        ]


def balls(matrix: Sequence[Sequence[Expr | float]]) -> Any:
    """A matrix of python-flint's numbers."""
    from flint import arb_mat, ctx

    with ctx.workprec(BITS):
        return arb_mat(
            [
                [enclosed(e, {}, BITS).mid() if isinstance(e, Expr) else float(e) for e in row]
                for row in matrix
            ]
        )


def _column(vectors: Any, j: int, size: int, weights: Sequence[Any]) -> Array:
    """The upper entries of a column times the weights, of length 1."""
    entries = [vectors[i, j] * (weights[i] if weights else 1) for i in range(size)]
    scale = max(abs(entry) for entry in entries)
    column = np.array([complex((entry / scale).mid()) for entry in entries])
    return np.asarray(column / np.linalg.norm(column))


def _groups(values: Sequence[Any], rounding: float) -> Iterator[tuple[list[int], list[float]]]:
    """Places of equal eigenvalues, with their real and imaginary parts; what is rounding there is zero."""
    sizes = [float(abs(value).mid()) for value in values]
    found: list[tuple[list[int], Any]] = []
    for place, value in enumerate(values):
        if sizes[place] <= rounding * max(sizes):
            value = value * 0
        limit = rounding * sizes[place]
        group = next((places for places, other in found if float(abs(value - other).mid()) <= limit), None)
        if group is None:
            found.append(([place], value))
        else:
            group.append(place)
    for places, value in found:
        parts = [float(value.real.mid()), float(value.imag.mid())]
        yield places, [0.0 if abs(part) <= rounding * math.hypot(*parts) else part for part in parts]


def numeric_spectrum(matrix: Sequence[Sequence[Expr | float]]) -> Spectrum:
    """The spectrum of A (2n by 2n, coordinates first) in numbers; floats are the fractions that they are."""
    size = len(matrix) // 2
    a, b, d, e = ([row[k : k + size] for row in matrix[i : i + size]] for i in (0, size) for k in (0, size))
    from flint import ctx

    is_natural = not any(entry for part in (a, e) for row in part for entry in row)
    with ctx.workprec(BITS):
        back = balls(b) * balls(d) if is_natural and not balls(b).det().contains(0) else None
    if back is not None:
        # Coordinates obey q'' = B D q. At a rate of zero they drift.
        found = eigenvalues(back, square_root=True)
        pairs = [(side * x.growth, side * x.angular) for x in found for _ in x.vectors for side in (1, -1)]
        drifting = [x for x in found if not x.growth and (not x.angular or x.rank < len(x.vectors))]
    else:
        found = eigenvalues(balls(matrix))
        pairs = [(x.growth, x.angular) for x in found for _ in x.vectors]
        drifting = [x for x in found if not x.growth and x.rank < len(x.vectors)]
    frequencies = sorted({im for re, im in pairs if im > 0 and not re})
    grows = any(re > 0 for re, _ in pairs)
    verdict: Stability = "unstable" if grows else "marginal" if drifting else "stable"
    return Spectrum(tuple(sorted((re + 0.0, im + 0.0) for re, im in pairs)), tuple(frequencies), verdict)
