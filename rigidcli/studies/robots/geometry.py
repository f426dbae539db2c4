"""A link's mass properties beside the forms in which it is drawn, or collides: boxes, balls and the like."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.tensor import shift_to_com, shortfall
from rigidcli.errors import DocumentError
from rigidcli.model.bodies import Composite
from rigidcli.model.load import Places, from_tree
from rigidcli.model.robots.links import Body, Link
from rigidcli.model.shape import Shape
from rigidcli.studies.pictures.surfaces import surface

LIGHTEST, HEAVIEST = 10.0, 23_000.0
"""The densities (kg/m^3) between which a link lies: a hollow one of foam, and one of osmium (22,590)."""

FACTOR = 10.0
"""How far a moment may be from that of the uniform form: a shell has twice as much, a motor in it less."""

NEAR = 3.0
"""A repair is proposed where the moments are then within this factor of those of the form."""

OUTSIDE = 0.02
"""How far a centre of mass may be outside the hull, in units of its size: circles are drawn as polygons."""

MOST_FORMS = 200
"""The most forms of a link that are compared with it, which takes a tenth of a second."""

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


def solids(link: Link) -> list[Solid]:
    """What is drawn and what collides, each as one solid; without a role of which a form is not known."""
    found = []
    for role, bodies in _forms(link).items():
        composite = _composite(bodies)
        if composite is not None:
            whole = composite.properties(FLOAT)
            found.append(Solid(float(whole.mass or 0), np.asarray(whole.com), np.asarray(whole.tensor), role))
    return found


def _forms(link: Link) -> dict[str, list[Body | None]]:
    """The geometry by its roles."""
    forms: dict[str, list[Body | None]] = {}
    for part in link.geometry:
        forms.setdefault(part.role, []).append(part.body)
    return forms


def _composite(bodies: Sequence[Body | None]) -> Composite | None:
    """The forms as one body; None where one of them is not known, or no body."""
    known = [body for body in bodies if body is not None]
    if not 0 < len(known) == len(bodies) <= MOST_FORMS:
        return None
    try:
        document = from_tree(lambda decimal: {"body": {"parts": known}}, Places("", "geometry"))
    except DocumentError:
        return None
    assert isinstance(document.body, Composite)
    return document.body


def moments_agree(body: Weighed, form: Solid, factor: float) -> bool:
    """Whether each principal moment of a body is that of the uniform form to within a factor."""
    ratio = body.moments / form.moments
    return bool((1 / factor <= ratio).all() and (ratio <= factor).all())


def misfits(body: Weighed, forms: Sequence[Solid], *, only_mass: bool) -> Iterator[Remark]:
    """What does not fit any of the forms: the density, and unless only the mass is judged, the moments."""
    densities = [body.mass / form.mass for form in forms]
    if densities and not any(LIGHTEST <= density <= HEAVIEST for density in densities):
        text = f"{body.mass:g} kg in the {forms[0].mass:.3g} m^3 of its {forms[0].role}"
        hint = "is it in grams?" if LIGHTEST <= densities[0] / 1000 <= HEAVIEST else None
        yield Remark("mass", f"{text} would be {densities[0]:.3g} kg/m^3", hint)
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


def contains(link: Link, point: Floats) -> bool | None:
    """Whether a point (3, m) is in the convex hull of all geometry; None where some of that is not known."""
    composite = _composite([part.body for part in link.geometry])
    if composite is None:
        return None
    corners = []
    for leaf in composite.leaves(FLOAT):
        assert isinstance(leaf.form, Shape)
        corners.append(np.vstack(surface(leaf.form)) @ leaf.rotation.T + leaf.displacement)
    places = np.vstack(corners).astype(float)
    from scipy.spatial import ConvexHull, QhullError

    try:
        planes = ConvexHull(places).equations
    except QhullError:
        return None
    size = float(np.ptp(places, axis=0).max())
    return bool((planes[:, :3] @ point + planes[:, 3]).max() <= OUTSIDE * size)
