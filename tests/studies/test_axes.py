"""`axes`: moments, axes and classes of known bodies, and how they turn, against definitions and books."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import rigidcli
from rigidcli.errors import ComputationError
from tests.exact import numeric

few = settings(max_examples=30)

BODIES = yaml.safe_load(Path(__file__).with_name("bodies.yaml").read_text(encoding="utf-8"))
BOX = {"shape": "box", "size": [1, 2, 3], "mass": 12}
BOX_MOMENTS = [5.0, 10.0, 13.0]
"""About e1 = z, e2 = y, e3 = x of the box: M (a^2 + b^2)/12."""


def run(text: str, **options: Any) -> Any:
    return rigidcli.axes(rigidcli.loads(text, **options))


def turning(body: Any, omega: Any, basis: str = "body", **rest: Any) -> Any:
    return run(json.dumps({"body": body, "motion": {"omega": list(omega), "basis": basis}, **rest}))


def require_consistent(found: Any) -> None:
    """The axes are a right-handed frame in which the tensor is diagonal, with the moments ascending."""
    tensor, moments, axes = found["tensor"], found["moments"], found["axes"]
    assert np.abs(axes @ axes.T - np.eye(3)).max() < 5e-15
    assert np.linalg.det(axes) == pytest.approx(1, rel=1e-14, abs=0)
    assert moments[0] <= moments[1] <= moments[2]
    diagonal = axes @ tensor @ axes.T
    assert np.abs(diagonal - np.diag(moments)).max() <= 3e-12 * max(moments[2], 1e-300)
    assert found["residual"] <= 3e-12
    if moments[2] > 0:
        errors = [np.linalg.norm(tensor @ e - m * e) / moments[2] for e, m in zip(axes, moments, strict=True)]
        assert found["residual"] == pytest.approx(max(errors), abs=2e-15)


# --- classes


@pytest.mark.parametrize(("kind", "body", "groups", "about"), BODIES["classes"])
def test_every_class(kind: str, body: str, groups: list[list[int]], about: str) -> None:
    found = run(f"{{body: {body}, about: {about}}}")
    assert found["class"] == kind
    assert found["groups"] == groups
    require_consistent(found)
    if kind in ("point", "linear"):
        assert found["moments"][0] == 0.0


@pytest.mark.parametrize("scale", [1e-10, 1e9])
def test_the_class_does_not_depend_on_the_scale(scale: float) -> None:
    for size, kind in (
        ([1, 1, 1], "spherical"),
        ([1, 1, 2], "prolate"),
        ([2, 2, 1], "oblate"),
        ([1, 2, 3], "asymmetric"),
    ):
        box = {
            "shape": "box",
            "size": [scale * side for side in size],
            "mass": scale**2,
            "rotation": {"euler": [1, 2, 3]},
        }
        assert run(json.dumps({"body": box}))["class"] == kind


# --- turning: L, T and the angle between omega and L


@few
@given(
    st.lists(st.integers(-9, 9), min_size=3, max_size=3).filter(any),
    st.lists(st.integers(-64, 64), min_size=4, max_size=4).filter(any),
    st.sampled_from([1e-150, 1e-30, 1.0, 1e30, 1e150]),
)
def test_momentum_energy_and_angle_by_their_definitions(
    omega: list[int], quaternion: list[int], scale: float
) -> None:
    points = [[1, 1, 0, 0.5], [2, -0.5, 2, 0], [0.5, 0, -1, 3]]
    body = {"points": points, "rotation": {"quaternion": quaternion}}
    turn = Rotation.from_quat([*quaternion[1:], quaternion[0]]).as_matrix()
    found = turning(body, [w * scale for w in omega])
    momentum, energy = np.zeros(3), 0.0
    for m, *place in points:
        r = turn @ np.array(place)
        velocity = np.cross(omega, r)
        momentum += m * np.cross(r, velocity)
        energy += m * float(velocity @ velocity) / 2
    size = np.linalg.norm(omega)
    assert found["omega"].tolist() == [w * scale for w in omega]
    assert np.abs(found["angular_momentum"] / scale - momentum).max() < 1e-13 * 30 * size
    assert found["kinetic_energy"] / scale / scale == pytest.approx(energy, rel=1e-13, abs=0)
    angle = math.atan2(float(np.linalg.norm(np.cross(omega, momentum))), float(np.dot(omega, momentum)))
    assert found["angle"] == pytest.approx(angle, abs=1e-14)
    assert found["wobbles"] == (angle > 1e-9)


def test_basis_and_frame() -> None:
    frame = {"axis": [0, 0, 1], "angle": "30 deg"}
    turn = Rotation.from_rotvec([0, 0, math.pi / 6]).as_matrix()
    body = BOX | {"rotation": {"euler": [1, 2, 3]}}
    omega = np.array([1.0, -2, 0.5])
    plain, turned = turning(body, omega), turning(body, omega, frame=frame)
    # Components along the document's body axes; results along the frame.
    assert turned["omega"] == pytest.approx(turn.T @ omega, abs=1e-15)
    assert turned["angular_momentum"] == pytest.approx(turn.T @ plain["angular_momentum"], abs=1e-14)
    assert turned["kinetic_energy"] == pytest.approx(plain["kinetic_energy"], rel=1e-15, abs=0)
    assert turned["angle"] == pytest.approx(plain["angle"], rel=1e-14, abs=0)
    # Components along e1, e2, e3 as printed; T = sum lambda w^2 / 2 (the notes call 2 T the kinetic energy).
    for rest in ({}, {"frame": frame}):
        found = turning(body, omega, "principal", **rest)
        assert found["omega"] == pytest.approx(found["axes"].T @ omega, abs=1e-15)
        assert found["axes"] @ found["angular_momentum"] == pytest.approx(BOX_MOMENTS * omega, rel=2e-15)
        assert found["kinetic_energy"] == pytest.approx(float(BOX_MOMENTS @ omega**2) / 2, rel=1e-14, abs=0)


# --- turning: does it wobble?

SIZES = [1e-150, 1.0, 1e20]
TURNED = BOX | {"rotation": {"euler": [1, 2, 3]}}


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("axis", range(3))
def test_spin_about_a_principal_axis_does_not_wobble(axis: int, size: float) -> None:
    omega = [0.0, 0.0, 0.0]
    omega[axis] = -size
    straight = turning(BOX, omega)
    assert straight["wobbles"] is False
    assert straight["angle"] == 0.0
    turned = turning(TURNED, omega, "principal")
    assert turned["wobbles"] is False
    assert turned["angle"] < 1e-14
    # The same axis, rounded to components along x, y and z.
    by_components = turning(TURNED, (size * turned["axes"][axis]).tolist())
    assert by_components["wobbles"] is False
    assert by_components["angle"] < 1e-14


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize("tilt", [1e-9, 0.1])
@pytest.mark.parametrize(("axis", "towards"), [(0, 1), (1, 2), (2, 0)])
def test_a_tilt_wobbles(axis: int, towards: int, tilt: float, size: float) -> None:
    omega = [0.0, 0.0, 0.0]
    omega[axis], omega[towards] = size, tilt * size
    # lambda_axis w, lambda_towards tilt w: the angle between (1, tilt) and (l, l' tilt).
    with mpmath.workdps(40):
        own, other, t = (mpmath.mpf(x) for x in (BOX_MOMENTS[axis], BOX_MOMENTS[towards], tilt))
        angle = float(abs(mpmath.atan(other * t / own) - mpmath.atan(t)))
    turned = turning(TURNED, omega, "principal")
    assert turned["wobbles"] is True
    assert turned["angle"] == pytest.approx(angle, rel=1e-9, abs=2e-15)
    places = [2, 1, 0]  # e1 is z, e2 is y, e3 is x
    straight = [0.0, 0.0, 0.0]
    straight[places[axis]], straight[places[towards]] = size, tilt * size
    found = turning(BOX, straight)
    assert found["wobbles"] is True
    assert found["angle"] == pytest.approx(angle, rel=1e-13, abs=0)


def test_symmetric_bodies_wobble_only_off_their_axis_and_plane() -> None:
    disk = {"shape": "disk", "radius": 1, "mass": 4, "axis": [1, 2, 3]}
    for omega, wobbles in (([1, 2, 0], False), ([0, 0, 5], False), ([1, 0, 1], True), ([0, 1e-8, 1], True)):
        assert turning(disk, omega, "principal")["wobbles"] is wobbles
    ball = {"shape": "cube", "side": 1, "mass": 4, "axis": [1, 2, 3]}
    for omega in ([1, 2, 3], [0, 0, 1e-150], [1, -1, 1e-9]):
        found = turning(ball, omega)
        assert found["wobbles"] is False
        assert found["angle"] < 1e-14


def test_without_omega_or_moments_there_is_no_angle() -> None:
    rest = turning(BOX, [0, 0, 0])
    assert rest["angle"] is None
    assert rest["wobbles"] is False
    assert rest["kinetic_energy"] == 0
    point = turning({"points": [[1, 1, 2, 3]]}, [1, 2, 3], about="com")
    assert point["angle"] is None
    assert point["wobbles"] is False
    assert point["angular_momentum"].tolist() == [0, 0, 0]


@pytest.mark.parametrize("axis", [[0, 0, 1], [1, 2, 3], [-3, 1, 0.5]])
@pytest.mark.parametrize("size", [1e-150, 1.0])
def test_a_rod_that_spins_about_itself_has_no_momentum(axis: list[float], size: float) -> None:
    rod = {"shape": "rod", "length": 1, "mass": 1, "axis": axis}
    for omega, basis in (([size * component for component in axis], "body"), ([size, 0, 0], "principal")):
        found = turning(rod, omega, basis)
        assert np.abs(found["angular_momentum"]).max() <= 1e-15 * size * np.abs(axis).max()
        # L is zero but for rounding, which has no direction: nor has it an angle to omega.
        assert found["angle"] is None
        assert found["wobbles"] is False
        assert 0 <= found["kinetic_energy"] <= 1e-15 * size**2 * 10


# --- exact


def require_alike(exact: Any, floating: Any, values: Mapping[str, float] | None = None) -> None:
    """The same numbers, and the same axes: equal tensors get equal axes whatever their kind of number.

    With symbols, which of two components is the larger depends on the values: signs and pairs are then free.
    """
    assert numeric(exact["moments"], values) == pytest.approx(floating["moments"], rel=1e-13, abs=0)
    axes = numeric(exact["axes"], values)
    if values is None:
        assert axes == pytest.approx(floating["axes"], abs=1e-13)
    assert np.linalg.det(axes) == pytest.approx(1, rel=1e-13, abs=0)
    for group in floating["groups"]:
        one, other = axes[group], floating["axes"][group]
        assert one.T @ one == pytest.approx(other.T @ other, abs=1e-13)
    assert exact["groups"] == floating["groups"]
    assert exact["class"] == floating["class"]
    assert floating["residual"] < 1e-14
    for key in ("omega", "angular_momentum"):
        if key in floating:
            # L of a rod that spins about itself is zero: rounding is that of lambda3 omega.
            size = np.abs(floating["omega"]).max() * (
                floating["moments"][2] if key == "angular_momentum" else 1
            )
            assert np.abs(numeric(exact[key], values) - floating[key]).max() <= 1e-13 * size
    if "angle" in floating:
        assert numeric(exact["kinetic_energy"], values) == pytest.approx(
            floating["kinetic_energy"], rel=1e-13, abs=1e-15
        )
        assert exact["wobbles"] == floating["wobbles"]
        assert (exact["angle"] is None) == (floating["angle"] is None)
        if floating["angle"] is not None:
            assert numeric(exact["angle"], values) == pytest.approx(floating["angle"], abs=1e-13)


@pytest.mark.parametrize("text", BODIES["exact axes"])
def test_exact_results_are_the_floating_ones(text: str) -> None:
    require_alike(run(text, exact=True), run(text))


@pytest.mark.parametrize(("text", "values"), BODIES["symbols"])
def test_symbols_with_values_give_the_floating_results(text: str, values: dict[str, float]) -> None:
    symbolic = run(f"{{{text}, parameters: {json.dumps(dict.fromkeys(values))}}}")
    require_alike(symbolic, run(f"{{{text}, parameters: {json.dumps(values)}}}"), values)


def test_where_the_moments_are_too_long_all_else_is_told() -> None:
    body = "{points: [[m, a, 0, 0], [2*m, 0, a, a], [3*m, 1, 2, a]]}"
    text = f"{{body: {body}, motion: {{omega: [0, 0, 1]}}, parameters: "
    found, values = run(f"{text}{{m: null, a: null}}}}"), {"m": 2.0, "a": 0.7}
    floating = run(f"{text}{json.dumps(values)}}}")
    assert [found[key] for key in ("moments", "axes", "groups", "class", "residual")] == [None] * 5
    assert any("too long to print" in note for note in found.notes)
    for key in ("tensor", "angular_momentum", "kinetic_energy", "angle"):
        assert numeric(found[key], values) == pytest.approx(floating[key], rel=1e-13, abs=1e-13)
    assert found["wobbles"] is floating["wobbles"] is True
    with pytest.raises(ComputationError, match="too long to print"):
        run(f"{text}{{m: null, a: null}}}}".replace("omega: [0, 0, 1]", "omega: [0, 0, 1], basis: principal"))


# --- about an axis, and held


@few
@given(
    st.lists(st.integers(-50, 50), min_size=3, max_size=3).filter(any),
    st.lists(st.integers(-9, 9).map(lambda x: x / 7), min_size=3, max_size=3),
)
def test_the_moment_about_an_axis_is_that_of_the_distances_from_it(u: list[int], point: list[float]) -> None:
    masses = np.array([[1.0, 1, 2, 3], [2, -1, 0, 1], [0.5, 2, -2, 0.5], [1.5, 0, 1, -1]])
    # |r x u|^2, of the arms from the point, without any tensor.
    arms = np.cross(masses[:, 1:] - point, np.array(u) / math.hypot(*u))
    expected = float(masses[:, 0] @ (arms**2).sum(axis=1))
    for rest in ({}, {"frame": {"euler": [1, 2, 3]}}):
        body = {"points": masses.tolist()}
        found = run(json.dumps({"body": body, "about": point, "axis": u, **rest}))
        assert found["axis_moment"] == pytest.approx(expected, rel=1e-12)
        assert found["radius_of_gyration"] == pytest.approx(math.sqrt(expected / 5), rel=1e-12)


def test_the_torque_that_holds_an_unbalanced_shaft() -> None:
    # Two masses on arms of opposite ends: the centrifugal forces m r w^2 make the couple 2 m r z w^2.
    found = run("{body: {points: [[3, 0.2, 0, 0.5], [3, -0.2, 0, -0.5]]}, motion: {omega: [0, 0, 7]}}")
    assert found["holding_torque"] == pytest.approx([0, -2 * 3 * 0.2 * 0.5 * 49, 0], rel=1e-14, abs=1e-14)
    turned = turning(TURNED, [0, 1, 0], "principal")
    assert turned["holding_torque"].tolist() == [0, 0, 0]


def test_a_common_factor_with_symbols_leaves_numbers_to_solve() -> None:
    document = "body: {shape: box, size: [1, 2, 3], mass: M, anchor: corner}\nparameters: {M: null}"
    exact = rigidcli.axes(document)
    numbers = rigidcli.axes(document.replace("null", "2.5"))
    assert [moment.evaluate(M=2.5) for moment in exact["moments"]] == pytest.approx(numbers["moments"])
    assert np.allclose(exact["axes"].astype(float), numbers["axes"], atol=1e-12)
    assert exact["class"] == "asymmetric"
