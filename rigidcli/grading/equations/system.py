"""A set of equations as a whole: whether each is true, and whether together they determine the motion."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property
from typing import Literal, TypeAlias

from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, number
from rigidcli.algebra.field import reduced
from rigidcli.algebra.substitution import substitute
from rigidcli.document.variables import acceleration, velocity
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.domain import has_no_value, has_value
from rigidcli.grading.equations.elimination import matrix, slopes, valued
from rigidcli.grading.equations.key import Key
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.solution import Reading, Solution, solution
from rigidcli.grading.equations.text import Equation
from rigidcli.grading.equations.truth import differs, is_refuted, is_trivial, vanishes

Truth: TypeAlias = Literal["true", "wrong", "open"]


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
        rows = [slopes(e, motion.jets) for e in saying]
        found = valued(rows, motion)
        reached = 0 if found is None else len(reduced(matrix(found, motion.jets)))
        return min(reached, needed - 1) / needed
