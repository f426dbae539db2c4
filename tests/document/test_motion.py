"""The sections `motion`, `top` and `tide` as they are read and refused."""

from __future__ import annotations

import numpy as np
import pytest

from rigidcli.document.document import Document
from rigidcli.document.load import loads

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


def test_the_default_is_1001_samples_of_the_given_duration() -> None:
    section = loads(f"{BODY}motion: {{omega: [0, 0, 1]}}\n").motion
    assert section is not None
    times = section.instants(5.0)
    assert len(times) == 1001
    assert (times[0], times[-1]) == (0.0, 5.0)


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


def test_moments_that_no_body_has_about_its_centre_are_noted_not_refused() -> None:
    """A disc of no thickness on a massless rod, its own transverse moment left out: common in problems."""
    top = loads("top: {spin: 1, mass: 1, distance: 1, lambda1: 1.2, lambda3: 0.5}\n").physical.heavy_top
    assert "lambda3 > 2 (lambda1 - M R^2)" in top.remarks[0]
