"""`trusted_digits` of orbits and driven motion against references, and what acts for a short while only.

The references are Taylor series in numbers of 33 digits to a tolerance of 1e-33, by heyoka 7.13 (real128),
of the equations written out anew, with the decimals of the documents exactly. The same to 1e-30 agrees in 18
digits at least. Each line of `references.jsonl` is a document and the states at its times after the first:
coordinates and momenta, or orientations.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from rigidcli.document.load import loads
from rigidcli.report import Report
from rigidcli.studies import euler, hamilton

CASES = [json.loads(line) for line in (Path(__file__).parent / "references.jsonl").read_text().splitlines()]

ABOVE, BELOW = 0.5, 2.0
"""Digits by which the claim may be above what is true, and below."""

MOST = 15.9
"""Digits of a float."""


def worked(document: dict[str, Any]) -> Report:
    text = loads(json.dumps(document))
    return hamilton.run(text) if "system" in document else euler.run(text)


def true_error(document: dict[str, Any], found: Report, states: list[list[float]]) -> float:
    """The largest error of a variable in units of its size, or of the orientation in rad."""
    true = np.array(states)
    if "system" not in document:
        ours = np.array(found["trajectory"]["orientation"])[1:]
        true *= np.sign((ours * true).sum(axis=1))[:, None]
        return float(2 * np.linalg.norm(ours - true, axis=1).max())
    orbit = found["orbit"]
    ours = np.column_stack([*orbit["q"].values(), *orbit["p"].values()])
    size = np.abs(ours).max(axis=0)
    return float(np.abs((ours[1:] - true) / np.where(size > 0, size, 1)).max())


@pytest.mark.parametrize("case", CASES, ids=lambda case: str(case["name"]))
def test_the_digits_that_are_claimed_are_those_that_are_right(case: dict[str, Any]) -> None:
    found = worked(case["document"])
    error = true_error(case["document"], found, case["states"])
    true = min(MOST, max(0.0, -math.log10(error))) if error else MOST
    claimed = (found["orbit"] if "system" in case["document"] else found)["trusted_digits"]
    assert true - BELOW <= claimed <= true + ABOVE
    assert found.notes == () or claimed == 0


def orbit(system: str, start: str, times: str) -> Report:
    document = f"system: {{coordinates: [x], {system}}}\norbit: {{initial: {{{start}}}, times: {times}}}\n"
    return hamilton.run(loads(document))


@pytest.mark.parametrize("width", ["0.01", "1e-5", "1e-8"])
@pytest.mark.parametrize(
    "wall",
    [
        "exp(-(x/{w})**2)",
        "1/(1 + (x/{w})**2)**4",
        "exp(-sqrt((x/{w})**2 + 1) + 1)",
        "(1 + tanh(x/{w}))/2",
        "exp(-((x - 2)/{w})**2) + exp(-(x/{w})**2)",
    ],
)
def test_no_wall_is_too_narrow_to_turn_a_particle_back(wall: str, width: str) -> None:
    text = f'hamiltonian: "p_x**2/2 + {wall.format(w=width)}"'
    found = orbit(text, "x: -50, p_x: 0.6", "[0, 300]")["orbit"]
    # The wall is at x = 0 to within a few times its width, where it is as high as the energy.
    assert found["p"]["p_x"][-1] == pytest.approx(-0.6, rel=1e-6)
    assert found["q"]["x"][-1] == pytest.approx(50 - 0.6 * 300 - 50 + 50, abs=0.1 + 8 * float(width))
    assert found["trusted_digits"] > 7


def test_a_wall_that_is_passed_costs_the_time_that_it_takes() -> None:
    """It is nowhere lower than 0, where the speed is 1.5: a particle is late behind it, but as fast."""
    found = orbit('lagrangian: "xdot**2/2 - exp(-(x/1e-5)**2)"', "x: -50, p_x: 1.5", "[0, 60]")["orbit"]
    assert found["p"]["p_x"][-1] == pytest.approx(1.5, rel=1e-10)
    late = 1.5 * 60 - 50 - found["q"]["x"][-1]
    speed = [math.sqrt(1.5**2 - 2 * math.exp(-(u**2))) for u in np.arange(-8, 8, 1e-3)]
    assert late == pytest.approx(1e-5 * 1e-3 * sum(1.5 / v - 1 for v in speed), rel=1e-4)


PULSES = [
    ("{a}*exp(-((t - 5.3)/{w})**2)", math.sqrt(math.pi)),
    ("{a}*exp(-abs(t - 5.3)/{w})", 2.0),
    ("{a}/(1 + ((t - 5.3)/{w})**2)**2", math.pi / 2),
    ("{a}*(tanh((t - 5.3)/{w} + 1) - tanh((t - 5.3)/{w} - 1))", 4.0),
]


@pytest.mark.parametrize("width", [1e-5, 1e-9])
@pytest.mark.parametrize(("pulse", "area"), PULSES)
def test_no_pulse_of_torque_is_too_short_to_turn_a_body(pulse: str, area: float, width: float) -> None:
    torque = pulse.format(a=repr(1 / width), w=repr(width))
    found = euler.run(
        loads(
            "body: {moments: [1, 2, 2.5], mass: 1}\nabout: com\n"
            f'motion: {{omega: [0, 0, 1], times: [0, 10], torque: {{body: [0, 0, "{torque}"]}}}}\n'
        )
    )
    assert found["trajectory"]["omega"][-1][2] == pytest.approx(1 + area / 2.5, rel=1e-6)
    assert found["trusted_digits"] > 4


def test_what_stays_too_narrow_costs_all_digits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigidcli.core.narrow.REPETITIONS", 1)
    found = orbit('hamiltonian: "p_x**2/2 + exp(-(x/0.01)**2)"', "x: -50, p_x: 0.6", "[0, 300]")
    assert found["orbit"]["trusted_digits"] == 0
    (note,) = found.notes
    assert "something narrow near t = 83.3" in note


def test_a_crude_orbit_is_compared_with_a_finer_one() -> None:
    document = 'hamiltonian: "p_x**2/2 + x**2/2"', "x: 1, p_x: 0", "[0, 5, 9, 20], tolerance: 1e-3"
    found = orbit(*document)["orbit"]
    off = np.abs(np.array(found["q"]["x"]) - np.cos([0, 5, 9, 20])).max()
    assert -math.log10(off) - BELOW < found["trusted_digits"] < -math.log10(off) + ABOVE


def past_the_pole(p_phi: str, times: list[float]) -> NDArray[np.float64]:
    """phi, theta, psi of a top whose tip passes the vertical closely, by its axis n as a vector.

    With unit moment across the axis and spin momentum 1, n'' = -|n'|^2 n + n x n' + F - n (n.F); the rate of
    phi + psi is regular there.
    """
    p, force = float(p_phi), np.array([0.0, 0.0, 0.7])
    start, fall = 0.5, -0.6
    phi_dot = (p - math.cos(start)) / math.sin(start) ** 2
    n = np.array([math.sin(start), 0, math.cos(start)])
    v = np.array([math.cos(start) * fall, math.sin(start) * phi_dot, -math.sin(start) * fall])

    def flow(_: float, y: NDArray[np.float64]) -> NDArray[np.float64]:
        n, v = y[:3], y[3:6]
        return np.array(
            [*v, *(np.cross(n, v) - (v @ v) * n + force - n * (n @ force)), 2 + (p - n[2]) / (1 + n[2])]
        )

    y = solve_ivp(flow, (0, times[-1]), [*n, *v, 0], method="DOP853", rtol=3e-14, atol=1e-16, t_eval=times).y
    phi = np.arctan2(y[1], y[0])
    return np.column_stack([phi, np.arctan2(np.hypot(y[0], y[1]), y[2]), y[6] - phi])


@pytest.mark.parametrize("tolerance", [1e-6, 1e-9, 1e-12, 1e-15])
@pytest.mark.parametrize("p_phi", ["1.0001", "1.000001", "1.00000001", "1.00000000005", "0.99999999995"])
def test_an_orbit_that_passes_a_pole_closely_turns_back_and_says_how_well(
    p_phi: str, tolerance: float
) -> None:
    times = [0.0, 1.0, 2.0, 5.0]
    document = {
        "system": {
            "coordinates": ["phi", "theta", "psi"],
            "hamiltonian": "p_theta**2/2 + (p_phi - p_psi*cos(theta))**2/(2*sin(theta)**2)"
            " + p_psi**2 - 0.7*cos(theta)",
        },
        "orbit": {
            "initial": {"phi": 0, "theta": 0.5, "psi": 0, "p_phi": p_phi, "p_theta": -0.6, "p_psi": 1},
            "times": times,
            "tolerance": tolerance,
        },
    }
    found = worked(document)["orbit"]
    ours, true = np.column_stack([*found["q"].values()]), past_the_pole(p_phi, times)
    turns = 2 * np.pi * np.round((ours[:, 0] - true[:, 0]) / (2 * np.pi))
    true[:, 0] += turns
    true[:, 2] -= turns
    error = float((np.abs(ours - true) / np.abs(ours).max(axis=0)).max())
    assert (ours[:, 1] > 0).all()
    assert error < 1e-5
    assert found["trusted_digits"] <= ABOVE - math.log10(error)
