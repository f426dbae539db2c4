"""Simplices and polygons against exact fractions: Green's theorem, dissections, crossings."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.bodies import solids
from rigidcli.core.arithmetic import FLOAT
from rigidcli.errors import ValueProblem

Floats = NDArray[np.float64]
Moments = tuple[float, Floats, Floats]

few = settings(max_examples=40)

COORDINATE = st.floats(-3, 3).map(lambda x: 0.0 if abs(x) < 1e-6 else x)
TURN: Floats = np.array(Rotation.from_euler("ZXZ", [0.4, 1.0, -2.0]).as_matrix())


def outline_moments(outline: Sequence[Sequence[float]]) -> Moments:
    """Area, centre and mean r r^T about it of a plane polygon (k by 2), by Green's theorem in fractions.

    The boundary integrals are those of C. Steger, On the calculation of arbitrary moments of polygons (1996).
    """
    points = [(Fraction(float(x)), Fraction(float(y))) for x, y in outline]
    area = first_x = first_y = xx = xy = yy = Fraction(0)
    for (x, y), (X, Y) in zip(points, points[1:] + points[:1], strict=True):
        cross = x * Y - X * y
        area += cross / 2
        first_x += cross * (x + X) / 6
        first_y += cross * (y + Y) / 6
        xx += cross * (x * x + x * X + X * X) / 12
        yy += cross * (y * y + y * Y + Y * Y) / 12
        xy += cross * (2 * x * y + x * Y + X * y + 2 * X * Y) / 24
    cx, cy = first_x / area, first_y / area
    second = [
        [xx / area - cx * cx, xy / area - cx * cy, 0],
        [xy / area - cx * cy, yy / area - cy * cy, 0],
        [0, 0, 0],
    ]
    return float(abs(area)), np.array([cx, cy, 0], dtype=float), np.array(second, dtype=float)


def in_space(outline: Sequence[Sequence[float]], turn: Floats, shift: Any = (0, 0, 0)) -> Floats:
    flat = np.array([[x, y, 0.0] for x, y in outline])
    return np.asarray(flat @ turn.T + np.array(shift, dtype=float))


# --- simplices


def test_a_cube_is_six_tetrahedra() -> None:
    # Kuhn's dissection: one tetrahedron for each order of the axes. Volume 1, centre 1/2, <x^2> = 1/12.
    volume, first, second = 0.0, np.zeros(3), np.zeros((3, 3))
    for order in itertools.permutations(range(3)):
        corners = np.zeros((4, 3))
        for step, axis in enumerate(order):
            corners[step + 1 :, axis] = 1.0
        v = solids.simplex_measure(corners, FLOAT)
        centre, spread = solids.simplex_moments(corners)
        volume += v
        first += v * centre
        second += v * (spread + np.outer(centre, centre))
    assert volume == pytest.approx(1, rel=1e-15, abs=0)
    assert first == pytest.approx([0.5, 0.5, 0.5], rel=1e-15, abs=0)
    assert second - np.outer(first, first) == pytest.approx(np.eye(3) / 12, abs=1e-15)


def corner_moments(size: int) -> Floats:
    """Mean of xi_i xi_j over the simplex xi >= 0, sum xi <= 1, by Gauss-Legendre on nested intervals."""
    nodes, weights = np.polynomial.legendre.leggauss(8)
    nodes, weights = (nodes + 1) / 2, weights / 2
    grids = np.meshgrid(*size * [nodes], indexing="ij")
    measure = np.prod(np.meshgrid(*size * [weights], indexing="ij"), axis=0)
    left, xi = np.ones_like(grids[0]), []
    for grid in grids:
        xi.append(grid * left)
        measure = measure * left
        left = left * (1 - grid)
    total = measure.sum()
    return np.array([[(measure * a * b).sum() / total for b in (*xi, 1)] for a in (*xi, 1)])


@few
@given(
    st.lists(st.lists(COORDINATE, min_size=3, max_size=3), min_size=4, max_size=4), st.sampled_from([3, 4])
)
def test_simplices_against_quadrature(vertices: list[list[float]], count: int) -> None:
    corners = np.array(vertices[:count])
    edges = (corners[1:] - corners[0]).T
    table = corner_moments(count - 1)
    mean, square = table[:-1, -1], table[:-1, :-1]
    centre, spread = solids.simplex_moments(corners)
    assert np.abs(centre - (corners[0] + edges @ mean)).max() < 1e-14
    assert np.abs(spread - edges @ (square - np.outer(mean, mean)) @ edges.T).max() < 1e-14 * 36
    # Gram's determinant: measure^2 = det(E^T E) / k!^2.
    gram = max(0.0, float(np.linalg.det(edges.T @ edges)))
    measure = solids.simplex_measure(corners, FLOAT)
    size = float(np.abs(edges).max()) or 1.0
    if measure > 1e-3 * size ** (count - 1):
        assert measure == pytest.approx(math.sqrt(gram) / math.factorial(count - 1), rel=1e-9, abs=0)


def test_triangles_and_tetrahedra_have_the_measure_of_school() -> None:
    assert solids.simplex_measure(np.array([[1.0, 1, 1], [4, 1, 1], [1, 5, 1]]), FLOAT) == 6
    assert solids.simplex_measure(
        np.array([[0.0, 0, 0], [3, 0, 0], [0, 4, 0], [9, 9, 5]]), FLOAT
    ) == pytest.approx(10, rel=1e-14, abs=0)
    # Heron: 13, 14, 15 has the area 84, wherever it stands.
    heron = in_space([[0, 0], [14, 0], [5, 12]], TURN, (3, -7, 2))
    assert solids.simplex_measure(heron, FLOAT) == pytest.approx(84, rel=1e-14, abs=0)


@pytest.mark.parametrize("scale", [1e-50, 1e-9, 1.0, 1e49])
def test_flat_simplices_measure_nothing_at_any_scale(scale: float) -> None:
    thin = solids.DEGENERATE
    line = np.array([[0.0, 0, 0], [1, 2, 3], [-2, -4, -6]]) * scale
    plane = np.array([[0.0, 0, 0], [1, 0, 0.1], [0, 1, 0.1], [1, 1, 0.2]]) * scale
    assert solids.simplex_measure(line, FLOAT) == 0
    assert solids.simplex_measure(plane, FLOAT) == 0
    # A triangle of height h on the base 1 has the area h/2, a tetrahedron on a right angle h/6.
    for h, flat in ((1.9 * thin, True), (2.1 * thin, False)):
        triangle = np.array([[0.0, 0, 0], [1, 0, 0], [0.5, h, 0]]) * scale
        assert (solids.simplex_measure(triangle, FLOAT) == 0) == flat
        tetrahedron = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 3 * h]]) * scale
        assert (solids.simplex_measure(tetrahedron, FLOAT) == 0) == flat


@few
@given(
    st.lists(st.lists(st.integers(-9, 9), min_size=3, max_size=3), min_size=4, max_size=4),
    st.sampled_from([3, 4]),
)
def test_simplices_far_from_the_origin(vertices: list[list[int]], count: int) -> None:
    corners = np.array(vertices[:count], dtype=float)
    far = corners + np.array([1e8, -1e8, 3e8])
    centre, spread = solids.simplex_moments(corners)
    far_centre, far_spread = solids.simplex_moments(far)
    assert np.array_equal(far_spread, spread)
    assert far_centre == pytest.approx(centre + np.array([1e8, -1e8, 3e8]), rel=1e-15, abs=0)
    assert solids.simplex_measure(far, FLOAT) == solids.simplex_measure(corners, FLOAT)


def test_points_in_a_tetrahedron() -> None:
    rng = np.random.default_rng(5)
    corners = rng.normal(size=(4, 3))
    weights = rng.uniform(-0.3, 1, (4, 500))
    weights /= weights.sum(axis=0)
    inside = solids.in_simplex(corners, corners.T @ weights)
    assert inside.tolist() == (weights > 0).all(axis=0).tolist()
    assert 50 < inside.sum() < 450


# --- polygons

L_SHAPE = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]]
ARROW = [[0, 0], [4, 3], [0, 1], [-4, 3]]
COMB = [[0, 0], [7, 0], [7, 5], [6, 5], [6, 1], [4, 1], [4, 6], [3, 6], [3, 1], [1, 1], [1, 3], [0, 3]]
ZIGZAG = [[0, 0], [1, 3], [2, 0], [3, 3], [4, 0], [4.5, 0.5], [3, 4], [2, 1], [1, 4], [-0.5, 0.5]]
SLIM = [[0, 0], [5, 0], [5, 1e-4], [0, 1e-4]]
OUTLINES: list[list[list[float]]] = [L_SHAPE, ARROW, COMB, ZIGZAG, SLIM]  # type: ignore[list-item]


@pytest.mark.parametrize("outline", OUTLINES)
@pytest.mark.parametrize("start", [0, 1, 3])
@pytest.mark.parametrize("sense", [1, -1])
@pytest.mark.parametrize("turned", [False, True], ids=["flat", "turned"])
def test_polygons_against_greens_theorem(
    outline: list[list[float]], start: int, sense: int, turned: bool
) -> None:
    turn = TURN if turned else np.eye(3)
    ordered = (outline[start:] + outline[:start])[::sense]
    area, centre, second = outline_moments(outline)
    found = solids.polygon(in_space(ordered, turn), FLOAT)
    # Turning rounds the vertices, which the area of a slim polygon feels.
    slim = 5e4 if turned and outline == SLIM else 1
    assert found[0] == pytest.approx(area, rel=1e-14 * slim, abs=0)
    assert np.abs(found[1] - turn @ centre).max() < 1e-14 * 5 * slim
    assert np.abs(found[2] - turn @ second @ turn.T).max() < 3e-14 * second.max()


@pytest.mark.parametrize("outline", OUTLINES[:4])
def test_polygons_far_from_the_origin(outline: list[list[float]]) -> None:
    shift = np.array([1e8, -2e8, 3e8])
    near, far = (solids.polygon(in_space(outline, np.eye(3), s), FLOAT) for s in (0 * shift, shift))
    assert far[0] == pytest.approx(near[0], rel=1e-14, abs=0)
    assert far[1] - shift == pytest.approx(near[1], abs=6e-8)
    assert np.abs(far[2] - near[2]).max() < 1e-14 * near[2].max()


@few
@given(st.lists(st.floats(0.3, 2.0), min_size=3, max_size=12), st.integers(-160, 160), st.integers(0, 5))
def test_star_shaped_polygons_at_any_scale(radii: list[float], exponent: int, start: int) -> None:
    angles = 2 * math.pi * np.arange(len(radii)) / len(radii)
    outline = np.array([radii * np.cos(angles), radii * np.sin(angles)]).T
    scaled = np.roll(in_space(outline.tolist(), TURN), start, axis=0) * 2.0**exponent
    solids.require_simple_polygon(scaled, FLOAT)
    area, centre, second = outline_moments(outline.tolist())
    found = solids.polygon(scaled, FLOAT)
    assert found[0] == pytest.approx(area * 4.0**exponent, rel=2e-14, abs=0)
    assert np.abs(found[1] * 2.0**-exponent - TURN @ centre).max() < 1e-14
    assert np.abs(found[2] * 4.0**-exponent - TURN @ second @ TURN.T).max() < 2e-14 * second.max() * 4


# --- which polygons are simple


def _meet(a: Any, b: Any, c: Any, d: Any) -> bool:
    """Whether the closed segments a b and c d, with integer ends, have a point in common; exactly."""

    def side(p: Any, q: Any, r: Any) -> int:
        return int(np.sign((q[0] - p[0]) * (r[1] - p[1]) - (q[1] - p[1]) * (r[0] - p[0])))

    def on(p: Any, q: Any, r: Any) -> bool:
        return side(p, q, r) == 0 and all(min(p[k], q[k]) <= r[k] <= max(p[k], q[k]) for k in (0, 1))

    if side(a, b, c) * side(a, b, d) < 0 and side(c, d, a) * side(c, d, b) < 0:
        return True
    return on(a, b, c) or on(a, b, d) or on(c, d, a) or on(c, d, b)


def is_simple(points: list[tuple[int, int]]) -> bool:
    """Whether edges meet at common vertices only, no edge is a point, and no two neighbours fold back."""
    count = len(points)
    edges = [(points[k], points[(k + 1) % count]) for k in range(count)]
    if any(a == b for a, b in edges):
        return False
    for i, j in itertools.combinations(range(count), 2):
        if (j - i) % count in (1, count - 1):
            first, second = (i, j) if (j - i) % count == 1 else (j, i)
            (a, b), (_, d) = edges[first], edges[second]
            ahead = ((b[0] - a[0]) * (d[0] - b[0])) + ((b[1] - a[1]) * (d[1] - b[1]))
            cross = (b[0] - a[0]) * (d[1] - b[1]) - (b[1] - a[1]) * (d[0] - b[0])
            if cross == 0 and ahead < 0:
                return False
        elif _meet(*edges[i], *edges[j]):
            return False
    return True


def accepted(points: Sequence[Sequence[float]], turn: Floats = TURN) -> bool:
    try:
        solids.require_simple_polygon(in_space(points, turn), FLOAT)
    except ValueProblem:
        return False
    return True


@pytest.mark.parametrize("turn", [np.eye(3), TURN], ids=["flat", "turned"])
def test_crossings_are_found_exactly(turn: Floats) -> None:
    # Most lists of points cross themselves; those that do not are found here in sufficient number.
    rng = np.random.default_rng(2)
    simple = 0
    for _ in range(1500):
        points = [(int(x), int(y)) for x, y in rng.integers(0, 5, (rng.integers(3, 8), 2))]
        expected = is_simple(points)
        simple += expected
        assert accepted(points, turn) == expected, points
    assert simple > 200


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([[0, 0], [1, 1], [1, 0], [0, 1]], "meet"),
        ([[0, 0], [2, 0], [2, 2], [1, 0], [0, 2]], "meet"),
        ([[0, 0], [4, 0], [2, 0.0], [2, 2]], "meet"),
        ([[0, 0], [1, 0], [1, 1], [0, 0]], "meet"),
        ([[0, 0], [1, 1], [2, 2]], "area|meet|line"),
        ([[1, 1], [1, 1], [1, 1]], "one point"),
    ],
)
def test_what_is_no_polygon_is_refused(points: list[list[float]], message: str) -> None:
    with pytest.raises(ValueProblem, match=message):
        solids.require_simple_polygon(in_space(points, TURN), FLOAT)


@pytest.mark.parametrize("outline", OUTLINES)
def test_simple_polygons_pass(outline: list[list[float]]) -> None:
    assert accepted(outline)
    assert accepted(outline[::-1])


@pytest.mark.parametrize("detail", [1e-3, 1e-6, 1e-8])
def test_a_small_notch_in_a_large_polygon_is_no_crossing(detail: float) -> None:
    # A saw of small teeth: neighbouring teeth touch nowhere.
    teeth = [[0.5 + detail * k, 1 + detail * (k % 2)] for k in range(8)][::-1]
    assert accepted([[0, 0], [1, 0], [1, 1], *teeth, [0, 1]])
    slit = [[0.5 + detail, 1], [0.5 + detail, 0.2], [0.5, 0.2], [0.5, 1]]
    assert accepted([[0, 0], [1, 0], [1, 1], *slit, [0, 1]])


@pytest.mark.parametrize("scale", [1e-40, 1.0, 1e40])
def test_both_sides_of_the_tolerance_of_a_plane(scale: float) -> None:
    for off, fine in ((0.9e-9, True), (1.1e-9, False)):
        square = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, off], [0, 1, 0]]) * scale
        if fine:
            # The plane is laid through three of the vertices: the fourth is off by about as much.
            solids.require_simple_polygon(square * np.array([1, 1, 0.5]), FLOAT)
        else:
            with pytest.raises(ValueProblem, match="one plane"):
                solids.require_simple_polygon(square * np.array([1, 1, 2.0]), FLOAT)


# --- points in polygons


def winding(outline: Floats, x: float, y: float) -> float:
    """The angle under which the outline is seen from a point, in turns: 0 outside, +-1 inside."""
    rays = outline - np.array([x, y])
    after = np.roll(rays, -1, axis=0)
    cross = rays[:, 0] * after[:, 1] - rays[:, 1] * after[:, 0]
    return float(np.arctan2(cross, (rays * after).sum(axis=1)).sum() / (2 * math.pi))


def off_the_edges(outline: Floats, x: float, y: float) -> bool:
    """Whether a point is further than 1e-9 from all edges."""
    start, along = outline, np.roll(outline, -1, axis=0) - outline
    part = ((np.array([x, y]) - start) * along).sum(axis=1) / (along**2).sum(axis=1)
    foot = start + np.clip(part, 0, 1)[:, None] * along
    return bool(np.hypot(*(foot - [x, y]).T).min() > 1e-9)


@pytest.mark.parametrize("outline", OUTLINES[:4])
def test_points_in_a_polygon_against_the_winding_number(outline: list[list[float]]) -> None:
    rng = np.random.default_rng(7)
    corners = np.array(outline, dtype=float)
    x, y = rng.uniform(-5, 8, (2, 400))
    # Heights of vertices, too, where rays pass through corners.
    y[:100] = rng.choice(corners[:, 1], 100)
    x[:100] += 1e-3 * math.pi
    expected = [abs(winding(corners, a, b)) > 0.5 for a, b in zip(x, y, strict=True)]
    clear = np.array([off_the_edges(corners, a, b) for a, b in zip(x, y, strict=True)])
    found = solids.in_polygon(corners, x, y)
    assert found[clear].tolist() == np.array(expected)[clear].tolist()
    assert clear.sum() > 330


@pytest.mark.parametrize("outline", OUTLINES)
@pytest.mark.parametrize("sense", [1, -1])
def test_the_plane_of_a_polygon(outline: list[list[float]], sense: int) -> None:
    vertices = in_space(outline[::sense], TURN, (5, 6, 7))
    turn, origin = solids.plane_of(vertices)
    assert np.abs(turn @ turn.T - np.eye(3)).max() < 2e-15
    assert np.linalg.det(turn) == pytest.approx(1, rel=1e-14, abs=0)
    assert np.abs((vertices - origin) @ turn[:, 2]).max() < 1e-14
    assert abs(float(turn[:, 2] @ TURN[:, 2])) == pytest.approx(1, rel=1e-14, abs=0)
