"""Curved shells and wires, which have no thickness, one class each. All else is as in `solid_shapes`."""

# Annotations here are objects, not texts: pydantic reads them, for each shape those of all its bases anew.

from collections.abc import Sequence
from typing import ClassVar

from rigidcli.bodies import charts
from rigidcli.bodies.geometry import ORIGIN, Geometry
from rigidcli.bodies.shape import Shell, Wire
from rigidcli.core.arithmetic import Arithmetic
from rigidcli.fields.quantities import Length


class SphericalShell(Shell):
    """A thin sphere; origin at its centre."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(4 * n.pi * self.radius**2, ORIGIN, 3 * [self.radius**2 / 3])

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.sphere(self.radius, n)]


class HemisphericalShell(Shell):
    """A thin half sphere bulging to +z; origin at the centre of its rim."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(2 * n.pi * R**2, (0, 0, R / 2), [R**2 / 3, R**2 / 3, R**2 / 12])

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.sphere(self.radius, n, quarters=1)]


class CylindricalShell(Shell):
    """A thin cylinder along z, open at both ends; origin at its centre."""

    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        return Geometry(2 * n.pi * R * h, ORIGIN, [R**2 / 2, R**2 / 2, h**2 / 12])

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.prism(charts.ring(self.radius, n), self.height)]


class ConicalShell(Shell):
    """The thin lateral surface of a cone opening to +z; origin at its apex."""

    ANCHORS: ClassVar = {"apex": lambda s: ORIGIN, "base": lambda s: (0, 0, s.height)}
    radius: Length
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R, h = self.radius, self.height
        area = n.pi * R * n.hypot(R, h)
        return Geometry(area, (0, 0, 2 * h / 3), [R**2 / 4, R**2 / 4, h**2 / 18])

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.cone_surface(self.radius, self.height, n)]


class Rod(Wire):
    """A thin straight rod along z; origin at its centre."""

    ANCHORS: ClassVar = {"end": lambda s: (0, 0, -s.length / 2)}
    length: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        return Geometry(self.length, ORIGIN, [0, 0, self.length**2 / 12])

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.block(None, None, self.length)]


class Ring(Wire):
    """A thin circular ring, normal along z; origin at its centre."""

    radius: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        R = self.radius
        return Geometry(2 * n.pi * R, ORIGIN, [R**2 / 2, R**2 / 2, 0])

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.ring(self.radius, n)]
