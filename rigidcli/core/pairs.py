"""Long decimals for motion in closed form: floats become decimals without rounding, and back."""

from __future__ import annotations

from decimal import Decimal
from typing import Any, TypeAlias

import numpy as np

from rigidcli.core.high_precision import decimals

Long: TypeAlias = Any
"""A decimal, or an array of them."""


def exactly(number: Any) -> Long:
    """A float as a decimal, without rounding; an array of them as an array of decimals."""
    return decimals(number) if np.ndim(number) else Decimal(number)


def rounded(number: Long) -> float:
    """The float nearest to a decimal."""
    return float(number)
