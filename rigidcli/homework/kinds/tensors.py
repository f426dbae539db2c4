"""Inertia tensors and principal moments.

Products of inertia have a minus sign, Ixy = -sum m x y, unless a question says `products: plus`.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, ClassVar

import numpy as np

from rigidcli.core.arithmetic import Array
from rigidcli.errors import ValueProblem
from rigidcli.homework.base import Asked, Finding, Outcome, Tree, Unreadable
from rigidcli.homework.entries import Entry, Ruler, Same, filled
from rigidcli.homework.kinds.arrays import (
    Key,
    List,
    Matrix,
    Triples,
    by_places,
    compared,
    counted,
    listed,
    rows,
)
from rigidcli.homework.lists import read_list
from rigidcli.homework.mistakes import OTHER_PRODUCTS, Arrays, of_tensor

COMPONENTS = ("Ixx", "Ixy", "Ixz", "Ixy", "Iyy", "Iyz", "Ixz", "Iyz", "Izz")
"""The components of a tensor, row by row; those with mirror images stand twice."""


class Tensor(Matrix):
    """An inertia tensor, 3 by 3 or by its six components; zeros are not counted."""

    name: ClassVar[str] = "tensor"
    options: ClassVar[frozenset[str]] = List.options | {"products"}
    uncounted: ClassVar[tuple[int, ...]] = (0,)

    def table(self, answer: Tree) -> Array:
        """What was typed for each component, in rows or by names. Raises Unreadable."""
        entries = read_list(answer, is_square=True)
        return _components(entries) if isinstance(entries, dict) else rows(entries)

    def labels(self, shape: tuple[int, ...]) -> tuple[str, ...]:
        """The names of the components. Raises ValueProblem."""
        if shape != (3, 3):
            raise ValueProblem("this is not a tensor, which has 3 rows of 3")
        return COMPONENTS

    def key(self, asked: Asked) -> Key:
        """The key of a question for an inertia tensor. Raises ValueProblem."""
        key = super().key(asked)
        if asked.report is not None:
            key = replace(key, entries=key.ruler.entries(np.asarray(asked.value) * products(asked)))
        if _odd(key.ruler, key.right):
            raise ValueProblem("this tensor is not symmetric")
        return key

    def mistakes(self, asked: Asked, key: Key) -> Arrays:
        """The tensors that come out under a mistake, with the products of inertia that the question has."""
        signs = products(asked)
        usual = key.entries * signs if asked.report is None else np.asarray(asked.value)
        yield from ((code, tensor * signs) for code, tensor in of_tensor(asked, usual))
        yield from super().mistakes(asked, key)

    def said(self, key: Key, triples: Triples, wrong: Sequence[str], *, partly: bool) -> list[Finding]:
        """What is said of a wrong tensor: first, that it is not symmetric."""
        odd = _odd(key.ruler, [own for _, own, _ in triples])
        others = [name for name in wrong if name not in odd]
        first = [Finding("not_symmetric", listed(odd))] if odd else []
        return first + (super().said(key, triples, others, partly=partly) if others else [])

    def typed(self, key: Key) -> Tree:
        """The components by their names."""
        return {name: key.ruler.typed(each) for name, each in zip(key.labels, key.right, strict=True)}


def products(asked: Asked) -> Array:
    """The signs (3 by 3) that products of inertia have in a question, beside the usual ones."""
    return OTHER_PRODUCTS if asked.question.products == "plus" else OTHER_PRODUCTS**2


def _odd(ruler: Ruler, entries: Sequence[Any]) -> list[str]:
    """The components of a tensor that differ from their mirror images."""
    pairs = ((1, 3), (2, 6), (5, 7))
    return [COMPONENTS[i] for i, j in pairs if ruler.differ(entries[i], entries[j])]


def _components(answer: dict[str, Tree]) -> Array:
    """What was typed for components by their names, which stand for their mirror images, too."""
    given, places = by_places(answer, 2, 3, ", ".join(dict.fromkeys(COMPONENTS))), list(np.ndindex(3, 3))
    given = {(j, i): entry for (i, j), entry in given.items()} | given
    if missing := [name for name, place in zip(COMPONENTS, places, strict=True) if place not in given]:
        raise Unreadable("wrong_shape", f"{listed(missing)} missing")
    return filled([given[place] for place in places], (3, 3))


# --- moments


class Moments(List):
    """Numbers in any order, or in ascending order: each stands as often as it occurs."""

    name: ClassVar[str] = "moments"
    options: ClassVar[frozenset[str]] = List.options | {"order"}
    word: ClassVar[str] = "moment"

    def key(self, asked: Asked) -> Key:
        """The key of a question for moments, by their sizes. Raises ValueProblem."""
        key = super().key(asked)
        if key.ruler.formulas is not None:
            if asked.question.order == "ascending":
                raise ValueProblem("the order of moments with symbols depends on these", path=("order",))
            return replace(key, entries=key.entries[_ranks(key.ruler, key.right)])
        return replace(key, entries=np.sort(key.entries))

    def mistakes(self, asked: Asked, key: Key) -> Arrays:
        """The moments of the tensors that come out under a mistake."""
        is_report = asked.report is not None and asked.path[-1] == "moments"
        tensor = asked.report.get("tensor") if asked.report is not None and is_report else None
        if tensor is not None and key.ruler.formulas is None:
            others = of_tensor(asked, np.asarray(tensor, dtype=float))
            yield from ((code, np.linalg.eigvalsh(np.asarray(each, dtype=float))) for code, each in others)

    def fits(self, key: Key, shape: tuple[int, ...]) -> bool:
        """Moments may be missing, or too many."""
        return len(shape) == 1 and shape[0] <= 2 * key.entries.size

    def judge(self, key: Key, value: Sequence[Entry]) -> Outcome:
        """The outcome of a list of moments, put into the order of the key: what is left over by its size."""
        count = len(key.right)
        partners = matched([[key.ruler.same(entry, right) for right in key.right] for entry in value])
        own = {place: k for k, place in enumerate(partners) if place is not None}
        if len(value) != count:
            zero = {place for place, right in enumerate(key.right) if key.ruler.has_value(right, 0)}
            # Where only zeros are right, nothing is.
            share = 0 if own.keys() <= zero and len(zero) < count else len(own)
            detail = f"read {counted((len(value),))}, expected {count}"
            surplus = max(0, len(value) - count)
            return Outcome.earning((share - surplus) / count, Finding("wrong_shape", detail=detail))
        rest = (k for k in _ranks(key.ruler, value) if partners[k] is None)
        order = [own[place] if place in own else next(rest) for place in range(count)]
        labels = tuple(f"moment {k + 1}" for k in order)
        free = replace(key, labels=labels, counted=frozenset(labels))
        outcome = super().judge(free, [value[k] for k in order])
        standing = [same is not False for same in compared(key, value).values()]
        if key.question.order == "free" or all(standing) or outcome.share < 1:
            return outcome
        return Outcome.earning(sum(standing) / count, Finding("wrong_order"))


def _ranks(ruler: Ruler, entries: Sequence[Any]) -> list[int]:
    """The places of entries in the order of their sizes."""
    ranks: list[int] = np.argsort(np.abs(ruler.numbers(entries)[:, 0]), kind="stable").tolist()
    return ranks


def matched(same: Sequence[Sequence[Same]]) -> list[int | None]:
    """The column of each row of a table of which entries are the same, each column used once.

    A column takes the row whose choices end first, which finds as many as can be where the choices of every
    row are neighbours (F. Glover, Naval Research Logistics Quarterly 14 (1967) 313).
    """
    ends = [max((k for k, each in enumerate(row) if each is True), default=0) for row in same]
    columns: dict[int, int] = {}
    for column, entries in enumerate(zip(*same, strict=True)):
        free = [row for row, each in enumerate(entries) if each is True and row not in columns]
        if free:
            columns[min(free, key=ends.__getitem__)] = column
    return [columns.get(row) for row in range(len(same))]
