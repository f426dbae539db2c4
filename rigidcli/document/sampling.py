"""The starts of a motion, one or many, and the times of its samples."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self

import numpy as np
from pydantic import (
    AfterValidator,
    Field,
    ValidationError,
    ValidationInfo,
    ValidatorFunctionWrapHandler,
    model_validator,
)
from pydantic.json_schema import JsonSchemaValue
from pydantic_core import InitErrorDetails

from rigidcli.core.arithmetic import Floats, Scalar
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import TIME
from rigidcli.fields.environment import finite
from rigidcli.fields.quantities import AsList, Duration, Number, Quantity, WholeNumber, limited
from rigidcli.fields.section import Alternative, Section, details, environment, optional
from rigidcli.fields.texts import csv_rows


@dataclass(frozen=True, slots=True, eq=False)
class Ensemble:
    """The values (m by k, SI units) of k quantities by their `names`, for each of m starts."""

    names: tuple[str, ...]
    values: Floats

    def __len__(self) -> int:
        return len(self.values)

    def start(self, place: int) -> dict[str, float]:
        """The values of one start, by the names of the quantities."""
        return dict(zip(self.names, self.values[place].tolist(), strict=True))


@dataclass(frozen=True, eq=False)
class OrMany(Alternative):
    """Marks a field of one start (`otherwise`) that also takes a list of starts, or the name of a table.

    `named` gives the values of a start by their names, and `heads` the names for the heads of a table;
    `require` checks a start of the table. `heads` and `require` raise ValueProblem.
    """

    otherwise: Any
    named: Callable[[Any], dict[str, Any]]
    heads: Callable[[Sequence[str], ValidationInfo], tuple[str, ...]]
    example: str
    require: Callable[[Mapping[str, float]], None] = lambda start: None

    def schemas(self, one: JsonSchemaValue) -> list[JsonSchemaValue]:
        """The JSON Schemas of one start, of a list, and of a table."""
        words = f"A .csv file of starts, beside the document, with heads such as {self.example}"
        table = {"type": "string", "pattern": r"\.[cC][sS][vV]$", "description": words}
        several = {"type": "array", "items": one, "minItems": 1, "description": "A list of such starts"}
        return [one, several, table]

    def read(self, raw: Any, otherwise: ValidatorFunctionWrapHandler, info: ValidationInfo) -> object:
        """One start, or several as an ensemble."""
        if isinstance(raw, str) and raw.lower().endswith(".csv"):
            return _table(environment(info).file(raw), lambda heads: self.heads(heads, info), self.require)
        if not (isinstance(raw, list) and raw and isinstance(raw[0], list | Mapping)):
            return otherwise(raw)
        rows, errors = list[dict[str, Any]](), list[InitErrorDetails]()
        for place, entry in enumerate(raw):
            try:
                rows.append(self.named(otherwise(entry)))
            except ValidationError as error:
                errors += details(error, place)
        if errors:
            raise ValidationError.from_exception_data("starts", errors)
        n, names, values = environment(info).arithmetic, tuple(rows[0]), list[list[Any]]()
        for place, row in enumerate(rows):
            if row.keys() != {*names}:
                expected = f"expected {', '.join(names)}, as the first start has"
                raise ValueProblem(f"read {', '.join(row)}, {expected}", path=(place,))
            values.append([n.value(row[name]) for name in names])
            if None in values[-1]:
                raise ValueProblem("a parameter in it has no value; expected numbers", path=(place,))
        return Ensemble(names, np.array(values, dtype=np.float64))


def _table(
    path: Path,
    names: Callable[[Sequence[str]], tuple[str, ...]],
    require: Callable[[Mapping[str, float]], None],
) -> Ensemble:
    """The ensemble in a .csv file, by the `names` of its heads; `require` checks each start.

    Raises ValueProblem, which begins with the path and the line.
    """
    values, line = list[list[float]](), 1
    try:
        rows = csv_rows(path)
        _, heads = next(rows, (line, [""]))
        if len({*heads}) < len(heads):
            raise ValueProblem(f"header {shown(','.join(heads))}, expected each head once")
        columns = names(heads)
        for line, cells in rows:  # noqa: B007 - the line of a problem
            if len(cells) != len(heads):
                raise ValueProblem(f"read {len(cells)} values, expected {len(heads)}")
            values.append(list(map(_number, heads, cells)))
            require(dict(zip(columns, values[-1], strict=True)))
    except ValueProblem as problem:
        raise ValueProblem(f"{path}:{line}: {problem.message}", hint=problem.hint) from None
    if not values:
        raise ValueProblem(f"{path}: no starts")
    return Ensemble(columns, np.array(values, dtype=np.float64))


def _number(head: str, cell: str) -> float:
    with suppress(ValueError):
        return finite(cell)
    raise ValueProblem(f"column {head}: read {shown(cell)}, expected a number")


MOST_SAMPLES = 10_000_000  # the most samples of a motion: a trajectory of as many rows takes a gigabyte
# Bounds of the relative error of a step: below the least is rounding, the largest is three digits.
LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-15, 1e-3
# Samples where a document says nothing: with both ends, they cut its duration into a thousand parts.
DEFAULT_SAMPLES = 1001
# Relative error of a step where a document says nothing: smaller than most users need.
DEFAULT_TOLERANCE = 1e-12
WHOLE_STEP = 1e-9  # relative to the step: a last step that ends so near to the end is meant to end there


def _ascending(times: tuple[Scalar, ...], info: ValidationInfo) -> tuple[Scalar, ...]:
    sizes = [environment(info).arithmetic.size(time) for time in times]
    for index, (before, after) in enumerate(pairwise(sizes), start=1):
        if not before < after:
            hint = None
            if len(sizes) == 3 and sizes[0] == 0:
                hint = f"instead of `times` write `duration: {before:g}` and `step: {after:g}`"
            message = f"read {after:g} after {before:g}, expected ascending times"
            raise ValueProblem(message, path=(index,), hint=hint)
    return times


Time = Annotated[Scalar, Quantity(TIME, "nonnegative")]
Times = Annotated[tuple[Time, ...], AsList, Field(min_length=1), AfterValidator(_ascending)]
Samples = Annotated[WholeNumber, Field(ge=2, le=MOST_SAMPLES)]
Tolerance = Annotated[
    Number,
    limited(
        lambda x, n: n.value(x) is None or LEAST_TOLERANCE <= n.value(x) <= LARGEST_TOLERANCE,
        f"a number from {LEAST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}",
    ),
]


class Sampling(Section):
    """The span of a motion that begins at t = 0, and its samples."""

    STARTS: ClassVar[str]  # the key of the start or of the ensemble

    AT_MOST_ONE_OF: ClassVar = (("samples", "step", "times"), ("duration", "times"))
    NEEDS: ClassVar = {"step": "duration"}

    duration: Duration | None = optional("End of the motion (s)")
    samples: Samples | None = optional("Number of samples, evenly spaced in time (default 1001)")
    step: Duration | None = optional("Time between two samples (s)")
    times: Times | None = optional("Times of the samples, ascending")
    tolerance: Tolerance | None = optional("Relative error of a step of integration (default 1e-12)")
    max_step: Duration | None = optional("The longest step of the integration (s)")

    @model_validator(mode="after")
    def _check_sampling(self, info: ValidationInfo) -> Self:
        n = environment(info).arithmetic
        if self.step is not None and self.duration is not None:
            steps = n.size(self.duration / self.step)
            if not 1 - WHOLE_STEP <= steps < MOST_SAMPLES:
                message = f"there are {steps:.6g} steps in the duration, expected 1 to {MOST_SAMPLES:,}"
                raise ValueProblem(message, path=("step",))
        return self

    @property
    def ensemble(self) -> Ensemble | None:
        """The ensemble of starts; None for a single start."""
        start = getattr(self, self.STARTS)
        return start if isinstance(start, Ensemble) else None

    def instants(self, default: Scalar) -> Floats:
        """The times of the samples (n, s); `default` is the duration where none is given."""
        if self.times is not None:
            return np.array(self.times)
        duration = default if self.duration is None else self.duration
        if self.step is None:
            return np.linspace(0.0, duration, self.samples or DEFAULT_SAMPLES)
        whole = round(duration / self.step)
        if abs(duration / self.step - whole) > WHOLE_STEP:
            return np.arange(int(duration / self.step) + 1, dtype=np.float64) * self.step
        return np.append(np.arange(whole, dtype=np.float64) * self.step, duration)
