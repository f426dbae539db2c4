"""A link's mass properties beside the forms in which it is drawn, or collides: boxes, balls and the like."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import product
from typing import Any, NamedTuple

import numpy as np
from pydantic import ValidationError

from rigidcli.bodies.bodies import Composite
from rigidcli.bodies.holes import Leaf
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.robots.links import Body, Link
from rigidcli.bodies.shape import Shape
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.mass_properties import MassProperties, combine
from rigidcli.core.tensor import shift_to_com, shortfall
from rigidcli.errors import RigidError
from rigidcli.fields.environment import Environment

LIGHTEST, HEAVIEST = 10.0, 23_000.0
"""The densities (kg/m^3) between which a link lies: a hollow one of foam, and one of osmium (22,590)."""

SOLID = 500.0, 20_000.0
"""The densities (kg/m^3) of solids, from wood to tungsten."""

SLIPS = {1e-3: "the mass may be in g, expected kg", 1e9: "the lengths may be in mm: a `scale` of 0.001?"}
"""What may be wrong where a density is that of a solid after it is multiplied by so much."""

FACTOR = 10.0
"""How far a moment may be from that of the uniform form: a shell has twice as much, a motor in it less."""

NEAR = 3.0
"""A repair is proposed where the moments are then within this factor of those of the form."""

OUTSIDE = 0.02
"""How far a centre of mass may be outside the hull, in units of its size: both are rounded."""

MOST_OF_LINK = 200
"""The most forms of a link that are compared with it, which take a sixth of a second."""

UNITS = {1e3: "g m^2", 1e4: "kg cm^2", 1e6: "kg mm^2", 1e7: "g cm^2", 1e9: "g mm^2"}
"""Units in which tensors are often written by mistake, by how many of them are 1 kg m^2."""


class Remark(NamedTuple):
    """What is suspicious, what of the link it is about (mass, inertia, position), and what may help."""

    about: str
    text: str
    hint: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """Mass (kg), centre of mass (3, m) and the tensor about it (3 by 3, kg m^2) along the axes of a link."""

    mass: float
    centre: Floats
    tensor: Floats

    @property
    def moments(self) -> Floats:
        """The principal moments (3, kg m^2), ascending, of a body of 1 kg of this form."""
        return np.asarray(np.linalg.eigvalsh(self.tensor), dtype=np.float64) / self.mass


@dataclass(frozen=True, slots=True, eq=False)
class Solid(Weighed):
    """The forms of one role, uniform, of 1 kg/m^3, so that the mass is the volume (m^3)."""

    role: str


@dataclass(frozen=True, slots=True, eq=False)
class Forms:
    """The geometry of a link: each role as one solid, if all that has the role is of known form.

    `leaves` are all its shapes and meshes, none where one form is not known.
    """

    solids: Sequence[Solid]
    leaves: Sequence[Leaf] = ()

    def contain(self, point: Floats) -> bool:
        """Whether a point (3, m) is in the convex hull; also where the hull is not known.

        It is outside where it lies farther along some direction than every form reaches. The directions that
        are tried are the axes of each form, those from its centre, and those of them across its z.
        """
        if not self.leaves:
            return True
        places = [(leaf.rotation.astype(float), leaf.displacement.astype(float)) for leaf in self.leaves]
        middle = np.mean([shift for _, shift in places], axis=0)
        tried = [point - middle]
        for turn, shift in places:
            away = point - shift
            tried += [*turn.T, *-turn.T, away, away - turn[:, 2] * (turn[:, 2] @ away)]
        directions = np.array([each / length for each in tried if (length := np.linalg.norm(each))])
        reach = np.max(
            [
                directions @ (shift - middle) + _reach(leaf.form, directions @ turn)
                for leaf, (turn, shift) in zip(self.leaves, places, strict=True)
            ],
            axis=0,
        )
        return bool((directions @ (point - middle) - reach).max() <= OUTSIDE * reach.max())


REACH: dict[str, Callable[[Any, Floats], Floats]] = {
    "box": lambda s, u: np.abs(u) @ np.array(s.size) / 2,
    "sphere": lambda s, u: np.full(len(u), s.radius),
    "ellipsoid": lambda s, u: np.linalg.norm(u * np.array(s.semi_axes), axis=1),
    "cylinder": lambda s, u: s.radius * np.hypot(u[:, 0], u[:, 1]) + s.height / 2 * np.abs(u[:, 2]),
    "capsule": lambda s, u: s.radius + s.height / 2 * np.abs(u[:, 2]),
}
"""How far (n, m) each shape of links reaches from its centre, along directions (n, 3) in its own axes."""


def _reach(form: Any, directions: Floats) -> Floats:
    """How far (n, m) a form reaches along directions (n, 3) in its own axes; a mesh as far as its box."""
    if isinstance(form, Shape):
        return REACH[form.shape](form, directions)
    reach: Floats = (directions @ np.array(list(product(*form.bounds()))).T).max(axis=1)
    return reach


def forms_of(link: Link) -> Forms:
    """The geometry of a link, as far as it is a body: not an open mesh, nor a box without a width."""
    if len(link.geometry) > MOST_OF_LINK:
        return Forms(())
    leaves: list[Leaf] = []
    roles: dict[str, list[MassProperties | None]] = {}
    for part in link.geometry:
        form, properties = _form(part.body)
        roles.setdefault(part.role, []).append(properties)
        leaves += form.leaves(FLOAT) if form is not None else ()
    solids = []
    for role, found in roles.items():
        known = [properties for properties in found if properties is not None]
        if len(known) == len(found):
            whole = combine(known)
            solids.append(Solid(float(whole.mass or 0), whole.com, whole.tensor, role))
    is_whole = len(leaves) == len(link.geometry) and all(
        isinstance(leaf.form, Shape | Mesh) for leaf in leaves
    )
    return Forms(solids, leaves if is_whole else ())


def _form(body: Body | None) -> tuple[Composite | None, MassProperties | None]:
    """A form with its mass properties at a density of 1; neither of what is no body."""
    if body is not None:
        with suppress(ValidationError, RigidError):
            form = Composite.model_validate({"parts": [body]}, context=Environment())
            return form, form.properties(FLOAT)
    return None, None


def moments_agree(body: Weighed, form: Solid, factor: float) -> bool:
    """Whether each principal moment of a body is that of the uniform form to within a factor."""
    ratio = body.moments / form.moments
    return bool((1 / factor <= ratio).all() and (ratio <= factor).all())


def misfits(body: Weighed, forms: Sequence[Solid], *, only_mass: bool) -> Iterator[Remark]:
    """What does not fit any of the forms: the density, and unless only the mass is judged, the moments."""
    densities = [body.mass / form.mass for form in forms]
    if densities and not any(LIGHTEST <= density <= HEAVIEST for density in densities):
        text = f"{body.mass:g} kg in the {forms[0].mass:.3g} m^3 of its {forms[0].role}"
        hints = [words for factor, words in SLIPS.items() if SOLID[0] <= factor * densities[0] <= SOLID[1]]
        yield Remark("mass", f"{text} would be {densities[0]:.3g} kg/m^3", next(iter(hints), None))
    if forms and not only_mass and not any(moments_agree(body, form, FACTOR) for form in forms):
        form = forms[0]
        own, uniform = (", ".join(f"{moment:.3g}" for moment in body.mass * m.moments) for m in (body, form))
        text = (
            f"the principal moments are {own}; {body.mass:g} kg in the form of its {form.role} have {uniform}"
        )
        yield Remark("inertia", f"{text} kg m^2", _cure(body, form))


def _cure(body: Weighed, form: Solid) -> str | None:
    """What would bring the moments near to those of the form, if one thing does."""
    hints = []
    central = shift_to_com(body.tensor, body.mass, body.centre)
    if shortfall(central) is None and moments_agree(Weighed(body.mass, body.centre, central), form, NEAR):
        hints.append("the tensor may be about the origin of the link, expected one about the centre of mass")
    for factor, unit in UNITS.items():
        if moments_agree(Weighed(body.mass, body.centre, body.tensor / factor), form, NEAR):
            hints.append(f"the tensor may be in {unit}, expected kg m^2")
    return hints[0] if len(hints) == 1 else None
