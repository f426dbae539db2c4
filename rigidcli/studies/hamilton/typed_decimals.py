"""Results written with decimals for those who typed decimals."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import replace

import numpy as np

from rigidcli.algebra.expressions import Expr
from rigidcli.document.document import Document
from rigidcli.report import Field, Value

DECIMAL = re.compile(r"\.\d|\de-")
"""What the text of a decimal has, and no other part of an expression."""


def as_typed(fields: Iterable[Field], document: Document) -> list[Field]:
    """The results with decimals, where the system has some and exact ones are not asked for."""
    if document.exact_results or not DECIMAL.search(repr(document.system)):
        return list(fields)
    return [replace(entry, value=_in_decimals(entry.value)) for entry in fields]


def _in_decimals(value: Value) -> Value:
    """Exact expressions written with decimals, and all else as it is."""
    match value:
        case Expr():
            return value.in_decimals()
        case list():
            return [_in_decimals(entry) for entry in value]
        case dict():
            return {key: _in_decimals(entry) for key, entry in value.items()}
        case np.ndarray() if value.dtype == object:
            return np.array([_in_decimals(entry) for entry in value.flat], dtype=object).reshape(value.shape)
        case _:
            return value
