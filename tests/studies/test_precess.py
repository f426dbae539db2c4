"""`precess` as a whole: what each section of a document answers, and what is refused or null."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from rigidcli.algebra.expressions import Expr
from rigidcli.document.load import loads
from rigidcli.report import Report
from rigidcli.studies.precess import run
from tests.conftest import Program
from tests.exact import numeric

DISC = "mass: 0.3, distance: 0.05, lambda3: 3.75e-4"


def precess(text: str, **options: Any) -> Report:
    return run(loads(text, **options))


def top(text: str) -> Any:
    return precess(f"top: {{{text}}}\n")["top"]


def free(moments: str, omega: str, more: str = "") -> Any:
    return precess(f"body: {{moments: {moments}}}\nabout: com\nmotion: {{omega: {omega}{more}}}\n")["free"]


# --- tops


@given(tilt=st.floats(0.01, 3.13))
@example(tilt=0.0)
def test_the_gyroscopic_rate_does_not_depend_on_the_tilt_while_the_torque_does(tilt: float) -> None:
    found = top(f"spin: 100, tilt: {tilt}, {DISC}, lambda1: 1.1e-3")
    assert found["gyroscopic_rate"] == pytest.approx(0.3 * 9.80665 * 0.05 / 3.75e-2, rel=1e-14)
    arm, weight = 0.05 * np.array([math.sin(tilt), 0, math.cos(tilt)]), np.array([0, 0, -0.3 * 9.80665])
    assert found["torque"] == pytest.approx(np.cross(arm, weight), rel=1e-14)
    assert found["torque_magnitude"] == pytest.approx(np.linalg.norm(found["torque"]), rel=1e-15)


def test_a_top_that_is_too_slow_has_complex_roots_and_is_told_the_spin_it_needs() -> None:
    report = precess("top: {spin: 1, tilt: 30 deg, mass: 1, distance: 0.1, lambda1: 0.02, lambda3: 0.01}\n")
    found = report["top"]
    assert (found["slow_rate"], found["fast_rate"]) == (None, None)
    assert [root["im"] for root in found["complex_roots"]] == sorted(
        root["im"] for root in found["complex_roots"]
    )
    needed = found["minimum_spin"]
    assert needed == pytest.approx(2 * math.sqrt(0.02 * 0.980665 * math.cos(math.pi / 6)) / 0.01, rel=1e-13)
    faster = "top: {spin: %r, tilt: 30 deg, mass: 1, distance: 0.1, lambda1: 0.02, lambda3: 0.01}\n"
    assert precess(faster % (needed * 1.0001))["top"]["slow_rate"] is not None
    assert precess(faster % (needed * 0.9999))["top"]["slow_rate"] is None


def test_steady_precession_begun_with_its_own_rate_stays_steady() -> None:
    text = "spin: 500, tilt: 50 deg, mass: 1, distance: 0.1, lambda1: 0.02, lambda3: 0.01"
    for start in ("steady", "null"):
        found = top(f"{text}, precession: {start}")
        assert found["nutation_kind"] == "steady"
        assert found["theta_min"] == found["theta_max"] == pytest.approx(math.radians(50), rel=1e-15)
        assert found["mean_precession_rate"] == pytest.approx(found["slow_rate"], rel=1e-12)
    assert top(text)["nutation_kind"] == "cuspidal"


def test_the_mean_precession_of_the_fastest_tops_and_of_one_without_weight() -> None:
    fast = "mass: 1, distance: 1, lambda1: 2, lambda3: 1, tilt: 0.5"
    # A fast top that starts from rest precesses at M g R/(lambda3 spin) on the average.
    for spin in (1e9, -1e80):
        found = top(f"spin: {spin}, {fast}")["mean_precession_rate"]
        assert found == pytest.approx(9.80665 / spin, rel=1e-12, abs=0)
    # Without weight the axis goes round L, and not round the vertical beside it.
    free_top = f"spin: 1, gravity: 0, nutation: 1, {fast}"
    assert top(free_top)["mean_precession_rate"] == top(free_top)["precession_per_nutation"] == 0


# --- free precession


@pytest.mark.parametrize("spin", ["1e-6", "-0.5"])
def test_a_horizontal_top_that_is_to_be_steady_is(spin: str) -> None:
    found = top(f"{DISC}, lambda1: 9e-4, spin: {spin}, tilt: 90 deg, precession: steady")
    assert found["nutation_kind"] == "steady"
    assert found["theta_min"] == found["theta_max"] == math.pi / 2
    assert found["mean_precession_rate"] == found["slow_rate"]


@pytest.mark.parametrize("moments", ["[A, A, C]", "[C, A, A]", "[A, C, A]"])
def test_two_equal_symbols_leave_the_odd_one_for_the_axis(moments: str) -> None:
    """L. Landau, E. Lifshitz, Mechanics, sections 33 and 36, whichever of the moments is larger."""
    place = moments.strip("[]").split(", ").index("C")
    omega = ["u", "0", "0"] if place else ["0", "u", "0"]
    omega[place] = "w"
    text = f"body: {{moments: {moments}}}\nabout: com\nmotion: {{omega: [{', '.join(omega)}]}}\n"
    symbols = precess("parameters: {A: null, C: null, u: null, w: null}\n" + text)["free"]
    for a, c in ((2, 3), (3, 2)):
        values = {"A": a, "C": c, "u": 0.5, "w": 2}

        def at(key: str, values: dict[str, float] = values) -> float:
            return float(symbols[key].evaluate(**{s: values[s] for s in symbols[key].names}))

        assert at("body_rate") == pytest.approx((c - a) / a * 2, rel=1e-14)
        assert at("space_rate") == pytest.approx(math.hypot(a * 0.5, c * 2) / a, rel=1e-14)
        assert at("axis_angle") == pytest.approx(math.atan2(a * 0.5, c * 2), rel=1e-14)
        assert at("body_cone_angle") == pytest.approx(math.atan2(0.5, 2), rel=1e-14)


# --- tides


def test_perturbers_add_up() -> None:
    text = (
        "tide: {obliquity: 23.4 deg, spin: 7.29e-5, ellipticity: 0.0033, perturbers: ["
        "{name: moon, gm: 4.9e12, distance: 384000 km}, {mass: 1.99e30, distance: 1.496e11}]}\n"
    )
    found = precess(text)["tide"]
    rates = [each["rate"] for each in found["perturbers"]]
    assert found["rate"] == pytest.approx(sum(rates), rel=1e-15)
    assert [each["name"] for each in found["perturbers"]] == ["moon", "2"]
    year = 365.25 * 86400
    assert found["rate_arcsec_per_year"] == pytest.approx(
        math.degrees(found["rate"] * year) * 3600, rel=1e-14
    )
    assert found["period_years"] == pytest.approx(2 * math.pi / found["rate"] / year, rel=1e-14)


# --- the whole


def test_only_the_sections_that_apply_are_in_json_and_all_columns_in_csv(program: Program) -> None:
    document = f"top: {{spin: 100, {DISC}}}\n"
    found = json.loads(program("precess", "-q", "-f", "json", "-", stdin=document).out)
    assert "free" not in found
    assert "tide" not in found
    header, row = program("precess", "-q", "-f", "csv", "-", stdin=document).out.splitlines()
    columns = dict(zip(header.split(","), row.split(","), strict=True))
    assert columns["top.gyroscopic_rate"] == repr(found["top"]["gyroscopic_rate"])
    assert columns["free.body_rate"] == columns["tide.rate"] == columns["top.tilt"] == ""
    assert list(columns)[:2] == ["name", "top.mass"]


def test_exact_results_are_the_floating_ones() -> None:
    text = (
        "body: {shape: cone, radius: 1/4, height: 1, mass: 2}\n"
        "top: {spin: 100, tilt: pi/3, gravity: 10}\nmotion: {omega: [0, 3, 4]}\n"
    )
    floating, exact = precess(text), precess(text, exact=True)
    for section in ("top", "free"):
        for key, value in exact[section].items():
            if isinstance(value, Expr | np.ndarray):
                assert numeric(value) == pytest.approx(floating[section][key], rel=1e-13), key
    assert exact["top"]["theta_min"] is None
    assert any("elliptic" in note for note in exact.notes)
