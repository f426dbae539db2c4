"""Whether an expression vanishes on a motion: proved in a finite field, or refuted by bounds at states.

The refutation: at states of the motion the equation as typed has a value that is certainly not zero, or it
certainly has no value. Bounds are those of python-flint's balls, which have numbers of any size.

Points and states follow from the key and from the name of the question.
"""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from fractions import Fraction
from functools import lru_cache
from itertools import count, islice
from typing import Any

from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.motion import Motion
from rigidcli.symbolic.algebra.expressions import Expr
from rigidcli.symbolic.algebra.field import P, Point, depends_on_signs, raised
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.evaluation import Operations, value
from rigidcli.symbolic.language.tree import Negative, Node, Sum

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
    """The value that something made of these parts has at all points tried; None if it has several, or none."""
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
    return _common(lambda point: point.value(e), map(motion.point, count()), [e], motion.depends_on_signs) == 0


def is_trivial(e: Expr, motion: Motion) -> bool:
    """Whether it is proved that an expression is zero whatever the derivatives are."""
    return _common(lambda point: point.value(e), map(motion.free_point, count()), [e], False) == 0


def proportional(e: Expr, other: Expr, motion: Motion) -> bool:
    """Whether it is proved that an expression is another, times a number."""

    def ratio(point: Point) -> int:
        return point.value(e) * raised(point.value(other), -1) % P

    return _common(ratio, map(motion.point, count()), [e, other], motion.depends_on_signs) is not None


def generic(parts: Sequence[Expr], motion: Motion) -> list[int] | None:
    """The values of expressions at a point of the field where all have values, other than zero if there is one."""
    found = None
    for point in map(motion.point, range(FEW)):
        with suppress(ValueError, ExpressionError):
            if point is not None:
                known = [point.value(e) for e in parts]
                if all(known):
                    return known
                found = found or known
    return found


# --- balls

STATES = 40
"""At which an equation is tried."""

SCALES = ((0.5, 2.0), (0.1, 10.0), (0.02, 50.0), (50.0, 1e4))
"""Between which sizes the values at a state lie, state after state."""

GRAIN = 2**30
"""Values are whole multiples of one over this."""

PRECISIONS = (64, 400)
"""Bits of the balls."""

LARGEST_EXPONENT = 2**40
"""Beyond it a whole power is left open."""


class NoValueError(Exception):
    """An expression certainly has no real value."""


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


@lru_cache(512)
def balls(motion: Motion, place: int, bits: int) -> dict[str, Any] | None:
    """The values of all names at a state; None where the motion has none, or it is not sure that it has."""
    from flint import arb, ctx, fmpq

    with ctx.workprec(bits):
        known = {name: arb(fmpq(*x.as_integer_ratio())) for name, x in state(motion, place).items()}
        for name, tree in motion.trees.items():
            with suppress(NoValueError):
                known[name] = ball(tree, known)
            if name not in known or not known[name].is_finite():
                return None
    return known


def ball(node: Node, known: Mapping[str, Any]) -> Any:
    """The value of a tree, with the bits of the context. Raises NoValueError where there certainly is none."""
    return value(node, _BALLS._replace(name=known.__getitem__))


def _number(x: float) -> Any:
    from flint import arb

    return arb(x) if x.is_integer() and abs(x) < 2**53 else arb(x, abs(x) * 2**-52)


def _joined(a: Any, sign: str, b: Any) -> Any:
    if sign == "/" and b.is_zero():
        raise NoValueError
    return a + b if sign == "+" else a - b if sign == "-" else a * b if sign == "*" else a / b


def _ball_power(base: Any, exponent: Any) -> Any:
    whole = exponent.unique_fmpz() if exponent.is_exact() else None
    if base.is_zero() and exponent < 0:
        raise NoValueError
    if whole is not None and abs(whole) < LARGEST_EXPONENT:
        return base ** int(whole)
    if base < 0 and not exponent.contains_integer():
        raise NoValueError
    return base * 0 if base.is_zero() and exponent > 0 else base**exponent


_OUTSIDE = {
    "log": lambda x: x <= 0,
    "sqrt": lambda x: x < 0,
    "asin": lambda x: abs(x) > 1,
    "acos": lambda x: abs(x) > 1,
    "acosh": lambda x: x < 1,
    "atanh": lambda x: abs(x) >= 1,
}
"""Where functions certainly have no value."""


def _ball_call(function: str, arguments: list[Any]) -> Any:
    if function == "atan2":
        return arguments[0].atan2(arguments[1])
    (x,) = arguments
    if function in _OUTSIDE and _OUTSIDE[function](x):
        raise NoValueError
    return abs(x) if function == "abs" else x.sgn() if function == "sign" else getattr(x, function)()


_BALLS = Operations(lambda name: name, _number, lambda x: -x, _joined, _ball_power, _ball_call)


def refuted(left: Node, right: Node, motion: Motion, tolerance: float) -> bool:
    """Whether it is proved that an equation does not hold at some state, or has no value there."""
    from flint import ctx

    terms = [term for side in (left, right) for term in (side.terms if isinstance(side, Sum) else (side,))]
    for bits in PRECISIONS:
        for place in range(STATES):
            known = balls(motion, place, bits)
            if known is None:
                continue
            with ctx.workprec(bits):
                try:
                    gap = abs(ball(Sum((left, Negative(right))), known))
                    size = sum(abs(ball(term, known)) for term in terms) if tolerance else 0
                except NoValueError:
                    return True
                if gap > tolerance * size:
                    return True
    return False


def has_zeros(e: Expr, motion: Motion) -> bool:
    """Whether an expression is zero at a state, or of either sign at states of the motion."""
    from flint import ctx

    signs = set()
    for known in filter(None, (balls(motion, place, PRECISIONS[0]) for place in range(STATES))):
        with ctx.workprec(PRECISIONS[0]), suppress(NoValueError):
            found = ball(to_tree(e), known)
            signs |= {0} if found.is_zero() else {1} if found > 0 else {-1} if found < 0 else set()
    return 0 in signs or len(signs) > 1
