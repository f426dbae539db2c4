"""Laws of sines and cosines on sums of products: used to shorten them, and to tell whether they vanish."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from fractions import Fraction
from typing import NamedTuple

from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Applied, Atom, Monomial, interned
from rigidcli.symbolic.algebra.calculus import expand, mapped, rebuilt
from rigidcli.symbolic.algebra.expressions import Expr, gathered, product, total
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.algebra.roots import Rational

MAX_ROUNDS = 200
"""Most times that terms of one sum are replaced by fewer."""

_STEPS_TO_SEARCH = 10
"""Steps for each pair of functions in a term whose partner is looked for."""

MAX_MULTIPLE = 12
"""Largest multiple of an angle whose sine is written in sines and cosines of the angle itself."""


class _Pair(NamedTuple):
    """An odd and an even function with odd**2 = sign*(1 - even**2)."""

    odd: str
    even: str
    sign: int


_PAIRS = (_Pair("sin", "cos", 1), _Pair("sinh", "cosh", -1))
_FUNCTIONS = frozenset(function for pair in _PAIRS for function in (pair.odd, pair.even))


def has_functions(e: Expr) -> bool:
    """Whether one of the functions stands in a term."""
    return any(isinstance(atom, Applied) and atom.function in _FUNCTIONS for atom in e.atoms)


def shortened(e: Expr, allowance: Allowance) -> Expr:
    """A sum with fewer terms where the laws give one: sin(x)**2 + cos(x)**2 is 1, and so on."""
    for _ in range(MAX_ROUNDS):
        if len(e.terms) < 2:
            break
        shorter = next(_shorter(e, allowance), None)
        if shorter is None:
            break
        e = shorter
    return _in_one_function(e, allowance)


def _shorter(e: Expr, allowance: Allowance) -> Iterator[Expr]:
    for monomial, coefficient in e.ordered:
        functions = [
            (atom.function, atom.arguments[0])
            for atom, _ in monomial
            if isinstance(atom, Applied) and atom.function in _FUNCTIONS
        ]
        allowance.spend(1 + _STEPS_TO_SEARCH * len(functions) ** 2)
        for pair in _PAIRS:
            for function, x in functions:
                if function in (pair.odd, pair.even):
                    yield from _squares(e, monomial, coefficient, pair, function, x)
            evens = [x for function, x in functions if function == pair.even]
            odds = [x for function, x in functions if function == pair.odd]
            yield from _angles(e, monomial, coefficient, pair, evens, odds)


def _function(name: str, x: Expr) -> Atom:
    return interned(Applied(name, (x,)))


def _exchanged(monomial: Monomial, change: Mapping[Atom, int]) -> Monomial | None:
    """A monomial with some exponents changed; None where a power would not be natural."""
    exponents = dict(monomial)
    for atom, step in change.items():
        exponents[atom] = exponents.get(atom, 0) + step
        if exponents[atom] < 0 or exponents[atom].denominator != 1:
            return None
    made = gathered(1, exponents)
    return next(iter(made.terms)) if len(made.terms) == 1 else None


def _replaced(
    e: Expr, gone: Mapping[Monomial, Rational], made: Monomial, coefficient: Rational, factor: Expr
) -> Expr:
    """A sum without some parts of its terms, and with a monomial times a factor instead."""
    removed = Expr({monomial: -part for monomial, part in gone.items()})
    return total([e, removed, Expr({made: coefficient}) * factor])


def _squares(
    e: Expr, monomial: Monomial, coefficient: Rational, pair: _Pair, function: str, x: Expr
) -> Iterator[Expr]:
    """odd**2 + sign*even**2 = sign, with the third of these terms to stand for the other two."""
    odd, even = _function(pair.odd, x), _function(pair.even, x)
    one = Expr({(): 1})
    if function == pair.odd:
        rest = _exchanged(monomial, {odd: -2})
        partner = _exchanged(monomial, {odd: -2, even: 2})
        if rest is None or partner is None:
            return
        if e.terms.get(partner) == pair.sign * coefficient:
            gone = {monomial: coefficient, partner: pair.sign * coefficient}
            yield _replaced(e, gone, rest, pair.sign * coefficient, one)
        if e.terms.get(rest) == -pair.sign * coefficient:
            gone = {monomial: coefficient, rest: -pair.sign * coefficient}
            yield _replaced(e, gone, partner, -pair.sign * coefficient, one)
    else:
        rest = _exchanged(monomial, {even: -2})
        partner = _exchanged(monomial, {even: -2, odd: 2})
        if rest is not None and partner is not None and e.terms.get(rest) == -coefficient:
            gone = {monomial: coefficient, rest: -coefficient}
            yield _replaced(e, gone, partner, -pair.sign * coefficient, one)


def _angles(
    e: Expr, monomial: Monomial, coefficient: Rational, pair: _Pair, evens: list[Expr], odds: list[Expr]
) -> Iterator[Expr]:
    """The theorems of addition, read from right to left."""
    for place, x in enumerate(evens):
        for y in [*evens[place + 1 :], x]:
            # cos x cos y + sin x sin y = cos(x - y); cosh has the other sign.
            evened = _times(_function(pair.even, x), _function(pair.even, y))
            odded = _times(_function(pair.odd, x), _function(pair.odd, y))
            rest = _exchanged(monomial, {atom: -power for atom, power in evened.items()})
            partner = _exchanged(rest, odded) if rest is not None else None
            found = e.terms.get(partner) if partner is not None else None
            if rest is None or partner is None or found is None or abs(found) != abs(coefficient):
                continue
            sign = 1 if found * pair.sign == coefficient else -1
            if x == y and sign == 1:
                continue
            angle = x - y if sign == 1 else x + y
            yield _replaced(
                e, {monomial: coefficient, partner: found}, rest, coefficient, apply(pair.even, angle)
            )
    for x in odds:
        for y in evens:
            # sin x cos y + cos x sin y = sin(x + y)
            if x == y:
                continue
            here = {_function(pair.odd, x): -1, _function(pair.even, y): -1}
            there = {_function(pair.even, x): 1, _function(pair.odd, y): 1}
            rest = _exchanged(monomial, here)
            partner = _exchanged(rest, there) if rest is not None else None
            found = e.terms.get(partner) if partner is not None else None
            if rest is None or partner is None or found is None or abs(found) != abs(coefficient):
                continue
            angle = x + y if found == coefficient else x - y
            yield _replaced(
                e, {monomial: coefficient, partner: found}, rest, coefficient, apply(pair.odd, angle)
            )


def _times(first: Atom, second: Atom) -> dict[Atom, int]:
    return {first: 2} if first is second else {first: 1, second: 1}


def _in_one_function(e: Expr, allowance: Allowance) -> Expr:
    """Squares of sines by cosines, or the other way, wherever that leaves fewer terms."""
    for pair in _PAIRS:
        for x in _arguments(e, pair):
            ways = [without_squares(e, function, x, allowance) for function in (pair.odd, pair.even)]
            e = min([e, *ways], key=lambda way: len(way.terms))
    return e


def _arguments(e: Expr, pair: _Pair) -> list[Expr]:
    found = [
        atom.arguments[0]
        for atom in e.atoms
        if isinstance(atom, Applied) and atom.function in (pair.odd, pair.even)
    ]
    return sorted(dict.fromkeys(found), key=lambda x: x.key)


def without_squares(e: Expr, function: str, x: Expr, allowance: Allowance) -> Expr:
    """A sum with the squares of one function written in the other one of its pair."""
    pair = next(pair for pair in _PAIRS if function in (pair.odd, pair.even))
    other = apply(pair.even if function == pair.odd else pair.odd, x)
    square = pair.sign * (1 - other**2) if function == pair.odd else 1 - pair.sign * other**2
    replaced = _function(function, x)
    parts = []
    allowance.spend(len(e.terms))
    for monomial, coefficient in e.terms.items():
        exponents = dict(monomial)
        exponent = exponents.get(replaced, 0)
        if exponent.denominator == 1 and exponent >= 2:
            exponents[replaced] = exponent % 2
            written = product([gathered(coefficient, exponents), square ** (exponent // 2)])
            parts.append(expand(written, allowance))
        else:
            parts.append(Expr({monomial: coefficient}))
    return total(parts)


def elementary_angles(e: Expr, allowance: Allowance) -> Expr:
    """The expression in sines and cosines of the terms of their arguments, and no sine squared."""
    e = expand(_in_single_angles(e, allowance), allowance)
    for pair in _PAIRS:
        for x in _arguments(e, pair):
            e = without_squares(e, pair.odd, x, allowance)
    return e


def _in_single_angles(e: Expr, allowance: Allowance) -> Expr:
    return mapped(e, lambda atom: _single_angles(atom, allowance))


def _single_angles(atom: Atom, allowance: Allowance) -> Expr:
    if isinstance(atom, Applied) and atom.function in ("tan", "tanh"):
        pair = _PAIRS[0 if atom.function == "tan" else 1]
        odd, even = _odd_and_even(pair, _in_single_angles(atom.arguments[0], allowance), allowance)
        return odd / even
    if isinstance(atom, Applied) and atom.function in _FUNCTIONS:
        pair = next(pair for pair in _PAIRS if atom.function in (pair.odd, pair.even))
        odd, even = _odd_and_even(pair, _in_single_angles(atom.arguments[0], allowance), allowance)
        return odd if atom.function == pair.odd else even
    return rebuilt(atom, lambda inner: _in_single_angles(inner, allowance))


def _odd_and_even(pair: _Pair, x: Expr, allowance: Allowance) -> tuple[Expr, Expr]:
    """sin and cos, or sinh and cosh, of a sum by the theorems of addition."""
    odd, even = apply(pair.odd, 0), apply(pair.even, 0)
    for monomial, coefficient in expand(x, allowance).ordered:
        multiple = coefficient.numerator
        repeated = abs(multiple) if abs(multiple) <= MAX_MULTIPLE else 1
        angle = Expr({monomial: Fraction(coefficient) / repeated})
        further_odd, further_even = apply(pair.odd, angle), apply(pair.even, angle)
        for _ in range(repeated):
            odd, even = (
                expand(odd * further_even + even * further_odd, allowance),
                expand(even * further_even - pair.sign * odd * further_odd, allowance),
            )
    return odd, even


def exponentials_merged(e: Expr) -> Expr:
    """exp(x)*exp(y) as exp(x + y) in each term."""
    parts = []
    for monomial, coefficient in e.terms.items():
        kept: dict[Atom, Rational] = {}
        exponents = []
        for atom, exponent in monomial:
            if isinstance(atom, Applied) and atom.function == "exp":
                exponents.append(exponent * atom.arguments[0])
            else:
                kept[atom] = exponent
        rest = gathered(coefficient, kept)
        parts.append(rest * apply("exp", total(exponents)) if exponents else rest)
    return total(parts)
