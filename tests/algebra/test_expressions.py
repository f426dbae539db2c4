"""The algebra of exact expressions against values with 50 digits, and against what people write."""

from __future__ import annotations

import contextlib
import os
import subprocess
import sys
import time
import timeit
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path

import pytest
import sympy
import yaml
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

import rigidcli
from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expansion import coefficients, expand
from rigidcli.algebra.expressions import PI, Expr, number, symbol
from rigidcli.algebra.functions import apply
from rigidcli.algebra.substitution import from_tree, substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError
from rigidcli.language.parser import read
from rigidcli.language.text import text
from rigidcli.language.tree import Name, Node, Product, Sum, rebuilt
from tests.trees import CONTEXT, POINTS, TREES, NoValueError, value, written
from tests.trees import expression as expr

a, b, c, m, x, y = map(symbol, "abcmxy")
FORMS = yaml.safe_load(Path(__file__).with_name("forms.yaml").read_text(encoding="utf-8"))

thorough = settings(max_examples=100, suppress_health_check=[HealthCheck.filter_too_much])


def _require_bound(error: ExpressionError) -> None:
    """Where there is a value, nothing is refused but what is too large."""
    assert "too large" in error.message or "bits" in error.message


def kept(node: Node, change: Callable[[Expr], Expr]) -> None:
    """The changed expression has the value of the tree wherever this has one."""
    known = []
    for point in POINTS:
        try:
            known.append((point, value(node, point)))
        except NoValueError:
            continue
    assume(known)
    try:
        changed = to_tree(change(from_tree(node)))
    except ExpressionError as error:
        _require_bound(error)
        return
    for point, truth in known:
        try:
            found = value(changed, point, edge=1e-200)
        except NoValueError:
            pytest.fail(f"{text(node)} became {text(changed)}, which has no value at {point}")
        assert abs(found - truth) <= 1e-25 * (1 + abs(truth)), f"{text(node)} became {text(changed)}"


@thorough
@given(TREES)
def test_a_tree_keeps_its_value(node: Node) -> None:
    kept(node, lambda e: e)


@thorough
@given(TREES)
def test_multiplying_out_keeps_the_value(node: Node) -> None:
    kept(node, expand)


@thorough
@given(TREES)
def test_an_expression_becomes_itself_again(node: Node) -> None:
    try:
        e = from_tree(node)
        again = from_tree(to_tree(e))
    except ExpressionError:
        return
    assert again == e
    assert hash(again) == hash(e)
    assert again.key == e.key


@thorough
@given(TREES, TREES)
def test_substitution_keeps_the_value(node: Node, inner: Node) -> None:
    def replaced(tree: Node) -> Node:
        return _with_name(tree, "x", inner)

    try:
        put = from_tree(inner)
    except ExpressionError:
        return
    try:
        e = from_tree(node)
    except ExpressionError:
        return
    kept(replaced(node), lambda _: substitute(e, {"x": put}))


def _with_name(node: Node, name: str, inner: Node) -> Node:
    """The tree with another one in the place of a name."""
    return inner if node == Name(name) else rebuilt(node, lambda part: _with_name(part, name, inner))


@thorough
@given(TREES)
def test_a_derivative_is_the_limit_of_differences(node: Node) -> None:
    points = []
    for point in POINTS:
        # Where there is a value on both sides and the function is smooth, differences tell the truth.
        with contextlib.suppress(NoValueError, ZeroDivisionError):
            steps = [
                value(node, {**point, "x": CONTEXT.mpf(point["x"].numerator) / point["x"].denominator + h})
                for h in map(CONTEXT.mpf, ("-2e-10", "-1e-10", "1e-10", "2e-10"))
            ]
            slope = (8 * (steps[2] - steps[1]) - steps[3] + steps[0]) / CONTEXT.mpf("12e-10")
            coarse = (steps[3] - steps[0]) / CONTEXT.mpf("4e-10")
            if abs(coarse - slope) <= 1e-9 * (1 + abs(slope)):
                points.append((point, slope))
    assume(points)
    try:
        slope_tree = to_tree(derivative(from_tree(node), "x"))
    except ExpressionError as error:
        _require_bound(error)
        return
    for point, slope in points:
        try:
            found = value(slope_tree, point)
        except NoValueError:
            continue  # a derivative may need more than its function, as that of abs(x)*x does at 0
        assert abs(found - slope) <= 1e-12 * (1 + abs(slope)), f"{text(node)}' is not {text(slope_tree)}"


@pytest.mark.parametrize(("first", "second"), FORMS["same"])
def test_these_are_one_expression(first: str, second: str) -> None:
    assert expr(first) == expr(second)
    assert hash(expr(first)) == hash(expr(second))


@pytest.mark.parametrize(("first", "second"), FORMS["different"])
def test_what_is_wrong_for_negative_values_is_not_done(first: str, second: str) -> None:
    assert expr(first) != expr(second)


@given(st.permutations(["a*x**2", "-b*y", "sin(x)*a", "3", "(x - y)**2*a", "pi*x"]))
def test_the_order_of_terms_and_factors_does_not_matter(parts: list[str]) -> None:
    trees = tuple(read(part)[0] for part in parts)
    forwards = tuple(read(part)[0] for part in sorted(parts))
    for operation in (Sum, Product):
        assert from_tree(operation(trees)) == from_tree(operation(forwards))
        assert written(from_tree(operation(trees))) == written(from_tree(operation(forwards)))


@pytest.mark.parametrize(("source", "shown"), FORMS["written"])
def test_trees_read_as_people_write(source: str, shown: str) -> None:
    assert written(expr(source)) == shown


@pytest.mark.parametrize(
    ("source", "message"),
    [
        *FORMS["refused"],
        ("sqrt(" + "9" * 300 + ")", "a number under a root has more than 512 bits"),
    ],
)
def test_what_has_no_value_is_refused(source: str, message: str | None) -> None:
    with pytest.raises(ExpressionError) as caught:
        expr(source)
    assert message is None or caught.value.message == message


HOSTILE = [
    "((a+b)**50)**50",
    "(a+b+c+x)**900",
    "(a+b)**1000000000",
    "*".join(f"(x{i}+1)" for i in range(1500)),
    "*".join(["(sin(x)+cos(y)+exp(a))"] * 40),
    "(1+sqrt(2)+sqrt(3)+sqrt(5)+sqrt(7)+sqrt(11)+x)**60",
    "((((((a+b)*c+x)*a+b)*c+x)*a+b)*c+x)**30",
]


@pytest.mark.parametrize("source", HOSTILE)
@pytest.mark.parametrize("change", [expand, lambda e: coefficients(e, ["x", "a", "x7"])])
def test_what_would_take_for_ever_is_refused_soon(source: str, change: Callable[[Expr], object]) -> None:
    start = time.process_time()
    with contextlib.suppress(ExpressionError):
        change(expr(source))
    assert time.process_time() - start < 2.0


@pytest.mark.parametrize(
    "source",
    [
        "sin(" * 90 + "x" + ")" * 90,
        "sqrt(1+" * 90 + "x" + ")" * 90,
        "1/(1+" * 90 + "x" + ")" * 90,
        "(1+" * 90 + "x" + ")**2" * 90,
        "x**" * 40 + "x",
    ],
)
def test_the_deepest_texts_are_worked_on(source: str) -> None:
    e = expr(source)
    for result in (derivative(e, "x"), substitute(e, {"x": a}), from_tree(to_tree(e))):
        assert not result.is_zero


def test_multiplying_out() -> None:
    assert expand(expr("(x + y)*(x - y)")) == expr("x**2 - y**2")
    assert expand(expr("sin((x + y)*a)")) == expr("sin(a*x + a*y)")
    assert expand(expr("a/((x + y)*b + b*x)**2")) == expr("a/(2*b*x + b*y)**2")
    assert expand(expr("(1 + sqrt(2))**2")) == expr("3 + 2*sqrt(2)")
    assert expand(expr("(a*(x + y)**2 + b)*(x + y)**0.5")) == expr(
        "a*x**2*sqrt(x+y) + 2*a*x*y*sqrt(x+y) + a*y**2*sqrt(x+y) + b*sqrt(x+y)"
    )


def test_coefficients_of_a_polynomial() -> None:
    e = expr("m*(x - y)**2/2 + sin(a)*x + b*c")
    assert coefficients(e, ["x", "y"]) == {
        (2, 0): m / 2,
        (1, 1): -m,
        (0, 2): m / 2,
        (1, 0): apply("sin", a),
        (0, 0): b * c,
    }
    assert coefficients(expr("x*(x + 1) - x**2 - x"), ["x"]) == {}
    for source in ("1/x", "sqrt(x)", "sin(x)", "(x + y)**0.5", "a**x", "x*abs(x)"):
        assert coefficients(expr(source), ["x"]) is None


def test_substitution_is_done_all_at_once() -> None:
    assert substitute(expr("x - 2*y"), {"x": y, "y": x}) == expr("y - 2*x")
    with pytest.raises(ExpressionError, match="division by zero"):
        substitute(expr("1/(x - y)"), {"x": y})


def test_texts_do_not_depend_on_hashes() -> None:
    program = (
        "from rigidcli.language.parser import read\n"
        "from rigidcli.algebra.substitution import from_tree\n"
        "from rigidcli.algebra.trees import to_tree\n"
        "from rigidcli.algebra.calculus import derivative\n"
        "from rigidcli.algebra.expansion import expand\n"
        "from rigidcli.algebra.simplification import tidy\n"
        "from rigidcli.language.text import text\n"
        "e = from_tree(read('(a*sin(x) + b*cos(y - x))**3*(x + y)/(a + b*x) + sqrt(6*x)*pi/log(a + x)')[0])\n"
        "for f in (e, expand(e), derivative(e, 'x'), tidy(e)): print(text(to_tree(f)))\n"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            check=True,
            timeout=60,
        ).stdout
        for seed in ("0", "1")
    }
    assert len(outputs) == 1


def test_a_chain_of_masses_is_quick() -> None:
    kinetic = "+".join(f"m{i}*x{i}dot**2/2" for i in range(20))
    springs = "+".join(f"k*(x{i} - x{i + 1})**2/2" for i in range(19))
    node = read(f"{kinetic} - ({springs})")[0]

    def derive() -> None:
        lagrangian = from_tree(node)
        for i in range(20):
            assert coefficients(derivative(lagrangian, f"x{i}dot"), [f"x{i}dot"]) == {(1,): symbol(f"m{i}")}
            to_tree(derivative(lagrangian, f"x{i}"))

    assert min(timeit.repeat(derive, "", time.process_time, 5, 1)) < 0.1


# --- results in Python


def test_results_of_all_studies_are_of_one_class() -> None:
    spring = (
        "{system: {coordinates: [x], lagrangian: m*xdot**2/2 - k*x**2/2}, parameters: {m: null, k: null}}"
    )
    rod = "{body: {shape: rod, length: a, mass: m}, parameters: {a: null, m: null}}"
    hamiltonian = rigidcli.hamilton(rigidcli.loads(spring))["hamiltonian"]
    moment = rigidcli.axes(rigidcli.loads(rod))["moments"][2]
    assert type(hamiltonian) is type(moment) is Expr
    assert (str(hamiltonian), str(moment)) == ("p_x**2/(2*m) + k*x**2/2", "m*a**2/12")
    assert moment._repr_latex_() == r"$\frac{m a^{2}}{12}$"


def test_expressions_are_evaluated_on_numbers_and_arrays() -> None:
    e = symbol("a", True) ** 2 * symbol("x") / 3
    assert e.evaluate(a=3, x=2) == 6.0
    assert e.evaluate(a=3, x=[1.0, 2.0]).tolist() == [3.0, 6.0]
    with pytest.raises(ExpressionError, match="no value for `a`"):
        e.evaluate(x=1)
    assert float(number(Fraction(1, 4))) == 0.25


def test_expressions_become_those_of_sympy() -> None:
    a, x = sympy.Symbol("a", positive=True), sympy.Symbol("x", real=True)
    e = (symbol("a", True) ** 3 * (symbol("x") + 1)) ** Fraction(1, 2) / 3 + apply("cos", symbol("x")) * PI
    assert sympy.simplify(e.to_sympy() - (sympy.sqrt(a**3 * (x + 1)) / 3 + sympy.pi * sympy.cos(x))) == 0
    assert sympy.expand(symbol("a", True) * (a + x)) == a**2 + a * x
