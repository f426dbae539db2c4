"""Linear equations with exact coefficients: what they determine, and where they may fail to.

The rank at almost every state is found in a finite field. At every state it is proved by elimination, with
pivots that are never zero.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import TypeAlias

from rigidcli.algebra.calculus import derivative
from rigidcli.algebra.expressions import ZERO, Expr
from rigidcli.algebra.field import P, reduced
from rigidcli.algebra.matrices import determinant
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.domain import open_factors
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.truth import generic, vanishes

MOST_PIVOTS = 24
"""Candidates for one pivot, the shortest, that are looked at."""

LARGEST = 4
"""Rows of the largest determinant that is worked out where no pivot is found."""

Row: TypeAlias = dict[str, tuple[Expr, int]]
"""The coefficients of the unknown derivatives in an equation, with their values at a point of the field."""


def slopes(e: Expr, names: Sequence[str]) -> dict[str, Expr]:
    """The slopes of an equation; none where they are too large."""
    with suppress(ExpressionError):
        return {name: derivative(e, name) for name in names if name in e.names}
    return {}


def valued(rows: Sequence[dict[str, Expr]], motion: Motion) -> list[Row] | None:
    """The rows with values at a point of the field."""
    kept = [{name: e for name, e in row.items() if e.terms} for row in rows]
    found = generic([e for row in kept for e in row.values()], motion)
    if found is None:
        return None
    values = iter(found)
    return [{name: (e, next(values)) for name, e in row.items()} for row in kept]


def matrix(rows: Sequence[Row], columns: Sequence[str]) -> list[list[int]]:
    """The coefficients of these columns at the point of the field, zero where a row has none."""
    return [[row[name][1] if name in row else 0 for name in columns] for row in rows]


def determined(rows: Sequence[Row], columns: Sequence[str]) -> set[str]:
    """The columns in which no vector that the rows take to zero has an entry."""
    echelon = reduced(matrix(rows, columns))
    return {columns[place] for place, row in echelon.items() if sum(map(bool, row)) == 1}


def gaps(rows: Sequence[Row], wanted: set[str], motion: Motion) -> list[Expr]:
    """The factors that may be zero, and where they are the rows do not determine what they do elsewhere."""
    table = [dict(row) for row in rows]
    others = {name for row in table for name in row} - wanted
    for columns in (others, wanted):
        left = set(columns)
        while left:
            places = [
                (len(e.key), place, name)
                for place, row in enumerate(table)
                for name, (e, known) in row.items()
                if name in left and known
            ]
            if not places:
                break
            shortest = sorted(places)[:MOST_PIVOTS]
            pivot = next(((k, n) for _, k, n in shortest if not open_factors(table[k][n][0], motion)), None)
            if pivot is None:
                return _of_block(table, sorted(left), motion, shortest[0])
            _eliminate(table, *pivot, motion)
            left.remove(pivot[1])
    return []


def _of_block(
    table: Sequence[Row], columns: Sequence[str], motion: Motion, shortest: tuple[int, int, str]
) -> list[Expr]:
    """The factors that may be zero in the determinant of what has no pivots."""
    echelon = reduced([list(column) for column in zip(*matrix(table, columns), strict=True)])
    if len(echelon) < len(columns) or len(columns) > LARGEST:
        _, place, name = shortest
        return open_factors(table[place][name][0], motion)
    block = [
        [table[place][name][0] if name in table[place] else ZERO for name in columns] for place in echelon
    ]
    return open_factors(determinant(block), motion)


def _eliminate(table: list[Row], place: int, name: str, motion: Motion) -> None:
    """Take a column out of the rows by that with the pivot, which goes."""
    pivot = table.pop(place)
    head, known = pivot.pop(name)
    inverse = pow(known, -1, P)
    for row in table:
        if name not in row:
            continue
        e, value = row.pop(name)
        for other, (entry, size) in pivot.items():
            own, here = row.pop(other, (ZERO, 0))
            changed = own - e * entry / head
            found = (here - value * size * inverse) % P
            if found or not vanishes(changed, motion):
                row[other] = (changed, found)
