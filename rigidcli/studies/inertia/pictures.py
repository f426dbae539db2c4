"""The picture of a body: the surface, the principal axes about O, and the ellipsoid of inertia."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from rigidcli.bodies.composites import Composite, Leaf
from rigidcli.bodies.meshes import Mesh
from rigidcli.bodies.points import PointMasses
from rigidcli.bodies.shapes import Shape, Wire
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.picture import Mark, Panel, Picture, PictureAxis
from rigidcli.studies.common import require_values

MOST_POINTS = 2_000  # the most point masses that are drawn, evenly chosen, so that a picture is small
MOST_FACES = 4_000  # the most triangles of a mesh that are drawn as they are, so that viewers stay fast
HOLE_GROWN = 1.004  # how much larger holes are drawn than they are
# The points of a closed line, and the lines of equal height on an ellipsoid: it looks round, and not crowded.
CIRCLE, CIRCLES = 61, 7
# Length of the principal axes, in units of the distance from O to the farthest point of the body.
LENGTH_OF_AXES = 1.25


def ellipsoid(document: Document) -> Picture:
    """Poinsot's ellipsoid x.I.x = 1 about O with the principal axes, in its own unit, without the body."""
    require_values(document, "a picture")
    if not (document.physical.frame.moments > 0).all():
        raise UsageError("the ellipsoid of inertia needs moments about all axes")
    return replace(body(document, is_drawn=False), kind="ellipsoid")


def body(document: Document, is_drawn: bool = True) -> Picture:
    """The body along the axes of the results. Raises DocumentError where a parameter has no value."""
    require_values(document, "a picture")
    physical, frame = document.physical, document.physical.frame
    forms, axes = marks_of_body(document) if is_drawn else (), physical.axes
    marks = [replace(mark, points=moved(mark.points, axes, np.zeros(3))) for mark in forms]
    centre = axes.T @ physical.point if marks else np.zeros(3)
    semi = semi_axes(frame.moments, 1.0)
    size = reach(marks, centre) or (1.0 if semi is None or marks else float(semi.max()))
    # Without a body, the picture has the unit of the ellipsoid x.I.x = 1.
    title, unit, com = "principal axes and ellipsoid of inertia", "1/√(kg m²)", centre
    if marks:
        title, unit = f"body, {title}", "m"
        if physical.properties.mass is not None:
            com = axes.T @ physical.properties.com
    if semi is not None:
        scale, label = (0.9 * size / semi.max(), " (scaled)") if marks else (1, "")
        marks += ellipsoid_lines(semi * scale, f"ellipsoid of inertia{label}", frame.axes, centre)
    for k, (axis, moment) in enumerate(zip(frame.axes, frame.moments, strict=True)):
        ends = np.array([centre, centre + LENGTH_OF_AXES * size * axis])
        marks.append(Mark("arrow", ends, f"e{'₁₂₃'[k]}: λ{'₁₂₃'[k]} = {moment:.4g} kg m²", style=k + 1))
    marks.append(Mark("dots", centre[None], "O", style=0))
    if np.linalg.norm(com - centre) > 1e-9 * size:
        marks.append(Mark("dots", com[None], "centre of mass", style=4))
    rulers = tuple(PictureAxis(name, unit=unit) for name in "xyz")
    return Picture("body", title, (Panel(rulers, tuple(marks), is_even=True),))


def moved(places: Floats | list[Floats], turn: Floats, shift: Floats) -> Floats | list[Floats]:
    """Points (n, 3), or a list of such, along the columns of `turn` (3 by 3), and shifted (3)."""
    return [face @ turn + shift for face in places] if isinstance(places, list) else places @ turn + shift


def reach(marks: Sequence[Mark], centre: Floats) -> float:
    """The distance from the centre (3) to the farthest point of the marks; zero where there are none."""
    far = [np.linalg.norm(np.vstack(list(mark.points)) - centre, axis=1).max() for mark in marks]
    return float(max(far, default=0.0))


def marks_of_body(document: Document) -> Iterator[Mark]:
    """The parts of the body, along the document's axes."""
    form = document.body
    if form is None:
        return
    place = form.motion(FLOAT)
    inner = form.leaves(FLOAT) if isinstance(form, Composite) else [Leaf(form)]
    material, holes, wires, is_rough = list[Floats](), list[Floats](), list[Floats](), False
    for leaf in (leaf.within(place, 1, ()) for leaf in inner):
        turn, shift = leaf.rotation, leaf.displacement
        if isinstance(leaf.form, PointMasses):
            step = -(-sum(map(len, leaf.form.blocks())) // MOST_POINTS)
            places = np.vstack([block[::step, 1:] for block in leaf.form.blocks()]).astype(float)
            yield Mark("dots", places @ turn.T + shift, "point masses", style=5)
        elif isinstance(leaf.form, Shape | Mesh):
            target = wires if isinstance(leaf.form, Wire) else holes if leaf.sign < 0 else material
            faces = leaf.form.faces(MOST_FACES, 24) if isinstance(leaf.form, Mesh) else leaf.form.faces()
            is_rough |= isinstance(leaf.form, Mesh) and leaf.form.checked.surface.triangles > MOST_FACES
            faces = [np.asarray(face @ turn.T + shift, dtype=float) for face in faces]
            target += _grown(faces) if target is holes else faces
    if material := _outside(material):
        yield Mark("faces", material, "the body", style=5, is_rough=is_rough)
    if holes:
        yield Mark("faces", holes, "hole", quiet=True, is_rough=is_rough)
    for number, wire in enumerate(wires):
        yield Mark("line", wire, "" if number or material else "the body", style=5)


def _grown(faces: list[Floats]) -> list[Floats]:
    """The faces of a hole, a little larger about their middle, so that its ends are seen on the body."""
    points = np.vstack(faces)
    middle = (points.min(axis=0) + points.max(axis=0)) / 2
    return [middle + HOLE_GROWN * (face - middle) for face in faces]


def _outside(faces: list[Floats]) -> list[Floats]:
    """The faces of the outside: two parts that meet, such as shells in each other, share faces inside."""
    size = max((float(np.abs(face).max()) for face in faces), default=0.0) or 1.0
    names = [frozenset(map(tuple, np.round(face / size, 9).tolist())) for face in faces]
    count = Counter(names)
    return [face for face, name in zip(faces, names, strict=True) if count[name] == 1]


# --- ellipsoids


def semi_axes(moments: Floats, level: float) -> Floats | None:
    """The semi-axes (3) of the ellipsoid on which the sum of I x^2 is `level`, sqrt(level/I).

    With `moments` in kg m^2 and the level 2 T in J they are in rad/s; with the level 1 it is the ellipsoid of
    inertia. None where a moment, or the level, is zero, so that there is no ellipsoid.
    """
    if not (moments > 0).all() or level <= 0:
        return None
    return np.asarray(np.sqrt(level / moments))


def ellipsoid_lines(
    axes: Floats, label: str, turn: Floats | None = None, centre: Floats | None = None
) -> list[Mark]:
    """The lines of an ellipsoid with semi-axes (3) along the rows of `turn` (3 by 3), about a centre (3)."""
    x, y, z = np.eye(3)
    angle = np.linspace(0, 2 * np.pi, CIRCLE)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    heights = np.linspace(-1, 1, CIRCLES + 2)[1:-1]
    sides = np.arange(CIRCLES - 1) * np.pi / (CIRCLES - 1)
    circles = [np.sqrt(1 - h * h) * (cosine * x + sine * y) + h * z for h in heights]
    circles += [sine * (np.cos(side) * x + np.sin(side) * y) + cosine * z for side in sides]
    own, middle = np.eye(3) if turn is None else turn, np.zeros(3) if centre is None else centre
    lines = [(circle * axes @ own + middle, circle / axes @ own) for circle in circles]
    return [
        Mark("line", line, "" if number else label, quiet=True, normals=normals)
        for number, (line, normals) in enumerate(lines)
    ]
