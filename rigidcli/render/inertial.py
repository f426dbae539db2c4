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
    back the same. The renderer raises ComputationError where there is no mass, or no number.
    """
    return partial(_filled, template)


def _filled(template: str, reports: Iterable[Report], look: Look) -> Iterator[str]:
    for report in reports:
        mass, centre, tensor = report["mass"], report["center_of_mass"], report["tensor_com"]
        if mass is None:
            raise ComputationError(f"{report.source}: a link has a mass, which this body lacks: `body.mass`")
        numbers = {"mass": _decimal(mass, report.source)}
        numbers |= {key: _decimal(entry, report.source) for key, entry in zip("xyz", centre, strict=True)}
        numbers |= {key: _decimal(tensor[place], report.source) for key, place in PLACES.items()}
        # A comment may not hold two hyphens in a row.
        name = printable(report.name).replace("--", "- -").rstrip("-")
        yield f"<!-- {name} -->\n{template.format(**numbers)}"


def _decimal(value: Value, source: str) -> str:
    """A number in decimal; raises ComputationError for one that holds symbols."""
    if is_exact(value):
        if value.names:
            hint = "give every parameter a value"
            raise ComputationError(f"{source}: `{value}` is no number, which a link needs", hint=hint)
        value = value.evaluate()
    return repr(float(value))
