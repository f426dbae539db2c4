"""Identities hold at all points of the finite field, and nothing else does."""

from __future__ import annotations

import pytest

from rigidcli.algebra.expressions import symbol
from rigidcli.algebra.field import P, Point, depends_on_signs, height, reduced
from rigidcli.algebra.reading import from_tree
from rigidcli.language.expression import parse

SYMBOLS = {name: symbol(name, name in ("m", "k")) for name in ("m", "k", "x", "y")}


def values(text: str, count: int = 40) -> list[int]:
    """The values at the points that have one."""
    e = from_tree(parse(text).root, SYMBOLS)
    found = []
    for seed in range(20 * count):
        point = Point(str(seed), {})
        point.values |= {name: point.square(name) for name in ("m", "k")}
        try:
            found.append(point.value(e))
        except ValueError:
            continue
    return found[:count]


@pytest.mark.parametrize(
    "text",
    [
        "sin(x)^2 + cos(x)^2 - 1",
        "sin(2*x - y/2) - 2*sin(x)*cos(x)*cos(y/2) + cos(2*x)*sin(y/2)",
        "cos(x - pi/2) - sin(x)",
        "tan(x)*cos(x) - sin(x)",
        "exp(x)*exp(-x/2) - exp(x/2)",
        "cosh(x)^2 - sinh(x)^2 - 1",
        "tanh(x)*cosh(x) - sinh(x)",
        "sqrt(k/m) - sqrt(k)/sqrt(m)",
        "sqrt((1 + x^2)*(2 + y^2)) - sqrt(1 + x^2)*sqrt(2 + y^2)",
        "sqrt(8) - 2*sqrt(2)",
        "sqrt(x^2) - abs(x)",
        "abs(x)*sign(x) - x",
        "log(k/m) - log(k) + log(m)",
        "m^x*m^y - m^(x + y)",
        "1/(x - y) - (x + y)/(x^2 - y^2)",
        "atan((x + 1)^2) - atan(x^2 + 2*x + 1)",
    ],
)
def test_identities_hold_at_all_points(text: str) -> None:
    assert set(values(text)) == {0}


@pytest.mark.parametrize(
    "text",
    [
        "3*x^2/(2*m) - 0.25*k*y/(x - y)",
        "cos(x - y)*sin(x - y)^2 - exp(-x/2)*tan(2*y)",
        "atan(x)*log(m)/sqrt(k/m)",
    ],
)
def test_a_tree_has_the_value_of_its_expression(text: str) -> None:
    point = Point("seed", {})
    point.values |= {name: point.square(name) for name in ("m", "k")}
    root = parse(text).root
    assert point.of_tree(root, SYMBOLS) == point.value(from_tree(root, SYMBOLS)) != 0


def test_a_tree_has_none_where_signs_decide() -> None:
    with pytest.raises(ValueError, match="positive"):
        Point("seed", {}).of_tree(parse("abs(x) - x").root, SYMBOLS)


def test_multiples_of_the_number_of_elements_are_too_high() -> None:
    """They are zero in the field, however they are written."""
    third = 10**9
    nested = f"(((({P // third**4})*{third} + {P // third**3 % third})*{third} + {P // third**2 % third})"
    nested += f"*{third} + {P // third % third})*{third} + {P % third}"
    for text in (str(P), nested, nested.replace("+", "*x/x +")):
        tree = parse(f"x*({text})*0.1^80").root
        assert Point("seed", {}).of_tree(tree, SYMBOLS) == 0
        assert max(height(tree, SYMBOLS)) > P.bit_length()
    assert height(parse("(3*x^2 - y/5)/(2*m)").root, SYMBOLS) < (10, 10)


@pytest.mark.parametrize(
    "text",
    [
        "sqrt(x^2) - x",
        "abs(x) + x",
        "sin(x)^2 - cos(x)^2",
        "exp(x)*exp(y) - exp(x*y)",
        "x/1e300",
        "log(x) - x",
    ],
)
def test_what_is_no_identity_fails_at_some_point(text: str) -> None:
    assert any(values(text))


def test_what_depends_on_signs_is_told() -> None:
    for text, expected in (
        ("sqrt(m*k)", False),
        ("sin(x)/m", False),
        ("sqrt(1 + x^2)", True),
        ("abs(x)", True),
    ):
        assert depends_on_signs(from_tree(parse(text).root, SYMBOLS)) == expected


def test_rows_are_reduced_to_their_rank() -> None:
    assert reduced([[2, 4, 6], [1, 2, 3], [0, 1, P - 1]]) == {0: [1, 0, 5], 1: [0, 1, P - 1]}
