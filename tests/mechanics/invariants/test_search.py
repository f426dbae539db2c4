"""Conserved quantities against those in textbooks, with Poisson brackets and ranks from 50 digits."""

from __future__ import annotations

import itertools
import os
import subprocess
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from fractions import Fraction

import mpmath
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.algebra.expressions import Expr
from rigidcli.language.parser import read
from rigidcli.mechanics.hamilton_equations import Phase
from rigidcli.mechanics.invariants.search import conserved_quantities
from tests.trees import CONTEXT, expression, value, written

FREE = "(p_x**2 + p_y**2)/(2*m)"
FREE_3 = "(p_x**2 + p_y**2 + p_z**2)/(2*m)"
R = "sqrt(x**2 + y**2)"
R_3 = "sqrt(x**2 + y**2 + z**2)"
L = "x*p_y - y*p_x"
ROTOR = "(p_theta**2 + p_phi**2/sin(theta)**2)"
L_X = "p_theta*sin(phi) + p_phi*cos(phi)/tan(theta)"
TILT = "(p_phi - p_psi*cos(theta))/sin(theta)"
NODE = f"({TILT})*sin(psi) + p_theta*cos(psi)"
DELTA = "(r**2 - 2*M*r + a**2)"
KERR = (
    f"({DELTA}*p_r**2 + p_theta**2 + (p_phi/sin(theta) + a*p_T*sin(theta))**2"
    f" - ((r**2 + a**2)*p_T + a*p_phi)**2/{DELTA})/(2*(r**2 + a**2*cos(theta)**2))"
)
CARTER = f"p_theta**2 + (p_phi/sin(theta) + a*p_T*sin(theta))**2 - 2*a**2*cos(theta)**2*({KERR})"
STARK = "2*(u*p_u**2 + v*p_v**2)/(m*(u + v)) + p_phi**2/(2*m*u*v) - 2*k/(u + v) + F*(u - v)/2"
ELLIPTIC = "((p_u**2 + p_v**2)/(2*m*a**2) - k*cosh(u)/a - K*cos(v)/a)/(sinh(u)**2 + sin(v)**2)"
PAIR = "(p_x1**2 + p_y1**2)/(2*m1) + (p_x2**2 + p_y2**2)/(2*m2)"
APART = "sqrt((x1 - x2)**2 + (y1 - y2)**2)"
TURNING = "(x1 - x2)*(m2*p_y1 - m1*p_y2) - (y1 - y2)*(m2*p_x1 - m1*p_x2)"
COUPLED_RATES = "(a + c)*p_x**2/m**2 - 2*c*p_x*p_y/(m*M) + (b + c)*p_y**2/M**2"
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
    "Kepler, polar": Case(
        "r phi",
        "p_r**2/(2*m) + p_phi**2/(2*m*r**2) - k/r",
        ("(p_phi**2/r - m*k)*cos(phi) + p_r*p_phi*sin(phi)",),
        1,
        ("p_phi",),
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
    "screened, spherical": Case(
        "r theta phi", f"p_r**2/(2*m) + {ROTOR}/(2*m*r**2) - k*exp(-r/a)/r", (ROTOR, L_X), 2, ("p_phi",)
    ),
    "dipole, spherical": Case(
        "r theta phi",
        f"p_r**2/(2*m) + {ROTOR}/(2*m*r**2) + k*cos(theta)/r**2",
        (f"{ROTOR} + 2*m*k*cos(theta)",),
        1,
        ("p_phi",),
    ),
    # L. D. Landau, E. M. Lifshitz, Mechanics, section 35, in Euler angles; L is at rest in space.
    "free asymmetric top": Case(
        "theta phi psi",
        f"({NODE})**2/(2*A) + (({TILT})*cos(psi) - p_theta*sin(psi))**2/(2*B) + p_psi**2/(2*C)",
        (
            f"p_theta**2 + ({TILT})**2 + p_psi**2",
            "p_psi*cos(phi)/sin(theta) - p_phi*cos(phi)/tan(theta) - p_theta*sin(phi)",
        ),
        2,
        ("p_phi",),
    ),
    "free symmetric top": Case(
        "theta phi psi",
        f"p_theta**2/(2*A) + ({TILT})**2/(2*A) + p_psi**2/(2*C)",
        (
            f"p_theta**2 + ({TILT})**2 + p_psi**2",
            "p_psi*cos(phi)/sin(theta) - p_phi*cos(phi)/tan(theta) - p_theta*sin(phi)",
        ),
        1,
        ("p_phi", "p_psi"),
    ),
    # L. D. Landau, E. M. Lifshitz, Mechanics, section 48: separation of variables.
    "Stark, parabolic": Case(
        "u v phi",
        STARK,
        (f"2*u*p_u**2/m + p_phi**2/(2*m*u) + F*u**2/2 - u*({STARK})",),
        1,
        ("p_phi",),
    ),
    "Stark, squared": Case(
        "u v phi",
        "((p_u**2 + p_v**2)/(2*m) - 2*k)/(u**2 + v**2) + p_phi**2/(2*m*u**2*v**2) + F*(u**2 - v**2)/2",
        (),
        1,
        ("p_phi",),
    ),
    "two centres, elliptic": Case("u v", ELLIPTIC, (), 1),
    "Liouville": Case("x y", "(p_x**2 + p_y**2 + a*x**3 + b*exp(y))/(2*(x**4 + exp(2*y)))", (), 1),
    "in steps": Case(
        "r theta phi",
        "p_r**2/2 + exp(r) + (p_theta**2 + (p_phi**2 + exp(cos(phi)))/sin(theta)**2 + cos(theta))/(2*r**2)",
        ("p_phi**2 + exp(cos(phi))", "p_theta**2 + (p_phi**2 + exp(cos(phi)))/sin(theta)**2 + cos(theta)"),
        2,
    ),
    # B. Carter, Physical Review 174 (1968) 1559: geodesics about a turning black hole.
    "Kerr": Case("r theta phi T", KERR, (CARTER,), 1, ("p_phi", "p_T")),
    "Schwarzschild": Case(
        "r theta phi T",
        "((1 - 2*M/r)*p_r**2 + (p_theta**2 + p_phi**2/sin(theta)**2)/r**2 - p_T**2/(1 - 2*M/r))/2",
        (ROTOR,),
        1,
        ("p_phi", "p_T"),
    ),
    "dipole": Case("x y", f"{FREE} - k*x/{R}**3", (f"({L})**2 - 2*m*k*x/{R}",), 1),
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
    "oscillators, all different": Case(
        "x y",
        "p_x**2/(2*m) + p_y**2/(2*M) + a*x**2/2 + b*y**2/2 + c*(x - y)**2/2",
        # M x'' = -K x keeps p M^-1 K M^-1 p + x K M^-1 K x.
        (f"{COUPLED_RATES} + ((a + c)*x - c*y)**2/m + ((b + c)*y - c*x)**2/M",),
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
    "Henon-Heiles, Korteweg-de Vries": Case(
        "x y",
        "p_x**2/2 + p_y**2/2 + (a*x**2 + b*y**2)/2 + x**2*y + 2*y**3",
        (f"4*p_x*({L}) + (4*a - b)*(p_x**2 + a*x**2) + x**4 + 4*x**2*y**2 + 4*a*x**2*y",),
        1,
    ),
    "Henon-Heiles, Kaup-Kupershmidt": Case("x y", KAUP, (), 0),
    "Smorodinsky-Winternitz": Case(
        "x y",
        f"{FREE} + k*(x**2 + y**2)/2 + a/x**2 + b/y**2",
        ("p_x**2 + m*k*x**2 + 2*m*a/x**2", f"({L})**2 + 2*m*(x**2 + y**2)*(a/x**2 + b/y**2)"),
        2,
    ),
    # L. D. Landau, E. M. Lifshitz, Mechanics, section 48.
    "Kepler in a field": Case("x y", f"{FREE} - k/{R} + F*x", (f"p_y*({L}) - m*k*x/{R} - m*F*y**2/2",), 1),
    "two centres": Case(
        "x y",
        f"{FREE} - k/sqrt((x - a)**2 + y**2) - K/sqrt((x + a)**2 + y**2)",
        (f"({L})**2 + a**2*p_x**2 - 2*m*a*x*(k/sqrt((x - a)**2 + y**2) - K/sqrt((x + a)**2 + y**2))",),
        1,
    ),
    "Kepler, parabolic": Case(
        "u v",
        "((p_u**2 + p_v**2)/(2*m) - 2*k)/(u**2 + v**2)",
        ("u*p_v - v*p_u", "(v**2*p_u**2 - u**2*p_v**2 + 2*m*k*(u**2 - v**2))/(u**2 + v**2)"),
        2,
    ),
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
    "spring between masses": Case("x y", "p_x**2/(2*m1) + p_y**2/(2*m2) + k*(x - y)**2/2", ("p_x + p_y",), 1),
    "two bodies": Case(
        "x1 y1 x2 y2",
        f"{PAIR} - k/{APART}",
        (
            "p_x1 + p_x2",
            "p_y1 + p_y2",
            "(m1*x1 + m2*x2)*(p_y1 + p_y2) - (m1*y1 + m2*y2)*(p_x1 + p_x2)",
            TURNING,
            f"(m2*p_y1 - m1*p_y2)*({TURNING}) - m1*m2*(m1 + m2)*k*(x1 - x2)/{APART}",
        ),
        5,
    ),
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
    "power": Case("x y", f"{FREE} + k*(x**2 + y**2)**n", (L,), 1),
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
        ("Kepler", [L, f"x*p_y**2 - y*p_x*p_y - m*k*x/{R}"]),
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


coefficient = st.fractions(-3, 3, max_denominator=2)


@settings(max_examples=15, deadline=None)
@given(
    st.sampled_from([(3, 4, 5), (1, 2, 1), (0, 1, 1), (1, 1, 1)]),
    st.lists(coefficient, min_size=4, max_size=4),
    st.lists(coefficient, min_size=4, max_size=4),
)
def test_a_turned_separable_potential_is_seen_through(
    turn: tuple[int, int, int], first: list[Fraction], second: list[Fraction]
) -> None:
    """H = p^2/2 + f(u) + g(v) keeps p_u^2/2 + f(u), where u and v are turned (and perhaps longer)."""
    a, b, c = turn

    def polynomial(coefficients: Sequence[Fraction], variable: str) -> str:
        return " + ".join(f"({k})*({variable})**{i + 1}" for i, k in enumerate(coefficients))

    u, v = f"({a}*x + {b}*y)/{c}", f"({b}*x - {a}*y)/{c}"
    length = Fraction(a * a + b * b, c * c)
    f = polynomial(first, u)
    hamiltonian = f"(p_x**2 + p_y**2)/2 + {f} + {polynomial(second, v)}"
    energy = f"(({a}*p_x + {b}*p_y)/{c})**2/2 + ({length})*({f})"
    result = found("x y", hamiltonian)
    holds_together(Case("x y", hamiltonian, (energy,), 0), [written(e) for e in result])


def test_total_momentum_of_a_chain_is_found_though_the_whole_list_is_too_long() -> None:
    size = 12
    names = [f"x{i}" for i in range(size)]
    kinetic = " + ".join(f"p_{name}**2/(2*m{i % 3})" for i, name in enumerate(names))
    springs = " + ".join(f"k*({a} - {b})**4" for a, b in itertools.pairwise(names))
    result = found(" ".join(names), f"{kinetic} + {springs}")
    assert list(result) == [expression(" + ".join(f"p_{name}" for name in names))]


def test_a_coefficient_that_is_not_recognized_is_admitted() -> None:
    """In x*p_y - (y - sqrt(a))*p_x the root is no ratio of coefficients of H."""
    assert found("x y", f"{FREE} - k/sqrt(x**2 + (y - sqrt(a))**2)") == ()


@pytest.mark.parametrize(
    ("coordinates", "hamiltonian"),
    [
        ("theta", "p_theta**2/(2*m*l**2) - m*g*l*cos(theta)"),
        ("x y", f"{FREE} + k*x*cos(w*t)"),
        ("x y", "k"),
        ("x y", f"{FREE} + sqrt(-1 - x**2 - y**2)"),
        ("x y", "(p_x**2 + p_y**2)*10**200 + x**2/10**200 + y**2"),
        (" ".join(f"x{i}" for i in range(30)), " + ".join(f"p_x{i}**2" for i in range(30))),
    ],
)
def test_where_nothing_is_searched(coordinates: str, hamiltonian: str) -> None:
    assert found(coordinates, hamiltonian) == ()


def test_the_verdict_is_the_same_in_every_run() -> None:
    case = CASES["Kepler in a field"]
    script = (
        "from tests.mechanics.invariants.test_search import found, written\n"
        f"print([written(e) for e in found({case.coordinates!r}, {case.hamiltonian!r})])"
    )
    outputs = {
        subprocess.run(
            [sys.executable, "-c", script],
            env=os.environ | {"PYTHONHASHSEED": seed},
            check=True,
            capture_output=True,
            text=True,
        ).stdout
        for seed in ("1", "2")
    }
    assert len(outputs) == 1
