"""Inertia tensors and principal moments, and what the mistakes of people make of them.

Products of inertia have a minus sign, Ixy = -sum m x y, unless a question says `products: plus`.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import permutations
from typing import TYPE_CHECKING, Any, ClassVar, TypeAlias

import numpy as np

from rigidcli.check.base import Asked, Finding, Outcome, Tree, Unreadable, earning
from rigidcli.check.entries import Cell, Entry, Layout, Ruler, Same, filled, typed_as
from rigidcli.check.kinds.arrays import AXES, Arrays, Key, named, rows, settled
from rigidcli.core.arithmetic import Array
from rigidcli.core.tensor import point_tensor, rotate
from rigidcli.errors import ValueProblem, shown

if TYPE_CHECKING:
    from rigidcli.document.document import Document

SIX = {"Ixx": (0, 0), "Iyy": (1, 1), "Izz": (2, 2), "Ixy": (0, 1), "Ixz": (0, 2), "Iyz": (1, 2)}
"""The components of a tensor, by their usual names; the last three have mirror images."""

ROWS, COLUMNS = np.array(list(SIX.values())).T

TENSORS = ("tensor", "tensor_com")
"""The last names of the paths of inertia tensors."""

EYE = np.eye(3, dtype=int)

OTHER_PRODUCTS = 2 * EYE - 1
"""These signs give the products of inertia of a tensor the other sign."""

ALIKE = np.ones((3, 3), dtype=int)

NEEDED = ("mass", "center_of_mass", "about", "tensor", "tensor_com")
"""The results that the parallel-axis theorem needs."""

MIRRORED = ((1, 0), (2, 0), (2, 1))
"""The places of the mirror images."""

Mistaken: TypeAlias = Iterator[tuple[str, Array]]
"""Codes of mistakes, each with the tensor (3 by 3, kg m^2) that the mistake leads to."""


class Tensor(Arrays):
    """An inertia tensor, 3 by 3 or by its six components. An answer has these six, then the mirror images."""

    name: ClassVar[str] = "tensor"
    options: ClassVar[frozenset[str]] = Arrays.options | {"products"}

    def layout(self, answer: Tree) -> Layout:
        """The cells of rows, or of a mapping from the names of components. Raises Unreadable."""
        if isinstance(answer, dict):
            return (3, 3), _by_names(answer)
        shape, cells = rows(answer)
        if shape == (3, 3):
            cells = [cells[3 * i + j] for i, j in (*SIX.values(), *MIRRORED)]
        return shape, cells

    def key(self, asked: Asked) -> Key:
        """The key of a question for an inertia tensor; zeros are not counted. Raises ValueProblem."""
        key = super().key(asked)
        if key.entries.shape != (3, 3):
            raise ValueProblem("this is not a tensor, which has 3 rows of 3")
        signs = OTHER_PRODUCTS if asked.question.products == "plus" else ALIKE
        if asked.report is None:
            # A literal key was laid out as an answer.
            tensor = whole(key.right)
            if any(key.ruler.differ(tensor[i, j], tensor[j, i]) for i, j in MIRRORED):
                raise ValueProblem("this tensor is not symmetric")
            usual = tensor * signs if key.ruler.names is not None else tensor.astype(float) * signs
        else:
            usual = np.asarray(asked.value)
        six = key.ruler.entries((usual * signs)[ROWS, COLUMNS])
        mistaken = tuple(
            (code, key.ruler.entries((each * signs)[ROWS, COLUMNS]))
            for code, each in mistaken_tensors(asked, usual)
        )
        counted = tuple(not zero for zero in key.ruler.are_zero(list(six)))
        counted = counted if any(counted) else (True,) * 6
        return replace(key, entries=six, labels=tuple(SIX), counted=counted, mistaken=mistaken)

    def fits(self, key: Key, shape: tuple[int, ...]) -> bool:
        """Three rows of three."""
        return shape == (3, 3)

    def arranged(self, entries: list[Any], shape: tuple[int, ...]) -> list[Any]:
        """Components and mirror images in rows."""
        rows: list[Any] = whole(entries).tolist()
        return rows

    def compared(self, key: Key, entries: Sequence[Entry]) -> list[Same]:
        """Whether the components are right; of those that have mirror images, both must be."""
        found = [key.ruler.same(own, right) for own, right in zip(entries[:6], key.right, strict=True)]
        for k, own in enumerate(entries[6:], start=3):
            mirrored = key.ruler.same(own, key.right[k])
            found[k] = mirrored if found[k] is True or mirrored is False else found[k]
        return found

    def said(self, key: Key, entries: Sequence[Entry], wrong: list[int], *, partly: bool) -> list[Finding]:
        """What is said of a wrong tensor: first, that it is not symmetric."""
        odd = [k for k in (3, 4, 5) if key.ruler.differ(entries[k], entries[k + 3])]
        others = [k for k in wrong if k not in odd]
        first = [Finding("not_symmetric", named(key, odd))] if odd else []
        return first + (super().said(key, entries[:6], others, partly=partly) if others else [])

    def typed(self, key: Key) -> Tree:
        """The components by their names."""
        return {name: typed_as(key.ruler, entry) for name, entry in zip(SIX, key.right, strict=True)}


def _by_names(answer: dict[str, Tree]) -> list[Cell]:
    """The cells of a mapping from the names of components, which stand for their mirror images, too."""
    places = {f"{a}{b}": (i, j) for a, i in AXES.items() for b, j in AXES.items() if max(i, j) < 3}
    cells: dict[tuple[int, int], Cell] = {}
    for name, entry in answer.items():
        place = places.get(re.sub(r"[\s_{}]", "", name).lower()[1:])
        if place is None:
            raise Unreadable("wrong_shape", f"read {shown(name)}, expected {', '.join(SIX)}")
        if place in cells:
            raise Unreadable("duplicate_key", f"read {shown(name)}")
        cells[place] = shown(name), entry
    missing = [name for name, (i, j) in SIX.items() if not {(i, j), (j, i)} & cells.keys()]
    if missing:
        raise Unreadable("wrong_shape", f"{', '.join(missing)} missing")
    return [cells.get((i, j)) or cells[j, i] for i, j in (*SIX.values(), *MIRRORED)]


def whole(entries: Sequence[Any]) -> Array:
    """The tensor (3 by 3) of six components and their mirror images."""
    tensor = np.empty((3, 3), dtype=object)
    for place, entry in zip((*SIX.values(), *MIRRORED), entries, strict=True):
        tensor[place] = entry
    return tensor


# --- moments


class Moments(Arrays):
    """Numbers in any order, or in ascending order: each stands as often as it occurs."""

    name: ClassVar[str] = "moments"
    options: ClassVar[frozenset[str]] = Arrays.options | {"order"}
    word: ClassVar[str] = "moment"

    def key(self, asked: Asked) -> Key:
        """The key of a question for moments, by their sizes. Raises ValueProblem."""
        key = super().key(asked)
        if key.entries.ndim != 1 or not key.entries.size:
            raise ValueProblem("this is not a list of moments")
        if key.ruler.names is not None:
            if asked.question.order == "ascending":
                raise ValueProblem("the order of moments with symbols depends on these", path=("order",))
            return replace(key, entries=filled(_ranked(key.ruler, key.right), key.entries.shape))
        tensor = None if asked.report is None or asked.path[-1] != "moments" else asked.report.get("tensor")
        others = () if tensor is None else mistaken_tensors(asked, np.asarray(tensor, dtype=float))
        mistaken = tuple((code, np.linalg.eigvalsh(np.asarray(each, dtype=float))) for code, each in others)
        return replace(key, entries=np.sort(key.entries), mistaken=mistaken)

    def fits(self, key: Key, shape: tuple[int, ...]) -> bool:
        """Moments may be missing, or too many."""
        return len(shape) == 1 and shape[0] <= 2 * key.entries.size

    def judge(self, key: Key, value: Sequence[Entry]) -> Outcome:
        """The outcome of a list of moments: first without their order."""
        right, zero = key.right, key.ruler.are_zero(key.right)
        same = [[key.ruler.same(entry, each) for each in right] for entry in value]
        places = matched(same)
        wrong = [k for k, place in enumerate(places) if place is None]
        opens = [next((each for each in same[k] if isinstance(each, str)), False) for k in wrong]
        if len(value) == len(right) and False not in opens:
            in_order = key.question.order == "free" or False not in self.compared(key, value)
            return settled(key, value, opens) if in_order else earning(0.0, Finding("wrong_order"))
        count, surplus = len(value) - len(wrong), max(0, len(value) - len(right))
        if not all(zero) and all(place is None or zero[place] for place in places):
            count = 0  # where only zeros are right, nothing is
        return earning((count - surplus) / len(right), *self._said_of(key, value, wrong, count > 0))

    def _said_of(self, key: Key, entries: Sequence[Entry], wrong: list[int], partly: bool) -> list[Finding]:
        """What is said of wrong moments, those of the same rank beside each other."""
        count, asked = len(entries), len(key.right)
        if count != asked:
            return [Finding("wrong_shape", detail=f"read {count}, expected {asked}")]
        found = super().said(key, _ranked(key.ruler, entries), list(range(count)), partly=partly)
        return (
            [Finding("component_wrong", named(key, wrong))] if found[0].code == "component_wrong" else found
        )


def _ranked(ruler: Ruler, entries: Sequence[Any]) -> list[Any]:
    """Entries in the order of their sizes."""
    sizes = np.abs(ruler.numbers(entries)[:, 0])
    return [entries[place] for place in np.argsort(sizes, kind="stable")]


def matched(same: Sequence[Sequence[Same]]) -> list[int | None]:
    """The column of each row of a table of which entries are the same, each used once, for as many as can be.

    Rows find columns by augmenting paths (H. Kuhn, Naval Research Logistics Quarterly 2 (1955) 83).
    """
    rows = dict[int, int]()

    def found(row: int, seen: set[int]) -> bool:
        for column in (k for k, each in enumerate(same[row]) if each is True and k not in seen):
            seen.add(column)
            if column not in rows or found(rows[column], seen):
                rows[column] = row
                return True
        return False

    for row in range(len(same)):
        found(row, set())
    columns = {row: column for column, row in rows.items()}
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
    if all(results.get(name) is not None for name in NEEDED):
        mass, com, about, here, central = (np.asarray(results[name]) for name in NEEDED)
        term = mass * point_tensor(about - com)
        about_com = asked.path[-1:] == ("tensor_com",)
        yield "parallel_axis_missing", here if about_com else central
        yield "parallel_axis_sign", here + term if about_com else central - term
