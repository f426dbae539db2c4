"""Exact numbers as results: their shortest form, their common factor, and how they are printed."""

from __future__ import annotations

import re
import time

import numpy as np
import pytest
import sympy
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.exact import common_factor, latex, latex_name, reading, text, tidy, tidy_array
from rigidcli.symbolic.language.expression import FUNCTIONS, parse

NAMES = "a b c k l1 l2 m m1 m2 p r v1 v2 M"
POSITIVE = {name: sympy.Symbol(name, positive=True) for name in NAMES.split()}
REAL = {name: sympy.Symbol(name, real=True) for name in ("x", "y", "theta1", "theta2")}
SYMBOLS = POSITIVE | REAL


def exact(source: str) -> sympy.Expr:
    return parse(source).exact(SYMBOLS)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("M*a^2/6 + M*a^2/2", "2*M*a**2/3"),
        ("m*r^2*sin(x)^2 + m*r^2*cos(x)^2", "m*r**2"),
        ("M*(r^2 + a^2)/4 + M*a^2/12 + M*(a/2)^2", "M*(7*a**2 + 3*r**2)/12"),
        ("m1*r^2 + m2*r^2", "r**2*(m1 + m2)"),
        ("(x^2 - 1)/(x - 1)", "x + 1"),
        ("1/(1/m1 + 1/m2)", "m1*m2/(m1 + m2)"),
        ("1/(1 + sqrt(2))", "-1 + sqrt(2)"),
        ("sqrt(3 + 2*sqrt(2))", "1 + sqrt(2)"),
        ("cos(x)*(m*cos(x) - r*sin(x)) + sin(x)*(m*sin(x) + r*cos(x))", "m"),
        ("cosh(x)^2 - sinh(x)^2", "1"),
        ("1/cos(x)^2 - tan(x)^2", "1"),
        ("l1*l2*(cos(theta1)*cos(theta2) + sin(theta1)*sin(theta2))", "l1*l2*cos(theta1 - theta2)"),
        ("p^2/(2*m) + k*x^2/2", "k*x**2/2 + p**2/(2*m)"),
        ("p^2/(2*m*r^2) - m*r*cos(x)", "-m*r*cos(x) + p**2/(2*m*r**2)"),
        ("2/3", "2/3"),
    ],
)
def test_tidy_finds_the_form_a_person_would_write(source: str, expected: str) -> None:
    assert text(tidy(exact(source))) == expected


@pytest.mark.parametrize(
    "source",
    [
        "(x + 1)^2 - x^2 - 2*x - 1",
        "sin(2*x) - 2*sin(x)*cos(x)",
        "cos(x)^2 - sin(x)^2 - cos(2*x)",
        "(x^2 - y^2)/(x - y) - x - y",
        "m*(a + b)/(m*a + m*b) - 1",
        "sqrt(5 + 2*sqrt(6))*x - sqrt(2)*x - sqrt(3)*x",
    ],
)
def test_tidy_finds_hidden_zeros(source: str) -> None:
    assert tidy(exact(source)) == 0


def test_a_factor_before_a_sum_stays_there() -> None:
    assert text(sympy.factor_terms(exact("2*a + 2*b"))) == "2*(a + b)"


def test_tidy_takes_plain_numbers() -> None:
    assert tidy(3) == sympy.Integer(3)
    assert tidy(sympy.Float("0.25")) == sympy.Float("0.25")
    with pytest.raises(sympy.SympifyError):
        tidy("__import__('os')")


@pytest.mark.parametrize(
    "source",
    [
        "(x + 1)^1000 - 1",
        "x^999 + 1",
        "(a + b + c + k + m + p + r + x)^24",
        "cosh((12 - x)^3)",
        "sinh(2*x + 1e20)",
        "exp(900*x) - exp(x)",
        "x^0.123456789 + x",
        "sqrt(10^100 + 1)*x",
        "+".join(f"a^{i}*b^{i}" for i in range(300)),
        "*".join(f"(a + {i}*b)" for i in range(60)),
    ],
)
def test_tidy_leaves_alone_what_would_take_long(source: str) -> None:
    expr = exact(source)
    start = time.process_time()
    tidy(expr)
    assert time.process_time() - start < 2.0


def test_tidy_array() -> None:
    array = np.array([[exact("a/6 + a/3"), sympy.Integer(0)], [0, exact("x - x")]], dtype=object)
    result = tidy_array(array)
    assert result.tolist() == [[POSITIVE["a"] / 2, 0], [0, 0]]
    assert all(isinstance(entry, sympy.Expr) for entry in result.flat)
    assert array[1, 0] == 0
    floats = np.eye(3)
    assert tidy_array(floats) is floats


def objects(*rows: str) -> np.ndarray[tuple[int, ...], np.dtype[np.object_]]:
    return np.array([[exact(entry) for entry in row.split()] for row in rows], dtype=object)


@pytest.mark.parametrize(
    ("rows", "factor", "rest"),
    [
        (
            ["2*M*a^2/3 -M*a^2/4 -M*a^2/4", "-M*a^2/4 2*M*a^2/3 -M*a^2/4", "-M*a^2/4 -M*a^2/4 2*M*a^2/3"],
            "M*a**2/12",
            [["8", "-3", "-3"], ["-3", "8", "-3"], ["-3", "-3", "8"]],
        ),
        (["10*m*a^2 7*m*a^2 5*m*a^2"], "a**2*m", [["10", "7", "5"]]),
        (["M*a^2/6 0", "0 M*a^2/6"], "M*a**2/6", [["1", "0"], ["0", "1"]]),
        (["1/(2*m) 1/(3*m)"], "1/(6*m)", [["3", "2"]]),
        (["1/2 -1/3"], "1/6", [["3", "-2"]]),
        (["sqrt(2)/2 sqrt(2)/2 0"], "sqrt(2)/2", [["1", "1", "0"]]),
        (["(m1+m2)*x (m1+m2)*y"], "m1 + m2", [["x", "y"]]),
        (
            ["m*(r^2+a^2)/12 -m*r*a/4", "-m*r*a/4 m*(r^2+a^2)/12"],
            "m/12",
            [["a**2 + r**2", "-3*a*r"], ["-3*a*r", "a**2 + r**2"]],
        ),
        (["-2*a -4*a"], "2*a", [["-1", "-2"]]),
        (["2 -1 0"], "1", [["2", "-1", "0"]]),
        (["a 1/a"], "1", [["a", "1/a"]]),
        (["M*a^2/6"], "1", [["M*a**2/6"]]),
        (["0 0"], "1", [["0", "0"]]),
    ],
)
def test_common_factor(rows: list[str], factor: str, rest: list[list[str]]) -> None:
    found, left = common_factor(objects(*rows))
    assert text(found) == factor
    assert [[text(entry) for entry in row] for row in left] == rest


def test_common_factor_of_floats_is_one() -> None:
    array = np.array([2.0, 4.0])
    factor, rest = common_factor(array)
    assert factor == 1
    assert rest is array


ENTRIES = st.builds(
    lambda number, powers: (
        number * sympy.Mul(*(POSITIVE[n] ** e for n, e in zip("abm", powers, strict=True)))
    ),
    st.fractions(-9, 9, max_denominator=12).map(lambda f: sympy.Rational(f.numerator, f.denominator)),
    st.tuples(*[st.integers(-2, 3)] * 3),
)


@settings(max_examples=30, deadline=None)
@given(st.lists(ENTRIES, min_size=1, max_size=6))
def test_a_factor_times_the_rest_is_the_array(entries: list[sympy.Expr]) -> None:
    factor, rest = common_factor(np.array(entries, dtype=object))
    assert all(factor * left == entry for left, entry in zip(rest, entries, strict=True))
    assert sum(len(text(left)) for left in rest) <= sum(len(text(entry)) for entry in entries)


@pytest.mark.parametrize(
    ("expr", "expected"),
    [
        (sympy.E, "exp(1)"),
        (sympy.exp(2) / sympy.E, "exp(1)"),
        (sympy.Abs(REAL["x"]), "abs(x)"),
        (sympy.sqrt(2) / 2, "sqrt(2)/2"),
        (sympy.Rational(-2, 3), "-2/3"),
        (POSITIVE["a"] ** sympy.Rational(2, 3), "a**(2/3)"),
        (1 / sympy.sqrt(POSITIVE["a"]), "1/sqrt(a)"),
        ((-2) ** REAL["x"], "(-2)**x"),
        (sympy.cot(REAL["x"]), "1/tan(x)"),
        (sympy.sec(REAL["x"]) ** 2, "cos(x)**(-2)"),
        (sympy.atan2(REAL["y"], REAL["x"]), "atan2(y, x)"),
        (sympy.Symbol("E") * sympy.Symbol("lambda"), "E*lambda"),
        (sympy.Float("0.1"), "0.1"),
        (sympy.Float("1e-30") * REAL["x"], "1e-30*x"),
        (2, "2"),
    ],
)
def test_text(expr: sympy.Expr, expected: str) -> None:
    assert text(expr) == expected
    assert parse(text(expr))


@pytest.mark.parametrize(
    "expr",
    [
        sympy.oo,
        sympy.zoo,
        sympy.nan,
        sympy.I,
        sympy.Symbol("sin"),
        sympy.Symbol("pi"),
        sympy.Symbol("a b"),
        sympy.Symbol("é"),
        sympy.Symbol("1"),
        sympy.Float("inf"),
        sympy.gamma(REAL["x"]),
        sympy.Function("f")(REAL["x"]),
        sympy.Derivative(sympy.Function("f")(REAL["x"]), REAL["x"]),
        sympy.Piecewise((1, REAL["x"] > 0), (2, True)),
        sympy.EulerGamma,
    ],
    ids=str,
)
def test_text_refuses_what_the_language_cannot_say(expr: sympy.Expr) -> None:
    with pytest.raises(ValueError, match="not in the expression language"):
        text(expr)


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("M*a^2/12", "M a^2/12"),
        ("11*M*a^2/12", "11 M a^2/12"),
        ("x/(2*m)", "x/(2 m)"),
        ("a*(b + c)", "a (b + c)"),
        ("10*2^(1/3)", "10*2^(1/3)"),
        ("l1*2^x", "2^x l1"),
        ("2*sqrt(2)*cos(x)", "2 sqrt(2) cos(x)"),
    ],
)
def test_reading(source: str, expected: str) -> None:
    assert reading(exact(source)) == expected


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("x", "x"),
        ("E", "E"),
        ("alpha", r"\alpha"),
        ("lambda", r"\lambda"),
        ("lambda1", r"\lambda_{1}"),
        ("omega0", r"\omega_{0}"),
        ("Omega_b", r"\Omega_{b}"),
        ("Alpha", r"\mathrm{A}"),
        ("x_1", "x_{1}"),
        ("p_theta", r"p_{\theta}"),
        ("a_b_c", "a_{b,c}"),
        ("mass", r"\mathrm{mass}"),
        ("hbar", r"\hbar"),
        ("xdot", r"\dot{x}"),
        ("xddot", r"\ddot{x}"),
        ("theta1dot", r"\dot{\theta}_{1}"),
        ("x_1dot", r"\dot{x}_{1}"),
        ("dot", r"\mathrm{dot}"),
        ("prime", r"\mathrm{prime}"),
        ("abs", r"\mathrm{abs}"),
        ("xbar", r"\mathrm{xbar}"),
        ("radius_bar", r"\mathrm{radius}_{\mathrm{bar}}"),
        ("_", r"\mathrm{\_}"),
        ("__a", r"\mathrm{\_\_a}"),
        ("a_", r"\mathrm{a\_}"),
        ("a__b", r"\mathrm{a\_\_b}"),
    ],
)
def test_latex_names(name: str, expected: str) -> None:
    assert latex_name(name) == expected


@pytest.mark.parametrize(
    ("source", "expected"),
    [
        ("2*M*a^2/3", r"\frac{2 M a^{2}}{3}"),
        ("sqrt(2)*x", r"\sqrt{2} x"),
        ("log(x)", r"\ln{\left(x \right)}"),
        ("asin(x)", r"\arcsin{\left(x \right)}"),
        ("abs(x)", r"\left|{x}\right|"),
        ("m1*theta1", r"m_{1} \theta_{1}"),
    ],
)
def test_latex(source: str, expected: str) -> None:
    assert latex(exact(source)) == expected


IDENTIFIERS = st.from_regex(r"[A-Za-z_][A-Za-z0-9_]{0,8}", fullmatch=True)


@settings(max_examples=100, deadline=None)
@given(IDENTIFIERS)
def test_every_identifier_makes_well_formed_latex(name: str) -> None:
    shown = latex(sympy.Symbol(name, real=True) ** 2 / 2)
    commands = re.sub(r"\\[A-Za-z]+|\\_", "", shown)
    assert re.fullmatch(r"[A-Za-z0-9{}^_, ]*", commands)
    depth = 0
    for character in commands:
        depth += {"{": 1, "}": -1}.get(character, 0)
        assert depth >= 0
    assert depth == 0
    assert not re.search(r"_[^{]|_\{[^{}]*\}_", commands), "a double or bare index"


SOURCES = st.recursive(
    st.sampled_from(["x", "y", "a", "m", "1", "2", "3", "0.5", "10", "pi", "-1", "1/3"]),
    lambda sources: st.one_of(
        st.tuples(sources, st.sampled_from("+-*/"), sources).map(lambda p: f"({p[0]}){p[1]}({p[2]})"),
        st.tuples(sources, st.sampled_from(["2", "-1", "(1/2)", "(-2/3)", "x"])).map(
            lambda p: f"({p[0]})^{p[1]}"
        ),
        st.tuples(st.sampled_from(sorted(FUNCTIONS)), sources, sources).map(
            lambda p: f"{p[0]}({', '.join(p[1 : 1 + FUNCTIONS[p[0]].arity])})"
        ),
    ),
    max_leaves=6,
)
POINT = {
    "x": sympy.Rational(4, 7),
    "y": sympy.Rational(-9, 5),
    "a": sympy.Rational(7, 3),
    "m": sympy.Integer(2),
}


def number(expr: sympy.Expr) -> complex:
    return complex(expr.evalf(30, subs={SYMBOLS[name]: value for name, value in POINT.items()}))


def same(first: complex, second: complex) -> bool:
    return abs(first - second) <= 1e-12 * (1 + abs(first))


@settings(max_examples=100, deadline=None)
@given(SOURCES)
def test_text_is_read_back_and_tidying_keeps_the_value(source: str) -> None:
    try:
        expr = exact(source)
        value = number(expr)
    except (ExpressionError, OverflowError):
        assume(False)
    assume(abs(value) < 1e12)
    shortest = tidy(expr)
    assert same(number(exact(text(expr))), value)
    assert same(number(shortest), value)
    assert same(number(exact(text(shortest))), value)
    assert len(text(shortest)) <= 2 * len(text(expr))
    assert latex(shortest).count("{") == latex(shortest).count("}")
