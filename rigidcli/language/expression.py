"""The expressions of documents and answers: read once and safely, worth a number in many ways.

    energy = parse("m*v^2/2")
    energy.names                                  # {'m', 'v'}
    energy.evaluate({"m": 2.0, "v": 3.0})         # 9.0

`read` in `parser` holds the grammar, `tree` the nodes, `functions` what may be called.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any, overload

from rigidcli.errors import ExpressionError
from rigidcli.language import evaluation
from rigidcli.language.functions import FUNCTIONS, RESERVED
from rigidcli.language.parser import read
from rigidcli.language.tree import Node, UnknownFunction

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

__all__ = ["FUNCTIONS", "RESERVED", "Expression", "parse"]


@dataclass(frozen=True, slots=True)
class Expression:
    """An expression that has been read; two are equal when their texts are."""

    text: str
    """The expression as it was typed."""
    root: Node = field(compare=False, repr=False)
    names: frozenset[str] = field(compare=False)
    """The symbols in it, `t` included, in ASCII spelling."""

    @overload
    def evaluate(self, values: Mapping[str, float]) -> float: ...
    @overload
    def evaluate(self, values: Mapping[str, float | NDArray[np.float64]]) -> float | NDArray[np.float64]: ...
    def evaluate(self, values: Mapping[str, float | NDArray[np.float64]]) -> float | NDArray[np.float64]:
        """The value where the names have these values.

        From floats comes a float. As soon as one of the names used is an array, all is done
        element by element, and an element without a finite real value is infinite or NaN.

        Raises:
            ExpressionError: a name has no value, or floats lead to no finite real value.
        """
        missing = sorted(name for name in self.names if name not in values)
        if missing:
            raise ExpressionError(f"no value for {', '.join(f'`{name}`' for name in missing[:5])}")
        known: Mapping[str, Any] = values
        if all(isinstance(known[name], (float, int)) for name in self.names):
            return evaluation.real(self.root, known)
        return evaluation.array(self.root, known)


def parse(text: str, functions: Mapping[str, UnknownFunction] | None = None) -> Expression:
    """Read a text in the expression language, in which there may be `functions` without a formula.

    Raises:
        ExpressionError: the text is not in the language or beyond its bounds.
    """
    root, names = read(text, functions or {})
    return Expression(text, root, names)
