"""The orbit of a double pendulum by heyoka, as csv: what a person writes who has worked out H by hand.

python heyoka_pendulum.py DURATION SAMPLES
"""

import sys

import heyoka as hy
import numpy as np

a, b, pa, pb = hy.make_vars("a", "b", "pa", "pb")
m1, m2, l1, l2, g = 1.0, 0.6, 1.0, 0.7, 9.81
c, s = hy.cos(a - b), hy.sin(a - b)
quadratic = m2 * l2**2 * pa**2 + (m1 + m2) * l1**2 * pb**2 - 2 * m2 * l1 * l2 * pa * pb * c
T = quadratic / (2 * m2 * l1**2 * l2**2 * (m1 + m2 * s**2))
H = T - (m1 + m2) * g * l1 * hy.cos(a) - m2 * g * l2 * hy.cos(b)
slopes = [(a, hy.diff(H, pa)), (b, hy.diff(H, pb)), (pa, -hy.diff(H, a)), (pb, -hy.diff(H, b))]
integrator = hy.taylor_adaptive(slopes, [0.8, 0.4, 0.0, 0.0], compact_mode=True)
times = np.linspace(0, float(sys.argv[1]), int(sys.argv[2]))
np.savetxt(sys.stdout, np.column_stack([times, integrator.propagate_grid(times)[-1]]), delimiter=",")
