"""Pictures on closed surfaces: ellipsoids and spheres as lines, and curves on them.

The tip of omega moves on the ellipsoid of energy, I1 w1^2 + I2 w2^2 + I3 w3^2 = 2 T, where |L| is constant:
L. Landau, E. Lifshitz, Mechanics, section 37.
"""

from __future__ import annotations

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import UsageError
from rigidcli.picture import Mark, Panel, Picture, PictureAxis

# The points of a closed line, and the lines of equal height on a sphere: it looks round, and not crowded.
CIRCLE, CIRCLES = 61, 7
SPACE = tuple(map(PictureAxis, "xyz"))  # the directions of space, z upward, for unit vectors
# Components of omega along the principal axes.
ALONG = tuple(PictureAxis(f"ω{k}", unit="rad/s") for k in "₁₂₃")


def semi_axes(moments: Floats, level: float) -> Floats | None:
    """The semi-axes (3) of the ellipsoid on which the sum of I x^2 is `level`, sqrt(level/I).

    With `moments` in kg m^2 and the level 2 T in J they are in rad/s; with the level 1 it is the ellipsoid of
    inertia. None where a moment, or the level, is zero, so that there is no ellipsoid.
    """
    if not (moments > 0).all() or level <= 0:
        return None
    axes: Floats = np.sqrt(level / moments)
    return axes


def separatrix(moments: Floats, axes: Floats, count: int) -> tuple[Floats, Floats] | None:
    """The two closed curves (count, 3) on the ellipsoid of energy with these `axes` on which L^2 = 2 T I2.

    They are plane: I1 (I2-I1) w1^2 = I3 (I3-I2) w3^2. None unless the `moments` differ, ascending.
    """
    low, middle, high = moments
    if not low < middle < high:
        return None
    cosine, sine = np.sqrt((high - middle) / (high - low)), np.sqrt((middle - low) / (high - low))
    turn = np.linspace(0, 2 * np.pi, count)
    along, across = np.cos(turn), np.sin(turn)
    first, second = (
        axes * np.column_stack([cosine * along, across, sign * sine * along]) for sign in (1, -1)
    )
    return first, second


def ellipsoid(
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


def polhode_picture(moments: Floats, omega: Floats, is_free: bool = True) -> Picture:
    """The path of omega (n, 3, rad/s, along the principal axes) on the ellipsoid of energy of its start.

    Raises UsageError where a body without a moment about an axis, or at rest, has no such ellipsoid.
    """
    axes = semi_axes(moments, float(omega[0] @ (moments * omega[0])))
    if axes is None:
        raise UsageError("the ellipsoid of energy needs a body that turns, with moments about all its axes")
    marks = ellipsoid(axes, "ellipsoid of energy" if is_free else "ellipsoid of the energy at t = 0")
    for place, curve in enumerate(separatrix(moments, axes, CIRCLE) or ()):
        name = "" if place else "separatrix"
        marks.append(Mark("line", curve, name, style=1, normals=curve * moments))
    marks.append(Mark("line", omega, "polhode", style=0, normals=omega * moments))
    marks.append(Mark("dots", omega[:1], "start", style=0))
    title = "polhode, the path of omega in the body"
    return Picture("polhode", title, (Panel(ALONG, tuple(marks), is_even=True),))


def trace_picture(axis: Floats, name: str, title: str) -> Picture:
    """The path of a unit vector (n, 3) in space on the unit sphere."""
    marks = [
        *ellipsoid(np.ones(3), "unit sphere"),
        Mark("line", axis, name, normals=axis),
        Mark("dots", axis[:1], "start"),
        Mark("arrow", np.array([np.zeros(3), axis[0]]), style=0),
    ]
    return Picture("trace", title, (Panel(SPACE, tuple(marks), is_even=True),))
