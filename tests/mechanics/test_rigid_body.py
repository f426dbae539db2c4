"""The equations of motion as trees against the same laws in arrays of numbers."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from fractions import Fraction

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rigidcli.core import rotation
from rigidcli.language import code, tree
from rigidcli.language.expression import real
from rigidcli.mechanics import rigid_body

Floats = NDArray[np.float64]

few = settings(max_examples=50)

NUMBERS = st.floats(-5, 5)
THREE = st.tuples(NUMBERS, NUMBERS, NUMBERS)
FOUR = st.tuples(NUMBERS, NUMBERS, NUMBERS, NUMBERS)

X, Y, Z = tree.Name("x"), tree.Name("y"), tree.Name("z")


def names(letter: str, count: int) -> NDArray[np.object_]:
    return np.array([tree.Name(f"{letter}{k}") for k in range(count)])


def values(**vectors: Sequence[float]) -> dict[str, float]:
    return {f"{letter}{k}": float(x) for letter, vector in vectors.items() for k, x in enumerate(vector)}


def evaluated(trees: Iterable[tree.Node], known: Mapping[str, float]) -> Floats:
    return np.array([real(node, known) for node in trees])


# --- vectors and quaternions


@few
@given(FOUR, FOUR)
def test_quaternion_products(p: Sequence[float], q: Sequence[float]) -> None:
    # Hamilton's product by matrices of complex numbers: i, j, k are -i times Pauli's.
    def matrix(quaternion: Sequence[float]) -> NDArray[np.complex128]:
        a, b, c, d = quaternion
        return np.array([[a - 1j * d, -c - 1j * b], [c - 1j * b, a + 1j * d]])

    found = evaluated(rotation.compose(names("p", 4), names("q", 4)), values(p=p, q=q))
    assert np.abs(matrix(found.tolist()) - matrix(p) @ matrix(q)).max() < 1e-13


@few
@given(FOUR.filter(lambda q: math.hypot(*q) > 0.1), THREE)
def test_turns(q: Sequence[float], v: Sequence[float]) -> None:
    unit = np.array(q) / math.hypot(*q)
    turn = Rotation.from_quat(np.roll(unit, -1))
    known = values(q=unit.tolist(), v=v)
    there, back = (rotation.turned(names("q", 4) * [1, *3 * [sign]], names("v", 3)) for sign in (1, -1))
    assert evaluated(there, known) == pytest.approx(turn.apply(v), abs=1e-13)
    assert evaluated(back, known) == pytest.approx(turn.inv().apply(v), abs=1e-13)


@few
@given(st.tuples(*[st.one_of(NUMBERS, st.sampled_from([0.0, 1.0, -1.0]))] * 2))
def test_operators(pair: tuple[float, float]) -> None:
    a, b = pair
    left, right = tree.number(a), tree.number(b)
    for one, other in ((left, right), (left, b)):
        assert real(one + other, {}) == a + b
        assert real(one - other, {}) == a - b
        assert real(one * other, {}) == a * b
        assert b == 0 or real(one / other, {}) == pytest.approx(a / b)
    assert real(-left, {}) == -a
    assert a * right == right * left
    assert a + right in (right + left, left + right)


# --- the equations


@few
@given(st.tuples(*[st.floats(0.1, 10)] * 3), FOUR, THREE, THREE)
def test_the_laws_of_motion(
    moments: Sequence[float], q: Sequence[float], L: Sequence[float], torque: Sequence[float]
) -> None:
    trees = rigid_body.equations(np.array(moments), [tree.number(part) for part in torque])
    flow = code.function(trees, rigid_body.STATE, {})
    found = np.array(flow(math)(0.0, *q, *L))
    omega = np.array(L) / moments
    # The derivative of R(q) r by q' is R (omega x r): here as the product of q and (0, omega)/2 by its parts.
    vector, half = np.array(q[1:]), omega / 2
    assert found[0] == pytest.approx(-vector @ half, abs=1e-12)
    assert found[1:4] == pytest.approx(q[0] * half + np.cross(vector, half), abs=1e-12)
    assert found[4:] == pytest.approx(np.cross(L, omega) + torque, abs=1e-11)


@pytest.mark.parametrize("ulps", [1, 3, 1000])
def test_moments_that_are_almost_equal_keep_their_difference(ulps: int) -> None:
    near = 0.3 + ulps * math.ulp(0.3)
    trees = rigid_body.equations(np.array([0.3, near, 0.7]), [tree.ZERO] * 3)
    found = code.function(trees, rigid_body.STATE, {})(math)(0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0)
    exact = 1 / Fraction(near) - 1 / Fraction(0.3)
    assert found[6] == pytest.approx(float(exact), rel=1e-15, abs=0)


# --- names


def test_names_are_bound_everywhere() -> None:
    root = tree.Sum(
        (
            tree.Negative(X),
            tree.Product((Y, tree.Reciprocal(X))),
            tree.Power(X, Y),
            tree.Call("atan2", (Y, X)),
            tree.Constant("pi"),
            tree.number(2.0),
            Z,
        )
    )
    found = tree.bound(root, {"x": tree.Sum((Z, tree.ONE)), "y": tree.number(3.0)})
    assert real(found, {"z": 0.5}) == pytest.approx(
        -1.5 + 3 / 1.5 + 1.5**3 + math.atan2(3, 1.5) + math.pi + 2 + 0.5, rel=1e-15
    )
    assert tree.bound(root, {}) == root
    # Not again in what takes their place: x and y change places.
    assert tree.bound(tree.Sum((X, Y)), {"x": Y, "y": X}) == tree.Sum((Y, X))
