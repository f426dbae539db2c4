"""The orbit of a system in phase space: followed numerically, with a passport of how well."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core import integrate
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import digits
from rigidcli.errors import ComputationError
from rigidcli.model.sampling import DEFAULT_TOLERANCE
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.initial import Start
from rigidcli.studies.hamilton.motion import Motion, columns, motion_of, terms_of
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.text import text

if TYPE_CHECKING:
    from rigidcli.model.orbit import Orbit

SECOND_OPINION = 1e2
"""How much coarser the second integration is, from which the error of the first is estimated."""

PIECES = 7
"""In which the second integration is done; the first is a 64th of the span."""

REFINEMENTS, PARTS = 5, 101
"""How often the time at which an orbit leaves its range is narrowed down, to one of how many."""

LOST = 0.1
"""Error of a variable, in units of its size, with which it has no digits."""

SOON = 0.8
"""If the coarse orbit is lost before this part of the span, so is the other before its end."""

ORDER = 7 / 8
"""The power of the tolerance to which the error of an orbit is proportional: steps h have errors of h^8."""


@dataclass(frozen=True, slots=True, eq=False)
class Path:
    """An orbit at `times` (k): coordinates and momenta (k by n each) and H (k).

    `drift` tells of H and of each conserved momentum by how much it changes, in units of the largest sum of
    the sizes of its terms; where H changes by law, of its balance. `plain` are those of H and momenta.
    `lost` is when an orbit with somewhat coarser steps has nothing in common with this one any more.
    """

    times: Floats
    coordinates: Floats
    momenta: Floats
    energy: Floats
    drift: dict[str, float]
    plain: tuple[str, ...]
    method: str
    steps: int
    trusted_digits: float
    lost: float | None


@np.errstate(over="ignore", invalid="ignore")
def follow(
    orbit: Orbit,
    found: Derivation,
    start: Start,
    invariants: Sequence[Expr],
    progress: Callable[[float], None] | None,
) -> Path:
    """The orbit that a document asks for; also of the `invariants` the drift is told.

    Raises ComputationError where the orbit ends early.
    """
    motion = motion_of(found, start)
    times = orbit.instants(1.0)
    tolerance = orbit.tolerance or DEFAULT_TOLERANCE
    engine: integrate.Engine = "symplectic" if orbit.method == "symplectic" else "auto"

    solution = integrate.integrate(
        motion.flow,
        motion.start,
        (0.0, float(times[-1])),
        tolerance=tolerance,
        engine=engine,
        progress=progress,
        name="the orbit",
    )
    _require_range(solution, found, start)
    states = solution.at(times)
    coordinates, momenta, energy, terms = motion.seen(times, states)
    error, lost = _doubt(motion, times, states, tolerance, engine)
    balance = states[:, -1] if found.explicit_time else np.zeros(len(times))
    size = float(np.abs(terms).sum(axis=0).max()) or 1.0
    drift = {"H": float(np.abs(energy - energy[0] - (balance - balance[0])).max() / size)}
    for name in found.cyclic:
        column = momenta[:, found.phase.coordinates.index(name)]
        change = np.abs(column - column[0]).max()
        drift[f"p_{name}"] = float(change / np.abs(column).max()) if change else 0.0
    for invariant in invariants:
        parts = columns(terms_of(invariant, found, start.values), times, np.hstack([coordinates, momenta]))
        change = np.abs(parts.sum(axis=0) - parts[:, 0].sum()).max()
        drift[text(to_tree(invariant))] = float(change / np.abs(parts).sum(axis=0).max()) if change else 0.0
    return Path(
        times,
        coordinates,
        momenta,
        energy,
        drift,
        ("H", *(f"p_{name}" for name in found.cyclic)),
        solution.method,
        solution.steps,
        digits(max(error, np.finfo(np.float64).eps * solution.steps**0.5)),
        lost,
    )


def _require_range(solution: integrate.Solution, found: Derivation, start: Start) -> None:
    """Raise ComputationError where momenta leave the range in which they have velocities on this branch."""
    for condition in () if found.branch is None else found.branch.conditions:
        told = terms_of(condition, found, start.values)
        times = solution.knots
        for _ in range(REFINEMENTS):
            states = solution.at(times)[:, : 2 * len(start.q)]
            outside = ~(columns(told, times, states).sum(axis=0) > 0)
            if not outside.any():
                break
            first = int(np.argmax(outside))
            times = np.linspace(times[max(0, first - 1)], times[first], PARTS)
        else:
            raise ComputationError(
                f"the orbit has no velocities beyond t = {times[-1]:.6g}, "
                f"expected {text(to_tree(condition))} > 0"
            )


def _doubt(
    motion: Motion, times: Floats, states: Floats, tolerance: float, engine: integrate.Engine
) -> tuple[float, float | None]:
    """The largest error of the states (k by n), in units of the variables' sizes, and when digits are lost.

    It is estimated from a second, coarser integration, which ends where that loses all of its digits: of
    chaotic motion, there is no need to go on. So it is done piece by piece, each twice as long.
    """
    scale = np.abs(states).max(axis=0)
    scale[scale == 0] = 1.0
    coarse = min(1e-3, tolerance * SECOND_OPINION)
    growth = SECOND_OPINION**ORDER
    end = float(times[-1])
    t, state, error = 0.0, motion.start, 0.0
    for piece in reversed(range(PIECES)):
        until = end / 2**piece
        solution = integrate.integrate(
            motion.flow, state, (t, until), tolerance=coarse, engine=engine, name="the orbit"
        )
        inside = (times > t) & (times <= until)
        misses = np.abs((solution.at(times[inside]) - states[inside]) / scale).max(axis=1, initial=0.0)
        error = max(error, float(misses.max(initial=0.0)) / growth)
        if (misses > LOST).any():
            lost = float(times[inside][np.argmax(misses > LOST)])
            if lost < SOON * end:
                return 1.0, lost
        t, state = until, solution.at(np.array([until]))[0]
    return error, None
