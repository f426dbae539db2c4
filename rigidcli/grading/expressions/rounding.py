"""Decimals in an answer that stand for other numbers, as 0.333 does for 1/3, and numbers in place of symbols.

Such an answer is judged by its decimals, each by itself: it is right to the digits that are written if the
reference comes out when every decimal is moved within half of its last digit. The numbers to which they must
be moved are looked for, worked to dozens of digits, put in, and compared like any other answer. Exponents
are exact, and so are whole numbers: `0.50` may be rounded, 1/2 cannot be. That explains nothing where so
little changes a lot: any number is the cosine of 9.81^9, rounded.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ExpressionError
from rigidcli.grading.expressions.agreement import PROVED, Function, changes
from rigidcli.grading.expressions.formula import names_in, parts_of, size_of
from rigidcli.grading.question import RELATIVE
from rigidcli.grading.values import Ball, Integers, estimate
from rigidcli.language import evaluation
from rigidcli.language.tree import Name, Node, Number, Power, bound, rebuilt

FIGURES = 3
"""Significant figures of a decimal that may pass for what it was rounded from."""

MOST_NODES = 400
"""Of an answer whose decimals are looked at."""

MOST_UNKNOWN = 12
"""Numbers that are looked for at once."""

SMALL, LARGE = 0.1, 0.3
"""Effects on an answer, in units of its terms, of decimals with digits enough and of others."""

SLACK = 1 + 1e-9
"""So that a number on the very limit is within it."""

CLOSE = 1e-6
"""Difference, in units of the terms, above which the search has found nothing."""

STEPS = 60
"""Of a search for numbers; most take less than ten."""

NUDGE = 1e-7
"""By which share of its range a number is moved, to see what that changes."""

DAMPINGS = (1e-6, 1e3)
"""Of the search, in units of the slopes: at first, and where nothing nearer is found any more."""

LEAST = 6
"""Points at which they are worked with more digits, and two more for each number."""

DIGITS = 512
"""Bits of the numbers that were found."""

MOST_FIGURES = 150
"""Decimal digits that these bits are."""

ROUNDS = 9
"""Of the method of Gauss and Newton that works them: each has tens of bits more."""

DAMPING = 2.0**-60
"""Of that method, in units of the slopes: numbers of which only a product counts stay where they are."""


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


@dataclass(frozen=True, slots=True)
class Rounded:
    """An answer with the numbers for which its decimals stand, and whether these have digits enough."""

    tree: Node
    enough: bool


def rounded(answer: Function, key: Function, *, constant: bool = False) -> Rounded | None:
    """The answer that was rounded; None where the key does not come out, but for a `constant`."""
    decimals: list[Decimal] = []
    tree = _named(answer.tree, decimals)
    if not decimals or size_of(answer.tree) > MOST_NODES:
        return None
    effect = _effect(answer, key, constant)
    if not effect <= LARGE:
        return None
    widest = _moved(key, tree, {each: each.half_a_digit for each in decimals}, constant)
    if widest is None:
        return None
    nearest = (
        _moved(key, tree, {each: each.allowed for each in decimals}, constant) if effect <= SMALL else None
    )
    if nearest is None or not _are_near(answer.tree, nearest):
        return Rounded(widest, enough=False)
    return Rounded(nearest, enough=True)


def _effect(answer: Function, key: Function, constant: bool) -> float:
    """The difference from the key, in units of the terms, at half of the points or more."""
    gap = changes(answer.rough.minus(key.rough), constant)
    with np.errstate(all="ignore"):
        relative = np.abs(gap.value) / np.array([float(size) for size in key.sizes_of(constant)])
    relative = relative[key.ground.is_near(constant)]
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


def _moved(key: Function, tree: Node, distances: Mapping[Decimal, float], constant: bool) -> Node | None:
    """The tree with numbers up to these distances from its decimals, if the key comes out."""
    typed = {each.name: Number(repr(each.value), each.value) for each in distances if not distances[each]}
    tree = bound(tree, typed)
    free = {each.name: (each.value, distance * SLACK) for each, distance in distances.items() if distance}
    ranges = {name: (value - reach, value, value + reach) for name, (value, reach) in free.items()}
    found = fitted(tree, key, ranges, constant=constant)
    if found is None:
        return None
    moved = bound(tree, found)
    same = Function(moved, key.ground).is_same(key, constant=constant, relative=PROVED)
    return moved if same is True else None


def fitted(
    tree: Node, target: Function, ranges: Mapping[str, tuple[float, float, float]], *, constant: bool = False
) -> dict[str, Number] | None:
    """Numbers in place of some names for which a tree may be another function, but for a `constant`.

    Each lies between the first and the last of its range, all above zero, and is looked for from the
    middle one. None where no such numbers are near.
    """
    if not 0 < len(ranges) <= MOST_UNKNOWN:
        return None
    low, middle, high = np.log(np.array(list(ranges.values()))).T
    known, wanted = target.ground.points.floats, target.rough.value
    sizes = np.array([float(size) for size in target.sizes_of(constant)])

    usable = target.ground.is_near(constant)

    def gaps(logarithms: Floats) -> Floats:
        numbers = dict(zip(ranges, np.exp(logarithms), strict=True))
        with np.errstate(all="ignore"):
            gap = evaluation.array(tree, {**known, **numbers}) - wanted
            half = len(gap) // 2
            return np.asarray(((gap[:half] - gap[half:] if constant else gap) / sizes)[usable])

    usable[usable] = np.isfinite(gaps(middle))
    if np.count_nonzero(usable) < len(ranges):
        return None
    with np.errstate(all="ignore"):
        near = _nearest(gaps, low, middle, high)
        if not np.median(np.abs(gaps(near))) < CLOSE:
            return None
    start = dict(zip(ranges, np.exp(near), strict=True))
    numbers = _worked_out(tree, target, start, np.flatnonzero(usable), constant)
    inside = numbers is not None and all(
        first / SLACK <= numbers[name].value <= last * SLACK for name, (first, _, last) in ranges.items()
    )
    return numbers if inside else None


def _nearest(gaps: Callable[[Floats], Floats], low: Floats, start: Floats, high: Floats) -> Floats:
    """Where between bounds (n) some differences are small, by the method of Levenberg and Marquardt.

    Steps are in units of the ranges, so that numbers of which only a product counts share its change. This
    is not scipy's, which takes half a second to load, and makes every process that judges a file larger.
    """
    here, found, width = start, gaps(start), high - low
    damping, most = DAMPINGS
    for _ in range(STEPS):
        slopes = np.array([(gaps(here + NUDGE * each) - found) / NUDGE for each in np.diag(width)])
        pull = slopes @ found
        slopes[((here <= low) & (pull > 0)) | ((here >= high) & (pull < 0))] = 0  # what is at its bound stays
        square = slopes @ slopes.T
        if not (np.isfinite(square).all() and found.any() and damping <= most):
            break
        square += damping * np.trace(square) * np.eye(len(width))
        there = np.clip(here - width * np.linalg.lstsq(square, slopes @ found)[0], low, high)
        then = gaps(there)
        if then @ then < found @ found:
            here, found, damping = there, then, damping / 10
        else:
            damping *= 10
    return here


def _worked_out(
    tree: Node, target: Function, start: Mapping[str, float], places: Integers, constant: bool
) -> dict[str, Number] | None:
    """The numbers with many more digits, by the method of Gauss and Newton at some of the points."""
    from flint import arb, arb_mat, ctx

    few = places[: LEAST + 2 * len(start)]
    half = len(target.sizes_of(constant))
    points = target.ground.points.some([*few, *(few + half)] if constant else few)
    with ctx.workprec(DIGITS):
        values = points.finest
        wanted = changes(estimate(target.tree, values, points.count, DIGITS), constant).balls
        weights = [1 / target.sizes_of(constant)[place] for place in few]
        step = arb(2) ** (-DIGITS // 3)
        numbers = [arb(x) for x in start.values()]

        def gaps(tried: Sequence[Ball]) -> list[Ball]:
            known = {name: [x] * points.count for name, x in zip(start, tried, strict=True)}
            found = changes(estimate(tree, {**values, **known}, points.count, DIGITS), constant).balls
            return [((x - y) * w).mid() for x, y, w in zip(found, wanted, weights, strict=True)]

        for _ in range(ROUNDS):
            here = gaps(numbers)
            slopes = []
            for place, x in enumerate(numbers):
                there = gaps([*numbers[:place], x + x * step, *numbers[place + 1 :]])
                slopes.append([((y - z) / step).mid() for y, z in zip(there, here, strict=True)])
            rows = arb_mat(slopes)
            square = rows * rows.transpose()
            for place in range(len(numbers)):
                square[place, place] += DAMPING * (square[place, place] + DAMPING)
            try:
                change = square.solve(rows * arb_mat([[gap] for gap in here]))
            except ZeroDivisionError:
                return None
            numbers = [(x - x * change[place, 0]).mid() for place, x in enumerate(numbers)]
        found = {
            name: Number(x.str(MOST_FIGURES, radius=False), float(x))
            for name, x in zip(start, numbers, strict=True)
        }
    return found if all(x.is_finite() for x in numbers) else None
