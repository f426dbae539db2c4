"""Driven motion: the equations of a document's body with its torque, integrated and held against the laws."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core import integrate, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.principal import ZERO_MOMENT, principal_frame
from rigidcli.core.solution import digits, joined
from rigidcli.errors import ComputationError, Path, ValueProblem
from rigidcli.model.environment import Formula
from rigidcli.model.motion import VARIABLES, SpaceTorque
from rigidcli.studies.euler.balance import Ledger, ledger
from rigidcli.studies.euler.trajectory import Start, Trajectory, conserved
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.tree import ONE, ZERO, Name, Node, bound, minus, number, plus, times
from rigidcli.symbolic.mechanics import rigid_body

SECOND_OPINIONS = (1e4, 1e2, 10.0)
"""How much coarser a second integration is, from which the error of the first is estimated."""

COMPARED = 64
"""Times at which the two are compared."""

COARSEST = 1e-2
"""The largest tolerance that it may have."""

PROPORTIONAL = 0.1
"""A second error (rad) beyond which it says little of the first: then a finer one is asked."""

ROUNDS = 4
"""Integrations, at most, of which each begins anew where the one before has missed the torque."""

TRIED = 64
"""States at which it is seen whether a torque about the line of a linear body is always zero."""

NOTHING = 1e-12
"""What is zero beside the torque."""


@dataclass(frozen=True, slots=True, eq=False)
class _System:
    """A start along principal axes: `axes` (3 by 3) has them as columns, in the document's components."""

    start: Start
    moments: Floats
    axes: Floats
    torque: list[Node]
    state: Floats

    @property
    def turn(self) -> Floats:
        """The quaternion from the principal axes to the document's."""
        return rotation.as_quaternion(self.axes)


def driven(start: Start, engine: integrate.Engine, progress: Callable[[float], None] | None) -> Trajectory:
    """Follow a driven motion.

    Raises ComputationError where it ends early or cannot begin, and ValueProblem, with the path in
    `motion`, for a torque that cannot be: one that is too large, or about a line without a moment.
    """
    system = _system(start)
    flow = code.function(rigid_body.equations(system.moments, system.torque), rigid_body.STATE, {})

    def solve(
        tolerance: float, places: Floats, progress: Callable[[float], None] | None
    ) -> integrate.Solution:
        return _solution(flow, system.state, float(start.times[-1]), tolerance, places, engine, progress)

    def direct(places: Floats) -> integrate.Solution:
        return solve(start.tolerance, places, progress)

    solution, places, book = _balanced(system, start.tolerance, direct, np.empty((0, 2)))
    omega, orientation = _seen(system, solution.at(start.times))
    compared = np.linspace(0.0, start.times[-1], COMPARED)
    _, fine = _seen(system, solution.at(compared))

    def off(tolerance: float) -> float:
        coarser, *_ = _balanced(system, tolerance, lambda places: solve(tolerance, places, None), places)
        _, other = _seen(system, coarser.at(compared))
        return float(rotation.angles_between(other, fine).max())

    error = _error(start.tolerance, off)
    rounding = np.finfo(np.float64).eps * solution.steps**0.5
    notes = start.notes
    if len(book.missed):
        near = f"the balance of energy or angular momentum is missed near t = {book.missed[0, 0]:.6g}"
        notes += (f"{near}: the integration may have gone over a torque that acts for a short while",)
    lengths = np.linalg.norm(solution.at(solution.knots)[:, :4], axis=1)
    return Trajectory(
        replace(start, notes=notes),
        omega,
        rotation.continuous(orientation),
        None,
        solution.method,
        solution.steps,
        digits(max(error, rounding, *book.drift.values())),
        book.drift | {"quaternion": float(np.abs(lengths - 1).max())},
    )


def _solution(
    flow: integrate.Flow,
    state: Floats,
    last: float,
    tolerance: float,
    places: Floats,
    engine: integrate.Engine,
    progress: Callable[[float], None] | None,
) -> integrate.Solution:
    """The solution up to the time `last`, begun anew at both ends of each of the `places` (k by 2, s)."""
    parts: list[integrate.Solution] = []
    begin = 0.0
    for index, end in enumerate([*places.ravel().tolist(), last]):
        if end <= begin and (parts or end < last):
            continue
        parts.append(
            integrate.integrate(
                flow,
                state,
                (begin, end),
                tolerance=tolerance,
                blocks=(4, 3),
                # What is short is not worth compiling.
                engine="runge-kutta" if index % 2 else engine,
                progress=_share(progress, begin, end, last),
                name="the motion",
            )
        )
        state, begin = parts[-1].at(np.array([end]))[0], end
    return joined(parts)


def _error(tolerance: float, off: Callable[[float], float]) -> float:
    """The error (rad) of a solution, from how far one of a coarser tolerance is `off`.

    Errors are proportional to tolerances as long as they are small.
    """
    error = math.pi
    for ratio in SECOND_OPINIONS:
        coarser = min(COARSEST, ratio * tolerance)
        with suppress(ComputationError):
            error = off(coarser)
            if error <= PROPORTIONAL:
                return error * tolerance / coarser
    return error


def _share(
    progress: Callable[[float], None] | None, begin: float, end: float, last: float
) -> Callable[[float], None] | None:
    """What tells of all that is done, given the fraction of the span from `begin` to `end` that is."""
    return progress and (lambda fraction: progress((begin + (end - begin) * fraction) / last))


def _balanced(
    system: _System, tolerance: float, solve: Callable[[Floats], integrate.Solution], places: Floats
) -> tuple[integrate.Solution, Floats, Ledger]:
    """A solution that has seen all of the torque, the spans (k by 2, s) where that took care, its ledger.

    An integrator looks at the torque now and then only, and goes over what acts in between. Where that
    shows in the ledger, it begins anew with steps that are short, as it does in the given `places` from the
    first; if that does not help, it is left.
    """
    solution = solve(places)
    book = _ledger(system, tolerance, solution)
    for _ in range(ROUNDS):
        if not len(book.missed):
            break
        more = _merged(places, book.missed)
        other = solve(more)
        found = _ledger(system, tolerance, other)
        if max(found.drift.values()) > max(book.drift.values()) / 2:
            break
        solution, places, book = other, more, found
    return solution, places, book


def _merged(places: Floats, more: Floats) -> Floats:
    """The spans of both (k by 2), in order, without what they share."""
    spans = np.concatenate([places, more])
    merged: list[list[float]] = []
    for begin, end in spans[np.argsort(spans[:, 0], kind="stable")].tolist():
        begin = max(begin, merged[-1][1]) if merged else begin
        if end > begin:
            merged.append([begin, end])
    return np.array(merged)


def _ledger(system: _System, tolerance: float, solution: integrate.Solution) -> Ledger:
    """The balances; under weight alone, energy is conserved, and so is L about the vertical."""
    start = system.start
    if start.torque is None:
        drift = conserved(start, *_seen(system, solution.at(solution.knots)))
        return Ledger({key: drift[key] for key in ("energy", "angular_momentum")}, np.empty((0, 2)))
    timed = "t" in start.torque.names
    return ledger(system.torque, system.moments, solution, tolerance=tolerance, timed=timed)


def _system(start: Start) -> _System:
    """The equations along principal axes; those of the document where they are principal.

    A linear body that does not turn about its line moves as a sphere would.
    """
    diagonal = np.diag(start.tensor)
    if (start.tensor == np.diag(diagonal)).all():
        moments, axes = diagonal, np.eye(3)
    else:
        frame = principal_frame(start.tensor)
        moments, axes = frame.moments, frame.axes.T
    turn = rotation.as_quaternion(axes)
    momentum = axes.T @ (start.tensor @ start.omega)
    state = np.concatenate([rotation.compose(start.orientation, turn), momentum])
    idle = moments <= ZERO_MOMENT * moments.max()
    if idle.all():
        raise ValueProblem(
            "the body is a point, which has no moment of inertia, so that a torque has no finite effect",
            path=("torque",),
            hint="give the body some extent",
        )
    if idle.any():
        moments = np.full(3, moments.max())
        state[4:][idle] = 0.0
    torque = _torque(start, moments, axes, turn)
    for line in np.flatnonzero(idle):
        if not _is_across(torque, int(line), state, float(start.times[-1])):
            raise ValueProblem(
                "the body is linear: a torque about its line, where it has no moment, has no finite effect",
                path=("torque",),
                hint="give a torque across the line, or the body some thickness",
            )
        torque[line] = ZERO
    return _System(start, moments, axes, torque, state)


def _is_across(torque: Sequence[Node], line: int, state: Floats, end: float) -> bool:
    """Whether the torque has no component along a `line` about which the body does not turn, in any state."""
    if torque[line] == ZERO:
        return True
    draw = random.Random(0)  # noqa: S311 - no secret
    tried = np.array([[draw.uniform(-1, 1) for _ in rigid_body.STATE] for _ in range(TRIED)])
    tried[:, 0] = (1 + tried[:, 0]) / 2 * end
    tried[:, 1:5] /= np.linalg.norm(tried[:, 1:5], axis=1, keepdims=True)
    tried[:, 5:] *= 2 * (np.abs(state[4:]).max() or 1.0)
    tried[:, 5 + line] = 0.0
    with np.errstate(all="ignore"):
        acting = np.array(np.broadcast_arrays(*code.function(torque, rigid_body.STATE, {})(np)(*tried.T)))
        known = acting[:, np.isfinite(acting).all(axis=0)]
        return bool((np.abs(known[line]) <= NOTHING * np.abs(known).max(axis=0)).all())


def _torque(start: Start, moments: Floats, axes: Floats, turn: Floats) -> list[Node]:
    """The torque along principal axes, as trees in the names of the state."""
    q, momentum = (
        [Name(name) for name in rigid_body.STATE[1:5]],
        [Name(name) for name in rigid_body.STATE[5:]],
    )
    total: Sequence[Node] = [ZERO] * 3
    if start.weight.any():
        arm = [number(component) for component in axes.T @ start.weight]
        down = [minus(part) for part in rigid_body.rotated(q, (ZERO, ZERO, ONE), back=True)]
        total = rigid_body.cross(arm, down)
    if start.torque is None:
        return list(total)
    omega = [times(number(1 / m), part) for m, part in zip(moments, momentum, strict=True)]
    back = [number(part) for part in turn * [1, -1, -1, -1]]
    third = axes.T @ start.third
    meanings = [
        Name("t"),
        *rigid_body.scaled(axes, omega),
        *rigid_body.rotated(q, omega),
        *rigid_body.compose(q, back),
        *rigid_body.rotated(q, [number(part) for part in third]),
    ]
    values = dict(zip(VARIABLES, meanings, strict=True))
    in_space = isinstance(start.torque, SpaceTorque)
    own = [
        _bound(formula, values, ("torque", "space" if in_space else "body", index))
        for index, formula in enumerate(start.torque.components)
    ]
    own = rigid_body.rotated(q, own, back=True) if in_space else rigid_body.scaled(axes.T, own)
    return [plus(*pair) for pair in zip(total, own, strict=True)]


def _bound(formula: Formula, values: dict[str, Node], path: Path) -> Node:
    """The formula in the names of the state. Raises ValueProblem where a part of it has no value."""
    constants = {name: number(value) for name, value in formula.constants.items()}
    node = bound(formula.expression.root, values | constants)
    try:
        code.function([node], rigid_body.STATE, {})
    except ValueProblem as problem:
        raise problem.below(*path) from None
    return node


def _seen(system: _System, states: Floats) -> tuple[Floats, Floats]:
    """omega and orientation along the document's axes, of states along principal ones."""
    quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    back = system.turn * [1, -1, -1, -1]
    return (states[:, 4:] / system.moments) @ system.axes.T, rotation.compose(quaternions, back)
