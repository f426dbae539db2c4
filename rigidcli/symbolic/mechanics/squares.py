"""The kinetic energy of momenta, H = P.M^-1.P/2, as a sum of squares.

Each block of the mass matrix M is written in the shortest of these forms:

    L typed as the sum of a_k (W_k.v)^2, as many squares as velocities:  H = sum_k pi_k^2/(4 a_k), W^T pi = P,
                                        as of a body with angular velocities about its principal axes
    squares completed one after the other:  H = P_j^2/(2 M_jj) + the same of M_ik - M_ij M_jk/M_jj and of
                                        P_i - M_ij P_j/M_jj, for all others i and k
    coefficient by coefficient:         H = sum_ij (M^-1)_ij P_i P_j/2, of three momenta and more

Source: the second is Lagrange's reduction, G. H. Golub, C. F. Van Loan, Matrix Computations, 4th edition,
section 4.1 (L D L^T); the first is the second of a basis in which M is diagonal.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from fractions import Fraction
from typing import TypeAlias

from rigidcli.symbolic.algebra.atoms import Group, Symbol
from rigidcli.symbolic.algebra.calculus import coefficients
from rigidcli.symbolic.algebra.expressions import ONE, ZERO, Expr, gathered, total
from rigidcli.symbolic.algebra.simplification import over_shared_sums, shortest, tidy
from rigidcli.symbolic.mechanics import mass_matrix
from rigidcli.symbolic.mechanics.hamilton_equations import coefficient, has_degrees

Squares: TypeAlias = Sequence[tuple[Expr, Sequence[Expr]]]
"""Pairs of a factor and a row of coefficients of the velocities: factor*(row.v)^2."""

_HALF = Fraction(1, 2)


def typed_squares(e: Expr, velocities: Sequence[str]) -> Squares:
    """The squares whose sum the terms of degree 2 are, as they are typed; none where there are others."""
    try:
        return list(_squares(e, velocities, ONE))
    except ValueError:
        return []


def _squares(e: Expr, velocities: Sequence[str], factor: Expr) -> Iterator[tuple[Expr, Sequence[Expr]]]:
    """The same of a sum that stands behind a factor. Raises ValueError where there are other terms."""
    for monomial, number in e.terms.items():
        moving = [(atom, n) for atom, n in monomial if not atom.names.isdisjoint(velocities)]
        if not moving:
            continue
        ((atom, exponent), *others) = moving
        if others or exponent not in (1, 2) or not isinstance(atom, Symbol | Group):
            raise ValueError("no square")
        kept = factor * gathered(number, {other: n for other, n in monomial if other is not atom})
        inner = atom.inner if isinstance(atom, Group) else Expr({((atom, 1),): 1})
        found = coefficients(inner, velocities)
        if not has_degrees(found, 0, 1):
            if exponent == 2:
                raise ValueError("no square")
            yield from _squares(inner, velocities, kept)
        elif exponent == 2:
            size = len(velocities)
            yield kept, [coefficient(found, size, place) for place in range(size)]


def kinetic_energy(
    matrix: mass_matrix.Matrix, inverse: mass_matrix.Matrix, momenta: Sequence[Expr], squares: Squares
) -> Expr:
    """P.M^-1.P/2 of a mass matrix, its inverse (n by n each) and momenta (n).

    `squares` are those as whose sum v.M.v/2 was typed; none if it was not.
    """
    energy = []
    alone: dict[Expr, list[Expr]] = {}
    for block in mass_matrix.blocks(inverse):
        if len(block) == 1 and len(momenta[block[0]].terms) == 1:
            alone.setdefault(inverse[block[0]][block[0]] / 2, []).append(momenta[block[0]] ** 2)
            continue
        own, back = mass_matrix.part(matrix, block, block), mass_matrix.part(inverse, block, block)
        inside = [(a, [row[i] for i in block]) for a, row in squares if any(row[i] != ZERO for i in block)]
        energy.append(shortest(list(_forms(own, back, [momenta[i] for i in block], inside))))
    energy += [factor * total(equal) for factor, equal in alone.items()]
    return over_shared_sums(total(energy))


def _forms(
    matrix: mass_matrix.Matrix, inverse: mass_matrix.Matrix, momenta: Sequence[Expr], squares: Squares
) -> Iterator[Expr]:
    """The energy of one block in several forms."""
    size = range(len(momenta))
    if 2 <= len(size) == len(squares) <= mass_matrix.LARGEST:
        yield from _dual(momenta, squares)
    if 2 <= len(size) <= mass_matrix.LARGEST:
        yield from _completed(matrix, [inverse[i][i] for i in size], momenta)
    if len(size) != 2 or matrix[0][0].is_zero is matrix[1][1].is_zero is True:
        pairs = [(i, j) for i in size for j in size[i:]]
        yield tidy(
            total(inverse[i][j] * (_HALF if i == j else 1) * momenta[i] * momenta[j] for i, j in pairs)
        )


def _dual(momenta: Sequence[Expr], squares: Squares) -> Iterator[Expr]:
    """The squares of the momenta that belong to the velocities which are squared."""
    columns = [row for _, row in squares]
    whole = tidy(mass_matrix.determinant(columns))
    if whole.is_zero:
        return
    size, energy = range(len(momenta)), []
    for k, (factor, _) in enumerate(squares):
        rows = [row for place, row in enumerate(columns) if place != k]
        minors = [
            mass_matrix.determinant(mass_matrix.part(rows, size[:-1], [*size[:i], *size[i + 1 :]]))
            for i in size
        ]
        momentum = tidy(
            total(tidy(minor / whole) * (-1) ** (i + k) * momenta[i] for i, minor in enumerate(minors))
        )
        energy.append(tidy(1 / (4 * factor)) * momentum**2)
    yield total(energy)


def _completed(matrix: mass_matrix.Matrix, last: Sequence[Expr], momenta: Sequence[Expr]) -> Iterator[Expr]:
    """The completed squares; `last` are the diagonal entries of the inverse of the whole block."""
    if len(momenta) == 1:
        yield last[0] * _HALF * momenta[0] ** 2
        return
    pivots = [(str(row[i]), i) for i, row in enumerate(matrix) if not row[i].is_zero]
    if len(momenta) > 2:
        pivots = sorted(pivots, key=lambda pivot: len(pivot[0]))[:1]
    for _, j in pivots:
        others = [i for i in range(len(momenta)) if i != j]
        slopes = {i: tidy(matrix[i][j] / matrix[j][j]) for i in others}
        left = (
            [[tidy(matrix[i][k] - slopes[i] * matrix[j][k]) for k in others] for i in others]
            if len(others) > 1
            else [[ONE]]
        )
        rest = [momenta[i] - slopes[i] * momenta[j] for i in others]
        for energy in _completed(left, [last[i] for i in others], rest):
            yield energy + tidy(_HALF / matrix[j][j]) * momenta[j] ** 2
