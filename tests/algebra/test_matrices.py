"""Matrices of expressions against numpy's numbers at random values of their symbols."""

from __future__ import annotations

import numpy as np
import pytest

from rigidcli.algebra import matrices
from rigidcli.algebra.expressions import ONE, ZERO
from rigidcli.algebra.trees import to_tree
from rigidcli.core.arithmetic import Floats
from rigidcli.language.expression import real
from tests.tables import rows_of
from tests.trees import expression, matrix

POINT = {"a": 0.7, "b": 1.3, "m": 2.1, "q": 0.4}


def numbers(entries: matrices.Matrix) -> Floats:
    return np.array([[real(to_tree(entry), POINT) for entry in row] for row in entries])


@pytest.mark.parametrize(
    "rows",
    rows_of(__file__, "inverses"),
)
def test_inverses(rows: list[str]) -> None:
    entries = matrix(*rows)
    found = matrices.inverse(entries)
    assert found is not None
    assert numbers(found) == pytest.approx(np.linalg.inv(numbers(entries)), rel=1e-13, abs=1e-13)


def test_blocks_are_what_entries_connect() -> None:
    entries = matrix("1,0,a,0", "0,1,0,0", "a,0,1,b", "0,0,b,1")
    assert matrices.blocks(entries) == [[0, 2, 3], [1]]


def test_a_large_full_block_is_not_inverted() -> None:
    entries = [[expression(f"a^{i + j} + {9 if i == j else 0}") for j in range(5)] for i in range(5)]
    assert matrices.inverse(entries) is None


def test_null_vectors_are_taken_to_zero() -> None:
    entries = matrix("m,m*a,0", "m*a,m*a^2,0", "0,0,b")
    (vector,) = matrices.null_vectors(entries)
    columns = np.array([real(to_tree(e), POINT) for e in vector])
    assert numbers(entries) @ columns == pytest.approx(np.zeros(3), abs=1e-14)
    assert matrices.null_vectors([[ONE, ZERO], [ZERO, ONE]]) == []
