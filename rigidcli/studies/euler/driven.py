"""Driven motion: Euler's equations with a torque, integrated, and checked by the balances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rigidcli.core import integrate, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.estimate import compared, foreseen, unshared
from rigidcli.core.solution import digits
from rigidcli.document.motion import VARIABLES, SpaceTorque
from rigidcli.errors import Path, ValueProblem, at
from rigidcli.fields.environment import Formula
from rigidcli.language import code
from rigidcli.language.tree import ZERO, Name, Node, bound, number
from rigidcli.mechanics import rigid_body
from rigidcli.studies.euler.balance import drift_of_balances
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.euler.trajectory import Trajectory, drift_of

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

    def along_document(self, states: Floats) -> tuple[Floats, Floats]:
        """omega (n, 3) and orientation (n, 4) along the document's axes, of states (n, 7)."""
        quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
        back = rotation.as_quaternion(self.axes) * [1, -1, -1, -1]
        return (states[:, 4:] / self.moments) @ self.axes.T, rotation.compose(quaternions, back)

    def drift(self, solution: integrate.Solution) -> dict[str, float]:
        """The errors of the balances; weight alone conserves the energy, and L about the vertical."""
        if self.problem.torque is None:
            drift = drift_of(self.problem, *self.along_document(solution.at(solution.knots)))
            return {key: drift[key] for key in ("energy", "angular_momentum")}
        torque = code.function(self.torque, rigid_body.STATE, {})
        return drift_of_balances(torque, self.moments, solution)


def driven_trajectory(
    problem: InitialValueProblem,
    method: integrate.Engine,
    max_step: float,
    progress: Callable[[float], None] | None,
    starts: int = 1,
) -> Trajectory:
    """The trajectory of a body that a torque drives, one of so many `starts`, in steps of `max_step` at most.

    Raises ComputationError where it ends early or cannot begin, and ValueProblem, with the path in
    `motion`, for a torque that cannot be: one that is too large, or about a line without a moment.
    """
    equations, name, end = _along_principal_axes(problem), "the motion", float(problem.times[-1])
    slopes = rigid_body.equations(equations.moments, equations.torque)
    watched = code.watched(slopes, rigid_body.STATE, {})
    stops, longest = foreseen(watched, end, name)
    follow = partial(
        integrate.integrate,
        code.function(slopes, rigid_body.STATE, {}),
        equations.state,
        (0.0, end),
        blocks=(4, 3),
        name=name,
        longest=min(longest, max_step),
        starts=starts,
    )
    solution = follow(tolerance=problem.tolerance, engine=method, stops=stops.tolist(), progress=progress)
    omega, orientation = equations.along_document(solution.at(problem.times))
    error, lost = compared(
        solution,
        lambda tolerance, stops: follow(tolerance=tolerance, stops=stops, like=solution),
        watched,
        stops,
        lambda one, other: 2 * np.linalg.norm((one - other)[:, :4], axis=1),
        problem.times,
    )
    rounding = np.finfo(np.float64).eps * solution.steps**0.5
    notes = problem.notes if solution.note is None else (*problem.notes, solution.note)
    if lost is not None:
        notes += (unshared("motion", lost, may_be_chaotic=True),)
    lengths = np.linalg.norm(solution.at(solution.knots)[:, :4], axis=1)
    drift = equations.drift(solution)
    return Trajectory(
        replace(problem, notes=notes),
        omega,
        rotation.continuous(orientation),
        None,
        solution.method,
        solution.steps,
        digits(max(error, rounding, *drift.values())),
        drift | {"quaternion": float(np.abs(lengths - 1).max())},
    )


def _along_principal_axes(problem: InitialValueProblem) -> _Equations:
    """The equations along principal axes, which are the document's axes where these are principal.

    A linear body that does not turn about its line moves as a sphere would.
    """
    tensor = problem.inertia.tensor
    diagonal = np.diag(tensor)
    if (tensor == np.diag(diagonal)).all():
        moments, axes = diagonal, np.eye(3)
    else:
        moments, axes = problem.frame.moments, problem.shown @ problem.frame.axes.T
    turn = rotation.as_quaternion(axes)
    momentum = moments * (axes.T @ problem.omega)
    state = np.concatenate([rotation.compose(problem.orientation, turn), momentum])
    idle = moments <= 0
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
    return _Equations(problem, moments, axes, torque, state)


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
