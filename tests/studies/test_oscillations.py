"""Small oscillations: normal modes of textbooks, of matrices worked by numpy, and refusals."""

from __future__ import annotations

import json
import math
import random
import re
from collections.abc import Callable
from pathlib import Path
from textwrap import indent
from typing import Any

import numpy as np
import pytest
import yaml

import rigidcli
from rigidcli.errors import ExpressionError
from rigidcli.language.expression import parse
from rigidcli.language.text import reading
from rigidcli.report import Report
from tests.conftest import Program


def hamilton(document: str) -> Report:
    return rigidcli.hamilton(rigidcli.loads(document))


def system(coordinates: str, body: str, equilibrium: str, **parameters: object) -> str:
    values = ", ".join(f"{name}: {'null' if value is None else value}" for name, value in parameters.items())
    return (
        f"system:\n  coordinates: [{coordinates}]\n{body}\n"
        f"equilibrium: {{{equilibrium}}}\nparameters: {{{values}}}\n"
    )


VALUES = {"m": 1.3, "M": 0.7, "k": 2.1, "K": 0.9, "l": 0.6, "g": 9.7, "q": 1.1, "B": 0.8, "R": 0.5, "w": 11.0}
"""Values of symbols at which formulas are compared."""


def at_values(expression: Any) -> float:
    text = parse(str(expression))
    return float(text.evaluate({name: VALUES[name] for name in text.names}))


HOOP = (
    "  particles: [{mass: m, position: [R*sin(a)*cos(w*t), R*sin(a)*sin(w*t), -R*cos(a)],"
    " potential: -m*g*R*cos(a)}]"
)
TEXTBOOKS = yaml.safe_load(Path(__file__).with_name("oscillations.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", TEXTBOOKS)
@pytest.mark.parametrize("exact", [True, False])
def test_modes_of_textbooks(name: str, exact: bool) -> None:
    coordinates, body, place, rates, vectors = TEXTBOOKS[name].values()
    names = [name for name in VALUES if re.search(rf"\b{name}\b", body.partition(":")[2])]
    parameters = {name: None if exact else VALUES[name] for name in names}
    modes = hamilton(system(coordinates, indent(body, "  "), place, **parameters))["modes"]
    value: Callable[[Any], float] = at_values if exact else float
    assert [value(mode["rate"]) for mode in modes] == pytest.approx(list(map(at_values, rates)), rel=1e-13)
    if exact:
        shortest = sum(map(len, rates))
        assert sum(len(str(mode["rate"])) for mode in modes) <= 1.2 * shortest + 1
    for mode, vector in zip(modes, vectors, strict=True):
        entries = [
            complex(value(e["re"]), value(e["im"])) if isinstance(e, dict) else value(e)
            for e in mode["vector"]
        ]
        known = [complex(*map(at_values, e)) if isinstance(e, list) else at_values(e) for e in vector]
        assert entries == pytest.approx(known, rel=1e-13, abs=1e-13)
        if value(mode["rate"]):
            assert value(mode["frequency"]) == pytest.approx(value(mode["rate"]) / (2 * math.pi))
            assert value(mode["period"]) * value(mode["frequency"]) == pytest.approx(1)
        else:
            assert mode["frequency"] is mode["period"] is mode["stable"] is None


def test_the_bead_on_the_hoop_at_its_three_equilibria(program: Program) -> None:
    values = {"m": 1, "R": 0.2, "w": 10, "g": 9.8}
    expected = {
        "0": (math.sqrt(100 - 9.8 / 0.2), False),
        "pi": (math.sqrt(100 + 9.8 / 0.2), False),
        "acos(g/(R*w^2))": (math.sqrt(100 - (9.8 / 0.2 / 10) ** 2), True),
    }
    for place, (rate, stable) in expected.items():
        (mode,) = hamilton(system("a", HOOP, f"a: {place}", **values))["modes"]
        assert mode["rate"] == pytest.approx(rate, rel=1e-14)
        assert mode["stable"] is stable
        assert (mode["period"] is None) is not stable
    open_sign = program("hamilton", "-", stdin=system("a", HOOP, "a: 0", m=None, R=None, w=None, g=None))
    assert open_sign.code == 0
    assert "sqrt(g/R - w^2)" in open_sign.out
    assert "oscillates where R w^2 < g" in open_sign.err


# --- matrices of any kind, and the same from the Hamiltonian


def matrices(size: int, seed: int, magnetic: float, least: float) -> tuple[Any, Any, Any]:
    """A mass matrix, an antisymmetric one and a symmetric one whose least eigenvalue may be negative."""
    source = np.random.default_rng(seed)
    a, b, c = (source.integers(-9, 10, (size, size)) / 4 for _ in range(3))
    return a @ a.T + np.eye(size), magnetic * (b - b.T), c @ c.T + least * np.eye(size)


def lagrangian(m: Any, g: Any, k: Any) -> str:
    size = range(len(m))
    terms = [
        f"({m[i][j] / 2})*x{i}dot*x{j}dot - ({k[i][j] / 2})*x{i}*x{j} + ({g[i][j] / 2})*x{j}*x{i}dot"
        for i in size
        for j in size
    ]
    return " + ".join(f"({term})" for term in terms)


def residual(modes: Any, m: Any, g: Any, k: Any) -> float:
    """How far the modes are from M s^2 + G s + K taking their vectors to zero."""
    worst = 0.0
    for mode in modes:
        rate, omega = mode["rate"], 2 * math.pi * (mode["frequency"] or 0.0)
        s = 1j * rate if mode["stable"] else rate + 1j * omega if mode["stable"] is False else 0.0
        v = np.array([e["re"] + 1j * e["im"] if isinstance(e, dict) else e for e in mode["vector"]])
        scale = np.abs(s * s * m).max() + np.abs(s * g).max() + np.abs(k).max()
        worst = max(worst, np.abs((s * s * m + s * g + k) @ v).max() / scale / np.abs(v).max())
    return worst


@pytest.mark.parametrize(("magnetic", "least"), [(0.0, 0.5), (0.0, -3.0), (0.5, 0.5), (2.0, -6.0)])
def test_modes_against_numpy(magnetic: float, least: float) -> None:
    size = 3
    m, g, k = matrices(size, 1, magnetic, least)
    names = [f"x{i}" for i in range(size)]
    place = ", ".join(f"{name}: 0" for name in names)
    found = hamilton(system(", ".join(names), f"  lagrangian: {lagrangian(m, g, k)}", place))
    back = np.linalg.solve(m, np.hstack([-k, -g]))
    every = np.linalg.eigvals(np.vstack([np.eye(size, 2 * size, size), back]))
    real, imaginary = (np.where(np.abs(part) < 1e-6, 0, part) for part in (every.real, every.imag))
    expected = [re or im for re, im in zip(real, imaginary, strict=True) if re >= 0 and im >= 0]
    modes = found["modes"]
    assert [mode["rate"] for mode in modes] == pytest.approx(sorted(expected), rel=1e-9)
    assert residual(modes, m, g, k) < 1e-12
    assert all(next(e for e in mode["vector"] if e != 0) in (1, {"re": 1, "im": 0}) for mode in modes)
    # The same from H alone, by the linearised equations of Hamilton.
    other = hamilton(system(", ".join(names), f"  hamiltonian: {found['hamiltonian']}", place))
    assert [mode["rate"] for mode in other["modes"]] == pytest.approx(sorted(expected), rel=1e-9)
    assert residual(other["modes"], m, g, k) < 1e-12
    assert other["lagrange_equations"] is None


def test_gyroscopic_forces_may_hold_a_system_on_a_hill() -> None:
    # K < 0: with m = 1 omega^2 - b omega + k = 0, which is real for b^2 > 4 k only.
    body = "  lagrangian: (xdot^2 + ydot^2)/2 + b*(x*ydot - y*xdot)/2 + k*(x^2 + y^2)/2"
    held = hamilton(system("x, y", body, "x: 0, y: 0", b=6, k=4))["modes"]
    assert [mode["rate"] for mode in held] == pytest.approx([3 - math.sqrt(5), 3 + math.sqrt(5)])
    assert all(mode["stable"] for mode in held)
    (lost,) = hamilton(system("x, y", body, "x: 0, y: 0", b=6, k=10))["modes"]
    assert lost["rate"] == pytest.approx(1)
    assert lost["frequency"] == pytest.approx(3 / (2 * math.pi))
    assert lost["stable"] is False
    # Just between the two frequencies are one, and motion grows by powers of the time.
    (between,) = hamilton(system("x, y", body, "x: 0, y: 0", b=6, k=9))["modes"]
    assert between["rate"] == pytest.approx(3)
    assert between["stable"] is False


def test_friction_makes_modes_decay() -> None:
    body = "  kinetic: m*xdot^2/2\n  potential: k*x^2/2\n  forces: {x: -c*xdot}"
    (weak,) = hamilton(system("x", body, "x: 0", m=2, k=3, c=1))["modes"]
    assert weak["rate"] == pytest.approx(math.sqrt(3 / 2 - 1 / 16))
    assert weak["decay"] == pytest.approx(1 / 4)
    assert weak["stable"] is True
    slow, fast = hamilton(system("x", body, "x: 0", m=2, k=3, c=10))["modes"]
    assert [slow["rate"], fast["rate"]] == pytest.approx([2.5 - math.sqrt(4.75), 2.5 + math.sqrt(4.75)])
    assert slow["period"] is None
    (exact,) = hamilton(system("x", body, "x: 0", m=None, k=None, c=None))["modes"]
    assert str(exact["decay"]) == "c/(2*m)"
    (critical,) = hamilton(system("x", body, "x: 0", m=1, k=1, c=2))["modes"]
    assert (critical["rate"], critical["stable"]) == (pytest.approx(1), True)


# --- equilibria that are found, assumed, or refused


def test_modes_that_oscillate_where_a_discriminant_is_positive() -> None:
    # L. Brown, G. Gabrielse, Rev. Mod. Phys. 58 (1986) 233: cyclotron, magnetron and axial motion.
    trap = "  lagrangian: m*(xdot^2+ydot^2+zdot^2)/2 + q*B*(x*ydot-y*xdot)/2 - m*w^2*(2*z^2-x^2-y^2)/4"
    report = hamilton(system("x, y, z", trap, "x: 0, y: 0, z: 0", m=None, q=None, B=None, w=None))
    for m, q, B, w in (1.0, 2.0, 3.0, 2.0), (0.5, 1.0, 4.0, 1.5):
        cyclotron = q * B / m
        width = math.sqrt(cyclotron**2 - 2 * w**2)
        expected = sorted([(cyclotron - width) / 2, w, (cyclotron + width) / 2])
        point = {"m": m, "q": q, "B": B, "w": w}
        rates = [mode["rate"] for mode in report["modes"]]
        found = sorted(float(e.evaluate(**{name: point[name] for name in e.names})) for e in rates)
        assert found == pytest.approx(expected, rel=1e-13)
    assert [mode["stable"] for mode in report["modes"]].count(None) == 2
    assert sum("oscillates where 2 m^2 w^2 < B^2 q^2" in note for note in report.notes) == 2
    # V. Szebehely, Theory of Orbits, section 5.4: w^4 - w^2 + 27/4 mu (1 - mu) = 0 at the triangular points.
    points = (
        "  lagrangian: (xdot^2 + ydot^2)/2 + x*ydot - y*xdot + (x^2 + y^2)/2"
        " + (1-mu)/sqrt((x+mu)^2+y^2) + mu/sqrt((x-1+mu)^2+y^2)"
    )
    modes = hamilton(system("x, y", points, "x: 1/2 - mu, y: sqrt(3)/2", mu=None))["modes"]
    assert [mode["stable"] for mode in modes] == [None, None]
    for mode in modes:
        square = float(mode["rate"].evaluate(mu=0.02)) ** 2
        assert square**2 - square + 27 / 4 * 0.02 * 0.98 == pytest.approx(0, abs=1e-14)


def test_vectors_have_the_roots_of_their_rates() -> None:
    # A pendulum on a cart on a spring: w^2 = (B -+ sqrt(B^2 - 4 M l g k))/(2 M l), B = (M + m) g + k l.
    body = (
        "  kinetic: M*xdot^2/2 + m*(xdot^2 + 2*l*xdot*adot*cos(a) + l^2*adot^2)/2\n"
        "  potential: k*x^2/2 - m*g*l*cos(a)"
    )
    modes = hamilton(system("x, a", body, "x: 0, a: 0", m=None, M=None, l=None, k=None, g=None))["modes"]
    root = "sqrt((M*g + m*g + k*l)**2 - 4*M*g*k*l)"
    for mode, sign in zip(modes, "-+", strict=True):
        assert str(mode["rate"]) == f"sqrt((M*g + m*g + k*l {sign} {root})/(2*M*l))"
        assert root in str(mode["vector"][1])
        assert mode["stable"] is True


def test_modes_without_a_closed_form_are_told_with_values(program: Program) -> None:
    names = [f"x{i}" for i in range(4)]
    kinetic = "(" + " + ".join(f"m*{i + 1}*{name}dot^2" for i, name in enumerate(names)) + ")/2"
    chain = " + ".join(f"({a} - {b})^2" for a, b in zip(names, ["0", *names], strict=False))
    potential = f"k*({chain})/2 + K*x2^2/2"
    body, place = f"  kinetic: {kinetic}\n  potential: {potential}", ", ".join(f"{n}: 0" for n in names)
    open_form = program(
        "hamilton", "-f", "json", "-", stdin=system(", ".join(names), body, place, m=None, k=None, K=None)
    )
    assert json.loads(open_form.out)["modes"] is None
    assert "no closed form" in open_form.err
    document = rigidcli.loads(system(", ".join(names), body, place, m=1, k=1, K=1), exact=True)
    numbers = rigidcli.hamilton(document, steps=True)
    assert all(isinstance(mode["rate"], float) for mode in numbers["modes"])
    assert [step.title for step in numbers.steps if "mode" in step.title] == [
        f"Vector of mode {number}" for number in range(1, 5)
    ]


@pytest.mark.parametrize("size", [8, 12])
def test_a_ring_in_letters_has_rates_in_closed_form(size: int) -> None:
    names = [f"x{k}" for k in range(size)]
    potential = " + ".join(f"({a} - {b})^2" for a, b in zip(names, [*names[1:], names[0]], strict=True))
    place = ", ".join(f"{name}: 0" for name in names)
    report = rigidcli.hamilton(
        rigidcli.loads(
            f"parameters: {{k: null, m: null}}\nequilibrium: {{{place}}}\n"
            f"system: {{coordinates: [{', '.join(names)}], potential: k*({potential})/2,"
            f" kinetic: m*({' + '.join(f'{name}dot^2' for name in names)})/2}}\n"
        )
    )
    rates = [float(mode["rate"].evaluate(k=3, m=2)) for mode in report["modes"]]
    expected = sorted(2 * math.sqrt(1.5) * math.sin(math.pi * k / size) for k in range(size))
    assert rates == pytest.approx(expected, rel=1e-14)
    assert report.notes == ()


def test_a_ring_of_masses_has_all_its_modes() -> None:
    # Of n masses and springs omega_k = 2 sin(pi k/n): all rates but two stand twice.
    size = 20
    names = [f"x{k}" for k in range(size)]
    body = (
        f"  kinetic: ({' + '.join(f'{name}dot^2' for name in names)})/2\n"
        f"  potential: ({' + '.join(f'({names[k]} - {names[k - 1]})^2' for k in range(size))})/2"
    )
    place = ", ".join(f"{name}: 0" for name in names)
    modes = hamilton(system(", ".join(names), body, place))["modes"]
    expected = sorted(2 * math.sin(math.pi * k / size) for k in range(size))
    assert [mode["rate"] for mode in modes] == pytest.approx(expected, rel=1e-13, abs=1e-13)
    vectors = np.array([mode["vector"] for mode in modes])
    assert np.linalg.matrix_rank(vectors) == size
    assert [mode["stable"] for mode in modes] == [None, *(size - 1) * [True]]


def test_rates_that_vanish_for_the_given_values_are_numbers() -> None:
    # In a frame that turns at the rate of the spring itself, one mode does not move: it is no double root.
    body = "  hamiltonian: (p_x**2 + p_y**2)/2 - w*(x*p_y - y*p_x) + (x**2 + y**2)/2"
    found = rigidcli.hamilton(rigidcli.loads(system("x, y", body, "x: 0, y: 0", w=1), exact=True))
    assert found["stability"] == "stable"
    assert [float(mode["rate"]) for mode in found["modes"]] == [0, 0, 2]


CONDITIONS = yaml.safe_load(Path(__file__).with_name("conditions.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", CONDITIONS.values(), ids=CONDITIONS.keys())
def test_a_condition_holds_exactly_where_the_numbers_say_so(case: dict[str, Any]) -> None:
    letters, chance = case["letters"].split(), random.Random(5)
    place = dict.fromkeys(case["system"]["coordinates"], 0)

    def modes(parameters: dict[str, float | None]) -> Report:
        document = {"parameters": parameters, "system": case["system"], "equilibrium": place}
        return rigidcli.hamilton(rigidcli.loads(yaml.safe_dump(document)))

    found = modes(dict.fromkeys(letters))
    told = {
        note.split("the rate ")[1].split(" oscillates where ")[0]: note.split(" oscillates where ")[1]
        for note in found.notes
        if " oscillates where " in note
    }
    seen = set[bool]()
    for _ in range(40):
        point = {name: chance.choice((0.1, 1.0, 3.0)) * chance.uniform(0.3, 1.7) for name in letters}
        claimed = 0
        for mode in found["modes"]:
            condition = told.get(reading(mode["rate"].tree()))
            if condition is None:
                claimed += bool(mode["stable"])
                continue
            sides = re.split(" [<>] ", condition)
            low, high = (value_of(side, point) for side in (sides if "<" in condition else sides[::-1]))
            claimed += low < high
            seen.add(low < high)
        numbers = modes(dict(point))["modes"]
        # What flutters has a twin of the same frequency that decays.
        growing = [mode["frequency"] for mode in numbers if mode["stable"] is False and mode["frequency"]]
        steady = [mode["frequency"] for mode in numbers if mode["stable"] and mode["frequency"]]
        assert claimed == sum(f not in map(pytest.approx, growing) for f in steady), point
    assert len(seen) == (2 if told else 0)


def value_of(text: str, point: dict[str, float]) -> float:
    """The value of a text as people write it; without a real one, NaN."""
    try:
        return float(parse(text).evaluate(point))
    except ExpressionError:
        return math.nan
