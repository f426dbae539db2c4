"""The kinds of answers: how a key and an answer of each are read and compared."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.homework.base import AnswerKind
from rigidcli.homework.kinds.arrays import MatrixKind, MomentsKind, TensorKind, VectorKind
from rigidcli.homework.kinds.axes import AxesKind
from rigidcli.homework.kinds.equations import EquationsKind, InvariantsKind
from rigidcli.homework.kinds.expression import ExpressionKind
from rigidcli.homework.kinds.single import ChoiceKind, QuantityKind
from rigidcli.homework.kinds.trajectory import BY_DEFAULT, TrajectoryKind

_EVERY: tuple[AnswerKind, ...] = (
    QuantityKind("number"), QuantityKind("quantity"), VectorKind(), MomentsKind(), MatrixKind(), TensorKind(),
    AxesKind(), ExpressionKind(), EquationsKind(), InvariantsKind(), TrajectoryKind(), ChoiceKind(),
)  # fmt: skip
KINDS = {kind.name: kind for kind in _EVERY}
# Kinds of results by the last name of their path.
KIND_BY_NAME = {
    **{name: name for name in ("axes", "moments", "tensor", "equations", "invariants")},
    "tensor_com": "tensor",
    "cyclic": "choice",
    "conserved": "choice",
}
# Kinds of answers with symbols, which are compared by values: unknown functions have none.
OF_SYMBOLS = ("expression", "equations", "invariants", "matrix")


def kind_of(path: tuple[str, ...], value: Any, unit: str) -> str | None:
    """The kind of a result; None where it is no single answer."""
    is_scalar = isinstance(value, bool | int | float | str | np.generic)
    is_motion = path[1:2] and path[1] in BY_DEFAULT and path[-1] != "turning_points"
    if is_motion and not is_scalar:
        return "trajectory"
    if path[-1] in KIND_BY_NAME:
        return KIND_BY_NAME[path[-1]]
    if isinstance(value, bool | np.bool_ | str):
        return "choice"
    if is_scalar:
        return "quantity" if unit else "number"
    if isinstance(value, Expr):
        return "expression"
    if isinstance(value, Mapping):
        return None
    return {1: "vector", 2: "matrix"}.get(np.ndim(np.array(value, dtype=object)))
