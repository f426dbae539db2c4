"""The working of `hamilton`: from L to momenta, velocities, H and its equations, and what they conserve."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from rigidcli.report import Field, Step, Table
from rigidcli.symbolic.algebra.calculus import derivative
from rigidcli.symbolic.algebra.expressions import Expr, total
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.language.latex_names import latex_name
from rigidcli.symbolic.mechanics.hamilton_equations import Phase


class _Part(NamedTuple):
    """A step by the keys of the results, and of the tables, that it shows.

    Its `forced` sentence is for systems with forces beside L, if it is another one.
    """

    title: str
    sentence: str
    keys: tuple[str, ...]
    forced: str = ""


PARTS = (
    _Part("Lagrangian", "L tells how the system moves.", ("lagrangian",)),
    _Part(
        "Momenta",
        "The momentum of a coordinate q is the derivative of L by its velocity.",
        ("momentum_definitions",),
    ),
    _Part("Velocities", "These equations are solved for the velocities.", ("velocity_solutions",)),
    _Part(
        "Hamiltonian",
        "H is the sum of p_q qdot, less L, with the velocities as functions of the momenta.",
        ("hamiltonian", "branches"),
    ),
    _Part(
        "Hamilton's equations",
        "The rate of a coordinate is the derivative of H by its momentum, that of a momentum minus the "
        "derivative of H by its coordinate.",
        ("equations",),
        "The rate of a coordinate is the derivative of H by its momentum, that of a momentum minus the "
        "derivative of H by its coordinate, plus the force.",
    ),
    _Part(
        "Lagrange's equations",
        "The same motion in one equation of second order a coordinate: d/dt (dL/dqdot) - dL/dq vanishes.",
        ("lagrange_equations", "accelerations"),
        "The same motion in one equation of second order a coordinate: d/dt (dL/dqdot) - dL/dq is the force.",
    ),
    _Part(
        "Matrix form",
        "The equations are linear in the coordinates and momenta, which are the entries of z.",
        ("matrix", "offset", "frequencies", "stability"),
    ),
    _Part(
        "Energy",
        "Along the motion, dH/dt is the partial derivative of H by the time. T + V is the energy.",
        ("dH_dt", "energy", "h_equals_energy", "natural"),
        "Along the motion, dH/dt is the partial derivative of H by the time, plus the power of the forces. "
        "T + V is the energy.",
    ),
    _Part(
        "Small oscillations",
        "Near the equilibrium L is expanded to second order, and each mode oscillates at a rate of its own.",
        ("equilibrium", "modes"),
    ),
)
"""The steps that show results; one without results is left out."""


def hamilton_steps(
    fields: Sequence[Field],
    tables: Sequence[Table],
    phase: Phase,
    conserved: Iterable[tuple[str, Expr]],
    h: Expr | None,
    is_forced: bool,
) -> Iterator[Step]:
    """The way to the results, shown by these themselves; `conserved` quantities by the bracket with H."""
    parts: tuple[_Part, ...] = PARTS
    if not any(_belongs(entry, PARTS[1]) for entry in fields):
        parts = (_Part("Hamiltonian", "As it is given.", ("hamiltonian",)), *PARTS[4:])
    for part in parts:
        shown = tuple(_titled(entry) for entry in fields if _belongs(entry, part))
        listed = tuple(table for table in tables if table.key in part.keys)
        if shown or listed:
            sentence = part.forced if is_forced and part.forced else part.sentence
            yield Step(part.title, sentence, shown, listed)
    if h is None:
        return
    for name, e in conserved:
        slopes = [
            total(derivative(e, a) * derivative(h, b) for a, b in pairs)
            for pairs in (
                list(zip(phase.coordinates, phase.momenta, strict=True)),
                list(zip(phase.momenta, phase.coordinates, strict=True)),
            )
        ]
        yield Step(
            f"{name} is conserved",
            "Its bracket with H, the sum of df/dq dH/dp - df/dp dH/dq, vanishes, as both sums are equal.",
            (
                Field("", e, "f", "f"),
                Field("", tidy(slopes[0]), "sum of df/dq dH/dp", ""),
                Field("", tidy(slopes[1]), "sum of df/dp dH/dq", ""),
            ),
        )


def _belongs(entry: Field, part: _Part) -> bool:
    """Whether the result is to be shown in this part, and can be."""
    if entry.key.partition(".")[0] not in part.keys:
        return False
    if entry.key == "offset" and isinstance(entry.value, np.ndarray) and not any(entry.value.flat):
        return False
    return bool(entry.words) or not (
        entry.value is None or isinstance(entry.value, bool | list) or np.size(entry.value) == 0
    )


def _titled(entry: Field) -> Field:
    """The result under its title, or under the last part of its key."""
    if entry.title.strip():
        return replace(entry, key="", cells={})
    name = entry.key.rpartition(".")[2]
    return replace(entry, key="", cells={}, title=name, symbol=latex_name(name))
