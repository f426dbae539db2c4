"""Which kind of answer a result asks for, told from what it is."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigidcli.algebra.expressions import Expr

BY_NAME = {
    "axes": "axes",
    "moments": "moments",
    "tensor": "tensor",
    "tensor_com": "tensor",
    "cyclic": "choice",
    "conserved": "choice",
    "equations": "equations",
}
"""Kinds of results by the last name of their path."""

TRAJECTORIES = ("orbit", "trajectory")
"""Results that are tables in time: they, and their columns."""

SCALARS = (bool, int, float, str, np.generic)


def kind_of(path: tuple[str, ...], value: Any, unit: str) -> str | None:
    """The kind of a result; None where it cannot be told, or is no single answer."""
    if path[1:2] and path[1] in TRAJECTORIES and not isinstance(value, SCALARS):
        return "trajectory"
    if path[-1] in BY_NAME:
        return BY_NAME[path[-1]]
    if isinstance(value, bool | np.bool_ | str):
        return "choice"
    if isinstance(value, int | float | np.number):
        return "quantity" if unit else "number"
    if isinstance(value, Expr):
        return "expression"
    if isinstance(value, Mapping):
        return None
    return {1: "vector", 2: "matrix"}.get(np.ndim(np.array(value, dtype=object)))
