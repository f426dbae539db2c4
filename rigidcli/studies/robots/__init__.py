"""What is suspicious in the mass and inertia of a robot's link: placeholders, and what its form denies."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from rigidcli.bodies.robots.links import Link, listed
from rigidcli.document.document import Document
from rigidcli.errors import Problem
from rigidcli.studies.robots.geometry import Remark, Weighed, forms_of, misfits
from rigidcli.studies.robots.placeholders import placeholder


@np.errstate(all="ignore")
def remarks(link: Link, document: Document) -> list[Problem]:
    """What is suspicious in the mass properties of a link, which are those of a body.

    The document is that of the link. Values that nobody has measured are told first; a tensor of that kind is
    not compared with the geometry.
    """
    return [
        Problem(
            link.source, f"note: {remark.text}", link.line_of(remark.about), f"link {link.name}", remark.hint
        )
        for remark in _remarks(link, document)
    ]


def uncompared(links: Sequence[Link]) -> list[str]:
    """A note that names the links that have a form, of which nothing is known."""
    names = [link.name for link in links if link.geometry and not any(part.body for part in link.geometry)]
    return [f"not compared with their geometry, which is not read here: {listed(names)}"] if names else []


def _remarks(link: Link, document: Document) -> Iterator[Remark]:
    properties, n = document.physical.properties, document.arithmetic
    assert properties.mass is not None
    centre = np.array([n.size(component) for component in properties.com])
    tensor = np.array([[n.size(entry) for entry in row] for row in properties.tensor])
    link_body = Weighed(n.size(properties.mass), centre, tensor)
    forms = forms_of(link)
    known = placeholder(link_body, forms.solids)
    if known is not None:
        yield known
    yield from misfits(link_body, forms.solids, only_mass=known is not None)
    if not forms.contain(centre):
        place = ", ".join(f"{component:.6g}" for component in centre)
        text = f"the centre of mass ({place}) m is outside the hull of its geometry"
        yield Remark("position", text)
