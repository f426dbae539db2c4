"""Pendulums from many starts, as csv: `python swarm.py scipy|heyoka STARTS.csv`.

scipy has all of them in one vector, and heyoka integrates four at a time.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

SPAN, SAMPLES, LANES = 20.0, 5, 4
TIMES = np.linspace(0.0, SPAN, SAMPLES)


def by_scipy(starts: Any) -> Any:
    from scipy.integrate import solve_ivp

    count = len(starts)

    def slopes(_t: float, y: Any) -> Any:
        return np.concatenate([y[count:], -np.sin(y[:count])])

    span, start = (0.0, SPAN), starts.T.ravel()
    found = solve_ivp(slopes, span, start, "DOP853", t_eval=TIMES, rtol=1e-12, atol=1e-12)
    return found.y.reshape(2, count, SAMPLES).transpose(1, 2, 0)


def by_heyoka(starts: Any) -> Any:
    import heyoka

    x, p = heyoka.make_vars("x", "p")
    equations = [(x, p), (p, -heyoka.sin(x))]
    integrator = heyoka.taylor_adaptive_batch(equations, np.zeros((2, LANES)), tol=1e-15)
    grid = np.repeat(TIMES[:, None], LANES, axis=1)
    found = []
    for first in range(0, len(starts), LANES):
        integrator.set_time(0.0)
        integrator.state[:] = starts[first : first + LANES].T
        found.append(integrator.propagate_grid(grid)[-1].transpose(2, 0, 1))
    return np.concatenate(found)


path = np.loadtxt(sys.argv[2], delimiter=",", skiprows=1)
states = {"scipy": by_scipy, "heyoka": by_heyoka}[sys.argv[1]](path)
sys.stdout.write("start,t,x,p\n")
for place, table in enumerate(states):
    sys.stdout.writelines(
        f"{place},{t!r},{x!r},{p!r}\n" for t, (x, p) in zip(TIMES.tolist(), table.tolist(), strict=True)
    )
