"""What is read off an orbit: its end, the states of a Poincare section, the period of motion to and fro."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np

from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import ZERO, Expr
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.core.events import Events, events
from rigidcli.core.libration import Libration, libration
from rigidcli.core.solution import Solution, Stopped, columns
from rigidcli.document.system import Orbit
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import code
from rigidcli.mechanics.phase_space import TIME
from rigidcli.report import Field, Step
from rigidcli.studies.hamilton.derivation import Derivation
from rigidcli.studies.hamilton.equations_of_motion import InitialState

# What comes this near to zero and goes back is no pass, in units of the largest value, as errors are.
TOUCHING = 1e-10
# Where an orbit cannot be followed on, it is looked for its end up to this share of the time before.
BEFORE_STOP = 1e-6

Values = Callable[[Floats, Floats], Floats]


def reach(
    follow: Callable[[float], Solution], function: Values, end: float, key: str
) -> tuple[float, float | None]:
    """The time to which an orbit is to be followed, and the first zero of a function before it, or None.

    The orbit may stop behind its end: a planet that is followed to the surface of the sun would fall into it.
    """
    stopped: Stopped | None = None
    try:
        solution = follow(end)
    except Stopped as stop:
        if stop.time <= 0:
            raise
        stopped, solution = stop, follow(stop.time * (1 - BEFORE_STOP))
    found = passes(function, solution, key)
    if not len(found.times):
        if stopped is not None:
            raise stopped
        return end, None
    beyond = solution.knots[solution.knots > found.times[0]]
    return float(beyond[:2][-1]) if len(beyond) else end, float(found.times[0])


def passes(function: Values, solution: Solution, key: str) -> Events:
    """The zeros of a function along an orbit. Raises ComputationError where it has no value before one."""
    found = events(function, solution, TOUCHING)
    ends = key == "orbit.until" and len(found.times) > 0
    if found.gap is not None and not (ends and found.times[0] < found.gap):
        raise ComputationError(f"`{key}` has no finite real value at t = {found.gap:.6g}")
    return found


def cut(solution_knots: Floats, end: float) -> Floats:
    """The ascending times before an end, and the end itself."""
    return np.append(solution_knots[solution_knots < end], end)


def selected(found: Events, orbit: Orbit) -> Floats:
    """The times of a section. Raises ComputationError where there are none."""
    assert orbit.section is not None
    direction, at = orbit.section.direction, orbit.section.at.text
    times = found.times
    if direction != "both":
        times = times[found.upwards == (direction == "up")]
    if not len(times):
        way = {"up": " upwards", "down": " downwards", "both": ""}[direction]
        others = f"; {len(found.times)} times the other way: `direction: both`" if len(found.times) else ""
        raise ComputationError(
            f"the orbit never passes {equation(at)}{way}, so that the section is empty",
            hint=f"take a longer `orbit.duration`{others}",
        )
    return times


def equation(text: str) -> str:
    """What holds where an expression, or the difference of two sides, vanishes."""
    return text if "=" in text else f"{text} = 0"


def touching(text: str, touched: Floats) -> list[str]:
    """A remark on places where a function comes to zero and goes back."""
    if not len(touched):
        return []
    more = f" and at {len(touched) - 1} more times" if len(touched) > 1 else ""
    return [f"at t = {touched[0]:.10g}{more} the orbit touches {equation(text)} and does not pass it"]


def steps(orbit: Orbit, end: tuple[float, str] | None, crossings: int) -> Iterator[Step]:
    """Say what is looked for along an orbit, how it is found, and what came out."""
    sentence = (
        "The function is looked at in 16 places of each step of the integration, and more closely where its "
        "size is least, so that no two zeros between them are missed. Where its sign changes, the zero is "
        "narrowed down on the solution between the steps by the Illinois method, to the digits of the orbit."
    )
    shown = list[Field]()
    if orbit.until is not None and end is not None:
        time, reason = end
        ends = _said("ends where" if reason != "duration" else "ends by its", reason)
        shown += [_said("looked for", equation(orbit.until.text)), Field("", time, "end", "t", "s"), ends]
    if orbit.section is not None:
        way = {"up": "upwards", "down": "downwards", "both": "either way"}[orbit.section.direction]
        shown.append(_said("looked for", f"{equation(orbit.section.at.text)}, passed {way}"))
        shown.append(Field("", crossings, "crossings"))
    yield Step("Events of the orbit", sentence, tuple(shown))


def _said(title: str, words: str) -> Field:
    return Field("", words, title, words=words)


# The orbit may pass a turning point by this share of their distance, or it does not turn there.
BEYOND_TURNING = 1e-6


def period(derivation: Derivation, initial: InitialState, paths: Floats) -> Libration | None:
    """The motion to and fro of the only coordinate that is not cyclic, if it is such; `paths` are samples.

    The momenta of cyclic coordinates are constant, so that the other coordinate moves by itself: in a central
    field, r from one apsis to the other and back (L. Landau, E. Lifshitz, Mechanics, section 14).
    """
    phase = derivation.phase
    (place,) = (k for k, q in enumerate(phase.coordinates) if q not in derivation.cyclic)
    parts = _quadratic(derivation.hamiltonian, phase.momenta[place])
    if parts is None:
        return None
    # The momenta of the cyclic coordinates stay what they are at the start.
    constants = dict(zip(phase.momenta, map(float, initial.p), strict=True))
    q, p = float(initial.q[place]), constants.pop(phase.momenta[place])
    trees, known = [to_tree(e) for e in parts], {**initial.parameters, **constants}
    values = columns(code.function(trees, [TIME, phase.coordinates[place]], known))
    a, b, c = values(np.zeros(1), np.array([q]))[:, 0]
    energy = float((a * p + b) * p + c)

    def function(places: Floats) -> tuple[Floats, Floats, Floats]:
        a, b, c = values(np.zeros(len(places)), places)
        return b**2 - 4 * a * (c - energy), a, b**2 + 4 * np.abs(a) * (np.abs(c) + abs(energy))

    path = paths[:, place]
    spread = float(np.ptp(path))
    found = libration(function, q, max(spread, abs(q) / 100) / 8 or 1.0)
    if found is None:
        return None
    first, last = found.turning_points
    slack = BEYOND_TURNING * (last - first)
    return found if first - slack <= path.min() and path.max() <= last + slack else None


def _quadratic(hamiltonian: Expr | None, momentum: str) -> tuple[Expr, Expr, Expr] | None:
    """The coefficients of p^2, p and 1 in H; None where H has another form."""
    if hamiltonian is None:
        return None
    try:
        polynomial = coefficients(hamiltonian, [momentum])
    except ExpressionError:
        return None
    if polynomial is None or not polynomial.keys() <= {(0,), (1,), (2,)} or (2,) not in polynomial:
        return None
    return polynomial[2,], polynomial.get((1,), ZERO), polynomial.get((0,), ZERO)
