"""Conserved quantities: sums of given terms whose Poisson bracket with H vanishes, by linear algebra.

A term is a product of up to two momenta, a function of the coordinates, and a product of parameters. The
functions are powers of the coordinates, sines and cosines of angles, and what stands in H; the products of
parameters are ratios of the coefficients of H. The values of the brackets {f, H} at random points make a
matrix, whose null space has the sums that are conserved; then their brackets are shown to vanish. Those
linear in the momenta are always looked for, as total and angular momentum, others for few coordinates.

Source: J. Hietarinta, Direct methods for the search of the second invariant, Physics Reports 147 (1987) 87.
There the functions of the coordinates are free and solve differential equations; here they come from a list,
so that there may be others.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from itertools import combinations_with_replacement, permutations, product

import numpy as np

from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, Expr, factored, gathered, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero, sampled
from rigidcli.core.arithmetic import Floats
from rigidcli.core.elimination import echelon
from rigidcli.errors import ExpressionError
from rigidcli.mechanics.hamilton_equations import TIME, Phase, bracket

MOST_COORDINATES = 9
"""With more coordinates only sums of momenta are tried: there are n^2 products of coordinates and momenta."""

FEW_COORDINATES = 3
"""The most coordinates of terms of degree 2 in the momenta."""

MOST_TERMS = 160
"""The most terms of one sum: their brackets take a tenth of a second."""

SPARE = 20
"""Random points beyond the number of terms at which sums of brackets have to vanish."""

NONE = 1e-12
"""Singular values below this, in units of the largest one, are rounding errors of some hundred terms."""

LARGEST = 1000
"""The largest denominator in a sum that is conserved."""

LONGEST_TURNING = 200
"""The longest key of an H with angles for which more than momenta is tried: in spherical coordinates 160."""

MOST_INNER = 10
"""The most functions by which the sine of a free angle is multiplied; these are the simplest ones."""

MOST_FACTORS = 6
"""The most products of parameters by which terms are multiplied; these are the simplest ones."""

POINTS = 12
"""Random points at which gradients are compared: those of dependent functions are combinations at all."""

DEPENDENT = 1e-6
"""Singular values of gradients of length 1 below this are rounding: they are combinations of others."""


def conserved_quantities(hamiltonian: Expr, phase: Phase, known: Sequence[Expr]) -> tuple[Expr, ...]:
    """Quantities with {F, H} = 0 that are no functions of H, of the `known` ones and of one another.

    Where H holds the time, they are linear in the momenta. The search ends where expressions are too large.
    """
    if len(phase.coordinates) < 2 or hamiltonian.names.isdisjoint(phase.names):
        return ()
    quantities: list[Expr] = []
    with suppress(ExpressionError):
        for terms in _trial_sums(hamiltonian, phase):
            candidates = [_primitive(e, phase) for e in _null_sums(terms, hamiltonian, phase)]
            for e in sorted(dict.fromkeys(candidates), key=lambda e: (len(str(e)), str(e))):
                if _is_new(e, [hamiltonian, *known, *quantities], phase):
                    quantities.append(e)
    return tuple(quantities)


def _trial_sums(hamiltonian: Expr, phase: Phase) -> Iterator[list[Expr]]:
    """The terms of the sums that are looked for, list by list: linear in the momenta, then of degree 2."""
    momenta, coordinates = [symbol(p) for p in phase.momenta], [symbol(q) for q in phase.coordinates]
    parts = _parts(hamiltonian, phase)
    straight, angles = _kinds(hamiltonian, phase)
    if len(coordinates) > MOST_COORDINATES or (angles and len(hamiltonian.key) > LONGEST_TURNING):
        yield momenta
        return
    waves = [apply(function, symbol(q)) for q in angles for function in ("sin", "cos")]
    lines = [symbol(q) for q in straight]
    pieces = _simplest(_pieces(parts, phase))
    backwards = substitute(hamiltonian, {p: -symbol(p) for p in phase.momenta})
    ratios = (a / b for a, b in permutations(dict.fromkeys(parts.values()), 2))
    factors = _simplest([ONE, *ratios])[:MOST_FACTORS]
    functions = _simplest([ONE, *lines, *waves])
    squares = [a * b for a, b in combinations_with_replacement(lines, 2)]
    if len(coordinates) <= FEW_COORDINATES:
        functions += [*_turning(parts, angles, pieces), *squares]
    linear = _products([*functions, *factors], momenta)
    if backwards != hamiltonian:
        linear += _products([*lines, *waves, *squares], factors)
    yield linear[:MOST_TERMS]
    if len(coordinates) > FEW_COORDINATES or TIME in hamiltonian.names:
        return
    powers = [ONE] if angles else [ONE, *lines, *squares]
    kinetic = [*powers, *pieces] if angles else powers
    pairs = [a * b for a, b in combinations_with_replacement(momenta, 2)]
    alone = _simplest([*powers, *waves, *pieces, *_products(pieces, [] if angles else lines)])
    quadratic = [*_products(kinetic, pairs), *_products(alone[1:], factors)]
    yield quadratic[:MOST_TERMS] if backwards == hamiltonian else [*quadratic, *linear][:MOST_TERMS]


def _turning(parts: Iterable[Monomial], angles: Sequence[str], pieces: Sequence[Expr]) -> list[Expr]:
    """Functions with the sine or cosine of an angle that is not in H, as angular momenta across its axis."""
    used = {name for monomial in parts for atom, _ in monomial for name in atom.names}
    free = [apply(f, symbol(q)) for q in angles if q not in used for f in ("sin", "cos")]
    others = [apply(f, symbol(q)) for q in angles if q in used for f in ("sin", "cos")]
    inner = [ONE, *pieces, *(a / b for a, b in permutations(others, 2)), *(1 / a for a in others)]
    return _products(free, _simplest(inner)[:MOST_INNER])


def _parts(hamiltonian: Expr, phase: Phase) -> dict[Monomial, Expr]:
    """The terms of H, multiplied out: products of functions of coordinates and momenta, with coefficients."""
    names = frozenset(phase.names)
    parts: dict[Monomial, list[Expr]] = {}
    for monomial, coefficient in expand(hamiltonian).ordered:
        moving = tuple(factor for factor in monomial if not names.isdisjoint(factor[0].names))
        fixed = {atom: n for atom, n in monomial if names.isdisjoint(atom.names)}
        if moving:
            parts.setdefault(moving, []).append(gathered(coefficient, fixed))
    return {moving: total(values) for moving, values in parts.items()}


def _pieces(parts: Iterable[Monomial], phase: Phase) -> Iterator[Expr]:
    """The factors of the terms of H that hold no momenta, and the roots of their squares."""
    for monomial in parts:
        still = {a: n for a, n in monomial if a.names.isdisjoint(phase.momenta)}
        if still:
            yield gathered(1, still)
            if all(n % 2 == 0 for n in still.values()):
                yield gathered(1, {a: n / Fraction(2) for a, n in still.items()})


def _kinds(hamiltonian: Expr, phase: Phase) -> tuple[list[str], list[str]]:
    """The coordinates that are taken by themselves, and the angles, which stand in sines or nowhere."""
    waves = filter(_is_wave, hamiltonian.everywhere())
    inside = {name for atom in waves for name in atom.names}.intersection(phase.coordinates)
    outside = {*_outside(hamiltonian)}
    straight = [q for q in phase.coordinates if q in outside or q not in inside]
    angles = [q for q in phase.coordinates if q in inside or (inside and q not in outside)]
    return straight, angles if len(phase.coordinates) <= FEW_COORDINATES else []


def _is_wave(atom: Atom) -> bool:
    return isinstance(atom, Applied) and str(atom.function)[:3] in ("sin", "cos", "tan", "ata")


def _outside(e: Expr) -> Iterator[str]:
    """The names that stand outside of sines, arc tangents and the like."""
    for atom in e.atoms:
        if not _is_wave(atom):
            yield from _outside(atom.inner) if isinstance(atom, Group) else atom.names


def _null_sums(terms: Sequence[Expr], hamiltonian: Expr, phase: Phase) -> Iterator[Expr]:
    """The sums of terms that are conserved: for two orders of the terms, as many as the null space has."""
    brackets = [bracket(f, hamiltonian, phase) for f in terms]
    values = sampled(brackets, {}, len(terms) + SPARE, signed=phase.names)
    if values is None:
        return
    # High powers are of very different sizes from point to point.
    values /= np.maximum(np.abs(values).max(axis=1, keepdims=True), np.finfo(float).tiny)
    sizes = np.linalg.norm(values, axis=0)
    sizes[sizes == 0] = 1.0
    _, singular, rows = np.linalg.svd(values / sizes)
    null = rows[(singular > NONE * singular.max(initial=1.0)).sum() :] / sizes
    for turn in (1, -1):
        for row in echelon(null[:, ::turn], len(null), DEPENDENT)[0]:
            numbers = {k: x for k, x in enumerate(row[::turn].tolist()) if abs(x) > 0.5 / LARGEST}
            e = total(Fraction(x).limit_denominator(LARGEST) * terms[k] for k, x in numbers.items())
            if TIME not in e.names and not is_zero(e) and is_zero(bracket(e, hamiltonian, phase)):
                yield e


def _is_new(e: Expr, known: Sequence[Expr], phase: Phase) -> bool:
    """Whether the gradient of a function is no combination of others at random points."""
    slopes = [derivative(f, name) for f in (*known, e) for name in phase.names]
    values = sampled(slopes, {}, count=POINTS, signed=phase.names)
    if values is None:
        return False
    gradients: Floats = values.reshape(POINTS, len(known) + 1, -1)
    sizes = np.linalg.norm(gradients, axis=2, keepdims=True)
    units = gradients / np.where(sizes == 0, 1.0, sizes)
    whole, others = (np.linalg.matrix_rank(rows, tol=DEPENDENT) for rows in (units, units[:, :-1]))
    return bool((whole > others).any())


def _primitive(e: Expr, phase: Phase) -> Expr:
    """A short form, without numbers and parameters that all of its terms have in common."""
    for _ in range(2):
        coefficient, monomial = factored(e)
        kept = {atom: n for atom, n in monomial if not atom.names.isdisjoint(phase.names)}
        e = tidy(e if coefficient == 1 and len(kept) == len(monomial) else gathered(1, kept))
    return e


def _products(left: Iterable[Expr], right: Iterable[Expr]) -> list[Expr]:
    """All products of one on the left and one on the right, without repetition."""
    return list(dict.fromkeys(a * b for a, b in product(left, list(right))))


def _simplest(functions: Iterable[Expr]) -> list[Expr]:
    """The functions without repetition, the simplest first."""
    return sorted(dict.fromkeys(functions), key=lambda e: (e != ONE, len(e.key), e.key))
