"""Pairs that are worth the most together."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import linear_sum_assignment

from rigidcli.grading.matching import assigned


@pytest.mark.parametrize("shape", [(1, 1), (3, 3), (2, 4), (5, 3), (6, 3), (0, 3), (3, 0), (7, 7), (9, 4)])
def test_the_pairs_are_worth_as_much_as_those_of_scipy(shape: tuple[int, int]) -> None:
    chance = np.random.default_rng(sum(shape))
    for worth in (chance.normal(size=shape), chance.random(shape) < 0.4):
        found = assigned(worth)
        rows = np.flatnonzero(found >= 0)
        assert found.shape == shape[:1]
        assert len(rows) == len(set(found[rows])) == min(shape)
        best = worth[linear_sum_assignment(1.0 * worth, maximize=True)]
        assert worth[rows, found[rows]].sum() == pytest.approx(best.sum())
