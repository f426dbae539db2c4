"""The arithmetic of formulas: floats, or exact expressions."""

from __future__ import annotations

import math
from collections.abc import Callable
from decimal import Decimal
from typing import Any, NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.errors import ValueProblem

EPS = 2.0**-52  # The distance of 1 and the next larger float.
WHOLE = 1e6  # Whole numbers below this are typed digit by digit, larger ones with a power of ten.
# A float, or an exact number (an `Expr` of the algebra) in its place: the `Arithmetic` says which.
Scalar: TypeAlias = float
Array: TypeAlias = NDArray[Any]  # An array of float64, or of exact numbers (dtype object).

Floats: TypeAlias = NDArray[np.float64]
Mask: TypeAlias = NDArray[np.bool_]


class Arithmetic(NamedTuple):
    """The elementary functions of one kind of number.

    `value` gives the number as a float, and `sign` gives -1, 0 or 1; both give None where that depends
    on symbols without a value. `size` gives a float to compare by where any consistent choice will do
    (a pivot, an order to print in): the number itself, or its value at a fixed sample of its
    symbols. `tidy` brings the entries of an array into their shortest form. `symbol` makes an unknown
    of a name, and of whether it is positive; floats have none.
    """

    exact: bool
    pi: Scalar
    sqrt: Callable[[Scalar], Scalar]
    sin: Callable[[Scalar], Scalar]
    cos: Callable[[Scalar], Scalar]
    atan2: Callable[[Scalar, Scalar], Scalar]
    hypot: Callable[..., Scalar]
    value: Callable[[Scalar], float | None]
    sign: Callable[[Scalar], int | None]
    size: Callable[[Scalar], float]
    tidy: Callable[[Array], Array]
    symbol: Callable[[str, bool], Scalar]

    def array(self, values: object) -> Array:
        """`values` (numbers, nested to any depth) as an array of this kind of number."""
        return np.array(values, dtype=object if self.exact else np.float64)

    def tidied(self, number: Any) -> Scalar:
        """One number in its shortest form."""
        short: Scalar = self.tidy(self.array([number]))[0] if self.exact else number
        return short


def half_unit(number: float) -> float:
    """Half a unit in the last digit of a typed number: all that round to it are at most that far away.

    Zero for a number of one digit, or a whole one below 100: these are meant exactly. Zeros at the end of a
    decimal are not counted as digits, as a float does not have them.
    """
    _, digits, exponent = Decimal(f"{number:.15g}").normalize().as_tuple()
    assert isinstance(exponent, int)
    is_whole = exponent >= 0 and abs(number) < WHOLE
    if len(digits) < (3 if is_whole else 2):
        return 0.0
    return 0.5 if is_whole else 5.0 * 10.0 ** (exponent - 1)


def _no_symbol(name: str, positive: bool) -> Scalar:
    raise ValueProblem("missing, expected a value")


FLOAT = Arithmetic(
    exact=False,
    pi=math.pi,
    sqrt=math.sqrt,
    sin=math.sin,
    cos=math.cos,
    atan2=math.atan2,
    hypot=math.hypot,
    value=float,
    sign=lambda x: int(x > 0) - int(x < 0),
    size=float,
    tidy=lambda array: array,
    symbol=_no_symbol,
)


def echelon(matrix: Array, rank: int, noise: float = 0.0, n: Arithmetic = FLOAT) -> tuple[Array, list[int]]:
    """The reduced row echelon form of a matrix of this rank, and the columns of its pivots.

    The pivot is the largest entry that a column has left. Entries that are no larger than `noise` are zero.
    """
    rows, pivots = matrix.copy(), list[int]()
    for column in range(rows.shape[1]):
        done = len(pivots)
        if done == rank:
            break
        sizes = [n.size(abs(entry)) for entry in rows[done:, column]]
        best = int(np.argmax(sizes))
        if sizes[best] <= noise:
            continue
        rows[[done, done + best]] = rows[[done + best, done]]
        rows[done] = n.tidy(rows[done] / rows[done, column])
        others = np.arange(len(rows)) != done
        rows[others] = n.tidy(rows[others] - np.outer(rows[others, column], rows[done]))
        pivots.append(column)
    return rows, pivots
