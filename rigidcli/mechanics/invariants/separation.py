"""Conserved quantities of systems whose Hamilton-Jacobi equation separates, of Liouville's kind or in steps.

If f(q) (H - E) is a sum of functions that have no variables in common, each of them is conserved for the
value E of H, as they add up to zero: r**2 (H - E) for a central force, or (u + v) (H - E) in parabolic
coordinates. A function of several coordinates may be split again. Sources: L. D. Landau, E. M. Lifshitz,
Mechanics, section 48; B. Carter, Physical Review 174 (1968) 1559.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress

from rigidcli.algebra.arithmetic import tidy
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, PI, ZERO, Expr, gathered, symbol, total
from rigidcli.algebra.matrices import connected
from rigidcli.algebra.simplification import shortest
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.hamilton_equations import Phase
from rigidcli.mechanics.invariants.trial_terms import simplest_first

MOST_COORDINATES = 6
"""With more coordinates nothing is split: each pair of them takes several derivatives."""

MOST_FACTORS = 12
"""The most factors f that are tried; these are the simplest denominators."""

ELSEWHERE = (ZERO, PI / 2, ONE)
"""Values of the other coordinates, one of which leaves a function of a group of them its value."""


def separated(hamiltonian: Expr, phase: Phase) -> Iterator[Expr]:
    """Candidates for conserved quantities besides H, with H in place of its value."""
    if len(phase.coordinates) <= MOST_COORDINATES:
        yield from _split(hamiltonian, hamiltonian, range(len(phase.coordinates)), phase)


def _split(e: Expr, value: Expr, places: Sequence[int], phase: Phase) -> Iterator[Expr]:
    """Candidates from a function of some coordinates and momenta that has a conserved `value`."""
    constant = symbol(f"value {len(places)}")
    moving = [i for i in places if phase.coordinates[i] in e.names]
    names = [(phase.coordinates[i], phase.momenta[i]) for i in moving]
    for factor in _factors(e, phase) if len(moving) > 1 else ():
        with suppress(ExpressionError, ComputationError):
            whole = expand(factor * (e - constant))
            slopes = [derivative(whole, name) for pair in names for name in pair]

            def linked(i: int, j: int, slopes: Sequence[Expr] = slopes) -> bool:
                mixed = (derivative(slopes[2 * i + k], name) for k in range(2) for name in names[j])
                return not all(map(is_zero, mixed))

            groups = connected(len(moving), linked)
            if len(groups) == 1:
                continue
            parts = [
                _part(
                    whole,
                    frozenset(name for k in group for name in names[k]),
                    [pair for k, pair in enumerate(names) if k not in group],
                )
                for group in groups
            ]
            found = [_with_value(part, constant, value) for part in parts]
            # The last one follows from the others: they add up to zero.
            yield from simplest_first(found)[:-1]
            for part, group in zip(parts, groups, strict=True):
                if len(group) > 1:
                    inner = [moving[k] for k in group]
                    for further in _split(part, part, inner, phase):
                        yield _with_value(further, constant, value)
            return


def _with_value(e: Expr, constant: Expr, value: Expr) -> Expr:
    """A function with the conserved quantity in place of its value, in a short form."""
    whole = substitute(tidy(e), {str(constant): value})
    return shortest([whole, tidy(whole)])


def _part(e: Expr, own: frozenset[str], others: Sequence[tuple[str, str]]) -> Expr:
    """What a sum of functions without common variables has of its `own` ones, up to a constant."""
    gone = frozenset(name for pair in others for name in pair)
    terms = [Expr({monomial: coefficient}) for monomial, coefficient in e.ordered]
    if all(term.names.isdisjoint(gone) or term.names.isdisjoint(own) for term in terms):
        return total(term for term in terms if not term.names.isdisjoint(own))
    for q in ELSEWHERE:
        with suppress(ExpressionError):
            return substitute(e, dict.fromkeys(gone, ZERO) | {name: q for name, _ in others})
    return e


def _factors(e: Expr, phase: Phase) -> list[Expr]:
    """1, and what stands in the denominators of the terms without momenta, whole and in part."""
    names, momenta = frozenset(phase.names), frozenset(phase.momenta)
    found = [ONE]
    for monomial, _ in expand(e).ordered:
        below = {a: -n for a, n in monomial if n < 0 and a.names & names and not a.names & momenta}
        found += [gathered(1, below), *(gathered(1, {a: n}) for a, n in below.items())]
    return simplest_first(found)[:MOST_FACTORS]
