"""The change of variables that a document asks about: is it canonical, and what becomes of H?"""

from __future__ import annotations

from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass

from rigidcli.algebra.arithmetic import sign
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import from_tree, substitute
from rigidcli.algebra.values import is_zero
from rigidcli.document.document import Document
from rigidcli.document.phase_space import Transform
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics import canonical
from rigidcli.mechanics.canonical import Generated, NewHamiltonian, added_by_forces
from rigidcli.mechanics.canonical import generated as generated_by
from rigidcli.mechanics.phase_space import Phase, equations
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import derived_parameters, known_values


@dataclass(frozen=True, slots=True)
class TransformedSystem:
    """New `names` (coordinates, then momenta), the fundamental brackets, and what `canonical` ones are.

    All holds under the `conditions`. H and its equations in the new variables are None where the change is
    not canonical, or where no way leads to them. `generated` is what a generating function makes.
    """

    names: tuple[str, ...]
    brackets: dict[str, Expr]
    canonical: dict[str, Expr]
    conditions: tuple[str, ...]
    hamiltonian: Expr | None
    equations: tuple[Expr, ...] | None
    generated: Generated | None = None

    @property
    def wrong(self) -> list[str]:
        """The names of the brackets that a canonical change does not have."""
        return [name for name, e in self.brackets.items() if e != self.canonical[name]]

    @property
    def open_brackets(self) -> list[Expr]:
        """The wrong brackets, if symbols may have values at which all of them are 1, as they have to be."""
        wrong = {name: self.brackets[name] for name in self.wrong}
        may_be_one = all(self.canonical[name] == 1 and e.names for name, e in wrong.items())
        return list(wrong.values()) if may_be_one else []


def transformed(document: Document, transform: Transform, derivation: Derivation) -> TransformedSystem:
    """Judge a change of variables, for all values of the parameters or else for the given ones.

    New variables are in pairs, [Q1, P1, Q2, P2], if only so they are canonical.
    """
    result, names = _transformed(document, transform, derivation), transform.new_variables
    if not result.wrong or len(names) <= 2:
        return result
    paired = transform.model_copy(update={"new_variables": (*names[::2], *names[1::2])})
    other = _transformed(document, paired, derivation)
    return result if other.wrong else other


def _transformed(document: Document, transform: Transform, derivation: Derivation) -> TransformedSystem:
    old, known, hamiltonian = derivation.phase, known_values(document), derivation.hamiltonian
    new, generated = Phase(transform.coordinates, transform.momenta), None
    if transform.generating is not None:
        kind, function = transform.generating
        generated = generated_by(kind, from_tree(function.root, derived_parameters(document)), old, new)
    values, pairs, phase = given_side(document, transform, old, generated)
    if not values:  # the relations stay implicit; a change that follows from a function is canonical
        return TransformedSystem(new.names, {}, {}, (), None, None, generated)
    brackets = canonical.brackets(values, pairs, phase)
    expected = {pair: canonical.expected(*pair, pairs) for pair in brackets}
    free = {pair: e - expected[pair] for pair, e in brackets.items()}
    rate = None if generated is None else generated.rate
    new_h, negative = None, {name for name, value in known.items() if sign(value) != 1}
    # For all values of the parameters, or else for the given ones.
    for given in ({}, known) if known else ({},):
        misses = {pair: substitute(miss, given) for pair, miss in free.items()}
        needed = canonical.positive_names(misses.values(), phase.names)
        needed = None if needed is None or negative.intersection(needed) else needed
        if needed is not None and hamiltonian is not None:
            there = {name: substitute(value, given) for name, value in values.items()}
            added = None if rate is None else substitute(rate, given)
            with suppress(ComputationError, ExpressionError):
                new_h = canonical.new_hamiltonian(substitute(hamiltonian, given), there, old, new, added)
        if new_h is not None and negative.isdisjoint(new_h.positive):
            break
        new_h = None
    assumed = dict.fromkeys([*(needed or ()), *(() if new_h is None else new_h.positive)])
    wrong = [] if needed is not None else [pair for pair, miss in misses.items() if not is_zero(miss)]
    shown = {pair: tidy(e) if pair in wrong else expected[pair] for pair, e in brackets.items()}
    return TransformedSystem(
        new.names,
        {f"{{{a}, {b}}}": e for (a, b), e in shown.items()},
        {f"{{{a}, {b}}}": e for (a, b), e in expected.items()},
        tuple(f"{name} > 0" for name in assumed if name not in known),
        None if new_h is None else new_h.hamiltonian,
        None if new_h is None else _equations(new_h, new, derivation),
        generated,
    )


def given_side(
    document: Document, transform: Transform, old: Phase, generated: Generated | None
) -> tuple[Mapping[str, Expr], Phase, Phase]:
    """The given variables as functions of the other ones, the names of the given ones, and of the others.

    Those of a generating function are the old ones, else the new ones, else none.
    """
    new = Phase(transform.coordinates, transform.momenta)
    if generated is not None:
        is_old = generated.old is not None
        found = generated.old if is_old else generated.new
        return (found or {}, old, new) if is_old else (found or {}, new, old)
    given = transform.old if transform.old is not None else transform.new
    assert given is not None
    derived = derived_parameters(document)
    values = {name: from_tree(expression.root, derived) for name, expression in given.items()}
    return (values, old, new) if transform.old is not None else (values, new, old)


def _equations(new_h: NewHamiltonian, new: Phase, derivation: Derivation) -> tuple[Expr, ...]:
    free = equations(new_h.hamiltonian, new)
    if not derivation.is_forced or derivation.velocities is None:
        return free
    forces = derivation.forces_of(derivation.velocities)
    added = added_by_forces(forces, new_h.old, derivation.phase, new)
    return tuple(rate + force for rate, force in zip(free, added, strict=True))
