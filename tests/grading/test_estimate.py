"""Values of expressions, and the bounds of their errors, against mpmath with 50 digits."""

from __future__ import annotations

import math
from collections.abc import Mapping
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.grading.expressions.digits import exactly, precisely
from rigidcli.grading.expressions.estimate import Ball, Estimate, estimate
from rigidcli.symbolic.language.parser import read
from rigidcli.symbolic.language.tree import FUNCTIONS, Call, Name, Node
from tests.symbolic.trees import CONTEXT, NAMES, TREES, NoValueError, value

thorough = settings(max_examples=120, deadline=None)

FLOATS = st.floats(-4, 4, allow_subnormal=False).filter(lambda x: x == 0 or abs(x) > 1e-6)
STATES = st.fixed_dictionaries(dict.fromkeys(NAMES, FLOATS))


def in_floats(node: Node, point: Mapping[str, float]) -> Estimate:
    zero = np.zeros(1)
    return estimate(node, {name: Ball(np.array([x]), zero) for name, x in point.items()}, 1)


def in_digits(node: Node, point: Mapping[str, float]) -> Estimate:
    return precisely(node, exactly({name: np.array([x]) for name, x in point.items()}), 1)


def truth(node: Node, point: Mapping[str, float], edge: float = 1e-20) -> Any:
    """The value with 50 digits, None where there is certainly or possibly none."""
    try:
        return value(node, {name: Fraction(x) for name, x in point.items()}, edge)
    except NoValueError:
        return None


def mpf(number: Any) -> Any:
    return CONTEXT.mpf(str(number)) if not isinstance(number, float) else CONTEXT.mpf(number)


@thorough
@given(TREES, STATES)
def test_the_value_is_within_its_error(node: Node, point: dict[str, float]) -> None:
    right, found = truth(node, point), in_floats(node, point)
    if right is None:
        return
    assert not found.undefined[0]
    if not found.doubtful[0]:
        assert abs(mpf(float(found.value[0])) - right) <= mpf(float(found.error[0])) * (1 + 1e-9)


@thorough
@given(TREES, STATES)
def test_so_is_one_with_80_digits(node: Node, point: dict[str, float]) -> None:
    right, found = truth(node, point), in_digits(node, point)
    if right is None:
        return
    assert not found.undefined[0]
    if not found.doubtful[0]:
        # The truth has 50 digits, of numbers up to 1e20.
        assert abs(mpf(found.value[0]) - right) <= mpf(found.error[0]) + CONTEXT.mpf(10) ** -25 * (
            1 + abs(right)
        )


@pytest.mark.parametrize("function", [name for name in FUNCTIONS if name != "atan2"])
@pytest.mark.parametrize("x", [-0.93, -0.2, -1e-9, 1e-9, 0.4, 0.999, 1.0001, 1.7, 12.5, 300.0])
def test_each_function_has_80_digits(function: str, x: float) -> None:
    node = Call(function, (Name("x"),))
    right, found = truth(node, {"x": x}, edge=1e-300), in_digits(node, {"x": x})
    assert bool(found.undefined[0]) == (right is None)
    if right is not None:
        with CONTEXT.workdps(50):
            assert abs(mpf(found.value[0]) - right) <= CONTEXT.mpf(10) ** -48 * (
                abs(right) + CONTEXT.mpf(10) ** -20
            )
        assert found.error[0] < 1e-70 * (1 + abs(float(found.value[0])))


@pytest.mark.parametrize(
    ("y", "x"), [(1.0, 2.0), (1.0, -2.0), (-1.0, -2.0), (-1.0, 2.0), (3.0, 0.0), (-3.0, 0.0), (1e-9, -1.0)]
)
def test_the_angle_is_in_its_quadrant(y: float, x: float) -> None:
    node = read("atan2(y, x)")[0]
    point = {"y": y, "x": x}
    for found in (in_floats(node, point), in_digits(node, point)):
        assert not found.doubtful[0]
        assert float(found.value[0]) == pytest.approx(math.atan2(y, x), rel=1e-15)


# --- what is known of an error


@pytest.mark.parametrize(
    ("text", "lost"),
    [("(x + 1e16) - 1e16", 1.0), ("(x + 1e8) - 1e8", 1e-8), ("sin(x)^2 + cos(x)^2 - 1", 1e-16)],
)
def test_terms_that_cancel_leave_an_error(text: str, lost: float) -> None:
    error = in_floats(read(text)[0], {"x": 1.3}).error[0]
    assert lost <= error < 100 * lost
    assert in_digits(read(text)[0], {"x": 1.3}).error[0] < 1e-55


@pytest.mark.parametrize(
    "text",
    [
        "1/0",
        "0**-1",
        "1/(x - x)",
        "log(-1)",
        "sqrt(-x)",
        "x^0.5/0",
        "(-x)^(1/2)",
        "log(0)",
        "asin(1 + x)",
        "acosh(x - x)",
        "atanh(1)",
        "0*log(-x)",
        "(-x)^x",
    ],
)
def test_what_has_no_value_is_known_to_have_none(text: str) -> None:
    for found in (in_floats(read(text)[0], {"x": 1.3}), in_digits(read(text)[0], {"x": 1.3})):
        assert found.undefined[0]
        assert not found.doubtful[0]


@pytest.mark.parametrize(
    "text",
    [
        "1/(x + a - x - a)",
        "sqrt(x + a - x - a)",
        "log(sin(x)^2 + cos(x)^2 - 1)",
        "sign(x + a - x - a)",
        "exp(exp(exp(10*x)))",
        "acos(sin(x)^2 + cos(x)^2)",
        "1e9999 - 1e9999",
    ],
)
def test_what_rounding_leaves_open_is_doubtful(text: str) -> None:
    found = in_floats(read(text)[0], {"x": 1.3, "a": 0.7})
    assert found.doubtful[0]
    assert not found.undefined[0]


@pytest.mark.parametrize(
    ("text", "right"),
    [("(-8)^(1/3*3)", -8), ("asin(3 - 2)", math.pi / 2), ("sqrt(4 - 4)", 0), ("0^0", 1), ("0^2", 0),
     ("(-2)^3", -8), ("(-2)^-3", -0.125), ("2^0.5", math.sqrt(2)), ("0.1*3 - 0.3", 0), ("acosh(1)", 0),
     ("atan2(0, -1)", math.pi), ("abs(-3)", 3), ("sign(0)", 0), ("1e-400*1e400", 1), ("x - x", 0)],
)  # fmt: skip
def test_exact_numbers_stay_exact(text: str, right: float) -> None:
    for found in (in_floats(read(text)[0], {"x": 1.3}), in_digits(read(text)[0], {"x": 1.3})):
        assert not found.undefined[0]
        assert not found.doubtful[0]
        assert float(found.value[0]) == pytest.approx(right, rel=1e-15, abs=0)


def test_many_points_at_once_are_the_same_as_one_by_one() -> None:
    node = read("sqrt(x)*sin(a)/x^a + log(x)")[0]
    values = np.array([-1.0, 0.5, 2.0]), np.array([2.0, 0.3, -1.0])
    both = estimate(node, {n: Ball(v, np.zeros(3)) for n, v in zip("xa", values, strict=True)}, 3)
    for place, (x, a) in enumerate(zip(*values, strict=True)):
        one = in_floats(node, {"x": float(x), "a": float(a)})
        assert bool(both.undefined[place]) == bool(one.undefined[0])
        np.testing.assert_equal(both.value[place], one.value[0])
