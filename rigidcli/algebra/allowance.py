"""Work that may be done on one expression, counted in steps and never in seconds."""

from __future__ import annotations

from rigidcli.errors import ExpressionError

MOST_STEPS = 60_000
"""Steps for one question about one expression: a few tenths of a second."""


class Allowance:
    """A number of steps, each about the handling of one factor of one term; what needs more is refused."""

    __slots__ = ("left",)

    def __init__(self, steps: int = MOST_STEPS) -> None:
        self.left = steps

    def spend(self, steps: int) -> None:
        """Take off what is about to be done.

        Raises:
            ExpressionError: nothing is left.
        """
        self.left -= steps
        if self.left < 0:
            raise ExpressionError("the expression is too large to be multiplied out")
