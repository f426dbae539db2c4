"""The equilibrium that a document gives, or asks to find, and the small oscillations about it."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.model.document import Document
from rigidcli.model.equilibrium import Equilibrium
from rigidcli.studies.hamilton.derivation import TIME, Derivation
from rigidcli.studies.hamilton.equilibrium import KEY, forces_at_rest, found_place, given_place
from rigidcli.studies.hamilton.system import known_values
from rigidcli.symbolic.algebra.calculus import substitute
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.mechanics import mass_matrix, small_oscillations
from rigidcli.symbolic.mechanics.normal_modes import FOUND, Mode, numeric_modes
from rigidcli.symbolic.mechanics.small_oscillations import LinearMotion
from rigidcli.symbolic.mechanics.symbolic_modes import LARGEST, symbolic_modes

NO_MODES = (
    "the modes have no closed form here: the characteristic polynomial has no factors of low degree; "
    "with values for all parameters they are told as numbers"
)
"""What is said where there are symbols, and no modes."""


@dataclass(frozen=True, slots=True)
class Oscillations:
    """The coordinates of the equilibrium, and the modes about it; None where these cannot be told."""

    place: Mapping[str, float | Expr]
    modes: Sequence[Mode] | None
    notes: tuple[str, ...]


def oscillations(document: Document, equilibrium: Equilibrium, derivation: Derivation) -> Oscillations:
    """The small oscillations about the equilibrium of a document.

    Raises DocumentError where it is none, and ComputationError where none is found, or the equations have no
    first order there.
    """
    try:
        forces, at_rest = forces_at_rest(document, derivation)
        names = derivation.phase.coordinates
        if equilibrium.is_sought:
            known = known_values(document)
            place, notes = found_place(document, equilibrium, names, forces)
        else:
            place, known, notes = given_place(document, equilibrium, names, forces)
        there = {name: substitute(p, known | place) for name, p in at_rest.items()} | known | place
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
    rounding = {"rounding": FOUND} if equilibrium.is_sought else {}
    modes = _modes(document, derivation, motion, known, rounding)
    if modes is None:
        notes = (*notes, NO_MODES)
    is_numeric = equilibrium.is_sought or not document.exact_results
    values = {name: float(e) if is_numeric and not e.names else e for name, e in place.items()}
    return Oscillations(values, modes, (*notes, *_conditions(modes or ())))


def _motion(derivation: Derivation, there: Mapping[str, Expr]) -> LinearMotion | None:
    lagrange, phase = derivation.lagrange, derivation.phase
    if lagrange is not None:
        return small_oscillations.of_lagrange(lagrange, phase, derivation.velocity_names, there)
    assert derivation.equations is not None
    return small_oscillations.of_hamilton(derivation.equations, phase, there)


def _is_singular(motion: LinearMotion) -> bool:
    """Whether the mass matrix has no inverse, as far as small blocks tell."""
    blocks = (mass_matrix.part(motion.masses, b, b) for b in mass_matrix.blocks(motion.masses))
    return any(is_zero(mass_matrix.determinant(block)) for block in blocks if len(block) <= LARGEST)


def _modes(
    document: Document,
    derivation: Derivation,
    motion: LinearMotion,
    known: Mapping[str, Expr],
    rounding: Mapping[str, float],
) -> list[Mode] | None:
    """The modes in symbols, where these are wanted or needed, or else in numbers."""
    entries = [e for part in (motion.masses, motion.rates, motion.stiffness) for row in part for e in row]
    if any(TIME in e.names for e in entries):
        raise ComputationError("the equations of motion near the equilibrium change with time")
    open_names = {name for e in entries for name in (*e.names, *e.unknown)}
    if document.exact_results or open_names:
        values = {name: float(value) for name, value in document.values.items()}
        found = symbolic_modes(motion, values)
        if found is not None or open_names:
            return found
    try:
        return numeric_modes(motion, not derivation.is_forced, **rounding)
    except ZeroDivisionError:
        raise ComputationError("the mass matrix is singular at the equilibrium") from None


def _conditions(modes: Sequence[Mode]) -> Iterator[str]:
    """Notes on modes whose kind depends on the values of symbols."""
    for mode in modes:
        if mode.condition is not None:
            yield f"the mode with the rate {mode.rate} oscillates where {mode.condition} > 0"
