"""Driven motion: Euler's equations with a torque, integrated, and checked by the balances."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from rigidcli.core import integrate, rotation
from rigidcli.core.arithmetic import Floats
from rigidcli.core.narrow import begun_anew, merged, solved
from rigidcli.core.second_opinion import estimated_error
from rigidcli.core.solution import digits
from rigidcli.document.motion import VARIABLES, SpaceTorque
from rigidcli.errors import Path, ValueProblem, at
from rigidcli.fields.environment import Formula
from rigidcli.language import code
from rigidcli.language.tree import ZERO, Name, Node, bound, insides, number
from rigidcli.mechanics import rigid_body
from rigidcli.studies.euler.balance import BalanceErrors, balance_errors
from rigidcli.studies.euler.initial import InitialValueProblem
from rigidcli.studies.euler.trajectory import Trajectory, drift_of

COMPARED = 64
"""Times at which the two integrations are compared: enough to meet the largest difference nearly."""

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
    max_steps: int | None = None
    starts: int = 1

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
        self, progress: Callable[[float], None] | None
    ) -> tuple[integrate.Solution, Floats, BalanceErrors, Floats]:
        """A solution that has followed all of the torque, the spans (k by 2, s) repeated for it, its errors.

        An integrator looks at the torque now and then only, and goes over what acts in between. Where that
        shows in the torque itself or in the balances, it begins anew with steps that are short; if that does
        not help, the solution stays as it was. Last are the spans in which it still goes over the torque.
        """
        last, tolerance = float(self.problem.times[-1]), self.problem.tolerance

        def follow(state: Floats, span: tuple[float, float]) -> integrate.Solution:
            return self.part(state, span, tolerance, _share(progress, *span, last))

        inner = sorted(set().union(*map(insides, self.torque)), key=repr)
        quantities = code.function(inner, rigid_body.STATE, {})
        whole = (self.state, (0.0, last))
        solution, places, narrow = solved(follow, self.right_side, quantities, *whole, tolerance)
        balance = self._balance(solution)
        for _ in range(ROUNDS):
            if not len(balance.missed):
                break
            more = merged(places, balance.missed)
            other = begun_anew(follow, *whole, more)
            found = self._balance(other)
            if max(found.drift.values()) > max(balance.drift.values()) / 2:
                break
            solution, places, balance = other, more, found
        return solution, places, balance, narrow

    def part(
        self,
        state: Floats,
        span: tuple[float, float],
        tolerance: float,
        progress: Callable[[float], None] | None = None,
        like: integrate.Solution | None = None,
    ) -> integrate.Solution:
        """The solution over a span of time, from the state at its beginning; it may be `like` another one."""
        return integrate.integrate(
            self.right_side,
            state,
            span,
            tolerance=tolerance,
            blocks=(4, 3),
            engine=self.engine,
            progress=progress,
            name="the motion",
            most_steps=self.max_steps,
            like=like,
            starts=self.starts,
        )

    def _balance(self, solution: integrate.Solution) -> BalanceErrors:
        """The balances; under weight alone, energy is conserved, and so is L about the vertical."""
        problem = self.problem
        if problem.torque is None:
            drift = drift_of(problem, *self.along_document(solution.at(solution.knots)))
            errors = {key: drift[key] for key in ("energy", "angular_momentum")}
            return BalanceErrors(errors, np.empty((0, 2)))
        timed = "t" in problem.torque.names
        return balance_errors(self.torque, self.moments, solution, tolerance=problem.tolerance, timed=timed)


def driven_trajectory(
    problem: InitialValueProblem,
    engine: integrate.Engine,
    progress: Callable[[float], None] | None,
    max_steps: int | None = None,
    starts: int = 1,
) -> Trajectory:
    """The trajectory of a body that a torque drives, one of so many `starts`.

    Raises ComputationError where it ends early or cannot begin, and ValueProblem, with the path in
    `motion`, for a torque that cannot be: one that is too large, or about a line without a moment.
    """
    equations = replace(_along_principal_axes(problem, engine), max_steps=max_steps, starts=starts)
    solution, places, balance, narrow = equations.followed(progress)
    omega, orientation = equations.along_document(solution.at(problem.times))
    error, _ = estimated_error(
        solution,
        problem.tolerance,
        partial(equations.part, like=solution),
        lambda one, other: 2 * np.linalg.norm((one - other)[:, :4], axis=1),
        np.linspace(0.0, problem.times[-1], COMPARED),
        places.ravel(),
        integrate.CHEAPER[solution.engine],
    )
    missed = merged(narrow, balance.missed)
    rounding = np.finfo(np.float64).eps * solution.steps**0.5
    notes = problem.notes
    if len(missed):
        near = f"the balance of energy or angular momentum is missed near t = {missed[0].mean():.6g}"
        notes += (f"{near}: the integration may have gone over a torque that acts for a short while",)
    lengths = np.linalg.norm(solution.at(solution.knots)[:, :4], axis=1)
    return Trajectory(
        replace(problem, notes=notes),
        omega,
        rotation.continuous(orientation),
        None,
        solution.method,
        solution.steps,
        digits(math.pi if len(narrow) else max(error, rounding, *balance.drift.values())),
        balance.drift | {"quaternion": float(np.abs(lengths - 1).max())},
    )


def _share(
    progress: Callable[[float], None] | None, begin: float, end: float, last: float
) -> Callable[[float], None] | None:
    """A function that reports all that is done, given the fraction of the span from `begin` to `end`."""
    return progress and (lambda fraction: progress((begin + (end - begin) * fraction) / last))


def _along_principal_axes(problem: InitialValueProblem, engine: integrate.Engine) -> _Equations:
    """The equations along principal axes; those of the document where they are principal.

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
    return _Equations(problem, moments, axes, torque, state, engine)


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
