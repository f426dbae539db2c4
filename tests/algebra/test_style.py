"""Decimals that come back as decimals: texts that people typed, and the values of what is written."""

from __future__ import annotations

import json
from fractions import Fraction

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidcli.algebra.expressions import number, symbol
from rigidcli.algebra.trees import Style
from rigidcli.language.expression import parse
from tests.conftest import Program
from tests.tables import pairs_of

DECIMAL = Style(decimal=True)

x, m = symbol("x", True), symbol("m", True)


COEFFICIENTS = """
37/100 -> 0.37*x   37/20 -> 1.85*x   -37/20 -> -1.85*x   3/2 -> 1.5*x   1/2 -> x/2   1/10 -> 0.1*x
50/37 -> x/0.74   1/3 -> x/3   2/3 -> 2*x/3   7 -> 7*x   1/1000000000 -> 1e-9*x   300000000 -> 300000000*x
10000000000000000 -> 1e16*x   -250000000000000000000 -> -2.5e20*x
"""


@pytest.mark.parametrize(("coefficient", "written"), pairs_of(COEFFICIENTS))
def test_coefficients(coefficient: str, written: str) -> None:
    assert str((number(Fraction(coefficient)) * x).styled(DECIMAL)) == written


@given(st.fractions(max_denominator=10**6), st.integers(-3, 3))
def test_the_value_stays(coefficient: Fraction, exponent: int) -> None:
    e = coefficient * x * m**exponent + coefficient**2 / (x + coefficient)
    values = {"x": 0.7, "m": 1.3}
    assert parse(str(e.styled(DECIMAL))).evaluate(values) == pytest.approx(
        float(e.evaluate(**values)), rel=1e-12
    )


SYSTEM = "system: {coordinates: [x], lagrangian: 0.37*xdot**2 - 1.85*x**2}"


def test_a_system_with_decimals_is_told_in_decimals(program: Program) -> None:
    result = json.loads(program("hamilton", "-", "-f", "json", stdin=SYSTEM).out)
    assert result["hamiltonian"] == "p_x**2/1.48 + 1.85*x**2"
    assert result["equations"] == {"x": "p_x/0.74", "p_x": "-3.7*x"}
    assert result["matrix"] == [["0", "1/0.74"], ["-3.7", "0"]]
    assert "1.85 x^2" in program("hamilton", "-", stdin=SYSTEM).out


@pytest.mark.parametrize("document", [SYSTEM, SYSTEM.replace("0.37", "37/100").replace("1.85", "37/20")])
def test_rationals_stay_where_they_were_typed_or_asked_for(document: str, program: Program) -> None:
    options = ["--exact"] if "." in document else []
    out = program("hamilton", "-", *options, stdin=document).out
    assert "25 p_x^2/37 + 37 x^2/20" in out
