"""The kinds of answers: one class each."""

from __future__ import annotations

from rigidcli.grading.kinds.arrays import Matrix, Vector
from rigidcli.grading.kinds.axes import Axes
from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.kinds.choice import Choice
from rigidcli.grading.kinds.equations import Equations
from rigidcli.grading.kinds.expression import Expression
from rigidcli.grading.kinds.moments import Moments
from rigidcli.grading.kinds.number import Number
from rigidcli.grading.kinds.tensor import Tensor
from rigidcli.grading.kinds.trajectory import Trajectory

KINDS: dict[str, Kind] = {
    "number": Number(),
    "quantity": Number(),
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
