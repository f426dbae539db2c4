"""Slender bodies: what is a small moment, and what is the rounding of none, wherever they lie."""

from __future__ import annotations

import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import rigidcli

NEEDLE = {"shape": "cylinder", "radius": 1e-8, "height": 1, "mass": 1}
"""Its moment about its own axis is M R^2/2 = 5e-17 kg m^2, and 1/12 across."""

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


def run(study: str, body: Any, **rest: Any) -> Any:
    return getattr(rigidcli, study)(rigidcli.loads(json.dumps({"body": body, **rest})))


def require(body: Any, kind: str, least: float, tolerance: float = 1e-12, **rest: Any) -> None:
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


@directions
@pytest.mark.parametrize("place", PLACES)
@pytest.mark.parametrize(("mass", "length"), [(1e-27, 1e-10), (1e30, 1e7)])
def test_a_needle_and_a_rod_anywhere(direction: Any, place: Any, mass: float, length: float) -> None:
    there = {"axis": direction, "position": [length * x for x in place]}
    require(scaled(NEEDLE, mass, length) | there, "prolate", 5e-17 * mass * length**2, about="com")
    require(scaled(ROD, mass, length) | there, "linear", 0.0, about="com")
    points = [[mass * m, *(length * np.array(r))] for m, *r in carbon_dioxide(direction, place)["points"]]
    require({"points": points}, "linear", 0.0, about="com")


@directions
def test_about_points_of_their_line(direction: Any) -> None:
    unit = np.array(direction) / np.linalg.norm(direction)
    for place in ([0, 0, 0], [0.1, 0.2, 0.3]):
        there = {"axis": direction, "position": place}
        require(NEEDLE | there | {"anchor": "base"}, "prolate", 5e-17, about=place)
        require(ROD | there | {"anchor": "end"}, "linear", 0.0, about=place)
    # The middle of the rod comes to the origin, but for rounding.
    require(ROD | {"axis": direction, "anchor": "end", "position": list(-unit / 2)}, "linear", 0.0)
    require({"points": [[2, *direction]]}, "point", 0.0, about=direction)


@directions
@pytest.mark.parametrize("place", PLACES)
def test_in_composites(direction: Any, place: Any) -> None:
    there = {"axis": direction, "position": place}
    for body, kind, least in ((NEEDLE, "prolate", 1e-16), (ROD, "linear", 0.0)):
        pair = {"parts": [body, body | {"position": [0, 0, 3]}]}
        require(pair | there, kind, least, about="com")
        unit = np.array(direction) / np.linalg.norm(direction)
        further = {"axis": direction, "position": list(np.array(place) + 3 * unit)}
        if max(place) < 1:
            require({"parts": [body | there, body | further]}, kind, least, 1e-6, about="com")
        opposite = further | {"axis": [-x for x in direction]}
        require({"parts": [ROD | there, ROD | opposite]}, "linear", 0.0, about="com")


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


@pytest.mark.parametrize("omega", [[0.3, 0.1, 2.0], [0, 0, 2.0], [1, 0, 1e4]])
def test_a_needle_moves_alike_however_it_lies_in_its_document(omega: list[float]) -> None:
    when = {"duration": 5, "samples": 4}
    plain = run("euler", NEEDLE, motion={"omega": omega, **when})
    # Turned in the document, and back as the motion begins.
    w, x, y, z = TURN.as_quat(scalar_first=True)
    turned = run(
        "euler",
        NEEDLE | {"rotation": {"quaternion": [w, x, y, z]}},
        motion={"omega": list(TURN.apply(omega)), "orientation": {"quaternion": [w, -x, -y, -z]}, **when},
    )
    assert plain["motion"] == turned["motion"] == ("prolate" if omega[0] else "principal")
    one, other = (
        Rotation.from_quat(r["trajectory"]["orientation"], scalar_first=True) for r in (plain, turned)
    )
    assert (one.inv() * (other * TURN)).magnitude().max() < 1e-14 * math.hypot(*omega) * 50
    assert turned["kinetic_energy"] == pytest.approx(plain["kinetic_energy"], rel=1e-11, abs=0)


def test_a_needle_is_a_top_and_a_rod_is_none() -> None:
    held = {"axis": [1, 2, 3], "anchor": "base"}
    top = {"spin": 1e3, "tilt": 0.5}
    found = run("precess", NEEDLE | held, top=top)
    assert found["top"]["lambda3"] == pytest.approx(5e-17, rel=1e-12, abs=0)
    with pytest.raises(rigidcli.errors.RigidError, match="linear"):
        run("precess", ROD | held | {"anchor": "end"}, top=top)
