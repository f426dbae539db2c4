"""Equations of motion, brackets, canonical changes and energies against their laws."""

from __future__ import annotations

import pytest

from rigidcli.algebra.expressions import ONE
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.values import is_zero
from rigidcli.mechanics import canonical
from rigidcli.mechanics import hamilton_equations as energies
from rigidcli.mechanics.canonical import Branch, inverse
from rigidcli.mechanics.hamilton_equations import Phase, bracket, linear
from tests.trees import expression, written

ONE_FREEDOM = Phase(("x",), ("p_x",))
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


def test_linear_equations() -> None:
    found = linear([expression("a*x + b*p_x + c"), expression("-x")], ONE_FREEDOM.names)
    assert found is not None
    matrix, offset = found
    assert [[written(e) for e in row] for row in matrix] == [["a", "b"], ["-1", "0"]]
    assert [written(e) for e in offset] == ["c", "0"]
    assert linear([expression("x^2"), expression("x")], ONE_FREEDOM.names) is None
    assert linear([expression("sin(x)"), expression("x")], ONE_FREEDOM.names) is None


@pytest.mark.parametrize(
    ("values", "wrong"),
    [
        ({"x": "sqrt(2*P)*sin(Q)", "p_x": "sqrt(2*P)*cos(Q)"}, []),
        ({"x": "Q", "p_x": "P + Q^3"}, []),
        ({"x": "2*Q", "p_x": "P"}, [("x", "p_x")]),
        ({"x": "P", "p_x": "Q"}, [("x", "p_x")]),
    ],
)
def test_canonical_changes(values: dict[str, str], wrong: list[tuple[str, str]]) -> None:
    given = {name: expression(words) for name, words in values.items()}
    found = canonical.brackets(given, ONE_FREEDOM, Phase(("Q",), ("P",)))
    assert list(canonical.wrong_brackets(found, ONE_FREEDOM)) == wrong


def test_a_rotation_of_the_plane_is_canonical_and_inverted() -> None:
    old, new = Phase(("x", "y"), ("p_x", "p_y")), Phase(("X", "Y"), ("PX", "PY"))
    values = {
        name: expression(f"cos(a)*{first} {sign} sin(a)*{second}")
        for name, first, sign, second in (
            ("X", "x", "+", "y"),
            ("Y", "y", "-", "x"),
            ("PX", "p_x", "+", "p_y"),
            ("PY", "p_y", "-", "p_x"),
        )
    }
    assert list(canonical.wrong_brackets(canonical.brackets(values, new, old), new)) == []
    back = inverse(values, new, old, Branch({}))
    assert back is not None
    assert is_zero(back["x"] - expression("cos(a)*X - sin(a)*Y"))
    assert canonical.expected("X", "PX", new) == ONE


def test_the_kinetic_energy_of_particles() -> None:
    length, theta = expression("l"), expression("theta")
    particle = energies.Particle(
        expression("m"), (expression("l*sin(theta)"), expression("-l*cos(theta)")), None, None
    )
    assert written(energies.kinetic([particle], {"theta": "thetadot"})) == "m*l**2*thetadot**2/2"
    turning = energies.Particle(None, (), expression("I"), theta / length)
    assert written(energies.kinetic([turning], {"theta": "thetadot"})) == "I*thetadot**2/(2*l**2)"


def test_what_natural_coordinates_do_not_have() -> None:
    assert energies.unnatural(expression("m*xdot^2/2"), ["xdot"]) is None
    wrong = energies.unnatural(expression("m*(xdot^2 + x^2*w^2)/2"), ["xdot"])
    assert wrong is not None
    assert written(tidy(wrong)) == "m*w**2*x**2/2"
    wrong = energies.unnatural(expression("m*exp(t)*xdot^2/2"), ["xdot"])
    assert wrong is not None
