"""The Legendre transform against the inversion of p(v) with many digits, which knows no formula."""

from __future__ import annotations

import random
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.trees import to_tree
from rigidcli.language.expression import real
from rigidcli.language.parser import read
from rigidcli.language.tree import Node
from rigidcli.mechanics.inversion import Branch
from rigidcli.mechanics.legendre import canonical_momenta, legendre_transform
from tests.trees import CONTEXT, expression, value, written

few = settings(max_examples=8, phases=[Phase.explicit, Phase.reuse, Phase.generate])


def slope(node: Node, point: Mapping[str, Any], name: str) -> Any:
    """The derivative of a tree by a name, numerically with many digits."""
    return CONTEXT.diff(lambda x: value(node, {**point, name: x}), point[name])


def judge(lagrangian: str, coordinates: list[str], branch: Branch, point: Mapping[str, float]) -> None:
    """At a point (q, v): p = dL/dv, and there H = p v - L, dH/dp = v, dH/dq = -dL/dq to 1e-12."""
    root = read(lagrangian)[0]
    many = {name: CONTEXT.mpf(number) for name, number in point.items()}
    p = {f"p_{q}": slope(root, many, f"{q}dot") for q in coordinates}
    energy = CONTEXT.fsum(p[f"p_{q}"] * many[f"{q}dot"] for q in coordinates) - value(root, many)
    forces = {q: slope(root, many, q) for q in coordinates}
    here = {**point, **{name: float(number) for name, number in p.items()}}
    scale = max(1.0, *(abs(float(p[f"p_{q}"]) * point[f"{q}dot"]) for q in coordinates), abs(float(energy)))
    assert real(to_tree(branch.hamiltonian), here) == pytest.approx(float(energy), abs=1e-12 * scale)
    for place, q in enumerate(coordinates):
        velocity, force = point[f"{q}dot"], float(forces[q])
        for e in (branch.velocities[place], derivative(branch.hamiltonian, f"p_{q}")):
            assert real(to_tree(e), here) == pytest.approx(velocity, rel=1e-11, abs=1e-12)
        back = real(to_tree(derivative(branch.hamiltonian, q)), here)
        assert back == pytest.approx(-force, abs=1e-11 * max(scale, abs(force)))


def transformed(lagrangian: str, coordinates: list[str]) -> list[Branch]:
    velocities, names = [f"{q}dot" for q in coordinates], [f"p_{q}" for q in coordinates]
    return legendre_transform(expression(lagrangian), velocities, names)


LAGRANGIANS = yaml.safe_load(Path(__file__).with_name("lagrangians.yaml").read_text(encoding="utf-8"))


@pytest.mark.parametrize("name", LAGRANGIANS["closed"])
def test_closed_inverses(name: str) -> None:
    coordinates, lagrangian = LAGRANGIANS["closed"][name]
    (branch,) = transformed(lagrangian, coordinates)
    chance = random.Random(7)
    one_sided = name in ("logarithm", "root of a velocity")
    for sign in (1, -1):
        point = {symbol: chance.uniform(0.4, 1.2) for symbol in (*coordinates, "m", "k", "t")}
        point |= {"c": 2.0 + chance.random()}
        way = 1 if one_sided else sign
        point |= {f"{q}dot": way * chance.uniform(0.1, 0.9) for q in coordinates}
        judge(lagrangian, coordinates, branch, point)


@pytest.mark.parametrize(("lagrangian", "count", "velocities"), LAGRANGIANS["branches"])
def test_every_velocity_is_on_one_branch(lagrangian: str, count: int, velocities: list[float]) -> None:
    found = transformed(lagrangian, ["x"])
    assert len(found) == count
    for velocity in velocities:
        point = {"x": 0.5, "m": 1.3, "k": 1.1, "xdot": velocity}
        here = {**point, "p_x": real(to_tree(derivative(expression(lagrangian), "xdot")), point)}
        inside = [b for b in found if all(real(to_tree(e), here) > 0 for e in b.conditions)]
        (right,) = (b for b in inside if real(to_tree(b.velocities[0]), here) == pytest.approx(velocity))
        judge(lagrangian, ["x"], right, point)


@pytest.mark.parametrize("lagrangian", LAGRANGIANS["without a closed inverse"])
def test_what_has_no_closed_inverse_has_no_branch(lagrangian: str) -> None:
    assert transformed(lagrangian, ["x"]) == []


@st.composite
def mechanisms(draw: st.DrawFn) -> tuple[list[str], str, dict[str, float]]:
    """T = v.M(q).v/2 + b(q).v - V(q) with a positive definite M = J^T J + 1, in up to three coordinates."""
    size = draw(st.integers(1, 3))
    coordinates = [f"q{i}" for i in range(1, size + 1)]
    terms = [f"{q}dot^2/2" for q in coordinates]
    for _ in range(draw(st.integers(1, 2))):
        factors = [
            draw(st.sampled_from(["0", "1", "a", f"sin({q})", f"cos({q})", f"a*{q}"])) for q in coordinates
        ]
        path = " + ".join(f"{f}*{q}dot" for f, q in zip(factors, coordinates, strict=True))
        terms.append(f"m*({path})^2/2")
    terms.append(f"a*{coordinates[-1]}*{coordinates[0]}dot")
    terms.append(f"- m*cos({coordinates[0]}) + a*{coordinates[-1]}^2")
    values = {name: draw(st.floats(0.2, 2)) for name in (*coordinates, "m", "a")}
    values |= {f"{q}dot": draw(st.floats(-2, 2)) for q in coordinates}
    return coordinates, " + ".join(terms), values


@few
@given(mechanisms())
def test_any_mechanism(mechanism: tuple[list[str], str, dict[str, float]]) -> None:
    coordinates, lagrangian, point = mechanism
    (branch,) = transformed(lagrangian, coordinates)
    judge(lagrangian, coordinates, branch, point)


def test_masses_in_a_row() -> None:
    size = 8
    # Coordinates relative to the mass before: the mass matrix is full, but one of numbers.
    coordinates = [f"s{i}" for i in range(1, size + 1)]
    places = [" + ".join(f"{q}dot" for q in coordinates[: i + 1]) for i in range(size)]
    lagrangian = " + ".join(f"m*({place})^2/2" for place in places) + "".join(
        f" - k*{q}^2/2" for q in coordinates
    )
    (branch,) = transformed(lagrangian, coordinates)
    chance = random.Random(5)
    point = {"m": 1.5, "k": 0.7} | {q: chance.uniform(-1, 1) for q in coordinates}
    judge(lagrangian, coordinates, branch, point | {f"{q}dot": chance.uniform(-1, 1) for q in coordinates})


FREE_PAIR = (
    "m*(xdot^2 + ydot^2 + zdot^2)/2 + k*((xdot + adot*cos(a)*cos(b) - bdot*sin(a)*sin(b))^2"
    " + (ydot + adot*cos(a)*sin(b) + bdot*sin(a)*cos(b))^2 + (zdot - adot*sin(a))^2)/2"
)
"""Two masses at the ends of a rod: the place of one, and the angles of the rod."""


def coupled(size: int) -> tuple[list[str], str]:
    """A Lagrangian whose mass matrix is full, and has a cosine of each coordinate."""
    coordinates = [f"a{i}" for i in range(1, size + 1)]
    path = " + ".join(f"cos({q})*{q}dot" for q in coordinates)
    return coordinates, f"({path})^2/2 + " + " + ".join(f"{q}dot^2/2" for q in coordinates)


@pytest.mark.parametrize(
    ("coordinates", "lagrangian"),
    [
        coupled(3),
        (["x", "y", "z", "a", "b"], FREE_PAIR),
        (["x", "y", "z"], "m*xdot*ydot + k*ydot*zdot + xdot*zdot"),
    ],
)
def test_full_blocks_are_written_as_squares(coordinates: list[str], lagrangian: str) -> None:
    (branch,) = transformed(lagrangian, coordinates)
    chance = random.Random(9)
    point = {name: chance.uniform(0.4, 1.2) for name in ("m", "k", *coordinates)}
    judge(lagrangian, coordinates, branch, point | {f"{q}dot": chance.uniform(-1, 1) for q in coordinates})


def test_what_would_fill_pages_is_left_implicit() -> None:
    coordinates, lagrangian = coupled(20)
    assert transformed(lagrangian, coordinates) == []


@pytest.mark.parametrize(
    ("lagrangian", "coordinates", "hamiltonian"), LAGRANGIANS["as a physicist writes it"]
)
def test_it_reads_as_a_physicist_writes_it(lagrangian: str, coordinates: list[str], hamiltonian: str) -> None:
    (branch,) = transformed(lagrangian, coordinates)
    assert written(branch.hamiltonian) == hamiltonian


def test_the_momenta_and_the_mass_matrix() -> None:
    found = canonical_momenta(expression("m*(rdot^2 + r^2*phidot^2)/2 + B*r*phidot"), ["rdot", "phidot"])
    assert [written(p) for p in found.definitions] == ["m*rdot", "r*(m*r*phidot + B)"]
    assert [[written(e) for e in row] for row in found.mass_matrix] == [["m", "0"], ["0", "m*r**2"]]


READS_OTHERWISE = {"exponential"}
"""Where a factor exp(x) stays where it was typed."""


@pytest.mark.parametrize("name", LAGRANGIANS["forms"])
def test_every_form_has_the_same_hamiltonian(name: str) -> None:
    """However a Lagrangian is typed: multiplied out, factored, constants moved."""
    coordinates, forms = LAGRANGIANS["forms"][name].values()
    (first,) = transformed(forms[0], coordinates)
    chance = random.Random(name)
    for form in forms:
        (branch,) = transformed(form, coordinates)
        point = {symbol: chance.uniform(0.3, 0.7) for symbol in (*coordinates, "m", "k")} | {"c": 2.0}
        moving = point | {f"{q}dot": chance.uniform(0.1, 0.6) for q in coordinates}
        judge(form, coordinates, branch, moving)
        momenta = {f"p_{q}": derivative(expression(forms[0]), f"{q}dot") for q in coordinates}
        here = point | {name: real(to_tree(p), moving) for name, p in momenta.items()}
        known = real(to_tree(first.hamiltonian), here)
        assert real(to_tree(branch.hamiltonian), here) == pytest.approx(known, rel=1e-12)
        if name not in READS_OTHERWISE:
            assert str(branch.hamiltonian) == str(first.hamiltonian)
