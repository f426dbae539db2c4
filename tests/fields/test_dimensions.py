"""Dimensions: what fits a field, what does not, and the names that messages have for them."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidcli.errors import ValueProblem
from rigidcli.fields.dimensions import (
    ANGLE,
    ANGULAR_VELOCITY,
    DIMENSIONLESS,
    FREQUENCY,
    LENGTH,
    MASS,
    NAMES,
    TIME,
    Dimension,
    check_dimension,
)
from rigidcli.fields.units import parse_unit


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
