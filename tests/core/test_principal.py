"""Principal frames against eigenvalues at 50 digits, and the rules where mechanics leaves a choice."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.core import principal, tensor
from rigidcli.core.principal import PrincipalFrame
from tests.core.rigid_motion import principal_frame

Floats = NDArray[np.float64]

few = settings(max_examples=30)

EPS = float(np.finfo(np.float64).eps)

QUATERNIONS = st.lists(st.floats(-1, 1), min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 0.1)
SCALES = st.sampled_from([1e-47, 1e-12, 1.0, 7.3, 1e37, 1e59])


@st.composite
def moments(draw: st.DrawFn) -> list[float]:
    """Moments that a body can have: l1 <= l2 <= l3 <= l1 + l2, equal ones and thin bodies among them."""
    second = draw(st.sampled_from([1.0, draw(st.floats(0.5, 1.0))]))
    low = draw(st.sampled_from([second, 1e-3, 1e-9, draw(st.floats(0.0, 1.0)) * second]))
    high = second + low * draw(st.sampled_from([0.0, 1.0, draw(st.floats(0.0, 1.0))]))
    return sorted([low, second, high])


def turned(values: Sequence[float], turn: Floats) -> Floats:
    return tensor.rotate(np.diag(np.array(values, dtype=float)), turn)


def of_quaternion(quaternion: Sequence[float]) -> Floats:
    return np.array(Rotation.from_quat(quaternion).as_matrix())


def by_mpmath(inertia: Floats) -> list[float]:
    """The eigenvalues of exactly this matrix, ascending, at 50 digits."""
    with mpmath.workdps(50):
        values = mpmath.eigsy(mpmath.matrix(inertia.tolist()), eigvals_only=True)
        return sorted(float(value) for value in values)


def require_frame(frame: PrincipalFrame) -> None:
    """Orthonormal to rounding, right-handed, ascending; e1 and e3 have their largest component positive."""
    axes = frame.axes
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 5e-15
    assert abs(np.linalg.det(axes) - 1) < 5e-15
    assert np.cross(axes[0], axes[1]) == pytest.approx(axes[2], abs=2e-15)
    assert frame.moments[0] <= frame.moments[1] <= frame.moments[2]
    assert frame.moments[0] >= 0
    for axis in axes[::2]:
        first = next(k for k in range(3) if axis[k] ** 2 >= max(axis**2) - 1e-9)
        assert axis[first] > 0
    assert [index for group in frame.groups for index in group] == [0, 1, 2]


# --- any tensor


@few
@given(moments(), QUATERNIONS, SCALES)
def test_moments_and_axes_of_any_body(values: list[float], quaternion: list[float], scale: float) -> None:
    inertia = turned(values, of_quaternion(quaternion)) * scale
    frame = principal_frame(inertia)
    require_frame(frame)
    largest = frame.moments[2]
    assert np.abs(frame.moments - by_mpmath(inertia)).max() <= 1e-13 * largest
    for axis, moment in zip(frame.axes, frame.moments, strict=True):
        # Of a group of equal moments, any axis may be off by what they differ by, 1e-12 of the largest.
        alone = any(len(group) == 1 and frame.moments[group[0]] == moment for group in frame.groups)
        assert np.abs(inertia @ axis - moment * axis).max() <= (5e-15 if alone else 2e-12) * largest
    assert principal.residual(inertia, frame) <= 3e-12
    assert np.abs(frame.axes.T @ np.diag(frame.moments) @ frame.axes - inertia).max() <= 3e-12 * largest


@few
@given(QUATERNIONS, st.floats(0.1, 0.9), st.floats(0.1, 0.9))
def test_well_separated_axes_are_exact_to_rounding(quaternion: list[float], low: float, step: float) -> None:
    values, turn = [low, 1.0, 1.0 + low * step], of_quaternion(quaternion)
    gap = min(1 - low, low * step)
    frame = principal_frame(turned(values, turn))
    assert frame.groups == ((0,), (1,), (2,))
    for k in range(3):
        # An axis is off by eps lambda3 / gap (J. Demmel, Applied Numerical Linear Algebra, theorem 5.4).
        assert abs(abs(float(turn[:, k] @ frame.axes[k])) - 1) < 1e-14
        assert np.abs(np.cross(turn[:, k], frame.axes[k])).max() < 20 * EPS * values[2] / gap


@pytest.mark.parametrize("order", list(itertools.permutations([1.0, 2.0, 2.5])))
def test_a_diagonal_tensor_in_any_order(order: tuple[float, ...]) -> None:
    frame = principal_frame(np.diag(order))
    assert frame.moments.tolist() == [1.0, 2.0, 2.5]
    for k, axis in enumerate(frame.axes):
        place = order.index(sorted(order)[k])
        expected = np.zeros(3)
        expected[place] = 1.0
        assert np.abs(axis).tolist() == expected.tolist()
    assert frame.axes[::2].min() >= 0
    require_frame(frame)
    # e2 yields: with an odd order it points along minus its axis.
    odd = np.linalg.det(np.abs(frame.axes)) < 0
    assert (frame.axes[1].min() < 0) == odd


# --- published and hand-made numbers


def test_the_cube_about_its_corner() -> None:
    # J. R. Taylor, Classical Mechanics, example 10.4: M a^2/12 times 2, 11, 11, e1 along the diagonal.
    inertia = np.array([[8.0, -3, -3], [-3, 8, -3], [-3, -3, 8]])
    frame = principal_frame(inertia)
    assert frame.moments == pytest.approx([2, 11, 11], abs=1e-14)
    assert frame.axes[0] == pytest.approx(np.ones(3) / math.sqrt(3), abs=1e-15)
    assert frame.groups == ((0,), (1, 2))
    assert principal.body_class(frame) == "prolate"
    # Nearest to the plane across (1, 1, 1) are x, y, z alike; the first is taken.
    assert frame.axes[1] == pytest.approx(np.array([2, -1, -1]) / math.sqrt(6), abs=1e-15)
    assert frame.axes[2] == pytest.approx(np.array([0, 1, -1]) / math.sqrt(2), abs=1e-15)
    assert principal.residual(inertia, frame) < 1e-15
    require_frame(frame)


# --- equal moments


GAPS = [0.0, 1e-16, 1e-13, 0.9e-12]


@pytest.mark.parametrize("gap", GAPS)
@pytest.mark.parametrize("scale", [1e-47, 1.0, 1e59])
def test_nearly_equal_moments_are_one_group(gap: float, scale: float) -> None:
    # On the one side of 1e-12 lambda3 ...
    low = principal_frame(np.diag([1.0, 1 + gap * 1.5, 1.5]) * scale)
    assert low.groups == ((0, 1), (2,))
    assert low.axes.tolist() == np.eye(3).tolist()
    high = principal_frame(np.diag([0.7, 1.0, 1 + gap]) * scale)
    assert high.groups == ((0,), (1, 2))
    every = principal_frame(np.diag([1.0, 1 + gap, 1 + gap]) * scale)
    assert every.groups == ((0, 1, 2),)
    assert every.axes.tolist() == np.eye(3).tolist()
    assert [principal.body_class(frame) for frame in (low, high, every)] == ["oblate", "prolate", "spherical"]
    # ... and on the other.
    for values in ([1.0, 1 + (gap + 1.1e-12) * 1.5, 1.5], [0.7, 1.0, 1 + gap + 1.1e-12]):
        frame = principal_frame(np.diag(values) * scale)
        assert frame.groups == ((0,), (1,), (2,))
        assert principal.body_class(frame) == "asymmetric"


@few
@given(QUATERNIONS, st.sampled_from([0.0, 1e-13, 8e-13]), SCALES)
def test_a_group_is_found_in_any_axes(quaternion: list[float], gap: float, scale: float) -> None:
    turn = of_quaternion(quaternion)
    for values, groups in (([1, 1 + gap, 1.6], ((0, 1), (2,))), ([0.5, 1, 1 + gap], ((0,), (1, 2)))):
        frame = principal_frame(turned(values, turn) * scale)
        assert frame.groups == groups
        require_frame(frame)


@few
@given(
    st.lists(st.floats(-1, 1), min_size=3, max_size=3).filter(lambda v: math.hypot(*v) > 0.1),
    st.floats(-4, 4),
    st.sampled_from([(1.0, 1.7), (1.0, 0.4), (1.0, 0.0)]),
)
def test_turning_a_symmetric_body_about_its_axis_changes_nothing(
    axis: list[float], angle: float, pair: tuple[float, float]
) -> None:
    across, along = pair
    n = np.array(axis) / math.hypot(*axis)
    inertia = across * (np.eye(3) - np.outer(n, n)) + along * np.outer(n, n)
    # Where two coordinate axes lie equally near the plane, within the rule's tolerance, rounding may choose.
    nearness = np.sort(1 - n**2)
    assume(all(abs(nearness[2] - other - principal.PIVOT_TIE) > 1e-12 for other in nearness[:2]))
    one = principal_frame((inertia + inertia.T) / 2)
    two = principal_frame(tensor.rotate(inertia, np.array(Rotation.from_rotvec(angle * n).as_matrix())))
    assert two.axes == pytest.approx(one.axes, abs=2e-14)
    assert two.groups == one.groups
