"""A bare script for a sweep: spins of a heavy symmetric top, with what `precess` tells of each, as CSV.

    python sweep.py START STOP COUNT > spins.csv

The spins are in rad/s. It is what a person writes with numpy and scipy.special for one top, without units,
checks of what is given, or tops that are not in these ranges; the elliptic integrals are Carlson's.
"""

import csv
import sys

import numpy as np
from scipy.special import ellipk, elliprf, elliprj

MASS, DISTANCE, LAMBDA1, LAMBDA3, TILT, GRAVITY = 0.1, 0.075, 6.09375e-4, 1.875e-5, np.pi / 6, 9.8
"""The cone of configs/cone_top.yaml."""

spin = np.linspace(float(sys.argv[1]), float(sys.argv[2]), int(sys.argv[3]))
fall = MASS * GRAVITY * DISTANCE
momentum = LAMBDA3 * spin
upward = np.cos(TILT)

# Steady precession, and the sleeping top.
with np.errstate(invalid="ignore"):
    root = np.sqrt(momentum**2 - 4 * LAMBDA1 * fall * upward)
    slow, fast = 2 * fall / (momentum + root), (momentum + root) / (2 * LAMBDA1 * upward)
    upright = np.sqrt(momentum**2 - 4 * LAMBDA1 * fall)
    growth = np.sqrt(4 * LAMBDA1 * fall - momentum**2) / (2 * LAMBDA1)
least = 2 * np.sqrt(LAMBDA1 * fall * upward) / LAMBDA3
sleeping = 2 * np.sqrt(LAMBDA1 * fall) / LAMBDA3

# Nutation from rest: u'^2 = (u0 - u) (beta (1 - u^2) - a^2 (u0 - u)), u = cos(theta), u1 <= u <= u0.
a, beta = momentum / LAMBDA1, 2 * fall / LAMBDA1
half = a**2 / (2 * beta)
spread = np.sqrt(half**2 - 2 * half * upward + 1)
u1, u3 = half - spread, half + spread
k2 = (upward - u1) / (u3 - u1)
period = 4 * ellipk(k2) / np.sqrt(beta * (u3 - u1))


def mean(pole: float) -> np.ndarray:
    """The mean of (u0 - u)/(pole - u) over a period."""
    n = (upward - u1) / (pole - u1)
    third = elliprf(0, 1 - k2, 1) + n / 3 * elliprj(0, 1 - k2, 1, 1 - n)
    share: np.ndarray = (upward - pole) / (pole - u1) * third / ellipk(k2)
    return 1 + share


rate = a * (mean(1.0) / 2 - mean(-1.0) / 2)
columns = {
    "top.spin": spin,
    "top.gyroscopic_rate": fall / momentum,
    "top.gyroscopic_period": 2 * np.pi * momentum / fall,
    "top.slow_rate": slow,
    "top.fast_rate": fast,
    "top.minimum_spin": np.full_like(spin, least),
    "top.sleeping_spin": np.full_like(spin, sleeping),
    "top.sleeping_growth_rate": growth,
    "top.sleeping_rate": upright / (2 * LAMBDA1),
    "top.theta_min": np.full_like(spin, TILT),
    "top.theta_max": np.arccos(u1),
    "top.phi_dot_at_theta_max": a * (upward - u1) / (1 - u1**2),
    "top.nutation_period": period,
    "top.precession_per_nutation": rate * period,
    "top.mean_precession_rate": rate,
}
table = csv.writer(sys.stdout)
table.writerow(columns)
table.writerows(np.column_stack(list(columns.values())).tolist())
