"""The orbit of a double pendulum by sympy and scipy, as csv: what a person writes who types T and V.

python sympy_pendulum.py DURATION SAMPLES
"""

import sys

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

a, b, adot, bdot, pa, pb = sp.symbols("a b adot bdot pa pb")
m1, m2, l1, l2, g = 1.0, 0.6, 1.0, 0.7, 9.81
T = (m1 + m2) * l1**2 * adot**2 / 2 + m2 * l2**2 * bdot**2 / 2 + m2 * l1 * l2 * adot * bdot * sp.cos(a - b)
V = -(m1 + m2) * g * l1 * sp.cos(a) - m2 * g * l2 * sp.cos(b)
velocities = sp.solve([sp.diff(T, adot) - pa, sp.diff(T, bdot) - pb], [adot, bdot])
H = (T + V).subs(velocities)
slopes = [sp.diff(H, pa), sp.diff(H, pb), -sp.diff(H, a), -sp.diff(H, b)]
f = sp.lambdify([a, b, pa, pb], slopes, modules="math", cse=True)
times = np.linspace(0, float(sys.argv[1]), int(sys.argv[2]))
start, span = [0.8, 0.4, 0.0, 0.0], (0.0, times[-1])
solved = solve_ivp(lambda t, y: f(*y.tolist()), span, start, "DOP853", times, rtol=1e-12, atol=1e-12)
np.savetxt(sys.stdout, np.column_stack([times, solved.y.T]), delimiter=",")
