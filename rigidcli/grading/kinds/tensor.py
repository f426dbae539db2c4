"""Inertia tensors, entry by entry: 3 by 3, or by the names of the six components.

Products of inertia stand with a minus sign, Ixy = -sum m x y, unless a question says `products: plus`.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import ClassVar

import numpy as np

from rigidcli.core.arithmetic import Array, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, filled
from rigidcli.grading.arrays.reference import Reference, Typed, exactly, listed
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.arrays import Findings, Matrix, rows
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.numbers import margins
from rigidcli.grading.outcome import Finding, Unreadable
from rigidcli.grading.tensors import convention, impossible, mistaken_tensors, moments_of

COMPONENTS = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
"""The six components, by their usual names."""

LABELS = np.array([["Ixx", "Ixy", "Ixz"], ["Ixy", "Iyy", "Iyz"], ["Ixz", "Iyz", "Izz"]], dtype=object)
"""The names of entries: those that mirror each other have one."""

UPPER = tuple(np.array(list(COMPONENTS.values())).T)

_NAMES = {f"i{a}{b}": (i, j) for i, a in enumerate("xyz") for j, b in enumerate("xyz")}
_NAMES |= {f"i{i + 1}{j + 1}": (i, j) for i in range(3) for j in range(3)}


class Tensor(Matrix):
    """An inertia tensor."""

    name: ClassVar[str] = "tensor"

    def layout(self, answer: Tree) -> Array:
        """The 3 by 3 cells of a list of rows, or of a mapping from names. Raises Unreadable."""
        cells = _by_names(answer) if isinstance(answer, dict) else rows(answer)
        if cells.shape != (3, 3):
            height, width = cells.shape
            raise Unreadable("wrong_shape", f"read {height} rows of {width}, expected 3 rows of 3")
        return cells

    def read_key(self, asked: Asked) -> Reference:
        """The key of a question for an inertia tensor. Raises ValueProblem."""
        found = super().read_key(asked)
        if found.shape != (3, 3):
            raise ValueProblem("this is not a tensor, which has 3 rows of 3")
        if not found.holds(exactly(found.values.swapaxes(1, 2))):
            raise ValueProblem("this tensor is not symmetric")
        signs = convention(found)
        causes = mistaken_tensors(asked, found.values * signs, found)
        return replace(found, labels=LABELS, mistaken=tuple((code, each * signs) for code, each in causes))

    def right(self, facing: Reference, answer: Typed) -> Mask:
        """Which entries are right, both of those that mirror each other."""
        right = super().right(facing, answer)
        return right & right.T

    def share(self, facing: Reference, right: Mask) -> float:
        """The share of right components among the six; nothing where only zeros are right."""
        return float(right[UPPER].mean()) if bool((right & facing.nonzero).any()) else 0.0

    def findings(self, key: Reference, answer: Typed, facing: Reference, share: float) -> Findings:
        """What is said of a wrong tensor: that it is not symmetric, why it is wrong, or where."""
        odd = ~(_is_mirrored(key, answer) | self.right(key, answer))
        if odd.any():
            return (Finding("not_symmetric", listed(odd, LABELS)), *self._remarks(answer, key, share, odd))
        return self.explained(key, answer) or self._remarks(answer, key, share, odd)

    def _remarks(self, answer: Typed, key: Reference, share: float, known: Mask) -> Findings:
        """What is said where no mistake explains it: that no body has it, and which entries are wrong."""
        if (self.right(key, answer) | known).all():
            return ()
        entries = self.wrong_entries(answer, key, share, known)
        codes = {impossible(moments_of(answer.values[k] * convention(key)), key) for k in answer.rows}
        code = codes.pop() if len(codes) == 1 else None
        if code is None or entries[0].code == "number_for_symbol":
            return entries
        return (Finding(code), *entries) if share else (Finding(code),)

    def right_forms(self, key: Reference) -> Iterator[tuple[str, Tree]]:
        """The tensor in several forms, each also by the names of its components."""
        for what, form in super().right_forms(key):
            yield what, form
            if isinstance(form, list):
                named = {name: form[i][j] for name, (i, j) in COMPONENTS.items()}
                yield f"{what}, by the names of its components", named

    def wrong_forms(self, key: Reference) -> Iterator[Example]:
        """The tensor to few digits, without its unit, and with one product that is wrong on one side."""
        yield from super().wrong_forms(key)
        odd = key.entries.copy()
        odd[0, 1] = 2 * float(np.abs(key.values).max())
        yield from self.example(key, "one product of inertia wrong on one side", odd, "not_symmetric")


def _is_mirrored(key: Reference, answer: Typed) -> Mask:
    """Which entries are the same as those that they mirror."""
    mirrored = answer.values.swapaxes(1, 2)
    with np.errstate(all="ignore"):
        near = np.abs(answer.values - mirrored) <= margins(mirrored, key.tolerance)
    same = np.asarray((near | ~answer.counts).all(axis=0) | np.isnan(answer.values).any(axis=0))
    return same | same.T


def _by_names(answer: dict[str, Tree]) -> Array:
    """The cells of a mapping from the names of components, of which mirrored ones stand for each other."""
    cells = np.full((3, 3), None, dtype=object)
    for name, entry in answer.items():
        place = _NAMES.get(name.replace("_", "").strip().lower())
        if place is None:
            raise Unreadable("wrong_shape", f"read {shown(name)}, expected {', '.join(COMPONENTS)}")
        if cells[place] is not None:
            raise Unreadable("duplicate_key", f"read {shown(name)}")
        cells[place] = Cell(entry, shown(name))
    missing = [name for name, (i, j) in COMPONENTS.items() if cells[i, j] is None and cells[j, i] is None]
    if missing:
        raise Unreadable("wrong_shape", f"{', '.join(missing)} missing")
    mirrored = zip(cells.flat, cells.T.flat, strict=True)
    return filled([other if cell is None else cell for cell, other in mirrored], (3, 3))
