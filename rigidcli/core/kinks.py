"""What integrands do in narrow parts of a box: kinks, jumps, poles and peaks, and how wide these are."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask

Function = Callable[[Floats], Floats]
"""Values (n, or k by n) at points (1 + d by n); the first row is the index of the piece."""

Course = Callable[[Array, Floats], Floats]
"""Points (1 + d by m) on ways through boxes: on which of them (m), and how far along it from 0 to 1 (m)."""

NEAR = 0.1
"""A function comes near zero in a box if its least size there is less than this part of its largest."""

DISTANCES = 0.5 ** np.arange(40.0, -1.0, -1.0)
"""Where it is looked how wide something narrow is, in units of the way to an end of the line."""

STRIDE = 2
"""At every other of these distances a line is cut, from where the argument has changed enough."""

SMALL = 1e-14
"""What does not count, in units of the largest value of a narrow function."""

DOUBLED = 3.0
"""A divisor changes enough when it grows by this part of its least value."""


class Narrow(NamedTuple):
    """Something that a function of the `argument` does in a narrow part of a box, if this varies enough.

    It does so where `core` passes zero or turns back, which is simpler than the argument. A `function` that
    is smooth needs an argument that varies by `steep` for this, and does nothing where it hardly changes.
    Others, for which it is None, have roots or poles where the argument is zero; or, if `steep` is zero,
    kinks and jumps there, and are smooth on both sides. Where the `guide` is lowest or highest along some
    coordinates, surfaces on which the core is zero begin or end to cross the lines along these.
    """

    core: Function
    argument: Function
    guide: Function
    function: Callable[[Floats], Floats] | None = None
    steep: float = np.inf

    @property
    def breaks(self) -> bool:
        """Whether it has kinks or jumps, and is smooth on both sides of them."""
        return self.steep == 0

    def matters(self, arguments: Floats, largest: float) -> Mask:
        """Where the function changes by what counts beside its largest value that is known.

        Kinks and poles do so at small arguments; `largest` is that of them then.
        """
        with np.errstate(all="ignore"):
            if self.function is None:
                return np.asarray(np.abs(arguments) < NEAR * largest)
            sides = [self.function(arguments + side) for side in (-self.steep, 0.0, self.steep)]
            return np.asarray(~(np.ptp(sides, axis=0) <= SMALL * largest))

    def widths(
        self, at: Course, on: Array, places: Floats, start: Floats, largest: float
    ) -> tuple[Array, Floats]:
        """Where the argument has changed much from what it is at places on courses: on which, and where.

        From there on, so are farther places, until the function changes no more, or up to the end.
        """
        courses, found = [np.zeros(0, dtype=int)], [np.zeros(0)]
        enough = DOUBLED * np.abs(start) if self.function is None else np.full(start.size, self.steep)
        for end in (0.0, 1.0) if on.size else ():
            t = places[:, None] + (end - places)[:, None] * DISTANCES
            values = self.argument(at(np.repeat(on, len(DISTANCES)), t.ravel())).reshape(t.shape)
            last = np.full(on.size, len(DISTANCES) - 1)
            with np.errstate(all="ignore"):
                first = (np.abs(values - start[:, None]) > enough[:, None]).argmax(axis=1)
                if self.function is not None:
                    changes = ~(np.abs(np.diff(self.function(values))) <= SMALL * largest)
                    last -= changes[:, ::-1].argmax(axis=1)
            stages = first[:, None] + STRIDE * np.arange(len(DISTANCES) // STRIDE)
            which, stage = np.nonzero(
                (first > 0)[:, None] & (stages < np.minimum(last[:, None] + STRIDE, t.shape[1] - 1))
            )
            courses.append(on[which])
            found.append(t[which, stages[which, stage]])
        return np.concatenate(courses), np.concatenate(found)
