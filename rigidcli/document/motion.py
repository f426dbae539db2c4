"""How a body turns: its angular velocity and orientation at t = 0, and the torque that drives it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Literal, Self, TypeAlias

import numpy as np
from pydantic import Field, ValidationInfo, model_validator

from rigidcli.bodies.rotations import EulerSequence, Quaternion, Rotation
from rigidcli.core.arithmetic import Scalar
from rigidcli.document.ensembles import Ensemble, OrMany, read_starts
from rigidcli.document.sampling import Sampling
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import ACCELERATION, ENERGY
from rigidcli.fields.environment import Formula
from rigidcli.fields.quantities import DEFAULT_LIMIT, AsList, Quantity, Rates3
from rigidcli.fields.readers import ReadBy, by_key
from rigidcli.fields.section import Section, environment, optional

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
        lambda raw, info: environment(info).formula(raw, ENERGY, tuple(VARIABLES)),
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

    gravity: Annotated[Scalar, Quantity(ACCELERATION, "nonnegative")]


Torque: TypeAlias = Annotated[
    Section, by_key({"body": BodyTorque, "space": SpaceTorque, "gravity": Weight}, "{body: [0, 0, -w3]}")
]


RATES, QUATERNION = ("w1", "w2", "w3"), ("q0", "q1", "q2", "q3")
"""The heads of a table of starts: the components of omega, and of the orientation, if they are there."""


def _read_table(path: Path, info: ValidationInfo) -> Ensemble:
    def check(heads: Sequence[str]) -> tuple[str, ...]:
        if {*heads} not in ({*RATES}, {*RATES, *QUATERNION}):
            read = shown(",".join(heads))
            raise ValueProblem(
                f"header {read}, expected {','.join(RATES)}, and {','.join(QUATERNION)} or none"
            )
        return tuple(heads)

    return read_starts(path, check, _fault)


def _fault(ensemble: Ensemble) -> tuple[int, str] | None:
    """The first start with an omega of no size that is known, or with no orientation."""
    known = {name: ensemble.values[:, place] for place, name in enumerate(ensemble.names)}
    rates = np.abs(np.column_stack([known[name] for name in RATES]))
    beyond = ((rates > 0) & ((rates < 1 / DEFAULT_LIMIT) | (rates > DEFAULT_LIMIT))).any(axis=1)
    if beyond.any():
        limits = f"{1 / DEFAULT_LIMIT:.0e} to {DEFAULT_LIMIT:.0e}"
        return int(np.argmax(beyond)), f"expected angular velocities (rad/s) from {limits}"
    if QUATERNION[0] in known:
        none = ~np.any([known[name] for name in QUATERNION], axis=0)
        if none.any():
            return int(np.argmax(none)), "q0,q1,q2,q3 are all zero, expected a quaternion"
    return None


_OR_MANY = OrMany(
    lambda raw: not isinstance(raw[0], list),
    lambda rates: dict(zip(RATES, rates, strict=True)),
    _read_table,
    Rates3,
    "w1,w2,w3",
)


class Motion(Sampling):
    """How the body turns, from the time t = 0 on."""

    omega: Annotated[Rates3 | Ensemble, _OR_MANY] | None = optional(
        "Angular velocity at t = 0 (rad/s); or several starts: an ensemble"
    )
    basis: Literal["body", "principal"] = Field(
        default="body",
        description="Whether omega's components are along the document's axes, or along the principal axes "
        "e1, e2, e3 as `axes` prints them",
    )
    orientation: Rotation | None = optional(
        "From the document's axes to those of space at t = 0; default identity"
    )
    torque: Torque | None = optional("By its components along body axes or those of space, or of the weight")
    method: Literal["auto", "taylor"] = Field(
        default="auto",
        description="How a driven motion is integrated; `taylor` is by heyoka (extra `taylor`)",
    )
    angles: EulerSequence | None = optional(
        "Euler angles that `euler` tells besides, by their sequence, such as zxz"
    )

    @model_validator(mode="after")
    def _check_starts(self) -> Self:
        if (
            self.orientation is not None
            and self.ensemble is not None
            and QUATERNION[0] in self.ensemble.names
        ):
            raise ValueProblem("the table of starts tells it, too: expected one", path=("orientation",))
        return self

    @property
    def ensemble(self) -> Ensemble | None:
        """The starts, where there is not one."""
        return self.omega if isinstance(self.omega, Ensemble) else None

    def start(self, place: int) -> Self:
        """The motion from one start of the ensemble."""
        assert self.ensemble is not None
        changes: dict[str, Any] = {"omega": self.ensemble.of(place, RATES)}
        if QUATERNION[0] in self.ensemble.names:
            w, x, y, z = self.ensemble.of(place, QUATERNION)
            changes["orientation"] = Quaternion(quaternion=(w, x, y, z))
        return self.model_copy(update=changes)
