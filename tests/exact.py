"""Exact results as floats, worked out by sympy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import sympy


def numeric(value: Any, values: Mapping[str, float] | None = None) -> Any:
    """An exact result as floats: 30 digits worked, symbols given values by their names."""

    def one(x: Any) -> float:
        x = sympy.sympify(x)
        chosen = {symbol: sympy.Rational(str((values or {})[symbol.name])) for symbol in x.free_symbols}
        return float(x.subs(chosen).evalf(30))

    return np.vectorize(one, otypes=[float])(value) if isinstance(value, np.ndarray) else one(value)
