"""Whether an expression vanishes on a motion: proved in a finite field, or refuted by bounds at states.

Bounds are those of python-flint's balls, which have numbers of any size. Points and states follow from the
key and from the name of the question.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from itertools import count, islice, product
from typing import Any

from rigidcli.algebra.expansion import expand
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.field import P, Point, depends_on_signs, raised
from rigidcli.algebra.values import enclosed
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.motion import Motion

ENOUGH = 3
"""Points of the field where nothing depends on a sign: the chance of an error is below 1e-60."""

ENOUGH_OF_SIGNS = 40
"""Points where something does: the chance of an error is below 1e-12."""

TRIED = 600
"""Points that are tried, as roots have values at half of them only."""

FEW = 60
"""Points among which one is looked for where several expressions have values."""


def _common(
    of: Callable[[Point], int], points: Iterator[Point | None], parts: Iterable[Expr], signs: bool
) -> int | None:
    """The value that what is made of these parts has at all points tried; None if there are several."""
    signs = signs or any(map(depends_on_signs, parts))
    left, found = ENOUGH_OF_SIGNS if signs else ENOUGH, None
    for point in islice(points, TRIED if signs else 2 * ENOUGH):
        with suppress(ValueError, ExpressionError):
            if point is not None:
                known = of(point)
                if found is not None and known != found:
                    return None
                found, left = known, left - 1
                if not left:
                    return found
    return None


def differs(e: Expr, motion: Motion) -> bool:
    """Whether an expression is not zero at the first point of the motion that has values."""
    for point in filter(None, map(motion.point, range(FEW))):
        with suppress(ValueError, ExpressionError):
            return point.value(e) != 0
    return False


def vanishes(e: Expr, motion: Motion) -> bool:
    """Whether it is proved that an expression is zero on the motion."""
    if differs(e, motion):
        return False
    points = map(motion.point, count())
    return _common(lambda point: point.value(e), points, [e], motion.depends_on_signs) == 0


def is_trivial(e: Expr, motion: Motion) -> bool:
    """Whether it is proved that an expression is zero whatever the derivatives are."""
    return _common(lambda point: point.value(e), map(motion.free_point, count()), [e], False) == 0


def proportional(e: Expr, other: Expr, motion: Motion) -> bool:
    """Whether it is proved that an expression is another, times a number that is not zero."""

    def ratio(point: Point) -> int:
        return point.value(e) * raised(point.value(other), -1) % P

    found = _common(ratio, map(motion.point, count()), [e, other], motion.depends_on_signs)
    return found is not None and found != 0


def generic(parts: Sequence[Expr], motion: Motion) -> list[int] | None:
    """The values of expressions at a point of the field where all have values, not zero if there is one."""
    found = None
    for point in map(motion.point, range(FEW)):
        with suppress(ValueError, ExpressionError):
            if point is not None:
                known = [point.value(e) for e in parts]
                if all(known):
                    return known
                found = found or known
    return found


# --- values with bounds

STATES = 40
"""At which an equation is tried."""

SCALES = ((0.5, 2.0), (0.1, 10.0), (0.02, 50.0), (50.0, 1e4))
"""Between which sizes the values at a state lie, state after state."""

GRAIN = 2**30
"""Values are whole multiples of one over this."""

PRECISIONS = (64, 400)
"""Bits of the balls."""


@lru_cache(8192)
def state(motion: Motion, place: int) -> dict[str, Fraction]:
    """The values of all independent names at a state.

    At the first states, after one of no special values, one name after the other is zero, and then all.
    """
    chance = random.Random(f"{motion.seed} {place}")  # noqa: S311 - a probe needs no secrecy
    low, high = (math.log(bound) for bound in SCALES[place % len(SCALES)])
    found = {}
    for name, domain in sorted(motion.domains.items()):
        size = Fraction(round(math.exp(chance.uniform(low, high)) * GRAIN), GRAIN)
        found[name] = size if domain == "positive" or chance.random() < 1 / 2 else -size
    moving = [name for name in sorted(motion.domains) if motion.domains[name] == "real"]
    if 0 < place <= len(moving):
        found[moving[place - 1]] = Fraction(0)
    elif place == len(moving) + 1:
        found |= dict.fromkeys(moving, Fraction(0))
    return found | dict(motion.fixed)


def at_state(e: Expr, motion: Motion, place: int, bits: int = PRECISIONS[0]) -> Any:
    """The value of an expression without derivatives at a state, as a ball; None where none is sure."""
    with suppress(ArithmeticError, ValueError):
        return enclosed(e, state(motion, place), bits)
    return None


@lru_cache(64)
def states(motion: Motion) -> tuple[int, ...]:
    """The places of the states at which all derivatives have values."""
    rates = [motion.in_states(e) for e in motion.rates.values()]
    return tuple(
        place for place in range(STATES) if all(at_state(e, motion, place) is not None for e in rates)
    )


def is_refuted(e: Expr, motion: Motion, tolerance: float) -> bool:
    """Whether it is proved that an expression is not zero at some state, in units of its terms."""
    try:
        whole = motion.in_states(e)
    except ExpressionError:
        return False
    with suppress(ExpressionError):
        whole = expand(whole)
    parts = [motion.in_states(Expr({m: c})) for m, c in e.terms.items()] if tolerance else []
    for bits, place in product(PRECISIONS, states(motion)):
        known = [at_state(part, motion, place, bits) for part in (whole, *parts)]
        if None not in known:
            gap, *sizes = map(abs, known)
            if gap > tolerance * sum(sizes):
                return True
    return False


def has_zeros(e: Expr, motion: Motion) -> bool:
    """Whether an expression is zero at a state, or of either sign at states of the motion."""
    try:
        e = motion.in_states(e)
    except ExpressionError:
        return False
    found = [x for place in states(motion) if (x := at_state(e, motion, place)) is not None]
    return any(x.is_zero() for x in found) or (any(x > 0 for x in found) and any(x < 0 for x in found))
