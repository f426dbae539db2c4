"""Solids of one section along z, one class each; all else is as in `solid_shapes`."""

# Annotations here are objects, not texts: pydantic reads them, for each shape those of all its bases anew.

from collections.abc import Sequence
from typing import Any, ClassVar

from rigidcli.bodies import charts
from rigidcli.bodies.flat_shapes import Annulus, Disk, HalfDisk, Plate
from rigidcli.bodies.geometry import ORIGIN, Geometry
from rigidcli.bodies.shape import Hollow, Solid
from rigidcli.core.arithmetic import Arithmetic, Floats, Mask
from rigidcli.fields.quantities import Length, Size2, Size3


class _Prism(Solid):
    """What a flat shape fills when it is moved along z; origin half way, over that of the flat shape.

    It has the dimensions of that shape, its `SECTION`, whose formulas read them from it.
    """

    SECTION: ClassVar[Any]

    def swept(self: Any) -> Length:
        """The height (m)."""
        height: Length = self.height
        return height

    def check(self, n: Arithmetic) -> None:
        self.SECTION.check(self, n)

    def geometry(self, n: Arithmetic) -> Geometry:
        height = self.swept()
        area, centre, (xx, yy, _), (x, y, _) = self.SECTION.geometry(self, n)
        bounds = x, y, (-height / 2, height / 2)
        return Geometry(area * height, centre, [xx, yy, height**2 / 12], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.prism(chart, self.swept()) for chart in self.SECTION.maps(self, n)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        inside: Mask = self.SECTION.contains(self, x, y, z) & (abs(z) <= self.swept() / 2)
        return inside


class Box(_Prism):
    """A rectangular block; origin at its centre."""

    SECTION: ClassVar = Plate
    ANCHORS: ClassVar = {"corner": lambda s: tuple(-side / 2 for side in s.size)}
    size: Size3

    def swept(self) -> Length:
        return self.size[2]


class Cube(_Prism):
    """A cube; origin at its centre."""

    SECTION: ClassVar = Plate
    ANCHORS: ClassVar = {"corner": lambda s: 3 * (-s.side / 2,)}
    side: Length

    @property
    def size(self) -> tuple[Length, Length]:
        """The sides of its section (m)."""
        return self.side, self.side

    def swept(self) -> Length:
        return self.side

    def geometry(self, n: Arithmetic) -> Geometry:
        return super().geometry(n)._replace(measure=self.side**3)  # rounded once


class Cylinder(_Prism):
    """A circular cylinder along z; origin at its centre."""

    SECTION: ClassVar = Disk
    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    radius: Length
    height: Length


class Tube(_Prism, Hollow):
    """A cylinder along z with a coaxial hole; origin at its centre."""

    SECTION: ClassVar = Annulus
    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    height: Length


class EllipticCylinder(Solid):
    """A cylinder along z on an ellipse; origin at its centre."""

    ANCHORS: ClassVar = {"base": lambda s: (0, 0, -s.height / 2)}
    semi_axes: Size2
    height: Length

    def geometry(self, n: Arithmetic) -> Geometry:
        (a, b), h = self.semi_axes, self.height
        bounds = (-a, a), (-b, b), (-h / 2, h / 2)
        return Geometry(n.pi * a * b * h, ORIGIN, [a**2 / 4, b**2 / 4, h**2 / 12], bounds)

    def maps(self, n: Arithmetic) -> Sequence[charts.Chart]:
        return [charts.prism(charts.sector(1, n, stretch=self.semi_axes), self.height)]

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        a, b = self.semi_axes
        return ((x / a) ** 2 + (y / b) ** 2 <= 1) & (abs(z) <= self.height / 2)


class HalfCylinder(_Prism):
    """The half y >= 0 of a cylinder along z; origin at the centre of the flat face."""

    SECTION: ClassVar = HalfDisk
    radius: Length
    height: Length
