"""The Legendre transform against the inversion of p(v) with many digits, which knows no formula."""

from __future__ import annotations

import random
from collections.abc import Mapping
from typing import Any

import pytest
from hypothesis import Phase, given, settings
from hypothesis import strategies as st

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.trees import to_tree
from rigidcli.language.evaluation import real
from rigidcli.language.parser import read
from rigidcli.language.tree import Node
from rigidcli.mechanics.legendre import canonical_momenta, legendre_transform
from rigidcli.mechanics.velocity_inversion import Branch
from tests.trees import CONTEXT, expression, value, written

few = settings(max_examples=25, deadline=None, phases=[Phase.explicit, Phase.reuse, Phase.generate])


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


FORMS = {
    "relativistic": (["x"], "-m*c^2*sqrt(1 - (xdot/c)^2) - k*x^2/2"),
    "relativistic with a field": (
        ["x", "y"],
        "-m*c^2*sqrt(1 - (xdot^2 + ydot^2)/c^2) + m*(x*ydot - y*xdot) - k*x*y",
    ),
    "relativistic, written otherwise": (["x"], "-m*c*sqrt(c^2 - xdot^2)"),
    "exponential": (["x"], "m*exp(c*xdot + x) - k*x"),
    "hyperbolic cosine": (["x"], "m*cosh(k*xdot) - x^4"),
    "logarithm": (["x"], "m*log(c*xdot + x^2) - x"),
    "fourth power": (["x"], "m*xdot^4/4 - k*x^2"),
    "sixth power with a linear term": (["x"], "m*xdot^6/6 + x*xdot - k*x^2"),
    "root of a velocity": (["x"], "-m*xdot^(1/2) + x*xdot"),
    "two kinds at once": (["x", "y"], "m*exp(xdot) + k*ydot^2/2 - x*y"),
    "masses of both signs": (["x", "y"], "m*xdot*ydot + k*ydot^2 - x*y"),
    "no mass by itself": (["x", "y"], "m*xdot*ydot + x*ydot - x*y"),
    "time": (["x"], "exp(c*t)*(m*xdot^2/2 - k*x^2/2)"),
}


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("name", FORMS)
def test_closed_inverses(name: str, sign: int) -> None:
    coordinates, lagrangian = FORMS[name]
    (branch,) = transformed(lagrangian, coordinates)
    chance = random.Random(7)
    one_sided = name in ("logarithm", "root of a velocity")
    for _ in range(4):
        point = {symbol: chance.uniform(0.4, 1.2) for symbol in (*coordinates, "m", "k", "t")}
        point |= {"c": 2.0 + chance.random()}
        way = 1 if one_sided else sign
        point |= {f"{q}dot": way * chance.uniform(0.1, 0.9) for q in coordinates}
        judge(lagrangian, coordinates, branch, point)


@pytest.mark.parametrize(
    ("lagrangian", "count", "velocities"),
    [
        ("m*xdot^3/3 - x", 2, [0.7, -0.7]),
        ("m*sinh(xdot) - x", 2, [0.7, -0.7]),
        ("m/xdot - x", 2, [0.7, -0.7]),
        ("m*xdot^5 + x*xdot", 2, [0.7, -0.7]),
        ("xdot^3/3 + x*xdot^2/2 - x", 2, [-3.0, -0.9, 0.2, 2.0]),
        ("xdot*log(xdot) - k*x", 1, [0.4, 3.0]),
        ("log(cosh(m*xdot))", 1, [-0.4, 1.2]),
        ("xdot*atan(xdot) - log(1 + xdot^2)/2", 1, [-3.0, 0.4]),
        ("xdot*asinh(xdot) - sqrt(1 + xdot^2) + x*xdot", 1, [-3.0, 0.4]),
        ("tanh(xdot)", 2, [-1.2, 0.4]),
        ("xdot^2/(m + xdot)", 2, [-1.4, -5.0, 0.4]),
        ("log((1 - xdot^2)^2)", 2, [-3.0, -0.4, 0.4, 5.0]),
    ],
)
def test_every_velocity_is_on_one_branch(lagrangian: str, count: int, velocities: list[float]) -> None:
    found = transformed(lagrangian, ["x"])
    assert len(found) == count
    for velocity in velocities:
        point = {"x": 0.5, "m": 1.3, "k": 1.1, "xdot": velocity}
        here = {**point, "p_x": real(to_tree(derivative(expression(lagrangian), "xdot")), point)}
        inside = [b for b in found if all(real(to_tree(e), here) > 0 for e in b.conditions)]
        (right,) = (b for b in inside if real(to_tree(b.velocities[0]), here) == pytest.approx(velocity))
        judge(lagrangian, ["x"], right, point)


@pytest.mark.parametrize(
    "lagrangian",
    ["xdot^6 + xdot^2 - x", "xdot^4/4 + xdot^2/2", "exp(xdot) + xdot^2", "exp(xdot^2) - x", "xdot*exp(xdot)"],
)
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


@pytest.mark.parametrize("size", [5, 20])
def test_masses_in_a_row(size: int) -> None:
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
        coupled(5),
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
    ("lagrangian", "coordinates", "hamiltonian"),
    [
        ("m*xdot^2/2 - k*x^2/2", ["x"], "p_x**2/(2*m) + k*x**2/2"),
        ("m*l^2*thetadot^2/2 + m*g*l*cos(theta)", ["theta"], "p_theta**2/(2*m*l**2) - m*g*l*cos(theta)"),
        ("m*(rdot^2 + r^2*phidot^2)/2 + k/r", ["r", "phi"], "p_phi**2/(2*m*r**2) + p_r**2/(2*m) - k/r"),
        ("m*(xdot^2 + ydot^2)/2 - m*g*y", ["x", "y"], "(p_x**2 + p_y**2)/(2*m) + m*g*y"),
        ("xdot^2/2 - (x^2 - 1)^2/4", ["x"], "p_x**2/2 + (x**2 - 1)**2/4"),
    ],
)
def test_it_reads_as_a_physicist_writes_it(lagrangian: str, coordinates: list[str], hamiltonian: str) -> None:
    (branch,) = transformed(lagrangian, coordinates)
    assert written(branch.hamiltonian) == hamiltonian


def test_the_momenta_and_the_mass_matrix() -> None:
    found = canonical_momenta(expression("m*(rdot^2 + r^2*phidot^2)/2 + B*r*phidot"), ["rdot", "phidot"])
    assert [written(p) for p in found.definitions] == ["m*rdot", "r*(m*r*phidot + B)"]
    assert [[written(e) for e in row] for row in found.mass_matrix] == [["m", "0"], ["0", "m*r**2"]]
