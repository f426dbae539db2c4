"""Results in chosen units: `--units g,cm,deg,rpm`."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import TypeAlias

import numpy as np

from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import (
    ANGLE,
    ANGULAR_VELOCITY,
    DIMENSIONLESS,
    LENGTH,
    MASS,
    TIME,
    Dimension,
    product_of_units,
)
from rigidcli.fields.units import Unit, is_unit, parse_unit
from rigidcli.render.values import is_exact
from rigidcli.report import Field, Report, Table, Value

Units: TypeAlias = Mapping[Dimension, Unit]  # the chosen units by their dimensions
# The base dimensions of results, in the order in which units are written, with their SI units.
BASES = {MASS: "kg", LENGTH: "m", TIME: "s", ANGLE: "rad"}


def read_units(text: str) -> Units:
    """The units in a list such as `g,cm,deg,rpm`.

    Raises ValueProblem where one is unknown, measures nothing, or is the second for its dimension.
    """
    units: dict[Dimension, Unit] = {}
    for name in text.split(","):
        unit = parse_unit(name)
        parts = [parse_unit(part).dimension for part in name.split() if is_unit(part)]
        if len(parts) == len(name.split()) > 1 and {*parts} <= {*BASES, ANGULAR_VELOCITY}:
            hint = f"write commas: `{','.join(name.split())}`"
            raise ValueProblem(f"no result has the unit `{unit.text}`", hint=hint)
        if unit.dimension == DIMENSIONLESS:
            raise ValueProblem(f"`{unit.text}` measures nothing", hint="expected units such as g,cm,deg,rpm")
        other = units.setdefault(unit.dimension, unit)
        if other is not unit:
            raise ValueProblem(f"`{other.text}` and `{unit.text}` are both units of {unit.dimension}")
    return units


def in_units(report: Report, units: Units) -> Report:
    """The report with its values in these `units`.

    A value has the chosen unit of its own dimension (rpm for an angular velocity), where there is one. Else
    it has a product of units of mass, length, time and angle (g cm^2), with SI units for those that are not
    chosen. Where all units of the product would be SI units, the value stays as it is.
    """
    fields = tuple(_field(entry, units) for entry in report.fields)
    swept = tuple(_field(entry, units) for entry in report.swept)
    tables = tuple(_table(table, units) for table in report.tables)
    scene = report.scene
    if scene is not None:
        scene = replace(scene, readings=_table(scene.readings, units))
    return replace(report, fields=fields, swept=swept, tables=tables, scene=scene)


def _field(entry: Field, units: Units) -> Field:
    value, unit = _converted(entry.value, entry.unit, units)
    return replace(entry, value=value, unit=unit)


def _table(table: Table, units: Units) -> Table:
    columns = []
    for column in table.columns:
        value, unit = _converted(column.values, column.unit, units)
        columns.append(replace(column, values=value, unit=unit))
    return replace(table, columns=tuple(columns))


def _converted(value: Value, text: str, units: Units) -> tuple[Value, str]:
    """A value with this SI unit in the chosen units, and its new unit."""
    unit = _unit_for(parse_unit(text), units) if text else None
    if unit is None or value is None:
        return value, text
    if isinstance(value, list):
        return [_converted(entry, text, units)[0] for entry in value], unit.text
    if not is_exact(value):
        return value / unit.scale, unit.text
    if any(number.names for number in np.ravel(value)):
        return value, text  # symbols bring units of their own
    from rigidcli.algebra.expressions import PI

    return value / (Fraction(unit.factor) * PI**unit.pi_power), unit.text


def _unit_for(si: Unit, units: Units) -> Unit | None:
    """The unit for values with this SI unit; None where the SI unit stays."""
    if si.scale != 1:
        return None  # a unit that the name of the result promises, such as years
    if si.dimension in units:
        return units[si.dimension]
    powers = {
        base: power
        for base in BASES
        if (power := sum(a * b for a, b in zip(si.dimension, base, strict=True)))
    }
    if not powers.keys() & units.keys():
        return None
    named = {units[base].text if base in units else BASES[base]: power for base, power in powers.items()}
    return parse_unit(product_of_units(named))
