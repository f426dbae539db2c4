"""The equilibrium of a system: that a document gives, after a check, or one near values that it gives."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import numpy as np

from rigidcli.algebra.atoms import Applied
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import Expr, atomic, number
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.document.document import Document
from rigidcli.document.variables import Equilibrium
from rigidcli.errors import ComputationError
from rigidcli.language import code
from rigidcli.language.tree import UnknownFunction
from rigidcli.mechanics import small_oscillations
from rigidcli.mechanics.hamilton_equations import TIME
from rigidcli.studies.common import require_values
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.system import derived_parameters, known_values, require_formulas

KEY = "equilibrium"
"""The key under which a document gives the equilibrium."""

BALANCE = 1e-9
"""A search ends at an equilibrium if the forces are below this, in units of their terms where it began.

So must be the next step of Newton's method, in units of the coordinates: where forces fade away at a large
distance, it never is.
"""

NOISE = 1e-14
"""Coordinates smaller than this, in units of the largest one there or at the begin, are zero."""

POLISHING = 4
"""How often forces are worked out after the search, with a step of Newton's method between."""


@dataclass(frozen=True, slots=True)
class Place:
    """Coordinates of an equilibrium, and the parameters whose values are put in; with a note, if any.

    Where there are unknown functions, it is one only if what is `assumed` vanishes.
    """

    coordinates: dict[str, Expr]
    known: dict[str, Expr]
    note: str = ""
    assumed: tuple[Expr, ...] = ()


def forces_at_rest(document: Document, derivation: Derivation) -> tuple[list[Expr], dict[str, Expr]]:
    """The generalized forces at rest, as functions of the coordinates, and momenta where H alone is known."""
    phase, lagrange, equations = derivation.phase, derivation.lagrange, derivation.equations
    momenta: dict[str, Expr] = {}
    if lagrange is not None:
        forces = small_oscillations.forces_at_rest(lagrange, derivation.velocity_names)
    else:
        size = len(phase.coordinates)
        known = None if equations is None else small_oscillations.momenta_at_rest(equations[:size], phase)
        if equations is None or known is None:
            raise ComputationError("the momenta of the system at rest do not follow from H")
        momenta = known
        forces = [tidy(substitute(e, momenta)) for e in equations[size:]]
    if any(not is_zero(derivative(force, TIME)) for force in forces):
        raise document.refusal("forces on the system at rest change with time: there is no equilibrium", KEY)
    return forces, momenta


def given_place(
    document: Document, equilibrium: Equilibrium, names: Sequence[str], forces: Sequence[Expr]
) -> Place:
    """Check the equilibrium that is given. Raises DocumentError where it is none.

    Results are exact for all values of the parameters where the document is, or else for the given ones.
    """
    derived, values = derived_parameters(document), known_values(document)
    tries: list[dict[str, Expr]] = [{}, values] if document.exact_results else [values]
    left: dict[str, Expr] = {}
    for known in tries:
        place = {
            name: substitute(from_tree(e.root, derived), known) for name, e in equilibrium.values.items()
        }
        left = {
            name: tidy(substitute(force, known | place)) for name, force in zip(names, forces, strict=True)
        }
        left = {name: force for name, force in left.items() if not is_zero(force)}
        if all(force.unknown for force in left.values()):
            return Place(place, known, assumed=tuple(map(_vanishing, left.values())))
    raise document.refusal(
        f"no equilibrium: at rest there, {_listed(left)}",
        KEY,
        hint=None if document.symbols else "look for one near these values: `equilibrium: {find: {...}}`",
    )


def _vanishing(force: Expr) -> Expr:
    """A force vanishes with this: the unknown function in it, where it is that times a factor."""
    if len(force.terms) == 1:
        ((monomial, _),) = force.terms.items()
        for atom, _ in monomial:
            if isinstance(atom, Applied) and isinstance(atom.function, UnknownFunction):
                return atomic(atom)
    return force


def _listed(forces: Mapping[str, float | Expr]) -> str:
    """List forces in words."""
    written = {
        name: f"{float(e):.6g}" if isinstance(e, float) or not e.names else str(e)
        for name, e in forces.items()
    }
    return ", ".join(f"the force along {name} is {text}" for name, text in written.items())


def found_place(
    document: Document, equilibrium: Equilibrium, names: Sequence[str], forces: Sequence[Expr]
) -> Place:
    """Search for an equilibrium near given values. Raises ComputationError where the search fails."""
    from scipy.optimize import root

    require_values(document, "the search for an equilibrium")
    require_formulas(document, forces, "the search for an equilibrium")
    constants = {name: float(value) for name, value in document.values.items()}
    begin = np.array([equilibrium.values[name].evaluate(constants) for name in names])
    slopes = [derivative(force, name) for force in forces for name in names]
    f, jacobian, sizes = (
        code.function([to_tree(e) for e in es], names, constants)(math)
        for es in (forces, slopes, [abs(Expr({m: c})) for force in forces for m, c in force.terms.items()])
    )

    def at(q: Floats, g: Callable[..., Any] = f) -> Floats:
        return np.array(g(*q.tolist()), dtype=np.float64)

    def slope(q: Floats) -> Floats:
        return at(q, jacobian).reshape(len(names), len(names))

    try:
        q: Floats = root(at, begin, jac=slope, method="lm", tol=1e-15).x
        step: Floats = np.zeros(len(names))
        for _ in range(POLISHING):
            q = q - step
            q[np.abs(q) <= NOISE * max(np.abs(q).max(), np.abs(begin).max())] = 0.0
            left = at(q) + 0.0
            step = np.asarray(np.linalg.lstsq(slope(q), left, rcond=1e-10)[0], dtype=np.float64)
        scale = at(begin, sizes).max(initial=0.0)
    except NO_VALUE as error:
        raise ComputationError("no equilibrium found: the forces have no value on the way") from error
    listed = _listed(dict(zip(names, left.tolist(), strict=True)))
    near = BALANCE * max(np.linalg.norm(q), np.linalg.norm(begin))
    if not (np.abs(left).max() <= BALANCE * scale and np.linalg.norm(step) <= near):
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, q.tolist(), strict=True))
        raise ComputationError(f"no equilibrium found: the search ended at {shown}; at rest there, {listed}")
    place = {name: number(Fraction(value)) for name, value in zip(names, q.tolist(), strict=True)}
    note = f"equilibrium found by scipy.optimize.root; at rest there, {listed}"
    return Place(place, known_values(document), note)
