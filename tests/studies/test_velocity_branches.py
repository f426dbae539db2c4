"""Momenta that several velocities have, or none in closed form: branches, starts of orbits, their ends."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from scipy.optimize import brentq

import rigidcli
from rigidcli.errors import DocumentError
from rigidcli.language.expression import real
from rigidcli.language.parser import read
from rigidcli.report import Report
from tests.conftest import Program


def hamilton(lagrangian: str, orbit: str = "", parameters: str = "", coordinates: str = "x") -> Report:
    text = f"system: {{coordinates: [{coordinates}], lagrangian: '{lagrangian}'}}\n"
    text += f"parameters: {{{parameters}}}\n" if parameters else ""
    text += f"orbit: {{{orbit}, samples: 6}}\n" if orbit else ""
    return rigidcli.hamilton(rigidcli.loads(text))


def notes(report: Report) -> str:
    return "\n".join(report.notes)


# --- starts from momenta


@pytest.mark.parametrize("p", [0.5, -2.0])
def test_an_orbit_begins_with_momenta_that_have_no_closed_inverse(p: float) -> None:
    found = hamilton(
        "xdot^2/2 + eps*xdot^6/6 - x^2/2", f"initial: {{x: 1, p_x: {p}}}, duration: 3", "eps: 0.1"
    )
    v = brentq(lambda v: v + 0.1 * v**5 - p, -10, 10, xtol=1e-15)
    truth = solve_ivp(
        lambda t, y: (y[1], -y[0] / (1 + 0.5 * y[1] ** 4)),
        (0, 3),
        (1, v),
        "DOP853",
        found["orbit"]["t"],
        rtol=1e-12,
        atol=1e-13,
    )
    assert found["orbit"]["q"]["x"] == pytest.approx(truth.y[0], abs=1e-9)
    assert found["orbit"]["p"]["p_x"][0] == pytest.approx(p, rel=1e-13)
    assert found["hamiltonian"] is None
    assert "no closed form" in notes(found)


def test_two_velocities_follow_from_their_momenta() -> None:
    lagrangian = "xdot^2/2 + ydot^2 + (xdot + ydot)^6/6"
    found = hamilton(lagrangian, "initial: {x: 0, y: 0, p_x: 3, p_y: 4}, duration: 1", coordinates="x, y")
    # Free motion: p_x = v + s^5, p_y = 2 w + s^5, where s = v + w.
    s = brentq(lambda s: (3 - s**5) + (4 - s**5) / 2 - s, 0, 3, xtol=1e-15)
    orbit = found["orbit"]
    assert orbit["q"]["x"] == pytest.approx((3 - s**5) * orbit["t"], abs=1e-11)
    assert orbit["q"]["y"] == pytest.approx((4 - s**5) / 2 * orbit["t"], abs=1e-11)


@pytest.mark.parametrize(
    ("lagrangian", "coordinates", "initial"),
    [
        # The momentum jumps from -1 to 1 where the velocity changes its sign.
        ("xdot^6/6 + xdot^2/2 + abs(xdot)", "x", "p_x: 0.5"),
        ("xdot^2/2 + abs(xdot)", "x", "p_x: 0.5"),
    ],
)
def test_momenta_that_no_velocity_has_are_refused(lagrangian: str, coordinates: str, initial: str) -> None:
    with pytest.raises(DocumentError, match="no velocities were found that have these momenta"):
        hamilton(lagrangian, f"initial: {{x: 0, {initial}}}, duration: 1", coordinates=coordinates)


# --- the branch of an orbit, and its end


def test_an_orbit_begins_with_velocities_that_are_not_alone() -> None:
    # p = v^3/3 - v falls from 2 to 0 on the branch of the largest root.
    start = max(np.roots([1 / 3, 0, -1, -2]).real)
    found = hamilton("xdot^4/12 - xdot^2/2 - x", f"initial: {{x: 0, xdot: {start}}}, duration: 2")
    orbit = found["orbit"]
    for t, p in zip(orbit["t"], orbit["p"]["p_x"], strict=True):
        assert p == pytest.approx(2 - t, abs=1e-11)
    # dx = v dt, and dt = -dp = -(v^2 - 1) dv.
    v = [max(np.roots([1 / 3, 0, -1, -p]).real) for p in (2, 0)]
    travelled = [u**4 / 4 - u**2 / 2 for u in v]
    assert orbit["q"]["x"][-1] == pytest.approx(travelled[0] - travelled[1], abs=1e-10)


@pytest.mark.parametrize(
    ("lagrangian", "v", "end"),
    [
        # p = p0 + t runs into an extremum of p(v), which is at v = -1 or 1.
        ("xdot^4/12 - xdot^2/2 + x", 0.1, 2 / 3 - (0.1**3 / 3 - 0.1)),
        ("xdot^6/30 - xdot^2/2 + x", 0.1, 4 / 5 - (0.1**5 / 5 - 0.1)),
        ("xdot^4/12 - xdot^2/2 - x", 2.0, (8 / 3 - 2) + 2 / 3),
        ("xdot^6/30 - xdot^2/2 - x", 2.0, (32 / 5 - 2) + 4 / 5),
    ],
)
def test_a_mass_that_vanishes_on_the_way_is_told(
    program: Program, lagrangian: str, v: float, end: float
) -> None:
    document = f"system: {{coordinates: [x], lagrangian: {lagrangian}}}\n"
    ended = program(
        "hamilton", "-", stdin=document + f"orbit: {{initial: {{x: 0, xdot: {v}}}, duration: 20}}\n"
    )
    assert ended.code == 4
    time = float(ended.err.split("t = ")[1].split()[0])
    assert time == pytest.approx(end, rel=1e-4)
    before = program(
        "hamilton",
        "-q",
        "-",
        stdin=document + f"orbit: {{initial: {{x: 0, xdot: {v}}}, duration: {0.9 * end}}}\n",
    )
    assert before.code == 0


def test_a_mass_that_only_touches_zero_ends_nothing() -> None:
    # H = 3 p^(4/3)/4 + x^2/2, and at rest the mass 3 v^2 is zero.
    found = hamilton("xdot^4/4 - x^2/2", "initial: {x: 1, p_x: 0}, duration: 2")
    assert found["orbit"]["H"] == pytest.approx(np.full(6, 0.5), rel=1e-6)


def test_an_orbit_from_where_branches_meet_is_refused(program: Program) -> None:
    document = "system: {coordinates: [x], lagrangian: xdot**6/6 - xdot**3/3 + x}\n"
    ended = program("hamilton", "-", stdin=document + "orbit: {initial: {x: 0, xdot: 0}, duration: 1}\n")
    assert ended.code == 4
    assert "t = 0" in ended.err
    assert "Traceback" not in ended.err


def test_velocities_beyond_the_listed_ones_are_followed_themselves() -> None:
    found = hamilton("-cos(xdot)", "initial: {x: 0, xdot: 7}, duration: 1")
    assert found["orbit"]["q"]["x"][-1] == pytest.approx(7)


# --- lists without an orbit


def test_branches_are_listed_with_their_ranges(program: Program) -> None:
    ended = program("hamilton", "-f", "json", "-", stdin="system: {coordinates: [x], lagrangian: tanh(xdot)}")
    branches = json.loads(ended.out)["branches"]
    assert [branch["range"] for branch in branches] == ["0 < p_x < 1"] * 2
    for p in (0.1, 0.5, 0.9):
        found = {round(real(read(branch["xdot"])[0], {"p_x": p}), 9) for branch in branches}
        assert found == {round(side * math.acosh(1 / math.sqrt(p)), 9) for side in (1, -1)}


# --- forms that depend on signs


def test_what_is_assumed_of_signs_is_told() -> None:
    lagrangian = "-m*c^2*sqrt(1 - xdot^2/c^2)"
    free = hamilton(lagrangian, parameters="m: null, c: null")
    assert "m > 0" not in notes(free), "letters are positive"
    negative = hamilton(lagrangian, parameters="m: -2, c: 3")
    assert "m > 0" not in notes(negative)
    assert negative["hamiltonian"].evaluate(m=-2, c=3, p_x=4.0) == pytest.approx(-math.hypot(18, 12))
