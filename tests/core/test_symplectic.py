"""Symplectic integration against closed forms and mpmath: its order, its laws over long times, its ends."""

from __future__ import annotations

import math
from collections.abc import Callable
from functools import partial
from types import ModuleType

import mpmath
import numpy as np
import pytest

from rigidcli.core import integrate, symplectic
from rigidcli.core.integrate import Flow
from rigidcli.errors import ComputationError
from tests.core.flows import (
    Elements,
    Floats,
    array_of,
    ellipse,
    kepler,
    on_ellipse,
    on_pendulum,
    pendulum,
)

solved = partial(integrate.integrate, engine="symplectic")


def henon_heiles(module: ModuleType) -> Elements:
    return lambda t, x, y, u, v: (u, v, -x - 2 * x * y, -y - x * x + y * y)


def not_separable(module: ModuleType) -> Elements:
    """H = (1 + q^2)(1 + p^2)/2."""
    return lambda t, q, p: ((1 + q * q) * p, -(1 + p * p) * q)


def energy_of_kepler(x: Floats, y: Floats, u: Floats, v: Floats) -> Floats:
    energy: Floats = (u**2 + v**2) / 2 - 1 / np.hypot(x, y)
    return energy


def energy_of_not_separable(q: Floats, p: Floats) -> Floats:
    return (1 + q**2) * (1 + p**2) / 2


def on_not_separable(q: float, time: float) -> Floats:
    """Released at p = 0 with H = (1 + q^2)/2: q'^2 = (1 + x^2)(q^2 - x^2), so that x = q cn(t sqrt(2H))."""
    with mpmath.workdps(40):
        a = mpmath.mpf(q)
        rate = mpmath.sqrt(1 + a * a)
        u, m = rate * mpmath.mpf(time), (a / rate) ** 2
        sn, cn, dn = (mpmath.ellipfun(kind, u, m=m) for kind in ("sn", "cn", "dn"))
        return array_of(float(a * cn), float(-a * rate * sn * dn / (1 + (a * cn) ** 2)))


def steps_of(flow: Flow, start: Floats, end: float, steps: int, tolerance: float = 1.0) -> Floats:
    """The states after so many equal steps, whatever their errors."""
    knots = np.linspace(0, end, steps + 1)
    return symplectic.march(flow, knots, tuple(start.tolist()), tolerance, lambda t: None)


def one_step(flow: Flow, start: Floats, h: float, t: float = 0.0) -> Floats:
    f = flow(math)
    y = tuple(start.tolist())
    guess = tuple(h * weight * slope for weight in symplectic.WEIGHTS.tolist() for slope in f(t, *y))
    zeros = (0.0,) * len(y)
    made = symplectic.stepper(len(y))(f, t, h, y, zeros, guess, zeros, zeros)
    assert made is not None
    return array_of(*made[0]) + array_of(*made[1])


# --- the method


def test_the_method_is_symplectic_and_symmetric_in_floats() -> None:
    # Section VI.4, (4.2): b_i a_ij + b_j a_ji = b_i b_j, without any rounding.
    for i, j in np.ndindex(6, 6):
        assert symplectic.SHARES[i][j] + symplectic.SHARES[j][i] == 1.0
        assert (symplectic.SHARES[i][j] - 0.5) + (symplectic.SHARES[j][i] - 0.5) == 0.0
    assert symplectic.WEIGHTS[::-1].tolist() == symplectic.WEIGHTS.tolist()


CLOSED: dict[str, tuple[Flow, Callable[[float, float], Floats]]] = {
    "pendulum": (pendulum, on_pendulum),
    "not separable": (not_separable, on_not_separable),
}


@pytest.mark.parametrize(("name", "amplitude", "steps"), [("pendulum", 2, 1), ("not separable", 1.5, 2)])
def test_the_solution_is_of_order_twelve(name: str, amplitude: float, steps: int) -> None:
    flow, truth = CLOSED[name]
    errors = []
    for each in (steps, 2 * steps):
        path = steps_of(flow, array_of(amplitude, 0), 6, 6 * each)[::each]
        errors.append(max(np.abs(row - truth(amplitude, time)).max() for time, row in enumerate(path)))
    assert math.log2(errors[0] / errors[1]) == pytest.approx(12, abs=1)


STARTS: dict[str, tuple[Flow, Floats]] = {
    "henon-heiles": (henon_heiles, array_of(0.1, 0.2, 0.3, -0.1)),
    "not separable": (not_separable, array_of(0.4, 1.1)),
}


@pytest.mark.parametrize("name", STARTS)
def test_a_step_preserves_area(name: str) -> None:
    # J^T S J = S for the map of one step, which is so long that its own error is far larger than 1e-9.
    flow, start = STARTS[name]
    n = len(start) // 2
    form = np.block([[np.zeros((n, n)), np.eye(n)], [-np.eye(n), np.zeros((n, n))]])
    h, d = 0.9, 1e-3
    columns = []
    for axis in np.eye(2 * n):
        # Central differences of order 8.
        weights = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}
        columns.append(
            sum(
                weight
                / d
                * (one_step(flow, start + k * d * axis, h) - one_step(flow, start - k * d * axis, h))
                for k, weight in weights.items()
            )
        )
    jacobian = np.array(columns).T
    assert jacobian.T @ form @ jacobian == pytest.approx(form, abs=1e-9)


# --- solutions


@pytest.mark.parametrize("span", [(5.0, -35.0), (1e6, 1e6 + 40)])
def test_time_may_be_in_the_equations(span: tuple[float, float]) -> None:
    # An oscillator in the field cos(3 (t - t0)): q = (cos(t) - cos(3t))/8 from rest.
    def driven(module: ModuleType) -> Elements:
        return lambda t, q, p: (p, -q + module.cos(3 * (t - span[0])))

    solution = solved(driven, array_of(0, 0), span)
    times = np.linspace(*span, 200)
    past = times - span[0]
    found = solution.at(times)
    # Times near 1e6 are given to 1e-10: they make neither the solution worse nor its steps shorter.
    assert solution.steps < 300
    bound = 2e-12 + 20 * np.spacing(max(map(abs, span)))
    assert found[:, 0] == pytest.approx((np.cos(past) - np.cos(3 * past)) / 8, abs=bound)
    assert found[:, 1] == pytest.approx((3 * np.sin(3 * past) - np.sin(past)) / 8, abs=bound)


def test_the_start_may_be_the_calm_part_of_an_orbit() -> None:
    # From the far end, steps suit slow motion; the near end is where they turn out to be too long.
    e = 0.7
    start = array_of(1 + e, 0, 0, math.sqrt((1 - e) / (1 + e)))
    solution = solved(kepler, start, (0, 40))
    found = solution.at(array_of(40, 39.3))
    for row, time in zip(found, (40, 39.3), strict=True):
        # Half a period later than from the near end, on the other side.
        assert row == pytest.approx(-on_ellipse(e, time + math.pi), abs=1e-10)


# --- the law


LONG: dict[str, tuple[Flow, Floats, Callable[..., Floats], float]] = {
    "kepler": (kepler, ellipse(0.6), energy_of_kepler, 1_500),
    "not separable": (not_separable, array_of(0, 1.5), energy_of_not_separable, 3_000),
}


@pytest.mark.parametrize("name", LONG)
def test_the_error_of_the_energy_does_not_grow(name: str) -> None:
    flow, start, energy, end = LONG[name]
    solution = solved(flow, start, (0, end), tolerance=1e-10)
    scale = abs(float(energy(*start)))
    error = (
        energy(*solution.at(solution.knots[:: max(1, solution.steps // 20_000)]).T) - energy(*start)
    ) / scale
    assert np.abs(error).max() < 2e-10
    first, last = (np.abs(part).max() for part in np.array_split(error, 8)[::7])
    assert last < 1.5 * first + 1e-13


def test_what_is_not_symplectic_drifts_where_this_does_not() -> None:
    # Guards the tests above: at the same tolerance, the energy of the other engine does move.
    flow, start, energy, _ = LONG["kepler"]
    path = integrate.integrate(flow, start, (0, 1500), tolerance=1e-10, engine="runge-kutta")
    assert abs(energy(*path.at(array_of(1500)).T) - energy(*start))[0] > 2e-9


def test_angular_momentum_is_kept_to_rounding_errors() -> None:
    # A quadratic invariant: section IV.2.1.
    path = steps_of(kepler, ellipse(0.3), 600, 6000)
    x, y, u, v = path.T
    assert np.abs(x * v - y * u - math.sqrt(1 - 0.3**2)).max() < 4e-15


# --- ends


ENDS: dict[str, tuple[Flow, Floats, tuple[float, float], float]] = {
    # Fall into the centre from rest at distance 1 takes pi/sqrt(8).
    "fall": (kepler, array_of(1, 0, 0, 0), (0, 4), math.pi / math.sqrt(8)),
    # H = p sqrt(2 - t) is no motion beyond t = 2.
    "no value": (lambda m: lambda t, q, p: (m.sqrt(2 - t), 0 * p), array_of(0, 1), (0, 5), 2),
}


@pytest.mark.parametrize("name", ENDS)
def test_solutions_that_end_need_other_steps(name: str) -> None:
    flow, start, span, time = ENDS[name]
    with pytest.raises(ComputationError, match="the motion has no steps of one length") as caught:
        solved(flow, start, span, name="the motion")
    near = float(str(caught.value).rsplit("= ", 1)[1])
    assert near == pytest.approx(time, abs=0.01)
    assert "`auto`" in str(caught.value.hint)
