"""A body whose surface is a mesh of triangles in a file."""

from __future__ import annotations

import pathlib
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, model_validator

from rigidcli.bodies.density import Density
from rigidcli.bodies.form import Form
from rigidcli.core import mass_properties, tensor
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Mask, Scalar
from rigidcli.errors import ComputationError, ValueProblem
from rigidcli.fields.dimensions import DENSITY
from rigidcli.fields.environment import BoundExpression
from rigidcli.fields.quantities import Mass, Scale
from rigidcli.fields.section import FileName, environment

if TYPE_CHECKING:
    from rigidcli.bodies.mesh_files import Checked

# A mesh without a `scale` that is larger than this (m) has probably millimetres for its unit.
LARGEST_IN_METRES = 10.0
MOST_TRIANGLES_OF_HOLE = 500  # the most triangles of a hole that are compared with what it is cut from
# How far corners of such a triangle are drawn to its middle, as they may be at sharp edges of the hole.
CORNERS_DRAWN_IN = 1e-2


def _enclosing(path: pathlib.Path) -> pathlib.Path:
    """The path of a mesh. Raises ValueProblem, beside other problems of the section, for one of no body."""
    from rigidcli.bodies.mesh_files import checked  # with all that reads meshes

    checked(path)
    return path


def _uniform(density: Scalar | BoundExpression) -> Scalar:
    if isinstance(density, BoundExpression):
        hint = "cut it into `parts`, each with a density of its own, or describe it by shapes"
        raise ValueProblem("the density of a mesh is a number, and does not vary in it", hint=hint)
    return density


class Mesh(Form):
    """What is inside a closed surface of triangles from a file, such as .stl or .obj."""

    UNIT: ClassVar = "kg/m^3"

    ONE_OF: ClassVar = ("mass", "density")
    MARGIN: ClassVar = 1e-6
    """How far, in units of its size, single precision may leave the surface from where it was meant to be."""

    mesh: Annotated[FileName, AfterValidator(_enclosing)] = Field(
        description="An .stl, .obj, .off, .ply or .glb file, beside the document"
    )
    scale: Scale | None = Field(default=None, description="The unit of the file's coordinates; default 1 m")
    mass: Mass | None = Field(default=None, description="The mass of all of it; or give `density`")
    density: Annotated[Scalar, Density(DENSITY, "positive"), AfterValidator(_uniform)] | None = Field(
        default=None, description="Mass per volume (kg/m^3), the same everywhere in the mesh"
    )
    anchor: Literal["com"] | None = Field(
        default=None, description="`com` puts the centre of mass at `position`, in place of the file's origin"
    )

    @model_validator(mode="after")
    def _look(self, info: ValidationInfo) -> Self:
        env = environment(info)
        if not env.arithmetic.exact:
            notes, size = [*self.checked.notes], float(np.ptp(self.checked.surface.box, axis=0).max())
            if self.scale is None and size > LARGEST_IN_METRES:
                meant = "`scale: 0.001` says so, and `scale: 1` that they are metres"
                long = f"the mesh is {size:.6g} m long; are its coordinates millimetres?"
                notes.append(f"{long} {meant}")
            env.log.note(*(f"{self.mesh}: {note}" for note in notes))
        return self

    @cached_property
    def checked(self) -> Checked:
        """What the file holds: the field has been read, so that it encloses a body."""
        from rigidcli.bodies.mesh_files import checked  # with all that reads meshes

        return checked(self.mesh)

    def extent(self) -> tuple[Floats, float]:
        """The middle (3; m, axes of the file) and the radius (m) of a ball that holds the mesh."""
        surface = self.checked.surface
        return surface.box.mean(axis=0) * self.unit, surface.size * self.unit / 2

    def contains(self, x: Floats, y: Floats, z: Floats) -> Mask:
        """Which of the points (n; m, axes of the file) are inside; of too many, some are taken to be."""
        points = np.stack(np.broadcast_arrays(x, y, z), axis=1) / self.unit
        return np.asarray(self.checked.surface.windings(points) != 0)

    def net(self) -> Floats:
        """Points inside (3 by n; m, axes of the file), near the middles and corners of triangles."""
        from rigidcli.bodies.mesh_geometry import normals

        surface = self.checked.surface
        corners = surface.some(slice(None, None, -(-surface.triangles // MOST_TRIANGLES_OF_HOLE)))
        middles = corners.mean(axis=1, keepdims=True)
        depth = np.sign(surface.volume) * self.MARGIN * surface.size
        places = np.concatenate([middles, corners + CORNERS_DRAWN_IN * (middles - corners)], axis=1)
        points = (places - depth * normals(corners)[:, None]).reshape(-1, 3).T * self.unit
        return np.asarray(points[:, self.contains(*points)])

    def faces(self, most: int, cells: int) -> Floats:
        """The triangles (k, 3, 3; m, axes of the file); simplified where there are more than `most`."""
        from rigidcli.bodies.mesh_geometry import simplified

        surface = self.checked.surface
        if surface.triangles > most:
            return simplified(surface.corners, surface.box, cells) * self.unit
        return surface.some(slice(None)) * self.unit

    @property
    def unit(self) -> float:
        """The unit of the file's coordinates, m."""
        return 1.0 if self.scale is None else float(self.scale)

    @property
    def volume(self) -> float:
        """The volume, m^3."""
        return abs(self.checked.surface.volume) * self.unit**3

    def mean_density(self, n: Arithmetic) -> Scalar:
        """The density as given, or as it follows from the mass."""
        return (self.density or 0) if self.mass is None else (self.local(n).mass or 0) / self.volume

    def pivot(self, arithmetic: Arithmetic) -> Array:
        """The point that is put at `position`: the origin of the file, or the centre of mass."""
        return super().pivot(arithmetic) if self.anchor is None else self.local(arithmetic).com

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Mass properties along the axes of the file, and from its origin."""
        if arithmetic.exact:
            raise ComputationError(
                f"a mesh has no exact results: {self.mesh.name}",
                hint="leave out `--exact` and give every parameter a value",
            )
        surface, unit = self.checked.surface, self.unit
        mass = self.mass if self.mass is not None else self.mean_density(FLOAT) * self.volume
        spread = np.sqrt(np.maximum(surface.second.diagonal(), 0))
        rounding = tensor.ROUNDING_OF_SUM * surface.cancelled * np.outer(spread, spread)
        central = tensor.from_second_moments(mass * unit**2, tensor.rounded_off(surface.second, rounding))
        return mass_properties.MassProperties(mass, (surface.origin + surface.centre) * unit, central)

    def report(self) -> dict[str, Any]:
        """What the mesh is, by the names of the results: lengths, areas and volumes in SI units."""
        surface, unit = self.checked.surface, self.unit
        return {
            "volume": self.volume,
            "area": surface.area * unit**2,
            "bounding_box": surface.box * unit,
        }
