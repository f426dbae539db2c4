"""Inertia tensors against sums in exact fractions, over bodies made from point masses."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.core import mass_properties, principal, tensor
from rigidcli.core.mass_properties import MassProperties
from rigidcli.errors import ValueProblem

Floats = NDArray[np.float64]

few = settings(max_examples=25)

# From atoms (1e-27 kg, 1e-10 m) to planets (1e37 kg, 1e11 m), in powers of two, by which floats are
# multiplied without rounding: every absolute tolerance and every unit hidden in the code then shows.
MASS_EXPONENTS = st.integers(-90, 123)
LENGTH_EXPONENTS = st.integers(-33, 37)


def _numbers(low: float, high: float) -> st.SearchStrategy[float]:
    return st.floats(low, high, allow_nan=False, width=64).map(lambda x: 0.0 if abs(x) < 1e-6 else x)


@st.composite
def point_clouds(draw: st.DrawFn, least: int = 1, most: int = 8) -> Floats:
    """Rows (m, x, y, z): masses within a factor of a million, coordinates of the order of 1."""
    count = draw(st.integers(least, most))
    rows = [
        [draw(st.floats(1e-3, 1e3)), *(draw(_numbers(-4.0, 4.0)) for _ in range(3))] for _ in range(count)
    ]
    return np.array(rows)


@st.composite
def rotations(draw: st.DrawFn) -> Floats:
    """Rotation matrices from unit quaternions, by scipy."""
    quaternion = [draw(st.floats(-1, 1)) for _ in range(4)]
    if np.linalg.norm(quaternion) < 0.1:
        quaternion[3] = 1.0
    return np.array(Rotation.from_quat(quaternion).as_matrix())


VECTORS = st.lists(_numbers(-10.0, 10.0), min_size=3, max_size=3).map(np.array)


def exact_sums(points: Floats, about: Sequence[float] | None = None) -> tuple[float, Floats, Floats]:
    """Mass, centre and tensor (about it, or about a point) of rows m, x, y, z; only the end is rounded."""
    rows = [[Fraction(float(value)) for value in row] for row in points]
    mass: Any = sum(row[0] for row in rows)
    com = [sum(row[0] * row[1 + k] for row in rows) / mass for k in range(3)]
    origin = com if about is None else [Fraction(float(x)) for x in about]
    inertia: list[list[Any]] = [[Fraction(0)] * 3 for _ in range(3)]
    for m, *place in rows:
        r = [place[k] - origin[k] for k in range(3)]
        inertia[0][0] += m * (r[1] ** 2 + r[2] ** 2)
        inertia[1][1] += m * (r[0] ** 2 + r[2] ** 2)
        inertia[2][2] += m * (r[0] ** 2 + r[1] ** 2)
        for i, j in ((0, 1), (0, 2), (1, 2)):
            inertia[i][j] -= m * r[i] * r[j]
            inertia[j][i] -= m * r[i] * r[j]
    return float(mass), np.array(com, dtype=float), np.array(inertia, dtype=float)


def extent(points: Floats) -> float:
    """M d^2 with d the largest distance from the first point: on this scale a central tensor is rounded."""
    reach = np.abs(points[:, 1:] - points[0, 1:]).max()
    return float(points[:, 0].sum() * reach**2)


def cloud_body(points: Floats) -> tuple[MassProperties, float]:
    """The points as a body, and its mass."""
    body = mass_properties.of_points(points)
    assert body.mass is not None
    return body, float(body.mass)


def near(found: Any, expected: Any, scale: float, tolerance: float = 1e-14) -> bool:
    return bool(np.abs(np.asarray(found, dtype=float) - expected).max() <= tolerance * scale)


# --- one cloud


@few
@given(point_clouds())
def test_points_equal_the_sums_in_fractions(points: Floats) -> None:
    body = mass_properties.of_points(points)
    mass, com, central = exact_sums(points)
    assert body.mass == pytest.approx(mass, rel=1e-15, abs=0)
    assert near(body.com, com, 4.0)
    assert near(body.tensor, central, extent(points))


@few
@given(point_clouds(least=2), st.integers(0, 2), st.integers(0, 2))
def test_far_from_the_origin_the_central_tensor_keeps_its_digits(
    points: Floats, axis: int, other: int
) -> None:
    points = points.copy()
    points[:, 1 + axis] += 1e8
    points[:, 1 + other] -= 1e8
    # The points are now at what floats there are at 1e8 (1.5e-8 apart); of these the tensor is exact.
    _, com, central = exact_sums(points)
    body = mass_properties.of_points(points)
    assert near(body.com, com, 1e8, 4e-16)
    assert near(body.tensor, central, extent(points))
    single = [MassProperties(row[0], row[1:], np.zeros((3, 3))) for row in points]
    # Here the centre itself is rounded at 1e8, which shows in the second order only.
    rounding = points[:, 0].sum() * 3 * (np.spacing(2e8) ** 2)
    combined = mass_properties.combine(single)
    assert near(combined.tensor, central, 1.0, 1e-14 * extent(points) + rounding)


@few
@given(point_clouds(), MASS_EXPONENTS, LENGTH_EXPONENTS)
def test_mass_and_length_scale_the_tensor_exactly(points: Floats, m: int, a: int) -> None:
    scaled = points * np.array([2.0**m, *3 * (2.0**a,)])
    (one, mass), (other, multiple) = cloud_body(points), cloud_body(scaled)
    assert multiple == mass * 2.0**m
    assert np.array_equal(other.com, one.com * 2.0**a)
    assert np.array_equal(other.tensor, one.tensor * 2.0 ** (m + 2 * a))


# --- sums of one sign keep their digits


THIN = {
    # About z, a unit mass at (3e-9, 4e-9, 1) has the moment x^2 + y^2.
    "a point near the axis": (tensor.point_tensor(np.array([3e-9, 4e-9, 1.0])), 25e-18),
    # A wire along z, 1 m long and 2e-6 m thick: M R^2/2.
    "a wire": (tensor.from_second_moments(1.0, np.diag([1e-12 / 4, 1e-12 / 4, 1 / 12])), 5e-13),
    "a rod shifted almost along itself": (
        tensor.shift_from_com(np.diag([1 / 12, 1 / 12, 0.0]), 2.0, np.array([1e-8, 0.0, 1.0])),
        2e-16,
    ),
}


@pytest.mark.parametrize("name", THIN)
def test_what_is_thin_keeps_its_small_moment(name: str) -> None:
    inertia, small = THIN[name]
    assert inertia[2, 2] == pytest.approx(small, rel=1e-14, abs=0)
    if name == "a wire":
        assert principal.principal_frame(inertia).moments[0] == inertia[2, 2]


# --- shifting


@few
@given(point_clouds(), VECTORS)
def test_shift_from_the_centre_is_the_sum_about_the_point(points: Floats, about: Floats) -> None:
    body, mass = cloud_body(points)
    _, _, expected = exact_sums(points, list(about))
    found = tensor.shift_from_com(body.tensor, mass, about - body.com)
    assert near(found, expected, points[:, 0].sum() * 300)


@few
@given(point_clouds(), VECTORS)
def test_shift_there_and_back(points: Floats, d: Floats) -> None:
    body, mass = cloud_body(points)
    there = tensor.shift_from_com(body.tensor, mass, d)
    back = tensor.shift_from_com(there, -mass, d)
    assert near(back, body.tensor, mass * float(d @ d) + extent(points), 1e-15 * 4)


# --- turning


@few
@given(point_clouds(), rotations())
def test_rotation_keeps_trace_and_moments(points: Floats, turn: Floats) -> None:
    before = mass_properties.of_points(points).tensor
    after = tensor.rotate(before, turn)
    scale = extent(points)
    assert np.array_equal(after, after.T)
    assert abs(np.trace(after) - np.trace(before)) <= 1e-14 * scale
    assert near(np.linalg.eigvalsh(after), np.linalg.eigvalsh(before), scale)
    assert near(tensor.rotate(after, turn.T), before, scale)


@few
@given(point_clouds(), rotations(), VECTORS)
def test_placing_a_body_is_placing_its_points(points: Floats, turn: Floats, shift: Floats) -> None:
    placed = mass_properties.place(mass_properties.of_points(points), turn, shift)
    moved = np.hstack([points[:, :1], points[:, 1:] @ turn.T + shift])
    _, com, central = exact_sums(moved)
    assert near(placed.com, com, 20.0)
    # The moved points are rounded at their distance from the origin, about 20.
    assert near(placed.tensor, central, extent(points) + points[:, 0].sum() * 20)


# --- taking bodies as one


@few
@given(point_clouds(), point_clouds(), point_clouds())
def test_combining_is_associative_and_equals_all_points_at_once(a: Floats, b: Floats, c: Floats) -> None:
    bodies = [mass_properties.of_points(points) for points in (a, b, c)]
    every = np.vstack([a, b, c])
    mass, com, central = exact_sums(every)
    scale = mass * 64 * 3
    left = mass_properties.combine([mass_properties.combine(bodies[:2]), bodies[2]])
    right = mass_properties.combine([bodies[0], mass_properties.combine(bodies[1:])])
    for found in (
        mass_properties.combine(bodies),
        left,
        right,
        mass_properties.combine(bodies[::-1]),
        mass_properties.of_points(every),
    ):
        assert found.mass == pytest.approx(mass, rel=1e-15, abs=0)
        assert near(found.com, com, 8.0)
        assert near(found.tensor, central, scale)


@few
@given(point_clouds(), point_clouds())
def test_a_hole_undoes_what_was_added(a: Floats, b: Floats) -> None:
    whole, total = cloud_body(np.vstack([a, b]))
    rest = mass_properties.combine([whole, mass_properties.of_points(b).missing()])
    mass, com, central = exact_sums(a)
    lost = total / mass
    assert rest.mass == pytest.approx(mass, rel=1e-15 * 4 * lost, abs=0)
    assert near(rest.com, com, 8.0, 1e-14 * lost)
    assert near(rest.tensor, central, total * 200, 1e-14 * lost)


# --- blocks of a file


@few
@given(point_clouds(least=2), st.integers(1, 7), st.sampled_from([0.0, 1e8, -3e8]), LENGTH_EXPONENTS)
def test_blocks_are_all_their_points(points: Floats, cut: int, shift: float, a: int) -> None:
    points = (points + np.array([0, shift, 0, -shift])) * np.array([1, *3 * (2.0**a,)])
    _, com, central = exact_sums(points)
    blocks = [block for block in (points[:cut], points[cut:]) if len(block)]
    body = mass_properties.of_blocks(lambda: iter(blocks))
    assert body.mass == pytest.approx(float(points[:, 0].sum()), rel=1e-15, abs=0)
    assert near(body.com, com, max(4.0, abs(shift)) * 2.0**a, 4e-16)
    assert near(body.tensor, central, extent(points))


# --- which tensors a body can have


@few
@given(point_clouds(), rotations(), MASS_EXPONENTS, LENGTH_EXPONENTS)
def test_every_cloud_is_physical_at_every_scale(points: Floats, turn: Floats, m: int, a: int) -> None:
    body = mass_properties.of_points(points * np.array([2.0**m, *3 * (2.0**a,)]))
    tensor.require_physical(tensor.rotate(body.tensor, turn))


SCALES = [1e-47, 1.0, 1e59]
TURNS = [np.eye(3), Rotation.from_euler("ZXZ", [0.3, 1.1, -2.0]).as_matrix()]


def _turned(moments: Sequence[float], turn: Floats, scale: float) -> Floats:
    return tensor.rotate(np.diag(moments), turn) * scale


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("turn", TURNS, ids=["straight", "turned"])
@pytest.mark.parametrize("pair", [(1.0, 3.0), (0.01, 1.0)])
def test_both_sides_of_the_slack_of_the_triangle(
    pair: tuple[float, float], turn: Floats, scale: float
) -> None:
    # lambda3 = lambda1 + lambda2 + excess, the slack being 1e-10 of the trace.
    low, middle = pair
    edge = tensor.PHYSICAL_SLACK * 2 * (low + middle)
    tensor.require_physical(_turned((low, middle, low + middle), turn, scale))
    tensor.require_physical(_turned((low, middle, low + middle + 0.99 * edge), turn, scale))
    with pytest.raises(ValueProblem, match="lambda3 <= lambda1 \\+ lambda2"):
        tensor.require_physical(_turned((low, middle, low + middle + 1.01 * edge), turn, scale))


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("turn", TURNS, ids=["straight", "turned"])
def test_both_sides_of_the_slack_of_a_negative_moment(turn: Floats, scale: float) -> None:
    edge = tensor.PHYSICAL_SLACK * 2
    tensor.require_physical(_turned((-0.99 * edge, 1.0, 1.0), turn, scale))
    with pytest.raises(ValueProblem, match="lambda1 >= 0"):
        tensor.require_physical(_turned((-1.01 * edge, 1.0, 1.0), turn, scale))


def test_the_shortfall_says_by_how_much() -> None:
    text, amount = tensor.shortfall(np.diag([1.0, 2.0, 3.5])) or ("", 0.0)
    assert "3.5 > 3" in text
    assert amount == pytest.approx(0.5, rel=1e-14, abs=0)
    assert tensor.shortfall(np.zeros((3, 3))) is None
    assert tensor.shortfall(np.diag([1.0, 2.0, 3.0])) is None


# --- thin and light bodies, through to the moments


@few
@given(point_clouds(least=3), MASS_EXPONENTS, LENGTH_EXPONENTS)
def test_principal_frames_scale_exactly(points: Floats, m: int, a: int) -> None:
    scaled = points * np.array([2.0**m, *3 * (2.0**a,)])
    one, other = (
        principal.principal_frame(mass_properties.of_points(rows).tensor) for rows in (points, scaled)
    )
    assert np.array_equal(other.moments, one.moments * 2.0 ** (m + 2 * a))
    assert np.array_equal(other.axes, one.axes)
    assert other.groups == one.groups
    assert principal.body_class(other) == principal.body_class(one)


@pytest.mark.parametrize("digits", [2, 3, 4, 6])
@pytest.mark.parametrize("seed", range(20))
def test_a_rounded_tensor_of_a_flat_body_is_within_its_digits(seed: int, digits: int) -> None:
    """What rounding does is allowed, in any axes; four times as much in the worst direction is not."""
    chance = np.random.default_rng(seed)
    flat = chance.normal(size=(5, 3)) * [1, 2, 0]
    axes, _ = np.linalg.qr(chance.normal(size=(3, 3)))
    second = axes @ flat.T @ flat @ axes.T
    exact = np.trace(second) * np.eye(3) - second
    typed = np.array([[float(f"{entry:.{digits}g}") for entry in row] for row in exact])
    halves = np.abs(10.0 ** (np.floor(np.log10(np.abs(typed))) - digits + 1)) / 2
    assert tensor.is_within_digits(typed, halves)
    normal = axes[:, 2]
    worse = exact + 4 * halves * np.sign(np.outer(normal, normal) - np.eye(3) / 2)
    assert not tensor.is_within_digits(worse, halves)
