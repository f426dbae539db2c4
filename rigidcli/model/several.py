"""Several values of one key of a document, which is then read once for all of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from rigidcli.core.many import ALONE, Many, PartedError, UnfitError, agreed
from rigidcli.errors import ValueProblem


@dataclass(frozen=True, slots=True, eq=False)
class Several:
    """The values of a key as they are written, one for each of some runs over the document."""

    values: Sequence[Any]

    def read(self, read: Callable[[Any], Any], notes: list[str]) -> Any:
        """The numbers that the function reads, which adds to the `notes`.

        Raises PartedError where some are refused or noted: those are for documents of their own.
        """
        return _each(read, [(value,) for value in self.values], notes)

    @property
    def are_bare(self) -> bool:
        """Whether all values are plain numbers, without a unit."""
        return all(type(value) is float for value in self.values)

    def numbers(self) -> Many:
        """The values, which are plain numbers. Raises PartedError where some are not finite."""
        values = np.array(self.values, dtype=np.float64)
        agreed(True, np.isfinite(values))
        return Many(values)


def evaluated(evaluate: Callable[[Mapping[str, float]], float], values: Mapping[str, Any]) -> Any:
    """A function of named floats, some of which may be many. Raises what it raises, or PartedError."""
    many = [name for name, value in values.items() if isinstance(value, Many)]
    if not many:
        return evaluate(values)
    columns = zip(*(values[name].values.tolist() for name in many), strict=True)
    return _each(lambda *row: evaluate({**values, **dict(zip(many, row, strict=True))}), list(columns), [])


def _each(read: Callable[..., Any], rows: Sequence[Sequence[Any]], notes: list[str]) -> Many:
    """The numbers that a function finds for each of the rows."""
    numbers, known = [], len(notes)
    for row in rows:
        try:
            number = read(*row)
        except ValueProblem:
            number = math.nan
        if len(notes) > known:
            number = math.nan
            del notes[known:]
        if not isinstance(number, float):
            raise UnfitError
        numbers.append(number)
    values = np.array(numbers)
    missing = np.isnan(values)
    if missing.any():
        raise PartedError(np.where(missing, ALONE, 0))
    return Many(values)
