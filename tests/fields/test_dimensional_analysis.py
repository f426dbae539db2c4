"""A parameter with a unit keeps its dimension wherever an expression carries it."""

from __future__ import annotations

import pytest

import rigidcli
from rigidcli.errors import DocumentError
from rigidcli.fields.dimensional_analysis import dimension_of
from rigidcli.fields.dimensions import ANGLE, LENGTH, MASS, MOMENT_OF_INERTIA, Dimension
from rigidcli.language.expression import parse

KNOWN = {"a": LENGTH, "b": LENGTH, "m": MASS, "theta": ANGLE}
AREA = Dimension(length=2)
DIMENSIONLESS = Dimension()


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


def test_plain_parameters_fit_everywhere() -> None:
    document = rigidcli.loads("parameters: {k: 3}\nbody: {shape: cube, side: k, mass: 2*k}\n")
    assert rigidcli.inertia(document)["mass"] == 6


def test_a_broken_sum_in_a_parameter_is_told_there() -> None:
    with pytest.raises(
        DocumentError, match=r"parameters\.c: a length \(m\) and a mass \(kg\) cannot be added"
    ):
        rigidcli.loads("parameters: {a: 3 cm, m: 2 kg, c: a + m}\nbody: {shape: cube, side: a, mass: m}\n")
