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
from rigidcli.errors import ComputationError, DocumentError
from rigidcli.report import Report
from tests.conftest import Program

SPRING = "system: {coordinates: [x], kinetic: m*xdot**2/2, potential: k*x**2/2}\n"


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


def test_the_mass_on_a_spring_in_symbols() -> None:
    found = hamilton(SPRING + "parameters: {m: null, k: null}\n")
    assert words(found["velocity_solutions"]) == {"xdot": "p_x/m"}
    assert words(found["equations"]) == {"x": "p_x/m", "p_x": "-k*x"}
    assert [words(pair) for pair in found["eigenvalues"]] == [
        {"re": "0", "im": "-sqrt(k/m)"},
        {"re": "0", "im": "sqrt(k/m)"},
    ]


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
        "kinetic: xdot^2*(sin(t)^2 + cos(t)^2)/2",
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


def test_a_mass_that_vanishes_in_decimals_is_found() -> None:
    with pytest.raises(ComputationError, match="rank 0 of 1"):
        hamilton(
            "system: {coordinates: [x], lagrangian: (a - b)*xdot^2/2 - x^2}\n"
            "parameters: {m: 0.1, a: 3*m, b: 0.3}\n"
        )


def test_a_growth_that_is_slow_beside_other_motion_is_growth() -> None:
    found = hamilton(
        "system: {coordinates: [x, y], kinetic: (xdot^2 + ydot^2)/2, potential: k*x^2/2 - g*y^2/2}\n"
        "parameters: {k: 1e12, g: 1e-3}\n"
    )
    assert found["stability"] == "unstable"
    assert found["frequencies"] == pytest.approx([1e6])
    assert max(pair["re"] for pair in found["eigenvalues"]) == pytest.approx(math.sqrt(1e-3))


GAMMA = "sqrt(1 - xdot^2/c^2)"
PLANE_GAMMA = "sqrt(1 - (rdot^2 + r^2*phidot^2)/c^2)"


@pytest.mark.parametrize(
    ("coordinates", "kinetic", "potential", "lagrangian", "excess"),
    [
        ("x", f"m*c^2/{GAMMA}", "k*x^2/2", f"-m*c^2*{GAMMA} - k*x^2/2", "0"),
        ("x", f"m*c^2/{GAMMA} - m*c^2", "k*x^2/2", f"m*c^2*(1 - {GAMMA}) - k*x^2/2", "0"),
        ("x", f"m*c^2/{GAMMA} - m*c^2", "k*x^2/2", f"-m*c^2*{GAMMA} - k*x^2/2", "-m c^2"),
        ("r, phi", f"m*c^2/{PLANE_GAMMA}", "-k/r", f"-m*c^2*{PLANE_GAMMA} + k/r", "0"),
        ("r, phi", f"m*c^2/{PLANE_GAMMA}", "-k/r", f"-m*c^2*{PLANE_GAMMA} + k/r + k*r^2*phidot", "0"),
        (
            "x, y",
            f"m*c^2/{GAMMA} + m*c^2/{GAMMA.replace('x', 'y')}",
            "k*(x - y)^2",
            f"-m*c^2*({GAMMA} + {GAMMA.replace('x', 'y')}) - k*(x - y)^2",
            "0",
        ),
        ("x", f"m*c^2*(1/{GAMMA} - 1)", "k*x", "m*xdot^2/2 - k*x", None),
    ],
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


@pytest.mark.parametrize(
    ("lagrangian", "rank", "constraint"),
    [
        ("(xdot + ydot)^2/2 - x^2", "rank 1 of 2", "p_y - p_x = 0"),
        ("xdot^2/2 + x*ydot", "rank 1 of 2", "p_y - x = 0"),
        ("x*ydot - y*xdot - x^2", "rank 0 of 2", "= 0"),
        ("xdot^2/2 + (sin(x)^2 + cos(x)^2 - 1)*ydot^2", "rank 1 of 2", "p_y = 0"),
        ("sqrt(xdot^2 + ydot^2)", "rank 1 of 2", ""),
    ],
)
def test_degenerate_lagrangians_are_refused(lagrangian: str, rank: str, constraint: str) -> None:
    with pytest.raises(ComputationError) as caught:
        hamilton(f"system: {{coordinates: [x, y], lagrangian: '{lagrangian}'}}")
    assert "degenerate" in str(caught.value)
    assert rank in str(caught.value)
    assert constraint in str(caught.value)


def test_a_mass_that_vanishes_at_the_given_values_is_refused() -> None:
    document = "system: {coordinates: [x], lagrangian: (m - 1)*xdot^2/2}\nparameters: {m: 1}\n"
    with pytest.raises(ComputationError, match=r"rank 0 of 1 at the given values \(m = 1\)"):
        hamilton(document)


def test_branches_are_listed_and_none_is_chosen() -> None:
    found = hamilton("system: {coordinates: [x], lagrangian: m*xdot^3/3 - x}\nparameters: {m: null}\n")
    assert found["hamiltonian"] is None
    assert found["equations"] is None
    assert [str(branch["xdot"]) for branch in found["branches"]] == ["sqrt(p_x/m)", "-sqrt(p_x/m)"]
    assert {branch["range"] for branch in found["branches"]} == {"p_x/m > 0"}


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


@pytest.mark.parametrize(
    ("initial", "message"),
    [("{x: 0, p_x: -1}", "expected p_x/m > 0"), ("{x: 0, p_x: 1}", "2 velocities have these momenta")],
)
def test_momenta_outside_or_on_several_branches(initial: str, message: str) -> None:
    with pytest.raises(DocumentError, match=message):
        hamilton(
            "system: {coordinates: [x], lagrangian: m*xdot^3/3 - x}\nparameters: {m: 1}\n"
            f"orbit: {{initial: {initial}, duration: 0.5}}\n"
        )


def test_velocities_beyond_that_of_light_are_refused() -> None:
    with pytest.raises(DocumentError, match=r"orbit\.initial"):
        hamilton(
            "system: {coordinates: [x], lagrangian: -m*sqrt(1 - xdot^2)}\nparameters: {m: 1}\n"
            "orbit: {initial: {x: 0, xdot: 1.5}, duration: 1}\n"
        )


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


def test_an_orbit_that_ends_names_the_time() -> None:
    # From rest at distance 1, it falls into the centre at t = pi/(2 sqrt 2).
    with pytest.raises(ComputationError, match=r"the orbit .* t = 1\.1107"):
        hamilton(
            "system: {coordinates: [r], lagrangian: rdot^2/2 + 1/r}\n"
            "orbit: {initial: {r: 1, rdot: 0}, duration: 3}\n"
        )


def test_an_orbit_that_often_falls_past_a_centre_is_told_with_few_digits() -> None:
    found = hamilton(
        "system: {coordinates: [r, phi], lagrangian: (rdot^2 + r^2*phidot^2)/2 + 1/r}\n"
        "orbit: {initial: {r: 0.1, rdot: 0, phi: 0.5, phidot: 0.2}, duration: 2, samples: 5}\n"
    )
    _, q, p = orbit(found)
    # By a Taylor series in 33 digits.
    assert abs(q["r"][-1] - 0.025815581471272213) < 0.1 * 10 ** -found["orbit"]["trusted_digits"]
    assert 1 < found["orbit"]["trusted_digits"] < 5
    assert q["r"].max() < 0.1 + 1e-6
    assert p["p_phi"] == pytest.approx(0.002, rel=1e-9)


def test_a_hamiltonian_may_be_given_and_begun_with_velocities() -> None:
    found = hamilton(
        "system: {coordinates: [x, y], hamiltonian: (p_x^2 + p_y^2)/2 + x*p_y - y*p_x}\n"
        "orbit: {initial: {x: 1, y: 0, xdot: 0, ydot: 1}, duration: 1, samples: 3}\n"
    )
    _, _, p = orbit(found)
    # xdot = p_x - y, ydot = p_y + x.
    assert p["p_x"][0] == pytest.approx(0)
    assert p["p_y"][0] == pytest.approx(0, abs=1e-15)
    assert found["lagrangian"] is None
    assert found["verified"] is None


def test_an_energy_beyond_floats_is_refused(program: Program) -> None:
    document = (
        "system: {coordinates: [x], lagrangian: xdot^2/2 + x^2/2}\n"
        "orbit: {initial: {x: 1, xdot: 0}, duration: 600, samples: 3}\n"
    )
    ended = program("hamilton", "-f", "json", "-", stdin=document)
    assert (ended.code, ended.out) == (4, "")
    assert "drift of H is beyond the range of floating-point numbers" in ended.err
    assert "Warning" not in ended.err


def test_an_orbit_ends_where_momenta_have_no_velocities() -> None:
    # p = (3/2) sqrt(v) falls by 1 a second: there is no velocity beyond t = 1.5.
    with pytest.raises(ComputationError, match=r"no velocities beyond t = 1\.5.*p_x.* > 0"):
        hamilton(
            "system: {coordinates: [x], lagrangian: xdot^(3/2) - x}\n"
            "orbit: {initial: {x: 1, xdot: 1}, duration: 3}\n"
        )


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
        ("{a: 0.1, b: 10}", "a*x", "b*p_x"),
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


@pytest.mark.parametrize(
    ("document", "code", "message"),
    [
        ("body: {moments: [1, 2, 2.5]}", 3, "-: system: missing"),
        ("system: {coordinates: [x], lagrangian: xdot^2*9^9^9^9}", 3, "-:1: system.lagrangian"),
        ("system: {coordinates: [x], lagrangian: x}", 4, "rank 0 of 1"),
        (
            SPRING + "parameters: {m: null, k: 1}\norbit: {initial: {x: 1, p_x: 0}, duration: 1}",
            3,
            "parameters.m",
        ),
        (
            "system: {coordinates: [x], hamiltonian: log(x)}\norbit: {initial: {x: -1, p_x: 1}, times: [1]}",
            3,
            "orbit.initial: H has no finite real value there",
        ),
    ],
)
def test_refusals(program: Program, document: str, code: int, message: str) -> None:
    for form in ("json", "csv", "table"):
        ended = program("hamilton", "-f", form, "-", stdin=document)
        assert ended.code == code
        assert ended.out == ""
        assert message in ended.err
        assert "Traceback" not in ended.err


CHAINS: dict[str, tuple[str, Callable[[float], float]]] = {
    "Toda": ("exp(-({0})) + {0}", lambda d: -math.expm1(-d)),
    "Morse": ("(1 - exp(-({0})))^2", lambda d: -2 * math.expm1(-d) * math.exp(-d)),
}
"""The potential of a spring that is longer by {0}, and its tension."""


@pytest.mark.parametrize("kick", [0.1, 1e-4, 1e-7])
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

    truth = kick * solve_ivp(flow, (0, 2), [0] * 4 + [1] + [0] * 3, "DOP853", rtol=3e-14, atol=1e-16).y[:, -1]
    found = [column[0] for column in (*orbit["q"].values(), *orbit["p"].values())]
    error = float(np.abs(found / truth - 1).max())
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
