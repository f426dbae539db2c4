"""The results of a study: named values and tables with units and symbols, without mechanics or looks."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from rigidcli.language.code import Formulas
    from rigidcli.picture import Picture

# Entries of an array below this, in units of its largest, are shown to people as zero: a few roundings.
NOISE = 4 * 2.0**-52
# A number or array (floats, or exact), a text, a truth value, a list, or None for a missing value.
Value: TypeAlias = Any


@dataclass(slots=True)
class Field:
    """One result.

    `key`: its name in JSON, which lacks a field without a key; a dot leads into an object, as in `top.spin`.
    `title`, `unit`: for people, who do not see a field without a title. `symbol`: LaTeX.
    `cells`: its columns in CSV, each with an index into the value such as (0, 1); () is the value itself.
    `words`: what people see instead of the value.
    `counts`: each entry of an array counts by itself; else entries that are noise beside the largest are 0.
    `diagnostic`: tells how good other results are, and is shown by `-v`.
    `means`: what the title does not say.
    """

    key: str
    value: Value
    title: str = ""
    symbol: str = ""
    unit: str = ""
    cells: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    words: str = ""
    counts: bool = False
    diagnostic: bool = False
    means: str = ""


@dataclass(frozen=True, slots=True)
class Column:
    """One quantity of a table.

    `values`: a number for each row (n), or a vector (n, k); a list may stand for an array.
    `key`: its name in JSON; a dot leads into an object.
    `cells`: the names of its k components in CSV and in the heads of tables; `symbols` are the same in LaTeX.
    `hidden`: people see it by `-v`, or when they ask for it.
    `noise`: numbers below this share of the largest are shown as 0.
    `words`: what people see instead of the values.
    """

    key: str
    values: Value
    cells: tuple[str, ...]
    unit: str = ""
    symbols: tuple[str, ...] = ()
    hidden: bool = False
    noise: float = NOISE
    words: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Table:
    """Columns of equal length. In JSON, `key` holds a list of rows (`records`), or an object of columns.

    A table without a key is not in JSON. The table of `data` stands in CSV instead of the fields of its
    report, and people see a few of its rows.
    """

    key: str
    title: str
    columns: tuple[Column, ...]
    records: bool = False
    data: bool = False

    def __len__(self) -> int:
        return len(self.columns[0].values)


@dataclass(frozen=True, slots=True)
class Step:
    """One step of the way to the results, for those who want to see the working: a title, sentences that say
    what is done, and what comes out of it, in fields and tables without keys."""

    title: str
    sentence: str
    fields: tuple[Field, ...] = ()
    tables: tuple[Table, ...] = ()


class Run(NamedTuple):
    """What a program does: from the values `start` of its variables at t = 0 to those at `times` (k, s).

    `sizes` are those of the variables on the way, with which their errors are compared.
    """

    start: Sequence[float]
    sizes: Sequence[float]
    times: NDArray[np.float64]


class Program(NamedTuple):
    """Differential equations of first order, as a program in any language needs them.

    `about` are remarks, line by line. `constants` are numbers by their names, None where there is no value.
    The derivatives of the `variables` by `time` are the values of `rates`; each of the `quantities` has one
    value, and its name. What is to be printed are the `columns`: the time, variables and quantities.
    Without a `run` there is nowhere to begin.
    """

    about: Sequence[str]
    constants: Mapping[str, float | None]
    time: str
    variables: Sequence[str]
    rates: Formulas
    quantities: Mapping[str, Formulas]
    columns: Sequence[str]
    run: Run | None = None


@dataclass(frozen=True)  # without slots, for the tree is kept
class Report(Mapping[str, Value]):
    """The answer of one study to one document; also a mapping from the keys of JSON to their values.

    `notes`: remarks on the numbers, for standard error.
    `steps`, `pictures`, `program`, `scene`: the working, pictures, equations as a program, and the replay of
    a motion, each of which is made on demand.
    `document`: the text that was read. `swept`: the values at this point of a sweep;
    `motions`: the reports of a sweep that a page shows by turns.
    """

    schema: str
    name: str
    source: str
    title: str
    fields: tuple[Field, ...]
    notes: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    steps: tuple[Step, ...] = ()
    pictures: tuple[Picture, ...] = ()
    program: Program | None = None
    scene: Value = None
    document: str = ""
    swept: tuple[Field, ...] = ()
    motions: tuple[Report, ...] = ()

    @property
    def heading(self) -> str:
        """The name of the document, if it has one, and the title."""
        return self.about(self.title)

    def about(self, title: str) -> str:
        """A title behind the name of the document, if it has one."""
        return f"{self.name}: {title}" if self.name else title

    @cached_property
    def tree(self) -> dict[str, Value]:
        """All values as JSON nests them; a table with the key of a field shows that field to people."""
        tree: dict[str, Value] = {}
        pairs = [(entry.key, entry.value) for entry in self.fields if entry.key]
        for table in (each for each in self.tables if each.key):
            if table.records:
                rows = range(len(table))
                records = [{column.key: column.values[row] for column in table.columns} for row in rows]
                pairs.append((table.key, records))
            else:
                pairs += [(f"{table.key}.{column.key}", column.values) for column in table.columns]
        for key, value in pairs:
            *way, last = key.split(".")
            place = tree
            for step in way:
                place = place.setdefault(step, {})
            place.setdefault(last, value)
        return tree

    @property
    def data(self) -> Table | None:
        """The table of a motion or an orbit, which csv writes instead of the fields."""
        return next((table for table in self.tables if table.data), None)

    @property
    def units(self) -> dict[str, str]:
        """The units of the values that have one, by their keys: a dot is the way into an object."""
        units = {entry.key: entry.unit for entry in self.fields if entry.key and entry.unit}
        for table in self.tables:
            if table.key:
                units |= {f"{table.key}.{column.key}": column.unit for column in table.columns if column.unit}
        return units

    def __getitem__(self, key: str) -> Value:
        return self.tree[key]

    def __iter__(self) -> Iterator[str]:
        return iter(self.tree)

    def __len__(self) -> int:
        return len(self.tree)


def yes_or_no(value: bool | None, unknown: str = "-") -> str:
    """A truth value as people read it."""
    if value is None:
        return unknown
    return "yes" if value else "no"


def single_cells(table: Table, names: Sequence[str] = ()) -> list[Column]:
    """The columns of a table cut into those of one cell each: these `names` in that order, or all."""
    every = [
        replace(
            column,
            values=column.values if len(column.cells) == 1 else column.values[:, index],
            cells=(name,),
            symbols=column.symbols[index : index + 1],
        )
        for column in table.columns
        for index, name in enumerate(column.cells)
    ]
    by_name = {column.cells[0]: column for column in every}
    return [by_name[name] for name in names] or every
