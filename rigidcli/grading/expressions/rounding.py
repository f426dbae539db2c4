"""Decimals in an answer that stand for other numbers, as 0.333 does for 1/3.

Such an answer is judged by its decimals, each by itself: it is right to the digits that are written if the
reference comes out when every decimal is moved within half of its last digit. The numbers to which they must
be moved are looked for, put in, and compared like any other answer. Exponents are exact, and so are whole
numbers: `0.50` may be rounded, 1/2 cannot be. That explains nothing where so little changes a lot: any number
is the cosine of 9.81^9, rounded.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError
from rigidcli.grading.expressions.agreement import Reference
from rigidcli.grading.expressions.estimate import Estimate
from rigidcli.grading.expressions.fitting import fitted
from rigidcli.grading.expressions.formula import names_in, parts_of, replaced, size_of
from rigidcli.grading.question import RELATIVE
from rigidcli.symbolic.language import evaluation
from rigidcli.symbolic.language.tree import Name, Node, Number, Power, rebuilt

FIGURES = 3
"""Significant figures of a decimal that may pass for what it was rounded from."""

MOST_NODES = 400
"""Of an answer whose decimals are looked at."""

SMALL, LARGE = 0.1, 0.3
"""Effects on an answer, in units of its terms, of decimals with digits enough and of others."""

SLACK = 1 + 1e-9
"""So that a number on the very limit is within it."""


@dataclass(frozen=True, slots=True)
class Decimal:
    """A number with a point, as it was typed, under a name that no student can type."""

    name: str
    value: float
    figures: int
    half_a_digit: float

    @property
    def allowed(self) -> float:
        """How far it may be from what it stands for: half a digit, and RELATIVE of that number."""
        near = min(self.half_a_digit, RELATIVE / (1 - RELATIVE) * self.value)
        return near if self.figures >= FIGURES else 0.0

    def within(self, distance: float) -> Range:
        """The numbers up to this distance from it."""
        return Range(self.value, distance * SLACK)


@dataclass(frozen=True, slots=True)
class Range:
    """Numbers around a `middle`."""

    middle: float
    reach: float

    def __call__(self, place: Floats) -> Floats:
        """The numbers at these places from -1 to 1."""
        return self.middle + self.reach * place


@dataclass(frozen=True, slots=True)
class Rounded:
    """An answer with the numbers for which its decimals stand, and whether these have digits enough."""

    tree: Node
    enough: bool


def rounded(reference: Reference, answer: Node, found: Estimate, *, constant: bool = False) -> Rounded | None:
    """The answer that was rounded; None where the reference does not come out, but for a `constant`.

    `found` has the values of the answer at the points of the reference.
    """
    effect = _effect(reference, found, constant)
    if size_of(answer) > MOST_NODES or not effect <= LARGE:
        return None
    decimals: list[Decimal] = []
    tree = _named(answer, decimals)
    by_digits = {each: each.half_a_digit for each in decimals}
    by_tolerance = {each: each.allowed for each in decimals}
    widest = _moved(reference, tree, by_digits, constant)
    if widest is None:
        return None
    nearest = _moved(reference, tree, by_tolerance, constant) if effect <= SMALL else None
    if nearest is None or not _are_near(answer, nearest):
        return Rounded(widest, enough=False)
    return Rounded(nearest, enough=True)


def _effect(reference: Reference, found: Estimate, constant: bool) -> float:
    """The difference from the reference, in units of the terms, at half of the points or more."""
    probe = reference.floats
    excess = found.minus(probe.found)
    excess, size = (excess.changes, probe.steps.size) if constant else (excess, probe.scale.size)
    with np.errstate(all="ignore"):
        relative = np.abs(excess.value) / size
    return float(np.median(relative[np.isfinite(relative)])) if np.isfinite(relative).any() else math.inf


def _are_near(one: Node, other: Node) -> bool:
    """Whether no coefficient differs by more than RELATIVE between two trees of the same form."""
    pairs = zip(_coefficients(one), _coefficients(other), strict=True)
    try:
        values = [(evaluation.real(typed, {}), evaluation.real(meant, {})) for typed, meant in pairs]
    except ExpressionError:
        return False
    return all(abs(typed - meant) <= RELATIVE * abs(meant) * SLACK for typed, meant in values)


def _coefficients(node: Node) -> Iterator[Node]:
    """The largest parts without a name."""
    if not names_in(node):
        yield node
    else:
        for part in parts_of(node):
            yield from _coefficients(part)


def _named(node: Node, decimals: list[Decimal]) -> Node:
    """The tree with a name in place of each decimal, which is added to the list."""
    match node:
        case Number(text, value) if "." in text and value > 0 and math.isfinite(value):
            mantissa, _, power = text.lower().partition("e")
            digits = len(mantissa.replace(".", "").lstrip("0"))
            half = 0.5 * 10.0 ** (int(power or 0) - len(mantissa.partition(".")[2]))
            decimals.append(Decimal(f"#{len(decimals)}", value, digits, half))
            return Name(decimals[-1].name)
        case Power(base, exponent):
            return Power(_named(base, decimals), exponent)
    return rebuilt(node, lambda inner: _named(inner, decimals))


def _moved(reference: Reference, tree: Node, distances: dict[Decimal, float], constant: bool) -> Node | None:
    """The tree with numbers up to these distances from its decimals, if the reference comes out."""
    fixed = {each.name: _number(each.value) for each, distance in distances.items() if not distance}
    free = {each.name: each.within(distance) for each, distance in distances.items() if distance}
    tree = replaced(tree, fixed)
    probe = reference.floats
    size = probe.steps.size if constant else probe.scale.size
    values = fitted(
        tree, probe.points, free, probe.found, size, constant=constant, relative=reference.relative
    )
    if values is None:
        return None
    moved = replaced(tree, {name: _number(value) for name, value in values.items()})
    return moved if reference.holds(moved, constant=constant) else None


def _number(value: float) -> Number:
    return Number(repr(value), value)
