"""Documents in configs/ that have a system: what they promise, against derivations that share no code.

The equations of every document are compared with Euler and Lagrange's by sympy, which is not asked for H:
at random coordinates and velocities p = dL/dv, p' = dL/dq, H = p v - L. Orbits are compared with these
equations, integrated by scipy, and with figures that the comments of the documents promise.
"""

from __future__ import annotations

import json
import math
import random
from collections.abc import Callable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import pytest
import sympy
import yaml
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

import rigidcli
from rigidcli.language.expression import real
from rigidcli.language.parser import read
from rigidcli.language.text import reading
from rigidcli.render import Format, Look, renderer
from rigidcli.studies import hamilton
from tests.conftest import ROOT, printed

Floats = NDArray[np.float64]

CONFIGS = ROOT / "configs"


@cache
def raw(name: str) -> Any:
    return yaml.safe_load((CONFIGS / f"{name}.yaml").read_text())


@cache
def result(name: str, *settings: str) -> Any:
    """The JSON of a document."""
    report = hamilton.run(rigidcli.load(CONFIGS / f"{name}.yaml", settings=list(settings)))
    return json.loads("".join(renderer(Format.json)([report], Look())))


def derived(name: str) -> Any:
    """The JSON of a document, without its orbit."""
    return result(name, "orbit=null")


def value(text: str, point: Mapping[str, float]) -> float:
    return real(read(text)[0], point)


# --- H and the verdicts, as a person finds them


SYSTEMS = yaml.safe_load(Path(__file__).with_name("systems.yaml").read_text(encoding="utf-8"))

every = pytest.mark.parametrize("name", SYSTEMS)


def test_no_document_is_forgotten() -> None:
    systems = {path.stem: raw(path.stem).get("system", {}) for path in CONFIGS.glob("*.yaml")}
    # Those with forces, unknown functions and constraints are in tests/studies.
    others = {"forces", "functions", "constraints", "dissipation"}
    plain = {name for name, keys in systems.items() if keys and not keys.keys() & others}
    assert plain == set(SYSTEMS)


def random_point(name: str, generator: random.Random) -> dict[str, float]:
    """Values of parameters, time, coordinates and velocities; these are small beside a speed of light."""
    document = raw(name)
    names = [*document.get("parameters", {}), "t", *document["system"]["coordinates"]]
    point = {name: generator.uniform(0.5, 1.5) for name in names}
    return point | {f"{q}dot": generator.uniform(-0.4, 0.4) for q in document["system"]["coordinates"]}


@pytest.mark.parametrize("name", [name for name, system in SYSTEMS.items() if "written" in system])
def test_hamiltonian_is_printed_as_people_write_it(name: str) -> None:
    assert derived(name)["hamiltonian"] == SYSTEMS[name]["written"]


@pytest.mark.parametrize("name", ["double_pendulum", "relativistic_oscillator"])
def test_a_document_may_have_a_lagrangian_as_the_table_shows_it(name: str) -> None:
    told = derived(name)
    system = {"coordinates": told["coordinates"], "lagrangian": reading(read(told["lagrangian"])[0])}
    again = result(name, "orbit=null", f"system={json.dumps(system)}")
    assert again["hamiltonian"] == told["hamiltonian"]
    assert again["equations"] == told["equations"]


@every
def test_verdicts(name: str) -> None:
    found, expected = derived(name), SYSTEMS[name]
    assert found["conserved"] == expected["conserved"]
    assert found["cyclic"] == [p.removeprefix("p_") for p in expected["conserved"] if p != "H"]
    assert found["explicit_time"] is ("H" not in found["conserved"])
    assert (found["dH_dt"] == "0") is ("H" in found["conserved"])
    assert found["h_equals_energy"] is expected["energy"]
    assert found["natural"] is expected["natural"]
    assert expected["reason"] in found["natural_reason"]


# --- equations, by sympy


class Form(NamedTuple):
    """What a document says, in sympy."""

    symbols: dict[str, Any]
    coordinates: list[str]
    rates: list[str]
    lagrangian: Any
    total: Any
    momenta: list[Any]


@cache
def lagrangian(name: str) -> Form:
    """L, T + V and the momenta of a document, by sympy."""
    system, parameters = raw(name)["system"], raw(name).get("parameters", {})
    coordinates = system["coordinates"]
    rates = [f"{q}dot" for q in coordinates]
    symbols = {name: sympy.Symbol(name, real=True) for name in (*parameters, "t", *coordinates, *rates)}

    def expression(text: object) -> Any:
        return sympy.sympify(str(text), locals=symbols)

    def rate(position: Any) -> Any:
        return position.diff(symbols["t"]) + sum(
            position.diff(symbols[q]) * symbols[v] for q, v in zip(coordinates, rates, strict=True)
        )

    kinetic = expression(system.get("kinetic", 0))
    potential = expression(system.get("potential", 0))
    for particle in system.get("particles", ()):
        squares = sum(rate(expression(part)) ** 2 for part in particle.get("position", ()))
        kinetic += expression(particle.get("mass", 0)) * squares / 2
        turning = rate(expression(particle.get("angle", 0))) ** 2
        kinetic += expression(particle.get("moment_of_inertia", 0)) * turning / 2
        potential += expression(particle.get("potential", 0))
    moves = expression(system["lagrangian"]) if "lagrangian" in system else kinetic - potential
    momenta = [moves.diff(symbols[v]) for v in rates]
    return Form(symbols, coordinates, rates, moves, kinetic + potential, momenta)


@pytest.mark.parametrize("name", [name for name in SYSTEMS if "hamiltonian" not in raw(name)["system"]])
def test_equations_are_those_of_euler_and_lagrange(name: str) -> None:
    """dL/dv, dL/dq, H = p v - L and dH/dt; and T + V, where the document tells both."""
    found, form = derived(name), lagrangian(name)
    assert found["verified"] < 1e-12
    assert found["branches"] == []
    rates, size = [form.symbols[v] for v in form.rates], len(form.rates)
    wanted = [
        *form.momenta,
        *(form.lagrangian.diff(form.symbols[q]) for q in form.coordinates),
        sum(p * v for p, v in zip(form.momenta, rates, strict=True)) - form.lagrangian,
        -form.lagrangian.diff(form.symbols["t"]),
        form.total,
    ]
    truth = sympy.lambdify(list(form.symbols.values()), wanted, "math")
    has_total = not raw(name)["system"].keys().isdisjoint(["kinetic", "particles"])
    generator = random.Random(f"{name} moves")

    def near(number: float) -> Any:
        return pytest.approx(number, rel=1e-11, abs=1e-12)

    for _ in range(3):
        point = random_point(name, generator)
        known = [float(number) for number in truth(*(point[name] for name in form.symbols))]
        momenta, forces, (energy, slope, total) = known[:size], known[size : 2 * size], known[2 * size :]
        for p, momentum in zip(found["momenta"], momenta, strict=True):
            assert value(found["momentum_definitions"][p], point) == near(momentum)
        v = {v: point.pop(v) for v in found["velocities"]}
        here = point | dict(zip(found["momenta"], momenta, strict=True))
        for q, p, force in zip(found["coordinates"], found["momenta"], forces, strict=True):
            assert value(found["equations"][q], here) == near(v[f"{q}dot"])
            assert value(found["velocity_solutions"][f"{q}dot"], here) == near(v[f"{q}dot"])
            assert value(found["equations"][p], here) == near(force)
        assert value(found["hamiltonian"], here) == near(energy)
        assert value(found["dH_dt"], here) == near(slope)
        assert (abs(slope) > 1e-9) is found["explicit_time"]
        assert (found["energy"] is not None) is has_total
        if has_total:
            assert value(found["energy"], here) == near(total)
            assert found["h_equals_energy"] is (total == pytest.approx(energy, rel=1e-9))


# --- linear equations


def test_frequencies_of_the_chain() -> None:
    found = derived("chain_20")
    expected = 2 * math.sqrt(40 / 0.1) * np.sin(np.arange(1, 21) * np.pi / 42)
    np.testing.assert_allclose(sorted(found["frequencies"]), expected, rtol=1e-12)
    assert found["stability"] == "stable"
    assert len(found["eigenvalues"]) == 40


# --- orbits


class Samples(NamedTuple):
    """An orbit: times and the columns of coordinates and momenta."""

    t: Floats
    columns: dict[str, Floats]
    energy: Floats
    drift: dict[str, float]
    method: str


def orbit(name: str, *settings: str) -> Samples:
    found = result(name, *settings)["orbit"]
    columns = {key: np.array(values) for key, values in {**found["q"], **found["p"]}.items()}
    return Samples(np.array(found["t"]), columns, np.array(found["H"]), found["drift"], found["method"])


def integrated(name: str, t: Floats) -> dict[str, Floats]:
    """The orbit of a document: the accelerations of Euler and Lagrange, from sympy, integrated by scipy."""
    form, document = lagrangian(name), rigidcli.load(CONFIGS / f"{name}.yaml")
    values = {form.symbols[key]: float(number) for key, number in document.values.items()}
    rates = [form.symbols[v] for v in form.rates]
    places = [form.symbols[q] for q in form.coordinates]
    time, size = form.symbols["t"], len(rates)
    matrix = [p.diff(v) for p in form.momenta for v in rates]
    right = [
        form.lagrangian.diff(q)
        - p.diff(time)
        - sum(p.diff(a) * v for a, v in zip(places, rates, strict=True))
        for q, p in zip(places, form.momenta, strict=True)
    ]
    at = sympy.lambdify([time, *places, *rates], [e.subs(values) for e in (*matrix, *right)], "math")
    momenta = sympy.lambdify([time, *places, *rates], [p.subs(values) for p in form.momenta], "numpy")

    def slopes(t: float, y: Floats) -> Floats:
        found = np.array(at(t, *y))
        return np.append(y[size:], np.linalg.solve(found[:-size].reshape(size, size), found[-size:]))

    assert document.orbit is not None
    assert document.system is not None
    q, p, v = document.orbit.start(document.system)
    if v is None:
        zero = np.array(momenta(0.0, *q, *np.zeros(size)))
        mass = np.array(at(0.0, *q, *np.zeros(size)))[:-size].reshape(size, size)
        v = np.linalg.solve(mass, p - zero)
    atol = 1e-14 * np.append(np.maximum(np.abs(q), 1e-3), np.maximum(np.abs(v), 1e-3))
    y = solve_ivp(slopes, (0.0, t[-1]), np.append(q, v), "DOP853", t, rtol=1e-13, atol=atol).y
    rows = [*y[:size], *(np.broadcast_to(column, t.shape) for column in momenta(t, *y))]
    return dict(zip([*form.coordinates, *(f"p_{q}" for q in form.coordinates)], rows, strict=True))


ORBITS = [name for name, system in SYSTEMS.items() if "orbit" in system]


def test_no_orbit_is_forgotten() -> None:
    with_orbit = {name for name in SYSTEMS if "orbit" in raw(name)}
    # An ensemble has no orbit of its own (test_ensembles); a section is in test_events.
    assert with_orbit == {
        *ORBITS,
        "henon_heiles",
        "pendulum_swarm",
        "henon_heiles_section",
        "double_pendulum_section",
    }


@pytest.mark.parametrize("name", ORBITS)
def test_orbit(name: str) -> None:
    found = orbit(name)
    expected = integrated(name, found.t)
    assert list(found.columns) == [*derived(name)["coordinates"], *derived(name)["momenta"]]
    assert found.columns.keys() == expected.keys()
    for key, column in expected.items():
        size = float(np.abs(column).max())
        np.testing.assert_allclose(
            found.columns[key], column, rtol=0, atol=SYSTEMS[name]["orbit"] * size, err_msg=key
        )


@pytest.mark.parametrize("name", [*ORBITS, "henon_heiles"])
def test_orbit_keeps_what_is_conserved(name: str) -> None:
    """Where H changes, its drift is that of the balance, and as small."""
    found = orbit(name)
    conserved, further = derived(name)["conserved"], derived(name)["invariants"] or []
    assert found.drift.keys() == {"H", *conserved, *further}
    assert max(found.drift.values()) < 1e-11
    for momentum in conserved:
        if momentum != "H":
            column = found.columns[momentum]
            np.testing.assert_allclose(column, column[0], rtol=1e-12)
    if "H" not in conserved:
        assert np.ptp(found.energy) > 1e-3 * np.abs(found.energy).max()


# --- what the comments in the documents promise


def test_without_a_radius_the_bead_falls_freely() -> None:
    """J. R. Taylor, Classical Mechanics, problem 13.5: the special case R = 0."""
    found = orbit("taylor_13_05", "parameters.R=0")
    np.testing.assert_allclose(0.1 * (found.columns["phi"] - 10 * np.pi), -4.9 * found.t**2, atol=1e-12)


AU, YEAR = 149597870700.0, 365.25 * 86400

FIGURES: list[tuple[str, str, Callable[[Samples], float], str]] = [
    ("kepler_polar", "orbit.samples=1001", lambda found: found.columns["r"].max() / AU, "35.08"),
    ("kepler_polar", "orbit.samples=1001", lambda found: found.t[-1] / YEAR, "75.32"),
    (
        "spherical_pendulum",
        "orbit.samples=1001",
        lambda found: np.degrees(found.columns["theta"].max()),
        "60.77",
    ),
    ("bead_on_hoop", "orbit.samples=30001", lambda found: np.degrees(found.columns["theta"].max()), "90.93"),
]


@pytest.mark.parametrize(("name", "setting", "figure", "expected"), FIGURES)
def test_figures(name: str, setting: str, figure: Callable[[Samples], float], expected: str) -> None:
    """The extremes of orbits that the comments of the documents name."""
    assert figure(orbit(name, setting)) == printed(expected)


@pytest.mark.parametrize(
    ("name", "key", "period"),
    [
        ("kepler_polar", "r", 75.32),
        ("spherical_pendulum", "theta", 1.08145211),
        ("relativistic_oscillator", "x", 10.03692585),
        ("bead_on_hoop", "theta", 1.27376102),
    ],
)
def test_orbits_come_back_after_their_period(name: str, key: str, period: float) -> None:
    times = [] if name == "kepler_polar" else ["orbit.samples=null", "orbit.duration=null"]
    times += [] if name == "kepler_polar" else [f"orbit.times=[0, {period}]"]
    column = orbit(name, *times).columns[key]
    assert column[-1] == pytest.approx(column[0], rel=1e-7)


def test_the_top_nods_as_precess_says() -> None:
    """The limits and the period of theta, by the command that works them out without an orbit."""
    top = rigidcli.precess(rigidcli.load(CONFIGS / "top_cuspidal.yaml"))["top"]
    period = float(top["nutation_period"])
    assert math.degrees(top["theta_max"]) == printed("31.80")
    assert 1000 * period == printed("76.75")
    times = ["orbit.samples=null", "orbit.duration=null", f"orbit.times=[0, {period / 2!r}, {period!r}]"]
    found = orbit("top_euler_angles", *times)
    np.testing.assert_allclose(
        found.columns["theta"], [math.pi / 6, top["theta_max"], math.pi / 6], rtol=1e-9
    )


def test_order_in_the_galaxy() -> None:
    """The first tenth of the orbit by Newton's equations; all of it at E = 1/12."""
    found = orbit("henon_heiles")
    assert "Gauss-Legendre" in found.method
    np.testing.assert_allclose(found.energy, 1 / 12, rtol=1e-12)
    early = found.t <= 100
    for key, column in integrated("henon_heiles", found.t[early]).items():
        np.testing.assert_allclose(found.columns[key][early], column, atol=1e-10)


# --- changes of variables


def test_the_action_of_an_oscillator_that_is_not_harmonic() -> None:
    """K = P + 4 b P^2 sin(Q)^4, by putting in; Q' and P' by the chain rule from q' and p'."""
    found = derived("taylor_13_25")["transform"]
    b, Q, P = 0.7, 0.6, 1.3
    point = {"b": b, "Q": Q, "P": P}
    assert value(found["hamiltonian"], point) == pytest.approx(P + 4 * b * P**2 * math.sin(Q) ** 4, rel=1e-13)
    q, p = math.sqrt(2 * P) * math.sin(Q), math.sqrt(2 * P) * math.cos(Q)
    slope = -q - 4 * b * q**3
    # tan(Q) = q/p and P = (q^2 + p^2)/2.
    assert value(found["equations"]["Q"], point) == pytest.approx((p * p - q * slope) / (2 * P), rel=1e-13)
    assert value(found["equations"]["P"], point) == pytest.approx(q * p + p * slope, rel=1e-13)
