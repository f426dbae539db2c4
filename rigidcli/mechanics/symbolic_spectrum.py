"""The eigenvalues of linear equations of motion in symbols: see `spectrum`."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from rigidcli.algebra import matrices
from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.arithmetic import weak_sign
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.spectrum import WORSE, Spectrum, Stability, blocks

LARGEST = 4
"""The most freedoms that act on each other whose eigenvalues are looked for in symbols."""

MAX_STEPS = 60_000
"""Steps that factoring a polynomial in symbols may take: a few tenths of a second."""

_SQUARE = "lambda^2"

_HALF = Fraction(1, 2)


def symbolic_spectrum(matrix: Matrix, known: Mapping[str, Expr]) -> Spectrum | None:
    """The spectrum of A = J S (2n by 2n, coordinates first) in symbols; None where it has no short form.

    Signs are those for the `known` values of names, and any positive ones of the others. The squares of the
    eigenvalues are the roots of a polynomial, whose factors must have degree 1 or 2.
    """
    pairs: list[tuple[Expr, Expr]] = []
    verdicts: list[Stability] = ["stable"]
    for block in blocks(matrix):
        inner = matrices.part(matrix, block, block)
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
    return Spectrum(tuple(pairs), tuple(frequencies), max(verdicts, key=WORSE.index))


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
    """The product of two matrices, its entries tidied."""
    return [[tidy(entry) for entry in row] for row in matrices.product(a, b)]


def _is_natural(matrix: Matrix, known: Mapping[str, Expr]) -> bool:
    """Whether H is a positive T of the momenta and a V of the coordinates: lambda^2 is real then."""
    size = len(matrix) // 2
    first, last = range(size), range(size, 2 * size)
    mixed = (matrices.part(matrix, half, half) for half in (first, last))
    if any(not e.is_zero for part in mixed for row in part for e in row):
        return False
    minors = (matrices.part(matrix, first[:k], last[:k]) for k in range(1, size + 1))
    return all(sign_of(matrices.determinant(minor), known) == 1 for minor in minors)


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
