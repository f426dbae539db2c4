"""The picture of a body: its surface, its principal axes about O, and its ellipsoid of inertia."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigidcli.bodies.bodies import Composite
from rigidcli.bodies.holes import Leaf
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.point_masses import PointMasses
from rigidcli.bodies.shape import Shape, Wire
from rigidcli.core import poinsot
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.document.document import Document
from rigidcli.picture import Mark, Panel, Picture, Ruler
from rigidcli.studies.body import body_frame
from rigidcli.studies.common import require_values
from rigidcli.studies.pictures.closed import ellipsoid

MOST_POINTS = 2_000
"""The most point masses that are drawn; of more, evenly chosen ones."""

MOST_FACES = 4_000
"""The most triangles of a mesh that are drawn as they are; more make a file that no viewer likes."""

CELLS = 24
"""Into so many cells along its longest side a larger mesh is cut to be drawn: some thousand faces."""

SAME = 9
"""Digits, in units of the size of the body, in which the corners of two faces agree that are one."""

REACH = 1.25
"""Length of the principal axes, in units of the distance from O to the farthest point of the body."""

SHARE = 0.9
"""The largest semi-axis of the ellipsoid of inertia, in the same unit: its scale in the picture."""

ELLIPSOID_UNIT = "1/√(kg m^2)"
"""What an ellipsoid of inertia x.I.x = 1 measures, where there is no body to be drawn beside it."""


def body(document: Document) -> Picture:
    """The body along the axes of the results. Raises DocumentError where a parameter has no value."""
    require_values(document, "a picture")
    frame, physical = body_frame(document), document.physical
    forms = [replace(mark, points=_moved(mark.points, physical.axes)) for mark in marks_of_body(document)]
    known = physical.properties.mass is not None
    centre = physical.axes.T @ physical.point if forms else np.zeros(3)
    ends = [np.abs(np.linalg.norm(np.vstack(list(mark.points)) - centre, axis=1)).max() for mark in forms]
    semi = poinsot.semi_axes(frame.moments, 1.0)
    size = float(max(ends, default=0.0)) or (1.0 if semi is None or forms else float(semi.max()))
    marks = list(forms)
    if semi is not None:
        scale, label = (
            (size * SHARE / semi.max(), "ellipsoid of inertia (scaled)")
            if forms
            else (1, "ellipsoid of inertia")
        )
        marks += ellipsoid(semi * scale, label, frame.axes, centre)
    for k, (axis, moment) in enumerate(zip(frame.axes, frame.moments, strict=True), start=1):
        ends_of_arrow = np.array([centre, centre + REACH * size * axis])
        number = f"{moment:.4g}"
        symbol = rf"\mathbf{{e}}_{k}:\ \lambda_{k} = {_power(number)}\ \mathrm{{kg\,m^2}}"
        marks.append(Mark("arrow", ends_of_arrow, f"e{k}: lambda{k} = {number} kg m^2", symbol, style=k))
    marks.append(Mark("dots", centre[None], "O", "O", style=0))
    if forms and known:
        com = physical.axes.T @ physical.properties.com
        if np.linalg.norm(com - centre) > 1e-9 * size:
            marks.append(Mark("dots", com[None], "centre of mass", style=4))
    unit = "m" if forms else ELLIPSOID_UNIT
    rulers = tuple(Ruler(name, name, unit) for name in "xyz")
    title = f"{'body, ' if forms else ''}principal axes and ellipsoid of inertia"
    return Picture("body", title, (Panel(rulers, tuple(marks), is_even=True),))


def _power(number: str) -> str:
    """A number such as 1e-47 in LaTeX."""
    mantissa, _, exponent = number.partition("e")
    return rf"{mantissa}\times 10^{{{int(exponent)}}}" if exponent else number


def _moved(places: Floats | list[Floats], axes: Floats) -> Floats | list[Floats]:
    """Points (n, 3), or a list of such, along the columns of `axes`."""
    return [face @ axes for face in places] if isinstance(places, list) else places @ axes


def marks_of_body(document: Document) -> Iterator[Mark]:
    """The parts of the body whose places are known, along the document's axes."""
    form = document.body
    assert form is not None
    place = form.motion(FLOAT)
    inner = form.leaves(FLOAT) if isinstance(form, Composite) else [Leaf(form)]
    material: list[Floats] = []
    holes: list[Floats] = []
    wires: list[Floats] = []
    for leaf in (leaf.within(place, 1, ()) for leaf in inner):
        turn, shift = leaf.rotation, leaf.displacement
        if isinstance(leaf.form, PointMasses):
            yield Mark("dots", _places(leaf.form) @ turn.T + shift, "point masses", style=5)
        elif isinstance(leaf.form, Shape | Mesh):
            target = wires if isinstance(leaf.form, Wire) else holes if leaf.sign < 0 else material
            faces = leaf.form.faces(MOST_FACES, CELLS) if isinstance(leaf.form, Mesh) else leaf.form.faces()
            target += [np.asarray(face @ turn.T + shift, dtype=float) for face in faces]
    if material := _outside(material):
        yield Mark("faces", material, "the body", style=5)
    if holes:
        yield Mark("faces", holes, "hole", quiet=True)
    for number, wire in enumerate(wires):
        yield Mark("line", wire, "" if number or material else "the body", style=5)


def _outside(faces: list[Floats]) -> list[Floats]:
    """The faces of the outside: where two parts meet, such as shells in each other, faces are inside."""
    size = max((float(np.abs(face).max()) for face in faces), default=0.0) or 1.0
    names = [frozenset(map(tuple, np.round(face / size, SAME).tolist())) for face in faces]
    count = Counter(names)
    return [face for face, name in zip(faces, names, strict=True) if count[name] == 1]


def _places(form: PointMasses) -> Floats:
    """Where the point masses are (n, 3, m)."""
    step = -(-sum(map(len, form.blocks())) // MOST_POINTS)
    chosen, first = [], 0
    for block in form.blocks():
        chosen.append(np.array(block[first::step, 1:], dtype=float))
        first = (first - len(block)) % step
    return np.vstack(chosen)
