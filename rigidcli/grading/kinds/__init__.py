"""The kinds of answers: one class each."""

from __future__ import annotations

from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.kinds.equations import Equations
from rigidcli.grading.kinds.modules import Module
from rigidcli.grading.kinds.number import Number

KINDS: dict[str, Kind] = {
    "number": Number(),
    "quantity": Number(),
    "vector": Module("vector"),
    "moments": Module("moments"),
    "matrix": Module("matrix"),
    "tensor": Module("tensor"),
    "axes": Module("axes"),
    "expression": Module("expression"),
    "equations": Equations(),
    "trajectory": Module("trajectory"),
    "choice": Module("choice"),
}
