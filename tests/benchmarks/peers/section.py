"""A Poincare section of Henon and Heiles's system by heyoka's own events, as csv: `python section.py END`."""

from __future__ import annotations

import sys
from typing import Any

import heyoka

x, y, u, v = heyoka.make_vars("x", "y", "u", "v")
equations = [(x, u), (y, v), (u, -x - 2.0 * x * y), (v, -y - x * x + y * y)]
found: list[tuple[float, ...]] = []
START = [0.0, 0.1, 0.35, 0.1]


def passed(integrator: Any, time: float, _sign: int) -> None:
    """Remember the state at a crossing; the start is none."""
    if time < 1e-9:
        return
    integrator.update_d_output(time)
    found.append((time, *integrator.d_output.tolist()))


crossing = heyoka.nt_event(x, passed, direction=heyoka.event_direction.positive)
integrator = heyoka.taylor_adaptive(equations, START, tol=1e-15, nt_events=[crossing])
integrator.propagate_until(float(sys.argv[1]))
sys.stdout.write("t,x,y,p_x,p_y\n")
sys.stdout.writelines(",".join(map(repr, row)) + "\n" for row in found)
