"""Composites, given tensors and links of robots as forms of body."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import Annotated, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, ValidationInfo, model_validator

from rigidcli.bodies import holes
from rigidcli.bodies.bodies import Body
from rigidcli.bodies.form import Form
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.shapes import Shape
from rigidcli.core import mass_properties, tensor
from rigidcli.core.arithmetic import Arithmetic, Array, Floats, Scalar, half_unit
from rigidcli.errors import Path, ValueProblem, at
from rigidcli.fields.environment import Environment
from rigidcli.fields.quantities import AsList, Mass, MomentOfInertia, Point, PrincipalMoment, Vector3
from rigidcli.fields.section import (
    Alternative,
    FileName,
    Section,
    environment,
    reference,
)

# How far Ixy and Iyx may differ, in units of the largest entry: given tensors are rounded.
SYMMETRY_TOLERANCE = 1e-9
# The least radius of gyration (m): that of a proton is 1e-15, of a molecule 1e-10.
SMALLEST, POINT = 1e-14, "taken as a point mass"
# The least mass in a cube of the radius of gyration (kg/m^3): a thousandth of the density of air.
THINNEST = 1e-3


class TensorEntries(Section):
    """The entries of a symmetric tensor; products of inertia that are not given are zero."""

    Ixx: MomentOfInertia
    Iyy: MomentOfInertia
    Izz: MomentOfInertia
    Ixy: MomentOfInertia = Field(default=0, description="-sum m x y (kg m^2)")
    Ixz: MomentOfInertia = Field(default=0, description="-sum m x z (kg m^2)")
    Iyz: MomentOfInertia = Field(default=0, description="-sum m y z (kg m^2)")


def _rows(raw: Mapping[str, Any], env: Environment) -> tuple[tuple[Scalar, ...], ...]:
    e = TensorEntries.model_validate(raw, context=env)
    return ((e.Ixx, e.Ixy, e.Ixz), (e.Ixy, e.Iyy, e.Iyz), (e.Ixz, e.Iyz, e.Izz))


def _three_by_three(raw: object) -> object:
    """What is written under `inertia`. Raises ValueProblem, once, for a table of another size."""
    sizes = [len(row) for row in raw if isinstance(row, list)] if isinstance(raw, list) else [3]
    if sizes and sizes[0] != 3 and len(set(sizes)) == 1:
        raise ValueProblem(f"read {len(sizes)} rows of {sizes[0]} entries, expected 3 rows of 3")
    return raw


TensorRow = Annotated[tuple[MomentOfInertia, MomentOfInertia, MomentOfInertia], AsList]


class KnownTensor(Form):
    """A body with a given inertia tensor, or with given moments along the form's own x, y and z.

    Without a mass the tensor cannot be shifted: it is good for the point that it is given about.
    """

    ONE_OF: ClassVar = ("inertia", "moments")

    inertia: (
        Annotated[
            tuple[TensorRow, TensorRow, TensorRow],
            Alternative(
                dict,
                _rows,
                otherwise=Annotated[tuple[TensorRow, TensorRow, TensorRow], AsList],
                schema=reference(TensorEntries),
            ),
            BeforeValidator(_three_by_three),
        ]
        | None
    ) = Field(default=None, description="The tensor by its rows, or by Ixx, Iyy, Izz, Ixy, Ixz, Iyz")
    products: Literal["minus", "plus"] = Field(
        default="minus",
        description="The sign of products of inertia: -sum m x y, or plus as CAD programs print them",
    )
    moments: Annotated[tuple[PrincipalMoment, PrincipalMoment, PrincipalMoment], AsList] | None = Field(
        default=None, description="Moments along the form's own x, y and z"
    )
    mass: Mass | None = Field(default=None, description="Without it the tensor cannot be shifted")
    com: Vector3 | None = Field(default=None, description="Where the centre of mass is; default the origin")
    given_about: Point = Field(default="com", description="The point about which the tensor is given")

    @model_validator(mode="after")
    def _note_digits(self, info: ValidationInfo) -> Self:
        env = environment(info)
        with suppress(ValueProblem):  # which comes again where the body is needed
            _, note = self._central(env.arithmetic)
            env.log.note(*filter(None, [note]))
        return self

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """The tensor shifted to the centre of mass; without a mass, as given and about that point."""
        return self._central(arithmetic)[0]

    def _central(self, n: Arithmetic) -> tuple[mass_properties.MassProperties, str | None]:
        """The mass properties, and a note where a body has them only within the digits that were typed."""
        given, halves = self._given(n)
        com = n.array([0, 0, 0] if self.com is None else self.com)
        point = {"com": com, "origin": 0 * com}.get(str(self.given_about))
        offset = (n.array(self.given_about) if point is None else point) - com
        if self.mass is None:
            note = _require_physical(given, n, halves)
            at_com = all(n.sign(component) == 0 for component in offset)
            return mass_properties.MassProperties(None, com + offset, given, at_com=at_com), note
        shift = self.mass * tensor.point_tensor(offset)
        central = given - shift
        if not n.exact:  # what is left of two numbers that are equal but for their rounding
            central = tensor.rounded_off(central, tensor.ROUNDING_OF_SUM * np.abs(shift))
        # The rounding of M (d^2 1 - d d^T) from those of M and d.
        d, mass = (np.abs([n.size(part) for part in parts]) for parts in (offset, (self.mass,)))
        across = np.outer(d, [half_unit(n.size(part)) for part in com])
        halves = (
            halves
            + half_unit(mass[0]) * np.abs(tensor.point_tensor(d))
            + mass[0] * (2 * np.trace(across) * np.eye(3) + across + across.T)
        )
        note = _require_physical(central, n, halves) or self._size_meant(central, n)
        if note is not None and note.endswith(POINT):
            central = np.zeros((3, 3))
        return mass_properties.MassProperties(self.mass, com, central), note

    def _size_meant(self, central: Any, n: Arithmetic) -> str | None:
        """A note on moments that are rounding errors, or too large for the mass."""
        mass, largest = n.value(self.mass or 0), max(abs(n.size(entry)) for entry in central.flat)
        if n.exact or not mass or not largest:
            return None
        radius = math.sqrt(largest / mass)
        if radius < SMALLEST:
            return f"a radius of gyration of {radius:.1g} m is rounding: the body is {POINT}"
        if mass < THINNEST * radius**3:
            return f"a radius of gyration of {radius:.3g} m is large for {mass:.3g} kg; g and mm meant?"
        return None

    def _given(self, n: Arithmetic) -> tuple[Array, Floats]:
        """The tensor as it is written, and half a unit in the last digit of each entry."""
        given = n.array(self.inertia) if self.moments is None else np.diag(n.array(self.moments))
        if self.products == "plus":
            given = given * (2 * np.eye(3, dtype=int) - 1)
        sizes = [[n.size(entry) for entry in row] for row in given]
        halves = np.array([[half_unit(entry) for entry in row] for row in sizes])
        skew = np.abs([[n.size(entry) for entry in row] for row in n.tidy(given - given.T)])
        if (skew > SYMMETRY_TOLERANCE * np.abs(sizes).max() + halves + halves.T).any():
            raise ValueProblem(
                f"not symmetric: entries across the diagonal differ by up to {skew.max():.3g} kg m^2",
                path=("inertia",),
            )
        return given if self.moments is not None else (given + given.T) / 2, halves


def _require_physical(central: Any, n: Arithmetic, halves: Floats | float = 0.0) -> str | None:
    """`tensor.require_physical` for a tensor without open symbols; of others nothing can be said."""
    values = [n.value(entry) for entry in central.flat]
    if None in values:
        return None
    return tensor.require_physical(np.array(values, dtype=np.float64).reshape(3, 3), halves)


class Composite(Form):
    """Several bodies taken as one; parts with `hole: true` are missing."""

    parts: Annotated[tuple[Body, ...], AsList, Field(min_length=1)] = Field(
        description="Bodies of any form; one with `hole: true` is cut out of the others"
    )

    @model_validator(mode="after")
    def _fill_in(self, info: ValidationInfo) -> Self:
        """Give a hole without mass or density the density of what it is cut from."""
        n, parts = environment(info).arithmetic, list(self.parts)
        bare: dict[Path, int] = {
            ("parts", index): index
            for index, part in enumerate(parts)
            if part.hole and isinstance(part, Shape | Mesh) and part.mass is None and part.density is None
        }
        leaves = list(self.leaves(n)) if bare else []
        holes_of = [leaf for leaf in leaves if leaf.path in bare]
        for hole, density in zip(holes_of, holes.densities_around(holes_of, leaves, n), strict=True):
            parts[bare[hole.path]] = hole.form.model_copy(update={"density": density})
        filled = self.model_copy(update={"parts": tuple(parts)}) if bare else self
        environment(info).log.note(*filled._counted_twice(n))
        return filled

    def _counted_twice(self, n: Arithmetic) -> Iterator[str]:
        """Notes on parts that are alike, in one place, or overlap."""
        first = dict[str, int]()
        for index, part in enumerate(self.parts):
            if isinstance(part, Shape) and not part.hole:
                alike = first.setdefault(f"{part.word()} {vars(part) | {'name': ''}}", index)
                if alike != index:
                    yield f"parts.{alike} and parts.{index} are one body in one place, which counts twice"
        if len(first) == sum(isinstance(part, Shape) and not part.hole for part in self.parts):
            with suppress(ValueProblem):  # which comes again where the body is needed
                yield from holes.counted_twice(list(self.leaves(n)), n)

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """Parts added and holes taken away, refused where nothing would be left."""
        bodies = []
        for index, part in enumerate(self.parts):
            with at("parts", index):
                body = part.properties(arithmetic)
                if body.mass is None:
                    raise ValueProblem("missing, expected the mass of a part", path=("mass",))
            bodies.append(body.missing() if part.hole else body)
        whole = mass_properties.combine(bodies, arithmetic)
        if any(part.hole for part in self.parts):
            holes.require_material(list(self.leaves(arithmetic)), arithmetic)
            assert whole.mass is not None
            if arithmetic.sign(whole.mass) in (0, -1):
                raise ValueProblem(f"the holes leave no mass: {arithmetic.size(whole.mass):.6g} kg")
            _require_physical(whole.tensor, arithmetic)
        return whole

    @property
    def rounding(self) -> float | None:
        """The largest of molecules taken as one (m); None unless all parts are molecules."""
        molecules = [part.rounding for part in self.parts if part.rounding is not None and not part.hole]
        return max(molecules) if len(molecules) == len(self.parts) else None

    def leaves(self, arithmetic: Arithmetic) -> Iterator[holes.Leaf]:
        """All shapes in the composite, at any depth, with sign and place."""
        for index, part in enumerate(self.parts):
            place = part.motion(arithmetic)
            inner = part.leaves(arithmetic) if isinstance(part, Composite) else [holes.Leaf(part)]
            for leaf in inner:
                yield leaf.within(place, -1 if part.hole else 1, ("parts", index))


class RobotLink(Form):
    """A link of a robot, with the mass and the tensor that its file says, in the frame of the link."""

    robot: FileName = Field(description="A robot in URDF, SDF or MJCF, beside the document")
    link: str | None = Field(default=None, description="The name of one; needed where several have a mass")

    _form: Form = PrivateAttr()

    @model_validator(mode="after")
    def _look(self, info: ValidationInfo) -> Self:
        """Raise ValueProblem, which names the file and the line, where there is no such link, or no body."""
        from rigidcli.bodies.robot_formats import one_link  # with expat

        with at("robot"):
            link = one_link(self.robot, self.link)
            try:
                self._form = KnownTensor.model_validate(link.body, context=info.context)
                self._form.local(environment(info).arithmetic)
            except (ValidationError, ValueProblem) as error:
                said: object = error
                if isinstance(error, ValidationError):
                    complaint = error.errors()[0]
                    said = complaint.get("ctx", {}).get("error", complaint["msg"])
                message = f"{self.robot}:{link.line_of('inertia')}: link {link.name}: {said}"
                raise ValueProblem(message, hint=getattr(said, "hint", None)) from None
        return self

    def local(self, arithmetic: Arithmetic) -> mass_properties.MassProperties:
        """The mass properties in the frame of the link."""
        return self._form.properties(arithmetic)
