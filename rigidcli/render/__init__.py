"""Renderers turn reports into text, one complete piece after the other, so that output begins early."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import StrEnum
from functools import cache
from importlib import import_module
from pathlib import Path
from types import ModuleType
from typing import Any, Literal, NamedTuple, TypeAlias

from rigidcli.errors import UsageError
from rigidcli.report import Report


class Look(NamedTuple):
    """The look of the output.

    `digits`, `width`, `colour`, `verbose` (diagnostics): for people.
    `header`, `unit_header`: csv begins with a header; the header has units.
    `columns`: the columns of rows and of tables of data that are shown; empty for all.
    `several`: there are several documents; a table in csv then begins with a column of names.
    `standalone`: LaTeX is a whole document.
    """

    digits: int = 6
    header: bool = True
    width: int | None = None
    colour: bool = False
    columns: tuple[str, ...] = ()
    several: bool = False
    unit_header: bool = False
    verbose: bool = False
    standalone: bool = False


class Format(StrEnum):
    """The output formats, which `TRAITS` describes."""

    table = "table"
    json = "json"
    csv = "csv"
    latex = "latex"
    html = "html"
    parquet = "parquet"
    python = "python"
    c = "c"
    urdf = "urdf"
    sdf = "sdf"
    mjcf = "mjcf"


# The motions from many starts: `rows` of all samples that begin with the start, a report for each of the
# `starts`, or a `few` samples of each start, for a summary.
Ensembles: TypeAlias = Literal["rows", "starts", "few"]


class Traits(NamedTuple):
    """What a format can do.

    A format for `people` has a module with `render(reports, look)`. The other formats are data: their modules
    have `piece(report, look)`, and may have `render(pieces, look)` to join the pieces.

    `ensembles`: what it writes of a motion with many starts.
    `studies`: the only studies that write it; empty for all.
    `module`: its module, if several formats share one; then `piece` is called like the format.
    `program`: it is a program with the equations of one document.
    `page`: it shows pictures and replays.
    `terminal`: a chart of characters may follow it.
    `file`: the ending of its files, if it is no text.
    """

    ensembles: Ensembles = "starts"
    studies: tuple[str, ...] = ()
    module: str = ""
    program: bool = False
    page: bool = False
    terminal: bool = False
    file: str = ""

    @property
    def people(self) -> bool:
        """Whether people read it: it has chosen units and digits, the working, and comparisons."""
        return self.ensembles == "few"

    @property
    def rows(self) -> bool:
        """Whether a report without a table of data is a row."""
        return self.ensembles == "rows"


# The needs and abilities of the formats.
TRAITS = {
    Format.table: Traits(ensembles="few", terminal=True),
    Format.json: Traits(),
    Format.csv: Traits(ensembles="rows"),
    Format.latex: Traits(ensembles="few"),
    Format.html: Traits(ensembles="few", page=True),
    Format.parquet: Traits(ensembles="rows", file=".parquet"),
    **dict.fromkeys((Format.python, Format.c), Traits(studies=("hamilton",), module="program", program=True)),
    **dict.fromkeys((Format.urdf, Format.sdf, Format.mjcf), Traits(studies=("inertia",), module="inertial")),
}


def templates(file: str) -> dict[str, str]:
    """The texts in a file of this package by their names, each of which stands in a line after `===`."""
    text = Path(__file__).with_name(file).read_text("utf-8")
    return dict(re.findall(r"^=== (\w+)\n(.*?)(?=^===|\Z)", text, re.DOTALL | re.MULTILINE))


def formats_of(study: str) -> list[Format]:
    """The formats that a study writes."""
    return [format for format, traits in TRAITS.items() if study in (traits.studies or (study,))]


Renderer: TypeAlias = Callable[[Iterable[Report], Look], Iterator[Any]]


def renderer(name: Format) -> Renderer:
    """The renderer of a format; only its own module is loaded."""
    return lambda reports, look: joined(name, (piece(name, report, look) for report in reports), look)


def joined(name: Format, pieces: Iterable[Any], look: Look) -> Iterator[Any]:
    """The output in a format, text or bytes, from the pieces that `piece` made of the reports."""
    render: Callable[..., Iterator[Any]] | None = getattr(_module(name), "render", None)
    return iter(pieces) if render is None else render(pieces, look)


def piece(name: Format, report: Report, look: Look) -> Any:
    """The piece of the output for a report; in formats for people, the report itself.

    Raises RigidError where the report cannot be written in this format.
    """
    if TRAITS[name].people:
        return report
    return getattr(_module(name), name if TRAITS[name].module else "piece")(report, look)


def require_fit(name: Format, piece: Any, first: Any) -> None:
    """Raise ComputationError where a piece cannot stand in one table with the `first` one of a sweep."""
    if check := getattr(_module(name), "require_fit", None):
        check(piece, first)


@cache
def _module(name: Format) -> ModuleType:
    return import_module(f"rigidcli.render.{TRAITS[name].module or name}")


def require_columns(report: Report, names: Sequence[str], traits: Traits) -> None:
    """Raise UsageError unless the output for the report has columns with these names."""
    if not names:
        return
    heads = [name for column in report.data.columns for name in column.cells] if report.data else []
    if (traits.rows and not heads) or (report.swept and (traits.rows or traits.people)):
        from rigidcli.render.values import row_of

        heads = list(row_of(report))
    if not heads:
        hint = "`-f csv` writes the results as a row with columns"
        raise UsageError("this result has no table, and so no columns", hint=hint)
    for name in names:
        if name not in heads:
            raise UsageError(f"there is no column `{name}`", hint=f"the columns are {', '.join(heads)}")
