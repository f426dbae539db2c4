"""Bounds of work: how large expressions and numbers may be, and how many steps one question may take."""

from __future__ import annotations

from fractions import Fraction
from typing import TypeAlias

from rigidcli.errors import ExpressionError

Rational: TypeAlias = int | Fraction

MOST_STEPS = 60_000
"""Steps for one question about one expression: a few tenths of a second."""

MOST_TERMS_OF_SUM = 10_000
"""Most terms of a sum: adding so many takes a hundredth of a second."""

MOST_NODES_OF_ATOM = 20_000
"""The most nodes of a function or a group: its text would fill some 20 pages."""

DEEPEST_NESTING = 120
"""Largest depth to which functions and groups may stand inside each other."""

MAX_BITS = 10_000
"""Most bits of a numerator or denominator, about 3,000 digits, so that each operation is quick."""

MAX_ROOT_BITS = 512
"""Most bits of a number under a root, about 150 digits, as it is searched for factors."""

MAX_DIVISOR = 2_000
"""The largest prime factor that is looked for under a root. Larger ones stay together."""


class Allowance:
    """A number of steps, each about the handling of one factor of one term; what needs more is refused."""

    __slots__ = ("left",)

    def __init__(self, steps: int = MOST_STEPS) -> None:
        self.left = steps

    def spend(self, steps: int) -> None:
        """Take off what is about to be done.

        Raises:
            ExpressionError: nothing is left.
        """
        self.left -= steps
        if self.left < 0:
            raise ExpressionError("the expression is too large to be multiplied out")


def bounded(value: Rational) -> Rational:
    """The number, checked for its size, and as an integer where it is whole, which is several times faster.

    Raises:
        ExpressionError: it is too large.
    """
    above, below = value.numerator, value.denominator
    if above.bit_length() > MAX_BITS or below.bit_length() > MAX_BITS:
        raise ExpressionError(f"a number has more than {MAX_BITS:,} bits")
    return above if below == 1 else value
