"""The kinetic energy of momenta where that of velocities was typed as a sum of squares.

Of L = sum_k a_k (W_k.v)^2, as many squares as velocities, the energy is

    H = sum_k pi_k^2/(4 a_k),  W^T pi = P

as of a body, whose momenta pi_k are those about its axes. It is derived here from P = W^T pi and
pi_k = 2 a_k W_k.v.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TypeAlias

from rigidcli.algebra import matrices
from rigidcli.algebra.atoms import Group, Symbol
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, ZERO, Expr, gathered, total
from rigidcli.algebra.simplification import tidy
from rigidcli.mechanics.hamilton_equations import coefficient, has_degrees

Squares: TypeAlias = Sequence[tuple[Expr, Sequence[Expr]]]
"""Pairs of a factor a and the row W of coefficients of the velocities in a (W.v)^2."""


def typed_squares(e: Expr, velocities: Sequence[str]) -> Squares:
    """The squares whose sum the terms of degree 2 are, as they are typed; none where there are others."""
    try:
        return list(_squares(e, velocities, ONE))
    except ValueError:
        return []


def _squares(e: Expr, velocities: Sequence[str], factor: Expr) -> Iterator[tuple[Expr, Sequence[Expr]]]:
    """The same of a sum that stands behind a factor. Raises ValueError where there are other terms."""
    size = len(velocities)
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
        if has_degrees(found, 0, 1):
            if exponent == 2:
                yield kept, [coefficient(found, size, place) for place in range(size)]
        elif exponent == 1:
            yield from _squares(inner, velocities, kept)
        else:
            raise ValueError("no square")


def energies(block: Sequence[int], momenta: Sequence[Expr], squares: Squares) -> list[Expr]:
    """H of the momenta in one block of the mass matrix by these squares; none if they do not tell it."""
    size = range(len(block))
    inside = [(a, [row[i] for i in block]) for a, row in squares if any(row[i] != ZERO for i in block)]
    rows = [row for _, row in inside]
    if not 2 <= len(inside) == len(block) <= matrices.LARGEST:
        return []
    whole = tidy(matrices.determinant(rows))
    if whole.is_zero:
        return []
    energy = []
    for k, (factor, _) in enumerate(inside):
        others = [*rows[:k], *rows[k + 1 :]]
        minors = (
            matrices.determinant([[*row[:i], *row[i + 1 :]] for row in others]) * (-1) ** (i + k)
            for i in size
        )
        momentum = total(
            tidy(minor / whole) * momenta[place] for minor, place in zip(minors, block, strict=True)
        )
        energy.append(tidy(1 / (4 * factor)) * tidy(momentum) ** 2)
    return [total(energy)]
