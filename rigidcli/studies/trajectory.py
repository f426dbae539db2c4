"""The motion of a document's body in time: set up, followed in closed form or by integration, and judged."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core import freebody, lagrange, rotation
from rigidcli.core import top as heavytop
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.errors import ComputationError, DocumentError, Problem, UsageError
from rigidcli.model.document import Document
from rigidcli.model.motion import BodyTorque, Motion, SpaceTorque, Weight
from rigidcli.model.principal import principal_frame
from rigidcli.model.sampling import Sampling
from rigidcli.model.top import Top

if TYPE_CHECKING:
    from rigidcli.core.integrate import Engine

DEFAULT_TURNS = 10
"""Turns of the body in the time that is shown where the document does not say."""

DEFAULT_NUTATIONS = 3
"""Nutations of a top in that time, at least."""

DEFAULT_TOLERANCE = 1e-12

CLOSED = "closed form"
"""The method where nothing is integrated."""

SYMMETRIC = 1e-14
"""How far the tensor of a symmetric top may be from its form, in units of its largest entry."""

MOST_DIGITS = 15.9
"""Decimal digits of a float."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """What is to be followed, along the document's axes (which the body carries) and the axes of space.

    `tensor` (3 by 3) is about O, `orientation` (4) turns the document's axes to those of space. `weight`
    is M g R (3, N m), the arm from O to the centre of mass times the weight; zero for none. `symmetry` (3 by
    3) has as columns the axes of a top, the last along its symmetry axis; None for other bodies.
    """

    tensor: Floats
    omega: Floats
    orientation: Floats
    weight: Floats
    torque: BodyTorque | SpaceTorque | None
    times: Floats
    tolerance: float
    symmetry: Floats | None = None
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, eq=False)
class Trajectory:
    """A motion at `times` (n): omega along the document's axes (n, 3), orientation (n, 4), and how well.

    `free` is the closed form where no torque acts. `drift` tells by how much the laws are broken: of the
    energy balance, in units of the largest energy, of the balance of angular momentum about O, in units of
    the largest, and of the length of the quaternions from 1.
    """

    start: Start
    omega: Floats
    orientation: Floats
    free: freebody.FreeMotion | None
    method: str
    steps: int
    trusted_digits: float
    drift: dict[str, float]

    @cached_property
    def momentum(self) -> Floats:
        """Angular momentum about O (n, 3), along the document's axes."""
        return self.omega @ self.start.tensor

    @cached_property
    def momentum_in_space(self) -> Floats:
        """The same along the axes of space."""
        return rotation.turned(self.orientation, self.momentum)

    @cached_property
    def energy(self) -> Floats:
        """Kinetic energy (n, J)."""
        return _energy(self.omega, self.momentum)


def _energy(omega: Floats, momentum: Floats) -> Floats:
    energy: Floats = np.einsum("ij,ij->i", omega, momentum) / 2
    return energy


def follow(
    document: Document, engine: Engine = "auto", progress: Callable[[float], None] | None = None
) -> Trajectory:
    """The motion that the document describes.

    Raises DocumentError where it describes none, ComputationError where it cannot be followed to its end.
    """
    start = beginning(document)
    if start.torque is None and not start.weight.any():
        return _free(start)
    top = _as_top(start) if start.torque is None and engine == "auto" else None
    if top is not None:
        return _heavy(start, *top)
    from rigidcli.studies.driving import driven

    return driven(start, engine, progress)


def beginning(document: Document) -> Start:
    """What the document says of the motion's beginning, and what drives it."""
    _require_numbers(document)
    motion = document.motion or Motion()
    if motion.omega is not None:
        return _of_body(document, motion, motion.omega)
    if document.top is not None:
        return _of_top(document, motion, document.top)
    missing = "body" if document.body is None else "motion.omega"
    raise DocumentError(
        [
            Problem(
                document.source,
                "missing",
                key=missing,
                hint="`euler` needs a `body` and `motion.omega`, or a `top`",
            )
        ]
    )


def _require_numbers(document: Document) -> None:
    if not document.arithmetic.exact:
        return
    symbols = [name for name, value in (document.parameters or {}).items() if value is None]
    if not symbols:
        raise UsageError("a motion in time has no exact results", hint="leave out `--exact`")
    raise DocumentError(
        [
            Problem(document.source, "missing: a motion in time needs its value", key=f"parameters.{name}")
            for name in symbols
        ]
    )


def _of_body(document: Document, motion: Motion, omega: Sequence[float]) -> Start:
    if document.body is None:
        raise DocumentError([Problem(document.source, "missing, expected a body", key="body")])
    tensor, turning = document.tensor, np.array(omega)
    if motion.basis == "principal":
        # Along e1, e2, e3 as they are printed: of the tensor in the axes of the results.
        printed = principal_frame(document.axes.T @ tensor @ document.axes, FLOAT).axes
        turning = document.axes @ printed.T @ turning
    notes: tuple[str, ...] = ()
    if document.top is not None:
        notes += ("`motion.omega` is given, so that `top` is not used",)
    weight = np.zeros(3)
    if isinstance(motion.torque, Weight):
        body = document.properties
        if body.mass is None:
            raise DocumentError([Problem(document.source, "missing: a weight needs it", key="body.mass")])
        weight = (body.com - document.point) * body.mass * motion.torque.gravity
        if not weight.any():
            notes += ("the body is held at its centre of mass, so that its weight has no torque",)
    return Start(
        tensor,
        turning,
        rotation.as_quaternion(document.orientation),
        weight,
        motion.torque if isinstance(motion.torque, BodyTorque | SpaceTorque) else None,
        motion.instants(_ten_turns(turning)),
        motion.tolerance or DEFAULT_TOLERANCE,
        notes=(*notes, *_default_duration(motion)),
    )


def _of_top(document: Document, motion: Motion, section: Top) -> Start:
    """A top that leans at the beginning so that phi = psi = 0: towards -y of space."""
    top = document.heavy_top
    needed = {"tilt": section.tilt, "lambda1": top.lambda1}
    missing = [key for key, value in needed.items() if value is None]
    if missing:
        raise DocumentError(
            [Problem(document.source, "missing: `euler` needs it", key=f"top.{key}") for key in missing]
        )
    if motion.orientation is not None or isinstance(motion.torque, Weight):
        key = "orientation" if motion.orientation is not None else "torque.gravity"
        raise DocumentError([Problem(document.source, "the `top` tells this already", key=f"motion.{key}")])
    assert section.tilt is not None
    assert top.lambda1 is not None
    fall = top.mass * section.gravity * top.distance
    precession = section.precession
    if precession is None:
        steady = heavytop.steady(top.lambda1, top.lambda3, section.spin, section.tilt, fall, FLOAT)
        precession = steady.slow
        if precession is None:
            raise ComputationError(
                "there is no steady precession at this spin and tilt",
                hint=f"it takes a spin of {steady.minimum_spin:.6g} rad/s" if steady.minimum_spin else None,
            )
    sine, cosine = math.sin(section.tilt), heavytop.cosine(section.tilt, FLOAT)
    local = np.array([section.nutation, precession * sine, section.spin])
    axes = rotation.onto(tuple(top.axis), FLOAT)
    tilted = np.array([[1.0, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    tensor = axes @ np.diag([top.lambda1, top.lambda1, top.lambda3]) @ axes.T
    period = heavytop.nutation(
        top.lambda1, top.lambda3, section.spin, section.tilt, precession, section.nutation, fall
    ).period
    default = max(_ten_turns(local), DEFAULT_NUTATIONS * (period or 0.0))
    return Start(
        (tensor + tensor.T) / 2,
        axes @ local,
        rotation.as_quaternion(tilted @ axes.T),
        top.axis * fall,
        motion.torque if isinstance(motion.torque, BodyTorque | SpaceTorque) else None,
        motion.instants(default),
        motion.tolerance or DEFAULT_TOLERANCE,
        axes,
        (*top.remarks, *_default_duration(motion)),
    )


def _ten_turns(omega: Floats) -> float:
    rate = float(np.linalg.norm(omega / scale)) * scale if (scale := float(np.abs(omega).max())) else 0.0
    return 2 * math.pi * DEFAULT_TURNS / rate if rate else 1.0


def _default_duration(motion: Sampling) -> tuple[str, ...]:
    given = motion.duration is not None or motion.times is not None
    return () if given else ("`motion.duration` is not given: some turns are shown",)


def _free(start: Start) -> Trajectory:
    free = freebody.free_motion(start.tensor, start.omega, start.orientation)
    omega, orientation = freebody.at(free, start.times)
    _begin(start, omega, orientation)
    error = freebody.sensitivity(start.tensor, start.omega, start.orientation, start.times)
    drift = conserved(start, omega, orientation)
    return Trajectory(start, omega, orientation, free, CLOSED, 0, digits(error), drift)


def _as_top(start: Start) -> tuple[Floats, float, float] | None:
    """Axes (columns), lambda1 and lambda3 of a body that is a symmetric top under its weight."""
    axes = rotation.onto(tuple(start.weight), FLOAT)
    local = axes.T @ start.tensor @ axes
    lambda1, lambda3 = float(local[0, 0] + local[1, 1]) / 2, float(local[2, 2])
    off = np.abs(local - np.diag([lambda1, lambda1, lambda3])).max()
    return (axes, lambda1, lambda3) if off <= SYMMETRIC * np.abs(local).max() and lambda1 > 0 else None


def _heavy(start: Start, axes: Floats, lambda1: float, lambda3: float) -> Trajectory:
    turn = rotation.as_quaternion(axes)
    given = (
        lambda1,
        lambda3,
        FLOAT.hypot(*start.weight),
        axes.T @ start.omega,
        rotation.compose(start.orientation, turn),
    )
    local, orientation = lagrange.at(lagrange.heavy_motion(*given), start.times)
    omega = local @ axes.T
    orientation = rotation.continuous(rotation.compose(orientation, turn * [1, -1, -1, -1]))
    _begin(start, omega, orientation)
    error = lagrange.sensitivity(*given, start.times)
    drift = conserved(start, omega, orientation)
    return Trajectory(start, omega, orientation, None, CLOSED, 0, digits(error), drift)


def _begin(start: Start, omega: Floats, orientation: Floats) -> None:
    """Put in what is known of t = 0 without rounding."""
    beginning = start.times == 0
    omega[beginning], orientation[beginning] = start.omega, start.orientation


def digits(error: float) -> float:
    """Decimal digits that can be trusted in a direction that is off by `error` (rad)."""
    return MOST_DIGITS if error <= 0 else round(min(MOST_DIGITS, max(0.0, -math.log10(error))), 1)


def conserved(start: Start, omega: Floats, orientation: Floats) -> dict[str, float]:
    """How far a motion (n, 3 and n, 4) without torque, or under weight, is from keeping what it must.

    That is the energy, and the angular momentum in space: under weight its vertical component.
    """
    fast, size = np.abs(omega).max(), np.abs(omega @ start.tensor).max()
    if not size:
        return {"energy": 0.0, "angular_momentum": 0.0, "quaternion": 0.0}
    omega, momentum = omega / fast, omega @ start.tensor / size  # squares of tiny numbers would vanish
    kinetic = _energy(omega, momentum)
    space = rotation.turned(orientation, momentum)
    potential = np.zeros_like(kinetic)
    if start.weight.any():
        potential = rotation.turned(orientation, start.weight / size / fast)[:, 2]
        space = space[:, 2:]
    change = kinetic - kinetic[0] + potential - potential[0]
    scale = np.abs(kinetic).max() + np.abs(potential - potential[0]).max()
    return {
        "energy": float(np.abs(change).max() / scale),
        "angular_momentum": float(np.linalg.norm(space - space[0], axis=1).max()),
        "quaternion": float(np.abs(np.linalg.norm(orientation, axis=1) - 1).max()),
    }
