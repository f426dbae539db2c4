"""An assignment held against itself: each key as it is shown, judged, and what would be said of mistakes."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path

from rigidcli.check.base import CODES
from rigidcli.check.judge import Item, outcome
from rigidcli.check.question import RELATIVE, Question, Tolerance
from rigidcli.errors import printable, shortened

EXACT = ("choice", "expression", "equations")
"""The kinds of which no tolerance is usual: a decimal in a formula stands for all that rounds to it."""


def selftest(items: Mapping[str, Item], questions: Mapping[str, Question]) -> Iterator[tuple[str, bool]]:
    """For each question what it would do, in words, and whether its own key is judged to be right."""
    for id, item in items.items():
        found, read_as = outcome(item, item.kind.typed(item.key), Path())
        is_right = found.verdict == "correct"
        named = ", ".join(dict.fromkeys(code for code, _ in item.changes))
        lines = [
            f"{printable(id)}: {item.kind.name}, {item.points:.12g} point{'s' * (item.points != 1)}",
            f"  key        {printable(shortened(item.reference or read_as))}",
            f"  judged     {', '.join([found.verdict, *(CODES[each.code] for each in found.findings)])}",
            f"  tolerance  {tolerance}" if (tolerance := _tolerance(item, questions[id].tolerance)) else "",
            f"  mistakes   {named}" if named else "",
            *(
                f"  accepted   {other.credit:.0%} {printable(other.message)}".rstrip()
                for other in item.accepted
            ),
        ]
        yield "".join(f"{line}\n" for line in lines if line), is_right


def _tolerance(item: Item, tolerance: Tolerance) -> str:
    """A tolerance in words; formulas have one only where the question says so, and words have none."""
    given = ", ".join(f"{name} {value:g}" for name, value in tolerance if value is not None)
    return given or ("" if item.kind.name in EXACT else f"relative {RELATIVE:g}")
