"""Given tensors, links of robots and composites as forms of body.

A hole outside its body, larger than it, overlapping another, or denser than what it is cut from, can
leave a total mass and tensor that look harmless; at some point in the hole the material then falls
below zero. So the density left at points of every hole must not be negative. The points are those of a net:
of a round hole, one per cent of its radius may escape it.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from functools import cache, cached_property
from itertools import combinations
from typing import Annotated, Any, ClassVar, Literal, Self, TypeAlias, cast

import numpy as np
from pydantic import BeforeValidator, Field, PrivateAttr, ValidationError, ValidationInfo, model_validator

from rigidcli.bodies.bodies import Body
from rigidcli.bodies.density import at_points, place_text
from rigidcli.bodies.form import Form
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.shapes import NET_DRAWN_IN, Lamina, NoValueError, Region, Shape, floats
from rigidcli.core import mass_properties, tensor
from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array, Floats, Mask, Scalar, half_unit
from rigidcli.errors import Path, ValueProblem, at, with_article
from rigidcli.fields.environment import BoundExpression, Environment
from rigidcli.fields.quantities import AsList, Mass, MomentOfInertia, Point, PrincipalMoment, Vector3
from rigidcli.fields.section import Alternative, FileName, Section, environment, reference

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
    Ixy: MomentOfInertia = Field(default=0, validate_default=True, description="-sum m x y (kg m^2)")
    Ixz: MomentOfInertia = Field(default=0, validate_default=True, description="-sum m x z (kg m^2)")
    Iyz: MomentOfInertia = Field(default=0, validate_default=True, description="-sum m y z (kg m^2)")


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
TensorRows: TypeAlias = tuple[TensorRow, TensorRow, TensorRow]
_ENTRIES = Alternative(dict, _rows, Annotated[TensorRows, AsList], reference(TensorEntries))


class KnownTensor(Form):
    """A body with a given inertia tensor, or with given moments along the form's own x, y and z.

    Without a mass the tensor cannot be shifted: it is good for the point that it is given about.
    """

    ONE_OF: ClassVar = ("inertia", "moments")

    inertia: Annotated[TensorRows, _ENTRIES, BeforeValidator(_three_by_three)] | None = Field(
        default=None, description="The tensor by its rows, or by Ixx, Iyy, Izz, Ixy, Ixz, Iyz"
    )
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
        is_shifted = any(n.sign(component) != 0 for component in offset)
        less = ", less M d^2 and so about the centre of mass" if is_shifted else ""
        note = _require_physical(central, n, halves, less) or self._size_meant(central, n)
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


def _require_physical(
    central: Any, n: Arithmetic, halves: Floats | float = 0.0, less: str = ""
) -> str | None:
    """`tensor.require_physical` for a tensor without open symbols; of others nothing can be said."""
    values = [n.value(entry) for entry in central.flat]
    if None in values:
        return None
    return tensor.require_physical(np.array(values, dtype=np.float64).reshape(3, 3), halves, less)


def weighed(body: Mapping[str, Any]) -> mass_properties.MassProperties | None:
    """The mass properties that a mass and a tensor give, in floats; None where no body has them."""
    with suppress(ValidationError, ValueProblem):
        return KnownTensor.model_validate(body, context=Environment()).properties(FLOAT)
    return None


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


# --- parts and holes

# The most shapes of a composite that are compared with each other, which takes a tenth of a second.
MOST_COMPARED = 100
# How much denser than its body a hole may be, in units of its own density: given masses are rounded.
DENSER_THAN_BODY = 0.01


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
        for hole, density in zip(holes_of, densities_around(holes_of, leaves, n), strict=True):
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
                yield from counted_twice(list(self.leaves(n)), n)

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
            require_material(list(self.leaves(arithmetic)), arithmetic)
            assert whole.mass is not None
            if arithmetic.sign(whole.mass) in (0, -1):
                left = arithmetic.value(whole.mass)
                amount = "" if left is None else f" ({left:.6g} kg)"
                raise ValueProblem(
                    f"the holes leave no mass{amount}: they reach outside the body, or are denser than it is"
                )
            _require_physical(whole.tensor, arithmetic)
        return whole

    @property
    def rounding(self) -> float | None:
        """The largest of molecules taken as one (m); None unless all parts are molecules."""
        molecules = [part.rounding for part in self.parts if part.rounding is not None and not part.hole]
        return max(molecules) if len(molecules) == len(self.parts) else None

    def leaves(self, arithmetic: Arithmetic) -> Iterator[Leaf]:
        """All shapes in the composite, at any depth, with sign and place."""
        for index, part in enumerate(self.parts):
            place = part.motion(arithmetic)
            inner = part.leaves(arithmetic) if isinstance(part, Composite) else [Leaf(part)]
            for leaf in inner:
                yield leaf.within(place, -1 if part.hole else 1, ("parts", index))


@dataclass(frozen=True, eq=False)
class Leaf:
    """A form that is no composite, in a composite: +1 or -1 for a hole, its place, and the way to it."""

    form: Form
    sign: int = 1
    rotation: Array = field(default_factory=lambda: np.eye(3, dtype=int))
    displacement: Array = field(default_factory=lambda: np.zeros(3, dtype=int))
    path: Path = ()

    def within(self, place: tuple[Array, Array], sign: int, path: Path) -> Leaf:
        """The leaf seen from the composite in which its own is placed."""
        turn, shift = place
        moved = turn @ self.displacement + shift
        return Leaf(self.form, self.sign * sign, turn @ self.rotation, moved, (*path, *self.path))

    @property
    def name(self) -> str:
        """The way to it, as it is typed."""
        return ".".join(map(str, self.path))

    def fills_space(self) -> bool:
        """Whether the form has an inside, and can give points of it."""
        return isinstance(self.form, Region | Mesh)

    def is_like(self, other: Leaf) -> bool:
        """Whether both are solid, or both flat: their densities have one unit."""
        return self.fills_space() and isinstance(self.form, Lamina) == isinstance(other.form, Lamina)

    @property
    def region(self) -> Region | Mesh:
        """The form, which fills space."""
        return cast("Region | Mesh", self.form)

    def density(self, n: Arithmetic) -> Any:
        """The density: a number, or a formula where it varies."""
        form = self.region
        return form.density if isinstance(form.density, BoundExpression) else form.mean_density(n)

    def in_floats(self, n: Arithmetic) -> Leaf | None:
        """The leaf with floats for all of its numbers; None when one of them has no value."""
        form = self.form
        try:
            turn, shift = (np.array(floats(part.tolist(), n)) for part in (self.rotation, self.displacement))
            if isinstance(form, Region):
                form = form.model_copy(update=floats(form.__dict__, n))
        except NoValueError:
            return None
        return Leaf(form, self.sign, turn, shift, self.path)

    # What follows is for a leaf in floats, which fills space. Points are arrays (3 by k, m).

    @cached_property
    def ball(self) -> tuple[Floats, float]:
        """The middle (3, m) and the radius (m) of a ball that holds the leaf."""
        middle, radius = self.region.extent()
        return self.rotation @ middle + self.displacement, radius

    def points(self) -> Floats:
        """Points of the leaf."""
        return np.asarray(self.rotation @ self.region.net() + self.displacement[:, None])

    def shared_with(self, other: Leaf) -> Floats:
        """Points all over the box, along its own axes, in which another leaf like it may overlap it."""
        nets = [self.rotation.T @ (leaf.points() - self.displacement[:, None]) for leaf in (self, other)]
        low = np.max([net.min(axis=1) for net in nets], axis=0)
        high = np.min([net.max(axis=1) for net in nets], axis=0)
        narrowest = 1 if isinstance(self.form, Lamina) else 0  # but for the thickness of a flat one
        if np.sort(high - low)[narrowest] <= self.region.MARGIN * self.ball[1]:
            return np.empty((3, 0))  # they touch, or cross in a line
        # The sequence R3 of M. Roberts (2018).
        steps = np.outer([0.8191725133961645, 0.6710436067037893, 0.5497004779019703], np.arange(1, 1000)) % 1
        spots = low[:, None] + (high - low)[:, None] * steps
        return np.asarray(self.rotation @ spots + self.displacement[:, None])

    def density_at(self, points: Floats, inside: Mask) -> Floats:
        """The density at the points that are inside, and zero at the others."""
        density = self.density(FLOAT)
        if not isinstance(density, BoundExpression):
            return np.where(inside, density, 0.0)
        local = self.rotation.T @ (points - self.displacement[:, None])
        return np.where(inside, at_points(density, np.where(inside, local, np.nan)), 0.0)

    def contains(self, points: Floats, step: Sequence[float] = (0, 0, 0)) -> Mask:
        """Which of the points, moved by a `step` along its own axes, it fills."""
        local = self.rotation.T @ (points - self.displacement[:, None]) + np.reshape(step, (3, 1))
        return self.region.contains(*local)

    def reaches(self, points: Floats, hole: Leaf) -> Mask:
        """Which of the points of a hole lie inside, to within a rounding margin at shared faces."""
        size, near = 2 * max(hole.ball[1], self.ball[1]) * self.region.MARGIN, self.contains(points)
        for direction in (*np.eye(3), *-np.eye(3)):
            if (far := np.flatnonzero(~near)).size:
                near[far] = self.contains(points[:, far], size * direction)
        return near


def counted_twice(leaves: Sequence[Leaf], n: Arithmetic) -> Iterator[str]:
    """Notes on shapes of different parts that overlap.

    Nothing is said of shapes that depend on symbols without a value, and of very many parts.
    """
    regions = [leaf for leaf in leaves if isinstance(leaf.form, Region)]
    if len(regions) > MOST_COMPARED:
        return
    placed = [region for leaf in regions if leaf.sign > 0 and (region := leaf.in_floats(n)) is not None]
    for one, two in combinations(placed, 2):
        distance = np.linalg.norm(one.ball[0] - two.ball[0])
        if one.path[:2] == two.path[:2] or not one.is_like(two) or distance > one.ball[1] + two.ball[1]:
            continue
        points = np.hstack([one.points(), two.points(), one.shared_with(two), two.shared_with(one)])
        if (one.contains(points) & two.contains(points)).any():
            yield f"{one.name} and {two.name} overlap: what both fill counts twice"


def densities_around(bare: Sequence[Leaf], leaves: Sequence[Leaf], n: Arithmetic) -> list[Scalar]:
    """The density of each `bare` hole: that of all parts if they agree, else of the part in which it lies.

    Raises ValueProblem where there is no such part, or its density varies.
    """
    parts = [leaf for leaf in leaves if leaf.sign > 0 and leaf.fills_space()]
    densities, found = [leaf.density(n) for leaf in parts], []
    placed = cache(lambda k: parts[k].in_floats(n))
    for hole in bare:
        _require_kind(hole, parts)
        alike = [k for k, leaf in enumerate(parts) if leaf.is_like(hole)]
        if not _are_alike([densities[k] for k in alike], n):
            inner, places = hole.in_floats(n), [placed(k) for k in alike]
            if inner is None or None in places:
                alike = []  # where symbols without a value place them, nothing is sure to lie in anything
            else:
                points = inner.points()
                holds = [place is not None and place.reaches(points, inner).all() for place in places]
                alike = [k for k, is_round in zip(alike, holds, strict=True) if is_round]
        if not _are_alike([densities[k] for k in alike], n):
            message = "missing: the hole does not lie in one part, of one density"
            if len(alike) > 1:
                names = " and ".join(parts[k].name for k in alike)
                message = f"missing: the hole lies in {names}, which do not have one density"
            raise ValueProblem(message, path=(*hole.path, "density"))
        found.append(densities[alike[0]])
    return found


def _require_kind(hole: Leaf, parts: Sequence[Leaf]) -> None:
    """Raise ValueProblem for a flat hole where all parts are solid, or a solid one where all are flat."""
    if parts and not any(part.is_like(hole) for part in parts):
        message = "a solid hole takes away a volume, and the body is flat"
        hint = "give a flat hole, such as a disk"
        if isinstance(hole.form, Lamina):
            message = f"{with_article(hole.form.word())} has no volume to take away from a solid"
            hint = "give a solid hole, such as a cylinder"
        raise ValueProblem(message, path=hole.path, hint=hint)


def _are_alike(densities: Sequence[Any], n: Arithmetic) -> bool:
    is_known = densities and not any(isinstance(density, BoundExpression) for density in densities)
    return bool(is_known) and all(n.sign(n.tidied(density - densities[0])) == 0 for density in densities)


def require_material(leaves: Sequence[Leaf], n: Arithmetic) -> None:
    """Raise ValueProblem where a hole takes away what is not there.

    Holes stay untested where dimensions depend on symbols without a value, and in bodies with a known tensor,
    which have no given shape.
    """
    for leaf in leaves:
        if leaf.sign < 0 and not leaf.fills_space():
            raise ValueProblem("no hole can be of this form, expected a solid or flat shape", path=leaf.path)
        if leaf.sign < 0:
            _require_kind(leaf, [other for other in leaves if other.sign > 0 and other.fills_space()])
    regions = [leaf.in_floats(n) for leaf in leaves if leaf.fills_space()]
    placed = [region for region in regions if region is not None]
    material = [leaf.form for leaf in leaves if leaf.sign > 0]
    is_known = all(isinstance(form, Shape | Mesh) or hasattr(form, "points") for form in material)
    if len(placed) < len(regions) or not is_known:
        return
    middles, radii = (np.array(parts) for parts in zip(*(region.ball for region in placed), strict=True))
    for hole in placed:
        if hole.sign < 0:
            middle, radius = hole.ball
            reach = (radii + radius) * (1 + 8 * NET_DRAWN_IN)
            near = np.flatnonzero(np.linalg.norm(middles - middle, axis=1) <= reach)
            _require_material_in(hole, [placed[k] for k in near if placed[k].is_like(hole)])


def _require_material_in(hole: Leaf, others: Sequence[Leaf]) -> None:
    points = hole.points()
    if not points.size:
        raise ValueProblem(f"the hole is thinner than {Mesh.MARGIN:g} of its size", path=hole.path)
    own = hole.density_at(points, np.ones(points.shape[1], dtype=bool))
    there, taken = np.zeros_like(own), own
    for other in others:
        if other.sign > 0:
            there = there + other.density_at(points, other.reaches(points, hole))
        elif other is not hole:
            taken = taken + other.density_at(points, other.contains(points))
    worst = int(np.argmax(taken - there - DENSER_THAN_BODY * own))
    if taken[worst] - there[worst] > DENSER_THAN_BODY * own[worst]:
        amounts = f"{taken[worst]:.6g} from {there[worst]:.6g} {hole.region.UNIT}"
        what = f"more is taken away than is there ({amounts})"
        where = place_text(points[:, worst], hole.ball[1])
        reason = what if there[worst] else "the hole reaches outside the body"
        raise ValueProblem(f"{reason}: at {where} m", path=hole.path)
