"""Point masses as a form of body: in the document, in a table, or as the atoms of a molecule."""

from __future__ import annotations

import pathlib
from collections.abc import Iterator, Mapping
from functools import cached_property
from typing import TYPE_CHECKING, Annotated, Any, Self, TypeAlias

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationInfo, model_validator

from rigidcli.bodies.form import Form
from rigidcli.bodies.points import MOLECULE, Block, blocks
from rigidcli.core import mass_properties
from rigidcli.core.arithmetic import Arithmetic, Scalar
from rigidcli.errors import ComputationError, ValueProblem, at
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import AsList, Coordinate, Mass, Vector3
from rigidcli.fields.readers import Alternative, reference
from rigidcli.fields.section import Section, environment

if TYPE_CHECKING:
    from rigidcli.bodies.molecules import Molecule


class PointMass(Section):
    """A point with a mass."""

    mass: Mass
    position: Vector3


def _row(raw: Mapping[str, Any], env: Environment) -> tuple[Scalar, ...]:
    point = PointMass.model_validate(raw, context=env)
    return (point.mass, *point.position)


Row: TypeAlias = Annotated[
    tuple[Scalar, Scalar, Scalar, Scalar],
    Alternative(
        dict,
        _row,
        otherwise=Annotated[tuple[Mass, Coordinate, Coordinate, Coordinate], AsList],
        schema=reference(PointMass),
    ),
]


def _with_masses(raw: object) -> object:
    """What is written under `points`. Raises ValueProblem, once, for a list of places without masses."""
    if isinstance(raw, list) and raw and all(isinstance(row, list) and len(row) == 3 for row in raw):
        hint = "the mass comes first: [1, x, y, z] is a point of 1 kg"
        raise ValueProblem("read points of 3 numbers, expected [m, x, y, z]", hint=hint)
    return raw


class PointMasses(Form):
    """Point masses in the document or in a file.

    A .csv has the header m,x,y,z, a .npy the shape (n, 4), and an .xyz the atoms of a molecule.
    """

    points: Annotated[
        tuple[Row, ...] | pathlib.Path,
        Alternative(
            str,
            lambda raw, env: env.file(raw),
            otherwise=Annotated[tuple[Row, ...], AsList, Field(min_length=1)],
            schema={"type": "string", "description": "A .csv, .npy or .xyz file, beside the document"},
        ),
        BeforeValidator(_with_masses),
    ]

    _molecule: Molecule | None = PrivateAttr(default=None)

    @model_validator(mode="after")
    def _read_molecule(self, info: ValidationInfo) -> Self:
        if isinstance(self.points, pathlib.Path) and self.points.suffix.lower() == MOLECULE:
            from rigidcli.bodies.molecules import read_molecule

            with at("points"):
                self._molecule = read_molecule(self.points)
            environment(info).notes += self._molecule.notes
        return self

    @property
    def rounding(self) -> float | None:
        """That of the coordinates in the file of a molecule (m)."""
        return None if self._molecule is None else self._molecule.rounding

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Sums over the points, which are read in blocks from a file."""
        if not isinstance(self.points, pathlib.Path):
            return mass_properties.of_points(arithmetic.array(self.points), arithmetic)
        if arithmetic.exact:
            raise ComputationError(
                f"the points in {self.points} are floats, and have no exact results",
                hint="leave out `--exact` and give every parameter a value, or write the points out",
            )
        return self._in_file

    def blocks(self, *, checked: bool = False) -> Iterator[Block]:
        """Blocks of rows m, x, y, z, as `points.blocks` gives them; of points with floating-point values."""
        if self._molecule is not None:
            yield self._molecule.atoms
        elif isinstance(self.points, pathlib.Path):
            yield from blocks(self.points, checked=checked)
        else:
            yield np.array(self.points, dtype=np.float64)

    @cached_property
    def _in_file(self) -> mass_properties.MassProperties:
        with at("points"):
            body = mass_properties.of_blocks(self.blocks)
            if not np.isfinite(body.tensor).all():
                for _ in self.blocks(checked=True):
                    pass  # names the row to blame
            return body
