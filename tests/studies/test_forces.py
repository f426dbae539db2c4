"""Lagrange's equations, forces beside the potential, and functions without a formula."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sympy
from scipy.integrate import solve_ivp

import rigidcli
from rigidcli.report import Report
from tests.conftest import ROOT, Program


def hamilton(document: str, **options: Any) -> Report:
    return rigidcli.hamilton(rigidcli.loads(document), **options)


DRAG = "system: {coordinates: [x], kinetic: m*xdot^2/2, potential: k*x^2/2, forces: {x: -c*xdot}}\n"


# --- Lagrange's equations


@pytest.mark.parametrize("name", ["double_pendulum", "elevator_pendulum"])
def test_lagranges_equations_against_sympy(name: str) -> None:
    found = rigidcli.hamilton(rigidcli.load(ROOT / "configs" / f"{name}.yaml", settings=["orbit=null"]))
    t, names = sympy.Symbol("t", real=True), found["coordinates"]
    paths = {q: sympy.Function(q)(t) for q in names}
    moving = {sympy.Symbol(q, real=True): path for q, path in paths.items()}
    moving |= {sympy.Symbol(f"{q}dot", real=True): path.diff(t) for q, path in paths.items()}
    moving |= {sympy.Symbol(f"{q}ddot", real=True): path.diff(t, 2) for q, path in paths.items()}
    energy = found["lagrangian"].to_sympy().subs(moving)
    values = {s: sympy.Rational(k + 3, 7) for k, s in enumerate(sorted(energy.free_symbols, key=str))}
    motion = {
        path: sympy.Rational(2, 3) + (k + 1) * t / 5 + t**2 / (k + 3) for k, path in enumerate(paths.values())
    }
    for q, path in paths.items():
        expected = energy.diff(path.diff(t)).diff(t) - energy.diff(path)
        ours = found["lagrange_equations"][q].to_sympy().subs(moving)
        difference = (expected - ours).subs(motion).doit().subs(values)
        assert abs(difference.evalf(30)) < 1e-25
    # The accelerations obey the equations.
    solved = {sympy.Symbol(name, real=True): e.to_sympy() for name, e in found["accelerations"].items()}
    for equation in found["lagrange_equations"].values():
        left = equation.to_sympy().subs(solved)
        point = {s: sympy.Rational(k + 2, 9) for k, s in enumerate(sorted(left.free_symbols, key=str))}
        assert abs(left.subs(point).evalf(30)) < 1e-25


# --- forces


def test_an_orbit_with_friction() -> None:
    orbit = hamilton(
        DRAG + "parameters: {m: 2, k: 3, c: 0.4}\n"
        "orbit: {initial: {x: 1, xdot: 0}, duration: 30, samples: 61}\n"
    )["orbit"]
    decay, rate = 0.1, math.sqrt(1.5 - 0.01)
    t = orbit["t"]
    expected = np.exp(-decay * t) * (np.cos(rate * t) + decay / rate * np.sin(rate * t))
    assert orbit["q"]["x"] == pytest.approx(expected, abs=1e-11)
    assert orbit["drift"]["H"] < 1e-12
    assert orbit["trusted_digits"] > 10


def followed(rates: Any, state: list[float], times: Any) -> Any:
    return solve_ivp(rates, (0, times[-1]), state, "DOP853", times, rtol=1e-12, atol=1e-13).y


def test_forces_that_depend_on_everything() -> None:
    # In polar coordinates: a drive in t, a spring in r, drag by the velocity, and a torque by the momentum.
    orbit = hamilton(
        "system:\n  coordinates: [r, phi]\n  kinetic: m*(rdot^2 + r^2*phidot^2)/2\n"
        "  forces: {r: F*cos(t) - k*r - c*rdot, phi: -c*p_phi + x0}\n"
        "parameters: {m: 2, F: 1, k: 3, c: 0.2, x0: 0.7}\n"
        "orbit: {initial: {r: 1, phi: 0, rdot: 0, phidot: 1}, duration: 10, samples: 21}\n"
    )["orbit"]

    def rates(t: float, y: Any) -> list[float]:
        r, _, pr, pphi = y
        return [
            pr / 2,
            pphi / 2 / r**2,
            pphi**2 / 2 / r**3 + math.cos(t) - 3 * r - 0.1 * pr,
            -0.2 * pphi + 0.7,
        ]

    r, phi, pr, pphi = followed(rates, [1, 0, 0, 2], orbit["t"])
    assert orbit["q"]["r"] == pytest.approx(r, abs=1e-9)
    assert orbit["q"]["phi"] == pytest.approx(phi, abs=1e-9)
    assert orbit["p"]["p_r"] == pytest.approx(pr, abs=1e-9)
    assert orbit["p"]["p_phi"] == pytest.approx(pphi, abs=1e-9)
    assert orbit["drift"]["H"] < 1e-11
    assert set(orbit["drift"]) == {"H"}


def test_forces_on_five_pendulums_whose_hamiltonian_is_not_written() -> None:
    size, drag = 5, 0.3
    particles = []
    for count in range(1, size + 1):
        x, y = (" + ".join(f"{f}(a{i})" for i in range(1, count + 1)) for f in ("sin", "cos"))
        particles.append(f"    - {{mass: 1, position: ['{x}', '-({y})'], potential: '-({y})'}}")
    names = [f"a{i}" for i in range(1, size + 1)]
    forces = ", ".join(f"{a}: -c*{a}dot" for a in names)
    start = ", ".join(f"{a}: 0.{k}, {a}dot: 0" for k, a in enumerate(names))
    orbit = hamilton(
        f"system:\n  coordinates: [{', '.join(names)}]\n  particles:\n" + "\n".join(particles) + "\n"
        f"  forces: {{{forces}}}\nparameters: {{c: {drag}}}\n"
        f"orbit: {{initial: {{{start}}}, duration: 4, samples: 9}}\n"
    )["orbit"]
    weights = size - np.maximum.outer(np.arange(size), np.arange(size))

    def rates(_: float, y: Any) -> Any:
        a, v = y[:size], y[size:]
        turned = a[:, None] - a[None, :]
        right = -(weights * np.sin(turned)) @ v**2 - np.diag(weights) * np.sin(a) - drag * v
        return [*v, *np.linalg.solve(weights * np.cos(turned), right)]

    expected = followed(rates, [*(k / 10 for k in range(size)), *[0.0] * size], orbit["t"])
    for k, a in enumerate(names):
        assert orbit["q"][a] == pytest.approx(expected[k], abs=1e-8)
    assert orbit["drift"]["H"] < 1e-10


# --- functions without a formula

TRACK = "system: {{coordinates: [x], functions: {{h: [x]}}, {}}}\nparameters: {{m: null, g: null}}\n"
FORMS = [
    "particles: [{mass: m, position: [x, h(x)], potential: m*g*h(x)}]",
    "lagrangian: m*(1 + dh_dx(x)^2)*xdot^2/2 - m*g*h(x)",
    "kinetic: m*(1 + dh_dx(x)^2)*xdot^2/2, potential: m g h(x)",
    "hamiltonian: p_x^2/(2*m*(1 + dh_dx(x)^2)) + m*g*h(x)",
]


@pytest.mark.parametrize("form", FORMS)
def test_a_bead_on_a_track(form: str) -> None:
    # J. R. Taylor, Classical Mechanics, problem 13.7.
    found = hamilton(TRACK.format(form))
    assert str(found["hamiltonian"]) == "p_x**2/(2*m*(1 + dh_dx(x)**2)) + m*g*h(x)"
    (x, p), (m, g) = sympy.symbols("x p_x", real=True), sympy.symbols("m g", positive=True)
    h = sympy.Function("h")(x)
    energy = p**2 / (2 * m * (1 + h.diff(x) ** 2)) + m * g * h
    assert sympy.simplify(found["equations"]["p_x"].to_sympy() + energy.diff(x)) == 0
    assert found["conserved"] == ["H"]


def test_functions_of_several_arguments_and_of_expressions() -> None:
    found = hamilton(
        "system:\n  coordinates: [x, y]\n  functions: {V: [x, y], U: [r], A: [x, t]}\n"
        "  lagrangian: m*(xdot^2 + ydot^2)/2 - V(x, y) - U(sqrt(x^2 + y^2)) - dV_dy(y, x) + A(x, t)*xdot\n"
        "parameters: {m: null}\n"
    )
    assert str(found["equations"]["p_y"]) == (
        "-y*dU_dr(sqrt(x**2 + y**2))/sqrt(x**2 + y**2) - dV_dx_dy(y, x) - dV_dy(x, y)"
    )
    assert found["verified"] < 1e-12
    assert found["conserved"] == []
    assert "dA_dt(x, t)" in str(found["dH_dt"])


def test_what_is_conserved_for_any_potential() -> None:
    radial = hamilton(
        "system: {coordinates: [r, phi], functions: {V: r}, kinetic: m*(rdot^2 + r^2*phidot^2)/2,"
        " potential: V(r)}\nparameters: {m: null}\n"
    )
    assert radial["conserved"] == ["p_phi", "H"]
    pair = hamilton(
        "system: {coordinates: [x, y], functions: {V: [d]}, kinetic: (xdot^2 + ydot^2)/2,"
        " potential: V(x - y)}\n"
    )  # fmt: skip
    assert "p_x + p_y" in [str(e) for e in pair["invariants"]]
    # An even function is not taken for granted, and two documents share no names.
    odd = hamilton("system: {coordinates: [x], functions: {V: [s]}, hamiltonian: p_x + V(x) - V(-x)}\n")
    assert str(odd["equations"]["p_x"]) == "-dV_ds(-x) - dV_ds(x)"


def test_answers_with_unknown_functions_are_refused(tmp_path: Path, program: Program) -> None:
    (tmp_path / "doc.yaml").write_text(TRACK.format(FORMS[0]))
    (tmp_path / "bob.yaml").write_text("answers: {1: p_x^2}\n")
    for ask in ("hamiltonian", "equations", "dH_dt"):
        questions = f"questions: {{1: {{document: doc.yaml, ask: hamilton.{ask}}}}}"
        (tmp_path / "a.yaml").write_text(f"assignment: T\n{questions}\n")
        outcome = program("check", str(tmp_path / "a.yaml"), str(tmp_path / "bob.yaml"))
        assert outcome.code == 3
        assert "answers with unknown functions cannot be judged" in outcome.err
