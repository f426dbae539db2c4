"""Driven motion: Euler's equations with a torque, integrated, and checked by the balances."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rigidcli.core import integrate, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.principal import ZERO_MOMENT
from rigidcli.core.solution import digits, joined
from rigidcli.errors import ComputationError, Path, ValueProblem, at
from rigidcli.model.environment import Formula
from rigidcli.model.motion import VARIABLES, SpaceTorque
from rigidcli.studies.euler.balance import BalanceErrors, balance_errors
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.euler.trajectory import Trajectory, drift_of
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.tree import ZERO, Name, Node, bound, number
from rigidcli.symbolic.mechanics import rigid_body

COARSER = (1e4, 1e2, 10.0)
"""Ratios of the tolerance of a second integration, which estimates the error, to that of the first.

The coarsest is tried first, as it takes the least time.
"""

COMPARED = 64
"""Times at which the two integrations are compared: enough to meet the largest difference nearly."""

COARSEST = 1e-2
"""The largest tolerance of the second integration: a coarser one follows no motion."""

PROPORTIONAL = 0.1
"""Largest error (rad) of the second integration that is still proportional to its tolerance."""

ROUNDS = 4
"""Largest number of times that an integration is repeated because its steps went over a torque."""

TRIED = 64
"""Random states at which a torque is evaluated, to see whether its component along a line is always zero."""

NOTHING = 1e-12
"""A component below this, in units of the largest of the torque, is zero but for rounding."""


@dataclass(frozen=True, eq=False)
class _Equations:
    """A problem along principal axes: `axes` (3 by 3) has them as columns, in the document's components."""

    problem: InitialValueProblem
    moments: Floats
    axes: Floats
    torque: list[Node]
    state: Floats
    engine: integrate.Engine
    max_steps: int | None

    @cached_property
    def right_side(self) -> integrate.Flow:
        """The derivatives of the state, as a function."""
        return code.function(rigid_body.equations(self.moments, self.torque), rigid_body.STATE, {})

    def along_document(self, states: Floats) -> tuple[Floats, Floats]:
        """omega (n, 3) and orientation (n, 4) along the document's axes, of states (n, 7)."""
        quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
        back = rotation.as_quaternion(self.axes) * [1, -1, -1, -1]
        return (states[:, 4:] / self.moments) @ self.axes.T, rotation.compose(quaternions, back)

    def followed(
        self, tolerance: float, places: Floats, progress: Callable[[float], None] | None = None
    ) -> tuple[integrate.Solution, Floats, BalanceErrors]:
        """A solution that has followed all of the torque, the spans (k by 2, s) repeated for it, its errors.

        An integrator looks at the torque now and then only, and goes over what acts in between. Where that
        shows in the balances, it begins anew with steps that are short, as it does in the given `places` from
        the first; if that does not help, the solution stays as it was.
        """
        solution = self._solution(tolerance, places, progress)
        balance = self._balance(tolerance, solution)
        for _ in range(ROUNDS):
            if not len(balance.missed):
                break
            more = _merged(places, balance.missed)
            other = self._solution(tolerance, more, progress)
            found = self._balance(tolerance, other)
            if max(found.drift.values()) > max(balance.drift.values()) / 2:
                break
            solution, places, balance = other, more, found
        return solution, places, balance

    def _solution(
        self, tolerance: float, places: Floats, progress: Callable[[float], None] | None
    ) -> integrate.Solution:
        """The solution for all times, begun anew at both ends of each of the `places` (k by 2, s)."""
        parts: list[integrate.Solution] = []
        state, begin, last = self.state, 0.0, float(self.problem.times[-1])
        for index, end in enumerate([*places.ravel().tolist(), last]):
            if end <= begin and (parts or end < last):
                continue
            part = integrate.integrate(
                self.right_side,
                state,
                (begin, end),
                tolerance=tolerance,
                blocks=(4, 3),
                # A short span is not worth the compilation.
                engine="runge-kutta" if index % 2 else self.engine,
                progress=_share(progress, begin, end, last),
                name="the motion",
                most_steps=self.max_steps,
            )
            parts.append(part)
            state, begin = part.at(np.array([end]))[0], end
        return joined(parts)

    def _balance(self, tolerance: float, solution: integrate.Solution) -> BalanceErrors:
        """The balances; under weight alone, energy is conserved, and so is L about the vertical."""
        problem = self.problem
        if problem.torque is None:
            drift = drift_of(problem, *self.along_document(solution.at(solution.knots)))
            errors = {key: drift[key] for key in ("energy", "angular_momentum")}
            return BalanceErrors(errors, np.empty((0, 2)))
        timed = "t" in problem.torque.names
        return balance_errors(self.torque, self.moments, solution, tolerance=tolerance, timed=timed)


def driven_trajectory(
    problem: InitialValueProblem,
    engine: integrate.Engine,
    progress: Callable[[float], None] | None,
    max_steps: int | None = None,
) -> Trajectory:
    """The trajectory of a body that a torque drives.

    Raises ComputationError where it ends early or cannot begin, and ValueProblem, with the path in
    `motion`, for a torque that cannot be: one that is too large, or about a line without a moment.
    """
    equations = replace(_along_principal_axes(problem, engine), max_steps=max_steps)
    solution, places, balance = equations.followed(problem.tolerance, np.empty((0, 2)), progress)
    omega, orientation = equations.along_document(solution.at(problem.times))
    compared = np.linspace(0.0, problem.times[-1], COMPARED)
    _, fine = equations.along_document(solution.at(compared))

    def off(tolerance: float) -> float:
        coarser, *_ = equations.followed(tolerance, places)
        _, other = equations.along_document(coarser.at(compared))
        return float(rotation.angles_between(other, fine).max())

    error = _error(problem.tolerance, off)
    rounding = np.finfo(np.float64).eps * solution.steps**0.5
    notes = problem.notes
    if len(balance.missed):
        near = f"the balance of energy or angular momentum is missed near t = {balance.missed[0, 0]:.6g}"
        notes += (f"{near}: the integration may have gone over a torque that acts for a short while",)
    lengths = np.linalg.norm(solution.at(solution.knots)[:, :4], axis=1)
    return Trajectory(
        replace(problem, notes=notes),
        omega,
        rotation.continuous(orientation),
        None,
        solution.method,
        solution.steps,
        digits(max(error, rounding, *balance.drift.values())),
        balance.drift | {"quaternion": float(np.abs(lengths - 1).max())},
    )


def _error(tolerance: float, off: Callable[[float], float]) -> float:
    """The error (rad) of a solution, from how far one of a coarser tolerance is `off`.

    Errors are proportional to tolerances as long as they are small.
    """
    error = math.pi
    for ratio in COARSER:
        coarser = min(COARSEST, ratio * tolerance)
        with suppress(ComputationError):
            error = off(coarser)
            if error <= PROPORTIONAL:
                return error * tolerance / coarser
    return error


def _share(
    progress: Callable[[float], None] | None, begin: float, end: float, last: float
) -> Callable[[float], None] | None:
    """A function that reports all that is done, given the fraction of the span from `begin` to `end`."""
    return progress and (lambda fraction: progress((begin + (end - begin) * fraction) / last))


def _merged(places: Floats, more: Floats) -> Floats:
    """The spans of both (k by 2), in order, without what they share."""
    spans = np.concatenate([places, more])
    merged: list[list[float]] = []
    for begin, end in spans[np.argsort(spans[:, 0], kind="stable")].tolist():
        begin = max(begin, merged[-1][1]) if merged else begin
        if end > begin:
            merged.append([begin, end])
    return np.array(merged)


def _along_principal_axes(problem: InitialValueProblem, engine: integrate.Engine) -> _Equations:
    """The equations along principal axes; those of the document where they are principal.

    A linear body that does not turn about its line moves as a sphere would.
    """
    diagonal = np.diag(problem.tensor)
    if (problem.tensor == np.diag(diagonal)).all():
        moments, axes = diagonal, np.eye(3)
    else:
        moments, axes = problem.frame.moments, problem.shown @ problem.frame.axes.T
    turn = rotation.as_quaternion(axes)
    momentum = axes.T @ (problem.tensor @ problem.omega)
    state = np.concatenate([rotation.compose(problem.orientation, turn), momentum])
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
    torque = _torque(problem, moments, axes, turn)
    for line in np.flatnonzero(idle):
        if not _is_across(torque, int(line), state, float(problem.times[-1])):
            raise ValueProblem(
                "the body is linear: a torque about its line, where it has no moment, has no finite effect",
                path=("torque",),
                hint="give a torque across the line, or the body some thickness",
            )
        torque[line] = ZERO
    return _Equations(problem, moments, axes, torque, state, engine, None)


def _is_across(torque: Sequence[Node], line: int, state: Floats, end: float) -> bool:
    """Whether the torque has no component along a `line` about which the body does not turn, in any state."""
    if torque[line] == ZERO:
        return True
    tried = np.random.default_rng(0).uniform(-1, 1, (TRIED, len(rigid_body.STATE)))
    tried[:, 0] = (1 + tried[:, 0]) / 2 * end
    tried[:, 1:5] /= np.linalg.norm(tried[:, 1:5], axis=1, keepdims=True)
    tried[:, 5:] *= 2 * (np.abs(state[4:]).max() or 1.0)
    tried[:, 5 + line] = 0.0
    with np.errstate(all="ignore"):
        acting = np.array(np.broadcast_arrays(*code.function(torque, rigid_body.STATE, {})(np)(*tried.T)))
        known = acting[:, np.isfinite(acting).all(axis=0)]
        return bool((np.abs(known[line]) <= NOTHING * np.abs(known).max(axis=0)).all())


def _torque(problem: InitialValueProblem, moments: Floats, axes: Floats, turn: Floats) -> list[Node]:
    """The torque along principal axes, as trees in the names of the state."""
    state = np.array([Name(name) for name in rigid_body.STATE[1:]])
    q, momentum = state[:4], state[4:]
    back = q * [1, -1, -1, -1]
    total = np.array([ZERO] * 3)
    if problem.weight.any():
        total = np.cross(axes.T @ problem.weight, -rotation.turned(back, np.array([0, 0, 1])))
    if problem.torque is None:
        return list(total)
    omega = 1 / moments * momentum
    meanings = [
        Name("t"),
        *(axes @ omega),
        *rotation.turned(q, omega),
        *rotation.compose(q, turn * [1, -1, -1, -1]),
        *rotation.turned(q, axes.T @ problem.third),
    ]
    values = dict(zip(VARIABLES, meanings, strict=True))
    in_space = isinstance(problem.torque, SpaceTorque)
    own = [
        _bound(formula, values, ("torque", "space" if in_space else "body", index))
        for index, formula in enumerate(problem.torque.components)
    ]
    return list(total + (rotation.turned(back, np.array(own)) if in_space else axes.T @ np.array(own)))


def _bound(formula: Formula, values: dict[str, Node], path: Path) -> Node:
    """The formula in the names of the state. Raises ValueProblem where a part of it has no value."""
    constants = {name: number(value) for name, value in formula.constants.items()}
    node = bound(formula.expression.root, values | constants)
    with at(*path):
        code.function([node], rigid_body.STATE, {})
    return node
