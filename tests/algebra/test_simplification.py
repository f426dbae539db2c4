"""Shorter forms keep their values; what vanishes is told from what does not."""

from __future__ import annotations

import time
from collections.abc import Callable

import pytest
from hypothesis import HealthCheck, given, settings

from rigidcli.algebra.expressions import Expr, with_squares
from rigidcli.algebra.simplification import over_shared_sums, tidy
from rigidcli.algebra.substitution import from_tree
from rigidcli.algebra.values import is_zero
from rigidcli.errors import ExpressionError
from rigidcli.language.tree import Node
from tests.algebra.test_expressions import FORMS, kept
from tests.trees import TREES, expression, written

thorough = settings(max_examples=100, suppress_health_check=[HealthCheck.filter_too_much])


@pytest.mark.parametrize("change", [tidy, over_shared_sums, with_squares])
@thorough
@given(node=TREES)
def test_a_shorter_form_keeps_the_value(node: Node, change: Callable[[Expr], Expr]) -> None:
    kept(node, change)


@thorough
@given(TREES)
def test_a_tidy_form_is_not_longer(node: Node) -> None:
    try:
        e = from_tree(node)
    except ExpressionError:
        return
    assert len(written(tidy(e))) <= len(written(e))


def tidied(source: str) -> str:
    return written(tidy(expression(source)))


@pytest.mark.parametrize(("source", "short"), FORMS["short"])
def test_short_forms(source: str, short: str) -> None:
    assert tidied(source) == short


def test_a_double_pendulum_becomes_that_of_the_textbook() -> None:
    """From the velocities of its bobs; L. D. Landau, E. M. Lifshitz, Mechanics, 3rd edition, section 5."""
    velocities = {
        "v1": "((l1*th1dot*cos(th1))**2 + (l1*th1dot*sin(th1))**2)",
        "v2": "((l1*th1dot*cos(th1) + l2*th2dot*cos(th2))**2 + (l1*th1dot*sin(th1) + l2*th2dot*sin(th2))**2)",
    }
    lagrangian = f"m1*{velocities['v1']}/2 + m2*{velocities['v2']}/2"
    assert tidied(lagrangian) == (
        "(m1 + m2)*l1**2*th1dot**2/2 + m2*l2**2*th2dot**2/2 + m2*l1*l2*th1dot*th2dot*cos(th1 - th2)"
    )


@pytest.mark.parametrize(
    "source",
    [
        "((a+b)**50)**50",
        "*".join(f"(x{i}+1)" for i in range(1500)),
        "(sin(x)+cos(x))**60",
        "+".join(f"sin(x)**{i}*cos(x)**{100 - i}" for i in range(100)),
        "+".join(f"1/(x{i}+y{i})" for i in range(60)),
        "+".join(f"sin((a+x{i})**12)" for i in range(200)),
        "+".join(f"sin(x{i})*cos(x{i + 1})" for i in range(200)),
        "cos(" + "+".join(f"x{i}" for i in range(300)) + ")",
        "1/(1+" * 90 + "x" + ")" * 90,
        "sin(" * 90 + "x+y" + ")" * 90,
    ],
)
def test_the_work_is_bounded(source: str) -> None:
    e = expression(source)
    start = time.process_time()
    tidy(e)
    is_zero(e)
    assert time.process_time() - start < 4.0


@pytest.mark.parametrize(
    ("source", "short"),
    [
        (
            "a**2/((x + y)*(u + v)) + b**2/((x + y)*(u + v)) + c**2/((x + y)*(r + s)) + d/(r + s)",
            "d/(r + s) + (c**2/(r + s) + (a**2 + b**2)/(u + v))/(x + y)",
        ),
        ("a*x/(a + b)**2 + b*x/(a + b)**2 + x/(a + b) + y/(a + b)", "(2*x + y)/(a + b)"),
    ],
)
def test_terms_over_the_same_sum_come_over_one_fraction_bar(source: str, short: str) -> None:
    assert written(over_shared_sums(expression(source))) == short
