"""Notes on masses and tensors of a robot's links that are placeholders or do not fit the link's geometry.

The geometry consists of the boxes, balls, meshes and the like that simulators draw (visual) or use for
contacts (collision); here it is a body of uniform density.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from contextlib import suppress
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from pydantic import ValidationError

from rigidcli.bodies.composites import Composite
from rigidcli.bodies.robots import ENTRIES, Body, Link
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.tensor import shortfall
from rigidcli.document.document import Document
from rigidcli.errors import Problem, RigidError, first_few
from rigidcli.fields.environment import Environment

# The least and the greatest density of a link (kg/m^3): that of foam, and that of osmium (22,590).
LIGHTEST, HEAVIEST = 10.0, 23_000.0
SOLID = 500.0, 20_000.0  # the densities (kg/m^3) of solids, from wood to tungsten
# Mistakes by the factor that makes the density of the link that of a solid.
SLIPS = {1e-3: "the mass may be in g, expected kg", 1e9: "the lengths may be in mm: a `scale` of 0.001?"}
# Units in which tensors are often written by mistake, by their number in 1 kg m^2.
UNITS = {1e3: "g m^2", 1e4: "kg cm^2", 1e6: "kg mm^2", 1e7: "g cm^2", 1e9: "g mm^2"}
# A centre of mass is suspicious farther outside the box of the geometry, in units of its diagonal.
FAR_OUTSIDE = 0.25
# Moments may differ from the moments of the uniform form by this factor: hollow links have larger ones.
FACTOR_OF_FORM = 10.0
# A unit or an edit is proposed if it brings the moments within this factor of the form's: less than ten, by
# which the nearest units differ.
FACTOR_OF_CURE = 3.0
# Equal moments within this factor of the form's are no placeholder: balls and cubes have equal moments.
FACTOR_OF_BALLS = 1.2
# Factors of an entry that mend a wrong sign, or a decimal point that is up to three places off.
EDITS = (-1.0, 1e-3, 1e-2, 1e-1, 1e1, 1e2, 1e3)
MOST_OF_LINK = 200  # the most forms of a link that are compared with it, so that no file takes long
# The places in `ENTRIES` of the entries of the matrix of a tensor.
PLACES = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])


class LinkGeometry(NamedTuple):
    """The geometry of a link in one role: its volume (m^3), and the moments (3, m^2) of 1 kg in it.

    `box` holds the lowest and the highest of its coordinates (2 by 3, m), along the axes of the link.
    """

    role: str
    volume: float
    moments: Floats
    box: Floats

    def is_near(self, moments: Floats, factor: float) -> bool:
        """Whether every moment (3, m^2) of 1 kg is within this factor of the form's moment."""
        ratio = moments / self.moments
        return bool((1 / factor <= ratio).all() and (ratio <= factor).all())


@np.errstate(all="ignore")
def remarks(link: Link, document: Document) -> list[Problem]:
    """The suspicions about the mass and the tensor of a link, which is the body of the `document`."""
    properties, size = document.physical.properties, document.arithmetic.size
    assert properties.mass is not None
    tensor = np.array([[size(entry) for entry in row] for row in properties.tensor])
    return [
        Problem(link.source, f"note: {text}", link.line_of(key), f"link {link.name}", hint)
        for key, text, hint in _suspicions(
            size(properties.mass), np.array([size(part) for part in properties.com]), tensor, _forms(link)
        )
    ]


def uncompared(links: Sequence[Link]) -> list[str]:
    """A note that names the links whose geometry cannot be read at all."""
    names = [link.name for link in links if link.geometry and not any(body for _, body in link.geometry)]
    return [f"not compared with their geometry, which is not read here: {first_few(names)}"] if names else []


def _forms(link: Link) -> list[LinkGeometry]:
    """The geometry of a link by role; one with a form that is no body, as an open mesh, is left out."""
    roles, forms = defaultdict[str, list[Body | None]](list), list[LinkGeometry]()
    for role, body in link.geometry if len(link.geometry) <= MOST_OF_LINK else ():
        roles[role].append(body)
    for role, parts in roles.items():
        with suppress(ValidationError, RigidError):
            form = Composite.model_validate({"parts": parts}, context=Environment())
            whole, points = form.properties(FLOAT), np.hstack([leaf.points() for leaf in form.leaves(FLOAT)])
            volume = float(whole.mass or 0)  # of density 1
            box = np.array([points.min(axis=1), points.max(axis=1)])
            forms.append(LinkGeometry(role, volume, _moments(whole.tensor, volume), box))
    return forms


def _suspicions(
    mass: float, com: Floats, tensor: Floats, forms: Sequence[LinkGeometry]
) -> Iterator[tuple[str, str, str | None]]:
    """A key, a reason and a hint for what is odd in a mass (kg), its centre (3, m) and tensor (kg m^2)."""
    moments = _moments(tensor, mass)
    placeholder = _placeholder(mass, tensor, any(form.is_near(moments, FACTOR_OF_BALLS) for form in forms))
    if placeholder:
        yield "inertia", placeholder, None
    if not forms:
        return
    outside = [_outside(com, form.box) for form in forms]
    if min(outside) > FAR_OUTSIDE:
        where, hint = ", ".join(f"{part:.6g}" for part in com), None
        if min(_outside(com / 1e3, form.box) for form in forms) <= 0:
            hint = "the position may be in mm, expected m"
        text = f"the centre of mass ({where}) m is outside its {forms[0].role}"
        yield "position", f"{text}, by {min(outside):.3g} of its diagonal", hint
    form, densities = forms[0], [mass / form.volume for form in forms]
    if not any(LIGHTEST <= density <= HEAVIEST for density in densities):
        text = f"{mass:g} kg in the {form.volume:.3g} m^3 of its {form.role} would be"
        slips = [words for factor, words in SLIPS.items() if SOLID[0] <= factor * densities[0] <= SOLID[1]]
        yield "mass", f"{text} {densities[0]:.3g} kg/m^3", next(iter(slips), None)
    if not placeholder and not any(form.is_near(moments, FACTOR_OF_FORM) for form in forms):
        own, uniform = (", ".join(f"{moment * mass:.3g}" for moment in m) for m in (moments, form.moments))
        text = f"the principal moments are {own}; {mass:g} kg in the form of its {form.role} have"
        units = [unit for factor, unit in UNITS.items() if form.is_near(moments / factor, FACTOR_OF_CURE)]
        hint = f"the tensor may be in {units[0]}, expected kg m^2" if len(units) == 1 else None
        yield "inertia", f"{text} {uniform} kg m^2", hint


def _outside(point: Floats, box: Floats) -> float:
    """How far a point (3, m) is outside a box (2 by 3, m), in units of its diagonal."""
    off = np.maximum(np.maximum(box[0] - point, point - box[1]), 0.0)
    return float(np.linalg.norm(off) / np.linalg.norm(box[1] - box[0]))


def _moments(tensor: Floats, mass: float) -> Floats:
    """The principal moments (3, m^2), ascending, of 1 kg of a body with this tensor and mass."""
    return np.asarray(np.linalg.eigvalsh(tensor) / mass, dtype=np.float64)


def _placeholder(mass: float, tensor: Floats, fits: bool) -> str | None:
    """Why a tensor looks like a placeholder; one that `fits` the geometry is that of a ball or a cube."""
    if not tensor.any():
        return "the tensor is zero: this is a point, which most simulators refuse or change"
    moment = float(tensor[0, 0])
    if fits or np.abs(tensor - moment * np.eye(3)).max() > 1e-9 * abs(moment):  # turned axes leave rounding
        return None
    if moment == 1:
        return "the identity tensor looks like a placeholder"
    if f"{moment:e}".startswith("1.000000e"):
        return f"{moment:g} kg m^2 for each moment looks like a placeholder"
    if mass == 1:
        return f"equal moments ({moment:g} kg m^2) and a mass of 1 kg look like placeholders"
    return None


@np.errstate(all="ignore")
def repair(link: Link) -> str | None:
    """The edit of one place that makes the tensor of a link that of a body; None unless it is the only one.

    An edit changes a sign, moves a decimal point, or exchanges two entries. Where the link has geometry, the
    moments must then be near those of its form.
    """
    body = link.body or {}
    given, mass = body.get("inertia", {}), float(body.get("mass", 0))
    entries = np.array([float(given.get(key, 0)) for key in ENTRIES])
    if shortfall(entries[PLACES]) is None:
        return None
    forms, repairs = _forms(link), []
    for words, edited in _edits(entries):
        tensor = edited[PLACES]
        moments = _moments(tensor, mass)
        is_body = shortfall(tensor) is None and moments[0] > 0
        if is_body and (not forms or any(form.is_near(moments, FACTOR_OF_CURE) for form in forms)):
            repairs.append(words)
    if len(repairs) != 1:
        return None
    return f"a body would have it with {repairs[0]}; no other single slip explains it"


def _edits(entries: Floats) -> Iterator[tuple[str, Floats]]:
    """The edits of the entries (6) of a tensor in words, with the edited entries."""
    for place, factor in product(np.flatnonzero(entries), EDITS):
        edited = entries.copy()
        edited[place] = float(f"{entries[place] * factor:.15g}")  # 0.3 times ten is 3, as in a text
        slip = "the sign" if factor < 0 else "the decimal point"
        yield f"{ENTRIES[place]} = {edited[place]:g} instead of {entries[place]:g} (a slip of {slip})", edited
    for pair in combinations(range(6), 2):
        if entries[pair[0]] != entries[pair[1]]:
            edited = entries.copy()
            edited[list(pair)] = entries[list(pair[::-1])]
            yield f"{ENTRIES[pair[0]]} and {ENTRIES[pair[1]]} exchanged", edited
