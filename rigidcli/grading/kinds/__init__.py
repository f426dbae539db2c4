"""The kinds of answers, one module each, which is loaded when a question is of that kind."""

from __future__ import annotations

from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import Any, Protocol, cast

from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.example import Example
from rigidcli.grading.outcome import Outcome

KINDS = {
    "number": "rigidcli.grading.kinds.number",
    "quantity": "rigidcli.grading.kinds.number",
    "vector": "rigidcli.grading.kinds.vector",
    "moments": "rigidcli.grading.kinds.moments",
    "matrix": "rigidcli.grading.kinds.matrix",
    "tensor": "rigidcli.grading.kinds.tensor",
    "axes": "rigidcli.grading.kinds.axes",
    "expression": "rigidcli.grading.kinds.expression",
    "equations": "rigidcli.grading.kinds.equations",
    "trajectory": "rigidcli.grading.kinds.trajectory",
    "choice": "rigidcli.grading.kinds.choice",
}


class Kind(Protocol):
    """What each module has."""

    def read_key(self, asked: Asked) -> Any:
        """The key of a question, worked once; raises ValueProblem where what is asked is not of this kind."""

    def judge(self, key: Any, answer: Tree, folder: Path) -> Outcome:
        """The outcome of an answer; raises Unreadable for what is none. `folder` is that of its file."""

    def examples(self, key: Any) -> Iterator[Example]:
        """The key itself, the same in other forms, and under each named mistake that changes it."""


def kind(name: str) -> Kind:
    """The module for a kind of answers."""
    return cast(Kind, import_module(KINDS[name]))
