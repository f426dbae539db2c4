"""The steady motion of a document: its rates and momenta, the Routhian, and the system that this leaves."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from rigidcli.algebra.expressions import ZERO, Expr
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.document.document import Document
from rigidcli.document.phase_space import Equilibrium, momentum, velocity
from rigidcli.errors import ComputationError, DocumentError, ExpressionError, Problem
from rigidcli.language.expression import Expression
from rigidcli.language.text import latex_name
from rigidcli.mechanics.phase_space import Phase
from rigidcli.mechanics.small_oscillations import momenta_at_rest
from rigidcli.mechanics.steady import routhian, steady_rates, written
from rigidcli.report import Field, Step
from rigidcli.studies.common import if_known
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import SystemFunctions, derived_parameters, known_values
from rigidcli.studies.results import field_of


@dataclass(frozen=True, slots=True)
class SteadyMotion:
    """The values of the cyclic rates and momenta, the Routhian, and the effective potential.

    The Routhian and the potential are functions of the momenta, and None where they have not one closed form.
    """

    values: Mapping[str, float | Expr]
    routhian: Expr | None
    potential: Expr | None


def cyclic_momenta(
    document: Document, equilibrium: Equilibrium, derivation: Derivation
) -> tuple[dict[str, Expr], tuple[str, ...]]:
    """The momenta of the coordinates that turn, by their names, and notes on the rate that is solved for.

    Raises DocumentError where a coordinate is not cyclic, or there is no steady rate.
    """
    problems = list[Problem]()
    for name in equilibrium.turning:
        if name not in derivation.conserved_momenta:
            why = f"{'a force acts along' if name in derivation.cyclic else 'the system depends on'} {name}"
            hint = f"give a value of {name}; cyclic: {', '.join(derivation.conserved_momenta) or 'nothing'}"
            key = name if name == equilibrium.steady else momentum(name)
            message = f"{momentum(name)} is not conserved: {why}"
            problems.append(document.problem(message, f"equilibrium.{key}", hint=hint))
    if problems:
        raise DocumentError(problems)
    if derivation.equations is None:
        raise ComputationError("a steady motion needs Hamilton's equations, which are not written here")
    derived = derived_parameters(document)
    known = {} if document.exact_results else known_values(document)

    def read(values: Mapping[str, Expression]) -> dict[str, Expr]:
        return {q: substitute(from_tree(e.root, derived), known) for q, e in values.items()}

    momenta = {momentum(q): p for q, p in read(equilibrium.momenta).items()}
    steadily = equilibrium.steady
    if steadily is None:
        return momenta, ()
    left, place = reduced(derivation, equilibrium, momenta), read(equilibrium.values)
    assert left.equations is not None
    size = len(left.phase.coordinates)
    at_rest = momenta_at_rest(left.equations[:size], left.phase)
    if at_rest is None:
        raise ComputationError("the momenta of the system at rest do not follow from H")

    def there(e: Expr) -> Expr:
        return tidy(substitute(substitute(e, at_rest), {**known, **place}))

    forces = {q: there(e) for q, e in zip(left.phase.coordinates, left.equations[size:], strict=True)}
    rate = derivation.equations[derivation.phase.coordinates.index(steadily)]
    rate = there(substitute(rate, momenta))
    try:
        found = steady_rates(forces, momentum(steadily), rate, known_values(document))
    except ExpressionError as error:
        message, key = f"no steady motion: {error.message}", f"equilibrium.{steadily}"
        raise document.refusal(message, key, hint=error.hint) from error
    second = [] if found.other is None else [f"{velocity(steadily)} = {written(found.other)}"]
    notes = [f"a second steady rate is {text}" for text in second]
    notes += [] if found.condition is None else [f"the motion is steady where {found.condition} > 0"]
    return momenta | {momentum(steadily): found.momentum}, tuple(notes)


def reduced(derivation: Derivation, equilibrium: Equilibrium, momenta: Mapping[str, Expr]) -> Derivation:
    """The system of the coordinates that do not turn, with these values of the momenta of the others."""
    phase, functions = derivation.phase, derivation.system
    assert derivation.hamiltonian is not None
    assert derivation.velocities is not None
    rates = dict(zip(derivation.velocity_names, derivation.velocities, strict=True))
    turned = {velocity(q): substitute(rates[velocity(q)], momenta) for q in equilibrium.turning}
    places = [k for k, q in enumerate(phase.coordinates) if q not in equilibrium.turning]
    forces = tuple(substitute(functions.forces[k], turned) for k in places)
    system = SystemFunctions(None, substitute(derivation.hamiltonian, momenta), forces=forces)
    names = Phase(*(tuple(part[k] for k in places) for part in (phase.coordinates, phase.momenta)))
    return Derivation(names, tuple(derivation.velocity_names[k] for k in places), system)


def steady(
    document: Document,
    equilibrium: Equilibrium,
    derivation: Derivation,
    momenta: Mapping[str, Expr],
    there: Mapping[str, Expr],
    is_exact: bool,
) -> SteadyMotion:
    """The steady motion with these momenta at a place, which has the other coordinates and momenta."""
    phase = derivation.phase
    assert derivation.velocities is not None
    values: dict[str, float | Expr] = {}
    rates = dict(zip(phase.coordinates, derivation.velocities, strict=True))
    place = {**there, **{name: substitute(p, there) for name, p in momenta.items()}}
    for q in equilibrium.turning:
        for name, e in ((velocity(q), tidy(substitute(rates[q], place))), (momentum(q), place[momentum(q)])):
            values[name] = e if is_exact or e.names else float(e)
    return SteadyMotion(values, *routhian_of(document, derivation, equilibrium.turning))


def routhian_of(
    document: Document, derivation: Derivation, cyclic: Collection[str]
) -> tuple[Expr | None, Expr | None]:
    """The Routhian without these cyclic coordinates, and minus the Routhian at rest, if they have a form."""
    names, given = derivation.velocity_names, known_values(document)
    assert derivation.hamiltonian is not None
    found = routhian(
        derivation.system.lagrangian, derivation.hamiltonian, derivation.phase, names, cyclic, given
    )
    if found is None:
        return None, None
    return found, tidy(-substitute(found, dict.fromkeys(names, ZERO)))


def fields_without_motion(document: Document, derivation: Derivation) -> list[Field]:
    """The Routhian and the effective potential of a system with cyclic coordinates, in a verbose look."""
    found, potential = routhian_of(document, derivation, derivation.conserved_momenta)
    shown = [field_of("hamilton", "effective_potential", potential), field_of("hamilton", "routhian", found)]
    return [replace(if_known(entry), diagnostic=True) for entry in shown]


def fields(motion: SteadyMotion) -> list[Field]:
    """Report the steady motion as JSON has it; people see the Routhian in a verbose look."""
    keys = {f"steady.{name}": (name, e) for name, e in motion.values.items()}
    return [
        *(
            Field(key, e, f"steady, {name}", latex_name(name), cells={key: ()})
            for key, (name, e) in keys.items()
        ),
        if_known(field_of("hamilton", "effective_potential", motion.potential)),
        if_known(field_of("hamilton", "routhian", motion.routhian)),
    ]


def steps(shown: tuple[Field, ...]) -> Step:
    """Show how the cyclic coordinates are taken out, and the steady motion."""
    sentence = (
        "The momenta of the cyclic coordinates are constants. R = L - sum p v over these coordinates depends "
        "on the others alone, V_eff = -R at rest, and motion is steady where all slopes of V_eff vanish."
    )
    return Step("Steady motion", sentence, shown)
