"""Trees as text: read back with the same value, and spelled as on paper."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from rigidcli.errors import ExpressionError
from rigidcli.language.expression import real
from rigidcli.language.parser import MAX_DEPTH, read
from rigidcli.language.text import latex, reading, text
from rigidcli.language.tree import Call, Constant, Name, Node
from rigidcli.language.words import FUNCTIONS
from tests.tables import pairs_of, rows_of, words_of
from tests.trees import number, trees

many = settings(max_examples=100)

NAMES: dict[str, str] = rows_of(__file__, "names")
"""Names and how they are typeset."""

VALUES = st.fixed_dictionaries(
    {name: st.one_of(st.floats(-3, 3), st.sampled_from([0.0, 1.0, -1.0, 1e200])) for name in NAMES}
)
POSITIVE = st.fixed_dictionaries({name: st.floats(0.5, 2) for name in NAMES})


LEAVES: st.SearchStrategy[Node] = st.one_of(
    st.sampled_from(sorted(NAMES)).map(Name),
    st.sampled_from(["0", "1", "2", "3", "0.25", "12", "1e-07", "6.67e+11"]).map(number),
    st.just(Constant("pi")),
)


TREES = trees(LEAVES)


def root(source: str) -> Node:
    return read(source)[0]


def outcome(node: Node, values: dict[str, float]) -> str:
    """The value to the last bit and sign, or that there is none."""
    try:
        return repr(real(node, values))
    except ExpressionError:
        return "none"


@many
@given(TREES, VALUES)
def test_text_is_read_back_with_the_same_value(node: Node, values: dict[str, float]) -> None:
    assert outcome(root(text(node)), values) == outcome(node, values)


def pairs(written: str) -> Iterator[tuple[int, int]]:
    """Where parentheses that group open and close."""
    opened: list[int] = []
    for place, character in enumerate(written):
        if character == "(":
            opened.append(place)
        elif character == ")":
            start = opened.pop()
            if not written[:start][-1:].isalnum():
                yield start, place


@many
@given(TREES)
def test_no_parentheses_could_be_left_out(node: Node) -> None:
    written = text(node)
    for start, end in pairs(written):
        bare = written[:start] + written[start + 1 : end] + written[end + 1 :]
        if written[:start].endswith("**") and written[start + 1] == "-":
            continue
        try:
            without = root(bare)
        except ExpressionError:
            continue
        assert without != root(written)


SHORT = """
x   pi   6.67e-11   -a   a - b   -a + b   a - (b - c)   -(a + b)   -(a + b)*c   p_x**2/(2*m) + k*x**2/2
k*(x - y)**2/2   (a + b)/(c*d)   a/b*c   a/(b/c)   a*(b*c)   1/x   1/(a + b)**2   -1/x   -x**2   (-x)**2
-(-2)**x   a**b**c   (a**b)**c   (a*b)**c   a**(b*c)   a**(1/2)   x**(-2)   x**(-a/b)   sin(theta)**2
sqrt(x)**3   sqrt(a**2 + b**2)   atan2(-y, x)
m*l**2*(theta1dot**2 + 2*cos(theta1 - theta2)*theta1dot*theta2dot)/2
"""


@pytest.mark.parametrize("written", words_of(SHORT))
def test_text_is_short(written: str) -> None:
    assert text(root(written)) == written


BARE = """
((x)) -> x   (a + b) + c -> a + b + c   (a*b)/c -> a*b/c   a*-b -> -a*b   a/-b -> -a/b   -a*-b -> a*b
--a -> a   a - -b -> a + b   a + (-b)*c -> a - b*c   -(-(a + b)) -> a + b   a^(b^c) -> a**b**c
x^-2 -> x**(-2)   (sin(x))^2 -> sin(x)**2
"""


@pytest.mark.parametrize(("source", "expected"), pairs_of(BARE))
def test_text_leaves_out_what_says_nothing(source: str, expected: str) -> None:
    assert text(root(source)) == expected


READ = """
M*a^2/12 -> M a^2/12   x/(2*m) -> x/(2 m)   a*(b + c) -> a (b + c)   10*2^(1/3) -> 10*2^(1/3)   x*.5 -> x*.5
2*3*x -> 2*3 x   -k*x -> -k x   a*b/c*d -> a b/c*d   (a/b)*c -> a/b*c   1/2*m*v^2 -> 1/2*m*v^2
(a + b)*(c - d) -> (a + b) (c - d)   (a*b)^2 -> (a b)^2   p_x^2/(2*m) + k*x^2/2 -> p_x^2/(2 m) + k x^2/2
2*m*g*l*sin(theta)^2 -> 2 m g l sin(theta)^2   atan2(2*y, x) -> atan2(2 y, x)
"""


@pytest.mark.parametrize(("source", "expected"), pairs_of(READ))
def test_reading(source: str, expected: str) -> None:
    assert reading(root(source)) == expected


@many
@given(TREES, VALUES)
def test_reading_says_the_same_as_text(node: Node, values: dict[str, float]) -> None:
    assert outcome(root(reading(node)), values) == outcome(node, values)


@many
@given(TREES)
def test_reading_is_read_back_as_the_same_tree(node: Node) -> None:
    assert root(reading(node)) == root(text(node))


LATEX = r"""
p_x^2/(2*m) + k*x^2/2 -> \frac{p_{x}^{2}}{2 m} + \frac{k x^{2}}{2}   -k*x -> -k x   -x/2 -> -\frac{x}{2}
x/-2 -> -\frac{x}{2}   (a - b)/-c -> -\frac{a - b}{c}   a - (b - c) -> a - \left(b - c\right)
-(a + b) -> -\left(a + b\right)   a - -b -> a + b   1/x -> \frac{1}{x}   1/2*m*v^2 -> \frac{m v^{2}}{2}
1*1 -> 1   a/b/c*d -> \frac{a d}{b c}
(a + b)*c/(d*(e + f)) -> \frac{\left(a + b\right) c}{d \left(e + f\right)}
a/(1 + b/c) -> \frac{a}{1 + \frac{b}{c}}   a/(b/c) -> \frac{a}{\frac{b}{c}}
(a/b)^2 -> \left(\frac{a}{b}\right)^{2}   sin(theta)^2 -> \sin^{2}\theta   sin(x) -> \sin x
sin(2*x)^2 -> \sin^{2}\left(2 x\right)   cos(theta_1 - theta_2) -> \cos\left(\theta_{1} - \theta_{2}\right)
sin(-x) -> \sin\left(-x\right)   sin(x)^(-1) -> \left(\sin x\right)^{-1}
sin(x)^y -> \left(\sin x\right)^{y}   sin(theta)*phidot*cos(phi) -> \dot{\phi} \sin\theta \cos\phi
(a*sin(x))*b -> b a \sin x   (-(a*sin(x)))*b -> -b a \sin x   sin(cos(x)) -> \sin\left(\cos x\right)
theta1dot^2 -> \dot{\theta}_{1}^{2}   xdot*p_x -> \dot{x} p_{x}   m*xddot -> m \ddot{x}
omega_0*t -> \omega_{0} t   2*pi*hbar -> 2 \pi \hbar   sqrt(k/m)*t -> \sqrt{\frac{k}{m}} t
sqrt(x)^3 -> \left(\sqrt{x}\right)^{3}   x^(3/2) -> x^{3/2}   x^(-1/2) -> x^{-1/2}
x^(a*b/2) -> x^{\frac{a b}{2}}   (-2)^x -> \left(-2\right)^{x}   -2^x -> -2^{x}   a^b^c -> a^{b^{c}}
(a^b)^c -> \left(a^{b}\right)^{c}
exp(-gamma*t)*cos(omega*t) -> \mathrm{e}^{-\gamma t} \cos\left(\omega t\right)
abs(x)^2*sign(y) -> \left|x\right|^{2} \operatorname{sgn}y   log(x) -> \ln x
asin(x/2) -> \arcsin\left(\frac{x}{2}\right)   atan2(y, x) -> \operatorname{atan2}\left(y, x\right)
2*mass*length/t -> \frac{2 \, \mathrm{mass} \, \mathrm{length}}{t}   x*massdot -> x \, \dot{\mathrm{mass}}
I_max*omega -> I_{\mathrm{max}} \omega   2*3*x -> 2 \cdot 3 x   x*2^y -> x \cdot 2^{y}
6.67e-11*m -> 6.67 \times 10^{-11} m   2E05^2 -> \left(2 \times 10^{5}\right)^{2}
"""


@pytest.mark.parametrize(("source", "expected"), pairs_of(LATEX))
def test_latex(source: str, expected: str) -> None:
    assert latex(root(source)) == expected


HEADS = {r"\arcsin": "asin", r"\arccos": "acos", r"\arctan": "atan", r"\ln": "log"} | {
    rf"\{name}": name for name in ("sin", "cos", "tan", "sinh", "cosh", "tanh")
}
TIMES = {r"\cdot": "*", r"\times": "*", r"\,": "*", "/": "/"}
OPERATORS = {"arsinh": "asinh", "arcosh": "acosh", "artanh": "atanh", "sgn": "sign", "atan2": "atan2"}
TOKEN = re.compile(
    r"\\,|(?:\\mathrm|\\operatorname|\\dot)\{\\?\w+\}(?:_\{\w+\})?|\\?[A-Za-z]+(?:_\{\w+\})?|[0-9.]+|\S"
)


class Typeset:
    """What LaTeX says, in the expression language, by the conventions of print alone."""

    def __init__(self, written: str) -> None:
        self.tokens: list[str] = [*TOKEN.findall(written), "end"]
        self.names = {shown: name for name, shown in NAMES.items()} | {r"\pi": "pi"}

    def whole(self) -> str:
        spelled = self.sum()
        assert self.tokens == ["end"]
        return spelled

    def take(self, *expected: str) -> str:
        token = self.tokens.pop(0)
        assert not expected or token in expected
        return token

    def group(self) -> str:
        self.take("{")
        inside = self.sum()
        self.take("}")
        return f"({inside})"

    def sum(self) -> str:
        spelled = self.take() if self.tokens[0] == "-" else ""
        spelled += self.product()
        while self.tokens[0] in ("+", "-"):
            spelled += self.take() + self.product()
        return spelled

    def product(self) -> str:
        spelled, is_bare = self.factor()
        while self.tokens[0] not in ("+", "-", "}", r"\right", ",", "end"):
            operator = "*"
            if self.tokens[0] in TIMES:
                operator = TIMES[self.take()]
            else:
                assert not self.tokens[0][0].isdigit(), "two numbers side by side"
            if is_bare:
                assert self.is_head(), "a factor that a function seems to take in"
            factor, is_bare = self.factor()
            spelled += operator + factor
        return spelled

    def is_head(self) -> bool:
        return self.tokens[0] in HEADS or self.tokens[0].startswith(r"\operatorname")

    def factor(self) -> tuple[str, bool]:
        if self.is_head():
            return self.call()
        base = self.atom()
        if self.tokens[0] != "^":
            return base, False
        self.take()
        exponent = self.group()
        assert self.tokens[0] != "^", "a double superscript"
        return (f"exp{exponent}" if base == "e" else f"({base})**{exponent}"), False

    def atom(self) -> str:
        token = self.take()
        if token in self.names:
            return self.names[token]
        if token == r"\mathrm{e}":
            return "e"
        if token == r"\frac":
            return f"({self.group()}/{self.group()})"
        if token == r"\sqrt":
            return f"sqrt{self.group()}"
        if token == r"\left":
            opening = self.take("(", "|")
            inside = self.sum()
            self.take(r"\right")
            self.take({"(": ")", "|": "|"}[opening])
            return f"({inside})" if opening == "(" else f"abs({inside})"
        assert token[0].isdigit()
        return token

    def call(self) -> tuple[str, bool]:
        head = self.take()
        name = HEADS.get(head) or OPERATORS[head.removeprefix(r"\operatorname{").removesuffix("}")]
        exponent = ""
        if self.tokens[0] == "^":
            self.take()
            exponent = f"**{self.group()}"
        is_bare = self.tokens[:2] != [r"\left", "("]
        if is_bare:
            return f"{name}({self.atom()}){exponent}", True
        self.take()
        self.take()
        arguments = [self.sum()]
        while self.tokens[0] == ",":
            self.take()
            arguments.append(self.sum())
        self.take(r"\right")
        self.take(")")
        return f"{name}({','.join(arguments)}){exponent}", False


@settings(max_examples=150)
@given(TREES, POSITIVE)
def test_latex_has_the_same_value(node: Node, values: dict[str, float]) -> None:
    try:
        expected = real(node, values)
        nearby = [real(node, {n: v * factor for n, v in values.items()}) for factor in (1 - 1e-12, 1 + 1e-12)]
    except ExpressionError:
        assume(False)
    # Where rounding moves the value by itself, as sin(1e200) does, there is nothing to compare.
    assume(all(math.isclose(value, expected, rel_tol=1e-6) for value in nearby))
    shown = real(root(Typeset(latex(node)).whole()), values)
    assert math.isclose(shown, expected, rel_tol=1e-5, abs_tol=1e-200)


def test_every_function_can_be_written() -> None:
    for name, function in FUNCTIONS.items():
        node = Call(name, tuple(map(Name, "xk"[: function.arity])))
        assert root(text(node)) == node
        assert reading(node) == text(node)
        assert root(Typeset(latex(node)).whole()) == node


WRITERS: list[Callable[[Node], str]] = [text, reading, latex]


@pytest.mark.parametrize(
    ("opening", "closing", "levels"),
    [
        ("(", "", MAX_DEPTH),
        ("sin(", "", MAX_DEPTH),
        ("a - b/(", " + c)", MAX_DEPTH),
        ("a/-(", "*c)", MAX_DEPTH // 2),
        ("a - b*(", " - c)**2", MAX_DEPTH // 2),
        ("-", "", MAX_DEPTH),
        ("x**", "", MAX_DEPTH),
    ],
)
def test_the_deepest_texts(opening: str, closing: str, levels: int) -> None:
    node = root(opening * levels + "x" + (closing or ")" * opening.count("(")) * levels)
    again = root(text(node))
    values = {"a": 0.7, "b": 0.2, "c": 0.4, "x": 0.9}
    assert outcome(again, values) == outcome(node, values) != "none"
    assert all(write(again) == write(node) for write in WRITERS)
