"""The old variables of a canonical change as functions of the new ones, on the branch that holds at a point.

Where roots are taken, or an angle is told by its tangent, it may be otherwise elsewhere: the caller
checks what follows. A matrix M of derivatives of a canonical change is symplectic, so that its inverse is
-J M^T J: no equations are solved for what is linear. Source: V. I. Arnold, Mathematical Methods of Classical
Mechanics, section 41.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.arithmetic import root_of_either_sign, tidy
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr, power, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import rebuilt, substitute, with_powers
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.hamilton_equations import Phase, linear
from rigidcli.mechanics.undoing import solutions

NEAR = 1e-6
"""Values that differ by less than this, in units of their size, are those of the same branch."""

MOST_TRIALS = 60
"""Values of unknowns that are looked at, at most, in the search for a way through the equations."""


@dataclass(frozen=True, slots=True)
class Branch:
    """The signs of square roots of squares: those that they have where names have the values of `point`.

    Where the point does not tell, a root may have either sign.
    """

    point: Mapping[str, float]

    def value(self, e: Expr) -> float:
        """The value at the point; nan where there is none."""
        try:
            return float(e.evaluate(**{name: self.point[name] for name in e.names}))
        except (ExpressionError, KeyError):
            return math.nan

    def is_at(self, e: Expr, value: float) -> bool:
        """Whether an expression has this value at the point."""
        return abs(self.value(e) - value) <= NEAR * (1 + abs(value))

    def root(self, e: Expr) -> Expr:
        """The square root, without a root where it is one of a square."""
        found = root_of_either_sign(e)
        return -found if self.value(found) < 0 else found

    def put(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """The same as `with_roots`, in a short form."""
        return tidy(self.with_roots(e, values))

    def with_roots(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """An expression with names replaced, roots worked out, and tangents in sines and cosines."""
        return self._rooted(substitute(e, values))

    def _rooted(self, e: Expr) -> Expr:
        return with_powers(e, self._of_power)

    def _of_power(self, atom: Atom, n: Rational) -> Expr:
        inner = rebuilt(atom, self._rooted)
        if isinstance(atom, Applied) and atom.function == "tan":
            inner = apply("sin", *atom.arguments) / apply("cos", *atom.arguments)
        half = isinstance(atom, Group) and n.denominator == 2
        return power(self.root(inner), 2 * n) if half else power(inner, n)


def inverse(values: Mapping[str, Expr], new: Phase, old: Phase, branch: Branch) -> dict[str, Expr] | None:
    """The `old` variables as functions of the `new` ones, whose `values` are canonical; None if not found.

    The branch knows the values of the old variables and of the new ones at its point.
    """
    with suppress(ExpressionError, ComputationError):
        parts = linear([values[name] for name in new.names], old.names)
        if parts is not None:
            shifted = [symbol(name) - b for name, b in zip(new.names, parts[1], strict=True)]
            return _of_linear(parts[0], shifted, old)
        half = _half(new, old, values)
        if half is not None:
            return _of_half(values, *half, branch)
        return _solution(
            [symbol(n) - values[n] for n in new.names], old.names, Allowance(MOST_TRIALS), branch
        )
    return None


def _of_linear(matrix: Sequence[Sequence[Expr]], values: Sequence[Expr], old: Phase) -> dict[str, Expr]:
    """M^-1 times values, with M^-1 = -J M^T J."""
    size = len(old.coordinates)
    found = {}
    for place, name in enumerate(old.names):
        other = (place + size) % (2 * size)
        sign = 1 if place < size else -1
        found[name] = sign * total(
            matrix[k + size][other] * values[k] - matrix[k][other] * values[k + size] for k in range(size)
        )
    return found


_Halves: TypeAlias = tuple[tuple[str, ...], tuple[str, ...]]


def _half(new: Phase, old: Phase, values: Mapping[str, Expr]) -> tuple[_Halves, _Halves, int] | None:
    """A half of the new variables that holds a half of the old ones only, each with the other half.

    The last number is 1 where both are coordinates, or both are momenta, else -1.
    """
    for ours in (new.coordinates, new.momenta), (new.momenta, new.coordinates):
        for alone in (old.coordinates, old.momenta), (old.momenta, old.coordinates):
            if all(values[name].names.isdisjoint(alone[1]) for name in ours[0]):
                return ours, alone, 1 if (ours[0] == new.coordinates) == (alone[0] == old.coordinates) else -1
    return None


def _of_half(
    values: Mapping[str, Expr], new: _Halves, old: _Halves, sign: int, branch: Branch
) -> dict[str, Expr] | None:
    """Half of the old variables by solving equations, and the others by the derivatives of these."""
    (ours, theirs), (alone, rest) = new, old
    found = _solution([symbol(name) - values[name] for name in ours], alone, Allowance(MOST_TRIALS), branch)
    if found is None:
        return None
    at_rest = dict.fromkeys(rest, ZERO)
    shifted = [symbol(name) - substitute(values[name], at_rest) for name in theirs]
    others = {
        name: sign * total(derivative(values[a], u) * b for a, b in zip(ours, shifted, strict=True))
        for u, name in zip(alone, rest, strict=True)
    }
    return found | {name: branch.put(e, found) for name, e in others.items()}


def _values(equation: Expr, unknown: str) -> Iterator[Expr]:
    """The values of an unknown for which an equation may hold, as far as they are found."""
    with suppress(ExpressionError, ComputationError):
        yield from (value for value, _, _ in solutions(equation, unknown))


def _solution(
    equations: Sequence[Expr], unknowns: Sequence[str], trials: Allowance, branch: Branch
) -> dict[str, Expr] | None:
    """Values of the unknowns for which the equations (expressions that vanish) hold; None if not found.

    One unknown is isolated in one equation and put into the others, the shortest first.
    """
    if not unknowns:
        return {}
    for equation in sorted(equations, key=lambda e: (len(e.names.intersection(unknowns)), len(e.key))):
        for unknown in unknowns:
            for value in _values(equation, unknown) if unknown in equation.names else ():
                trials.spend(1)
                if not branch.is_at(value, branch.point[unknown]):
                    continue
                with suppress(ExpressionError, ComputationError):
                    here = {unknown: branch.put(value, {})}
                    others = [
                        branch.put(e, here) if unknown in e.names else e
                        for e in equations
                        if e is not equation
                    ]
                    left = [name for name in unknowns if name != unknown]
                    rest = _solution(others, left, trials, branch)
                    if rest is not None:
                        return rest | {unknown: branch.put(here[unknown], rest)}
    return None
