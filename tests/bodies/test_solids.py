"""Which polygons are simple, which points are inside of them, and which simplices are flat."""

from __future__ import annotations

import itertools
import math
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.bodies import solids
from rigidcli.core.arithmetic import FLOAT
from rigidcli.errors import ValueProblem
from tests.tables import rows_of

Floats = NDArray[np.float64]
TURN: Floats = np.array(Rotation.from_euler("ZXZ", [0.4, 1.0, -2.0]).as_matrix())


def in_space(outline: Sequence[Sequence[float]], turn: Floats) -> Floats:
    return np.asarray(np.array([[x, y, 0.0] for x, y in outline]) @ turn.T)


# --- simplices


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


# --- polygons

L_SHAPE = [[0, 0], [3, 0], [3, 1], [1, 1], [1, 4], [0, 4]]
ARROW = [[0, 0], [4, 3], [0, 1], [-4, 3]]
COMB = [[0, 0], [7, 0], [7, 5], [6, 5], [6, 1], [4, 1], [4, 6], [3, 6], [3, 1], [1, 1], [1, 3], [0, 3]]
ZIGZAG = [[0, 0], [1, 3], [2, 0], [3, 3], [4, 0], [4.5, 0.5], [3, 4], [2, 1], [1, 4], [-0.5, 0.5]]
SLIM = [[0, 0], [5, 0], [5, 1e-4], [0, 1e-4]]
OUTLINES: list[list[list[float]]] = [L_SHAPE, ARROW, COMB, ZIGZAG, SLIM]  # type: ignore[list-item]


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
    rows_of(__file__, "what is no polygon is refused"),
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
