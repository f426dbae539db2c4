"""A set of equations as a whole: whether it is right, and what is wrong with it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import compress

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.equations import determinacy as d
from rigidcli.grading.equations.factors import lasting_zeros
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.mistakes import Mistake
from rigidcli.grading.equations.roots import is_linear, others
from rigidcli.grading.equations.states import STATES
from rigidcli.grading.expressions.formula import independent
from rigidcli.grading.kinds.modules import explained
from rigidcli.grading.outcome import Finding
from rigidcli.model.variables import acceleration, velocity
from rigidcli.symbolic.language.evaluation import array

NARROW = STATES - 3
"""States, the first, whose values are of about one size: where ranks are told."""

SEARCHED = 2
"""States at which further solutions are looked for."""

AGREEING = 3
"""Searches that must lead to the motion for it to be the only solution."""

OTHER = 3.0
"""Times its value in the document, a parameter has another."""

MOST_NAMED = 8
"""Derivatives that a finding names."""


@dataclass(frozen=True, slots=True, eq=False)
class EquationSet:
    """Equations that say something, as they were tried, with their places, and whether each is true (m)."""

    key: Key
    places: Sequence[str]
    tried: Sequence[d.Tried]
    true: Sequence[bool]

    @property
    def names(self) -> frozenset[str]:
        """All names in them."""
        return frozenset().union(*(each.names for each in self.tried))

    @property
    def second_derivatives(self) -> frozenset[str]:
        """The second derivatives in them."""
        return self.names & frozenset(map(acceleration, self.key.motion.functions))

    @property
    def is_of_second_order(self) -> bool:
        """Whether each of them has second derivatives."""
        return all(each.names & self.second_derivatives for each in self.tried)

    @property
    def states(self) -> Mask:
        """The narrow states at which all of them have values (n)."""
        known = np.arange(STATES) < NARROW
        for each in self.tried:
            known &= each.has_value
        return known

    def slopes(self, states: Mask | NDArray[np.int64]) -> Floats:
        """In units of the terms of each equation (m, J, n)."""
        rows = [
            np.divide(each.slopes, each.scale, out=np.zeros_like(each.slopes), where=each.scale > 0)
            for each in self.tried
        ]
        return np.array([row[:, states] for row in rows])

    def only(self, which: Sequence[bool]) -> EquationSet:
        """Some of the equations."""
        kept = [place for place, chosen in enumerate(which) if chosen]
        return EquationSet(
            self.key,
            [self.places[k] for k in kept],
            [self.tried[k] for k in kept],
            [self.true[k] for k in kept],
        )

    def remarks(self) -> list[Finding]:
        """What is to be said of a set that is right: where else it can hold."""
        found = [lasting_zeros(each, self.key.motion, self.key.elsewhere) for each in self.tried]
        if not any(found) or not self.only([not names for names in found]).problems():
            return []
        return [
            Finding("extra_solutions", place, f"where the factor `{name}` is zero for ever")
            for place, names in zip(self.places, found, strict=True)
            for name in names[:1]
        ]

    def problems(self) -> list[Finding]:
        """What is wrong with the set; nothing with one that is right."""
        wrong = [] if all(self.true) else self._wrong_ones()
        implied = self.key.implied
        places, true = [*self.places, *[""] * len(implied)], [*self.true, *[True] * len(implied)]
        return wrong + EquationSet(self.key, places, [*self.tried, *implied], true)._open(not wrong)

    def _open(self, is_true: bool) -> list[Finding]:
        """What says that the set leaves other motions open; where it `is_true`, these are searched for."""
        states = self.states
        if not self.tried or not states.any():
            return self._missing()
        sizes = self.key.stencil.sizes[:, states]
        complete = d.determines(self.key.motion, self.slopes(states), sizes)
        if not is_true:
            return [] if complete else self._missing()
        unknown = self._unknown()
        searched = np.flatnonzero(states)[:SEARCHED]
        values = self.key.values_at(searched)
        curved = [place for place in range(len(self.tried)) if not self._is_linear(place, unknown, values)]
        if not curved:
            return [] if complete else self._missing()
        if not complete:
            # Slopes vanish where a square is zero: so it may be that nothing else solves the equations.
            alone = self._may_determine(unknown) and self._is_alone(unknown, values)
            return [] if alone else self._missing()
        free = d.loose(self.slopes(searched)[:, self._columns(unknown)], unknown)
        tied = [name for name in unknown if name not in free]
        if tied and (self._follow(tied, searched) or self._is_alone(tied, values)):
            return []
        return [Finding("extra_solutions", self.places[curved[0]] if len(curved) == 1 else "")]

    def _unknown(self) -> list[str]:
        """The derivatives for which to solve: of functions that the equations hold, the highest."""
        motion, names = self.key.motion, self.names
        known = {velocity(name) for name in motion.second if acceleration(name) in names}
        return [name for name in motion.jets if name in names - known - set(motion.auxiliary)]

    def _may_determine(self, unknown: Sequence[str]) -> bool:
        """Whether all is among the unknown that has to be, and nothing else is left open."""
        motion = self.key.motion
        if self.second_derivatives:
            return set(motion.tops) <= set(unknown) and self.names.isdisjoint(motion.auxiliary)
        return {*motion.middles, *motion.auxiliary_rates} <= set(unknown) and bool(motion.middles)

    def _is_alone(self, unknown: Sequence[str], values: Mapping[str, Floats]) -> bool:
        """Whether searches for the unknown derivatives lead to the motion, and nowhere else."""
        back, away = others(self.tried, values, unknown)
        return back >= AGREEING and not away

    def _is_linear(self, place: int, unknown: Sequence[str], values: Mapping[str, Floats]) -> bool:
        """Whether one equation is linear in those of the unknown derivatives that it holds."""
        own = [name for name in unknown if name in self.tried[place].names]
        return not own or is_linear(self.tried[place], values, own, self.key.motion.parameters)

    def _follow(self, unknown: Sequence[str], states: NDArray[np.int64]) -> bool:
        """Whether the unknown derivatives follow one after the other from linear equations."""
        left, values = list(unknown), self.key.values_at(states)
        while left:
            linear = [self._is_linear(place, left, values) for place in range(len(self.tried))]
            some = self.only(linear)
            held = [name for name in left if name in some.names]
            if not held:
                return False
            slopes = np.moveaxis(some.slopes(states)[:, self._columns(held)], -1, 0)
            if (d.ranks(slopes) < len(held)).any():
                return False
            left = [name for name in left if name not in held]
        return True

    def _columns(self, names: Sequence[str]) -> list[int]:
        """The places of derivatives among the slopes."""
        return [self.key.motion.jets.index(name) for name in names]

    def _missing(self) -> list[Finding]:
        """That equations are missing, and for what."""
        motion = self.key.motion
        first = motion.first_order and not self.second_derivatives and bool(motion.second)
        rates = (motion.middles if first else motion.tops) + motion.auxiliary_rates
        names = rates if first else motion.tops
        states = self.states
        if self.tried and states.any():
            free = d.loose(self.slopes(states)[:, self._columns(rates)], rates)
            names = tuple(name for name in names if name in free) or names
        more = ", ..." if len(names) > MOST_NAMED else ""
        return [Finding("missing_equation", ", ".join(names[:MOST_NAMED]) + more)]

    def share(self) -> float:
        """The share of right equations that do not follow from each other among those needed."""
        motion, names = self.key.motion, self.names
        beside = list(motion.auxiliary)
        if self.second_derivatives:
            beside = [name for name in beside if name in names or velocity(name) in names]
        needed = len(motion.functions) + len(beside)
        right = self.only(self.true)
        states = right.states
        if not right.tried or not states.any():
            return 0.0
        reached = int(d.ranks(np.moveaxis(right.slopes(states), -1, 0)).max())
        return min(reached, needed - 1) / needed

    def _wrong_ones(self) -> list[Finding]:
        """The mistake that was made, or else the equations that are wrong."""
        places = [place for place, true in zip(self.places, self.true, strict=True) if not true]
        fitting = compress(self.key.mistakes, self._matches())
        details = [(self._code(mistake), mistake.detail) for mistake in fitting]
        if numbers := self._numbers():
            details.append(("number_for_symbol", f"without {', '.join(f'`{name}`' for name in numbers)}"))
        code = explained(details, lambda _: True, "equation_wrong").code
        if code == "equation_wrong":
            return [Finding(code, place) for place in places]
        told = {detail for each, detail in details if each == code}
        return [Finding(code, places[0] if len(places) == 1 else "", told.pop() if len(told) == 1 else "")]

    def _code(self, mistake: Mistake) -> str:
        """What a mistake is called in these equations: those of second order are not Hamilton's."""
        is_plain = mistake.code == "hamilton_sign" and self.second_derivatives
        return "sign_error" if is_plain else mistake.code

    def _matches(self) -> Mask:
        """Which mistakes make all equations true (k)."""
        key, states = self.key, self.states
        count = len(key.mistakes)
        known = key.values_at(states)
        fits: Mask = np.full(count, bool(states.any()))
        changed: dict[str, Floats] = {}
        for name in {name for mistake in key.mistakes for name in mistake.values} & self.names:
            own = [mistake.values.get(name) for mistake in key.mistakes]
            changed[name] = np.array([known[name] if value is None else value[states] for value in own])
        for each in self.tried if fits.any() else ():
            used = {name: changed.get(name, known[name]) for name in each.names}
            found = np.broadcast_to(array(each.node, used), (count, int(states.sum())))
            with np.errstate(invalid="ignore"):
                fits &= (np.abs(found) <= key.tolerance * each.scale[states]).all(axis=1)
        return fits

    def _numbers(self) -> list[str]:
        """The parameters that are lacking, if all is true where just these have their values."""
        key = self.key
        used = independent(key.points.derived, key.motion.known)
        used -= independent(key.points.derived, self.names - key.motion.known.keys())
        values = {name: value for name, value in key.given.items() if name in used}
        if not values or not self._are_true_with(values):
            return []
        # Others cancel, or their values hide a term that is wrong.
        needed = {
            name: value
            for name, value in values.items()
            if not self._are_true_with({**values, name: OTHER * value})
        }
        return list(needed) if needed and self._are_true_with(needed) else []

    def _are_true_with(self, values: Mapping[str, float]) -> bool:
        """Whether all equations are true where parameters have these values."""
        key = self.key
        points = key.points.but(values)
        on = d.stencil(key.motion, points)
        return all(d.is_true(d.tried(each.node, on), points, key.tolerance) for each in self.tried)
