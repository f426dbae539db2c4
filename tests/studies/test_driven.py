"""The steady response of linear systems to forces, against orbits that start on it, and resonance."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

import rigidcli
from rigidcli.report import Report
from rigidcli.studies import hamilton
from tests.conftest import ROOT
from tests.tables import rows_of

CASES = yaml.safe_load(Path(__file__).with_name("driven.yaml").read_text(encoding="utf-8"))


def run(document: dict[str, Any]) -> Report:
    return rigidcli.hamilton(rigidcli.loads(json.dumps(document)))


def at(value: Any, known: dict[str, float]) -> float:
    """A number, or an expression at values of its letters."""
    return float(value) if isinstance(value, float) else float(value.evaluate(**known))


@pytest.mark.parametrize("name", CASES)
def test_an_orbit_that_starts_on_the_response_stays_on_it(name: str) -> None:
    case = CASES[name]
    parameters, names = case["parameters"], case["system"]["coordinates"]
    times = np.linspace(0, 9, 37)
    expected, starts = {q: np.zeros(len(times)) for q in names}, dict[str, float]()
    for one in run({k: case[k] for k in ("system", "parameters")})["response"]:
        # The force is sin or cos of w t + a.
        f = one["force"]
        (early,) = (0.0,) if f == 1 else (math.acos(at(f, parameters | {"t": 0.0})),)
        if "sin" in str(f):
            early = math.asin(at(f, parameters | {"t": 0.0})) - math.pi / 2
        for q in names:
            a, w, lag = one["amplitude"][q], one["rate"], one["phase"][q]
            expected[q] += a * np.cos(w * times + early - lag)
            starts[q] = starts.get(q, 0.0) + a * math.cos(early - lag)
            starts[f"{q}dot"] = starts.get(f"{q}dot", 0.0) - a * w * math.sin(early - lag)
    orbit = {"initial": starts, "times": times.tolist()}
    found = run({k: case[k] for k in ("system", "parameters")} | {"orbit": orbit})["orbit"]["q"]
    for q in names:
        assert found[q] == pytest.approx(expected[q], abs=1e-9 * np.abs(expected[q]).max())


@pytest.mark.parametrize("name", CASES)
def test_the_response_in_letters_has_the_values_of_that_in_numbers(name: str) -> None:
    case = CASES[name]
    parameters = case["parameters"]
    numbers = run({k: case[k] for k in ("system", "parameters")})
    letters = run({"system": case["system"], "parameters": dict.fromkeys(parameters)})
    for one, other in zip(numbers["response"], letters["response"], strict=True):
        for q, amplitude in one["amplitude"].items():
            if other["amplitude"][q] is None:
                assert "not written in letters" in " ".join(letters.notes)
                continue
            assert at(other["amplitude"][q], parameters) == pytest.approx(amplitude, rel=1e-12)
            turns = (at(other["phase"][q], parameters) - one["phase"][q]) / (2 * math.pi)
            assert turns == pytest.approx(round(turns), abs=1e-12)
    for q, text in case.get("amplitude", {}).items():
        value = eval(text, {"sqrt": math.sqrt} | parameters)  # the text is ours
        assert numbers["response"][0]["amplitude"][q] == pytest.approx(value, rel=1e-13)
    if "quality" in case:
        value = eval(case["quality"], {"sqrt": math.sqrt} | parameters)
        assert numbers["quality"] == pytest.approx(value, rel=1e-13)


@pytest.mark.parametrize(
    ("lagrangian", "names", "growth"),
    rows_of(__file__, "in resonance the growth is told as the orbit shows"),
)
def test_in_resonance_the_growth_is_told_as_the_orbit_shows(
    lagrangian: str, names: list[str], growth: dict[str, float | None]
) -> None:
    orbit = {
        "initial": dict.fromkeys([f"{q}{end}" for q in names for end in ("", "dot")], 0),
        "duration": 400,
    }
    found = run(
        {"system": {"coordinates": names, "lagrangian": lagrangian}, "orbit": orbit | {"samples": 20001}}
    )
    (response,) = found["response"]
    for q, rate in growth.items():
        assert response["amplitude"][q] == (None if rate else 0.0)
        assert response["growth"][q] == (None if rate is None else pytest.approx(rate, rel=1e-9))
        late = np.abs(np.asarray(found["orbit"]["q"][q])[-400:]).max()
        assert late == pytest.approx(400 * (rate or 0.0), rel=0.02, abs=1e-9)


def test_a_damping_of_zero_is_no_damping() -> None:
    system = {
        "coordinates": ["x"],
        "lagrangian": "xdot**2/2 - 2*x**2",
        "forces": {"x": "F*cos(2*t) - c*xdot"},
    }
    found = run({"system": system, "parameters": {"F": 3, "c": 0}})
    assert found["response"][0]["growth"]["x"] == pytest.approx(0.75, rel=1e-12)
    assert found["response"][0]["peak"] == {"rate": 2.0, "amplitude": None}
    assert "quality" not in found


@pytest.mark.parametrize(
    "system",
    [
        {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**2/2"},
        {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**4/4 + x*cos(t)"},
        {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**2*(2 + cos(t))/2"},
        {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**2/2 + x*exp(-t)"},
        {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**2/2 + x*cos(t**2)"},
    ],
)
def test_what_is_not_linear_or_not_harmonic_has_no_response(system: dict[str, Any]) -> None:
    assert "response" not in run({"system": system})


def test_the_document_on_resonance_has_the_figures_of_its_comment() -> None:
    document = rigidcli.load(ROOT / "configs/resonance.yaml")
    m, w0, b, f, w = (float(document.values[name]) for name in ("m", "w0", "b", "F", "w"))
    report = hamilton.run(document, picture="resonance")
    (one,) = report["response"]
    assert one["amplitude"]["x"] == pytest.approx(f / (m * math.hypot(w0**2 - w**2, 2 * b * w)), rel=1e-13)
    assert one["phase"]["x"] == pytest.approx(math.atan2(2 * b * w, w0**2 - w**2), rel=1e-13)
    assert one["peak"]["rate"] == pytest.approx(math.sqrt(w0**2 - 2 * b**2), rel=1e-13)
    assert report["quality"] == pytest.approx(w0 / (2 * b), rel=1e-13)
    curve = np.asarray(report.pictures[0].panels[0].marks[0].points)
    assert curve[curve[:, 1].argmax()] == pytest.approx(
        [one["peak"]["rate"], one["peak"]["amplitude"]], rel=1e-3
    )


def test_motion_that_grows_beside_the_response_is_noted() -> None:
    upright = {"coordinates": ["x"], "lagrangian": "xdot**2/2 + x**2 + x*cos(t)"}
    (note,) = run({"system": upright}).notes
    assert "the free motion grows" in note


def test_resonance_of_two_coordinates_in_letters_has_its_matrix() -> None:
    lagrangian = "m*(xdot**2 + ydot**2)/2 - k*(x**2 + (x - y)**2 + y**2)/2 + F*x*cos(sqrt(k/m)*t)"
    system = {"coordinates": ["x", "y"], "lagrangian": lagrangian}
    found = run({"system": system, "parameters": dict.fromkeys("mkF")})
    assert found["response"][0]["amplitude"] == {"x": None, "y": None}
    assert str(found["response"][0]["matrix"]["re"]) == "[[k, -k], [-k, k]]"
    assert "not written in letters" in " ".join(found.notes)


def test_the_peak_of_a_force_in_both_phases() -> None:
    system = {"coordinates": ["x"], "lagrangian": "m*xdot**2/2 - k*x**2/2"}
    parameters = {"m": 1, "k": 4, "c": 1, "w": 3, "a": 0.1}
    forces = {"x": "3*cos(w*t) + 4*sin(w*t) - c*xdot"}
    (one,) = run({"system": system | {"forces": forces}, "parameters": parameters})["response"]
    assert one["peak"]["amplitude"] == pytest.approx(5 / math.sqrt(4 - 1 / 4), rel=1e-13)
    # The force of a base depends on its rate.
    base = {"x": "k*a*cos(w*t) - c*a*w*sin(w*t) - c*xdot"}
    assert run({"system": system | {"forces": base}, "parameters": parameters})["response"][0]["peak"] is None


def test_a_force_that_fades_has_no_steady_response() -> None:
    found = run({"system": {"coordinates": ["x"], "lagrangian": "xdot**2/2 - x**2/2 + x*exp(-t)"}})
    assert "response" not in found
