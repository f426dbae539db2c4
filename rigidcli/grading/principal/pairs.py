"""Pairs of a moment and an axis, as they are read from answers and from literal keys.

Where the axes alone are asked for, a list of them is an answer, too. Entries are numbers, or expressions in
symbols where the question has any: a row of them is a moment with its axis (4), or an axis (3).
"""

from __future__ import annotations

from dataclasses import dataclass
from math import hypot

import numpy as np

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.errors import shown
from rigidcli.grading.arrays.entries import Cell, filled, read_entry
from rigidcli.grading.asked import Tree
from rigidcli.grading.numbers import unit_of
from rigidcli.grading.outcome import Unreadable

UNIT = unit_of("kg m^2")

MOST = 6
"""Pairs of an answer; there are three, but an equal moment may be told too often."""

NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")


@dataclass(frozen=True, slots=True, eq=False)
class Pairs:
    """Moments (n, kg m^2), axes (n by 3) as typed, their lengths (n), and unit vectors along them (n by 3).

    Where an axis has no direction or no value, the unit vector is zero. Of axes alone there are no moments.
    """

    moments: Floats | None
    axes: Floats
    lengths: Floats
    units: Floats

    def __len__(self) -> int:
        return len(self.axes)


def of(values: Floats) -> Pairs:
    """Pairs of moments and axes (n by 4), or axes alone (n by 3)."""
    axes = values[:, -3:]
    lengths = np.array([hypot(*axis) for axis in axes.tolist()])
    known = np.where(np.isfinite(axes).all(axis=1, keepdims=True), axes, 0.0)
    # First by the largest component, so that squares stay within floats.
    largest = np.abs(known).max(axis=1, keepdims=True)
    shorter = known / np.where(largest > 0, largest, 1.0)
    norms = np.linalg.norm(shorter, axis=1, keepdims=True)
    moments = values[:, 0] if values.shape[1] == 4 else None
    return Pairs(moments, axes, lengths, shorter / np.where(norms > 0, norms, 1.0))


# --- reading


def read(answer: Tree, names: frozenset[str], *, alone: bool) -> Array:
    """The entries of pairs (n by 4), or of a list of axes (n by 3) where those may stand `alone`.

    Raises Unreadable.
    """
    cells = of_axes(answer) if alone and _has_lists(answer) else of_pairs(answer)
    units = [None] * 3 if cells.shape[1] == 3 else [UNIT, None, None, None]
    entries = [read_entry(cell, units[k], names)[0] for row in cells for k, cell in enumerate(row)]
    return filled(entries, cells.shape)


def _has_lists(answer: Tree) -> bool:
    return isinstance(answer, list) and any(isinstance(axis, list) for axis in answer)


def of_pairs(answer: Tree) -> Array:
    """The cells of a list of `{moment, axis}`, or `{moments, axes}` with axes in rows. Raises Unreadable."""
    if isinstance(answer, dict) and set(answer) == {"moments", "axes"}:
        answer = _zipped(answer["moments"], answer["axes"])
    if not isinstance(answer, list):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of `{{moment, axis}}`")
    if len(answer) > MOST:
        raise Unreadable("wrong_shape", f"read {len(answer)} pairs of a moment and an axis")
    cells = []
    for k, pair in enumerate(answer):
        if not isinstance(pair, dict) or set(pair) != {"moment", "axis"}:
            detail = f"read {shown(pair)}, expected a mapping with `moment` and `axis`"
            raise Unreadable("wrong_shape", detail, place=f"pair {k + 1}")
        cells += [Cell(pair["moment"], f"moment {k + 1}"), *_cells(pair["axis"], f"axis {k + 1}")]
    return filled(cells, (len(answer), 4))


def of_axes(answer: list[Tree]) -> Array:
    """The cells of a list of axes. Raises Unreadable."""
    if len(answer) > 3:
        raise Unreadable("wrong_shape", f"read {len(answer)} axes, expected 3")
    cells = [cell for k, axis in enumerate(answer) for cell in _cells(axis, f"axis {k + 1}")]
    return filled(cells, (len(answer), 3))


def of_tensor(answer: Tree) -> Array:
    """The cells of a symmetric tensor, as three rows or by the names of its components. Raises Unreadable."""
    if isinstance(answer, dict) and set(answer) == set(NAMES):
        xx, yy, zz, xy, xz, yz = (Cell(answer[name], name) for name in NAMES)
        return filled([xx, xy, xz, xy, yy, yz, xz, yz, zz], (3, 3))
    if not isinstance(answer, list) or len(answer) != 3:
        raise Unreadable("wrong_shape")
    return filled([cell for k, row in enumerate(answer) for cell in _cells(row, f"row {k + 1}")], (3, 3))


def _cells(numbers: Tree, place: str) -> list[Cell]:
    """The cells of a list of three."""
    if not isinstance(numbers, list):
        raise Unreadable("wrong_shape", f"read {shown(numbers)}, expected a list of numbers", place=place)
    if len(numbers) != 3:
        raise Unreadable("wrong_shape", f"read {len(numbers)} numbers, expected 3", place=place)
    return [Cell(number, f"{place} entry {k + 1}") for k, number in enumerate(numbers)]


def _zipped(moments: Tree, axes: Tree) -> Tree:
    if not isinstance(moments, list) or not isinstance(axes, list) or len(moments) != len(axes):
        raise Unreadable("wrong_shape", "expected a list of `moments`, and as many `axes`")
    return [{"moment": moment, "axis": axis} for moment, axis in zip(moments, axes, strict=True)]
