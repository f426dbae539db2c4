"""Inertia tensors, entry by entry: 3 by 3, or by the names of the six components.

Products of inertia stand with a minus sign: Ixy = -sum m x y.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.arrays.entries import Cell, filled
from rigidcli.grading.arrays.keys import reference
from rigidcli.grading.arrays.mistakes import (
    Explanation,
    constant_factor,
    flipped,
    forms,
    listed,
    one_of,
    power_of_ten,
    times,
    told,
    too_few_digits,
    wrong_entries,
    wrong_forms,
)
from rigidcli.grading.arrays.reference import Reference, Typed, exactly
from rigidcli.grading.arrays.tensors import impossible, mistaken_tensors, moments_of
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.kinds.matrix import rows
from rigidcli.grading.numbers import are_near
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong

COMPONENTS = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
"""The six components, by their usual names."""

BELOW = np.tri(3, k=-1, dtype=bool)
"""Entries that mirror the components."""

UPPER = tuple(np.array(list(COMPONENTS.values())).T)

_NAMES = {f"i{a}{b}": (i, j) for i, a in enumerate("xyz") for j, b in enumerate("xyz")}
_NAMES |= {f"i{i + 1}{j + 1}": (i, j) for i in range(3) for j in range(3)}

PRODUCTS = ("products_of_inertia_sign", "products_of_inertia_missing")
"""Codes of the mistakes that need no body."""

COINCIDENCE = 10
"""Equal moments tell that axes differ where the square of the difference is above so many tolerances."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The entries of a tensor, and what it would be under named mistakes (codes, k by 3 by 3)."""

    reference: Reference
    causes: tuple[tuple[str, Floats], ...]


def read_key(asked: Asked) -> Key:
    """The key of a question for an inertia tensor. Raises ValueProblem."""
    found = reference(asked, components)
    if found.shape != (3, 3):
        raise ValueProblem("this is not a tensor, which has 3 rows of 3")
    if not found.same(exactly(found.values.swapaxes(1, 2)), found.values):
        raise ValueProblem("this tensor is not symmetric")
    causes = mistaken_tensors(asked, found.values, found)
    return Key(found, tuple((code, values) for code, values in causes if found.differs(values)))


# --- the form of an answer


def components(answer: Tree) -> Array:
    """The 3 by 3 cells of a list of rows, or of a mapping from names. Raises Unreadable."""
    if isinstance(answer, dict):
        return _by_names(answer)
    cells = rows(answer)
    if cells.shape != (3, 3):
        height, width = cells.shape
        raise Unreadable("wrong_shape", f"read {height} rows of {width}, expected 3 rows of 3")
    return cells


def _by_names(answer: dict[str, Tree]) -> Array:
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


# --- judging


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a tensor. Raises Unreadable."""
    ours = key.reference
    typed = ours.read(answer, components)
    right = ours.agree(typed, ours.values)
    if right.all():
        return correct()
    right &= right.T
    share = _share(ours, right)
    odd = _odd(ours, typed, right)
    if odd.any():
        finding = Finding("not_symmetric", _places(odd), reference=told(ours))
        return wrong(finding, *_remarks(ours, typed, right | odd, share), share=share)
    found = one_of(_causes(key, typed), _descriptions(ours, typed, right))
    if found is not None:
        return wrong(replace(found, reference=told(ours)), share=share)
    return wrong(*_remarks(ours, typed, right, share), share=share)


def _place(row: int, column: int) -> str:
    return f"I{'xyz'[row]}{'xyz'[column]}"


def _places(mask: Mask) -> str:
    return listed(name for name, place in COMPONENTS.items() if mask[place])


def _odd(key: Reference, answer: Typed, right: Mask) -> Mask:
    """Which wrong entries differ from those that they mirror."""
    same = key.agree(answer, answer.values.swapaxes(1, 2)) | np.isnan(answer.values).any(axis=0)
    odd: Mask = ~(same | same.T | right)
    return odd


def _share(key: Reference, right: Mask) -> float:
    """The share of right components among the six; nothing where only zeros are right."""
    mask = right[UPPER]
    return float(mask.mean()) if bool((mask & key.nonzero[UPPER]).any()) else 0.0


def _remarks(key: Reference, answer: Typed, right: Mask, share: float) -> tuple[Finding, ...]:
    """What is said where no mistake explains a tensor: that no body has it, and which entries are wrong."""
    if right.all():
        return ()
    entries = wrong_entries(key, answer, right | BELOW, _place, share)
    codes = {impossible(moments_of(answer.values[k]), key) for k in answer.rows}
    code = codes.pop() if len(codes) == 1 else None
    if code is None or entries[0].code == "number_for_symbol":
        return entries
    remark = Finding(code, reference=told(key))
    return (remark, *entries) if share else (remark,)


def _causes(key: Key, answer: Typed) -> Iterator[Explanation]:
    ours = key.reference
    yield from ((Finding(code), ours.same(answer, values)) for code, values in key.causes)
    yield Finding("power_of_ten"), power_of_ten(ours, answer)


def _descriptions(key: Reference, answer: Typed, right: Mask) -> Iterator[Explanation]:
    yield Finding("constant_factor"), constant_factor(key, answer)
    yield Finding("other_frame"), _is_turned(key, answer)
    yield too_few_digits(key, answer, right, _places)
    signs = flipped(key, answer, right)
    if signs.any():
        every = signs.sum() == key.nonzero.sum() > 1
        yield Finding("sign_error", "" if every else _places(signs)), True


@np.errstate(over="ignore", invalid="ignore")
def _is_turned(key: Reference, answer: Typed) -> bool:
    """Whether the tensor has the right moments, and is too far from the right one for this to be chance.

    A small wrong entry changes the moments by its square over their differences only.
    """
    for k in answer.rows:
        mine, own = answer.values[k], key.values[k]
        distance, largest = float(np.abs(mine - own).max()), float(np.abs(own).max())
        if not distance > math.sqrt(COINCIDENCE * key.slack) * largest:
            return False
        if not are_near(moments_of(mine), moments_of(own), key.tolerance).all():
            return False
    return True


# --- examples


def examples(key: Key) -> Iterator[Example]:
    """The tensor in several forms, and under each mistake."""
    ours = key.reference
    for what, answer in forms(ours):
        yield Example(what, answer)
        named = {name: answer[i][j] for name, (i, j) in COMPONENTS.items()}
        yield Example(f"{what}, by the names of the components", named)
    for what, code, answer in wrong_forms(ours, _mistaken(key)):
        typed = ours.read(answer, components)
        right = ours.agree(typed, ours.values)
        if right.all():
            continue
        if _odd(ours, typed, right & right.T).any():
            found: Finding | None = Finding("not_symmetric")
        else:
            found = one_of(_causes(key, typed), _descriptions(ours, typed, right))
        if found is not None and found.code == code:
            yield Example(what, answer, code)


def _mistaken(key: Key) -> Iterator[tuple[str, str, Array]]:
    entries, eye = key.reference.entries, np.eye(3)
    if not key.reference.names:
        for code, values in key.causes:
            yield code.replace("_", " "), code, values[0].astype(object)
    else:
        yield "the products of inertia with the wrong sign", PRODUCTS[0], times(entries, 2 * eye - 1)
        yield "the products of inertia missing", PRODUCTS[1], times(entries, eye)
    yield "a thousand times the tensor", "power_of_ten", times(entries, 1000)
    yield "three times the tensor", "constant_factor", times(entries, 3)
    yield "Ixx with the wrong sign", "sign_error", times(entries, 1 - 2 * np.outer(eye[0], eye[0]))
    odd = entries.copy()
    odd[0, 1] = 2 * float(np.abs(key.reference.values).max())
    yield "one product of inertia wrong on one side", "not_symmetric", odd
