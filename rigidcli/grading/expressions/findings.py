"""What is wrong with an expression: the first of these that can be told for sure."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.grading.expressions.agreement import CHANGE, factor
from rigidcli.grading.expressions.dimensions import mismatch
from rigidcli.grading.expressions.estimate import Estimate
from rigidcli.grading.expressions.fitting import fitted
from rigidcli.grading.expressions.formula import names_in
from rigidcli.grading.expressions.key import Key
from rigidcli.grading.expressions.vocabulary import TIME
from rigidcli.grading.outcome import Finding
from rigidcli.symbolic.language.tree import Name, Node

TURN = 2 * math.pi

EXACT = 1e-9
"""Relative error of a factor that is 2 pi."""

LARGEST = 1e3
"""Number that may stand in place of a symbol of which no value is known; the smallest is its inverse."""

STRIDE = 0.3
"""How far such a number is changed at once: by a power of LARGEST."""


def findings(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """What is wrong with an answer that is not right; `found` are its values at the key's points."""
    velocities = sorted(key.misplaced & names_in(tree))
    if velocities:
        yield from _of_velocities(key, tree, found, velocities[0])
        return
    for look in (_recomputed, _proportional, _dimensions, _part, _term):
        named = {finding.code: finding for finding in look(key, tree, found)}
        if named:
            break
    yield from named.values() if len(named) == 1 else [Finding("outside_tolerance")]


def _of_velocities(key: Key, tree: Node, found: Estimate, name: str) -> Iterator[Finding]:
    """A velocity where momenta are asked."""
    if key.hamiltonian:
        yield Finding("velocity_in_hamiltonian", detail=f"read `{name}`")
        if key.lagrangian is not None and key.is_same(found, key.lagrangian):
            yield Finding("lagrangian_or_potential_sign")
    elif tree == Name(key.asked):
        yield Finding("trivial_equation", detail="this is what is asked for")
    else:
        yield Finding("outside_tolerance", detail=f"read `{name}`, expected no velocity, but momenta")


def _recomputed(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """Mistakes under each of which the reference was worked out again."""
    for mistake in key.mistakes:
        if key.is_same(found, mistake.found):
            yield Finding(mistake.code)
    if names_in(key.reference.tree) and not key.constant and key.reference.holds(tree, found, constant=True):
        yield Finding("additive_constant")
    yield from _numbers(key, tree, found)


def _numbers(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """Numbers in place of symbols: the answer is right where these have the values.

    That is sure for the values of a document. Of what has none, it is if some value will do and no other.
    """
    points = key.reference.floats.points
    mine, own = (points.independent(names_in(each)) for each in (tree, key.reference.tree))
    gone = own - mine - key.names.states - {TIME}
    missing = [name for name in key.names.vocabulary.domains if name in gone]
    values = {name: key.names.values[name] for name in missing if name in key.names.values}
    free = [name for name in missing if name not in values]
    if free:
        chosen = _chosen(key, found, values, free)
        if chosen is None:
            return
        values |= chosen
    if values and key.reference.holds_where(values, found, constant=key.constant):
        without = ", ".join(f"`{name}`" for name in missing)
        yield Finding("number_for_symbol", detail=f"without {without}" if key.names.vocabulary.told else "")


def _chosen(key: Key, found: Estimate, values: dict[str, float], free: list[str]) -> dict[str, float] | None:
    """Values of the free names under which the answer may be right; None where there are none."""
    reference, constant = key.reference, key.constant
    points = reference.floats.points.but(values)
    seen = found.changes if constant else found
    chosen = fitted(
        reference.tree,
        points,
        dict.fromkeys(free, _power),
        found,
        np.abs(seen.value),
        constant=constant,
        relative=reference.relative,
        stride=STRIDE,
    )
    if chosen is None:
        return None
    for name, value in chosen.items():
        other = {**values, **chosen, name: CHANGE * value}
        if not reference.holds_where(other, found, constant=constant):
            return chosen
    return None


def _power(place: Floats) -> Floats:
    return np.asarray(LARGEST**place, dtype=np.float64)


def _proportional(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """A constant factor."""
    number = factor(found, key.reference.floats.found) if names_in(key.reference.tree) else None
    if number is not None:
        turns = any(math.isclose(number, turn, rel_tol=EXACT) for turn in (TURN, 1 / TURN))
        yield Finding("frequency_vs_angular_frequency" if turns and key.periodic else "constant_factor")


def _dimensions(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """A sum, or a function, of what cannot be added."""
    wrong_sum = mismatch(tree, key.names.dimensions)
    if wrong_sum is not None:
        yield Finding("dimension_mismatch", detail=wrong_sum)


def _part(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """Only one of T and V is right."""
    if key.rest is None:
        return
    still = key.rest.points.at(tree)
    if key.is_same(still, key.rest.found):
        yield Finding("kinetic_term_wrong")
    if key.is_same(found.minus(still), key.reference.floats.found.minus(key.rest.found)):
        yield Finding("potential_wrong")


def _term(key: Key, tree: Node, found: Estimate) -> Iterator[Finding]:
    """One term of the sum is missing, or has another factor."""
    excess = found.minus(key.reference.floats.found)
    if any(factor(excess, term.found) is not None for term in key.terms):
        yield Finding("term_wrong")
