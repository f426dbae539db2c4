"""Observables: functions of the state, their rates along the motion, and Poisson brackets of them.

    df/dt = {f, H} + df/dt|q,p + sum_i df/dp_i Q_i

where Q_i are the forces beside H, those of constraints among them. Source: H. Goldstein, C. Poole, J. Safko,
Classical Mechanics, 3rd edition, section 9.5. An observable is conserved if this vanishes wherever the
constraints hold.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import combinations, combinations_with_replacement, islice
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, Expr, number, product, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import from_tree, substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero, sample_points
from rigidcli.document.document import Document
from rigidcli.document.phase_space import ENERGIES
from rigidcli.errors import ExpressionError
from rigidcli.language.expression import Expression
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.phase_space import TIME, bracket
from rigidcli.report import Field, Step
from rigidcli.studies.common import celled, if_known, noise
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import compiled, symbolic_equations, terms, way_back
from rigidcli.studies.hamilton.system import derived_parameters, known_values, step

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.orbit import OrbitSolution

# Points on constraints at which functions are compared.
CONSTRAINED_POINTS = 3
# Steps of Newton's method that move a random state onto the constraints.
NEWTON_STEPS = 12
# Ratios that differ by less, in units of themselves, are the same where only values can tell.
SAME_RATIO = 1e-9


class Observable(NamedTuple):
    """A function of coordinates, momenta, t and multipliers, and of velocities where these have no formula.

    The `rate` along the motion is None where accelerations have no formula. The observable is `conserved` if
    that vanishes for the parameters of the document, None where this is open.
    """

    name: str
    function: Expr
    rate: Expr | None
    conserved: bool | None

    def fields(self, orbit: OrbitSolution | None) -> Iterator[Field]:
        """The function, its rate, whether it is conserved, and its mean over the orbit."""
        key, sign, words = f"observables.{self.name}", latex_name(self.name), ""
        if self.conserved and self.rate is not None:
            zero = "0" if self.rate.is_zero else f"{reading(to_tree(self.rate))}, which is zero here"
            words = f"{zero}: conserved"
        yield if_known(celled(f"{key}.expression", self.function, self.name, sign))
        yield if_known(celled(f"{key}.rate", self.rate, f"d{self.name}/dt", rf"\dot{{{sign}}}", words=words))
        yield celled(f"{key}.conserved", self.conserved)
        if orbit is None:
            yield celled(f"{key}.mean", None)
            return
        mean, rounding = orbit.means[key], noise(orbit.trusted_digits) * orbit.scales[key]
        mean_sign, words = rf"\langle {sign} \rangle", "0" if abs(mean) <= rounding else ""
        yield celled(f"{key}.mean", mean, f"mean of {self.name}", mean_sign, words=words)


class NamedBracket(NamedTuple):
    """A Poisson bracket `of` two texts, its value, and what it equals; None where one of these is open."""

    of: tuple[str, str]
    value: Expr | None
    equals: Expr | None


class Observed(NamedTuple):
    """What a document asks about functions of the state; `events` are those of the orbit, by their keys."""

    observables: tuple[Observable, ...]
    brackets: tuple[NamedBracket, ...]
    events: Mapping[str, Expr]

    def fields(self, orbit: OrbitSolution | None) -> list[Field]:
        """The observables with their rates and means over the orbit, and the brackets."""
        shown = [entry for one in self.observables for entry in one.fields(orbit)]
        if self.brackets:
            rows = [{"of": [*pair.of], "value": pair.value, "equals": pair.equals} for pair in self.brackets]
            shown.append(Field("brackets", rows))
        for place, pair in enumerate(self.brackets):
            title, sign = f"{{{', '.join(pair.of)}}}", ", ".join(map(latex_name, pair.of))
            value, cells = pair.value if pair.equals is None else pair.equals, {f"brackets.{place}": ()}
            words = "" if value is not None else "not known"
            shown.append(Field("", value, title, rf"\{{{sign}\}}", cells=cells, words=words))
        return shown

    def steps(self, derivation: Derivation) -> Iterator[Step]:
        """Lead to the rates of the observables, and to the brackets."""
        phase, rates, shown = derivation.phase, derivation.equations, list[Field]()
        for one in self.observables if rates is not None else ():
            moved = [derivative(one.function, x) * f for x, f in zip(phase.names, rates or (), strict=True)]
            size = len(phase.coordinates)
            parts = {
                "sum of df/dq qdot": total(moved[:size]),
                "sum of df/dp pdot": total(moved[size:]),
                "partial df/dt": derivative(one.function, TIME),
            }
            shown.append(Field("", one.function, one.name, latex_name(one.name)))
            shown += [Field("", tidy(e), title) for title, e in parts.items() if e]
            if one.rate is not None:
                shown.append(Field("", one.rate, f"d{one.name}/dt", rf"\dot{{{latex_name(one.name)}}}"))
        if shown:
            yield step("observables", shown)
        shown = []
        for (first, second), value, name in self.brackets:
            if value is not None:
                shown.append(Field("", value, f"{{{first}, {second}}}"))
                shown += [] if name is None or name == value else [Field("", name, "which is")]
        if shown:
            yield step("brackets", shown)


def observed(document: Document, derivation: Derivation) -> Observed:
    """The observables and brackets of a document. Raises DocumentError where one has an unknown energy."""
    given, derived = document.observables or {}, derived_parameters(document)
    h, system = derivation.hamiltonian, derivation.system
    energy = derivation.energy_of_velocities if h is None else h
    energies = {"T": system.kinetic, "V": system.potential, "H": energy}
    # An observable may have the name of an energy.
    known = {name: e for name, e in energies.items() if e is not None and name not in given}

    def function(typed: Expression, key: str) -> Expr:
        for name in ENERGIES[1:]:
            if name in typed.names and name not in known and name not in document.definitions:
                hint = "give `kinetic` and `potential`, or `particles`"
                raise document.refusal(f"the system does not tell {name}", key, hint=hint)
        for name in typed.names & given.keys() - known.keys():
            known[name] = function(given[name], f"observables.{name}")
        try:
            return _of_state(substitute(from_tree(typed.root, derived), known), derivation)
        except ExpressionError as error:
            raise document.refusal(error.message, key) from error

    for name, typed in given.items():
        if name not in known:
            known[name] = function(typed, f"observables.{name}")
    found = [_observable(document, derivation, name, known[name]) for name in given]
    candidates = {one.name: one.function for one in found}
    if "H" in known:
        candidates.setdefault("H", known["H"])
    brackets = []
    for place, pair in enumerate(document.brackets or ()):
        sides = [function(typed, f"brackets.{place}") for typed in pair]
        names = (pair.first.text, pair.second.text)
        free = all(e.names.isdisjoint(derivation.velocity_names) for e in sides)
        value = tidy(bracket(sides[0], sides[1], derivation.phase)) if free else None
        equals = None if value is None else _recognised(value, candidates, derivation)
        brackets.append(NamedBracket(names, value, equals))
    events = {} if document.orbit is None else document.orbit.events
    passing = {key: function(typed, key) for key, typed in events.items()}
    return Observed(tuple(found), tuple(brackets), passing)


def _of_state(e: Expr, derivation: Derivation) -> Expr:
    """A function in terms of coordinates and momenta; of velocities, where these have no formula."""
    known = derivation.rates
    if not known and not derivation.are_linear:
        known = derivation.definitions
    return e if e.names.isdisjoint(known) else tidy(substitute(e, known))


def _observable(document: Document, derivation: Derivation, name: str, e: Expr) -> Observable:
    phase, v, rates = derivation.phase, derivation.velocity_names, {TIME: ONE}
    if derivation.equations is not None:
        rates |= zip(phase.names, derivation.equations, strict=True)
    else:
        rates |= zip(phase.coordinates, map(symbol, v), strict=True)
        rates |= zip(v, derivation.accelerations or (), strict=False)
    limits = [one.name for one in derivation.system.constraints]
    solved = derivation.multipliers_anywhere or ()
    try:
        whole = _of_state(substitute(e, dict(zip(limits, solved, strict=False))), derivation)
        if not whole.names.isdisjoint({*limits, *phase.names, *v} - rates.keys()):
            return Observable(name, e, None, None)
        slopes = total(derivative(whole, x) * f for x, f in rates.items() if x in whole.names)
        rate = tidy(_of_state(slopes, derivation))
        if is_zero(rate):
            rate = total([])
        values = known_values(document)
        conserved = is_zero(rate) or is_zero(substitute(rate, values))
        if not conserved and limits:
            conserved = _vanishes_on_constraints(rate, derivation, values)
    except ExpressionError:
        return Observable(name, e, None, None)
    return Observable(name, e, rate, conserved)


def _vanishes_on_constraints(rate: Expr, derivation: Derivation, values: Mapping[str, Expr]) -> bool:
    """Whether a function vanishes at random states that obey the constraints, for these parameters."""
    equations, limits = symbolic_equations(derivation), derivation.system.constraints
    used = {TIME, *equations.names} | rate.names | derivation.generator.names
    used = used.union(*(one.rate.names | one.expression.names for one in limits))
    fixed = {name: e.evaluate() for name, e in values.items()}
    for point in islice(sample_points(sorted(used), fixed), CONSTRAINED_POINTS):
        back, state = way_back(derivation, point), tuple(point[name] for name in equations.names)
        try:
            for _ in range(NEWTON_STEPS):
                state = tuple(back(point[TIME], state))
        except ArithmeticError:
            return False
        function = compiled(terms(expand(rate)), equations.names, point, equations.steps)
        parts = function(np.array([point[TIME]]), *np.array(state)[:, None])
        if not abs(parts.sum()) <= SAME_RATIO * np.abs(parts).sum():
            return False
    return True


def _recognised(value: Expr, candidates: Mapping[str, Expr], derivation: Derivation) -> Expr | None:
    """The observable, or product of two, of which a bracket is a multiple by parameters; else None."""
    moving = [*derivation.phase.names, TIME]
    if value.names.isdisjoint(moving):
        return None
    every = {name: e for name, e in candidates.items() if not e.names.isdisjoint(moving)}
    groups = [*combinations(every, 1), *combinations_with_replacement(every, 2)]
    point = {name: number(2 * k + 3) / number(k + 2) for k, name in enumerate(moving)}
    for names in groups:
        e = product([every[name] for name in names])
        with suppress(ExpressionError, ZeroDivisionError):
            # With value = c e everywhere, c is their quotient at a point.
            there, of_e = (substitute(part, point) for part in (value, e))
            if is_zero(value * of_e - there * e):
                return product([tidy(there / of_e), *map(symbol, names)])
    return None
