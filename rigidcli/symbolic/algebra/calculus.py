"""Exact expressions: derivatives, substitution, multiplying out, polynomials."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping, Sequence
from fractions import Fraction
from typing import TypeAlias

from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Symbol, key_of_atom
from rigidcli.symbolic.algebra.expressions import (
    ONE,
    ZERO,
    Expr,
    atomic,
    gathered,
    multiplied,
    number,
    power,
    product,
    total,
)
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.algebra.roots import Rational, bounded
from rigidcli.symbolic.language.tree import UnknownFunction

MAX_STEPS = 100_000
"""Most steps in multiplying one expression out: about half a second."""

MAX_FACTORS = 20_000
"""Most factors of the terms of one derivative, so that none takes longer than a second."""

_SLOPES: dict[str, Callable[[Expr], Expr]] = {
    "sin": lambda x: apply("cos", x),
    "cos": lambda x: -apply("sin", x),
    "tan": lambda x: 1 + apply("tan", x) ** 2,
    "asin": lambda x: (1 - x**2) ** Fraction(-1, 2),
    "acos": lambda x: -((1 - x**2) ** Fraction(-1, 2)),
    "atan": lambda x: 1 / (1 + x**2),
    "sinh": lambda x: apply("cosh", x),
    "cosh": lambda x: apply("sinh", x),
    "tanh": lambda x: 1 - apply("tanh", x) ** 2,
    "asinh": lambda x: (1 + x**2) ** Fraction(-1, 2),
    "acosh": lambda x: (x - 1) ** Fraction(-1, 2) * (x + 1) ** Fraction(-1, 2),
    "atanh": lambda x: 1 / (1 - x**2),
    "exp": lambda x: apply("exp", x),
    "log": lambda x: 1 / x,
    "abs": lambda x: apply("sign", x),
    "sign": lambda x: ZERO,
}
"""The derivative of each function of one argument."""


def derivative(e: Expr, name: str) -> Expr:
    """The derivative with respect to a symbol; that of `abs` is `sign`, that of `sign` is 0."""
    return _Derivative(name).of(e)


class _Derivative:
    """The derivatives of atoms that are known so far."""

    __slots__ = ("allowance", "known", "name")

    def __init__(self, name: str) -> None:
        self.name = name
        self.allowance = Allowance(MAX_FACTORS)
        self.known: dict[Atom, Expr] = {}

    def of(self, e: Expr) -> Expr:
        if self.name not in e.names:
            return ZERO
        parts = []
        for monomial, coefficient in e.terms.items():
            for atom, exponent in monomial:
                if self.name in atom.names:
                    self.allowance.spend(len(monomial))
                    exponents = dict(monomial)
                    exponents[atom] = exponent - 1
                    rest = gathered(bounded(coefficient * exponent), exponents)
                    parts.append(rest * self.of_atom(atom))
        return total(parts)

    def of_atom(self, atom: Atom) -> Expr:
        if atom not in self.known:
            self.known[atom] = self.worked_out(atom)
        return self.known[atom]

    def worked_out(self, atom: Atom) -> Expr:
        match atom:
            case Group(inner=inner):
                return self.of(inner)
            case Applied(function="atan2", arguments=(y, x)):
                turned: Expr = (x * self.of(y) - y * self.of(x)) / (x**2 + y**2)
                return turned
            case Applied(function="pow", arguments=(base, exponent)):
                return self.of_power(base, exponent)
            case Applied(function=UnknownFunction() as function, arguments=arguments):
                slopes = [apply(slope, *arguments) for slope in function.derivatives]
                return total(f * self.of(x) for f, x in zip(slopes, arguments, strict=True))
            case Applied(function=function, arguments=(argument,)):
                return _SLOPES[function](argument) * self.of(argument)
            case _:
                return ONE

    def of_power(self, base: Expr, exponent: Expr) -> Expr:
        through_base = exponent * base ** (exponent - 1) * self.of(base)
        slope = self.of(exponent)
        if slope.is_zero:
            return through_base
        return through_base + base**exponent * apply("log", base) * slope


def substitute(e: Expr, values: Mapping[str, Expr]) -> Expr:
    """The expression with symbols replaced, all at once.

    Raises:
        ExpressionError: it has no value there, or becomes too large.
    """
    names = frozenset(values)

    def replaced(atom: Atom) -> Expr | None:
        if names.isdisjoint(atom.names):
            return None
        if isinstance(atom, Symbol):
            return values[atom.name]
        return rebuilt(atom, whole)

    def whole(inner: Expr) -> Expr:
        return inner if names.isdisjoint(inner.names) else mapped(inner, replaced)

    return whole(e)


def without(e: Expr, vanishing: Collection[Atom]) -> Expr:
    """The expression where some of its atoms vanish.

    Raises:
        ExpressionError: it has no value there.
    """

    def whole(inner: Expr) -> Expr:
        return mapped(inner, lambda atom: ZERO if atom in vanishing else rebuilt(atom, whole))

    return whole(e) if vanishing else e


def rebuilt(atom: Atom, change: Callable[[Expr], Expr]) -> Expr:
    """A function of changed arguments, or a changed group."""
    if isinstance(atom, Applied):
        return apply(atom.function, *[change(argument) for argument in atom.arguments])
    if isinstance(atom, Group):
        return change(atom.inner)
    return atomic(atom)


def mapped(e: Expr, change: Callable[[Atom], Expr | None]) -> Expr:
    """The expression with atoms changed, each worked out once; None leaves one as it is."""
    changes = {atom: change(atom) for atom in e.atoms}

    def raised(atom: Atom, exponent: Rational) -> Expr | None:
        value = changes[atom]
        return None if value is None else power(value, exponent)

    return with_powers(e, raised)


def with_powers(e: Expr, change: Callable[[Atom, Rational], Expr | None]) -> Expr:
    """The expression with powers of atoms changed; None leaves one as it is."""
    parts = []
    for monomial, coefficient in e.terms.items():
        changes = [change(*factor) for factor in monomial]
        changed = [value for value in changes if value is not None]
        if changed:
            kept = (factor for factor, value in zip(monomial, changes, strict=True) if value is None)
            parts.append(product([gathered(coefficient, dict(kept)), *changed]))
        else:
            parts.append(Expr({monomial: coefficient}))
    return total(parts)


def expand(e: Expr, allowance: Allowance | None = None) -> Expr:
    """Everything multiplied out that stands in a product or under a natural power, at any depth.

    Without an allowance to share, there are `MAX_STEPS`.

    Raises:
        ExpressionError: the result is too large.
    """
    return _Expansion(allowance or Allowance(MAX_STEPS)).of(e)


class _Expansion:
    """The atoms that are known multiplied out, and the steps that may be taken."""

    __slots__ = ("allowance", "known")

    def __init__(self, allowance: Allowance) -> None:
        self.known: dict[Atom, Expr] = {}
        self.allowance = allowance

    def of(self, e: Expr) -> Expr:
        if all(isinstance(atom, Symbol) for atom in e.atoms):
            return e
        return total([self.of_term(monomial, coefficient) for monomial, coefficient in e.terms.items()])

    def of_term(self, monomial: Monomial, coefficient: Rational) -> Expr:
        self.allowance.spend(1 + len(monomial))
        sums = []
        others = [number(coefficient)]
        for atom, exponent in monomial:
            base = self.of_atom(atom)
            if len(base.terms) > 1 and exponent.denominator == 1 and exponent > 0:
                self.allowance.spend(int(exponent))
                sums.extend([base] * int(exponent))
            else:
                others.append(power(base, exponent))
        result = product(others)
        if len(result.terms) > 1 and sums:
            sums.append(result)
            result = ONE
        for factor in sums:
            result = self.times(result, factor)
        if any(_is_open(atom, exponent) for inner in result.terms for atom, exponent in inner):
            return self.of(result)
        return result

    def of_atom(self, atom: Atom) -> Expr:
        if atom not in self.known:
            self.known[atom] = rebuilt(atom, self.of)
        return self.known[atom]

    def times(self, left: Expr, right: Expr) -> Expr:
        weight = 2 + max(map(len, left.terms), default=0) + max(map(len, right.terms), default=0)
        self.allowance.spend(len(left.terms) * len(right.terms) * weight)
        if not (_is_settled(left) and _is_settled(right)):
            return total(
                multiplied(first, second, a * b)
                for first, a in left.terms.items()
                for second, b in right.terms.items()
            )
        terms: dict[Monomial, Rational] = {}
        for first, a in left.terms.items():
            for second, b in right.terms.items():
                exponents = dict(first)
                for atom, exponent in second:
                    exponents[atom] = exponents.get(atom, 0) + exponent
                factors = [factor for factor in exponents.items() if factor[1]]
                factors.sort(key=key_of_atom)
                monomial = tuple(factors)
                terms[monomial] = terms.get(monomial, 0) + a * b
        return total([Expr({monomial: bounded(c) for monomial, c in terms.items() if c})])


def _is_settled(e: Expr) -> bool:
    """Whether powers of its atoms never come to anything simpler."""
    return all(isinstance(atom, (Symbol, Pi)) or _is_smooth(atom) for atom in e.atoms)


def _is_smooth(atom: Atom) -> bool:
    return isinstance(atom, Applied) and atom.function != "abs"


def _is_open(atom: Atom, exponent: Rational) -> bool:
    return isinstance(atom, Group) and atom.plain and exponent.denominator == 1 and exponent > 0


Polynomial: TypeAlias = dict[tuple[int, ...], Expr]
"""Coefficients by the exponents of some symbols."""

_STEPS_TO_MULTIPLY = 10
"""Steps for the product of two coefficients, which is a sum of products itself."""


def coefficients(e: Expr, names: Sequence[str]) -> Polynomial | None:
    """The coefficients as a polynomial in some symbols, by the exponents of these; None if it is none.

    Only what holds the symbols is multiplied out.

    Raises:
        ExpressionError: the polynomial has too many terms.
    """
    places = {name: place for place, name in enumerate(names)}
    return _polynomial(e, places, Allowance(MAX_STEPS))


def _polynomial(e: Expr, places: Mapping[str, int], allowance: Allowance) -> Polynomial | None:
    names = places.keys()
    constant = (0,) * len(places)
    if e.names.isdisjoint(names):
        return {constant: e} if e.terms else {}
    gathered_terms: dict[tuple[int, ...], list[Expr]] = {}
    for monomial, coefficient in e.terms.items():
        powers = list(constant)
        kept: dict[Atom, Rational] = {}
        groups: list[Polynomial] = []
        for atom, exponent in monomial:
            if atom.names.isdisjoint(names):
                kept[atom] = exponent
                continue
            if exponent.denominator != 1 or exponent < 0:
                return None
            if isinstance(atom, Symbol):
                powers[places[atom.name]] += int(exponent)
                continue
            inner = _polynomial(atom.inner, places, allowance) if isinstance(atom, Group) else None
            if inner is None:
                return None
            allowance.spend(int(exponent))
            groups.extend([inner] * int(exponent))
        part = {tuple(powers): gathered(coefficient, kept)}
        for factor in groups:
            size = sum(len(value.terms) for value in part.values())
            allowance.spend(_STEPS_TO_MULTIPLY * size * len(factor))
            part = _multiplied(part, factor)
        for exponents, value in part.items():
            gathered_terms.setdefault(exponents, []).append(value)
    return _totals(gathered_terms)


def _multiplied(left: Polynomial, right: Polynomial) -> Polynomial:
    parts: dict[tuple[int, ...], list[Expr]] = {}
    for first, a in left.items():
        for second, b in right.items():
            parts.setdefault(tuple(map(sum, zip(first, second, strict=True))), []).append(a * b)
    return _totals(parts)


def _totals(parts: Mapping[tuple[int, ...], Sequence[Expr]]) -> Polynomial:
    sums = {exponents: total(values) for exponents, values in parts.items()}
    return {exponents: value for exponents, value in sums.items() if value.terms}
