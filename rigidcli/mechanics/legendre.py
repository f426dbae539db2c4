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
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from fractions import Fraction
from itertools import product as combinations
from typing import NamedTuple

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficients, expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.simplification import over_shared_sums, shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import coefficient, has_degrees
from rigidcli.mechanics.polynomial_inversion import inverted_polynomial
from rigidcli.mechanics.squares import Squares, energies, typed_squares
from rigidcli.mechanics.velocity_inversion import (
    Branch,
    inverted_kernel,
    quadratic_form,
)
from rigidcli.mechanics.velocity_terms import Kernel, places_in, restricted, sorted_terms

MOST_BRANCHES = 16
"""The most branches that are listed: more of them nobody would read."""

SHORT = 300
"""Characters of an H as a sum of squares, up to which no shorter one is looked for: four lines."""

LONGEST_TO_TIDY = 2_000
"""The longest key of a velocity that is made shorter: about ten lines of text."""

NOTHING: Mapping[str, Expr] = {}
"""Values of no names."""


@dataclass(frozen=True, slots=True)
class Momenta:
    """The momenta p_i = dL/dv_i (n), and the matrix of their derivatives by the velocities (n by n)."""

    definitions: tuple[Expr, ...]
    mass_matrix: tuple[tuple[Expr, ...], ...]

    def are_linear(self, velocities: Sequence[str]) -> bool:
        """Whether they are linear in the velocities."""
        return all(has_degrees(coefficients(p, velocities), 0, 1) for p in self.definitions)


class _Part(NamedTuple):
    """The places of some velocities, and the terms of a Lagrangian in these, in this order."""

    places: list[int]
    polynomial: Polynomial
    kernels: list[Kernel]


def canonical_momenta(lagrangian: Expr, velocities: Sequence[str]) -> Momenta:
    """The momenta of a Lagrangian with these velocities."""
    definitions = tuple(tidy(derivative(lagrangian, name)) for name in velocities)
    size = range(len(velocities))
    upper = [[tidy(derivative(definitions[i], velocities[j])) for j in size[i:]] for i in size]
    matrix = tuple(tuple(upper[min(i, j)][abs(i - j)] for j in size) for i in size)
    return Momenta(definitions, matrix)


def legendre_transform(
    lagrangian: Expr,
    velocities: Sequence[str],
    names: Sequence[str],
    values: Mapping[str, Expr] = NOTHING,
) -> list[Branch]:
    """All ways back from the momenta, called `names`; none where no closed form is known.

    Where their form depends on signs, as that of a mass, it is the form for the `values` of parameters and
    coordinates, and where these do not tell for positive ones. The mass matrix must be regular.
    """
    sorted_out = _parts(lagrangian, velocities)
    if sorted_out is None:
        return []
    still, parts = sorted_out
    p = [symbol(name) for name in names]
    typed = typed_squares(lagrangian, velocities)
    options = [_likely(_inverted(part, p, typed), values) for part in parts]
    chosen = combinations(*options) if math.prod(map(len, options)) <= MOST_BRANCHES else ()
    return [_joined(choice, parts, still, len(p)) for choice in chosen]


def _likely(branches: Sequence[Branch], values: Mapping[str, Expr]) -> list[Branch]:
    """The branches in one region: in that of the values, or else in the first."""
    signs = [[substitute(e, values) for e in branch.region] for branch in branches]
    possible = [
        branch
        for branch, known in zip(branches, signs, strict=True)
        if not any(not e.names and e.evaluate() <= 0 for e in known)
    ]
    return [branch for branch in possible if branch.region == possible[0].region]


def _joined(chosen: Sequence[Branch], parts: Sequence[_Part], still: Expr, size: int) -> Branch:
    """The branch of the whole Lagrangian, from one branch of each part."""
    velocities = [ZERO] * size
    for branch, part in zip(chosen, parts, strict=True):
        for place, velocity in zip(part.places, branch.velocities, strict=True):
            velocities[place] = velocity
    return Branch(
        tuple(velocities),
        total([*(branch.hamiltonian for branch in chosen), -still]),
        tuple(e for branch in chosen for e in branch.conditions),
        tuple(e for branch in chosen for e in branch.region),
        next((branch.period for branch in chosen if branch.period is not None), None),
        any(branch.is_continued for branch in chosen),
    )


def _parts(lagrangian: Expr, velocities: Sequence[str]) -> tuple[Expr, list[_Part]] | None:
    """What is without velocities, and the others: all, if they are quadratic, or those that share some.

    None where a term has no form that is known.
    """
    size = len(velocities)
    still = total(
        Expr({monomial: factor})
        for monomial, factor in lagrangian.terms.items()
        if all(atom.names.isdisjoint(velocities) for atom, _ in monomial)
    )
    found = sorted_terms(lagrangian - still, velocities)
    if found is None:
        return None
    polynomial, kernels = found
    still = _cancelled(still, coefficient(polynomial, size))
    if not kernels and has_degrees(polynomial, 0, 1, 2):
        groups = [list(range(size))]
    else:
        links = [*(kernel.places for kernel in kernels), *map(places_in, polynomial)]
        groups = matrices.connected(size, lambda i, j: any({i, j} <= places for places in links))
    parts = []
    for group in groups:
        own = {powers: e for powers, e in polynomial.items() if places_in(powers) & {*group}}
        inner = [kernel for kernel in kernels if kernel.places & {*group}]
        parts.append(_Part(group, restricted(own, group), [kernel.restricted(group) for kernel in inner]))
    return still, parts


def _cancelled(typed: Expr, rest: Expr) -> Expr:
    """Terms as they are typed, and what is left of others: together, if some of them cancel."""
    both = typed + rest
    with suppress(ExpressionError):
        if typed.terms and rest.terms and len(expand(both).terms) < len(both.terms):
            return tidy(both)
    return both


def _inverted(part: _Part, momenta: Sequence[Expr], typed: Squares) -> list[Branch]:
    """All that is known of going back from the momenta of a part to its velocities."""
    places, found, kernels = part
    size = len(places)
    own = [momenta[place] for place in places]
    if kernels and not has_degrees(found, 1):
        return []
    if not has_degrees(found, 1, 2):
        return inverted_polynomial(found, own)
    shifted = [P - coefficient(found, size, place) for place, P in enumerate(own)]
    if not kernels:
        matrix = [[2 * entry for entry in row] for row in quadratic_form(found, size)]
        return _of_masses(matrix, shifted, [(a, [row[place] for place in places]) for a, row in typed])
    return inverted_kernel(kernels[0], shifted) if len(kernels) == 1 else []


def _of_masses(matrix: matrices.Matrix, momenta: Sequence[Expr], typed: Squares) -> list[Branch]:
    """The inverse for L = v.M.v/2, block by block; `typed` are the squares as whose sum it was typed."""
    velocities = [ZERO] * len(momenta)
    energy = []
    alone: dict[Expr, list[Expr]] = {}
    for block in matrices.blocks(matrix):
        own, P = matrices.part(matrix, block, block), [momenta[place] for place in block]
        if len(block) == 1 and len(P[0].terms) == 1:
            velocities[block[0]] = tidy(P[0] / own[0][0])
            alone.setdefault(tidy(1 / own[0][0]) / 2, []).append(P[0] ** 2)
            continue
        squares = _of_squares(own, P)
        is_short = squares and len(str(squares[0].hamiltonian)) <= SHORT
        inverted = [] if is_short else _of_inverse(own, P)
        forms = [*inverted, *squares]
        if not forms:
            return []
        energy.append(shortest([*(form.hamiltonian for form in forms), *energies(block, momenta, typed)]))
        for place, velocity in zip(block, forms[0].velocities, strict=True):
            is_tidy = inverted or len(velocity.key) > LONGEST_TO_TIDY
            velocities[place] = velocity if is_tidy else tidy(velocity)
    energy += [factor * total(terms) for factor, terms in alone.items()]
    return [Branch(tuple(velocities), over_shared_sums(total(energy)))]


def _of_inverse(matrix: matrices.Matrix, momenta: Sequence[Expr]) -> list[Branch]:
    """H = P.M^-1.P/2 of one block: of two momenta as squares, of more coefficient by coefficient."""
    inverse = matrices.inverse(matrix)
    if inverse is None:
        return []
    size = range(len(momenta))
    velocities = tuple(tidy(total(inverse[i][j] * momenta[j] for j in size)) for i in size)
    half = Fraction(1, 2)
    if len(momenta) == 2:
        # (M^-1)_ij/(M^-1)_ii = -M_ij/M_jj, and what is left when the square is complete is P_j^2/M_jj.
        forms = [
            inverse[i][i] * half * (momenta[i] - tidy(matrix[i][j] / matrix[j][j]) * momenta[j]) ** 2
            + tidy(half / matrix[j][j]) * momenta[j] ** 2
            for i, j in ((0, 1), (1, 0))
            if not matrix[j][j].is_zero
        ]
        return [Branch(velocities, shortest(forms or [inverse[0][1] * momenta[0] * momenta[1]]))]
    pairs = [(i, j) for i in size for j in size[i:]]
    energy = (inverse[i][j] * (half if i == j else 1) * momenta[i] * momenta[j] for i, j in pairs)
    return [Branch(velocities, tidy(total(energy)))]


def _of_squares(matrix: matrices.Matrix, momenta: Sequence[Expr]) -> list[Branch]:
    """H as a sum of as many squares as momenta, of one block of three or more.

    With v.M.v = sum d_k w_k^2, where w_k = v_k + sum_j f_kj v_j, it is sum Q_k^2/(2 d_k), where
    P_j = Q_j + sum_k f_kj Q_k. The velocities are dH/dP_j = sum_k Q_k/d_k dQ_k/dP_j.
    """
    squares = matrices.squares(matrix) if len(momenta) > 2 else None
    if squares is None:
        return []
    size = range(len(momenta))
    Q, slopes = list(momenta), [[ONE if i == j else ZERO for j in size] for i in size]
    for k, _, others in squares:
        for j, factor in others.items():
            Q[j] -= factor * Q[k]
            slopes[j] = [a - factor * b for a, b in zip(slopes[j], slopes[k], strict=True)]
    velocities = tuple(total(slopes[k][j] * Q[k] / d for k, d, _ in squares) for j in size)
    return [Branch(velocities, total(tidy(1 / d) / 2 * Q[k] ** 2 for k, d, _ in squares))]
