"""Slender bodies: which digits a small moment has, and what is the rounding of none, wherever they lie."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

import rigidcli

ROD = {"shape": "rod", "length": 1, "mass": 1}

DIRECTIONS = [
    [0, 0, 1],
    [1, 0, 0],
    [1e-9, 0, 1],
    [1, 2, 3],
    [-3, 1, 0.5],
]
PLACES = [[0, 0, 0], [0.1, 0.2, 0.3], [1e5, -3e4, 7]]
directions = pytest.mark.parametrize("direction", DIRECTIONS)


def needle(aspect: float) -> dict[str, Any]:
    """A cylinder 1 m long and 1/aspect thick: M R^2/2 about its axis, and M (3 R^2 + 1)/12 across."""
    return {"shape": "cylinder", "radius": 1 / (2 * aspect), "height": 1, "mass": 1}


def least(aspect: float) -> float:
    return 1 / (8 * aspect**2)


def run(study: str, body: Any, **rest: Any) -> Any:
    return getattr(rigidcli, study)(rigidcli.loads(json.dumps({"body": body, **rest})))


def require(body: Any, kind: str, least: float, tolerance: float = 1e-12, **rest: Any) -> None:
    """The class of a body, and its least moment to within a tolerance of itself."""
    found = run("axes", body, **rest)
    assert found["class"] == kind
    assert found["moments"][0] == pytest.approx(least, rel=tolerance, abs=0)


def carbon_dioxide(direction: Any, place: Any) -> Any:
    unit = np.array(direction) / np.linalg.norm(direction)
    return {"points": [[m, *(np.array(place) + x * unit)] for m, x in ((16, -1.16), (12, 0), (16, 1.16))]}


def scaled(body: Any, mass: float, length: float) -> Any:
    """The body in other units of mass and of length."""
    factors = {"mass": mass, "radius": length, "height": length, "length": length}
    return {key: value * factors[key] if key in factors else value for key, value in body.items()}


ASPECTS = st.floats(0, 6).map(lambda digits: 10**digits)
ALONG = st.sampled_from([[0, 0, 1], [0, 0, -1], [1, 0, 0], [0, -1, 0]])


@settings(max_examples=60)
@given(ASPECTS, ALONG, st.sampled_from(PLACES), st.sampled_from([(1e-27, 1e-10), (1.0, 1.0), (1e30, 1e7)]))
def test_a_body_along_an_axis_keeps_twelve_digits(
    aspect: float, axis: list[float], place: list[float], units: tuple[float, float]
) -> None:
    mass, length = units
    one = scaled(needle(aspect), mass, length) | {"axis": axis, "position": [length * x for x in place]}
    kind = "prolate" if aspect > 1 else "oblate"
    if aspect > 1.01:  # that of sqrt(3)/2 is a spherical top
        require(one, kind, least(aspect) * mass * length**2, about="com")
    part = needle(aspect / 4)  # two of them are four times as long
    two = {"parts": [part, part | {"position": [0, 0, 3]}], "axis": axis}
    if aspect > 8:
        require(two, "prolate", 2 * least(aspect / 4), about="com")
        require(needle(aspect) | {"anchor": "base", "axis": axis}, "prolate", least(aspect))


@settings(max_examples=60)
@given(ASPECTS, st.sampled_from(DIRECTIONS), st.sampled_from(PLACES))
def test_a_tilted_body_keeps_the_digits_of_its_tensor(
    aspect: float, axis: list[float], place: list[float]
) -> None:
    found = run("axes", needle(aspect) | {"axis": axis, "position": place}, about="com")
    across = (3 / (4 * aspect**2) + 1) / 12
    expected = sorted([least(aspect), across, across])
    assert found["moments"] == pytest.approx(expected, rel=0, abs=1e-15)
    lost = [note for note in found.notes if "digits" in note]
    if not 2e4 < aspect < 2e5:
        assert bool(lost) == (aspect > 1e5 and axis[1] != 0)


@directions
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("mass", "length"), [(1e-27, 1e-10), (1e30, 1e7)])
def test_a_rod_anywhere_is_linear(direction: Any, place: Any, mass: float, length: float) -> None:
    there = {"axis": direction, "position": [length * x for x in place]}
    for body in (ROD, needle(1e7)):
        require(scaled(body, mass, length) | there, "linear", 0.0, about="com")
    points = [[mass * m, *(length * np.array(r))] for m, *r in carbon_dioxide(direction, place)["points"]]
    require({"points": points}, "linear", 0.0, about="com")


@directions
def test_about_points_of_their_line(direction: Any) -> None:
    unit = np.array(direction) / np.linalg.norm(direction)
    for place in ([0, 0, 0], [0.1, 0.2, 0.3]):
        there = {"axis": direction, "position": place}
        require(ROD | there | {"anchor": "end"}, "linear", 0.0, about=place)
    # The middle of the rod comes to the origin, but for rounding.
    require(ROD | {"axis": direction, "anchor": "end", "position": list(-unit / 2)}, "linear", 0.0)
    require({"points": [[2, *direction]]}, "point", 0.0, about=direction)


@directions
@pytest.mark.parametrize("place", PLACES)
def test_in_composites(direction: Any, place: Any) -> None:
    there = {"axis": direction, "position": place}
    unit = np.array(direction) / np.linalg.norm(direction)
    further = {"axis": direction, "position": list(np.array(place) + 3 * unit)}
    opposite = further | {"axis": [-x for x in direction]}
    for parts in ([ROD, ROD | {"position": [0, 0, 3]}],):
        require({"parts": parts} | there, "linear", 0.0, about="com")
    for other in (further, opposite):
        require({"parts": [ROD | there, ROD | other]}, "linear", 0.0, about="com")


@directions
def test_points_of_a_file_on_a_line(direction: Any, tmp_path: Path) -> None:
    rng = np.random.default_rng(2)
    for place, count in itertools.product(PLACES, (2, 3, 40, 150)):
        along = rng.normal(size=(count, 1)) * direction / np.linalg.norm(direction)
        rows = np.column_stack([rng.uniform(0.1, 10, count), along + place])
        np.save(tmp_path / "line.npy", rows)
        for points in (str(tmp_path / "line.npy"), rows.tolist()):
            for about in ("com", rows[0, 1:].tolist()):
                require({"points": points}, "linear", 0.0, about=about)


def test_a_typed_tensor_of_a_point_far_away_is_a_point() -> None:
    d = np.array([3e4, -1e3, 2.0])
    tensor = 2.0 * (d @ d * np.eye(3) - np.outer(d, d))
    body = {"inertia": tensor.tolist(), "mass": 2, "com": d.tolist(), "given_about": "origin"}
    assert run("axes", body, about="com")["class"] == "point"


def test_rounding_prints_as_zero() -> None:
    molecule = carbon_dioxide([1, 0, 0], [0.1, 0.2, 0.3])["points"]
    tensor = run(
        "inertia", {"points": [[1e-27 * m, *(1e-10 * np.array(r))] for m, *r in molecule]}, about="com"
    )
    assert np.count_nonzero(tensor["tensor"]) == 2
    box = {"shape": "box", "size": [1, 2, 3], "mass": 1, "rotation": {"axis": [0, 0, 1], "angle": "90 deg"}}
    found = run("inertia", box, frame={"axis": [1, 1, 1], "angle": "120 deg"})
    assert np.count_nonzero(found["tensor"]) == 3
    around = [[1, math.cos(k), math.sin(k), 0] for k in np.arange(7) * 2 * math.pi / 7]
    assert run("inertia", {"points": around})["center_of_mass"].tolist() == [0, 0, 0]


# --- their motion

TURN = Rotation.from_rotvec([0.3, -0.5, 0.7])


@pytest.mark.parametrize("omega", [[0.3, 0.1, 2.0], [0, 0, 2.0]])
def test_a_needle_moves_alike_however_it_lies_in_its_document(omega: list[float]) -> None:
    when = {"duration": 5, "samples": 4}
    plain = run("euler", needle(1e4), motion={"omega": omega, **when})
    # Turned in the document, and back as the motion begins.
    w, x, y, z = TURN.as_quat(scalar_first=True)
    turned = run(
        "euler",
        needle(1e4) | {"rotation": {"quaternion": [w, x, y, z]}},
        motion={"omega": list(TURN.apply(omega)), "orientation": {"quaternion": [w, -x, -y, -z]}, **when},
    )
    assert plain["motion"] == turned["motion"] == ("prolate" if omega[0] else "principal")
    one, other = (
        Rotation.from_quat(r["trajectory"]["orientation"], scalar_first=True) for r in (plain, turned)
    )
    assert (one.inv() * (other * TURN)).magnitude().max() < 10 ** -turned["trusted_digits"]
    assert turned["kinetic_energy"] == pytest.approx(plain["kinetic_energy"], rel=0, abs=1e-16)


def test_a_needle_is_a_top_and_a_rod_is_none() -> None:
    top = {"spin": 1e3, "tilt": 0.5}
    found = run("precess", needle(1e5) | {"anchor": "base"}, top=top)
    assert found["top"]["lambda3"] == pytest.approx(least(1e5), rel=1e-12, abs=0)
    for body in (ROD | {"anchor": "end"}, needle(1e7) | {"anchor": "base"}):
        with pytest.raises(rigidcli.errors.RigidError, match="linear"):
            run("precess", body | {"axis": [1, 2, 3]}, top=top)
