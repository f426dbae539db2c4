"""Laws of sines and cosines on sums of products: used to shorten them, and to tell whether they vanish."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from typing import NamedTuple, TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Monomial, interned
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, Expr, atomic, expr, gathered, product, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import mapped

MAX_ROUNDS = 200
"""Most times that terms of one sum are replaced by fewer."""

_STEPS_TO_SEARCH = 10
"""Steps for each pair of functions in a term whose partner is looked for."""


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
    """Sums in which one product stands for two terms, by one of the laws."""
    for monomial, coefficient in e.ordered:
        functions = [
            (atom.function, atom.arguments[0])
            for atom, _ in monomial
            if isinstance(atom, Applied) and atom.function in _FUNCTIONS
        ]
        allowance.spend(1 + _STEPS_TO_SEARCH * len(functions) ** 2)
        for here, there, made in itertools.chain.from_iterable(_laws(pair, functions) for pair in _PAIRS):
            rest = _exchanged(monomial, here, -1)
            partner = None if rest is None else _exchanged(rest, there, 1)
            other_coefficient = None if partner is None else e.terms.get(partner)
            if rest is None or partner is None or other_coefficient is None:
                continue
            ratio = 1 if other_coefficient == coefficient else -1 if other_coefficient == -coefficient else 0
            if ratio in made:
                gone = Expr({monomial: -coefficient, partner: -other_coefficient})
                yield total([e, gone, Expr({rest: coefficient}) * made[ratio]()])


_Functions: TypeAlias = Sequence[tuple[str, Expr]]
"""Functions by their names, each with its argument."""

_Law: TypeAlias = tuple[_Functions, _Functions, Mapping[int, Callable[[], Expr]]]
"""Two products of functions, and what the first comes to with the second, or with its negative, added."""


def _laws(pair: _Pair, functions: _Functions) -> Iterator[_Law]:
    """The laws whose first product is of these functions: of squares, and of sums of angles."""
    for function, x in functions:
        if function == pair.odd:
            yield from _of_odd_square(pair, x)
        elif function == pair.even:
            yield from _of_even_square(pair, x)
    odds, evens = ([x for function, x in functions if function == name] for name in (pair.odd, pair.even))
    for place, x in enumerate(evens):
        for y in [*evens[place + 1 :], x]:
            # cos x cos y + sin x sin y = cos(x - y); cosh has the other sign.
            made = {turn * -pair.sign: partial(_turned, pair.even, x, y, turn) for turn in (1, -1)}
            if x == y:
                del made[pair.sign]
            yield [(pair.even, x), (pair.even, y)], [(pair.odd, x), (pair.odd, y)], made
    for x, y in itertools.product(odds, evens):
        if x != y:
            # sin x cos y + cos x sin y = sin(x + y)
            made = {turn: partial(_turned, pair.odd, x, y, turn) for turn in (1, -1)}
            yield [(pair.odd, x), (pair.even, y)], [(pair.even, x), (pair.odd, y)], made


def _of_odd_square(pair: _Pair, x: Expr) -> Iterator[_Law]:
    """odd**2 + sign*even**2 = sign, with the third of these terms to stand for the other two."""
    yield [(pair.odd, x)] * 2, [(pair.even, x)] * 2, {pair.sign: lambda: pair.sign * ONE}
    yield [(pair.odd, x)] * 2, [], {-pair.sign: lambda: -pair.sign * apply(pair.even, x) ** 2}


def _of_even_square(pair: _Pair, x: Expr) -> Iterator[_Law]:
    """even**2 - 1 = -sign*odd**2, the same law with another pair of terms."""
    yield [(pair.even, x)] * 2, [], {-1: lambda: -pair.sign * apply(pair.odd, x) ** 2}


def _turned(function: str, x: Expr, y: Expr, turn: int) -> Expr:
    return apply(function, x + turn * y)


def _exchanged(monomial: Monomial, functions: _Functions, step: int) -> Monomial | None:
    """A monomial with powers of functions changed; None where one would not be natural."""
    exponents = dict(monomial)
    for name, x in functions:
        atom = _function(name, x)
        exponents[atom] = exponents.get(atom, 0) + step
        if exponents[atom] < 0 or exponents[atom].denominator != 1:
            return None
    made = gathered(1, exponents)
    return next(iter(made.terms)) if len(made.terms) == 1 else None


def _function(name: str, x: Expr) -> Atom:
    return interned(Applied(name, (x,)))


def _in_one_function(e: Expr, allowance: Allowance) -> Expr:
    """Squares of sines by cosines, or the other way, wherever that leaves fewer terms."""
    for pair in _PAIRS:
        for x in _arguments(e, pair):
            ways = [_without_squares(e, function, x, allowance) for function in (pair.odd, pair.even)]
            e = min([e, *ways], key=lambda way: (len(way.terms), len(way.key)))
    return e


def _arguments(e: Expr, pair: _Pair) -> list[Expr]:
    arguments = [
        atom.arguments[0]
        for atom in e.atoms
        if isinstance(atom, Applied) and atom.function in (pair.odd, pair.even)
    ]
    return sorted(dict.fromkeys(arguments), key=lambda x: x.key)


def _without_squares(e: Expr, function: str, x: Expr, allowance: Allowance) -> Expr:
    """A sum with the squares of one function written in the other one of its pair."""
    pair = next(pair for pair in _PAIRS if function in (pair.odd, pair.even))
    other = apply(pair.even if function == pair.odd else pair.odd, x)
    square = pair.sign * (1 - other**2) if function == pair.odd else 1 - pair.sign * other**2
    replaced = _function(function, x)
    parts = []
    allowance.spend(len(e.terms))
    if all(dict(monomial).get(replaced, 0) < 2 for monomial in e.terms):
        return e
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


def mixes_tangents(e: Expr) -> bool:
    """Whether tan or tanh stands beside the sine or cosine of the same angle."""
    applied = [atom for atom in e.atoms if isinstance(atom, Applied)]
    tangents = {(atom.function[3:], atom.arguments) for atom in applied if atom.function in ("tan", "tanh")}
    return any((a.function[3:], a.arguments) in tangents for a in applied if a.function in _FUNCTIONS)


def tangents_replaced(e: Expr) -> Expr:
    """The expression with quotients of sines and cosines for tangents."""

    def change(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied) and atom.function in ("tan", "tanh"):
            end = atom.function[3:]
            quotient: Expr = apply(f"sin{end}", *atom.arguments) / apply(f"cos{end}", *atom.arguments)
            return quotient
        return None

    return mapped(e, change)


def exponentials_merged(e: Expr) -> Expr:
    """exp(x)*exp(y) as exp(x + y) in each term, x**a*x**b as x**(a + b), and exp(n*log(x)) as x**n."""
    parts = []
    for monomial, coefficient in e.terms.items():
        kept: dict[Atom, Rational] = {}
        exponents = []
        powers: dict[Expr, list[Expr]] = {}
        for atom, exponent in monomial:
            if isinstance(atom, Applied) and atom.function == "exp":
                exponents.append(exponent * atom.arguments[0])
            elif isinstance(atom, Applied) and atom.function == "pow":
                powers.setdefault(atom.arguments[0], []).append(exponent * atom.arguments[1])
            else:
                kept[atom] = exponent
        for atom in [*kept]:
            if atomic(atom) in powers:
                powers[atomic(atom)].append(expr(kept.pop(atom)))
        rest = product([gathered(coefficient, kept), *(base ** total(own) for base, own in powers.items())])
        parts.append(rest * _exponential(total(exponents)) if exponents else rest)
    return total(parts)


def _exponential(e: Expr) -> Expr:
    """exp of a sum, its logarithms as factors: exp(a + n*log(x)) is x**n*exp(a)."""
    powers, others = [], []
    for monomial, coefficient in e.terms.items():
        logs = [
            atom for atom, n in monomial if isinstance(atom, Applied) and atom.function == "log" and n == 1
        ]
        if len(logs) == 1:
            exponent = Expr({tuple(factor for factor in monomial if factor[0] is not logs[0]): coefficient})
            powers.append(logs[0].arguments[0] ** exponent)
        else:
            others.append(Expr({monomial: coefficient}))
    return product([*powers, apply("exp", total(others))])
