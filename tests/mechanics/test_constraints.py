"""The rank of mass matrices, and the primary constraints of degenerate Lagrangians."""

from __future__ import annotations

import pytest

from rigidcli.algebra.expressions import Expr
from rigidcli.mechanics import lagrange_equations as constraints
from tests.trees import matrix, written


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


def test_primary_constraints() -> None:
    # L = (xdot + a ydot)^2 m/2 + q xdot: p_x = m (xdot + a ydot) + q, p_y = a m (xdot + a ydot).
    entries = matrix("m,m*a", "m*a,m*a^2")
    definitions = matrix("m*(xdot + a*ydot) + q,a*m*(xdot + a*ydot)")[0]
    (found,) = constraints.primary_constraints(entries, definitions, ["xdot", "ydot"], ["p_x", "p_y"])
    assert written(found) in ("p_y - a*p_x + a*q", "p_y - a*(p_x - q)", "a*q + p_y - a*p_x")
