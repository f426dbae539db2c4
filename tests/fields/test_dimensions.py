"""Dimensions: what fits a field, what messages call it, and how expressions carry it on."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import rigidcli
from rigidcli.errors import DocumentError, ValueProblem
from rigidcli.fields.dimensions import (
    ANGLE,
    ANGULAR_VELOCITY,
    AREA,
    DIMENSIONLESS,
    FREQUENCY,
    LENGTH,
    MASS,
    MOMENT_OF_INERTIA,
    NAMES,
    TIME,
    Dimension,
    check_dimension,
    dimension_of,
)
from rigidcli.fields.units import parse_unit
from rigidcli.language.expression import parse


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("cm", LENGTH),
        ("rpm", ANGULAR_VELOCITY),
        ("1/s", ANGULAR_VELOCITY),
        ("m/m", ANGLE),
        ("kg m^2 rad/s", parse_unit("kg m^2/s").dimension),
        ("N m/rad", parse_unit("N m/rad").dimension),
        ("N m", parse_unit("N m/rad").dimension),
        ("kHz", FREQUENCY),
    ],
)
def test_what_fits(text: str, expected: Dimension) -> None:
    check_dimension(parse_unit(text).text, parse_unit(text).dimension, expected)


@pytest.mark.parametrize(
    ("text", "expected", "message"),
    [
        ("kg", LENGTH, "`kg` is a mass (kg), expected a length (m)"),
        ("deg", LENGTH, "`deg` is an angle (rad), expected a length (m)"),
        ("deg", DIMENSIONLESS, "`deg` is an angle (rad), expected a pure number"),
        ("deg^2", ANGLE, "`deg^2` is a quantity in rad^2, expected an angle (rad)"),
        ("s", ANGLE, "`s` is a time (s), expected an angle (rad)"),
        ("kg m/s^3", TIME, "`kg m/s^3` is a quantity in kg m/s^3, expected a time (s)"),
        ("kg m^2", MASS, "`kg m^2` is a moment of inertia (kg m^2), expected a mass (kg)"),
        ("1/s", TIME, "`1/s` is a quantity in 1/s, expected a time (s)"),
        ("1/s", FREQUENCY, "`1/s` is a quantity in 1/s, expected a frequency (Hz)"),
    ],
)
def test_what_does_not_fit(text: str, expected: Dimension, message: str) -> None:
    with pytest.raises(ValueProblem) as caught:
        check_dimension(parse_unit(text).text, parse_unit(text).dimension, expected)
    assert caught.value.message == message


@pytest.mark.parametrize("text", ["Hz", "kHz", "megahertz", "kilohertz"])
def test_hertz_is_no_angular_velocity(text: str) -> None:
    with pytest.raises(ValueProblem, match=r"is a frequency .Hz., expected an angular velocity") as caught:
        check_dimension(parse_unit(text).text, parse_unit(text).dimension, ANGULAR_VELOCITY)
    assert caught.value.hint == "a hertz may count turns or radians, 2 pi apart: write `rev/s` or `rad/s`"


def test_the_unit_in_a_dimension_s_name_is_of_that_dimension() -> None:
    for dimension, name in NAMES.items():
        if dimension != DIMENSIONLESS:
            unit = parse_unit(name[name.index("(") + 1 : -1])
            assert (unit.dimension, unit.scale) == (dimension, 1.0)


@given(st.tuples(*[st.integers(-3, 3)] * 5))
def test_an_unnamed_dimension_prints_its_si_unit(powers: tuple[int, ...]) -> None:
    mass, length, time, angle, current = powers
    dimension = Dimension(mass, length, time, angle, current=current)
    if dimension not in NAMES:
        assert parse_unit(str(dimension)).dimension == dimension


# --- what follows from the parameters with units


KNOWN = {"a": LENGTH, "b": LENGTH, "m": MASS, "theta": ANGLE}


@pytest.mark.parametrize(
    ("text", "dimension"),
    [
        ("a", LENGTH),
        ("-a/2", LENGTH),
        ("2*pi*a*sin(theta)", LENGTH),
        ("a + 1", LENGTH),
        ("1 + a - b", LENGTH),
        ("a*b", AREA),
        ("a^2", AREA),
        ("m*a**2/12", MOMENT_OF_INERTIA),
        ("m*(a^2 + b^2)/12", MOMENT_OF_INERTIA),
        ("sqrt(a*b)", LENGTH),
        ("sqrt(a^2 + b^2)", LENGTH),
        ("abs(-a)", LENGTH),
        ("a^-1", Dimension(length=-1)),
        ("a/b", DIMENSIONLESS),
        ("a*theta", Dimension(length=1, angle=1)),
        ("a*theta + b", Dimension(length=1, angle=1)),
        ("2*exp(-a/b)*m", MASS),
        ("2*3", None),  # a plain number is in SI units of whatever fits
        ("7", None),
        ("k*a", None),  # and so is a parameter that was given as one
        ("a^k", None),
        ("sqrt(a)", None),
        ("sin(theta)", None),
    ],
)
def test_follows_from_the_parameters(text: str, dimension: Dimension | None) -> None:
    assert dimension_of(parse(text).root, KNOWN) == dimension


@pytest.mark.parametrize("text", ["a + m", "a - a^2", "sin(a)", "exp(m)", "atan2(a, m)", "2*(a + m)"])
def test_what_makes_no_sense_is_refused(text: str) -> None:
    with pytest.raises(ValueError, match=r"cannot be added|expected an angle"):
        dimension_of(parse(text).root, KNOWN)


def test_a_length_is_no_mass() -> None:
    with pytest.raises(DocumentError) as refused:
        rigidcli.loads("parameters: {a: 3 cm, b: 2*a}\nbody: {shape: cube, side: a, mass: b}\n")
    (problem,) = refused.value.problems
    assert (problem.line, problem.key) == (2, "body.mass")
    assert problem.message == "`b` is a length (m), expected a mass (kg)"


def test_a_broken_sum_in_a_parameter_is_told_there() -> None:
    with pytest.raises(
        DocumentError, match=r"parameters\.c: a length \(m\) and a mass \(kg\) cannot be added"
    ):
        rigidcli.loads("parameters: {a: 3 cm, m: 2 kg, c: a + m}\nbody: {shape: cube, side: a, mass: m}\n")
