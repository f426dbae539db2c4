"""Torque-free motion against two independent truths, and the names and numbers of its regimes.

One truth is a Taylor series in decimals. The other is the textbook closed form (Landau and Lifshitz,
section 37, with Legendre's integral of the third kind) by mpmath, with as many digits as it takes.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from scipy.integrate import quad
from scipy.spatial.transform import Rotation

from rigidcli.core import mass_properties, tensor
from rigidcli.errors import ComputationError
from tests.core.rigid_motion import (
    Floats,
    Motion,
    State,
    cross,
    effect_of_rounding,
    matrix,
    principal_frame,
)
from tests.tables import rows_of

few = settings(max_examples=20)

TURNED = np.array(Rotation.from_quat([0.3, -0.5, 0.2, 0.7]).as_matrix())
EPS = float(np.finfo(np.float64).eps)


def body(moments: Sequence[float], turn: Floats | None = None) -> Floats:
    diagonal = np.diag(np.array(moments, dtype=float))
    return diagonal if turn is None else tensor.rotate(diagonal, turn)


# --- the textbook closed form


def textbook(motion: Motion, times: Sequence[float], digits: int = 40) -> list[State]:
    """The states at `times` of a body whose motion is periodic."""
    inertia, omega, orientation = motion.inputs
    with mpmath.workdps(digits):
        if np.count_nonzero(inertia - np.diag(np.diag(inertia))):
            values, vectors = mpmath.eigsy(mpmath.matrix(inertia.tolist()))
        else:
            values, vectors = mpmath.matrix(np.diag(inertia).tolist()), mpmath.eye(3)
        order = sorted(range(3), key=lambda k: values[k])
        e = [[vectors[i, k] for i in range(3)] for k in order]
        w = [sum(x * mpmath.mpf(float(y)) for x, y in zip(axis, omega, strict=True)) for axis in e]
        moments = [values[k] for k in order]
        energy = sum(i * x * x for i, x in zip(moments, w, strict=True))
        L = mpmath.sqrt(sum((i * x) ** 2 for i, x in zip(moments, w, strict=True)))
        if energy * moments[1] > L * L:  # about the axis of smallest moment
            moments, e, w = moments[::-1], e[::-1], w[::-1]
        # Landau's (37.8) to (37.12) with 1 and 3 as they are here; the sign of the second is Euler's.
        I1, I2, I3 = moments
        handed = mpmath.sign(sum(x * y for x, y in zip(cross(e[0], e[1]), e[2], strict=True)))
        a1 = mpmath.sqrt((energy * I3 - L * L) / (I1 * (I3 - I1)))
        a3 = mpmath.sqrt((L * L - energy * I1) / (I3 * (I3 - I1))) * mpmath.sign(w[2])
        a2 = mpmath.sqrt((energy * I3 - L * L) / (I2 * (I3 - I2)))
        rate = mpmath.sqrt((I3 - I2) * (L * L - energy * I1) / (I1 * I2 * I3))
        m = (I2 - I1) * (energy * I3 - L * L) / ((I3 - I2) * (L * L - energy * I1))
        a2 *= mpmath.sign(I3 - I2) * mpmath.sign(a3) * handed
        n = I3 * (I2 - I1) / (I1 * (I3 - I2))
        K = mpmath.ellipk(m)

        def third(sn: Any, cn: Any) -> Any:
            return mpmath.ellippi(-n, mpmath.atan2(sn, cn), m)

        u0 = mpmath.ellipf(mpmath.atan2(w[1] / a2, w[0] / a1), m)
        states = []
        for time in (0.0, *times):
            u = u0 + rate * mpmath.mpf(time)
            turns = mpmath.nint(u / (2 * K))
            u -= 2 * K * turns
            sn, cn, dn = (mpmath.ellipfun(name, u, m=m) for name in ("sn", "cn", "dn"))
            phi = L * mpmath.mpf(time) / I3 + L * (I3 - I1) / (I1 * I3 * rate) * (
                third(sn, cn) + 2 * turns * mpmath.ellippi(-n, m)
            )
            sign = (-1) ** int(turns)
            rates = [a1 * cn * sign, a2 * sn * sign, a3 * dn]
            spin = [sum(rates[k] * e[k][i] for k in range(3)) for i in range(3)]
            up = [sum(rates[k] * moments[k] * e[k][i] for k in range(3)) / L for i in range(3)]
            # c's horizontal part is at the azimuth phi in axes along L: three known vectors in both axes.
            lift = sum(x * y for x, y in zip(up, e[2], strict=True))
            level = [x - lift * y for x, y in zip(e[2], up, strict=True)]
            length = mpmath.sqrt(sum(x * x for x in level))
            level = [x / length for x in level]
            side = cross(up, level)
            c, s = mpmath.cos(phi), mpmath.sin(phi)
            rows = [
                [c * x - s * y for x, y in zip(level, side, strict=True)],
                [s * x + c * y for x, y in zip(level, side, strict=True)],
                up,
            ]
            states.append((spin, mpmath.matrix(rows)))
        first = matrix(orientation) * states[0][1].T
        return [(spin, first * rows) for spin, rows in states[1:]]


INTEGRATED: list[tuple[str, Sequence[float], Sequence[float]]] = [
    *(
        (f"{x:+.0f}{y:+.0f}{z:+.0f} {name}", [1, 2, 2.5], [a * x, 0.5 * y, b * z])
        for x, y, z in ((1, 1, 1), (-1, 1, -1), (1, -1, -1))
        for name, a, b in (("highest", 0.3, 0.9), ("lowest", 0.9, 0.3))
    ),
    ("separatrix", [3, 4, 6], [2, 0.5, -1]),
    ("separatrix in other axes", [6, 3, 4], [1, -2, -0.5]),
    *(
        (f"beside the separatrix {side:+.0e}", [6, 3, 4], [1 + side, 2, -0.5])
        for side in (1e-3, -1e-8, 1e-12, -1e-15)
    ),
    ("about the least axis", [1, 2, 2.5], [0.7, 0, 0]),
    ("about the middle axis", [1, 2, 2.5], [0, -0.7, 0]),
    *(
        (f"wobble of {size} about {k}", [1, 2, 2.5], (np.eye(3)[k] + np.roll([0, size, -size], k)).tolist())
        for size, k in ((1e-8, 1), (1e-160, 1), (1e-160, 2))
    ),
    *(
        (f"{name} but for {gap}", [1, 1 + gap * a, 1 + gap * b if name == "sphere" else 1.6 + gap * b], w)
        for gap in (1e-13,)
        for name, a, b, w in (
            ("sphere", 1.0, 2.0, [0.3, 0.4, 0.5]),
            ("oblate", 1.0, 0.0, [0.3, 0.4, 0.5]),
            ("oblate, nearly across", 1.0, 0.0, [0.3, 0.4, 5e-7]),
        )
    ),
    ("prolate but for 1e-13, nearly across", [1, 1.6, 1.6 + 1e-13], [1e-7, 0.04, 0.5]),
    ("oblate", [1, 1, 1.6], [0.3, 0.4, -0.5]),
    ("prolate", [1.6, 1.6, 1], [0.3, 0.4, -0.5]),
    ("sphere", [1.6, 1.6, 1.6], [0.3, 0.4, -0.5]),
    ("plate", [1, 2, 3], [-0.3, 0.4, 0.5]),
]


@pytest.mark.parametrize(
    ("moments", "omega"), [case[1:] for case in INTEGRATED], ids=[c[0] for c in INTEGRATED]
)
def test_against_direct_integration(moments: list[float], omega: list[float]) -> None:
    Motion(body(moments), omega).require()


@pytest.mark.parametrize("moments", [[1, 2, 2.5], [1, 1, 1.6], [1, 1.6, 1.6], [3, 4, 6]])
def test_full_tensors_against_direct_integration(moments: list[float]) -> None:
    Motion(body(moments, TURNED), TURNED @ np.array([2, -0.5, 1]) / 2).require()


# --- long spans

TURNS = 1e4

LONG: list[tuple[str, Sequence[float], Sequence[float], int]] = [
    ("about the highest", [1, 2, 2.5], [-0.3, 0.5, 0.9], 40),
    ("about the lowest", [1, 2, 2.5], [-0.9, 0.5, -0.3], 40),
    ("a plate", [3, 1, 2], [0.5, -0.3, 0.4], 40),
    ("a thin plate of nearly a rod", [1e-3, 1, 1 + 1e-3], [3.0, 0.2, 0.4], 40),
    ("oblate", [1.6, 1, 1], [0.3, 0.4, 0.5], 40),
    ("prolate", [1, 1.6, 1.6], [0.3, 0.4, 0.5], 40),
    *(
        (f"beside the separatrix {side:+.0e}", [3, 4, 6], [2, 0.5, 1 + side], 50)
        for side in (1e-3, -1e-8, 1e-15)
    ),
    *(
        (f"wobble of {size} about {k}", [1, 2, 2.5], np.roll([1, size, -size], k).tolist(), digits)
        for size, digits, k in ((1e-8, 60, 1), (1e-40, 170, 2))
    ),
    ("sphere but for 1e-13", [1, 1 + 1e-13, 1 + 2e-13], [0.3, 0.4, 0.5], 60),
    ("oblate but for 1e-13", [1, 1 + 1e-13, 1.6], [0.3, 0.4, 0.5], 60),
    ("oblate but for 1e-13, nearly across", [1, 1 + 1e-13, 1.6], [0.3, 0.4, 5e-7], 60),
    ("prolate but for 1e-13, nearly across", [1, 1.6, 1.6 + 1e-13], [1e-7, 0.04, 0.5], 60),
    ("nearly a rod, end over end", [1e-12, 1, 1 + 3e-13], [1e-3, 0.7, -0.4], 60),
    ("slow", [1, 2, 2.5], [-3e-161, 5e-161, 9e-161], 40),
    ("tiny and light", [1e-47, 2e-47, 2.5e-47], [3e-161, 5e-161, 9e-161], 40),
]


@pytest.mark.parametrize(
    ("moments", "omega", "digits"), [case[1:] for case in LONG], ids=[c[0] for c in LONG]
)
def test_long_spans_against_the_textbook(moments: list[float], omega: list[float], digits: int) -> None:
    w = np.array(omega)
    turn = 2 * math.pi / math.hypot(*(w / np.abs(w).max())) / np.abs(w).max()
    times = [turn * x for x in (0.4, -3.3, TURNS / 7, TURNS, -TURNS)]
    motion = Motion(body(moments), w, times=times)
    motion.require(textbook(motion, times, digits))


def test_many_turns() -> None:
    turns = 1e6
    motion = Motion(body([1, 2, 2.5]), [-0.3, 0.5, 0.9])
    period = motion.periods().period
    assert period is not None
    times = [period * turns * x for x in (1.0, 0.7123, -1.3)]
    motion.require(textbook(motion, times, 50), times)


@pytest.mark.parametrize("moments", [[1, 2, 2.5], [1, 1.6, 1.6]])
def test_long_spans_of_full_tensors(moments: list[float]) -> None:
    motion = Motion(body(moments, TURNED), TURNED @ np.array([0.3, 0.5, 0.9]), times=[-6e4, 6e4])
    motion.require(textbook(motion, motion.times, 70))


# --- what the inputs themselves leave open


@pytest.mark.parametrize(("moments", "omega"), [([1, 2, 2.5], [0.3, 0.5, 0.9]), ([3, 4, 6], [2, 0.5, 1.1])])
def test_the_sensitivity_is_what_rounding_of_the_inputs_does(
    moments: list[float], omega: list[float]
) -> None:
    motion = Motion(body(moments), np.array(omega))
    expected = effect_of_rounding(motion, lambda body: textbook(body, [6e4]))
    assert expected / 2.1 < motion.sensitivity([6e4]) < expected * 1.1


def test_the_sensitivity_of_a_steady_spin() -> None:
    # A relative change by 2^-52 of 1.5 rad/s turns the body by 1.5 * 2^-52 t, and nothing else matters.
    inertia, w = body([1, 2, 2.5]), np.array([0.0, 0.0, 1.5])
    spinning, resting = Motion(inertia, w), Motion(inertia, np.zeros(3))
    assert spinning.sensitivity([0.0, 1e6]) == pytest.approx(1.5e6 * EPS, rel=0.1)
    assert spinning.sensitivity([-1e6, 3.0]) == pytest.approx(1.5e6 * EPS, rel=0.1)
    assert spinning.sensitivity([0.0]) == pytest.approx(4 * EPS, rel=0.5)
    assert resting.sensitivity([0.0, 1e9]) == pytest.approx(4 * EPS, rel=0.5)
    assert spinning.sensitivity([]) == pytest.approx(4 * EPS, rel=0.5)


def test_the_sensitivity_of_what_rounding_decides() -> None:
    # On the separatrix, and about the middle axis of a computed tensor, rounding alone decides after a while.
    assert Motion(body([3, 4, 6]), [2.0, 0.5, 1.0]).sensitivity([0.0, 1e3]) > 0.1
    spun = TURNED @ np.array([0, 1.0, 0])
    assert Motion(body([1, 2, 2.5], TURNED), spun).sensitivity(np.linspace(0, 1e4, 500)) > 0.1
    # That of a diagonal tensor is exact: a body without products of inertia goes on forever.
    assert Motion(body([1, 2, 2.5]), [0, 1.0, 0]).sensitivity([1e4]) < 1e-11
    linear = TURNED @ np.array([0, 0.3, 0.4])
    assert Motion(body([0, 2, 2], TURNED), linear).sensitivity([1e3]) < 1e-12


# --- regimes

REGIMES: list[tuple[str, list[float], list[float], str]] = [
    ("at rest", [1, 2, 2.5], [0, 0, 0], "rest"),
    ("a point at rest", [0, 0, 0], [0, 0, 0], "rest"),
    ("a sphere", [2, 2, 2], [1, 2, 3], "sphere"),
    ("a sphere but for 1e-13", [2, 2 + 2e-13, 2 + 4e-13], [1, 2, 3], "sphere"),
    ("a linear body", [1, 0, 1], [1, 0, 2], "linear"),
    ("a slender body", [1, 1e-12, 1], [1, 1e-16, 2], "prolate"),
    ("a body as thin as a line", [1, 1e-14, 1], [1, 0, 2], "linear"),
    ("spin about the least axis", [1, 2, 2.5], [-1, 0, 0], "principal"),
    ("spin about the middle axis", [1, 2, 2.5], [0, 3, 0], "principal"),
    ("spin across the symmetry axis", [2, 2, 1], [3, 4, 0], "principal"),
    ("oblate", [1, 3, 1], [1, 1, 1], "oblate"),
    ("prolate", [2, 1, 2], [1, 1, 1], "prolate"),
    ("oblate but for 1e-13", [1, 1 + 1e-13, 1.5], [1, 1, 1], "oblate"),
    ("not quite oblate", [1, 1 + 1e-11, 1.5], [1, 1, 1], "about_highest"),
    ("mostly about the least axis", [2.5, 1, 2], [0.1, 1, 0.5], "about_lowest"),
    ("mostly about the largest axis", [2.5, 1, 2], [1, 0.1, 0.5], "about_highest"),
    ("on the separatrix", [3, 4, 6], [2, 0.7, -1], "separatrix"),
    ("on it but for rounding", [3, 4, 6], [2, 0.7, -1 - EPS], "separatrix"),
    ("just outside", [3, 4, 6], [2, 0.7, 1 + 1e-14], "about_highest"),
    ("just inside", [3, 4, 6], [2, 0.7, 1 - 1e-14], "about_lowest"),
    ("a tiny wobble about the middle axis", [1, 2, 2.5], [1e-160, 1, 1e-160], "about_highest"),
    ("a tiny wobble", [1, 2, 2.5], [1, 0, 1e-200], "about_lowest"),
]


@pytest.mark.parametrize(
    ("moments", "omega", "regime"), [c[1:] for c in REGIMES], ids=[c[0] for c in REGIMES]
)
@pytest.mark.parametrize("scale", [1.0, 1e-47])
def test_regimes(moments: list[float], omega: list[float], regime: str, scale: float) -> None:
    exponent = math.frexp(scale)[1]
    motion = Motion(np.ldexp(body(moments), exponent), omega).periods()
    assert motion.regime == regime
    if regime in ("rest", "sphere", "linear", "principal", "separatrix"):
        assert motion.period is None
    if regime in ("about_highest", "about_lowest"):
        assert motion.period is not None
        assert motion.flip_interval == motion.period / 2
    else:
        assert motion.flip_interval is None
    assert (motion.mean_space_rate is None) == (regime == "rest")
    if regime in ("sphere", "linear", "principal"):
        assert motion.mean_space_rate == pytest.approx(math.hypot(*omega), rel=1e-15)


@pytest.mark.parametrize(
    ("moments", "omega", "regime"),
    rows_of(__file__, "regimes of computed tensors"),
)
def test_regimes_of_computed_tensors(moments: list[float], omega: list[float], regime: str) -> None:
    for seed in range(3):
        turn = np.array(Rotation.from_quat(np.random.default_rng(seed).normal(size=4)).as_matrix())
        motion = Motion(body(moments, turn), turn @ np.array(omega, dtype=float))
        assert motion.periods().regime == regime
        w, _ = motion.found([0.0, 50.0])
        assert w[0] == pytest.approx(turn @ np.array(omega), abs=1e-14)
        if regime in ("linear", "principal"):
            assert w[1].tolist() == w[0].tolist()


@pytest.mark.parametrize("omega", [[1e-12, 1, 0], [1, 0, 0], [-1e-12, 0, 2]])
def test_a_linear_body_cannot_spin_about_its_line(omega: list[float]) -> None:
    # A moment below 1e-13 of the others is zero.
    line, across = [0, 1, 1], TURNED @ omega
    assert Motion(body([1e-12, 1, 1]), np.array(omega)).periods().regime != "linear"
    for inertia, w in (
        (body(line), np.array(omega)),
        (body(line, TURNED), across),
        (body([1e-15, 1, 1], TURNED), across),
    ):
        with pytest.raises(ComputationError, match="linear"):
            Motion(inertia, w).periods()


@pytest.mark.parametrize("seed", range(5))
def test_spin_about_computed_axes_is_principal(seed: int) -> None:
    # As a document has it with omega along an axis that the program itself found.
    rng = np.random.default_rng(seed)
    rows = np.column_stack([rng.uniform(0.1, 1, 6), rng.normal(size=(6, 3)) * [0.01, 0.3, 1]])
    inertia = tensor.rotate(mass_properties.of_points(rows).tensor, TURNED)
    for axis in principal_frame(inertia).axes:
        assert Motion(inertia, 1.7 * axis).periods().regime == "principal"


# --- periods and rates


@few
@given(
    st.tuples(*[st.floats(0.2, 1)] * 3).map(lambda c: [c[0] + c[1], c[1] + c[2], c[2] + c[0]]),
    st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda w: math.hypot(*w) > 0.1),
)
def test_period_and_mean_rate_by_quadrature(moments: list[float], omega: tuple[float, float, float]) -> None:
    # Of the two invariants alone: w2 = a2 sin x and dt = I2 dw2 / ((I3 - I1) w3 w1); and the rate of the turn
    # about L is L times the mean of 1/I over the part of L across the axis of circulation.
    inertia, w = body(moments), np.array(omega)
    motion = Motion(inertia, w).periods()
    assume(motion.flip_interval is not None and motion.mean_space_rate is not None)
    principal = sorted(zip(moments, omega, strict=True), reverse=motion.regime == "about_lowest")
    (I1, w1), (I2, w2), (I3, w3) = principal
    momentum, energy = math.hypot(I1 * w1, I2 * w2, I3 * w3), I1 * w1**2 + I2 * w2**2 + I3 * w3**2
    assume(abs(momentum**2 - energy * I2) > 1e-3 * momentum**2 and min(abs(I3 - I2), abs(I2 - I1)) > 1e-2)
    a1 = math.sqrt((I1 * (I3 - I1) * w1**2 + I2 * (I3 - I2) * w2**2) / (I1 * (I3 - I1)))
    a2 = a1 * math.sqrt(I1 * (I3 - I1) / (I2 * (I3 - I2)))
    assume(a2 > 1e-3)

    def rates(x: float) -> tuple[float, float]:
        """dt/dx and phi'."""
        first, second = a1 * math.cos(x), a2 * math.sin(x)
        third = math.sqrt((energy - I1 * first**2 - I2 * second**2) / I3)
        across = (I1 * first) ** 2 + (I2 * second) ** 2
        precession = momentum * (I1 * first**2 + I2 * second**2) / across
        return I2 * a2 / (abs(I3 - I1) * third * a1), precession

    half = quad(lambda x: rates(x)[0], 0, math.pi, epsabs=0, epsrel=1e-11, limit=200)[0]
    turn = quad(lambda x: rates(x)[0] * rates(x)[1], 0, math.pi, epsabs=0, epsrel=1e-11, limit=200)[0]
    assert motion.flip_interval == pytest.approx(half, rel=1e-9)
    assert motion.mean_space_rate == pytest.approx(turn / half, rel=1e-9)
