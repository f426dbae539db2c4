"""Powers of rational numbers, as rational numbers times roots of integers."""

from __future__ import annotations

import math
from collections.abc import Collection
from fractions import Fraction

from rigidcli.algebra.bounds import MAX_BITS, MAX_DIVISOR, MAX_ROOT_BITS, Rational, bounded
from rigidcli.errors import ExpressionError


def magnitude(value: Rational) -> Rational:
    """The number without its sign."""
    return value if value >= 0 else -value


def content(values: Collection[Rational]) -> Fraction:
    """The positive number by which some numbers are to be divided for integers without a common divisor."""
    return Fraction(
        math.gcd(*(value.numerator for value in values)),
        bounded(math.lcm(*(value.denominator for value in values))),
    )


def surd(base: Rational, exponent: int) -> Rational:
    """An integer power of a number that is not zero."""
    bits = max(base.numerator.bit_length(), base.denominator.bit_length())
    if abs(base) != 1 and (bits - 1) * abs(exponent) > MAX_BITS:
        raise ExpressionError(f"a number has more than {MAX_BITS:,} bits")
    if exponent >= 0:
        return base**exponent
    return Fraction(base.denominator, base.numerator) ** -exponent


def root(base: Fraction, exponent: Fraction) -> tuple[Rational, dict[int, Fraction]]:
    """A power of a positive number as a rational number times powers of integers, with exponents below 1."""
    if exponent.denominator == 1:
        return surd(base, int(exponent)), {}
    coefficient: Rational = 1
    surds: dict[int, Fraction] = {}
    for integer, sign in ((base.numerator, 1), (base.denominator, -1)):
        for prime, multiplicity in _factors(integer).items():
            full = sign * multiplicity * exponent
            whole = full.numerator // full.denominator
            coefficient = bounded(coefficient * surd(prime, whole))
            if full != whole:
                surds[prime] = full - whole
    return coefficient, surds


def _factors(integer: int) -> dict[int, int]:
    """Small prime factors, and what they leave, perhaps as a square, each with its multiplicity."""
    if integer.bit_length() > MAX_ROOT_BITS:
        raise ExpressionError(f"a number under a root has more than {MAX_ROOT_BITS} bits")
    factors: dict[int, int] = {}
    divisor = 2
    while divisor <= MAX_DIVISOR and divisor * divisor <= integer:
        while integer % divisor == 0:
            factors[divisor] = factors.get(divisor, 0) + 1
            integer //= divisor
        divisor += 1 if divisor == 2 else 2
    if integer > 1:
        whole = math.isqrt(integer)
        base, multiplicity = (whole, 2) if whole**2 == integer else (integer, 1)
        factors[base] = factors.get(base, 0) + multiplicity
    return factors
