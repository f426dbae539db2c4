"""Conserved quantities against those in textbooks, with Poisson brackets and ranks from 50 digits."""

from __future__ import annotations

import itertools
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import mpmath
import pytest
import yaml

from rigidcli.algebra.expressions import Expr
from rigidcli.language.parser import read
from rigidcli.mechanics.invariants import conserved_quantities
from rigidcli.mechanics.phase_space import Phase
from tests.trees import CONTEXT, expression, value, written

FREE = "(p_x**2 + p_y**2)/(2*m)"
L = "x*p_y - y*p_x"


@dataclass(frozen=True)
class Case:
    """A Hamiltonian, conserved quantities that follow from those found, and how many are to be found."""

    coordinates: str
    hamiltonian: str
    truth: Sequence[str]
    count: int
    known: Sequence[str] = ()


CASES = {
    name: Case(**case)
    for name, case in yaml.safe_load(Path(__file__).with_name("invariants.yaml").read_text("utf-8")).items()
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
        ("x y", "k"),
        ("x y", f"{FREE} + sqrt(-1 - x**2 - y**2)"),
    ],
)
def test_where_nothing_is_searched(coordinates: str, hamiltonian: str) -> None:
    assert found(coordinates, hamiltonian) == ()
