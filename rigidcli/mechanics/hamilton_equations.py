"""What follows from a Hamiltonian: equations of motion, Poisson brackets, the matrix of linear ones."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import TypeGuard

from rigidcli.algebra.atoms import Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficients
from rigidcli.algebra.expressions import ZERO, Expr, total
from rigidcli.algebra.simplification import is_product, shortest, spread, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.errors import ExpressionError


@dataclass(frozen=True, slots=True)
class Phase:
    """The names of coordinates and, in the same order, of their momenta."""

    coordinates: tuple[str, ...]
    momenta: tuple[str, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """All of them, coordinates first."""
        return self.coordinates + self.momenta


def equations(hamiltonian: Expr, phase: Phase, velocities: Sequence[Expr] | None = None) -> tuple[Expr, ...]:
    """Hamilton's equations: the derivatives by time of the coordinates, dH/dp, and of the momenta, -dH/dq.

    Where the `velocities` are known as functions of the momenta, the shorter form of these is kept.
    """
    if velocities is None:
        velocities = [tidy(derivative(hamiltonian, name)) for name in phase.momenta]
    velocities = [
        v if is_product(v) else shortest([v, derivative(hamiltonian, name)])
        for v, name in zip(velocities, phase.momenta, strict=True)
    ]
    parts = spread(hamiltonian)
    potential = Expr(
        {m: c for m, c in parts.terms.items() if all(a.names.isdisjoint(phase.momenta) for a, _ in m)}
    )
    return (*velocities, *(_force(parts - potential, potential, name, phase) for name in phase.coordinates))


def _force(kinetic: Expr, potential: Expr, name: str, phase: Phase) -> Expr:
    """-dH/dq, what comes from the terms of H with momenta and from the others each by itself.

    Where something is left without momenta, as in a rotating frame, the two may cancel. Where both are
    divided by the same sum, they may be shorter together.
    """
    parts = [tidy(-derivative(e, name)) for e in (kinetic, potential)]
    apart = total(parts)
    below = [{a for m in e.terms for a, n in m if isinstance(a, Group) and n < 0} for e in parts]
    with suppress(ExpressionError):
        at_rest = substitute(parts[0], dict.fromkeys(phase.momenta, ZERO))
        if any(e.is_zero for e in parts) or (at_rest.is_zero and below[0].isdisjoint(below[1])):
            return apart
    return shortest([apart, tidy(-derivative(kinetic + potential, name))])


def bracket(f: Expr, g: Expr, phase: Phase) -> Expr:
    """The Poisson bracket {f, g} = sum_i df/dq_i dg/dp_i - df/dp_i dg/dq_i."""
    return total(
        derivative(f, q) * derivative(g, p) - derivative(f, p) * derivative(g, q)
        for q, p in zip(phase.coordinates, phase.momenta, strict=True)
    )


def coefficient(polynomial: Polynomial, size: int, *places: int) -> Expr:
    """The coefficient of the product of the variables at these places, of `size` variables in all."""
    return polynomial.get(tuple(map(places.count, range(size))), ZERO)


def has_degrees(polynomial: Polynomial | None, *degrees: int) -> TypeGuard[Polynomial]:
    """Whether it is a polynomial, and each of its terms of one of these degrees."""
    return polynomial is not None and {sum(powers) for powers in polynomial} <= {*degrees}


def linear(expressions: Sequence[Expr], names: Sequence[str]) -> tuple[list[list[Expr]], list[Expr]] | None:
    """A and b of expressions that are A z + b, z being the names; None if they are not linear in them."""
    size = len(names)
    matrix, offset = [], []
    for expression in expressions:
        found = coefficients(expression, names)
        if not has_degrees(found, 0, 1):
            return None
        offset.append(coefficient(found, size))
        matrix.append([tidy(coefficient(found, size, place)) for place in range(size)])
    return matrix, offset
