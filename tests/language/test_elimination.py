"""Linear equations solved by elimination, in generated code, against numpy."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.language import code
from rigidcli.language.elimination import solved
from rigidcli.language.tree import Name, number

few = settings(max_examples=30, deadline=None)


@few
@given(st.integers(1, 8), st.integers(0, 2**31), st.floats(0, 1))
def test_elimination_solves(size: int, seed: int, sparsity: float) -> None:
    chance = np.random.default_rng(seed)
    root = chance.normal(size=(size, size)) * (chance.random((size, size)) > sparsity)
    entries, right = root @ root.T + np.eye(size), chance.normal(size=size)
    steps, answers = solved(
        [[number(entry) for entry in row] for row in entries], [Name(f"b{i}") for i in range(size)]
    )
    f = code.function(answers, [f"b{i}" for i in range(size)], {}, steps)
    assert f(math)(*right) == pytest.approx(np.linalg.solve(entries, right), rel=1e-9, abs=1e-9)
