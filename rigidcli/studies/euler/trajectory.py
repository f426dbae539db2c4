"""The motion of a document's body in time: set up, followed in closed form or by integration, and judged."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from rigidcli.core import freebody, lagrange, rotation
from rigidcli.core import top as heavytop
from rigidcli.core.arithmetic import FLOAT, Floats
from rigidcli.core.principal import ZERO_MOMENT
from rigidcli.core.solution import digits
from rigidcli.errors import ComputationError, DocumentError, UsageError, ValueProblem
from rigidcli.model.document import Document
from rigidcli.model.motion import Motion, OwnTorque, Weight
from rigidcli.model.rotations import Quaternion
from rigidcli.model.sampling import DEFAULT_TOLERANCE, Sampling
from rigidcli.model.top import Top

if TYPE_CHECKING:
    from rigidcli.core.integrate import Engine

DEFAULT_TURNS = 10
"""Turns of the body in the time that is shown where the document does not say."""

DEFAULT_NUTATIONS = 3
"""Nutations of a top in that time, where they have a period."""

CLOSED = "closed form"
"""The method where nothing is integrated."""

SYMMETRIC = 1e-14
"""How far the tensor of a symmetric top may be from its form, in units of its largest entry."""


@dataclass(frozen=True, slots=True, eq=False)
class Start:
    """What is to be followed, along the document's axes (which the body carries) and the axes of space.

    `tensor` (3 by 3) is about O, `orientation` (4) turns the document's axes to those of space. `weight`
    is M g R (3, N m), the arm from O to the centre of mass times the weight; zero for none. `symmetry` (3 by
    3) has as columns the axes of a top, the last along its symmetry axis; None for other bodies. `third` (3)
    is the axis that a torque knows as ux, uy, uz: that of a top, or e3 as it is printed.
    """

    tensor: Floats
    omega: Floats
    orientation: Floats
    weight: Floats
    torque: OwnTorque | None
    times: Floats
    tolerance: float
    third: Floats
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

    Raises DocumentError where it describes none, or one that a body cannot have, ComputationError where it
    cannot be followed to its end.
    """
    start = beginning(document)
    if start.torque is None and not start.weight.any():
        return _free(start)
    top = _as_top(start) if start.torque is None and engine == "auto" else None
    if top is not None:
        return _heavy(start, *top)
    from rigidcli.studies.euler.driven import driven

    try:
        return driven(start, engine, progress)
    except ValueProblem as problem:
        key = ".".join(map(str, ("motion", *problem.path)))
        raise document.refusal(problem.message, key, hint=problem.hint) from None


def beginning(document: Document) -> Start:
    """What the document says of the motion's beginning, and what drives it."""
    _require_numbers(document)
    motion = document.motion or Motion()
    if motion.omega is not None:
        return _of_body(document, motion)
    if document.top is not None:
        return _of_top(document, motion, document.top)
    missing = "body" if document.body is None else "motion.omega"
    raise document.refusal("missing", missing, hint="`euler` needs a `body` and `motion.omega`, or a `top`")


def _require_numbers(document: Document) -> None:
    if not document.arithmetic.exact:
        return
    symbols = [name for name, value in (document.parameters or {}).items() if value is None]
    if not symbols:
        raise UsageError("a motion in time has no exact results", hint="leave out `--exact`")
    raise DocumentError(
        [
            document.problem("missing: a motion in time needs its value", f"parameters.{name}")
            for name in symbols
        ]
    )


def _of_body(document: Document, motion: Motion) -> Start:
    if document.body is None:
        raise document.refusal("missing, expected a body", "body")
    axes = document.axes @ document.principal.axes.T
    along = document.turning
    omega = axes @ along if motion.basis == "principal" else np.array(motion.omega)
    notes: tuple[str, ...] = ()
    if document.top is not None:
        notes += ("`motion.omega` is given, so that `top` is not used",)
    weight = np.zeros(3)
    if isinstance(motion.torque, Weight):
        body = document.properties
        if body.mass is None:
            raise document.refusal("missing: a weight needs it", "body.mass")
        weight = (body.com - document.point) * body.mass * motion.torque.gravity
        if not weight.any():
            notes += ("the body is held at its centre of mass, so that its weight has no torque",)
    torque = motion.torque if isinstance(motion.torque, OwnTorque) else None
    if len(document.principal.groups[-1]) > 1 and torque is not None and torque.names & {"ux", "uy", "uz"}:
        notes += ("e3 is not unique, as its moment equals another: `ux uy uz` are the one that is printed",)
    shown = _turns(omega, at_rest=torque is None and not weight.any())
    return Start(
        document.tensor,
        omega,
        _orientation(document, motion),
        weight,
        torque,
        motion.instants(shown.duration),
        motion.tolerance or DEFAULT_TOLERANCE,
        axes[:, 2],
        notes=(*notes, *_default_duration(motion, shown)),
    )


def _orientation(document: Document, motion: Motion) -> Floats:
    """The quaternion from the document's axes to those of space; of the sign that is given, if any is."""
    if isinstance(motion.orientation, Quaternion):
        given = np.array(motion.orientation.quaternion)
        unit: Floats = given / FLOAT.hypot(*given)
        return unit
    return rotation.as_quaternion(document.orientation)


def _of_top(document: Document, motion: Motion, section: Top) -> Start:
    """A top that leans at the beginning so that phi = psi = 0: towards -y of space."""
    top = document.heavy_top
    needed = {"tilt": section.tilt, "lambda1": top.lambda1}
    missing = [key for key, value in needed.items() if value is None]
    if missing:
        raise DocumentError([document.problem("missing: `euler` needs it", f"top.{key}") for key in missing])
    if motion.orientation is not None or isinstance(motion.torque, Weight):
        key = "orientation" if motion.orientation is not None else "torque.gravity"
        raise document.refusal("the `top` tells this already", f"motion.{key}")
    assert section.tilt is not None
    assert top.lambda1 is not None
    if section.spin and top.lambda3 <= ZERO_MOMENT * top.lambda1:
        problem = "the body is linear: it has no moment about its line, and cannot turn about it"
        raise document.refusal(problem, "top.spin", hint="set it to zero: what is left is a pendulum")
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
    sine, cosine = heavytop.sine(section.tilt, FLOAT), heavytop.cosine(section.tilt, FLOAT)
    local = np.array([section.nutation, precession * sine, section.spin])
    axes = rotation.onto(tuple(top.axis), FLOAT)
    tilted = np.array([[1.0, 0, 0], [0, cosine, -sine], [0, sine, cosine]])
    tensor = axes @ np.diag([top.lambda1, top.lambda1, top.lambda3]) @ axes.T
    period = heavytop.nutation(
        top.lambda1, top.lambda3, section.spin, section.tilt, precession, section.nutation, fall
    ).period
    torque = motion.torque if isinstance(motion.torque, OwnTorque) else None
    shown = _turns(local, at_rest=torque is None and period is None)
    if period is not None:
        shown = Shown(DEFAULT_NUTATIONS * period, f"{DEFAULT_NUTATIONS} nutations are")
    return Start(
        (tensor + tensor.T) / 2,
        axes @ local,
        rotation.as_quaternion(tilted @ axes.T),
        top.axis * fall,
        torque,
        motion.instants(shown.duration),
        motion.tolerance or DEFAULT_TOLERANCE,
        axes[:, 2],
        axes,
        (*top.remarks, *_default_duration(motion, shown)),
    )


class Shown(NamedTuple):
    """The duration (s) where the document does not give it, and in words: `10 turns are`, or nothing."""

    duration: float
    words: str


def _turns(omega: Floats, *, at_rest: bool) -> Shown:
    """Some turns of a body that turns, and a second of one that does not yet, or never if it is `at_rest`."""
    if rate := FLOAT.hypot(*omega):
        return Shown(2 * math.pi * DEFAULT_TURNS / rate, f"{DEFAULT_TURNS} turns are")
    return Shown(1.0, "" if at_rest else "1 s is")


def _default_duration(motion: Sampling, shown: Shown) -> tuple[str, ...]:
    given = motion.duration is not None or motion.times is not None or not shown.words
    return () if given else (f"`motion.duration` is not given: {shown.words} shown",)


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
