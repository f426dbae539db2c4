"""Numbers of a document by their dimension, sign and size; lists of them, and points."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from decimal import Decimal
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Strict, ValidationInfo
from pydantic.json_schema import JsonSchemaValue

from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import (
    ANGLE,
    ANGULAR_VELOCITY,
    DIMENSIONLESS,
    LENGTH,
    MASS,
    MOMENT_OF_INERTIA,
    TIME,
    Dimension,
    number_of,
)
from rigidcli.fields.environment import Environment
from rigidcli.fields.section import SHARED_SCHEMA, Alternative, ReadBy, Reader, environment
from rigidcli.fields.words import list_meant, not_one_of

# The largest number of a dimension, in SI units; its inverse is the least. No formula goes beyond floats.
LARGEST_SIZES: dict[Dimension | None, float] = {LENGTH: 1e50, MASS: 1e100, MOMENT_OF_INERTIA: 1e200}
DEFAULT_LIMIT = 1e160  # the limit of numbers of other dimensions
# A bare number beyond this (rad) is probably an angle in degrees; 2 pi, as it is typed, is not beyond it.
FULL_TURN = 6.2832


@dataclass(frozen=True)
class Quantity(Reader):
    """Marks a field as a number with a dimension, which becomes an SI value once, when it is read.

    The dimension None stands for any dimension.
    """

    dimension: Dimension | None
    sign: Literal["positive", "nonnegative"] | None = None

    def json_schema(self) -> JsonSchemaValue:
        """The JSON Schema of a number, or of a text for a number, under a name of its own."""
        number: dict[str, object] = {"type": "number"}
        if self.sign is not None:
            number["exclusiveMinimum" if self.sign == "positive" else "minimum"] = 0
        text = f"{self.words}; or a quantity with a unit, or an expression in the parameters"
        name = " ".join(filter(None, [self.sign, str(self.dimension or "number").partition(" (")[0]]))
        body = {"anyOf": [number, {"type": "string"}], "description": text[0].upper() + text[1:]}
        return {SHARED_SCHEMA: name.replace(" ", "-"), "schema": body}

    @property
    def words(self) -> str:
        """The expected quantity, in words."""
        return number_of(self.dimension, self.sign)

    def read(self, raw: object, info: ValidationInfo) -> Scalar:
        """The SI value, of a size and sign that fit."""
        env = environment(info)
        value: Scalar = env.read(raw, self.dimension)
        is_bare = self.dimension == ANGLE and isinstance(raw, int | float | Decimal)
        if is_bare and abs(float(str(raw))) > FULL_TURN:
            env.log.note(f"an angle of {raw} rad is beyond a full turn; {raw} deg meant?")
        limit = LARGEST_SIZES.get(self.dimension, DEFAULT_LIMIT)
        if not env.arithmetic.exact and value and not 1 / limit <= abs(value) <= limit:
            bounds = f"from {1 / limit:.0e} to {limit:.0e}"
            raise ValueProblem(f"read {shown(raw)}, expected {self.words} {bounds}")
        if self.sign is not None:
            sign = env.arithmetic.sign(value)
            if sign == -1 or (sign == 0 and self.sign == "positive"):
                raise ValueProblem(f"{worked_out(raw, env.arithmetic.value(value))}, expected {self.words}")
        return value


def worked_out(raw: object, value: float | None) -> str:
    """The number as it was read, for a message; an expression has its value behind it."""
    worked = f" (which is {value:.6g})" if isinstance(raw, str) and value is not None else ""
    return f"read {shown(raw)}{worked}"


class UnitOfLength(Quantity):
    """Marks a field as a length that is a unit, which may stand without a number: `mm` is `1 mm`."""

    def read(self, raw: object, info: ValidationInfo) -> Scalar:
        """The length (m)."""
        if isinstance(raw, str) and raw.strip() not in environment(info).declared:
            from rigidcli.fields.units import is_unit

            raw = f"1 {raw}" if is_unit(raw.strip()) else raw
        return super().read(raw, info)


def _read_whole(raw: object, info: ValidationInfo) -> int:
    env = environment(info)
    value = env.arithmetic.value(env.read(raw, DIMENSIONLESS))
    if value is None or not value.is_integer():
        raise ValueProblem(f"{worked_out(raw, value)}, expected a whole number")
    return int(value)


def limited(fits: Callable[[Any, Arithmetic], bool], expected: str, unit: str = "") -> AfterValidator:
    """Marks a number that is refused where it does not fit; `expected` says in words which numbers fit."""

    def check(value: Scalar, info: ValidationInfo) -> Scalar:
        n = environment(info).arithmetic
        if not fits(value, n):
            size = n.size(value)
            is_typed = float(f"{size:.6g}") == size  # and not made from another unit
            hint = f"{size:.6g} deg meant?" if unit == " rad" and 0 < size <= 180 and is_typed else None
            raise ValueProblem(f"read {size:.6g}{unit}, expected {expected}", hint=hint)
        return value

    return AfterValidator(check)


Mass = Annotated[Scalar, Quantity(MASS, "positive")]
Length = Annotated[Scalar, Quantity(LENGTH, "positive")]
OptionalLength = Annotated[Scalar, Quantity(LENGTH, "nonnegative")]
Coordinate = Annotated[Scalar, Quantity(LENGTH)]
Scale = Annotated[Scalar, UnitOfLength(LENGTH, "positive")]
Angle = Annotated[Scalar, Quantity(ANGLE)]
PolarAngle = Annotated[
    Angle, limited(lambda x, n: -1 not in (n.sign(x), n.sign(n.pi - x)), "an angle from 0 to 180 deg", " rad")
]
AngularVelocity = Annotated[Scalar, Quantity(ANGULAR_VELOCITY)]
MomentOfInertia = Annotated[Scalar, Quantity(MOMENT_OF_INERTIA)]
PrincipalMoment = Annotated[Scalar, Quantity(MOMENT_OF_INERTIA, "nonnegative")]
PositiveMoment = Annotated[Scalar, Quantity(MOMENT_OF_INERTIA, "positive")]
Duration = Annotated[Scalar, Quantity(TIME, "positive")]
Number = Annotated[Scalar, Quantity(DIMENSIONLESS)]
WholeNumber = Annotated[int, ReadBy(_read_whole, {"type": ["integer", "string"]})]

# A YAML list is read as a tuple; everything else stays strict.
AsList = Strict(False)
Vector3 = Annotated[tuple[Coordinate, Coordinate, Coordinate], AsList]
Direction = Annotated[tuple[Number, Number, Number], AsList]
Rates3 = Annotated[tuple[AngularVelocity, AngularVelocity, AngularVelocity], AsList]


def _list_along(axes: str) -> BeforeValidator:
    """Marks lengths along these axes; the error of a text that is no list shows how to write the list."""

    def check(raw: object) -> object:
        if not isinstance(raw, list | tuple):
            meant = list_meant(raw) if isinstance(raw, str) else None
            message = f"read {shown(raw)}, expected a list, such as [{axes}]"
            raise ValueProblem(message, hint=meant and f"write `{meant}`", typed=meant and str(raw))
        return raw

    return BeforeValidator(check)


Size2 = Annotated[tuple[Length, Length], AsList, _list_along("x, y")]
Size3 = Annotated[tuple[Length, Length, Length], AsList, _list_along("x, y, z")]


def _read_point(raw: str, env: Environment) -> str:
    if raw not in ("origin", "com"):
        raise ValueProblem(not_one_of(raw, ("origin", "com")))
    return raw


Point: TypeAlias = Annotated[
    tuple[Scalar, Scalar, Scalar] | str,
    Alternative(str, _read_point, otherwise=Vector3, schema={"enum": ["origin", "com"]}),
]

ReferencePoint: TypeAlias = Annotated[
    tuple[Scalar, Scalar, Scalar] | str,
    Alternative(str, lambda raw, env: raw, otherwise=Vector3, schema={"type": "string"}),
]
"""A point of the document, which may have a name."""
