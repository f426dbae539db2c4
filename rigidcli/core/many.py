"""Many values of one number at once: arrays that pass through the formulas of a single float.

A `Many` has a float for each of some runs of the same formulas, and stands wherever one float does. Its
results are those of the runs one by one, bit for bit: sums, products, quotients and square roots are rounded
correctly by IEEE 754, and the functions are those of `math`, since the ones that numpy has for arrays may
differ from them in the last bit. A branch is taken by all runs or by none: where they part, a
`PartedError` says which of them go together, and `grouped` begins anew with each of these.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable, Iterator
from dataclasses import fields
from itertools import repeat
from typing import Any, NoReturn, TypeVar

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Floats

ALONE = -1
"""The label of a run that has to be worked by itself."""

FEW = 8
"""Groups of fewer runs are worked one by one, which takes no longer."""

_Found = TypeVar("_Found")


class UnfitError(Exception):
    """Something that takes one float, and cannot be done with many at once."""


class PartedError(Exception):
    """The runs take different ways: those with the same of the `labels` (n) go together, ALONE ones alone."""

    def __init__(self, labels: NDArray[np.int_]) -> None:
        super().__init__("runs take different ways")
        self.labels = labels


def agreed(yes: Any, certain: Any = True) -> bool:
    """The truth value that all runs have in common (each n).

    Raises PartedError where they have none, and where some are not `certain`.
    """
    labels = np.where(certain, yes, ALONE)
    return bool(common(labels))


def common(labels: Any) -> int:
    """The label that all runs have in common. Raises PartedError where there is none."""
    first = int(labels.flat[0])
    if first == ALONE or (labels != first).any():
        raise PartedError(labels)
    return first


def grouped(
    runs: NDArray[np.int_], work: Callable[[NDArray[np.int_]], _Found]
) -> Iterator[tuple[NDArray[np.int_], _Found | None]]:
    """What `work` finds for groups of the `runs` (n), each run in one group; None for those to work alone.

    Errors of `work`, other than PartedError, are for those runs to tell that have them.
    """
    if len(runs) < FEW:
        yield runs, None
        return
    try:
        yield runs, work(runs)
    except PartedError as parted:
        for label in np.unique(parted.labels).tolist():
            group = runs[parted.labels == label]
            if label == ALONE:
                yield group, None
            else:
                yield from grouped(group, work)
    except (UnfitError, ArithmeticError):
        yield runs, None


def _unfit(*_: object) -> NoReturn:
    raise UnfitError


def _compared(name: str) -> Callable[[Many, Any], bool]:
    compare = getattr(operator, name)

    def method(self: Many, other: Any) -> bool:
        return agreed(compare(self.values, _values(other)))

    return method


def _values(other: Any) -> Any:
    if isinstance(other, Many):
        return other.values
    if isinstance(other, float | int):
        return other
    raise UnfitError


class Many:
    """A number in each of n runs: `values` (n); or a vector in each (n by k), whose entries can be taken."""

    __slots__ = ("values",)

    __array_ufunc__ = None
    """Arrays leave operations with it to this class."""

    def __init__(self, values: Floats) -> None:
        self.values = values

    def __add__(self, other: Any) -> Many:
        return Many(self.values + _values(other))

    __radd__ = __add__

    def __mul__(self, other: Any) -> Many:
        return Many(self.values * _values(other))

    __rmul__ = __mul__

    def __sub__(self, other: Any) -> Many:
        return Many(self.values - _values(other))

    def __rsub__(self, other: Any) -> Many:
        return Many(_values(other) - self.values)

    def __truediv__(self, other: Any) -> Many:
        return _quotient(self.values, _values(other))

    def __rtruediv__(self, other: Any) -> Many:
        return _quotient(_values(other), self.values)

    def __pow__(self, other: Any) -> Many:
        return each(operator.pow, self, _values(other))

    def __neg__(self) -> Many:
        return Many(-self.values)

    def __abs__(self) -> Many:
        return Many(abs(self.values))

    def __getitem__(self, index: int | tuple[int, ...]) -> Many:
        return Many(np.moveaxis(self.values, 0, -1)[index])

    def __bool__(self) -> bool:
        return agreed(self.values != 0)

    __eq__ = _compared("eq")
    __ne__ = _compared("ne")
    __lt__ = _compared("lt")
    __le__ = _compared("le")
    __gt__ = _compared("gt")
    __ge__ = _compared("ge")
    __hash__ = None  # type: ignore[assignment]
    __float__ = __int__ = __index__ = __format__ = _unfit
    __array__ = __iter__ = __len__ = __matmul__ = __rmatmul__ = _unfit

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)
        raise UnfitError


def _quotient(dividend: Any, divisor: Any) -> Many:
    """The quotient of runs none of which divides by zero, as a float may not."""
    if agreed(np.asarray(divisor) == 0):
        raise ZeroDivisionError
    return Many(dividend / divisor)


def each(function: Callable[..., float], *numbers: Any) -> Many:
    """A function of floats, run by run; numbers that are not many are the same in all."""
    columns = (number.values.tolist() if isinstance(number, Many) else repeat(number) for number in numbers)
    return Many(np.array(list(map(function, *columns))))


def _either(function: Callable[..., float]) -> Callable[..., Any]:
    """The function, for floats and for many at once."""

    def apply(*numbers: Any) -> Any:
        is_many = any(isinstance(number, Many) for number in numbers)
        return each(function, *numbers) if is_many else function(*numbers)

    return apply


def _sqrt(x: Any) -> Any:
    if not isinstance(x, Many):
        return math.sqrt(x)
    if x < 0:
        raise UnfitError
    return Many(np.sqrt(x.values))


def _sign(x: Any) -> int | None:
    if not isinstance(x, Many):
        return FLOAT.sign(x)
    # Labels are not negative.
    return common((x.values > 0).astype(int) - (x.values < 0) + 1) - 1


class _Together(Arithmetic):
    """The arithmetic of floats, some of which are many at once."""

    def array(self, values: object) -> Any:
        """The numbers as an array; where some of a list are many at once, as many vectors."""
        entries = values if isinstance(values, list | tuple) else ()
        counts = [len(entry.values) for entry in entries if isinstance(entry, Many)]
        if not counts:
            return FLOAT.array(values)
        columns = [
            entry.values if isinstance(entry, Many) else np.full(counts[0], float(entry)) for entry in entries
        ]
        return Many(np.stack(columns, axis=1))


MANY = _Together(
    **{entry.name: getattr(FLOAT, entry.name) for entry in fields(FLOAT)}
    | {"sqrt": _sqrt, "sign": _sign}
    | {name: _either(getattr(FLOAT, name)) for name in ("sin", "cos", "atan2", "hypot")}
)
"""Floats, some of which are many at once."""
