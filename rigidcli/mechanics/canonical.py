"""Changes of variables in phase space: whether they are canonical, where, and the way back.

A change is canonical if and only if the fundamental Poisson brackets stay what they are,
{Q_i, Q_j} = {P_i, P_j} = 0 and {Q_i, P_j} = delta_ij. Where the old variables are given as functions of the
new ones, the same is asked the other way round, of the brackets of the old ones by the new ones: one follows
from the other. Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, sections 9.4 and
9.5.

The way back is the one on the branch that holds at a point: where roots are taken, or an angle is given by
its tangent, it may be another elsewhere. A matrix M of derivatives of a canonical change is symplectic, so
that its inverse is -J M^T J: no equations are solved for what is linear. Source: V. I. Arnold,
Mathematical Methods of Classical Mechanics, section 41.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.arithmetic import root_of_either_sign
from rigidcli.algebra.arithmetic import tidy as in_lowest_terms
from rigidcli.algebra.atoms import Applied, Atom, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ONE, ZERO, Expr, power, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.substitution import rebuilt, substitute, with_powers
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.hamilton_equations import Phase, bracket, linear
from rigidcli.mechanics.undoing import solutions


def brackets(values: Mapping[str, Expr], pairs: Phase, phase: Phase) -> dict[tuple[str, str], Expr]:
    """All fundamental brackets of the variables `pairs`, whose `values` are functions on `phase`."""
    return {(a, b): bracket(values[a], values[b], phase) for a, b in combinations(pairs.names, 2)}


def expected(a: str, b: str, pairs: Phase) -> Expr:
    """What the bracket of two variables is, if they are canonical."""
    conjugate = b in pairs.momenta and a in pairs.coordinates
    return ONE if conjugate and pairs.coordinates.index(a) == pairs.momenta.index(b) else ZERO


def positive_names(expressions: Iterable[Expr], variables: Sequence[str]) -> tuple[str, ...] | None:
    """The names that must be positive for all the expressions to vanish; None if that is not enough.

    Conditions on parameters are preferred to conditions on `variables`.
    """
    left = [e for e in expressions if not is_zero(e)]
    if not left:
        return ()
    parameters = sorted({name for e in left for name in e.names}.difference(variables))

    def vanish(names: Sequence[str]) -> bool:
        positive = {name: symbol(name, positive=True) for name in names}
        with suppress(ExpressionError):
            return all(is_zero(substitute(e, positive)) for e in left)
        return False

    needed = [*variables, *parameters]
    if not vanish(needed):
        return None
    for name in tuple(needed):
        fewer = [kept for kept in needed if kept != name]
        if vanish(fewer):
            needed = fewer
    return tuple(needed)


NEAR = 1e-6
"""Values that differ by less than this, in units of their size, are those of the same branch."""

MOST_TRIALS = 60
"""Values of unknowns that are looked at, at most, in the search for a way through the equations."""


@dataclass(frozen=True, slots=True)
class Branch:
    """The signs that square roots of squares have where names have the values of `point`.

    Where a root has no value there, it may have either sign.
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
        root = root_of_either_sign(e)
        return -root if self.value(root) < 0 else root

    def put(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """The same as `with_roots`, in a short form."""
        return in_lowest_terms(self.with_roots(e, values))

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
    """The `old` variables as functions of the `new` ones, which have canonical `values`; None if none follow.

    The point of the branch has values of the old variables and of the new ones.
    """
    with suppress(ExpressionError, ComputationError):
        parts = linear([values[name] for name in new.names], old.names)
        if parts is not None:
            shifted = [symbol(name) - b for name, b in zip(new.names, parts[1], strict=True)]
            return _of_linear(parts[0], shifted, old)
        if all(values[name].names.isdisjoint(old.momenta) for name in new.coordinates):
            return _of_point(values, new, old, branch)
        return _solution(
            [symbol(n) - values[n] for n in new.names], old.names, Allowance(MOST_TRIALS), branch
        )
    return None


def _of_linear(matrix: Sequence[Sequence[Expr]], values: Sequence[Expr], old: Phase) -> dict[str, Expr]:
    """M^-1 times values, with M^-1 = -J M^T J."""
    size = len(old.coordinates)
    solution = {}
    for place, name in enumerate(old.names):
        other = (place + size) % (2 * size)
        sign = 1 if place < size else -1
        solution[name] = sign * total(
            matrix[k + size][other] * values[k] - matrix[k][other] * values[k + size] for k in range(size)
        )
    return solution


def _of_point(values: Mapping[str, Expr], new: Phase, old: Phase, branch: Branch) -> dict[str, Expr] | None:
    """The coordinates by solving Q(q), and the momenta p_i = sum_j (P_j - P_j(p = 0)) dQ_j/dq_i."""
    equations = [symbol(name) - values[name] for name in new.coordinates]
    coordinates = _solution(equations, old.coordinates, Allowance(MOST_TRIALS), branch)
    if coordinates is None:
        return None
    at_rest = dict.fromkeys(old.momenta, ZERO)
    pairs = [
        (values[Q], symbol(P) - substitute(values[P], at_rest))
        for Q, P in zip(new.coordinates, new.momenta, strict=True)
    ]
    others = {
        p: branch.put(total(derivative(Q, q) * P for Q, P in pairs), coordinates)
        for q, p in zip(old.coordinates, old.momenta, strict=True)
    }
    return coordinates | others


def _values(equation: Expr, unknown: str) -> Iterator[Expr]:
    """The values of an unknown for which an equation may hold, as far as undoing leads to them."""
    with suppress(ExpressionError, ComputationError):
        yield from (value for value, _, _ in solutions(equation, unknown))


def _solution(
    equations: Sequence[Expr], unknowns: Sequence[str], trials: Allowance, branch: Branch
) -> dict[str, Expr] | None:
    """Values of the unknowns for which the equations (expressions that vanish) hold; None where none follow.

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
