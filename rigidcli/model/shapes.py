"""The shapes by name. A new one is a class in `solid_shapes` or `thin_shapes`, and a line here."""

from __future__ import annotations

from rigidcli.model import solid_shapes, thin_shapes
from rigidcli.model.shape import Shape

SHAPES: dict[str, type[Shape]] = {
    "box": solid_shapes.Box,
    "cube": solid_shapes.Cube,
    "sphere": solid_shapes.Sphere,
    "hollow_sphere": solid_shapes.HollowSphere,
    "ellipsoid": solid_shapes.Ellipsoid,
    "cylinder": solid_shapes.Cylinder,
    "tube": solid_shapes.Tube,
    "elliptic_cylinder": solid_shapes.EllipticCylinder,
    "half_cylinder": solid_shapes.HalfCylinder,
    "cone": solid_shapes.Cone,
    "frustum": solid_shapes.Frustum,
    "pyramid": solid_shapes.Pyramid,
    "hemisphere": solid_shapes.Hemisphere,
    "spherical_cap": solid_shapes.SphericalCap,
    "capsule": solid_shapes.Capsule,
    "torus": solid_shapes.Torus,
    "tetrahedron": solid_shapes.Tetrahedron,
    "spherical_shell": thin_shapes.SphericalShell,
    "hemispherical_shell": thin_shapes.HemisphericalShell,
    "cylindrical_shell": thin_shapes.CylindricalShell,
    "conical_shell": thin_shapes.ConicalShell,
    "plate": thin_shapes.Plate,
    "disk": thin_shapes.Disk,
    "annulus": thin_shapes.Annulus,
    "half_disk": thin_shapes.HalfDisk,
    "triangle": thin_shapes.Triangle,
    "polygon": thin_shapes.Polygon,
    "rod": thin_shapes.Rod,
    "ring": thin_shapes.Ring,
}
"""What may stand under `shape`."""
