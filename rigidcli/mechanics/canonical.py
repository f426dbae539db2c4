"""Changes of variables in phase space: whether they are canonical, where, the way back, and the new H.

A change is canonical if and only if the fundamental Poisson brackets stay what they are,
{Q_i, Q_j} = {P_i, P_j} = 0 and {Q_i, P_j} = delta_ij. Where the old variables are given as functions of the
new ones, the same is asked the other way round, of the brackets of the old ones by the new ones: one follows
from the other. The new H is K = H + R: where the change holds the time, the new variables Z move at fixed old
ones, as by a Hamiltonian R of their own, dZ/dt = J dR/dZ. Source: H. Goldstein, C. Poole, J. Safko, Classical
Mechanics, 3rd edition, sections 9.1, 9.4 and 9.5.

The way back is the one on the branch that holds at a point: where roots are taken, or an angle is given by
its tangent, it may be another elsewhere.

A generating function F of the old variables q, p and the new ones Q, P has one half of each:

    F1(q, Q, t):    p = dF/dq      P = -dF/dQ
    F2(q, P, t):    p = dF/dq      Q =  dF/dP
    F3(p, Q, t):    q = -dF/dp     P = -dF/dQ
    F4(p, P, t):    q = -dF/dp     Q =  dF/dP

and K = H + dF/dt, the derivative at fixed arguments. The relations are a change of variables where the matrix
of mixed derivatives of F is invertible (table 9.1 there).
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from rigidcli.algebra.arithmetic import root_of_either_sign
from rigidcli.algebra.arithmetic import tidy as in_lowest_terms
from rigidcli.algebra.atoms import Applied, Atom, Group, Symbol
from rigidcli.algebra.bounds import Allowance, Rational
from rigidcli.algebra.calculus import antiderivative, derivative
from rigidcli.algebra.expansion import coefficients, polynomial_sum
from rigidcli.algebra.expressions import (
    ZERO,
    Expr,
    atomic,
    factored,
    gathered,
    power,
    product,
    symbol,
    total,
)
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import exponentials_merged, shortest, tidy
from rigidcli.algebra.substitution import mapped, rebuilt, substitute, with_powers
from rigidcli.algebra.values import is_zero, sample_points
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.inversion import on_main_branch, solutions
from rigidcli.mechanics.phase_space import TIME, Phase


def positive_names(expressions: Iterable[Expr], variables: Sequence[str]) -> tuple[str, ...] | None:
    """The names that must be positive for expressions to vanish, `variables` only if need be; or None."""
    left = [e for e in expressions if not is_zero(e)]
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
        needed = fewer if vanish(fewer) else needed
    return tuple(needed)


EARLY = 0.01  # the time at a sample point in units of other values
NEAR = 1e-6  # relative tolerance of values at the sample point: another branch has another value there
MOST_TRIALS = 60  # the most values of unknowns that are tried on the way through the equations


class RootSigns(NamedTuple):
    """The sign that each square root has at a sample `point`; either where it has no value there."""

    point: Mapping[str, float]

    def value(self, e: Expr) -> float:
        """The value at the point; nan where there is none."""
        try:
            return float(e.evaluate(**{name: self.point[name] for name in e.names}))
        except (ExpressionError, KeyError):
            return math.nan

    def root(self, e: Expr) -> Expr:
        """The square root, without a root where it is one of a square."""
        root = root_of_either_sign(e)
        return -root if self.value(root) < 0 else root

    def put(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """The same as `with_roots`, in lowest terms."""
        return in_lowest_terms(self.with_roots(e, values))

    def with_roots(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        """An expression with names replaced, roots worked out, and tangents in sines and cosines."""
        put_in = self._with_roots(e, values)
        return self._with_roots(put_in, {}) if values else put_in

    def _with_roots(self, e: Expr, values: Mapping[str, Expr]) -> Expr:
        def of_power(atom: Atom, n: Rational) -> Expr:
            inner = rebuilt(atom, lambda e: self._with_roots(e, values))
            if isinstance(atom, Symbol):
                inner = values.get(atom.name, inner)
            elif isinstance(atom, Applied) and atom.function == "tan":
                (angle,) = atom.arguments
                inner = self._with_roots(apply("sin", angle) / apply("cos", angle), values)
            # Of x^2 under a root, put in with the root, it would be abs(x) for good.
            half = n.denominator == 2 and (isinstance(atom, Group) or inner != atomic(atom))
            return power(self.root(inner), 2 * n) if half else power(inner, n)

        return with_powers(e, of_power)


def inverse(values: Mapping[str, Expr], new: Phase, old: Phase, signs: RootSigns) -> dict[str, Expr] | None:
    """The `old` variables as functions of the `new` ones, which have canonical `values`; or None."""
    with suppress(ExpressionError, ComputationError):
        trials = Allowance(MOST_TRIALS)
        if any(not values[Q].names.isdisjoint(old.momenta) for Q in new.coordinates):
            return solution([symbol(n) - values[n] for n in new.names], old.names, trials, signs)
        # Of a change Q(q) the momenta follow: p_i = sum_j (P_j - P_j(p = 0)) dQ_j/dq_i.
        equations = [symbol(Q) - values[Q] for Q in new.coordinates]
        coordinates = solution(equations, old.coordinates, trials, signs)
        if coordinates is not None:
            at_rest = dict.fromkeys(old.momenta, ZERO)
            shifted = [symbol(P) - substitute(values[P], at_rest) for P in new.momenta]
            pairs = [(values[Q], P) for Q, P in zip(new.coordinates, shifted, strict=True)]
            sums = (total(derivative(Q, q) * P for Q, P in pairs) for q in old.coordinates)
            momenta = [signs.put(e, coordinates) for e in sums]
            return coordinates | dict(zip(old.momenta, momenta, strict=True))
    return None


def _values(equation: Expr, unknown: str) -> Iterator[Expr]:
    with suppress(ExpressionError, ComputationError):
        yield from (value for value, _, _ in solutions(equation, unknown))


def solution(
    equations: Sequence[Expr], unknowns: Sequence[str], trials: Allowance, signs: RootSigns
) -> dict[str, Expr] | None:
    """Values of the unknowns for which the equations (expressions that vanish) hold; None where none follow.

    One unknown is isolated in one equation and put into the others, the shortest first.
    """
    if not unknowns:
        return {}
    for equation in sorted(equations, key=lambda e: (len(e.names.intersection(unknowns)), e.nodes)):
        for unknown in unknowns:
            for value in _values(equation, unknown) if unknown in equation.names else ():
                trials.spend(1)
                known = signs.point[unknown]
                if not abs(signs.value(value) - known) <= NEAR * (1 + abs(known)):
                    continue
                with suppress(ExpressionError, ComputationError):
                    here = {unknown: signs.put(value, {})}
                    others = [
                        signs.put(e, here) if unknown in e.names else e
                        for e in equations
                        if e is not equation
                    ]
                    left = [name for name in unknowns if name != unknown]
                    rest = solution(others, left, trials, signs)
                    if rest is not None:
                        return rest | {unknown: signs.put(here[unknown], rest)}
    return None


class NewHamiltonian(NamedTuple):
    """K for positive values of some names."""

    hamiltonian: Expr
    positive: tuple[str, ...]


def new_hamiltonian(
    hamiltonian: Expr,
    values: Mapping[str, Expr],
    old: Phase,
    new: Phase,
    rate: Expr | None = None,
    signs: RootSigns | None = None,
) -> NewHamiltonian | None:
    """K for an H, tested for all variables or for positive ones; None where none is found.

    The `values` of one side are functions of the other side. Where a generating function makes the change,
    `rate` is its derivative by the time, at fixed arguments, and `signs` are those that its relations have.
    """
    is_given = values.keys() == {*old.names}
    signs = signs or next(_points((hamiltonian, *values.values()), values), RootSigns({}))
    back = values if is_given else inverse(values, new, old, signs)
    if back is None:
        return None
    slopes = _added_slopes(back, old, new)
    added = _function_with(slopes, new.names) if rate is None else signs.with_roots(rate, back)
    if added is None:
        return None
    k = _gathered(signs.with_roots(hamiltonian, back) + added, new)
    if is_given:
        misses = [k - added - substitute(hamiltonian, back)]
        rates = [derivative(added, name) for name in new.names]
    else:
        misses = [on_main_branch(substitute(k - added, values)) - hamiltonian]
        slopes = [substitute(slope, values) for slope in slopes]
        # dR/dZ by the old variables: -dP/dt for the coordinates, dQ/dt for the momenta
        moved = {name: derivative(values[name], TIME) for name in new.names}
        rates = [*(-moved[P] for P in new.momenta), *(moved[Q] for Q in new.coordinates)]
    misses += [slope - rate for slope, rate in zip(slopes, rates, strict=True)]
    positive = positive_names(misses, (*(new if is_given else old).names, TIME))
    return None if positive is None else NewHamiltonian(k, positive)


def _points(expressions: Sequence[Expr], values: Mapping[str, Expr]) -> Iterator[RootSigns]:
    """Points at which variables have `values`, and the other names in the expressions are positive."""
    names = {name for e in expressions for name in e.names}.difference(values)
    for point in sample_points(sorted(names), {}):
        # Near t = 0 a phase Q - w t has the sign that textbooks give it.
        point = {name: value * EARLY if name == TIME else value for name, value in point.items()}
        here = RootSigns(point)
        there = {name: here.value(e) for name, e in values.items()}
        if all(map(math.isfinite, there.values())):
            yield RootSigns({**point, **there})


def _added_slopes(old: Mapping[str, Expr], phase: Phase, new: Phase) -> list[Expr]:
    """dR/dZ (2n) for old variables z(Z, t): sum_i dq_i/dZ dp_i/dt - dp_i/dZ dq_i/dt."""
    pairs = [(old[q], old[p]) for q, p in zip(phase.coordinates, phase.momenta, strict=True)]

    def slope(name: str) -> Expr:
        parts = (
            derivative(q, name) * derivative(p, TIME) - derivative(p, name) * derivative(q, TIME)
            for q, p in pairs
        )
        return tidy(total(parts))

    return list(map(slope, new.names))


def _function_with(slopes: Sequence[Expr], names: Sequence[str]) -> Expr | None:
    """The function with these derivatives by the names; None where no integral is known.

    Products of roots may only join where what is under them is positive.
    """
    atoms = {atom for slope in slopes for atom in slope.everywhere()}
    open_ = {a.name for a in atoms if isinstance(a, Symbol) and not a.positive} - {TIME}
    free = {name: symbol(name) for name in open_}
    positive = {name: symbol(name, positive=True) for name in free}
    there, integral = [tidy(substitute(slope, positive)) for slope in slopes], ZERO
    for name, slope in reversed([*zip(names, there, strict=True)]):
        part = antiderivative(tidy(slope - derivative(integral, name)), name)
        if part is None:
            return None
        integral += part
    misses = [slope - derivative(integral, name) for name, slope in zip(names, there, strict=True)]
    return substitute(integral, free) if all(map(is_zero, misses)) else None


def _gathered(e: Expr, phase: Phase) -> Expr:
    """The expression as a polynomial in the momenta, or else in all variables, with tidy coefficients."""
    e = exponentials_merged(e)
    for names in (phase.names, phase.momenta):
        with suppress(ExpressionError, ComputationError):
            polynomial = coefficients(e, names)
            if polynomial is not None:
                short = {powers: in_lowest_terms(c) for powers, c in polynomial.items()}
                forms = [tidy(e), tidy(polynomial_sum(short, list(map(symbol, names))))]
                return shortest([*forms, *(_in_brackets(form, phase) for form in forms)])
    return tidy(e)


def _in_brackets(e: Expr, phase: Phase) -> Expr:
    """Terms with the same number and parameters in one bracket, as in w*(P**2 + Q**2)."""
    parts: dict[Expr, list[Expr]] = {}
    for monomial, coefficient in e.ordered:
        fixed = {atom: n for atom, n in monomial if atom.names.isdisjoint(phase.names)}
        parts.setdefault(gathered(max(coefficient, -coefficient), fixed), []).append(
            Expr({monomial: coefficient})
        )
    products = (factored(total(terms)) for terms in parts.values())
    return total(gathered(number, dict(monomial)) for number, monomial in products)


SINGULAR = 1e-9  # a matrix with a singular value below this share of its largest entry is singular


class Generated(NamedTuple):
    """The change that a generating function makes.

    `relations` are the other old and new variables as functions of its arguments. `old` are the old
    variables as functions of the new ones, and `new` the new ones by the old ones; each is None where the
    relations are not solved for it. `rate` is dF/dt at fixed arguments, and `signs` are those of roots at a
    point where the relations hold. Where `old` and `new` are not inverse everywhere, the old variables of
    that point tell the `branch`.
    """

    relations: Mapping[str, Expr]
    old: Mapping[str, Expr] | None
    new: Mapping[str, Expr] | None
    rate: Expr
    signs: RootSigns
    branch: Mapping[str, float] | None = None


def generated(kind: str, function: Expr, old: Phase, new: Phase) -> Generated:
    """The change by a function of a `kind`, such as "F1". Raises ComputationError where it makes none."""
    befores = old.momenta if kind in ("F3", "F4") else old.coordinates
    afters = new.momenta if kind in ("F2", "F4") else new.coordinates
    relations = {}
    for phase, names in ((old, befores), (new, afters)):
        for name in names:
            # p = dF/dq and Q = dF/dP, but q = -dF/dp and P = -dF/dQ.
            sign = 1 if (phase is old) == (name in phase.coordinates) else -1
            partner = dict(zip(phase.names, phase.momenta + phase.coordinates, strict=True))[name]
            relations[partner] = tidy(sign * derivative(function, name))
    mixed = [[derivative(derivative(function, a), b) for b in afters] for a in befores]
    signs = None
    for point in _points((function, *relations.values()), relations):
        matrix = np.array([[point.value(e) for e in row] for row in mixed])
        if np.isfinite(matrix).all():
            rank = np.linalg.matrix_rank(matrix, tol=SINGULAR * np.abs(matrix).max())
            signs = point if rank == len(matrix) else None
            break
    if signs is None:
        raise ComputationError(
            f"{kind} generates no change of variables: the determinant of its mixed derivatives by "
            f"{', '.join(befores)} and {', '.join(afters)} vanishes",
            hint=f"each old argument has to occur in a term with a new one, as in `{befores[0]}*{afters[0]}`",
        )
    by_new, by_old = (_solved(relations, side, signs) for side in (old, new))
    branch = None
    if by_new is not None and by_old is not None:
        by_old = _on_whole_circle(by_old, by_new, signs)
        branch = None if leads_back(by_old, by_new) else {name: signs.point[name] for name in old.names}
    return Generated(relations, by_new, by_old, derivative(function, TIME), signs, branch)


def _on_whole_circle(new: dict[str, Expr], old: Mapping[str, Expr], signs: RootSigns) -> dict[str, Expr]:
    """The new variables with atan2(y, x) for atan(y/x), if that leads back to the old ones everywhere."""

    def turned(atom: Atom) -> Expr | None:
        if not (isinstance(atom, Applied) and atom.function == "atan"):
            return None
        powers = factors(atom.arguments[0])
        y, x = (product(f ** abs(n) for f, n in powers if n * side > 0) for side in (1, -1))
        return apply("atan2", -y, -x) if signs.value(x) < 0 else apply("atan2", y, x)

    # On half a circle r = x sqrt(1 + y^2/x^2), and sqrt(x^2 + y^2) on all of it.
    free = {name: symbol(name) for name in old}
    positive = {name: symbol(name, positive=True) for name in old if signs.point[name] > 0}
    for half in (positive, {}):
        with suppress(ExpressionError, ComputationError):
            short = {name: in_lowest_terms(substitute(e, half)) for name, e in new.items()}
            whole = {name: mapped(substitute(e, free), turned) for name, e in short.items()}
            if leads_back(whole, old):
                return whole
    return new


def leads_back(new: Mapping[str, Expr], old: Mapping[str, Expr]) -> bool:
    """Whether old(new(z)) is z at random points z, of any sign."""
    names = {name for e in (*new.values(), *old.values()) for name in e.names}.difference(new)
    for point in sample_points(sorted(names.union(old)), {}, signed=old):
        here = RootSigns(point)
        there = RootSigns({**point, **{name: here.value(e) for name, e in new.items()}})
        if any(abs(there.value(e) - point[name]) > NEAR * (1 + abs(point[name])) for name, e in old.items()):
            return False
    return True


def _solved(relations: Mapping[str, Expr], side: Phase, signs: RootSigns) -> dict[str, Expr] | None:
    """The variables of one side as functions of the other one; None where the relations are not solved."""
    equations = [symbol(name) - e for name, e in relations.items() if name not in side.names]
    unknowns = [name for name in side.names if name not in relations]
    found = solution(equations, unknowns, Allowance(MOST_TRIALS), signs)
    if found is None:
        return None
    found |= {name: signs.put(e, found) for name, e in relations.items() if name in side.names}
    return {name: tidy(found[name]) for name in side.names}
