"""The base of all forms of body, which have a place: turned about their own origin, then moved.

The ways to write a rotation are all active (body to space): roll, pitch and yaw, axis and angle, Euler,
quaternion, matrix.
"""

from abc import abstractmethod
from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Self, TypeAlias

from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from rigidcli.core import mass_properties, principal, rotation, tensor
from rigidcli.core.arithmetic import Arithmetic, Array
from rigidcli.core.principal import PrincipalFrame
from rigidcli.errors import ValueProblem, at, shown
from rigidcli.fields.quantities import Angle, AsList, Direction, Number, Vector3
from rigidcli.fields.section import Section, Title, by_key, environment

LIKE_FLOATS = 1e-9  # a matrix that is a rotation to within this has the digits of floats, and needs no note


class Turn(Section):
    """A rotation."""

    @abstractmethod
    def as_matrix(self, n: Arithmetic) -> Array:
        """The rotation matrix (3 by 3). Raises ValueProblem where there is none."""


class AxisAngle(Turn):
    """A right-handed turn by `angle` about `axis` (of any length)."""

    axis: Direction
    angle: Angle

    def as_matrix(self, n: Arithmetic) -> Array:
        """The matrix by Rodrigues' formula."""
        return rotation.from_axis_angle(self.axis, self.angle, n)


def _three_axes(sequence: str) -> str:
    repeated = any(first == second for first, second in pairwise(sequence))
    if len(sequence) != 3 or not set(sequence) <= set("xyz") or repeated:
        raise ValueProblem(
            f"read {shown(sequence)}, expected three of x, y, z with no axis twice in a row, such as zxz"
        )
    return sequence


EulerSequence = Annotated[str, AfterValidator(_three_axes)]


class Euler(Turn):
    """Intrinsic turns about three of the body's axes in `sequence`; zxz is Rz(phi) Rx(theta) Rz(psi)."""

    euler: Annotated[tuple[Angle, Angle, Angle], AsList]
    sequence: EulerSequence = "zxz"

    def as_matrix(self, n: Arithmetic) -> Array:
        """The product of the three turns, the first one leftmost."""
        return rotation.from_euler(self.euler, self.sequence, n)


class RollPitchYaw(Turn):
    """Turns about the fixed axes x, y and z, in this order, as in URDF: Rz(yaw) Ry(pitch) Rx(roll)."""

    rpy: Annotated[tuple[Angle, Angle, Angle], AsList]

    def as_matrix(self, n: Arithmetic) -> Array:
        """The product of the three turns: about fixed axes the last one is leftmost."""
        return rotation.from_euler(self.rpy[::-1], "zyx", n)


class Quaternion(Turn):
    """A quaternion [w, x, y, z]; it is normalised."""

    quaternion: Annotated[tuple[Number, Number, Number, Number], AsList]

    def as_matrix(self, n: Arithmetic) -> Array:
        """The matrix of the normalised quaternion."""
        return rotation.from_quaternion(self.quaternion, n)


class Matrix(Turn):
    """A rotation matrix, given by its rows."""

    matrix: Annotated[tuple[Direction, Direction, Direction], AsList]

    @model_validator(mode="after")
    def _note_digits(self, info: ValidationInfo) -> Self:
        with suppress(ValueProblem):  # which comes again where the matrix is needed
            _, miss = rotation.from_matrix(self.matrix, environment(info).arithmetic)
            if miss > LIKE_FLOATS:
                note = f"R^T R of a matrix differs from 1 by {miss:.1g}, within its digits"
                environment(info).log.note(f"{note}: the nearest rotation is taken")
        return self

    def as_matrix(self, n: Arithmetic) -> Array:
        """The nearest rotation to the matrix."""
        return rotation.from_matrix(self.matrix, n)[0]


TURN = by_key(
    {"axis": AxisAngle, "rpy": RollPitchYaw, "euler": Euler, "quaternion": Quaternion, "matrix": Matrix},
    "{axis: [0, 0, 1], angle: 30 deg}",
)
Rotation: TypeAlias = Annotated[Turn, TURN]


class Form(Section):
    """One form of body, placed: first turned about its own origin, then moved."""

    AT_MOST_ONE_OF: ClassVar = (("rotation", "axis"),)
    INSIDE: ClassVar = dict.fromkeys(("rpy", "euler", "sequence", "quaternion", "matrix"), "rotation")

    name: Title | None = Field(default=None, description="What messages call it")
    position: Vector3 | None = Field(default=None, description="Where the form's own origin goes (m)")
    rotation: Rotation | None = Field(default=None, description="Turns the form about its own origin")
    axis: Direction | None = Field(default=None, description="Direction onto which local +z is turned")
    hole: bool = Field(
        default=False,
        description="In `parts`: what is missing there; by default it has the density of what it is cut from",
    )

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        # A hole may leave its density to the part in which it lies.
        is_bare = bool(raw.get("hole")) and raw.get("mass") is None and raw.get("density") is None
        yield from super()._contradictions({**raw, "density": 0} if is_bare else raw)

    @property
    def rounding(self) -> float | None:
        """By how much the coordinates of the atoms of a molecule may be off (m); None for other bodies."""
        return None

    def report(self) -> dict[str, Any]:
        """Further results of a mesh, by their names; no other form has any."""
        return {}

    @abstractmethod
    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Mass properties in the form's own axes and from its own origin."""

    def pivot(self, arithmetic: Arithmetic) -> Array:
        """The point of the form, in its own axes, that is put at `position` (3, m)."""
        return arithmetic.array([0, 0, 0])

    def motion(self, arithmetic: Arithmetic) -> tuple[Array, Array]:
        """Rotation (3 by 3) and displacement (3, m) that take the form from its own axes to its place."""
        turn = arithmetic.array(tensor.IDENTITY)
        if self.rotation is not None:
            with at("rotation"):
                turn = self.rotation.as_matrix(arithmetic)
        elif self.axis is not None:
            with at("axis"):
                turn = rotation.onto(self.axis, arithmetic)
        return turn, arithmetic.array(self.position or [0, 0, 0]) - turn @ self.pivot(arithmetic)

    def properties(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Mass properties in the axes in which the form is placed."""
        return mass_properties.place(self.local(arithmetic), *self.motion(arithmetic), arithmetic)

    def principal_frame(self, inertia: Array, point: Array, axes: Array, n: Arithmetic) -> PrincipalFrame:
        """The principal frame about `point` (3, m), where the tensor is `inertia` (3 by 3, kg m^2).

        The frame is in components along `axes` (columns, 3 by 3). Raises ComputationError where it is exact
        and too long to print.
        """
        if not n.exact:
            return principal.principal_frame(tensor.without_rounding(tensor.rotate(inertia, axes.T)))
        from rigidcli.mechanics import principal_axes

        # Along the form's own axes, the columns of `turn`, exact entries are short.
        (turn, _), own = self.motion(n), self.local(n).tensor
        placed = self.properties(n)
        if placed.mass is not None:
            own = tensor.shift_from_com(own, placed.mass, turn.T @ (placed.com - point))
        return principal_axes.principal_frame(n.tidy(own), n.tidy(axes.T @ turn))
