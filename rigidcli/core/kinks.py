"""What integrands do in narrow parts of a box: kinks, jumps, poles and peaks, and how wide these are."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.core.boxes import Lines

Function = Callable[[Floats], Floats]
"""Values (n, or k by n) at points (1 + d by n); the first row is the index of the piece."""

NEAR = 0.1
"""A function comes near zero in a box if its least size there is less than this part of its largest."""

DISTANCES = 0.5 ** np.arange(40.0, -1.0, -1.0)
"""Where it is looked how wide something narrow is, in units of the way to an end of the line."""

STAGES = 2
"""At how many of these distances a line is cut, from where the argument has changed enough."""

SMALL = 1e-14
"""What does not count, in units of the largest value of a narrow function."""

DOUBLED = 3.0
"""A divisor changes enough when it grows by this part of its least value."""


class Narrow(NamedTuple):
    """Something that a function of the `argument` does in a narrow part of a box, if this varies enough.

    It does so where `core` passes zero or turns back, which is simpler than the argument. A `function` that
    is smooth needs an argument that varies by `steep` for this, and does nothing where it hardly changes;
    others, for which it is None, have kinks or poles where the argument is zero.
    """

    core: Function
    argument: Function
    function: Callable[[Floats], Floats] | None = None
    steep: float = np.inf

    def matters(self, arguments: Floats, largest: float) -> Mask:
        """Where the function changes by what counts beside its largest value that is known.

        Kinks and poles do so at small arguments; `largest` is that of them then.
        """
        with np.errstate(all="ignore"):
            if self.function is None:
                return np.asarray(np.abs(arguments) < NEAR * largest)
            sides = [self.function(arguments + side) for side in (-self.steep, 0.0, self.steep)]
            return np.asarray(~(np.ptp(sides, axis=0) <= SMALL * largest))

    def widths(self, lines: Lines, on: Array, places: Floats, start: Floats) -> tuple[Array, Floats]:
        """Where the argument has changed much from what it is at places on lines: on which, and where."""
        lines_found, found = [np.zeros(0, dtype=int)], [np.zeros(0)]
        enough = DOUBLED * np.abs(start) if self.function is None else np.full(start.size, self.steep)
        for end in (0.0, 1.0) if on.size else ():
            t = places[:, None] + (end - places)[:, None] * DISTANCES
            values = self.argument(lines.along(on, t)[0]).reshape(t.shape)
            with np.errstate(invalid="ignore"):
                first = (np.abs(values - start[:, None]) > enough[:, None]).argmax(axis=1)
            for further in range(STAGES):
                some = np.flatnonzero((first > 0) & (first + further < len(DISTANCES) - 1))
                lines_found.append(on[some])
                found.append(t[some, first[some] + further])
        return np.concatenate(lines_found), np.concatenate(found)
