"""Driven motion: Euler's equations with a torque, integrated, and checked by the balances."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from rigidcli.core import integrate, many, rotation
from rigidcli.core.arithmetic import EPS, Floats
from rigidcli.core.dormand_prince import slices
from rigidcli.core.kicks import Watched, foreseen
from rigidcli.core.second_run import MISSED, compared, rounding, unshared
from rigidcli.core.solution import Flow, Solution, digits
from rigidcli.document.document import Document
from rigidcli.document.motion import TORQUE_VARIABLES, SpaceTorque
from rigidcli.errors import Path, RigidError, ValueProblem, at
from rigidcli.fields.environment import BoundExpression
from rigidcli.language import code, tree
from rigidcli.language.tree import ZERO, Name, Node, bound, number
from rigidcli.mechanics import rigid_body
from rigidcli.studies.euler.motion import InitialValueProblem, Trajectory, drift_of

# The problem with omega (m, 3) and orientation (m, 4) of the starts at these places.
Starts: TypeAlias = Callable[[range], InitialValueProblem]
# What `together` gives.
Samples: TypeAlias = Callable[[range], tuple[Floats, Floats, Floats, NDArray[np.bool_]]]
NOTHING = 1e-12  # a component below this, in units of the largest of the torque, is zero but for rounding


def driven_trajectory(
    problem: InitialValueProblem,
    method: integrate.Engine,
    max_step: float,
    progress: Callable[[float], None] | None,
    starts: int = 1,
) -> Trajectory:
    """The trajectory of a body that a torque drives, one of so many `starts`, in steps of `max_step` at most.

    It is integrated along principal axes. Raises ComputationError where it ends early or cannot begin. Raises
    ValueProblem, with the path in `motion`, for a torque that is too large, or about a line without a moment.
    """
    equations = _equations(problem)
    moments, _, _, acting, slopes, watched, idle = equations
    start = _starts(problem, equations)[0]
    name, end = "the motion", float(problem.times[-1])
    stops, longest = foreseen(watched, end, name)
    follow = partial(
        integrate.integrate,
        code.function(slopes, rigid_body.STATE, {}),
        start,
        (0.0, end),
        blocks=(4, 3),
        roundings=code.function([tree.rounding(slope) for slope in slopes], rigid_body.STATE, {}),
        name=name,
        longest=min(longest, max_step),
        starts=starts,
    )
    solution = follow(tolerance=problem.tolerance, engine=method, stops=stops.tolist(), progress=progress)
    solution, error, lost = compared(
        solution,
        lambda tolerance, stops: follow(tolerance=tolerance, stops=stops, like=solution),
        watched,
        stops,
        _turned_apart,
        problem.times,
    )
    _require_across(acting, np.flatnonzero(idle).tolist(), solution)

    # Weight alone conserves the energy, and L about the vertical.
    gained = None if problem.torque is None else partial(_gained, acting, moments, solution)
    drift = drift_of(problem, *equations.along_document(solution.at(solution.knots)), gained)
    trusted = digits(max(error, rounding(solution, stops), drift["energy"], drift["angular_momentum"]))
    lengths = np.linalg.norm(solution.at(solution.knots)[:, :4], axis=1)
    drift["quaternion"] = float(np.abs(lengths - 1).max())
    notes = problem.notes if solution.note is None else (*problem.notes, solution.note)
    if lost is not None:
        notes += (unshared("motion", lost, may_be_chaotic=True),)
    omega, orientation = equations.along_document(solution.at(problem.times))
    problem, orientation = replace(problem, notes=notes), rotation.continuous(orientation)
    return Trajectory(problem, omega, orientation, None, solution.method, solution.steps, trusted, drift)


class _Equations(NamedTuple):
    """Euler's equations along principal axes: moments (3), axes (3 by 3), the turn of the document to them.

    `idle` (3) are the axes without a moment.
    """

    moments: Floats
    axes: Floats
    turn: Floats
    acting: Flow
    slopes: list[Node]
    watched: Watched
    idle: NDArray[np.bool_]

    def along_document(self, states: Floats) -> tuple[Floats, Floats]:
        """omega (..., 3) and orientation (..., 4) in the states (..., 7), along the document's axes."""
        quaternions = states[..., :4] / np.linalg.norm(states[..., :4], axis=-1, keepdims=True)
        turned = rotation.compose(quaternions, rotation.inverse(self.turn))
        return (states[..., 4:] / self.moments) @ self.axes.T, turned


def _equations(problem: InitialValueProblem) -> _Equations:
    moments, axes = _principal(problem)
    idle = moments <= 0
    if idle.all():
        raise ValueProblem(
            "the body is a point, which has no moment of inertia, so that a torque has no finite effect",
            path=("torque",),
            hint="give the body some extent",
        )
    turn = rotation.as_quaternion(axes)
    if idle.any():  # a linear body that does not turn about its line moves as a sphere would
        moments = np.full(3, moments.max())
    torque = _torque(problem, moments, axes, turn)
    across = [ZERO if is_idle else along for along, is_idle in zip(torque, idle, strict=True)]
    slopes = rigid_body.equations(moments, across)
    acting, watched = code.function(torque, rigid_body.STATE, {}), code.watched(slopes, rigid_body.STATE, {})
    return _Equations(moments, axes, turn, acting, slopes, watched, idle)


def _starts(problem: InitialValueProblem, equations: _Equations) -> Floats:
    """The quaternion and L of one start (1, 7), or of m of them (m, 7), along the principal axes."""
    omega = np.atleast_2d(problem.omega) @ equations.axes
    turned = np.atleast_2d(rotation.compose(problem.orientation, equations.turn))
    return np.concatenate([turned, np.where(equations.idle, 0.0, equations.moments * omega)], axis=1)


def together(document: Document, first: InitialValueProblem, starts: Starts) -> Samples | None:
    """A function from places to the motions of some starts in arrays, as `many` follows them; None without.

    It gives omega (m, k, 3) and orientation (m, k, 4), errors (m, rad), and which starts (m) go alone.
    """
    motion = document.motion
    try:
        equations = _equations(first)
        stops, longest = foreseen(equations.watched, float(first.times[-1]), "the motion")
    except RigidError:
        return None  # it is told of each start
    if motion is None or motion.method != "auto" or equations.idle.any():
        return None
    flow, moving = code.function(equations.slopes, rigid_body.STATE, {}), equations.watched.moving
    longest = min(longest, motion.max_step or math.inf)
    problem = many.ManyStarts(flow, None, moving, slices((4, 3)), first.tolerance, longest, stops.tolist())

    def samples(places: range) -> tuple[Floats, Floats, Floats, NDArray[np.bool_]]:
        begin = _starts(starts(places), equations).T
        paths, apart = many.twice(
            problem, begin, first.times, lambda one, other: _turned_apart(one.states, other.states)
        )
        error = np.maximum(apart.max(axis=0), EPS * (np.sqrt(paths.steps) + 4 * len(stops)))
        omega, orientation = equations.along_document(paths.states.transpose(2, 0, 1))
        # What two motions do not share is looked into alone.
        return omega, rotation.continuous(orientation), error, paths.alone | ~(error < MISSED)

    return samples


def _turned_apart(one: Floats, other: Floats) -> Floats:
    """The angles (k, or k by m; rad) between orientations in the states (k, 7, or k by 7 by m)."""
    return np.asarray(2 * np.linalg.norm((one - other)[:, :4], axis=1))


def _principal(problem: InitialValueProblem) -> tuple[Floats, Floats]:
    """The principal moments (3), and the axes as columns (3 by 3) in the document's components.

    They are the axes of the document where these are principal.
    """
    tensor = problem.tensor
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
        total = np.cross(axes.T @ problem.weight, -rotation.turned(rotation.inverse(q), np.array([0, 0, 1])))
    if problem.torque is None:
        return list(total)
    omega = 1 / moments * momentum
    meanings = [
        Name("t"),
        *(axes @ omega),
        *rotation.turned(q, omega),
        *rotation.compose(q, rotation.inverse(turn)),
        *rotation.turned(q, axes.T @ problem.third),
    ]
    values = dict(zip(TORQUE_VARIABLES, meanings, strict=True))
    in_space = isinstance(problem.torque, SpaceTorque)
    own = np.array(
        [
            _bound(formula, values, ("torque", "space" if in_space else "body", index))
            for index, formula in enumerate(problem.torque.components)
        ]
    )
    return list(total + (rotation.turned(rotation.inverse(q), own) if in_space else axes.T @ own))


def _bound(formula: BoundExpression, values: dict[str, Node], path: Path) -> Node:
    """The formula in the names of the state. Raises ValueProblem where a part of it has no value."""
    constants = {name: number(value) for name, value in formula.constants.items()}
    node = bound(formula.expression.root, values | constants)
    with at(*path):
        code.function([node], rigid_body.STATE, {})
    return node


def _gained(torque: Flow, moments: Floats, solution: Solution, size: float, fast: float) -> Floats:
    """The work and the impulse in space of a torque until the end of each step (m, 4).

    The work is the integral of N.omega, and the impulse that of N in space. L is in units of `size`, and
    omega in units of `fast`. The `torque` is along the axes of the `moments` (3, kg m^2). The quadrature
    is exact to the degree 11, beyond that of the method.
    """
    steps = np.diff(solution.knots)
    acting, gained = torque(np), np.zeros((len(steps) + 1, 4))
    with np.errstate(all="ignore"):
        for node, weight in zip(*np.polynomial.legendre.leggauss(6), strict=True):
            times = solution.knots[:-1] + steps * (1 + node) / 2
            states = solution.at(times)
            now = np.column_stack(np.broadcast_arrays(*acting(times, *states.T))) / size
            power = np.einsum("ij,ij->i", now, states[:, 4:] / moments / fast)
            change = np.column_stack([power, rotation.turned(states[:, :4], now)])
            gained[1:] += weight / 2 * steps[:, None] * change
    return np.cumsum(gained, axis=0)
