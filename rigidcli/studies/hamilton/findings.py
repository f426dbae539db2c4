"""All that a document asks about its system: derivation, conserved quantities, orbit, modes."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol, total
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.trees import to_tree
from rigidcli.document.document import Document
from rigidcli.language.formula import Formula, Style, is_even
from rigidcli.language.tree import Negative, Power, Sum, nodes
from rigidcli.mechanics.velocity_inversion import Branch
from rigidcli.report import Field
from rigidcli.studies.common import require_values
from rigidcli.studies.hamilton.derivation import Derivation, derive
from rigidcli.studies.hamilton.system import derived_parameters, require_formulas

if TYPE_CHECKING:
    from rigidcli.core.libration import Libration
    from rigidcli.studies.hamilton.equations_of_motion import InitialState
    from rigidcli.studies.hamilton.observables import Observed
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.oscillations import Oscillations
    from rigidcli.studies.hamilton.transform import TransformedSystem


class Findings(NamedTuple):
    """The answers on the system of a document; one is None where it was not asked, or not searched for.

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


def derived(document: Document) -> Derivation:
    """The system of a document, which is derived once for all starts."""
    derivation: Derivation = document.reading.kept.get("derivation") or derive(document)
    document.reading.kept["derivation"] = derivation
    return derivation


def find(
    document: Document, progress: Callable[[float], None] | None, followed: OrbitSolution | None = None
) -> Findings:
    """Derive, search and follow what a document asks for; what it does not ask is not imported.

    Its orbit may have been `followed` already.
    """
    derivation = derived(document)
    branches, orbit, transform, small, initial = derivation.branches, None, None, None, None
    observed: Observed | None = None
    functions: dict[str, Expr] = {}
    if document.equilibrium is not None:
        if derivation.system.constraints:
            message = "small oscillations are told of a system without constraints"
            hint = "choose coordinates that obey the constraints, such as an angle"
            raise document.refusal(message, "equilibrium", hint=hint)
        from rigidcli.studies.hamilton.oscillations import oscillations

        small = oscillations(document, document.equilibrium, derivation)
    if document.orbit is None:
        searched = invariants_of(derivation)
        observed = observations(document, derivation)
    else:
        from rigidcli.studies.hamilton.orbit import initial_state, solve_orbit

        require_values(document, "an orbit")
        require_formulas(document, [derivation.generator, *derivation.system.forces], "an orbit")
        derivation, initial = initial_state(document, document.orbit, derivation)
        searched = invariants_of(derivation)
        observed = observations(document, derivation)
        functions = {f"observables.{name}": e for name, e in observed.functions.items()} if observed else {}
        starts = document.reading.starts
        passing = observed.events if observed else {}
        orbit = followed or solve_orbit(
            document.orbit, derivation, initial, searched or (), progress, starts, functions, passing
        )
    libration = None
    if orbit is not None and initial is not None and len(derivation.phase.coordinates) == 1:
        from rigidcli.studies.hamilton.periods import period

        libration = period(derivation, initial, orbit)
    if document.transform is not None:
        from rigidcli.studies.hamilton.transform import transformed

        transform = transformed(document, document.transform, derivation)
    return Findings(
        document, branches, derivation, searched, orbit, transform, small, observed, initial, libration
    )


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


DECIMAL = re.compile(r"\.\d|\de-")
"""What the text of a decimal has, and no other part of an expression."""


def as_typed(fields: Iterable[Field], document: Document) -> list[Field]:
    """Write results in the style of the document.

    Decimals (unless exact results are asked for), squares of sums, and the order of coordinates are its own.
    """
    decimal = not document.exact_results and DECIMAL.search(repr(document.system)) is not None
    coordinates = () if document.system is None else document.system.coordinates
    style = Style(decimal, tuple(_typed_sums(document).items()), coordinates)
    return [_styled(entry, style) for entry in fields]


def _typed_sums(document: Document) -> dict[Sum, Sum]:
    """Map the sums under even powers in the system, as the algebra writes them, to what is typed."""
    system, sums = document.system, dict[Sum, Sum]()
    assert system is not None
    values = derived_parameters(document)
    written = [system.lagrangian, system.kinetic, system.potential, system.hamiltonian]
    written += [particle.potential for particle in system.particles or ()]
    for part in nodes(e.root for e in written if e is not None):
        if isinstance(part, Power) and isinstance(part.base, Sum) and is_even(part.exponent):
            terms = [from_tree(term, values) for term in part.base.terms]
            typed, square = Sum(tuple(map(to_tree, terms))), to_tree(total(terms) ** 2)
            if isinstance(square, Power) and isinstance(square.base, Sum) and _has_terms(square.base, typed):
                sums.setdefault(square.base, typed)
    for root in (equation.expression.root for equation in (system.constraints or {}).values()):
        if isinstance(root, Sum):
            terms = [from_tree(term, values) for term in root.terms]
            whole, typed = to_tree(total(terms)), Sum(tuple(map(to_tree, terms)))
            if isinstance(whole, Sum) and {*whole.terms} == {*typed.terms}:
                sums.setdefault(whole, typed)
    return sums


def _has_terms(written: Sum, typed: Sum) -> bool:
    """Whether one sum has the terms of the other in another order, or their negatives, the first positive."""
    if isinstance(typed.terms[0], Negative):
        return False
    return {*written.terms} in ({*typed.terms}, {-term for term in typed.terms})


def _styled(entry: Field, style: Style) -> Field:
    """Write a result in a style, with the expressions in its lists, objects, arrays and formulas."""

    def changed(value: Any) -> Any:
        match value:
            case Expr():
                return value.styled(style)
            case Formula(exact=True):
                return replace(value, root=replace(style, coordinates=()).of(value.root))
            case list():
                return list(map(changed, value))
            case dict():
                return {key: changed(inner) for key, inner in value.items()}
            case np.ndarray() if value.dtype == object:
                return np.array([*map(changed, value.flat)], dtype=object).reshape(value.shape)
            case _:
                return value

    return replace(entry, value=changed(entry.value))
