"""Exact principal moments and axes against mpmath's eigenvalues, and in the body's own axes."""

from __future__ import annotations

import random
from fractions import Fraction
from pathlib import Path
from typing import Any

import mpmath
import numpy as np
import pytest
import sympy
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st

import rigidcli
from rigidcli.algebra.atoms import Symbol
from rigidcli.algebra.expressions import Expr, expr, symbol
from rigidcli.core.principal import PrincipalFrame
from rigidcli.errors import ComputationError
from rigidcli.mechanics.principal_axes import principal_frame


def tensor(rows: Any) -> Any:
    return np.array([[expr(entry) for entry in row] for row in rows], dtype=object)


def numbers(array: Any, values: dict[str, Fraction] | None = None) -> Any:
    """Exact numbers with 40 digits."""

    def one(e: Expr) -> Any:
        chosen = {s: sympy.Rational((values or {})[s.name]) for s in e.to_sympy().free_symbols}
        return mpmath.mpf(sympy.N(e.to_sympy().subs(chosen), 40))

    with mpmath.workdps(40):
        return np.array([one(e) for e in array.flat], dtype=object).reshape(array.shape)


def require_frame(frame: PrincipalFrame, of: Any, values: dict[str, Fraction] | None = None) -> None:
    """The moments are the eigenvalues, ascending, and the axes a right-handed frame of eigenvectors."""
    with mpmath.workdps(40):
        given, moments, axes = (numbers(array, values) for array in (of, frame.moments, frame.axes))
        size = max(1e-30, *map(abs, given.flat))
        expected = sorted(mpmath.eigsy(mpmath.matrix(given.tolist()), eigvals_only=True))
        assert max(abs(a - b) for a, b in zip(sorted(moments), expected, strict=True)) < 1e-30 * size
        assert not frame.ordered or list(moments) == sorted(moments)
        assert np.abs(given @ axes.T - axes.T * moments).max() < 1e-30 * size
        assert np.abs(axes @ axes.T - np.eye(3, dtype=int)).max() < 1e-30
        assert axes[2] @ np.cross(axes[0], axes[1]) > 0


ENTRIES = st.integers(-9, 9)


@settings(max_examples=3)
@given(st.lists(ENTRIES, min_size=6, max_size=6))
def test_any_rational_tensor(entries: list[int]) -> None:
    a, b, c, d, e, f = entries
    of = tensor([[a, d, e], [d, b, f], [e, f, c]])
    require_frame(principal_frame(of), of)


@pytest.mark.parametrize(
    ("rows", "groups"),
    [
        ([[2, 0, 0], [0, 2, 0], [0, 0, 2]], ((0, 1, 2),)),
        ([[8, -3, -3], [-3, 8, -3], [-3, -3, 8]], ((0,), (1, 2))),
        ([[2, -1, 0], [-1, 2, 0], [0, 0, 4]], ((0,), (1,), (2,))),
        ([[5, 1, 1], [1, 5, 1], [1, 1, 5]], ((0, 1), (2,))),
        ([[1, 2, 3], [2, -1, 0], [3, 0, 4]], ((0,), (1,), (2,))),
    ],
)
def test_equal_moments_are_one_group(rows: Any, groups: tuple[tuple[int, ...], ...]) -> None:
    of = tensor(rows)
    frame = principal_frame(of)
    assert frame.groups == groups
    require_frame(frame, of)


def test_symbols_in_a_plane() -> None:
    a, b, x = symbol("a", True), symbol("b", True), symbol("x")
    of = tensor([[a, x, 0], [x, b, 0], [0, 0, a + b]])
    require_frame(principal_frame(of), of, {"a": Fraction(2), "b": Fraction(5, 3), "x": Fraction(-3, 4)})


def test_a_cubic_with_symbols_is_too_long() -> None:
    a = symbol("a", True)
    with pytest.raises(ComputationError, match="too long to print"):
        principal_frame(tensor([[a, 1, 2], [1, 0, a], [2, a, 3]]))


DOCUMENTS = {
    "a box under Euler angles": "{shape: box, size: [1, 2, 3], mass: 1, "
    "rotation: {euler: [pi/5, pi/8, pi/12]}}",
    "parts turned alike": "{parts: [{shape: box, size: [1, 2, 3], mass: 1, axis: [1, 2, 3]}, "
    "{shape: cylinder, radius: 1, height: 2, mass: 3, axis: [1, 2, 3], position: [1, 2, 3]}]}",
}


@pytest.mark.parametrize("body", DOCUMENTS.values(), ids=DOCUMENTS.keys())
def test_what_is_turned_as_a_whole_keeps_its_moments(body: str) -> None:
    document = rigidcli.loads(f"{{body: {body}, about: com}}", exact=True)
    found = rigidcli.axes(document)
    assert all(len(str(moment)) < 10 for moment in found["moments"])
    floating = rigidcli.axes(rigidcli.loads(f"{{body: {body}, about: com}}"))
    assert np.array(found["moments"], dtype=float) == pytest.approx(floating["moments"], rel=1e-13)
    assert np.abs(np.array(found["axes"], dtype=float) - floating["axes"]).max() < 1e-12


SYMBOLIC = yaml.safe_load(Path(__file__).with_name("axes.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("case", SYMBOLIC.values(), ids=SYMBOLIC.keys())
def test_axes_turn_the_tensor_into_its_moments_at_values_of_both_signs(case: dict[str, Any]) -> None:
    letters = case["letters"].split()
    document = {"parameters": dict.fromkeys(letters), "about": case["about"], "body": case["body"]}
    found = rigidcli.axes(rigidcli.loads(yaml.safe_dump(document)))
    tensor, axes, moments = (np.atleast_2d(found[key]) for key in ("tensor", "axes", "moments"))
    atoms = [atom for e in (*tensor.flat, *axes.flat) for atom in e.everywhere()]
    positive = {atom.name for atom in atoms if isinstance(atom, Symbol) and atom.positive}
    chance = random.Random(6)
    for _ in range(20):
        point = {name: chance.uniform(0.2, 2.5) for name in letters}
        point = {name: x if name in positive else x * chance.choice((1, -1)) for name, x in point.items()}
        I, A, (diagonal,) = (  # noqa: E741 - as in textbooks
            np.array([[e.evaluate(**{n: point[n] for n in e.names}) for e in row] for row in array])
            for array in (tensor, axes, moments)
        )
        assert pytest.approx(np.eye(3), abs=1e-9) == A @ A.T
        assert pytest.approx(np.diag(diagonal), abs=1e-8 * np.abs(I).max()) == A @ I @ A.T


DUMBBELL = "{points: [[m, a*sin(u), 0, a*cos(u)], [m, -a*sin(u), 0, -a*cos(u)]]}"


def test_a_skew_dumbbell_has_its_axis_along_itself() -> None:
    found = rigidcli.axes(
        rigidcli.loads(f"{{parameters: {{m: null, a: null, u: null}}, body: {DUMBBELL}, about: com}}")
    )
    assert [str(e) for e in found["axes"][0]] == ["sin(u)", "0", "cos(u)"]


def test_moments_have_one_order_where_masses_are_multiples_of_a_letter() -> None:
    points = [["2*m", "b", 0, 0], ["3*m", 0, "-2*b", 0], ["3*m", "-b", 0, 0]]
    document = {"parameters": {"m": None, "b": None}, "body": {"points": points}, "about": "origin"}
    found = rigidcli.axes(document)
    assert [str(e) for e in found["moments"]] == ["5*m*b**2", "12*m*b**2", "17*m*b**2"]
    assert found.notes == ()
