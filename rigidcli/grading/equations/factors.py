"""States of the motion that are factors of an equation: where one of them stays zero, the equation is true.

Equations may be multiplied by anything that is not zero at almost every state. But a factor that the equation
itself lets stay zero adds solutions at the states where it is: rest to m x' x'' + k x x' = 0.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from rigidcli.grading.equations.determinacy import Tried
from rigidcli.grading.equations.states import POSITIVE, Motion
from rigidcli.grading.values import Points
from rigidcli.model.variables import acceleration, velocity
from rigidcli.symbolic.language.evaluation import array

NEAR = np.array([0.0, 1e-6, 1e-3])
"""Values of a factor: zero, and close to it."""

RATES = np.array([0.0, 1.0])
"""Values of the rate of a factor, between which an equation is held to be linear."""

VANISHING = 0.5
"""A rate that falls by more than this from the last value of a factor to the one before is zero with it."""


def lasting_zeros(equation: Tried, motion: Motion, elsewhere: Points) -> list[str]:
    """The factors of an equation, among the states of the motion, that it wrongly lets stay zero.

    `elsewhere` has derivatives that are of no motion.
    """
    return [
        factor
        for factor, rate in _states(motion, equation.names)
        if {factor, rate} <= equation.names
        and motion.domains.get(factor) != POSITIVE
        and _may_stay_zero(equation, factor, rate, elsewhere)
    ]


def _states(motion: Motion, names: frozenset[str]) -> Iterator[tuple[str, str]]:
    """The states of the motion, as an equation with these names has it, with their rates."""
    for name in motion.functions:
        if acceleration(name) in names:
            yield velocity(name), acceleration(name)
        else:
            yield name, velocity(name)
    for name in motion.auxiliary:
        yield name, velocity(name)
    if len(motion.auxiliary) == len(motion.functions):
        # Equations of first order tell how a velocity changes by how its momentum does.
        for name, partner in zip(motion.functions, motion.auxiliary, strict=True):
            yield velocity(name), velocity(partner)


def _may_stay_zero(equation: Tried, factor: str, rate: str, elsewhere: Points) -> bool:
    """Whether the equation is true where the factor is zero, and tells a rate that is not zero near there."""
    values = {name: elsewhere.floats[name] for name in equation.names}
    values |= {factor: NEAR[:, None, None], rate: RATES[:, None]}
    found = np.broadcast_to(array(equation.node, values), (len(NEAR), len(RATES), elsewhere.count))
    with np.errstate(all="ignore"):
        told = np.abs(found[1:, 0] / (found[1:, 1] - found[1:, 0]))
        return bool((found[0] == 0).all() and (told[0] > VANISHING * told[1]).all())
