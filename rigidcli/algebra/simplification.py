"""Shorter forms of exact expressions; some by the laws of sines, cosines and exponentials."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import cache, lru_cache
from itertools import combinations_with_replacement
from typing import NamedTuple, TypeAlias

from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Surd, Symbol, interned
from rigidcli.algebra.bounds import Allowance, Rational
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, atomic, expr, factored, gathered, product, total, with_squares
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import mapped, rebuilt, with_powers
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError
from rigidcli.language.text import text

MAX_TERMS_TO_TIDY = 300  # most terms of a sum that is rearranged at all
MOST_NODES_TO_TIDY = 1_000  # the most nodes of an expression that is rearranged: more than a page
MAX_STEPS_TO_TIDY = 20_000  # steps after which no further forms are looked for: a few hundredths of a second
_STEPS_TO_WRITE = 50  # steps for one term of a form that is written as text, to compare its length
DEEPEST_ROOT = 3  # largest depth of a sum under a root that is made shorter: each level triples the time


@lru_cache(maxsize=4096)
def tidy(e: Expr) -> Expr:
    """The form with the shortest text among some that are equal to `e` wherever that has a value.

    They are: multiplied out, shortened by the laws of sines and cosines, over one denominator that is divided
    out where it can be, with common factors taken out of all terms or of those with the same
    functions and velocities.
    """
    return _tidied(e, Allowance(MAX_STEPS_TO_TIDY))


def _tidied(e: Expr, allowance: Allowance) -> Expr:
    has_parts = len(e.terms) > 1 or any(isinstance(atom, (Group, Applied)) for atom in e.atoms)
    if len(e.terms) > MAX_TERMS_TO_TIDY or e.nodes > MOST_NODES_TO_TIDY or not has_parts:
        return e

    def tidied(atom: Atom) -> Expr | None:
        is_whole = isinstance(atom, (Symbol, Pi, Surd))
        return None if is_whole else rebuilt(atom, lambda part: _tidied(part, allowance))

    inner = e
    with suppress(ExpressionError):
        inner = mapped(e, tidied)
    return shortest(list(dict.fromkeys([e, *_forms(inner, allowance)])))


def shortest(forms: Sequence[Expr]) -> Expr:
    """The form with the shortest text; of several, the first by that text."""
    return forms[0] if len(forms) == 1 else min(forms, key=_length)


def over_shared_sums(e: Expr) -> Expr:
    """Terms over the same power of a sum and of symbols over one fraction bar, where that is shorter."""
    for divisor in dict.fromkeys(a for m in e.terms for a, n in m if isinstance(a, Group) and n < 0):
        for below in dict.fromkeys(_below(m, divisor) for m in e.terms):
            # The terms are looked for anew, since those of another divisor may have been joined to them.
            own = {m: c for m, c in e.terms.items() if _below(m, divisor) == below}
            if len(own) > 1 and divisor in dict(below):
                rest = Expr({m: c for m, c in e.terms.items() if m not in own})
                e = shortest([e, total([_with_factors(Expr(own)), rest])])
    return e


def _below(monomial: Monomial, divisor: Atom) -> frozenset[tuple[Atom, Rational]]:
    return frozenset((a, n) for a, n in monomial if n < 0 and (a is divisor or isinstance(a, Symbol)))


def is_product(e: Expr) -> bool:
    """Whether it has at most one term, and no sum in it."""
    return len(e.terms) < 2 and not any(isinstance(atom, Group) for atom in e.atoms)


def spread(e: Expr) -> Expr:
    """Sums over a denominator that some of their terms cancel, term by term: (a + b)/(a*b) is 1/b + 1/a."""

    def parts(monomial: Monomial, coefficient: Rational) -> Expr:
        for atom, n in monomial:
            if isinstance(atom, Group) and atom.plain and n == 1:
                inside = frozenset(atom.inner.atoms)
                if any(k < 0 and other in inside for other, k in monomial):
                    rest = gathered(coefficient, {other: k for other, k in monomial if other is not atom})
                    return total(rest * Expr({m: c}) for m, c in atom.inner.terms.items())
        return Expr({monomial: coefficient})

    return total(parts(monomial, coefficient) for monomial, coefficient in e.terms.items())


def apart(e: Expr) -> Expr:
    """A product with a sum in it, whose terms have different functions and parameters, as a sum of products.

    m*(g*sin(x) - a*cos(x)) is m*g*sin(x) - m*a*cos(x), but k*(sin(x) + cos(x)) stays.
    """
    if len(e.terms) != 1:
        return e
    ((monomial, coefficient),) = e.terms.items()
    sums = [atom for atom, n in monomial if isinstance(atom, Group) and atom.plain and n > 0]
    if len(sums) != 1 or (sums[0], 1) not in monomial:
        return e
    inner = sums[0].inner.terms
    if len({tuple(filter(_is_parameter, dict(m))) for m in inner}) == 1:
        return e
    rest = gathered(coefficient, {atom: n for atom, n in monomial if atom is not sums[0]})
    return _collected(total(rest * Expr({m: c}) for m, c in inner.items()))


@lru_cache(4096)
def _length(e: Expr) -> tuple[int, str]:
    written = text(to_tree(e))
    return len(written), written


def _forms(e: Expr, allowance: Allowance) -> Iterator[Expr]:
    """Forms of an expression; one that becomes too large is passed over."""
    known: set[Expr] = set()

    @cache
    def multiplied_out() -> Expr:
        return expand(e, allowance)

    changes: tuple[Callable[[], Expr], ...] = (
        lambda: e,
        lambda: _reduced(multiplied_out(), allowance),
        lambda: _over_one_denominator(multiplied_out(), allowance),
        lambda: _over_lowest_powers(e, allowance),
    )
    for change in changes:
        with suppress(ExpressionError):
            form = _roots_tidied(change(), allowance)
            if form not in known:
                allowance.spend(_STEPS_TO_WRITE * len(form.terms))
                known.add(form)
                yield form
                yield _with_factors(form)
                yield _collected(form)
                squared = _squares_completed(form)
                if squared is not form:
                    yield squared


def _squares_completed(e: Expr) -> Expr:
    """The expression with squares of sums, as a whole and in the sums of its products."""

    def change(atom: Atom, n: Rational) -> Expr | None:
        if not isinstance(atom, Group):
            return None
        squared = with_squares(atom.inner)
        return None if squared is atom.inner else squared**n

    return with_powers(with_squares(e), change)


def _roots_tidied(e: Expr, allowance: Allowance) -> Expr:
    """The expression with the sums under roots in their shortest form, which multiplying out has undone."""

    def change(atom: Atom, n: Rational) -> Expr | None:
        is_root = n.denominator > 1 and atom.depth <= DEEPEST_ROOT
        return _tidied(atom.inner, allowance) ** n if is_root and isinstance(atom, Group) else None

    return with_powers(e, change)


def _shortened(e: Expr, allowance: Allowance) -> Expr:
    return _reduced(expand(e, allowance), allowance)


def _reduced(e: Expr, allowance: Allowance) -> Expr:
    if len(e.terms) > MAX_TERMS_TO_TIDY or all(isinstance(atom, Symbol) for atom in e.atoms):
        return e
    e = exponentials_merged(_roots_above(e))
    replaced = tangents_replaced(e)
    return shortened(e if replaced == e else expand(replaced, allowance), allowance)


def _roots_above(e: Expr) -> Expr:
    """Roots of products only above the fraction bar: k/sqrt(k*m) is sqrt(k*m)/m."""

    def moved(atom: Atom, n: Rational) -> Expr | None:
        if not isinstance(atom, Group) or len(atom.inner.terms) > 1 or n > 0:
            return None
        whole = math.floor(n)
        return product([gathered(1, {atom: n - whole}), atom.inner**whole])

    return with_powers(e, moved)


def _with_factors(e: Expr) -> Expr:
    coefficient, monomial = factored(e)
    return gathered(coefficient, dict(monomial))


def _collected(e: Expr) -> Expr:
    """Terms with the same functions, groups and velocities together, their common factors taken out."""
    parts: dict[Monomial, dict[Monomial, Rational]] = {}
    for monomial, coefficient in e.ordered:
        shared = tuple(factor for factor in monomial if not _is_parameter(factor[0]))
        parts.setdefault(shared, {})[monomial] = coefficient
    return total(_with_factors(Expr(part)) for part in parts.values())


def _is_parameter(atom: Atom) -> bool:
    return isinstance(atom, (Pi, Surd)) or (isinstance(atom, Symbol) and not atom.is_rate)


def _over_lowest_powers(e: Expr, allowance: Allowance) -> Expr:
    """Terms over different powers of a root over the highest of them: a/r^3 + b/r is (a + b r^2)/r^3."""
    powered = {factor for monomial in e.terms for factor in monomial}
    roots = {a for a, n in powered if isinstance(a, Group) and len(a.inner.terms) > 1 and n < 0}
    for root in sorted(roots, key=lambda atom: atom.key):
        powers = {dict(m).get(root, 0) for m in e.terms}
        low = min(powers, default=0)  # without terms where the sum has come to zero
        if low.denominator > 1 and len(powers) > 1 and all((n - low).denominator == 1 for n in powers):
            whole = total(
                gathered(c, {a: n for a, n in m if a is not root}) * root.inner ** (dict(m)[root] - low)
                for m, c in e.terms.items()
            )
            e = _shortened(whole, allowance) * gathered(1, {root: low})
    return e


def _over_one_denominator(e: Expr, allowance: Allowance) -> Expr:
    """What is multiplied out as a fraction in lowest terms and in factors, where a sum is below."""
    if not any(isinstance(atom, Group) and n < 0 for atom, n in factored(e)[1]):
        return e
    parts = [(_shortened(factor, allowance), n) for factor, n in factors(e, allowance)]
    return product([shortest([part, _collected(part)]) ** n for part, n in parts])


# --- sines, cosines and exponentials

_STEPS_TO_SEARCH = 5  # steps for each pair of functions in a term, each of which is looked up beside another


class _Pair(NamedTuple):
    """An odd and an even function with even**2 + sign*odd**2 = 1."""

    odd: str
    even: str
    sign: int


_PAIRS = (_Pair("sin", "cos", 1), _Pair("sinh", "cosh", -1))
_PAIR_OF = {function: pair for pair in _PAIRS for function in (pair.odd, pair.even)}


def _functions(e: Expr | Monomial) -> list[Applied[Expr]]:
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
"""A second product g, and a rule for f + c g, by the number c; None where there is none."""


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
        e = min([e, *ways], key=lambda way: (len(way.terms), way.nodes, way.key))
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
    """The expression with sin/cos for tan, where that is squared or beside a sine or cosine of its angle."""
    squares = {a for m in e.terms for a, n in m if n == 2 and isinstance(a, Applied)}
    tangents = (a for a in squares if a.function == "tan")
    beside = {(atom.function[3:], atom.arguments) for atom in (*_functions(e), *tangents)}

    def change(atom: Atom) -> Expr | None:
        if isinstance(atom, Applied) and atom.function in ("tan", "tanh"):
            end = atom.function[3:]
            if (end, atom.arguments) in beside:
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
        logs = [a for a, n in monomial if isinstance(a, Applied) and a.function == "log" and n == 1]
        if len(logs) == 1:
            exponent = Expr({tuple(factor for factor in monomial if factor[0] is not logs[0]): coefficient})
            powers.append(logs[0].arguments[0] ** exponent)
        else:
            others.append(Expr({monomial: coefficient}))
    return product([*powers, apply("exp", total(others))])
