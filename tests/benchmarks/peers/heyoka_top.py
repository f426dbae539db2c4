"""A heavy symmetric top by heyoka, as csv: what a person writes who knows Euler's equations with a weight.

python heyoka_top.py DURATION SAMPLES
"""

import sys

import heyoka as hy
import numpy as np

across, along, weight, distance = 2.0, 1.0, 9.81, 0.5
w1, w2, w3, q0, q1, q2, q3 = hy.make_vars("w1", "w2", "w3", "q0", "q1", "q2", "q3")
# Upward has these parts in the body: the weight turns the top by distance e3 x (-weight upward).
up1, up2 = 2 * (q1 * q3 - q0 * q2), 2 * (q2 * q3 + q0 * q1)
slopes = [
    (w1, ((across - along) * w2 * w3 + weight * distance * up2) / across),
    (w2, ((along - across) * w3 * w1 - weight * distance * up1) / across),
    (w3, hy.expression(0.0)),
    (q0, -0.5 * (q1 * w1 + q2 * w2 + q3 * w3)),
    (q1, 0.5 * (q0 * w1 + q2 * w3 - q3 * w2)),
    (q2, 0.5 * (q0 * w2 + q3 * w1 - q1 * w3)),
    (q3, 0.5 * (q0 * w3 + q1 * w2 - q2 * w1)),
]
start = [0.4, 0.3, 6.0, np.cos(np.pi / 6), np.sin(np.pi / 6), 0.0, 0.0]
times = np.linspace(0, float(sys.argv[1]), int(sys.argv[2]))
states = hy.taylor_adaptive(slopes, start).propagate_grid(times)[-1]
np.savetxt(sys.stdout, np.column_stack([times, states]), delimiter=",", fmt="%.17g")
