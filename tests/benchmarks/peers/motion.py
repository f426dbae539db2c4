"""What a person writes who follows a free body: q' = q (0, omega)/2 and L' = L x omega, integrated, as csv.

python motion.py scipy|heyoka DURATION SAMPLES
"""

import sys
from typing import Any

import numpy as np

MOMENTS = np.array([1.0, 2.0, 2.5])
OMEGA = 2 * np.pi / np.sqrt(1.15) * np.array([0.3, 0.5, 0.9])
START = [1.0, 0.0, 0.0, 0.0, *(MOMENTS * OMEGA).tolist()]


def rates(q0: Any, q1: Any, q2: Any, q3: Any, a: Any, b: Any, c: Any) -> list[Any]:
    """The derivatives of the state, of plain numbers or of heyoka's expressions."""
    u, v, w = (L / moment for L, moment in zip((a, b, c), MOMENTS.tolist(), strict=True))
    return [
        -0.5 * (q1 * u + q2 * v + q3 * w),
        0.5 * (q0 * u + q2 * w - q3 * v),
        0.5 * (q0 * v + q3 * u - q1 * w),
        0.5 * (q0 * w + q1 * v - q2 * u),
        b * w - c * v,
        c * u - a * w,
        a * v - b * u,
    ]


def by_scipy(times: Any) -> Any:
    """With solve_ivp, DOP853."""
    from scipy.integrate import solve_ivp

    span = (0, times[-1])
    solved = solve_ivp(lambda t, y: rates(*y.tolist()), span, START, "DOP853", times, rtol=1e-12, atol=1e-12)
    return solved.y.T


def by_heyoka(times: Any) -> Any:
    """With heyoka's taylor_adaptive."""
    import heyoka

    variables = heyoka.make_vars("q0", "q1", "q2", "q3", "a", "b", "c")
    system = list(zip(variables, rates(*variables), strict=True))
    return heyoka.taylor_adaptive(system, START).propagate_grid(times)[-1]


if __name__ == "__main__":
    _, tool, duration, samples = sys.argv
    instants = np.linspace(0, float(duration), int(samples))
    states = {"scipy": by_scipy, "heyoka": by_heyoka}[tool](instants)
    np.savetxt(sys.stdout, np.column_stack([instants, states]), delimiter=",", fmt="%.17g")
