"""The cells of pairs, axes and tensors, in keys and answers: numbers, or expressions in symbols."""

from __future__ import annotations

import numpy as np

from rigidcli.core.arithmetic import Array
from rigidcli.errors import shown
from rigidcli.grading.arrays.entries import Cell, filled, read_entry
from rigidcli.grading.asked import Tree
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.principal.eigen import Answer
from rigidcli.grading.principal.key import Key

MOST = 6
"""Pairs of an answer; there are three, but an equal moment may be told too often."""

NAMES = ("Ixx", "Iyy", "Izz", "Ixy", "Ixz", "Iyz")
"""The components of a symmetric tensor."""


def read(key: Key, answer: Tree) -> Answer:
    """An answer, worked out at each point. Raises Unreadable."""
    cells = pair_cells(answer, alone=key.alone)
    entries, bare = [], list[int]()
    for (row, column), cell in np.ndenumerate(cells):
        is_moment = cells.shape[1] == 4 and column == 0
        found = read_entry(cell, key.unit if is_moment else None, key.reference.names)
        bare += [row] if is_moment and found.bare and key.question.unit == "required" else []
        entries.append(found.entry)
    return key.typed(filled(entries, cells.shape), tuple(bare))


def pair_cells(answer: Tree, *, alone: bool = False) -> Array:
    """The cells of pairs (n by 4): a list of `{moment, axis}`, or `{moments, axes}`. Raises Unreadable.

    Axes may stand `alone` (n by 3), each a list or `{x, y, z}`.
    """
    moments, axes = None, answer
    if isinstance(answer, dict) and set(answer) == {"moments", "axes"}:
        moments, axes = answer["moments"], answer["axes"]
    elif isinstance(answer, list) and not (alone and any(map(_is_axis, answer))):
        for k, pair in enumerate(answer, 1):
            if not isinstance(pair, dict) or set(pair) != {"moment", "axis"}:
                detail = f"read {shown(pair)}, expected a mapping with `moment` and `axis`"
                raise Unreadable("wrong_shape", detail, place=f"pair {k}")
        moments, axes = ([pair[name] for pair in answer] for name in ("moment", "axis"))
    told = axes if alone and moments is None else moments
    if not isinstance(axes, list) or not isinstance(told, list) or len(axes) != len(told):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of `{{moment, axis}}`")
    if len(axes) > (3 if moments is None else MOST):
        raise Unreadable("wrong_shape", f"read {len(axes)} axes, expected 3")
    cells = [_three_cells(axis, f"axis {k}") for k, axis in enumerate(axes, 1)]
    if moments is not None:
        cells = [[Cell(told[k], f"moment {k + 1}"), *axis] for k, axis in enumerate(cells)]
    return filled([cell for row in cells for cell in row], (len(axes), 3 if moments is None else 4))


def _is_axis(answer: Tree) -> bool:
    """Whether this may be an axis without a moment."""
    return isinstance(answer, list) or (isinstance(answer, dict) and not {"moment", "axis"} & set(answer))


def tensor_cells(answer: Tree) -> Array:
    """The cells of a symmetric tensor, as three rows or by the names of its components. Raises Unreadable."""
    if isinstance(answer, dict) and set(answer) == set(NAMES):
        xx, yy, zz, xy, xz, yz = (Cell(answer[name], name) for name in NAMES)
        return filled([xx, xy, xz, xy, yy, yz, xz, yz, zz], (3, 3))
    if not isinstance(answer, list) or len(answer) != 3:
        raise Unreadable("wrong_shape")
    return filled([cell for k, row in enumerate(answer, 1) for cell in _three_cells(row, f"row {k}")], (3, 3))


def _three_cells(numbers: Tree, place: str) -> list[Cell]:
    """The cells of a list of three, or of a mapping from x, y and z. Raises Unreadable."""
    if isinstance(numbers, dict):
        by_name = {name.strip().lower(): number for name, number in numbers.items()}
        named = len(numbers) == 3 and by_name.keys() == set("xyz")
        numbers = [by_name[name] for name in "xyz"] if named else numbers
    if not isinstance(numbers, list) or len(numbers) != 3:
        detail = f"read {shown(numbers)}, expected a list of three numbers, or `{{x, y, z}}`"
        raise Unreadable("wrong_shape", detail, place=place)
    return [Cell(number, f"{place} entry {k}") for k, number in enumerate(numbers, 1)]
