"""Poisson brackets against their laws."""

from __future__ import annotations

from rigidcli.algebra.values import is_zero
from rigidcli.mechanics.phase_space import Phase, bracket
from tests.trees import expression

SPACE = Phase(("x", "y", "z"), ("p_x", "p_y", "p_z"))
L = ("y*p_z - z*p_y", "z*p_x - x*p_z", "x*p_y - y*p_x")


def test_angular_momentum_is_an_algebra() -> None:
    first, second, third = map(expression, L)
    assert is_zero(bracket(first, second, SPACE) - third)
    assert is_zero(bracket(second, third, SPACE) - first)
    size = first**2 + second**2 + third**2
    assert is_zero(bracket(size, first, SPACE))


def test_the_bracket_is_odd_and_obeys_jacobi() -> None:
    f, g, h = (expression(words) for words in ("x^2*p_y", "sin(x*p_z) + y", "p_x^2/r + z"))
    assert is_zero(bracket(f, g, SPACE) + bracket(g, f, SPACE))
    cyclic = [(f, g, h), (g, h, f), (h, f, g)]
    assert is_zero(sum((bracket(a, bracket(b, c, SPACE), SPACE) for a, b, c in cyclic), expression("0")))
