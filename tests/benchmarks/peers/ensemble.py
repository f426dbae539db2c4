"""Free bodies from many starts by heyoka's batch integration, as csv: `python ensemble.py STARTS.csv`."""

from __future__ import annotations

import sys

import heyoka
import numpy as np
import orjson

MOMENTS, SPAN, SAMPLES, LANES = (1.0, 2.0, 3.0), 100.0, 100, 4


def equations() -> list[tuple[heyoka.expression, heyoka.expression]]:
    """Euler's equations without a torque, and those of the quaternion."""
    a, b, c = MOMENTS
    w1, w2, w3, q0, q1, q2, q3 = heyoka.make_vars("w1", "w2", "w3", "q0", "q1", "q2", "q3")
    return [
        (w1, (b - c) / a * w2 * w3),
        (w2, (c - a) / b * w3 * w1),
        (w3, (a - b) / c * w1 * w2),
        (q0, -0.5 * (q1 * w1 + q2 * w2 + q3 * w3)),
        (q1, 0.5 * (q0 * w1 + q2 * w3 - q3 * w2)),
        (q2, 0.5 * (q0 * w2 + q3 * w1 - q1 * w3)),
        (q3, 0.5 * (q0 * w3 + q1 * w2 - q2 * w1)),
    ]


starts = np.loadtxt(sys.argv[1], delimiter=",", skiprows=1)
assert len(starts) % LANES == 0
times = np.linspace(0.0, SPAN, SAMPLES)
integrator = heyoka.taylor_adaptive_batch(equations(), np.zeros((7, LANES)), tol=1e-15)
grid = np.repeat(times[:, None], LANES, axis=1)
sys.stdout.write("start,t,w1,w2,w3,q0,q1,q2,q3\n")
for first in range(0, len(starts), LANES):
    integrator.set_time(0.0)
    integrator.state[:3] = starts[first : first + LANES].T
    integrator.state[3:] = [[1.0], [0.0], [0.0], [0.0]]
    samples = integrator.propagate_grid(grid)[-1]
    for lane in range(LANES):
        table = np.column_stack([times, samples[:, :, lane]])
        rows = orjson.dumps(table, option=orjson.OPT_SERIALIZE_NUMPY).decode()
        place = first + lane
        sys.stdout.write(f"{place}," + rows[2:-2].replace("],[", f"\n{place},") + "\n")
