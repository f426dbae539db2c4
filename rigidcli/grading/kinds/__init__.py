"""The kinds of answers: one class each."""

from __future__ import annotations

from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.kinds.expression import Expression
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
    "expression": Expression(),
    "equations": Module("equations"),
    "trajectory": Module("trajectory"),
    "choice": Module("choice"),
}
