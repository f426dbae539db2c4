"""The effective potential of the heavy symmetric top, in which its tilt moves.

Source: H. Goldstein, Classical Mechanics, 2nd edition, section 5.7. As there, the energy
is without the constant lambda3 omega3^2/2. For the names of arguments see `core.top`.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats


@dataclass(frozen=True, slots=True, eq=False)
class EffectivePotential:
    """The potential at tilts (n, rad), and the energy, both in J.

    V(theta) = (p_phi - p_psi cos theta)^2/(2 lambda1 sin^2 theta) + M g R cos theta.
    """

    at: Callable[[Floats], Floats]
    energy: float


def effective_potential(
    lambda1: float,
    lambda3: float,
    spin: float,
    tilt: float,
    precession: float,
    nutation: float,
    weight_moment: float,
) -> EffectivePotential:
    """The potential of a top that starts at `tilt`, with phi-dot and theta-dot as given (rad/s).

    With delta = cos(tilt) - cos(theta), p_phi - p_psi cos theta = lambda1 sin^2(tilt) phi-dot + p_psi delta.
    """
    along, turning = lambda3 * spin, lambda1 * np.sin(tilt) ** 2 * precession

    def at(theta: Floats) -> Floats:
        # The difference of two cosines as a product, which keeps its digits beside the start.
        difference = 2 * np.sin((theta + tilt) / 2) * np.sin((theta - tilt) / 2)
        centrifugal = (turning + along * difference) ** 2 / (2 * lambda1 * np.sin(theta) ** 2)
        potential: Floats = centrifugal + weight_moment * np.cos(theta)
        return potential

    kinetic = lambda1 * (nutation**2 + (np.sin(tilt) * precession) ** 2) / 2
    return EffectivePotential(at, float(kinetic + weight_moment * np.cos(tilt)))
