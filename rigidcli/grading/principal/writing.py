"""Moments and axes as they are written: in entries, which are numbers or expressions in symbols."""

from __future__ import annotations

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.grading.arrays.entries import Entry, filled
from rigidcli.grading.arrays.mistakes import as_typed
from rigidcli.grading.asked import Tree
from rigidcli.grading.numbers import NOISE
from rigidcli.symbolic.language.expression import Expression, parse

PLACES = {1: "along", 2: "at right angles to", 3: "in any direction"}
"""Where axes are, by the dimension of their space."""


def written(entries: Array) -> Tree:
    """Pairs (n by 4) as a student types them, or axes (n by 3), to all digits."""
    rows = as_typed(entries)
    if entries.shape[1] == 3:
        return rows
    return [{"moment": moment, "axis": axis} for moment, *axis in rows]


def shown(entry: Entry) -> str:
    """A number to six figures, or an expression."""
    return entry.text if isinstance(entry, Expression) else f"{entry + 0.0:.6g}"


def moment_shown(entry: Entry) -> str:
    """A moment with its unit; symbols bring units of their own."""
    return shown(entry) if isinstance(entry, Expression) else f"{shown(entry)} kg m^2"


def place_shown(axes: Array, space: tuple[int, ...], slot: int) -> str:
    """Where the axis in a place is: along it, or what the axes of its space (indices) have in common."""
    if len(space) == 3:
        return PLACES[3]
    own = slot if len(space) == 1 else ({0, 1, 2} - set(space)).pop()
    return f"{PLACES[len(space)]} ({', '.join(map(shown, axes[own]))})"


def mixed(factors: Floats, entries: Array) -> Array:
    """Sums of entries (n, or n by j) times factors (m by n): m, or m by j."""
    columns = entries.reshape(len(entries), -1).T
    sums = [_sum(row, column) for row in factors.tolist() for column in columns]
    return filled(sums, (len(factors), *entries.shape[1:]))


def _sum(factors: list[float], entries: Array) -> Entry:
    """A sum in which equal expressions stand once, without what rounding leaves of zeros."""
    number, parts = 0.0, dict[Expression, float]()
    for factor, entry in zip(factors, entries, strict=True):
        if isinstance(entry, Expression):
            parts[entry] = parts.get(entry, 0.0) + factor
        else:
            number += factor * entry
    least = NOISE * max(map(abs, factors))
    parts = {entry: factor for entry, factor in parts.items() if abs(factor) > least}
    if not parts:
        return number
    terms = [_term(factor, entry) for entry, factor in parts.items()]
    return parse(" + ".join([*terms, *([f"{number:.17g}"] if number else [])]))


def _term(factor: float, entry: Expression) -> str:
    """A product, with so many digits that rounding does not show."""
    text = entry.text if entry.text.isidentifier() else f"({entry.text})"
    written = f"{factor:.15g}"
    return {"1": text, "-1": f"-{text}"}.get(written, f"{written}*{text}")
