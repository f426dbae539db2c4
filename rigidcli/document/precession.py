"""The sections `top` and `tide`: gravity on a top, and distant bodies that pull at the bulge of a planet."""

from __future__ import annotations

from typing import Annotated, ClassVar, Self

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from rigidcli.core.arithmetic import Scalar
from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import ACCELERATION, GRAVITATIONAL_PARAMETER
from rigidcli.fields.quantities import (
    AngularVelocity,
    AsList,
    Length,
    Mass,
    Number,
    PolarAngle,
    PositiveMoment,
    Quantity,
    limited,
)
from rigidcli.fields.readers import Title
from rigidcli.fields.section import Section, environment, optional


class Top(Section):
    """A top in uniform gravity; its moments are about the pivot, where its axis is held."""

    spin: AngularVelocity = Field(description="Component of the angular velocity along the axis (rad/s)")
    tilt: PolarAngle | None = optional("Angle of the axis from the vertical (rad), 0 to pi")
    gravity: Annotated[Scalar, Quantity(ACCELERATION, "nonnegative")] = Field(
        default=9.80665, validate_default=True, description="Acceleration of free fall (m/s^2)"
    )
    precession: Annotated[
        AngularVelocity | None, BeforeValidator(lambda raw: None if raw == "steady" else raw)
    ] = Field(
        default=0,
        validate_default=True,
        description="phi-dot at t = 0 (rad/s); null or `steady` for steady precession",
    )
    nutation: AngularVelocity = Field(default=0, validate_default=True, description="theta-dot at t = 0")
    mass: Mass | None = None
    distance: Length | None = optional("Distance from the pivot to the centre of mass (m)")
    lambda1: PositiveMoment | None = optional("Moment of inertia across the axis (kg m^2)")
    lambda3: PositiveMoment | None = optional("Moment of inertia about the axis (kg m^2)")

    @property
    def numbers(self) -> dict[str, Scalar | None]:
        """The numbers of a top without a body, by their keys."""
        return {key: getattr(self, key) for key in ("mass", "distance", "lambda1", "lambda3")}


Eccentricity = Annotated[
    Number,
    limited(lambda e, n: n.sign(e) != -1 and n.sign(1 - e) not in (0, -1), "a number from 0 to below 1"),
]
Ellipticity = Annotated[
    Number, limited(lambda x, n: n.sign(1 - 2 * x) != -1, "(C - A)/C with C <= 2 A, a number up to 1/2")
]
GravitationalParameter = Annotated[Scalar, Quantity(GRAVITATIONAL_PARAMETER, "positive")]
Moments = Annotated[tuple[PositiveMoment, PositiveMoment, PositiveMoment], AsList]


class Perturber(Section):
    """A body that pulls at the bulge, on an orbit as it is seen from the planet."""

    ONE_OF: ClassVar = ("mass", "gm")

    name: Title | None = None
    mass: Mass | None = None
    gm: GravitationalParameter | None = optional(
        "Gravitational parameter G m (m^3/s^2), often known better than the mass"
    )
    distance: Length = Field(description="Semi-major axis of the orbit (m)")
    eccentricity: Eccentricity = Field(default=0, validate_default=True)
    inclination: PolarAngle = Field(
        default=0, validate_default=True, description="Angle from the plane of zero obliquity to the orbit"
    )


class Tide(Section):
    """A spinning planet, and the bodies that pull at its bulge."""

    ONE_OF: ClassVar = ("moments", "ellipticity")

    obliquity: PolarAngle = Field(
        description="Angle between the spin and the normal of the orbits' plane (rad)"
    )
    spin: AngularVelocity = Field(description="Angular velocity of the planet about its axis")
    moments: Moments | None = optional("Principal moments A, B, C, the last about the spin")
    ellipticity: Ellipticity | None = optional("(C - A)/C; A is the mean of the moments across the spin")
    perturbers: Annotated[tuple[Perturber, ...], AsList, Field(min_length=1)] = Field(
        description="The bodies that pull at the bulge"
    )

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        n = environment(info).arithmetic
        if n.sign(self.spin) == 0:
            raise ValueProblem("read zero, expected a planet that spins", path=("spin",))
        moments = self.moments or ()
        for index, largest in enumerate(moments):
            others = sum(moments[:index] + moments[index + 1 :])
            if n.sign(others - largest) == -1:
                message = (
                    f"{n.size(largest):.6g} > {n.size(others):.6g}, the sum of the others: no body has these"
                )
                raise ValueProblem(message, path=("moments", index))
        return self
