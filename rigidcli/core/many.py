"""Many values of one number at once: arrays that pass through the formulas of a single float.

A `Many` has a float, or an array, for each of some runs of the same formulas, and stands wherever one float
or one array does. Its results are those of the runs one by one, bit for bit: sums, products, quotients and
square roots are rounded correctly by IEEE 754, and the functions are those of `math`, since the ones that
numpy has for arrays may differ from them in the last bit. A branch is taken by all runs or by none, as
`core.groups` has it.
"""

from __future__ import annotations

import operator
from collections.abc import Callable, Iterable, Iterator
from itertools import repeat
from typing import Any, NoReturn

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import FLOAT
from rigidcli.core.groups import UnfitError, agreed, common

SHORT = 8
"""Sums of fewer numbers along one axis are added by numpy one after the other, however they lie in memory.

How it adds others hangs on that, so that they are added run by run.
"""


def _unfit(*_: object) -> NoReturn:
    raise UnfitError


def _aligned(*numbers: Any) -> Iterator[Any]:
    """The values of numbers and arrays, with axes put in so that those of one run meet each other."""
    if not all(isinstance(number, Many | np.ndarray | float | int) for number in numbers):
        raise UnfitError
    rank = max(number.ndim if isinstance(number, Many) else np.ndim(number) for number in numbers)
    for number in numbers:
        if isinstance(number, Many):
            count, *shape = number.values.shape
            number = number.values.reshape(count, *[1] * (rank - len(shape)), *shape)
        yield number


def _worked(function: Callable[..., Any], *numbers: Any) -> Any:
    """What comes out in all runs; a truth value in each has to be the same."""
    values = function(*_aligned(*numbers))
    if values.ndim == 1:
        return agreed(values) if values.dtype == bool else Many(values)
    single = function(*(number.values[0] if isinstance(number, Many) else number for number in numbers))
    return _laid_out(values, single)


def _laid_out(values: NDArray[Any], single: NDArray[Any]) -> Many:
    """The arrays, each in memory as that of a `single` run: the last bit of a matrix product hangs on it."""
    if single.flags.c_contiguous:
        return Many(np.ascontiguousarray(values))
    if single.ndim != 2 or not single.flags.f_contiguous:
        raise UnfitError
    return Many(np.ascontiguousarray(values.swapaxes(1, 2)).swapaxes(1, 2))


def _operated(name: str, *, backwards: bool = False) -> Callable[[Many, Any], Any]:
    operate = getattr(operator, name)

    def method(self: Many, other: Any) -> Any:
        return _worked(operate, other, self) if backwards else _worked(operate, self, other)

    return method


def _reduced(name: str) -> Callable[..., Any]:
    """A method of arrays that takes the entries along one axis together, or all."""

    def method(self: Many, axis: int | None = None, **options: Any) -> Many:
        values = self.values.reshape(len(self.values), -1) if axis is None else self.values
        along = 1 if axis is None else axis + 1
        if not 0 < along < values.ndim:
            raise UnfitError
        if name == "sum" and (values.shape[along] >= SHORT or (axis is None and self.ndim > 1)):
            return Many(np.array([run.sum(axis, **options) for run in self.values]))
        return Many(np.ascontiguousarray(getattr(values, name)(axis=along, **options)))

    return method


class Many:
    """A number in each of n runs: `values` (n); or an array in each (n, ...), whose entries can be taken."""

    __slots__ = ("values",)

    def __init__(self, values: NDArray[Any]) -> None:
        self.values = values

    __add__ = _operated("add")
    __radd__ = _operated("add", backwards=True)
    __mul__ = _operated("mul")
    __rmul__ = _operated("mul", backwards=True)
    __sub__ = _operated("sub")
    __rsub__ = _operated("sub", backwards=True)
    __and__ = _operated("and_")
    __eq__ = _operated("eq")
    __ne__ = _operated("ne")
    __lt__ = _operated("lt")
    __le__ = _operated("le")
    __gt__ = _operated("gt")
    __ge__ = _operated("ge")
    any, all, sum, max = map(_reduced, ("any", "all", "sum", "max"))
    __hash__ = None  # type: ignore[assignment]
    __float__ = __int__ = __index__ = __format__ = __array__ = _unfit

    def __truediv__(self, other: Any) -> Many:
        return _quotient(self, other)

    def __rtruediv__(self, other: Any) -> Many:
        return _quotient(other, self)

    def __matmul__(self, other: Any) -> Many:
        return _product(self, other)

    def __rmatmul__(self, other: Any) -> Many:
        return _product(other, self)

    def __pow__(self, other: Any) -> Many:
        if not self.ndim:
            return each(operator.pow, self, other)
        if other != 2:
            raise UnfitError
        return Many(self.values**2)

    def __neg__(self) -> Many:
        return Many(-self.values)

    def __abs__(self) -> Many:
        return Many(abs(self.values))

    def __getitem__(self, index: Any) -> Many:
        found = self.values[self._place(index)]
        is_copied = isinstance(index, tuple) and any(isinstance(part, list) for part in index)
        return _laid_out(found, self.values[0][index]) if is_copied else Many(found)

    def __setitem__(self, index: Any, value: Any) -> None:
        value = stacked(value)
        self.values[self._place(index)] = value.values if isinstance(value, Many) else value

    def _place(self, index: Any) -> Any:
        if not self.ndim:
            raise UnfitError
        if isinstance(index, Many):
            return index.values
        return (slice(None), *(index if isinstance(index, tuple) else (index,)))

    def __len__(self) -> int:
        if not self.ndim:
            raise UnfitError
        return int(self.values.shape[1])

    def __iter__(self) -> Iterator[Many]:
        return (self[place] for place in range(len(self)))

    def __bool__(self) -> bool:
        if self.ndim:
            raise UnfitError
        return agreed(self.values != 0)

    @property
    def ndim(self) -> int:
        """The number of axes of what each run has."""
        return self.values.ndim - 1

    @property
    def dtype(self) -> np.dtype[Any]:
        """The kind of number."""
        return self.values.dtype

    @property
    def T(self) -> Many:  # noqa: N802 - the name that numpy has
        """The transpose of the matrix of each run."""
        return Many(self.values.swapaxes(1, 2)) if self.ndim == 2 else self

    @property
    def flat(self) -> Many:
        """The entries of the array of each run one after the other, in the same memory."""
        entries = self.values.reshape(len(self.values), -1)
        if not np.shares_memory(entries, self.values):
            raise UnfitError
        return Many(entries)

    def tolist(self) -> list[Any]:
        """The entries, nested as in the array of each run."""
        return [entry.tolist() if entry.ndim else entry for entry in self]

    def diagonal(self) -> Many:
        """The diagonal of the matrix of each run."""
        return Many(self.values.diagonal(axis1=1, axis2=2))

    def __array_ufunc__(self, function: Any, method: str, *numbers: Any, **options: Any) -> Any:
        if options or method not in ("__call__", "outer") or function not in _ROUNDED:
            raise UnfitError
        if method == "outer":
            numbers = numbers[0][:, None], numbers[1][None, :]
        if function in _ARRAYS:
            return _ARRAYS[function](*numbers)
        return _worked(function, *numbers)

    def __array_function__(self, function: Any, _: Any, given: Any, options: Any) -> Any:
        if function not in _ARRAYS:
            raise UnfitError
        return _ARRAYS[function](*given, **options)

    def __getattr__(self, name: str) -> NoReturn:
        if name.startswith("__"):
            raise AttributeError(name)
        raise UnfitError


def _quotient(dividend: Any, divisor: Any) -> Many:
    """The quotient of runs none of which divides by zero, as a float may not."""
    zero = np.asarray((divisor.values if isinstance(divisor, Many) else divisor) == 0)
    if agreed(zero.reshape(len(zero), -1).any(axis=1)) if isinstance(divisor, Many) else zero.any():
        raise ZeroDivisionError
    found: Many = _worked(operator.truediv, dividend, divisor)
    return found


def _product(one: Any, other: Any) -> Many:
    """The matrix product in each run, for which numpy calls the same as for a single one."""
    ranks = [number.ndim if isinstance(number, Many | np.ndarray) else 0 for number in (one, other)]
    if not {1, 2}.issuperset(ranks):
        raise UnfitError
    left, right = (number.values if isinstance(number, Many) else number for number in (one, other))
    found = (left if ranks[0] == 2 else left[..., None, :]) @ (right if ranks[1] == 2 else right[..., None])
    found = found if ranks[1] == 2 else found[..., 0]
    return Many(found if ranks[0] == 2 else found[:, 0])


def _cross(one: Any, other: Any) -> Any:
    (a, b, c), (x, y, z) = one, other
    return stacked([b * z - c * y, c * x - a * z, a * y - b * x])


def _diag(entries: Many) -> Many:
    if entries.ndim == 2:
        return entries.diagonal()
    values = entries.values
    matrices = np.where(np.eye(values.shape[1], dtype=bool), values[:, None, :], 0.0)
    return Many(np.ascontiguousarray(matrices))


def _norm(vectors: Many, *, axis: int) -> Many:
    return Many(np.linalg.norm(vectors.values, axis=axis + 1))


_ROUNDED = {
    *(np.add, np.subtract, np.multiply, np.divide, np.negative, np.absolute, np.sqrt, np.matmul),
    *(np.isfinite, np.equal, np.not_equal, np.less, np.less_equal, np.greater, np.greater_equal),
    np.bitwise_and,
}
"""Functions of numpy with one right result, however many numbers they take at once."""

_ARRAYS: dict[Any, Callable[..., Any]] = {
    np.matmul: _product,
    np.divide: _quotient,
    np.where: lambda *numbers: _worked(np.where, *numbers),
    np.outer: lambda one, other: one[:, None] * other[None, :],
    np.cross: _cross,
    np.diag: _diag,
    np.argmax: lambda entries: common(entries.values.argmax(axis=1)),
    np.linalg.norm: _norm,
}
"""What stands for functions of arrays, where an array is many."""


def stacked(values: object) -> Any:
    """The numbers, nested to any depth, as an array; where some are many at once, as many arrays."""
    if isinstance(values, Many):
        return values
    entries = [stacked(entry) for entry in values] if isinstance(values, list | tuple) else []
    counts = [len(entry.values) for entry in entries if isinstance(entry, Many)]
    if not counts:
        return FLOAT.array(values)
    columns = [
        entry.values if isinstance(entry, Many) else np.broadcast_to(entry, (counts[0], *entry.shape))
        for entry in entries
    ]
    return Many(np.stack(columns, axis=1))


def each(function: Callable[..., float], *numbers: Any) -> Many:
    """A function of floats, run by run; numbers that are not many are the same in all."""
    return Many(np.array([function(*row) for row in runs(*numbers)]))


def runs(*numbers: Any) -> Iterator[tuple[Any, ...]]:
    """The numbers and arrays run by run; those that are not many are the same in all."""
    return zip(*(_column(number) for number in numbers), strict=False)


def _column(number: Any) -> Iterable[Any]:
    if not isinstance(number, Many):
        return repeat(number)
    return number.values if number.ndim else number.values.tolist()
