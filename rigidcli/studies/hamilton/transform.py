"""The change of variables that a document asks about: is it canonical, and what becomes of H?"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from rigidcli.model.document import Document
from rigidcli.model.transform import Transform
from rigidcli.studies.hamilton.derivation import TIME, Derivation
from rigidcli.studies.hamilton.system import derived_parameters, known_values
from rigidcli.symbolic.algebra.arithmetic import sign
from rigidcli.symbolic.algebra.calculus import derivative, substitute
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.positive_roots import for_positive_symbols
from rigidcli.symbolic.algebra.reading import from_tree
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.values import is_zero
from rigidcli.symbolic.mechanics import canonical
from rigidcli.symbolic.mechanics.hamilton_equations import Phase, equations


@dataclass(frozen=True, slots=True)
class TransformedSystem:
    """New `names` (coordinates, then momenta), the fundamental brackets, and those that are `wrong`.

    H in the new variables holds under the `conditions`.
    H and its equations in the new variables are None where the change is not canonical, holds the time,
    or cannot be inverted.
    """

    names: tuple[str, ...]
    brackets: dict[str, Expr]
    wrong: tuple[str, ...]
    conditions: tuple[str, ...]
    hamiltonian: Expr | None
    equations: tuple[Expr, ...] | None


def transformed(document: Document, transform: Transform, derivation: Derivation) -> TransformedSystem:
    """Judge a change of variables, for all values of the parameters or else for the given ones."""
    new = Phase(transform.coordinates, transform.momenta)
    given = transform.old if transform.old is not None else transform.new
    assert given is not None
    derived = derived_parameters(document)
    values = {name: from_tree(expression.root, derived) for name, expression in given.items()}
    pairs, phase = (derivation.phase, new) if transform.old is not None else (new, derivation.phase)
    brackets = canonical.brackets(values, pairs, phase)
    wrong = canonical.wrong_brackets(brackets, pairs)
    if wrong:
        known = known_values(document)
        wrong = canonical.wrong_brackets({pair: substitute(brackets[pair], known) for pair in wrong}, pairs)
    timeless = all(is_zero(derivative(value, TIME)) for value in values.values())
    old = values if transform.old is not None else canonical.inverted(values, pairs, phase)
    hamiltonian: Expr | None = None
    positive: list[str] = []
    if not wrong and timeless and old is not None and derivation.hamiltonian is not None:
        signs = {name: sign(value) for name, value in known_values(document).items()}
        negative = [name for name in signs if signs[name] != 1]
        hamiltonian = tidy(substitute(derivation.hamiltonian, old))
        hamiltonian, positive = for_positive_symbols(hamiltonian, negative)
        positive = [name for name in positive if name not in signs]
    return TransformedSystem(
        new.names,
        {
            _written(pair): value if pair in wrong else canonical.expected(*pair, pairs)
            for pair, value in brackets.items()
        },
        tuple(map(_written, wrong)),
        tuple(f"{name} > 0" for name in positive),
        hamiltonian,
        None if hamiltonian is None or old is None else _equations(hamiltonian, new, derivation, old),
    )


def _equations(
    hamiltonian: Expr, new: Phase, derivation: Derivation, old: Mapping[str, Expr]
) -> tuple[Expr, ...]:
    """Hamilton's equations in the new variables, with forces where there are some."""
    free = equations(hamiltonian, new)
    if not derivation.is_forced or derivation.velocities is None:
        return free
    forces = derivation.forces_of(derivation.velocities)
    added = canonical.added_by_forces(forces, old, derivation.phase, new)
    return tuple(rate + force for rate, force in zip(free, added, strict=True))


def _written(pair: tuple[str, str]) -> str:
    return f"{{{pair[0]}, {pair[1]}}}"
