"""Whether two expressions are the same function, as far as values at many points can tell.

They differ if they do at one point by more than rounding, or if an answer has no value where the reference
has one. They are the same if they agree at `NEEDED` points at least where rounding leaves no doubt: where it
is small beside all that matters, down to the smallest term and to what a change of one symbol does. So
`1e9 + x` is not `1e9`. Where floats find too few such points, 80 digits decide.

Where the reference has no value nothing is asked: a simpler form may have values there.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass
from decimal import localcontext

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem
from rigidcli.grading.expressions.digits import QUIET
from rigidcli.grading.expressions.estimate import Estimate, Values
from rigidcli.grading.expressions.formula import Points, Vocabulary, draw, names_in, size_of
from rigidcli.symbolic.language.tree import Node, Sum

STRICT = 1e-9
"""Relative to the sizes of all terms together, what decimals such as 0.333333333333 may be off."""

VISIBLE = 1e-6
"""Relative to the smallest thing that matters, what may be hidden where two expressions agree."""

PAIRS = 24
LEAST_PAIRS = 4
CANDIDATES = (100, 4000)
"""Random points among which those with a value are looked for."""

NEEDED = 6
"""Points at which expressions must agree beyond doubt."""

PRECISE_PAIRS = 6
"""Of points at which 80 digits are used; fewer for large expressions."""

NODES_AT_ONCE = 12_000

CHANGE = 1.37
"""The factor by which a symbol is changed to see what it does."""

ZERO = 1e-30
"""What matters where the reference is zero everywhere."""

SURE = 4.0
"""Above so many times its error, a value is certainly not zero."""


@dataclass(frozen=True, slots=True, eq=False)
class Scale:
    """At each point (n): the sizes of all terms together, and that of the smallest thing that matters."""

    size: Floats
    smallest: Floats


@dataclass(frozen=True, slots=True, eq=False)
class Probe:
    """A reference at points (2 n), in floats or with 80 digits.

    They come in pairs, i and i + n, that differ in some symbols only: what is left of the difference of two
    expressions there is not a constant. `steps` is the scale of what changes from one to the other (n).
    """

    points: Points
    precise: bool
    found: Estimate
    scale: Scale
    steps: Scale

    def at(self, tree: Node) -> Estimate:
        """The values of an expression at the points."""
        return self.points.precisely_at(tree) if self.precise else self.points.at(tree)

    def verdict(
        self, answer: Estimate, reference: Estimate, *, constant: bool = False, relative: float | None = None
    ) -> bool | None:
        """Whether two expressions agree, but for a `constant`; None where rounding leaves that open.

        A tolerance `relative` to the size of the terms may be given.
        """
        with _context(precise=self.precise), np.errstate(all="ignore"):
            if constant:
                return _verdict(answer.changes, reference.changes, self.steps, relative)
            return _verdict(answer, reference, self.scale, relative)


def _context(*, precise: bool) -> AbstractContextManager[object]:
    return localcontext(QUIET) if precise else nullcontext()


def _verdict(answer: Estimate, reference: Estimate, scale: Scale, relative: float | None) -> bool | None:
    gap = _floats(abs(answer.value - reference.value))
    noise = _floats(answer.error + reference.error)
    allowed = (STRICT if relative is None else relative) * scale.size
    asked = ~(reference.undefined | reference.doubtful)
    both = asked & ~(answer.undefined | answer.doubtful)
    if np.any((answer.undefined & asked) | (both & (gap > noise + allowed))):
        return False
    visible = VISIBLE * scale.smallest
    clear = (noise <= visible) & (gap <= visible)
    if relative is not None:
        clear |= noise <= VISIBLE * allowed
    return True if np.count_nonzero(both & clear) >= min(NEEDED, len(gap)) else None


def _floats(values: Values) -> Floats:
    return np.asarray(values, dtype=np.float64)


def factor(answer: Estimate, reference: Estimate) -> float | None:
    """The number, not zero, by which a reference is multiplied in an answer, both in floats.

    None where there is no such number, or rounding leaves that open.
    """
    with np.errstate(all="ignore"):
        asked = ~(reference.undefined | reference.doubtful) & (abs(reference.value) > reference.error)
        if np.any(answer.undefined & asked):
            return None
        both = asked & ~answer.doubtful
        ratio = answer.value / reference.value
        noise = (answer.error + abs(ratio) * reference.error) / abs(reference.value)
        clear = both & (noise <= VISIBLE * abs(ratio))
        if np.count_nonzero(clear) < NEEDED:
            return None
        common = float(np.median(ratio[clear]))
        near = abs(ratio - common) <= STRICT * abs(common) + noise
    return common if common and np.all(near[both]) else None


@dataclass(frozen=True, slots=True, eq=False)
class Reference:
    """An expression to which answers are compared: in floats first."""

    tree: Node
    floats: Probe
    digits: Probe
    relative: float | None = None

    def holds(self, answer: Node, found: Estimate | None = None, *, constant: bool = False) -> bool:
        """Whether an answer is the same function, but for a `constant`.

        `found` has the values of the answer at the points of `floats`, if they are known.
        """
        estimate = self.floats.at(answer) if found is None else found
        verdict = self._verdict(self.floats, estimate, constant)
        if verdict is None and size_of(answer) * self.digits.points.count <= NODES_AT_ONCE:
            verdict = self._verdict(self.digits, self.digits.at(answer), constant)
        return verdict is True

    def holds_where(self, values: Mapping[str, float], answer: Estimate, *, constant: bool = False) -> bool:
        """Whether it is the same function where some names, which it does not hold, have these values."""
        points = self.floats.points.but(values)
        found = points.at(self.tree)
        terms = [points.at(term) for term in _terms(self.tree)]
        probe = Probe(points, False, found, *_scales(found, terms, ()))
        if not self._verdict(probe, answer, constant):
            return False
        # Of what is too small to be seen at these values nothing can be said.
        effects = [_effect(found, points.scaled(name, CHANGE).at(self.tree)) for name in values]
        probe = Probe(points, False, found, *_scales(found, terms, effects))
        return self._verdict(probe, answer, constant) is True

    def _verdict(self, probe: Probe, estimate: Estimate, constant: bool) -> bool | None:
        return probe.verdict(estimate, probe.found, constant=constant, relative=self.relative)


def refer(
    tree: Node, vocabulary: Vocabulary, changing: Iterable[str] = (), relative: float | None = None
) -> Reference:
    """The reference that a tree is; the points of a pair differ in the `changing` names, if there are any.

    Raises ValueProblem where it has values at too few points.
    """
    points = _with_values(tree, vocabulary, frozenset(changing) or vocabulary.domains.keys())
    half = points.count // 2
    count = max(2, min(half, PRECISE_PAIRS, NODES_AT_ONCE // (2 * size_of(tree))))
    places = [place for start in (0, half) for place in range(start, start + count)]
    few = points.some(places)
    rough, fine = points.at(tree), few.precisely_at(tree)
    in_floats, in_digits = [], []
    for name in sorted(points.independent(names_in(tree))):
        effect = _effect(rough, points.scaled(name, CHANGE).at(tree))
        if effect.all():
            in_floats.append(effect)
            in_digits.append(effect[places])
            continue
        with localcontext(QUIET):
            finer = _effect(fine, few.scaled(name, CHANGE).precisely_at(tree))
        if effect.any() or finer.any():
            in_floats.append(effect)
            in_digits.append(np.where(finer == 0, np.inf, finer))
    terms = _terms(tree)
    with localcontext(QUIET), np.errstate(all="ignore"):
        return Reference(
            tree,
            Probe(points, False, rough, *_scales(rough, map(points.at, terms), in_floats)),
            Probe(few, True, fine, *_scales(fine, map(few.precisely_at, terms), in_digits)),
            relative,
        )


def _terms(tree: Node) -> tuple[Node, ...]:
    return tree.terms if isinstance(tree, Sum) else (tree,)


def _with_values(tree: Node, vocabulary: Vocabulary, changing: Iterable[str]) -> Points:
    for count in CANDIDATES:
        first, other = draw(vocabulary, count), draw(vocabulary, count, seed=2)
        second = first.but({name: other.values[name] for name in changing})
        is_known = np.ones(count, dtype=bool)
        for found in (first.at(tree), second.at(tree)):
            is_known &= ~(found.undefined | found.doubtful)
        places = np.flatnonzero(is_known)[:PAIRS]
        if len(places) == PAIRS or (count == CANDIDATES[-1] and len(places) >= LEAST_PAIRS):
            return first.some(places).joined(second.some(places))
    raise ValueProblem("has a value at too few of the points where its symbols may lie")


def _effect(before: Estimate, after: Estimate) -> Floats:
    """What a change of a symbol does: zero where it is lost in rounding, infinite where nothing is known."""
    with np.errstate(all="ignore"):
        change = _floats(abs(after.value - before.value))
        seen = np.where(change > SURE * _floats(after.error + before.error), change, 0.0)
    return np.where(after.undefined | after.doubtful, np.inf, seen)


def _scales(found: Estimate, terms: Iterable[Estimate], effects: Sequence[Floats]) -> tuple[Scale, Scale]:
    """The scale of values at all points, and that of what changes within a pair."""
    n = len(found.value) // 2
    value, step = _floats(abs(found.value)), _floats(abs(found.changes.value))
    if np.all(value <= SURE * _floats(found.error)):
        nothing, zero = np.zeros(2 * n), np.full(2 * n, ZERO)
        return Scale(nothing, zero), Scale(nothing[:n], zero[:n])
    sizes = [_floats(abs(term.value)) for term in terms]
    size = np.sum(sizes, axis=0)
    smallest = np.min([value, *effects, *(each for each in sizes if each.any())], axis=0)
    both = np.minimum(smallest[:n], smallest[n:])
    return Scale(size, smallest), Scale(size[:n] + size[n:], np.minimum(both, step))
