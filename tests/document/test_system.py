"""The sections `system`, `orbit` and `transform` as they are read and refused."""

from __future__ import annotations

import math
import time

import pytest

from rigidcli.document.document import Document
from rigidcli.document.load import loads
from rigidcli.document.system import Orbit, System
from rigidcli.errors import DocumentError, UsageError
from rigidcli.language.expression import Expression
from rigidcli.studies.common import require_values
from tests.refusals import problems, told

SPRING = "system: {coordinates: [x], lagrangian: m*xdot**2/2 - k*x**2/2}\n"
FREE = "system: {coordinates: [x, y], kinetic: xdot**2/2 + ydot**2/2}\n"
VALUES = "parameters: {m: 1, k: 4}\n"


def keys(text: str) -> set[str]:
    return {problem.key for problem in problems(text)}


def system_of(text: str) -> System:
    system = loads(text).system
    assert system is not None
    return system


def orbit_of(text: str, system: str = VALUES + SPRING) -> Orbit:
    orbit = loads(f"{system}orbit: {{{text}}}\n").orbit
    assert orbit is not None
    return orbit


# --- numbers


def test_numbers_and_quantities_are_expressions() -> None:
    """120 g cm^2 is 1.2e-5 kg m^2; an angle in degrees is a multiple of pi, exactly."""
    (particle,) = (
        system_of(
            "system: {coordinates: [x], particles: "
            "[{mass: 250 g, position: [x, 5 cm, -1e-3], moment_of_inertia: 120 g cm^2, angle: 30 deg}]}\n"
        ).particles
        or ()
    )
    assert particle.mass is not None
    assert particle.position is not None
    assert particle.moment_of_inertia is not None
    assert particle.angle is not None
    values = [part.evaluate({"x": 7.0}) for part in (particle.mass, *particle.position)]
    assert values == [0.25, 7.0, 0.05, -1e-3]
    assert particle.moment_of_inertia.evaluate({}) == 1.2e-5
    assert particle.angle.evaluate({}) == pytest.approx(math.pi / 6, rel=1e-15)
    assert particle.angle.text == "1/6*pi"


def defined(text: str) -> tuple[Document, Expression]:
    """A document with the parameter v, and what v is said to be."""
    document = loads(
        f"parameters: {{v: {text}}}\nsystem: {{coordinates: [x], lagrangian: xdot**2/2 - v*x}}\n"
    )
    definition = document.definitions["v"]
    assert definition is not None
    return document, definition


def test_a_quantity_that_is_no_decimal_stays_a_fraction() -> None:
    """A kilometre an hour is 5/18 m/s, which has no last digit."""
    assert defined("1 kph")[1].text == "5/18"


@pytest.mark.parametrize("text", ["-250 deg", "1e-300 deg^2", "5e-324 m", "-12 rpm", "2 1/deg", "1e300 kph"])
def test_a_definition_is_worth_the_value(text: str) -> None:
    document, definition = defined(text)
    assert definition.evaluate({}) == pytest.approx(document.values["v"], rel=1e-15, abs=1e-323)


def test_so_many_coordinates_are_the_most() -> None:
    names = [f"x{n}" for n in range(129)]
    assert len(system_of(f"system: {{coordinates: [{', '.join(names[:128])}], kinetic: 0}}\n").momenta) == 128
    key, message = told(f"system: {{coordinates: [{', '.join(names)}], kinetic: 0}}\n")
    assert key == "system.coordinates"
    assert "1 to 128 coordinates" in message


def test_hostile_mappings_are_refused_in_time() -> None:
    many = ", ".join(f"y{n}: {n}" for n in range(20_000))
    names = ", ".join(f"y{n}" for n in range(20_000))
    for section in (
        f"orbit: {{duration: 1, initial: {{{many}}}}}",
        f"transform: {{new_variables: [Q, P, R, S], old: {{{many}}}}}",
        f"transform: {{new_variables: [{names}], old: {{x: 1, y: 1, p_x: 1, p_y: 1}}}}",
    ):
        begin = time.perf_counter()
        assert problems(f"{FREE}{section}\n")
        # Reading YAML of this size takes most of it.
        assert time.perf_counter() - begin < 3


# --- names that collide


def test_coordinates_may_be_called_like_nothing_special() -> None:
    names = "E, I, S, N, Q, beta, gamma, lambda, x, y_1, _z"
    system = system_of(f"system: {{coordinates: [{names}], kinetic: E*x + Edot}}\n")
    assert ", ".join(system.coordinates) == names


def test_all_problems_are_told_at_once() -> None:
    assert keys(
        "parameters: {m: , p_x: 2, sin: 3}\n"
        "system: {coordinates: [x, xdot, t], lagrangian: 'x+', foo: 1, particles: [{mass: m}]}\n"
        "orbit: {initial: {x: 1 furlng}}\n"
        "transform: {old: {}, new_variables: [Q]}\n"
    ) == {
        "parameters.p_x",
        "parameters.sin",
        "system",
        "system.foo",
        "system.coordinates.1",
        "system.coordinates.2",
        "system.lagrangian",
        "system.particles.0.position",
        "orbit.duration",
        "orbit.initial.x",
        "transform.new_variables",
    }


# --- parameters


def test_parameters_without_a_value_need_no_exact_numbers() -> None:
    document = loads(f"parameters: {{m: , k: 4.10, w: sqrt(k/m), unused: , also: 3}}\n{SPRING}")
    assert not document.arithmetic.exact
    assert document.exact_results
    assert document.symbols == ("m",)
    assert document.values == {"k": 4.1, "also": 3.0}
    assert document.notes == (
        "parameter `also` is not used",
        "parameter `unused` is not used",
        "parameter `w` is not used",
    )
    definitions = document.definitions
    assert list(definitions).index("w") > max(list(definitions).index(name) for name in "mk")
    assert definitions["m"] is None
    assert definitions["k"] is not None
    assert definitions["k"].text == "4.10"
    assert definitions["w"] is not None
    assert definitions["w"].names == {"k", "m"}


def test_exact_results_may_be_asked_for() -> None:
    document = loads(f"{VALUES}{SPRING}orbit: {{initial: {{x: 1, p_x: 0}}, duration: 2}}\n", exact=True)
    assert document.exact_results
    assert not document.arithmetic.exact
    require_values(document, "an orbit")


def test_a_body_beside_the_system_is_worked_exactly() -> None:
    document = loads(f"parameters: {{m: , k: }}\nbody: {{shape: cube, side: 1, mass: m}}\n{SPRING}")
    assert document.arithmetic.exact
    assert document.symbols == ("m", "k")
    with pytest.raises(DocumentError):
        require_values(document, "an orbit")
    document = loads(f"{VALUES}body: {{shape: cube, side: 1, mass: m}}\n{SPRING}", exact=True)
    with pytest.raises(UsageError, match="no exact results"):
        require_values(document, "an orbit")


# --- orbits


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1", 1.0),
        ("30 deg", math.pi / 6),
        ("-12 rpm", -0.4 * math.pi),
        ("pi/6", math.pi / 6),
        ("k/m + 1", 5.0),
    ],
)
def test_an_initial_value_may_have_any_dimension(text: str, value: float) -> None:
    orbit = orbit_of(f"initial: {{x: {text}, p_x: 0}}, duration: 10")
    assert isinstance(orbit.initial, dict)
    assert orbit.initial["x"] == pytest.approx(value, rel=1e-15)


def test_what_the_initial_values_lack_is_told_name_by_name() -> None:
    assert keys(f"{FREE}orbit: {{initial: {{p_x: 0}}, duration: 1}}\n") == {
        "orbit.initial.x",
        "orbit.initial.y",
        "orbit.initial.p_y",
    }
    assert keys(f"{FREE}orbit: {{initial: {{x: 1, y: 0, ydot: 0}}, duration: 1}}\n") == {"orbit.initial.xdot"}
    key, message = told(f"{FREE}orbit: {{initial: {{x: 1, y: 0, p_x: 0, ydot: 0}}, duration: 1}}\n")
    assert key == "orbit.initial"
    assert "mixed: read p_x and ydot" in message
    assert "all momenta (p_x, p_y) or all velocities (xdot, ydot)" in message


def test_initial_values_may_have_greek_names_but_once() -> None:
    system = "system: {coordinates: [theta], kinetic: thetadot**2}\n"
    assert orbit_of("initial: {θ: 1, θdot: 2}, duration: 1", system).initial == {"theta": 1, "thetadot": 2}
    key, message = told(f"{system}orbit: {{initial: {{θ: 1, theta: 1, thetadot: 2}}, duration: 1}}\n")
    assert key == "orbit.initial.theta"
    assert "another spelling" in message


def test_an_orbit_needs_the_values_of_the_parameters() -> None:
    document: Document = loads(
        f"parameters: {{m: , k: , w: sqrt(k/m), b: }}\n{SPRING}"
        "orbit: {initial: {x: 1, p_x: 0}, duration: 2}\n"
    )
    with pytest.raises(DocumentError) as caught:
        require_values(document, "an orbit")
    assert {(problem.key, problem.message) for problem in caught.value.problems} == {
        ("parameters.m", "missing: an orbit needs its value"),
        ("parameters.k", "missing: an orbit needs its value"),
    }
    require_values(loads(f"{VALUES}{SPRING}orbit: {{initial: {{x: 1, p_x: 0}}, duration: 2}}\n"), "an orbit")


def test_a_change_of_variables_may_be_written_in_any_order() -> None:
    for given, names in (("old: {p_x: P, x: Q}", ["x", "p_x"]), ("new: {P: p_x, Q: x}", ["Q", "P"])):
        transform = loads(f"{VALUES}{SPRING}transform: {{new_variables: [Q, P], {given}}}\n").transform
        assert transform is not None
        assert [*(transform.old or transform.new or ())] == names
