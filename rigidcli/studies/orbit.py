"""The orbit of a system in phase space: followed numerically, with a passport of how well.

Where H has a closed form, Hamilton's equations are integrated. Where it has none, but the velocities follow
from linear equations M(q, t) v = p - b(q, t), these are solved at each step, and p' = dL/dq. Otherwise
the velocities themselves are variables: M v' = dL/dq - (dp/dq) v - dp/dt.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np

from rigidcli.core import integrate
from rigidcli.core.arithmetic import Floats
from rigidcli.core.solution import NO_VALUE, Flow
from rigidcli.errors import ComputationError, DocumentError, Problem
from rigidcli.studies.derivation import TIME, Derivation
from rigidcli.studies.trajectory import DEFAULT_TOLERANCE, digits
from rigidcli.symbolic import code
from rigidcli.symbolic.algebra import Expr, symbol, total
from rigidcli.symbolic.calculus import derivative, substitute
from rigidcli.symbolic.elimination import solved
from rigidcli.symbolic.growth import to_tree
from rigidcli.symbolic.legendre import Branch
from rigidcli.symbolic.tree import Name, Node
from rigidcli.symbolic.writing import text

if TYPE_CHECKING:
    from rigidcli.model.document import Document
    from rigidcli.model.orbit import Orbit

SECOND_OPINION = 1e2
"""How much coarser the second integration is, from which the error of the first is estimated."""

PIECES = 7
"""In which the second integration is done; the first is a 64th of the span."""

LOST = 0.1
"""Error of a variable, in units of its size, with which it has no digits."""

SOON = 0.8
"""If the coarse orbit is lost before this part of the span, so is the other before its end."""

ORDER = 7 / 8
"""The power of the tolerance to which the error of an orbit is proportional: steps h have errors of h^8."""

BALANCE = "_balance"
"""The integral of the partial derivative of H by the time, which is the change of H."""


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


@dataclass(frozen=True, slots=True, eq=False)
class _Motion:
    """What is integrated, and how its variables (k by m) tell the `seen`: q, p, H and the terms of H."""

    flow: Flow
    start: Floats
    seen: Callable[[Floats, Floats], tuple[Floats, Floats, Floats, Floats]]


def follow(
    document: Document,
    orbit: Orbit,
    found: Derivation,
    invariants: Sequence[Expr],
    progress: Callable[[float], None] | None,
) -> Path:
    """The orbit that the document asks for; also of the `invariants` the drift is told.

    Raises DocumentError for a start at which the system has no motion, ComputationError where the
    orbit ends early.
    """
    assert document.system is not None
    q, p, v = orbit.start(document.system)
    values = {name: float(value) for name, value in document.values.items()}
    motion = _motion(document, found, values, q, p, v)
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
        parts = _columns(_terms(invariant, found, values), times, np.hstack([coordinates, momenta]))
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


def _doubt(
    motion: _Motion, times: Floats, states: Floats, tolerance: float, engine: integrate.Engine
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


def on_its_branch(document: Document, orbit: Orbit, found: Derivation) -> Derivation:
    """The system on the one branch of its velocities that the orbit begins on."""
    if len(found.branches) < 2:
        return found
    assert document.system is not None
    q, p, v = orbit.start(document.system)
    values = {name: float(value) for name, value in document.values.items()}
    if p is None:
        assert v is not None
        p = _momenta(document, found, values, q, v)
    branch = _branch(document, found, values, q, p, v)
    assert branch is not None
    return replace(found, branches=(branch,))


def _motion(
    document: Document,
    found: Derivation,
    values: Mapping[str, float],
    q: Floats,
    p: Floats | None,
    v: Floats | None,
) -> _Motion:
    if p is None:
        assert v is not None
        p = _momenta(document, found, values, q, v)
    _branch(document, found, values, q, p, v)
    if found.hamiltonian is not None:
        point = {TIME: 0.0, **values} | dict(zip(found.phase.names, (*q, *p), strict=True))
        _evaluated(document, [found.hamiltonian], point, "H")
    if found.equations is not None:
        return _explicit(found, values, q, p)
    return _implicit(document, found, values, q, p, v)


def _evaluated(
    document: Document, expressions: Sequence[Expr], point: Mapping[str, float], what: str
) -> list[float]:
    """The values of expressions at t = 0, or DocumentError if there are none."""
    try:
        found = code.function([to_tree(e) for e in expressions], list(point), {})(math)(
            *map(float, point.values())
        )
    except NO_VALUE:
        found = (math.nan,)
    if not all(map(math.isfinite, found)):
        raise DocumentError(
            [Problem(document.source, f"{what} has no finite real value there", key="orbit.initial")]
        )
    return list(found)


def _momenta(
    document: Document, found: Derivation, values: Mapping[str, float], q: Floats, v: Floats
) -> Floats:
    """The momenta at the start, from the velocities."""
    if found.momenta is None:
        return _from_hamiltonian(document, found, values, q, v)
    point = {TIME: 0.0, **values} | dict(
        zip((*found.phase.coordinates, *found.velocity_names), (*q, *v), strict=True)
    )
    return np.array(_evaluated(document, found.momenta.definitions, point, "a momentum"))


def _from_hamiltonian(
    document: Document, found: Derivation, values: Mapping[str, float], q: Floats, v: Floats
) -> Floats:
    """The momenta of which v = dH/dp, where that is linear in them."""
    phase, size = found.phase, len(q)
    slopes = [derivative(found.mover, name) for name in phase.momenta]
    matrix = [derivative(slope, name) for slope in slopes for name in phase.momenta]
    if any(not entry.names.isdisjoint(phase.momenta) for entry in matrix):
        problem = "velocities do not tell the momenta, as dH/dp is not linear in them"
        hint = f"give the momenta {', '.join(phase.momenta)}"
        raise DocumentError([Problem(document.source, problem, key="orbit.initial", hint=hint)])
    point = {TIME: 0.0, **values} | dict(zip(phase.names, (*q, *[0.0] * size), strict=True))
    told = np.array(_evaluated(document, [*slopes, *matrix], point, "a velocity"))
    try:
        return np.linalg.solve(told[size:].reshape(size, size), v - told[:size])
    except np.linalg.LinAlgError:
        raise ComputationError("the velocities do not tell the momenta there: dH/dp is degenerate") from None


def _branch(
    document: Document,
    found: Derivation,
    values: Mapping[str, float],
    q: Floats,
    p: Floats,
    v: Floats | None,
) -> Branch | None:
    """The branch of the velocities that the orbit begins on."""
    if not found.branches:
        return None
    point = {TIME: 0.0, **values} | dict(zip(found.phase.names, (*q, *p), strict=True))
    inside = []
    for branch in found.branches:
        conditions = _evaluated(document, branch.conditions, point, "a momentum")
        if min(conditions, default=1.0) <= 0:
            continue
        inside.append(branch)
    if not inside:
        told = " and ".join(f"{text(to_tree(e))} > 0" for e in found.branches[0].conditions)
        raise DocumentError(
            [
                Problem(
                    document.source,
                    f"no velocity has these momenta, expected {told}",
                    key="orbit.initial",
                )
            ]
        )
    if len(inside) == 1 and v is None:
        return inside[0]
    if v is None:
        raise DocumentError(
            [
                Problem(
                    document.source,
                    f"{len(inside)} velocities have these momenta",
                    key="orbit.initial",
                    hint=f"give the velocities {', '.join(found.velocity_names)} instead",
                )
            ]
        )
    misses = [
        np.abs(np.array(_evaluated(document, branch.velocities, point, "a velocity")) - v).max()
        for branch in inside
    ]
    return inside[int(np.argmin(misses))]


def _columns(f: Flow, times: Floats, states: Floats) -> Floats:
    """The values (m by k) of a flow at times (k) and states (k by n)."""
    with np.errstate(all="ignore"):
        rows = f(np)(times, *states.T)
    return np.array([np.broadcast_to(row, times.shape) for row in rows])


def _terms(e: Expr, found: Derivation, values: Mapping[str, float]) -> Flow:
    """The terms of a function on phase space, one by one."""
    parts = [Expr({monomial: factor}) for monomial, factor in e.ordered] or [e]
    return code.function([to_tree(part) for part in parts], [TIME, *found.phase.names], values)


def _explicit(found: Derivation, values: Mapping[str, float], q: Floats, p: Floats) -> _Motion:
    """Hamilton's equations; with the balance of H as a further variable where it changes."""
    phase, hamiltonian = found.phase, found.hamiltonian
    assert hamiltonian is not None
    assert found.equations is not None
    slopes = list(found.equations)
    start = np.concatenate([q, p])
    arguments = [TIME, *phase.names]
    if found.explicit_time:
        slopes.append(derivative(hamiltonian, TIME))
        start, arguments = np.append(start, 0.0), [*arguments, BALANCE]
    flow = code.function([to_tree(e) for e in slopes], arguments, values)
    terms = _terms(hamiltonian, found, values)
    size = len(phase.coordinates)

    def seen(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        parts = _columns(terms, times, states[:, : 2 * size])
        return states[:, :size], states[:, size : 2 * size], parts.sum(axis=0), parts

    return _Motion(flow, start, seen)


def _implicit(
    document: Document,
    found: Derivation,
    values: Mapping[str, float],
    q: Floats,
    p: Floats,
    v: Floats | None,
) -> _Motion:
    """Euler and Lagrange's equations, the velocities being solved for at each step."""
    assert found.momenta is not None
    matrix = found.momenta.mass_matrix
    linear = all(entry.names.isdisjoint(found.velocity_names) for row in matrix for entry in row)
    if linear:
        return _from_momenta(found, values, q, p)
    if v is None:
        raise ComputationError(
            "the velocities have no closed form in the momenta",
            hint=f"begin the orbit with velocities: {', '.join(found.velocity_names)}",
        )
    return _from_velocities(found, values, q, v)


def _from_momenta(found: Derivation, values: Mapping[str, float], q: Floats, p: Floats) -> _Motion:
    """q' = v and p' = dL/dq, with v from M v = p - b."""
    assert found.momenta is not None
    assert found.given.lagrangian is not None
    phase, lagrangian = found.phase, found.given.lagrangian
    matrix = [[to_tree(entry) for entry in row] for row in found.momenta.mass_matrix]
    zero = {name: Expr({}) for name in found.velocity_names}
    rest = [
        to_tree(symbol(name) - substitute(e, zero))
        for name, e in zip(phase.momenta, found.momenta.definitions, strict=True)
    ]
    steps, answers = solved(matrix, rest)
    steps = [*steps, *zip(found.velocity_names, answers, strict=True)]
    forces = [to_tree(derivative(lagrangian, name)) for name in phase.coordinates]
    slopes: list[Node] = [*map(Name, found.velocity_names), *forces]
    start, arguments = np.concatenate([q, p]), [TIME, *phase.names]
    if found.explicit_time:
        slopes.append(to_tree(-derivative(lagrangian, TIME)))
        start, arguments = np.append(start, 0.0), [*arguments, BALANCE]
    flow = code.function(slopes, arguments, values, steps)
    parts = [symbol(a) * symbol(b) for a, b in zip(phase.momenta, found.velocity_names, strict=True)]
    terms = [*parts, *(Expr({m: -c}) for m, c in lagrangian.ordered)]
    told = code.function([to_tree(e) for e in terms], [TIME, *phase.names], values, steps)
    size = len(phase.coordinates)

    def seen(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        columns = _columns(told, times, states[:, : 2 * size])
        return states[:, :size], states[:, size : 2 * size], columns.sum(axis=0), columns

    return _Motion(flow, start, seen)


def _from_velocities(found: Derivation, values: Mapping[str, float], q: Floats, v: Floats) -> _Motion:
    """q' = v and M v' = dL/dq - (dp/dq) v - dp/dt."""
    assert found.momenta is not None
    assert found.given.lagrangian is not None
    phase, lagrangian, definitions = found.phase, found.given.lagrangian, found.momenta.definitions
    matrix = [[to_tree(entry) for entry in row] for row in found.momenta.mass_matrix]
    rest = [
        to_tree(
            total(
                [
                    derivative(lagrangian, name),
                    *(
                        -derivative(p, other) * symbol(rate)
                        for other, rate in zip(phase.coordinates, found.velocity_names, strict=True)
                    ),
                    -derivative(p, TIME),
                ]
            )
        )
        for name, p in zip(phase.coordinates, definitions, strict=True)
    ]
    steps, answers = solved(matrix, rest)
    slopes: list[Node] = [*map(Name, found.velocity_names), *answers]
    start = np.concatenate([q, v])
    arguments = [TIME, *phase.coordinates, *found.velocity_names]
    if found.explicit_time:
        slopes.append(to_tree(-derivative(lagrangian, TIME)))
        start = np.append(start, 0.0)
    flow = code.function(slopes, [*arguments, BALANCE] if found.explicit_time else arguments, values, steps)
    parts = [p * symbol(rate) for p, rate in zip(definitions, found.velocity_names, strict=True)]
    terms = [*parts, *(Expr({m: -c}) for m, c in lagrangian.ordered)]
    told = code.function([to_tree(e) for e in (*definitions, *terms)], arguments, values)
    size = len(phase.coordinates)

    def seen(times: Floats, states: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        columns = _columns(told, times, states[:, : 2 * size])
        return states[:, :size], columns[:size].T, columns[size:].sum(axis=0), columns[size:]

    return _Motion(flow, start, seen)
