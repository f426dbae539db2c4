"""The old variables of a canonical change as functions of the new ones, on the branch that holds at a point.

Where roots are taken, or an angle is told by its tangent, it may be otherwise elsewhere: the caller
checks what follows. A matrix M of derivatives of a canonical change is symplectic, so that its inverse is
-J M^T J: no equations are solved for what is linear. Source: V. I. Arnold, Mathematical Methods of Classical
Mechanics, section 41.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from typing import TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.isolation import Branch, isolated
from rigidcli.algebra.substitution import substitute
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.hamilton_equations import Phase, linear

MOST_TRIALS = 60
"""Values of unknowns that are looked at, at most, in the search for a way through the equations."""


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
            for value in isolated(equation, unknown, branch) if unknown in equation.names else ():
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
