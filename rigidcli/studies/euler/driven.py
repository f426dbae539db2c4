"""Driven motion: Euler's equations with a torque, integrated, and checked by the balances."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from rigidcli.core import integrate, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.estimate import compared, foreseen, unshared
from rigidcli.core.solution import Flow, Solution, digits
from rigidcli.document.motion import VARIABLES, SpaceTorque
from rigidcli.errors import Path, ValueProblem, at
from rigidcli.fields.environment import Formula
from rigidcli.language import code
from rigidcli.language.tree import ZERO, Name, Node, bound, number
from rigidcli.mechanics import rigid_body
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.euler.trajectory import Trajectory, drift_of

NOTHING = 1e-12
"""A component below this, in units of the largest of the torque, is zero but for rounding."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
"""Nodes and weights of the quadrature in a step; it is exact to the degree 11, beyond that of the method."""

BACK = np.array([1, -1, -1, -1])
"""A unit quaternion times this is that of the turn back."""


def driven_trajectory(
    problem: InitialValueProblem,
    method: integrate.Engine,
    max_step: float,
    progress: Callable[[float], None] | None,
    starts: int = 1,
) -> Trajectory:
    """The trajectory of a body that a torque drives, one of so many `starts`, in steps of `max_step` at most.

    It is integrated along principal axes. Raises ComputationError where it ends early or cannot begin, and
    ValueProblem, with the path in `motion`, for a torque that is too large, or about a line without a moment.
    """
    moments, axes = _principal(problem)
    idle = moments <= 0
    if idle.all():
        raise ValueProblem(
            "the body is a point, which has no moment of inertia, so that a torque has no finite effect",
            path=("torque",),
            hint="give the body some extent",
        )
    turn = rotation.as_quaternion(axes)
    start = np.concatenate([rotation.compose(problem.orientation, turn), moments * (axes.T @ problem.omega)])
    if idle.any():  # a linear body that does not turn about its line moves as a sphere would
        moments = np.full(3, moments.max())
        start[4:][idle] = 0.0
    torque = _torque(problem, moments, axes, turn)
    acting = code.function(torque, rigid_body.STATE, {})
    across = [ZERO if is_idle else along for along, is_idle in zip(torque, idle, strict=True)]
    slopes = rigid_body.equations(moments, across)
    watched, name, end = code.watched(slopes, rigid_body.STATE, {}), "the motion", float(problem.times[-1])
    stops, longest = foreseen(watched, end, name)
    follow = partial(
        integrate.integrate,
        code.function(slopes, rigid_body.STATE, {}),
        start,
        (0.0, end),
        blocks=(4, 3),
        name=name,
        longest=min(longest, max_step),
        starts=starts,
    )
    solution = follow(tolerance=problem.tolerance, engine=method, stops=stops.tolist(), progress=progress)
    _require_across(acting, np.flatnonzero(idle).tolist(), solution)
    error, lost = compared(
        solution,
        lambda tolerance, stops: follow(tolerance=tolerance, stops=stops, like=solution),
        watched,
        stops,
        lambda one, other: 2 * np.linalg.norm((one - other)[:, :4], axis=1),
        problem.times,
    )

    def along_document(times: Floats) -> tuple[Floats, Floats]:
        states = solution.at(times)
        quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
        return (states[:, 4:] / moments) @ axes.T, rotation.compose(quaternions, turn * BACK)

    if problem.torque is None:  # weight alone conserves the energy, and L about the vertical
        drift = drift_of(problem, *along_document(solution.knots))
    else:
        drift = _drift_of_balances(acting, moments, solution)
    rounding = np.finfo(np.float64).eps * solution.steps**0.5
    trusted = digits(max(error, rounding, drift["energy"], drift["angular_momentum"]))
    lengths = np.linalg.norm(solution.at(solution.knots)[:, :4], axis=1)
    drift["quaternion"] = float(np.abs(lengths - 1).max())
    notes = problem.notes if solution.note is None else (*problem.notes, solution.note)
    if lost is not None:
        notes += (unshared("motion", lost, may_be_chaotic=True),)
    omega, orientation = along_document(problem.times)
    problem, orientation = replace(problem, notes=notes), rotation.continuous(orientation)
    return Trajectory(problem, omega, orientation, None, solution.method, solution.steps, trusted, drift)


def _principal(problem: InitialValueProblem) -> tuple[Floats, Floats]:
    """The principal moments (3), and the axes as columns (3 by 3) in the document's components.

    They are the axes of the document where these are principal.
    """
    tensor = problem.inertia.tensor
    diagonal = np.diag(tensor)
    if (tensor == np.diag(diagonal)).all():
        return diagonal, np.eye(3)
    return problem.frame.moments, problem.shown @ problem.frame.axes.T


def _require_across(acting: Flow, idle: Sequence[int], solution: Solution) -> None:
    """Raise ValueProblem where the torque on a linear body has a component along its line."""
    states = solution.at(solution.knots)
    with np.errstate(all="ignore"):
        torques = np.array(np.broadcast_arrays(*acting(np)(solution.knots, *states.T)))
    if (np.abs(torques[idle]) > NOTHING * np.abs(torques).max(axis=0)).any():
        raise ValueProblem(
            "the body is linear: a torque about its line, where it has no moment, has no finite effect",
            path=("torque",),
            hint="give a torque across the line, or the body some thickness",
        )


def _torque(problem: InitialValueProblem, moments: Floats, axes: Floats, turn: Floats) -> list[Node]:
    """The torque along principal axes, as trees in the names of the state."""
    state = np.array([Name(name) for name in rigid_body.STATE[1:]])
    q, momentum = state[:4], state[4:]
    total = np.array([ZERO] * 3)
    if problem.weight.any():
        total = np.cross(axes.T @ problem.weight, -rotation.turned(q * BACK, np.array([0, 0, 1])))
    if problem.torque is None:
        return list(total)
    omega = 1 / moments * momentum
    meanings = [
        Name("t"),
        *(axes @ omega),
        *rotation.turned(q, omega),
        *rotation.compose(q, turn * BACK),
        *rotation.turned(q, axes.T @ problem.third),
    ]
    values = dict(zip(VARIABLES, meanings, strict=True))
    in_space = isinstance(problem.torque, SpaceTorque)
    own = np.array(
        [
            _bound(formula, values, ("torque", "space" if in_space else "body", index))
            for index, formula in enumerate(problem.torque.components)
        ]
    )
    return list(total + (rotation.turned(q * BACK, own) if in_space else axes.T @ own))


def _bound(formula: Formula, values: dict[str, Node], path: Path) -> Node:
    """The formula in the names of the state. Raises ValueProblem where a part of it has no value."""
    constants = {name: number(value) for name, value in formula.constants.items()}
    node = bound(formula.expression.root, values | constants)
    with at(*path):
        code.function([node], rigid_body.STATE, {})
    return node


def _drift_of_balances(torque: Flow, moments: Floats, solution: Solution) -> dict[str, float]:
    """The largest errors of two balances at the ends of steps, in units of the largest energy and |L|.

    The work of the torque, the integral of N.omega, is the change of the kinetic energy, and the integral of
    N in space is the change of L in space. The `torque` is along the axes of the `moments` (3, kg m^2). All
    is in units of the largest L and omega, so that squares of tiny and huge numbers are within range.
    """
    states, steps = solution.at(solution.knots), np.diff(solution.knots)
    unit, rate = float(np.abs(states[:, 4:]).max()), float(np.abs(states[:, 4:] / moments).max())
    if not unit:
        return {"energy": 0.0, "angular_momentum": 0.0}
    acting, gained = torque(np), np.zeros((len(steps), 4))
    with np.errstate(all="ignore"):
        for node, weight in zip(NODES, WEIGHTS, strict=True):
            times = solution.knots[:-1] + steps * (1 + node) / 2
            there = solution.at(times)
            now = np.column_stack(np.broadcast_arrays(*acting(times, *there.T))) / unit
            power = np.einsum("ij,ij->i", now, there[:, 4:] / moments / rate)
            change = np.column_stack([power, rotation.turned(there[:, :4], now)])
            gained += weight / 2 * steps[:, None] * change
    sums = np.vstack([np.zeros(4), np.cumsum(gained, axis=0)])
    quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    momentum = states[:, 4:] / unit
    energy = np.einsum("ij,ij->i", states[:, 4:] / moments / rate, momentum) / 2
    has = np.column_stack([energy, rotation.turned(quaternions, momentum)])
    missing = np.nan_to_num(has - has[0] - sums, nan=1.0)
    largest = np.linalg.norm(has[:, 1:], axis=1).max()
    return {
        "energy": float(np.abs(missing[:, 0]).max() / (energy + np.abs(sums[:, 0])).max()),
        "angular_momentum": float(np.linalg.norm(missing[:, 1:], axis=1).max() / largest),
    }
