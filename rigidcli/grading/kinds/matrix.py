"""Matrices of any shape, row by row."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rigidcli.core.arithmetic import Array, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, filled
from rigidcli.grading.arrays.keys import reference
from rigidcli.grading.arrays.mistakes import (
    Explanation,
    constant_factor,
    earned,
    flipped,
    forms,
    one_of,
    places_in,
    power_of_ten,
    times,
    told,
    too_few_digits,
    wrong_entries,
    wrong_forms,
)
from rigidcli.grading.arrays.reference import Reference, Typed
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.numbers import MOST_ENTRIES
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The entries of a matrix."""

    reference: Reference


def read_key(asked: Asked) -> Key:
    """The key of a question for a matrix. Raises ValueProblem."""
    found = reference(asked, rows)
    if len(found.shape) != 2 or 0 in found.shape:
        raise ValueProblem("this is not a list of rows of equal length")
    return Key(found)


def rows(answer: Tree) -> Array:
    """The cells of a list of rows, all of one length. Raises Unreadable."""
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
    cells = [Cell(entry, _place(i, j)) for i, row in enumerate(answer) for j, entry in enumerate(row)]
    return filled(cells, shape)


def _place(row: int, column: int) -> str:
    return f"row {row + 1}, column {column + 1}"


def _places(mask: Mask) -> str:
    return places_in(mask, _place)


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of rows. Raises Unreadable."""
    ours = key.reference
    typed = ours.read(answer, rows)
    shape = typed.values.shape[1:]
    if shape != ours.shape:
        if shape == ours.shape[::-1] and ours.same(typed.transposed(), ours.values):
            return wrong(Finding("transposed", reference=told(ours)))
        height, width = ours.shape
        detail = f"read {shape[0]} rows of {shape[1]}, expected {height} rows of {width}"
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
    right = ours.agree(answer, ours.values)
    yield too_few_digits(ours, answer, right, _places)
    signs = flipped(ours, answer, right)
    if signs.any():
        every = signs.sum() == ours.nonzero.sum() > 1
        yield Finding("sign_error", "" if every else _places(signs)), True


def examples(key: Key) -> Iterator[Example]:
    """The matrix in several forms, and with each mistake."""
    ours = key.reference
    yield from (Example(what, answer) for what, answer in forms(ours))
    for what, code, answer in wrong_forms(ours, _mistaken(ours)):
        typed = ours.read(answer, rows)
        if typed.values.shape[1:] != ours.shape:
            yield Example(what, answer, code)
        elif not ours.same(typed, ours.values):
            found = one_of(_causes(key, typed), _descriptions(key, typed))
            if found is not None and found.code == code:
                yield Example(what, answer, code)


def _mistaken(key: Reference) -> Iterator[tuple[str, str, Array]]:
    yield "rows and columns exchanged", "transposed", key.entries.T
    yield "a thousand times the matrix", "power_of_ten", times(key.entries, 1000)
    yield "three times the matrix", "constant_factor", times(key.entries, 3)
    signs = np.ones(key.shape)
    signs[tuple(np.argwhere(key.nonzero)[:1].T)] = -1
    yield "one entry with the wrong sign", "sign_error", times(key.entries, signs)
