"""Principal axes: moments lambda with their directions e, each judged by I e = lambda e.

The order of the pairs, the sign and length of an axis, and every turn among the axes to equal moments are
free, unless the question asks for more. Where `ask: axes.axes` is asked, axes alone are an answer, too.
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from itertools import pairwise
from pathlib import Path
from typing import ClassVar

import numpy as np

from rigidcli.algebra.reading import from_tree
from rigidcli.check.base import (
    Asked,
    Finding,
    Kind,
    Outcome,
    Reading,
    Tree,
    Unreadable,
    correct,
    earning,
    review,
)
from rigidcli.check.entries import (
    EXACT,
    Cell,
    Layout,
    Ruler,
    computed,
    literal,
    opened,
    read_cells,
    shown_as,
    typed_as,
)
from rigidcli.check.kinds.arrays import are_bare, factor, has_unit_length, row
from rigidcli.check.kinds.eigen import Eigen, Pairs, Solver, solved
from rigidcli.check.kinds.tensors import OTHER_PRODUCTS, TENSORS, Tensor, mistaken_tensors, whole
from rigidcli.check.question import Question
from rigidcli.core.arithmetic import Array
from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.units import parse_unit

SLACK = 1e-2
"""How far a key that is typed with few digits may miss the laws, in units of its largest entry."""

LARGEST_ANGLE = 0.5
"""The largest angle (rad) that a question may allow: more was hardly meant in radians."""

MOST_PAIRS = 6
"""The most pairs of an answer: three are right, and more are surplus."""

KG_M2 = parse_unit("kg m^2")

_LINES = re.compile(r"\s*(?:\n|;(?![^(\[]*[)\]]))\s*")
"""Between pairs that are typed as lines, or with semicolons outside of brackets."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The eigenproblem that axes must solve; `mistaken` has other tensors, with the codes of mistakes.

    `pairs` (3 by 4) are the right moments and axes. `alone` says that axes need no moments, `columns` that
    the axes of an answer stand in columns, by mistake.
    """

    question: Question
    path: tuple[str, ...]
    eigen: Eigen
    alone: bool
    pairs: Array
    mistaken: tuple[tuple[str, Array], ...] = ()
    columns: bool = False

    @property
    def ruler(self) -> Ruler:
        """By what moments are read and compared."""
        return self.eigen.ruler


class Axes(Kind):
    """Principal moments with their axes, or axes alone."""

    name: ClassVar[str] = "axes"
    options: ClassVar[frozenset[str]] = frozenset(
        {"order", "normalized", "orthogonal", "symbols", "unit", "products"}
    )

    def key(self, asked: Asked) -> Key:
        """The tensor whose axes are asked. Raises ValueProblem."""
        if (asked.question.tolerance.angle or 0.0) > LARGEST_ANGLE:
            raise ValueProblem(
                f"is in radians, expected at most {LARGEST_ANGLE}", path=("tolerance", "angle")
            )
        ruler, usual, pairs = _literal(asked) if asked.report is None else _reported(asked)
        if ruler.names is not None and asked.question.order == "ascending":
            raise ValueProblem("the order of moments with symbols depends on these", path=("order",))
        mistaken = tuple((code, ruler.entries(each)) for code, each in mistaken_tensors(asked, usual))
        alone = len(asked.path) > 1 and asked.path[-1] == "axes"
        eigen = solved(ruler, ruler.entries(usual))
        if pairs is None:
            pairs = np.column_stack([eigen.moments, eigen.axes])
        return Key(asked.question, asked.path, eigen, alone, pairs, mistaken)

    def read(self, key: Key, answer: Tree, folder: Path) -> Reading:
        """A list of pairs, or of axes. Raises Unreadable."""
        moments, axes = _cells(answer)
        if not key.alone and not moments:
            raise Unreadable("wrong_shape", "expected a moment with each axis: `[moment, [x, y, z]]`")
        direction = replace(key.ruler, unit=None)
        pairs = Pairs(read_cells(key.ruler, moments), tuple(read_cells(direction, axis) for axis in axes))
        names = [f"{each}: " for each in shown_as(pairs.moments)] or [""] * len(axes)
        texts = (f"{name}[{', '.join(shown_as(axis))}]" for name, axis in zip(names, pairs.axes, strict=True))
        return Reading(pairs, "; ".join(texts))

    def judge(self, key: Key, value: Pairs) -> Outcome:
        """The outcome of pairs, one by one; one counts half where only its moment or its axis is right."""
        count = len(value.axes)
        value = _in_rows(key, value)
        solver = Solver(key.eigen, value)
        worth, findings, opens = _by_pairs(key, value, solver)
        if count < 3:
            findings.insert(0, Finding("missing_axis"))
        if count == 3 and not findings:
            return review(opens[0]) if opens else _by_rules(key, value, solver)
        if count == 3 and {each.code for each in findings} == {"outside_tolerance"}:
            code = factor(key.ruler, key.path, key.ruler.numbers(value.moments), solver.expected())
            findings = findings if code is None else [Finding(code)]
        return earning((worth - max(0, count - 3)) / 3, *findings)

    def is_right(self, key: Key, value: Pairs) -> bool:
        """Whether the outcome is `correct`: most pairs are soon seen not to be."""
        solver = Solver(key.eigen, _in_rows(key, value))
        solves = len(value.axes) == 3 and all(solver.pair(k) is True for k in range(3))
        return solves and super().is_right(key, value)

    def typed(self, key: Key) -> Tree:
        """The moments and axes."""
        direction = replace(key.ruler, unit=None)
        moments = [typed_as(key.ruler, each) for each in key.pairs[:, 0].tolist()]
        axes = [[typed_as(direction, each) for each in axis] for axis in key.pairs[:, 1:].tolist()]
        pairs = zip(moments, axes, strict=True)
        return axes if key.alone else [{"moment": moment, "axis": axis} for moment, axis in pairs]

    def names(self, key: Key) -> frozenset[str]:
        """The symbols of the tensor."""
        return key.ruler.symbols(key.eigen.tensor.flat) if key.ruler.names is not None else frozenset()


def _in_rows(key: Key, pairs: Pairs) -> Pairs:
    """Pairs with axes that by mistake stand in columns."""
    is_turned = key.columns and len(pairs.axes) == 3
    return Pairs(pairs.moments, tuple(zip(*pairs.axes, strict=True))) if is_turned else pairs


def _by_pairs(key: Key, pairs: Pairs, solver: Solver) -> tuple[float, list[Finding], list[str]]:
    """How many pairs are right, what is said of the others, and why some are open."""
    worth, findings, opens = 0.0, list[Finding](), list[str]()
    seen, sound = list[int](), list[int]()
    for k in range(len(pairs.axes)):
        place = f"axis {k + 1}"
        together = solver.pair(k)
        axis = solver.axis(k) if together is False else together
        if axis is not False and not solver.independent([*seen, k]):
            findings.append(Finding("missing_axis", place))  # it stands twice, or is made up of others
            continue
        seen += [k] * (axis is not False)
        if isinstance(together, str):
            opens.append(together)
        elif together and key.question.orthogonal == "required" and not solver.orthogonal([*sound, k]):
            findings.append(Finding("axes_not_orthogonal", place))
            worth += 0.5 * bool(pairs.moments)
        elif together:
            sound.append(k)
            worth += 1
        else:
            moment = solver.moment(k)
            # Where every direction is an axis, one is worth nothing without its moment.
            worth += 0.5 * (moment or (axis is True and not solver.isotropic))
            if axis is not True:
                findings.append(Finding("not_an_eigenvector", place))
            elif moment:
                findings.append(Finding("moment_axis_pairing", f"pair {k + 1}"))
            if pairs.moments and not moment:
                findings.append(Finding("outside_tolerance", f"moment {k + 1}"))
    return worth, findings, opens


def _by_rules(key: Key, pairs: Pairs, solver: Solver) -> Outcome:
    """The outcome of three right pairs: whether they keep the rules of the question."""
    half = 0.5 * bool(pairs.moments)
    if key.question.unit == "required" and key.ruler.has_units and are_bare(pairs.moments):
        return earning(half, Finding("unit_missing"))
    moments = solver.expected()[:, 0] if key.question.order == "ascending" else ()
    if any(own < before - key.ruler.slack * abs(before) for before, own in pairwise(moments)):
        return earning(0.0, Finding("wrong_order"))
    for k, axis in enumerate(pairs.axes if key.question.normalized == "required" else ()):
        if not has_unit_length(key.ruler, axis):
            return earning(half, Finding("axis_not_normalised", f"axis {k + 1}"))
    return correct()


# --- reading


def _cells(answer: Tree) -> tuple[list[Cell], list[list[Cell]]]:
    """The cells of moments, none for axes alone, and of the components of axes. Raises Unreadable."""
    lines = _LINES.split(answer.strip()) if isinstance(answer, str) else []
    answer = lines if lines and all(":" in line for line in lines) else opened(answer)
    if isinstance(answer, dict) and set(answer) == {"moments", "axes"}:
        moments, axes = opened(answer["moments"]), opened(answer["axes"])
    else:
        if isinstance(answer, dict):
            answer = (
                [answer] if set(answer) == {"moment", "axis"} else [list(pair) for pair in answer.items()]
            )
        if not isinstance(answer, list):
            raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a list of `[moment, [x, y, z]]`")
        pairs = [_pair(each) for each in answer]
        moments = [moment for moment, _ in pairs if moment is not None]
        axes = [axis for _, axis in pairs]
    if not isinstance(moments, list) or not isinstance(axes, list) or len(moments) not in (0, len(axes)):
        raise Unreadable("wrong_shape", "expected as many moments as axes")
    if not 0 < len(axes) <= MOST_PAIRS:
        raise Unreadable("wrong_shape", f"expected at most {MOST_PAIRS} axes")
    named = [(f"moment {k}", moment) for k, moment in enumerate(moments, 1)]
    return named, [_components(axis, f"axis {k}") for k, axis in enumerate(axes, 1)]


def _pair(entry: Tree) -> tuple[Tree, Tree]:
    """The moment (None for an axis alone) and the axis in an entry of a list."""
    if isinstance(entry, dict) and set(entry) == {"moment", "axis"}:
        return entry["moment"], entry["axis"]
    if isinstance(entry, str) and ":" in entry:
        moment, axis = entry.split(":", 1)
        return moment, axis
    if isinstance(entry, list) and len(entry) in (2, 4):
        return entry[0], entry[1] if len(entry) == 2 else entry[1:]
    return None, entry


def _components(axis: Tree, place: str) -> list[Cell]:
    """The three cells of an axis."""
    shape, cells = row(opened(axis), place)
    if shape != (3,):
        raise Unreadable("wrong_shape", f"read {shown(axis)}, expected three components", place=place)
    return cells


# --- keys


def _reported(asked: Asked) -> tuple[Ruler, Array, Array | None]:
    """The ruler, the tensor of a report, and where there are symbols the pairs. Raises ValueProblem."""
    assert asked.report is not None
    tensor = asked.value if asked.path[-1] in TENSORS else asked.report.get("tensor")
    if tensor is None:
        raise ValueProblem("this document has no principal axes")
    ruler, _ = computed(replace(asked, unit="kg m^2"), tensor)
    if ruler.names is None:
        return ruler, np.asarray(tensor), None
    moments, axes = asked.report.get("moments"), asked.report.get("axes")
    if moments is None or axes is None or tensor is not asked.report["tensor"]:
        raise ValueProblem("the axes of this tensor cannot be written in its symbols")
    return ruler, np.asarray(tensor), ruler.entries(np.column_stack([moments, axes]))


def _literal(asked: Asked) -> tuple[Ruler, Array, Array | None]:
    """The same of a literal key: a tensor of numbers, or pairs. Raises ValueProblem."""
    value, pairs = asked.value, None
    if isinstance(value, dict) and set(value) == {"tensor"}:
        ruler, entries = literal(replace(asked, value=opened(value["tensor"])), Tensor().layout)
        if entries.shape != (3, 3):
            raise ValueProblem("expected a tensor of 3 rows of 3")
        tensor = whole(entries.ravel().tolist()).astype(float if ruler.names is None else object)
        if ruler.names is not None:
            raise ValueProblem("a tensor with symbols is no key", hint="write pairs: `[moment, [x, y, z]]`")
        tensor = tensor * OTHER_PRODUCTS if asked.question.products == "plus" else tensor
    else:
        ruler, pairs = literal(asked, _pair_cells)
        tensor = _tensor_of_pairs(ruler, pairs)
    if ruler.names is None:
        allowed = EXACT if pairs is None else SLACK
        if np.abs(tensor - tensor.T).max() > allowed * np.abs(tensor).max():
            raise ValueProblem("this tensor is not symmetric, or the axes are not at right angles")
        tensor, pairs = (tensor + tensor.T) / 2, None
    if ruler.unit is not None and ruler.unit.dimension != KG_M2.dimension:
        raise ValueProblem(f"read a unit of {ruler.unit.dimension}, expected one of a moment of inertia")
    return replace(ruler, unit=ruler.unit or KG_M2), tensor, pairs


def _pair_cells(answer: Tree) -> Layout:
    """The cells of three pairs, each a moment and an axis."""
    moments, axes = _cells(answer)
    if len(moments) != 3 or len(axes) != 3:
        raise Unreadable("wrong_shape", "expected three pairs of a moment and an axis, or `{tensor: [[..]]}`")
    return (3, 4), [cell for moment, axis in zip(moments, axes, strict=True) for cell in (moment, *axis)]


def _tensor_of_pairs(ruler: Ruler, pairs: Array) -> Array:
    """The tensor with three moments and axes (3 by 4). Raises ValueProblem."""
    moments, axes = pairs[:, 0], pairs[:, 1:]
    if ruler.names is not None:
        if ruler.vanish([axes[i] @ axes[j] for i, j in ((0, 1), (0, 2), (1, 2))]) is not True:
            raise ValueProblem("the axes are not at right angles")
        terms = (np.outer(e, e) * (moment / (e @ e)) for moment, e in zip(moments, axes, strict=True))
        return ruler.entries(np.vectorize(from_tree, otypes=[object])(sum(terms)))
    # I e = lambda e for three axes, which need be at right angles only where the moments differ.
    with np.errstate(all="ignore"):
        units = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    if not np.isfinite(units).all() or np.linalg.svd(units, compute_uv=False)[2] < SLACK:
        raise ValueProblem("the axes do not span the space")
    return np.linalg.solve(units, moments[:, None] * units)


# --- what mistakes make of a key


def worked_out(code: str) -> Callable[[Key], Iterator[Key]]:
    """What makes the keys whose tensor comes out under this mistake."""

    def changes(key: Key) -> Iterator[Key]:
        for name, tensor in key.mistaken:
            if name == code:
                yield replace(key, eigen=solved(key.ruler, tensor), mistaken=())

    return changes


def in_columns(key: Key) -> Iterator[Key]:
    """The key for which the axes of an answer stand in columns."""
    yield replace(key, columns=True, mistaken=())
