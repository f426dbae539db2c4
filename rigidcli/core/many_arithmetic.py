"""The arithmetic of floats, some of which are many at once, and that of one of the runs."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import fields, replace
from typing import Any

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Arithmetic
from rigidcli.core.groups import UnfitError, common
from rigidcli.core.many import Many, each, stacked


def alone(run: int) -> Arithmetic:
    """The arithmetic of floats, to which many numbers have the value that they have in this run."""

    def value(x: Any) -> float:
        return float(x.values[run] if isinstance(x, Many) else x)

    return replace(FLOAT, value=value)


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
        """The numbers, nested to any depth, as an array."""
        return stacked(values)


def _itself(x: Any) -> Any:
    return x if isinstance(x, Many) else float(x)


MANY = _Together(
    **{entry.name: getattr(FLOAT, entry.name) for entry in fields(FLOAT)}
    | {"sqrt": _sqrt, "sign": _sign, "value": _itself, "size": _itself}
    | {name: _either(getattr(FLOAT, name)) for name in ("sin", "cos", "atan2", "hypot")}
)
"""Floats, some of which are many at once."""
