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

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import cache
from itertools import chain, permutations

import numpy as np

from rigidcli.algebra.atoms import Monomial
from rigidcli.algebra.expressions import ONE, Expr, factored, gathered, symbol, total
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import code
from rigidcli.mechanics.energies import TIME
from rigidcli.mechanics.hamilton_equations import Phase, bracket
from rigidcli.mechanics.invariants.nullspace import (
    ABSENT,
    SAME,
    SPARE,
    Sampler,
    is_combination,
    null_sums,
    sampler,
    split_columns,
)
from rigidcli.mechanics.invariants.separation import separated
from rigidcli.mechanics.invariants.trial_terms import Term, parts_of, products, simplest_first, trial_sums
from rigidcli.mechanics.jumps import smooth

MOST_COORDINATES = 20
"""With more coordinates nothing is searched: the lists of terms would be too long."""

MOST_MISSES = 6
"""Sums whose coefficients are not recognized, after which no more of the same terms are tried."""

MOST_RATIOS = 150
"""Combinations of parameters among which a coefficient is looked for; each takes a set of parameters."""

FEW_RATIOS = 24
"""The simplest of these combinations, which are tried first where a coefficient is a sum of several."""

SPARE_SETS = 4
"""Sets of parameters beyond the number of ratios that may be summed up, which put a sum to the test."""

UNITS = 6
"""Terms of a sum for each of which it is tried whether its coefficient is 1."""

SMALL = 1e-4
"""Multiples of ratios below this, beside the largest, may be rounding: it is tried to do without them."""

LARGEST_DENOMINATOR = 1_000_000
"""The largest denominator of the rational factor of a coefficient, which decimals in H may bring."""


def conserved_quantities(hamiltonian: Expr, phase: Phase, known: Sequence[Expr]) -> tuple[Expr, ...]:
    """Quantities with {F, H} = 0 that are no functions of H, of the `known` ones and of each other.

    If H is even in the momenta, those of degree 1 come first; otherwise those with shorter texts do.
    An H that holds the time is not searched, and the search ends where expressions become too large.
    """
    still = hamiltonian.names.isdisjoint(phase.names)
    if still or TIME in hamiltonian.names or not 1 < len(phase.coordinates) <= MOST_COORDINATES:
        return ()
    found: list[Expr] = []
    with suppress(ComputationError, ExpressionError):
        parts = parts_of(hamiltonian, phase)
        sums = trial_sums(hamiltonian, parts, phase)
        sample = sampler(hamiltonian, phase, known, chain(*sums))
        ratios = cache(lambda: _ratios(parts, phase))
        here = sample(0, max(map(len, sums), default=0))
        spanned = here.given[:SPARE]
        for terms in sums:
            misses = 0
            for chosen, coefficients in null_sums(here, terms):
                gradients = np.einsum("pti,t->pi", here.gradients(chosen)[:SPARE], coefficients)
                if misses == MOST_MISSES or is_combination(gradients, spanned):
                    continue
                e = _recognized(sample, chosen, ratios())
                if e is not None:
                    e = _primitive(tidy(_primitive(e, phase)), phase)
                if e is None or not _is_conserved(e, hamiltonian, phase):
                    misses += 1
                    continue
                spanned = np.concatenate([spanned, gradients[:, None]], axis=1)
                found.append(e)
        # As many as there are coordinates are all that separation gives.
        missing = len(phase.coordinates) - 1 - len(known) - len(found)
        for candidate in separated(hamiltonian, phase) if missing > 0 else ():
            e = shortest([candidate, _primitive(candidate, phase)])
            *others, gradients = sampler(hamiltonian, phase, [*known, *found, e], ())(0, 0).given.swapaxes(
                0, 1
            )
            is_new = not is_combination(gradients, np.array(others).swapaxes(0, 1))
            if is_new and _is_conserved(e, hamiltonian, phase):
                found.append(e)
    return tuple(found)


def _is_conserved(e: Expr, hamiltonian: Expr, phase: Phase) -> bool:
    """Whether {F, H} = 0, also across steps in H, of which derivatives do not tell."""
    if not is_zero(bracket(e, hamiltonian, phase)):
        return False
    gradual = smooth(hamiltonian)
    return gradual == hamiltonian or is_zero(bracket(smooth(e), gradual, phase))


def _primitive(e: Expr, phase: Phase) -> Expr:
    """Without numbers and parameters that all of its terms have in common."""
    coefficient, monomial = factored(e)
    kept = {atom: n for atom, n in monomial if not atom.names.isdisjoint(phase.names)}
    return e if coefficient == 1 and len(kept) == len(monomial) else gathered(1, kept)


def _ratios(parts: Mapping[Monomial, Expr], phase: Phase) -> list[Expr]:
    """1, ratios of the coefficients in H, also times powers of parameters inside functions, and products."""
    known = dict.fromkeys(parts.values())
    first = simplest_first([ONE, *(a / b for a, b in permutations(known, 2))])
    inner = sorted({name for m in parts for atom, _ in m for name in atom.names}.difference(phase.names))
    powers = [symbol(name) ** n for name in inner for n in (1, 2, -1)]
    few = first[:FEW_RATIOS]
    more = [*simplest_first(products(few, powers)), *simplest_first(products(few, few))]
    return list(dict.fromkeys([*first, *more]))[:MOST_RATIOS]


def _recognized(sample: Sampler, terms: Sequence[Term], ratios: Sequence[Expr]) -> Expr | None:
    """The sum of just these terms that is conserved for all parameters, if its coefficients are recognized.

    It is tried whether each is one ratio times a rational number, then the sum of a few, then of any.
    """
    flow = code.function([to_tree(e) for e in ratios], list(sample(0, 0).parameters), {})(math)
    rows: list[Floats] = []
    known: list[tuple[float, ...]] = []
    size = len(ratios)
    for recognize, sets, most in (_multiple, 1, size), (_sum, FEW_RATIOS, FEW_RATIOS), (_sum, size, size):
        for which in range(len(rows), sets + SPARE_SETS):
            here = sample(which, len(terms))
            rates, units = here.rates(terms)
            _, sizes, null = np.linalg.svd(rates)
            if sizes[-1] > ABSENT * sizes[0]:
                return None
            rows.append(null[-1] / units)
            known.append(flow(*here.parameters.values()))
        vectors, columns = np.array(rows), np.array(known)[:, :most]
        found = []
        for unit in range(min(len(terms), UNITS)):
            if np.abs(vectors[:, unit]).min() >= ABSENT * np.abs(vectors).max():
                values = (vectors / vectors[:, [unit]]).T
                coefficients = []
                for row in values:
                    if (e := recognize(row, columns, ratios)) is None:
                        break
                    coefficients.append(e)
                else:
                    found.append(coefficients)
        if found:
            simplest = min(found, key=lambda coefficients: sum(len(e.key) for e in coefficients))
            return total(c * f * p for c, (f, p) in zip(simplest, terms, strict=True))
    return None


def _multiple(values: Floats, known: Floats, ratios: Sequence[Expr]) -> Expr | None:
    """The simplest rational multiple of one of the ratios that has these values."""
    multiples = values[:, None] / known
    steady = (np.abs(multiples - multiples[0]) <= SAME * np.abs(multiples[0])).all(axis=0)
    factors = {place: _rational(multiples[0, place]) for place in np.flatnonzero(steady).tolist()}
    found = [(abs(f.numerator) + f.denominator, place, f) for place, f in factors.items() if f is not None]
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
