"""The kinds of answers: how a key and an answer of each are read and compared."""

from __future__ import annotations

from rigidcli.check.base import Kind
from rigidcli.check.kinds.arrays import Matrix, Vector
from rigidcli.check.kinds.axes import Axes
from rigidcli.check.kinds.choice import Choice
from rigidcli.check.kinds.equations import Equations
from rigidcli.check.kinds.expression import Expression
from rigidcli.check.kinds.number import Quantity
from rigidcli.check.kinds.tensors import Moments, Tensor
from rigidcli.check.kinds.trajectory import Trajectory

KINDS: dict[str, Kind] = {
    "number": Quantity("number"),
    "quantity": Quantity("quantity"),
    "vector": Vector(),
    "moments": Moments(),
    "matrix": Matrix(),
    "tensor": Tensor(),
    "axes": Axes(),
    "expression": Expression(),
    "equations": Equations(),
    "trajectory": Trajectory(),
    "choice": Choice(),
}
"""The kinds of answers by the names that questions have for them."""
