"""The Legendre transform: from a Lagrangian L(q, v, t) to momenta, velocities and the Hamiltonian.

    p_i = dL/dv_i,   H(q, p, t) = sum_i p_i v_i - L

Where L is quadratic in the velocities, L = v.M.v/2 + b.v - V, nothing is solved but M v = p - b, block by
block, and H = (p - b).M^-1.(p - b)/2 + V. Other terms are inverted by the closed forms of
`velocity_inversion`.
What has none is left implicit: it can be evaluated, but not written.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 8.1; in its matrix form
there T = v.T.v/2 and a = b. Here no velocity is eliminated by a general solver, and H is not simplified as a
whole: each coefficient is, by itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product as combinations
from typing import TypeAlias

from rigidcli.symbolic.algebra.calculus import coefficients, derivative
from rigidcli.symbolic.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.symbolic.algebra.simplification import over_shared_sums, shortest, tidy
from rigidcli.symbolic.mechanics import mass_matrix
from rigidcli.symbolic.mechanics.hamilton_equations import coefficient, has_degrees
from rigidcli.symbolic.mechanics.squares import Squares, energies, typed_squares
from rigidcli.symbolic.mechanics.velocity_inversion import Branch, inverted_velocities, quadratic_form

MOST_BRANCHES = 16
"""The most branches that are listed: more of them nobody would read."""


@dataclass(frozen=True, slots=True)
class Momenta:
    """The momenta p_i = dL/dv_i (n), and the matrix of their derivatives by the velocities (n by n)."""

    definitions: tuple[Expr, ...]
    mass_matrix: tuple[tuple[Expr, ...], ...]


_Part: TypeAlias = tuple[Expr, list[int]]
"""Terms of a Lagrangian, and the places of the velocities in them."""


def canonical_momenta(lagrangian: Expr, velocities: Sequence[str]) -> Momenta:
    """The momenta of a Lagrangian with these velocities."""
    definitions = tuple(tidy(derivative(lagrangian, name)) for name in velocities)
    size = range(len(velocities))
    upper = [[tidy(derivative(definitions[i], velocities[j])) for j in size[i:]] for i in size]
    matrix = tuple(tuple(upper[min(i, j)][abs(i - j)] for j in size) for i in size)
    return Momenta(definitions, matrix)


def legendre_transform(lagrangian: Expr, velocities: Sequence[str], names: Sequence[str]) -> list[Branch]:
    """All ways back from the momenta, called `names`; none where the velocities have no closed form.

    The mass matrix must be regular.
    """
    still, parts = _parts(lagrangian, velocities)
    p = [symbol(name) for name in names]
    options = [_inverted(part, velocities, p) for part in parts]
    chosen = combinations(*options) if math.prod(map(len, options)) <= MOST_BRANCHES else ()
    return [_joined(choice, parts, still, len(p)) for choice in chosen]


def _joined(chosen: Sequence[Branch], parts: Sequence[_Part], still: Expr, size: int) -> Branch:
    """The branch of the whole Lagrangian, from one branch of each part."""
    velocities = [ZERO] * size
    for branch, (_, places) in zip(chosen, parts, strict=True):
        for place, velocity in zip(places, branch.velocities, strict=True):
            velocities[place] = velocity
    hamiltonian = total([*(branch.hamiltonian for branch in chosen), -still])
    return Branch(tuple(velocities), hamiltonian, tuple(e for branch in chosen for e in branch.conditions))


def _parts(lagrangian: Expr, velocities: Sequence[str]) -> tuple[Expr, list[_Part]]:
    """The terms without velocities, and the others: all, if they are quadratic, or those that share some."""
    every = range(len(velocities))
    found = coefficients(lagrangian, velocities)
    if has_degrees(found, 0, 1, 2):
        still = coefficient(found, len(velocities))
        return still, [(lagrangian - still, list(every))]
    terms = [
        (term, {i for i in every if velocities[i] in term.names})
        for term in (Expr({monomial: factor}) for monomial, factor in lagrangian.terms.items())
    ]
    groups = mass_matrix.connected(len(velocities), lambda i, j: any({i, j} <= places for _, places in terms))
    parts = [(total(term for term, places in terms if places & {*group}), group) for group in groups]
    return total(term for term, places in terms if not places), parts


def _inverted(part: _Part, velocities: Sequence[str], momenta: Sequence[Expr]) -> list[Branch]:
    """All that is known of going back from the momenta of a part to its velocities."""
    e, places = part
    names, size = [velocities[place] for place in places], len(places)
    found, others = coefficients(e, names), []
    if not has_degrees(found, 0, 1, 2):
        terms = [Expr({monomial: factor}) for monomial, factor in e.terms.items()]
        others = [term for term in terms if not has_degrees(coefficients(term, names), 1)]
        found = coefficients(e - total(others), names) or {}
    shifted = [momenta[place] - coefficient(found, size, i) for i, place in enumerate(places)]
    if not others:
        matrix = [[2 * entry for entry in row] for row in quadratic_form(found, size)]
        return _of_masses(matrix, shifted, typed_squares(e, names))
    return inverted_velocities(others[0], names, shifted) if len(others) == 1 else []


def _of_masses(matrix: mass_matrix.Matrix, momenta: Sequence[Expr], typed: Squares) -> list[Branch]:
    """The inverse for L = v.M.v/2, block by block; `typed` are the squares as whose sum it was typed."""
    inverse = mass_matrix.inverse(matrix)
    if inverse is None:
        return []
    size = range(len(momenta))
    velocities = tuple(tidy(total(inverse[i][j] * momenta[j] for j in size)) for i in size)
    energy = []
    alone: dict[Expr, list[Expr]] = {}
    for block in mass_matrix.blocks(inverse):
        if len(block) == 1 and len(momenta[block[0]].terms) == 1:
            alone.setdefault(inverse[block[0]][block[0]] / 2, []).append(momenta[block[0]] ** 2)
        else:
            own, back = mass_matrix.part(matrix, block, block), mass_matrix.part(inverse, block, block)
            form = _energy(back, own, [momenta[i] for i in block])
            energy.append(shortest([form, *energies(block, momenta, typed)]))
    energy += [factor * total(squares) for factor, squares in alone.items()]
    return [Branch(velocities, over_shared_sums(total(energy)))]


def _energy(inverse: mass_matrix.Matrix, matrix: mass_matrix.Matrix, momenta: Sequence[Expr]) -> Expr:
    """P.M^-1.P/2 of one block: of two momenta as squares, of more coefficient by coefficient."""
    size = range(len(momenta))
    half = Fraction(1, 2)
    if len(momenta) == 2:
        # (M^-1)_ij/(M^-1)_ii = -M_ij/M_jj, and what is left when the square is complete is P_j^2/M_jj.
        return shortest(
            [
                inverse[i][i] * half * (momenta[i] - tidy(matrix[i][j] / matrix[j][j]) * momenta[j]) ** 2
                + tidy(half / matrix[j][j]) * momenta[j] ** 2
                for i, j in ((0, 1), (1, 0))
                if not matrix[j][j].is_zero
            ]
            or [inverse[0][1] * momenta[0] * momenta[1]]
        )
    pairs = [(i, j) for i in size for j in size[i:]]
    return tidy(total(inverse[i][j] * (half if i == j else 1) * momenta[i] * momenta[j] for i, j in pairs))
