"""Laws that the closed forms of all rigid bodies keep, free ones and heavy symmetric tops."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.core import mass_properties, rotation
from tests.core.rigid_motion import Motion, leaning

many = settings(max_examples=25)

NUMBERS = st.floats(-3, 3).map(lambda x: 0.0 if abs(x) < 1e-9 else x)
TIMES = st.lists(st.floats(-1e4, 1e4), min_size=1, max_size=20)


@st.composite
def free_bodies(draw: st.DrawFn) -> Motion:
    """A few masses, of any shape and axes, and an omega."""
    points = draw(st.lists(st.tuples(*[st.floats(-1, 1)] * 3), min_size=2, max_size=5))
    rows = np.array([[1.0, *point] for point in points] + [[1.0, 0.1, 0.2, 0.9], [2.0, 0.5, -0.8, 0.3]])
    omega = draw(st.tuples(*[st.floats(-2, 2)] * 3).filter(lambda w: math.hypot(*w) > 0.1))
    return Motion(mass_properties.of_points(rows).tensor, omega)


TOPS = st.builds(
    lambda along, weight, omega, q: Motion(np.diag([1.0, 1.0, along]), omega, q, weight=weight),
    st.floats(0.05, 2),
    st.floats(0.1, 5),
    st.tuples(NUMBERS, NUMBERS, NUMBERS),
    st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS).filter(lambda q: math.hypot(*q) > 0.1),
)
MOTIONS = free_bodies() | TOPS


def rounding(motion: Motion, times: list[float]) -> float:
    """What the rounding of the phase turns a body by (rad), some four times over: a float has 53 bits.

    A top of weight P and lambda1 = 1 also swings, at most at about sqrt(P) when it begins slowly.
    """
    rate = math.hypot(*motion.omega) + math.sqrt(motion.weight)
    return 4 * float(np.finfo(float).eps) * rate * max(map(abs, times), default=0.0)


@many
@given(MOTIONS, TIMES)
def test_energy_and_momentum_in_space_are_kept(motion: Motion, times: list[float]) -> None:
    # By the attitude as it is: that of t = 0 is first found, not given.
    inertia, weight = motion.inertia, motion.weight
    w, q = motion.found([0.0, *times])
    momentum = rotation.turned(q, w @ inertia)
    up = rotation.turned(q * [1, -1, -1, -1], np.broadcast_to([0.0, 0.0, 1.0], w.shape))[:, 2]
    energy = np.einsum("ti,ij,tj->t", w, inertia, w) / 2 + weight * up
    assert np.linalg.norm(q, axis=1) == pytest.approx(1, abs=1e-15)
    turned = rounding(motion, times)
    if weight:
        limit = 1e-13 + turned
        assert energy == pytest.approx(energy[0], abs=limit * (abs(energy[0]) + 2 * weight + 1))
        assert momentum[:, 2] == pytest.approx(momentum[0, 2], abs=limit * (np.abs(w @ inertia).max() + 1))
        assert w[:, 2].tolist() == [motion.omega[2]] * len(w)
    else:
        assert energy == pytest.approx(energy[0], rel=1e-14)
        size = np.linalg.norm(inertia) * np.linalg.norm(w[0])
        assert np.abs(momentum - momentum[0]).max() < (1e-14 + turned) * size


@many
@given(MOTIONS)
def test_it_begins_as_it_is_given(motion: Motion) -> None:
    w, q = motion.found([0.0])
    assert rotation.angles_between(q, np.array([motion.orientation]))[0] < 1e-14
    assert w[0] == pytest.approx(motion.omega, abs=1e-13)


@many
@given(MOTIONS, st.floats(-30, 30), st.floats(-30, 30))
def test_motions_go_on_from_where_they_are(motion: Motion, first: float, second: float) -> None:
    w, q = motion.found([first, first + second])
    onward = motion._replace(omega=w[0], orientation=q[0])
    later, turned = onward.found([second])
    # The state in between is rounded: what follows is open by so much, some ten times over.
    limit = 20 * onward.sensitivity([second]) + 20 * motion.sensitivity([first, first + second])
    limit += 4e-13 if motion.weight else 1e-14
    if limit < 1e-6:
        assert rotation.angles_between(turned, q[1:])[0] < limit
        assert later[0] == pytest.approx(w[1], abs=10 * limit)


@many
@given(MOTIONS, TIMES)
def test_time_reversal(motion: Motion, times: list[float]) -> None:
    # With omega reversed, the body goes back along its own way.
    back = motion._replace(omega=-np.array(motion.omega))
    w, q = motion.found(times)
    other_w, other_q = back.found(-np.array(times))
    limit = (
        motion.limit(times) + back.limit(-np.array(times))
        if motion.weight
        else 4e-14 + rounding(motion, times)
    )
    if limit < 1e-6:
        assert rotation.angles_between(q, other_q).max() < limit
        assert other_w == pytest.approx(-w, abs=10 * limit if motion.weight else limit)


FREE = Motion(np.diag([1, 2, 2.5]), [0.3, 0.5, 0.9])
TOP = Motion(np.diag([1, 1, 0.5]), [0, -0.3, 10], leaning(0.5), weight=1.0)


@pytest.mark.parametrize("motion", [FREE, TOP], ids=["free", "top"])
def test_samples_do_not_depend_on_each_other(motion: Motion) -> None:
    times = np.linspace(-1e4, 1e4, 20_001)
    w, q = motion.found(times)
    for k in (0, 8191, 8192, 16384, 20_000):
        one_w, one_q = motion.found(times[k : k + 1])
        assert one_w[0] == pytest.approx(w[k], abs=8e-16)
        assert np.abs(np.outer(one_q[0], one_q[0]) - np.outer(q[k], q[k])).max() < 1.7e-15
