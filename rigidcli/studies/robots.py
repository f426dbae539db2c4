"""Suspicious masses and tensors of a robot's links: placeholders, and what the link's own geometry denies.

The geometry is what a link is drawn with (visual) or collides with: boxes, balls, meshes and the like, taken
as uniform.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from rigidcli.bodies.bodies import Composite, KnownTensor
from rigidcli.bodies.holes import Leaf
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.robots.links import COLUMNS, ENTRIES, ROWS, Link, listed, matrix
from rigidcli.bodies.shape import Region
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.mass_properties import MassProperties, combine
from rigidcli.core.tensor import point_tensor, shift_from_com, shortfall
from rigidcli.document.document import Document
from rigidcli.errors import Problem, RigidError, ValueProblem
from rigidcli.fields.environment import Environment

LIGHTEST, HEAVIEST = 10.0, 23_000.0
"""The densities (kg/m^3) between which a link lies: a hollow one of foam, and one of osmium (22,590)."""

SOLID = 500.0, 20_000.0
"""The densities (kg/m^3) of solids, from wood to tungsten."""

SLIPS = {1e-3: "the mass may be in g, expected kg", 1e9: "the lengths may be in mm: a `scale` of 0.001?"}
"""The mistakes after which a density, multiplied by so much, is that of a solid."""

FACTOR = 10.0
"""How far a moment may be from that of the uniform form: a shell has twice as much, a motor in it less."""

NEAR = 3.0
"""A repair is proposed where the moments are then within this factor of the moments of the form."""

ALIKE = 1.2
"""Moments that agree with the geometry to within this factor are no placeholder, however round."""

EQUAL = 1e-9
"""Moments that differ by less than this, relative to their size, are equal: turned axes round them."""

OUTSIDE = 0.01
"""How far a centre of mass may be outside the box of the geometry, in units of its diagonal: rounding."""

MOST_OF_LINK = 200
"""The most forms of a link that are compared with it, which take a sixth of a second."""

UNITS = {1e3: "g m^2", 1e4: "kg cm^2", 1e6: "kg mm^2", 1e7: "g cm^2", 1e9: "g mm^2"}
"""Units in which tensors are often written by mistake, by how many of them are 1 kg m^2."""

POWERS = (-3, -2, -1, 1, 2, 3)
"""Places by which a decimal point slips: a digit or two, or the step from a unit to the next."""

FARTHEST = 100.0
"""A parallel-axis term of this many times the tensor was not taken from it by mistake."""

PRODUCTS = ROWS != COLUMNS
"""Which of the entries are products of inertia."""


class Remark(NamedTuple):
    """A suspicion, the part of the link that it is about (mass, inertia, position), and a hint."""

    about: str
    text: str
    hint: str | None = None


@dataclass(frozen=True, slots=True, eq=False)
class Weighed:
    """Mass (kg), centre of mass (3, m) and the tensor about it (3 by 3, kg m^2) along the axes of a link.

    `role` is that of the geometry, uniform of 1 kg/m^3, so that the mass is the volume (m^3).
    """

    mass: float
    centre: Floats
    tensor: Floats
    role: str = ""

    @property
    def moments(self) -> Floats:
        """The principal moments (3, kg m^2), ascending, of a body of 1 kg of this form."""
        return np.asarray(np.linalg.eigvalsh(self.tensor), dtype=np.float64) / self.mass

    def is_like(self, form: Weighed, factor: float) -> bool:
        """Whether each principal moment of a body is that of the uniform form to within a factor."""
        ratio = self.moments / form.moments
        return bool((1 / factor <= ratio).all() and (ratio <= factor).all())

    def with_tensor(self, tensor: Floats) -> Weighed:
        """A body of the same mass with another tensor."""
        return Weighed(self.mass, self.centre, tensor)


@np.errstate(all="ignore")
def remarks(link: Link, document: Document) -> list[Problem]:
    """The suspicions about the mass properties of a link, which are those of a body.

    The document is that of the link. Values that nobody has measured come first; a tensor of that kind is
    not compared with the geometry.
    """
    properties, n = document.physical.properties, document.arithmetic
    assert properties.mass is not None
    centre = np.array([n.size(component) for component in properties.com])
    tensor = np.array([[n.size(entry) for entry in row] for row in properties.tensor])
    body = Weighed(n.size(properties.mass), centre, tensor)
    forms, leaves = _forms(link)
    doubt = _placeholder(body, forms)
    found = [*([doubt] if doubt else []), *_misfits(body, forms, only_mass=doubt is not None)]
    if _is_outside(centre, leaves):
        place = ", ".join(f"{component:.6g}" for component in centre)
        found.append(Remark("position", f"the centre of mass ({place}) m is outside the box of its geometry"))
    key = f"link {link.name}"
    return [
        Problem(link.source, f"note: {text}", link.line_of(about), key, hint) for about, text, hint in found
    ]


def uncompared(links: Sequence[Link]) -> list[str]:
    """A note that names the links with geometry none of which is read here."""
    names = [link.name for link in links if link.geometry and not any(part.body for part in link.geometry)]
    return [f"not compared with their geometry, which is not read here: {listed(names)}"] if names else []


# --- the geometry of a link


def _forms(link: Link) -> tuple[list[Weighed], list[Leaf]]:
    """Each role of the geometry as one body, and all shapes and meshes of it.

    A role is left out where one of its forms is no body, such as an open mesh or a box without a width; and
    then there are no shapes and meshes.
    """
    leaves: list[Leaf] = []
    roles: dict[str, list[MassProperties | None]] = {}
    for part in link.geometry if len(link.geometry) <= MOST_OF_LINK else ():
        properties = None
        with suppress(ValidationError, RigidError):
            form = Composite.model_validate({"parts": [part.body]}, context=Environment())
            properties = form.properties(FLOAT)
            leaves += form.leaves(FLOAT)
        roles.setdefault(part.role, []).append(properties)
    forms = []
    for role, found in roles.items():
        known = [properties for properties in found if properties is not None]
        if len(known) == len(found):
            whole = combine(known)
            forms.append(Weighed(float(whole.mass or 0), whole.com, whole.tensor, role))
    return forms, leaves if len(leaves) == len(link.geometry) else []


def _is_outside(point: Floats, leaves: Sequence[Leaf]) -> bool:
    """Whether a point (3, m) is outside the box, along the axes of the link, of all its geometry."""
    corners = [
        np.array(list(product(*leaf.form.bounds()))) @ leaf.rotation.T.astype(float)
        + leaf.displacement.astype(float)
        for leaf in leaves
        if isinstance(leaf.form, Region | Mesh)
    ]
    if len(corners) < max(len(leaves), 1):
        return False
    low, high = np.vstack(corners).min(axis=0), np.vstack(corners).max(axis=0)
    slack = OUTSIDE * np.linalg.norm(high - low)
    return bool(((point < low - slack) | (point > high + slack)).any())


# --- suspicions


def _placeholder(body: Weighed, forms: Sequence[Weighed]) -> Remark | None:
    """The remark on a tensor that looks like a placeholder: zero, or three equal moments that are round.

    Those of a ball or a cube are equal, too: a tensor that agrees with the geometry is none.
    """
    if not body.tensor.any():
        return Remark(
            "inertia", "the tensor is zero: this is a point, which most simulators refuse or change"
        )
    moment = float(body.tensor[0, 0])
    is_round = np.abs(body.tensor - moment * np.eye(3)).max() <= EQUAL * abs(moment)
    if not is_round or any(body.is_like(form, ALIKE) for form in forms):
        return None
    if moment == 1:
        return Remark("inertia", "the identity tensor looks like a placeholder")
    if f"{moment:e}".startswith("1.000000e"):
        return Remark("inertia", f"{moment:g} kg m^2 for each moment looks like a placeholder")
    if body.mass == 1:
        return Remark(
            "inertia", f"equal moments ({moment:g} kg m^2) and a mass of 1 kg look like placeholders"
        )
    return None


def _misfits(body: Weighed, forms: Sequence[Weighed], *, only_mass: bool) -> Iterator[Remark]:
    """Remarks on a density, and unless only the mass is judged on moments, that fit none of the forms."""
    densities = [body.mass / form.mass for form in forms]
    if densities and not any(LIGHTEST <= density <= HEAVIEST for density in densities):
        text = f"{body.mass:g} kg in the {forms[0].mass:.3g} m^3 of its {forms[0].role}"
        hints = [words for factor, words in SLIPS.items() if SOLID[0] <= factor * densities[0] <= SOLID[1]]
        yield Remark("mass", f"{text} would be {densities[0]:.3g} kg/m^3", next(iter(hints), None))
    if forms and not only_mass and not any(body.is_like(form, FACTOR) for form in forms):
        form = forms[0]
        own, uniform = (", ".join(f"{moment:.3g}" for moment in body.mass * m.moments) for m in (body, form))
        text = f"the principal moments are {own}; {body.mass:g} kg in the form of its {form.role} have"
        yield Remark("inertia", f"{text} {uniform} kg m^2", _cure(body, form))


def _cure(body: Weighed, form: Weighed) -> str | None:
    """The one change that would bring the moments near to the moments of the form, if there is one."""
    central = shift_from_com(body.tensor, -body.mass, body.centre)
    hints = [
        f"the tensor may be in {unit}, expected kg m^2"
        for factor, unit in UNITS.items()
        if body.with_tensor(body.tensor / factor).is_like(form, NEAR)
    ]
    if shortfall(central) is None and body.with_tensor(central).is_like(form, NEAR):
        hints.append("the tensor may be about the origin of the link, expected one about the centre of mass")
    return hints[0] if len(hints) == 1 else None


# --- the edit that mends a tensor


@np.errstate(all="ignore")
def repair(link: Link) -> str | None:
    """The one edit that makes the tensor of a link one that a body may have; None unless exactly one does.

    An edit moves a decimal point, changes a sign or all signs of the products, exchanges two entries, or
    undoes the parallel-axis theorem. It must lead near to the form of the link, where that is known.
    """
    given = None if link.body is None else link.body.get("inertia")
    if link.body is None or given is None:
        return None
    entries = np.array([float(given.get(key, 0)) for key in ENTRIES])
    mass = float(link.body["mass"])
    if mass <= 0 or shortfall(matrix(entries)) is None:
        return None
    forms, _ = _forms(link)
    edits = []
    for words, edited in _edits(entries, mass, _origin(link)):
        body = Weighed(mass, np.zeros(3), matrix(edited))
        if shortfall(body.tensor) is None and body.moments[0] > 0:
            edits += [words] if not forms or any(body.is_like(form, NEAR) for form in forms) else []
    return f"{edits[0]} makes it one that a body has; no other single edit does" if len(edits) == 1 else None


def _edits(entries: Floats, mass: float, origin: Floats) -> Iterator[tuple[str, Floats]]:
    """Each edit in words, and the entries (6) that it leaves."""
    for place, factor in product(np.flatnonzero(entries), (-1.0, *(10.0**power for power in POWERS))):
        edited = entries.copy()
        edited[place] = float(f"{entries[place] * factor:.15g}")
        slip = "sign" if factor < 0 else "decimal point"
        words = f"{ENTRIES[place]} = {edited[place]:g} instead of {entries[place]:g}"
        yield f"{words} (a slip of the {slip})", edited
    for one, other in combinations(range(6), 2):
        if entries[one] != entries[other]:
            edited = entries.copy()
            edited[[one, other]] = edited[[other, one]]
            yield f"{ENTRIES[one]} and {ENTRIES[other]} exchanged", edited
    if np.count_nonzero(entries[PRODUCTS]) > 1:
        yield "the other sign for all products of inertia", np.where(PRODUCTS, -entries, entries)
    shift = (mass * point_tensor(origin))[ROWS, COLUMNS]
    if origin.any() and np.abs(shift).max() <= FARTHEST * np.abs(entries).max():
        yield "the parallel-axis term added once (about the wrong point)", entries + shift


def _origin(link: Link) -> Floats:
    """The origin of the link from its centre of mass, along the axes of the tensor (3, m); else zero."""
    body = {**(link.body or {}), "mass": 1, "inertia": {"Ixx": 1, "Iyy": 1, "Izz": 1}}
    try:
        turn, shift = KnownTensor.model_validate(body).motion(FLOAT)
    except (ValidationError, ValueProblem):
        return np.zeros(3)
    origin: Floats = -turn.T.astype(float) @ shift.astype(float)
    return origin
