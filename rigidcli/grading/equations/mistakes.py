"""Keys of equations as they come out under common mistakes."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from functools import lru_cache
from itertools import islice, product
from typing import Literal, TypeAlias

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, scaled, total
from rigidcli.document.variables import acceleration, velocity
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.system import System
from rigidcli.grading.equations.text import Equation

FACTORS = tuple(Fraction(*each) for each in ((2, 1), (1, 2), (3, 1), (1, 3), (4, 1), (1, 4), (3, 2), (2, 3)))
"""By which an equation is often wrong."""

MOST_TERMS = 30
"""Of a rate that is taken apart."""

MOST_POINTS = 600
"""Of the field, among which one is looked for where the derivatives have values."""

ROUNDED = 1e-9
"""The tolerance of a number that stands for a symbol: it is right, and not near."""

MOST_MISTAKES = 400
"""That an answer is compared with."""

ONE_TERM = "the sign of one term"
"""What a mistake in a sign says where the other terms of the equation are right."""

Rates = Mapping[str, Expr]
"""Derivatives as functions of the state; those that a mistake leaves alone are not there."""


Form: TypeAlias = Literal["first_order", "second_order"]

Changed: TypeAlias = tuple[Key, str, str]
"""A key under a mistake, no place, and more that is to be said of the mistake."""

BOTH: tuple[Form, ...] = ("first_order", "second_order")
"""The forms of equations that a mistake in forces has."""


def made(code: str) -> Callable[[Key], Iterator[Changed]]:
    """What makes the keys of equations with this mistake."""
    return lambda key: ((mistaken, "", detail) for each, mistaken, detail in mistakes(key) if each == code)


def with_numbers(key: Key, answer: Sequence[Equation]) -> Iterator[Changed]:
    """The key with values of the document, those that are needed for the answer, in the place of symbols."""
    names = [name for name in key.given if name not in key.motion.fixed]
    if names and System(key.with_numbers(names, ROUNDED), answer).are_true:
        # Without the others, which cancel.
        needed = [
            name
            for name in names
            if not System(key.with_numbers([n for n in names if n != name], ROUNDED), answer).are_true
        ]
        told = f"without {', '.join(f'`{name}`' for name in needed)}"
        yield key.with_numbers(needed, ROUNDED), "", told


@lru_cache(64)
def mistakes(key: Key) -> tuple[tuple[str, Key, str], ...]:
    """Codes, keys and details of all mistakes that change the motion as no mistake before them does."""
    places = (n for n in range(MOST_POINTS) if key.motion.point(n) is not None)
    place, right = next(places, 0), None
    known = set[tuple[Form, tuple[int, ...] | None]]()
    found = []
    for code, changes, detail, forms in islice(_all(key.motion, key.potential), MOST_MISTAKES):
        motion = key.motion.changed(changes)
        values, right = _values(motion, place), right or _values(key.motion, place)
        new = [form for form in forms if (form, values) not in known and key.form in ("any", form)]
        if values is not None and values != right and new:
            known |= {(form, values) for form in new}
            form = key.form if new == list(BOTH) else new[0]
            found.append((code, replace(key, motion=motion, form=form), detail))
    return tuple(found)


def _values(motion: Motion, place: int) -> tuple[int, ...] | None:
    """The derivatives at a point of the field."""
    point = motion.point(place)
    return None if point is None else tuple(point.values[name] for name in motion.known)


def _all(motion: Motion, potential: Expr | None) -> Iterator[tuple[str, Rates, str, tuple[Form, ...]]]:
    """Mistakes with details and forms; the first of equal ones is the one told."""
    for code, rates, detail in _mistaken(motion, potential):
        is_force = rates.keys().isdisjoint(motion.middles)
        if code == "hamilton_sign" and is_force:
            # Equations of second order are not Hamilton's.
            yield code, rates, detail, BOTH[:1]
            code = "sign_error"
        yield code, rates, detail, BOTH if is_force else BOTH[:1]
    if motion.partners and motion.first_order:
        own = {name: motion.known[name] for name in motion.tops}
        for name, e in own.items():
            yield "sign_error", {name: -e}, "", BOTH[1:]
        yield "sign_error", {name: -e for name, e in own.items()}, "", BOTH[1:]
        for factor in FACTORS:
            for name, e in own.items():
                yield "constant_factor", {name: scaled(e, factor)}, "", BOTH[1:]


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
