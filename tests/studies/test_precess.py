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
from rigidcli.errors import DocumentError
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


def test_without_tilt_and_lambda1_the_gyroscopic_rate_is_all_there_is() -> None:
    report = precess(f"top: {{spin: 20 rev/s, gravity: 9.8, {DISC}}}\n")
    found = report["top"]
    assert found["gyroscopic_rate"] == pytest.approx(0.3 * 9.8 * 0.05 / (3.75e-4 * 40 * math.pi), rel=1e-14)
    for key in ("tilt", "torque", "slow_rate", "sleeping", "nutation_kind", "theta_min"):
        assert found[key] is None
    assert any("`top.tilt` is not given" in note for note in report.notes)
    assert any("`top.lambda1` is not given" in note for note in report.notes)


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
    for spin in (1e9, 1e18, 1e40, -1e80):
        found = top(f"spin: {spin}, {fast}")["mean_precession_rate"]
        assert found == pytest.approx(9.80665 / spin, rel=1e-12, abs=0)
    # Without weight the axis goes round L, and not round the vertical beside it.
    free_top = f"spin: 1, gravity: 0, nutation: 1, {fast}"
    assert top(free_top)["mean_precession_rate"] == top(free_top)["precession_per_nutation"] == 0


def test_no_spin_leaves_the_gyroscopic_rate_null_where_something_else_can_be_told() -> None:
    found = top(f"spin: 0, tilt: 1, {DISC}, lambda1: 1.1e-3")
    assert found["gyroscopic_rate"] is None
    assert found["gyroscopic_period"] is None
    assert found["theta_max"] > 3.0


@pytest.mark.parametrize("more", ["", ", tilt: 1", ", lambda1: 1.1e-3"])
def test_no_spin_is_refused_where_nothing_else_could_be_told(more: str) -> None:
    with pytest.raises(DocumentError, match=r"top\.spin: read zero"):
        top(f"spin: 0, {DISC}{more}")


# --- free precession


def test_a_symmetric_body_by_the_textbook() -> None:
    """L. Landau, E. Lifshitz, Mechanics, section 33: space rate L/lambda1; section 36: body rate."""
    found = free("[2, 2, 3]", "[0.3, 0.4, 2]")
    momentum = math.hypot(1, 6)
    assert found["angular_momentum"] == pytest.approx(momentum, rel=1e-15)
    assert found["kinetic_energy"] == pytest.approx((2 * 0.25 + 3 * 4) / 2, rel=1e-15)
    assert found["body_rate"] == pytest.approx((3 - 2) / 2 * 2, rel=1e-15)
    assert found["body_period"] == pytest.approx(2 * math.pi, rel=1e-15)
    assert found["space_rate"] == pytest.approx(momentum / 2, rel=1e-15)
    assert found["spin_rate"] == pytest.approx(-1, rel=1e-15)
    assert found["body_cone_angle"] == pytest.approx(math.atan2(0.5, 2), rel=1e-15)
    assert found["axis_angle"] == pytest.approx(math.atan2(1, 6), rel=1e-15)
    assert found["space_cone_angle"] == pytest.approx(math.atan2(0.5, 2) - math.atan2(1, 6), rel=1e-13)
    assert found["polhode_period"] is None


def test_of_a_prolate_body_e3_is_its_axis_and_the_body_rate_is_negative() -> None:
    report = precess("body: {moments: [1, 4, 4]}\nabout: com\nmotion: {omega: [3, 0, 0.1]}\n")
    assert report["free"]["body_rate"] == pytest.approx((1 - 4) / 4 * 3, rel=1e-15)
    assert any("e1" in note for note in report.notes)


@pytest.mark.parametrize("spin", ["1e-6", "0.1", "-0.5", "3"])
@pytest.mark.parametrize("tilt", ["90 deg", "pi/2"])
def test_a_horizontal_top_that_is_to_be_steady_is(spin: str, tilt: str) -> None:
    found = top(f"{DISC}, lambda1: 9e-4, spin: {spin}, tilt: {tilt}, precession: steady")
    assert found["nutation_kind"] == "steady"
    assert found["theta_min"] == found["theta_max"] == math.pi / 2
    assert found["mean_precession_rate"] == found["slow_rate"]


def test_omega_along_the_principal_axes_or_the_axes_of_a_frame_is_the_same_motion() -> None:
    body = "body: {inertia: [[2, 1, 0], [1, 3, 0], [0, 0, 4]]}\nabout: com\n"
    along = precess(body + "motion: {omega: [1, 2, 3], basis: principal}\n")["free"]
    turned = precess(
        body + "frame: {axis: [1, 2, 3], angle: 1}\nmotion: {omega: [1, 2, 3], basis: principal}\n"
    )["free"]
    assert along["kinetic_energy"] == pytest.approx(turned["kinetic_energy"], rel=1e-13)
    moments = along["moments"]
    assert along["kinetic_energy"] == pytest.approx(moments @ [1, 4, 9] / 2, rel=1e-13)


def test_a_torque_is_left_aside_with_a_note() -> None:
    report = precess(
        "body: {moments: [1, 1, 2]}\nabout: com\nmotion: {omega: [0, 1, 1], torque: {body: [0, 0, 1]}}\n"
    )
    assert any("torque" in note for note in report.notes)


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


@pytest.mark.parametrize("exact", [False, True])
@pytest.mark.parametrize("moments", ["[0, 1, 1]", "[0, 0, 0]"])
def test_turning_about_an_axis_without_a_moment_is_refused_as_in_euler(moments: str, exact: bool) -> None:
    from rigidcli.studies.euler import run as euler

    text = f"body: {{moments: {moments}}}\nabout: com\nmotion: {{omega: [1, 0.5, 0]}}\n"
    with pytest.raises(DocumentError) as caught:
        precess(text, exact=exact)
    with pytest.raises(DocumentError) as other:
        euler(loads(text))
    assert str(caught.value) == str(other.value)
    (problem,) = caught.value.problems
    assert (problem.key, problem.line) == ("motion.omega", 3)


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


def test_a_planet_may_be_prolate() -> None:
    planet = "obliquity: 23 deg, spin: 7e-5, perturbers: [{gm: 1, distance: 10}]"
    by_moments = precess(f"tide: {{moments: [5, 5, 2], {planet}}}\n")["tide"]["rate"]
    by_ellipticity = precess(f"tide: {{ellipticity: -1.5, {planet}}}\n")["tide"]["rate"]
    assert by_ellipticity == pytest.approx(by_moments, rel=1e-14)
    assert by_ellipticity < 0
    with pytest.raises(DocumentError, match="up to 1/2"):
        precess(f"tide: {{ellipticity: 0.6, {planet}}}\n")


def test_a_rod_cannot_spin_about_itself() -> None:
    rod = "body: {shape: rod, length: 2, mass: 3, anchor: end}\n"
    with pytest.raises(DocumentError, match="linear") as caught:
        precess(rod + "top: {spin: 5, tilt: 1}\n")
    assert caught.value.problems[0].key == "top.spin"
    assert precess(rod + "top: {spin: 0, tilt: 1}\n")["top"]["theta_min"] is not None


def test_an_upright_orbit_plane_gives_no_precession_and_no_period() -> None:
    report = precess(
        "tide: {obliquity: 90 deg, spin: 1, ellipticity: 0.1, perturbers: [{gm: 1, distance: 10}]}\n"
    )
    assert report["tide"]["rate"] == 0
    assert report["tide"]["period_years"] is None
    assert any("infinite" in note for note in report.notes)


# --- the whole


def test_a_document_that_does_not_precess_is_refused() -> None:
    with pytest.raises(DocumentError, match="nothing here precesses"):
        precess("body: {moments: [1, 1, 2]}\nabout: com\n")


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


def test_symbols_give_formulas(program: Program) -> None:
    document = (
        "parameters: {M: null, R: null, g: null, w: null, I: null}\n"
        "top: {mass: M, distance: R, gravity: g, spin: w, lambda3: I}\n"
    )
    found = json.loads(program("precess", "-q", "-f", "json", "-", stdin=document).out)["top"]
    assert found["gyroscopic_rate"] == "M*g*R/(I*w)"
    assert found["gyroscopic_period"].count("abs") == 1
    assert "1/" not in found["gyroscopic_period"]
    assert found["spin"] == "w"


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
