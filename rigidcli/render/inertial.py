"""Mass, centre of mass and tensor of reports, as the formats of robots write them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from rigidcli.errors import ComputationError, printable
from rigidcli.render import Look, Renderer
from rigidcli.render.values import is_exact
from rigidcli.report import Report, Value

PLACES = {f"I{'xyz'[row]}{'xyz'[column]}": (row, column) for row in range(3) for column in range(row, 3)}
"""The names of the entries of a tensor, and their places in it."""


def block(template: str) -> Renderer:
    """A renderer that fills a template: `name`, `mass`, `x`, `y`, `z` (m) and `Ixx` to `Izz` (kg m^2).

    The tensor is about the centre of mass, along the axes of the results. Numbers are the shortest that read
    back the same.
    """
    return partial(_filled, template)


def require_numbers(report: Report) -> None:
    """Raise ComputationError where a report has no mass, or none of which the value is known."""
    if report["mass"] is None:
        raise ComputationError("a link has a mass, which this body lacks: `body.mass`")
    values = [report["mass"], *report["center_of_mass"], *report["tensor_com"].flat]
    names = sorted({name for value in values if is_exact(value) for name in value.names})
    if names:
        raise ComputationError(
            f"a link has numbers: `{names[0]}` has no value", hint="give it one by `--set`"
        )


def _filled(template: str, reports: Iterable[Report], look: Look) -> Iterator[str]:
    for report in reports:
        centre, tensor = report["center_of_mass"], report["tensor_com"]
        values = {"mass": report["mass"], **dict(zip("xyz", centre, strict=True))}
        values |= {key: tensor[place] for key, place in PLACES.items()}
        # A comment may not hold two hyphens in a row.
        name = printable(report.name).replace("--", "- -").rstrip("-")
        yield f"<!-- {name} -->\n{template.format(**{key: _decimal(value) for key, value in values.items()})}"


def _decimal(value: Value) -> str:
    return repr(float(value.evaluate() if is_exact(value) else value))
