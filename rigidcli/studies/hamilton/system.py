"""What a document says of a system: its Lagrangian or Hamiltonian, its energies, and its coordinates."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.calculus import coefficients, derivative
from rigidcli.symbolic.algebra.expressions import ZERO, Expr, total
from rigidcli.symbolic.algebra.reading import from_tree
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.language.text import text
from rigidcli.symbolic.mechanics import energies

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.model.system import Particle, System
    from rigidcli.symbolic.language.expression import Expression


@dataclass(frozen=True, slots=True)
class Given:
    """A system in expressions; None for what the document does not say.

    `natural` is whether the coordinates are, and `reason` why; None where that cannot be told.
    """

    lagrangian: Expr | None
    hamiltonian: Expr | None = None
    kinetic: Expr | None = None
    potential: Expr | None = None
    natural: bool | None = None
    reason: str = ""


def stated(document: Document) -> Given:
    """The system of a document.

    Raises DocumentError where there is none, or an expression cannot be worked with exactly.
    """
    system = document.system
    if system is None:
        hint = "`hamilton` needs `coordinates`, and a `lagrangian`, energies, particles or a `hamiltonian`"
        raise document.refusal("missing", "system", hint=hint)
    reader = _Reader(document, derived_parameters(document))
    if system.hamiltonian is not None:
        given = reader.read(system.hamiltonian, "hamiltonian")
        return Given(None, given, reason="H alone does not tell what its coordinates are")
    lagrangian = None if system.lagrangian is None else reader.read(system.lagrangian, "lagrangian")
    potential = ZERO if system.potential is None else reader.read(system.potential, "potential")
    if system.particles is not None:
        return _of_particles(system, system.particles, potential, reader)
    if system.kinetic is not None:
        return _of_energies(system, reader.read(system.kinetic, "kinetic"), potential, lagrangian)
    reason = "L alone does not tell T from V: give `kinetic` and `potential`, or `particles`"
    return Given(lagrangian, reason=reason)


def derived_parameters(document: Document) -> dict[str, Expr]:
    """The parameters that are given by others, as functions of these: lest a law be missed."""
    derived: dict[str, Expr] = {}
    for name, definition in document.definitions.items():
        if definition is not None and definition.names:
            derived[name] = from_tree(definition.root, derived)
    return derived


def known_values(document: Document) -> dict[str, Expr]:
    """The parameters that have values, exactly as they are given."""
    known: dict[str, Expr] = {}
    for name, definition in document.definitions.items():
        if definition is not None and definition.names <= known.keys():
            known[name] = from_tree(definition.root, known)
    return known


@dataclass(frozen=True, slots=True)
class _Reader:
    """Reads the expressions of a document, in which derived parameters are what they are derived from."""

    document: Document
    derived: Mapping[str, Expr]

    def read(self, expression: Expression, key: str) -> Expr:
        """An expression under this key of the system."""
        try:
            return from_tree(expression.root, self.derived)
        except ExpressionError as error:
            raise self.document.refusal(error.message, f"system.{key}") from error

    def optional(self, expression: Expression | None, key: str) -> Expr | None:
        """The same; None for None."""
        return None if expression is None else self.read(expression, key)


def _of_particles(system: System, given: tuple[Particle, ...], potential: Expr, reader: _Reader) -> Given:
    particles = []
    potentials = [potential]
    for index, particle in enumerate(given):
        where = f"particles.{index}"
        particles.append(
            energies.Particle(
                reader.optional(particle.mass, f"{where}.mass"),
                tuple(
                    reader.read(component, f"{where}.position.{place}")
                    for place, component in enumerate(particle.position or ())
                ),
                reader.optional(particle.moment_of_inertia, f"{where}.moment_of_inertia"),
                reader.optional(particle.angle, f"{where}.angle"),
            )
        )
        potentials.append(reader.optional(particle.potential, f"{where}.potential") or ZERO)
    velocities = dict(zip(system.coordinates, system.velocities, strict=True))
    kinetic, potential = energies.kinetic(particles, velocities), total(potentials)
    carriers = [
        path.text
        for particle in given
        for path in (*(particle.position or ()), particle.angle)
        if path is not None
        and energies.TIME in path.names
        and not is_zero(derivative(from_tree(path.root, reader.derived), energies.TIME))
    ]
    reason = (
        f"the time is in the position {carriers[0]}"
        if carriers
        else "the positions follow from the coordinates without the time"
    )
    still = _of_position(potential, system)
    return Given(kinetic - potential, None, kinetic, still, not carriers, reason)


def _of_energies(system: System, kinetic: Expr, potential: Expr, lagrangian: Expr | None) -> Given:
    wrong = energies.unnatural(kinetic, system.velocities)
    reason = (
        "T is homogeneous of degree 2 in the velocities, without the time"
        if wrong is None
        else f"T has {text(to_tree(wrong))}, as it has not in natural coordinates"
    )
    moves = kinetic - potential if lagrangian is None else lagrangian
    return Given(moves, None, kinetic, _of_position(potential, system), wrong is None, reason)


def _of_position(potential: Expr, system: System) -> Expr:
    """A potential without terms linear in the velocities: a magnetic field does no work, and is no energy."""
    found = coefficients(potential, system.velocities)
    if found is None or any(sum(powers) > 1 for powers in found):
        return potential
    return found.get((0,) * len(system.velocities), ZERO)
