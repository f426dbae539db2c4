"""Common subexpressions: values stay the same, and nothing is written twice."""

from __future__ import annotations

import math
from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import ExpressionError
from rigidcli.language import code
from rigidcli.language.expression import parse
from rigidcli.language.sharing import shared, solved
from rigidcli.language.tree import Call, Name, Node, Power, Product, Sum, nodes, number

TEXTS = [
    "a*sin(x - y)^2 + b/(1 + cos(x - y)) - (x - y)^(2/3)",
    "sin(x - y)^2/(1 + cos(x - y))",
    "-(x - y)",
    "2/3 + x",
]

VALUES = {"a": 1.5, "b": -0.7, "x": 2.0, "y": 0.3}


def _roots() -> list[Node]:
    return [parse(text).root for text in TEXTS]


def test_the_values_stay_the_same() -> None:
    found = shared([], _roots())
    values = code.function(found.values, list(VALUES), {}, found.steps)(math)(*VALUES.values())
    assert list(values) == [parse(text).evaluate(VALUES) for text in TEXTS]


def test_nothing_with_a_name_in_it_stands_twice() -> None:
    found = shared([], _roots())
    uses = Counter(
        node
        for node in nodes(found.trees)
        if isinstance(node, Sum | Product | Power | Call)
        and any(isinstance(part, Name) for part in nodes([node]))
    )
    assert set(uses.values()) == {1}
    assert len(found.steps) == 3  # x - y, sin(x - y)^2, and 1 + cos(x - y)


def test_steps_without_use_are_left_out() -> None:
    steps = [("_p", parse("x + y").root), ("_q", parse("_p^2").root), ("_r", parse("sin(_p)").root)]
    found = shared(steps, [parse("_q + 1").root])
    assert [name for name, _ in found.steps] == ["_p", "_q"]


def test_a_number_beyond_floats_is_refused() -> None:
    with pytest.raises(ExpressionError, match="too large"):
        shared([], [parse("x*1e999").root])


few = settings(max_examples=30, deadline=None)


@few
@given(st.integers(1, 8), st.integers(0, 2**31), st.floats(0, 1))
def test_elimination_solves(size: int, seed: int, sparsity: float) -> None:
    chance = np.random.default_rng(seed)
    root = chance.normal(size=(size, size)) * (chance.random((size, size)) > sparsity)
    entries, right = root @ root.T + np.eye(size), chance.normal(size=size)
    steps, answers = solved(
        [[number(entry) for entry in row] for row in entries], [Name(f"b{i}") for i in range(size)]
    )
    f = code.function(answers, [f"b{i}" for i in range(size)], {}, steps)
    assert f(math)(*right) == pytest.approx(np.linalg.solve(entries, right), rel=1e-9, abs=1e-9)
