"""The kinds of answers: one class each."""

from __future__ import annotations

from rigidcli.grading.kinds.axes import Axes
from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.kinds.modules import Module
from rigidcli.grading.kinds.number import Number
from rigidcli.grading.kinds.trajectory import Trajectory

KINDS: dict[str, Kind] = {
    "number": Number(),
    "quantity": Number(),
    "vector": Module("vector"),
    "moments": Module("moments"),
    "matrix": Module("matrix"),
    "tensor": Module("tensor"),
    "axes": Axes(),
    "expression": Module("expression"),
    "equations": Module("equations"),
    "trajectory": Trajectory(),
    "choice": Module("choice"),
}
