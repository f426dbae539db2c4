"""Principal axes: moments lambda with their directions e, each judged by I e = lambda e.

The order of the pairs, the sign and length of an axis, and every turn among the axes to equal moments are
free, unless the question asks for more. Where `ask: axes.axes` is asked, axes alone are an answer, too.
With symbols the problem is solved at a point, where they have values: what is wrong there is wrong. What is
right there, within the tolerance, is asked again in symbols.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from rigidcli.algebra.substitution import from_tree
from rigidcli.core.arithmetic import Array, Floats, Mask
from rigidcli.errors import ExpressionError, ValueProblem, shown
from rigidcli.fields.units import parse_unit
from rigidcli.homework import entries
from rigidcli.homework.base import AnswerKind, Finding, KeySource, Outcome, ReadAnswer, Tree, Unreadable
from rigidcli.homework.entries import NOISE_OF_ENTRIES, Entry, Ruler, Same, shown_as
from rigidcli.homework.kinds import arrays
from rigidcli.homework.lists import MOST_BRACKETS, in_brackets, read_list, split
from rigidcli.homework.mistakes import of_tensor, shared_factor
from rigidcli.homework.numbers import ROUNDING, SLIP, TypedNumber
from rigidcli.homework.question import RELATIVE, Question
from rigidcli.homework.same import all_same
from rigidcli.language import tree
from rigidcli.language.latex import HAT
from rigidcli.language.tokens import rewritten, rules
from rigidcli.language.typed import closings_of, cut, without_labels

MOST_PAIRS = 6  # the most pairs of an answer: three are right, and more are surplus
# Moments that differ by less, in units of the largest, are equal: three figures do not tell their axes.
EQUAL_MOMENTS = 1e-3
KG_M2 = parse_unit("kg m^2")
_SEPARATOR = re.compile(r"[,;|\n]")
_DIVIDED = re.compile(r"\s*/\s*(?:sqrt\s*)?\(?\d+\)?")
# A sign that an axis has and a number has not.
_AXIS = re.compile("[\\s,;(\\[{\\\\]|[\u0302\u20d7\u0177\u1e91]|(?<![^\\W\\d])[ijk](?![^\\W\\d])")
# What stands between axes, besides the moments.
_NO_MOMENT = re.compile(
    r"(?i)\b(?:with|along|about|around|for|and|the|direction|principal|mit|um|und|entlang|avec|axe|con|eje"
    r"|[^\W\d]*(?:ax[ie]s|achsen?|vectors?|vektor|values?|wert|moments?|momente))\b|[-=]>"
)
# The last name that is given something, of a moment or of an axis.
_NAME = re.compile(r"(?:\b[^\W\d]\w*\s*=(?=(?:[^=:,;]*:)?[^=:]*\Z)|[,;]\s*[^\W\d]\w*\s*:(?=[^=:]*\Z))")
_NAMES = re.compile(rf"{_NO_MOMENT.pattern}|\b[^\W\d]\w*\s*[=:]")
# Pairs without brackets, with a colon in each: `10 along the x axis`, `I1 = 10, e1 = x`.
_WITH_COLONS = rules(
    (r"(?i)(?<=\b[xyz])[ -](?:axis|achse)\b", ""),
    (r"(?i)\s(?:with|along|about|around|mit|um|entlang|avec|con)(?:\s(?:the|axis|achse|axe|eje))*\s", ": "),
    (r"=([^=:,;\n]*),\s*[^\W\d]\w*\s*=", r"=\1:"),
)


class Pairs(NamedTuple):
    """The moments (n, or none at all) and the axes (n by 3) of an answer, as they were read."""

    moments: tuple[Entry, ...]
    axes: Sequence[Sequence[Entry]]


@dataclass(frozen=True, slots=True, eq=False)
class AxesKey:
    """The `tensor` (3 by 3, floats in kg m^2 or trees) whose axes an answer must have; `usual` is as asked.

    It has `moments` (3, ascending), `axes` (rows), and a table of which moments are `equal` (3 by 3); `typed`
    (3 by 4) are moments and axes as a student would write them. `alone`: moments are not asked. `columns`:
    this is the key of the mistake that axes are written as columns.
    """

    question: Question
    path: tuple[str, ...]
    ruler: Ruler
    tensor: Array
    moments: Floats
    axes: Floats
    equal: Mask
    usual: Array
    typed: Array
    alone: bool
    columns: bool = False


class AxesKind(AnswerKind):
    """Principal moments with their axes, or axes alone."""

    name = "axes"
    options = frozenset({"order", "normalized", "orthogonal", "symbols", "unit", "products"})

    def key(self, source: KeySource) -> AxesKey:
        if (source.question.tolerance.angle or 0.0) > 0.5:
            raise ValueProblem("is in radians, expected at most 0.5", path=("tolerance", "angle"))
        ruler, usual, pairs = _literal(source) if source.report is None else _reported(source)
        if ruler.formulas is not None:
            arrays.require_no_order(source.question)
        alone = len(source.path) > 1 and source.path[-1] == "axes"
        solved = _solved(ruler, ruler.entries(usual))
        typed = np.column_stack([solved["moments"], solved["axes"]]) if pairs is None else pairs
        return AxesKey(source.question, source.path, **solved, usual=usual, typed=typed, alone=alone)

    def read(self, key: AxesKey, answer: Tree) -> ReadAnswer:
        table = _typed(answer)
        count, width = table.shape
        if not key.alone and width == 3:
            raise Unreadable("wrong_shape", "expected a moment with each axis: `[moment, [x, y, z]]`")
        moments = key.ruler.read(table[:, :-3].ravel(), arrays.numbered("moment", count * (width - 3)))
        direction = replace(key.ruler, unit=None)
        places = np.repeat(arrays.numbered("axis", count), 3).tolist()
        components = direction.read(table[:, -3:].ravel(), places)
        axes = entries.filled(components, (count, 3)).tolist()
        names = [f"{name}: " for name in shown_as(moments)] or [""] * count
        texts = [f"{name}[{', '.join(shown_as(axis))}]" for name, axis in zip(names, axes, strict=True)]
        doubt = SLIP if any(map(key.ruler.may_be_a_slip, moments)) else ""
        return ReadAnswer(Pairs(moments, axes), "; ".join(texts), doubt)

    def judge(self, key: AxesKey, value: Pairs) -> Outcome:
        """The outcome of pairs, one by one: a pair is right if both its moment and its axis are."""
        count, answer = len(value.axes), _Answer(key, value)
        truths = [answer.pair(k) for k in range(count)]
        worth, findings = answer.worth(truths)
        findings = [Finding("missing_axis")] * (count < 3) + findings
        if count == 3 and not findings:
            why = all_same(truths)
            return Outcome.review(why) if isinstance(why, str) else answer.by_rules()
        if count == 3 and {finding.code for finding in findings} == {"outside_tolerance"}:
            own, expected = key.ruler.numbers(value.moments), answer.expected()
            code = shared_factor(own, expected, key.ruler.unit, key.path, key.ruler.slack)
            findings = findings if code is None else [Finding(code)]
        return Outcome.earning((worth - max(0, count - 3)) / 3, *findings)

    def mistaken(self, source: KeySource, key: AxesKey) -> Iterator[tuple[str, AxesKey]]:
        """The keys whose tensor comes out under a mistake, and that for axes which stand in columns."""
        for code, tensor in of_tensor(source, key.usual):
            yield code, replace(key, **_solved(key.ruler, key.ruler.entries(tensor)))
        yield "transposed", replace(key, columns=True)

    def typed(self, key: AxesKey) -> Tree:
        direction = replace(key.ruler, unit=None)
        moments = list(map(key.ruler.typed, key.typed[:, 0].tolist()))
        axes = [list(map(direction.typed, axis)) for axis in key.typed[:, 1:].tolist()]
        return axes if key.alone else [{"moment": m, "axis": e} for m, e in zip(moments, axes, strict=True)]


class _Answer:
    """The pairs of an answer, held against the eigenvalues and eigenvectors of the key."""

    def __init__(self, key: AxesKey, pairs: Pairs) -> None:
        if key.columns and len(pairs.axes) == 3:
            pairs = Pairs(pairs.moments, tuple(zip(*pairs.axes, strict=True)))
        self.key, self.ruler, self.given = key, key.ruler, pairs
        self.units = np.array([self.ruler.numbers(axis)[:, 0] for axis in pairs.axes])
        self.units = np.nan_to_num(arrays.unit_vectors(self.units.T).T)
        # The angle between the axis and the eigenspace of each moment: its tangent is the length of the
        # component outside over that inside.
        squares = (self.units @ key.axes.T) ** 2
        inside, outside = np.sqrt(squares @ key.equal), np.sqrt(squares @ ~key.equal)
        self.near = np.where(inside > 0, np.arctan2(outside, inside), math.pi) <= self.ruler.angle
        moments: Sequence[Entry] = pairs.moments
        if self.ruler.formulas is not None:
            at_point = self.ruler.numbers(moments)[:, 0].tolist()
            moments = [TypedNumber(value, value, 1.0) for value in at_point]
        point = replace(self.ruler, formulas=None, noise=ROUNDING * self.ruler.largest)
        self.moments = [[point.same(own, each) for each in key.moments.tolist()] for own in moments]

    def vanish(self, k: int, residual: Callable[[Array, Array], Array]) -> Same:
        """Whether a residual of I e and e is zero in symbols; numbers have been compared already."""
        if self.ruler.formulas is None:
            return True
        tensor, axis = _droppable(self.key.tensor), _droppable(self.given.axes[k])
        return self.ruler.formulas.vanish(residual(tensor @ axis, axis))

    def axis(self, k: int) -> Same:
        """Whether e and I e are parallel."""
        return bool(self.near[k].any()) and self.vanish(k, np.cross)

    def pair(self, k: int) -> Same:
        """Whether I e = lambda e; without moments, whether e is an axis."""
        if not self.given.moments:
            return self.axis(k)
        both = [same for same, near in zip(self.moments[k], self.near[k], strict=True) if near]
        truth = True in both or next((same for same in both if same), False)
        if truth is not True:
            return truth
        return self.vanish(k, lambda turned, axis: turned - axis * self.given.moments[k])

    def independent(self, places: Sequence[int]) -> bool:
        """Whether axes are linearly independent, however wide the tolerance."""
        least = np.linalg.svd(self.units[list(places)], compute_uv=False)[-1]
        return len(places) <= 3 and bool(least > min(2 * self.ruler.angle, 0.02))

    def orthogonal(self, places: Sequence[int]) -> bool:
        """Whether the last of some axes is at right angles to the others."""
        *others, last = self.units[list(places)]
        return all(abs(float(last @ other)) <= math.sin(2 * self.ruler.angle) for other in others)

    def expected(self) -> Floats:
        """The moments about the axes, e.I.e/e.e (n by k), at all points."""
        axes = np.array([self.ruler.numbers(axis) for axis in self.given.axes])
        tensor = self.ruler.numbers(self.key.tensor.ravel().tolist()).reshape(3, 3, -1)
        with np.errstate(all="ignore"):
            above, below = np.einsum("kip,ijp,kjp->kp", axes, tensor, axes), (axes**2).sum(axis=1)
            return np.asarray(above / below)

    def worth(self, truths: Sequence[Same]) -> tuple[int, list[Finding]]:
        """How many pairs are right, by the truths of all, and what is said of the others."""
        worth, findings = 0, list[Finding]()
        seen, sound = list[int](), list[int]()
        ranks = np.argsort(self.ruler.numbers(self.given.moments)[:, 0]).tolist()
        partners, has_moments = arrays.matched(self.moments, ranks), bool(self.given.moments)
        for k, truth in enumerate(truths):
            place = f"axis {k + 1}"
            axis = self.axis(k) if truth is False else truth
            if axis is not False and not self.independent([*seen, k]):
                findings.append(Finding("missing_axis", place))  # it stands twice, or is made up of others
                continue
            seen += [k] * (axis is not False)
            is_free = self.key.question.orthogonal == "optional" or truth is not True
            if not is_free and not self.orthogonal([*sound, k]):
                findings.append(Finding("axes_not_orthogonal", place))
            elif truth is True:
                sound.append(k)
                worth += 1
            elif truth is False:
                moment = k in partners
                if axis is not True:
                    findings.append(Finding("not_an_eigenvector", place))
                elif moment:
                    findings.append(Finding("moment_axis_pairing", f"pair {k + 1}"))
                if has_moments and not moment:
                    findings.append(Finding("outside_tolerance", f"moment {k + 1}"))
        return worth, findings

    def by_rules(self) -> Outcome:
        """The outcome of three right pairs: whether they keep the rules of the question."""
        question = self.key.question
        if question.unit == "required" and self.ruler.has_units and arrays.are_bare(self.given.moments):
            return Outcome.earning(0.0, Finding("unit_missing"))
        moments = self.expected()[:, 0] if question.order == "ascending" else ()
        if any(own < before - self.ruler.slack * abs(before) for before, own in pairwise(moments)):
            return Outcome.earning(0.0, Finding("wrong_order"))
        if question.normalized == "required":
            places = [k for k in range(3) if not arrays.has_unit_length(self.ruler, self.given.axes[k])]
            if places:
                findings = [Finding("axis_not_normalised", f"axis {k + 1}") for k in places]
                return Outcome.earning(1 - len(places) / 3, *findings)
        return Outcome.correct()


# Trees, with zeros in a form that sums and products drop.
_droppable = np.vectorize(
    lambda each: tree.ZERO if isinstance(each, tree.Number) and each.value == 0 else each, otypes=[object]
)


# --- reading


def _typed(answer: Tree) -> Array:
    """What was typed, a row for each pair: its moment, unless axes stand alone, and three components.

    Raises Unreadable.
    """
    answer = _in_text(answer) if isinstance(answer, str) else read_list(answer)
    if isinstance(answer, list) and list(map(_depth, answer)) == [1, 2]:
        answer = {"moments": answer[0], "axes": answer[1]}  # as Mathematica gives an eigensystem
    if isinstance(answer, dict) and set(answer) == {"moments", "axes"}:
        moments, axes = read_list(answer["moments"]), read_list(answer["axes"])
        are_lists = isinstance(moments, list) and isinstance(axes, list) and len(moments) == len(axes)
        answer = list(map(list, zip(moments, axes, strict=True))) if are_lists else []
    elif isinstance(answer, dict):
        answer = [answer] if set(answer) == {"moment", "axis"} else list(map(list, answer.items()))
    pairs = [_pair(each) for each in answer] if isinstance(answer, list) else []
    if not 0 < len(pairs) <= MOST_PAIRS or len({len(pair) for pair in pairs}) > 1:
        expected = f"expected at most {MOST_PAIRS} pairs `[moment, [x, y, z]]`"
        raise Unreadable("wrong_shape", f"read {shown(answer)}, {expected}")
    if all(isinstance(axis, str) and not _AXIS.search(axis.strip()) for *_, axis in pairs):
        expected = "expected an axis beside each moment: `[moment, [x, y, z]]`"
        raise Unreadable("wrong_shape", f"read {arrays.how_many((len(pairs),))} and no axes, {expected}")
    cells = list[Tree]()
    for k, (*moment, axis) in enumerate(pairs, 1):
        components = arrays.row(read_list(axis))
        if components.shape != (3,):
            detail = f"read {shown(axis)}, expected three components"
            raise Unreadable("wrong_shape", detail, place=f"axis {k}")
        cells += [*moment, *components]
    return entries.filled(cells, (len(pairs), -1))


def _depth(entry: Tree) -> int:
    return 1 + max(map(_depth, entry), default=0) if isinstance(entry, list) else 0


def _in_text(text: str) -> Tree:
    """The pairs of a text: in lines or one line, with a colon in each, or as a list."""
    if (pairs := _in_line(text)) is not None:
        return pairs
    for between in (r"[\n;,]", r"[\n;]"):
        pieces = cut(without_labels(rewritten(text.strip(), _WITH_COLONS)), re.compile(between))
        if all(":" in piece for piece in pieces):
            return pieces
    return read_list(text)


def _in_line(text: str) -> Tree:
    """The pairs of a text such as `3: (1,1,0), 5 with axis (1,-1,0)`, or `e1 = (..), I1 = 3`; or None."""
    try:
        text = without_labels(in_brackets(text).replace(HAT, ""))
        closings = sorted(closings_of(text).items())
    except ExpressionError:
        return None
    ends = [0]  # where an axis begins, and where it ends
    for start, end in closings if len(closings) <= MOST_BRACKETS else ():
        inner = text[start + 1 : end]
        if start >= ends[-1] and 3 in (len(cut(inner, _SEPARATOR)), len(split(inner))):
            divided = _DIVIDED.match(text, end + 1)
            ends += [start, divided.end() if divided else end + 1]
    around = (pair for pair in closings if any(pair[0] < start < pair[1] for start in ends[1::2]))
    of_list = {bracket for pair in around for bracket in pair}
    text = "".join(" " if place in of_list else sign for place, sign in enumerate(text))
    pieces = [text[begin:end] for begin, end in pairwise([*ends, len(text)])]
    axes, around_axes = pieces[1::2], [_NAMES.sub("", piece).strip(" \n,;.:") for piece in pieces[::2]]
    for listed in around_axes:  # all moments in one place, before or behind all axes
        moments = split(listed)
        if len(moments) == len(axes) > 1 and not any(each for each in around_axes if each is not listed):
            return {"moments": moments, "axes": axes}
    between = list(map(_moment_and_factor, pieces[::2]))
    # A moment stands before its axis, or else behind it, where a factor would belong to the next axis.
    behind = [] if any(factor for _, factor in between[1:]) else between[1:]
    for given, rest in ((between[:-1], between[-1]), (behind, between[0])):
        if len(given) > 1 and all(re.search(r"\w", own) for own, _ in given) and not any(rest):
            return [[own, f"{factor} {axis}"] for (own, factor), axis in zip(given, axes, strict=True)]
    return None


def _moment_and_factor(between: str) -> tuple[str, str]:
    """The moment, and the factor of the axis behind it, in `3: 1/sqrt(2)` or `I1 = 3, e1 = 1/sqrt(2)`."""
    parts = [part.strip(" \t\n,;:") for part in _NAME.split(_NO_MOMENT.sub("", between))]
    if len(parts) == 2 and parts[0]:
        return parts[0], parts[1]
    moment, _, factor = parts[-1].partition(":" if re.match(r"[-+.\d]", parts[-1]) else "\0")
    return moment, factor


def _pair(entry: Tree) -> list[Tree]:
    """The moment and the axis in an entry of a list, or an axis alone."""
    if isinstance(entry, dict) and set(entry) == {"moment", "axis"}:
        return [entry["moment"], entry["axis"]]
    if isinstance(entry, str) and ":" in entry:
        return list(entry.split(":", 1))
    if isinstance(entry, list) and len(entry) in (2, 4):
        return entry if len(entry) == 2 else [entry[0], entry[1:]]
    return [entry]


# --- keys


def _solved(ruler: Ruler, tensor: Array) -> dict[str, Any]:
    """The fields of a key that follow from a tensor. Raises ValueProblem for a tensor of zeros."""
    numbers = ruler.numbers(tensor.ravel().tolist())[:, 0].reshape(3, 3)
    scale = float(np.abs(numbers).max())
    if not scale:
        raise ValueProblem("a tensor of zeros has no axes of its own")
    moments, vectors = np.linalg.eigh(numbers / scale)
    largest = float(np.abs(moments).max())
    moments[np.abs(moments) < NOISE_OF_ENTRIES * largest] = 0.0
    equal = (
        np.abs(moments[:, None] - moments) <= max(NOISE_OF_ENTRIES, min(EQUAL_MOMENTS, ruler.slack)) * largest
    )
    ruler = replace(ruler, largest=largest * scale)
    return {"ruler": ruler, "tensor": tensor, "moments": moments * scale, "axes": vectors.T, "equal": equal}


def _reported(source: KeySource) -> tuple[Ruler, Array, Array | None]:
    """The ruler, the tensor of a report, and where there are symbols the pairs. Raises ValueProblem."""
    assert source.report is not None
    tensor = source.value if source.path[-1] in ("tensor", "tensor_com") else source.report.get("tensor")
    if tensor is None:
        raise ValueProblem("this document has no principal axes")
    ruler, _ = entries.computed(replace(source, unit="kg m^2"), tensor)
    if ruler.formulas is None:
        return ruler, np.asarray(tensor), None
    moments, axes = source.report.get("moments"), source.report.get("axes")
    if moments is None or axes is None or tensor is not source.report["tensor"]:
        raise ValueProblem("the axes of this tensor cannot be written in its symbols")
    return ruler, np.asarray(tensor), ruler.entries(np.column_stack([moments, axes]))


def _literal(source: KeySource) -> tuple[Ruler, Array, Array | None]:
    """The ruler, the tensor and perhaps the pairs of a literal key. Raises ValueProblem."""
    if isinstance(source.value, dict) and set(source.value) == {"tensor"}:
        key = arrays.TensorKind().key(replace(source, value=source.value["tensor"]))
        if key.ruler.formulas is not None:
            raise ValueProblem("a tensor with symbols is no key", hint="write pairs: `[moment, [x, y, z]]`")
        ruler, tensor, pairs = key.ruler, key.entries * arrays.products(source), None
    else:
        table = _typed(source.value)
        if table.shape != (3, 4):
            expected = "expected three pairs of a moment and an axis, or `{tensor: [[..]]}`"
            raise Unreadable("wrong_shape", expected)
        ruler, typed = entries.literal(source, table, np.repeat(arrays.numbered("pair", 3), 4).tolist())
        tensor = _tensor_of_pairs(ruler, typed)
        pairs = None if ruler.formulas is None else typed
    if ruler.unit is not None and ruler.unit.dimension != KG_M2.dimension:
        raise ValueProblem(f"read a unit of {ruler.unit.dimension}, expected one of a moment of inertia")
    return replace(ruler, unit=ruler.unit or KG_M2), tensor, pairs


def _tensor_of_pairs(ruler: Ruler, pairs: Array) -> Array:
    """The tensor with three moments and axes (3 by 4). Raises ValueProblem."""
    moments, axes = pairs[:, 0], pairs[:, 1:]
    if ruler.formulas is not None:
        if ruler.formulas.vanish([axes[i] @ axes[j] for i, j in ((0, 1), (0, 2), (1, 2))]) is not True:
            raise ValueProblem("the axes are not at right angles")
        terms = (np.outer(e, e) * (moment / (e @ e)) for moment, e in zip(moments, axes, strict=True))
        return ruler.entries(np.vectorize(from_tree, otypes=[object])(sum(terms)))
    units = arrays.unit_vectors(axes.T).T
    if not np.abs(units @ units.T - np.eye(3)).max() <= RELATIVE:  # also where an axis has no direction
        raise ValueProblem("the axes are not at right angles")
    return np.asarray(units.T * moments @ units)
