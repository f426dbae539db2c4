"""Formulas that show numbers in their places, and are not worked out: 0.3*9.8*0.05*sin(0.5)."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from rigidcli.language.tree import (
    Node,
    Number,
    rebuilt,
)


@dataclass(frozen=True, slots=True)
class Formula:
    """A tree as it is to be written; renderers round its numbers to the digits that people ask for.

    The numbers of one that is `exact` stay as they are.
    """

    root: Node
    exact: bool = False

    names: ClassVar[frozenset[str]] = frozenset(("units",))
    """Something, as the numbers in a formula have units of their own."""

    def tree(self, digits: int | None = None) -> Node:
        """The tree, its numbers rounded to so many significant digits."""
        return self.root if digits is None or self.exact else _rounded(self.root, digits)


def _rounded(node: Node, digits: int) -> Node:
    if isinstance(node, Number):
        return Number(f"{node.value:.{digits}g}", node.value)
    return rebuilt(node, lambda operand: _rounded(operand, digits))
