"""A set of equations as a whole: whether each is true, and whether together they determine the motion.

To determine the motion is to leave, in every state, one value only to the highest derivatives. Equations do
if they are linear in these, and the matrix of their coefficients has full rank at every state of the motion.
The rank at almost every state is found in a finite field. At every state it is proved by elimination, with
pivots that are never zero.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from fractions import Fraction
from functools import cached_property
from typing import Literal, NamedTuple, TypeAlias

from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.domain import has_no_value, has_value, open_factors
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.text import Equation
from rigidcli.grading.equations.truth import differs, generic, is_refuted, is_trivial, vanishes
from rigidcli.grading.expressions.domains import least_sign
from rigidcli.model.variables import acceleration, velocity
from rigidcli.symbolic.algebra.atoms import is_positive
from rigidcli.symbolic.algebra.calculus import coefficients, derivative, expand, substitute
from rigidcli.symbolic.algebra.expressions import ONE, ZERO, Expr, atomic, factored, gathered, number, symbol
from rigidcli.symbolic.algebra.field import P, reduced
from rigidcli.symbolic.mechanics.mass_matrix import determinant

Truth: TypeAlias = Literal["true", "wrong", "open"]

MOST_PIVOTS = 24
"""Candidates for one pivot, the shortest, that are looked at."""

LARGEST = 4
"""Rows of the largest determinant that is worked out where no pivot is found."""

Row: TypeAlias = dict[str, tuple[Expr, int]]
"""The coefficients of the unknown derivatives in an equation, with their values at a point of the field."""


class Reading(NamedTuple):
    """What equations are solved for, and what of it they must determine.

    The functions in `second` are given with their velocities; of the others, momenta are given, or nothing
    more. Equations that hold the second derivatives in `foreign` say nothing in it.
    """

    unknown: tuple[str, ...]
    goal: tuple[str, ...]
    second: tuple[str, ...]
    foreign: frozenset[str]


@dataclass(slots=True)
class Solution:
    """What equations determine at almost every state, and the factors that may be zero where they do not.

    It is `hopeful` where equations that are not linear, or not worked out, might tell what is missing.
    What was too large to prove leaves the gap 1, which is no factor that is ever zero.
    """

    reading: Reading
    known: set[str] = field(default_factory=set)
    gaps: list[Expr] = field(default_factory=list)
    hopeful: bool = False

    @property
    def missing(self) -> list[str]:
        """What is not determined and should be."""
        return [name for name in self.reading.goal if name not in self.known]


@dataclass(frozen=True, eq=False)
class System:
    """Equations held against a key."""

    key: Key
    equations: Sequence[Equation]

    @property
    def motion(self) -> Motion:
        """The motion of the key."""
        return self.key.motion

    @cached_property
    def truths(self) -> list[Truth]:
        """Whether each equation is true of the motion, as far as that can be told."""
        return [self._truth(each) for each in self.equations]

    @property
    def are_true(self) -> bool:
        """Whether it is proved that all are true."""
        exprs = [each.exact for each in self.equations]
        if not self.key.tolerance and any(e is None or differs(e, self.motion) for e in exprs):
            return False
        return all(map(self._seems_true, self.equations)) and all(map(self._has_value, self.equations))

    @cached_property
    def trivial(self) -> list[bool]:
        """Whether each is true of everything."""
        return [
            truth == "true" and each.exact is not None and is_trivial(each.exact, self.motion)
            for each, truth in zip(self.equations, self.truths, strict=True)
        ]

    def _truth(self, equation: Equation) -> Truth:
        seems = self._seems_true(equation)
        if seems and self._has_value(equation):
            return "true"
        # Numbers too large to work with are in no equation of a motion.
        sides = equation.left, equation.right
        if equation.exact is None or any(has_no_value(side, self.motion) for side in sides):
            return "wrong"
        return (
            "wrong" if not seems and is_refuted(equation.exact, self.motion, self.key.tolerance) else "open"
        )

    def _has_value(self, equation: Equation) -> bool:
        return has_value(equation.left, self.motion) and has_value(equation.right, self.motion)

    def _seems_true(self, equation: Equation) -> bool:
        """Whether an equation is proved to be true where it has a value."""
        e = equation.exact
        return e is not None and (vanishes(e, self.motion) or self._is_near(e))

    def _is_near(self, e: Expr) -> bool:
        """Whether an equation is true up to its numbers: each term within the tolerance."""
        if not self.key.tolerance:
            return False
        fixed = {name: number(value) for name, value in self.motion.fixed.items()}
        try:
            parts = [Expr({monomial: c}) for monomial, c in expand(e).terms.items()]
            terms = [expand(substitute(self.motion.in_states(part), fixed)).terms for part in parts]
        except ExpressionError:
            return False
        monomials = dict.fromkeys(monomial for term in terms for monomial in term)
        found = [[Fraction(term.get(monomial, 0)) for term in terms] for monomial in monomials]
        sums = [(abs(sum(each, Fraction(0))), max(map(abs, each), default=Fraction(0))) for each in found]
        near = Fraction(self.key.tolerance)
        return all(gap <= near * size for gap, size in sums)

    @property
    def is_open(self) -> bool:
        """Whether one that is not linear might tell what the others do not."""
        of_use = self.solutions[:1] if self.is_first_order else self.solutions
        return any(each.hopeful for each in of_use)

    @property
    def is_first_order(self) -> bool:
        """Whether they hold no second derivatives."""
        return all(each.names.isdisjoint(self.motion.accelerations) for each in self.equations)

    @property
    def is_complete(self) -> bool:
        """Whether it is proved that they determine the motion."""
        return any(not each.missing and not each.gaps for each in self.solutions)

    # --- what they determine

    @cached_property
    def solutions(self) -> list[Solution]:
        """What all equations determine, in each way to read them up to one in which they are complete."""
        chosen = zip(self.equations, self.trivial, strict=True)
        exprs = [each.exact for each, trivial in chosen if not trivial and each.exact]
        found: list[Solution] = []
        for reading in self._readings(exprs):
            found.append(solution(self.motion, exprs, reading))
            if not found[-1].missing and not found[-1].gaps:
                break
        return found

    def _readings(self, exprs: Sequence[Expr]) -> Iterator[Reading]:
        motion = self.motion
        names = frozenset().union(*(e.names for e in exprs))
        partners = motion.partners
        told = tuple(f for f in partners if acceleration(f) in names)
        choices = [()] if self.key.form == "first_order" else [(), told, tuple(partners)]
        if self.key.form == "second_order":
            choices = [told] if told else []
        for second in dict.fromkeys(choices):
            unknown: list[str] = []
            goal: list[str] = []
            foreign = set()
            for f, top in zip(motion.functions, motion.tops, strict=True):
                first = f in partners and f not in second
                own = [velocity(f), velocity(partners[f])] if first else [top]
                goal += own
                unknown += own
                if first:
                    foreign.add(acceleration(f))
                elif f in partners:
                    unknown += [velocity(partners[f]), partners[f]]
            yield Reading(tuple(unknown), tuple(goal), second, frozenset(foreign))

    @property
    def share(self) -> float:
        """The share of right equations that do not follow from each other among those needed."""
        motion = self.motion
        names = frozenset().union(*(each.names for each in self.equations))
        beside = list(motion.auxiliary)
        if names & motion.accelerations:
            beside = [name for name in beside if name in names or velocity(name) in names]
        needed = len(motion.functions) + len(beside)
        chosen = zip(self.equations, self.truths, self.trivial, strict=True)
        saying = [e.exact for e, truth, trivial in chosen if truth == "true" and not trivial and e.exact]
        rows = [_slopes(e, motion.jets) for e in saying]
        found = _valued(rows, motion)
        reached = 0 if found is None else len(reduced(_matrix(found, motion.jets)))
        return min(reached, needed - 1) / needed


def affine(e: Expr, unknown: Sequence[str], motion: Motion) -> dict[str, Expr] | None:
    """The coefficients of unknown names in an equation that is linear in them; None where it is not.

    What it is divided by is left out, and so is a factor that is never zero.
    """
    coefficient, monomial = factored(e)
    above = {atom: n for atom, n in monomial if n > 0 or atom.names.isdisjoint(unknown)}
    needed = {
        atom: n
        for atom, n in above.items()
        if atom.names.isdisjoint(unknown) or not (is_positive(atom) or least_sign(atomic(atom)) == 1)
    }
    for factors in (above, needed) if len(needed) < len(above) else (above,):
        with suppress(ExpressionError):
            parts = coefficients(gathered(coefficient, factors), unknown)
            if parts is not None:
                linear = {p: part for p, part in parts.items() if any(p) and not vanishes(part, motion)}
                if all(sum(powers) == 1 for powers in linear):
                    return {unknown[powers.index(1)]: part for powers, part in linear.items()}
    return None


def solution(
    motion: Motion, equations: Sequence[Expr], reading: Reading, granted: frozenset[str] = frozenset()
) -> Solution:
    """What equations determine: first what those tell that are linear, and then what follows.

    Once all momenta are told by the velocities, they change as they do in the motion.
    """
    found = Solution(reading, set(granted))
    exprs = [e for e in equations if e.names.isdisjoint(reading.foreign)]
    partners = motion.partners
    if not motion.first_order:
        exprs += [symbol(v) - symbol(velocity(q)) for q, v in partners.items()]
    given = {velocity(f) for f in motion.functions} & set(reading.unknown)
    given |= {partners[f] for f in reading.second}
    differentiated = not reading.second
    while True:
        left = [name for name in reading.unknown if name not in found.known]
        every = [affine(e, left, motion) for e in exprs]
        rows = [row for row in every if row]
        valued = _valued(rows, motion)
        new = set() if valued is None else _determined(valued, left)
        if new and valued is not None:
            try:
                found.gaps += _gaps(valued, new, motion)
            except ExpressionError:
                found.gaps.append(ONE)
            found.known |= new
        elif valued is None:
            found.hopeful = True
            return found
        elif differentiated or not given <= found.known:
            curved = [e for e, row in zip(exprs, every, strict=True) if row is None]
            if found.missing and curved and not granted:
                hope = frozenset(found.known | _told_at_most(rows, curved, left, motion))
                if hope > found.known:
                    found.hopeful = not solution(motion, equations, reading, hope).missing
            return found
        if not differentiated and given <= found.known:
            differentiated = True
            for f in reading.second:
                own = motion.known[acceleration(f)] if motion.first_order else symbol(velocity(partners[f]))
                exprs.append(symbol(acceleration(f)) - own)


def _told_at_most(
    rows: Sequence[dict[str, Expr]], curved: Sequence[Expr], left: Sequence[str], motion: Motion
) -> set[str]:
    """What equations that are not linear may determine together with others.

    Where their slopes do not depend on each other, it is what is determined by these: near the motion there
    are as many others as there are directions in which the slopes are zero.
    """
    slopes = [_slopes(e, left) for e in curved]
    linear, both = _valued(rows, motion), _valued([*rows, *slopes], motion)
    if linear is not None and both is not None:
        found, whole = (len(reduced(_matrix(each, left))) for each in (linear, both))
        if whole == found + len(curved):
            return _determined(both, left)
    return set().union(*(e.names & set(left) for e in curved))


def _slopes(e: Expr, names: Sequence[str]) -> dict[str, Expr]:
    """The slopes of an equation; none where they are too large."""
    with suppress(ExpressionError):
        return {name: derivative(e, name) for name in names if name in e.names}
    return {}


def _valued(rows: Sequence[dict[str, Expr]], motion: Motion) -> list[Row] | None:
    """The rows with values at a point of the field."""
    kept = [{name: e for name, e in row.items() if e.terms} for row in rows]
    found = generic([e for row in kept for e in row.values()], motion)
    if found is None:
        return None
    values = iter(found)
    return [{name: (e, next(values)) for name, e in row.items()} for row in kept]


def _matrix(rows: Sequence[Row], columns: Sequence[str]) -> list[list[int]]:
    return [[row[name][1] if name in row else 0 for name in columns] for row in rows]


def _determined(rows: Sequence[Row], columns: Sequence[str]) -> set[str]:
    """The columns in which no vector that the rows take to zero has an entry."""
    echelon = reduced(_matrix(rows, columns))
    return {columns[place] for place, row in echelon.items() if sum(map(bool, row)) == 1}


def _gaps(rows: Sequence[Row], wanted: set[str], motion: Motion) -> list[Expr]:
    """The factors that may be zero, and where they are the rows do not determine what they do elsewhere."""
    table = [dict(row) for row in rows]
    others = {name for row in table for name in row} - wanted
    for columns in (others, wanted):
        left = set(columns)
        while left:
            places = [
                (len(e.key), place, name)
                for place, row in enumerate(table)
                for name, (e, known) in row.items()
                if name in left and known
            ]
            if not places:
                break
            shortest = sorted(places)[:MOST_PIVOTS]
            pivot = next(((k, n) for _, k, n in shortest if not open_factors(table[k][n][0], motion)), None)
            if pivot is None:
                return _of_block(table, sorted(left), motion, shortest[0])
            _eliminate(table, *pivot, motion)
            left.remove(pivot[1])
    return []


def _of_block(
    table: Sequence[Row], columns: Sequence[str], motion: Motion, shortest: tuple[int, int, str]
) -> list[Expr]:
    """The factors that may be zero in the determinant of what has no pivots."""
    echelon = reduced([list(column) for column in zip(*_matrix(table, columns), strict=True)])
    if len(echelon) < len(columns) or len(columns) > LARGEST:
        _, place, name = shortest
        return open_factors(table[place][name][0], motion)
    block = [
        [table[place][name][0] if name in table[place] else ZERO for name in columns] for place in echelon
    ]
    return open_factors(determinant(block), motion)


def _eliminate(table: list[Row], place: int, name: str, motion: Motion) -> None:
    """Take a column out of the rows by that with the pivot, which goes."""
    pivot = table.pop(place)
    head, known = pivot.pop(name)
    inverse = pow(known, -1, P)
    for row in table:
        if name not in row:
            continue
        e, value = row.pop(name)
        for other, (entry, size) in pivot.items():
            own, here = row.pop(other, (ZERO, 0))
            changed = own - e * entry / head
            found = (here - value * size * inverse) % P
            if found or not vanishes(changed, motion):
                row[other] = (changed, found)
