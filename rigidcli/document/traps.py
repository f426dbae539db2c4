"""What is written well, and yet probably not meant: notes on a document that is read without a problem."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rigidcli.bodies.bodies import Composite
from rigidcli.bodies.form import Form
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.shape import Solid
from rigidcli.core.arithmetic import Arithmetic

if TYPE_CHECKING:
    from rigidcli.document.document import Document

FAST = 1000.0
"""An angular velocity (rad/s) that a large body is rarely given: 10,000 revolutions a minute."""

LARGE = 1.0
"""A body longer than this (m) is large; it would be torn apart by FAST."""

DENSE = 1e9
"""A mean density (kg/m^3) of a million times that of water, which no matter on earth comes near."""


def traps(document: Document, tree: Mapping[str, Any]) -> Iterator[str]:
    """Notes on the numbers of a document, which was read from `tree`."""
    body, n = document.body, document.arithmetic
    if body is None:
        return
    for path, density in _densities(body, "body", n):
        yield (
            f"`{path}` has {density:.3g} kg/m^3, over a million times the density of water: "
            "is a length, or the mass, in another unit?"
        )
    for section, key in (("motion", "omega"), ("top", "spin")):
        typed = (tree.get(section) or {}).get(key)
        several = typed if isinstance(typed, list) else [typed]
        bare = [abs(float(rate)) for rate in several if not isinstance(rate, str | bool | list | type(None))]
        if max(bare, default=0.0) > FAST and _length(document, n) > LARGE:
            rate = max(bare)
            yield f"`{section}.{key}` has {rate:.6g} rad/s for a body over {LARGE:g} m; {rate:.6g} rpm meant?"


def _densities(body: Form, path: str, n: Arithmetic) -> Iterator[tuple[str, float]]:
    """The solids of a body that are denser than DENSE, with their place and mean density."""
    if isinstance(body, Composite):
        for index, part in enumerate(body.parts):
            yield from _densities(part, f"{path}.parts.{index}", n)
    elif isinstance(body, Solid) or (isinstance(body, Mesh) and not body.shell):
        density = n.value(body.mean_density(n))
        if density is not None and density > DENSE:
            yield path, density


def _length(document: Document, n: Arithmetic) -> float:
    """The length (m) of the rod with the mass and the largest moment of the body; 0 where it is not known."""
    properties = document.physical.properties
    mass = None if properties.mass is None else n.value(properties.mass)
    moments = [n.value(entry) for entry in np.diag(properties.tensor)]
    if not mass or None in moments:
        return 0.0
    return math.sqrt(12 * max(moment or 0.0 for moment in moments) / mass)
