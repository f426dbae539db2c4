"""Pages of text for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

WIDTH = 80
"""The columns of a page: those of the narrowest terminal that people use."""

INDENT = "  "


def paragraph(text: str, indent: str = "") -> str:
    """A text of sentences, broken into lines."""
    return textwrap.fill(" ".join(text.split()), WIDTH, initial_indent=indent, subsequent_indent=indent)


def rows(entries: Sequence[tuple[str, str]], most: int = 28) -> str:
    """Names and what they are, side by side; a name longer than `most` has a line of its own."""
    widest = max((len(name) for name, _ in entries if len(name) <= most), default=0)
    margin = " " * (len(INDENT) + widest + 2)
    lines = []
    for name, text in entries:
        first = f"{INDENT}{name:{widest}}  "
        if len(name) > widest and text:
            lines.append(f"{INDENT}{name}")
            first = margin
        filled = textwrap.wrap(" ".join(text.split()), WIDTH - len(margin), break_on_hyphens=False) or [""]
        lines += [(first if not place else margin) + line for place, line in enumerate(filled)]
    return "\n".join(line.rstrip() for line in lines)


def words(names: Iterable[str]) -> str:
    """Names one after the other."""
    return textwrap.fill(
        ", ".join(names), WIDTH, initial_indent=INDENT, subsequent_indent=INDENT, break_on_hyphens=False
    )


def page(*parts: str) -> str:
    """Parts with an empty line between them."""
    return "\n\n".join(part for part in parts if part) + "\n"
