"""All that a document asks about its system: derivation, conserved quantities, orbit, modes."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import lru_cache
from typing import TYPE_CHECKING, NamedTuple

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.document.document import Document
from rigidcli.mechanics.inversion import Branch
from rigidcli.studies.common import require_values
from rigidcli.studies.hamilton.derivation import Derivation, derive
from rigidcli.studies.hamilton.linear_equations import Driven, driven
from rigidcli.studies.hamilton.system import require_formulas

if TYPE_CHECKING:
    from rigidcli.core.libration import Libration
    from rigidcli.studies.hamilton.equations_of_motion import InitialState
    from rigidcli.studies.hamilton.observables import Observed
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.oscillations import Oscillations
    from rigidcli.studies.hamilton.transform import TransformedSystem


class Findings(NamedTuple):
    """What was found on the system of a document; None for what it does not ask.

    The derivation is on the branch of the velocities that the orbit is on, if there is one.
    """

    document: Document
    branches: Sequence[Branch]
    derivation: Derivation
    invariants: tuple[Expr, ...] | None
    orbit: OrbitSolution | None
    transform: TransformedSystem | None
    oscillations: Oscillations | None
    observed: Observed | None
    initial: InitialState | None
    libration: Libration | None = None
    driven: Driven | None = None


def find(
    document: Document, progress: Callable[[float], None] | None, followed: OrbitSolution | None = None
) -> Findings:
    """Derive and follow what a document asks for; modules for the rest are not imported.

    Its orbit may have been `followed` already.
    """
    derivation = derive(document)
    branches, small, initial = derivation.branches, None, None
    if document.equilibrium is not None:
        from rigidcli.studies.hamilton.oscillations import oscillations

        small = oscillations(document, document.equilibrium, derivation)
    if document.orbit is not None:
        from rigidcli.studies.hamilton.start import initial_state

        require_values(document, "an orbit")
        require_formulas(document, [derivation.generator, *derivation.system.forces], "an orbit")
        derivation, initial = initial_state(document, document.orbit, derivation)
    invariants, observed = invariants_of(derivation), observations(document, derivation)
    orbit, libration, transform = None, None, None
    if document.orbit is not None and initial is not None:
        from rigidcli.studies.hamilton.orbit import solve_orbit

        functions = {f"observables.{name}": e for name, e in observed.functions.items()} if observed else {}
        asked = (document.starts, functions, observed.events if observed else {})
        orbit = followed or solve_orbit(
            document.orbit, derivation, initial, invariants or (), progress, *asked
        )
        if derivation.moves_alone:
            from rigidcli.studies.hamilton.sections import period

            libration = period(derivation, initial, orbit.coordinates)
    if document.transform is not None:
        from rigidcli.studies.hamilton.transform import transformed

        transform = transformed(document, document.transform, derivation)
    found = Findings(document, branches, derivation, invariants, orbit, transform, small, observed, initial)
    return found._replace(libration=libration, driven=driven(document, derivation))


def observations(document: Document, derivation: Derivation) -> Observed | None:
    """The observables, brackets and events of the orbit, which are imported where there are any."""
    has_events = document.orbit is not None and document.orbit.events
    if document.observables is None and document.brackets is None and not has_events:
        return None
    from rigidcli.studies.hamilton.observables import observed

    return observed(document, derivation)


@lru_cache(maxsize=1)
def invariants_of(derivation: Derivation) -> tuple[Expr, ...] | None:
    """Conserved quantities besides H and the momenta of cyclic coordinates; None where none is looked for."""
    hamiltonian = derivation.hamiltonian
    if derivation.is_forced or hamiltonian is None or not derivation.is_short:
        return None
    if len(derivation.phase.coordinates) == 1 or derivation.jumps:
        return ()
    from rigidcli.mechanics.invariants import conserved_quantities

    return conserved_quantities(hamiltonian, derivation.phase, [symbol(f"p_{q}") for q in derivation.cyclic])
