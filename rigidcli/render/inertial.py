"""The `<inertial>` of a link in URDF, SDF and MJCF: the tensor about the centre of mass, along its axes.

Products of inertia are entries of the tensor, -sum m x y, in all three formats. Their templates stand in
`inertial.txt`.
"""

from __future__ import annotations

from functools import partial
from itertools import combinations_with_replacement

from rigidcli.errors import ComputationError, printable
from rigidcli.render import Look, templates
from rigidcli.render.values import is_exact
from rigidcli.report import Report


def _block(template: str, report: Report, look: Look) -> str:
    """A template filled with `mass` (kg), `x`, `y`, `z` (m) and `Ixx` to `Izz` (kg m^2) of a report.

    Numbers are the shortest that read back the same. Raises ComputationError where the report has no mass, or
    a number without a value.
    """
    if report["mass"] is None:
        raise ComputationError("a link needs a mass, and this body has none: give `body.mass`")
    centre, tensor = report["center_of_mass"], report["tensor_com"]
    values = {"mass": report["mass"], **dict(zip("xyz", centre, strict=True))}
    for row, column in combinations_with_replacement(range(3), 2):
        values[f"I{'xyz'[row]}{'xyz'[column]}"] = tensor[row, column]
    names = sorted({name for value in values.values() if is_exact(value) for name in value.names})
    if names:
        raise ComputationError(
            f"a link needs numbers, and `{names[0]}` has no value", hint="give it one by `--set`"
        )
    # A comment may not hold two hyphens in a row.
    name = printable(report.name).replace("--", "- -").rstrip("-")
    floats = {key: float(value.evaluate() if is_exact(value) else value) for key, value in values.items()}
    return f"<!-- {name} -->\n{template.format(**floats)}"


_TEMPLATES = templates("inertial.txt")
urdf, sdf, mjcf = (partial(_block, _TEMPLATES[name]) for name in ("urdf", "sdf", "mjcf"))
