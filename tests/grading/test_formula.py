"""Expressions in answers: what is read, and when two of them are the same function."""

from __future__ import annotations

import pickle
import time
from dataclasses import replace

import numpy as np
import pytest

from rigidcli.algebra.field import P
from rigidcli.errors import ValueProblem
from rigidcli.grading.expressions.agreement import Function, Told
from rigidcli.grading.expressions.formula import (
    Vocabulary,
    draw,
    independent,
    names_in,
    read,
    size_of,
    spellings,
)
from rigidcli.grading.expressions.ground import ground
from rigidcli.grading.expressions.mistakes import factor
from rigidcli.grading.outcome import Unreadable
from rigidcli.language import parser
from rigidcli.language.text import text
from tests.grading.asking import cases

NAMES = Vocabulary(
    {"m": "positive", "k": "positive", "c": "positive", "x": "real", "theta": "real", "p_x": "real"},
    {"w": parser.read("sqrt(k/m)")[0], "T": parser.read("2*pi/w")[0]},
    {"px": "p_x"},
)
MOVING = replace(NAMES, domains={**NAMES.domains, **dict.fromkeys(["xdot", "xddot", "thetaddot"], "real")})


def function(text: str, *, seed: int = 7) -> Function:
    tree = read(text, NAMES)
    return Function(tree, ground(tree, NAMES, ("x", "theta", "p_x"), seed))


def told(key: Function, answer: str, *, relative: float | None = None, constant: bool = False) -> Told:
    return Function(read(answer, NAMES), key.ground).is_same(key, constant=constant, relative=relative)


def same(key: str, answer: str, *, relative: float | None = None, constant: bool = False) -> bool:
    return told(function(key), answer, relative=relative, constant=constant) is True


# --- reading


@cases(
    """
    meant | typed
    m*x**2 | m*x^2
    p_x**2/(2*m) | px^2/(2*m)  H(x, p_x) = p_x^2/(2*m)
    m*x | H = m*x  p_x=m*x  m·x  m x
    p_x/m | ẋ = p_x/m  ẋ = p_x/m  x' = p_x/m
    x | H (x,ṗ , θ)= x
    m*xdot | m*x'
    m*xddot*xdot + thetaddot | m*x''*x’ + θ″
    cos(theta) - 1 | cos(θ) − 1
    2*x | 2x
    0.5*m*x**2 | ½ m x²
    m*w**2*T | m*w^2*T
    2 | 2
    """,
    ("m*x**2", "  m * x**2 "),
)
def test_what_is_read(typed: str, meant: str) -> None:
    assert text(read(typed, MOVING)) == meant


@cases(
    """
    code | words | typed
    unknown_symbol | `z` | m*z
    unknown_symbol | did you mean `theta`? | m*Theta
    parse_error | column 3 | x 2  m*(x  m*
    parse_error | `1/(2*m)` or `m/2` | 1/2 m
    parse_error | = | m = x = 2  m == x  H(x+1) = x
    unknown_symbol | mdot | m'
    parse_error | a time derivative is spelled `xdot` | m*ẋ  m*ẋ
    parse_error | a second one `xddot` | θ̈
    too_large | power of ten | 1e99999
    parse_error | ' | __import__('os')
    parse_error | . | x.__class__
    parse_error | `eval` is not a function | eval(x)
    """,
    ("parse_error", "empty", "   "),
    ("parse_error", "U+001B", "x\x1b[31m"),
    ("too_deep", "100", "(" * 101 + "x" + ")" * 101),
    ("too_large", "20001", "x+" * 10_000 + "x"),
    ("too_large", "400", "1" * 401),
    ("parse_error", "", "lambda x: x"),
    ("unknown_symbol", "", "import os"),
)
def test_what_is_refused(typed: str, code: str, words: str) -> None:
    with pytest.raises(Unreadable) as refused:
        read(typed, NAMES, "left side")
    finding = refused.value.finding
    assert (finding.code, finding.place) == (code, "left side")
    assert words in finding.detail
    assert finding.detail.isprintable()


@pytest.mark.parametrize("tree", [None, ["x"], {"H": "x"}, []])
def test_only_a_text_is_an_expression(tree: object) -> None:
    with pytest.raises(Unreadable) as refused:
        read(tree, NAMES)
    assert refused.value.finding.code == "wrong_shape"


def test_names_are_told_only_where_they_may_be() -> None:
    told = Vocabulary({"m": "positive", "xdot": "real"}, {}, {}, told=True, unlisted=frozenset(["xdot"]))
    secret = Vocabulary({"m": "positive"}, {}, {}, told=False)
    details = []
    for names in (told, secret):
        with pytest.raises(Unreadable) as refused:
            read("q", names)
        details.append(refused.value.finding.detail)
    assert details == ["read `q`, the symbols are `m`", "read `q`"]
    assert text(read("m*xdot", told)) == "m*xdot"


def test_other_spellings_mean_one_thing_only() -> None:
    assert spellings(["x", "p_x"], ["p_x"], ["xdot"]) == {"px": "p_x", "p": "p_x", "x_dot": "xdot"}
    assert spellings(["px", "p"], ["p_x"], []) == {}
    assert spellings([], ["p_x", "p_y"], []) == {"px": "p_x", "py": "p_y"}
    assert spellings(["m1", "k_2", "x1y"], [], []) == {"m_1": "m1", "k2": "k_2"}
    taken = spellings(["m1", "m_1", "p_1", "p_q1"], ["p_q1"], [])
    assert taken == dict.fromkeys(["p", "pq1", "pq_1", "p_q_1"], "p_q1")
    momenta, velocities = ["p_q1", "p_q2"], ["q1dot", "q2dot"]
    moving = spellings(["q1", "q2", *momenta, *velocities], momenta, velocities)
    assert {moving[each] for each in ("p1", "p_1", "pq1", "p_q_1")} == {"p_q1"}
    assert {moving[each] for each in ("q2_dot", "q_2dot", "q_2_dot")} == {"q2dot"}
    assert "p1" not in spellings(["x1", "y1"], ["p_x1", "p_y1"], [])
    assert "v_dot" not in spellings(["x", "v"], [], ["v"])


def test_trees_are_walked() -> None:
    tree = parser.read("-a*atan2(b, c)**d/e + 2 - pi")[0]
    assert names_in(tree) == set("abcde")
    assert size_of(parser.read("a + b*c")[0]) == 5
    assert independent(NAMES.derived, ["T", "x"]) == {"k", "m", "x"}


# --- points


def test_points_are_the_same_every_time_and_lie_where_they_may() -> None:
    first, second = draw(NAMES, 200), draw(NAMES, 200)
    for name, domain in NAMES.domains.items():
        np.testing.assert_array_equal(first.values[name], second.values[name])
        assert (first.values[name] > 0).all() == (domain == "positive")
        assert np.abs(first.values[name]).min() < 0.2
        assert np.abs(first.values[name]).max() > 5
    assert not np.array_equal(draw(NAMES, 200, seed=2).values["x"], first.values["x"])


# --- the same function

SAME = [
    ("p_x^2/(2*m) + k*x^2/2", "(p_x^2 + m*k*x^2)/(2*m)"),
    ("p_x^2/(2*m) + k*x^2/2", "0.5*p_x*p_x/m + 0.5*m*w^2*x^2"),
    ("sqrt(k/m)", "w"),
    ("sqrt(k/m)", "2*pi/T"),
    ("sqrt(k/m)", "sqrt(k)/sqrt(m)"),
    ("log(m^2)", "2*log(m)"),
    ("sqrt(x^2)", "abs(x)"),
    ("sin(2*theta)", "2*sin(theta)*cos(theta)"),
    ("cos(theta)^2", "(1 + cos(2*theta))/2"),
    ("1", "cosh(x)^2 - sinh(x)^2"),
    ("(x^3 - 1)/(x - 1)", "x^2 + x + 1"),
    ("x + 1", "(x^2 - 1)/(x - 1)"),
    ("x", "x + 0*sin(1e300)"),
    ("atan2(p_x, m)", "atan(p_x/m)"),
    ("0", "x*p_x*k/m - p_x*x/m*k"),
    ("x*p_x*k/m - p_x*x/m*k", "0"),
    ("0", "k*(sin(x)^2 + cos(x)^2 - 1)"),
    # Floats say nothing of these: all digits cancel.
    ("p_x^2/(2*m) + k*x^2/2", "(1e16 + p_x^2/(2*m) + k*x^2/2) - 1e16"),
    ("x", "(x + 1e40) - 1e40"),
    ("cos(1e-9*x)", "sin(pi/2 - 1e-9*x)"),
    ("c^2*(sqrt(1 + 1e-18*p_x^2/c^2) - 1)", "1e-18*p_x^2/(1 + sqrt(1 + 1e-18*p_x^2/c^2))"),
    ("1e9 + x", "x + 1e9"),
    ("sqrt(p_x^2*299792458^2 + m^2*299792458^4)", "299792458*sqrt(p_x^2 + m^2*299792458^2)"),
    ("sqrt(x^2 + m^2)", "exp(log(x^2 + m^2)/2)"),
    ("cos(theta) - x^(sin(x)^2 + cos(x)^2 + 1)", "2*cos(theta/2)^2 - 1 - x^2"),
    ("abs(x)*theta", "sqrt(x^2)*theta"),
    ("x", "x + 0*acosh(2 + exp(theta - 1e9))"),
    ("sqrt(1 - x^2/c^2)", "sqrt(c^2 - x^2)/c"),
    # A simpler form may have values where the key has none.
    ("2*log(x)", "log(x^2)"),
    ("sqrt(x)^2", "x"),
    ("x^0.5*x^0.5", "x"),
]  # fmt: skip

DIFFERENT = [
    ("p_x^2/(2*m) + k*x^2/2", "p_x^2/(2*m) - k*x^2/2"),
    ("p_x^2/(2*m) + k*x^2/2", "p_x^2/(2*m) + k*x^2/2 + 1"),
    ("p_x^2/(2*m) + k*x^2/2", "1.0000001*p_x^2/(2*m) + k*x^2/2"),
    ("log(x^2)", "2*log(x)"),
    ("sqrt(x^2)", "x"),
    ("sin(theta)", "sqrt(1 - cos(theta)^2)"),
    ("atan2(p_x, x)", "atan(p_x/x)"),
    ("x", "x^3/x^2*abs(x)/x"),
    ("1/3", "0.333333333333"),
    ("pi*m", "3.14159265358979*m"),
    ("1e9 + x", "1e9"),
    ("1e9 + x", "1e9 + 1.0001*x"),
    ("1e12*k + x", "1e12*k"),
    ("sqrt(p_x^2*299792458^2 + m^2*299792458^4)", "m*299792458^2"),
    ("cos(1e-9*x)", "1"),
    ("0", "1e-20*x"),
    ("0", "(x + 1e16) - 1e16 - 2*x"),
    ("x", "(x*1.0001 + 1e16) - 1e16"),
    ("x", "1/0"),
    ("x", "x + log(-1)*0"),
    ("x", "10**10**10"),
    ("x", "x + 1/(x + k - x - k)"),
    ("m", "exp(exp(exp(exp(100*m))))"),
]


@pytest.mark.parametrize(("key", "answer"), SAME)
def test_equal_functions_are_the_same(key: str, answer: str) -> None:
    assert same(key, answer)


@pytest.mark.parametrize(("key", "answer"), DIFFERENT)
def test_other_functions_are_not(key: str, answer: str) -> None:
    assert not same(key, answer)


OPEN = [
    ("abs(theta - 1e9) + theta - 1e9", "theta - 1000000000"),
    ("sqrt((theta - 1e9)^2) + theta - 1e9", "theta - 1000000000"),
    ("sign(theta + x - 1e8) + 1", "100000000"),
    ("theta - 1e9*atan(tan(theta/1e9))", "cos(theta/1000000000)"),
    ("atan(1/(theta - 1e9)) + atan(theta - 1e9) + pi/2", "theta - 1000000000"),
    ("(abs(theta - 10) + theta - 10)*(abs(10.01 - theta) + 10.01 - theta)", "theta - 10"),
    ("0*log(1e9 - theta)", "theta - 1000000000"),
    ("0*sqrt(theta + 1e9)", "theta + 1000000000"),
    ("0*asin(theta/1e9)", "1000000000"),
    ("0*(1e9 + theta)^0.3", "theta + 1000000000"),
    ("cos(theta) + 1 - 2*cos(theta/2)^2 + exp(-1e6*(theta - 0.123)^2)", "too small"),
    ("(1 - cos(theta) - 2*sin(theta/2)^2)*x + (1 - tanh(1e6*(theta - 77.7))^2)", "too few points"),
    ("x*(2*cos(theta/2)^2 - 1 - cos(theta)) + tanh(1e8*x) - sign(x)", "too few points"),
    ("x*(2*cos(theta/2)^2 - 1 - cos(theta)) + 1e200*sin(1e-200*x) - x", "too small"),
]


@pytest.mark.parametrize(("nothing", "words"), OPEN)
def test_what_vanishes_wherever_it_was_tried_need_not_be_zero(nothing: str, words: str) -> None:
    for key in ("x + theta", "cos(theta)*x"):
        found = told(function(key), f"{key} + {nothing}")
        assert isinstance(found, str)
        assert words in found


def test_an_answer_that_is_the_key_in_a_finite_field_need_not_be_right() -> None:
    """What is added is a multiple of the number of its elements, and too small to be seen at the points."""
    key = function("m*x")
    assert told(key, f"m*x + x*{P}*0.1^200") is False
    assert told(key, f"m*x + {P}*0.1^120/((x - 0.123)^2 + 0.1^60)") is not True
    assert told(key, f"m*x + cos({P}*x) - cos(2*{P}*x)", constant=True) is False


@pytest.mark.parametrize("constant", ["1", "-m*c^2", "1e6*k", "cos(m)"])
def test_a_constant_is_told_from_what_changes(constant: str) -> None:
    key = "p_x^2/(2*m) + k*x^2/2"
    assert same(key, f"{key} + {constant}", constant=True)
    for change in ("x", "theta", "1e-3*p_x", "k*sin(x)"):
        assert not same(key, f"{key} + {constant} + {change}", constant=True)
    assert not same(key, f"2*({key}) + {constant}", constant=True)


def test_a_tolerance_is_relative_to_the_terms() -> None:
    key = "p_x^2/(2*m) + k*x^2/3"
    assert same(key, "p_x^2/(2*m) + 0.333*k*x^2", relative=2e-3)
    assert not same(key, "p_x^2/(2*m) + 0.33*k*x^2", relative=2e-3)
    assert not same(key, "p_x^2/(2*m)", relative=2e-3)


@pytest.mark.parametrize(
    "key", ["log(-m)", "1/0", "sqrt(-1 - x^2)", "exp(exp(exp(exp(9*k + 9))))", "asin(2 + m)"]
)
def test_a_key_without_values_is_refused(key: str) -> None:
    with pytest.raises(ValueProblem, match="value"):
        function(key)


@pytest.mark.parametrize(
    "key", ["sqrt(1 - x^2/c^2)", "acos((m^2 + k^2 - c^2)/(2*m*k))", "asin(x)", "log(x - m)"]
)
def test_a_key_with_values_on_a_part_of_the_domain_is_none(key: str) -> None:
    assert same(key, f"3*({key}) - 2*({key})")
    assert told(function(key), f"({key})*1.001") is False


@pytest.mark.parametrize(
    ("answer", "number"), [("3*x*k", 3.0), ("-x*k", -1.0), ("x*k", 1.0), ("pi*k*x", np.pi)]
)
def test_a_common_factor_is_found(answer: str, number: float) -> None:
    points = draw(NAMES, 40)
    found = factor(points.at(read(answer, NAMES)), points.at(read("x*k", NAMES)))
    assert found is not None
    assert float(found) == pytest.approx(number, rel=1e-12)


@pytest.mark.parametrize("answer", ["x*k^2", "0", "x*k + 1", "1/0", "sqrt(x)*k", "x*k + 1e-15"])
def test_there_need_not_be_one(answer: str) -> None:
    points = draw(NAMES, 40)
    assert factor(points.at(read(answer, NAMES)), points.at(read("x*k", NAMES))) is None


def test_a_function_goes_to_another_process() -> None:
    key = function("k*x^2/2")
    assert told(key, "m*w^2*x^2/2") is True
    copy: Function = pickle.loads(pickle.dumps(key))
    assert told(copy, "m*w^2*x^2/2") is True
    assert told(copy, "m*w^2*x^2") is False


@pytest.mark.parametrize("seed", range(20))
def test_points_follow_from_the_seed(seed: int) -> None:
    """A polynomial that vanishes at all points of one question is another function at those of the next."""
    key = function("k*x^2/2", seed=seed)
    zeros = "*".join(f"(x - ({x!r}))" for x in key.ground.points.values["x"].tolist())
    answer = f"k*x^2/2 + {zeros}"
    assert told(key, answer) is not True
    assert told(function("k*x^2/2", seed=seed + 1), answer) is False


HOSTILE = {
    "long": "x*" * 9_999 + "x",
    "functions": "+".join(["sin(x)"] * 2_800),
    "powers": "+".join(["(x+k)**99"] * 2_000),
    "cancelling": "*".join(["(x+1e16-1e16)"] * 1_400),
    "deep": "exp(" * 99 + "9" + ")" * 99,
    "fractions": "+".join(f"1/{n}" for n in range(1_001, 3_800)),
    "digits": "*".join(["9" * 390] * 50),
    "nines": "(" * 99 + "9" + "**99)" * 99,
    "tower": "9**" * 99 + "9",
    "roots": "sqrt(" * 99 + "x^2" + ")" * 99,
    "quotients": "x" + "/sqrt(x^2 + 0.1)" * 1_100,
}


@pytest.mark.parametrize("name", HOSTILE)
def test_no_answer_takes_long(name: str) -> None:
    key = function("p_x^2/(2*m) + k*x^2/2")
    start = time.process_time()
    assert told(key, HOSTILE[name]) is not True
    assert told(key, HOSTILE[name], constant=True) is not True
    assert time.process_time() - start < 5
