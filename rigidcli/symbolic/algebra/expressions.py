"""Exact expressions: sums of products of powers, in one canonical form.

    x, m = symbol("x"), symbol("m")
    m * x / (2 * x)                    # m/2
    (x - m) ** 2 == (m - x) ** 2       # True

An expression is a dict from monomials to their rational coefficients, and a monomial is a tuple of
atoms with rational exponents. An atom is a symbol, pi, the integer under a root, a function with
its arguments, or a group: a sum that stands in a product or under a power. A product of sums is
kept as it is, `calculus.expand` multiplies it out.

The algebra is real: a step is taken only where both sides are equal for all real values for which
the first one has a value. So x*y/x is y, but sqrt(x**2) is not x.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from typing import TypeAlias

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.atoms import (
    Applied,
    Atom,
    Group,
    Monomial,
    Pi,
    Surd,
    Symbol,
    interned,
    is_nonnegative,
    is_positive,
    key_of_atom,
)
from rigidcli.symbolic.algebra.roots import Rational, bounded, magnitude, root, surd

MAX_TERMS = 10_000
"""Of a sum."""

Number: TypeAlias = "Expr | int | Fraction"


class Expr:
    """An immutable expression."""

    __slots__ = ("_depth", "_factored", "_hash", "_key", "_names", "_ordered", "terms")

    def __init__(self, terms: Mapping[Monomial, Rational]) -> None:
        """`terms` is in canonical form already; use `number`, `symbol` and the operators to make one."""
        self.terms = terms
        self._depth: int | None = None
        self._factored: tuple[Rational, Monomial] | None = None
        self._hash: int | None = None
        self._key: str | None = None
        self._names: frozenset[str] | None = None
        self._ordered: tuple[tuple[Monomial, Rational], ...] | None = None

    @property
    def is_zero(self) -> bool:
        """Whether nothing is left; `simplification.is_zero` looks deeper."""
        return not self.terms

    @property
    def as_number(self) -> Rational | None:
        """The rational number that it is."""
        if not self.terms:
            return 0
        return self.terms.get(()) if len(self.terms) == 1 else None

    @property
    def names(self) -> frozenset[str]:
        """The symbols in it, at any depth."""
        if self._names is None:
            self._names = frozenset().union(*(atom.names for atom in self.atoms))
        return self._names

    @property
    def atoms(self) -> list[Atom]:
        """The atoms of its terms, each once."""
        return list(dict.fromkeys(atom for monomial in self.terms for atom, _ in monomial))

    @property
    def depth(self) -> int:
        """How deep its atoms are nested."""
        if self._depth is None:
            self._depth = max((atom.depth for atom in self.atoms), default=0)
        return self._depth

    @property
    def ordered(self) -> tuple[tuple[Monomial, Rational], ...]:
        """The terms in canonical order."""
        if self._ordered is None:
            self._ordered = tuple(sorted(self.terms.items(), key=_place))
        return self._ordered

    @property
    def key(self) -> str:
        """A text that equal expressions share."""
        if self._key is None:
            self._key = ",".join(
                "*".join([str(coefficient), *(f"{atom.key}^{exponent}" for atom, exponent in monomial)])
                for monomial, coefficient in self.ordered
            )
        return self._key

    def __repr__(self) -> str:
        return f"Expr({self.key})"

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Expr):
            return self.terms == other.terms
        return self.as_number == other if isinstance(other, (int, Fraction)) else NotImplemented

    def __hash__(self) -> int:
        if self._hash is None:
            self._hash = hash(frozenset(self.terms.items()))
        return self._hash

    def __neg__(self) -> Expr:
        return scaled(self, -1)

    def __add__(self, other: Number) -> Expr:
        return total((self, _expr(other)))

    def __radd__(self, other: Number) -> Expr:
        return total((_expr(other), self))

    def __sub__(self, other: Number) -> Expr:
        return total((self, -_expr(other)))

    def __rsub__(self, other: Number) -> Expr:
        return total((_expr(other), -self))

    def __mul__(self, other: Number) -> Expr:
        return product((self, _expr(other)))

    def __rmul__(self, other: Number) -> Expr:
        return product((_expr(other), self))

    def __truediv__(self, other: Number) -> Expr:
        return product((self, power(_expr(other), -1)))

    def __rtruediv__(self, other: Number) -> Expr:
        return product((_expr(other), power(self, -1)))

    def __pow__(self, exponent: Number) -> Expr:
        """The power; where the exponent is no rational number, `elementary.apply` knows the laws."""
        exponent = _expr(exponent)
        known = exponent.as_number
        if known is not None:
            return power(self, known)
        if self == 1:
            return ONE
        return atomic(Applied("pow", (self, exponent)))


def _place(term: tuple[Monomial, Rational]) -> tuple[object, ...]:
    """Where a term stands in a sum: kinetic energy first, functions last, otherwise by falling degree."""
    rates: Rational = 0
    degree: Rational = 0
    functions = 0
    for atom, exponent in term[0]:
        if isinstance(atom, Symbol):
            rates += exponent if atom.is_rate else 0
            degree += max(exponent, 0)
        elif isinstance(atom, Applied):
            functions += 1
        elif isinstance(atom, Group):
            rates += 2 if atom.has_rates and exponent > 0 else 0
            degree += max(exponent, 0)
    return -rates, functions, -degree, [(atom.key, -exponent) for atom, exponent in term[0]]


ZERO = Expr({})
ONE = Expr({(): 1})


def number(value: Rational) -> Expr:
    """A rational number."""
    return Expr({(): bounded(value)}) if value else ZERO


def atomic(atom: Atom) -> Expr:
    """The expression that is this atom."""
    return Expr({((interned(atom), 1),): 1})


@lru_cache(1000)
def symbol(name: str) -> Expr:
    """A symbol for any real number."""
    return atomic(Symbol(name))


PI = atomic(Pi())


def _expr(value: Number) -> Expr:
    return value if isinstance(value, Expr) else number(value)


def scaled(e: Expr, factor: Rational) -> Expr:
    """The expression times a number."""
    if factor == 1:
        return e
    if factor == 0:
        return ZERO
    return Expr({monomial: bounded(factor * coefficient) for monomial, coefficient in e.terms.items()})


def total(parts: Iterable[Expr]) -> Expr:
    """The sum, its like terms gathered.

    Raises:
        ExpressionError: it is too large.
    """
    terms: dict[Monomial, Rational] = {}
    for part in parts:
        for monomial, coefficient in part.terms.items():
            known = terms.get(monomial)
            terms[monomial] = coefficient if known is None else bounded(known + coefficient)
        if len(terms) > MAX_TERMS:
            raise ExpressionError(f"the expression has more than {MAX_TERMS:,} terms")
    return Expr({monomial: coefficient for monomial, coefficient in terms.items() if coefficient})


def product(factors: Iterable[Expr]) -> Expr:
    """The product, its like factors gathered; a number is distributed over a sum that stands alone.

    Raises:
        ExpressionError: it is too large.
    """
    coefficient: Rational = 1
    others = []
    for factor in factors:
        known = factor.as_number
        if known is None:
            others.append(factor)
        else:
            coefficient = bounded(coefficient * known)
    if coefficient == 0:
        return ZERO
    if len(others) == 1:
        return scaled(others[0], coefficient)
    exponents: dict[Atom, Rational] = {}
    for factor in others:
        content, monomial = factored(factor)
        coefficient = bounded(coefficient * content)
        for atom, exponent in monomial:
            exponents[atom] = exponents.get(atom, 0) + exponent
    return gathered(coefficient, exponents)


def gathered(coefficient: Rational, exponents: Mapping[Atom, Rational]) -> Expr:
    """A number times powers of atoms, of which some may come to something simpler."""
    if coefficient == 0:
        return ZERO
    kept = []
    changed = []
    for atom, exponent in exponents.items():
        if exponent == 0:
            continue
        value = None if isinstance(atom, (Symbol, Pi)) else _resolved(atom, exponent)
        if value is None:
            kept.append((atom, exponent))
        else:
            changed.append(value)
    kept.sort(key=key_of_atom)
    if len(kept) == 1 and kept[0][1] == 1 and isinstance(kept[0][0], Group):
        rest = scaled(kept[0][0].inner, coefficient)
    else:
        rest = Expr({tuple(kept): coefficient})
    return product([rest, *changed]) if changed else rest


def _resolved(atom: Atom, exponent: Rational) -> Expr | None:
    """A power of an atom where it is not canonical."""
    if isinstance(atom, Surd) and not 0 < exponent < 1:
        coefficient, surds = root(Fraction(atom.value), Fraction(exponent))
        return gathered(coefficient, {interned(Surd(value)): part for value, part in surds.items()})
    if isinstance(atom, Group) and not atom.plain and exponent.denominator == 1:
        return power(atom.inner, exponent)
    even = exponent.denominator == 1 and exponent.numerator % 2 == 0
    if even and isinstance(atom, Applied) and atom.function == "abs":
        return power(atom.arguments[0], exponent)
    return None


def factored(e: Expr) -> tuple[Rational, Monomial]:
    """A number and a monomial whose product is `e`: a sum becomes a group."""
    if len(e.terms) == 1:
        ((monomial, coefficient),) = e.terms.items()
        return coefficient, monomial
    if not e.terms:
        return 0, ()
    if e._factored is None:
        content, common = _content(e), _common(e)
        inner = divided(e, content, common)
        if common:
            # Groups that stand alone now have become sums, so that terms may have met.
            further, monomial = factored(inner)
            exponents = dict(common)
            for atom, exponent in monomial:
                exponents[atom] = exponents.get(atom, 0) + exponent
            e._factored = factored(gathered(bounded(content * further), exponents))
        else:
            e._factored = content, ((interned(Group(inner, plain=True)), 1),)
    return e._factored


def _content(e: Expr) -> Rational:
    """The rational number by which a sum is to be divided for coprime integers, the leading one positive."""
    coefficients = list(e.terms.values())
    size = Fraction(
        math.gcd(*(coefficient.numerator for coefficient in coefficients)),
        bounded(math.lcm(*(coefficient.denominator for coefficient in coefficients))),
    )
    return size if e.ordered[0][1] > 0 else -size


def _common(e: Expr) -> dict[Atom, Rational]:
    """The powers of atoms that all terms of a sum have in common, of those with integer exponents only."""
    exponents: dict[Atom, list[Rational]] = {}
    for monomial in e.terms:
        for atom, exponent in monomial:
            exponents.setdefault(atom, []).append(exponent)
    common = {}
    for atom, found in exponents.items():
        if all(exponent.denominator == 1 for exponent in found):
            least = min(found) if len(found) == len(e.terms) else min(0, *found)
            if least:
                common[atom] = least
    return common


def divided(e: Expr, content: Rational, common: Mapping[Atom, Rational]) -> Expr:
    """The terms of a sum over a number and powers of atoms."""
    inverse = 1 / Fraction(content)
    if not common:
        return scaled(e, inverse)
    parts = []
    for monomial, coefficient in e.terms.items():
        exponents = dict(monomial)
        for atom, exponent in common.items():
            exponents[atom] = exponents.get(atom, 0) - exponent
        parts.append(gathered(coefficient * inverse, exponents))
    return total(parts)


def power(base: Expr, exponent: Rational) -> Expr:
    """A rational power.

    Raises:
        ExpressionError: it has no real value, or is too large.
    """
    if exponent == 0:
        return ONE
    if exponent == 1:
        return base
    if not base.terms:
        if exponent < 0:
            raise ExpressionError("division by zero")
        return ZERO
    bounded(exponent)
    if exponent.denominator != 1:
        return _rooted(base, Fraction(exponent))
    coefficient, monomial = factored(base)
    if coefficient == 0:
        return power(ZERO, exponent)
    raised = {atom: part * exponent for atom, part in monomial}
    return gathered(surd(coefficient, int(exponent)), raised)


def _rooted(base: Expr, exponent: Fraction) -> Expr:
    """A power that is not an integer: positive numbers are taken out, nothing else is."""
    if len(base.terms) > 1:
        size = magnitude(_content(base))
        coefficient, surds = root(Fraction(size), exponent)
        inner = scaled(base, 1 / Fraction(size))
        powers: dict[Atom, Rational] = {interned(Surd(value)): part for value, part in surds.items()}
        return gathered(coefficient, powers | {_group(inner): exponent})
    ((monomial, factor),) = base.terms.items()
    positive = {atom: part for atom, part in monomial if is_positive(atom)}
    rest = tuple((atom, part) for atom, part in monomial if atom not in positive)
    if factor < 0 and not rest:
        raise ExpressionError(f"a negative number to the power {exponent} has no real value")
    coefficient, surds = root(abs(Fraction(factor)), exponent)
    outside = gathered(coefficient, {atom: part * exponent for atom, part in positive.items()})
    numbers = gathered(1, {interned(Surd(value)): part for value, part in surds.items()})
    sign = 1 if factor > 0 else -1
    return product([outside, numbers, _root_of_monomial(sign, rest, exponent)])


def _root_of_monomial(sign: int, monomial: Monomial, exponent: Fraction) -> Expr:
    """A power of a product that may be negative: (x**3*y**6)**q is (x*y**2)**(3*q), where it has a value.

    Of even powers the square stays inside, (x**4)**q is (x**2)**(2*q).
    """
    if not monomial:
        return ONE
    if len(monomial) == 1 and sign > 0:
        atom, inside = monomial[0]
        if inside.denominator != 1 or inside.numerator % 2 or is_nonnegative(atom):
            return gathered(1, {atom: inside * exponent})
    if all(inside.denominator == 1 for _, inside in monomial):
        common = math.gcd(*(inside.numerator for _, inside in monomial))
        if common % 2 == 0:
            common = common // 2 if sign > 0 else 1
        if all(inside < 0 for _, inside in monomial):
            common = -common
        if common != 1:
            base = gathered(sign, {atom: inside / Fraction(common) for atom, inside in monomial})
            return power(base, exponent * common)
    return gathered(1, {_group(Expr({monomial: sign})): exponent})


def _group(inner: Expr) -> Group:
    plain = len(inner.terms) > 1 and inner.ordered[0][1] > 0 and not _common(inner)
    return interned(Group(inner, plain))
