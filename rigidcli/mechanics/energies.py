"""Energies of particles and bodies in generalized coordinates, and whether these are natural.

Coordinates are natural if the positions of all particles follow from them without the time, as in
J. R. Taylor, Classical Mechanics, section 7.3. Then T is homogeneous of degree 2 in the velocities, and
H = T + V.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ONE, Expr, product, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.values import is_zero

TIME = "t"


@dataclass(frozen=True, slots=True)
class Particle:
    """A mass at a position (up to 3), and a moment of inertia that turns by an angle; or one of these."""

    mass: Expr | None
    position: tuple[Expr, ...]
    moment: Expr | None
    angle: Expr | None


def kinetic(particles: Sequence[Particle], velocities: Mapping[str, str]) -> Expr:
    """T = sum m v^2/2 + I (d angle/dt)^2/2; `velocities` names that of each coordinate.

    With dx/dt = sum_i dx/dq_i v_i + dx/dt, each coefficient of a product of velocities is tidied by itself.
    """
    rates = _rates(velocities)
    parts: dict[tuple[int, int], list[Expr]] = {}
    for particle in particles:
        paths = [(particle.mass, path) for path in particle.position] + [(particle.moment, particle.angle)]
        for factor, path in paths:
            if factor is None or path is None:
                continue
            slopes = [derivative(path, name) for name in (*velocities, TIME)]
            moving = [(i, slope) for i, slope in enumerate(slopes) if not slope.is_zero]
            for place, (i, a) in enumerate(moving):
                for j, b in moving[place:]:
                    half = Fraction(1, 2) if i == j else 1
                    parts.setdefault((i, j), []).append(factor * half * a * b)
    return tidy(total(tidy(total(terms)) * rates[i] * rates[j] for (i, j), terms in sorted(parts.items())))


def squares(particles: Sequence[Particle], coordinates: Sequence[str]) -> list[tuple[Expr, list[Expr]]]:
    """The squares of T = sum a (w.v)^2: m/2 and the slopes of each path of a particle by the coordinates."""
    paths = [
        (factor / 2, path)
        for one in particles
        for factor, path in ((one.moment, one.angle), *((one.mass, path) for path in one.position))
        if factor is not None and path is not None
    ]
    return [(factor, [derivative(path, name) for name in coordinates]) for factor, path in paths]


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
    found = coefficients(kinetic_energy, velocities)
    if found is None:
        return kinetic_energy
    wrong = [
        product([value, *(symbol(name) ** power for name, power in zip(velocities, powers, strict=True))])
        for powers, value in found.items()
        if not is_zero(value) and (sum(powers) != 2 or not is_zero(derivative(value, TIME)))
    ]
    return total(wrong) if wrong else None
