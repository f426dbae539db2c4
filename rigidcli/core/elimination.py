"""Elimination by Gauss and Jordan, for floats, complex and exact numbers."""

from __future__ import annotations

import numpy as np

from rigidcli.core.arithmetic import FLOAT, Arithmetic, Array


def echelon(matrix: Array, rank: int, noise: float = 0.0, n: Arithmetic = FLOAT) -> tuple[Array, list[int]]:
    """The reduced row echelon form of a matrix of this rank, and the columns of its pivots.

    The pivot is the largest entry that a column has left. Entries that are no larger than `noise` are zero.
    """
    rows, pivots = matrix.copy(), list[int]()
    for column in range(rows.shape[1]):
        done = len(pivots)
        if done == rank:
            break
        sizes = [n.size(abs(entry)) for entry in rows[done:, column]]
        best = int(np.argmax(sizes))
        if sizes[best] <= noise:
            continue
        rows[[done, done + best]] = rows[[done + best, done]]
        rows[done] = n.tidy(rows[done] / rows[done, column])
        others = np.arange(len(rows)) != done
        rows[others] = n.tidy(rows[others] - np.outer(rows[others, column], rows[done]))
        pivots.append(column)
    return rows, pivots
