"""What a study found: named values with their unit and symbol. No mechanics here, and no looks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, TypeAlias

Value: TypeAlias = Any
"""A number or array (floats, or exact), a text, a truth value, a list, or None for what is not known."""


@dataclass(frozen=True, slots=True)
class Field:
    """One result. `key` is its name in JSON; `cells` are its columns in CSV, with their places in the value.

    A cell's place is an index such as (0, 1) into an array, or () for a value that is one cell.
    `symbol` is LaTeX; `title` and `unit` are for people, who are not shown a field without a title, and
    see `words` instead of the value where there are any, and zero for entries of an array that are rounding
    noise beside its largest, unless each entry `counts` by itself.
    """

    key: str
    value: Value
    title: str = ""
    symbol: str = ""
    unit: str = ""
    cells: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    words: str = ""
    counts: bool = False


@dataclass(frozen=True, slots=True)
class Report(Mapping[str, Value]):
    """The answer of one study to one document; also a mapping from the keys of its fields to their values.

    `about` is what people are told first; `notes` are remarks on the numbers, for standard error.
    """

    schema: str
    name: str
    source: str
    title: str
    fields: tuple[Field, ...]
    notes: tuple[str, ...] = ()

    def __getitem__(self, key: str) -> Value:
        for entry in self.fields:
            if entry.key == key:
                return entry.value
        raise KeyError(key)

    def __iter__(self) -> Iterator[str]:
        return (entry.key for entry in self.fields)

    def __len__(self) -> int:
        return len(self.fields)
