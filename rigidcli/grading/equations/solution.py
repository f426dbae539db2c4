"""What a set of equations determines of a motion, in one way to read it.

To determine the motion is to leave, in every state, one value only to the highest derivatives. Equations do
if they are linear in these, and the matrix of their coefficients has full rank at every state of the motion.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import NamedTuple

from rigidcli.algebra.atoms import is_positive
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, Expr, atomic, factored, gathered, symbol
from rigidcli.algebra.field import reduced
from rigidcli.document.variables import acceleration, velocity
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.elimination import determined, gaps, matrix, slopes, valued
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.truth import vanishes
from rigidcli.grading.expressions.domains import least_sign


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
        table = valued(rows, motion)
        new = set() if table is None else determined(table, left)
        if new and table is not None:
            try:
                found.gaps += gaps(table, new, motion)
            except ExpressionError:
                found.gaps.append(ONE)
            found.known |= new
        elif table is None:
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
    bent = [slopes(e, left) for e in curved]
    linear, both = valued(rows, motion), valued([*rows, *bent], motion)
    if linear is not None and both is not None:
        found, whole = (len(reduced(matrix(each, left))) for each in (linear, both))
        if whole == found + len(curved):
            return determined(both, left)
    return set().union(*(e.names & set(left) for e in curved))
