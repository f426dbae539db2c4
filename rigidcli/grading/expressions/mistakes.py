"""What mistakes make of the key of an expression.

H(q, p) is V = H(q, 0), and T for the rest, if it is the same for -p: so it is for a particle in a potential,
and at any speed, but not in a magnetic field. In the same way L is T - V.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from fractions import Fraction
from functools import lru_cache

import numpy as np

from rigidcli.algebra.atoms import Monomial, Symbol
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ZERO, Expr, symbol
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.grading.expressions.agreement import NEEDED, PROVED, Function
from rigidcli.grading.expressions.formula import independent, names_in
from rigidcli.grading.expressions.key import Key
from rigidcli.grading.expressions.rounding import fitted
from rigidcli.grading.expressions.vocabulary import TIME
from rigidcli.grading.factors import TURN
from rigidcli.grading.values import ENOUGH, Ball, Estimate
from rigidcli.language.tree import Constant, Negative, Node, Number, Product, Sum, bound, number

KEYS = 1024
"""Keys of which what is found in them is kept."""

MOST_TERMS = 60
"""Of an expression of which each may be the one that is wrong."""

EXACT = 1e-9
"""Relative error of a factor that is 2 pi."""

TWO, THREE = number(2.0), number(3.0)

TOLD = 2.0**-100
"""Relative error of a factor that is told from the values of an answer."""

LARGEST = 1e3
"""Number that may stand in place of a symbol of which no value is known; the smallest is its inverse."""

CHANGE = 1.37
"""The factor by which such a number is changed to see whether it matters."""


@dataclass(frozen=True, slots=True)
class Parts:
    """An energy as the sum of what moves and of what is left at rest; with the values of the latter."""

    moving: Expr
    resting: Expr
    at_rest: Estimate


@lru_cache(KEYS)
def parts(key: Key) -> Parts | None:
    """The parts of an energy; None where it cannot be told apart."""
    energy = key.function.exact
    rates = [name for name in key.rates if energy is not None and name in energy.names]
    if energy is None or not rates or not key.is_energy:
        return None
    with suppress(ExpressionError):
        resting = substitute(energy, dict.fromkeys(rates, ZERO))
        back = substitute(energy, {name: -symbol(name) for name in rates})
        if is_zero(energy - back):
            return Parts(energy - resting, resting, key.answer(still(key, key.tree)).rough)
    return None


def still(key: Key, tree: Node) -> Node:
    """What is left of an expression at rest."""
    return bound(tree, dict.fromkeys(key.rates, number(0.0)))


def negative(key: Key) -> Iterator[Key]:
    """The key of the other sign."""
    if key.function.exact is not None:
        yield key.of(to_tree(-key.function.exact))


def difference(*, of_lagrangian: bool) -> Callable[[Key], Iterator[Key]]:
    """What turns the sign of the potential energy."""

    def changes(key: Key) -> Iterator[Key]:
        found = parts(key)
        if found is not None and key.is_lagrangian == of_lagrangian:
            yield key.of(to_tree(found.moving - found.resting))

    return changes


def of_another_mass(key: Key) -> Iterator[Key]:
    """The keys of twice the kinetic energy, and of half of it."""
    found = parts(key)
    if found is not None and found.resting.terms:
        for factor in (Fraction(2), Fraction(1, 2)):
            yield key.of(to_tree(factor * found.moving + found.resting))


def uncoupled(key: Key) -> Iterator[Key]:
    """The keys without products of several coordinates, of several momenta, or of either."""
    coordinates, rates = key.names.coordinates, key.rates
    with suppress(ExpressionError):
        if key.function.exact is None:
            return
        e = expand(key.function.exact)
        for groups in ((coordinates,), (rates,), (coordinates, rates)):
            kept = {
                term: c for term, c in e.terms.items() if not any(_couples(term, names) for names in groups)
            }
            if len(kept) < len(e.terms):
                yield key.of(to_tree(Expr(kept)))


def _couples(term: Monomial, names: Sequence[str]) -> bool:
    """Whether several of the names are multiplied in a term."""
    return sum(isinstance(atom, Symbol) and atom.name in names for atom, _ in term) > 1


def but_for_a_constant(key: Key) -> Iterator[Key]:
    """The key of which the derivatives alone count."""
    if names_in(key.tree) and not key.constant:
        yield replace(key, constant=True)


def three_times(key: Key) -> Iterator[Key]:
    """The key of a number that got lost."""
    yield key.of(Product((THREE, key.tree)))


def of_a_turn(key: Key) -> Iterator[Key]:
    """The key of what counts radians where turns are meant."""
    if key.periodic:
        yield key.of(Product((TWO, Constant("pi"), key.tree)))


def proportional(*, to_turn: bool) -> Callable[[Key, Function], Iterator[Key]]:
    """What makes the key of as many times the expression as the answer is: of a turn, or another number."""

    def fits(key: Key, answer: Function) -> Iterator[Key]:
        found = factor(answer.rough, key.function.rough) if names_in(key.tree) else None
        if found is None or abs(found).contains(1):
            return
        is_turn = any(math.isclose(float(found), turn, rel_tol=EXACT) for turn in (TURN, 1 / TURN))
        if to_turn == (is_turn and key.periodic):
            digits = Number(found.str(ENOUGH, radius=False).lstrip("-"), abs(float(found)))
            tree = Product((digits if found > 0 else Negative(digits), key.tree))
            yield key.of(tree, relative=max(key.relative or 0.0, TOLD))

    return fits


def factor(answer: Estimate, key: Estimate) -> Ball | None:
    """The number, not zero, by which a key is multiplied in an answer; None where there is no such number."""
    usable = np.flatnonzero(answer.known & key.differs)
    if np.any(answer.undefined & key.differs) or len(usable) < NEEDED:
        return None
    ratios = answer.over(key).some(usable).balls
    best = min(ratios, key=lambda ratio: float(ratio.rad()))
    is_common = not best.contains(0) and best.rel_accuracy_bits() >= ENOUGH
    return best if is_common and all(ratio.overlaps(best) for ratio in ratios) else None


def with_numbers(key: Key, answer: Function) -> Iterator[tuple[Key, str, str]]:
    """The key with numbers in place of symbols that an answer does not hold; and, in words, of which.

    That is sure for the values of a document. Of what has none, it is if some value will do and no other.
    """
    derived, domains = key.names.vocabulary.derived, key.names.vocabulary.domains
    mine, own = (independent(derived, names_in(tree)) for tree in (answer.tree, key.tree))
    gone = own - mine - key.names.states - {TIME}
    missing = [name for name in domains if name in gone]
    if not missing:
        return
    tree = key.tree
    for name in reversed(list(derived)):
        tree = bound(tree, {name: derived[name]})
    tree = bound(tree, {name: key.names.meant[name] for name in missing if name in key.names.meant})
    free = {name: (1 / LARGEST, 1.0, LARGEST) for name in missing if name not in key.names.meant}
    without = ", ".join(f"`{name}`" for name in missing)
    told = f"without {without}" if key.names.vocabulary.told else ""
    if not free:
        yield key.of(tree), "", told
        return
    found = fitted(tree, answer, free, constant=key.constant)
    if found is not None:
        others = [bound(tree, {**found, name: number(CHANGE * x.value)}) for name, x in found.items()]
        if not any(key.of(other).told(answer) is True for other in others):
            yield key.of(bound(tree, found), relative=max(key.relative or 0.0, PROVED)), "", told


@lru_cache(KEYS)
def additive_terms(key: Key) -> tuple[Function, ...]:
    """The terms of a sum, as it is written and multiplied out."""
    written = key.tree.terms if isinstance(key.tree, Sum) else ()
    out: tuple[Node, ...] = ()
    with suppress(ExpressionError):
        e = ZERO if key.function.exact is None else expand(key.function.exact)
        if 1 < len(e.terms) <= MOST_TERMS:
            out = tuple(to_tree(Expr({term: factor})) for term, factor in e.terms.items())
    return tuple(map(key.answer, (*written[:MOST_TERMS], *out)))
