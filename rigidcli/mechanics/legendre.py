"""The Legendre transform: from a Lagrangian L(q, v, t) to momenta, velocities and the Hamiltonian.

    p_i = dL/dv_i,   H(q, p, t) = sum_i p_i v_i - L

Where L is quadratic in the velocities, L = v.M.v/2 + b.v - V, nothing is solved but M v = p - b, block by
block, and H = (p - b).M^-1.(p - b)/2 + V (`quadratic_energy`). Velocities that the mass matrix does not
couple are inverted apart, by `velocity_inversion` where L is not quadratic in them. What has no closed form
is left implicit: it can be evaluated, but not written.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 8.1; in its matrix form
there T = v.T.v/2 and a = b. Here no velocity is eliminated by a general solver, and H is not simplified as a
whole, but coefficient by coefficient.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from itertools import product as combinations
from typing import NamedTuple

from rigidcli.algebra import matrices
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, expand, has_degrees
from rigidcli.algebra.expressions import ZERO, Expr, factored, product, symbol, total
from rigidcli.algebra.simplification import over_shared_sums, shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.quadratic_energy import Squares, of_blocks, typed_squares
from rigidcli.mechanics.velocity_inversion import Branch, inverted

MOST_BRANCHES = 16
"""The most branches that are listed: more of them nobody would read."""


class Momenta(NamedTuple):
    """The momenta p_i = dL/dv_i (n), and the matrix of their derivatives by the velocities (n by n)."""

    definitions: tuple[Expr, ...]
    mass_matrix: tuple[tuple[Expr, ...], ...]

    def are_linear(self, velocities: Sequence[str]) -> bool:
        """Whether they are linear in the velocities."""
        return all(has_degrees(coefficients(p, velocities), 0, 1) for p in self.definitions)


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
    values: Mapping[str, Expr] | None = None,
    momenta: Momenta | None = None,
    squares: Squares = (),
    typed: Sequence[Expr] = (),
) -> list[Branch]:
    """All ways back from the momenta, called `names`; none where no closed form is reached.

    Where their form depends on signs, as that of a mass, it is the form for the `values` of parameters and
    coordinates, and where these do not decide for positive ones, and positive sums as they are `typed` in
    products. The mass matrix must be regular. `squares` are the squares of the velocities of particles, where
    L is given by particles.
    """
    momenta = momenta or canonical_momenta(lagrangian, velocities)
    moving, still = _apart(lagrangian, velocities)
    matrix, P = momenta.mass_matrix, [symbol(name) for name in names]
    curved = [
        block
        for block in matrices.blocks(matrix)
        if any(not matrix[i][j].names.isdisjoint(velocities) for i in block for j in block)
    ]
    try:
        if curved:
            return _mixed(moving, still, curved, velocities, P, values or {}, typed)
        branch = _quadratic(lagrangian, moving, still, momenta, velocities, P, squares)
    except ExpressionError:
        return []
    return [] if branch is None else [branch]


def _apart(lagrangian: Expr, velocities: Sequence[str]) -> tuple[Expr, Expr]:
    """The terms with velocities, and the others, as they are typed."""
    still = Expr(
        {m: c for m, c in lagrangian.terms.items() if all(a.names.isdisjoint(velocities) for a, _ in m)}
    )
    return lagrangian - still, still


def _quadratic(
    lagrangian: Expr,
    moving: Expr,
    still: Expr,
    momenta: Momenta,
    velocities: Sequence[str],
    P: Sequence[Expr],
    squares: Squares,
) -> Branch | None:
    """The inverse of a Lagrangian that is quadratic in all velocities."""
    at_rest = dict.fromkeys(velocities, ZERO)
    linear = [substitute(p, at_rest) for p in momenta.definitions]
    rest = substitute(moving, at_rest)
    shifted = [p - b for p, b in zip(P, linear, strict=True)]
    coordinates = [v.removesuffix("dot") for v in velocities]
    typed = typed_squares(lagrangian, velocities)
    inverse = of_blocks(momenta.mass_matrix, shifted, typed, squares, coordinates)
    if inverse is None:
        return None
    energy = over_shared_sums(total(inverse[1]))
    forms = [energy - _cancelled(still, rest)]
    if any(linear):
        forms += _by_degrees(energy, still + rest, P)
    return Branch(tuple(inverse[0]), shortest(forms))


def _by_degrees(energy: Expr, rest: Expr, momenta: Sequence[Expr]) -> list[Expr]:
    """H by its degrees in the momenta: in a rotating frame the centrifugal potential cancels there."""
    with suppress(ExpressionError):
        polynomial = coefficients(energy, list(map(str, momenta)))
        if polynomial is not None and len(polynomial) <= matrices.LARGEST**2:
            parts: list[list[Expr]] = [[], [], []]
            for powers, e in polynomial.items():
                parts[sum(powers)].append(product([e, *(p**n for p, n in zip(momenta, powers, strict=True))]))
            free, linear, quadratic = map(total, parts)
            return [tidy(quadratic) + tidy(linear) + tidy(free - rest)]
    return []


def _cancelled(typed: Expr, rest: Expr) -> Expr:
    """Terms as they are typed, and what is left of others: together, if some of them cancel."""
    both = typed + rest
    with suppress(ExpressionError):
        if typed.terms and rest.terms and len(expand(both).terms) < len(both.terms):
            return tidy(both)
    return both


def _mixed(
    moving: Expr,
    still: Expr,
    curved: Sequence[Sequence[int]],
    velocities: Sequence[str],
    P: Sequence[Expr],
    values: Mapping[str, Expr],
    typed: Sequence[Expr],
) -> list[Branch]:
    """Invert each block of velocities in which L is not quadratic (`curved`) by itself."""
    parts = _of_groups(moving, curved, velocities) or _of_groups(expand(moving), curved, velocities)
    if parts is None:
        return []
    *kernels, plain = parts
    options, rates = [], [ZERO] * len(P)
    for group, K in zip(curved, kernels, strict=True):
        names = [velocities[place] for place in group]
        K = expand(K)
        terms = [(Expr({m: c}), coefficients(Expr({m: c}), names)) for m, c in K.terms.items()]
        linear = total(term for term, polynomial in terms if has_degrees(polynomial, 1))
        K, constant = _apart(K - linear, names)
        still += constant
        shifted = [P[k] - derivative(linear, velocities[k]) for k in group]
        options.append(_likely(inverted(K, names, shifted), values, typed))
    rest = ZERO
    if plain:
        kept = [v for k, v in enumerate(velocities) if not any(k in group for group in curved)]
        own = legendre_transform(plain, kept, [str(P[velocities.index(v)]) for v in kept])
        if not own:
            return []
        rest = own[0].hamiltonian
        for v, velocity in zip(kept, own[0].velocities, strict=True):
            rates[velocities.index(v)] = velocity
    chosen = combinations(*options) if math.prod(map(len, options)) <= MOST_BRANCHES else ()
    return [_joined(choice, curved, rates, rest - still) for choice in chosen]


def _of_groups(e: Expr, groups: Sequence[Sequence[int]], velocities: Sequence[str]) -> list[Expr] | None:
    """The terms by groups of velocities, and last the terms without any; None where a term has two groups."""
    names = [{velocities[place] for place in group} for group in groups]
    parts: list[list[Expr]] = [[] for _ in range(len(groups) + 1)]
    for monomial, c in e.terms.items():
        used = {name for atom, _ in monomial for name in atom.names if name in velocities}
        inside = [k for k, own in enumerate(names) if used & own]
        if len(inside) > 1 or (inside and not used <= names[inside[0]]):
            return None
        parts[inside[0] if inside else -1].append(Expr({monomial: c}))
    return list(map(total, parts))


def _likely(branches: Sequence[Branch], values: Mapping[str, Expr], typed: Sequence[Expr]) -> list[Branch]:
    """The branches in one region: in that of the values, or else where sums are positive as typed."""
    turned = {monomial[0][0] for size, monomial in map(factored, typed) if size < 0 and len(monomial) == 1}

    def is_typed(e: Expr) -> bool:
        size, monomial = factored(e)
        return (size > 0) == (sum(atom in turned for atom, _ in monomial) % 2 == 0)

    signs = [[substitute(e, values) for e in branch.region] for branch in branches]
    possible = [
        branch
        for branch, own in zip(branches, signs, strict=True)
        if not any(not e.names and e.evaluate() <= 0 for e in own)
    ]
    possible.sort(key=lambda branch: not all(map(is_typed, branch.region)))
    return [branch for branch in possible if branch.region == possible[0].region]


def _joined(
    chosen: Sequence[Branch], groups: Sequence[Sequence[int]], others: Sequence[Expr], rest: Expr
) -> Branch:
    """The branch of the whole Lagrangian, from one branch of every group."""
    velocities = list(others)
    for branch, group in zip(chosen, groups, strict=True):
        for place, velocity in zip(group, branch.velocities, strict=True):
            velocities[place] = velocity
    return Branch(
        tuple(velocities),
        total([*(branch.hamiltonian for branch in chosen), rest]),
        tuple(e for branch in chosen for e in branch.conditions),
        tuple(e for branch in chosen for e in branch.region),
        next((branch.period for branch in chosen if branch.period is not None), None),
    )
