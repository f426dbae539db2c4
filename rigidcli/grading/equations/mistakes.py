"""Equations as they come out under common mistakes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from itertools import product

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.states import Motion
from rigidcli.grading.expressions.formula import names_in
from rigidcli.grading.values import Points
from rigidcli.model.variables import acceleration, velocity
from rigidcli.symbolic.algebra.calculus import derivative, expand
from rigidcli.symbolic.algebra.expressions import Expr, scaled, total
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.evaluation import array

FACTORS = tuple(Fraction(*each) for each in ((2, 1), (1, 2), (3, 1), (1, 3), (4, 1), (1, 4), (3, 2), (2, 3)))
"""By which an equation is often wrong."""

MOST_TERMS = 30
"""Of a rate that is taken apart."""

MOST_MISTAKES = 400
"""That an answer is compared with."""

SAME = 1e-9
"""Relative difference that is rounding."""

DIGITS = 6
"""After the point, by which mistakes are told from each other."""

ONE_TERM = "the sign of one term"
"""What a mistake in a sign says where the other terms of the equation are right."""

Rates = Mapping[str, Expr]
"""Derivatives as functions of the state; those that a mistake leaves alone are not there."""


@dataclass(frozen=True, slots=True, eq=False)
class Mistake:
    """What derivatives are under a mistake, at the states of the key (n).

    `rates` has them as expressions, where the mistake is made in the equations that the key tells.
    `detail` says more of the mistake than its code.
    """

    code: str
    values: Mapping[str, Floats]
    rates: Rates | None = None
    detail: str = ""


def mistakes(motion: Motion, potential: Expr | None, points: Points) -> tuple[Mistake, ...]:
    """Every mistake that changes the motion, in a way that no mistake before it does."""
    known = {name: value + np.zeros(points.count) for name, value in points.floats.items()}
    found: list[Mistake] = []
    for code, rates, detail in _mistaken(motion, potential):
        values = {name: _at(e, known) for name, e in rates.items()}
        found.append(Mistake(code, values, rates, detail))
    found += list(_of_second_order(motion, known, found))
    kept: dict[tuple[object, ...], Mistake] = {}
    for mistake in found[:MOST_MISTAKES]:
        mark = _mark(mistake.values, known)
        if mark:
            kept.setdefault(mark, mistake)
    return tuple(kept.values())


def _at(e: Expr, known: Mapping[str, Floats]) -> Floats:
    tree = to_tree(e)
    value = array(tree, {name: known[name] for name in names_in(tree)})
    return value + np.zeros(len(next(iter(known.values()))))


def _mark(values: Mapping[str, Floats], known: Mapping[str, Floats]) -> tuple[object, ...]:
    """What is the same for mistakes with the same outcome, and empty where there is no change."""
    parts: list[object] = []
    for name in sorted(values):
        size = np.abs(known[name]) + np.abs(known[name]).mean()
        if not (np.abs(values[name] - known[name]) <= SAME * size).all():
            ratios = values[name] / np.where(size > 0, size, 1.0)
            parts += [name, (ratios.round(DIGITS) + 0.0).tobytes()]
    return tuple(parts)


def _mistaken(motion: Motion, potential: Expr | None) -> Iterator[tuple[str, Rates, str]]:
    """Mistakes in the equations that the key tells, with details; the first of equal ones is the one told."""
    rates = motion.rates
    parts = {name: _terms(e) for name, e in rates.items()}
    for code, changed in _of_signs(motion, potential):
        yield code, changed, ""
    for name, terms in parts.items():
        for term in terms if len(terms) > 1 else ():
            yield "sign_error", {name: rates[name] - scaled(term, 2)}, ONE_TERM
    for code, changed in _uncoupled(motion, parts):
        yield code, changed, ""
    for factor in FACTORS:
        for name, e in rates.items():
            yield "constant_factor", {name: scaled(e, factor)}, ""
        yield "constant_factor", {name: scaled(e, factor) for name, e in rates.items()}, ""


def _of_signs(motion: Motion, potential: Expr | None) -> Iterator[tuple[str, Rates]]:
    """Signs of whole equations, and those of terms that belong together."""
    rates = motion.rates
    if motion.momenta and motion.second:
        forward = {name: -rates[name] for name in map(velocity, motion.functions)}
        back = {name: -rates[name] for name in motion.auxiliary_rates}
        for signs in (back, forward, forward | back):
            yield "hamilton_sign", signs
    yield from _euler(motion)
    for name, e in rates.items():
        yield "sign_error", {name: -e}
    yield "sign_error", {name: -e for name, e in rates.items()}
    if potential is not None and motion.momenta and motion.second:
        pairs = zip(motion.functions, motion.auxiliary, strict=True)
        forces = {velocity(p): derivative(potential, q) for q, p in pairs}
        yield "potential_sign", {name: rates[name] + scaled(e, 2) for name, e in forces.items()}


def _terms(e: Expr) -> list[Expr]:
    """The terms of a sum, multiplied out where that is short."""
    try:
        whole = expand(e)
    except ExpressionError:
        whole = e
    for form in (whole, e):
        if len(form.terms) <= MOST_TERMS:
            return [Expr({monomial: coefficient}) for monomial, coefficient in form.terms.items()]
    return [e]


def _euler(motion: Motion) -> Iterator[tuple[str, Rates]]:
    """Euler's equations with other signs of cross terms: those that multiply the two other rates."""
    if len(motion.functions) != 3 or motion.second:
        return
    crossed: dict[str, Expr] = {}
    for name in motion.functions:
        pair = set(motion.functions) - {name}
        e = motion.rates[velocity(name)]
        crossed[velocity(name)] = total(term for term in _terms(e) if pair <= term.names)
    if any(e.is_zero for e in crossed.values()):
        return
    for signs in sorted(product((False, True), repeat=3), key=sum, reverse=True):
        changed = [name for name, turned in zip(crossed, signs, strict=True) if turned]
        if changed:
            yield "euler_sign", {name: motion.rates[name] - scaled(crossed[name], 2) for name in changed}


def _uncoupled(motion: Motion, parts: Mapping[str, Sequence[Expr]]) -> Iterator[tuple[str, Rates]]:
    """Rates without the terms that hold what belongs to other functions."""
    own = _own(motion)
    without: dict[str, Expr] = {}
    for name, terms in parts.items():
        others = frozenset().union(*(names for names in own.values() if name not in names))
        kept = [term for term in terms if others.isdisjoint(term.names)]
        if 0 < len(kept) < len(terms):
            without[name] = total(kept)
            yield "coupling_term_missing", {name: without[name]}
    if len(without) > 1:
        yield "coupling_term_missing", without


def _own(motion: Motion) -> dict[str, frozenset[str]]:
    """The names that belong to each function."""
    partners = motion.auxiliary if len(motion.auxiliary) == len(motion.functions) else ()
    return {
        f: frozenset(
            name
            for each in (f, *partners[place : place + 1])
            for name in (each, velocity(each), acceleration(each))
        )
        for place, f in enumerate(motion.functions)
    }


def _of_second_order(
    motion: Motion, known: Mapping[str, Floats], found: Sequence[Mistake]
) -> Iterator[Mistake]:
    """Mistakes in equations of second order that follow from a key of first order."""
    if not motion.first_order or not motion.second:
        return
    for name in motion.tops:
        yield Mistake("sign_error", {name: -known[name]})
    yield Mistake("sign_error", {name: -known[name] for name in motion.tops})
    for mistake in found:
        if mistake.values.keys() <= set(motion.auxiliary_rates):
            states = {**known, **mistake.values}
            values = {name: _tree_at(motion, name, states) for name in motion.tops}
            yield Mistake(mistake.code, values, detail=mistake.detail)
    for factor in FACTORS:
        for name in motion.tops:
            yield Mistake("constant_factor", {name: float(factor) * known[name]})


def _tree_at(motion: Motion, name: str, values: Mapping[str, Floats]) -> Floats:
    tree = motion.known[name]
    found: Floats = array(tree, {each: values[each] for each in names_in(tree)}) + 0 * values[name]
    return found
