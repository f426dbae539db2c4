"""Free bodies and heavy symmetric tops, and a truth about their motion that shares nothing with the program.

It is a Taylor series of Euler's equations for the angular momentum, with the vertical and the quaternion,
summed in decimals of 40 digits step by step.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from decimal import Context, Decimal, localcontext
from operator import mul
from typing import Any, NamedTuple

import mpmath
import numpy as np
from numpy.typing import NDArray

from rigidcli.core import free_body, heavy_top, principal

Floats = NDArray[np.float64]

START = np.array([0.5, -0.7, 0.1, 0.5])

WIDE = Context(prec=40, Emax=10**9, Emin=-(10**9))
ORDER = 24
PRECISE = Decimal("1e-20")
"""What a step of the series leaves out, in units of the state."""

State = tuple[Sequence[Any], Any]
"""omega in the body, and the matrix (mpmath) of the rotation from the body to space."""


def principal_frame(tensor: Floats) -> principal.PrincipalFrame:
    """The frame of a body by its tensor."""
    return principal.principal_frame(tensor)


class Motion(NamedTuple):
    """A body, its state at t = 0, times at which to look, and M g R of a top, whose axis is the third."""

    inertia: Floats
    omega: Sequence[float] | Floats
    orientation: Sequence[float] | Floats = START
    times: Sequence[float] = (0.3, 2.0, -1.0)
    weight: float = 0.0

    @property
    def inputs(self) -> tuple[Any, ...]:
        """What the module of the motion is given."""
        omega, orientation = np.array(self.omega, float), np.array(self.orientation, float)
        if self.weight:
            return self.inertia[0, 0], self.inertia[2, 2], self.weight, omega, orientation
        return self.inertia, omega, orientation

    def found(self, times: Iterable[float]) -> tuple[Floats, Floats]:
        """omega and quaternions by the closed form."""
        at = np.array(list(times), float)
        if self.weight:
            return heavy_top.heavy_motion(*self.inputs).at(at)
        body, omega, orientation = self.inputs
        unit = orientation / np.linalg.norm(orientation)
        spins, attitudes = free_body.motions(body, omega[None], unit[None], at)
        return spins[0], attitudes[0]

    def periods(self) -> free_body.Periods:
        """What characterises the motion of a free body."""
        body, omega, _ = self.inputs
        return free_body.periods(body, omega)

    def sensitivity(self, times: Iterable[float]) -> float:
        """What rounding of the inputs may turn the body by."""
        at = np.array(list(times), float)
        body, *state = self.inputs
        if self.weight:
            return heavy_top.sensitivity(body, state[0], state[1], state[2], state[3], at)
        return float(free_body.sensitivity(body, state[0][None], state[1][None], at)[0])

    def limit(self, times: Iterable[float]) -> float:
        """What rounding of the inputs may do, ten times over."""
        return 10 * self.sensitivity(times)

    def require(self, true: Sequence[State] = (), times: Sequence[float] = (), limit: float = 0.0) -> None:
        """Attitude (rad) and omega (in units of its size) are within `limit` of the truth at `times`."""
        times = times or self.times
        limit = limit or self.limit(times)
        true = true or by_series(self, times)
        for w, q, (spin, attitude) in zip(*self.found(times), true, strict=True):
            with mpmath.workdps(40):
                size = mpmath.norm(spin, mpmath.inf) + math.sqrt(self.weight / self.inertia[0, 0])
                miss = max(abs(x - float(y)) for x, y in zip(spin, w, strict=True))
                assert angle(matrix(q), attitude) <= limit
            assert miss <= limit * size
            assert abs(float(np.linalg.norm(q)) - 1) < 1e-15


def matrix(quaternion: Iterable[Any]) -> Any:
    """The rotation matrix of a quaternion of any length."""
    w, x, y, z = (mpmath.mpf(str(c) if isinstance(c, Decimal) else float(c)) for c in quaternion)
    rows = [
        [w * w + x * x - y * y - z * z, 2 * (x * y - w * z), 2 * (x * z + w * y)],
        [2 * (x * y + w * z), w * w - x * x + y * y - z * z, 2 * (y * z - w * x)],
        [2 * (x * z - w * y), 2 * (y * z + w * x), w * w - x * x - y * y + z * z],
    ]
    return mpmath.matrix(rows) / (w * w + x * x + y * y + z * z)


def angle(one: Any, other: Any) -> float:
    """The angle (rad) between two rotations."""
    chord = mpmath.norm(one - other) / (2 * mpmath.sqrt(2))
    return float(2 * mpmath.asin(min(mpmath.mpf(1), chord)))


def cross(a: Sequence[Any], b: Sequence[Any], times: Any = mul) -> list[Any]:
    """The vector product, with any product of the components."""
    return [times(a[i - 2], b[i - 1]) - times(a[i - 1], b[i - 2]) for i in range(3)]


def convolution(a: Sequence[Decimal], b: Sequence[Decimal]) -> Decimal:
    return sum(map(mul, a, reversed(b)), Decimal(0))


def _dot(a: Iterable[Decimal], b: Iterable[Decimal]) -> Decimal:
    return sum(map(mul, a, b), Decimal(0))


def _series(state: Sequence[Decimal], inverse: Sequence[Any], weight: Decimal) -> list[list[Decimal]]:
    """The coefficients of L1..L3, the vertical z1..z3 in the body, and q0..q3.

    L' = L x w + M g R z x e3, z' = z x w, q' = q (0, w)/2.
    """
    terms = [[x] for x in state]
    L, z, scalar, vector = terms[:3], terms[3:6], terms[6], terms[7:]
    w: list[list[Decimal]] = [[], [], []]
    for n in range(ORDER):
        for part, row in zip(w, inverse, strict=True):
            part.append(_dot(row, (x[n] for x in L)))
        torque = weight * z[1][n], -weight * z[0][n], Decimal(0)
        turns = zip(w, cross(vector, w, convolution), strict=True)
        slopes = [
            *(a + b for a, b in zip(cross(L, w, convolution), torque, strict=True)),
            *cross(z, w, convolution),
            -sum(map(convolution, vector, w), Decimal(0)) / 2,
            *((convolution(scalar, x) + y) / 2 for x, y in turns),
        ]
        for part, slope in zip(terms, slopes, strict=True):
            part.append(slope / (n + 1))
    return terms


def by_series(motion: Motion, times: Iterable[float | Decimal]) -> list[State]:
    """The states at `times`, each reached from the one before if that is on the same side of 0."""
    with localcontext(WIDE):
        weight = Decimal(motion.weight)
        rows = [[Decimal(float(x)) for x in row] for row in motion.inertia]
        adjugate = [cross(rows[i - 2], rows[i - 1]) for i in range(3)]
        inverse = [[x / _dot(rows[0], adjugate[0]) for x in row] for row in adjugate]
        omega, q = ([Decimal(float(x)) for x in v] for v in (motion.omega, motion.orientation))
        a, b, c, d = q = [x / _dot(q, q).sqrt() for x in q]
        vertical = [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c]
        start = [*(_dot(row, omega) for row in rows), *vertical, *q]
        pull = (weight * rows[0][0]).sqrt()
        states: list[State] = []
        now, state, unit = Decimal(0), start, Decimal(1)
        for time in times:
            target = +Decimal(time)
            if now * target < 0:
                now, state = Decimal(0), start
            while now != target:
                terms = _series(state, inverse, weight)
                # A tiny deviation from the vertical, which may grow, has its own scale.
                across = abs(state[0]) + abs(state[1]) + pull * min(unit, abs(state[3]) + abs(state[4]))
                lean = across / pull if pull else unit
                scales = [across, across, _dot(state[:3], state[:3]).sqrt(), lean, lean] + [unit] * 5
                h = target - now
                for n in (ORDER - 1, ORDER):
                    last = max(abs(part[n]) / size for part, size in zip(terms, scales, strict=True) if size)
                    if last:
                        h = min(abs(h), ((PRECISE / last).ln() / n).exp()).copy_sign(h)
                powers = [h**n for n in range(ORDER + 1)]
                state = [_dot(part, powers) for part in terms]
                now = target if h == target - now else now + h
            spin = [_dot(row, state[:3]) for row in inverse]
            with mpmath.workdps(40):
                states.append(([mpmath.mpf(str(x)) for x in spin], matrix(state[6:])))
        return states


def effect_of_rounding(motion: Motion, truth: Callable[[Motion], Sequence[State]]) -> float:
    """The angle (rad) that one unit in the last place of each input turns the first state of `truth` by."""
    grown = 1 + 2.0**-36 * np.eye(4)
    along = [grown[0, :3] * grown[1, :3], grown[2, :3]] if motion.weight else grown[:3, :3]
    changed = [
        *(motion._replace(inertia=motion.inertia * factors) for factors in along),
        *(motion._replace(omega=motion.omega * factors[:3]) for factors in grown[:3]),
        *(motion._replace(orientation=motion.orientation * factors) for factors in grown),
        motion._replace(weight=motion.weight * grown[0, 0]),
    ]
    reference = truth(motion)[0][1]
    with mpmath.workdps(40):
        turns = [angle(reference, truth(other)[0][1]) for other in changed]
    # One unit in the last place is between eps/2 and eps of a number.
    return math.hypot(*turns) * 2.0 ** (36 - 52)


def leaning(theta: float, phi: float = 0.0, psi: float = 0.0) -> list[float]:
    """The quaternion of these Euler angles (zxz)."""
    c, s = math.cos(theta / 2), math.sin(theta / 2)
    total, difference = (phi + psi) / 2, (phi - psi) / 2
    return [c * math.cos(total), s * math.cos(difference), s * math.sin(difference), c * math.sin(total)]
