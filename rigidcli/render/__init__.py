"""Renderers turn reports into text, one complete piece after the other, so that output begins early."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from enum import StrEnum
from importlib import import_module
from types import ModuleType
from typing import Any, Literal, NamedTuple, TypeAlias

from rigidcli.errors import UsageError
from rigidcli.report import Report


class Look(NamedTuple):
    """The look of the output: significant digits for people, the csv header, width and colour.

    `columns` are those of rows and of tables of data that are shown; none stands for all. With `several`
    documents, a table in csv begins with a column of names. With `unit_header`, heads of csv have units. For
    people, `verbose` shows the diagnostics and `steps` the working. `standalone` LaTeX is a whole document.
    """

    digits: int = 6
    header: bool = True
    width: int | None = None
    colour: bool = False
    columns: tuple[str, ...] = ()
    several: bool = False
    unit_header: bool = False
    verbose: bool = False
    steps: bool = False
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


Ensembles: TypeAlias = Literal["rows", "starts", "few"]
"""The motions from many starts: `rows` of all samples that begin with the start, a report for each of the
`starts`, or a `few` samples of each start, for a summary."""


class Traits(NamedTuple):
    """The needs and abilities of a format.

    A format for `people` has units and digits by choice, the working, and comparisons: its module has a
    function `render(reports, look)`. The others are data: their modules make each report a piece of output by
    `piece(report, look)`, or, where several formats share a `module`, by the function with the format's name;
    a function `render(pieces, look)` may join the pieces. Reports without data may be `rows` of a table. Only
    these `studies` write it, or all. A `program` is written from one document. A `page` shows pictures and
    motions. A chart of characters may follow the text on a `terminal`. A `file` has this ending.
    """

    people: bool = False
    rows: bool = False
    ensembles: Ensembles = "starts"
    studies: tuple[str, ...] = ()
    module: str = ""
    program: bool = False
    page: bool = False
    terminal: bool = False
    file: str = ""


_PROGRAM = Traits(studies=("hamilton",), module="program", program=True)
_BLOCK = Traits(studies=("inertia",), module="inertial")

TRAITS = {
    Format.table: Traits(people=True, ensembles="few", terminal=True),
    Format.json: Traits(),
    Format.csv: Traits(rows=True, ensembles="rows"),
    Format.latex: Traits(people=True, ensembles="few"),
    Format.html: Traits(people=True, ensembles="few", page=True),
    Format.parquet: Traits(rows=True, ensembles="rows", file=".parquet"),
    Format.python: _PROGRAM,
    Format.c: _PROGRAM,
    Format.urdf: _BLOCK,
    Format.sdf: _BLOCK,
    Format.mjcf: _BLOCK,
}
"""The needs and abilities of the formats."""


def formats_of(study: str) -> list[Format]:
    """The formats that a study writes."""
    return [format for format, traits in TRAITS.items() if study in (traits.studies or (study,))]


Renderer: TypeAlias = Callable[[Iterable[Report], Look], Iterator[Any]]


def renderer(name: Format) -> Renderer:
    """The renderer of a format; only its own module is loaded."""
    return lambda reports, look: joined(name, (piece(name, report, look) for report in reports), look)


def joined(name: Format, pieces: Iterable[Any], look: Look) -> Iterator[Any]:
    """The output in a format, text or bytes, from the pieces that `piece` made of the reports."""
    render = getattr(_module(name), "render", None)
    output: Iterator[Any] = iter(pieces) if render is None else render(pieces, look)
    return output


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
        raise UsageError("there are no samples here, and no columns to choose", hint=hint)
    for name in names:
        if name not in heads:
            raise UsageError(f"`{name}` is no column here", hint=f"the columns are {', '.join(heads)}")
