"""What `hamilton` says of systems: verdicts with their reasons, orbits against closed forms, refusals."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

import rigidcli
from rigidcli.errors import ComputationError
from rigidcli.report import Report
from tests.conftest import Program
from tests.tables import rows_of


def hamilton(document: str) -> Report:
    return rigidcli.hamilton(rigidcli.loads(document))


def words(value: Any) -> Any:
    """Expressions as text, in objects too."""
    if isinstance(value, dict):
        return {key: words(entry) for key, entry in value.items()}
    return str(value) if value is not None else None


def orbit(report: Report) -> tuple[Any, Any, Any]:
    found = report["orbit"]
    return found["t"], found["q"], found["p"]


# --- three questions that are not one


def test_unequal_pendulums_have_the_energy_for_their_hamiltonian() -> None:
    size = 6
    particles = []
    for count in range(1, size + 1):
        x, y = (" + ".join(f"l{i}*{f}(a{i})" for i in range(1, count + 1)) for f in ("sin", "cos"))
        particles.append(f"    - {{mass: m{count}, position: ['{x}', '-({y})']}}")
    symbols = ", ".join(f"{letter}{i}: null" for letter in "ml" for i in range(1, size + 1))
    found = hamilton(
        f"system:\n  coordinates: [{', '.join(f'a{i}' for i in range(1, size + 1))}]\n  particles:\n"
        + "\n".join(particles)
        + f"\nparameters: {{{symbols}}}\n"
    )
    assert found["h_equals_energy"] is True


@pytest.mark.parametrize(
    "system",
    [
        "particles: [{mass: 1, position: [x + t - t, sin(t)^2 + cos(t)^2]}]",
        "kinetic: xdot^2/2 + ((t + x)^2 - t^2 - 2*t*x - x^2)*xdot",
    ],
)
def test_time_that_cancels_is_no_time(system: str) -> None:
    found = hamilton(f"system: {{coordinates: [x], {system}}}")
    assert found["natural"] is True
    assert found["conserved"] == ["p_x", "H"]


def test_derived_parameters_hide_no_law() -> None:
    found = hamilton(
        "system: {coordinates: [x], lagrangian: m*xdot^2/2 - (k - m*w^2)*x^2*cos(t)/2}\n"
        "parameters: {m: 1, k: 4, w: sqrt(k/m)}\n"
    )
    assert found["cyclic"] == ["x"]
    assert found["conserved"] == ["p_x", "H"]
    with pytest.raises(ComputationError, match="rank 1 of 2"):
        hamilton(
            "system: {coordinates: [x, y], lagrangian: k*xdot^2/2 + m*ydot^2/2 + w*xdot*ydot}\n"
            "parameters: {m: null, k: null, w: sqrt(k*m)}\n"
        )


GAMMA = "sqrt(1 - xdot^2/c^2)"
PLANE_GAMMA = "sqrt(1 - (rdot^2 + r^2*phidot^2)/c^2)"


@pytest.mark.parametrize(
    ("coordinates", "kinetic", "potential", "lagrangian", "excess"),
    rows_of(__file__, "relativistic energies"),
)
def test_relativistic_energies(
    coordinates: str, kinetic: str, potential: str, lagrangian: str, excess: str | None
) -> None:
    found = hamilton(
        f"system: {{coordinates: [{coordinates}], kinetic: {kinetic}, potential: {potential}, "
        f"lagrangian: {lagrangian}}}\nparameters: {{m: null, c: null, k: null}}\n"
    )
    assert found["h_equals_energy"] is (excess == "0")
    if excess is not None:
        (field,) = (field for field in found.fields if field.key == "h_equals_energy")
        assert field.words == ("yes" if excess == "0" else f"no: T + V - H = {excess}")


# --- what has no one Hamiltonian


def test_velocities_choose_the_branch() -> None:
    found = hamilton(
        "system: {coordinates: [x], lagrangian: m*xdot^3/3 - x}\nparameters: {m: 1}\n"
        "orbit: {initial: {x: 0, xdot: -1}, duration: 0.5, samples: 5}\n"
    )
    # p = v^2, p' = -1: v = -sqrt(1 - t), x = (2/3) ((1 - t)^(3/2) - 1).
    t, q, p = orbit(found)
    assert p["p_x"] == pytest.approx(1 - t, rel=1e-12)
    assert q["x"] == pytest.approx(2 / 3 * ((1 - t) ** 1.5 - 1), abs=1e-12)
    assert words(found["velocity_solutions"]) == {"xdot": "-sqrt(p_x/m)"}


# --- orbits


def test_a_pulse_from_rest_whose_force_begins_below_all_floats() -> None:
    text = (
        "system: {coordinates: [x], lagrangian: xdot**2/2 + x*exp(-(t - 30)**2)}\n"
        "orbit: {initial: {x: 0, p_x: 0}, duration: 60, samples: 61}\n"
    )
    found = hamilton(text)["orbit"]
    # The momentum given is the whole integral of the Gaussian, at t = 30 in the mean.
    assert found["p"]["p_x"][-1] == pytest.approx(math.sqrt(math.pi), rel=1e-11)
    assert found["q"]["x"][-1] == pytest.approx(30 * math.sqrt(math.pi), rel=1e-11)
    assert found["trusted_digits"] > 9


def test_a_hamiltonian_that_fills_a_screen_is_told_with_its_length(program: Program) -> None:
    names = [f"a{i}" for i in range(1, 6)]
    path = " + ".join(f"cos({name})*{name}dot" for name in names)
    kinetic = " + ".join(f"{name}dot**2/2" for name in names)
    document = f"system: {{coordinates: [{', '.join(names)}], lagrangian: '({path})**2/2 + {kinetic}'}}"
    whole = program("hamilton", "-f", "json", "-", stdin=document)
    hamiltonian = json.loads(whole.out)["hamiltonian"]
    assert len(hamiltonian) > 2_000
    shown = program("hamilton", "-", stdin=document)
    assert (shown.code, whole.code) == (0, 0)
    assert f"too long for people to read: the Hamiltonian ({len(hamiltonian):,} characters)" in shown.err
    assert "`-f json` prints all of it" in shown.err
    assert "Hamiltonian   " not in shown.out


# --- canonical changes of variables


@pytest.mark.parametrize(
    ("parameters", "new", "momentum"),
    [
        ("{a: null, b: 1/a}", "a*x", "b*p_x"),
        ("{a: 1/2, b: 2}", "x^a*cos(b*p_x)", "x^a*sin(b*p_x)"),
    ],
)
def test_parameters_may_make_a_change_canonical(parameters: str, new: str, momentum: str) -> None:
    found = hamilton(
        f"parameters: {parameters}\nsystem: {{coordinates: [x], hamiltonian: p_x^2/2 + x}}\n"
        f"transform: {{new_variables: [Q, P], new: {{Q: {new}, P: {momentum}}}}}\n"
    )
    assert found["transform"]["canonical"] is True


# --- as a command


CHAINS: dict[str, tuple[str, Callable[[float], float]]] = {
    "Toda": ("exp(-({0})) + {0}", lambda d: -math.expm1(-d)),
    "Morse": ("(1 - exp(-({0})))^2", lambda d: -2 * math.expm1(-d) * math.exp(-d)),
}
"""The potential of a spring that is longer by {0}, and its tension."""


@pytest.mark.parametrize("kick", [0.1, 1e-7])
@pytest.mark.parametrize("kind", CHAINS)
def test_a_kick_of_any_size_runs_along_a_chain(kind: str, kick: float, program: Program) -> None:
    """The forces are small differences of large terms: neither steps nor digits may suffer unsaid."""
    text, tension = CHAINS[kind]
    names = ["x1", "x2", "x3", "x4"]
    springs = [text.format(f"({b} - {a})") for a, b in pairwise(["0", *names, "0"])]
    start = {**dict.fromkeys(names, 0), **{f"p_{name}": 0 for name in names}, "p_x1": kick}
    document = {
        "system": {
            "coordinates": names,
            "kinetic": " + ".join(f"{name}dot^2/2" for name in names),
            "potential": " + ".join(springs),
        },
        "orbit": {"initial": start, "times": [2.0]},
    }
    orbit = json.loads(program("hamilton", "-f", "json", "-", stdin=json.dumps(document)).out)["orbit"]
    assert orbit["steps"] < 500

    def flow(t: float, y: Any) -> Any:
        pulls = [tension(kick * (b - a)) / kick for a, b in pairwise([0, *y[:4], 0])]
        return [*y[4:], *(b - a for a, b in pairwise(pulls))]

    path = kick * solve_ivp(flow, (0, 2), [0] * 4 + [1] + [0] * 3, "DOP853", rtol=3e-14, atol=1e-16).y
    found = [column[0] for column in (*orbit["q"].values(), *orbit["p"].values())]
    error = float((np.abs(found - path[:, -1]) / np.abs(path).max(axis=1)).max())
    assert orbit["trusted_digits"] < -math.log10(error) + 0.5
    assert orbit["trusted_digits"] > 11 + math.log10(kick) - 1.5


def test_a_ring_of_springs_moves_as_the_sum_of_its_waves() -> None:
    size = 8
    names = [f"x{i}" for i in range(size)]
    kinetic = " + ".join(f"m*{name}dot**2/2" for name in names)
    springs = " + ".join(f"k*({a} - {b})**2/2" for a, b in zip(names, [*names[1:], names[0]], strict=True))
    start = {name: float(name == "x0") for name in names} | {f"p_{name}": 0.0 for name in names}
    orbit = rigidcli.hamilton(
        {
            "parameters": {"m": 1e-6, "k": 4e-6},
            "system": {"coordinates": names, "kinetic": kinetic, "potential": springs},
            "orbit": {"initial": start, "duration": 500, "samples": 201},
        }
    )["orbit"]
    numbers = np.arange(size)
    waves = np.cos(4 * np.abs(np.sin(np.pi * numbers / size)) * np.array(orbit["t"])[:, None])
    for place, name in enumerate(names):
        exact = (waves * np.cos(2 * np.pi * numbers * place / size)).mean(axis=1)
        miss = np.abs(orbit["q"][name] - exact).max()
        assert miss < 10 ** (0.5 - orbit["trusted_digits"])  # half a digit of slack, as of every orbit
