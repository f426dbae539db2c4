"""Phase space: the names of its variables, Hamilton's equations, Poisson brackets, and where H has steps."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import NamedTuple

from rigidcli.algebra.atoms import Applied
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficient, coefficients, free_of, has_degrees
from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.simplification import is_product, shortest, spread, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero

TIME = "t"


class Phase(NamedTuple):
    """The names of coordinates and, in the same order, of their momenta."""

    coordinates: tuple[str, ...]
    momenta: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """The names of coordinates, then of momenta."""
        return self.coordinates + self.momenta


def equations(hamiltonian: Expr, phase: Phase, velocities: Sequence[Expr] | None = None) -> tuple[Expr, ...]:
    """Hamilton's equations: the derivatives by time of the coordinates, dH/dp, and of the momenta, -dH/dq.

    Where there are `velocities` as functions of the momenta, the shorter form of these is kept.
    """
    if velocities is None:
        velocities = [tidy(derivative(hamiltonian, name)) for name in phase.momenta]
    velocities = [
        v if is_product(v) else shortest([v, derivative(hamiltonian, name)])
        for v, name in zip(velocities, phase.momenta, strict=True)
    ]
    parts = spread(hamiltonian)
    potential = free_of(phase.momenta, parts)
    return (*velocities, *(_force(parts - potential, potential, name) for name in phase.coordinates))


def _force(kinetic: Expr, potential: Expr, name: str) -> Expr:
    """-dH/dq: what comes from terms with momenta by itself, or both together where that is shorter.

    In a rotating frame the two may cancel.
    """
    apart = total(tidy(-derivative(e, name)) for e in (kinetic, potential))
    return shortest([apart, tidy(-derivative(kinetic + potential, name))])


def is_constant_in(e: Expr, name: str) -> bool:
    """Whether a function does not depend on a name: its derivative vanishes, and it has no steps."""
    if name not in e.names:
        return True
    return is_zero(derivative(e, name)) and is_zero(e - substitute(e, {name: symbol(f"{name}'")}))


def steps(e: Expr, names: Collection[str]) -> tuple[Expr, ...]:
    """Functions u of the names whose sign stands in a function, also as u/|u|: it has a step where u = 0."""
    atoms = [a for a in e.everywhere() if isinstance(a, Applied) and a.function == "sign"]
    for monomial in e.terms:
        for size, n in monomial:
            across = {name for atom, k in monomial if k * n < 0 for name in atom.names}
            if isinstance(size, Applied) and size.function == "abs" and not across.isdisjoint(size.names):
                atoms.append(size)
    return tuple(dict.fromkeys(a.arguments[0] for a in atoms if not a.names.isdisjoint(names)))


def bracket(f: Expr, g: Expr, phase: Phase) -> Expr:
    """The Poisson bracket {f, g} = sum_i df/dq_i dg/dp_i - df/dp_i dg/dq_i."""
    pairs = [*zip(phase.coordinates, phase.momenta, strict=True)]
    terms = [derivative(f, q) * derivative(g, p) for q, p in pairs if q in f.names]
    return total([*terms, *(-derivative(f, p) * derivative(g, q) for q, p in pairs if p in f.names)])


def linear(expressions: Sequence[Expr], names: Sequence[str]) -> tuple[list[list[Expr]], list[Expr]] | None:
    """A and b of expressions that are A z + b, z being the names; None if they are not linear in them."""
    size = len(names)
    matrix, offset = [], []
    for expression in expressions:
        polynomial = coefficients(expression, names)
        if not has_degrees(polynomial, 0, 1):
            return None
        offset.append(coefficient(polynomial, size))
        factors = {powers.index(1): factor for powers, factor in polynomial.items() if any(powers)}
        matrix.append([tidy(factors.get(place, ZERO)) for place in range(size)])
    return matrix, offset
