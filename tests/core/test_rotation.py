"""Rotation matrices against scipy's, against mpmath at 50 digits, and at both sides of every limit."""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.linalg import polar
from scipy.spatial.transform import Rotation

from rigidcli.core import rotation
from rigidcli.core.arithmetic import FLOAT
from rigidcli.errors import ValueProblem

Floats = NDArray[np.float64]

few = settings(max_examples=25)

COMPONENT = st.floats(-1, 1).map(lambda x: 0.0 if abs(x) < 1e-8 else x)
VECTORS = st.lists(COMPONENT, min_size=3, max_size=3).filter(lambda v: math.hypot(*v) > 1e-3)
QUATERNIONS = st.lists(COMPONENT, min_size=4, max_size=4).filter(lambda q: math.hypot(*q) > 1e-3)
ANGLES = st.one_of(st.floats(-7, 7), st.floats(-1e-6, 1e-6), st.floats(-1e6, 1e6))
SEQUENCES = [
    "".join(axes) for axes in itertools.product("xyz", repeat=3) if axes[0] != axes[1] and axes[1] != axes[2]
]


def defect(matrix: Floats) -> float:
    """How far R^T R is from 1, or the determinant from +1."""
    return max(float(np.abs(matrix.T @ matrix - np.eye(3)).max()), abs(float(np.linalg.det(matrix)) - 1))


def rodrigues(axis: Sequence[float], angle: float) -> Floats:
    """The rotation as the exponential of a skew matrix, at 50 digits."""
    with mpmath.workdps(50):
        x, y, z = (mpmath.mpf(float(component)) for component in axis)
        length = mpmath.sqrt(x * x + y * y + z * z)
        n = [x / length, y / length, z / length]
        c, s = mpmath.cos(mpmath.mpf(float(angle))), mpmath.sin(mpmath.mpf(float(angle)))
        cross = [[0, -n[2], n[1]], [n[2], 0, -n[0]], [-n[1], n[0], 0]]
        return np.array(
            [
                [float(c * (i == j) + s * cross[i][j] + (1 - c) * n[i] * n[j]) for j in range(3)]
                for i in range(3)
            ]
        )


# --- directions


@few
@given(VECTORS, st.integers(-1020, 1020))
def test_a_direction_does_not_depend_on_the_length(vector: list[float], exponent: int) -> None:
    scaled = [math.ldexp(component, exponent) for component in vector]
    assume(all(math.ldexp(s, -exponent) == v for s, v in zip(scaled, vector, strict=True)))
    unit = rotation.direction(scaled, FLOAT)
    with mpmath.workdps(40):
        length = mpmath.sqrt(sum(mpmath.mpf(c) ** 2 for c in vector))
        expected = [float(mpmath.mpf(c) / length) for c in vector]
    assert unit == pytest.approx(expected, rel=5e-16, abs=0)


@pytest.mark.parametrize(
    ("make", "zero", "message"),
    [
        (rotation.direction, [0.0, -0.0, 0.0], "zero vector"),
        (rotation.onto, [0.0, 0.0, 0.0], "direction"),
        (rotation.from_quaternion, [0.0, 0.0, 0.0, 0.0], "zero quaternion"),
    ],
)
def test_zeros_are_refused(make: Callable[..., Any], zero: list[float], message: str) -> None:
    with pytest.raises(ValueProblem, match=message):
        make(zero, FLOAT)


# --- axis and angle


@few
@given(VECTORS, ANGLES)
def test_axis_and_angle_against_fifty_digits(axis: list[float], angle: float) -> None:
    found = rotation.from_axis_angle(axis, angle, FLOAT)
    assert defect(found) < 2e-15
    assert np.abs(found - rodrigues(axis, angle)).max() < 1e-15


# --- Euler sequences


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("angles", [(0.3, -1.1, 2.5), (-3.0, 0.0, 1.0), (0.5, math.pi / 2, -0.25)])
def test_euler_sequences_are_intrinsic(sequence: str, angles: tuple[float, float, float]) -> None:
    found = rotation.from_euler(angles, sequence, FLOAT)
    assert len(SEQUENCES) == 12
    assert found == pytest.approx(Rotation.from_euler(sequence.upper(), angles).as_matrix(), abs=1e-15)
    assert defect(found) < 2e-15


def test_zxz_as_in_goldstein() -> None:
    # H. Goldstein, Classical Mechanics, section 4.4: the line of nodes is at phi from x, the body's z axis
    # is at theta from the space's, and stands at (sin theta sin phi, -sin theta cos phi, cos theta).
    phi, theta, psi = 0.4, 0.9, -2.2
    found = rotation.from_euler((phi, theta, psi), "zxz", FLOAT)
    axis = [math.sin(theta) * math.sin(phi), -math.sin(theta) * math.cos(phi), math.cos(theta)]
    assert found[:, 2] == pytest.approx(axis, abs=1e-15)
    node = [math.cos(phi), math.sin(phi), 0]
    assert found @ [math.cos(psi), -math.sin(psi), 0] == pytest.approx(node, abs=1e-15)


# --- quaternions


@few
@given(QUATERNIONS)
def test_quaternions_against_scipy(quaternion: list[float]) -> None:
    w, x, y, z = quaternion
    found = rotation.from_quaternion(quaternion, FLOAT)
    assert defect(found) < 3e-15
    assert found == pytest.approx(Rotation.from_quat([x, y, z, w]).as_matrix(), abs=2e-15)


@few
@given(QUATERNIONS, st.integers(-500, 500), st.sampled_from([1, -1]))
def test_a_quaternion_is_normalised(quaternion: list[float], exponent: int, sign: int) -> None:
    scaled = [sign * math.ldexp(component, exponent) for component in quaternion]
    one, other = (rotation.from_quaternion(q, FLOAT) for q in (quaternion, scaled))
    assert np.array_equal(one, other)
    third = rotation.from_quaternion([component / 3 for component in quaternion], FLOAT)
    assert third == pytest.approx(one, abs=2e-15)


# --- matrices

TURN: Floats = np.array(Rotation.from_euler("ZXZ", [0.4, 1.0, -2.0]).as_matrix())


def _rows(matrix: Any) -> list[list[float]]:
    rows: list[list[float]] = np.asarray(matrix, dtype=float).tolist()
    return rows


STRAINS = [
    np.eye(3) / 2,
    np.diag([0.5, -0.2, 0.1]),
    np.array([[0, 0.5, 0], [0.5, 0, 0], [0, 0, 0]]),
    np.array([[0, 1.0, 0], [0, 0, 0], [0, 0, 0]]),
]


@pytest.mark.parametrize("strain", STRAINS, ids=["swollen", "stretched", "sheared", "one entry"])
def test_both_sides_of_the_tolerance_of_a_matrix(strain: Floats) -> None:
    # R (1 + s E) has R^T R - 1 = s (E + E^T) + O(s^2), whose largest entry is made 1 for each E here.
    largest = np.abs(strain + strain.T).max()
    assert largest == 1
    for s in (0.99e-9, -0.99e-9):
        given_matrix = TURN @ (np.eye(3) + s * strain)
        found, _ = rotation.from_matrix(_rows(given_matrix), FLOAT)
        assert defect(found) < 2e-15
        nearest, _ = polar(given_matrix)
        assert found == pytest.approx(nearest, abs=1e-15)
    for s in (1.01e-9, -1.01e-9):
        with pytest.raises(ValueProblem, match="no rotation"):
            rotation.from_matrix(_rows(TURN @ (np.eye(3) + s * strain)), FLOAT)


@pytest.mark.parametrize(
    ("message", "matrices"),
    [
        ("reflection", [np.diag([1.0, 1, -1]), -np.eye(3), np.eye(3)[[1, 0, 2]], -TURN]),
        ("no rotation", [np.zeros((3, 3)), 2 * np.eye(3), np.ones((3, 3)), np.diag([1e160, 1, 1])]),
    ],
)
def test_other_matrices_are_refused(message: str, matrices: list[Floats]) -> None:
    for matrix in matrices:
        with pytest.raises(ValueProblem, match=message):
            rotation.from_matrix(_rows(matrix), FLOAT)


# --- turning z onto an axis


def is_shortest(turn: Floats) -> bool:
    """Whether the rotation's own axis is across z: the skew part has no z component."""
    return bool(abs(turn[0, 1] - turn[1, 0]) < 2e-15)


@few
@given(VECTORS, st.integers(-500, 500))
def test_onto_is_the_shortest_turn(axis: list[float], exponent: int) -> None:
    turn = rotation.onto([math.ldexp(component, exponent) for component in axis], FLOAT)
    unit = np.array(axis) / math.hypot(*axis)
    assert defect(turn) < 3e-15
    assert turn[:, 2] == pytest.approx(unit, abs=2e-15)
    assert is_shortest(turn)


@pytest.mark.parametrize("tilt", [0.1, 1e-8, 1e-17, 1e-154])
@pytest.mark.parametrize("up", [1.0, -1.0])
@pytest.mark.parametrize("way", [0.7, math.pi])
def test_onto_next_to_either_pole(tilt: float, up: float, way: float) -> None:
    axis = [tilt * math.cos(way), tilt * math.sin(way), up]
    turn = rotation.onto(axis, FLOAT)
    length = math.hypot(*axis)
    assert defect(turn) < 2e-15
    # The small components keep their own digits, so that the tilt is not lost.
    for k in range(3):
        assert turn[k, 2] == pytest.approx(axis[k] / length, rel=2e-15, abs=1e-200)
    assert is_shortest(turn)


def test_onto_the_poles_themselves() -> None:
    assert rotation.onto([0, 0, 3.0], FLOAT).tolist() == np.eye(3).tolist()
    assert rotation.onto([0.0, 0.0, -1e-150], FLOAT).tolist() == np.diag([1.0, -1, -1]).tolist()


# --- quaternions


angles = st.floats(-3.1, 3.1)
axes_of_turns = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda axis: np.linalg.norm(axis) > 1e-3)


@given(axes_of_turns, angles, axes_of_turns, angles)
def test_products_of_quaternions_are_products_of_matrices(
    first: Sequence[float], a: float, second: Sequence[float], b: float
) -> None:
    left, right = rotation.from_axis_angle(first, a, FLOAT), rotation.from_axis_angle(second, b, FLOAT)
    p, q = rotation.as_quaternion(left), rotation.as_quaternion(right)
    product = rotation.from_quaternion(tuple(rotation.compose(p, q)), FLOAT)
    np.testing.assert_allclose(product, left @ right, atol=1e-14)
    np.testing.assert_allclose(rotation.turned(p, np.eye(3)), left.T, atol=1e-14)


def test_signs_along_a_motion_are_continuous() -> None:
    half = np.linspace(0, 20, 500)
    smooth = np.column_stack([np.cos(half), np.zeros(500), np.zeros(500), np.sin(half)])
    broken = smooth * np.where(smooth[:, :1] < 0, -1, 1)
    np.testing.assert_array_equal(rotation.continuous(broken), smooth)


@pytest.mark.parametrize("sequence", SEQUENCES)
def test_euler_angles_in_any_sequence(sequence: str) -> None:
    first, third = np.linspace(0.4, 25, 300), np.linspace(-1, -40, 300)
    proper = sequence[0] == sequence[2]
    middle = 0.9 * np.sin(first) + (np.pi / 2 if proper else 0)
    angles = np.column_stack([first, middle, third])
    # scipy has the scalar last, and capitals for intrinsic turns.
    q = Rotation.from_euler(sequence.upper(), angles).as_quat(scalar_first=True)
    found = rotation.euler_angles(rotation.continuous(q), sequence)
    np.testing.assert_allclose(found, angles, atol=1e-13)


@pytest.mark.parametrize("sequence", SEQUENCES)
@pytest.mark.parametrize("end", [0, 1])
def test_where_two_axes_of_the_angles_fall_together(sequence: str, end: int) -> None:
    middle = np.pi * end if sequence[0] == sequence[2] else np.pi * (end - 0.5)
    angles = [0.7, middle, 0.3]
    q = Rotation.from_euler(sequence.upper(), angles).as_quat(scalar_first=True)[None]
    (found,) = rotation.euler_angles(q, sequence)
    assert found[1] == pytest.approx(middle, abs=1e-14)
    again = rotation.from_euler(found.tolist(), sequence, FLOAT)
    np.testing.assert_allclose(again, Rotation.from_euler(sequence.upper(), angles).as_matrix(), atol=1e-14)
    # What the two turns about one axis make together is shared alike between them.
    assert abs(found[0]) == pytest.approx(abs(found[2]), abs=1e-14)
