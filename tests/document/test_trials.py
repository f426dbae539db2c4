"""Documents with symbols: what no values, or not all, make a body."""

from __future__ import annotations

import pytest

import rigidcli
from rigidcli.errors import DocumentError

A = "parameters: {a: null}\nbody: "
CUBE = "{shape: cube, side: a, density: 1}"

REFUSED = [
    (f"{A}{{parts: [{CUBE}, {{shape: sphere, radius: a/2, density: 1, position: [5*a, 0, 0], hole: true}}]}}",
     "body.parts.1", "the hole reaches outside the body"),
    (f"{A}{{parts: [{CUBE}, {{shape: cube, side: a/2, density: 1, position: [a/2, 0, 0], hole: true}}]}}",
     "body.parts.1", "the hole reaches outside the body"),
    (f"{A}{{parts: [{CUBE}, {{shape: cube, side: a/2, density: 2, hole: true}}]}}",
     "body.parts.1", "more is taken away than is there"),
    ("parameters: {rho: null, R: null}\nbody: {shape: sphere, radius: R, density: rho*(1 - 2*r/R)}",
     "body.density", "the density is negative"),
    (f"{A}{{moments: [a, a, 3*a]}}", "body", "no body has this inertia tensor"),
    (f"{A}{{inertia: [[a, 5*a, 0], [5*a, a, 0], [0, 0, a]]}}", "body", "no body has this inertia tensor"),
    (f"{A}{{shape: sphere, radius: -a, mass: 1}}", "body.radius", "expected a positive length"),
    (f"{A}{{shape: sphere, radius: 1, mass: -2*a}}", "body.mass", "expected a positive mass"),
]  # fmt: skip


@pytest.mark.parametrize(("text", "key", "check"), REFUSED)
def test_what_no_positive_values_make_a_body_is_refused(text: str, key: str, check: str) -> None:
    with pytest.raises(DocumentError) as refusal:
        rigidcli.loads(text)
    message = str(refusal.value)
    assert message.startswith(f"<text>:2: {key}: for all positive values of ")
    assert check in message


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
        "{shape: sphere, radius: a, density: abs(x)/a}",
        "{moments: [a, a, 2*a]}",
    ],
)
def test_a_body_for_all_values_is_not_noted(body: str) -> None:
    assert rigidcli.loads(f"{A}{body}").notes == ()


def test_symbols_of_a_system_alone_are_not_tried() -> None:
    text = "parameters: {m: null}\nsystem: {coordinates: [x], lagrangian: m*xdot**2/2 - 1/(x - m)}"
    assert rigidcli.loads(text).notes == ()
