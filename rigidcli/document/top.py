"""The section `top`: a heavy symmetric top, held at a point of its axis."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import Field

from rigidcli.core.arithmetic import Scalar
from rigidcli.fields.dimensions import ACCELERATION, ANGULAR_VELOCITY
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import AngularVelocity, Length, Mass, PolarAngle, PositiveMoment, Quantity
from rigidcli.fields.readers import Alternative
from rigidcli.fields.section import Section, optional


def _steady_or_rate(raw: str, env: Environment) -> Any:
    return None if raw == "steady" else env.read(raw, ANGULAR_VELOCITY)


class Top(Section):
    """A top in uniform gravity; its moments are about the pivot, where its axis is held."""

    spin: AngularVelocity = Field(description="Component of the angular velocity along the axis (rad/s)")
    tilt: PolarAngle | None = optional("Angle of the axis from the vertical (rad), 0 to pi")
    gravity: Annotated[Scalar, Quantity(ACCELERATION, "nonnegative")] = Field(
        default=9.80665, validate_default=True, description="Acceleration of free fall (m/s^2)"
    )
    precession: Annotated[
        Scalar | None,
        Alternative(str, _steady_or_rate, otherwise=AngularVelocity | None, schema={"type": "string"}),
    ] = Field(
        default=0,
        validate_default=True,
        description="phi-dot at t = 0 (rad/s); null or `steady` for steady precession",
    )
    nutation: AngularVelocity = Field(default=0, validate_default=True, description="theta-dot at t = 0")
    mass: Mass | None = None
    distance: Length | None = optional("From the pivot to the centre of mass (m)")
    lambda1: PositiveMoment | None = optional("Moment across the axis (kg m^2)")
    lambda3: PositiveMoment | None = optional("Moment about the axis (kg m^2)")

    @property
    def numbers(self) -> dict[str, Scalar | None]:
        """What describes the top without a body, by its keys."""
        return {key: getattr(self, key) for key in ("mass", "distance", "lambda1", "lambda3")}
