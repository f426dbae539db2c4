"""Torque-free motion in closed form beside integrators.

    python tests/benchmarks/torque_free.py [RUNS]

Prints the median of RUNS (default 7) runs for 100,001 samples of omega and orientation over 10,000 turns:
of rigidcli, of heyoka's Taylor integrator if it can be imported (its compilation apart), and of scipy's
DOP853 with rtol = atol = 1e-12, which takes so long that it is run once over a hundredth of the span and of
the samples, and its time multiplied by 100. The errors at the end are against the closed form.
"""

import importlib
import importlib.util
import math
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rigidcli.core.freebody import at, free_motion, sensitivity
from rigidcli.core.tensor import Inertia

Floats = NDArray[np.float64]

MOMENTS = (1.0, 2.0, 2.5)
OMEGA = np.array([0.3, 0.5, 0.9])
START = np.array([1.0, 0.0, 0.0, 0.0])
SPAN = 1e4 * 2 * math.pi / float(np.linalg.norm(OMEGA))
TIMES = np.linspace(0, SPAN, 100_001)
SHARE = 100


def median(job: Callable[[], object], runs: int) -> float:
    """The median time (ms) of a job, after one run that is not counted."""
    job()
    spent = []
    for _ in range(runs):
        start = time.perf_counter()
        job()
        spent.append(time.perf_counter() - start)
    return statistics.median(spent) * 1e3


def closed() -> Floats:
    """The quaternions of rigidcli."""
    return at(free_motion(Inertia.of(np.diag(MOMENTS)), OMEGA, START), TIMES)[1]


def slopes(_: float, state: Floats) -> Floats:
    """d/dt of omega (3) and the quaternion (4)."""
    x, y, z, q0, q1, q2, q3 = state
    I1, I2, I3 = MOMENTS
    return np.array(
        [
            (I2 - I3) / I1 * y * z,
            (I3 - I1) / I2 * z * x,
            (I1 - I2) / I3 * x * y,
            (-q1 * x - q2 * y - q3 * z) / 2,
            (q0 * x + q2 * z - q3 * y) / 2,
            (q0 * y + q3 * x - q1 * z) / 2,
            (q0 * z + q1 * y - q2 * x) / 2,
        ]
    )


def by_scipy() -> Floats:
    """The quaternions of solve_ivp, over a share of the span and of the samples."""
    times = TIMES[: len(TIMES) // SHARE + 1]
    initial = np.concatenate([OMEGA, START])
    solution = solve_ivp(slopes, (0, times[-1]), initial, "DOP853", times, rtol=1e-12, atol=1e-12)
    quaternions: Floats = solution.y[3:].T
    return quaternions


def heyoka_job() -> tuple[float, Callable[[], Floats]]:
    """The time (ms) to compile heyoka's integrator, and the job that follows the motion with it."""
    heyoka = importlib.import_module("heyoka")
    names = heyoka.make_vars("x", "y", "z", "q0", "q1", "q2", "q3")
    initial = np.concatenate([OMEGA, START])
    start = time.perf_counter()
    system = list(zip(names, slopes(0.0, np.array(names, dtype=object)), strict=True))
    integrator = heyoka.taylor_adaptive(system, initial)
    compilation = (time.perf_counter() - start) * 1e3

    def follow() -> Floats:
        integrator.time = 0.0
        integrator.state[:] = initial
        quaternions: Floats = integrator.propagate_grid(TIMES)[-1][:, 3:]
        return quaternions

    return compilation, follow


def error(quaternions: Floats, reference: Floats) -> float:
    """The angle (rad) between the last of `quaternions` and that of `reference` at the same sample."""
    one, other = quaternions[-1], reference[len(quaternions) - 1]
    one = one / np.linalg.norm(one)
    chord = min(float(np.linalg.norm(one - other)), float(np.linalg.norm(one + other)))
    return 4 * math.asin(min(1.0, chord / 2))


def row(title: str, milliseconds: float, note: str) -> None:
    """Print one result."""
    print(f"{title:32} {milliseconds:9.1f} ms   {note}", flush=True)


def main() -> None:
    """Run all of them."""
    runs = int(sys.argv[1]) if len(sys.argv) > 1 else 7
    reference = closed()
    rounding = sensitivity(Inertia.of(np.diag(MOMENTS)), OMEGA, START, TIMES)
    row("rigidcli", median(closed, runs), f"rounding of the inputs alone: {rounding:.1e} rad")
    if importlib.util.find_spec("heyoka"):
        compilation, follow = heyoka_job()
        note = f"error {error(follow(), reference):.1e} rad; and {compilation:.0f} ms to compile"
        row("heyoka, propagate_grid", median(follow, runs), note)
    start = time.perf_counter()
    quaternions = by_scipy()
    spent = (time.perf_counter() - start) * 1e3 * SHARE
    note = f"error {error(quaternions, reference):.1e} rad after 1/{SHARE} of the span; time scaled up"
    row("scipy, solve_ivp DOP853", spent, note)


if __name__ == "__main__":
    main()
