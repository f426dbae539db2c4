"""Mass, centre of mass and tensor of reports, as the formats of robots write them."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

from rigidcli.errors import ComputationError, printable
from rigidcli.render import Look
from rigidcli.render.values import is_exact
from rigidcli.report import Report, Value

PLACES = {f"I{'xyz'[row]}{'xyz'[column]}": (row, column) for row in range(3) for column in range(row, 3)}
"""The names of the entries of a tensor, and their places in it."""


def block(template: str) -> Callable[[Report, Look], str]:
    """What fills a template: `name`, `mass`, `x`, `y`, `z` (m) and `Ixx` to `Izz` (kg m^2) of a report.

    The tensor is about the centre of mass, along the axes of the results. Numbers are the shortest that read
    back the same. It raises ComputationError where the report has no mass, or a number without a value.
    """
    return partial(_filled, template)


def _filled(template: str, report: Report, look: Look) -> str:
    if report["mass"] is None:
        raise ComputationError("a link has a mass, which this body lacks: `body.mass`")
    centre, tensor = report["center_of_mass"], report["tensor_com"]
    values = {"mass": report["mass"], **dict(zip("xyz", centre, strict=True))}
    values |= {key: tensor[place] for key, place in PLACES.items()}
    names = sorted({name for value in values.values() if is_exact(value) for name in value.names})
    if names:
        raise ComputationError(
            f"a link has numbers: `{names[0]}` has no value", hint="give it one by `--set`"
        )
    # A comment may not hold two hyphens in a row.
    name = printable(report.name).replace("--", "- -").rstrip("-")
    return f"<!-- {name} -->\n{template.format(**{key: _decimal(value) for key, value in values.items()})}"


def _decimal(value: Value) -> str:
    return repr(float(value.evaluate() if is_exact(value) else value))
