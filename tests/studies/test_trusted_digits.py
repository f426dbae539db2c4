"""`trusted_digits` of orbits and driven motion against references, and what acts for a short while only.

Those digits are told that two integrations share, of which one is a hundred times as crude: about two fewer
than are right, or none, and a note, where both have nothing in common. The references are Taylor series in
numbers of 33 digits to a tolerance of 1e-33, by heyoka 7.13 (real128), of the equations written out anew,
with the decimals of the documents exactly, in steps shorter than what acts for a moment. The same to 1e-30
agrees in 18 digits at least. From "zeros of an oscillator" on they are closed forms, by mpmath in 40 digits:
of walls by a quadrature of dt = dx/v. Each line of `references.jsonl` is a document and the states at its
times after the first: coordinates and momenta, with the largest `sizes` of these along the run, or
orientations.
"""

from __future__ import annotations

import json
import math
import time
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rigidcli.document.load import loads
from rigidcli.errors import ComputationError
from rigidcli.report import Report
from rigidcli.studies import euler, hamilton

CASES = [json.loads(line) for line in (Path(__file__).parent / "references.jsonl").read_text().splitlines()]

ABOVE, BELOW = 0.5, 4.0
"""Digits by which the claim may be above what is true, and below."""

TWO = 2.0
"""Digits by which it is below in the middle of all references."""

MOST = 15.9
"""Digits of a float."""


def worked(document: dict[str, Any]) -> Report:
    text = loads(json.dumps(document))
    return hamilton.run(text) if "system" in document else euler.run(text)


def true_error(case: dict[str, Any], found: Report) -> float:
    """The largest error of a variable in units of its size along the run, or of the orientation in rad."""
    true = np.array(case["states"])
    if "system" not in case["document"]:
        ours = np.array(found["trajectory"]["orientation"])[1:]
        true *= np.sign((ours * true).sum(axis=1))[:, None]
        return float(2 * np.linalg.norm(ours - true, axis=1).max())
    orbit = found["orbit"]
    ours = np.column_stack([*orbit["q"].values(), *orbit["p"].values()])
    return float(np.abs((ours[1:] - true) / np.array(case["sizes"])).max())


CLAIMS: dict[str, float] = {}
"""By how much the claims are above what is true, of the references so far."""


@pytest.mark.parametrize("case", CASES, ids=lambda case: str(case["name"]))
def test_no_digit_is_claimed_that_is_wrong(case: dict[str, Any]) -> None:
    if case["document"].get("orbit", {}).get("method") == "taylor":
        pytest.importorskip("heyoka", reason="Taylor series are those of heyoka")
    found = worked(case["document"])
    error = true_error(case, found)
    true = min(MOST, max(0.0, -math.log10(error))) if error else MOST
    claimed = (found["orbit"] if "system" in case["document"] else found)["trusted_digits"]
    CLAIMS[case["name"]] = claimed - true
    assert claimed <= true + ABOVE
    # The period has digits of its own.
    if notes := [note for note in found.notes if "separatrix" not in note]:
        (note,) = notes
        assert claimed == 0
        assert "max_step" in note
    else:
        assert claimed >= true - BELOW


def test_claims_are_about_two_digits_below() -> None:
    assert not CLAIMS or np.median(list(CLAIMS.values())) > -TWO - 0.25


def orbit(system: str, start: str, times: str) -> Report:
    document = f"system: {{coordinates: [x], {system}}}\norbit: {{initial: {{{start}}}, times: {times}}}\n"
    return hamilton.run(loads(document))


@pytest.mark.parametrize("wall", ["exp(-(x/0.01)**2)", "(1 + tanh(x/0.01))/2"])
def test_a_narrow_wall_far_away_is_found(wall: str) -> None:
    text = f'hamiltonian: "p_x**2/2 + {wall}"'
    for start, end in ((-50, 300), (-1, 3)):
        report = orbit(text, f"x: {start}, p_x: 0.6", f"[0, {end}]")
        found = report["orbit"]
        # The wall is at x = 0 to within a few times its width, where it is as high as the energy.
        assert found["p"]["p_x"][-1] == pytest.approx(-0.6, rel=1e-6)
        assert found["q"]["x"][-1] == pytest.approx(-start - 0.6 * end, abs=0.18)
        assert found["trusted_digits"] > 7
        assert report.notes == ()


def test_every_wall_of_two_narrow_ones_is_found() -> None:
    wall = "exp(-((x - 1)/0.01)**2) + exp(-((x + 1)/0.01)**2)"
    report = orbit(f'hamiltonian: "p_x**2/2 + {wall}"', "x: 0.3, p_x: 0.6", "[0, 13]")
    found = report["orbit"]
    # It is turned at 1, -1, 1 and -1, each time to within a few widths of the wall.
    path = 0.3 + 0.6 * 13
    assert found["p"]["p_x"][-1] == pytest.approx(0.6, rel=1e-6)
    assert found["q"]["x"][-1] == pytest.approx(path - 8, abs=4 * 0.05)
    assert found["trusted_digits"] > 7
    assert report.notes == ()


PULSES = [
    ("{a}*exp(-((t - 5.3)/{w})**2)", math.sqrt(math.pi)),
    ("{a}*exp(-abs(t - 5.3)/{w})", 2.0),
    # It vanishes where its argument has its extremum: it is seen beside that.
    ("{a}*((t - 5.3)/{w})**2*exp(-((t - 5.3)/{w})**2)", math.sqrt(math.pi) / 2),
    ("{a}*(tanh((t - 5.3)/{w} + 1) - tanh((t - 5.3)/{w} - 1))", 4.0),
]


@pytest.mark.parametrize("width", [1e-9])
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


KICKS = [
    # Widths, with the ends by Taylor series of steps shorter than the kicks, as in `references.jsonl`.
    ("0.003", 5.36021737728579, -0.1968714815101113),
    ("0.05", 5.361024509511861, -0.19722446518403106),
]


@pytest.mark.parametrize(("width", "x", "p"), KICKS)
def test_no_kick_is_stepped_over(width: str, x: float, p: float) -> None:
    kicks = f"p_x**2/2 + 0.5*cos(x)*exp(-(sin(pi*t)/{width})**2)/{width}"
    report = orbit(f'hamiltonian: "{kicks}"', "x: 1, p_x: 0.3", "[0, 8.5]")
    assert report["orbit"]["q"]["x"][-1] == pytest.approx(x, rel=1e-11)
    assert report["orbit"]["p"]["p_x"][-1] == pytest.approx(p, rel=1e-10)
    assert report["orbit"]["trusted_digits"] > 10
    assert report.notes == ()


@pytest.mark.parametrize("width", [1e-2, 1e-6])
def test_a_pulse_whose_force_is_zero_at_its_middle_moves_a_particle(width: float) -> None:
    """It pushes forth and back: the momentum is as before, and the particle by the area elsewhere."""
    force = f"(t - 5.3)*exp(-((t - 5.3)/{width})**2)/{width**3}"
    found = orbit(f'hamiltonian: "p_x**2/2 - x*{force}"', "x: 0, p_x: 0", "[0, 5.3, 10]")["orbit"]
    moved = -math.sqrt(math.pi) / 2
    assert found["q"]["x"][-1] == pytest.approx(moved, rel=10 ** (0.5 - found["trusted_digits"]))
    assert found["trusted_digits"] > 1


def test_a_sine_is_never_left_out_however_fast() -> None:
    # x'' = cos(w t) from rest has moved by (1 - cos(w t))/w^2.
    found = orbit('hamiltonian: "p_x**2/2 - x*cos(1e3*t)"', "x: 0, p_x: 0", "[0, 7], tolerance: 1e-9")[
        "orbit"
    ]
    right = pytest.approx((1 - math.cos(7e3)) / 1e6, rel=10 ** (0.5 - found["trusted_digits"]))
    assert found["q"]["x"][-1] == right
    assert found["trusted_digits"] > 2
    with pytest.raises(ComputationError, match="needs more than 1,000,000 steps"):
        orbit('hamiltonian: "p_x**2/2 - x*cos(1e9*t)"', "x: 0, p_x: 0", "[0, 7]")


def test_a_chain_gives_its_energy_back_to_its_first_mode() -> None:
    """E. Fermi, J. Pasta, S. Ulam, M. Tsingou, report LA-1940 (1955): after some 157 periods of it."""
    count = 32
    names, places = [f"x{n}" for n in range(1, count + 1)], np.arange(1, count + 1)
    springs = [f"({b} - {a})**2/2 + ({b} - {a})**3/12" for a, b in pairwise(["0", *names, "0"])]
    shape, rate = np.sin(np.pi * places / (count + 1)), 2 * math.sin(math.pi / (2 * (count + 1)))
    kinetic = " + ".join(f"{name}dot**2/2" for name in names)
    start = dict(zip(names, shape.tolist(), strict=True)) | {f"{name}dot": 0 for name in names}
    document = {
        "system": {"coordinates": names, "kinetic": kinetic, "potential": " + ".join(springs)},
        "orbit": {
            "initial": start,
            "times": [0, *(2 * np.pi / rate * np.array([80, 157]))],
            "tolerance": 1e-8,
        },
    }
    found = hamilton.run(loads(json.dumps(document)))["orbit"]
    q, p = (shape @ np.array([*found[key].values()]) for key in "qp")
    share = (p**2 + (rate * q) ** 2) / (rate * q[0]) ** 2
    assert share[1] < 0.1
    assert share[2] > 0.95
    assert found["trusted_digits"] > 5


def test_friction_that_holds_a_body_is_told_at_once() -> None:
    document = (
        'system: {coordinates: [x], lagrangian: "xdot**2/2 - x**2/2", forces: {x: "-0.1*sign(xdot)"}}\n'
        "orbit: {initial: {x: 3.2, p_x: 0}, duration: 300}\n"
    )
    begin = time.process_time()
    with pytest.raises(ComputationError, match="too fast to be followed beyond t = ") as caught:
        hamilton.run(loads(document))
    assert time.process_time() - begin < 4
    assert "sticks: tanh(x/0.001) for sign(x)" in str(caught.value.hint)


def test_only_what_may_be_chaotic_is_called_so() -> None:
    pendulums = "[x, y], hamiltonian: (p_x**2 + p_y**2 + x**2 + y**2)/2 + x**2*y - y**3/3"
    document = f"system: {{coordinates: {pendulums}}}\n"
    document += "orbit: {initial: {x: 0, y: -0.15, p_x: 0.5, p_y: 0.1}, duration: 600, tolerance: 1e-6}\n"
    (note,) = hamilton.run(loads(document)).notes
    assert "the motion may be chaotic" in note


def test_a_crude_orbit_is_compared_with_a_finer_one() -> None:
    document = 'hamiltonian: "p_x**2/2 + x**2/2"', "x: 1, p_x: 0", "[0, 5, 9, 20], tolerance: 1e-3"
    found = orbit(*document)["orbit"]
    off = np.abs(np.array(found["q"]["x"]) - np.cos([0, 5, 9, 20])).max()
    assert -math.log10(off) - BELOW < found["trusted_digits"] < -math.log10(off) + ABOVE
