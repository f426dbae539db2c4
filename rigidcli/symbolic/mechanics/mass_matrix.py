"""Matrices of expressions, as the mass matrix is one: their blocks, inverses and ranks."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TypeAlias

from rigidcli.errors import ExpressionError
from rigidcli.symbolic.algebra.calculus import expand
from rigidcli.symbolic.algebra.expressions import ONE, ZERO, Expr, total
from rigidcli.symbolic.algebra.simplification import tidy
from rigidcli.symbolic.algebra.values import is_zero

Matrix: TypeAlias = Sequence[Sequence[Expr]]

LARGEST = 4
"""Rows of a block whose determinant is worked out in symbols."""

MOST_TERMS = 24
"""Terms of that determinant, multiplied out, beyond which the inverse would fill pages."""


def connected(size: int, linked: Callable[[int, int], bool]) -> list[list[int]]:
    """The groups of the indices below `size` that links connect, each ascending."""
    left = list(range(size))
    found = []
    while left:
        block = [left.pop(0)]
        for i in block:
            near = [j for j in left if linked(i, j)]
            block.extend(near)
            left = [j for j in left if j not in near]
        found.append(sorted(block))
    return found


def blocks(matrix: Matrix) -> list[list[int]]:
    """The groups of indices that the entries (n by n, symmetric) connect, each ascending."""
    return connected(len(matrix), lambda i, j: not matrix[i][j].is_zero)


def part(matrix: Matrix, rows: Sequence[int], columns: Sequence[int]) -> list[list[Expr]]:
    """The entries in these rows and columns."""
    return [[matrix[i][j] for j in columns] for i in rows]


def inverse(matrix: Matrix) -> list[list[Expr]] | None:
    """The inverse of a regular symmetric matrix (n by n), by blocks; None if it would be too large.

    A block is inverted by its adjugate, or as numbers where it is a matrix of numbers times one expression.
    """
    result = [[ZERO] * len(matrix) for _ in matrix]
    for block in blocks(matrix):
        inner = part(matrix, block, block)
        inverted = _of_numbers(inner) if len(block) > 2 else None
        if inverted is None:
            if len(block) > LARGEST or (len(block) > 1 and not _is_short(minor(inner))):
                return None
            inverted = _adjugate(inner)
        for i, row in zip(block, inverted, strict=True):
            for j, entry in zip(block, row, strict=True):
                result[i][j] = entry
    return result


def _is_short(determinant: Expr) -> bool:
    try:
        return len(expand(determinant).terms) <= MOST_TERMS
    except ExpressionError:
        return False


def _adjugate(matrix: Matrix) -> list[list[Expr]]:
    determinant = tidy(minor(matrix))
    indices = range(len(matrix))
    result = [[ZERO] * len(matrix) for _ in matrix]
    for i in indices:
        for j in range(i, len(matrix)):
            rows, columns = ([k for k in indices if k != dropped] for dropped in (i, j))
            entry = minor(part(matrix, rows, columns)) * (-1) ** (i + j)
            result[i][j] = result[j][i] = tidy(entry / determinant)
    return result


def minor(matrix: Matrix) -> Expr:
    """The determinant, along the first row."""
    if not matrix:
        return ONE
    head, *rest = matrix
    return total(
        head[j] * minor([row[:j] + row[j + 1 :] for row in map(list, rest)]) * (-1) ** j
        for j in range(len(matrix))
        if not head[j].is_zero
    )


def _of_numbers(matrix: Matrix) -> list[list[Expr]] | None:
    """The inverse of numbers times one expression; None if it is not that."""
    unit = next(entry for row in matrix for entry in row if not entry.is_zero)
    numbers: list[list[Fraction]] = []
    for i, row in enumerate(matrix):
        ratios = [(entry / unit).as_number for entry in row]
        numbers.append([Fraction(int(i == j)) for j in range(len(matrix))])
        for j, ratio in enumerate(ratios):
            if ratio is None:
                return None
            numbers[i].insert(j, Fraction(ratio))
    size = len(matrix)
    for i in range(size):
        pivot = next((k for k in range(i, size) if numbers[k][i]), None)
        if pivot is None:
            return None
        numbers[i], numbers[pivot] = numbers[pivot], numbers[i]
        numbers[i] = [entry / numbers[i][i] for entry in numbers[i]]
        for k in range(size):
            if k != i and numbers[k][i]:
                numbers[k] = [a - numbers[k][i] * b for a, b in zip(numbers[k], numbers[i], strict=True)]
    return [[entry / unit for entry in row[size:]] for row in numbers]


def null_vectors(matrix: Matrix) -> list[list[Expr]]:
    """Vectors that span what the matrix (n by n) takes to zero, by elimination; entries are tidied."""
    rows = [list(row) for row in matrix]
    size = len(rows)
    pivots: list[int] = []
    for column in range(size):
        start = len(pivots)
        pivot = next((k for k in range(start, size) if not is_zero(rows[k][column])), None)
        if pivot is None:
            continue
        rows[start], rows[pivot] = rows[pivot], rows[start]
        rows[start] = [tidy(entry / rows[start][column]) for entry in rows[start]]
        for k in range(size):
            if k != start and not rows[k][column].is_zero:
                factor = rows[k][column]
                rows[k] = [tidy(a - factor * b) for a, b in zip(rows[k], rows[start], strict=True)]
        pivots.append(column)
    vectors = []
    for free in (column for column in range(size) if column not in pivots):
        vector = [ZERO] * size
        vector[free] = ONE
        for row, column in zip(rows, pivots, strict=False):
            vector[column] = -row[free]
        vectors.append(vector)
    return vectors
