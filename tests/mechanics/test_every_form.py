"""One Lagrangian has one Hamiltonian, however it is typed: multiplied out, factored, constants moved."""

from __future__ import annotations

import random

import pytest

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.trees import to_tree
from rigidcli.language.evaluation import real
from tests.mechanics.test_legendre import judge, transformed
from tests.trees import expression

PAIR = ["x", "y"]

SYSTEMS: dict[str, tuple[list[str], list[str]]] = {
    "relativistic": (
        ["x"],
        [
            "-m*c^2*sqrt(1 - xdot^2/c^2) - k*x^2/2",
            "-m*c*sqrt(c^2 - xdot^2) - k*x^2/2",
            "-sqrt(m^2*c^4 - m^2*c^2*xdot^2) - k*x^2/2",
            "-m*c*sqrt((c - xdot)*(c + xdot)) - k*x^2/2",
            "-m*c*sqrt(c - xdot)*sqrt(c + xdot) - k*x^2/2",
            "-(2*m*c^2*sqrt(1 - (xdot/c)^2) + k*x^2)/2",
            "m*(xdot^2 - c^2)/sqrt(1 - xdot^2/c^2) - k*x^2/2",
            "-m*c^2/sqrt(1 - xdot^2/c^2) + m*xdot^2/sqrt(1 - xdot^2/c^2) - k*x^2/2",
            "-m*c^2*(sqrt(1 - xdot^2/c^2) + k*x^2/(2*m*c^2))",
        ],
    ),
    "relativistic kinetic energy": (
        ["x"],
        [
            "m*c^2*(1 - sqrt(1 - xdot^2/c^2))",
            "m*c^2 - m*c^2*sqrt(1 - xdot^2/c^2)",
            "m*c*(c - sqrt(c^2 - xdot^2))",
            "-m*c^2*(sqrt((c^2 - xdot^2)/c^2) - 1)",
        ],
    ),
    "relativistic in a magnetic field": (
        ["x", "y", "z"],
        [
            "-m*c^2*sqrt(1 - (xdot^2 + ydot^2 + zdot^2)/c^2) - k*(y - (x*xdot + y*zdot)/c)",
            "-m*c^2*sqrt(1 - xdot^2/c^2 - ydot^2/c^2 - zdot^2/c^2) - k*y + k*x*xdot/c + k*y*zdot/c",
            "-(m*c^3*sqrt(1 - (xdot^2 + ydot^2 + zdot^2)/c^2) + k*(c*y - x*xdot - y*zdot))/c",
            "-m*c*sqrt(c^2 - xdot^2 - (ydot^2 + zdot^2)) + k*x*xdot/c - k*(c*y - y*zdot)/c",
        ],
    ),
    "rotating frame under the root": (
        PAIR,
        [
            "-m*c*sqrt(c^2 - (xdot - k*y)^2 - (ydot + k*x)^2)",
            "-m*c*sqrt(c^2 - xdot^2 - ydot^2 - 2*k*(x*ydot - y*xdot) - k^2*(x^2 + y^2))",
            "-m*c^2*sqrt(1 - xdot^2/c^2 + 2*k*y*xdot/c^2 - (ydot + k*x)^2/c^2 - k^2*y^2/c^2)",
        ],
    ),
    "moving frame under the root": (
        ["x"],
        [
            "-m*c*sqrt(c^2 - (xdot + k)^2)",
            "-m*c*sqrt(c^2 - xdot^2 - 2*k*xdot - k^2)",
            "-m*c*sqrt((c - k - xdot)*(c + k + xdot))",
        ],
    ),
    "curved space and time": (
        ["r", "a"],
        [
            "-m*sqrt((1 + k/r)*c^2 - rdot^2/(1 + k/r) - r^2*adot^2)",
            "-m*sqrt(c^2 + k*c^2/r - r*rdot^2/(r + k) - r^2*adot^2)",
            "-m*sqrt(((r + k)^2*c^2 - r^2*rdot^2 - r^3*(r + k)*adot^2)/(r*(r + k)))",
        ],
    ),
    "surface of revolution": (
        ["y"],
        ["y*sqrt(1 + ydot^2)", "sqrt(y^2 + y^2*ydot^2)", "(y + y*ydot^2)/sqrt(1 + ydot^2)"],
    ),
    "exponential": (
        ["x"],
        ["m*exp(k*xdot + x) + x*xdot", "m*exp(k*xdot)*exp(x) + x*xdot", "m*(exp(k*xdot + x) + x*xdot/m)"],
    ),
    "hyperbolic cosine beside an oscillator": (
        PAIR,
        [
            "m*(cosh(k*xdot) + ydot^2/2 - y^2/2)",
            "m*cosh(k*xdot) + m*(ydot + y)*(ydot - y)/2",
        ],
    ),
    "two coupled angles": (
        ["a", "b"],
        [
            "m*adot^2 + m*bdot^2/2 + m*adot*bdot*cos(a - b) + k*cos(a)",
            "m*((adot*cos(a) + bdot*cos(b))^2 + (adot*sin(a) + bdot*sin(b))^2 + adot^2)/2 + k*cos(a)",
        ],
    ),
    "particle in a magnetic field": (
        PAIR,
        [
            "m*(xdot^2 + ydot^2)/2 + k*(x*ydot - y*xdot)/2",
            "(m*xdot*xdot + m*ydot^2 + k*x*ydot - k*y*xdot)/2",
            "m*(xdot - k*y/(2*m))^2/2 + m*(ydot + k*x/(2*m))^2/2 - k^2*(x^2 + y^2)/(8*m)",
        ],
    ),
    "rotating frame": (
        PAIR,
        [
            "m*((xdot - k*y)^2 + (ydot + k*x)^2)/2",
            "m*(xdot^2 + ydot^2)/2 + m*k*(x*ydot - y*xdot) + m*k^2*(x^2 + y^2)/2",
        ],
    ),
}

READS_OTHERWISE = {"exponential"}
"""Where a factor exp(x) stays where it was typed."""


@pytest.mark.parametrize(
    ("name", "place"), [(name, place) for name, (_, forms) in SYSTEMS.items() for place in range(len(forms))]
)
def test_every_form_has_the_same_hamiltonian(name: str, place: int) -> None:
    coordinates, forms = SYSTEMS[name]
    (first,), (branch,) = (transformed(forms[k], coordinates) for k in (0, place))
    chance = random.Random(name)
    for _ in range(2):
        point = {symbol: chance.uniform(0.3, 0.7) for symbol in (*coordinates, "m", "k")} | {"c": 2.0}
        moving = point | {f"{q}dot": chance.uniform(0.1, 0.6) for q in coordinates}
        judge(forms[place], coordinates, branch, moving)
        momenta = {f"p_{q}": derivative(expression(forms[0]), f"{q}dot") for q in coordinates}
        here = point | {name: real(to_tree(p), moving) for name, p in momenta.items()}
        known = real(to_tree(first.hamiltonian), here)
        assert real(to_tree(branch.hamiltonian), here) == pytest.approx(known, rel=1e-12)
    if name not in READS_OTHERWISE:
        assert str(branch.hamiltonian) == str(first.hamiltonian)
