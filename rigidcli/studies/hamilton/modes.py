"""What a report tells of an equilibrium and its normal modes."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.algebra.expressions import PI, Expr, symbol
from rigidcli.language.latex_names import latex_name
from rigidcli.report import Column, Field, Table

if TYPE_CHECKING:
    from rigidcli.mechanics.spectrum import Mode
    from rigidcli.studies.hamilton.oscillations import Oscillations

UNITS = {"rate": "1/s", "frequency": "Hz", "period": "s", "decay": "1/s"}
"""Columns of the modes that people are shown where there is something in them, with their units."""


def fields(found: Oscillations | None) -> list[Field]:
    """The equilibrium, and its modes as JSON has them; for CSV their rates."""
    if found is None:
        return [Field("equilibrium", None), Field("modes", None)]
    modes = None if found.modes is None else [_record(mode) for mode in found.modes]
    rates = [mode.rate for mode in found.modes or ()]
    kind = object if any(isinstance(rate, Expr) for rate in rates) else float
    cells = {f"modes.{place}.rate": (place,) for place in range(len(rates))}
    return [
        *(
            Field(
                f"equilibrium.{name}",
                e,
                f"equilibrium, {name}",
                latex_name(name),
                cells={f"equilibrium.{name}": ()},
            )
            for name, e in found.place.items()
        ),
        Field("modes", modes),
        Field("", np.array(rates, dtype=kind), cells=cells),
    ]


def _record(mode: Mode) -> dict[str, Any]:
    """A mode as JSON has it."""
    oscillates = bool(mode.angular)
    record = {
        "rate": mode.rate,
        "frequency": _turns(mode.angular) if oscillates else None,
        "period": 1 / _turns(mode.angular) if oscillates else None,
        "vector": [{"re": x, "im": y} for x, y in mode.vector]
        if any(y for _, y in mode.vector)
        else [x for x, _ in mode.vector],
        "stable": mode.is_stable,
    }
    return record | ({"decay": -mode.growth} if mode.growth and mode.is_stable else {})


def _turns(angular: float | Expr) -> float | Expr:
    """Turns per second from an angular frequency."""
    return angular / (2 * math.pi) if isinstance(angular, float) else angular / (2 * PI)


def tables(found: Oscillations | None) -> list[Table]:
    """The modes for people: a row each."""
    if found is None or not found.modes:
        return []
    modes = found.modes
    records = [_record(mode) for mode in modes]
    is_numeric = not any(isinstance(mode.rate, Expr) for mode in modes)
    columns = [
        Column(key, [record.get(key) for record in records], (key,), unit if is_numeric else "")
        for key, unit in UNITS.items()
        if key == "rate" or ((is_numeric or key == "decay") and any(r.get(key) for r in records))
    ]
    for place, name in enumerate(found.place):
        entries = [_component(*mode.vector[place]) for mode in modes]
        columns.append(Column(name, entries, (name,), "", (latex_name(name),)))
    columns.append(Column("motion", [_kind(mode) for mode in modes], ("motion",), ""))
    return [Table("", "normal modes", tuple(columns))]


def _component(real: float | Expr, imaginary: float | Expr) -> float | Expr | str:
    """An entry of a mode vector; in numbers a text where it is not real."""
    if isinstance(real, Expr) and isinstance(imaginary, Expr):
        return real + imaginary * symbol("i")
    if not imaginary:
        return real
    written = f"{float(imaginary):.6g}i"
    return written if not real else f"{float(real):.6g} {'' if written[0] == '-' else '+'}{written}"


def _kind(mode: Mode) -> str:
    """How a mode moves, in words."""
    if not mode.growth and not mode.angular:
        return "zero mode"
    if mode.is_stable is None:
        return "depends on the parameters"
    if not mode.is_stable:
        return "grows" if mode.growth else "grows by powers of the time"
    return "decays" if mode.growth else "stable"
