"""Whether a free body goes on turning about a principal axis: the intermediate axis theorem."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import sqrt

from rigidcli.core.arithmetic import Floats


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
