"""`euler` as a whole: free and driven motion from documents, against the laws and independent solutions."""

from __future__ import annotations

import json
import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rigidcli.core import rotation
from rigidcli.errors import ComputationError, DocumentError, UsageError
from rigidcli.model.load import loads
from rigidcli.report import Report
from rigidcli.studies.euler import run
from tests.conftest import Program

Floats = NDArray[np.float64]

BODY = "body: {moments: [1, 2, 2.5], mass: 1}\nabout: com\n"
TILTED = "body: {inertia: [[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]], mass: 1}\nabout: com\n"
TOP = "mass: 1, distance: 0.1, lambda1: 0.02, lambda3: 0.01"


def euler(text: str, **options: Any) -> Report:
    return run(loads(text, **options))


def arrays(report: Report) -> dict[str, Floats]:
    return {key: np.asarray(values) for key, values in report["trajectory"].items()}


def integrated(tensor: Floats, omega: Floats, times: Floats, torque: Any = None) -> Floats:
    """q and omega (n, 7) by scipy, in omega and not in L, with a torque(t, q, omega) along body axes."""
    inverse = np.linalg.inv(tensor)

    def rate(t: float, y: Floats) -> Floats:
        q, w = y[:4] / np.linalg.norm(y[:4]), y[4:]
        turning = rotation.compose(q, np.array([0, *w])) / 2
        acting = np.zeros(3) if torque is None else torque(t, q, w)
        return np.concatenate([turning, inverse @ (acting - np.cross(w, tensor @ w))])

    start = np.concatenate([[1.0, 0, 0, 0], omega])
    solved = solve_ivp(rate, (0, times[-1]), start, "DOP853", times, rtol=1e-13, atol=1e-13)
    assert solved.success
    result: Floats = solved.y.T
    return result


def same_turn(q: Floats, p: Floats) -> float:
    """The largest angle between orientations (rad)."""
    return float(2 * np.linalg.norm(rotation.compose(q * [1, -1, -1, -1], p)[:, 1:], axis=1).max())


# --- free


@pytest.mark.parametrize("body", [BODY, TILTED], ids=["principal", "tilted"])
def test_free_motion_is_that_of_an_independent_integration(body: str) -> None:
    report = euler(body + "motion: {omega: [0.5, 2, -0.3], duration: 20, samples: 101}\n")
    found = arrays(report)
    tensor = (
        np.diag([1, 2, 2.5]) if body == BODY else np.array([[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]])
    )
    expected = integrated(tensor, np.array([0.5, 2, -0.3]), found["t"])
    np.testing.assert_allclose(found["omega"], expected[:, 4:], atol=1e-9)
    assert same_turn(found["orientation"], expected[:, :4]) < 1e-8
    np.testing.assert_allclose(found["angular_momentum"], found["omega"] @ tensor, rtol=1e-13, atol=1e-13)
    np.testing.assert_allclose(
        found["angular_momentum_space"], np.tile(tensor @ [0.5, 2, -0.3], (101, 1)), atol=3e-14
    )
    assert (report["method"], report["steps"]) == ("closed form", 0)
    assert max(report["drift"].values()) < 1e-14


def test_the_beginning_is_what_the_document_says() -> None:
    found = arrays(
        euler(
            BODY + "motion: {omega: [0.1, 2, -0.3], orientation: {axis: [1, 2, 2], angle: 1}, duration: 1}\n"
        )
    )
    assert found["omega"][0].tolist() == [0.1, 2, -0.3]
    expected = [math.cos(0.5), *math.sin(0.5) * np.array([1, 2, 2]) / 3]
    np.testing.assert_allclose(found["orientation"][0], expected, atol=1e-15)


@pytest.mark.parametrize(
    ("moments", "omega", "kind"),
    [
        ("[1, 2, 2.5]", "[0, 0, 0]", "rest"),
        ("[2, 2, 2]", "[1, 2, 3]", "sphere"),
        ("[1, 2, 2.5]", "[0, 2, 0]", "principal"),
        ("[1, 1, 1.5]", "[1, 0, 2]", "oblate"),
        ("[1, 2, 2]", "[1, 0, 2]", "prolate"),
        ("[0, 2, 2]", "[0, 1, 2]", "linear"),
        ("[1, 2, 2.5]", "[2, 0.1, 0.1]", "about_lowest"),
        ("[1, 2, 2.5]", "[0.1, 0.1, 2]", "about_highest"),
        ("[3, 4, 6]", "[2, 1, 1]", "separatrix"),
    ],
)
def test_kinds_of_motion(moments: str, omega: str, kind: str) -> None:
    report = euler(f"body: {{moments: {moments}}}\nabout: com\nmotion: {{omega: {omega}}}\n")
    assert report["motion"] == kind
    assert (report["period"] is not None) == (kind in ("oblate", "prolate", "about_lowest", "about_highest"))
    assert (report["flip_interval"] is not None) == kind.startswith("about_")
    if report["flip_interval"] is not None:
        assert report["flip_interval"] == report["period"] / 2


def test_turns_of_the_frame_turn_body_components_and_orientation_together() -> None:
    text = BODY + "motion: {omega: [0.5, 2, -0.3], duration: 5, samples: 11}\n"
    plain, turned = arrays(euler(text)), arrays(euler(text + "frame: {axis: [1, 2, 3], angle: 1}\n"))
    axes = rotation.from_axis_angle((1, 2, 3), 1.0, loads(BODY).arithmetic)
    np.testing.assert_allclose(turned["omega"], plain["omega"] @ axes, atol=1e-14)
    np.testing.assert_allclose(turned["angular_momentum_space"], plain["angular_momentum_space"], atol=1e-14)
    for name in ("omega", "angular_momentum"):
        first, second = (rotation.turned(found["orientation"], found[name]) for found in (plain, turned))
        np.testing.assert_allclose(first, second, atol=1e-14)


def test_omega_along_principal_axes() -> None:
    found = arrays(euler(TILTED + "motion: {omega: [0, 0, 2], basis: principal, duration: 3, samples: 4}\n"))
    np.testing.assert_allclose(found["omega"], np.tile(found["omega"][0], (4, 1)), atol=1e-15)
    tensor = np.array([[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]])
    np.testing.assert_allclose(tensor @ found["omega"][0], np.linalg.eigvalsh(tensor)[2] * found["omega"][0])


@pytest.mark.parametrize("scale", [2e-158, 1e-30, 1e30])
def test_slow_and_fast_motions_are_the_same_in_their_own_time(scale: float) -> None:
    report = euler(
        BODY
        + f"motion: {{omega: [{0.5 * scale}, {2 * scale}, {scale}], duration: {20 / scale}, samples: 11}}\n"
    )
    unit = euler(BODY + "motion: {omega: [0.5, 2, 1], duration: 20, samples: 11}\n")
    assert same_turn(arrays(report)["orientation"], arrays(unit)["orientation"]) < 1e-13
    assert report["period"] * scale == pytest.approx(unit["period"], rel=1e-14)
    if scale < 1e-100:
        assert report["kinetic_energy"] is None


def test_stability_table_at_the_speed_of_the_beginning() -> None:
    report = euler(BODY + "motion: {omega: [3, 4, 0]}\n")
    assert [row["stable"] for row in report["stability"]] == [True, False, True]
    assert report["stability"][1]["rate_per_spin"] == pytest.approx(math.sqrt(0.5 * 1 / 2.5), rel=1e-14)
    assert report["stability"][1]["rate"] == pytest.approx(5 * math.sqrt(0.2), rel=1e-14)


def test_trust_falls_with_time_and_near_the_separatrix() -> None:
    """Each turn adds to what rounding of the inputs does; near the separatrix a flip multiplies it."""
    digits = [
        euler(
            f"body: {{moments: [3, 4, 6]}}\nabout: com\nmotion: {{omega: [2, 1, {w3}], duration: {end}}}\n"
        )["trusted_digits"]
        for w3, end in ((1.5, 10), (1.5, 1e5), (1.000000001, 100))
    ]
    assert digits[0] > 14
    assert digits[0] - 5 < digits[1] < digits[0] - 3
    assert digits[2] < digits[0] - 3


def test_the_default_time_is_noted() -> None:
    report = euler(BODY + "motion: {omega: [0, 0, 2]}\n")
    assert arrays(report)["t"][-1] == pytest.approx(10 * math.pi, rel=1e-14)
    assert any("duration" in note for note in report.notes)


# --- driven


def test_a_damped_body_against_scipy() -> None:
    text = (
        "motion: {omega: [0.5, 2, -0.3], duration: 10, samples: 41, "
        'torque: {body: ["-c*w1", "-c*w2", "k*t"]}}\n'
    )
    report = euler("parameters: {c: 0.3, k: 0.05}\n" + TILTED + text)
    found = arrays(report)
    tensor = np.array([[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]])
    expected = integrated(
        tensor,
        np.array([0.5, 2, -0.3]),
        found["t"],
        lambda t, q, w: np.array([-0.3 * w[0], -0.3 * w[1], 0.05 * t]),
    )
    np.testing.assert_allclose(found["omega"], expected[:, 4:], atol=1e-10)
    assert same_turn(found["orientation"], expected[:, :4]) < 1e-9
    assert report["motion"] == "driven"
    assert (report["period"], report["flip_interval"], report["mean_space_rate"]) == (None, None, None)
    assert max(report["drift"].values()) < 1e-11


def test_every_variable_of_a_torque_means_what_it_says() -> None:
    """One torque in space of all variables, and the same in scipy from their definitions."""
    text = (
        "motion: {omega: [0.5, 2, -0.3], duration: 4, samples: 21, torque: {space: "
        '["0.3*wx + 0.2*w1", "0.1*q0*q3 - 0.4*uy + 0.1*w2*wy", '
        '"0.2*uz*q1 - 0.3*ux + 0.1*q2*wz + 0.05*w3*t"]}}\n'
    )
    found = arrays(euler(TILTED + text))
    tensor = np.array([[2, 0.3, 0.1], [0.3, 3, -0.2], [0.1, -0.2, 4]])
    third = np.linalg.eigh(tensor)[1][:, 2]
    third *= np.sign(third[np.abs(third).argmax()])

    def torque(t: float, q: Floats, w: Floats) -> Floats:
        (wx, wy, wz), (ux, uy, uz) = rotation.turned(q, w), rotation.turned(q, third)
        space = [
            0.3 * wx + 0.2 * w[0],
            0.1 * q[0] * q[3] - 0.4 * uy + 0.1 * w[1] * wy,
            0.2 * uz * q[1] - 0.3 * ux + 0.1 * q[2] * wz + 0.05 * w[2] * t,
        ]
        return rotation.turned(q * [1, -1, -1, -1], np.array(space))

    expected = integrated(tensor, np.array([0.5, 2, -0.3]), found["t"], torque)
    np.testing.assert_allclose(found["omega"], expected[:, 4:], atol=1e-10)
    assert same_turn(found["orientation"], expected[:, :4]) < 1e-9


def test_weight_of_a_body_held_at_a_corner() -> None:
    text = (
        "body: {shape: box, size: [1, 2, 3], mass: 6, anchor: corner}\n"
        "motion: {omega: [0.5, 2, -0.3], duration: 3, samples: 31, torque: {gravity: 9.81}}\n"
    )
    report = euler(text)
    found = arrays(report)
    arm, box = np.array([0.5, 1, 1.5]), np.diag([13, 10, 5]) * 6 / 12
    tensor = box + 6 * (arm @ arm * np.eye(3) - np.outer(arm, arm))

    def torque(t: float, q: Floats, w: Floats) -> Floats:
        return np.cross(arm, rotation.turned(q * [1, -1, -1, -1], np.array([0, 0, -6 * 9.81])))

    expected = integrated(tensor, np.array([0.5, 2, -0.3]), found["t"], torque)
    np.testing.assert_allclose(found["omega"], expected[:, 4:], atol=1e-9)
    height = rotation.turned(found["orientation"], arm)[:, 2]
    energy = found["kinetic_energy"] + 6 * 9.81 * height
    np.testing.assert_allclose(energy, energy[0], rtol=1e-11)
    assert max(report["drift"].values()) < 1e-11


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


def test_steady_precession_is_steady_and_other_torques_add_to_the_weight() -> None:
    text = f"top: {{spin: 100, tilt: 40 deg, precession: steady, {TOP}}}\nmotion: {{duration: 2"
    steady = arrays(euler(text + "}\n"))["angles"][:, 1]
    np.testing.assert_allclose(steady, math.radians(40), rtol=1e-10)
    braked = arrays(euler(text + ', torque: {body: [0, 0, "-0.001*w3"]}}\n'))
    np.testing.assert_allclose(braked["omega"][:, 2], 100 * np.exp(-0.1 * braked["t"]), rtol=1e-10)


def test_going_back_in_time_by_reversing_omega() -> None:
    """Weight is the same both ways: the end with omega turned round leads to the beginning."""
    body = "body: {shape: box, size: [1, 2, 3], mass: 6, anchor: corner}\n"
    there = arrays(euler(body + "motion: {omega: [1, 2, -1], times: [2], torque: {gravity: 9.81}}\n"))
    omega, q = (-there["omega"][0]).tolist(), there["orientation"][0].tolist()
    start = f"omega: {omega}, orientation: {{quaternion: {q}}}"
    back = arrays(euler(body + f"motion: {{{start}, times: [2], torque: {{gravity: 9.81}}}}\n"))
    np.testing.assert_allclose(back["omega"][0], [-1, -2, 1], atol=1e-9)
    assert same_turn(back["orientation"], np.array([[1.0, 0, 0, 0]])) < 1e-9


def test_the_constant_of_kovalevskaya() -> None:
    """Moments 2 : 2 : 1, centre of mass in the equator, along x: |(w1 + i w2)^2 - c (n1 + i n2)| is constant.

    Here n is the upward vertical along the body's axes and c = M g R / I3. S. Kowalevski, Acta Math. 12
    (1889) 177.
    """
    text = (
        "body: {moments: [2, 2, 1], mass: 1, com: [0.3, 0, 0], given_about: origin}\n"
        "motion: {omega: [1, 0.4, 2], orientation: {euler: [0.3, 1.1, 0.5]}, duration: 20, "
        "torque: {gravity: 3}}\n"
    )
    found = arrays(euler(text))
    up = rotation.turned(found["orientation"] * [1, -1, -1, -1], np.array([0.0, 0, 1]))
    w, n = found["omega"] @ [1, 1j, 0], up @ [1, 1j, 0]
    constant = np.abs(w**2 - 0.9 * n) ** 2
    assert np.ptp(w.real) > 1
    np.testing.assert_allclose(constant, constant[0], rtol=1e-9)


# --- what cannot be followed


@pytest.mark.parametrize(
    ("torque", "time"),
    [
        ("1/(t - 0.5)^2", 0.5),
        ("sqrt(0.7 - t)", 0.7),
        ("log(0.25 - t)", 0.25),
        ("1/(1 - 2*t)", 0.5),
        ("(0.6 - t)^0.3", 0.6),
    ],
)
def test_a_torque_without_a_value_ends_the_motion_at_a_named_time(torque: str, time: float | None) -> None:
    with pytest.raises(ComputationError) as caught:
        euler(BODY + f'motion: {{omega: [0, 0, 1], duration: 2, torque: {{body: [0, 0, "{torque}"]}}}}\n')
    if time is not None:
        told = [float(word) for word in caught.value.message.replace(",", " ").split() if word[0].isdigit()]
        assert any(value == pytest.approx(time, abs=1e-3) for value in told)


def test_a_torque_without_a_value_at_the_start_is_refused() -> None:
    with pytest.raises(ComputationError):
        euler(BODY + 'motion: {omega: [0, 0, 1], duration: 2, torque: {body: [0, 0, "1/t"]}}\n')


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("body: {moments: [0, 1, 1]}\nabout: com\nmotion: {omega: [1, 1, 0]}\n", "no moment"),
        ("body: {moments: [0, 0, 0]}\nabout: com\nmotion: {omega: [1, 1, 0]}\n", "no moment"),
        (
            "body: {moments: [0, 1, 1]}\nabout: com\nmotion: {omega: [0, 1, 0], torque: {body: [0, 0, 1]}}\n",
            "zero",
        ),
    ],
)
def test_motion_about_an_axis_without_moment_is_refused(text: str, words: str) -> None:
    with pytest.raises(ComputationError, match=words):
        euler(text)


@pytest.mark.parametrize(
    ("text", "key"),
    [
        (BODY, "motion.omega"),
        ("motion: {omega: [0, 0, 1]}\n", "body"),
        ("name: nothing\n", "body"),
        (f"top: {{spin: 1, {TOP}}}\n", "top.tilt"),
        ("top: {spin: 1, tilt: 1, mass: 1, distance: 1, lambda3: 1}\n", "top.lambda1"),
        ("parameters: {w: null}\n" + BODY + "motion: {omega: [0, 0, w]}\n", "parameters.w"),
        (
            "body: {moments: [1, 2, 2]}\nmotion: {omega: [0, 0, 1], torque: {gravity: 9.81}}\nabout: com\n",
            "body.mass",
        ),
    ],
)
def test_what_is_missing_is_named(text: str, key: str) -> None:
    with pytest.raises(DocumentError) as caught:
        euler(text)
    assert key in [problem.key for problem in caught.value.problems]


def test_exact_motion_is_refused() -> None:
    with pytest.raises(UsageError):
        euler(BODY + "motion: {omega: [0, 0, 1]}\n", exact=True)


def test_no_steady_precession_to_start_with() -> None:
    with pytest.raises(ComputationError, match="steady"):
        euler(f"top: {{spin: 1, tilt: 30 deg, precession: steady, {TOP}}}\n")


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


def test_columns_options_and_their_refusal(program: Program) -> None:
    chosen = program("euler", "-f", "csv", "--columns", "t,T,q0", "--duration", "2 s", "-", stdin=DOCUMENT)
    assert chosen.out.splitlines()[0] == "t,T,q0"
    assert chosen.out.splitlines()[-1].startswith("2.0,")
    wrong = program("euler", "-f", "csv", "--columns", "t,w4", "-", stdin=DOCUMENT)
    assert (wrong.code, wrong.out) == (2, "")
    assert "w4" in wrong.err
    no_top = program("euler", "-f", "csv", "--columns", "t,theta", "-", stdin=DOCUMENT)
    assert (no_top.code, no_top.out) == (2, "")


def test_a_top_has_its_angles_besides(program: Program) -> None:
    document = f"top: {{spin: 100, tilt: 40 deg, {TOP}}}\nmotion: {{duration: 1, samples: 3}}\n"
    header = program("euler", "-f", "csv", "-", stdin=document).out.splitlines()[0]
    assert header.endswith("Lx,Ly,Lz,phi,theta,psi")


def test_several_files_are_told_apart_in_csv(program: Program) -> None:
    outcome = program("euler", "-q", "-f", "csv", "--samples", "2", "-", "-", stdin=DOCUMENT)
    header, *rows = outcome.out.splitlines()
    assert header.startswith("name,t,w1")
    assert all(row.startswith("stdin,") for row in rows)


def test_a_table_tells_why(program: Program) -> None:
    out = program("euler", "-", stdin=DOCUMENT).out
    assert "L^2 > 2 T lambda2" in out or "L^2 < 2 T lambda2" in out
    assert "time between flips" in out
    assert "stable" in out
    assert max(map(len, program("euler", "-", stdin=DOCUMENT).out.splitlines())) < 130


def test_a_failure_leaves_standard_output_empty(program: Program) -> None:
    document = BODY + 'motion: {omega: [0, 0, 1], duration: 2, torque: {body: [0, 0, "1/(t-1)^2"]}}\n'
    outcome = program("euler", "-f", "csv", "-", stdin=document)
    assert (outcome.code, outcome.out) == (4, "")
    assert outcome.err.startswith("-: ")
