"""The sections on how a body turns.

`motion` has the angular velocity and orientation at t = 0, the torque and the times, `top` the gravity on a
top, and `tide` distant bodies that pull at the bulge of a planet.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias

from pydantic import BeforeValidator, Field, ValidationInfo, model_validator

from rigidcli.bodies.form import EulerSequence, Quaternion, Rotation
from rigidcli.core import precession
from rigidcli.core.arithmetic import Scalar
from rigidcli.document.sampling import Ensemble, OrMany, Sampling
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import ACCELERATION, ENERGY, GRAVITATIONAL_PARAMETER
from rigidcli.fields.environment import BoundExpression
from rigidcli.fields.quantities import (
    DEFAULT_LIMIT,
    AngularVelocity,
    AsList,
    Length,
    Mass,
    Number,
    PolarAngle,
    PositiveMoment,
    Quantity,
    Rates3,
    limited,
)
from rigidcli.fields.section import ReadBy, Section, Title, by_key, environment, optional

# The variables of the components of a torque, in the order of the arguments of its functions. Here e3 is the
# third principal axis as `axes` prints it.
TORQUE_VARIABLES = {
    "t": "time (s)",
    **{f"w{k}": f"angular velocity (rad/s) along {axis} of the body" for k, axis in enumerate("xyz", 1)},
    **{f"w{axis}": f"angular velocity (rad/s) along {axis} in space" for axis in "xyz"},
    "q0": "scalar of the unit quaternion that turns from the body to space",
    **{f"q{k}": f"its component along {axis}, from the body to space" for k, axis in enumerate("xyz", 1)},
    **{
        f"u{axis}": f"{axis} in space of the unit vector along e3, or along the axis of a top"
        for axis in "xyz"
    },
}
_COMPONENT = ReadBy(
    lambda raw, info: environment(info).formula(raw, ENERGY, tuple(TORQUE_VARIABLES)),
    {
        "type": ["number", "string"],
        "description": f"An expression in the parameters and in {', '.join(TORQUE_VARIABLES)}",
    },
)
TorqueComponent = Annotated[BoundExpression, _COMPONENT]
Torque3 = Annotated[tuple[TorqueComponent, TorqueComponent, TorqueComponent], AsList]


class OwnTorque(Section):
    """A torque by its components, which stand under the only key of the section."""

    @property
    def components(self) -> tuple[BoundExpression, BoundExpression, BoundExpression]:
        """The three components, along the axes of the class."""
        (key,) = type(self).model_fields
        components: tuple[BoundExpression, BoundExpression, BoundExpression] = getattr(self, key)
        return components

    @property
    def names(self) -> frozenset[str]:
        """The variables and parameters on which it depends."""
        return frozenset[str]().union(*(formula.expression.names for formula in self.components))


class BodyTorque(OwnTorque):
    """A torque by its components along the document's axes, which turn with the body."""

    body: Torque3


class SpaceTorque(OwnTorque):
    """A torque by its components along the axes of space."""

    space: Torque3


class Weight(Section):
    """The weight of a body that is held at the point O, z being upward in space."""

    gravity: Annotated[Scalar, Quantity(ACCELERATION, "nonnegative")]


Torque: TypeAlias = Annotated[
    Section, by_key({"body": BodyTorque, "space": SpaceTorque, "gravity": Weight}, "{body: [0, 0, -w3]}")
]


# The heads of a table of starts: the components of omega, and of the orientation, if they are there.
RATES, QUATERNION = ("w1", "w2", "w3"), ("q0", "q1", "q2", "q3")


def _names(heads: Sequence[str], info: ValidationInfo) -> tuple[str, ...]:
    if {*heads} not in ({*RATES}, {*RATES, *QUATERNION}):
        expected = f"{','.join(RATES)}, and {','.join(QUATERNION)} or none"
        raise ValueProblem(f"header {shown(','.join(heads))}, expected {expected}")
    return tuple(heads)


def _require(start: Mapping[str, float]) -> None:
    """Raise ValueProblem for an omega beyond the limits of numbers, and for a quaternion of zeros."""
    if max(abs(start[name]) for name in RATES) > DEFAULT_LIMIT:
        raise ValueProblem(f"expected angular velocities (rad/s) up to {DEFAULT_LIMIT:.0e}")
    if QUATERNION[0] in start and not any(start[name] for name in QUATERNION):
        raise ValueProblem("q0,q1,q2,q3 are all zero, expected a quaternion")


_OR_MANY = OrMany(Rates3, lambda rates: dict(zip(RATES, rates, strict=True)), _names, "w1,w2,w3", _require)


class Motion(Sampling):
    """How the body turns, from the time t = 0 on."""

    EXAMPLE: ClassVar = "{omega: [0, 0, 1], duration: 10}"
    STARTS: ClassVar = "omega"
    INSIDE: ClassVar = {"gravity": "torque"}

    omega: Annotated[Rates3 | Ensemble, _OR_MANY] | None = optional(
        "Angular velocity at t = 0 (rad/s); or several starts: an ensemble"
    )
    basis: Literal["body", "principal"] = Field(
        default="body",
        description="Whether omega's components are along the document's axes, or along the principal axes "
        "e1, e2, e3 as `axes` prints them",
    )
    orientation: Rotation | None = optional(
        "Rotation from the document's axes to those of space at t = 0; default identity"
    )
    torque: Torque | None = optional("By components along axes of the body or of space, or of the weight")
    method: Literal["auto", "taylor"] = Field(
        default="auto",
        description="How a driven motion is integrated; `taylor` is by heyoka (extra `taylor`)",
    )
    angles: EulerSequence | None = optional(
        "Euler angles among the results of `euler`, by their sequence, such as zxz"
    )

    @model_validator(mode="after")
    def _check_starts(self) -> Self:
        turned = self.ensemble is not None and QUATERNION[0] in self.ensemble.names
        if turned and self.orientation is not None:
            raise ValueProblem("the table of starts has orientations, too", path=("orientation",))
        return self

    def at_start(self, place: int) -> Self:
        """The motion from one start of the ensemble."""
        assert self.ensemble is not None
        start = self.ensemble.start(place)
        changes: dict[str, Any] = {"omega": tuple(start[name] for name in RATES)}
        if QUATERNION[0] in start:
            w, x, y, z = (start[name] for name in QUATERNION)
            changes["orientation"] = Quaternion(quaternion=(w, x, y, z))
        return self.model_copy(update=changes)


# --- tops and planets


class Top(Section):
    """A top in uniform gravity; its moments are about the pivot, where its axis is held."""

    EXAMPLE: ClassVar = "{spin: 1800 rpm, tilt: 30 deg}"

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

    @property
    def pull(self) -> Scalar:
        """The gravitational parameter G m (m^3/s^2)."""
        return self.gm if self.gm is not None else precession.gravitational_parameter(self.mass or 0)


class Tide(Section):
    """A spinning planet, and the bodies that pull at its bulge."""

    ONE_OF: ClassVar = ("moments", "ellipticity")

    obliquity: PolarAngle = Field(description="Angle of the spin from the normal of the orbits' plane (rad)")
    spin: AngularVelocity = Field(description="Angular velocity of the planet about its axis")
    moments: Moments | None = optional("Principal moments A, B, C, the last about the spin")
    ellipticity: Ellipticity | None = optional("(C - A)/C; A is the mean of the moments across the spin")
    perturbers: Annotated[tuple[Perturber, ...], AsList, Field(min_length=1)] = Field(
        description="The bodies that pull at the bulge"
    )

    @property
    def bulge(self) -> Scalar:
        """(C - A)/C, with the mean A of the moments across the spin."""
        return precession.ellipticity(self.moments) if self.moments is not None else self.ellipticity or 0

    @model_validator(mode="after")
    def _check(self, info: ValidationInfo) -> Self:
        n = environment(info).arithmetic
        if n.sign(self.spin) == 0:
            raise ValueProblem("read zero, expected a planet that spins", path=("spin",))
        moments = self.moments or ()
        for index, largest in enumerate(moments):
            others = sum(moments[:index] + moments[index + 1 :])
            if n.sign(others - largest) == -1:
                sums = f"{n.size(largest):.6g} > {n.size(others):.6g}, the sum of the others"
                raise ValueProblem(f"{sums}: no body has these", path=("moments", index))
        return self
