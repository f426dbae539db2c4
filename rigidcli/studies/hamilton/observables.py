"""Observables: functions of the state, their rates along the motion, and Poisson brackets of them.

    df/dt = {f, H} + df/dt|q,p + sum_i df/dp_i Q_i

where Q_i are the forces beside H, those of constraints among them. Source: H. Goldstein, C. Poole, J. Safko,
Classical Mechanics, 3rd edition, section 9.5. An observable is conserved if this vanishes wherever the
constraints hold.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import replace
from itertools import combinations, combinations_with_replacement
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, Expr, product, symbol, total
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.values import is_zero, sampled
from rigidcli.core.estimate import columns
from rigidcli.document.document import Document
from rigidcli.document.observables import ENERGIES
from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.language.expression import Expression
from rigidcli.language.text import latex_name, reading
from rigidcli.mechanics.hamilton_equations import TIME, bracket
from rigidcli.report import Field, Step
from rigidcli.studies.common import if_known, noise
from rigidcli.studies.hamilton.constrained import keeper
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import symbolic_equations, terms
from rigidcli.studies.hamilton.named import SAME, factor_of
from rigidcli.studies.hamilton.system import derived_parameters, known_values

if TYPE_CHECKING:
    from rigidcli.studies.hamilton.orbit import OrbitSolution


class Observable(NamedTuple):
    """A function of coordinates, momenta, t and multipliers, and of velocities where these have no formula.

    The `rate` along the motion is None where accelerations have no formula. The observable is `conserved` if
    that vanishes for the parameters of the document, None where this is open.
    """

    name: str
    function: Expr
    rate: Expr | None
    conserved: bool | None


class NamedBracket(NamedTuple):
    """A Poisson bracket `of` two texts, its value, and what it equals; None where one of these is open."""

    of: tuple[str, str]
    value: Expr | None
    equals: Expr | None


class Observed(NamedTuple):
    """What a document asks about functions of the state; `events` are those of the orbit, by their keys."""

    observables: tuple[Observable, ...]
    brackets: tuple[NamedBracket, ...]
    functions: Mapping[str, Expr]
    events: Mapping[str, Expr]


def observed(document: Document, derivation: Derivation) -> Observed:
    """The observables and brackets of a document. Raises DocumentError where one has an unknown energy."""
    known, given = _energies(derivation), document.observables or {}
    derived = derived_parameters(document)

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

    for name in given:
        known.pop(name, None)
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
    return Observed(
        tuple(found),
        tuple(brackets),
        {one.name: one.function for one in found},
        {key: function(typed, key) for key, typed in events.items()},
    )


def _energies(derivation: Derivation) -> dict[str, Expr]:
    """H, T and V as functions of the state, as far as they are known."""
    system, momenta = derivation.system, derivation.momenta
    energies = {"T": system.kinetic, "V": system.potential, "H": derivation.hamiltonian}
    if system.kinetic is None:
        energies["V"] = None
    if energies["H"] is None and momenta is not None and system.lagrangian is not None:
        pairs = zip(momenta.definitions, derivation.velocity_names, strict=True)
        energies["H"] = total([*(p * symbol(v) for p, v in pairs), -system.lagrangian])
    return {name: e for name, e in energies.items() if e is not None}


def _of_state(e: Expr, derivation: Derivation) -> Expr:
    """A function without velocities, if these have formulas; else without momenta, if that is needed."""
    if derivation.velocities is not None:
        known = dict(zip(derivation.velocity_names, derivation.velocities, strict=True))
    elif derivation.momenta is not None and not derivation.are_linear:
        known = dict(zip(derivation.phase.momenta, derivation.momenta.definitions, strict=True))
    else:
        return e
    return e if e.names.isdisjoint(known) else tidy(substitute(e, known))


def _observable(document: Document, derivation: Derivation, name: str, e: Expr) -> Observable:
    phase, rates = derivation.phase, {TIME: ONE}
    if derivation.equations is not None:
        rates |= dict(zip(phase.names, derivation.equations, strict=True))
    else:
        v = derivation.velocity_names
        rates |= dict(zip(phase.coordinates, map(symbol, v), strict=True))
        if derivation.accelerations is not None:
            rates |= dict(zip(v, derivation.accelerations, strict=True))
    limits, solved = (
        [one.name for one in derivation.system.constraints],
        derivation.multipliers_anywhere or (),
    )
    try:
        whole = _of_state(substitute(e, dict(zip(limits, solved, strict=False))), derivation)
        if not whole.names.isdisjoint([*limits, *(_moving(derivation) - rates.keys())]):
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


def _moving(derivation: Derivation) -> set[str]:
    return {*derivation.phase.names, *derivation.velocity_names}


def _vanishes_on_constraints(rate: Expr, derivation: Derivation, values: Mapping[str, Expr]) -> bool:
    """Whether a function vanishes at random states that obey the constraints, for these parameters."""
    equations = symbolic_equations(derivation)
    moving, limits = {TIME, *equations.names}, derivation.system.constraints
    used = frozenset[str]().union(rate.names, *(one.rate.names | one.expression.names for one in limits))
    letters = sorted(
        (used | derivation.generator.names) - moving - _moving(derivation) - {o.name for o in limits}
    )
    points = sampled([symbol(name) for name in (*letters, TIME, *equations.names)], {}, 3)
    assert points is not None
    for point in points:
        constants = dict(zip(letters, point.tolist(), strict=False))
        constants |= {name: e.evaluate() for name, e in values.items() if not e.names}
        back, t = keeper(derivation, constants), float(point[len(letters)])
        state: Sequence[float] = point[len(letters) + 1 :].tolist()
        try:
            for _ in range(12):
                state = back.back(t, state)
        except ArithmeticError:
            return False
        trees = [to_tree(e) for e in terms(expand(rate))]
        f = columns(code.function(trees, [TIME, *equations.names], constants, equations.steps))
        parts = f(np.array([t]), *(np.array([x]) for x in state))
        if not abs(parts.sum()) <= SAME * np.abs(parts).sum():
            return False
    return True


def _recognised(value: Expr, candidates: Mapping[str, Expr], derivation: Derivation) -> Expr | None:
    """The observable that a bracket is, or a product of two, with a factor of parameters; else None."""
    moving = [*derivation.phase.names, TIME]
    if value.names.isdisjoint(moving):
        return None
    every = {name: e for name, e in candidates.items() if not e.names.isdisjoint(moving)}
    groups = [*combinations(every, 1), *combinations_with_replacement(every, 2)]
    for names in groups:
        with suppress(ExpressionError, ZeroDivisionError):
            factor = factor_of(value, product([every[name] for name in names]), moving)
            if factor is not None:
                return product([factor, *map(symbol, names)])
    return None


def fields(found: Observed, orbit: OrbitSolution | None) -> list[Field]:
    """The observables with their rates and means over the orbit, and the brackets."""
    shown = []
    for one in found.observables:
        key, sign = f"observables.{one.name}", latex_name(one.name)
        shown.append(
            Field(f"{key}.expression", one.function, one.name, sign, cells={f"{key}.expression": ()})
        )
        is_still = one.rate is not None and one.rate.is_zero
        words = "0: conserved" if is_still else ""
        if one.conserved and not is_still:
            words = (
                f"{reading(to_tree(one.rate))}, which is zero here: conserved" if one.rate is not None else ""
            )
        rate, cells = (
            Field(f"{key}.rate", one.rate, f"d{one.name}/dt", rf"\dot{{{sign}}}"),
            {f"{key}.rate": ()},
        )
        shown.append(if_known(replace(rate, cells=cells, words=words)))
        shown.append(Field(f"{key}.conserved", one.conserved, cells={f"{key}.conserved": ()}))
        mean = None if orbit is None else orbit.means[key]
        is_noise = (
            orbit is not None and abs(orbit.means[key]) <= noise(orbit.trusted_digits) * orbit.scales[key]
        )
        title, sign = f"mean of {one.name}", rf"\langle {sign} \rangle"
        entry = Field(f"{key}.mean", mean, title, sign, cells={f"{key}.mean": ()})
        shown.append(if_known(replace(entry, words="0" if is_noise else "")))
    if found.brackets:
        rows = [{"of": [*pair.of], "value": pair.value, "equals": pair.equals} for pair in found.brackets]
        shown.append(Field("brackets", rows))
    for place, pair in enumerate(found.brackets):
        title, sign = f"{{{', '.join(pair.of)}}}", ", ".join(map(latex_name, pair.of))
        value = pair.value if pair.equals is None else pair.equals
        entry = Field("", value, title, rf"\{{{sign}\}}", cells={f"brackets.{place}": ()})
        shown.append(replace(entry, words="" if value is not None else "not known"))
    return shown


def steps(found: Observed, derivation: Derivation) -> Iterator[Step]:
    """Lead to the rates of the observables, and to the brackets."""
    phase, rates = derivation.phase, derivation.equations
    shown = list[Field]()
    for one in found.observables if rates is not None else ():
        size = len(phase.coordinates)
        pairs = [*zip(phase.names, rates or (), strict=True)]
        moved = [
            total(derivative(one.function, x) * f for x, f in part) for part in (pairs[:size], pairs[size:])
        ]
        parts = [moved[0], moved[1], derivative(one.function, TIME)]
        titles = ("sum of df/dq qdot", "sum of df/dp pdot", "partial df/dt")
        shown.append(Field("", one.function, one.name, latex_name(one.name)))
        shown += [Field("", tidy(e), title) for title, e in zip(titles, parts, strict=True) if e]
        if one.rate is not None:
            shown.append(Field("", one.rate, f"d{one.name}/dt", rf"\dot{{{latex_name(one.name)}}}"))
    if shown:
        yield Step(
            "Rates of the observables",
            "Along the motion, f changes by the sum of df/dq qdot + df/dp pdot, which is its bracket with H "
            "where there are no forces, and by df/dt.",
            tuple(shown),
        )
    shown = []
    for (first, second), value, name in found.brackets:
        if value is not None:
            title = f"{{{first}, {second}}}"
            shown.append(Field("", value, title))
            shown += [] if name is None or name == value else [Field("", name, "which is")]
    if shown:
        sentence = "The bracket {A, B} is the sum of dA/dq dB/dp - dA/dp dB/dq."
        yield Step("Poisson brackets", sentence, tuple(shown))
