"""Driven motion: the equations of a document's body with its torque, integrated and held against the laws."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core import integrate, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.principal import ZERO_MOMENT, principal_frame
from rigidcli.errors import ComputationError
from rigidcli.model.environment import Formula
from rigidcli.model.motion import VARIABLES, SpaceTorque
from rigidcli.studies.trajectory import Start, Trajectory, conserved, digits
from rigidcli.symbolic import code, rigid
from rigidcli.symbolic.tree import Name, Node

SECOND_OPINION = 1e4
"""How much coarser the second integration is, from which the error of the first is estimated."""

NODES, WEIGHTS = np.polynomial.legendre.leggauss(6)
PANEL = 0.8
"""Largest angle (rad) that the body turns by in a panel of the quadrature of its torque."""

PANELS_AT_ONCE = 10_000


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
    """Follow a driven motion. Raises ComputationError where it ends early, or cannot begin."""
    system = _system(start)
    flow = code.function(rigid.equations(system.moments, system.torque), rigid.STATE, {})
    span = (0.0, float(start.times[-1]))

    def solve(
        tolerance: float, engine: integrate.Engine, progress: Callable[[float], None] | None
    ) -> integrate.Solution:
        return integrate.integrate(
            flow,
            system.state,
            span,
            tolerance=tolerance,
            blocks=(4, 3),
            engine=engine,
            progress=progress,
            name="the motion",
        )

    solution = solve(start.tolerance, engine, progress)
    omega, orientation = _seen(system, solution.at(start.times))
    coarser = solve(min(1e-3, start.tolerance * SECOND_OPINION), engine, None)
    _, other = _seen(system, coarser.at(start.times[-1:]))
    error = float(rotation.angles_between(other, orientation[-1:])[0])
    motion = Trajectory(
        start,
        omega,
        rotation.continuous(orientation),
        None,
        solution.method,
        solution.steps,
        digits(max(error / SECOND_OPINION, np.finfo(np.float64).eps * solution.steps**0.5)),
        {},
    )
    return replace(motion, drift=_drift(system, solution))


def _system(start: Start) -> _System:
    """The equations along principal axes; those of the document where they are principal."""
    diagonal = np.diag(start.tensor)
    if (start.tensor == np.diag(diagonal)).all():
        moments, axes = diagonal, np.eye(3)
    else:
        frame = principal_frame(start.tensor)
        moments, axes = frame.moments, frame.axes.T
    if moments.min() <= ZERO_MOMENT * moments.max():
        raise ComputationError(
            "a moment of inertia is zero, so that a torque about that axis has no finite effect",
            hint="give the body some thickness",
        )
    turn = rotation.as_quaternion(axes)
    state = np.concatenate([rotation.compose(start.orientation, turn), axes.T @ (start.tensor @ start.omega)])
    return _System(start, moments, axes, _torque(start, moments, axes, turn), state)


def _torque(start: Start, moments: Floats, axes: Floats, turn: Floats) -> list[Node]:
    """The torque along principal axes, as trees in the names of the state."""
    q, momentum = [Name(name) for name in rigid.STATE[1:5]], [Name(name) for name in rigid.STATE[5:]]
    total: Sequence[Node] = [rigid.ZERO] * 3
    if start.weight.any():
        arm = [rigid.number(component) for component in axes.T @ start.weight]
        down = [
            rigid.minus(part) for part in rigid.rotated(q, (rigid.ZERO, rigid.ZERO, rigid.ONE), back=True)
        ]
        total = rigid.cross(arm, down)
    if start.torque is None:
        return list(total)
    omega = [rigid.times(rigid.number(1 / m), part) for m, part in zip(moments, momentum, strict=True)]
    back = [rigid.number(part) for part in turn * [1, -1, -1, -1]]
    third = axes.T @ principal_frame(start.tensor).axes[2]
    meanings = [
        Name("t"),
        *rigid.scaled(axes, omega),
        *rigid.rotated(q, omega),
        *rigid.compose(q, back),
        *rigid.rotated(q, [rigid.number(part) for part in third]),
    ]
    values = dict(zip(VARIABLES, meanings, strict=True))
    if isinstance(start.torque, SpaceTorque):
        own = rigid.rotated(q, [_bound(formula, values) for formula in start.torque.space], back=True)
    else:
        own = rigid.scaled(axes.T, [_bound(formula, values) for formula in start.torque.body])
    return [rigid.plus(*pair) for pair in zip(total, own, strict=True)]


def _bound(formula: Formula, values: dict[str, Node]) -> Node:
    constants = {name: rigid.number(value) for name, value in formula.constants.items()}
    return rigid.bound(formula.expression.root, values | constants)


def _seen(system: _System, states: Floats) -> tuple[Floats, Floats]:
    """omega and orientation along the document's axes, of states along principal ones."""
    quaternions = states[:, :4] / np.linalg.norm(states[:, :4], axis=1, keepdims=True)
    back = system.turn * [1, -1, -1, -1]
    return (states[:, 4:] / system.moments) @ system.axes.T, rotation.compose(quaternions, back)


def _drift(system: _System, solution: integrate.Solution) -> dict[str, float]:
    """By how much the balances of energy and angular momentum are missed, at the ends of the steps.

    The work of the torque, the integral of N.omega, is held against the change of T, and the integral of
    N in space against the change of L in space, by Gauss-Legendre quadrature along the solution. Under
    weight alone energy is conserved, and so is L about the vertical.
    """
    states = solution.at(solution.knots)
    lengths = np.linalg.norm(states[:, :4], axis=1)
    quaternion = {"quaternion": float(np.abs(lengths - 1).max())}
    if system.start.torque is None:
        return conserved(system.start, *_seen(system, states)) | quaternion
    momentum = states[:, 4:]
    energy = np.einsum("ij,ij->i", momentum / system.moments, momentum) / 2
    space = rotation.turned(states[:, :4] / lengths[:, None], momentum)
    work, impulse = _ledger(system, solution)
    return {
        "energy": _miss((energy - energy[0] - work)[:, None], energy + np.abs(work)),
        "angular_momentum": _miss(space - space[0] - impulse, np.linalg.norm(momentum, axis=1)),
    } | quaternion


def _miss(balance: Floats, scale: Floats) -> float:
    largest = float(scale.max())
    return float(np.linalg.norm(balance / largest, axis=1).max()) if largest else 0.0


def _ledger(system: _System, solution: integrate.Solution) -> tuple[Floats, Floats]:
    """Work (m, J) and impulse in space (m, 3; N m s) of the torque from the start to each end of a step."""
    torque = code.function(system.torque, rigid.STATE, {})(np)
    knots = solution.knots
    rates = np.linalg.norm(solution.at(knots)[:, 4:] / system.moments, axis=1)
    angles = np.maximum(rates[:-1], rates[1:]) * np.diff(knots)
    parts = np.maximum(1, np.ceil(angles / PANEL)).astype(int)
    # The panels: every step in so many equal parts.
    step = np.repeat(np.arange(len(parts)), parts)
    place = np.arange(len(step)) - np.repeat(np.cumsum(parts) - parts, parts)
    width = (np.diff(knots) / parts)[step]
    left = knots[step] + place * width
    gained = np.zeros((len(step), 4))
    for first in range(0, len(step), PANELS_AT_ONCE):
        block = slice(first, first + PANELS_AT_ONCE)
        times = left[block, None] + width[block, None] * (1 + NODES) / 2
        states = solution.at(times.ravel())
        acting = np.column_stack(np.broadcast_arrays(*torque(times.ravel(), *states.T)))
        power = np.einsum("ij,ij->i", acting, states[:, 4:] / system.moments)
        values = np.column_stack([power, rotation.turned(states[:, :4], acting)])
        weights = width[block, None] / 2 * WEIGHTS
        gained[block] = np.einsum("pn,pnk->pk", weights, values.reshape(*times.shape, 4))
    sums = np.zeros((len(knots), 4))
    np.add.at(sums, step + 1, gained)
    sums = np.cumsum(sums, axis=0)
    return sums[:, 0], sums[:, 1:]
