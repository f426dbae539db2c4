"""Naming a mistake: the reference is worked again under each, and one alone must explain the answer."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from typing import TypeVar

from rigidcli.grading.outcome import Finding

_Value = TypeVar("_Value")


def explained(
    mistaken: Iterable[tuple[str, _Value]], same: Callable[[_Value], bool], otherwise: str
) -> Finding:
    """The finding of the one mistake under which the reference is the `same` as the answer.

    `mistaken` has codes with what comes out under them; a code may stand several times. Where none, or more
    than one, explains the answer, the finding is `otherwise`.
    """
    codes = {code for code, value in mistaken if same(value)}
    return Finding(codes.pop() if len(codes) == 1 else otherwise)
