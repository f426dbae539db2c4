"""The results on constraints: multipliers, forces of constraint, degrees of freedom, and their working."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol, total
from rigidcli.document.document import Document
from rigidcli.document.variables import acceleration
from rigidcli.language.text import latex_name
from rigidcli.report import Column, Field, Step, Table, yes_or_no
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.findings import as_typed
from rigidcli.studies.results import field_of


def fields(derivation: Derivation) -> list[Field]:
    """The multipliers, the forces of the constraints, and how many ways are left to move."""
    limits, phase = derivation.system.constraints, derivation.phase
    shown = [field_of("hamilton", "degrees_of_freedom", len(phase.coordinates) - len(limits))]
    if derivation.multipliers is None or derivation.constraint_forces is None:
        return [*shown, Field("multipliers", None), Field("constraint_forces", None)]
    solved = zip([one.name for one in limits], derivation.multipliers, strict=True)
    shown += [_named(f"multipliers.{name}", e, name, latex_name(name)) for name, e in solved]
    forces = zip(phase.coordinates, derivation.constraint_forces, strict=True)
    for q, e in forces:
        sign = f"R_{{{latex_name(q)}}}"
        entry = _named(f"constraint_forces.{q}", e, f"force of constraint, {q}", sign)
        # A force that is a multiplier is shown already.
        shown.append(replace(entry, diagnostic=e.is_zero or e in derivation.multipliers))
    return shown


def _named(key: str, e: Expr, title: str, sign: str) -> Field:
    return Field(key, e, title, sign, cells={key: ()})


def tables(derivation: Derivation, document: Document) -> list[Table]:
    """A table of the constraints, as they are typed; none without constraints."""
    limits = derivation.system.constraints
    if not limits:
        return []
    (typed,) = as_typed([Field("", [one.expression for one in limits])], document)
    kinds = [one.holonomic for one in limits]
    columns = (
        Column("name", [one.name for one in limits], ("multiplier",)),
        Column("expression", typed.value, ("what vanishes",)),
        Column("holonomic", kinds, ("holonomic",), words=tuple(map(yes_or_no, kinds))),
    )
    return [Table("constraints", "constraints", columns, records=True)]


def steps(derivation: Derivation, shown: list[Field]) -> Iterator[Step]:
    """Lead from the constraints to their multipliers; `shown` are the results on them."""
    limits, phase = derivation.system.constraints, derivation.phase
    matrix = np.array([one.slopes for one in limits], dtype=object)
    rates = [Field("", one.expression, one.name, latex_name(one.name)) for one in limits]
    yield Step(
        "Constraints",
        "These vanish. The entry a_ji of the matrix A is the derivative of the j-th by the i-th coordinate, "
        "or by its velocity where the constraint has velocities. It acts on that coordinate with the force "
        "lambda_j a_ji, which stands in the equations already.",
        (*rates, Field("", matrix, "A", r"\mathbf{A}")),
    )
    second = []
    for one in limits:
        moved = total(a * symbol(acceleration(q)) for a, q in zip(one.slopes, phase.coordinates, strict=True))
        if not one.has_velocities:
            second.append(Field("", one.rate, f"{one.name}, once: 0 =", "0"))
        times = "once" if one.has_velocities else "twice"
        second.append(Field("", moved + one.turning, f"{one.name}, {times}: 0 =", "0"))
    yield Step(
        "Differentiated constraints",
        "The constraints hold all the time, so that their derivatives by the time vanish, too. They are "
        "differentiated until there are accelerations in them.",
        tuple(second),
    )
    yield Step(
        "Multipliers",
        "The accelerations of Lagrange's equations are put into the differentiated constraints, which are "
        "solved for the multipliers. These give the forces of constraint, and the accelerations.",
        tuple(shown),
    )
