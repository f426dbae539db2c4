"""Laws of sines and cosines on sums of products: used to shorten them, and to tell whether they vanish."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from fractions import Fraction
from itertools import combinations_with_replacement
from typing import NamedTuple, TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Atom, Monomial, interned
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, atomic, expr, gathered, product, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import mapped, with_powers

_STEPS_TO_SEARCH = 5
"""Steps for each pair of functions in a term, each of which is looked up beside another."""


class _Pair(NamedTuple):
    """An odd and an even function with even**2 + sign*odd**2 = 1."""

    odd: str
    even: str
    sign: int


_PAIRS = (_Pair("sin", "cos", 1), _Pair("sinh", "cosh", -1))
_PAIR_OF = {function: pair for pair in _PAIRS for function in (pair.odd, pair.even)}


def _functions(e: Expr | Monomial) -> list[Applied[Expr]]:
    """The sines and cosines in a sum or a monomial, each once."""
    atoms = e.atoms if isinstance(e, Expr) else [atom for atom, _ in e]
    return [atom for atom in atoms if isinstance(atom, Applied) and atom.function in _PAIR_OF]


def shortened(e: Expr, allowance: Allowance) -> Expr:
    """A sum with fewer terms where the laws give one: sin(x)**2 + cos(x)**2 is 1, and so on."""
    if not _functions(e):
        return e
    while len(e.terms) > 1 and (shorter := next(_shorter(e, allowance), None)) is not None:
        e = shorter
    return _in_one_function(e, allowance)


def _shorter(e: Expr, allowance: Allowance) -> Iterator[Expr]:
    """Sums in which one product stands for two terms, by one of the laws."""
    for monomial, coefficient in e.ordered:
        functions = _functions(monomial)
        allowance.spend(1 + _STEPS_TO_SEARCH * len(functions) * (len(functions) + 1))
        for f, g in combinations_with_replacement(functions, 2):
            for there, made in _laws(f, g):
                rest = _times(monomial, (f, g), -1)
                partner = None if rest is None else _times(rest, there, 1)
                beside = None if partner is None else e.terms.get(partner)
                value = made(beside / Fraction(coefficient)) if beside else None
                if rest is not None and partner is not None and beside and value is not None:
                    gone = Expr({monomial: -coefficient, partner: -beside})
                    yield total([e, gone, Expr({rest: coefficient}) * value])


_Law: TypeAlias = tuple[tuple[Atom, ...], Callable[[Rational], Expr | None]]
"""A second product, and the sum of the first one with a number times the second."""


def _laws(f: Applied[Expr], g: Applied[Expr]) -> Iterator[_Law]:
    """The laws for the product of two functions: of squares, and of sums of angles."""
    odd, even, sign = pair = _PAIR_OF[f.function]
    (x,), (y,) = f.arguments, g.arguments
    if f is g:
        # odd^2 = sign (1 - even^2), even^2 = 1 - sign odd^2
        one = sign if f.function == odd else 1
        other = apply(even if f.function == odd else odd, x)
        yield (), lambda ratio: -sign * other**2 if ratio == -one else None
    if f.function == g.function == even:
        # cos x cos y + sin x sin y = cos(x - y); cosh has the other sign.
        yield (
            (_function(odd, x), _function(odd, y)),
            lambda ratio: apply(even, x - sign * ratio * y) if abs(ratio) == 1 else None,
        )
    elif _PAIR_OF[g.function] is pair and f.function != g.function and x != y:
        # sin x cos y + cos x sin y = sin(x + y)
        x, y = (x, y) if f.function == odd else (y, x)
        yield (
            (_function(even, x), _function(odd, y)),
            lambda ratio: apply(odd, x + ratio * y) if abs(ratio) == 1 else None,
        )


def _function(name: str, x: Expr) -> Atom:
    return interned(Applied(name, (x,)))


def _times(monomial: Monomial, atoms: tuple[Atom, ...], step: int) -> Monomial | None:
    """A monomial with powers of atoms raised by a step; None where one would not be natural."""
    exponents = dict(monomial)
    for atom in atoms:
        exponents[atom] = exponents.get(atom, 0) + step
        if exponents[atom] < 0 or exponents[atom].denominator != 1:
            return None
    made = gathered(1, exponents)
    return next(iter(made.terms)) if len(made.terms) == 1 else None


def _in_one_function(e: Expr, allowance: Allowance) -> Expr:
    """Squares of sines by cosines, or the other way, wherever that leaves fewer terms."""
    arguments = dict.fromkeys((_PAIR_OF[atom.function], atom.arguments[0]) for atom in _functions(e))
    for pair, x in sorted(arguments, key=lambda each: (_PAIRS.index(each[0]), each[1].key)):
        ways = [_without_squares(e, pair, function, x, allowance) for function in (pair.odd, pair.even)]
        e = min([e, *ways], key=lambda way: (len(way.terms), len(way.key)))
    return e


def _without_squares(e: Expr, pair: _Pair, function: str, x: Expr, allowance: Allowance) -> Expr:
    """A sum with the squares of one function written in the other one of its pair."""
    other = apply(pair.even if function == pair.odd else pair.odd, x)
    square = pair.sign * (1 - other**2) if function == pair.odd else 1 - pair.sign * other**2
    replaced = _function(function, x)

    def change(atom: Atom, n: Rational) -> Expr | None:
        if atom is not replaced or n.denominator != 1 or n < 2:
            return None
        return gathered(1, {atom: n % 2}) * square ** (n // 2)

    changed = with_powers(e, change)
    return e if changed == e else expand(changed, allowance)


def tangents_replaced(e: Expr) -> Expr:
    """The expression with sin/cos for tan where the sine or cosine of the same angle stands beside it."""
    beside = {(atom.function[3:], atom.arguments) for atom in _functions(e)}

    def change(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied) and atom.function in ("tan", "tanh"):
            end = atom.function[3:]
            if (end, atom.arguments) not in beside:
                return None
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
