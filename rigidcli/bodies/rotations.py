"""The ways to write a rotation, all active (body to space): axis and angle, Euler, quaternion, matrix."""

from __future__ import annotations

from abc import abstractmethod
from itertools import pairwise
from typing import Annotated, TypeAlias

from pydantic import AfterValidator

from rigidcli.core import rotation
from rigidcli.core.arithmetic import Arithmetic, Array
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.quantities import Angle, AsList, Direction, Number
from rigidcli.fields.readers import by_key
from rigidcli.fields.section import Section


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


class Quaternion(Turn):
    """A quaternion [w, x, y, z]; it is normalised."""

    quaternion: Annotated[tuple[Number, Number, Number, Number], AsList]

    def as_matrix(self, n: Arithmetic) -> Array:
        """The matrix of the normalised quaternion."""
        return rotation.from_quaternion(self.quaternion, n)


class Matrix(Turn):
    """A rotation matrix, given by its rows."""

    matrix: Annotated[tuple[Direction, Direction, Direction], AsList]

    def as_matrix(self, n: Arithmetic) -> Array:
        """The matrix as given, made orthogonal to rounding."""
        return rotation.from_matrix(self.matrix, n)


Rotation: TypeAlias = Annotated[
    Turn,
    by_key(
        {"axis": AxisAngle, "euler": Euler, "quaternion": Quaternion, "matrix": Matrix},
        "{axis: [0, 0, 1], angle: 30 deg}",
    ),
]
