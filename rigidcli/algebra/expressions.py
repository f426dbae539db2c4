"""Exact expressions: sums of products of powers, in one canonical form.

    x, m = symbol("x"), symbol("m")
    m * x / (2 * x)                    # m/2
    (x - m) ** 2 == (m - x) ** 2       # True

An expression is a dict from monomials to their rational coefficients, and a monomial is a tuple of
atoms with rational exponents. An atom is a symbol, pi, the integer under a root, a function with its
arguments, or a group: a sum in a product or under a power. `expansion.expand` multiplies these out.

The algebra is real: a step is taken only where both sides are equal for all real values for which
the first one has a value. So x*y/x is y, but sqrt(x**2) is not x.

Five functions keep products canonical, and call each other: `gathered` builds a number times powers of atoms.
It asks `_resolved` for each power, which is something simpler where a group is no plain sum, or a root is
whole; that calls `power`, which takes a sum apart by `factored`. `factored` divides a sum by what its terms
have in common with `divided`, term by term through `multiplied`, and `multiplied` ends in `gathered`. Each
round has fewer groups, or smaller ones, so that the calls end.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterable, Mapping
from fractions import Fraction
from functools import lru_cache
from numbers import Integral
from typing import Any, TypeAlias, cast

from rigidcli.algebra.atoms import Applied, Atom, Group, Monomial, Pi, Surd, Symbol, Terms, in_order, interned
from rigidcli.algebra.bounds import MOST_TERMS_OF_SUM, Rational, bounded, content, magnitude, root, surd
from rigidcli.algebra.trees import Style, to_tree
from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.expression import SIGNS, array, numbers, real
from rigidcli.language.text import latex, text

ExactNumber: TypeAlias = "Expr | int | Fraction"


def _operator(combine: Callable[[Expr, Expr], Expr]) -> Callable[[Expr, ExactNumber], Expr]:
    """A method for an operator; what is no exact number, such as an array, is left to do it by itself."""

    def method(self: Expr, other: ExactNumber) -> Expr:
        if not isinstance(other, Expr):
            if not isinstance(other, Integral | Fraction):
                return cast(Expr, NotImplemented)
            other = expr(other)
        return combine(self, other)

    return method


class Expr(Terms):
    """An immutable exact expression, and the type in which results are exact.

    H = rigidcli.hamilton(document)["hamiltonian"]
    str(H)                          # 'p_x**2/(2*m) + k*x**2/2', in the expression language
    H.evaluate(m=1, k=4, p_x=0, x=[0.0, 0.5])
    """

    style: Style = Style()
    """How it is written. Equal expressions may have different styles."""

    def __str__(self) -> str:
        return _text(self, self.style)

    __repr__ = __str__

    def _repr_latex_(self) -> str:
        return f"${latex(self.tree())}$"

    def tree(self, digits: int | None = None) -> tree.Node:
        """The tree in which it is written, exact for any number of digits."""
        return self.style.of(to_tree(self))

    def styled(self, style: Style) -> Expr:
        """The same expression, written in a style."""
        written = Expr(self.terms)
        written.style = style
        return written

    def __float__(self) -> float:
        """Raises ExpressionError where a symbol is in it, or the value is too large."""
        known = self.as_number
        try:
            return float(self.evaluate() if known is None else known)
        except OverflowError as error:
            raise ExpressionError("the value is too large") from error

    def evaluate(self, **values: Any) -> Any:
        """The value where the symbols have these values: a float, or an array as soon as one of these is.

        Raises ExpressionError where a symbol has no value, or numbers lead to no finite real value.
        """
        import numpy as np

        if missing := sorted(self.names - values.keys()):
            raise ExpressionError(f"no value for {', '.join(f'`{name}`' for name in missing[:5])}")
        is_float = not any(np.ndim(values[name]) for name in self.names)
        return real(to_tree(self), values) if is_float else array(to_tree(self), values)

    def to_sympy(self) -> Any:
        """The same as an expression of sympy, which must be installed. Its symbols are real or positive."""
        import sympy

        positive = {atom.name for atom in self.everywhere() if isinstance(atom, Symbol) and atom.positive}

        def called(function: str, values: list[Any]) -> Any:
            if not isinstance(function, tree.UnknownFunction):
                return getattr(sympy, "Abs" if function == "abs" else function)(*values)
            places = sympy.symbols(f"x:{len(values)}", cls=sympy.Dummy)
            slope = sympy.Function(function.base)(*places).diff(*(places[k] for k in function.by))
            return sympy.Subs(slope, places, values).doit()

        kind = numbers(
            number=lambda text, value: sympy.pi if text == "pi" else sympy.Rational(text),
            power=operator.pow,
            call=called,
            joined=lambda left, sign, right: SIGNS[sign](int(left) if left in (0.0, 1.0) else left, right),
        )
        return tree.fold(
            to_tree(self), lambda n: sympy.Symbol(n, real=True, positive=n in positive or None), kind
        )

    _sympy_ = to_sympy  # by this name sympy's own functions take it

    _factored: tuple[Rational, Monomial] | None = None

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Expr):
            return self.terms == other.terms
        return self.as_number == other if isinstance(other, Integral | Fraction) else NotImplemented

    __hash__ = Terms.__hash__

    def __bool__(self) -> bool:
        return bool(self.terms)

    def __neg__(self) -> Expr:
        return scaled(self, -1)

    __add__ = _operator(lambda a, b: total((a, b)))
    __radd__ = _operator(lambda a, b: total((b, a)))
    __sub__ = _operator(lambda a, b: total((a, -b)))
    __rsub__ = _operator(lambda a, b: total((b, -a)))
    __mul__ = _operator(lambda a, b: product((a, b)))
    __rmul__ = _operator(lambda a, b: product((b, a)))
    __truediv__ = _operator(lambda a, b: product((a, power(b, -1))))
    __rtruediv__ = _operator(lambda a, b: product((b, power(a, -1))))

    def __abs__(self) -> Expr:
        """|x|: numbers, even powers, and what is known to be positive come out of the bars.

        Bars around a denominator alone stand below: |1/w| is 1/|w|.
        """
        coefficient, monomial = factored(self)
        kept = [(atom, n) for atom, n in monomial if n.denominator == 1 and n % 2 and not atom.nonnegative]
        outside = number(magnitude(coefficient)) * product(
            power(atomic(atom), n) for atom, n in monomial if (atom, n) not in kept
        )
        side = -1 if all(n < 0 for _, n in kept) else 1
        inside = product(power(atomic(atom), side * n) for atom, n in kept)
        return outside * power(atomic(Applied("abs", (inside,))), side) if kept else outside

    def __pow__(self, exponent: ExactNumber) -> Expr:
        """The power; where the exponent is no rational number, `functions.apply` knows the laws."""
        exponent = expr(exponent)
        known = exponent.as_number
        if known is not None:
            return power(self, known)
        if self == 1:
            return ONE
        return atomic(Applied("pow", (self, exponent)))


@lru_cache
def _text(e: Expr, style: Style) -> str:
    """The text of an expression, kept: results of one system at many values of its parameters are alike.

    The `style` tells apart equal ones that are written in two ways.
    """
    return text(e.tree())


ZERO = Expr({})
ONE = Expr({(): 1})


def number(value: Rational) -> Expr:
    """A rational number."""
    return Expr({(): bounded(value)}) if value else ZERO


def atomic(atom: Atom) -> Expr:
    """The expression that is this atom."""
    return Expr({((interned(atom), 1),): 1})


@lru_cache(1000)
def symbol(name: str, positive: bool = False) -> Expr:
    """A symbol for any real number, or for any positive one."""
    return atomic(Symbol(name, positive))


PI = atomic(Pi())


def expr(value: Any) -> Expr:
    """The expression that is this exact number. Raises TypeError for others, such as floats."""
    if isinstance(value, Expr):
        return value
    if isinstance(value, Integral | Fraction):
        return number(value if isinstance(value, Fraction) else int(value))
    raise TypeError(f"{value!r} is no exact number")


def scaled(e: Expr, factor: Rational) -> Expr:
    """The expression times a number."""
    if factor == 1:
        return e
    if factor == 0:
        return ZERO
    return Expr({monomial: bounded(factor * coefficient) for monomial, coefficient in e.terms.items()})


def total(parts: Iterable[Expr]) -> Expr:
    """The sum, its like terms gathered."""
    terms: dict[Monomial, Rational] = {}
    for part in parts:
        for monomial, coefficient in part.terms.items():
            known = terms.get(monomial)
            terms[monomial] = coefficient if known is None else bounded(known + coefficient)
        if len(terms) > MOST_TERMS_OF_SUM:
            raise ExpressionError(f"the expression has more than {MOST_TERMS_OF_SUM:,} terms")
    return Expr({monomial: coefficient for monomial, coefficient in terms.items() if coefficient})


def product(factors: Iterable[Expr]) -> Expr:
    """The product, its like factors gathered; a number is distributed over a sum that stands alone."""
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
        size, monomial = factored(factor)
        coefficient = bounded(coefficient * size)
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
    if len(kept) == 1 and kept[0][1] == 1 and isinstance(kept[0][0], Group):
        rest = scaled(kept[0][0].inner, coefficient)
    else:
        rest = Expr({in_order(kept): coefficient})
    return product([rest, *changed]) if changed else rest


def multiplied(left: Monomial, right: Iterable[tuple[Atom, Rational]], coefficient: Rational) -> Expr:
    """The product of two monomials and a number."""
    exponents = dict(left)
    for atom, exponent in right:
        exponents[atom] = exponents.get(atom, 0) + exponent
    return gathered(bounded(coefficient), exponents)


def _resolved(atom: Atom, exponent: Rational) -> Expr | None:
    """A power of an atom in a simpler form; None where it is canonical already."""
    if isinstance(atom, Surd) and not 0 < exponent < 1:
        return _root_of_number(atom.value, exponent)
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
        # Over `size` the coefficients are coprime integers, and the leading one is positive.
        size, common = content(e.terms.values()) * (1 if e.ordered[0][1] > 0 else -1), _common(e)
        inner = divided(e, size, common)
        if common:
            # Groups that stand alone now have become sums, so that terms may have met.
            further, monomial = factored(inner)
            e._factored = factored(multiplied(monomial, common.items(), size * further))
        else:
            e._factored = size, ((interned(Group(inner, plain=True)), 1),)
    return e._factored


def _common(e: Expr) -> dict[Atom, Rational]:
    """The powers of atoms that all terms of a sum have in common; fractional ones where they are equal."""
    exponents: dict[Atom, list[Rational]] = {}
    for monomial in e.terms:
        for atom, exponent in monomial:
            exponents.setdefault(atom, []).append(exponent)
    common = {}
    for atom, powers in exponents.items():
        in_all = len(powers) == len(e.terms)
        if all(exponent.denominator == 1 for exponent in powers) or (in_all and len({*powers}) == 1):
            least = min(powers) if in_all else min(0, *powers)
            if least:
                common[atom] = least
    return common


def divided(e: Expr, size: Rational, common: Mapping[Atom, Rational]) -> Expr:
    """The terms of a sum over a number and powers of atoms."""
    inverse = 1 / Fraction(size)
    if not common:
        return scaled(e, inverse)
    below = [(atom, -exponent) for atom, exponent in common.items()]
    return total(multiplied(monomial, below, factor * inverse) for monomial, factor in e.terms.items())


def power(base: Expr, exponent: Rational) -> Expr:
    """A rational power."""
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


MOST_TERMS_OF_SQUARES = 30  # the most terms of a sum in which squares are looked for: pairs of them are tried


@lru_cache(4096)
def with_squares(e: Expr) -> Expr:
    """The sum with (a + b)^2 for a^2 + 2 a b + b^2 among its terms, and so for squares of longer sums."""
    if not 3 <= len(e.terms) <= MOST_TERMS_OF_SQUARES:
        return e
    alike: dict[frozenset[tuple[Atom, Rational]], list[Monomial]] = {}
    for monomial in e.terms:
        alike.setdefault(frozenset((a, n % 2) for a, n in monomial if n % 2), []).append(monomial)
    left, squares = dict(e.terms), list[Expr]()
    for odd, monomials in alike.items():
        monomials.sort(key=lambda monomial: [(atom.key, n) for atom, n in monomial])
        while len(monomials) > 1:
            first, *monomials = monomials
            c, chosen, used = left.get(first, 0), {first: Fraction(1)}, {first}
            # c (r_1 + x_2 r_2 + ...)^2 has the terms c x_i^2 r_i^2 and 2 c x_i x_j r_i r_j, each once.
            for other in monomials if c else ():
                x = Fraction(left.get(_mean(first, other), 0)) / (2 * c)
                terms = {_mean(other, m): 2 * c * x * y for m, y in chosen.items()} | {other: c * x**2}
                is_new = len(terms) > len(chosen) and used.isdisjoint(terms)
                if x and is_new and all(left.get(m) == size for m, size in terms.items()):
                    chosen[other] = x
                    used |= terms.keys()
            if len(chosen) > 1:
                roots = [(x, {a: (n - n % 2) / Fraction(2) for a, n in m}) for m, x in chosen.items()]
                squares.append(gathered(c, dict(odd)) * total(gathered(x, r) for x, r in roots) ** 2)
                for monomial in used:
                    del left[monomial]
    return total([Expr(left), *squares]) if squares else e


def _mean(left: Monomial, right: Monomial) -> Monomial:
    """The geometric mean of two monomials: a b of a^2 and b^2."""
    exponents = dict(left)
    for atom, n in right:
        exponents[atom] = exponents.get(atom, 0) + n
    return in_order((atom, Fraction(n) / 2) for atom, n in exponents.items() if n)


@lru_cache(4096)
def _rooted(base: Expr, exponent: Fraction) -> Expr:
    """A power that is not an integer: positive numbers and the roots of squares of sums are taken out."""
    if len(base.terms) > 1:
        base = with_squares(base)
    if len(base.terms) > 1:
        size = content(base.terms.values())
        inner = gathered(1, {_group(scaled(base, 1 / size)): exponent})
        return product([_root_of_number(size, exponent), inner])
    ((monomial, factor),) = base.terms.items()
    positive = {atom: part for atom, part in monomial if atom.positive}
    rest = tuple((atom, part) for atom, part in monomial if atom not in positive)
    if factor < 0 and not rest:
        raise ExpressionError(f"a negative number to the power {exponent} has no real value")
    outside = gathered(1, {atom: part * exponent for atom, part in positive.items()})
    inside = _root_of_monomial(1 if factor > 0 else -1, rest, exponent)
    return product([_root_of_number(magnitude(factor), exponent), outside, inside])


def _root_of_number(value: Rational, exponent: Rational) -> Expr:
    coefficient, surds = root(Fraction(value), Fraction(exponent))
    return gathered(coefficient, {interned(Surd(base)): part for base, part in surds.items()})


def _root_of_monomial(sign: int, monomial: Monomial, exponent: Fraction) -> Expr:
    """A power of a product that may be negative: (x**3*y**6)**q is (x*y**2)**(3*q), where it has a value.

    Of even powers the square stays inside, (x**4)**q is (x**2)**(2*q).
    """
    if not monomial:
        return ONE
    if len(monomial) == 1 and sign > 0:
        atom, inside = monomial[0]
        if isinstance(atom, Group) and inside.denominator == 1 and inside.numerator % 2 == 0:
            return power(abs(atom.inner), inside * exponent)
        if inside.denominator != 1 or inside.numerator % 2 or atom.nonnegative:
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
    return gathered(1, {_group(gathered(sign, dict(monomial))): exponent})


def _group(inner: Expr) -> Group[Expr]:
    plain = len(inner.terms) > 1 and inner.ordered[0][1] > 0 and not _common(inner)
    return interned(Group(inner, plain))
