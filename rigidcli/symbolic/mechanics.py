"""Energies of particles and bodies in generalized coordinates, and whether these are natural.

Coordinates are natural if the positions of all particles follow from them without the time, as in
J. R. Taylor, Classical Mechanics, section 7.3. Then T is homogeneous of degree 2 in the velocities, and
H = T + V.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fractions import Fraction

from rigidcli.symbolic.algebra import Expr, symbol, total
from rigidcli.symbolic.calculus import coefficients, derivative
from rigidcli.symbolic.simplify import tidy

TIME = "t"


@dataclass(frozen=True, slots=True)
class Particle:
    """A mass at a position (up to 3), and a moment of inertia that turns by an angle; or one of these."""

    mass: Expr | None
    position: tuple[Expr, ...]
    moment: Expr | None
    angle: Expr | None


def rate(e: Expr, velocities: Mapping[str, str]) -> Expr:
    """The derivative by time of a function of coordinates and t; `velocities` names theirs."""
    return total(
        [
            *(derivative(e, q) * symbol(v) for q, v in velocities.items()),
            derivative(e, TIME),
        ]
    )


def kinetic(particles: Sequence[Particle], velocities: Mapping[str, str]) -> Expr:
    """T = sum m v^2/2 + I (d angle/dt)^2/2, each coefficient of a product of velocities by itself tidied."""
    half = Fraction(1, 2)
    energy = total(
        factor * half * rate(path, velocities) ** 2
        for particle in particles
        for factor, paths in (
            (particle.mass, particle.position),
            (particle.moment, () if particle.angle is None else (particle.angle,)),
        )
        if factor is not None
        for path in paths
    )
    names = list(velocities.values())
    found = coefficients(energy, names)
    assert found is not None
    terms = []
    for powers, value in found.items():
        term = tidy(value)
        for name, power in zip(names, powers, strict=True):
            term = term * symbol(name) ** power
        terms.append(term)
    return tidy(total(terms))


def unnatural(kinetic_energy: Expr, velocities: Sequence[str]) -> Expr | None:
    """Terms of a kinetic energy that natural coordinates do not have, or None.

    These hold the time, or are not of degree 2 in the velocities.
    """
    found = coefficients(kinetic_energy, velocities)
    if found is None:
        return kinetic_energy
    wrong = []
    for powers, value in found.items():
        if sum(powers) != 2 or TIME in value.names:
            term = value
            for name, power in zip(velocities, powers, strict=True):
                term = term * symbol(name) ** power
            wrong.append(term)
    return total(wrong) if wrong else None
