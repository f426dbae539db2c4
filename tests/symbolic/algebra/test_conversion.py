"""Expressions as exact numbers: the same values as floats have, and bounds on everything that grows."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Callable, Iterator

import mpmath
import pytest
import sympy
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.language.expression import FUNCTIONS, parse

x = sympy.Symbol("x", positive=True)
y = sympy.Symbol("y", real=True)
SYMBOLS = {"x": x, "y": y}


def exact(text: str, **values: object) -> sympy.Expr:
    return parse(text).exact({**SYMBOLS, **values})


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("0.1", sympy.Rational(1, 10)),
        (".5", sympy.Rational(1, 2)),
        ("2.", sympy.Integer(2)),
        ("1e-3", sympy.Rational(1, 1000)),
        ("6.67430e-11", sympy.Rational(667430, 10**16)),
        ("1/3 + 1/7", sympy.Rational(10, 21)),
        ("2 - 3 - 4", sympy.Integer(-5)),
        ("pi/6", sympy.pi / 6),
        ("sin(pi/3)", sympy.sqrt(3) / 2),
        ("sqrt(12)", 2 * sympy.sqrt(3)),
        ("(-8)^2", sympy.Integer(64)),
        ("4^0.5", sympy.Integer(2)),
        ("0^0", sympy.Integer(1)),
        ("log(x^2)/2", sympy.log(x**2) / 2),
        ("exp(1)", sympy.E),
        ("atan2(1, -1)", 3 * sympy.pi / 4),
        ("abs(3 - pi)", sympy.pi - 3),
        ("sign(sqrt(2) - 2)", sympy.Integer(-1)),
        ("sqrt(x^2)", x),
        ("sqrt(y^2)", sympy.Abs(y)),
        ("x - x", sympy.Integer(0)),
        ("-(x + y)", -x - y),
        ("2*(x + y) - x", x + 2 * y),
        ("y*x^2/(2*x)", x * y / 2),
        ("sqrt(2)*(sqrt(3) + 1) - sqrt(6) - sqrt(2)", sympy.Integer(0)),
        ("x + (sqrt(2) + 1)*(sqrt(2) - 1) - 1", x),
    ],
)
def test_values(text: str, expected: sympy.Expr) -> None:
    assert exact(text) == expected


def test_names_stand_for_any_exact_value() -> None:
    assert exact("a*b", a=sympy.Rational(2, 3), b=3 * x) == 2 * x
    assert exact("a + 1", a=2) == 3
    hostile = {
        name: sympy.Symbol(name, real=True) for name in ("E", "I", "S", "beta", "lambda", "__import__")
    }
    result = parse("E*I + S*beta + lambda + __import__").exact(hostile)
    assert result.free_symbols == set(hostile.values())
    with pytest.raises(ExpressionError, match="no value for `q`"):
        exact("q + 1")


@pytest.mark.parametrize(
    "text",
    ["1/0", "x/0", "0/0", "0^-1", "log(0)", "tan(pi/2)", "atanh(1)", "1/(x - x)", "0*log(0)", "1/(1/0)"],
)
def test_what_is_not_finite_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="not finite"):
        exact(text)


@pytest.mark.parametrize(
    "text",
    [
        "sqrt(-1)",
        "sqrt(-1)^2",
        "sqrt(-x)",
        "(-8)^(1/3)",
        "(-8)^pi",
        "(1 - sqrt(2))^(1/3)",
        "((1 - pi)*x)^(1/3)",
        "log(-1)",
        "log(1 - sqrt(2))",
        "asin(2)",
        "acosh(0.5)",
        "atanh(2)",
    ],
)
def test_what_is_not_real_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="no real value"):
        exact(text)


@pytest.mark.parametrize("text", ["1/(sin(1)^2 + cos(1)^2 - 1)", "log(cosh(1)^2 - sinh(1)^2 - 1)"])
def test_a_zero_that_cannot_be_told_is_refused(text: str) -> None:
    with pytest.raises(ExpressionError, match="cannot tell"):
        exact(text)


@pytest.mark.parametrize(
    "text",
    [
        "9**9**9",
        "9**9**9**9",
        "x**9**9**9",
        "a**a",
        "(10**400)**400",
        "((10**400)*x)**400",
        "(2^(x*10^3000))^(1/x)",
        "(3^(1000*x))^(100000/x)",
        "3^(x + 1000)*3^(1000 - x)*3^(7000 + x)",
        "10**3000*10**3000",
        "1e9999",
        "1e-9999",
        "b*b + 1",
        "1/b + 1/(b + 1)",
        "exp(exp(exp(9)))",
        "exp(10^7*log(10))",
        "exp(1000000*log(10) + x)",
        "exp(10^30*log(2*x))",
        "pi^pi^pi^pi",
        "cosh(10^9)",
        "sqrt(10^3000 + 1)",
        "((10^3000 + 1)/(10^3000 + 3))^(5/7)",
        "24^(123456789/1234567891)",
        "2^(1/10^3000)",
    ],
)
def test_numbers_that_grow_too_large_are_refused_at_once(text: str) -> None:
    start = time.process_time()
    with pytest.raises(ExpressionError, match="too large"):
        exact(text, a=sympy.Integer(10**6), b=sympy.Integer(10**2000 + 7))
    assert time.process_time() - start < 0.25


def _names() -> Iterator[str]:
    letters = "abcdefghijklmnopqrsuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ"
    yield from letters
    yield from (first + second for first in letters for second in letters if first + second != "pi")


def _fill(symbol: str, piece: Callable[[int], str], length: int = 19_900) -> str:
    """As many numbered pieces as a text may hold, joined by an operator."""
    pieces: list[str] = []
    size = 0
    while (size := size + len(piece(len(pieces))) + 1) <= length:
        pieces.append(piece(len(pieces)))
    return symbol.join(pieces)


MANY_NAMES = "+".join(name for name, _ in zip(_names(), range(2700), strict=False))

HOSTILE_TEXTS = {
    "equal terms": "+".join(["x"] * 10_000),
    "equal terms taken away": "-".join(["x"] * 10_000),
    "names": MANY_NAMES,
    "names within brackets": "(" * 99 + MANY_NAMES + "+1)" * 99,
    "names within doubling": "2*(" * 99 + MANY_NAMES + ")" * 99,
    "names within sines": "sin(" * 99 + MANY_NAMES + ")" * 99,
    "denominators": _fill("+", lambda i: f"1/{10007 + 2 * i}"),
    "equal roots": _fill("*", lambda i: "2^(1/3)"),
    "roots": _fill("*", lambda i: f"sqrt({2 * i + 3})"),
    "roots of large numbers": _fill("+", lambda i: f"{10**20 + 2 * i + 1}^(1/7)"),
    "roots of fractions": _fill("+", lambda i: f"({10**70 + i}/{10**70 + i + 7})^(5/7)"),
    "signs of roots": _fill("+", lambda i: f"abs(1-sqrt({i + 2}))"),
    "sines of parts of pi": _fill("+", lambda i: f"sin(pi/{i + 2})"),
    "exponentials": _fill("*", lambda i: f"exp({i + 2})"),
    "signs of polynomials": _fill("*", lambda i: f"abs(x^9-x^8+{i}*x^7-1)"),
    "one high polynomial": "log(x^5000-x^4999+3*x^17-1)",
    "one long polynomial": f"abs({'-'.join(f'{i + 3}*x^{i}' for i in range(19))})",
    "a hidden zero": "abs(sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7)-sqrt((sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7))^2))",
    "another hidden zero": "abs(x*(sqrt(2)+sqrt(3)-sqrt(5+2*sqrt(6))))",
    "nested roots": "sqrt(2+sqrt(3)*" * 49 + "2" + ")" * 49,
    "nested sines": "sin(1-2*" * 99 + "7" + ")" * 99,
    "nested fractions": "y*x/(1+" * 99 + "x" + ")" * 99,
    "nested squares": "(1+x*" * 99 + "x" + ")^2" * 99,
    "nested powers": "^".join(["x"] * 100),
    "huge angles": "atan2(sin(10^300),cos(10^300)) + asin(sin(10^300)) + tan(10^300*pi/7)",
}


@pytest.mark.parametrize("text", HOSTILE_TEXTS.values(), ids=HOSTILE_TEXTS.keys())
def test_any_text_is_accepted_or_refused_within_a_second(text: str) -> None:
    expression = parse(text)
    values = {name: sympy.Symbol(name, positive=True) for name in expression.names}
    start = time.process_time()
    with contextlib.suppress(ExpressionError):
        expression.exact(values)
    assert time.process_time() - start < 1.0


def test_what_people_write_is_within_the_bounds() -> None:
    names = [f"{axis}{body}" for axis in "xyz" for body in range(8)]
    pairs = [(i, j) for i in range(8) for j in range(i)]
    potential = "-G*m^2*(" + " + ".join(
        f"1/sqrt((x{i} - x{j})^2 + (y{i} - y{j})^2 + (z{i} - z{j})^2)" for i, j in pairs
    )
    expression = parse(potential + ")")
    assert expression.names == {"G", "m", *names}
    result = expression.exact({name: sympy.Symbol(name, real=True) for name in expression.names})
    assert len(result.atoms(sympy.Pow)) > len(pairs)


# Random trees as (text with all parentheses, value by mpmath or None).

Tree = tuple[str, "mpmath.mpf | None"]
DIGITS = 40
NAMED = {"x": sympy.Rational(3, 4), "y": sympy.Rational(-5, 4)}
MPMATH = {"abs": "fabs", "log": "ln"}


def _apply(function: Callable[..., mpmath.mpf], *arguments: Tree) -> mpmath.mpf | None:
    numbers = [number for _, number in arguments]
    if None in numbers:
        return None
    with mpmath.workdps(DIGITS):
        try:
            result = function(*numbers)
        except (ValueError, ArithmeticError):
            return None
        if isinstance(result, mpmath.mpc) or not mpmath.isfinite(result) or abs(result) > 1e30:
            return None
        return result


def _power(base: mpmath.mpf, exponent: mpmath.mpf) -> mpmath.mpf:
    return base**exponent


OPERATIONS: dict[str, Callable[..., mpmath.mpf]] = {
    "+": lambda a, b: a + b,
    "-": lambda a, b: a - b,
    "*": lambda a, b: a * b,
    "/": lambda a, b: a / b,
    "^": _power,
}


def _binary(left: Tree, symbol: str, right: Tree) -> Tree:
    return f"({left[0]}{symbol}{right[0]})", _apply(OPERATIONS[symbol], left, right)


def _call(name: str, arguments: tuple[Tree, Tree]) -> Tree:
    used = arguments[: FUNCTIONS[name].arity]
    function = getattr(mpmath, MPMATH.get(name, name))
    return f"{name}({','.join(text for text, _ in used)})", _apply(function, *used)


def _leaf(text: str, number: sympy.Expr) -> Tree:
    return text, mpmath.mpf(number.p) / number.q


with mpmath.workdps(DIGITS):
    LEAVES = [_leaf(name, number) for name, number in NAMED.items()]
    LEAVES += [_leaf(text, sympy.Rational(text)) for text in ("1", "2", "3", "0.5", "0.1", "1e-3")]
    LEAVES += [("pi", +mpmath.pi)]

TREES = st.recursive(
    st.sampled_from(LEAVES),
    lambda trees: st.one_of(
        st.builds(_binary, trees, st.sampled_from(sorted(OPERATIONS)), trees),
        st.builds(_call, st.sampled_from(sorted(FUNCTIONS)), st.tuples(trees, trees)),
    ),
    max_leaves=8,
)


@settings(max_examples=120, deadline=None)
@given(TREES)
def test_random_trees_have_the_value_mpmath_gives_them(tree: Tree) -> None:
    text, expected = tree
    expression = parse(text)
    try:
        result = expression.exact({name: NAMED[name] for name in expression.names})
    except ExpressionError:
        return
    if expected is None:
        return
    with mpmath.workdps(DIGITS):
        difference = abs(mpmath.mpf(result.evalf(30)) - expected)
        assert difference <= mpmath.mpf(10) ** -20 * (1 + abs(expected))
