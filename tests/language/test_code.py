"""Generated code against the evaluation of the same trees, and what it must never do."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping, Sequence

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language import tree
from rigidcli.language.code import function
from rigidcli.language.expression import Expression, parse
from rigidcli.language.words import FUNCTIONS, WITH_CORNERS
from tests.trees import number as written
from tests.trees import trees

many = settings(max_examples=120)
few = settings(max_examples=15)

ARGUMENTS = ("t", "x", "y")
CONSTANTS = {"k": 0.75, "m": -3.0, "one": 1.0, "zero": 0.0}
NAMES = frozenset(ARGUMENTS) | frozenset(CONSTANTS)

VALUES = st.one_of(
    st.floats(-4, 4),
    st.sampled_from([0.0, 1.0, -1.0, 0.5, 1e-8, 710.0, -1e200, 1e200]),
)


def number(value: float) -> tree.Number:
    return tree.Number(repr(value), value)


LEAVES: st.SearchStrategy[tree.Node] = st.one_of(
    st.sampled_from(sorted(NAMES)).map(tree.Name),
    st.floats(0, 5).map(number),
    st.just(tree.Constant("pi")),
)


def pairs(nodes: st.SearchStrategy[tree.Node]) -> st.SearchStrategy[tuple[tree.Node, ...]]:
    return st.lists(nodes, min_size=2, max_size=4).map(tuple)


def tame(nodes: st.SearchStrategy[tree.Node]) -> st.SearchStrategy[tree.Node]:
    """Positive values and no cancellation: rounding errors stay such."""
    near = nodes.map(lambda node: tree.Sum((number(1.0), node)))
    unary = ["sqrt", "tanh", "atan", "asinh"]
    return st.one_of(
        pairs(nodes).map(tree.Sum),
        st.tuples(nodes, near.map(tree.Reciprocal)).map(tree.Product),
        st.builds(tree.Power, nodes, st.integers(-3, 3).map(float).map(number)),
        st.builds(tree.Power, nodes, st.sampled_from([0.5, 1.5, -0.25]).map(number)),
        st.builds(lambda name, node: tree.Call(name, (node,)), st.sampled_from(unary), nodes),
        near.map(lambda node: tree.Call("log", (node,))),
        st.tuples(nodes, near).map(lambda both: tree.Call("atan2", both)),
    )


FRACTIONS = st.sampled_from(["0.5", "1.5", "2.25", "17.0", "40.0"]).map(written)
WILD = trees(LEAVES, st.one_of(FRACTIONS, FRACTIONS.map(tree.Negative)))
"""Operations whose code does literally what evaluation does: no small integer powers."""

POSITIVE: st.SearchStrategy[tree.Node] = st.one_of(
    st.sampled_from(["t", "x", "y", "k", "one"]).map(tree.Name), st.floats(0.25, 4).map(number)
)
TAME = st.recursive(POSITIVE, tame, max_leaves=8)
TAME_VALUES = st.floats(0.25, 4)


def expression(node: tree.Node) -> Expression:
    return Expression("", node, NAMES)


def by_evaluation(node: tree.Node, point: Mapping[str, float]) -> float | str:
    """The value, or why there is none."""
    try:
        return expression(node).evaluate({**CONSTANTS, **point})
    except ExpressionError as error:
        return error.message


def by_code(node: tree.Node, point: Sequence[float]) -> float | str:
    try:
        value = function([node], ARGUMENTS, CONSTANTS)(math)(*point)[0]
    except (ArithmeticError, ValueError) as error:
        return str(error)
    return value if math.isfinite(value) else str(value)


# --- the same values


@pytest.mark.parametrize("growing", ["exp(x)", "cosh(-x)", "sinh(x)", "-sinh(-x)", "10^x", "(-x)^400"])
def test_what_is_too_large_for_a_float_is_infinite_on_the_way(growing: str) -> None:
    flow = function([parse(f"1/(1 + {growing})"), parse(f"{growing} - {growing}")], ["x"], {})
    value, difference = flow(math)(1000.0)
    assert value == 0
    assert math.isnan(difference)


@many
@given(WILD, VALUES, VALUES, VALUES)
def test_code_does_what_evaluation_does(node: tree.Node, t: float, x: float, y: float) -> None:
    expected = by_evaluation(node, {"t": t, "x": x, "y": y})
    found = by_code(node, (t, x, y))
    if isinstance(expected, float):
        assert found == expected
    elif "too large" not in expected:
        assert isinstance(found, str)


@many
@given(st.lists(TAME, min_size=1, max_size=4), TAME_VALUES, TAME_VALUES, TAME_VALUES)
def test_code_agrees_for_floats_and_arrays(nodes: list[tree.Node], t: float, x: float, y: float) -> None:
    expected = [by_evaluation(node, {"t": t, "x": x, "y": y}) for node in nodes]
    if all(isinstance(value, float) for value in expected):
        flow = function([expression(node) for node in nodes], ARGUMENTS, CONSTANTS)
        assert flow(math)(t, x, y) == pytest.approx(expected, rel=1e-11)
        with np.errstate(all="ignore"):
            arrays = flow(np)(t, np.full(3, x), np.array([y, y, y]))
        for value, array in zip(expected, arrays, strict=True):
            assert np.broadcast_to(array, 3) == pytest.approx([value] * 3, rel=1e-11)


@few
@given(TAME, TAME_VALUES, TAME_VALUES, TAME_VALUES)
def test_code_agrees_for_taylor_series(node: tree.Node, t: float, x: float, y: float) -> None:
    heyoka = pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    expected = by_evaluation(node, {"t": t, "x": x, "y": y})
    if isinstance(expected, float):
        names = heyoka.make_vars("a", "b", "c")
        (made,) = function([node], ARGUMENTS, CONSTANTS)(heyoka)(*names)
        compiled = heyoka.cfunc([heyoka.expression(0.0) + made], list(names))
        assert compiled([t, x, y])[0] == pytest.approx(expected, rel=1e-11)


@pytest.mark.parametrize("exponent", [*range(-9, 10, 3), 2, 17, 64, -100])
def test_integer_powers(exponent: int) -> None:
    power = function([parse(f"x^{exponent}")], ["x"], {})
    points = [0.3, -0.7, 1.0, -1.9, 2.5]
    expected = [math.pow(x, exponent) for x in points]
    assert [power(math)(x)[0] for x in points] == pytest.approx(expected, rel=1e-14)
    assert power(np)(np.array(points))[0] * np.ones(5) == pytest.approx(expected, rel=1e-14)
    if exponent >= 0:
        assert power(math)(0.0)[0] == (1.0 if exponent == 0 else 0.0)
    else:
        with pytest.raises((ZeroDivisionError, ValueError)):
            power(math)(0.0)


def test_a_power_that_is_known_to_be_small_is_a_product() -> None:
    # heyoka has NaN for x**2 at 0, and Python's ** has complex numbers.
    flow = function([parse("x^n + x^(1 + 1) + (-x)^(-n/n)")], ["x"], {"n": 3.0})
    assert "pow" not in flow(math).__globals__
    assert flow(math)(2.0) == (8.0 + 4.0 - 0.5,)


@pytest.mark.parametrize("text", ["1/x", "log(x)", "x^-2", "x^-0.5", "atanh(x - 1)", "1/(x - x)", "x/sin(x)"])
def test_there_is_no_value_behind_a_pole(text: str) -> None:
    flow = function([parse(text)], ["x"], {})
    with pytest.raises((ArithmeticError, ValueError)):
        flow(math)(0.0)
    with np.errstate(all="ignore"):
        assert not np.isfinite(flow(np)(np.array([0.0]))[0]).any()


# --- names and constants


def test_arguments_come_in_the_order_that_was_asked_for() -> None:
    texts = ["v1 - v0", "s0*2", "pow", "f + t"]
    arguments = ["v1", "f", "v0", "pow", "s0", "t"]
    flow = function([parse(text) for text in texts], arguments, {"v0": 99.0})
    assert flow(math)(1.0, 2.0, 4.0, 8.0, 16.0, 32.0) == (-3.0, 32.0, 8.0, 34.0)


@pytest.mark.parametrize("name", ["__import__", "lambda", "x); import os; (x", "f", "v0", "\n"])
def test_no_name_gets_into_the_code(name: str) -> None:
    node = tree.Sum((tree.Name(name), tree.Number("); import os; (", 1.0), tree.Name("c")))
    made = function([node], [name], {"c": 2.0})(math)
    assert made(3.0) == (6.0,)
    code = made.__code__
    assert set(code.co_names) | set(code.co_varnames) <= {"v0", "s0", "s1"}


def test_the_code_has_no_builtins() -> None:
    for module in (math, np):
        made = function([parse("sin(x) + x^1.5")], ["x"], {})(module)
        assert made.__globals__["__builtins__"] == {}
        assert set(made.__globals__) == {"__builtins__", "f", "sin", "pow"}


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("x + 1/zero", "division by zero"),
        ("x*log(-one)", "no finite real value"),
        ("x + 1e999", "too large"),
        ("x*(1e300*1e300)", "too large"),
        ("x + (-one)^0.5", "no real value"),
    ],
)
def test_constant_parts_without_a_value_are_refused_at_once(text: str, message: str) -> None:
    with pytest.raises(ExpressionError, match=message):
        function([parse(text)], ["x"], CONSTANTS)


@pytest.mark.parametrize("value", [-2.5, 1e-300, -1e22, 5e-324, 0.1, -0.0])
def test_numbers_keep_all_their_digits(value: float) -> None:
    flow = function(
        [parse("x - c"), parse("x*c"), parse("c/x"), parse("atan2(x - x, c)")], ["x"], {"c": value}
    )
    assert flow(math)(3.0) == (3.0 - value, 3.0 * value, value / 3.0, math.atan2(0.0, value))


# --- once and for all


def test_what_is_common_is_done_once(monkeypatch: pytest.MonkeyPatch) -> None:
    calls = []

    def counting(x: float) -> float:
        calls.append(x)
        return math.sin(x)

    monkeypatch.setitem(FUNCTIONS, "sin", FUNCTIONS["sin"]._replace(real=counting))
    texts = ["sin(a*x + y)", "2*sin(a*x + y)^2", "1/(1 + sin(a*x + y))", "sin(y + a*x)"]
    made = function([parse(text) for text in texts], ["x", "y"], {"a": 3.0})(math)
    made(1.0, 2.0)
    assert calls == [5.0, 5.0]


def test_no_expression_is_too_deep_or_too_long() -> None:
    texts = [
        "(" * 99 + "x" + ")" * 99,
        "sin(" * 99 + "x" + ")" * 99,
        "-" * 99 + "x",
        "^".join(["x"] * 99),
        "+".join(["x"] * 10_000),
        "*".join(["x"] * 5_000),
        "1/(1 + " * 90 + "x" + ")" * 90,
        "+".join(f"sin(x + {i})" for i in range(1_000)),
    ]
    for text in texts:
        made = function([parse(text)], ["x"], {})(math)
        assert made(1.0)[0] == pytest.approx(parse(text).evaluate({"x": 1.0}), rel=1e-12)


# --- heyoka


def test_heyoka_has_every_function_that_is_said_to_be_there() -> None:
    heyoka = pytest.importorskip("heyoka", reason="the extra `taylor` is not installed")
    x = heyoka.make_vars("x", "y")
    for name, known in FUNCTIONS.items():
        flow = function([tree.Call(name, (tree.Name("x"), tree.Name("y"))[: known.arity])], ["x", "y"], {})
        if name in WITH_CORNERS:
            with pytest.raises(ComputationError, match=re.escape(f"`{name}` has no Taylor series")):
                flow(heyoka)
        else:
            point = [1.3 if name == "acosh" else 0.7, 0.4]
            compiled = heyoka.cfunc(list(flow(heyoka)(*x)), list(x))
            assert compiled(point)[0] == pytest.approx(known.real(*point[: known.arity]), rel=1e-14)
