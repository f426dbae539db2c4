"""The Legendre transform: from a Lagrangian L(q, v, t) to momenta, velocities and the Hamiltonian.

    p_i = dL/dv_i,   H(q, p, t) = sum_i p_i v_i - L

Where L is quadratic in the velocities, L = v.M.v/2 + b.v - V, nothing is solved but M v = p - b, block by
block, and H = (p - b).M^-1.(p - b)/2 + V. Velocities that the mass matrix does not
couple are inverted apart, by `inversion` where L is not quadratic in them. What has no closed form
is left implicit: it can be evaluated, but not written.

Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 8.1; in its matrix form
there T = v.T.v/2 and a = b. Here no velocity is eliminated by a general solver, and H is not simplified as a
whole, but coefficient by coefficient.

The energy P.M^-1.P/2 of a block has several forms. The shortest is taken: sums of squares by
M = L D L^T; the inverse matrix; and what follows from a kinetic energy that was typed as a sum of squares
sum_k a_k (w_k.v)^2. Of n squares in n velocities the momenta pi_k with P = W^T pi give sum_k pi_k^2/(4 a_k).
Of any number of squares in two velocities

    H = sum_k a_k (w_k x P)^2 / (4 sum_kl a_k a_l (w_k x w_l)^2)

by the formula of Cauchy and Binet. Where M is indefinite, as a metric of space and time is, its entries pass
zero at places where H has no pole. No square is completed there but by an entry of parameters alone.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import combinations, combinations_with_replacement
from typing import NamedTuple, TypeAlias

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.atoms import Group, Symbol
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficient, coefficients, expand, free_of, has_degrees, polynomial_sum
from rigidcli.algebra.expressions import ONE, ZERO, Expr, factored, gathered, symbol, total
from rigidcli.algebra.matrices import Matrix
from rigidcli.algebra.simplification import over_shared_sums, shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import sampled
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.inversion import Branch, inverted

MOST_BRANCHES = 16  # the most branches that are listed: more of them nobody would read


class Momenta(NamedTuple):
    """The momenta p_i = dL/dv_i (n), and the matrix of their derivatives by the velocities (n by n)."""

    definitions: tuple[Expr, ...]
    mass_matrix: tuple[tuple[Expr, ...], ...]


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
    matrix, P = momenta.mass_matrix, [symbol(name) for name in names]
    curved = [
        block
        for block in matrices.blocks(matrix)
        if any(not matrix[i][j].names.isdisjoint(velocities) for i in block for j in block)
    ]
    with suppress(ExpressionError):
        if curved:
            return _mixed(lagrangian, curved, velocities, P, values or {}, typed)
        return _quadratic(lagrangian, momenta, velocities, P, squares)
    return []


def _quadratic(
    lagrangian: Expr, momenta: Momenta, velocities: Sequence[str], P: Sequence[Expr], particles: Squares
) -> list[Branch]:
    at_rest, potential = dict.fromkeys(velocities, ZERO), free_of(velocities, lagrangian)
    rest = substitute(lagrangian - potential, at_rest)
    shifted = [p - substitute(b, at_rest) for p, b in zip(P, momenta.definitions, strict=True)]
    coordinates = [v.removesuffix("dot") for v in velocities]
    typed: Squares = []
    with suppress(ValueError):  # it is no sum of squares
        typed = list(_squares(lagrangian, velocities, ONE))
    found = of_blocks(momenta.mass_matrix, shifted, typed, particles, coordinates)
    if found is None:
        return []
    energy, both = over_shared_sums(total(found[1])), potential + rest
    forms = [energy - both]
    with suppress(ExpressionError):
        # What is left of other terms joins those that are typed, if some of them cancel.
        if potential.terms and rest.terms and len(expand(both).terms) < len(both.terms):
            forms = [energy - tidy(both)]
    with suppress(ExpressionError):
        # H by its degrees in the momenta: in a rotating frame the centrifugal potential cancels there.
        polynomial = None if shifted == P else coefficients(energy, list(map(str, P)))
        if polynomial is not None and len(polynomial) <= matrices.LARGEST_BLOCK**2:
            free, linear, quadratic = (
                polynomial_sum({n: e for n, e in polynomial.items() if sum(n) == degree}, P)
                for degree in range(3)
            )
            forms.append(tidy(quadratic) + tidy(linear) + tidy(free - both))
    return [Branch(tuple(found[0]), shortest(forms))]


def _mixed(
    lagrangian: Expr,
    curved: Sequence[Sequence[int]],
    velocities: Sequence[str],
    P: Sequence[Expr],
    values: Mapping[str, Expr],
    typed: Sequence[Expr],
) -> list[Branch]:
    """Invert each block of velocities in which L is not quadratic (`curved`) by itself."""
    still = free_of(velocities, lagrangian)
    moving = lagrangian - still
    parts = _of_groups(moving, curved, velocities) or _of_groups(expand(moving), curved, velocities)
    if parts is None:
        return []
    *kernels, plain = parts
    groups, options = list(curved), []
    for group, K in zip(curved, kernels, strict=True):
        names = [velocities[place] for place in group]
        K = expand(K)
        terms = [Expr({m: c}) for m, c in K.terms.items()]
        linear = total(term for term in terms if has_degrees(coefficients(term, names), 1))
        constant = free_of(names, K - linear)
        still += constant
        shifted = [P[k] - derivative(linear, velocities[k]) for k in group]
        options.append(_likely(inverted(K - linear - constant, names, shifted), values, typed))
    if plain:
        kept = [k for k in range(len(P)) if not any(k in group for group in curved)]
        groups.append(kept)
        options.append(legendre_transform(plain, [velocities[k] for k in kept], [str(P[k]) for k in kept]))
    chosen = itertools.product(*options) if math.prod(map(len, options)) <= MOST_BRANCHES else ()
    return [_joined(choice, groups, still) for choice in chosen]


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

    def is_possible(e: Expr) -> bool:
        there = substitute(e, values)
        return bool(there.names) or float(there) > 0

    possible = [branch for branch in branches if all(map(is_possible, branch.region))]
    possible.sort(key=lambda branch: not all(map(is_typed, branch.region)))
    return [branch for branch in possible if branch.region == possible[0].region]


def _joined(chosen: Sequence[Branch], groups: Sequence[Sequence[int]], potential: Expr) -> Branch:
    """The branch of the whole Lagrangian, from one branch of each group of velocities."""
    pairs = zip(groups, chosen, strict=True)
    rates = {k: v for group, branch in pairs for k, v in zip(group, branch.velocities, strict=True)}
    return Branch(
        tuple(rates[k] for k in sorted(rates)),
        total([*(branch.hamiltonian for branch in chosen), -potential]),
        tuple(e for branch in chosen for e in branch.conditions),
        tuple(e for branch in chosen for e in branch.region),
        next((branch.period for branch in chosen if branch.period is not None), None),
    )


FEW_NODES = 70  # an H as a sum of squares beyond four lines of text: the inverse matrix is tried, too
MOST_COUPLED = 6  # velocities that all act on each other, beyond which the squares are too long
MOST_ROWS = 5  # the most squares that are solved for their momenta: a load on a crane in space has so many
MOST_NODES_TO_TIDY = 200  # the most nodes of a velocity that is made shorter: about ten lines of text
MOST_NODES = 2_000  # the most nodes of the entries of a sum of squares, taken together: a few pages
HALF = Fraction(1, 2)

Squares: TypeAlias = Sequence[tuple[Expr, Sequence[Expr]]]  # factors a and the rows w of a (w.v)^2


def energy(
    matrix: Matrix, momenta: Sequence[Expr], typed: Squares, particles: Squares, coordinates: Sequence[str]
) -> tuple[Expr, Sequence[Expr]] | None:
    """H = P.M^-1.P/2 of a block (n by n), and its velocities (n); None where all forms are too long to print.

    `typed` are the squares of which the kinetic energy was typed, or else those of `particles` make it.
    """
    completed, inverse = None, None
    # Whether M is definite at random points of coordinates and positive parameters.
    values = sampled([entry for row in matrix for entry in row], {}, count=8, signed=coordinates)
    definite = values is None
    if values is not None:
        eigenvalues = np.linalg.eigvalsh(values.reshape(-1, len(matrix), len(matrix)))
        definite = bool((eigenvalues > 0).all() or (eigenvalues < 0).all())
    if len(momenta) > 2 and definite and min(sum(map(bool, row)) for row in matrix) <= MOST_COUPLED:
        completed = _completed_squares(matrix, momenta)
    forms = [] if completed is None else [total(tidy(1 / d) / 2 * q**2 for q, d, _ in completed)]
    if not forms or forms[0].nodes > FEW_NODES:
        inverse = matrices.inverse(matrix, matrices.FEW_TERMS if forms else matrices.MOST_TERMS)
    if inverse is not None:
        entries = [row[k] for k, row in enumerate(matrix)]
        # A product of parameters vanishes nowhere.
        products = [len(e.terms) == 1 and e.names.isdisjoint(coordinates) for e in entries]
        fixed = [k for k, e in enumerate(entries) if e and (definite or products[k])]
        forms += _by_inverse(inverse, matrix, momenta, fixed)
        velocities = list(map(tidy, matrices.times(inverse, momenta)))
    elif completed is not None:
        rates = (total(slope[j] * q / d for q, d, slope in completed) for j in range(len(matrix)))
        velocities = [v if v.nodes > MOST_NODES_TO_TIDY else tidy(v) for v in rates]
    else:
        return None
    squares = [(a, row) for a, row in typed if any(row)] or [(a, row) for a, row in particles if any(row)]
    return shortest([*forms, *_by_rows(squares, momenta)]), velocities


def _by_inverse(
    inverse: Matrix, matrix: Matrix, momenta: Sequence[Expr], pivots: Sequence[int]
) -> Iterator[Expr]:
    """H from the inverse matrix: of two momenta as squares by the `pivots`, or entry by entry."""
    if len(momenta) == 2:
        # (M^-1)_ij/(M^-1)_ii = -M_ij/M_jj, and what is left when the square is complete is P_j^2/M_jj.
        for j in reversed(pivots):
            square = momenta[1 - j] - tidy(matrix[0][1] / matrix[j][j]) * momenta[j]
            whole = inverse[1 - j][1 - j] * HALF * square**2
            yield whole + tidy(HALF / matrix[j][j]) * momenta[j] ** 2
    if len(momenta) > 2 or len(pivots) < 2:
        whole, atoms = matrices.quadratic_form(inverse, momenta) / 2, {a for p in momenta for a in p.atoms}
        forms = [whole, tidy(whole)]
        # Nobody writes an energy as a product with a momentum.
        yield shortest([e for e in forms if len(e.terms) > 1 or atoms.isdisjoint(dict(*e.terms))] or forms)


def _completed_squares(
    matrix: Matrix, momenta: Sequence[Expr]
) -> list[tuple[Expr, Expr, Sequence[Expr]]] | None:
    """Momenta Q_k, factors d_k, and slopes dQ_k/dP_j (n each), with which H is sum_k Q_k^2/(2 d_k).

    With v.M.v = sum d_k w_k^2, where w_k = v_k + sum_j f_kj v_j, they are P_j = Q_j + sum_k f_kj Q_k, by the
    shortest entries first. The velocities are dH/dP_j = sum_k Q_k/d_k dQ_k/dP_j. None if there is no entry to
    begin with, or the squares become too long to be of use.
    """
    rows, left, length, size = [list(row) for row in matrix], set(range(len(matrix))), 0, range(len(matrix))
    Q, slopes = list(momenta), [[ONE if i == j else ZERO for j in size] for i in size]
    done: list[tuple[Expr, Expr, Sequence[Expr]]] = []
    while left:
        lengths = {i: rows[i][i].nodes for i in left if rows[i][i]}
        if not lengths:
            return None
        k = min(lengths, key=lambda i: (lengths[i], i))
        left.remove(k)
        done.append((Q[k], rows[k][k], slopes[k]))
        others = {j: tidy(rows[k][j] / rows[k][k]) for j in sorted(left) if rows[k][j]}
        changed = {
            (i, j): rows[i][j] - a * b * rows[k][k]
            for (i, a), (j, b) in combinations_with_replacement(others.items(), 2)
        }
        length += sum(entry.nodes for entry in changed.values())
        if length > MOST_NODES:
            return None
        for (i, j), entry in changed.items():
            rows[i][j] = rows[j][i] = tidy(entry)
        for j, factor in others.items():
            Q[j] -= factor * Q[k]
            slopes[j] = [a - factor * b for a, b in zip(slopes[j], slopes[k], strict=True)]
    return done


def _by_rows(squares: Squares, momenta: Sequence[Expr]) -> Iterator[Expr]:
    """H by the rows of the squares as they were typed, as far as these allow."""
    size, rows = len(momenta), [row for _, row in squares]
    if size == len(squares) <= MOST_ROWS and size > 1:
        whole = tidy(matrices.determinant(rows))
        if whole:
            parts: dict[Expr, list[Expr]] = {}
            for k, (factor, _) in enumerate(squares):
                minors = (matrices.minor(rows, k, i) * (-1) ** (i + k) for i in range(size))
                momentum = total(tidy(m / whole) * p for m, p in zip(minors, momenta, strict=True))
                parts.setdefault(tidy(1 / (4 * factor)), []).append(tidy(momentum) ** 2)
            # A factor stands in front of its squares, or at each of them.
            yield total(
                shortest([factor * tidy(total(own)), total(factor * e for e in own)])
                for factor, own in parts.items()
            )
    elif size == 2 and len(squares) > 2:
        above = tidy(total(a * tidy(matrices.determinant([row, momenta])) ** 2 for a, row in squares))
        pairs = combinations(squares, 2)
        below = tidy(total(4 * a * b * matrices.determinant([u, w]) ** 2 for (a, u), (b, w) in pairs))
        if below:
            yield shortest([above / below, tidy(above / below)])


def _squares(e: Expr, velocities: Sequence[str], factor: Expr) -> Iterator[tuple[Expr, Sequence[Expr]]]:
    """The squares whose sum the terms of degree 2 are, as they are typed, times a factor.

    Raises ValueError where there are other terms.
    """
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
        polynomial = coefficients(inner, velocities)
        if has_degrees(polynomial, 0, 1):
            if exponent == 2:
                yield kept, [coefficient(polynomial, size, place) for place in range(size)]
        elif exponent == 1:
            yield from _squares(inner, velocities, kept)
        else:
            raise ValueError("no square")


def of_blocks(
    matrix: Matrix, momenta: Sequence[Expr], typed: Squares, particles: Squares, coordinates: Sequence[str]
) -> tuple[list[Expr], list[Expr]] | None:
    """The velocities (n), and the terms of H = P.M^-1.P/2, block by block; None where one is too long."""
    velocities, parts = [ZERO] * len(momenta), list[Expr]()
    alone: dict[Expr, list[Expr]] = {}
    for block in matrices.blocks(matrix):
        own, P = matrices.part(matrix, block, block), [momenta[place] for place in block]
        if len(block) == 1:
            factor, square = tidy(1 / own[0][0]) / 2, P[0] ** 2
            velocities[block[0]] = tidy(P[0] / own[0][0])
            if len(P[0].terms) == 1:
                alone.setdefault(factor, []).append(square)
            else:
                parts.append(factor * square)
            continue
        ours, theirs = ([(a, [row[i] for i in block]) for a, row in rows] for rows in (typed, particles))
        form = energy(own, P, ours, theirs, coordinates)
        if form is None:
            return None
        parts.append(form[0])
        for place, velocity in zip(block, form[1], strict=True):
            velocities[place] = velocity
    # Squares with the same factor are in one bracket.
    return velocities, [*parts, *(factor * total(terms) for factor, terms in alone.items())]
