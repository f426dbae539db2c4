"""How a body turns: its angular velocity and orientation at t = 0, and the torque that drives it."""

from __future__ import annotations

from typing import Annotated, Literal, TypeAlias

from pydantic import Field

from rigidcli.core.arithmetic import Scalar
from rigidcli.model import units
from rigidcli.model.base import AsList, Quantity, Rates3, ReadBy, Section, by_key, environment
from rigidcli.model.environment import Formula
from rigidcli.model.rotations import EulerSequence, Rotation
from rigidcli.model.sampling import Sampling

VARIABLES = {
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
"""What the components of a torque may depend on, in the order in which its functions take them, in words.

e3 is the principal axis as it is printed.
"""

TorqueComponent = Annotated[
    Formula,
    ReadBy(
        lambda raw, info: environment(info).formula(raw, units.ENERGY, tuple(VARIABLES)),
        {
            "type": ["number", "string"],
            "description": f"An expression in the parameters and in {', '.join(VARIABLES)}",
        },
    ),
]
Torque3 = Annotated[tuple[TorqueComponent, TorqueComponent, TorqueComponent], AsList]


class OwnTorque(Section):
    """A torque that the document tells by its components, under the one key of the section."""

    @property
    def components(self) -> tuple[Formula, Formula, Formula]:
        """The three, along axes that the class knows."""
        (key,) = type(self).model_fields
        components: tuple[Formula, Formula, Formula] = getattr(self, key)
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

    gravity: Annotated[Scalar, Quantity(units.ACCELERATION, "nonnegative")]


Torque: TypeAlias = Annotated[
    Section, by_key({"body": BodyTorque, "space": SpaceTorque, "gravity": Weight}, "{body: [0, 0, -w3]}")
]


class Motion(Sampling):
    """How the body turns, from the time t = 0 on."""

    omega: Rates3 | None = Field(default=None, description="Angular velocity at t = 0 (rad/s)")
    basis: Literal["body", "principal"] = Field(
        default="body",
        description="Whether omega's components are along the document's axes, or along the principal axes "
        "e1, e2, e3 as `axes` prints them",
    )
    orientation: Rotation | None = Field(
        default=None, description="From the document's axes to those of space at t = 0; default identity"
    )
    torque: Torque | None = Field(
        default=None, description="By its components along body axes or those of space, or of the weight"
    )
    angles: EulerSequence | None = Field(
        default=None, description="Euler angles that `euler` tells besides, by their sequence, such as zxz"
    )
