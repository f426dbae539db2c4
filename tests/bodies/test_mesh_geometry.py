"""Integrals over surfaces of triangles, and which are closed, against closed forms and other programs."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import ConvexHull
from scipy.spatial.transform import Rotation

from rigidcli.bodies import mesh_geometry
from rigidcli.bodies.mesh_geometry import Surface
from rigidcli.core.arithmetic import Floats
from tests.meshes import Triangles, box, revolved


def corners_of(triangles: Triangles) -> Floats:
    """The corners of triangles by vertex, coordinate and triangle."""
    return np.ascontiguousarray(triangles.transpose(1, 2, 0))


def measured(triangles: Triangles) -> Surface:
    return Surface(corners_of(triangles))


def hull(seed: int) -> Triangles:
    """A convex body about random points, wound outwards."""
    points = np.random.default_rng(seed).normal(size=(30, 3))
    found = ConvexHull(points)
    triangles = points[found.simplices]
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    turned = (normals * found.equations[:, :3]).sum(axis=1) < 0
    triangles[turned] = triangles[turned][:, ::-1]
    return np.asarray(triangles, dtype=np.float64)


def ball(turns: int) -> Triangles:
    angle = np.pi * np.arange(turns // 2 + 1) / (turns // 2)
    profile = np.column_stack([np.sin(angle), np.cos(angle)])
    profile[[0, -1], 0] = 0.0
    return revolved(profile, turns)


# --- integrals


@pytest.mark.parametrize("distance", [2.0**17, -(2.0**20)])
def test_a_far_surface_loses_no_digits(distance: float) -> None:
    """Coordinates of single precision, moved by a power of two: the sums of both are exact to 53 bits."""
    near = ball(40).astype(np.float32).astype(np.float64)
    here, there = measured(near), measured(near + distance)
    assert there.volume == pytest.approx(here.volume, rel=1e-13)
    np.testing.assert_allclose(there.second, here.second, rtol=1e-12, atol=1e-13)
    np.testing.assert_allclose(there.origin + there.centre, [distance] * 3, rtol=1e-15)


def test_sums_are_taken_anew_where_the_middle_of_the_box_is_far_from_the_centre() -> None:
    """The small box is far from the centre: what its volume loses there, `cancelled` tells."""
    triangles = np.concatenate([box((0, 0, 0), (0.1, 0.1, 0.1)), box((1e4, 0, 0), (1e4 + 1, 2, 3))])
    found = measured(triangles)
    small, large = 1e-3, 6.0
    apart = np.array([1e4 + 0.45, 0.95, 1.45])
    exact = large * np.diag([1, 4, 9]) / 12 + small * np.eye(3) * 0.01 / 12
    exact = exact / (small + large) + small * large / (small + large) ** 2 * np.outer(apart, apart)
    error = np.abs(found.second - exact).max() / exact.max()
    assert error < 1e-9
    assert error < 1e-15 * found.cancelled


@given(seed=st.integers(0, 50), turn=st.integers(0, 50))
def test_turning_and_moving_a_body_turns_and_moves_what_is_measured(seed: int, turn: int) -> None:
    body, rotation = hull(seed), Rotation.random(rng=np.random.default_rng(turn)).as_matrix()
    one, two = measured(body), measured(body @ rotation.T + [3.0, -2.0, 5.0])
    assert two.volume == pytest.approx(one.volume, rel=1e-13)
    assert two.area == pytest.approx(one.area, rel=1e-13)
    np.testing.assert_allclose(two.second, rotation @ one.second @ rotation.T, atol=1e-12)
    place = rotation @ (one.origin + one.centre) + [3.0, -2.0, 5.0]
    np.testing.assert_allclose(two.origin + two.centre, place, atol=1e-12)


# --- edges


@settings(max_examples=20)
@given(seed=st.integers(0, 200), data=st.data())
def test_any_triangle_that_is_missing_or_turned_opens_the_surface(seed: int, data: st.DataObject) -> None:
    body = hull(seed)
    assert measured(body).is_closed
    place = data.draw(st.integers(0, len(body) - 1))
    missing = np.delete(body, place, axis=0)
    assert not measured(missing).is_closed
    found = mesh_geometry.unpaired(corners_of(missing))
    assert found is not None
    sides = {(tuple(body[place, j]), tuple(body[place, i])) for i, j in mesh_geometry.SIDES}
    assert (found.number, found.uses) == (3, 1)
    assert tuple(map(tuple, found.edge.tolist())) in sides
    turned = body.copy()
    turned[place] = turned[place][::-1]
    found = mesh_geometry.unpaired(corners_of(turned))
    assert found is not None
    assert (found.number, found.uses) == (3, 2)
    assert mesh_geometry.unpaired(corners_of(body)) is None


def test_a_tube_without_its_ends_is_not_closed_though_their_areas_cancel() -> None:
    body = box((0, 0, 0), (1, 1, 1))
    assert not measured(body[2:6]).is_closed
    assert not measured(np.concatenate([body[:1], body[3:]])).is_closed


def test_minus_zero_is_zero() -> None:
    body = box((0, 0, 0), (1, 1, 1))
    body[::2] = np.where(body[::2] == 0, -0.0, body[::2])
    assert measured(body).is_closed


# --- windings


def test_windings_are_one_inside_and_none_outside() -> None:
    body = ball(60)
    points = np.random.default_rng(1).uniform(-1, 1, (500, 3))
    distance = np.linalg.norm(points, axis=1)
    found = measured(body).windings(points)
    assert (found[distance < 0.99] == 1).all()
    assert (found[distance > 1] == 0).all()


def test_components_hang_together_by_their_vertices() -> None:
    row = [ball(30) + np.array([3.0 * k, 0, 0]) for k in range(7)]
    body = np.concatenate([*row, box((50, 0, 0), (51, 1, 1))])
    found = measured(np.random.default_rng(3).permutation(body))
    assert len(np.unique(mesh_geometry.components(mesh_geometry.vertex_keys(found.corners)))) == 8
