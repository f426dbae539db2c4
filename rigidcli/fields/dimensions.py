"""The dimension of a quantity, in exponents of the base units, and that of an expression.

A parameter that was given as `3 cm` is a length wherever it is used. A plain number is in SI units of
whatever fits, and so is a parameter given as one; an expression has a dimension only as far as that follows
from parameters with units.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING, NamedTuple, TypeAlias

from rigidcli.errors import ValueProblem, shown, with_article

if TYPE_CHECKING:
    from rigidcli.language.tree import Node, Parts


class Dimension(NamedTuple):
    """Exponents of the base units; its text names it and its SI unit, as in `length (m)`.

    Angle is kept, unlike in the SI, so that degrees cannot pass for metres. `cycle` is what a
    hertz counts: turns in one book and radians in the next, so it is neither.
    """

    mass: int = 0
    length: int = 0
    time: int = 0
    angle: int = 0
    cycle: int = 0
    current: int = 0
    temperature: int = 0
    amount: int = 0

    def times(self, other: Dimension, power: int = 1) -> Dimension:
        """The dimension of a product with `other` raised to `power`."""
        return Dimension(*(a + power * b for a, b in zip(self, other, strict=True)))

    def __str__(self) -> str:
        """The usual name with the SI unit, `mass (kg)`; without a name, the unit `kg m/s^3` alone."""
        if self in USUAL_NAMES:
            return USUAL_NAMES[self]
        units = ("kg", "m", "s", "rad", "cycle", "A", "K", "mol")
        return product_of_units(dict(zip(units, self, strict=True)))

    @property
    def unit(self) -> str:
        """The name of the SI unit alone; nothing for a pure number."""
        text = str(self)
        return (text.partition(" (")[2][:-1] or text) if any(self) else ""


def product_of_units(powers: Mapping[str, int]) -> str:
    """The product of units with these powers, as it is written: `kg m/s^3`, `1/s`, `kg/(m s)`."""
    above, below = (
        [unit if abs(n) == 1 else f"{unit}^{abs(n)}" for unit, n in powers.items() if sign * n > 0]
        for sign in (1, -1)
    )
    lower = f"({' '.join(below)})" if len(below) > 1 else "".join(below)
    return "/".join(filter(None, [" ".join(above) or "1", lower]))


# The usual names of dimensions, each with its SI unit.
USUAL_NAMES = {
    (DIMENSIONLESS := Dimension()): "pure number",
    (MASS := Dimension(mass=1)): "mass (kg)",
    (LENGTH := Dimension(length=1)): "length (m)",
    (TIME := Dimension(time=1)): "time (s)",
    (ANGLE := Dimension(angle=1)): "angle (rad)",
    (ANGULAR_VELOCITY := Dimension(angle=1, time=-1)): "angular velocity (rad/s)",
    Dimension(angle=1, time=-2): "angular acceleration (rad/s^2)",
    (FREQUENCY := Dimension(cycle=1, time=-1)): "frequency (Hz)",
    (AREA := Dimension(length=2)): "area (m^2)",
    (VOLUME := Dimension(length=3)): "volume (m^3)",
    Dimension(length=1, time=-1): "velocity (m/s)",
    (ACCELERATION := Dimension(length=1, time=-2)): "acceleration (m/s^2)",
    (LINE_DENSITY := Dimension(mass=1, length=-1)): "mass per length (kg/m)",
    (AREA_DENSITY := Dimension(mass=1, length=-2)): "mass per area (kg/m^2)",
    (DENSITY := Dimension(mass=1, length=-3)): "density (kg/m^3)",
    (MOMENT_OF_INERTIA := Dimension(mass=1, length=2)): "moment of inertia (kg m^2)",
    Dimension(mass=1, length=1, time=-1): "momentum (kg m/s)",
    Dimension(mass=1, length=2, time=-1): "angular momentum (kg m^2/s)",
    Dimension(mass=1, time=-2): "stiffness (N/m)",
    Dimension(mass=1, length=1, time=-2): "force (N)",
    (ENERGY := Dimension(mass=1, length=2, time=-2)): "torque or energy (N m)",
    (POWER := Dimension(mass=1, length=2, time=-3)): "power (W)",
    Dimension(mass=1, length=-1, time=-2): "pressure (Pa)",
    (GRAVITATIONAL_PARAMETER := Dimension(length=3, time=-2)): "gravitational parameter (m^3/s^2)",
    Dimension(current=1): "electric current (A)",
    Dimension(temperature=1): "temperature (K)",
}


def check_dimension(text: str, given: Dimension, expected: Dimension) -> None:
    """Refuse `text`, a unit or an expression, that has another dimension than expected.

    A radian counts as 1: an angle may be left out (`1/s` for an angular velocity) or join a
    product (`kg m^2 rad/s`), but a mere angle is no pure number. Hertz and radians never mix.
    Raises ValueProblem, which names both dimensions.
    """
    rest = given._replace(angle=0)
    angle_fits = given.angle in (0, expected.angle) or (expected.angle == 0 and rest != DIMENSIONLESS)
    # A torque is an energy per angle: the stiffness of a torsion spring is in N m/rad or J/rad^2.
    angle_fits |= (given.angle, expected.angle, rest.mass, rest.length) == (-2, -1, 1, 2)
    if angle_fits and rest == expected._replace(angle=0):
        return
    hint = None
    if given.cycle != expected.cycle:
        hint = "a hertz may count turns or radians, 2 pi apart: write `rev/s` or `rad/s`"
    raise ValueProblem(f"{shown(text)} is {described(given)}, expected {described(expected)}", hint=hint)


def described(dimension: Dimension) -> str:
    """A dimension in a sentence, with its article: `a length (m)`."""
    return with_article(USUAL_NAMES.get(dimension, f"quantity in {dimension}"))


def number_of(dimension: Dimension | None, sign: str | None = None) -> str:
    """A number of this dimension and sign in words, for messages of errors."""
    thing = "number" if not dimension or not any(dimension) else str(dimension)
    return with_article(thing if sign is None else f"{sign} {thing}")


# The dimension of a part of an expression, or None where it may be any; a pure number is a float, or NaN.
_Value: TypeAlias = Dimension | float | None


def dimension_of(root: Node, dimensions: Mapping[str, Dimension]) -> Dimension | None:
    """The dimension of an expression, from those of its names; None where it may be any.

    Raises ValueProblem for a sum of different dimensions, and for a function of no pure number.
    """
    from rigidcli.language.tree import Kind, fold

    def negative(value: _Value) -> _Value:
        return -value if isinstance(value, float) else value

    kind = Kind(lambda text, value: value, negative, _sum, _product, _power, _call)
    value = fold(root, dimensions.get, kind)
    return value if isinstance(value, Dimension) else None


def _sum(parts: Parts) -> _Value:
    """The dimension of terms: radians count as 1, and plain numbers fit any."""
    values = [value for _, value in parts]
    given = [value for value in values if isinstance(value, Dimension)]
    for other in given[1:]:
        if other._replace(angle=0) != given[0]._replace(angle=0):
            raise ValueProblem(f"{described(given[0])} and {described(other)} cannot be added")
    return given[0] if given else None if None in values else math.nan


def _product(parts: Parts) -> _Value:
    values = [value for _, value in parts]
    if None in values or not any(isinstance(value, Dimension) for value in values):
        return None if None in values else math.nan
    total = DIMENSIONLESS
    for divides, value in parts:
        total = total.times(value, -1 if divides else 1) if isinstance(value, Dimension) else total
    return total


def _power(base: _Value, exponent: _Value) -> _Value:
    if not isinstance(exponent, float) or base is None:
        return None
    if not isinstance(base, Dimension):
        return math.nan
    powers = [part * exponent for part in base]
    return Dimension(*map(int, powers)) if all(map(float.is_integer, powers)) else None


def _call(function: str, arguments: list[_Value]) -> _Value:
    from rigidcli.language.tree import UnknownFunction

    if isinstance(function, UnknownFunction):
        return None
    if function in ("sqrt", "abs"):
        return _power(arguments[0], 0.5 if function == "sqrt" else 1.0)
    dimension, is_any = _sum([(False, each) for each in arguments]), function in ("atan2", "sign")
    if not is_any and isinstance(dimension, Dimension) and any(dimension._replace(angle=0)):
        raise ValueProblem(f"{function} of {described(dimension)}, expected an angle or a pure number")
    return math.nan
