"""Kinetic energy in generalized coordinates, and what follows from a Hamiltonian: equations and brackets.

Coordinates are natural if the positions of all particles follow from them without the time, as in
J. R. Taylor, Classical Mechanics, section 7.3. Then T is homogeneous of degree 2 in the velocities, and
H = T + V.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations_with_replacement
from typing import NamedTuple, TypeGuard

from rigidcli.algebra.atoms import Applied, Group
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import Polynomial, coefficients
from rigidcli.algebra.expressions import ONE, ZERO, Expr, product, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import is_product, shortest, spread, tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError


@dataclass(frozen=True, slots=True)
class Phase:
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
    potential = Expr(
        {m: c for m, c in parts.terms.items() if all(a.names.isdisjoint(phase.momenta) for a, _ in m)}
    )
    return (*velocities, *(_force(parts - potential, potential, name, phase) for name in phase.coordinates))


def _force(kinetic: Expr, potential: Expr, name: str, phase: Phase) -> Expr:
    """-dH/dq, with what comes from the terms of H with momenta apart from what comes from the others.

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


def coefficient(polynomial: Polynomial, size: int, *places: int) -> Expr:
    """The coefficient of the product of the variables at these places, of `size` variables in all."""
    return polynomial.get(tuple(map(places.count, range(size))), ZERO)


def has_degrees(polynomial: Polynomial | None, *degrees: int) -> TypeGuard[Polynomial]:
    """Whether it is a polynomial, with terms of these degrees only."""
    return polynomial is not None and {sum(powers) for powers in polynomial} <= {*degrees}


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


TIME = "t"


class Particle(NamedTuple):
    """A mass at a position (up to 3), and a moment of inertia that turns by an angle; or one of these.

    A body in space has principal `moments` (3) instead, and the angles of Euler phi, theta, psi (zxz) that
    lead from the axes of space to its own.
    """

    mass: Expr | None
    position: tuple[Expr, ...]
    moment: Expr | None
    angle: Expr | None
    moments: tuple[Expr, ...] = ()
    euler: tuple[Expr, ...] = ()


def kinetic(particles: Sequence[Particle], velocities: Mapping[str, str]) -> Expr:
    """T = sum m v^2/2 + I (d angle/dt)^2/2; `velocities` names that of each coordinate.

    The coefficients of products of velocities are tidied one by one; the squares of a body in space stay.
    """
    rates = _rates(velocities)
    turned = [
        moment * tidy(omega) ** 2 / 2
        for body in particles
        if body.moments
        for moment, omega in zip(
            body.moments, turning(body, [velocity(a, velocities) for a in body.euler]), strict=True
        )
    ]
    particles = [one._replace(moments=()) for one in particles]
    parts: dict[tuple[int, int], list[Expr]] = {}
    for factor, slopes in squares(particles, (*velocities, TIME)):
        moving = [(place, slope) for place, slope in enumerate(slopes) if slope]
        for (i, a), (j, b) in combinations_with_replacement(moving, 2):
            parts.setdefault((i, j), []).append(factor * (1 if i == j else 2) * a * b)
    moved = tidy(total(tidy(total(terms)) * rates[i] * rates[j] for (i, j), terms in sorted(parts.items())))
    return moved + total(turned)


def squares(particles: Sequence[Particle], names: Sequence[str]) -> list[tuple[Expr, list[Expr]]]:
    """The squares of T = sum a (w.v)^2: m/2 or I/2, and the slopes by the names of a path or an angle.

    Those of a body in space are its rates of turning about its principal axes.
    """
    paths = [
        (factor / 2, path)
        for one in particles
        for factor, path in (*((one.mass, path) for path in one.position), (one.moment, one.angle))
        if factor is not None and path is not None
    ]
    found = [(factor, [derivative(path, name) for name in names]) for factor, path in paths]
    for body in particles:
        if body.moments:
            turned = [turning(body, [derivative(a, name) for a in body.euler]) for name in names]
            found += [(moment / 2, [rate[k] for rate in turned]) for k, moment in enumerate(body.moments)]
    return found


def turning(body: Particle, rates: Sequence[Expr]) -> tuple[Expr, Expr, Expr]:
    """The angular velocity about a body's axes, from the rates of its angles of Euler.

        omega = (phi' sin(theta) sin(psi) + theta' cos(psi), phi' sin(theta) cos(psi) - theta' sin(psi),
                 phi' cos(theta) + psi')

    Where the first two moments are equal, it is told about axes that do not turn by psi, as if psi were 0.
    Source: H. Goldstein, C. Poole, J. Safko, Classical Mechanics, 3rd edition, section 4.9.
    """
    _, theta, psi = body.euler
    phi_rate, theta_rate, psi_rate = rates
    across, third = phi_rate * apply("sin", theta), phi_rate * apply("cos", theta) + psi_rate
    if is_zero(body.moments[0] - body.moments[1]):
        return theta_rate, across, third
    sine, cosine = apply("sin", psi), apply("cos", psi)
    return across * sine + theta_rate * cosine, across * cosine - theta_rate * sine, third


def velocity(path: Expr, velocities: Mapping[str, str]) -> Expr:
    """The rate of a Cartesian coordinate, sum_i dx/dq_i v_i + dx/dt; `velocities` as for `kinetic`."""
    slopes = (derivative(path, name) for name in (*velocities, TIME))
    return tidy(total(slope * rate for slope, rate in zip(slopes, _rates(velocities), strict=True)))


def _rates(velocities: Mapping[str, str]) -> list[Expr]:
    """The rates of the coordinates and of the time."""
    return [*(symbol(v) for v in velocities.values()), ONE]


def unnatural(kinetic_energy: Expr, velocities: Sequence[str]) -> Expr | None:
    """Terms of a kinetic energy that natural coordinates do not have, or None.

    These hold the time, or are not of degree 2 in the velocities.
    """
    polynomial = coefficients(kinetic_energy, velocities)
    if polynomial is None:
        return kinetic_energy
    wrong = [
        product([value, *(symbol(name) ** power for name, power in zip(velocities, powers, strict=True))])
        for powers, value in polynomial.items()
        if not is_zero(value) and (sum(powers) != 2 or not is_zero(derivative(value, TIME)))
    ]
    return total(wrong) if wrong else None
