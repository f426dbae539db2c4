"""The pictures of `euler`: omega in time, the polhode, the trace of an axis on the sphere, and the replay.

The tip of omega moves on the ellipsoid of energy, I1 w1^2 + I2 w2^2 + I3 w3^2 = 2 T, where |L| is constant:
L. Landau, E. Lifshitz, Mechanics, section 37. The replay shows the body with its axes, omega and L in space,
and Poinsot's construction.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from rigidcli.bodies import charts
from rigidcli.core import rotation
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.tensor import ROUNDING_OF_SUM
from rigidcli.document.document import Document
from rigidcli.errors import UsageError
from rigidcli.picture import Mark, Panel, Picture, PictureAxis
from rigidcli.report import Column, Table
from rigidcli.scene import Part, Scene, Stage
from rigidcli.studies.euler.motion import Trajectory
from rigidcli.studies.inertia.pictures import CIRCLE, ellipsoid_lines, marks_of_body, moved, reach, semi_axes

# A spin beyond this many times the largest change of a component of omega has a panel of its own.
GAP_OF_PANELS = 3.0


def omega(motion: Trajectory, samples: Table) -> Picture:
    """The components of omega, as the samples have them, in time."""
    t, turning = (_column(samples, key) for key in ("t", "omega"))
    panels, names = [], ("ω₁", "ω₂", "ω₃")
    for group in _groups(turning.values):
        curves = (np.column_stack([t.values, turning.values[:, k]]) for k in group)
        marks = [Mark("line", curve, names[k], style=k) for k, curve in zip(group, curves, strict=True)]
        name = ", ".join(names[k] for k in group)
        rulers = PictureAxis("t", unit=t.unit), PictureAxis(name, unit=turning.unit)
        panels.append(Panel(rulers, tuple(marks)))
    return Picture("omega", "angular velocity along the axes of the body", tuple(panels))


def _groups(values: Floats) -> list[list[int]]:
    """Which components (n, 3) share a panel: a fast spin has its own, so that a small wobble is seen."""
    size = np.abs(values)
    spin, change = int(size.max(axis=0).argmax()), float(np.ptp(values, axis=0).max())
    if not ROUNDING_OF_SUM * size.max() < GAP_OF_PANELS * change < size[:, spin].min():
        return [[0, 1, 2]]
    return [[k for k in range(3) if k != spin], [spin]]


def polhode(motion: Trajectory, samples: Table) -> Picture:
    """The path of omega in the body, on the ellipsoid of the energy at the start.

    Raises UsageError where a body without a moment about an axis, or at rest, has no such ellipsoid.
    """
    frame, is_free = motion.problem.frame, motion.free is not None
    moments, path = frame.moments, _column(samples, "omega").values @ frame.axes.T
    axes = semi_axes(moments, float(path[0] @ (moments * path[0])))
    if axes is None:
        raise UsageError("the ellipsoid of energy needs a body that turns, with moments about all its axes")
    name = "ellipsoid of energy" if is_free else "ellipsoid of the energy at t = 0"
    marks = ellipsoid_lines(axes, name)
    for place, curve in enumerate(_separatrix(moments, axes)):
        label = "" if place else "separatrix"
        marks.append(Mark("line", curve, label, style=1, normals=curve * moments))
    marks.append(Mark("line", path, "polhode", style=0, normals=path * moments))
    marks.append(Mark("dots", path[:1], "start", style=0))
    rulers = tuple(PictureAxis(f"ω{k}", unit="rad/s") for k in "₁₂₃")
    title = "polhode, the path of omega in the body"
    return Picture("polhode", title, (Panel(rulers, tuple(marks), is_even=True),))


def _separatrix(moments: Floats, axes: Floats) -> Iterator[Floats]:
    """The two closed curves (n, 3) on the ellipsoid of energy with these `axes` on which L^2 = 2 T I2.

    They are plane: I1 (I2-I1) w1^2 = I3 (I3-I2) w3^2. There are none unless the `moments` differ, ascending.
    """
    low, middle, high = moments
    if not low < middle < high:
        return
    cosine, sine = np.sqrt((high - middle) / (high - low)), np.sqrt((middle - low) / (high - low))
    turn = np.linspace(0, 2 * np.pi, CIRCLE)
    along, across = np.cos(turn), np.sin(turn)
    for sign in (1, -1):
        yield axes * np.column_stack([cosine * along, across, sign * sine * along])


def trace(motion: Trajectory, samples: Table) -> Picture:
    """The path in space of the top's axis, or of e3, on the unit sphere."""
    is_top = motion.problem.weight.any() and motion.free is None
    name = "the axis of the top" if is_top else "e₃"
    axis = rotation.turned(motion.orientation, motion.problem.third)
    marks = [
        *ellipsoid_lines(np.ones(3), "unit sphere"),
        Mark("line", axis, name, normals=axis),
        Mark("dots", axis[:1], "start"),
        Mark("arrow", np.array([np.zeros(3), axis[0]]), style=0),
    ]
    rulers = tuple(map(PictureAxis, "xyz"))  # the directions of space, z upward
    title = f"path of {name} on the unit sphere"
    return Picture("trace", title, (Panel(rulers, tuple(marks), is_even=True),))


def _column(samples: Table, key: str) -> Column:
    return next(column for column in samples.columns if column.key == key)


# Lengths of the axes of the body, of omega and L where they are longest, and of the axes of space, in units
# of the distance from O to the farthest point of the body: no tip hides another.
AXES, VECTORS, SPACE = 1.25, 1.5, 1.6
# Directions of the corners of the polygon that stands for a plane (rad).
CORNERS_OF_DISC = np.linspace(0, 2 * np.pi, 72, endpoint=False)


def scene_of(document: Document, motion: Trajectory, samples: Table) -> Scene | None:
    """The scene that a replay of the motion shows; None where there is one moment only."""
    if len(motion.problem.times) < 2:
        return None
    stages = (_in_space(document, motion), *_rolling_ellipsoid(motion))
    columns = {column.key: column for column in samples.columns}
    length = np.hypot.reduce(motion.momentum_in_space, axis=1)
    space = columns["angular_momentum_space"]
    momentum = Column("L", length, ("|L|",), space.unit, (r"|\mathbf{L}|",), noise=space.noise)
    read = [columns["t"], columns["omega"], columns["kinetic_energy"], momentum]
    read += [columns["angles"]] if "angles" in columns else []
    readings = Table("", "the motion", tuple(read), data=True)
    orientation = rotation.continuous(motion.orientation)
    return Scene("the motion in space", motion.problem.times, readings, stages, orientation, motion.omega)


def _in_space(document: Document, motion: Trajectory) -> Stage:
    """The body as it is seen from space, omega and L, and the paths of omega and of an axis."""
    problem = motion.problem
    body, size = _body(document, motion)
    omega, momentum = (_scaled(values, VECTORS * size) for values in (motion.omega, motion.momentum_in_space))
    principal = problem.shown @ problem.frame.axes.T
    is_top = problem.weight.any() and motion.free is None
    trace = AXES * size * rotation.turned(motion.orientation, problem.third)
    parts = [Part(mark, carried=True) for mark in body]
    parts += [
        Part(_arrow(AXES * size * axis, f"e{k}"), carried=True, group="axes of the body")
        for k, axis in enumerate(principal.T, start=1)
    ]
    parts += [
        Part(_arrow(SPACE * size * axis, name), group="axes of space")
        for name, axis in zip("xyz", np.eye(3), strict=True)
    ]
    parts += [
        Part(Mark("arrow", _from_centre(omega), "ω", style=1), "sampled", carried=True),
        Part(Mark("arrow", _from_centre(momentum), "L", style=0), "sampled"),
        Part(Mark("line", omega, "polhode", style=3), "traced", carried=True),
        Part(Mark("line", rotation.turned(motion.orientation, omega), "herpolhode", style=1), "traced"),
        Part(Mark("line", trace, f"path of {'the axis of the top' if is_top else 'e3'}", style=2), "traced"),
    ]
    return Stage("the body in space", tuple(parts))


def _body(document: Document, motion: Trajectory) -> tuple[list[Mark], float]:
    """The body about O, or its ellipsoid of inertia where its parts are not given; and how far it reaches."""
    marks: list[Mark] = []
    if document.body is not None:
        turn, shift = np.eye(3), -document.physical.point
        marks += (replace(mark, points=moved(mark.points, turn, shift)) for mark in marks_of_body(document))
    if not marks:
        moments = motion.problem.frame.moments
        axes = semi_axes(moments / moments.max(), 1.0)
        if axes is None:
            return [], 1.0
        marks.append(Mark("faces", _ellipsoid(axes, motion), "ellipsoid of inertia", style=5))
    return marks, reach(marks, np.zeros(3)) or 1.0


def _rolling_ellipsoid(motion: Trajectory) -> Iterator[Stage]:
    """The ellipsoid of energy of a free body, which rolls on a plane without slipping.

    It touches the plane at the tip of omega; the plane is across L, at the distance 2 T/L from O.
    Source: L. Landau, E. Lifshitz, Mechanics, section 37.
    """
    momentum = motion.momentum_in_space[0]
    length = float(np.hypot.reduce(momentum))
    axes = semi_axes(motion.problem.frame.moments, 2 * float(motion.energy[0]))
    if motion.free is None or axes is None or not length:
        return
    along, size = momentum / length, float(axes.max())
    path = rotation.turned(motion.orientation, motion.omega)
    disc = (
        1.2
        * float(np.hypot.reduce(path, axis=1).max())
        * np.column_stack([np.cos(CORNERS_OF_DISC), np.sin(CORNERS_OF_DISC)])
    )
    turn = rotation.onto(tuple(along), FLOAT)
    plane = disc @ turn[:, :2].T + 2 * float(motion.energy[0]) / length * along
    parts = (
        Part(Mark("faces", _ellipsoid(axes, motion), "ellipsoid of energy", style=5), carried=True),
        Part(Mark("faces", [plane], "plane", quiet=True)),
        Part(Mark("arrow", _from_centre(motion.omega), "ω", style=1), "sampled", carried=True),
        Part(Mark("arrow", np.array([np.zeros(3), VECTORS * size * along]), "L", style=0)),
        Part(Mark("line", motion.omega, "polhode", style=3), "traced", carried=True),
        Part(Mark("line", path, "herpolhode", style=1), "traced"),
    )
    yield Stage("Poinsot's ellipsoid on its plane", parts)


def _ellipsoid(semi_axes: Floats, motion: Trajectory) -> list[Floats]:
    """The faces of an ellipsoid with these semi-axes (3) along the principal axes of the body."""
    principal = motion.problem.frame.axes @ motion.problem.shown.T
    return [face * semi_axes @ principal for face in charts.ball(1.0, FLOAT).faces()]


def _scaled(vectors: Floats, length: float) -> Floats:
    """Vectors (n, 3), scaled so that the longest is as long as asked; zero vectors stay."""
    largest = float(np.hypot.reduce(vectors, axis=1).max())
    return vectors * (length / largest) if largest else vectors


def _from_centre(tips: Floats) -> Floats:
    return np.stack([np.zeros_like(tips), tips], axis=1)


def _arrow(tip: Floats, name: str) -> Mark:
    """An axis from O, which is there for orientation."""
    return Mark("arrow", np.array([np.zeros(3), tip]), name, quiet=True)
