"""Inertia tensors and principal moments, and what the mistakes of people make of them.

Products of inertia have a minus sign, Ixy = -sum m x y, unless a question says `products: plus`.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import permutations
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from rigidcli.check.base import Asked, Finding, Outcome, Tree, Unreadable
from rigidcli.check.entries import Cell, Entry, Layout, Ruler, Same
from rigidcli.check.kinds.arrays import AXES, Arrays, Key, Matrix, Mistaken, Triples, compared, listed, rows
from rigidcli.core.arithmetic import Array
from rigidcli.core.tensor import point_tensor, rotate
from rigidcli.errors import ValueProblem, shown

if TYPE_CHECKING:
    from rigidcli.document.document import Document

COMPONENTS = ("Ixx", "Ixy", "Ixz", "Ixy", "Iyy", "Iyz", "Ixz", "Iyz", "Izz")
"""The components of a tensor, row by row; those with mirror images stand twice."""

EYE = np.eye(3, dtype=int)

OTHER_PRODUCTS = 2 * EYE - 1
"""These signs give the products of inertia of a tensor the other sign."""


class Tensor(Matrix):
    """An inertia tensor, 3 by 3 or by its six components; zeros are not counted."""

    name: ClassVar[str] = "tensor"
    options: ClassVar[frozenset[str]] = Arrays.options | {"products"}
    uncounted: ClassVar[tuple[int, ...]] = (0,)

    def layout(self, answer: Tree) -> Layout:
        """The cells of rows, or of a mapping from the names of components. Raises Unreadable."""
        return ((3, 3), _components(answer)) if isinstance(answer, dict) else rows(answer)

    def labels(self, entries: Array) -> tuple[str, ...]:
        """The names of the components. Raises ValueProblem."""
        if entries.shape != (3, 3):
            raise ValueProblem("this is not a tensor, which has 3 rows of 3")
        return COMPONENTS

    def key(self, asked: Asked) -> Key:
        """The key of a question for an inertia tensor. Raises ValueProblem."""
        key = super().key(asked)
        if _odd(key.ruler, key.right):
            raise ValueProblem("this tensor is not symmetric")
        signs = OTHER_PRODUCTS if asked.question.products == "plus" else OTHER_PRODUCTS**2
        usual = key.entries * signs if asked.report is None else np.asarray(asked.value)
        others = mistaken_tensors(asked, usual)
        mistaken = tuple((code, key.ruler.entries(each * signs)) for code, each in others)
        return replace(key, entries=key.ruler.entries(usual * signs), mistaken=mistaken)

    def said(self, key: Key, triples: Triples, wrong: Sequence[str], *, partly: bool) -> list[Finding]:
        """What is said of a wrong tensor: first, that it is not symmetric."""
        odd = _odd(key.ruler, [own for _, own, _ in triples])
        others = [name for name in wrong if name not in odd]
        first = [Finding("not_symmetric", listed(odd))] if odd else []
        return first + (super().said(key, triples, others, partly=partly) if others else [])

    def typed(self, key: Key) -> Tree:
        """The components by their names."""
        return {name: key.ruler.typed(each) for name, each in zip(key.labels, key.right, strict=True)}


def _odd(ruler: Ruler, entries: Sequence[Any]) -> list[str]:
    """The components of a tensor that differ from their mirror images."""
    pairs = ((1, 3), (2, 6), (5, 7))
    return [COMPONENTS[i] for i, j in pairs if ruler.differ(entries[i], entries[j])]


def _components(answer: dict[str, Tree]) -> list[Cell]:
    """The cells of a tensor from the names of components, which stand for their mirror images, too."""
    places = {f"{a}{b}": (i, j) for a, i in AXES.items() for b, j in AXES.items() if max(i, j) < 3}
    cells: dict[tuple[int, int], Cell] = {}
    for name, entry in answer.items():
        place = places.get(re.sub(r"[\s_{}]", "", name).lower()[1:])
        if place is None:
            expected = ", ".join(dict.fromkeys(COMPONENTS))
            raise Unreadable("wrong_shape", f"read {shown(name)}, expected {expected}")
        if place in cells:
            raise Unreadable("duplicate_key", f"read {shown(name)}")
        cells[place] = shown(name), entry
    whole = [cells.get((i, j)) or cells.get((j, i)) for i, j in np.ndindex(3, 3)]
    if missing := [name for name, cell in zip(COMPONENTS, whole, strict=True) if cell is None]:
        raise Unreadable("wrong_shape", f"{listed(missing)} missing")
    return [cell for cell in whole if cell is not None]


# --- moments


class Moments(Arrays):
    """Numbers in any order, or in ascending order: each stands as often as it occurs."""

    name: ClassVar[str] = "moments"
    options: ClassVar[frozenset[str]] = Arrays.options | {"order"}
    word: ClassVar[str] = "moment"

    def key(self, asked: Asked) -> Key:
        """The key of a question for moments, by their sizes. Raises ValueProblem."""
        key = super().key(asked)
        if key.ruler.formulas is not None:
            if asked.question.order == "ascending":
                raise ValueProblem("the order of moments with symbols depends on these", path=("order",))
            return replace(key, entries=key.entries[_ranks(key.ruler, key.right)])
        tensor = None if asked.report is None or asked.path[-1] != "moments" else asked.report.get("tensor")
        others = () if tensor is None else mistaken_tensors(asked, np.asarray(tensor, dtype=float))
        mistaken = tuple((code, np.linalg.eigvalsh(np.asarray(each, dtype=float))) for code, each in others)
        return replace(key, entries=np.sort(key.entries), mistaken=mistaken)

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
            detail = f"read {len(value)}, expected {count}"
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


# --- mistakes on the way to a tensor


def mistaken_tensors(asked: Asked, tensor: Array) -> Mistaken:
    """What mistakes make of the `tensor` that is asked; the formulas take floats, exact numbers and trees."""
    yield "products_of_inertia_sign", tensor * OTHER_PRODUCTS
    yield "products_of_inertia_missing", tensor * EYE
    orders = [list(order) for order in permutations(range(3))]
    for order in orders[1:]:
        yield "components_permuted", tensor[order, :][:, order]
    if tensor.dtype == float:
        moments = np.linalg.eigvalsh(tensor)
        yield from (("other_frame", np.diag(moments[order])) for order in orders)
    if asked.document is not None and asked.report is not None:
        tidy = asked.document.arithmetic.tidy
        yield from ((code, tidy(each)) for code, each in _of_document(asked, asked.document, tensor))


def _of_document(asked: Asked, document: Document, tensor: Array) -> Mistaken:
    """The tensor along the axes of the document or turned the wrong way, and Steiner's theorem misused."""
    if document.frame is not None:
        axes = document.physical.axes
        yield "other_frame", rotate(tensor, axes)
        yield "other_frame", rotate(tensor, axes @ axes)
    results = {} if asked.report is None else asked.report.tree()
    needed = [results.get(name) for name in ("mass", "center_of_mass", "about", "tensor", "tensor_com")]
    if all(each is not None for each in needed):
        mass, com, about, here, central = map(np.asarray, needed)
        term = mass * point_tensor(about - com)
        about_com = asked.path[-1:] == ("tensor_com",)
        yield "parallel_axis_missing", here if about_com else central
        yield "parallel_axis_sign", here + term if about_com else central - term
