"""Tables of truths as texts: a line is a case, and bars stand between its cells."""

from __future__ import annotations


def rows(text: str) -> list[tuple[str, ...]]:
    """The cells of each line; a line that begins with blanks goes on with the one before."""
    lines = text.strip().replace("\n  ", " ").split("\n")
    return [tuple(cell.strip() for cell in line.split(" | ")) for line in lines]
