"""Conserved quantities against those in textbooks, with Poisson brackets and ranks from 50 digits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass

import mpmath
import pytest

from rigidcli.algebra.expressions import Expr
from rigidcli.language.parser import read
from rigidcli.mechanics.hamilton_equations import Phase
from rigidcli.mechanics.invariants import conserved_quantities
from tests.trees import CONTEXT, expression, value, written

FREE = "(p_x**2 + p_y**2)/(2*m)"
FREE_3 = "(p_x**2 + p_y**2 + p_z**2)/(2*m)"
R = "sqrt(x**2 + y**2)"
R_3 = "sqrt(x**2 + y**2 + z**2)"
L = "x*p_y - y*p_x"
ROTOR = "(p_theta**2 + p_phi**2/sin(theta)**2)"
L_X = "p_theta*sin(phi) + p_phi*cos(phi)/tan(theta)"
PAIR = "(p_x1**2 + p_y1**2)/(2*m1) + (p_x2**2 + p_y2**2)/(2*m2)"
APART = "sqrt((x1 - x2)**2 + (y1 - y2)**2)"
KAUP = "p_x**2/2 + p_y**2/2 + k*(x**2 + 16*y**2)/2 + c*(x**2*y + 16*y**3/3)"
"""Its second invariant is of degree 4 in the momenta."""


@dataclass(frozen=True)
class Case:
    """A Hamiltonian, conserved quantities that follow from those found, and how many are to be found."""

    coordinates: str
    hamiltonian: str
    truth: tuple[str, ...]
    count: int
    known: tuple[str, ...] = ()


CASES = {
    # L. D. Landau, E. M. Lifshitz, Mechanics, sections 9, 14 and 15.
    "projectile": Case("x y", f"{FREE} + m*g*y", ("p_x*p_y + m**2*g*x",), 1, ("p_x",)),
    "free": Case("x y", FREE, (L,), 1, ("p_x", "p_y")),
    "free in space": Case("x y z", FREE_3, (L, "y*p_z - z*p_y", "z*p_x - x*p_z"), 2, ("p_x", "p_y", "p_z")),
    "Kepler": Case("x y", f"{FREE} - k/{R}", (L, f"p_y*({L}) - m*k*x/{R}", f"-p_x*({L}) - m*k*y/{R}"), 2),
    "Kepler in space": Case(
        "x y z",
        f"{FREE_3} - k/{R_3}",
        (L, "y*p_z - z*p_y", "z*p_x - x*p_z", f"p_y*({L}) - p_z*(z*p_x - x*p_z) - m*k*x/{R_3}"),
        4,
    ),
    "central force": Case("x y", f"{FREE} + k*{R}**3", (L,), 1),
    "central force, spherical": Case(
        "r theta phi",
        f"p_r**2/(2*m) + {ROTOR}/(2*m*r**2) + k*r**4",
        (ROTOR, L_X),
        2,
        ("p_phi",),
    ),
    "Kepler, spherical": Case(
        "r theta phi", f"p_r**2/(2*m) + {ROTOR}/(2*m*r**2) - k/r", (ROTOR, L_X), 2, ("p_phi",)
    ),
    # L. D. Landau, E. M. Lifshitz, Mechanics, section 35, in Euler angles; L is at rest in space.
    # L. D. Landau, E. M. Lifshitz, Mechanics, section 48: separation of variables.
    # B. Carter, Physical Review 174 (1968) 1559: geodesics about a turning black hole.
    "spherical pendulum": Case("theta phi", f"{ROTOR}/(2*m*l**2) - m*g*l*cos(theta)", (), 0, ("p_phi",)),
    "rotor": Case(
        "theta phi", f"{ROTOR}/(2*I)", ("p_theta*sin(phi) + p_phi*cos(phi)/tan(theta)",), 1, ("p_phi",)
    ),
    # J. M. Jauch, E. L. Hill; D. M. Fradkin: the symmetry of the isotropic oscillator.
    "isotropic oscillator": Case(
        "x y",
        f"{FREE} + k*(x**2 + y**2)/2",
        (L, "p_x*p_y + m*k*x*y", "p_x**2 - p_y**2 + m*k*(x**2 - y**2)"),
        2,
    ),
    "anisotropic oscillator": Case(
        "x y",
        f"{FREE} + a*x**2/2 + b*y**2/2",
        ("p_x**2/(2*m) + a*x**2/2", "p_y**2/(2*m) + b*y**2/2"),
        1,
    ),
    "oscillator 1:2": Case(
        "x y", f"{FREE} + k*(x**2 + 4*y**2)/2", ("p_x**2 + m*k*x**2", f"p_x*({L}) + m*k*x**2*y"), 2
    ),
    "oscillator, decimals": Case(
        "x y",
        "0.37*p_x**2 + 1.23456*p_y**2 + 0.9131*pi*x**2 + 7.77*y**4",
        ("0.37*p_x**2 + 0.9131*pi*x**2",),
        1,
    ),
    "oscillators, coupled": Case(
        "x y",
        f"{FREE} + k*(x**2 + y**2)/2 + c*(x - y)**2/2",
        ("(p_x + p_y)**2 + m*k*(x + y)**2", "(p_x - p_y)**2 + m*(k + 2*c)*(x - y)**2"),
        1,
    ),
    # J. Hietarinta, Physics Reports 147 (1987) 87, and the papers that it names.
    "Henon-Heiles": Case("x y", f"{FREE} + k*(x**2 + y**2)/2 + c*(x**2*y - y**3/3)", (), 0),
    "Henon-Heiles, Sawada-Kotera": Case(
        "x y",
        f"{FREE} + k*(x**2 + y**2)/2 + c*(x**2*y + y**3/3)",
        ("p_x*p_y + m*(k*x*y + c*(x*y**2 + x**3/3))",),
        1,
    ),
    "Henon-Heiles, Kaup-Kupershmidt": Case("x y", KAUP, (), 0),
    # L. D. Landau, E. M. Lifshitz, Mechanics, section 48.
    "Kepler in a field": Case("x y", f"{FREE} - k/{R} + F*x", (f"p_y*({L}) - m*k*x/{R} - m*F*y**2/2",), 1),
    # J. D. Jackson, Classical Electrodynamics, section 12.2; the centre of the circle is at rest.
    "magnetic field": Case(
        "x y",
        "((p_x + q*B*y/2)**2 + (p_y - q*B*x/2)**2)/(2*m)",
        (L, "p_x - q*B*y/2", "p_y + q*B*x/2"),
        2,
    ),
    "magnetic field, Landau's gauge": Case(
        "x y", "(p_x**2 + (p_y - q*B*x)**2)/(2*m)", ("p_x - q*B*y",), 1, ("p_y",)
    ),
    "Penning's trap": Case(
        "x y z",
        "((p_x + q*B*y/2)**2 + (p_y - q*B*x/2)**2 + p_z**2)/(2*m) + k*(z**2 - (x**2 + y**2)/2)/2",
        (L, "p_z**2 + m*k*z**2"),
        2,
    ),
    "rotating frame": Case("x y", f"{FREE} - w*({L}) - k/{R}", (L,), 1),
    "relativistic": Case("x y", f"sqrt((p_x**2 + p_y**2)*c**2 + m**2*c**4) - k/{R}", (L,), 1),
    # L. D. Landau, E. M. Lifshitz, Mechanics, sections 5, 13 and 35.
    "two bodies": Case(
        "x1 y1 x2 y2",
        f"{PAIR} - k/{APART}",
        ("p_x1 + p_x2", "p_y1 + p_y2", "x1*p_y1 - y1*p_x1 + x2*p_y2 - y2*p_x2"),
        3,
    ),
    "three bodies": Case(
        "x1 y1 x2 y2 x3 y3",
        f"{PAIR} + (p_x3**2 + p_y3**2)/(2*m3) - k/{APART} - k*((x1 - x3)**2 + (y1 - y3)**2)**2"
        " - k/sqrt((x2 - x3)**2 + (y2 - y3)**2)",
        (
            "p_x1 + p_x2 + p_x3",
            "p_y1 + p_y2 + p_y3",
            "x1*p_y1 - y1*p_x1 + x2*p_y2 - y2*p_x2 + x3*p_y3 - y3*p_x3",
        ),
        3,
    ),
    "spring between masses": Case("x y", "p_x**2/(2*m1) + p_y**2/(2*m2) + k*(x - y)**2/2", ("p_x + p_y",), 1),
    "double pendulum": Case(
        "a b",
        "(m2*l2**2*p_a**2 + (m1 + m2)*l1**2*p_b**2 - 2*m2*l1*l2*p_a*p_b*cos(a - b))"
        "/(2*m2*l1**2*l2**2*(m1 + m2*sin(a - b)**2)) - (m1 + m2)*g*l1*cos(a) - m2*g*l2*cos(b)",
        (),
        0,
    ),
    "cart with a pendulum": Case(
        "x theta",
        "(p_x**2*m*l**2 + (M + m)*p_theta**2 - 2*m*l*cos(theta)*p_x*p_theta)"
        "/(2*m*l**2*(M + m*sin(theta)**2)) - m*g*l*cos(theta)",
        (),
        0,
        ("p_x",),
    ),
    "heavy top": Case(
        "theta phi psi",
        "p_theta**2/(2*A) + (p_phi - p_psi*cos(theta))**2/(2*A*sin(theta)**2) + p_psi**2/(2*C)"
        " + M*g*l*cos(theta)",
        (),
        0,
        ("p_phi", "p_psi"),
    ),
    "washboard": Case("x y", f"{FREE} + V*(cos(w*x) + cos(w*y))", ("p_x**2/(2*m) + V*cos(w*x)",), 1),
    "product of waves": Case("x y", f"{FREE} + V*cos(w*x)*cos(w*y)", (), 0),
    "exponential": Case("x y", f"{FREE} + V*exp(a*(x - y))", ("p_x + p_y",), 1),
    "steps": Case("x y", f"{FREE} + k*x*sign(x) + c*y**4", ("p_x**2/(2*m) + k*x*sign(x)",), 1),
    "narrow parameters": Case(
        "x y",
        f"{FREE} + k*sqrt(1 - c**2/3)*x**2 + log(1 + c)*y**4",
        ("p_x**2/(2*m) + k*sqrt(1 - c**2/3)*x**2",),
        1,
    ),
    "walls": Case("x y", f"{FREE} + k*abs(x) + c*abs(y)", ("p_x**2/(2*m) + k*abs(x)",), 1),
}


def phase_of(coordinates: str) -> Phase:
    names = tuple(coordinates.split())
    return Phase(names, tuple(f"p_{name}" for name in names))


def found(coordinates: str, hamiltonian: str, known: Sequence[str] = ()) -> tuple[Expr, ...]:
    return conserved_quantities(
        expression(hamiltonian), phase_of(coordinates), [expression(e) for e in known]
    )


def gradients(sources: Sequence[str], phase: Phase, seed: int) -> mpmath.matrix:
    """The gradients of texts at a point (texts by 2n), from differences with many digits."""
    trees = [read(source)[0] for source in sources]
    names = sorted(set().union(*(expression(source).names for source in sources)) | set(phase.names))
    point = {name: CONTEXT.mpf((37 * i + 61 * seed) % 89 + 31) / 71 for i, name in enumerate(names)}
    return CONTEXT.matrix(
        [
            [
                CONTEXT.diff(lambda x, n=name, t=tree: value(t, point | {n: x}), point[name])
                for name in phase.names
            ]
            for tree in trees
        ]
    )


def rank(matrix: mpmath.matrix) -> int:
    rows = CONTEXT.matrix([list(matrix[i, :] / CONTEXT.norm(matrix[i, :])) for i in range(matrix.rows)])
    return sum(size > 1e-12 for size in CONTEXT.svd_r(rows, compute_uv=False))


def holds_together(case: Case, sources: Sequence[str]) -> None:
    """All are conserved and independent, and what should be conserved follows from them."""
    phase = phase_of(case.coordinates)
    size = len(phase.coordinates)
    basis = [case.hamiltonian, *case.known, *sources]
    for seed in (1, 2):
        rows = gradients([*basis, *case.truth], phase, seed)
        for i in range(1, rows.rows):
            bracket = sum(
                rows[i, j] * rows[0, size + j] - rows[i, size + j] * rows[0, j] for j in range(size)
            )
            scale = CONTEXT.norm(rows[i, :]) * CONTEXT.norm(rows[0, :])
            assert abs(bracket) < 1e-15 * scale, [*basis, *case.truth][i]
        given_before = rank(rows[: len(basis) - len(sources), :])
        assert rank(rows[: len(basis), :]) == given_before + len(sources), basis
        assert rank(rows) == given_before + len(sources), basis


@pytest.mark.parametrize("name", CASES)
def test_what_textbooks_know_is_found(name: str) -> None:
    case = CASES[name]
    sources = [written(e) for e in found(case.coordinates, case.hamiltonian, case.known)]
    holds_together(case, sources)
    assert len(sources) == case.count, sources


@pytest.mark.parametrize(
    ("name", "texts"),
    [
        ("free", [L]),
        ("isotropic oscillator", [L, "p_x**2 + m*k*x**2"]),
        ("anisotropic oscillator", ["p_x**2 + m*a*x**2"]),
        ("spring between masses", ["p_x + p_y"]),
        ("rotating frame", [L]),
    ],
)
def test_what_is_found_reads_as_people_write_it(name: str, texts: list[str]) -> None:
    case = CASES[name]
    assert [written(e) for e in found(case.coordinates, case.hamiltonian, case.known)] == texts


def test_what_is_known_is_not_found_again() -> None:
    case = CASES["Kepler"]
    (other,) = found(case.coordinates, case.hamiltonian, [L])
    holds_together(Case("x y", case.hamiltonian, case.truth, 1, (L,)), [written(other)])
    assert found("x y", f"{FREE} + k*(x**2 + y**2)**2", [f"({L})**2"]) == ()


def test_total_momentum_of_a_chain_is_found_though_the_whole_list_is_too_long() -> None:
    size = 12
    names = [f"x{i}" for i in range(size)]
    kinetic = " + ".join(f"p_{name}**2/(2*m{i % 3})" for i, name in enumerate(names))
    springs = " + ".join(f"k*({a} - {b})**4" for a, b in itertools.pairwise(names))
    result = found(" ".join(names), f"{kinetic} + {springs}")
    assert list(result) == [expression(" + ".join(f"p_{name}" for name in names))]


@pytest.mark.parametrize(
    ("coordinates", "hamiltonian"),
    [
        ("theta", "p_theta**2/(2*m*l**2) - m*g*l*cos(theta)"),
        ("x y", f"{FREE} + k*x*cos(w*t)"),
        ("x y", "k"),
        ("x y", f"{FREE} + sqrt(-1 - x**2 - y**2)"),
    ],
)
def test_where_nothing_is_searched(coordinates: str, hamiltonian: str) -> None:
    assert found(coordinates, hamiltonian) == ()
