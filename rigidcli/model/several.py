"""Several values of one key of a document, which is then read once for all of them."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats
from rigidcli.core.groups import ALONE, PartedError, UnfitError, common
from rigidcli.core.many import Many
from rigidcli.errors import ValueProblem


@dataclass(frozen=True, slots=True, eq=False)
class Several:
    """The values of a `key`, one for each of n runs over the document.

    `written` (n) are numbers in the `unit`, "" for none; or texts and other things, where that is None.
    `told` (n) are the values as results tell them, SI numbers; `labels` (n) say in which of the `units`, or
    ALONE for what is no number.
    """

    key: str
    written: Sequence[Any]
    unit: str | None
    told: Floats
    labels: NDArray[np.int_]
    units: Sequence[str]

    def take(self, runs: NDArray[np.int_]) -> Several:
        """The values for some of the runs."""
        written = [self.written[run] for run in runs.tolist()]
        return replace(self, written=written, told=self.told[runs], labels=self.labels[runs])

    def results(self) -> tuple[Many, str]:
        """The values as results tell them, and their unit. Raises PartedError where these differ."""
        unit = self.units[common(self.labels)]
        return Many(self.told), unit

    def numbers(self, read: Callable[[Any], float], notes: list[str]) -> Any:
        """The SI numbers, if all are plain or in one unit, of which `read` takes the largest for a check.

        It adds to the `notes`. Raises UnfitError where a letter is no unit after all, but a parameter.
        """
        if self.unit:
            largest, known = int(np.argmax(np.abs(self.told))), len(notes)
            if read(f"{self.written[largest]!r} {self.unit}") != self.told[largest] or len(notes) > known:
                raise UnfitError
        return Many(self.told)

    def read(self, read: Callable[[Any], Any], notes: list[str]) -> Any:
        """The numbers that the function reads one by one, which adds to the `notes`.

        Raises PartedError where some are refused or noted: those are for documents of their own.
        """
        return _each(read, [(value,) for value in self.written], notes)


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
