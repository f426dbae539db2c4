"""Reading expressions, and their values in floats and arrays."""

from __future__ import annotations

import inspect
import math
import sys
import time
from pathlib import Path

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import ExpressionError
from rigidcli.language import tree
from rigidcli.language.expression import array, parse, real
from rigidcli.language.text import reading, text
from rigidcli.language.words import FUNCTIONS
from tests.tables import pairs_of
from tests.trees import number, trees


def value(text: str, **values: float) -> float:
    return parse(text).evaluate(values)


def refusal(text: str) -> ExpressionError:
    with pytest.raises(ExpressionError) as caught:
        parse(text)
    return caught.value


VALUES = """
12.5 -> 12.5   .5 -> 0.5   2. -> 2.0   1e-3 -> 0.001   1E5 -> 100000.0   1e+2 -> 100.0   1 - 2 - 3 -> -4.0
8/4/2 -> 1.0   8/4*2 -> 4.0   2*-3 -> -6.0   2 - -3 -> 5.0   +3 -> 3.0   --3 -> 3.0   2^3^2 -> 512.0
2**3**2 -> 512.0   -2^2 -> -4.0   (-2)^2 -> 4.0   2^-1 -> 0.5   2**-2^2 -> 0.0625   -2^-2 -> -0.25
0^0 -> 1.0   sin(pi/6) -> 0.5   sqrt(2)^2 -> 2.0   abs(-3) + sign(-2) + sign(0) -> 2.0   log(exp(2)) -> 2.0
2·3⋅4 − 1 -> 23.0
"""


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        *pairs_of(VALUES),
        (" 1 + 2\t*\n3 ", 7.0),
        ("pi", math.pi),
        ("π/6", math.pi / 6),
        ("atan2(1, -1)", 3 * math.pi / 4),
    ],
)
def test_values(text: str, expected: float | str) -> None:
    assert value(text) == pytest.approx(float(expected), rel=1e-15)


WRITTEN = r"""
2**x/m -> (2**x)/m   x**-1/2 -> x^(-1)/2   x**1/2 -> (x^1)/2
2x -> 2*x   2 m g x -> 2*m*g*x   2(x + 1) -> 2*(x + 1)   m xdot^2/2 - k x^2/2 -> m*xdot^2/2 - k*x^2/2
(a + b)(a - b) -> (a + b)*(a - b)   (a + b)c -> (a + b)*c   x (a + b) -> x*(a + b)
l sin(theta) cos(phi) -> l*sin(theta)*cos(phi)   sin(x) (a + b) -> sin(x)*(a + b)   sin (x) -> sin(x)
pi r^2 -> pi*r^2   2pi r -> 2*pi*r   2πr -> 2*pir   2x^2 -> 2*x^2   2^x y -> 2^x*y   x^-2 y -> x^(-2)*y
-a b -> -(a*b)   a - b c -> a - b*c   a*b c/d*e f -> a*b*c/d*e*f   2e3 -> 2e3   2 e3 -> 2*e3   2e -> 2*e
2e3x -> 2e3*x   2.x -> 2.*x   x² -> x^2   x²y³ -> x^2*y^3   -x² -> -x^2   2x² + sin(x)² -> 2*x^2 + sin(x)^2
(a + b)² -> (a + b)^2   10⁻² -> 10^(-2)   5 m⁻¹² -> 5*m^(-12)   x^y² -> x^y^2   √2 -> sqrt(2)
√2 x -> sqrt(2)*x   √(2)x -> sqrt(2)*x   sqrt(1/2)x -> sqrt(1/2)*x
2√2√3/√x -> 2*sqrt(2)*sqrt(3)/sqrt(x)   √(x+1) -> sqrt(x + 1)
√sin(x) y -> sqrt(sin(x))*y   √√2 -> sqrt(sqrt(2))   ½ m v² -> 0.5*m*v^2   ½ m ẋ² -> 0.5*m*xdot^2
l θ̇² + θ̈ - ẏ_1*x1̇ -> l*thetadot^2 + thetaddot - y_1dot*x1dot   ¼x + ¾ -> 0.25*x + 0.75   ln(x) -> log(x)
1/2 m v^2 -> 1/2*m*v^2   sin²(x) -> sin(x)^2   sin^2 x -> sin(x)^2   ln x -> log(x)   √x² -> sqrt(x^2)
arcsin(x) + tg(y) -> asin(x) + tan(y)   |x| y -> abs(x)*y   2×x -> 2*x   x₁ + ⅓ -> x_1 + (1/3)
\frac{p^2}{2m} -> p^2/(2*m)   \sin\theta -> sin(theta)   lg(x) -> log(x)/log(10)   sin(30°) -> sin(30*pi/180)
2 cot(x)/m -> 2*(cos(x)/sin(x))/m   sec(x)csc(y) -> (1/cos(x))*(1/sin(y))
"""


@pytest.mark.parametrize(("written", "spelled"), pairs_of(WRITTEN))
def test_what_people_write_is_read_as_what_it_means(written: str, spelled: str) -> None:
    expected = parse(spelled)
    assert text(parse(written).root) == text(expected.root)
    assert parse(written).names == expected.names


@pytest.mark.parametrize("name", sorted(FUNCTIONS))
def test_every_function_agrees_with_math_and_numpy(name: str) -> None:
    arguments = (0.3, 0.7)[: FUNCTIONS[name].arity]
    if name == "acosh":
        arguments = (1.3,)
    names = ("x", "y")[: len(arguments)]
    expression = parse(f"{name}({', '.join(names)})")
    scalars = dict(zip(names, arguments, strict=True))
    expected = FUNCTIONS[name].real(*arguments)
    assert expression.evaluate(scalars) == expected
    arrays = {key: np.full(3, number) for key, number in scalars.items()}
    np.testing.assert_allclose(array(expression.root, arrays), np.full(3, expected), rtol=1e-14)


def test_the_tree() -> None:
    assert parse("a - b").root == tree.Sum((tree.Name("a"), tree.Negative(tree.Name("b"))))
    assert parse("2*a/b").root == tree.Product(
        (tree.Number("2", 2.0), tree.Name("a"), tree.Reciprocal(tree.Name("b")))
    )
    assert parse("-x^2").root == tree.Negative(tree.Power(tree.Name("x"), tree.Number("2", 2.0)))
    assert parse("atan2(y, pi)").root == tree.Call("atan2", (tree.Name("y"), tree.Constant("pi")))
    assert parse("(a + b) + c").root == tree.Sum((tree.Sum((tree.Name("a"), tree.Name("b"))), tree.Name("c")))


@pytest.mark.parametrize(
    ("text", "names"),
    [
        ("2*pi", set()),
        ("E + I*S - N/Q", {"E", "I", "S", "N", "Q"}),
        ("beta*gamma*lambda", {"beta", "gamma", "lambda"}),
        ("oo + zoo + nan + inf", {"oo", "zoo", "nan", "inf"}),
        ("Symbol + __import__ + _", {"Symbol", "__import__", "_"}),
        ("cos(omega*t)", {"omega", "t"}),
        ("th1*ch2 + sh_x/lg + tg", {"th1", "ch2", "sh_x", "lg", "tg"}),
        ("ω_0*t + Δx1", {"omega_0", "t", "Deltax1"}),
        ("ϑ + ϕ + ϵ + ϱ + ς", {"theta", "phi", "epsilon", "rho", "sigma"}),
        ("\N{MICRO SIGN} + \N{GREEK SMALL LETTER MU}", {"mu"}),
    ],
)
def test_names(text: str, names: set[str]) -> None:
    assert parse(text).names == names


REFUSED = yaml.safe_load(Path(__file__).with_name("refused.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize(
    ("text", "column", "message", "hint"),
    [
        *REFUSED,
        ("\ud800", 1, "U+D800", ""),
        ("1" * 401, 1, "at most 400 digits", ""),
        ("(" * 101 + "x" + ")" * 101, 102, "deeper than 100", ""),
        ("abs(" * 101 + "x" + ")" * 101, 405, "deeper than 100", ""),
        ("√" * 101 + "x", 102, "deeper than 100", ""),
    ],
)
def test_refusals(text: str, column: int, message: str, hint: str) -> None:
    error = refusal(text)
    assert error.column == column
    assert message in error.message
    assert hint in (error.hint or "")
    assert error.message.isascii()


NO_VALUE = """
1/0 -> division by zero   1/(a - a) -> division by zero   0^-1 -> division by zero
log(0) -> `log(0)` has no finite real value   sqrt(-4) -> `sqrt(-4)` has no finite real value
acos(2) -> no finite real value   atanh(1) -> no finite real value   (-8)^(1/3) -> no real value
(-8)^a -> no real value   9**9**9 -> too large   9**9**9**9 -> too large   exp(1000) -> too large
1e400 -> too large   1e308*10 -> too large   1e308 + 1e308 -> too large   1/1e-320 -> too large
1/(1e308*10) -> too large
"""


@pytest.mark.parametrize(
    ("text", "message"),
    pairs_of(NO_VALUE),
)
def test_no_finite_real_value(text: str, message: str) -> None:
    expression = parse(text)
    with pytest.raises(ExpressionError, match=message.replace("(", r"\(").replace(")", r"\)")):
        expression.evaluate({"a": 0.5})


def test_values_of_names() -> None:
    assert value("a*b", a=2, b=0.5, unused=3.0) == 1.0
    with pytest.raises(ExpressionError, match="no value for `b`"):
        value("a + b + c", a=1.0)
    with pytest.raises(ExpressionError, match="`a` is not a finite number"):
        value("a", a=math.nan)
    with pytest.raises(ExpressionError, match="`a` is not a finite number"):
        value("a", a=10**400)
    with pytest.raises(ExpressionError, match="too large"):
        value("a^a", a=10**6)


def test_arrays_element_by_element() -> None:
    x = np.array([-1.0, 0.0, 4.0])
    np.testing.assert_array_equal(array(parse("a*x^2 - 1").root, {"x": x, "a": 2.0}), [1.0, -1.0, 31.0])
    np.testing.assert_array_equal(array(parse("1/x").root, {"x": x}), [-1.0, math.inf, 0.25])
    np.testing.assert_array_equal(array(parse("sqrt(x)").root, {"x": x}), [math.nan, 0.0, 2.0])
    np.testing.assert_array_equal(array(parse("x^x").root, {"x": x}), [-1.0, 1.0, 256.0])
    np.testing.assert_array_equal(array(parse("x*(1/0)").root, {"x": x}), [-math.inf, math.nan, math.inf])
    whole = {"n": np.array([1, 2])}
    np.testing.assert_array_equal(array(parse("n^-1").root, whole), [1.0, 0.5])


HOSTILE_TEXTS = {
    "long": "x" * 100_000,
    "long sum": "+".join(["x"] * 10_000),
    "long product": "*".join(["x"] * 10_000),
    "parentheses": "(" * 10_000,
    "minuses": "-" * 10_000 + "x",
    "powers": "x^" * 9_999 + "x",
    "calls": "sin(" * 5_000,
    "digits": "1" * 20_000,
    "exponents": "1e" * 9_999,
    "blanks": " " * 19_999 + "x",
    "long product without signs": "x " * 10_000,
    "long product of numbers and names": "2x " * 6_000,
    "superscripts": "x" + "²" * 19_000,
    "roots": "√" * 20_000,
    "unclear quotients in each other": "1/2 (" * 4_000,
    "blanks after a number": "2" + " " * 19_000 + "x",
    "tower": "9**9**9**9**9",
    "deepest": "1+2/sin(" * 50 + "(" * 50 + "x" + ")" * 100,
}


@pytest.mark.parametrize("text", HOSTILE_TEXTS.values(), ids=HOSTILE_TEXTS.keys())
def test_any_text_is_accepted_or_refused_within_a_second(text: str) -> None:
    start = time.process_time()
    try:
        expression = parse(text)
        expression.evaluate(dict.fromkeys(expression.names, 1.0))
    except ExpressionError:
        pass
    assert time.process_time() - start < 1.0


def test_the_deepest_text_leaves_room_on_the_stack() -> None:
    text = "1+2/sin(" * 100 + "x" + ")" * 100
    depth = len(inspect.stack())
    limit = sys.getrecursionlimit()
    sys.setrecursionlimit(depth + 750)
    try:
        assert math.isfinite(value(text, x=1.0))
    finally:
        sys.setrecursionlimit(limit)


SOUP = st.one_of(
    st.text(max_size=40),
    st.text(alphabet="0123456789.eE+-*/^(), xytpiπΩ_−·'\"[]=:²³⁻√½", max_size=40),
    *(
        st.lists(st.sampled_from([*FUNCTIONS, *"xy()+-*/^,20²√½", "ln", "pi", ".5"]), max_size=20).map(
            blank.join
        )
        for blank in (" ", "")
    ),
    st.lists(st.sampled_from([*"xy()/2²√½", "sin(x)", "(x + y)"]), max_size=9).map(" ".join),
)


@settings(max_examples=200)
@given(SOUP)
def test_soup_is_an_expression_or_an_expression_error(source: str) -> None:
    error = None
    result = 0.0
    try:
        expression = parse(source)
        result = expression.evaluate(dict.fromkeys(expression.names, 1.5))
    except ExpressionError as caught:
        error = caught
    else:
        again = parse(reading(expression.root)).root
        assert again == parse(text(expression.root)).root
        assert real(again, dict.fromkeys(expression.names, 1.5)) == result
    assert math.isfinite(result)
    assert error is None or error.column is None or 1 <= error.column <= len(source) + 1


NAMED = {"x": 0.75, "y": -1.25, "m_1": 3.0}
LEAVES: st.SearchStrategy[tree.Node] = st.one_of(
    st.sampled_from(sorted(NAMED)).map(tree.Name),
    st.sampled_from(["0.0", "1.0", "2.0", "3.0", ".5", "2.5", "1e-3", "40.0"]).map(number),
    st.just(tree.Constant("pi")),
)


def by_python(written: str, **values: float) -> float | None:
    """The value that Python gives a text: it has the same grammar, but complex powers."""
    functions = {name: function.real for name, function in FUNCTIONS.items()}
    try:
        found = eval(written, {"pi": math.pi, **functions, **NAMED, **values})
    except (ValueError, ArithmeticError, TypeError):  # the last of a function of a complex power
        return None
    return found if isinstance(found, float) and math.isfinite(found) else None


@settings(max_examples=150)
@given(trees(LEAVES))
def test_random_trees_have_the_value_python_gives_them(node: tree.Node) -> None:
    written = text(node)
    expected = by_python(written)
    if expected is None:
        with pytest.raises(ExpressionError):
            parse(written).evaluate(NAMED)
    else:
        assert parse(written).evaluate(NAMED) == expected


@settings(max_examples=100)
@given(trees(LEAVES), st.lists(st.floats(-10, 10), min_size=1, max_size=4))
def test_arrays_agree_with_floats(node: tree.Node, numbers: list[float]) -> None:
    expression = parse(f"x + ({text(node)})")
    is_arithmetic = "**" not in expression.text and not any(name in expression.text for name in FUNCTIONS)
    results = array(expression.root, {**NAMED, "x": np.array(numbers)})
    for one, result in zip(numbers, results, strict=True):
        try:
            expected = expression.evaluate({**NAMED, "x": one})
        except ExpressionError:
            continue
        assert result == (expected if is_arithmetic else pytest.approx(expected, rel=1e-9))
