"""When a motion is looked at: its span of time, the samples in it, and how exactly it is followed."""

from __future__ import annotations

from itertools import pairwise
from typing import Annotated, ClassVar, Self

import numpy as np
from pydantic import AfterValidator, ValidationInfo, model_validator

from rigidcli.core.arithmetic import Floats, Scalar
from rigidcli.document.ensembles import Ensemble
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.quantities import AsList, Duration, Number, Time, WholeNumber, limited
from rigidcli.fields.section import Section, environment, optional

MOST_SAMPLES = 10_000_000
"""The most samples of a motion: a trajectory of as many rows takes a gigabyte."""

LEAST_TOLERANCE, LARGEST_TOLERANCE = 1e-15, 1e-3
"""Bounds of the relative error of a step: rounding is larger than less, and more is no solution."""

DEFAULT_SAMPLES = 1001
"""Samples where a document says nothing: with both ends, they cut its duration into a thousand parts."""

DEFAULT_TOLERANCE = 1e-12
"""Relative error of a step where a document says nothing: small beside what most are asked for."""

WHOLE_STEP = 1e-9
"""A last step that misses the end by less than this, in units of the step, was meant to end there."""


def _ascending(times: tuple[Scalar, ...], info: ValidationInfo) -> tuple[Scalar, ...]:
    """The times, if they ascend from t = 0 or later."""
    sizes = [environment(info).arithmetic.size(time) for time in times]
    if not sizes:
        raise ValueProblem("read an empty list, expected times")
    if sizes[0] < 0:
        raise ValueProblem(f"read {sizes[0]:g}, expected a time that is not negative", path=(0,))
    for index, (before, after) in enumerate(pairwise(sizes), start=1):
        if not before < after:
            raise ValueProblem(f"read {after:g} after {before:g}, expected ascending times", path=(index,))
    return times


Times = Annotated[tuple[Time, ...], AsList, AfterValidator(_ascending)]
Tolerance = Annotated[
    Number,
    limited(
        lambda x, n: n.value(x) is None or LEAST_TOLERANCE <= n.value(x) <= LARGEST_TOLERANCE,
        f"a number from {LEAST_TOLERANCE:g} to {LARGEST_TOLERANCE:g}",
    ),
]


class Sampling(Section):
    """The span of a motion that begins at t = 0, and its samples."""

    STARTS: ClassVar[str]
    """The key of the start, or of several: an ensemble."""

    AT_MOST_ONE_OF: ClassVar = ("samples", "step", "times")

    duration: Duration | None = optional("End of the motion (s)")
    samples: WholeNumber | None = optional("How many times, evenly spaced (default 1001)")
    step: Duration | None = optional("Time between two samples (s)")
    times: Times | None = optional("The times themselves, ascending")
    tolerance: Tolerance | None = optional(
        "Relative error of a step of numerical integration (default 1e-12)"
    )
    max_step: Duration | None = optional("The longest step of the integration (s)")

    @model_validator(mode="after")
    def _check_sampling(self, info: ValidationInfo) -> Self:
        n = environment(info).arithmetic
        if self.samples is not None and not 2 <= self.samples <= MOST_SAMPLES:
            expected = f"a whole number from 2 to {MOST_SAMPLES:,}"
            raise ValueProblem(f"read {shown(self.samples)}, expected {expected}", path=("samples",))
        if self.step is not None and self.duration is None:
            raise ValueProblem("missing, expected how long `step` is repeated", path=("duration",))
        if self.step is not None and self.duration is not None:
            steps = n.size(self.duration / self.step)
            if not 1 - WHOLE_STEP <= steps < MOST_SAMPLES:
                message = f"there are {steps:.6g} steps in the duration, expected 1 to {MOST_SAMPLES:,}"
                raise ValueProblem(message, path=("step",))
        if self.times is not None and self.duration is not None:
            raise ValueProblem("give `duration` or `times`, not both", path=("duration",))
        return self

    @property
    def ensemble(self) -> Ensemble | None:
        """The starts, where there is not one."""
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
