"""Matrices of any shape, row by row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rigidcli.core.arithmetic import Array
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Reference, Typed, filled, read_entry, reference
from rigidcli.grading.arrays.mistakes import (
    Explanation,
    as_typed,
    constant_factor,
    earned,
    flipped,
    forms,
    listed,
    one_of,
    power_of_ten,
    times,
    told,
    wrong_entries,
)
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds import Example
from rigidcli.grading.numbers import MOST_ENTRIES
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.model.units import Unit


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The entries of a matrix."""

    reference: Reference


def read_key(asked: Asked) -> Key:
    """The key of a question for a matrix. Raises ValueProblem."""
    found = reference(asked, read_rows)
    if len(found.shape) != 2 or 0 in found.shape:
        raise ValueProblem("this is not a list of rows of equal length")
    return Key(found)


def read_rows(answer: Tree, unit: Unit | None, names: frozenset[str]) -> Array:
    """The entries of a list of rows, all of one length. Raises Unreadable."""
    expected = "expected a list of rows, each a list of numbers"
    if not isinstance(answer, list) or not answer or len(answer) > MOST_ENTRIES:
        raise Unreadable("wrong_shape", f"read {shown(answer)}, {expected}")
    for k, row in enumerate(answer):
        if not isinstance(row, list):
            raise Unreadable("wrong_shape", f"read {shown(row)}, {expected}", place=f"row {k + 1}")
        if len(row) != len(answer[0]):
            detail = f"read {len(row)} numbers, but {len(answer[0])} in the first row"
            raise Unreadable("wrong_shape", detail, place=f"row {k + 1}")
    shape = len(answer), len(answer[0])
    if shape[0] * shape[1] > MOST_ENTRIES:
        raise Unreadable("too_large", f"{shape[0] * shape[1]} numbers")
    entries = [
        read_entry(entry, unit, names, _place(i, j))
        for i, row in enumerate(answer)
        for j, entry in enumerate(row)
    ]
    return filled(entries, shape)


def _place(row: int, column: int) -> str:
    return f"row {row + 1}, column {column + 1}"


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of rows. Raises Unreadable."""
    ours = key.reference
    typed = ours.read(answer, read_rows)
    shape = typed.values.shape[1:]
    if shape != ours.shape:
        if shape == ours.shape[::-1] and ours.same(typed.transposed(), ours.values):
            return wrong(Finding("transposed", reference=told(ours)))
        rows, columns = ours.shape
        detail = f"read {shape[0]} rows of {shape[1]}, expected {rows} rows of {columns}"
        raise Unreadable("wrong_shape", detail)
    right = ours.agree(typed, ours.values)
    if right.all():
        return correct()
    share = earned(ours, right)
    found = one_of(_causes(key, typed), _descriptions(key, typed))
    if found is not None:
        return wrong(replace(found, reference=told(ours)), share=share)
    return wrong(*wrong_entries(ours, typed, right, _place, share), share=share)


def _causes(key: Key, answer: Typed) -> Iterator[Explanation]:
    ours = key.reference
    if ours.shape[0] == ours.shape[1]:
        yield Finding("transposed"), ours.same(answer.transposed(), ours.values)
    yield Finding("power_of_ten"), power_of_ten(ours, answer)


def _descriptions(key: Key, answer: Typed) -> Iterator[Explanation]:
    ours = key.reference
    yield Finding("constant_factor"), constant_factor(ours, answer)
    signs = flipped(ours, answer, ours.agree(answer, ours.values))
    if signs.any():
        every = signs.sum() == ours.nonzero.sum() > 1
        places = "" if every else listed(_place(*place) for place in np.argwhere(signs).tolist())
        yield Finding("sign_error", places), True


def examples(key: Key) -> Iterator[Example]:
    """The matrix in several forms, and with each mistake."""
    ours = key.reference
    yield from (Example(what, answer) for what, answer in forms(ours))
    for what, code, mistaken in _mistaken(ours):
        typed = ours.typed(mistaken)
        if mistaken.shape != ours.shape:
            yield Example(what, as_typed(mistaken), code)
        elif not ours.same(typed, ours.values):
            found = one_of(_causes(key, typed), _descriptions(key, typed))
            if found is not None and found.code == code:
                yield Example(what, as_typed(mistaken), code)


def _mistaken(key: Reference) -> Iterator[tuple[str, str, Array]]:
    yield "rows and columns exchanged", "transposed", key.entries.T
    yield "a thousand times the matrix", "power_of_ten", times(key.entries, 1000)
    yield "three times the matrix", "constant_factor", times(key.entries, 3)
    signs = np.ones(key.shape)
    signs[tuple(np.argwhere(key.nonzero)[:1].T)] = -1
    yield "one entry with the wrong sign", "sign_error", times(key.entries, signs)
