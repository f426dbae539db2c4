"""Matrices of expressions against numpy's numbers at random values of their symbols."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.core.arithmetic import Floats
from rigidcli.symbolic.algebra.expressions import ONE, ZERO, Expr
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language import code
from rigidcli.symbolic.language.elimination import solved
from rigidcli.symbolic.language.evaluation import real
from rigidcli.symbolic.language.tree import Name, number
from rigidcli.symbolic.mechanics import constraints, mass_matrix
from tests.symbolic.trees import expression, written

few = settings(max_examples=30, deadline=None)
POINT = {"a": 0.7, "b": 1.3, "m": 2.1, "q": 0.4}


def matrix(*rows: str) -> list[list[Expr]]:
    return [[expression(entry) for entry in row.split(",")] for row in rows]


def numbers(entries: mass_matrix.Matrix) -> Floats:
    return np.array([[real(to_tree(entry), POINT) for entry in row] for row in entries])


@pytest.mark.parametrize(
    "rows",
    [
        ["m"],
        ["m,0", "0,a"],
        ["m,a*cos(q)", "a*cos(q),b"],
        ["2,1,0", "1,2,1", "0,1,2"],
        ["m,a,0", "a,b,q", "0,q,3"],
        ["3,a,q,0", "a,4,0,b", "q,0,5,1", "0,b,1,6"],
        ["2*m,m,0,0,m", "m,3*m,m,0,0", "0,m,4*m,0,0", "0,0,0,m,0", "m,0,0,0,5*m"],
    ],
)
def test_inverses(rows: list[str]) -> None:
    entries = matrix(*rows)
    found = mass_matrix.inverse(entries)
    assert found is not None
    assert numbers(found) == pytest.approx(np.linalg.inv(numbers(entries)), rel=1e-13, abs=1e-13)


def test_blocks_are_what_entries_connect() -> None:
    entries = matrix("1,0,a,0", "0,1,0,0", "a,0,1,b", "0,0,b,1")
    assert mass_matrix.blocks(entries) == [[0, 2, 3], [1]]


def test_a_large_full_block_is_not_inverted() -> None:
    entries = [[expression(f"a^{i + j} + {9 if i == j else 0}") for j in range(5)] for i in range(5)]
    assert mass_matrix.inverse(entries) is None


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


@pytest.mark.parametrize(
    ("rows", "expected"),
    [
        (["m"], 1),
        (["0"], 0),
        (["m,m", "m,m"], 1),
        (["m*cos(q)^2,m*sin(q)*cos(q)", "m*sin(q)*cos(q),m*sin(q)^2"], 1),
        (["sin(q)^2+cos(q)^2-1,0", "0,m"], 1),
        (["1e-9*m,0", "0,1e9"], 2),
        (["1,1", "1,1+1e-9"], 2),
        (["1,1", "1,1+1e-15"], 2),
        (["m,a,0", "a,a^2/m,0", "0,0,b"], 2),
        (["1,a,b", "a,a^2,a*b", "b,a*b,b^2"], 1),
    ],
)
def test_ranks(rows: list[str], expected: int) -> None:
    assert constraints.rank(matrix(*rows), {}) == expected


def test_the_rank_at_given_values() -> None:
    def at(**values: str) -> dict[str, Expr]:
        return {name: matrix(value)[0][0] for name, value in values.items()}

    assert constraints.rank(matrix("m,a", "a,b"), at(m="1", a="2", b="4")) == 1
    assert constraints.rank(matrix("m"), at(m="0")) == 0
    assert constraints.rank(matrix("m*q^2"), at(m="1e-30")) == 1
    assert constraints.rank(matrix("3*m - b"), at(m="0.1", b="0.3")) == 0


def test_null_vectors_are_taken_to_zero() -> None:
    entries = matrix("m,m*a,0", "m*a,m*a^2,0", "0,0,b")
    (vector,) = mass_matrix.null_vectors(entries)
    columns = np.array([real(to_tree(e), POINT) for e in vector])
    assert numbers(entries) @ columns == pytest.approx(np.zeros(3), abs=1e-14)
    assert mass_matrix.null_vectors([[ONE, ZERO], [ZERO, ONE]]) == []


def test_primary_constraints() -> None:
    # L = (xdot + a ydot)^2 m/2 + q xdot: p_x = m (xdot + a ydot) + q, p_y = a m (xdot + a ydot).
    entries = matrix("m,m*a", "m*a,m*a^2")
    definitions = matrix("m*(xdot + a*ydot) + q,a*m*(xdot + a*ydot)")[0]
    (found,) = constraints.primary_constraints(entries, definitions, ["xdot", "ydot"], ["p_x", "p_y"])
    assert written(found) in ("p_y - a*p_x + a*q", "p_y - a*(p_x - q)", "a*q + p_y - a*p_x")
