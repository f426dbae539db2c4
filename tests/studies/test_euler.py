"""`euler` as a whole: free and driven motion from documents, against the laws and independent solutions."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from rigidcli.core import rotation
from rigidcli.document.load import loads
from rigidcli.report import Report
from rigidcli.studies.euler import run
from tests.conftest import Program
from tests.euler_equations import Floats, Torque, integrated, same_turn
from tests.tables import rows_of

BODY = "body: {moments: [1, 2, 2.5], mass: 1}\nabout: com\n"
TILTED = "body: {inertia: [[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]], mass: 1}\nabout: com\n"
TENSOR = np.array([[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]])
"""That of `TILTED`."""

ROD = "body: {moments: [2, 2, 0]}\nabout: com\n"
TOP = "mass: 1, distance: 0.1, lambda1: 0.02, lambda3: 0.01"


def euler(text: str, **options: Any) -> Report:
    return run(loads(text, **options))


def driven(body: str, torque: str, more: str = "omega: [0, 0, 1], duration: 10") -> Report:
    return euler(f"{body}motion: {{{more}, torque: {torque}}}\n")


def arrays(report: Report) -> dict[str, Floats]:
    return {key: np.asarray(values) for key, values in report["trajectory"].items()}


# --- free


@pytest.mark.parametrize(("body", "tensor"), [(BODY, np.diag([1, 2, 2.5])), (TILTED, TENSOR)])
def test_free_motion_is_that_of_an_independent_integration(body: str, tensor: Floats) -> None:
    report = euler(body + "motion: {omega: [0.5, 2, -0.3], duration: 20, samples: 101}\n")
    found = arrays(report)
    omega, orientation = integrated(tensor, np.array([0.5, 2, -0.3]), found["t"])
    np.testing.assert_allclose(found["omega"], omega, atol=1e-9)
    assert same_turn(found["orientation"], orientation) < 1e-8
    np.testing.assert_allclose(found["angular_momentum"], found["omega"] @ tensor, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(
        found["angular_momentum_space"], np.tile(tensor @ [0.5, 2, -0.3], (101, 1)), atol=3e-14
    )
    assert (report["method"], report["steps"]) == ("closed form", 0)
    assert max(report["drift"].values()) < 1e-14


def test_turns_of_the_frame_turn_body_components_and_orientation_together() -> None:
    text = BODY + "motion: {omega: [0.5, 2, -0.3], duration: 5, samples: 11}\n"
    plain, turned = arrays(euler(text)), arrays(euler(text + "frame: {axis: [1, 2, 3], angle: 1}\n"))
    axes = rotation.from_axis_angle((1, 2, 3), 1.0, loads(BODY).arithmetic)
    np.testing.assert_allclose(turned["omega"], plain["omega"] @ axes, atol=1e-14)
    np.testing.assert_allclose(turned["angular_momentum_space"], plain["angular_momentum_space"], atol=1e-14)
    for name in ("omega", "angular_momentum"):
        first, second = (rotation.turned(found["orientation"], found[name]) for found in (plain, turned))
        np.testing.assert_allclose(first, second, atol=1e-14)


def test_trust_falls_with_time_and_near_the_separatrix() -> None:
    """Each turn adds to what rounding of the inputs does; near the separatrix a flip multiplies it."""
    digits = [
        euler(
            f"body: {{moments: [3, 4, 6]}}\nabout: com\nmotion: {{omega: [2, 1, {w3}], duration: {end}}}\n"
        )["trusted_digits"]
        for w3, end in ((1.5, 10), (1.5, 1e5), (1.000000001, 100))
    ]
    assert digits[0] > 13.5
    assert digits[0] - 5 < digits[1] < digits[0] - 3
    assert digits[2] < digits[0] - 3


def test_few_digits_are_explained_by_the_rounding_of_the_input() -> None:
    text = "body: {moments: [3, 4, 6]}\nabout: com\nmotion: {omega: [2, 0.5, 1], duration: 100, samples: 3}\n"
    report = euler(text)
    assert report["trusted_digits"] == 0
    assert any("rounding of the input" in note for note in report.notes)


def test_axes_of_equal_moments_are_neutral(program: Program) -> None:
    text = "body: {moments: [1, 1, 1.5]}\nabout: com\nmotion: {omega: [1, 0, 3], duration: 1}\n"
    found = json.loads(program("euler", "-q", "-f", "json", "-", stdin=text).out)
    assert [row["stable"] for row in found["stability"]] == [None, None, True]
    assert [row["axis"] for row in found["stability"]] == ["e1", "e2", "e3"]
    lines = program("euler", "-q", "-", stdin=text).out.splitlines()
    assert [line.split()[2] for line in lines if line.split()[:1] in (["e1"], ["e2"], ["e3"])] == [
        "neutral",
        "neutral",
        "yes",
    ]


SWING = 2 * math.sqrt(0.02 / 0.980665) * 2.768063145
"""From end to end of a pendulum, 2 sqrt(lambda1/(M g R)) K(sin(75 deg)): a nutation of a top without spin."""


@pytest.mark.parametrize(
    ("text", "end", "words"),
    [
        (BODY + "motion: {omega: [0, 0, 2]}\n", 10 * math.pi, "10 turns are shown"),
        (BODY + "motion: {omega: [0, 0, 0], torque: {body: [1, 0, 0]}}\n", 1, "1 s is shown"),
        (f"top: {{spin: 0, tilt: 180 deg, {TOP}}}\n", 1, ""),
        (f"top: {{spin: 1e-3, tilt: 30 deg, {TOP}}}\n", 3 * SWING, "3 nutations are shown"),
    ],
)
def test_the_default_time_is_noted(text: str, end: float, words: str) -> None:
    report = euler(text)
    assert arrays(report)["t"][-1] == pytest.approx(end, rel=1e-6)
    assert [words in note for note in report.notes if "duration" in note] == ([True] if words else [])


@pytest.mark.parametrize("more", ["", "torque: {body: [0, 0, 1]}, ", "torque: {gravity: 1}, "])
@pytest.mark.parametrize("sign", [-1, 1])
def test_a_quaternion_keeps_the_sign_that_is_given(more: str, sign: int) -> None:
    body = "body: {moments: [2, 2, 3], mass: 1, com: [0, 0, 0.2], given_about: origin}\n"
    given = sign * np.array([0.5, -0.1, -0.7, -0.3])
    text = body + f"motion: {{omega: [1, 0.2, 0.5], orientation: {{quaternion: {given.tolist()}}}, {more}"
    found = arrays(euler(text + "duration: 3}\n"))["orientation"]
    np.testing.assert_allclose(found[0], given / math.sqrt(0.84), rtol=1e-15)
    assert (np.einsum("ij,ij->i", found[1:], found[:-1]) > 0.99).all()


def test_a_hanging_top_that_only_spins_has_one_angle() -> None:
    """phi - psi is minus the angle of the spin, and phi + psi means nothing: it is zero."""
    found = arrays(euler(f"top: {{spin: 20, tilt: 180 deg, {TOP}}}\nmotion: {{duration: 2}}\n"))
    phi, theta, psi = found["angles"].T
    assert (theta == math.pi).all()
    np.testing.assert_allclose(psi - phi, 20 * found["t"], rtol=1e-13)
    np.testing.assert_array_equal(phi + psi, 0)
    assert (found["angular_momentum_space"][:, :2] == 0).all()


# --- driven


def damping(t: float, q: Floats, w: Floats) -> Floats:
    return np.array([-0.3 * w[0], -0.3 * w[1], 0.05 * t])


def every_variable(t: float, q: Floats, w: Floats) -> Floats:
    third = np.linalg.eigh(TENSOR)[1][:, 2]
    third *= np.sign(third[np.abs(third).argmax()])
    (wx, wy, wz), (ux, uy, uz) = rotation.turned(q, w), rotation.turned(q, third)
    space = [
        0.3 * wx + 0.2 * w[0],
        0.1 * q[0] * q[3] - 0.4 * uy + 0.1 * w[1] * wy,
        0.2 * uz * q[1] - 0.3 * ux + 0.1 * q[2] * wz + 0.05 * w[2] * t,
    ]
    return rotation.turned(q * [1, -1, -1, -1], np.array(space))


@pytest.mark.parametrize(
    ("torque", "by_hand"),
    [
        ('{body: ["-c*w1", "-c*w2", "k*t"]}', damping),
        (
            (
                '{space: ["0.3*wx + 0.2*w1", "0.1*q0*q3 - 0.4*uy + 0.1*w2*wy", '
                '"0.2*uz*q1 - 0.3*ux + 0.1*q2*wz + 0.05*w3*t"]}'
            ),
            every_variable,
        ),
    ],
)
def test_a_torque_of_any_variable_against_scipy(torque: str, by_hand: Torque) -> None:
    report = euler(
        f"parameters: {{c: 0.3, k: 0.05}}\n{TILTED}"
        f"motion: {{omega: [0.5, 2, -0.3], duration: 10, samples: 41, torque: {torque}}}\n"
    )
    found = arrays(report)
    omega, orientation = integrated(TENSOR, np.array([0.5, 2, -0.3]), found["t"], by_hand)
    np.testing.assert_allclose(found["omega"], omega, atol=1e-10)
    assert same_turn(found["orientation"], orientation) < 1e-9
    assert report["motion"] == "driven"
    assert (report["period"], report["flip_interval"], report["mean_space_rate"]) == (None, None, None)
    assert max(report["drift"].values()) < 1e-11


def test_a_driven_motion_at_its_beginning_alone() -> None:
    report = driven(BODY, "{body: [t, 0, 1]}", "omega: [0.3, 2, 0.1], times: [0]")
    assert arrays(report)["omega"].tolist() == [[0.3, 2, 0.1]]
    assert report["drift"] == {"energy": 0, "angular_momentum": 0, "quaternion": 0}


def test_a_top_starts_from_its_section_and_obeys_its_conservation_laws() -> None:
    report = euler(
        f"top: {{spin: 100, tilt: 40 deg, precession: 1, nutation: 0.5, {TOP}}}\nmotion: {{duration: 2}}\n"
    )
    found = arrays(report)
    phi, theta, psi = found["angles"].T
    assert (phi[0], psi[0]) == (0, 0)
    assert theta[0] == pytest.approx(math.radians(40), rel=1e-15)
    dt = found["t"][1]
    assert (theta[1] - theta[0]) / dt == pytest.approx(0.5, abs=5 * dt * 100)
    np.testing.assert_allclose(found["omega"][:, 2], 100, rtol=1e-11)
    vertical = found["angular_momentum_space"][:, 2]
    np.testing.assert_allclose(vertical, vertical[0], rtol=1e-11)
    assert vertical[0] == pytest.approx(
        0.02 * math.sin(theta[0]) ** 2 * 1 + 0.01 * 100 * math.cos(theta[0]), rel=1e-12
    )


@pytest.mark.parametrize("spin", [60, 100, 400])
def test_the_nutation_of_precess_is_that_of_euler(spin: float) -> None:
    from rigidcli.studies.precess import run as precess

    text = f"top: {{spin: {spin}, tilt: 40 deg, precession: 3, {TOP}}}\n"
    told = precess(loads(text))["top"]
    period = told["nutation_period"]
    found = arrays(euler(text + f"motion: {{duration: {10 * period!r}, samples: 4001}}\n"))
    phi, theta, _ = found["angles"].T
    assert theta.min() == pytest.approx(told["theta_min"], abs=1e-6 * (theta.max() - theta.min()))
    assert theta.max() == pytest.approx(told["theta_max"], abs=1e-6 * (theta.max() - theta.min()))
    assert theta[-1] == pytest.approx(theta[0], abs=1e-9)
    assert phi[-1] == pytest.approx(10 * told["precession_per_nutation"], abs=1e-8)


def test_going_back_in_time_by_reversing_omega() -> None:
    """Weight is the same both ways: the end with omega turned round leads to the beginning."""
    body = "body: {shape: box, size: [1, 2, 3], mass: 6, anchor: corner}\n"
    there = arrays(euler(body + "motion: {omega: [1, 2, -1], times: [2], torque: {gravity: 9.81}}\n"))
    omega, q = (-there["omega"][0]).tolist(), there["orientation"][0].tolist()
    start = f"omega: {omega}, orientation: {{quaternion: {q}}}"
    back = arrays(euler(body + f"motion: {{{start}, times: [2], torque: {{gravity: 9.81}}}}\n"))
    np.testing.assert_allclose(back["omega"][0], [-1, -2, 1], atol=1e-9)
    assert same_turn(back["orientation"], np.array([[1.0, 0, 0, 0]])) < 1e-9


@pytest.mark.parametrize(
    ("axis", "angle", "third"),
    [((1, 0, 0), 180, [0, 0, -1]), ((1, 0, 0), 100, [0, 0, 1]), ((0, 1, 0), 20, [0, 0, 1])],
)
def test_ux_uy_uz_are_the_e3_that_is_printed(axis: tuple[int, ...], angle: float, third: list[float]) -> None:
    """For a short time L gains (ux, 2 uy, 3 uz) t in space, e3 being turned back from the results."""
    frame = f"{{axis: {list(axis)}, angle: {angle} deg}}"
    text = f"body: {{moments: [1, 1.8, 2.3]}}\nabout: com\nframe: {frame}\n"
    report = driven(text, '{space: [ux, "2*uy", "3*uz"]}', "omega: [0, 0, 1e-9], times: [1e-6]")
    axes = rotation.from_axis_angle(axis, math.radians(angle), loads(BODY).arithmetic)
    np.testing.assert_allclose(axes @ report["axes"][2], third, atol=1e-15)
    gained = arrays(report)["angular_momentum_space"][0] - [0, 0, 2.3e-9]
    np.testing.assert_allclose(gained, 1e-6 * np.array([1, 2, 3]) * third, atol=1e-17)


def test_an_e3_that_is_not_unique_is_noted_where_it_matters() -> None:
    def noted(moments: str, torque: str) -> bool:
        text = f"body: {{moments: {moments}}}\nabout: com\n"
        return any("e3 is not unique" in note for note in driven(text, torque).notes)

    assert noted("[1, 2, 2]", "{space: [0, uz, 0]}")
    assert noted("[2, 2, 2]", '{body: [0, "0.1*ux", 0]}')
    assert not noted("[1, 1, 2]", "{space: [0, uz, 0]}")
    assert not noted("[1, 2, 2]", "{space: [0, wz, 0]}")


PULSE = "1000*exp(-((t - %s)/0.001)^2)"
"""Its integral is sqrt(pi)."""


@pytest.mark.parametrize(
    ("torque", "middle", "end"),
    [
        (PULSE % 5, 0, math.sqrt(math.pi)),
        (f"{PULSE % 5} - {PULSE % 7.3}/2 + t", 8, math.sqrt(math.pi) / 2 + 50),
        # Three pulses a second, each with 1/(3 pi) of that integral.
        ("1000*exp(-(sin(3*pi*(t - 1/6))/0.001)^2)", 12 / (3 * math.sqrt(math.pi)), 10 / math.sqrt(math.pi)),
    ],
)
def test_a_torque_that_acts_for_a_moment_is_not_stepped_over(torque: str, middle: float, end: float) -> None:
    """The integral of the torque, at 4 s and at 10 s."""
    report = driven(BODY, f'{{body: [0, 0, "{torque}"]}}')
    found = arrays(report)["omega"][[400, 1000], 2]
    np.testing.assert_allclose((found - 1) * 2.5, [middle, end], rtol=1e-6, atol=1e-10)
    assert max(report["drift"].values()) < 1e-10
    assert report.notes == ()


def test_a_short_push_at_an_angle_is_found() -> None:
    # A body in even rotation meets a short push where it has turned by some angle.
    push = '{body: [0, 0, "1000*exp(-((q3 - 0.3)/0.0001)^2)"]}'
    seen = driven(BODY, push, "omega: [0, 0, 1], duration: 1")
    # Its work is the integral of the torque over the angle: that over q3 by 1/2 of q0.
    work = 1000 * 1e-4 * math.sqrt(math.pi) * 2 / math.sqrt(1 - 0.3**2)
    assert arrays(seen)["omega"][-1, 2] == pytest.approx(math.sqrt(1 + 2 * work / 2.5), rel=1e-6)
    assert seen["trusted_digits"] > 5
    assert seen.notes == ()


def test_a_series_needs_no_slope_along_the_axis_of_symmetry() -> None:
    pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    cone = "body: {shape: cone, radius: 0.1, height: 0.3, mass: 4}\n"
    seen = driven(cone, "{gravity: 9.81}", "omega: [1, 2, 30], duration: 2, samples: 9, method: taylor")
    assert seen["method"] == "Taylor (heyoka)"
    rates = arrays(driven(cone, "{gravity: 9.81}", "omega: [1, 2, 30], duration: 2, samples: 9"))["omega"]
    assert arrays(seen)["omega"] == pytest.approx(rates, rel=1e-8, abs=1e-8)
    assert arrays(seen)["omega"][:, 2] == pytest.approx([30.0] * 9, rel=1e-14)


def test_the_method_of_a_motion_is_asked_for() -> None:
    pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    smooth = driven(BODY, '{body: ["sin(t)", 0, "-w3"]}', "omega: [0.3, 2, 0.1], duration: 5, method: taylor")
    assert smooth["method"] == "Taylor (heyoka)"
    pulse = driven(BODY, f'{{body: [0, 0, "{PULSE % 5}"]}}', "omega: [0, 0, 1], duration: 10, method: taylor")
    assert pulse["method"] == "Dormand-Prince 8(5,3)"
    assert arrays(pulse)["omega"][-1, 2] == pytest.approx(1 + math.sqrt(math.pi) / 2.5, rel=1e-9)
    (note,) = pulse.notes
    assert "`taylor` goes over what acts for a moment" in note


@pytest.mark.parametrize("scale", [1e-150, 1, 1e150])
def test_the_balances_of_slow_and_fast_motions_are_the_same(scale: float) -> None:
    text = f"omega: [{0.5 * scale}, {scale}, {-scale}], duration: {3 / scale}, samples: 3"
    damping = ", ".join(f'"-{0.1 * scale}*w{k}"' for k in (1, 2, 3))
    report, unit = (
        driven(BODY, f"{{body: [{damping}]}}", text),
        driven(
            BODY, '{body: ["-0.1*w1", "-0.1*w2", "-0.1*w3"]}', "omega: [0.5, 1, -1], duration: 3, samples: 3"
        ),
    )
    np.testing.assert_allclose(arrays(report)["omega"] / scale, arrays(unit)["omega"], atol=1e-11)
    for drift in (report["drift"], unit["drift"]):
        assert 1e-17 < drift["energy"] < 1e-11
        assert 1e-17 < drift["angular_momentum"] < 1e-11


# --- linear bodies


@pytest.mark.parametrize(
    "torque",
    [
        '{body: ["-0.3*w1", "-0.3*w2", 0]}',
        '{space: ["-0.3*wx", "-0.3*wy", "-0.3*wz"]}',
        '{body: ["-0.3*w1", "-0.3*w2", "-0.3*w3"]}',
    ],
)
def test_a_damped_rod_slows_down_across_its_line(torque: str) -> None:
    found = arrays(driven(ROD, torque, "omega: [0.6, 0.8, 0], duration: 5"))
    slowed = np.exp(-0.15 * found["t"])
    np.testing.assert_allclose(found["omega"], np.outer(slowed, [0.6, 0.8, 0]), atol=1e-12)
    turned = (1 - slowed[-1]) / 0.15
    expected = [math.cos(turned / 2), *(math.sin(turned / 2) * np.array([0.6, 0.8, 0]))]
    assert same_turn(found["orientation"][-1:], np.array([expected])) < 1e-11


def test_the_weight_of_a_rod_in_closed_form_and_integrated() -> None:
    body = "body: {shape: rod, length: 2, mass: 3, anchor: end, axis: [1, 2, 2]}\n"
    motion = "motion: {omega: [2, -1, 0], duration: 2, torque: %s}\n"
    x, y, z = (
        "2*(q1*q3 - q0*q2)",
        "2*(q2*q3 + q0*q1)",
        "(q0^2 - q1^2 - q2^2 + q3^2)",
    )  # the vertical, in the body
    weight = f'["9.81*2*({y} - {z})", "9.81*({z} - 2*{x})", "9.81*(2*{x} - {y})"]'
    closed = arrays(euler(body + motion % "{gravity: 9.81}"))
    integrated = arrays(euler(body + motion % f"{{body: {weight}}}"))
    np.testing.assert_allclose(closed["omega"], integrated["omega"], atol=1e-10)
    assert same_turn(closed["orientation"], integrated["orientation"]) < 1e-10


# --- output


DOCUMENT = BODY + "motion: {omega: [0.5, 2, -0.3], duration: 5}\n"


def test_csv_is_the_trajectory(program: Program) -> None:
    outcome = program("euler", "-f", "csv", "--samples", "3", "-", stdin=DOCUMENT)
    assert outcome.code == 0
    header, *rows = outcome.out.splitlines()
    assert header == "t,w1,w2,w3,L1,L2,L3,T,q0,q1,q2,q3,Lx,Ly,Lz"
    assert rows[0].startswith("0.0,0.5,2.0,-0.3,0.5,4.0,-0.75,4.2375,1.0,0.0,0.0,0.0,")
    assert [row.split(",")[0] for row in rows] == ["0.0", "2.5", "5.0"]
    found = json.loads(program("euler", "-f", "json", "--samples", "3", "-", stdin=DOCUMENT).out)
    assert [float(cell) for cell in rows[1].split(",")[1:4]] == found["trajectory"]["omega"][1]


@pytest.mark.parametrize(
    ("arguments", "words"),
    rows_of(__file__, "a problem names the option that gave the value"),
)
def test_a_problem_names_the_option_that_gave_the_value(
    arguments: list[str], words: str, program: Program
) -> None:
    outcome = program("euler", *arguments, "-", stdin=DOCUMENT)
    assert (outcome.code, outcome.out) == (3, "")
    assert words in outcome.err


# --- angles and names


@pytest.mark.parametrize("sequence", ["zxz", "xyz", "yxz"])
@pytest.mark.parametrize("torque", ["", "torque: {body: [0.5, 0, 0]}, "])
def test_euler_angles_of_any_motion(sequence: str, torque: str, program: Program) -> None:
    start = "omega: [1, 2, 3], orientation: {euler: [1, 2, 3]}, duration: 6, samples: 200"
    text = (
        "body: {shape: box, size: [1, 2, 3], mass: 12}\nframe: {axis: [1, 1, 0], angle: 0.4}\n"
        f"motion: {{{start}, {torque}angles: {sequence}}}\n"
    )
    found = arrays(euler(text))
    by_scipy = Rotation.from_euler(sequence.upper(), found["angles"])
    told = Rotation.from_quat(found["orientation"], scalar_first=True)
    assert (by_scipy.inv() * told).magnitude().max() < 1e-14 * 40
    assert np.abs(np.diff(found["angles"], axis=0)).max() < math.pi
    rows = program("euler", "-q", "-f", "csv", "-", stdin=text).out.splitlines()
    assert rows[0].endswith(",Lx,Ly,Lz,phi,theta,psi")
    assert np.array(rows[-1].split(",")[-3:], float).tolist() == found["angles"][-1].tolist()


def test_people_can_tell_the_axes_of_the_components_from_the_principal_ones(program: Program) -> None:
    text = "body: {shape: box, size: [1, 2, 3], mass: 12}\nmotion: {omega: [1, 2, 3]}\n"
    out = program("euler", "-q", "-", stdin=text).out
    assert "\nprincipal axes e1, e2, e3 (rows)" in out
    assert "\n  e1 " in out
    assert "\nthe motion: 1, 2, 3 are the axes x, y, z of the body, which turn with it\n" in out
    found = json.loads(program("euler", "-q", "-f", "json", "-", stdin=text).out)
    assert [row["axis"] for row in found["stability"]] == ["e1", "e2", "e3"]
