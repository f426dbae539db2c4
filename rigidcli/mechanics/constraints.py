"""Whether the velocities follow from the momenta: the rank of the mass matrix, and what its lack means.

Where the rank r is less than n, the momenta obey n - r primary constraints: combinations of them that hold
no velocity. Source: P. A. M. Dirac, Lectures on Quantum Mechanics, lecture 1.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from rigidcli.algebra import matrices, samples
from rigidcli.algebra.expressions import ZERO, Expr, symbol, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.values import is_zero

NONE = 1e-13
"""A singular value below this is rounding: it belongs to a matrix with entries of the order of 1."""


def rank(matrix: matrices.Matrix, fixed: Mapping[str, Expr]) -> int | None:
    """The rank of a symmetric matrix (n by n) of expressions almost everywhere; None where it has no value.

    Names have their `fixed` values, others any.
    """
    blocks = matrices.blocks(matrix)
    ranks = [_of_block(matrices.part(matrix, block, block), fixed) for block in blocks]
    known = [found for found in ranks if found is not None]
    return sum(known) if len(known) == len(ranks) else None


def _of_block(matrix: matrices.Matrix, fixed: Mapping[str, Expr]) -> int | None:
    size = len(matrix)
    exact = [[substitute(entry, fixed) for entry in row] for row in matrix]
    if size <= matrices.LARGEST:
        is_regular = not is_zero(matrices.determinant(exact))
        return size if is_regular else size - len(matrices.null_vectors(exact))
    found = samples.values([entry for row in exact for entry in row], {})
    if found is None:
        return None
    sampled = found.reshape(-1, size, size)
    # Rows and columns are divided by the square roots of their sizes.
    sizes = np.sqrt(np.abs(sampled).max(axis=2, keepdims=True))
    sizes[sizes == 0] = 1.0
    balanced = sampled / sizes / sizes.transpose(0, 2, 1)
    return int(np.linalg.matrix_rank(balanced, tol=NONE).max())


def primary_constraints(
    matrix: matrices.Matrix, definitions: Sequence[Expr], velocities: Sequence[str], names: Sequence[str]
) -> list[Expr]:
    """Primary constraints: expressions in the momenta, called `names`, and coordinates that vanish.

    Only those that are linear in the momenta are found.
    """
    at_rest = dict.fromkeys(velocities, ZERO)
    found = []
    for vector in matrices.null_vectors(matrix):
        if any(not entry.names.isdisjoint(velocities) for entry in vector):
            continue
        still = total(entry * substitute(p, at_rest) for entry, p in zip(vector, definitions, strict=True))
        moving = total(entry * symbol(name) for entry, name in zip(vector, names, strict=True))
        found.append(tidy(moving - still))
    return found
