"""Exact expressions as fractions of polynomials, in lowest terms, with their factors and square roots.

The variables of the polynomials are the atoms of an expression, or a root of one where it has fractional
exponents. Square roots r of n obey r^2 = n and sines s^2 = 1 - c^2, so that equal fractions have equal forms.

python-flint does the work on polynomials. It is loaded here, 0.04 s, and only where the normal form of
`expressions` leaves a doubt.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Sequence
from fractions import Fraction
from typing import Any, NamedTuple

from rigidcli.algebra.atoms import Applied, Atom, Group, Surd, interned
from rigidcli.algebra.bounds import Allowance, Rational, magnitude
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, Expr, atomic, divided, factored, gathered, product, total
from rigidcli.errors import ExpressionError

MOST_TERMS = 250  # largest number of terms of a polynomial that is divided or factored
MOST_VARIABLES = 12  # largest number of variables of such a polynomial
HIGHEST_POWER_IN_DIVISION = 30  # largest exponent of a variable in such a polynomial
_SQUARED = {"sin": ("cos", -1), "sinh": ("cosh", 1)}  # sin^2 = 1 - cos^2, sinh^2 = -1 + cosh^2 are put in


class _Ring(NamedTuple):
    """Variables, each a power of an atom, and the squares that some of them have (polynomials)."""

    context: Any
    variables: dict[Atom, tuple[int, Fraction]]
    squares: dict[int, Any]

    def polynomial(self, e: Expr) -> Any:
        """A multiplied-out expression without negative exponents as a reduced polynomial."""
        from flint import fmpq

        terms = {}
        for monomial, coefficient in e.terms.items():
            exponents = [0] * self.context.nvars()
            for atom, exponent in monomial:
                place, step = self.variables[atom]
                exponents[place] = int(exponent / step)
            _require(min(exponents) >= 0 and max(exponents) <= HIGHEST_POWER_IN_DIVISION)
            terms[tuple(exponents)] = fmpq(coefficient.numerator, coefficient.denominator)
        return self.reduced(self.context.from_dict(terms))

    def reduced(self, p: Any) -> Any:
        """The remainder of a polynomial when the squares are put in, from the outermost root inwards."""
        for place, square in sorted(self.squares.items()):
            p = divmod(p, self.context.gen(place) ** 2 - square)[1]
        _require(len(p) <= MOST_TERMS)
        return p

    def conjugated(self, above: Any, below: Any) -> tuple[Any, Any]:
        """A fraction (polynomials) with no root in the denominator, as far as square roots go."""
        for atom, (place, _) in self.variables.items():
            if place not in self.squares or isinstance(atom, Applied):
                continue
            root = self.context.gen(place)
            even = below.subs({str(root): 0})
            odd = below - even
            conjugate = even - odd
            denominator = self.reduced(below * conjugate)
            if odd != 0 and denominator != 0:
                above, below = self.reduced(above * conjugate), denominator
        return above, below

    def expr(self, p: Any) -> Expr:
        """A polynomial as an expression."""
        atoms = list(self.variables.items())
        return total(
            gathered(
                _rational(coefficient),
                {atom: step * int(powers[place]) for atom, (place, step) in atoms if powers[place]},
            )
            for powers, coefficient in p.to_dict().items()
        )


def _rational(coefficient: Any) -> Rational:
    return Fraction(int(coefficient.p), int(coefficient.q))


def _require(fits: bool) -> None:
    if not fits:
        raise ExpressionError("the expression is too large to be divided or factored")


def _ring(parts: Iterable[Expr]) -> _Ring:
    """The variables that expressions have, the outermost roots first."""
    from flint import Ordering, fmpq_mpoly_ctx

    steps: dict[Atom, int] = {}
    pending = list(parts)
    radicands: dict[Atom, Expr] = {}
    while pending:
        for monomial in pending.pop().terms:
            for atom, exponent in monomial:
                steps[atom] = math.lcm(steps.get(atom, 1), exponent.denominator)
                if exponent.denominator == 1 or atom in radicands or isinstance(atom, Surd):
                    continue
                if isinstance(atom, Group):
                    radicands[atom] = expand(atom.inner)
                    pending.append(radicands[atom])
    for atom in list(steps):
        if isinstance(atom, Applied) and atom.function in _SQUARED:
            steps.setdefault(interned(Applied(_SQUARED[atom.function][0], atom.arguments)), 1)
    _require(len(steps) <= MOST_VARIABLES)

    def place_of(atom: Atom) -> tuple[bool, int, bool, str]:
        # A root or a sine stands before the variables that its square is made of.
        has_square = isinstance(atom, Surd) or (isinstance(atom, Applied) and atom.function in _SQUARED)
        return atom not in radicands, -atom.depth, not has_square, atom.key

    order = sorted(steps, key=place_of)
    names = [f"x{place}" for place in range(len(order))]
    context = fmpq_mpoly_ctx.get(names or ["x0"], Ordering.lex)
    variables = {atom: (place, Fraction(1, steps[atom])) for place, atom in enumerate(order)}
    ring = _Ring(context, variables, {})
    for atom, (place, step) in reversed(variables.items()):
        square = _square(atom, step, radicands)
        if square is not None and all(n >= 0 for monomial in square.terms for _, n in monomial):
            ring.squares[place] = ring.polynomial(square)
    return ring


def _square(atom: Atom, step: Fraction, radicands: dict[Atom, Expr]) -> Expr | None:
    """The square of a variable, in terms of later variables; None where it has none."""
    if isinstance(atom, Applied) and atom.function in _SQUARED and step == 1:
        other, sign = _SQUARED[atom.function]
        return sign * Expr({((interned(Applied(other, atom.arguments)), 2),): 1}) - sign
    if step == Fraction(1, 2) and isinstance(atom, Surd):
        return atom.value * ONE
    return radicands.get(atom) if step == Fraction(1, 2) else None


class _Quotient(NamedTuple):
    """An expression as powers of what stands `outside`, times a fraction of two polynomials."""

    ring: _Ring
    outside: list[tuple[Expr, int]]
    above: Any
    below: Any


def _quotient(e: Expr, allowance: Allowance | None) -> _Quotient:
    """The fraction in lowest terms that an expression is."""
    allowance = allowance or Allowance()
    coefficient, monomial = factored(expand(e, allowance))
    above, below, outside = list[Expr](), list[Expr](), [(ONE * coefficient, 1)]
    for atom, exponent in monomial:
        if exponent.denominator == 1 and isinstance(atom, Group):
            (above if exponent > 0 else below).append(gathered(1, {atom: magnitude(exponent)}))
        elif exponent.denominator != 1 and isinstance(atom, Group | Surd):
            above.append(gathered(1, {atom: exponent - math.floor(exponent)}))
            below.append(gathered(1, {atom: -math.floor(exponent)}))
        elif exponent.denominator == 1:
            outside.append((atomic(atom), int(exponent)))
        else:
            outside.append((gathered(1, {atom: exponent}), 1))
    numerator, denominator = (expand(product(factors), allowance) for factors in (above, below))
    lowest = _lowest((numerator, denominator))
    numerator, denominator = (divided(part, 1, lowest) for part in (numerator, denominator))
    ring = _ring((numerator, denominator))
    over, under = ring.polynomial(numerator), ring.polynomial(denominator)
    if under == 0:
        raise ExpressionError("division by zero")
    over, under = ring.conjugated(over, under)
    common = over.gcd(under)
    return _Quotient(ring, outside, divmod(over, common)[0], divmod(under, common)[0])


def _lowest(parts: Sequence[Expr]) -> dict[Atom, Rational]:
    """The lowest negative exponent of each atom, by which both parts of a fraction are multiplied."""
    lowest: dict[Atom, Rational] = {}
    for part in parts:
        for monomial in part.terms:
            for atom, exponent in monomial:
                if exponent < 0:
                    lowest[atom] = min(lowest.get(atom, 0), Fraction(math.floor(exponent)))
    return lowest


def lowest_terms(e: Expr) -> tuple[Expr, Expr]:
    """The fraction in lowest terms that an expression is: multiplied out above and below, and in factors.

    No square root is below.
    """
    quotient = _quotient(e, None)
    outside = product([factor**power for factor, power in quotient.outside])
    multiplied_out = outside * quotient.ring.expr(quotient.above) / quotient.ring.expr(quotient.below)
    return multiplied_out, product([factor**power for factor, power in _factors(quotient)])


def vanishes(e: Expr) -> bool:
    """Whether the numerator of an expression is the zero polynomial in its atoms."""
    quotient = _quotient(e, None)
    return quotient.outside[0][0].is_zero or bool(quotient.above == 0)


def independent_rows(parts: Sequence[Expr], moving: Collection[str]) -> list[list[Expr]]:
    """The linear equations for c under which sum_k c_k parts_k vanishes for all values of `moving` names.

    The c may depend on the other names. Each row has the coefficients of one product of powers of the atoms
    that hold moving names; these products are independent once squares of roots and sines are put in.
    """
    numerators = list(map(expand, parts))
    while lowest := _lowest(numerators):
        numerators = [expand(divided(part, 1, lowest)) for part in numerators]
    ring = _ring(numerators)
    still = {place for atom, (place, _) in ring.variables.items() if atom.names.isdisjoint(moving)}
    rows: dict[tuple[int, ...], list[dict[tuple[int, ...], Any]]] = {}
    for k, part in enumerate(numerators):
        for powers, coefficient in ring.polynomial(part).to_dict().items():
            outside = tuple(0 if place in still else n for place, n in enumerate(powers))
            inside = tuple(n if place in still else 0 for place, n in enumerate(powers))
            rows.setdefault(outside, [{} for _ in parts])[k][inside] = coefficient
    return [[ring.expr(ring.context.from_dict(entry)) for entry in row] for row in rows.values()]


def factors(e: Expr, allowance: Allowance | None = None) -> list[tuple[Expr, int]]:
    """Factors that cannot be factored further, each with its exponent, negative below; numbers first."""
    return _factors(_quotient(e, allowance))


def _factors(quotient: _Quotient) -> list[tuple[Expr, int]]:
    parts = list(quotient.outside)
    for polynomial, sign in ((quotient.above, 1), (quotient.below, -1)):
        content, irreducible = polynomial.factor()
        size, powers = _rational(content), [(quotient.ring.expr(factor), int(n)) for factor, n in irreducible]
        # The first term of each is positive, so that the laws of sines find the same form for it everywhere.
        signs = [1 if factor.ordered[0][1] > 0 else -1 for factor, _ in powers]
        size *= math.prod(own**n for own, (_, n) in zip(signs, powers, strict=True))
        parts.append((size**sign * ONE, 1))
        parts += [(own * factor, sign * n) for own, (factor, n) in zip(signs, powers, strict=True)]
    return parts
