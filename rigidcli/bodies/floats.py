"""Numbers of a document as floats, where all of them have a value."""

from __future__ import annotations

from typing import Any

from rigidcli.core.arithmetic import Arithmetic
from rigidcli.fields.environment import Formula
from rigidcli.fields.section import Section


class NoValueError(Exception):
    """A number that depends on symbols without a value."""


def floats(value: Any, n: Arithmetic) -> Any:
    """`value` with every number in it as a float. Raises NoValueError."""
    if isinstance(value, dict):
        return {key: floats(item, n) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return tuple(floats(item, n) for item in value)
    if isinstance(value, Formula):
        return Formula(value.expression, floats(value.constants, n))
    if value is None or isinstance(value, str | bool | Section):
        return value
    if (number := n.value(value)) is None:
        raise NoValueError
    return number
