"""Matrices of exact expressions: their blocks, products, determinants, inverses and null vectors."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement
from typing import TypeAlias

import numpy as np

from rigidcli.algebra.arithmetic import EXACT, tidy_array
from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import ONE, ZERO, Expr, total
from rigidcli.algebra.simplification import tidy
from rigidcli.algebra.values import is_zero
from rigidcli.core.arithmetic import echelon
from rigidcli.errors import ExpressionError

Matrix: TypeAlias = Sequence[Sequence[Expr]]

LARGEST_BLOCK = 4  # the most rows of a block whose determinant is worked out in symbols: 24 products
MOST_TERMS = 24  # the most terms of that determinant, multiplied out: beyond, the inverse would fill pages
FEW_TERMS = 12  # the same where H is known without the inverse: an entry fills a screen
MOST_PRODUCTS = 5_000  # the most products of a larger determinant of few entries: a tenth of a second


def connected(size: int, linked: Callable[[int, int], bool]) -> list[list[int]]:
    """The groups of the indices below `size` that links connect, each ascending."""
    left = list(range(size))
    groups = []
    while left:
        block = [left.pop(0)]
        for i in block:
            near = [j for j in left if linked(i, j)]
            block.extend(near)
            left = [j for j in left if j not in near]
        groups.append(sorted(block))
    return groups


def blocks(matrix: Matrix) -> list[list[int]]:
    """The groups of indices that the entries (n by n, symmetric) connect, each ascending."""
    return connected(len(matrix), lambda i, j: not matrix[i][j].is_zero)


def part(matrix: Matrix, rows: Sequence[int], columns: Sequence[int]) -> list[list[Expr]]:
    """The entries in these rows and columns."""
    return [[matrix[i][j] for j in columns] for i in rows]


def product(left: Matrix, right: Matrix) -> list[list[Expr]]:
    """The product of two matrices."""
    # Most entries of large matrices are zeros.
    columns = [{k: b for k, b in enumerate(column) if b} for column in zip(*right, strict=True)]
    rows = [{k: a for k, a in enumerate(row) if a} for row in left]
    return [[total(row[k] * b for k, b in column.items() if k in row) for column in columns] for row in rows]


def times(matrix: Matrix, vector: Sequence[Expr]) -> list[Expr]:
    """The product of a matrix and a vector."""
    return [total(a * b for a, b in zip(row, vector, strict=True) if a) for row in matrix]


def quadratic_form(matrix: Matrix, vector: Sequence[Expr]) -> Expr:
    """The product x.M.x of a symmetric matrix and a vector."""
    pairs = combinations_with_replacement(range(len(vector)), 2)
    return total(matrix[i][j] * (1 if i == j else 2) * vector[i] * vector[j] for i, j in pairs)


def inverse(matrix: Matrix, most_terms: int = MOST_TERMS) -> list[list[Expr]] | None:
    """The inverse of a symmetric matrix (n by n), by blocks; None if there is none, or it would be too large.

    A block is inverted by its adjugate, or by elimination where it is numbers times one expression.
    """
    result = [[ZERO] * len(matrix) for _ in matrix]
    for block in blocks(matrix):
        inner = part(matrix, block, block)
        inverted = _of_numbers(inner) if len(block) > 2 else None
        if inverted is None:
            inverted = _adjugate(inner, most_terms if len(block) == LARGEST_BLOCK else MOST_TERMS)
        if inverted is None:
            return None
        for i, row in zip(block, inverted, strict=True):
            for j, entry in zip(block, row, strict=True):
                result[i][j] = entry
    return result


def _adjugate(matrix: Matrix, most_terms: int) -> list[list[Expr]] | None:
    size = len(matrix)
    whole = determinant(matrix) if size <= LARGEST_BLOCK else ZERO
    try:
        if is_zero(whole) or (size > 1 and len(expand(whole).terms) > most_terms):
            return None
    except ExpressionError:
        return None
    whole, result = tidy(whole), [[ZERO] * size for _ in matrix]
    for i, j in combinations_with_replacement(range(size), 2):
        result[i][j] = result[j][i] = tidy(minor(matrix, i, j) * (-1) ** (i + j) / whole)
    return result


def minor(matrix: Matrix, row: int, column: int) -> Expr:
    """The determinant without one row and one column."""
    kept = [entries for k, entries in enumerate(matrix) if k != row]
    return determinant([[e for k, e in enumerate(entries) if k != column] for entries in kept])


def determinant(matrix: Matrix) -> Expr:
    """The determinant, along the first row."""
    if not matrix:
        return ONE
    return total(e * minor(matrix, 0, j) * (-1) ** j for j, e in enumerate(matrix[0]) if e)


def short_determinant(matrix: Matrix) -> Expr:
    """The determinant of a matrix of few entries, which has not too many products."""
    if math.prod(sum(1 for e in row if e) or 1 for row in matrix) > MOST_PRODUCTS:
        raise ExpressionError("the determinant is too large")
    return determinant(matrix)


def _of_numbers(matrix: Matrix) -> list[list[Expr]] | None:
    """The inverse of numbers times one expression; None if it is not that."""
    size = len(matrix)
    unit = next(entry for row in matrix for entry in row if not entry.is_zero)
    rows = np.array([[entry / unit for entry in row] for row in matrix], dtype=object)
    if any(entry.as_number is None for entry in rows.flat):
        return None
    reduced, pivots = echelon(np.hstack([rows, np.eye(size, dtype=int)]), size, n=EXACT)
    if pivots != [*range(size)]:
        return None
    return [[entry / unit for entry in row] for row in reduced[:, size:].tolist()]


def null_vectors(matrix: Matrix) -> list[list[Expr]]:
    """Vectors that span what the matrix (m by n) takes to zero, by elimination; entries are tidied."""
    rows = tidy_array(np.array(matrix, dtype=object))
    reduced, pivots = echelon(rows, min(rows.shape), n=EXACT)
    vectors = []
    for free in (column for column in range(rows.shape[1]) if column not in pivots):
        vector = [ONE if column == free else ZERO for column in range(rows.shape[1])]
        for row, column in zip(reduced, pivots, strict=False):
            vector[column] = -row[free]
        vectors.append(vector)
    return vectors
