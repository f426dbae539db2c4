"""`inertia`: points and frames, and exact results against floating ones."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
import yaml
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import rigidcli
from rigidcli.algebra.expressions import Expr
from rigidcli.bodies.shapes import SHAPES
from tests.exact import numeric
from tests.shapes import DIMENSIONS

Floats = NDArray[np.float64]

BODIES = yaml.safe_load(Path(__file__).with_name("bodies.yaml").read_text(encoding="utf-8"))
KEYS = ("mass", "center_of_mass", "about", "tensor", "tensor_com")


def run(text: str, **options: Any) -> Any:
    return rigidcli.inertia(rigidcli.loads(text, **options))


# --- about a point

CLOUD = [[1.0, 1, 0, 0.5], [2, -0.5, 2, 0], [0.5, 0, -1, 3]]


def cloud_tensor(point: Any) -> Floats:
    total = np.zeros((3, 3))
    for m, *place in CLOUD:
        r = np.array(place) - np.array(point)
        total += m * (float(r @ r) * np.eye(3) - np.outer(r, r))
    return total


def cloud_com() -> Floats:
    rows = np.array(CLOUD)
    return np.array(rows[:, 0] @ rows[:, 1:] / rows[:, 0].sum())


def with_cloud(**rest: Any) -> Any:
    return run(json.dumps({"body": {"points": CLOUD}, **rest}))


def test_about_the_centre_and_about_a_point() -> None:
    found = with_cloud(about="com")
    assert found["about"] == pytest.approx(cloud_com(), rel=1e-15, abs=0)
    assert np.array_equal(found["tensor"], found["tensor_com"])
    assert found["tensor"] == pytest.approx(cloud_tensor(cloud_com()), abs=1e-13)
    found = with_cloud(about=[3, "-20 cm", 1])
    assert found["about"].tolist() == [3, -0.2, 1]
    assert found["tensor"] == pytest.approx(cloud_tensor([3, -0.2, 1]), abs=1e-13)
    assert found["tensor_com"] == pytest.approx(cloud_tensor(cloud_com()), abs=1e-13)


# --- frames

FRAMES: list[tuple[dict[str, Any], Floats]] = [
    ({"axis": [0, 0, 1], "angle": "30 deg"}, Rotation.from_rotvec([0, 0, math.pi / 6]).as_matrix()),
    ({"euler": [0.4, 1.0, -2.0]}, Rotation.from_euler("ZXZ", [0.4, 1.0, -2.0]).as_matrix()),
    ({"quaternion": [1, 2, 3, 4]}, Rotation.from_quat([2, 3, 4, 1]).as_matrix()),
]


@pytest.mark.parametrize(("frame", "turn"), FRAMES)
@pytest.mark.parametrize("about", ["origin", [1, 2, -3]])
def test_a_frame_expresses_every_vector_and_tensor(frame: dict[str, Any], turn: Floats, about: Any) -> None:
    plain, turned = with_cloud(about=about), with_cloud(about=about, frame=frame)
    for key in ("center_of_mass", "about"):
        assert turned[key] == pytest.approx(turn.T @ plain[key], abs=1e-14)
    for key in ("tensor", "tensor_com"):
        assert turned[key] == pytest.approx(turn.T @ plain[key] @ turn, abs=1e-13)
    assert turned["mass"] == plain["mass"]


# --- exact results

PLACES = [
    "density: 3",
    "mass: 2.5, anchor: com, position: [1, -2, 0.5], rotation: {axis: [0, 0, 1], angle: pi/3}",
    "density: 1.2, position: [1, 0, 0.1], axis: [1, 2, 2]",
]
EXACT = [
    *(f"{{shape: {shape}, {d}, {PLACES[0]}}}" for shape, d in DIMENSIONS.items()),
    *(f"{{shape: {shape}, {d}, {PLACES[1 + k % 2]}}}" for k, (shape, d) in enumerate(DIMENSIONS.items())),
    *BODIES["exact bodies"],
]


def require_alike(exact: Any, floating: Any, values: Mapping[str, float] | None = None) -> None:
    for key in KEYS:
        one, other = numeric(exact[key], values), np.asarray(floating[key])
        # A centre that is exactly at the origin comes with the rounding of the numbers it is made of.
        scale = max(np.abs(one).max(), 1.0 if key in ("center_of_mass", "about") else 0.0)
        assert np.abs(one - other).max() <= 1e-13 * scale, key


def test_every_shape_is_worked_exactly_here() -> None:
    assert list(DIMENSIONS) == list(SHAPES)


@pytest.mark.parametrize("body", EXACT)
def test_exact_results_are_the_floating_ones(body: str) -> None:
    # Turned by pi/3, a shape is asked about its centre; other points are for the shapes as they are.
    about = "com" if "pi/3" in body else "[1/3, 0, -2]"
    text = f"{{body: {body}, about: {about}}}"
    exact = run(text, exact=True)
    assert all(isinstance(entry, Expr) for entry in exact["tensor"].flat)
    require_alike(exact, run(text))


@pytest.mark.parametrize(
    ("frame", "about"),
    [("{axis: [0, 0, 1], angle: pi/6}", "origin"), ("{quaternion: [1, 1, 1, 0]}", "[1, 2, 0.1]")],
)
def test_exact_frames_and_points(frame: str, about: str) -> None:
    body = "{shape: cone, radius: 1, height: 2, mass: 3, axis: [0, 3, 4]}"
    text = f"{{body: {body}, frame: {frame}, about: {about}}}"
    require_alike(run(text, exact=True), run(text))


@pytest.mark.parametrize(
    ("axis", "about"),
    [
        ([1, 1, 1], ["1/3", 0, -2]),
        ([1, 0, -1], ["1/3", 0, -2]),
        ([1, 2, 2], [1, "1/2", 0]),
    ],
)
def test_an_exact_disk_is_rational_about_any_rational_point(axis: list[int], about: list[Any]) -> None:
    # M R^2 (1 + n n^T)/4 + M (p^2 1 - p p^T): the roots in n cancel, whatever the axis.
    body = f"{{shape: disk, radius: 1, mass: 1, axis: {axis}}}"
    found = run(f"{{body: {body}, about: {json.dumps(about)}}}", exact=True)["tensor"]
    p = [sympy.Rational(str(component)) for component in about]
    for i in range(3):
        for j in range(3):
            central = sympy.Rational(axis[i] * axis[j], 4 * sum(a * a for a in axis)) - p[i] * p[j]
            if i == j:
                central += sympy.Rational(1, 4) + sum(component**2 for component in p)
            assert found[i, j] == central


@pytest.mark.parametrize(("body", "values"), BODIES["bodies with symbols"])
def test_symbols_with_values_give_the_floating_results(body: str, values: dict[str, float]) -> None:
    about = "com" if "shape: cone" in body or "points" in body or "half_disk" in body else "origin"

    def text(parameters: Mapping[str, Any]) -> str:
        return f"{{body: {body}, about: {about}, parameters: {json.dumps(parameters)}}}"

    symbolic = run(text(dict.fromkeys(values)))
    require_alike(symbolic, run(text(values)), values)
