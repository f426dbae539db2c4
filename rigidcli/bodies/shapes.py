"""The shapes by name. A new one is a class in a module whose name ends in `_shapes`, and a line here."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import cache
from importlib import import_module

from rigidcli.bodies.shape import Shape

PLACES = {
    "box": "prism_shapes.Box",
    "cube": "prism_shapes.Cube",
    "sphere": "solid_shapes.Sphere",
    "hollow_sphere": "solid_shapes.HollowSphere",
    "ellipsoid": "solid_shapes.Ellipsoid",
    "cylinder": "prism_shapes.Cylinder",
    "tube": "prism_shapes.Tube",
    "elliptic_cylinder": "prism_shapes.EllipticCylinder",
    "half_cylinder": "prism_shapes.HalfCylinder",
    "cone": "solid_shapes.Cone",
    "frustum": "solid_shapes.Frustum",
    "pyramid": "solid_shapes.Pyramid",
    "hemisphere": "solid_shapes.Hemisphere",
    "spherical_cap": "solid_shapes.SphericalCap",
    "capsule": "solid_shapes.Capsule",
    "torus": "solid_shapes.Torus",
    "tetrahedron": "solid_shapes.Tetrahedron",
    "spherical_shell": "thin_shapes.SphericalShell",
    "hemispherical_shell": "thin_shapes.HemisphericalShell",
    "cylindrical_shell": "thin_shapes.CylindricalShell",
    "conical_shell": "thin_shapes.ConicalShell",
    "plate": "flat_shapes.Plate",
    "disk": "flat_shapes.Disk",
    "annulus": "flat_shapes.Annulus",
    "half_disk": "flat_shapes.HalfDisk",
    "triangle": "flat_shapes.Triangle",
    "polygon": "flat_shapes.Polygon",
    "rod": "thin_shapes.Rod",
    "ring": "thin_shapes.Ring",
}
"""What may stand under `shape`: the module of this package that has it, and its class there."""


@cache
def _class(name: str) -> type[Shape]:
    module, _, shape = PLACES[name].partition(".")
    found: type[Shape] = getattr(import_module(f"rigidcli.bodies.{module}"), shape)
    return found


class _Shapes(Mapping[str, type[Shape]]):
    """The shapes by name; a module is loaded when one of its shapes is asked for, as a document has few."""

    def __getitem__(self, name: str) -> type[Shape]:
        return _class(name)

    def __contains__(self, name: object) -> bool:
        return name in PLACES

    def __iter__(self) -> Iterator[str]:
        return iter(PLACES)

    def __len__(self) -> int:
        return len(PLACES)


SHAPES = _Shapes()
"""The classes of the shapes."""
