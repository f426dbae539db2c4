"""Exact expressions at points of a finite field, where one that is identically zero is zero at every point.

An expression is a rational function of its generators, which are symbols, sines and cosines, exponentials,
roots, and other functions of what they are functions of. If it is not zero, it is zero at a random point of
a field of P elements with a chance of about its degree over P (J. T. Schwartz, J. ACM 27 (1980) 701).

Squares of the field stand for positive numbers: the root of a square that is a square itself is the positive
root, and roots of products are products of roots, as they are for numbers. What is not known to be positive
is a square at half of the points, by chance.
"""

from __future__ import annotations

import math
from collections.abc import Container, Mapping
from fractions import Fraction
from functools import lru_cache
from hashlib import blake2b
from typing import TypeAlias

from rigidcli.algebra.atoms import Applied, Atom, Group, Pi, Surd, Symbol, is_positive
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import PI, Expr, factored
from rigidcli.algebra.functions import apply
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.roots import Rational
from rigidcli.language.tree import (
    Call,
    Name,
    Negative,
    Node,
    Number,
    Power,
    Product,
    Reciprocal,
    Sum,
)

P = 912 * math.prod(n for n in range(2, 98) if all(n % d for d in range(2, n))) - 1
"""A prime for which (P - 1)/2 is one, too, so that odd roots are unique; numbers to 100 are squares."""

PARTS = 12
"""An angle and an exponent are taken in so many parts, whose multiples are halves, thirds and quarters."""

LONGEST = 12
"""Digits of a number in a tree whose height is told."""

_PI = next(iter(PI.terms))


class Point:
    """A point of the field: values of names, and of all that is worked out from them."""

    def __init__(self, seed: str, values: Mapping[str, int]) -> None:
        self.seed = seed
        self.values = dict(values)
        self.atoms: dict[Atom, int] = {}
        self.trees: dict[Node, int] = {}

    def element(self, *what: object) -> int:
        """A random element that belongs to something."""
        return int.from_bytes(blake2b(repr((self.seed, *what)).encode()).digest()) % P

    def square(self, *what: object) -> int:
        """The same for something positive."""
        return pow(self.element(*what), 2, P)

    def value(self, e: Expr) -> int:
        """The value of an expression. Raises ValueError where it divides by zero or a root is not there."""
        total = 0
        for monomial, coefficient in e.terms.items():
            below = coefficient.denominator
            part = coefficient.numerator if below == 1 else coefficient.numerator * pow(below, -1, P)
            for atom, exponent in monomial:
                known = self.of_atom(atom)
                part = part * (known if exponent == 1 else raised(known, exponent)) % P
            total += part
        return total % P

    def of_tree(self, node: Node, symbols: Mapping[str, Expr]) -> int:
        """The value of a tree in which names are these expressions.

        Raises ValueError where there is none, or where it depends on what is positive; and ExpressionError.
        """
        match node:
            case Sum(terms):
                return sum(self.of_tree(term, symbols) for term in terms) % P
            case Product(factors):
                found = 1
                for factor in factors:
                    found = found * self.of_tree(factor, symbols) % P
                return found
            case Negative(operand):
                return -self.of_tree(operand, symbols) % P
            case Reciprocal(operand):
                return pow(self.of_tree(operand, symbols), -1, P)
            case Power(base, Number(digits)) if digits.isdecimal():
                return pow(self.of_tree(base, symbols), int(digits), P)
        if node not in self.trees:
            e = from_tree(node, symbols)
            if depends_on_signs(e):
                raise ValueError("it depends on what is positive")
            self.trees[node] = self.value(e)
        return self.trees[node]

    def of_atom(self, atom: Atom) -> int:
        """The value of an atom."""
        if atom not in self.atoms:
            self.atoms[atom] = self._worked_out(atom)
        return self.atoms[atom]

    def _worked_out(self, atom: Atom) -> int:
        match atom:
            case Symbol(name=name):
                return self.values[name] if name in self.values else self.element(name)
            case Surd(value=known):
                return known % P
            case Group(inner=inner):
                return self.value(inner)
            case Applied(function="pow", arguments=(base, exponent)):
                return self._power(base, exponent)
            case Applied(function=function, arguments=(argument,)):
                return self._called(function, argument)
            case Applied(function=function, arguments=arguments):
                return self.element(function, *map(self.value, arguments))
            case _:
                return self.square("pi")

    def _called(self, function: str, argument: Expr) -> int:
        match function:
            case "sin" | "cos" | "tan":
                cosine, sine = self._angle(argument)
                return {"sin": sine, "cos": cosine}.get(function, sine * raised(cosine, -1) % P)
            case "exp":
                return self._exponential(argument)
            case "sinh" | "cosh" | "tanh":
                e = self._exponential(argument)
                odd, even = e - raised(e, -1), e + raised(e, -1)
                below = even if function == "tanh" else 2
                return (even if function == "cosh" else odd) * raised(below, -1) % P
            case "abs" | "sign":
                known = self.value(argument)
                sign = _sign(known)
                return sign * known % P if function == "abs" else sign % P
            case "log":
                coefficient, monomial = factored(argument)
                if coefficient > 0 and all(is_positive(atom) for atom, _ in monomial):
                    above, below = coefficient.as_integer_ratio()
                    powers = [(above, 1), (below, -1), *((self.of_atom(atom), n) for atom, n in monomial)]
                    return sum(self._logarithm(known, n) for known, n in powers) % P
        return self.element(function, self.value(argument))

    def _logarithm(self, known: int, times: Rational) -> int:
        return (
            0 if known == 1 else self.element("log", known) * times.numerator * raised(times.denominator, -1)
        )

    def _angle(self, e: Expr) -> tuple[int, int]:
        """The cosine and the sine of a sum of terms."""
        found = (1, 0)
        for monomial, coefficient in expand(e).terms.items():
            known = [apply(name, PI * coefficient) for name in ("cos", "sin")] if monomial == _PI else []
            if known and not any(isinstance(atom, Applied) for each in known for atom in each.atoms):
                unit, times = (self.value(known[0]), self.value(known[1])), 1
            else:
                base, times = self._parts(Expr({monomial: 1}), coefficient)
                half = self.element("angle", base)
                below = raised(1 + half * half, -1)
                unit = ((1 - half * half) * below % P, 2 * half * below % P)
            found = _turned(found, unit, times)
        return found

    def _exponential(self, e: Expr) -> int:
        found = 1
        for monomial, coefficient in expand(e).terms.items():
            base, times = self._parts(Expr({monomial: 1}), coefficient)
            found = found * pow(self.square("exp", base), times, P) % P
        return found

    def _power(self, base: Expr, exponent: Expr) -> int:
        below = self.value(base)
        found = 1
        for monomial, coefficient in expand(exponent).terms.items():
            if monomial:
                part, times = self._parts(Expr({monomial: 1}), coefficient)
                found = found * pow(self.square("pow", below, part), times, P) % P
            else:
                found = found * raised(below, coefficient) % P
        return found

    def _parts(self, e: Expr, coefficient: Rational) -> tuple[int, int]:
        """A term as a part of it, so many times; of two that differ in sign, as the same part."""
        times = Fraction(coefficient) * PARTS
        known = self.value(e)
        if times.denominator != 1:
            known, times = (
                known * coefficient.numerator * raised(coefficient.denominator, -1) % P,
                Fraction(1),
            )
        return (known, int(times)) if known <= P // 2 else (P - known, -int(times))


Height: TypeAlias = tuple[float, float]
"""Bits of the sums of all coefficients, without their signs, above and below the line of a fraction."""

_PERIODIC = frozenset({"sin", "cos", "tan", "sinh", "cosh", "tanh"})
"""Functions that are made of two exponentials."""


def height(node: Node, domains: Container[str]) -> Height:
    """A bound of the coefficients of a tree as a fraction of powers of its names and of exponentials.

    It is infinite where there may be other relations than those of powers. What is not zero, and has less
    bits above the line than P, is not zero in the field, whoever has chosen its numbers.
    """
    match node:
        case Name(name) if name in domains:
            return 0, 0
        case Number(digits, value) if len(digits) <= LONGEST and value < 10**LONGEST and "e" not in digits:
            spelled = Fraction(digits)
            return spelled.numerator.bit_length(), spelled.denominator.bit_length()
        case Negative(operand):
            return height(operand, domains)
        case Reciprocal(operand):
            above, below = height(operand, domains)
            return below, above
        case Product(factors):
            parts = [height(factor, domains) for factor in factors]
            return sum(above for above, _ in parts), sum(below for _, below in parts)
        case Sum(terms):
            parts = [height(term, domains) for term in terms]
            all_below = sum(below for _, below in parts)
            most = max((above - below for above, below in parts), default=0)
            return all_below + most + len(parts).bit_length(), all_below
        case Power(base, Number(digits)) if digits.isdecimal() and len(digits) <= LONGEST:
            above, below = height(base, domains)
            return above * int(digits), below * int(digits)
        case Call(function, (argument,)) if function in _PERIODIC or function == "exp":
            return (1, 1) if max(height(argument, domains)) < P.bit_length() / 3 else (math.inf, math.inf)
    return math.inf, math.inf


def raised(known: int, exponent: Rational) -> int:
    """A power of an element. Raises ValueError where there is none."""
    below = exponent.denominator
    while below % 2 == 0:
        if _sign(known) < 0:
            raise ValueError("no root")
        known, below = pow(known, (P + 1) // 4, P), below // 2
    if below > 1:
        known = pow(known, pow(below, -1, P - 1), P)
    return pow(known, exponent.numerator, P)


def _sign(known: int) -> int:
    """1 for a square, -1 for what is none."""
    found = pow(known, (P - 1) // 2, P)
    return found if found < 2 else -1


def _turned(start: tuple[int, int], unit: tuple[int, int], times: int) -> tuple[int, int]:
    """A direction turned by an angle so many times."""
    x, y = unit if times > 0 else (unit[0], -unit[1])
    a, b = start
    times = abs(times)
    while times:
        if times % 2:
            a, b = (a * x - b * y) % P, (a * y + b * x) % P
        x, y = (x * x - y * y) % P, 2 * x * y % P
        times //= 2
    return a, b


@lru_cache(20_000)
def depends_on_signs(e: Expr) -> bool:
    """Whether something in an expression depends on what is positive."""
    return any(
        (exponent.denominator % 2 == 0 and not _has_root(atom))
        or (isinstance(atom, Group) and depends_on_signs(atom.inner))
        or (isinstance(atom, Applied) and _signs_within(atom))
        for monomial in e.terms
        for atom, exponent in monomial
    )


def _has_root(atom: Atom) -> bool:
    return isinstance(atom, Surd | Pi) or (isinstance(atom, Symbol) and atom.positive)


def _signs_within(atom: Applied[Expr]) -> bool:
    return atom.function in ("abs", "sign") or any(map(depends_on_signs, atom.arguments))


def reduced(rows: list[list[int]]) -> dict[int, list[int]]:
    """Rows of elements brought to the reduced echelon form, by the columns of their pivots."""
    found: dict[int, list[int]] = {}
    for row in rows:
        for column, pivot in found.items():
            row = [(a - row[column] * b) % P for a, b in zip(row, pivot, strict=True)]
        place = next((column for column, entry in enumerate(row) if entry), None)
        if place is None:
            continue
        inverse = raised(row[place], -1)
        row = [entry * inverse % P for entry in row]
        for column, pivot in found.items():
            found[column] = [(a - pivot[place] * b) % P for a, b in zip(pivot, row, strict=True)]
        found[place] = row
    return found
