"""Documents with symbols: what no values, or not all, make a body."""

from __future__ import annotations

import pytest

import rigidcli
from rigidcli.errors import DocumentError

A = "parameters: {a: null}\nbody: "
CUBE = "{shape: cube, side: a, density: 1}"


def test_what_no_positive_values_make_a_body_is_refused() -> None:
    with pytest.raises(DocumentError, match=r"<text>:2: body\.radius: read `-a`, expected a positive"):
        rigidcli.loads(f"{A}{{shape: sphere, radius: -a, mass: 1}}")
    with pytest.raises(
        DocumentError, match=r"<text>:2: body\.radius: for all positive values of .* positive"
    ):
        rigidcli.loads("parameters: {a: null, b: null}\nbody: {shape: sphere, radius: -(a - b)**2, mass: 1}")


def test_a_message_on_letters_has_no_number_for_them() -> None:
    with pytest.raises(DocumentError, match=r"inner_radius: read `2\*a`, expected less than outer_radius"):
        rigidcli.loads(f"{A}{{shape: annulus, outer_radius: a, inner_radius: 2*a, mass: 1}}")


def test_what_some_values_forbid_is_noted_with_the_check() -> None:
    hole = "{shape: cube, side: b, density: 1, position: [d, 0, 0], hole: true}"
    text = f"parameters: {{a: null, b: null, d: null}}\nbody: {{parts: [{CUBE}, {hole}]}}"
    notes = rigidcli.loads(text).notes
    assert any("for some positive values" in note and "outside the body" in note for note in notes)


@pytest.mark.parametrize(
    "body",
    [
        "{shape: cube, side: a, mass: 2, anchor: corner}",
        "{shape: rod, length: a, density: 3*(1 + z/a)}",
        "{shape: sphere, radius: a, density: x**2/a}",
        "{moments: [a, a, 2*a]}",
    ],
)
def test_a_body_for_all_values_is_not_noted(body: str) -> None:
    assert rigidcli.loads(f"{A}{body}").notes == ()


def test_the_range_of_an_angle_is_not_noted_of_a_letter() -> None:
    top = "top: {spin: 10, tilt: a, mass: 1, distance: 0.1, lambda1: 0.02, lambda3: 0.01}"
    assert rigidcli.loads(f"parameters: {{a: null}}\n{top}").notes == ()
    with pytest.raises(DocumentError, match=r"top\.tilt.*expected an angle from 0 to 180 deg"):
        rigidcli.loads(f"parameters: {{a: null}}\n{top.replace('tilt: a', 'tilt: 1000 + a')}")


def test_symbols_of_a_system_alone_are_not_tried() -> None:
    text = "parameters: {m: null}\nsystem: {coordinates: [x], lagrangian: m*xdot**2/2 - 1/(x - m)}"
    assert rigidcli.loads(text).notes == ()
