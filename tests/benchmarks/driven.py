"""A heavy top by `integrate` beside scipy's solve_ivp and heyoka.

    python tests/benchmarks/driven.py [RUNS]

A cone of 1 kg, 10 cm high and 2.5 cm in radius, spins about its tip with 1800 rpm, 30 degrees from the
vertical. Prints, for 10 s with 1,001 samples and for 1,000 s with 100,001, the median time of RUNS (default
5) runs, how many times faster that is than scipy, and how far the quaternion is from that of heyoka at its
finest tolerance. What takes minutes is run once; of the 1,000 s, scipy does 10 s, and the time is
multiplied by 100.
"""

import math
import statistics
import sys
import time
from collections.abc import Callable
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rigidcli.core.integrate import Engine, integrate

MASS, HEIGHT, RADIUS, GRAVITY = 1.0, 0.1, 0.025, 9.80665
ACROSS = MASS * (0.6 * HEIGHT**2 + 0.15 * RADIUS**2)
ALONG = 0.3 * MASS * RADIUS**2
TORQUE = MASS * GRAVITY * 0.75 * HEIGHT
MOMENTS = np.array([ACROSS, ACROSS, ALONG])
TILT, SPIN = math.radians(30), 1800 * 2 * math.pi / 60
START = np.array([math.cos(TILT / 2), math.sin(TILT / 2), 0, 0, 0, 0, ALONG * SPIN])


def flow(module: ModuleType) -> Callable[..., tuple[Any, ...]]:
    """Euler's equations for angular momentum, and q' = q (0, omega)/2: the same for all kinds of numbers."""

    def f(t: Any, q0: Any, q1: Any, q2: Any, q3: Any, L1: Any, L2: Any, L3: Any) -> tuple[Any, ...]:
        w1, w2, w3 = L1 / ACROSS, L2 / ACROSS, L3 / ALONG
        return (
            -0.5 * (q1 * w1 + q2 * w2 + q3 * w3),
            0.5 * (q0 * w1 + q2 * w3 - q3 * w2),
            0.5 * (q0 * w2 + q3 * w1 - q1 * w3),
            0.5 * (q0 * w3 + q1 * w2 - q2 * w1),
            L2 * w3 - L3 * w2 + 2 * TORQUE * (q2 * q3 + q0 * q1),
            L3 * w1 - L1 * w3 - 2 * TORQUE * (q1 * q3 - q0 * q2),
            L1 * w2 - L2 * w1,
        )

    return f


def plain(t: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
    """The same as people write it for solve_ivp."""
    q0, q, L = y[0], y[1:4], y[4:]
    w = L / MOMENTS
    down = np.array([2 * (q[0] * q[2] - q0 * q[1]), 2 * (q[1] * q[2] + q0 * q[0]), 0.0])
    torque = TORQUE * np.cross(down, [0.0, 0.0, 1.0])
    return np.concatenate([[-0.5 * q @ w], 0.5 * (q0 * w + np.cross(q, w)), np.cross(L, w) + torque])


def bare(t: float, y: NDArray[np.float64]) -> tuple[float, ...]:
    """The same as people write it who know that numpy is slow here."""
    return F(t, *y.tolist())


F = flow(math)


def scipy(function: Callable[..., Any], duration: float, samples: int) -> NDArray[np.float64]:
    """The samples of solve_ivp."""
    times = np.linspace(0, duration, samples)
    span = (0.0, duration)
    solution = solve_ivp(function, span, START, method="DOP853", rtol=1e-12, atol=1e-12, t_eval=times)
    return np.array(solution.y.T)


def ours(engine: Engine, duration: float, samples: int, tolerance: float = 1e-12) -> NDArray[np.float64]:
    """The samples of `integrate`."""
    span = (0.0, duration)
    solution = integrate(flow, START, span, tolerance=tolerance, blocks=(4, 3), engine=engine)
    return solution.at(np.linspace(0, duration, samples))


def measured(job: Callable[[], NDArray[np.float64]], runs: int) -> tuple[float, NDArray[np.float64]]:
    """The median of how long a job takes (s), and its samples."""
    laps = []
    for _ in range(runs):
        start = time.perf_counter()
        samples = job()
        laps.append(time.perf_counter() - start)
    return statistics.median(laps), samples


def main() -> None:
    """Print all comparisons."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 5
    start = time.perf_counter()
    ours("taylor", 1e-3, 2)
    print(f"heyoka: {time.perf_counter() - start:.2f} s to load it and compile for the first time")
    for duration, samples, rounds in ((10.0, 1001, runs), (1000.0, 100_001, 1)):
        truth = ours("taylor", duration, samples, 1e-15)[:1001, :4]
        jobs = {
            "solve_ivp, numpy": partial(scipy, plain, 10.0, 1001),
            "solve_ivp, floats": partial(scipy, bare, 10.0, 1001),
            "runge-kutta": partial(ours, "runge-kutta", duration, samples),
            "taylor": partial(ours, "taylor", duration, samples),
            "auto": partial(ours, "auto", duration, samples),
        }
        print(f"{duration:g} s")
        slowest = 0.0
        for title, job in jobs.items():
            spent, states = measured(job, rounds)
            if title.startswith("solve_ivp"):
                spent *= duration / 10
            slowest = slowest or spent
            error = np.abs(states[:1001, :4] - truth).max()
            print(
                f"  {title:18} {spent:8.3f} s  {slowest / spent:7.1f} x  error at 10 s {error:.0e}",
                flush=True,
            )


if __name__ == "__main__":
    main()
