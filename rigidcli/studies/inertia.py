"""`inertia`: mass, centre of mass, and the inertia tensor about a point."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import PurePath

import numpy as np

from rigidcli.core import tensor
from rigidcli.core.arithmetic import Array, Scalar
from rigidcli.errors import ComputationError, DocumentError, Problem
from rigidcli.model.document import Document
from rigidcli.model.load import STDIN
from rigidcli.report import Field, Report, Table, Value

SCHEMA = "rigidcli.inertia/1"


@dataclass(frozen=True, slots=True, eq=False)
class Inertia:
    """Mass properties as they are reported: about a point, with all components along `axes`.

    `axes` (3 by 3) has these axes as columns, in the document's components. `com`, and `central`, the tensor
    about it, are None when nothing is known but a tensor about another point.
    """

    axes: Array
    about: Array
    tensor: Array
    mass: Scalar | None
    com: Array | None
    central: Array | None


@np.errstate(over="ignore", invalid="ignore")
def inertia(document: Document) -> Inertia:
    """The inertia of a document's body.

    Raises DocumentError when it has none, and ComputationError when floats cannot hold it.
    """
    if document.body is None:
        raise DocumentError([Problem(document.source, "missing, expected a body", key="body")])
    n, body = document.arithmetic, document.properties
    axes = document.axes
    about = n.tidy(axes.T @ document.point)
    central = n.tidy(tensor.rotate(body.tensor, axes.T))
    com = n.tidy(axes.T @ body.com)
    if body.mass is None:
        known = body.at_com
        return Inertia(axes, about, central, None, com if known else None, central if known else None)
    asked = n.tidy(tensor.rotate(document.tensor, axes.T))
    mass = n.tidy(n.array([body.mass]))[0]
    if not n.exact and not np.isfinite([mass, *asked.flat]).all():
        raise ComputationError("the inertia tensor is beyond the range of floating-point numbers")
    return Inertia(axes, about, asked, mass, com, central)


def run(document: Document) -> Report:
    """Answer the document's question about its inertia."""
    return report(document, SCHEMA, "inertia tensor", fields(inertia(document)))


def fields(body: Inertia) -> tuple[Field, ...]:
    """What every report on a body begins with."""
    matrix = {"xx": (0, 0), "yy": (1, 1), "zz": (2, 2), "xy": (0, 1), "xz": (0, 2), "yz": (1, 2)}
    return (
        Field("mass", body.mass, "mass", "M", "kg", {"mass": ()}),
        Field(
            "center_of_mass",
            body.com,
            "centre of mass",
            r"\mathbf{R}",
            "m",
            {f"com_{axis}": (index,) for index, axis in enumerate("xyz")},
        ),
        Field("about", body.about, "about the point O", r"\mathbf{O}", "m"),
        Field(
            "tensor",
            body.tensor,
            "inertia tensor about O",
            r"\mathbf{I}_O",
            "kg m^2",
            {f"I{name}": place for name, place in matrix.items()},
        ),
        Field("tensor_com", body.central, "about the centre of mass", r"\mathbf{I}_\mathrm{cm}", "kg m^2"),
    )


def report(
    document: Document,
    schema: str,
    title: str,
    fields: tuple[Field, ...],
    notes: tuple[str, ...] = (),
    tables: tuple[Table, ...] = (),
) -> Report:
    """The report of a study; refused when a number in it is beyond what a float can hold."""
    if not document.arithmetic.exact:
        fields = tuple(replace(field, value=_settled(field)) for field in fields)
    name = document.name or ("stdin" if document.source == STDIN else PurePath(document.source).stem)
    return Report(
        schema, name, document.source, title, fields, (*document.notes, *notes), tuple(map(_signless, tables))
    )


def _signless(table: Table) -> Table:
    """A table in whose arrays no zero has a sign."""
    columns = (
        replace(column, values=column.values + 0.0) if isinstance(column.values, np.ndarray) else column
        for column in table.columns
    )
    return replace(table, columns=tuple(columns))


def _settled(field: Field) -> Value:
    """A floating result as it is handed out: arrays contiguous, and no zero with a sign."""
    if not isinstance(field.value, float | np.ndarray) or np.asarray(field.value).dtype.kind != "f":
        return field.value
    size = float(np.abs(field.value).max(initial=0.0))
    if not np.isfinite(size) or 0 < size < np.finfo(np.float64).tiny:
        raise ComputationError(
            f"the {field.title or field.key} is beyond the range of floating-point numbers"
        )
    return (
        np.ascontiguousarray(field.value) + 0.0 if isinstance(field.value, np.ndarray) else field.value + 0.0
    )
