"""Conserved quantities of degree 1 or 2 in the momenta, looked for among sums of given terms.

A term f is a product of up to two momenta with a function of the coordinates from a list: powers, sines
and cosines, and what stands in H (`trial_terms`). The rates {f, H} of all terms at random points of phase
space make a matrix whose null space holds the sums that are conserved (`nullspace`). Their coefficients may
depend on the parameters, as in x*p_y**2 - y*p_x*p_y - k*m*x/r: from values for several sets of parameters
they are recognized as sums of ratios of the coefficients in H. What is returned has passed
`values.is_zero` as an exact expression, {F, H} = 0.

Source: J. Hietarinta, Direct methods for the search of the second invariant, Physics Reports 147 (1987) 87.
There the functions of the coordinates are free and solve differential equations; here they come from a
list, so that what is not found may still exist.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cache

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.symbolic.algebra.atoms import Monomial
from rigidcli.symbolic.algebra.expressions import ONE, Expr, factored, gathered, symbol, total
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.invariants import trial_terms
from rigidcli.symbolic.invariants.nullspace import (
    ABSENT,
    SAME,
    SPARE,
    Span,
    Table,
    in_all,
    null_sums,
    scaled_rates,
    split_columns,
)
from rigidcli.symbolic.invariants.trial_terms import Term, products, simplest_first
from rigidcli.symbolic.language import code
from rigidcli.symbolic.mechanics.energies import TIME
from rigidcli.symbolic.mechanics.hamilton_equations import Phase, bracket

MOST_COORDINATES = 20
"""With more, nothing is searched."""

MOST_MISSES = 6
"""Sums that are not recognized, after which no more are tried."""

MOST_RATIOS = 150
"""Combinations of parameters among which a coefficient is looked for."""

FEW_RATIOS = 24
"""Of these, how many are tried first where a coefficient is a sum."""

SETS = 4
"""Of parameters, beyond the number of ratios that may be summed up."""

UNITS = 6
"""Terms of which it is tried that their coefficient is 1."""

SMALL = 1e-4
"""Multiples of ratios below this, beside the largest, are perhaps zero."""

LARGEST_DENOMINATOR = 1_000_000
"""Of the rational factor of a coefficient."""


@dataclass(frozen=True, slots=True)
class Search:
    """Conserved quantities; complete if every listed term was tried and every sum was recognized."""

    found: tuple[Expr, ...]
    complete: bool


def search(hamiltonian: Expr, phase: Phase, known: Sequence[Expr]) -> Search:
    """Quantities with {F, H} = 0 that are no functions of H, of the `known` ones and of each other.

    If H is even in the momenta, those of degree 1 come first; otherwise those with shorter texts do.
    An H that holds the time is not searched.
    """
    if len(phase.coordinates) == 1:
        return Search((), complete=True)
    still = hamiltonian.names.isdisjoint(phase.names)
    if still or TIME in hamiltonian.names or len(phase.coordinates) > MOST_COORDINATES:
        return Search((), complete=False)
    found: list[Expr] = []
    complete = True
    try:
        for e in _conserved(hamiltonian, phase, known):
            if e is None:
                complete = False
            else:
                found.append(e)
    except (ComputationError, ExpressionError):
        complete = False
    return Search(tuple(found), complete)


def _conserved(hamiltonian: Expr, phase: Phase, known: Sequence[Expr]) -> Iterator[Expr | None]:
    """What is found; None for a list of terms that was cut, and for sums that are not recognized."""
    parts = trial_terms.parts_of(hamiltonian, phase)
    sectors = trial_terms.sectors(hamiltonian, parts, phase)
    table = Table(hamiltonian, phase, known, [term for sector in sectors for term in sector.terms])
    ratios = cache(lambda: _ratios(parts, phase))
    spans = [Span(rows) for rows in table.gradients(0, (), SPARE)[0]]
    for sector in sectors:
        missed: list[Floats] = []
        for terms, coefficients in null_sums(table, sector.terms):
            gradients = np.einsum("pti,t->pi", table.gradients(0, terms, SPARE)[1], coefficients)
            if len(missed) == MOST_MISSES or in_all(spans, gradients):
                continue
            e = _recognized(table, terms, ratios())
            if e is not None:
                e = _primitive(tidy(_primitive(e, phase)), phase)
            if e is None or not is_zero(bracket(e, hamiltonian, phase)):
                missed.append(gradients)
                continue
            for span, gradient in zip(spans, gradients, strict=True):
                span.extend(gradient)
            yield e
        given_up = len(missed) == MOST_MISSES
        if given_up or not sector.complete or not all(in_all(spans, vectors) for vectors in missed):
            yield None


def _primitive(e: Expr, phase: Phase) -> Expr:
    """Without numbers and parameters that all of its terms have in common."""
    coefficient, monomial = factored(e)
    kept = {atom: n for atom, n in monomial if not atom.names.isdisjoint(phase.names)}
    return e if coefficient == 1 and len(kept) == len(monomial) else gathered(1, kept)


# Coefficients.


def _ratios(parts: Mapping[Monomial, Expr], phase: Phase) -> list[Expr]:
    """1, ratios of the coefficients in H, also times powers of parameters inside functions, and products."""
    first = simplest_first(
        [ONE, *(a / b for a, b in itertools.permutations(dict.fromkeys(parts.values()), 2))]
    )
    inner = sorted(set().union(*(atom.names for m in parts for atom, _ in m)) - set(phase.names))
    powers = [symbol(name) ** n for name in inner for n in (1, 2, -1)]
    more = [
        *simplest_first(products(first[:FEW_RATIOS], powers)),
        *simplest_first(products(first[:FEW_RATIOS], first[:FEW_RATIOS])),
    ]
    return list(dict.fromkeys([*first, *more]))[:MOST_RATIOS]


def _recognized(table: Table, terms: Sequence[Term], ratios: Sequence[Expr]) -> Expr | None:
    """The sum of just these terms that is conserved for all parameters, if its coefficients are recognized.

    It is tried whether each is one ratio times a rational number, then the sum of a few, then of any.
    """
    flow = code.function([to_tree(e) for e in ratios], table.parameters, {})(math)
    vectors: list[Floats] = []
    known: list[tuple[float, ...]] = []
    for recognize, most in ((_multiple, 1), (_sum, FEW_RATIOS), (_sum, len(ratios))):
        for which in range(len(vectors), most + SETS):
            rates, units = scaled_rates(*table.gradients(which, terms, len(terms) + SPARE))
            _, sizes, null = np.linalg.svd(rates)
            if sizes[-1] > ABSENT * sizes[0]:
                return None
            vectors.append(null[-1] / units)
            known.append(flow(*table.points[which]))
        samples = np.array(vectors)
        columns = np.array(known)[:, : most if most > 1 else None]
        found = []
        for unit in range(min(len(terms), UNITS)):
            if np.abs(samples[:, unit]).min() < ABSENT * np.abs(samples).max():
                continue
            coefficients = []
            for values in (samples / samples[:, [unit]]).T:
                coefficient = recognize(values, columns, ratios)
                if coefficient is None:
                    break
                coefficients.append(coefficient)
            else:
                found.append(coefficients)
        if found:
            simplest = min(found, key=lambda coefficients: sum(len(e.key) for e in coefficients))
            return total(c * table.product(term) for c, term in zip(simplest, terms, strict=True))
    return None


def _multiple(values: Floats, known: Floats, ratios: Sequence[Expr]) -> Expr | None:
    """The simplest rational multiple of one of the ratios that has these values."""
    multiples = values[:, None] / known
    found = []
    steady = (np.abs(multiples - multiples[0]) <= SAME * np.abs(multiples[0])).all(axis=0)
    for place, (value, same) in enumerate(zip(multiples[0].tolist(), steady.tolist(), strict=True)):
        factor = _rational(value) if same else None
        if factor is not None:
            found.append((abs(factor.numerator) + factor.denominator, place, factor))
    if not found:
        return None
    _, place, factor = min(found)
    return ratios[place] * factor


def _sum(values: Floats, known: Floats, ratios: Sequence[Expr]) -> Expr | None:
    """The sum of rational multiples of ratios that has these values.

    Small multiples are dropped and the others fitted again, until none is small.
    """
    sizes = np.linalg.norm(known, axis=0)
    places, _ = split_columns(known / sizes)
    while True:
        fitted = np.linalg.lstsq(known[:, places] / sizes[places], values, rcond=None)[0]
        large = np.abs(fitted) >= SMALL * np.abs(fitted).max()
        if large.all():
            break
        places = [place for place, kept in zip(places, large.tolist(), strict=True) if kept]
    factors = [_rational(value) for value in (fitted / sizes[places]).tolist()]
    e = total(ratios[place] * factor for place, factor in zip(places, factors, strict=True) if factor)
    rest = values - known[:, places] @ np.array([float(factor or 0) for factor in factors])
    return e if float(np.abs(rest).max()) <= SAME * float(np.abs(values).max()) else None


def _rational(value: float) -> Fraction | None:
    """The fraction with a small denominator that a number is, but for rounding."""
    near = Fraction(value).limit_denominator(LARGEST_DENOMINATOR)
    return near if abs(float(near) - value) <= SAME * abs(value) else None
