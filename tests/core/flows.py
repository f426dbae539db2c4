"""Equations of motion that several tests integrate, and their exact solutions."""

from __future__ import annotations

import math
from collections.abc import Callable
from types import ModuleType
from typing import Any

import mpmath
import numpy as np
from numpy.typing import NDArray

from rigidcli.core.integrate import Flow

Floats = NDArray[np.float64]
Elements = Callable[..., tuple[Any, ...]]


def array_of(*values: float) -> Floats:
    return np.array(values, dtype=np.float64)


def same(f: Elements) -> Flow:
    """A flow of arithmetic alone."""
    return lambda module: f


def oscillator(t: Any, x: Any, v: Any) -> tuple[Any, ...]:
    return v, -x


def pendulum(module: ModuleType) -> Elements:
    return lambda t, q, p: (p, -module.sin(q))


def kepler(module: ModuleType) -> Elements:
    def f(t: Any, x: Any, y: Any, u: Any, v: Any) -> tuple[Any, ...]:
        square = x * x + y * y
        cube = square * module.sqrt(square)
        return u, v, -x / cube, -y / cube

    return f


def ellipse(eccentricity: float) -> Floats:
    """The start of an orbit of period 2 pi, at its end nearest to the centre."""
    e = eccentricity
    return array_of(1 - e, 0, 0, math.sqrt((1 + e) / (1 - e)))


def on_ellipse(eccentricity: float, time: float) -> Floats:
    """The state on it by Kepler's equation, at 40 digits."""
    with mpmath.workdps(40):
        e, t = mpmath.mpf(eccentricity), mpmath.mpf(time) % (2 * mpmath.pi)
        u = mpmath.findroot(lambda u: u - e * mpmath.sin(u) - t, t + e * mpmath.sin(t))
        root, rate = mpmath.sqrt(1 - e * e), 1 / (1 - e * mpmath.cos(u))
        state = mpmath.cos(u) - e, root * mpmath.sin(u), -mpmath.sin(u) * rate, root * mpmath.cos(u) * rate
        return array_of(*map(float, state))


def on_pendulum(q: float, time: float) -> Floats:
    """The pendulum released at rest at q: sin(q(t)/2) = k sn(K - t), k = sin(q/2), at 40 digits."""
    with mpmath.workdps(40):
        k = mpmath.sin(mpmath.mpf(q) / 2)
        u = mpmath.ellipk(k * k) - mpmath.mpf(time)
        sn, cn = (mpmath.ellipfun(kind, u, m=k * k) for kind in ("sn", "cn"))
        return array_of(float(2 * mpmath.asin(k * sn)), float(-2 * k * cn))
