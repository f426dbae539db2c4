"""Kinetic energy of particles and bodies in generalized coordinates.

Coordinates are natural if the positions of all particles follow from them without the time, as in
J. R. Taylor, Classical Mechanics, section 7.3. Then T is homogeneous of degree 2 in the velocities, and
H = T + V.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, polynomial_sum
from rigidcli.algebra.expressions import ONE, ZERO, Expr, symbol, total
from rigidcli.algebra.functions import apply
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.values import is_zero
from rigidcli.mechanics.phase_space import TIME


class MovingBody(NamedTuple):
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


def kinetic(particles: Sequence[MovingBody], velocities: Mapping[str, str]) -> Expr:
    """T = sum m v^2/2 + I (d angle/dt)^2/2; `velocities` names that of each coordinate.

    The coefficients of products of velocities are tidied one by one; the squares of a body in space stay.
    """
    rates = _rates(velocities)
    turned = ZERO
    for body in particles:
        if body.moments:
            omega = turning(body, [velocity(angle, velocities) for angle in body.euler])
            turned += total(m * tidy(rate) ** 2 / 2 for m, rate in zip(body.moments, omega, strict=True))
    particles = [one._replace(moments=()) for one in particles]
    parts: dict[tuple[int, int], list[Expr]] = {}
    for factor, slopes in squares(particles, (*velocities, TIME)):
        moving = [(place, slope) for place, slope in enumerate(slopes) if slope]
        for (i, a), (j, b) in combinations_with_replacement(moving, 2):
            parts.setdefault((i, j), []).append(factor * (1 if i == j else 2) * a * b)
    moved = tidy(total(tidy(total(terms)) * rates[i] * rates[j] for (i, j), terms in sorted(parts.items())))
    return moved + turned


def squares(particles: Sequence[MovingBody], names: Sequence[str]) -> list[tuple[Expr, list[Expr]]]:
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


def turning(body: MovingBody, rates: Sequence[Expr]) -> tuple[Expr, Expr, Expr]:
    """The angular velocity about a body's axes, from the rates of its angles of Euler.

        omega = (phi' sin(theta) sin(psi) + theta' cos(psi), phi' sin(theta) cos(psi) - theta' sin(psi),
                 phi' cos(theta) + psi')

    Where the first two moments are equal, it is given along axes that do not turn by psi, as if psi were 0.
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
    return [*(symbol(v) for v in velocities.values()), ONE]


def unnatural(kinetic_energy: Expr, velocities: Sequence[str]) -> Expr | None:
    """Terms of a kinetic energy that natural coordinates do not have, or None.

    These hold the time, or are not of degree 2 in the velocities.
    """
    polynomial = coefficients(kinetic_energy, velocities)
    if polynomial is None:
        return kinetic_energy
    wrong = {
        powers: e
        for powers, e in polynomial.items()
        if not is_zero(e) and (sum(powers) != 2 or not is_zero(derivative(e, TIME)))
    }
    return polynomial_sum(wrong, list(map(symbol, velocities))) if wrong else None
