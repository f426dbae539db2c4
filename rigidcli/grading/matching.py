"""What belongs to what: pairs of rows and columns that are worth the most together."""

from __future__ import annotations

import math
from functools import lru_cache
from itertools import permutations

import numpy as np
from numpy.typing import NDArray

from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.grading.values import Integers

MOST_WAYS = 720
"""Ways to pair that are all tried, in less than a millisecond; to load scipy takes hundreds of them."""


def assigned(worth: Floats | Mask) -> Integers:
    """The column of each row (n) of `worth` (n by m) that make the largest sum together; -1 for none."""
    rows, columns = worth.shape
    if rows > columns:
        found = np.full(rows, -1)
        found[assigned(worth.T)] = range(columns)
        return found
    if math.perm(columns, rows) > MOST_WAYS:
        from scipy.optimize import linear_sum_assignment

        return np.asarray(linear_sum_assignment(worth, maximize=True)[1])
    ways = _ways(rows, columns)
    return np.asarray(ways[worth[range(rows), ways].sum(axis=1).argmax()])


@lru_cache
def _ways(rows: int, columns: int) -> NDArray[np.intp]:
    """A column for each of some rows, in all ways."""
    return np.array([*permutations(range(columns), rows)], dtype=np.intp)
