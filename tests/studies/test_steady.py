"""Steady motions and small oscillations about them, against published formulas at random values."""

from __future__ import annotations

import json
import math
import random
from pathlib import Path
from typing import Any

import pytest
import yaml

import rigidcli
from rigidcli.errors import RigidError
from rigidcli.report import Report
from tests.conftest import ROOT, printed

CASES = yaml.safe_load(Path(__file__).with_name("steady.yaml").read_text(encoding="utf-8"))
PENDULUM = CASES["conical pendulum"]["system"]


def known(text: Any, letters: dict[str, Any]) -> float:
    """The value of an entry of the table, which is ours: no text of a user."""
    names = {name: getattr(math, name) for name in ("sqrt", "sin", "cos")}
    return float(eval(str(text), {"__builtins__": {}} | names, letters))


def studied(case: dict[str, Any], letters: dict[str, Any], **others: Any) -> Report:
    document = {
        "parameters": letters | case.get("parameters", {}),
        "system": case["system"],
        "equilibrium": case["equilibrium"],
        **others,
    }
    return rigidcli.hamilton(rigidcli.loads(json.dumps(document)))


@pytest.mark.parametrize("name", CASES)
def test_steady_motions_of_textbooks(name: str) -> None:
    case, rng = CASES[name], random.Random(name)
    formulas = None if "find" in case["equilibrium"] else studied(case, dict.fromkeys(case["letters"]))
    for _ in range(3):
        letters = {letter: rng.uniform(*ends) for letter, ends in case["letters"].items()}
        found = studied(case, letters)
        rates = {f"{q}dot": known(rate, letters) for q, rate in case["rates"].items()}
        modes = [known(mode, {**letters, "W": next(iter(rates.values()))}) for mode in case["modes"]]
        shown = [mode["rate"] if mode["stable"] else -mode["rate"] for mode in found["modes"]]
        assert shown == pytest.approx(modes, rel=1e-10)
        for key, rate in rates.items():
            assert found["steady"][key] == pytest.approx(rate, rel=1e-10)
            if formulas is not None:
                symbolic = formulas["steady"][key].evaluate(**letters)
                assert symbolic == pytest.approx(rate, rel=1e-10)
        if formulas is not None:
            written = [mode["rate"].evaluate(**letters) for mode in formulas["modes"]]
            assert written == pytest.approx(list(map(abs, modes)), rel=1e-10)


def test_the_effective_potential_is_minus_the_routhian_at_rest() -> None:
    found = studied(CASES["string through a table"], {"m": 1, "M": 2, "g": 10, "a": 3})
    point = {"m": 1.0, "M": 2.0, "g": 10.0, "r": 1.7, "p_phi": 0.6}
    potential = 0.6**2 / (2 * 1.7**2) + 2 * 10 * 1.7
    assert found["effective_potential"].evaluate(**point) == pytest.approx(potential, rel=1e-14)
    moving = found["routhian"].evaluate(**point, rdot=0.4)
    assert moving == pytest.approx((1 + 2) * 0.4**2 / 2 - potential, rel=1e-14)


def test_a_second_rate_is_told() -> None:
    letters = {"A": 1, "C": 1, "M": 1, "g": 1, "h": 1, "alpha": 1, "J": 3}
    (note,) = studied(CASES["steady top, slow"], letters).notes
    fast = (3 + math.sqrt(9 - 4 * math.cos(1))) / (2 * math.cos(1))
    assert float(note.rpartition("= ")[2]) == pytest.approx(fast, abs=1e-5)


def test_the_conical_pendulum_has_the_figures_of_its_comment() -> None:
    found = rigidcli.hamilton(ROOT / "configs/conical_pendulum.yaml", steps=True)
    rate, sway = found["steady"]["phidot"], found["modes"][0]["rate"]
    figures = ("4.429", "1.419", "5.860", "1.323")
    assert [rate, 2 * math.pi / rate, sway, sway / rate] == [printed(figure) for figure in figures]
    (step,) = (step for step in found.steps if step.title == "Steady motion")
    assert [entry.title for entry in step.fields][:2] == ["Routhian", "effective potential"]


@pytest.mark.parametrize(("rate", "equilibrium"), [("slow_rate", {"phi": "steady"}), ("fast_rate", {})])
def test_a_steady_top_turns_as_precess_says(rate: str, equilibrium: dict[str, Any]) -> None:
    top = {"lambda1": 2, "lambda3": 1, "mass": 1, "distance": 1, "tilt": 1, "spin": 12, "gravity": 9.8}
    expected = rigidcli.precess(rigidcli.loads(json.dumps({"top": top})))["top"][rate]
    momentum = 2 * expected * math.sin(1) ** 2 + 12 * math.cos(1)
    given = {"theta": 1, **equilibrium} if equilibrium else {"find": {"theta": 1.01}, "p_phi": momentum}
    case = CASES["steady top, slow"] | {"equilibrium": {"p_psi": 12, **given}}
    letters = {"A": 2, "C": 1, "M": 1, "g": 9.8, "h": 1}
    assert studied(case, letters)["steady"]["phidot"] == pytest.approx(expected, rel=1e-9)


RELATIVISTIC = {"coordinates": ["r", "phi"], "hamiltonian": "sqrt(1 + p_r**2 + p_phi**2/r**2) + r"}
ROTOR = {"coordinates": ["phi"], "kinetic": "phidot**2"}


@pytest.mark.parametrize(
    ("system", "equilibrium", "words"),
    [
        (PENDULUM, {"theta": "steady", "phi": 0}, "p_theta is not conserved: the system depends on theta"),
        (PENDULUM, {"p_theta": 1, "phi": 0}, "p_theta is not conserved"),
        ({**PENDULUM, "forces": {"phi": "-phidot"}}, {"theta": 1, "phi": "steady"}, "a force acts along phi"),
        (PENDULUM, {"theta": 2, "phi": "steady"}, "at no real rate: its square would be"),
        (PENDULUM, {"theta": "steady", "phi": "steady"}, "`theta` is steady already"),
        (PENDULUM, {"theta": 1, "phi": "steady", "p_phi": 1}, "read `p_phi` besides"),
        (PENDULUM, {"theta": 1, "p_phi": 1, "phi": 0}, "read `p_phi` besides"),
        (PENDULUM, {"find": {"theta": 1}, "phi": "steady"}, "`find` needs a fixed momentum"),
        (PENDULUM, {"find": {"theta": 1, "p_phi": 1}}, "belongs beside `find`"),
        (PENDULUM, {"phi": "steady"}, "equilibrium.theta"),
        (PENDULUM, {"theta": 1, "p_phi": 1}, "no equilibrium: at rest there, the force along theta is"),
        (PENDULUM, {"theta": 0, "phi": "steady"}, "equilibrium"),
        (RELATIVISTIC, {"r": 1, "phi": "steady"}, "not a linear function of its momentum"),
        (ROTOR, {"phi": "steady"}, "no coordinate is left"),
        (CASES["circle, n = 1"]["system"] | {"potential": "0"}, {"r": 1, "phi": "steady"}, "at rest only"),
        (
            CASES["circle, n = 1"]["system"] | {"kinetic": "rdot**2 + phidot**2"},
            {"r": 1, "phi": "steady"},
            "at every rate",
        ),
    ],
)
def test_what_is_no_steady_motion_is_refused_with_the_reason(
    system: dict[str, Any], equilibrium: dict[str, Any], words: str
) -> None:
    names = ("m", "l", "g") if system.get("particles") else ("m", "k")
    case = {"system": system, "equilibrium": equilibrium}
    with pytest.raises(RigidError) as caught:
        studied(case, dict.fromkeys([] if system in (ROTOR, RELATIVISTIC) else names, 1))
    assert words in str(caught.value)


def test_vectors_have_the_names_of_their_coordinates_in_any_order() -> None:
    system = {"coordinates": ["a", "b"], "kinetic": "adot**2 + bdot**2", "potential": "a**2 + 2*b**2"}
    found = studied({"system": system, "equilibrium": {"b": 0, "a": 0}}, {})
    assert list(found["equilibrium"]) == ["a", "b"]
    assert found["modes"][0]["vector"] == [1, 0]


@pytest.mark.parametrize("spin", ["1300 rpm", "2000 rpm", "1200 rpm"])
def test_a_top_asleep_has_the_rates_that_precess_tells(spin: str) -> None:
    asleep = rigidcli.load(ROOT / "configs/top_asleep.yaml", settings=[f"parameters.w={spin}"])
    top = rigidcli.load(ROOT / "configs/top_sleeping.yaml", settings=[f"top.spin={spin}"])
    modes, known = rigidcli.hamilton(asleep)["modes"], rigidcli.precess(top)["top"]
    if known["sleeping"] == "stable":
        assert [mode["rate"] for mode in modes] == pytest.approx(known["sleeping_frequencies"], rel=1e-12)
    else:
        assert known["sleeping_growth_rate"] == pytest.approx(max(mode["rate"] for mode in modes), rel=1e-12)
    assert all(mode["stable"] == (known["sleeping"] == "stable") for mode in modes)


def test_the_routhian_is_told_where_a_coordinate_is_cyclic_and_another_is_not() -> None:
    kepler = {"coordinates": ["r", "phi"], "lagrangian": "m*(rdot**2 + r**2*phidot**2)/2 + k/r"}
    letters = {"m": 1.3, "k": 0.7, "r": 1.1, "rdot": 0.4, "p_phi": 0.9}
    found = rigidcli.hamilton(
        rigidcli.loads(json.dumps({"parameters": {"m": None, "k": None}, "system": kepler}))
    )
    potential = 0.9**2 / (2 * 1.3 * 1.1**2) - 0.7 / 1.1
    assert found["routhian"].evaluate(**letters) == pytest.approx(1.3 * 0.4**2 / 2 - potential)
    assert found["effective_potential"].evaluate(**letters) == pytest.approx(potential)
    free = {"coordinates": ["x"], "lagrangian": "xdot**2/2"}
    assert "routhian" not in rigidcli.hamilton(rigidcli.loads(json.dumps({"system": free})))
