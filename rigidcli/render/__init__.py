"""Renderers make text of reports, one complete piece after the other, so that output begins early."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from enum import StrEnum
from importlib import import_module
from typing import TypeAlias

from rigidcli.report import Report


@dataclass(frozen=True, slots=True)
class Look:
    """The look of the output: significant digits for people, the csv header, width and colour.

    `columns` are those of tables of data, or of rows, to show, all of them when empty. With `several`
    documents, such a table in csv begins with a column of their names. Heads of csv have `unit_header` where
    they tell units, too. People see diagnostics when they are `verbose`, and the `steps` of the working on
    demand. LaTeX is a whole document where it is `standalone`.
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
    """The output formats; each is a module of this package with a function `render`: of bytes for parquet."""

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


PEOPLE = (Format.table, Format.latex, Format.html)
"""The formats that people read: in units of their choice, with as many digits as they ask for."""


PROGRAMS = (Format.python, Format.c)
"""The formats that are programs: of the equations of motion of a system."""

BLOCKS = (Format.urdf, Format.sdf, Format.mjcf)
"""The formats of robots: the mass and inertia of each document as a block to paste into a link."""


Renderer: TypeAlias = Callable[[Iterable[Report], Look], Iterator[str]]


def renderer(name: Format) -> Renderer:
    """The renderer of a format; only its own module is loaded."""
    render: Renderer = import_module(f"rigidcli.render.{name}").render
    return render
