"""The equilibrium or steady motion of a document, which may be searched for, and its small oscillations."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from fractions import Fraction
from itertools import starmap
from typing import Any, NamedTuple, TypeAlias, cast

import numpy as np

from rigidcli.algebra.arithmetic import EXACT, inequality
from rigidcli.algebra.atoms import Applied, Atom
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr, atomic, number, symbol
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import from_tree, substitute, without
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.solution import NO_VALUE
from rigidcli.document.document import Document
from rigidcli.document.phase_space import Equilibrium, momentum, velocity
from rigidcli.errors import ComputationError, DocumentError, ExpressionError, Problem
from rigidcli.language import code
from rigidcli.language.expression import Expression
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.phase_space import TIME, Phase
from rigidcli.mechanics.small_oscillations import (
    DIGITS_OF_RATES,
    ROUNDING,
    ROUNDING_OF_FLOATS,
    LinearMotion,
    Root,
    Vector,
    momenta_at_rest,
    of_lagrange,
    spectrum,
)
from rigidcli.mechanics.steady import routhian, steady_rates, written
from rigidcli.report import Column, Field, Table
from rigidcli.studies.common import celled, if_known, require_values
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import terms
from rigidcli.studies.hamilton.system import (
    SystemFunctions,
    derived_parameters,
    known_values,
    require_formulas,
    row_of,
    style_of,
)

# Expressions by the names of coordinates, momenta or parameters.
Named: TypeAlias = Mapping[str, Expr]
# The key under which a document gives the equilibrium.
EQUILIBRIUM_KEY = "equilibrium"
# The largest force at an equilibrium that is found, in units of the terms of the forces at the start.
# The next step of Newton's method has to be as small, in units of the coordinates: where forces fade away
# with the distance, they are small, and the step is not.
NO_FORCE = 1e-9
# Coordinates of an equilibrium below this, in units of the largest one or of the start, are zero.
ZERO_COORDINATE = 1e-14
# Columns of the modes that people are shown where there is something in them, with their units.
UNITS = {"rate": "1/s", "frequency": "Hz", "period": "s", "decay": "1/s"}


class Oscillations(NamedTuple):
    """An equilibrium `place`, the linear `motion` about it, and its `roots`, None if they have no form.

    A `steady` motion has its rates and momenta, the effective potential and the Routhian as results.
    """

    place: Mapping[str, float | Expr]
    is_given: bool
    motion: LinearMotion
    roots: Sequence[Root] | None
    notes: tuple[str, ...]
    steady: Sequence[Field] = ()

    @property
    def modes(self) -> list[tuple[Root, Vector]]:
        """The modes y = Re(v exp(s t)): the root s, and one of its vectors v."""
        return [(root, vector) for root in self.roots or () for vector in root.vectors]

    def fields(self) -> list[Field]:
        """Report the equilibrium and its modes as JSON has them, and the rates of the modes for CSV."""
        rates = [root.rate for root, _ in self.modes]
        cells = {f"modes.{place}.rate": (place,) for place in range(len(rates))}
        is_known = self.is_given and not self.steady  # a steady motion is told with its place
        places = (
            celled(f"equilibrium.{q}", e, f"equilibrium, {q}", diagnostic=is_known)
            for q, e in self.place.items()
        )
        return [
            *places,
            *self.steady,
            Field("modes", None if self.roots is None else list(starmap(_record, self.modes))),
            Field("", np.array(rates), cells=cells),
        ]

    def tables(self) -> list[Table]:
        """Make the table of the modes that people are shown, one mode in a row."""
        modes, records = self.modes, list(starmap(_record, self.modes))
        if not modes:
            return []
        is_numeric = not any(isinstance(root.rate, Expr) for root, _ in modes)
        columns = [
            Column(key, [record.get(key) for record in records], (key,), unit if is_numeric else "")
            for key, unit in UNITS.items()
            if key == "rate" or ((is_numeric or key == "decay") and any(r.get(key) for r in records))
        ]
        for place, name in enumerate(self.place):
            entries = [_component(*vector[place].tolist()) for _, vector in modes]
            columns.append(Column(name, entries, (name,), "", (latex_name(name),)))
        columns.append(Column("motion", [_kind(root) for root, _ in modes], ("motion",), ""))
        return [Table("modes", "normal modes", tuple(columns), records=True)]


class EquilibriumPlace(NamedTuple):
    """Coordinates of an equilibrium, and the `known` values of parameters for which it is one; with notes.

    `assumed` are unknown functions that vanish there, or it is no equilibrium.
    """

    coordinates: dict[str, Expr]
    known: dict[str, Expr]
    notes: tuple[str, ...] = ()
    assumed: tuple[Atom, ...] = ()


def oscillations(document: Document, equilibrium: Equilibrium, derivation: Derivation) -> Oscillations:
    """The small oscillations about the equilibrium of a document.

    Raises DocumentError where it is none, and ComputationError where the search for one fails, or the
    equations have no first order there.
    """
    _require_no_constraints(document, derivation)
    try:
        momenta, notes = _cyclic_momenta(document, equilibrium, derivation)
        left = _reduced(derivation, equilibrium, momenta)
        forces, at_rest = _forces_at_rest(document, left)
        find = _found_place if equilibrium.is_sought else _given_place
        place = find(document, equilibrium, forces)
        there = place.known | place.coordinates
        there |= {name: substitute(p, there) for name, p in at_rest.items()}
        still = there | dict.fromkeys(derivation.velocity_names, ZERO)
        _require_smooth([derivation.generator, *derivation.system.forces], momenta | still)
        motion = _linearised(left, there).changed(lambda e: tidy(without(e, place.assumed)))
        steady = _steady(document, equilibrium, derivation, momenta, there) if equilibrium.turning else []
    except ExpressionError as error:
        raise document.refusal(
            f"the equations of motion have no value there: {error.message}", EQUILIBRIUM_KEY
        ) from error
    if any(TIME in e.names for e in motion.entries):
        raise ComputationError(
            "the equilibrium has no modes: the equations of motion near it change with time"
        )
    rounding = ROUNDING_OF_FLOATS if equilibrium.is_sought else ROUNDING
    roots = _roots(document, derivation, motion, rounding)
    is_numeric = equilibrium.is_sought or not document.exact_results
    values = {name: float(e) if is_numeric and not e.names else e for name, e in place.coordinates.items()}
    notes = (*notes, *place.notes, *_notes(roots, document))
    return Oscillations(values, not equilibrium.is_sought, motion, roots, notes, steady)


def _require_no_constraints(document: Document, derivation: Derivation) -> None:
    """Raise DocumentError where there are constraints."""
    limits = derivation.system.constraints
    if limits:
        hint = "follow an `orbit` that starts nearby"
        if all(one.holonomic for one in limits):  # there are such coordinates
            hint = "choose coordinates that obey the constraints, such as an angle"
        message = "small oscillations are not worked out for a system with constraints"
        raise document.refusal(message, EQUILIBRIUM_KEY, hint=hint)


def _linearised(derivation: Derivation, there: Named) -> LinearMotion:
    """The linear motion about a place: from Lagrange's equations, or Hamilton's where H alone is known."""
    if derivation.lagrange is not None:
        return of_lagrange(derivation.lagrange, derivation.phase, derivation.velocity_names, there)
    names, equations = derivation.phase.names, derivation.equations or ()
    slopes = [[tidy(substitute(derivative(e, name), there)) for name in names] for e in equations]
    return LinearMotion.of_matrix(np.array(slopes, dtype=object))


def _roots(
    document: Document, derivation: Derivation, motion: LinearMotion, rounding: float
) -> Sequence[Root] | None:
    """The roots of the linear motion. Raises ComputationError where its mass matrix is singular."""
    forces = derivation.system.forces
    is_free = not derivation.is_forced
    try:
        if motion.is_of_first_order:
            raise ZeroDivisionError
        roots = spectrum(motion, known_values(document), document.exact_results, is_free, rounding)
    except ZeroDivisionError:
        raise ComputationError(
            "dL/dv cannot be solved for v at the equilibrium: the mass matrix is singular there",
            hint="other coordinates may do: angles fail at their poles",
        ) from None
    back = {v: -symbol(v) for v in derivation.velocity_names}
    is_reversible = all(is_zero(substitute(force, back) - force) for force in forces)
    if roots is None or not derivation.energy_changes or derivation.linear is not None or is_reversible:
        return roots
    # What neither grows nor decays may do so by terms beyond the linear ones.
    return [root._replace(is_stable=None) if root.is_stable and not root.growth else root for root in roots]


def _forces_at_rest(document: Document, derivation: Derivation) -> tuple[dict[str, Expr], dict[str, Expr]]:
    """The forces along the coordinates of the system at rest, and its momenta where H alone is known."""
    phase, lagrange, equations = derivation.phase, derivation.lagrange, derivation.equations
    momenta: dict[str, Expr] = {}
    if lagrange is not None:
        still = dict.fromkeys(derivation.velocity_names, ZERO)
        forces = [-substitute(rest, still) for rest in lagrange.rest]
    else:
        size = len(phase.coordinates)
        known = None if equations is None else momenta_at_rest(equations[:size], phase)
        if equations is None or known is None:
            raise ComputationError("the momenta of the system at rest do not follow from H")
        momenta = known
        forces = [tidy(substitute(e, momenta)) for e in equations[size:]]
    return dict(zip(phase.coordinates, forces, strict=True)), momenta


def _given_place(document: Document, equilibrium: Equilibrium, forces: Named) -> EquilibriumPlace:
    """Check the equilibrium that is given. Raises DocumentError where it is none.

    Results are exact for all values of the parameters where the document is, or else for the given ones.
    """
    derived, values = derived_parameters(document), known_values(document)
    tries: list[dict[str, Expr]] = [{}, values] if document.exact_results else [values]
    left: dict[str, Expr] = {}
    for known in tries:
        given = {q: from_tree(e.root, derived) for q, e in equilibrium.values.items()}
        place = {q: substitute(e, known) for q, e in given.items()}
        there = {q: tidy(substitute(force, known | place)) for q, force in forces.items()}
        left = {q: force for q, force in there.items() if not is_zero(force)}
        if all(force.unknown for force in left.values()):
            notes = tuple(f"it is an equilibrium where the force {force} vanishes" for force in left.values())
            factors = (atom for force in left.values() if len(force.terms) == 1 for atom in force.atoms)
            return EquilibriumPlace(place, known, notes, tuple(a for a in factors if atomic(a).unknown))
    # A search needs values, and forces that do not change with the time.
    is_open = document.symbols or any(TIME in force.names for force in left.values())
    hint = None if is_open else "look for one near these values: `equilibrium: {find: {...}}`"
    raise document.refusal(f"no equilibrium: at rest there, {_listed(left)}", EQUILIBRIUM_KEY, hint=hint)


def _listed(forces: Mapping[str, float | Expr]) -> str:
    written = {
        name: f"{float(e):.6g}" if isinstance(e, float) or not e.names else str(e)
        for name, e in forces.items()
    }
    return ", ".join(f"the force along {name} is {text}" for name, text in written.items())


def _found_place(document: Document, equilibrium: Equilibrium, forces: Named) -> EquilibriumPlace:
    """Search for an equilibrium near given values. Raises ComputationError where the search fails."""
    from scipy.optimize import root

    require_values(document, "the search for an equilibrium")
    require_formulas(document, forces.values(), "the search for an equilibrium")
    if any(not is_zero(derivative(force, TIME)) for force in forces.values()):
        message = "no equilibrium is looked for: forces on the system at rest change with time"
        raise document.refusal(message, EQUILIBRIUM_KEY)
    names, constants = list(forces), {name: float(value) for name, value in document.values.items()}
    begin = np.array([equilibrium.values[name].evaluate(constants) for name in names])

    def compiled(expressions: Iterable[Expr]) -> Callable[[Floats], Floats]:
        function = code.function([to_tree(e) for e in expressions], names, constants)(math)
        return lambda q: np.array(function(*q.tolist()), dtype=np.float64)

    at, sizes = compiled(forces.values()), compiled(abs(e) for force in forces.values() for e in terms(force))
    slopes = compiled(derivative(force, name) for force in forces.values() for name in names)

    def slope(q: Floats) -> Floats:
        return slopes(q).reshape(len(names), len(names))

    try:
        # Its first step is no longer than a tenth of the values, so that what is near is found.
        q: Floats = root(at, begin, jac=slope, method="lm", tol=1e-15, options={"factor": 0.1}).x
        step: Floats = np.zeros(len(names))
        for _ in range(4):  # Newton's method doubles the digits: 2 become more than a float has
            q = q - step
            q[np.abs(q) <= ZERO_COORDINATE * max(np.abs(q).max(), np.abs(begin).max())] = 0.0
            left = at(q) + 0.0
            step = np.asarray(np.linalg.lstsq(slope(q), left, rcond=1e-10)[0], dtype=np.float64)
        scale = sizes(begin).max(initial=0.0)
    except NO_VALUE as error:
        raise ComputationError("no equilibrium found: the forces have no value on the way") from error
    listed = _listed(dict(zip(names, left.tolist(), strict=True)))
    near = NO_FORCE * max(np.linalg.norm(q), np.linalg.norm(begin))
    if not (np.abs(left).max() <= NO_FORCE * scale and np.linalg.norm(step) <= near):
        shown = ", ".join(f"{name} = {value:.6g}" for name, value in zip(names, q.tolist(), strict=True))
        raise ComputationError(f"no equilibrium found: the search ended at {shown}; at rest there, {listed}")
    place = {name: number(Fraction(value)) for name, value in zip(names, q.tolist(), strict=True)}
    note = f"equilibrium found by scipy.optimize.root; at rest there, {listed}"
    return EquilibriumPlace(place, known_values(document), (note,))


def _require_smooth(expressions: Sequence[Expr], there: Named) -> None:
    """Raise ExpressionError where `abs` and `sign` have their corner or jump: nothing is linear there."""
    for atom in {atom for e in expressions for atom in e.everywhere()}:
        if isinstance(atom, Applied) and atom.function in ("abs", "sign"):
            (argument,) = atom.arguments
            if is_zero(substitute(argument, there)):
                raise ExpressionError(f"`{atom.function}({argument})` is not smooth")


def _notes(roots: Sequence[Root] | None, document: Document) -> Iterator[str]:
    if roots is None:
        yield (
            "the modes have no closed form here: the characteristic polynomial has no factors of low degree; "
            "with values for all parameters they are given in numbers"
        )
    elif any(isinstance(root.rate, Expr) and root.rate.style.decimal for root in roots):
        yield f"rates with decimals have no closed form; they are rounded to {DIGITS_OF_RATES} digits"
    for root in roots or ():
        if root.condition is not None and isinstance(root.rate, Expr):
            rate, where = reading(root.rate.styled(style_of(document)).tree()), inequality(root.condition)
            yield f"the mode with the rate {rate} oscillates where {where}"


def _record(root: Root, vector: Vector) -> dict[str, Any]:
    n = EXACT if isinstance(root.rate, Expr) else FLOAT
    angular, decay = cast(Any, root.angular), cast(Any, -root.growth)
    frequency: Any = angular / (2 * n.pi) if angular else None
    period: Any = None if frequency is None else 1 / frequency
    if n.exact and angular:
        frequency, period = (e.styled(angular.style) for e in (frequency, period))
    is_complex = bool(vector[:, 1].any())
    record = {
        "rate": root.rate,
        "frequency": frequency,
        "period": period,
        "vector": [{"re": x, "im": y} if is_complex else x for x, y in vector.tolist()],
        "stable": root.is_stable,
    }
    if decay and root.is_stable:
        record["decay"] = decay
        if angular:  # Q = w0/(2 b) of the root -b + i w, where w0^2 = b^2 + w^2
            quality = n.sqrt(decay**2 + angular**2) / (2 * decay)
            record["quality"] = tidy(quality) if isinstance(quality, Expr) else quality
    return record


def _component(real: float | Expr, imaginary: float | Expr) -> float | Expr | str:
    """An entry of a mode vector; a complex number is written as text."""
    if isinstance(real, Expr) and isinstance(imaginary, Expr):
        return real + imaginary * symbol("i")
    if not imaginary:
        return real
    written = f"{float(imaginary):.6g}i"
    return written if not real else f"{float(real):.6g} {'' if written[0] == '-' else '+'}{written}"


def _kind(root: Root) -> str:
    if not root.growth and not root.angular:
        return "zero mode"
    if root.is_stable is None:
        is_open = root.condition is None
        return "marginal: small terms decide" if is_open else "depends on the parameters"
    if not root.is_stable:
        return "grows" if root.growth else "grows like a power of t"
    return "decays" if root.growth else "stable"


def _cyclic_momenta(
    document: Document, equilibrium: Equilibrium, derivation: Derivation
) -> tuple[dict[str, Expr], tuple[str, ...]]:
    """The momenta of the coordinates that turn, by their names, and notes on the rate that is solved for.

    There are none where nothing turns. Raises DocumentError where a coordinate is not cyclic, or there is no
    steady rate.
    """
    if not equilibrium.turning:
        return {}, ()
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
    place = known | read(equilibrium.values)
    at_any_rate, at_rest = _forces_at_rest(document, _reduced(derivation, equilibrium, momenta))
    forces = {q: tidy(substitute(force, place)) for q, force in at_any_rate.items()}
    rate = derivation.equations[derivation.phase.coordinates.index(steadily)]
    rate = tidy(substitute(substitute(rate, momenta | at_rest), place))
    try:
        found = steady_rates(forces, momentum(steadily), rate, known_values(document))
    except ExpressionError as error:
        message, key = f"no steady motion: {error.message}", f"equilibrium.{steadily}"
        raise document.refusal(message, key, hint=error.hint) from error
    notes = tuple[str, ...]()
    if found.other is not None:
        notes += (f"a second steady rate is {velocity(steadily)} = {written(found.other)}",)
    if found.condition is not None:
        notes += (f"the motion is steady where {found.condition} > 0",)
    return momenta | {momentum(steadily): found.momentum}, notes


def _reduced(derivation: Derivation, equilibrium: Equilibrium, momenta: Named) -> Derivation:
    """The system of the coordinates that do not turn, with these values of the momenta of the others."""
    if not equilibrium.turning:
        return derivation
    phase, functions = derivation.phase, derivation.system
    assert derivation.hamiltonian is not None
    turned = {velocity(q): substitute(derivation.rates[velocity(q)], momenta) for q in equilibrium.turning}
    places = [k for k, q in enumerate(phase.coordinates) if q not in equilibrium.turning]
    forces = tuple(substitute(functions.forces[k], turned) for k in places)
    system = SystemFunctions(None, substitute(derivation.hamiltonian, momenta), forces=forces)
    names = Phase(*(tuple(part[k] for k in places) for part in (phase.coordinates, phase.momenta)))
    return Derivation(names, tuple(derivation.velocity_names[k] for k in places), system)


def _steady(
    document: Document, equilibrium: Equilibrium, derivation: Derivation, momenta: Named, there: Named
) -> list[Field]:
    """The results on a steady motion with these momenta; the other coordinates and momenta are `there`."""
    is_exact = document.exact_results and not equilibrium.is_sought
    place = {**there, **{name: substitute(p, there) for name, p in momenta.items()}}
    shown = []
    for q in equilibrium.turning:
        rate = tidy(substitute(derivation.rates[velocity(q)], place))
        for name, e in ((velocity(q), rate), (momentum(q), place[momentum(q)])):
            value = e if is_exact or e.names else float(e)
            shown.append(celled(f"steady.{name}", value, f"steady, {name}", latex_name(name)))
    return shown + routhian_fields(document, derivation, equilibrium.turning)


def routhian_fields(document: Document, derivation: Derivation, cyclic: Collection[str]) -> list[Field]:
    """The effective potential, minus the Routhian at rest, and the Routhian without cyclic coordinates."""
    names, system = derivation.velocity_names, derivation.system
    assert derivation.hamiltonian is not None
    given, phase = known_values(document), derivation.phase
    found = routhian(system.lagrangian, derivation.hamiltonian, phase, names, cyclic, given)
    potential = None if found is None else tidy(-substitute(found, dict.fromkeys(names, ZERO)))
    pairs = (("effective_potential", potential), ("routhian", found))
    return [if_known(row_of(key, e)) for key, e in pairs]
