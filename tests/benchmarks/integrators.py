"""What a user would write instead of `rigidcli euler -f csv`: the peer that tests/benchmarks/motion.py runs.

    python tests/benchmarks/integrators.py scipy|heyoka free|top|box DURATION SAMPLES

Writes t, q0 to q3 and L1 to L3 as csv. `free` has no torque, `top` is the cone of configs/cone_top.yaml, and
`box` a box that hangs by a corner.
"""

import sys
from collections.abc import Callable
from typing import Any

import numpy as np

MOMENTS = {"free": (1.0, 2.0, 2.5), "top": (0.000609375, 0.000609375, 1.875e-5), "box": (28.0, 25.0, 20.0)}
WEIGHT = {"free": (0.0, 0.0, 0.0), "top": (0.0, 0.0, 0.0735), "box": (3.0, 6.0, 9.0)}
"""M g R along the body's axes."""

OMEGA = {"free": (0.3, 0.5, 0.9), "top": (0.0, 0.0, 60 * np.pi), "box": (0.5, 2.0, -0.3)}
TILT = {"free": 0.0, "top": np.pi / 6, "box": 2.0}


def equations(name: str) -> Callable[..., list[Any]]:
    """q' = q (0, omega)/2 and L' = L x omega + N of plain numbers, or of heyoka's expressions."""
    (i1, i2, i3), (r1, r2, r3) = MOMENTS[name], WEIGHT[name]

    def rates(q0: Any, q1: Any, q2: Any, q3: Any, a: Any, b: Any, c: Any) -> list[Any]:
        u, v, w = a / i1, b / i2, c / i3
        x, y = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1)
        z = 1 - 2 * (q1 * q1 + q2 * q2)
        return [
            -0.5 * (q1 * u + q2 * v + q3 * w),
            0.5 * (q0 * u + q2 * w - q3 * v),
            0.5 * (q0 * v + q3 * u - q1 * w),
            0.5 * (q0 * w + q1 * v - q2 * u),
            b * w - c * v - (r2 * z - r3 * y),
            c * u - a * w - (r3 * x - r1 * z),
            a * v - b * u - (r1 * y - r2 * x),
        ]

    return rates


def start(name: str) -> list[float]:
    """The state at t = 0."""
    turn = [np.cos(TILT[name] / 2), np.sin(TILT[name] / 2), 0.0, 0.0]
    return [*turn, *(i * w for i, w in zip(MOMENTS[name], OMEGA[name], strict=True))]


def by_scipy(name: str, times: Any) -> Any:
    """With solve_ivp, DOP853."""
    from scipy.integrate import solve_ivp

    rates = equations(name)
    solved = solve_ivp(
        lambda t, y: rates(*y.tolist()),
        (0, times[-1]),
        start(name),
        "DOP853",
        times,
        rtol=1e-12,
        atol=1e-12,
    )
    return solved.y.T


def by_heyoka(name: str, times: Any) -> Any:
    """With heyoka's taylor_adaptive."""
    import heyoka

    variables = heyoka.make_vars("q0", "q1", "q2", "q3", "a", "b", "c")
    system = list(zip(variables, equations(name)(*variables), strict=True))
    return heyoka.taylor_adaptive(system, start(name)).propagate_grid(times)[-1]


if __name__ == "__main__":
    _, tool, system, duration, samples = sys.argv
    instants = np.linspace(0, float(duration), int(samples))
    states = {"scipy": by_scipy, "heyoka": by_heyoka}[tool](system, instants)
    np.savetxt(sys.stdout, np.column_stack([instants, states]), delimiter=",", fmt="%.17g")
