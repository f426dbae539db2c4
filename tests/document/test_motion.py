"""The sections `motion`, `top` and `tide` as they are read and refused."""

from __future__ import annotations

import numpy as np
import pytest

from rigidcli.document.document import Document
from rigidcli.document.load import loads
from tests.refusals import told

BODY = "body: {moments: [1, 2, 2.5], mass: 1}\n"
TOP = "mass: 1, distance: 0.1, lambda1: 0.05, lambda3: 0.02"


def motion(text: str) -> Document:
    return loads(f"{BODY}motion: {{omega: [0, 0, 1], {text}}}\n")


# --- samples


@pytest.mark.parametrize(
    ("text", "times"),
    [
        ("duration: 2, samples: 5", [0, 0.5, 1, 1.5, 2]),
        ("duration: 2, step: 0.5", [0, 0.5, 1, 1.5, 2]),
        ("duration: 2, step: 0.75", [0, 0.75, 1.5]),
        ("duration: 0.3, step: 0.1", [0, 0.1, 0.2, 0.3]),
        ("times: [0.5, 1 s, 1 min]", [0.5, 1, 60]),
    ],
)
def test_times_of_the_samples(text: str, times: list[float]) -> None:
    section = motion(text).motion
    assert section is not None
    np.testing.assert_allclose(section.instants(7.0), times, rtol=1e-15)


def test_the_end_is_hit_exactly_by_repeated_steps() -> None:
    section = motion("duration: 0.7, step: 0.1").motion
    assert section is not None
    assert section.instants(1.0)[-1] == 0.7
    assert len(section.instants(1.0)) == 8


@pytest.mark.parametrize("samples", ["3", "3.0", "2 + 1", '"3"', "1.5e0*2"])
def test_a_number_of_samples_that_is_whole(samples: str) -> None:
    section = motion(f"duration: 1, samples: {samples}").motion
    assert section is not None
    assert section.instants(1.0).tolist() == [0, 0.5, 1]


@pytest.mark.parametrize("samples", ["3.5", "7/2", "[3]", "true", "3 s", "1e400"])
def test_a_number_of_samples_that_is_not(samples: str) -> None:
    key, words = told(f"{BODY}motion: {{omega: [0, 0, 1], duration: 1, samples: {samples}}}\n")
    assert key == "motion.samples"
    assert "Input" not in words
    assert "number" in words or "unit" in words


def test_the_default_is_1001_samples_of_the_given_duration() -> None:
    section = loads(f"{BODY}motion: {{omega: [0, 0, 1]}}\n").motion
    assert section is not None
    times = section.instants(5.0)
    assert len(times) == 1001
    assert (times[0], times[-1]) == (0.0, 5.0)


@pytest.mark.parametrize(
    ("text", "key", "words"),
    [
        ("duration: -1", "motion.duration", "positive time"),
        ("duration: 1 kg", "motion.duration", "time"),
        ("duration: 1, step: 0", "motion.step", "positive time"),
        ("step: 0.1", "motion.duration", "missing"),
        ("duration: 1, step: 2", "motion.step", "steps in the duration"),
        ("duration: 1, step: 1e-12", "motion.step", "steps in the duration"),
        ("duration: 1, samples: 1", "motion.samples", "from 2 to"),
        ("duration: 1, samples: 2000000000", "motion.samples", "from 2 to"),
        ("duration: 1, samples: 10, step: 0.1", "motion", "at most one"),
        ("times: []", "motion.times", "empty"),
        ("times: [0, 2, 1]", "motion.times.2", "ascending"),
        ("times: [0, 1, 1]", "motion.times.2", "ascending"),
        ("times: [-1, 1]", "motion.times.0", "not negative"),
        ("times: [0, 1], duration: 3", "motion.duration", "not both"),
        ("tolerance: 0", "motion.tolerance", "1e-15"),
        ("tolerance: 0.1", "motion.tolerance", "0.001"),
        ("orientation: {axis: [0, 0, 0], angle: 1}", "motion.orientation", "direction"),
    ],
)
def test_what_is_refused(text: str, key: str, words: str) -> None:
    found, message = told(f"{BODY}motion: {{omega: [0, 0, 1], {text}}}\n")
    assert found == key
    assert words in message


# --- torques


def test_a_torque_may_use_the_motion_and_the_parameters() -> None:
    document = loads(
        f"parameters: {{c: 0.1, k: 2*c}}\n{BODY}"
        'motion: {omega: [0, 0, 1], torque: {body: [0, 1 N cm, "-c*w3 + k*sin(t)*ux*q0*wx"]}}\n'
    )
    assert document.motion is not None
    first, second, third = document.motion.torque.body  # type: ignore[union-attr]
    assert first.constants == {"value": 0.0}
    assert second.constants == {"value": 0.01}
    assert third.constants == {"c": 0.1, "k": 0.2}
    assert document.notes == ()


@pytest.mark.parametrize(
    ("torque", "key", "words"),
    [
        ('{body: [0, 0, "-c*w33"]}', "motion.torque.body.2", "did you mean w3?"),
        ('{body: [0, 0, "-zeta*w3"]}', "motion.torque.body.2", "variables here: t, w1, w2, w3, wx"),
        ("{body: [0, 0, 1 kg]}", "motion.torque.body.2", "energy"),
        ("{gravity: -9.81}", "motion.torque.gravity", "nonnegative"),
        ("{gravity: 9.81, body: [0, 0, 1]}", "motion.torque", "exactly one"),
        ("{weight: 9.81}", "motion.torque", "exactly one of body, space, gravity"),
    ],
)
def test_torques_that_are_refused(torque: str, key: str, words: str) -> None:
    text = f"{BODY}parameters: {{c: 1}}\nmotion: {{omega: [0, 0, 1], torque: {torque}}}\n"
    found, message = told(text)
    assert found == key
    assert words in message


def test_a_parameter_cannot_hide_a_variable() -> None:
    _, message = told(
        f'{BODY}parameters: {{w3: 1}}\nmotion: {{omega: [0, 0, 1], torque: {{body: [0, 0, "-w3"]}}}}\n'
    )
    assert "rename the parameter" in message


# --- tops


def test_a_top_may_describe_itself() -> None:
    top = loads(f"top: {{spin: 10, tilt: 30 deg, {TOP}}}\n").physical.heavy_top
    assert (top.mass, top.distance, top.lambda1, top.lambda3) == (1, 0.1, 0.05, 0.02)
    assert top.axis.tolist() == [0, 0, 1]


def test_a_body_is_a_top_about_its_own_axis_wherever_that_points() -> None:
    """A cone about its tip: 3 M R^2/10 about the axis, 3 M (R^2 + 4 h^2)/20 across."""
    top = loads(
        "body: {shape: cone, radius: 0.3, height: 1, mass: 2, axis: [1, 2, -2]}\ntop: {spin: 1, tilt: 1}\n"
    ).physical.heavy_top
    assert top.axis == pytest.approx(np.array([1, 2, -2]) / 3, abs=1e-15)
    assert top.distance == pytest.approx(0.75, rel=1e-14)
    assert top.lambda3 == pytest.approx(0.6 * 0.09, rel=1e-13)
    assert top.lambda1 == pytest.approx(0.3 * (0.09 + 4), rel=1e-14)


def test_a_top_held_at_its_centre_of_mass_has_no_lever() -> None:
    top = loads(
        "body: {shape: disk, radius: 1, mass: 4}\nabout: com\ntop: {spin: 1, tilt: 1}\n"
    ).physical.heavy_top
    assert (top.distance, top.lambda1, top.lambda3) == (0, 1, 2)
    assert abs(top.axis[2]) == 1


@pytest.mark.parametrize(
    ("top", "key", "words"),
    [
        ("spin: 1, tilt: 181 deg, " + TOP, "top.tilt", "0 to 180 deg"),
        ("tilt: 1, " + TOP, "top.spin", "missing"),
        ("spin: 5 Hz, " + TOP, "top.spin", ""),
        ("spin: 1, gravity: -1, " + TOP, "top.gravity", "nonnegative"),
        ("spin: 1, precession: fast, " + TOP, "top.precession", "fast"),
        ("spin: 1, mass: 1, distance: 1, lambda1: 0.9, lambda3: 0.1", "top.lambda1", "mass distance^2"),
        ("spin: 1, mass: 1, distance: 0.1, lambda1: 1, lambda3: 2.1", "top.lambda3", "2 lambda1"),
        ("spin: 1", "top.mass", "or a `body`"),
    ],
)
def test_tops_that_are_refused(top: str, key: str, words: str) -> None:
    found, message = told(f"top: {{{top}}}\n")
    assert found == key
    assert words in message


def test_a_body_that_is_not_symmetric_is_no_top() -> None:
    key, message = told(
        "body: {shape: box, size: [1, 2, 3], mass: 1, position: [0, 0, 2]}\ntop: {spin: 1, tilt: 1}\n"
    )
    assert key == "top"
    assert "not symmetric" in message
    assert "`euler`" in message


def test_a_body_and_a_description_of_its_own_contradict() -> None:
    key, message = told(
        "body: {shape: cone, radius: 1, height: 1, mass: 1}\ntop: {spin: 1, tilt: 1, lambda3: 2}\n"
    )
    assert key == "top.lambda3"
    assert "one or the other" in message


def test_moments_that_no_body_has_about_its_centre_are_noted_not_refused() -> None:
    """A disc of no thickness on a massless rod, its own transverse moment left out: common in problems."""
    top = loads("top: {spin: 1, mass: 1, distance: 1, lambda1: 1.2, lambda3: 0.5}\n").physical.heavy_top
    assert "lambda3 > 2 (lambda1 - M R^2)" in top.remarks[0]


# --- tides


MOON = "perturbers: [{name: moon, gm: 4.9e12, distance: 3.84e8}]"


@pytest.mark.parametrize(
    ("tide", "key", "words"),
    [
        (f"spin: 0, ellipticity: 0.003, {MOON}", "spin", "spins"),
        (f"obliquity: 200 deg, ellipticity: 0.003, {MOON}", "obliquity", "180"),
        (f"ellipticity: 1.5, {MOON}", "ellipticity", "up to 1/2"),
        (MOON, "", "expected exactly one"),
        ("ellipticity: 0.003, perturbers: []", "perturbers", "at least 1"),
        (f"moments: [1, 1, 3], {MOON}", "moments.2", "no body"),
        (
            "ellipticity: 0, perturbers: [{gm: 1, distance: 9, eccentricity: 1}]",
            "perturbers.0.eccentricity",
            "below 1",
        ),
        (
            "ellipticity: 0, perturbers: [{gm: 1, distance: 9, inclination: 5.1}]",
            "perturbers.0.inclination",
            "180 deg",
        ),
        ("ellipticity: 0, perturbers: [{gm: 1, mass: 1, distance: 1}]", "perturbers.0", "exactly one"),
    ],
)
def test_tides_that_are_refused(tide: str, key: str, words: str) -> None:
    usual = [entry for entry in ("obliquity: 0.4", "spin: 1") if entry.partition(" ")[0] not in tide]
    found, message = told(f"tide: {{{', '.join([*usual, tide])}}}\n")
    assert found == f"tide.{key}".rstrip(".")
    assert words in message
