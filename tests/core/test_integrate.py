"""Solutions of differential equations against closed forms and mpmath; honest ends where there are none."""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Sequence
from functools import partial
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.linalg import expm

from rigidcli.core import integrate, runge_kutta, symplectic, taylor
from rigidcli.core.integrate import Engine, Flow, Solution, Stop, Stopped, TooManySteps
from rigidcli.errors import ComputationError
from tests.core.flows import (
    Floats,
    array_of,
    kepler,
    on_ellipse,
    on_pendulum,
    oscillator,
    pendulum,
    same,
)

few = settings(max_examples=25)

plain = partial(integrate.integrate, engine="runge-kutta")


def compiled(*problem: Any, **options: Any) -> Solution:
    pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    return integrate.integrate(*problem, engine="taylor", **options)


ENGINES: dict[ModuleType, Callable[..., Solution]] = {
    runge_kutta: plain,
    taylor: compiled,
    symplectic: partial(plain, engine="symplectic"),
}
"""The module of each engine, and an integration by it."""

by_every_engine = pytest.mark.parametrize("module", ENGINES, ids=lambda module: module.__name__[14:])


# --- accuracy against the truth


def riccati_truth(t: float) -> list[float]:
    """y' = t^2 + y^2, y(0) = 0, from Bessel functions (G. N. Watson, Theory of Bessel Functions, 4.3)."""
    with mpmath.workdps(30):
        z = mpmath.mpf(t) ** 2 / 2
        quarter, three = mpmath.mpf(1) / 4, mpmath.mpf(3) / 4
        return [float(t * mpmath.besselj(three, z) / mpmath.besselj(-quarter, z)) if t else 0.0]


def forced_truth(t: float) -> list[float]:
    """y' = -y + cos 3t, y(0) = 1."""
    return [0.9 * math.exp(-t) + 0.1 * math.cos(3 * t) + 0.3 * math.sin(3 * t)]


MATRIX = np.array([[-0.5, 2, 0, 1], [-2, -0.1, 0.3, 0], [0, 0.7, 0, 3], [-1, 0, -3, -0.2]])


def linear(t: Any, *y: Any) -> tuple[Any, ...]:
    return tuple(sum(float(a) * x for a, x in zip(row, y, strict=True)) for row in MATRIX)


Truth = Callable[[float], Sequence[float] | Floats]

PROBLEMS: dict[str, tuple[Flow, Floats, float, tuple[int, ...], Truth, float]] = {
    "oscillator": (same(oscillator), array_of(1, 0), 60, (2,), lambda t: [math.cos(t), -math.sin(t)], 1e-11),
    "kepler": (kepler, array_of(0.1, 0, 0, math.sqrt(19)), 6, (2, 2), lambda t: on_ellipse(0.9, t), 1e-10),
    "pendulum": (pendulum, array_of(2, 0), 20, (1, 1), lambda t: on_pendulum(2, t), 1e-11),
    "riccati": (same(lambda t, y: (t * t + y * y,)), array_of(0), 1.5, (1,), riccati_truth, 1e-11),
    "forced": (
        lambda module: lambda t, y: (module.cos(3 * t) - y,), array_of(1), 12, (1,), forced_truth, 1e-12,
    ),
    "linear": (
        same(linear), array_of(1, 2, 3, 4), 8, (4,),
        lambda t: (expm(MATRIX * t) @ [1, 2, 3, 4]).tolist(), 5e-12,
    ),
}  # fmt: skip


by_either = pytest.mark.parametrize("follow", [plain, compiled], ids=["runge-kutta", "taylor"])


@by_either
def test_a_span_of_no_length_has_the_start_alone(follow: Any) -> None:
    found = follow(lambda module: lambda t, y: (y,), np.array([2.0]), (0.0, 0.0))
    assert (found.steps, found.at(np.zeros(2)).tolist()) == (0, [[2.0], [2.0]])


@by_every_engine
@pytest.mark.parametrize("name", PROBLEMS)
def test_solutions_are_true_at_and_between_the_steps(name: str, module: ModuleType) -> None:
    flow, start, end, blocks, truth, bound = PROBLEMS[name]
    solution = ENGINES[module](flow, start, (0, end), blocks=blocks)
    assert solution.knots[[0, -1]].tolist() == [0, end]
    assert len(solution.knots) == solution.steps + 1
    inside = np.random.default_rng(1).uniform(0, end, 60)
    errors = []
    for times in (solution.knots[:: max(1, solution.steps // 40)], inside):
        found = solution.at(times)
        assert found.shape == (len(times), len(start))
        errors.append(max(float(np.abs(row - truth(t)).max()) for t, row in zip(times, found, strict=True)))
    assert max(errors) < bound
    # A sample is one shorter step, of an error that is smaller still.
    assert errors[1] < 3 * errors[0] + 1e-14


@pytest.mark.parametrize("tolerance", [1e-4, 1e-9, 1e-14])
def test_the_error_follows_the_tolerance(tolerance: float) -> None:
    solution = plain(pendulum, array_of(2, 0), (0, 20), tolerance=tolerance)
    error = np.abs(solution.at(array_of(20.0))[0] - on_pendulum(2, 20)).max()
    assert error < 100 * tolerance
    assert error > 1e-3 * tolerance or tolerance < 1e-13


# --- laws


@by_every_engine
@pytest.mark.parametrize("name", PROBLEMS)
def test_there_and_back(name: str, module: ModuleType) -> None:
    flow, start, end, blocks, _, bound = PROBLEMS[name]
    there = ENGINES[module](flow, start, (0, end), blocks=blocks).at(array_of(end))[0]
    back = ENGINES[module](flow, there, (end, 0), blocks=blocks)
    assert back.knots[0] == end
    assert back.knots[-1] == pytest.approx(0, abs=1e-16)
    assert np.all(np.diff(back.knots) < 0)
    assert back.at(array_of(0.0))[0] == pytest.approx(start, abs=bound * (1e6 if name == "forced" else 100))


@pytest.mark.parametrize("exponent", [-900, 400])
def test_no_variable_needs_a_scale(exponent: int) -> None:
    # A linear equation in other units, powers of two, which do not round: the same steps to the last bit.
    scale = math.ldexp(1.0, exponent)
    one = plain(same(linear), array_of(1, 2, 3, 4), (0, 8))
    other = plain(same(linear), array_of(1, 2, 3, 4) * scale, (0, 8))
    times = np.linspace(0, 8, 33)
    assert np.array_equal(one.knots, other.knots)
    assert np.array_equal(one.at(times) * scale, other.at(times))


def test_a_small_variable_is_as_accurate_as_a_large_one() -> None:
    def f(t: Any, x: Any, v: Any, y: Any, u: Any) -> tuple[Any, ...]:
        return v, -x, u, -4 * y

    solution = plain(same(f), array_of(1e10, 0, 1e-100, 0), (0, 10), blocks=(2, 2))
    times = np.linspace(0, 10, 50)
    found = solution.at(times)
    assert found[:, 0] == pytest.approx(1e10 * np.cos(times), abs=1e-2)
    assert found[:, 2] == pytest.approx(1e-100 * np.cos(2 * times), abs=1e-111)


# --- steps of the caller


def test_a_step_ends_where_it_is_told_to_and_none_is_longer() -> None:
    stops = [0.1, 2.0, 2.0000001, 7.5]
    for end in (10, -10):
        wanted = [math.copysign(stop, end) for stop in stops]
        path = plain(same(oscillator), array_of(1, 0), (0, end), longest=0.3, stops=wanted)
        # Steps end and begin a few units in the last place before and after a stop.
        for stop in wanted:
            near = path.knots[np.isclose(path.knots, stop, rtol=4e-15, atol=0)]
            assert near.min() < stop < near.max()
        assert np.abs(np.diff(path.knots)).max() <= 0.3
        assert path.at(array_of(end))[0] == pytest.approx([math.cos(end), -math.sin(end)], abs=1e-12)


def pulse(module: ModuleType) -> Callable[..., tuple[Any, ...]]:
    """A pulse of area sqrt(pi) at t = 5.3."""
    return lambda t, y: (module.exp(-(((t - 5.3) / 1e-6) ** 2)) / 1e-6,)


@pytest.mark.parametrize("engine", ["auto", "taylor", "symplectic"])
def test_a_pulse_at_a_stop_is_seen_by_every_method(engine: Engine) -> None:
    found = integrate.integrate(pulse, array_of(0), (0, 20), stops=[5.3], engine=engine)
    assert found.at(array_of(20.0))[0] == pytest.approx([math.sqrt(math.pi)], rel=1e-8)
    assert found.note is None if engine == "auto" else "acts for a moment" in str(found.note)
    assert plain(pulse, array_of(0), (0, 20)).at(array_of(20.0))[0] == [0]


@by_every_engine
def test_the_longest_step_binds_every_method(module: ModuleType) -> None:
    path = ENGINES[module](same(oscillator), array_of(1, 0), (0, 10), longest=0.01)
    assert np.diff(path.knots).max() <= 0.01 + 1e-14
    assert path.at(array_of(10.0))[0] == pytest.approx([math.cos(10), -math.sin(10)], abs=1e-12)


# --- what hardly moves


@pytest.mark.parametrize("module", [runge_kutta, symplectic])
def test_rest_takes_few_steps(module: ModuleType) -> None:
    solution = ENGINES[module](same(lambda t, x, v: (v, 0 * x)), array_of(3, 0), (0, 1e9))
    assert solution.steps < 20
    assert solution.at(array_of(0, 12.5, 1e9)).tolist() == [[3, 0]] * 3


def test_equilibrium_up_to_rounding_does_not_stall() -> None:
    # A weight on a spring: the force is the rounding error of k x - m g, and jumps with the last bit of x.
    m, g, k = 0.3, 9.81, 4.7

    def f(t: Any, x: Any, p: Any) -> tuple[Any, ...]:
        return p / m, m * g - k * x

    solution = plain(same(f), array_of(m * g / k + 5e-16, 0), (0, 1000))
    assert solution.steps < 20_000
    assert solution.at(np.linspace(0, 1000, 99))[:, 0] == pytest.approx(m * g / k, abs=1e-12)


# --- samples


def test_samples_in_any_order_and_number() -> None:
    solution = plain(same(oscillator), array_of(1, 0), (0, 30))
    times = np.random.default_rng(2).uniform(0, 30, 40_000)
    found = solution.at(times)
    assert np.abs(found[:, 0] - np.cos(times)).max() < 2e-12
    some = np.argsort(times)[::997]
    assert np.array_equal(solution.at(times[some]), found[some])
    assert solution.at(np.array([])).shape == (0, 2)
    assert solution.at(array_of(0.0))[0].tolist() == [1, 0]


@pytest.mark.parametrize("outside", [-0.001, math.nan])
def test_times_outside_the_span_are_refused(outside: float) -> None:
    for span in ((0, 10), (10, 0)):
        solution = plain(same(oscillator), array_of(1, 0), span)
        with pytest.raises(ValueError, match="outside the span from"):
            solution.at(array_of(1, outside))
        assert solution.at(array_of(10 * (1 + 2e-16))).shape == (1, 2)


@pytest.mark.parametrize("power", [2, 12])
def test_what_begins_with_nothing(power: int) -> None:
    # y = t^n e^-t, beside a variable that moves.
    def flow(module: ModuleType) -> Callable[..., tuple[Any, ...]]:
        return lambda t, x, y: (-x, power * t ** (power - 1) * module.exp(-t) - y)

    times = np.linspace(0, 3, 7)
    found = plain(flow, array_of(1, 0), (0, 3)).at(times)
    assert found[:, 1] == pytest.approx(times**power * np.exp(-times), rel=1e-9, abs=1e-12)


# --- honest ends


def sqrt_of(sign: float) -> Flow:
    return lambda module: lambda t, y: (sign * module.sqrt(y),)


ENDS: dict[str, tuple[Flow, float, tuple[float, float], float, Stop]] = {
    "pole": (same(lambda t, y: (1 / ((t - 0.5) * (t - 0.5)),)), 0, (0, 1), 0.5, Stop.INFINITE),
    "pole backwards": (same(lambda t, y: (1 / (t + 7) ** 2,)), 0, (0, -10), -7, Stop.INFINITE),
    "sqrt of the state": (sqrt_of(-1), 1, (0, 5), 2, Stop.NO_VALUE),
    "log of the state": (lambda m: lambda t, y: (-1 / m.log(y),), 2, (0, 2), 2 * math.log(2) - 1, Stop.LOST),
    "asin": (lambda m: lambda t, y: (m.arcsin(t) if m is np else m.asin(t),), 0, (0, 2), 1, Stop.NO_VALUE),
    "blow-up": (same(lambda t, y: (y * y,)), 1, (0, 2), 1, Stop.INFINITE),
    "too large": (same(lambda t, y: (y,)), 1e290, (0, 100), math.log(10) * 15.5, Stop.TOO_LARGE),
}


def end_of(
    flow: Flow, start: float | Floats, span: tuple[float, float], follow: Callable[..., Solution] = plain
) -> Stopped:
    with pytest.raises(Stopped) as caught:
        follow(flow, np.atleast_1d(start), span, name="the motion")
    return caught.value


@by_either
@pytest.mark.parametrize("name", ENDS)
def test_solutions_that_end(name: str, follow: Callable[..., Solution]) -> None:
    flow, start, span, time, stop = ENDS[name]
    end = end_of(flow, start, span, follow)
    assert end.time == pytest.approx(time, abs=5 if name == "too large" else 1e-10)
    assert end.stop is stop
    assert str(end).startswith(f"the motion {stop} t = ")
    assert name == "too large" or str(end).endswith(f" {time:.10g}")
    assert isinstance(end, ComputationError)
    assert not str(end).endswith(".")


def test_what_changes_too_fast_has_a_hint_and_other_ends_have_none() -> None:
    assert "tanh" in (end_of(*ENDS["log of the state"][:3]).hint or "")
    assert end_of(*ENDS["pole"][:3]).hint is None


@pytest.mark.parametrize("end", [1e25, 1e160])
def test_a_span_that_is_far_too_long_is_no_blow_up(end: float) -> None:
    stop = end_of(same(lambda t, y: (y,)), 1, (0, end)).stop
    assert stop is Stop.LOST


@few
@given(
    st.floats(0.02, 0.98),
    st.integers(1, 4),
    st.floats(-6, 6),
    st.booleans(),
    st.sampled_from([0.0, 1.0, -7.0]),
)
def test_no_pole_is_ever_crossed(place: float, power: int, size: float, up: bool, start: float) -> None:
    strength = 10**size if up else -(10**size)
    end = end_of(same(lambda t, y: (strength / (t - place) ** power,)), start, (0, 1))
    assert end.time == pytest.approx(place, abs=1e-9)


@few
@given(st.floats(0.02, 0.98), st.integers(2, 5))
def test_every_blow_up_is_found(time: float, power: int) -> None:
    # y' = y^p ends at y0^(1 - p)/(p - 1).
    start = ((power - 1) * time) ** (1 / (1 - power))
    end = end_of(same(lambda t, y: (y**power,)), start, (0, 1))
    assert end.stop is Stop.INFINITE
    assert end.time == pytest.approx(time, rel=1e-9)


def sign_of(module: ModuleType, x: Any) -> Any:
    return np.sign(x) if module is np else float(x > 0) - float(x < 0)


def rubbed(module: ModuleType) -> Callable[..., tuple[Any, ...]]:
    """An oscillator with dry friction 1/2."""
    return lambda t, x, v: (v, -x - sign_of(module, v) / 2)


def test_dry_friction_takes_the_same_from_every_swing() -> None:
    # From rest at 5.3, each half-period is an oscillation about -+1/2, and shorter by 1.
    solution = plain(rubbed, array_of(5.3, 0), (0, 15.7))
    times = np.linspace(0, 15.7, 300)
    swing = np.floor(times / math.pi)
    expected = (-1) ** swing * ((4.8 - swing) * np.cos(times - swing * math.pi) + 0.5)
    assert solution.at(times)[:, 0] == pytest.approx(expected, abs=1e-10)


@pytest.mark.parametrize(
    "flow",
    [
        lambda m: lambda t, y: (m.log(y),),
        lambda m: lambda t, y: (m.exp(1000 + y),),
    ],
)
@by_every_engine
def test_a_start_without_a_slope_is_refused(flow: Flow, module: ModuleType) -> None:
    with pytest.raises(Stopped, match="no finite real value at the start, t = 3") as caught:
        ENGINES[module](flow, array_of(0), (3, 4))
    assert caught.value.time == 3
    assert caught.value.stop is Stop.AT_START


def test_what_cannot_reach_its_end_is_given_up_early_or_solved_by_another_method() -> None:
    # Stability holds explicit steps at 1e-9 of the span, so that 1e10 of them are wanted.
    problem = same(lambda t, y: (-1e9 * y + 1,)), array_of(1), (0, 30)
    with pytest.raises(TooManySteps, match="more than 1,000,000 steps: 8,192 have come"):
        integrate.integrate(*problem, engine="runge-kutta")
    found = integrate.integrate(*problem)
    assert found.engine == "stiff"
    assert "held back by fast decay" in str(found.note)
    assert found.at(array_of(30))[0] == pytest.approx([1e-9], rel=1e-7)
    # An oscillation that goes on has to be followed.
    with pytest.raises(TooManySteps):
        integrate.integrate(same(lambda t, y, v: (v, -(y**3) * 1e12)), array_of(1, 0), (0, 1e3))


@pytest.mark.parametrize(
    "change",
    [
        {"tolerance": 0.0},
        {"tolerance": math.nan},
        {"blocks": (3,)},
        {"span": (0, math.inf)},
        {"start": array_of(1, math.nan)},
    ],
)
def test_what_is_no_problem_at_all_is_refused(change: dict[str, Any]) -> None:
    problem = {"flow": same(oscillator), "start": array_of(1, 0), "span": (0, 1), **change}
    with pytest.raises(ValueError, match="cannot integrate"):
        plain(**problem)


def test_mistakes_of_the_flow_are_not_taken_for_ends() -> None:
    with pytest.raises(TypeError):
        plain(same(lambda t, x: (x,)), array_of(1, 0), (0, 1))
    with pytest.raises(ValueError, match="cannot reshape"):
        plain(same(lambda t, x, v: (x,)), array_of(1, 0), (0, 1))


# --- engines


@by_every_engine
def test_the_same_problem_has_the_same_bytes(module: ModuleType) -> None:
    one, two = (ENGINES[module](pendulum, array_of(2, 0), (0, 9)) for _ in range(2))
    times = np.linspace(0, 9, 99)
    assert one.knots.tobytes() == two.knots.tobytes()
    assert one.at(times).tobytes() == two.at(times).tobytes()


@by_every_engine
def test_a_span_of_nothing(module: ModuleType) -> None:
    found = ENGINES[module](same(oscillator), array_of(1, 2), (5, 5))
    assert found.at(array_of(5, 5)).tolist() == [[1, 2], [1, 2]]
    assert found.steps == 0 or module is taylor


@by_every_engine
def test_too_many_steps(module: ModuleType, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "MOST_NUMBERS", 2000)
    with pytest.raises(TooManySteps, match=r"needs more than [\d,]+ steps") as caught:
        ENGINES[module](same(oscillator), array_of(1, 0), (0, 1e6))
    assert caught.value.hint is not None


@by_every_engine
@pytest.mark.parametrize("span", [(0, 2000), (10, -1990)])
def test_progress_is_told_in_fractions(
    module: ModuleType, span: tuple[float, float], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(taylor, "NUMBERS_PER_REPORT", 128)
    told: list[float] = []
    ENGINES[module](same(oscillator), array_of(1, 0), span, progress=told.append)
    assert len(told) > 5
    assert all(0 <= fraction < 1 for fraction in told)
    assert told[-1] > 0.9
    assert module is symplectic or told == sorted(told)  # which begins anew with shorter steps


def test_without_heyoka_taylor_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "heyoka", None)
    with pytest.raises(ComputationError, match="heyoka, which is not installed") as caught:
        integrate.integrate(same(oscillator), array_of(1, 0), (0, 1), engine="taylor")
    assert caught.value.hint is not None
    assert "rigidcli[taylor]" in caught.value.hint


# --- the Taylor engine


CORNERS: dict[str, tuple[Flow, float, str]] = {
    # |t - 1| as a root is one analytic function before 1 and another after.
    "root": (lambda m: lambda t, y: (m.sqrt((t - 1) * (t - 1)),), 2.5, "does not follow its Taylor series"),
    "no series": (lambda m: lambda t, y: (m.fabs(t - 1),), 2.5, "heyoka cannot express the solution"),
}


@pytest.mark.parametrize("name", CORNERS)
def test_what_has_no_series_is_left_to_the_other_method(name: str) -> None:
    flow, end, reason = CORNERS[name]
    found = compiled(flow, array_of(0), (0, 3))
    assert found.method == "Dormand-Prince 8(5,3)"
    assert reason in (found.note or "")
    assert found.at(array_of(3.0))[0] == pytest.approx([end], rel=1e-10)


def eager(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let `auto` change as soon as it can."""
    pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    monkeypatch.setattr(integrate, "TRIAL", 200)
    monkeypatch.setattr(integrate, "WORTH_COMPILING", 2000)


def test_auto_changes_to_taylor_when_much_is_left(monkeypatch: pytest.MonkeyPatch) -> None:
    eager(monkeypatch)
    short = integrate.integrate(same(oscillator), array_of(1, 0), (0, 50))
    long = integrate.integrate(same(oscillator), array_of(1, 0), (0, 1000))
    assert short.method == "Dormand-Prince 8(5,3)"
    assert long.method == "Taylor (heyoka)"
    assert long.at(array_of(1000.0))[0] == pytest.approx([math.cos(1000), -math.sin(1000)], abs=1e-12)
