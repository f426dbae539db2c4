"""Values of expressions, and the bounds of their errors, against mpmath with 50 digits."""

from __future__ import annotations

import math
import pickle
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.grading.values import Estimate, Points
from rigidcli.language.functions import FUNCTIONS
from rigidcli.language.parser import read
from rigidcli.language.tree import Call, Name, Node
from tests.trees import CONTEXT, NAMES, TREES, NoValueError, value

thorough = settings(max_examples=120, deadline=None)

FLOATS = st.floats(-4, 4, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-6)
STATES = st.fixed_dictionaries(dict.fromkeys(NAMES, FLOATS))


def points(point: Mapping[str, float]) -> Points:
    return Points({name: np.array([x]) for name, x in point.items()}, {}, 1)


def found_at(text: str, **point: float) -> Estimate:
    return points(point or {"x": 1.3}).at(read(text)[0])


def truth(node: Node, point: Mapping[str, float], edge: float = 1e-20) -> Any:
    """The value with 50 digits, None where there is certainly or possibly none."""
    try:
        return value(node, {name: Fraction(x) for name, x in point.items()}, edge)
    except NoValueError:
        return None


@thorough
@given(TREES, STATES)
def test_the_value_is_within_its_error(node: Node, point: dict[str, float]) -> None:
    right = truth(node, point)
    if right is None:
        return
    for found in (points(point).roughly_at(node), points(point).at(node), points(point).finely_at(node)):
        assert not found.undefined[0]
        if found.known[0]:
            # The truth has 50 digits, of numbers up to 1e20.
            gap = abs(CONTEXT.mpf(float(found.value[0])) - right)
            assert gap <= CONTEXT.mpf(float(found.error[0])) * (1 + 1e-9) + 1e-25 * (1 + abs(right))


@pytest.mark.parametrize("function", [name for name in FUNCTIONS if name != "atan2"])
@pytest.mark.parametrize("x", [-0.93, -0.2, -1e-9, 1e-9, 0.4, 0.999, 1.0001, 1.7, 12.5, 300.0])
def test_each_function_is_the_one_that_is_meant(function: str, x: float) -> None:
    node = Call(function, (Name("x"),))
    right, found = truth(node, {"x": x}, edge=1e-300), points({"x": x}).at(node)
    assert bool(found.undefined[0]) == (right is None)
    if right is not None:
        assert float(found.value[0]) == pytest.approx(float(right), rel=1e-15)
        assert float(found.balls[0].rad()) < 1e-30 * (1 + abs(float(right)))


@pytest.mark.parametrize(
    ("y", "x"), [(1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (-1.0, 2.0), (3.0, 0.0), (-3.0, 0.0), (1e-9, -1.0)]
)
def test_the_angle_is_in_its_quadrant(y: float, x: float) -> None:
    found = found_at("atan2(y, x)", y=y, x=x)
    assert not found.doubtful[0]
    assert float(found.value[0]) == pytest.approx(math.atan2(y, x), rel=1e-15)


# --- what is known of an error


@pytest.mark.parametrize(
    "text", ["(x + 1e16) - 1e16", "(x + 1e40) - 1e40", "x + 1e100 - 1e100*sin(x + pi/2 - x)"]
)
def test_terms_that_cancel_are_worked_with_more_digits(text: str) -> None:
    assert float(found_at(text).value[0]) == 1.3


def test_a_hidden_zero_has_a_small_error() -> None:
    found = found_at("sin(x)^2 + cos(x)^2 - 1")
    assert not found.differs[0]
    assert found.error[0] < 1e-150


@pytest.mark.parametrize(
    "text",
    [
        "1/0", "0**-1", "1/(x - x)", "log(-1)", "sqrt(-x)", "x^0.5/0", "(-x)^(1/2)", "log(0)", "asin(1 + x)",
        "acosh(x - x)", "atanh(1)", "0*log(-x)", "(-x)^x", "(x - x)^-x",
    ],
)  # fmt: skip
def test_what_has_no_value_is_known_to_have_none(text: str) -> None:
    found = found_at(text)
    assert found.undefined[0]
    assert not found.doubtful[0]
    assert not found.known[0]


@pytest.mark.parametrize(
    "text",
    [
        "1/(sin(x)^2 + cos(x)^2 - 1)", "sqrt(x/a*a - x)", "log(sin(x)^2 + cos(x)^2 - 1)",
        "exp(exp(exp(10*x)))", "acos(sin(x)^2 + cos(x)^2)", "1e9999 - 1e9999", "exp(1e3)", "10^10^10",
    ],
)  # fmt: skip
def test_what_no_float_is_near_is_doubtful(text: str) -> None:
    found = found_at(text, x=1.3, a=0.7)
    assert found.doubtful[0]
    assert not found.undefined[0]


@pytest.mark.parametrize("text", ["exp(1e3)", "10^10^10", "exp(-1e9*x^2)", "1e-999*x", "exp(exp(100*x))"])
def test_what_is_beyond_floats_has_a_ball(text: str) -> None:
    found = found_at(text)
    assert found.known[0]
    assert found.differs[0]
    assert found.minus(found_at(f"2*({text})")).differs[0]


@pytest.mark.parametrize(
    ("text", "right"),
    [("(-8)^(1/3*3)", -8), ("asin(3 - 2)", math.pi / 2), ("sqrt(4 - 4)", 0), ("0^0", 1), ("0^2", 0),
     ("(-2)^3", -8), ("(-2)^-3", -0.125), ("2^0.5", math.sqrt(2)), ("0.1*3 - 0.3", 0), ("acosh(1)", 0),
     ("atan2(0, -1)", math.pi), ("abs(-3)", 3), ("sign(0)", 0), ("1e-400*1e400", 1), ("x - x", 0),
     ("(-2)^(sin(x)^2 + cos(x)^2 + 1)", 4)],
)  # fmt: skip
def test_exact_numbers_stay_exact(text: str, right: float) -> None:
    found = found_at(text)
    assert not found.undefined[0]
    assert not found.doubtful[0]
    assert float(found.value[0]) == pytest.approx(right, rel=1e-15, abs=0)


@pytest.mark.parametrize(
    ("text", "hidden"),
    [("x + exp(-1e6*(x - 9)^2)", True), ("x + exp(-(x - 9)^2)", False), ("x + x - x", False),
     ("cos(exp(-1e4*x))", True), ("cos(x - x)", False), ("tanh(1e4*x)", True), ("tanh(x)", False),
     ("atan(exp(1e4*x))", True), ("x + 0*exp(-1e6*x)", False)],
)  # fmt: skip
def test_what_cannot_be_seen_is_noticed(text: str, hidden: bool) -> None:
    found = points({"x": 1.3}).finely_at(read(text)[0])
    assert found.hidden is not None
    assert found.hidden[0] == hidden


def test_many_points_at_once_are_the_same_as_one_by_one() -> None:
    node = read("sqrt(x)*sin(a)/x^a + log(x)")[0]
    values = {"x": np.array([-1.0, 0.5, 2.0]), "a": np.array([2.0, 0.3, -1.0])}
    both = Points(values, {}, 3).at(node)
    for place in range(3):
        one = points({name: float(value[place]) for name, value in values.items()}).at(node)
        assert bool(both.undefined[place]) == bool(one.undefined[0])
        np.testing.assert_equal(both.value[place], one.value[0])


def test_derived_names_have_their_values() -> None:
    values = {"k": np.array([4.0, 9.0]), "m": np.array([1.0, 4.0])}
    derived = {"w": read("sqrt(k/m)")[0], "T": read("2*pi/w")[0]}
    for points_of in (Points(values, derived, 2), pickle.loads(pickle.dumps(Points(values, derived, 2)))):
        np.testing.assert_allclose(points_of.floats["w"], [2, 1.5], rtol=1e-15)
        np.testing.assert_allclose(points_of.at(Name("T")).value, 2 * np.pi / np.array([2, 1.5]), rtol=1e-15)
        np.testing.assert_allclose(points_of.but({"k": 16.0}).some([1]).at(Name("w")).value, [2], rtol=1e-15)
