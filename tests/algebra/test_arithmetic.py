"""Exact numbers: values and signs against mpmath and sympy, short forms, bounds on everything that grows."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
from hypothesis import given, settings

from rigidcli.algebra.arithmetic import EXACT, common_factor, tidy, worked_out
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.errors import ComputationError, ExpressionError
from rigidcli.language.parser import read
from tests.algebra.test_expressions import FORMS
from tests.trees import CONTEXT, NAMES, POINTS, TREES, NoValueError, value

POSITIVE = frozenset(["a", "b", "c", "k", "l1", "l2", "m", "m1", "m2", "r", "M"])
n: Any = EXACT


def exact(text: str) -> Expr:
    """A text, in which some names are known to be positive."""
    root, names = read(text)
    return worked_out(root, {name: symbol(name, name in POSITIVE) for name in names})


def to_sympy(text: str) -> Any:
    """The same, by sympy's own reading of the text."""
    _, names = read(text)
    known = {name: symbol(name, name in POSITIVE).to_sympy() for name in names}
    return sympy.sympify(text.replace("^", "**"), locals=known, rational=True)


@pytest.mark.parametrize(("source", "expected"), FORMS["tidy"])
def test_tidy_finds_the_form_a_person_would_write(source: str, expected: str) -> None:
    assert str(tidy(exact(source))) == expected
    assert tidy(tidy(exact(source))) == tidy(exact(source))


@pytest.mark.parametrize(
    ("part", "function"),
    [(f"{k}*pi/{d}", f) for d in (5, 8, 12) for k in range(0, 2 * d, 3) for f in ("sin", "cos", "tan")],
)
def test_angles_with_square_roots(part: str, function: str) -> None:
    with contextlib.suppress(ExpressionError):  # tan of a right angle
        assert float(exact(f"{function}({part})")) == pytest.approx(
            float(to_sympy(f"{function}({part})")), abs=1e-14
        )


@pytest.mark.parametrize("text", FORMS["not finite"])
def test_what_is_not_finite_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match=r"zero|finite"):
        exact(text)


@pytest.mark.parametrize("text", FORMS["not real"])
def test_what_is_not_real_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="real value"):
        exact(text)


@pytest.mark.parametrize("text", ["1/(sin(1)^2 + cos(1)^2 - 1)", "log(cosh(1)^2 - sinh(1)^2 - 1)"])
def test_a_zero_that_cannot_be_told_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="cannot be told"):
        exact(text)


@pytest.mark.parametrize(("text", "sign"), FORMS["signs"])
def test_signs(text: str, sign: int | None) -> None:
    assert n.sign(exact(text)) == sign


@pytest.mark.parametrize(("text", "expected"), FORMS["roots"])
def test_square_roots(text: str, expected: str) -> None:
    assert str(n.sqrt(exact(text))) == expected


def test_the_sides_of_right_triangles() -> None:
    assert n.hypot(exact("3*a"), exact("4*a")) == 5 * exact("a")
    assert n.hypot(exact("sin(x)"), exact("cos(x)")) == 1


@pytest.mark.parametrize("y", ["0", "1", "-1", "sqrt(3)", "2 - sqrt(3)", "-a"])
@pytest.mark.parametrize("x", ["0", "1", "-1", "a", "-2*a"])
def test_angles_from_two_sides(y: str, x: str) -> None:
    if y == x == "0":
        with pytest.raises(ExpressionError, match="no value"):
            n.atan2(exact(y), exact(x))
    else:
        known = {"a": 0.7}
        sides = (float(e.evaluate(**{name: known[name] for name in e.names})) for e in map(exact, (y, x)))
        found = n.atan2(exact(y), exact(x))
        assert float(found.evaluate(**{name: known[name] for name in found.names})) == pytest.approx(
            math.atan2(*sides), abs=1e-15
        )


@pytest.mark.parametrize("text", ["sqrt(2)/3", "pi^20", "sin(1e30)", "1e-320", "exp(1)*10^300", "0.1", "0"])
def test_values_are_the_nearest_floats(text: str) -> None:
    with mpmath.workdps(60):
        expected = float(mpmath.mpf(sympy.N(to_sympy(text), 60)))
    assert n.value(exact(text)) == expected
    assert n.value(exact("x")) is None


@pytest.mark.parametrize(("rows", "factor", "rest"), FORMS["common factors"])
def test_common_factor(rows: list[str], factor: str, rest: list[list[str]]) -> None:
    array = np.array([[exact(entry) for entry in row.split()] for row in rows], dtype=object)
    found, left = common_factor(array)
    assert str(found) == factor
    assert [[str(entry) for entry in row] for row in left] == rest


@settings(max_examples=60)
@given(TREES)
def test_tidying_and_signs_keep_to_the_value_of_any_tree(tree: Any) -> None:
    e = None
    with contextlib.suppress(ExpressionError):
        e = worked_out(tree, {name: symbol(name) for name in NAMES})
    if e is None:
        return
    short, sign = tidy(e), n.sign(e)
    for point in POINTS:
        known = {name: CONTEXT.mpf(q.numerator) / q.denominator for name, q in point.items()}
        try:
            expected = value(tree, point)
        except (NoValueError, ArithmeticError, ValueError):
            continue
        chosen = {sympy.Symbol(name, real=True): known[name] for name in short.names}
        found = CONTEXT.mpf(sympy.N(short.to_sympy(), 40, subs=chosen))
        assert abs(found - expected) <= 1e-25 * (1 + abs(expected))
        assert sign in (None, CONTEXT.sign(expected) if abs(expected) > 1e-30 else 0)


def _fill(operator: str, piece: Callable[[int], str], length: int = 19_900) -> str:
    """As many numbered pieces as a text may hold, joined by an operator."""
    pieces: list[str] = []
    size = 0
    while (size := size + len(piece(len(pieces))) + 1) <= length:
        pieces.append(piece(len(pieces)))
    return operator.join(pieces)


HOSTILE = {
    "towers": "9**9**9**9",
    "powers of powers": "((10**400)*x)**400",
    "exponentials of exponentials": "exp(exp(exp(9)))",
    "equal terms": "+".join(["x"] * 10_000),
    "denominators": _fill("+", lambda i: f"1/{10007 + 2 * i}"),
    "roots": _fill("*", lambda i: f"sqrt({2 * i + 3})"),
    "roots of large numbers": _fill("+", lambda i: f"{10**20 + 2 * i + 1}^(1/7)"),
    "signs of roots": _fill("+", lambda i: f"abs(1-sqrt({i + 2}))"),
    "sines of parts of pi": _fill("+", lambda i: f"sin(pi/{i + 2})"),
    "signs of polynomials": _fill("*", lambda i: f"abs(x^9-x^8+{i}*x^7-1)"),
    "factors": _fill("*", lambda i: f"(a + {i}*b)"),
    "a power of a sum": "(a + b + c + k + m + r + x)^24",
    "a high power": "(x + 1)^1000 - 1",
    "a hidden zero": "abs(sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7)-sqrt((sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7))^2))",
    "nested roots": "sqrt(2+sqrt(3)*" * 49 + "2" + ")" * 49,
    "nested sines": "sin(1-2*" * 99 + "7" + ")" * 99,
    "nested fractions": "y*x/(1+" * 99 + "x" + ")" * 99,
    "nested squares": "(1+x*" * 99 + "x" + ")^2" * 99,
    "huge angles": "atan2(sin(10^300),cos(10^300)) + asin(sin(10^300)) + tan(10^300*pi/7)",
}


@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE.keys())
def test_any_text_is_accepted_or_refused_within_a_second_and_tidied_in_two(text: str) -> None:
    start, e = time.process_time(), None
    with contextlib.suppress(ExpressionError):
        e = exact(text)
    assert time.process_time() - start < 1.0
    if e is not None:
        start = time.process_time()
        with contextlib.suppress(ExpressionError, ComputationError):
            tidy(e)
        assert time.process_time() - start < 2.0


def test_a_result_of_pages_is_refused() -> None:
    angles = "*".join(f"(sin({k}) + a*cos({k})^2 + b*tan({k}))" for k in range(1, 7))
    with pytest.raises(ComputationError, match="too long to print"):
        tidy(expand(exact(angles)))
