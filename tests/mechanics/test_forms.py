"""H without poles that the system does not have, and no longer than people write it."""

from __future__ import annotations

import json
import random
import re
from pathlib import Path
from typing import Any

import pytest
import yaml

import rigidcli
from rigidcli.language.expression import parse, real
from rigidcli.language.parser import read
from rigidcli.report import Report
from tests.conftest import Program
from tests.tables import rows_of

LONGEST = 1.3
"""The length of an H without blanks, in units of that of the shortest one by hand."""


def hamilton(
    coordinates: str, kind: str, text: str, forces: dict[str, str] | None = None, **more: Any
) -> Report:
    """What the program derives where no parameter has a value."""
    names = coordinates.split()
    own = {"t", *names, *(f"{q}dot" for q in names), *(f"p_{q}" for q in names)}
    letters = {name for written in (text, *(forces or {}).values()) for name in parse(written).names} - own
    document = {
        "system": {"coordinates": names, kind: text, "forces": forces or {}},
        "parameters": dict.fromkeys(sorted(letters)),
    }
    return rigidcli.hamilton(rigidcli.loads(json.dumps(document | more)))


SYSTEMS = yaml.safe_load(Path(__file__).with_name("shortest.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", SYSTEMS)
def test_it_is_the_shortest_function_and_has_no_further_poles(name: str) -> None:
    coordinates, lagrangian, expected, pole = SYSTEMS[name].values()
    points: list[dict[str, float]] = [{}, {}, pole]
    found = hamilton(coordinates, "lagrangian", lagrangian)
    ours = str(found["hamiltonian"])
    assert len("".join(ours.split())) <= LONGEST * len("".join(expected.split())), ours
    chance = random.Random(name)
    names = sorted(parse(ours).names | parse(expected).names)
    for fixed in points:
        point = {symbol: chance.uniform(0.5, 1.5) for symbol in names} | fixed
        assert real(read(ours)[0], point) == pytest.approx(real(read(expected)[0], point), rel=1e-10)
    assert found["verified"] < 1e-9


def test_forces_on_a_fast_charge_have_one_root() -> None:
    found = hamilton("x y", "lagrangian", "-m*c**2*sqrt(1 - (xdot**2 + ydot**2)/c**2) + q*B*x*ydot - q*E*x")
    assert all(str(e).count("sqrt") == 1 and len(str(e)) < 90 for e in found["accelerations"].values())
    assert all(str(e).count("3/2") == 1 for e in found["lagrange_equations"].values())


def test_an_orbit_begins_at_a_horizon() -> None:
    found = rigidcli.hamilton(
        rigidcli.loads(
            "system: {coordinates: [v, r], lagrangian: (-(1 - 2/r)*vdot**2 + 2*vdot*rdot)/2}\n"
            "orbit: {initial: {v: 0, r: 2, p_v: -1, p_r: 0.5}, duration: 0.5, samples: 3}\n"
        )
    )
    # H = p_v p_r + (1 - 2/r) p_r^2/2 = -1/2 is conserved, and r' = p_v + (1 - 2/r) p_r begins at -1.
    assert found["orbit"]["H"] == pytest.approx([-0.5] * 3, rel=1e-11)
    assert found["orbit"]["q"]["r"][1] < 2


def test_an_h_comes_back_as_it_is_typed() -> None:
    typed = "((p_x - B*q*y/2)**2 + (p_y + B*q*x/2)**2)/(2*m)"
    assert str(hamilton("x y", "hamiltonian", typed)["hamiltonian"]) == typed


def test_two_modes_with_symbols_are_stable() -> None:
    cart = (
        "(M + m)*xdot**2/2 + m*l*xdot*thetadot*cos(theta) + m*l**2*thetadot**2/2 + m*g*l*cos(theta)"
        " - k*x**2/2"
    )
    found = hamilton("x theta", "lagrangian", cart, equilibrium={"x": 0, "theta": 0})
    middle = "M*g + m*g + k*l"
    for mode, sign in zip(found["modes"], "-+", strict=True):
        assert mode["stable"] is True
        assert str(mode["rate"]) == f"sqrt(({middle} {sign} sqrt(({middle})**2 - 4*M*g*k*l))/(2*M*l))"
        point = {"M": 0.7, "m": 1.3, "l": 0.6, "g": 9.7, "k": 2.1}
        square = mode["rate"].evaluate(**point) ** 2
        x, theta = (e.evaluate(**point) if e.names else float(e) for e in mode["vector"])
        assert (2.1 - 2.0 * square) * x == pytest.approx(square * 1.3 * 0.6 * theta, rel=1e-12)


def test_a_change_that_is_canonical_for_some_parameters(program: Program) -> None:
    document = (
        "parameters: {al: null, be: null}\n"
        "system: {coordinates: [q], hamiltonian: p_q**2/2 + q**2/2}\n"
        "transform: {new_variables: [Q, P], new: {Q: q**al*cos(be*p_q), P: q**al*sin(be*p_q)}}\n"
    )
    assert "only if al be q^(2 al - 1) = 1" in program("hamilton", "-", stdin=document).out


WRITTEN = yaml.safe_load(Path(__file__).with_name("written.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", WRITTEN)
def test_it_is_written_as_in_a_book(name: str) -> None:
    case = dict(WRITTEN[name])
    expected, coordinates = case.pop("expected"), case.pop("coordinates")
    equilibrium = {key: case.pop(key) for key in ("equilibrium",) if key in case}
    (kind, text), *more = case.items()
    found = hamilton(coordinates, kind, text, **equilibrium, **dict(more))
    for path, written in expected.items():
        value: Any = found
        for part in path.split("."):
            value = value[int(part) if part.isdigit() else part]
        assert str(value) == written, path


HANGING = rows_of(__file__, "hanging")


@pytest.mark.parametrize("name", HANGING)
def test_particles_have_the_form_of_their_velocities(name: str) -> None:
    coordinates, particles, book = HANGING[name]
    names = coordinates.split()
    found = rigidcli.hamilton(
        {
            "system": {
                "coordinates": names,
                "particles": [{"mass": mass, "position": position} for mass, position in particles],
            },
            "parameters": dict.fromkeys({"M", "m", "h"} & parse(book).names),
        }
    )
    ours, chance = str(found["hamiltonian"]), random.Random(name)
    for _ in range(5):
        point = {symbol: chance.uniform(0.5, 1.5) for symbol in sorted(parse(book).names)}
        assert real(read(ours)[0], point) == pytest.approx(real(read(book)[0], point), rel=1e-12)
    assert len("".join(ours.split())) <= LONGEST * len("".join(book.split())), ours


@pytest.mark.parametrize(
    ("typed", "written"),
    [
        ("((p_y + x*p_z/2)**2 + p_x**2 + p_z**2)/(2*m)", "(p_x**2 + (p_y + x*p_z/2)**2 + p_z**2)/(2*m)"),
        ("(p_x - 3*p_y)**2/(9*m)", "(p_x - 3*p_y)**2/(9*m)"),
    ],
)
def test_the_momentum_without_a_factor_stands_by_itself_in_a_square(typed: str, written: str) -> None:
    found = hamilton("x y z", "hamiltonian", typed)["hamiltonian"]
    assert str(found) == written


@pytest.mark.parametrize(
    "typed",
    rows_of(__file__, "squares of sums stand in the order in which they are typed"),
)
def test_squares_of_sums_stand_in_the_order_in_which_they_are_typed(typed: str) -> None:
    text = f"m*(rdot**2 + xdot**2 + x1dot**2 + x2dot**2)/2 - {typed}"
    found = hamilton("r x x1 x2", "lagrangian", text)["hamiltonian"]
    assert typed in str(found)
    (square,) = {part for part in ("(r - R)", "(x2 - x1 - b)", "(r + R)", "(x2 - x1)") if part in typed}
    other = hamilton("r x x1 x2", "lagrangian", text.replace(square, f"((-1)*{square})"))["hamiltonian"]
    assert found == other
    again = hamilton("r x x1 x2", "hamiltonian", str(found))["hamiltonian"]
    assert again == found
    assert str(again) == str(found)


def test_the_order_of_a_square_is_that_of_the_document_in_every_format(program: Program) -> None:
    document = """\
system: {coordinates: [r], kinetic: m*rdot**2/2, potential: k*(r - R)**2/2}
parameters: {m: null, k: null, R: null}
"""
    assert "k (r - R)^2/2" in program("hamilton", "-", stdin=document).out
    assert r"k \left(r - R\right)^{2}" in program("hamilton", "-f", "latex", "-", stdin=document).out
    page = program("hamilton", "-f", "html", "--steps", "-", stdin=document).out
    text = re.sub("<.*?>", "", page)
    assert "(r\N{MINUS SIGN}R)2" in text
    assert "(R\N{MINUS SIGN}r)2" not in text
    turned = program("hamilton", "-", stdin=document.replace("(r - R)", "(-R + r)")).out
    assert "k (r - R)^2/2" in turned  # shorter than what is typed, and from the coordinate
