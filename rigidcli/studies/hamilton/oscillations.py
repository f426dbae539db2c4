"""The equilibrium that a document gives, or asks to find, its small oscillations, and their report."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, cast

import numpy as np

from rigidcli.algebra import matrices
from rigidcli.algebra.atoms import Applied
from rigidcli.algebra.expressions import PI, ZERO, Expr, symbol
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute, without
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.document.variables import Equilibrium
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language.text import latex_name
from rigidcli.mechanics import small_oscillations
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.mechanics.linear_motion import LinearMotion, Root, Vector
from rigidcli.mechanics.numeric_spectrum import ROUNDING, ROUNDING_OF_FLOATS
from rigidcli.mechanics.spectrum import spectrum
from rigidcli.report import Column, Field, Table
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equilibrium import KEY, Place, forces_at_rest, found_place, given_place
from rigidcli.studies.hamilton.system import known_values

NO_MODES = (
    "the modes have no closed form here: the characteristic polynomial has no factors of low degree; "
    "with values for all parameters they are told as numbers"
)
"""This note stands where there are symbols, and no modes."""


UNITS = {"rate": "1/s", "frequency": "Hz", "period": "s", "decay": "1/s"}
"""Columns of the modes that people are shown where there is something in them, with their units."""


class Mode(NamedTuple):
    """A mode y = Re(v exp(s t)): the root s, and one of its vectors v."""

    root: Root
    vector: Vector

    @property
    def rate(self) -> float | Expr:
        """The rate of the root."""
        return self.root.rate


@dataclass(frozen=True, slots=True)
class Oscillations:
    """The coordinates of the equilibrium, the linear motion near it, and its modes, None where not known."""

    place: Mapping[str, float | Expr]
    motion: LinearMotion
    modes: Sequence[Mode] | None
    notes: tuple[str, ...]


def oscillations(document: Document, equilibrium: Equilibrium, derivation: Derivation) -> Oscillations:
    """The small oscillations about the equilibrium of a document.

    Raises DocumentError where it is none, and ComputationError where the search for one fails, or the
    equations have no first order there.
    """
    try:
        forces, at_rest = forces_at_rest(document, derivation)
        names = derivation.phase.coordinates
        find = found_place if equilibrium.is_sought else given_place
        place = find(document, equilibrium, names, forces)
        there = place.known | place.coordinates
        there |= {name: substitute(p, there) for name, p in at_rest.items()}
        still = dict.fromkeys(derivation.velocity_names, ZERO)
        _require_smooth([derivation.generator, *derivation.system.forces], there | still)
        motion = _motion(derivation, there)
    except ExpressionError as error:
        raise document.refusal(
            f"the equations of motion have no value there: {error.message}", KEY
        ) from error
    if motion is None or _is_singular(motion):
        raise ComputationError(
            "the momenta do not tell the velocities at the equilibrium",
            hint="other coordinates may do: angles fail at their poles",
        )
    assumed = {atom for e in place.assumed for atom in e.atoms if len(e.terms) == 1}
    motion = motion.changed(lambda e: tidy(without(e, assumed)))
    roots = _roots(document, derivation, motion, ROUNDING_OF_FLOATS if equilibrium.is_sought else ROUNDING)
    modes = None if roots is None else [Mode(root, vector) for root in roots for vector in root.vectors]
    is_numeric = equilibrium.is_sought or not document.exact_results
    values = {name: float(e) if is_numeric and not e.names else e for name, e in place.coordinates.items()}
    return Oscillations(values, motion, modes, tuple(_notes(place, modes)))


def _require_smooth(expressions: Sequence[Expr], there: Mapping[str, Expr]) -> None:
    """Raise ExpressionError where `abs` and `sign` have their corner or jump: nothing is linear there."""
    for atom in {atom for e in expressions for atom in e.everywhere()}:
        if isinstance(atom, Applied) and atom.function in ("abs", "sign"):
            (argument,) = atom.arguments
            if is_zero(substitute(argument, there)):
                raise ExpressionError(f"`{atom.function}({argument})` is not smooth")


def _motion(derivation: Derivation, there: Mapping[str, Expr]) -> LinearMotion | None:
    lagrange, phase = derivation.lagrange, derivation.phase
    if lagrange is not None:
        return small_oscillations.of_lagrange(lagrange, phase, derivation.velocity_names, there)
    assert derivation.equations is not None
    return small_oscillations.of_hamilton(derivation.equations, phase, there)


def _is_singular(motion: LinearMotion) -> bool:
    """Whether the mass matrix has no inverse, as far as small blocks tell."""
    blocks = (matrices.part(motion.masses, b, b) for b in matrices.blocks(motion.masses))
    return any(is_zero(matrices.determinant(block)) for block in blocks if len(block) <= matrices.LARGEST)


def _roots(
    document: Document, derivation: Derivation, motion: LinearMotion, rounding: float
) -> list[Root] | None:
    """The roots in symbols, where these are wanted or needed, or else in numbers; None without either."""
    if any(TIME in e.names for e in motion.entries):
        raise ComputationError("the equations of motion near the equilibrium change with time")
    known, is_free = known_values(document), not derivation.is_forced
    try:
        return spectrum(motion, known, document.exact_results, is_free, rounding)
    except ZeroDivisionError:
        raise ComputationError("the mass matrix is singular at the equilibrium") from None


def _notes(place: Place, modes: Sequence[Mode] | None) -> Iterator[str]:
    """Write notes on the search for the equilibrium, on what is assumed, and on where a mode oscillates."""
    if place.note:
        yield place.note
    yield from (f"it is an equilibrium where {e} = 0" for e in place.assumed)
    if modes is None:
        yield NO_MODES
    for mode in modes or ():
        if mode.root.condition is not None:
            yield f"the mode with the rate {mode.rate} oscillates where {mode.root.condition} > 0"


def fields(oscillations: Oscillations) -> list[Field]:
    """Report the equilibrium and its modes as JSON has them, and the rates of the modes for CSV."""
    modes = None if oscillations.modes is None else [_record(mode) for mode in oscillations.modes]
    rates = [mode.rate for mode in oscillations.modes or ()]
    kind = object if any(isinstance(rate, Expr) for rate in rates) else float
    cells = {f"modes.{place}.rate": (place,) for place in range(len(rates))}
    keys = {f"equilibrium.{name}": (name, e) for name, e in oscillations.place.items()}
    return [
        *(
            Field(key, e, f"equilibrium, {name}", latex_name(name), cells={key: ()})
            for key, (name, e) in keys.items()
        ),
        Field("modes", modes),
        Field("", np.array(rates, dtype=kind), cells=cells),
    ]


def _record(mode: Mode) -> dict[str, Any]:
    """Write a mode as JSON has it."""
    root, angular = mode.root, cast(Any, mode.root.angular)
    frequency = angular / (2 * (math.pi if isinstance(angular, float) else PI)) if angular else None
    is_complex = any(y for _, y in mode.vector)
    record = {
        "rate": mode.rate,
        "frequency": frequency,
        "period": None if frequency is None else 1 / frequency,
        "vector": [{"re": x, "im": y} if is_complex else x for x, y in mode.vector],
        "stable": root.is_stable,
    }
    return record | ({"decay": -root.growth} if root.growth and root.is_stable else {})


def tables(oscillations: Oscillations) -> list[Table]:
    """Make the table of the modes that people are shown, one mode in a row."""
    if not oscillations.modes:
        return []
    modes = oscillations.modes
    records = [_record(mode) for mode in modes]
    is_numeric = not any(isinstance(mode.rate, Expr) for mode in modes)
    columns = [
        Column(key, [record.get(key) for record in records], (key,), unit if is_numeric else "")
        for key, unit in UNITS.items()
        if key == "rate" or ((is_numeric or key == "decay") and any(r.get(key) for r in records))
    ]
    for place, name in enumerate(oscillations.place):
        entries = [_component(*mode.vector[place]) for mode in modes]
        columns.append(Column(name, entries, (name,), "", (latex_name(name),)))
    columns.append(Column("motion", [_kind(mode.root) for mode in modes], ("motion",), ""))
    return [Table("", "normal modes", tuple(columns))]


def _component(real: float | Expr, imaginary: float | Expr) -> float | Expr | str:
    """Write an entry of a mode vector; a number that is not real becomes a text."""
    if isinstance(real, Expr) and isinstance(imaginary, Expr):
        return real + imaginary * symbol("i")
    if not imaginary:
        return real
    written = f"{float(imaginary):.6g}i"
    return written if not real else f"{float(real):.6g} {'' if written[0] == '-' else '+'}{written}"


def _kind(root: Root) -> str:
    """Say in words how a mode moves."""
    if not root.growth and not root.angular:
        return "zero mode"
    if root.is_stable is None:
        return "depends on the parameters"
    if not root.is_stable:
        return "grows" if root.growth else "grows by powers of the time"
    return "decays" if root.growth else "stable"
