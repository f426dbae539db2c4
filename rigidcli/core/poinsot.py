"""Poinsot's picture of rotation: the ellipsoids of inertia and of energy, the separatrix, and stable axes.

The tip of omega moves on the ellipsoid of energy, I1 w1^2 + I2 w2^2 + I3 w3^2 = 2 T, where |L| is constant.
Source: L. Landau, E. Lifshitz, Mechanics, section 37.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

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


@dataclass(frozen=True, slots=True)
class AxisStability:
    """Rotation about one principal axis.

    `rate_per_spin` is, in units of the spin, the frequency of a small wobble if `stable`, else the rate of
    its exponential growth. An axis whose moment equals another one is neutral: `stable` is None, and the rate
    0. Both are None for an axis without a moment of inertia.
    """

    stable: bool | None
    rate_per_spin: float | None


def about_axes(moments: Floats, groups: Sequence[Sequence[int]]) -> list[AxisStability]:
    """The stability of rotation about e1, e2, e3, from moments (3, ascending) and groups of equal ones.

    Linearising Euler's equations about the spin w along axis i gives
    x'' = -w^2 (I_i - I_j)(I_i - I_k) / (I_j I_k) x (L. Landau, E. Lifshitz, Mechanics, section 37). About
    an axis of equal moments the coefficient is zero, and nothing drives a deviation back or away.
    """
    equal = {index for group in groups if len(group) > 1 for index in group}
    stabilities = []
    for i, (j, k) in enumerate(((1, 2), (2, 0), (0, 1))):
        if moments[i] == 0:
            stabilities.append(AxisStability(None, None))
        elif i in equal:
            stabilities.append(AxisStability(None, 0.0))
        else:
            square = float((moments[i] - moments[j]) / moments[j] * ((moments[i] - moments[k]) / moments[k]))
            stabilities.append(AxisStability(square > 0, sqrt(abs(square))))
    return stabilities
