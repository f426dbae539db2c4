"""Heavy symmetric tops: bodies that are held at a point of their axis, under their own weight."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Arithmetic, Array, Scalar, half_unit
from rigidcli.core.mass_properties import MassProperties
from rigidcli.core.principal import PrincipalFrame
from rigidcli.core.tensor import LEAST_MOMENT
from rigidcli.errors import ValueProblem, shown

# How far the tensor of a body may be from that of a symmetric top, in units of its largest entry.
SYMMETRY = 1e-9


@dataclass(frozen=True, slots=True, eq=False)
class HeavyTop:
    """What a top is worked with: mass (kg), distance of the centre of mass (m), moments about the pivot.

    `lambda1`, across the axis, may be None: not known. `axis` (3) is the unit vector from the pivot along the
    symmetry axis, in the document's components. `remarks` are for the notes of a result.
    """

    mass: Scalar
    distance: Scalar
    lambda1: Scalar | None
    lambda3: Scalar
    axis: Array
    remarks: tuple[str, ...] = ()


def described(
    n: Arithmetic,
    *,
    mass: Scalar | None,
    distance: Scalar | None,
    lambda1: Scalar | None,
    lambda3: Scalar | None,
) -> HeavyTop:
    """The top with these numbers; its axis is z. Raises ValueProblem where it cannot be."""
    if mass is None or distance is None or lambda3 is None:
        key = "mass" if mass is None else "distance" if distance is None else "lambda3"
        message = "missing; expected `mass`, `distance` and `lambda3` here, or a `body`"
        raise ValueProblem(message, path=(key,))
    remarks = _require_possible(mass, distance, lambda1, lambda3, n)
    return HeavyTop(mass, distance, lambda1, lambda3, n.array([0, 0, 1]), remarks)


def of_body(
    body: MassProperties, pivot: Array, tensor: Array, frame: Callable[[], PrincipalFrame], n: Arithmetic
) -> HeavyTop:
    """The top that a body makes when it is held at `pivot`, about which it has this `tensor`.

    A body held at its centre of mass turns about the axis of its `frame` whose moment is unlike the others.
    Raises ValueProblem for a body that is not symmetric about the line from the pivot to its centre of mass.
    """
    if body.mass is None:
        raise ValueProblem("missing: a top needs its weight", path=("body", "mass"))
    arm = n.tidy(body.com - pivot)
    distance = n.hypot(*arm)
    largest = max(abs(n.size(entry)) for entry in tensor.flat)
    far = max(abs(n.size(component)) for component in (*body.com, *pivot))
    if n.size(distance) <= (0 if n.exact else 1e-14 * far):
        own = frame()
        alone = [group[0] for group in own.groups if len(group) == 1]
        axis, distance = own.axes[alone[0] if len(alone) == 1 else 2], 0 * n.pi
    else:
        axis = n.tidy(arm / distance)
    lambda3 = n.tidied(axis @ tensor @ axis)
    if not n.exact and lambda3 <= LEAST_MOMENT * largest:
        lambda3 = 0.0
    lambda1 = n.tidied((np.trace(tensor) - lambda3) / 2)
    outer = np.outer(axis, axis)
    ideal = lambda3 * outer + lambda1 * (n.array(np.eye(3, dtype=int)) - outer)
    if max(abs(n.size(entry)) for entry in n.tidy(tensor - ideal).flat) > SYMMETRY * largest:
        raise ValueProblem(
            "the body is not symmetric about the line from the pivot to its centre of mass, so it is no top",
            hint="let `euler` follow its motion, with `motion: {omega: ..., torque: {gravity: 9.81}}`",
        )
    return HeavyTop(body.mass, distance, lambda1, lambda3, axis)


def _require_possible(
    mass: Scalar, distance: Scalar, lambda1: Scalar | None, lambda3: Scalar, n: Arithmetic
) -> tuple[str, ...]:
    """Remarks on moments about a pivot; raises ValueProblem for those that no body has."""
    if lambda1 is None:
        return ()
    central = lambda1 - mass * distance**2
    m, d, across, along = (n.size(number) for number in (mass, distance, lambda1, lambda3))
    # What the digits that were typed leave open of lambda1 - M R^2, and of lambda3.
    open1 = half_unit(across) + half_unit(m) * d**2 + 2 * m * d * half_unit(d) + 1e-12 * across
    open3 = half_unit(along)
    if n.sign(central) == -1 and n.size(-central) > open1:
        raise ValueProblem(
            f"read {shown(n.size(lambda1))}, expected at least mass distance^2 = "
            f"{n.size(mass * distance**2):.6g} kg m^2",
            path=("lambda1",),
            hint="the moments of a top are about its pivot, not about its centre of mass",
        )
    if n.sign(2 * lambda1 - lambda3) == -1 and along - 2 * across > 2 * half_unit(across) + open3:
        raise ValueProblem(
            f"read {shown(n.size(lambda3))}, expected at most 2 lambda1 = {n.size(2 * lambda1):.6g} kg m^2",
            path=("lambda3",),
        )
    if -1 in (n.sign(central), n.sign(2 * lambda1 - lambda3)):
        return ("a body has these moments only within the rounding of the digits typed",)
    if n.sign(2 * central - lambda3) == -1 and n.size(lambda3 - 2 * central) > 1e-12 * across:
        return ("lambda3 > 2 (lambda1 - M R^2): no rigid body has these moments about its centre of mass",)
    return ()
