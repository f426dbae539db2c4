"""H in the new variables of a canonical change: K = H + R.

Where the change holds the time, the new variables Z move at fixed old ones, as by a Hamiltonian R of their
own: dZ/dt = J dR/dZ. Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 9.1.
"""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

from rigidcli.algebra.arithmetic import tidy as in_lowest_terms
from rigidcli.algebra.calculus import antiderivative, derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr, product, symbol, total
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.simplification import shortest, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trigonometry import exponentials_merged
from rigidcli.algebra.values import is_zero, sample_points
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.mechanics.canonical import Branch, inverse, positive_names
from rigidcli.mechanics.hamilton_equations import TIME, Phase


@dataclass(frozen=True, slots=True)
class NewHamiltonian:
    """K for positive values of some names, with the `old` variables as functions of the new ones."""

    hamiltonian: Expr
    old: Mapping[str, Expr]
    positive: tuple[str, ...]

    def shorter(self, names: Collection[str]) -> NewHamiltonian:
        """The same with K in the form for positive values of names, if it is shorter: sqrt(k/m)."""
        e = self.hamiltonian
        positive = tidy(substitute(e, {name: symbol(name, positive=True) for name in names}))
        form = from_tree(substitute(positive, {name: symbol(name) for name in names}).tree())
        needed = None if len(str(form)) >= len(str(e)) else positive_names([e - form], ())
        if needed is None:
            return self
        return replace(self, hamiltonian=form, positive=(*self.positive, *needed))


@dataclass(frozen=True, slots=True)
class Change:
    """A canonical change from `old` to `new` variables. `values` has one side by the other."""

    values: Mapping[str, Expr]
    old: Phase
    new: Phase

    def hamiltonian(self, hamiltonian: Expr) -> NewHamiltonian | None:
        """K for an H; None where no way leads to the old variables, or to R.

        K is held to H for all variables, or for positive ones, as roots may have either sign.
        """
        is_given, branch = self.values.keys() == {*self.old.names}, self._branch(hamiltonian)
        old = self.values if is_given else inverse(self.values, self.new, self.old, branch)
        if old is None:
            return None
        slopes = _added_slopes(old, self.old, self.new)
        added = _function_with(slopes, self.new.names)
        if added is None:
            return None
        variables = (*(self.new if is_given else self.old).names, TIME)
        for way in branch.with_roots, substitute:
            k = _gathered(way(hamiltonian, old) + added, self.new)
            if is_given:
                misses = [k - added - substitute(hamiltonian, old)]
                rates = [derivative(added, name) for name in self.new.names]
            else:
                misses = [substitute(k - added, self.values) - hamiltonian]
                rates = self._rates()
                slopes = [substitute(slope, self.values) for slope in slopes]
            misses += [slope - rate for slope, rate in zip(slopes, rates, strict=True)]
            positive = positive_names(misses, variables)
            if positive is not None:
                return NewHamiltonian(k, old, positive)
        return None

    def _rates(self) -> list[Expr]:
        """What dR/dZ is, by the old variables: -dP/dt for the coordinates, dQ/dt for the momenta."""
        turned = [-derivative(self.values[name], TIME) for name in self.new.momenta]
        return [*turned, *(derivative(self.values[name], TIME) for name in self.new.coordinates)]

    def _branch(self, hamiltonian: Expr) -> Branch:
        """A point at which all variables have values, positive ones on the right-hand sides."""
        exprs = (hamiltonian, *self.values.values())
        names = {name for e in exprs for name in e.names}.difference(self.values)
        for point in sample_points(sorted(names), {}):
            here = Branch(point)
            values = {name: here.value(e) for name, e in self.values.items()}
            if all(map(math.isfinite, values.values())):
                return Branch({**point, **values})
        return Branch({})


def added_by_forces(
    forces: Sequence[Expr], old: Mapping[str, Expr], phase: Phase, new: Phase
) -> Sequence[Expr]:
    """What generalized forces on the `old` variables add to the equations of the new ones (2n).

    With canonical variables dQ/dp = -dq/dP and dP/dp = dq/dQ, so that F_i adds -F_i dq_i/dP_j to the rate of
    Q_j, and F_i dq_i/dQ_j to that of P_j.
    """
    there = [(substitute(f, old), old[q]) for f, q in zip(forces, phase.coordinates, strict=True)]

    def along(name: str) -> Expr:
        return tidy(total(f * derivative(q, name) for f, q in there))

    return [*(-along(name) for name in new.momenta), *(along(name) for name in new.coordinates)]


def _added_slopes(old: Mapping[str, Expr], phase: Phase, new: Phase) -> list[Expr]:
    """dR/dZ (2n) for old variables z(Z, t): sum_i dq_i/dZ dp_i/dt - dp_i/dZ dq_i/dt."""
    pairs = [(old[q], old[p]) for q, p in zip(phase.coordinates, phase.momenta, strict=True)]
    return [
        tidy(
            total(
                derivative(q, name) * derivative(p, TIME) - derivative(p, name) * derivative(q, TIME)
                for q, p in pairs
            )
        )
        for name in new.names
    ]


def _function_with(slopes: Sequence[Expr], names: Sequence[str]) -> Expr | None:
    """The function with these derivatives by the names; None where no integral is known.

    Products of roots may only join where what is under them is positive.
    """
    free = {name: symbol(name) for slope in slopes for name in slope.names - {TIME}}
    positive = {name: symbol(name, positive=True) for name in free}
    for values in {}, positive:
        there = [tidy(substitute(slope, values)) for slope in slopes]
        integral = ZERO
        for name, slope in reversed([*zip(names, there, strict=True)]):
            part = antiderivative(tidy(slope - derivative(integral, name)), name)
            if part is None:
                break
            integral += part
        else:
            if all(is_zero(e - derivative(integral, name)) for name, e in zip(names, there, strict=True)):
                return substitute(integral, free)
    return None


def _gathered(e: Expr, phase: Phase) -> Expr:
    """The expression as a polynomial in the momenta, or else in all variables, with tidy coefficients."""
    e = exponentials_merged(e)
    forms = [tidy(e)]
    for names in (phase.names, phase.momenta):
        with suppress(ExpressionError):
            polynomial = coefficients(e, names)
            if polynomial is not None:
                variables = [*map(symbol, names)]
                parts = [
                    product([_coefficient(c), *(x**k for x, k in zip(variables, powers, strict=True))])
                    for powers, c in polynomial.items()
                ]
                return shortest([*forms, tidy(total(parts))])
    return forms[0]


def _coefficient(e: Expr) -> Expr:
    """A coefficient in a short form, in lowest terms where these are not too long."""
    if is_zero(e):
        return ZERO
    with suppress(ComputationError):
        return in_lowest_terms(e)
    return tidy(e)
