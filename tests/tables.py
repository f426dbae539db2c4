"""Tables of truths, in YAML and as texts."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import yaml


@cache
def _tables(path: Path) -> Any:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def rows_of(test: str, table: str) -> Any:
    """A table by its name, in the file .yaml beside the file of a test and with the same name."""
    return _tables(Path(test).with_suffix(".yaml"))[table]


def words_of(text: str) -> list[str]:
    """The entries of a text: two blanks or more, or the end of a line, stand between them."""
    return re.split(r" {2,}|\n", text.strip())


def pairs_of(text: str) -> list[tuple[str, str]]:
    """The entries of a text that are pairs, with arrows between."""
    found = [entry.split(" -> ") for entry in words_of(text)]
    return [(first, second) for first, second in found]
