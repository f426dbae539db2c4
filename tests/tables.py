"""Tables of truths as texts."""

from __future__ import annotations

import re


def words_of(text: str) -> list[str]:
    """The entries of a text: two blanks or more, or the end of a line, stand between them."""
    return re.split(r" {2,}|\n", text.strip())


def pairs_of(text: str) -> list[tuple[str, str]]:
    """The entries of a text that are pairs, with arrows between."""
    found = [entry.split(" -> ") for entry in words_of(text)]
    return [(first, second) for first, second in found]
