"""Poinsot's picture of rotation: the ellipsoids of inertia and of energy, and the separatrix.

The tip of omega moves on the ellipsoid of energy, I1 w1^2 + I2 w2^2 + I3 w3^2 = 2 T, where |L| is constant.
Source: L. Landau, E. Lifshitz, Mechanics, section 37.
"""

from __future__ import annotations

import numpy as np

from rigidcli.core.arithmetic import Floats


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
