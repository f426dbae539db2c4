"""Dimensions: what fits a field, what messages call it, and how expressions carry it on."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

import rigidcli
from rigidcli.errors import DocumentError, ValueProblem
from rigidcli.fields import dimensions
from rigidcli.fields.dimensions import (
    ANGLE,
    ANGULAR_VELOCITY,
    DIMENSIONLESS,
    FREQUENCY,
    LENGTH,
    MASS,
    USUAL_NAMES,
    Dimension,
    check_dimension,
    dimension_of,
)
from rigidcli.fields.units import parse_unit
from rigidcli.language.expression import parse
from tests.tables import rows_of


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
    rows_of(__file__, "what does not fit"),
)
def test_what_does_not_fit(text: str, expected: str, message: str) -> None:
    with pytest.raises(ValueProblem) as caught:
        check_dimension(parse_unit(text).text, parse_unit(text).dimension, getattr(dimensions, expected))
    assert caught.value.message == message


@pytest.mark.parametrize("text", ["Hz", "kHz", "megahertz", "kilohertz"])
def test_hertz_is_no_angular_velocity(text: str) -> None:
    with pytest.raises(ValueProblem, match=r"is a frequency .Hz., expected an angular velocity") as caught:
        check_dimension(parse_unit(text).text, parse_unit(text).dimension, ANGULAR_VELOCITY)
    assert caught.value.hint == "a hertz may count turns or radians, 2 pi apart: write `rev/s` or `rad/s`"


def test_the_unit_in_a_dimension_s_name_is_of_that_dimension() -> None:
    for dimension, name in USUAL_NAMES.items():
        if dimension != DIMENSIONLESS:
            unit = parse_unit(name[name.index("(") + 1 : -1])
            assert (unit.dimension, unit.scale) == (dimension, 1.0)


@given(st.tuples(*[st.integers(-3, 3)] * 5))
def test_an_unnamed_dimension_prints_its_si_unit(powers: tuple[int, ...]) -> None:
    mass, length, time, angle, current = powers
    dimension = Dimension(mass, length, time, angle, current=current)
    if dimension not in USUAL_NAMES:
        assert parse_unit(str(dimension)).dimension == dimension


# --- what follows from the parameters with units


KNOWN = {"a": LENGTH, "b": LENGTH, "m": MASS, "theta": ANGLE}


@pytest.mark.parametrize(("text", "unit"), rows_of(__file__, "follows from the parameters"))
def test_follows_from_the_parameters(text: str, unit: str | None) -> None:
    assert dimension_of(parse(text).root, KNOWN) == (unit and parse_unit(unit).dimension)


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
