"""Equations of motion as a program in any language needs them: names, expressions, and where to begin."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rigidcli.language.sharing import Formulas


@dataclass(frozen=True, slots=True, eq=False)
class Run:
    """What a program does: from the values `start` of its variables at t = 0 to those at `times` (k, s).

    `sizes` are those of the variables on the way, with which their errors are compared.
    """

    start: Sequence[float]
    sizes: Sequence[float]
    times: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Program:
    """Differential equations of first order, as a program in any language needs them.

    `about` are remarks, line by line. `constants` are numbers by their names, None where there is no value.
    The derivatives of the `variables` by `time` are the values of `rates`; each of the `quantities` has one
    value, and its name. What is to be printed are the `columns`: the time, variables and quantities.
    Without a `run` there is nowhere to begin.
    """

    about: Sequence[str]
    constants: Mapping[str, float | None]
    time: str
    variables: Sequence[str]
    rates: Formulas
    quantities: Mapping[str, Formulas]
    columns: Sequence[str]
    run: Run | None = None
