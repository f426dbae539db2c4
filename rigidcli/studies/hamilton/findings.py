"""What is found of the system of a document: its derivation, and what the document asks for besides."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.document.document import Document
from rigidcli.mechanics.velocity_inversion import Branch
from rigidcli.report import Field, Value
from rigidcli.studies.common import require_values
from rigidcli.studies.hamilton.derivation import Derivation, derive
from rigidcli.studies.hamilton.system import require_formulas

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.initial import InitialState
    from rigidcli.studies.hamilton.orbit import OrbitSolution
    from rigidcli.studies.hamilton.oscillations import Oscillations
    from rigidcli.studies.hamilton.transform import TransformedSystem


@dataclass(frozen=True, slots=True)
class Found:
    """What was found of the system of a document; None for what was not asked, or not searched for.

    The derivation is on the branch of the velocities that the orbit is on, if there is one.
    """

    document: Document
    branches: Sequence[Branch]
    derivation: Derivation
    invariants: tuple[Expr, ...] | None
    orbit: OrbitSolution | None
    transform: TransformedSystem | None
    oscillations: Oscillations | None
    initial: InitialState | None
    fields: Sequence[Field] = ()
    """The results, once they are written."""


def find(document: Document, progress: Callable[[float], None] | None) -> Found:
    """Derive, search and follow what a document asks for; what it does not ask is not imported."""
    derivation: Derivation = document.reading.kept.get("derivation") or derive(document)
    document.reading.kept["derivation"] = derivation
    branches, orbit, transform, small, initial = derivation.branches, None, None, None, None
    if document.equilibrium is not None:
        from rigidcli.studies.hamilton.oscillations import oscillations

        small = oscillations(document, document.equilibrium, derivation)
    if document.orbit is None:
        searched = _searched(derivation)
    else:
        from rigidcli.studies.hamilton.initial import initial_state
        from rigidcli.studies.hamilton.orbit import solve_orbit

        require_values(document, "an orbit")
        require_formulas(document, [derivation.generator, *derivation.system.forces], "an orbit")
        derivation, initial = initial_state(document, document.orbit, derivation)
        searched = _searched(derivation)
        starts = document.reading.starts
        orbit = solve_orbit(document.orbit, derivation, initial, searched or (), progress, starts)
    if document.transform is not None:
        from rigidcli.studies.hamilton.transform import transformed

        transform = transformed(document, document.transform, derivation)
    return Found(document, branches, derivation, searched, orbit, transform, small, initial)


@lru_cache(maxsize=1)
def _searched(derivation: Derivation) -> tuple[Expr, ...] | None:
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
    """The results with decimals, where the system has some and exact ones are not asked for."""
    if document.exact_results or not DECIMAL.search(repr(document.system)):
        return list(fields)
    return [replace(entry, value=_in_decimals(entry.value)) for entry in fields]


def _in_decimals(value: Value) -> Value:
    """Exact expressions written with decimals, and all else as it is."""
    match value:
        case Expr():
            return value.in_decimals()
        case list():
            return [_in_decimals(entry) for entry in value]
        case dict():
            return {key: _in_decimals(entry) for key, entry in value.items()}
        case np.ndarray() if value.dtype == object:
            return np.array([_in_decimals(entry) for entry in value.flat], dtype=object).reshape(value.shape)
        case _:
            return value
