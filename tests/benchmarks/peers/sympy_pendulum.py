"""The orbit of a double pendulum by sympy and scipy, as csv: what a person writes who begins with L.

python sympy_pendulum.py DURATION SAMPLES
"""

import sys

import numpy as np
import sympy as sp
from scipy.integrate import solve_ivp

a, b, u, v, p, r = sp.symbols("a b u v p r", real=True)
m1, m2, l1, l2, g = 1, sp.Rational(3, 5), 1, sp.Rational(7, 10), sp.Float("9.81")
T = (m1 + m2) * l1**2 * u**2 / 2 + m2 * l2**2 * v**2 / 2 + m2 * l1 * l2 * u * v * sp.cos(a - b)
L = T + (m1 + m2) * g * l1 * sp.cos(a) + m2 * g * l2 * sp.cos(b)
rates = sp.Matrix([[sp.diff(L, x, y) for y in (u, v)] for x in (u, v)]).LUsolve(sp.Matrix([p, r]))
H = p * u + r * v - L
H = H.subs({u: rates[0], v: rates[1]})
slopes = sp.lambdify(
    [a, b, p, r], [sp.diff(H, p), sp.diff(H, r), -sp.diff(H, a), -sp.diff(H, b)], "math", cse=True
)
times = np.linspace(0, float(sys.argv[1]), int(sys.argv[2]))
orbit = solve_ivp(
    lambda t, y: slopes(*y.tolist()),
    times[[0, -1]],
    [0.8, 0.4, 0, 0],
    "DOP853",
    times,
    rtol=1e-12,
    atol=1e-12,
)
np.savetxt(sys.stdout, np.column_stack([times, orbit.y.T]), delimiter=",")
