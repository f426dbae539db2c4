"""Whether two expressions are the same function: told where it is proved, and left open where it is not.

They differ where a ball of their difference excludes zero at one point, or one of them has no value where
the other, which is the key, has one. They are the same where the difference vanishes by exact algebra. Where
both leave it open, the rest of the difference is worked to more than a hundred digits at points near and far
that nobody can foresee: an analytic function that vanishes there is zero. That holds between the zeros of
what is under a root, a logarithm or bars, so each of these must have one sign, or points lie on both sides.

Where the key has no value nothing is asked: a simpler form may have values there.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from hashlib import blake2b
from typing import TypeAlias

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Symbol
from rigidcli.algebra.expressions import Expr
from rigidcli.algebra.field import P, Point, height
from rigidcli.algebra.fractions import lowest_terms
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.trigonometry import elementary_angles
from rigidcli.core.arithmetic import Floats, Mask
from rigidcli.errors import ExpressionError
from rigidcli.grading.expressions.domains import (
    STEPS,
    Edge,
    boundaries,
    edge_of,
    factors_of,
    sign_of,
    with_plain_exponents,
)
from rigidcli.grading.expressions.formula import size_of
from rigidcli.grading.expressions.ground import Ground
from rigidcli.grading.values import BITS, LOST, Ball, Estimate, Worked
from rigidcli.language.text import text
from rigidcli.language.tree import Node, Sum

Told: TypeAlias = bool | str
"""Whether it is so; or why that cannot be told, in words for a person who is to look at it."""

NEEDED = 6
"""Points at which a difference must vanish beyond doubt."""

MOST_NODES = 1_500
"""Of a difference that is worked to hundreds of digits: tenths of a second."""

VANISHING = BITS[1] - LOST
"""Bits by which a difference is smaller than its terms where it vanishes."""

MOST_SIDES = 5
"""Expressions that change their sign, of which all combinations of signs must be seen."""


PROVED = 2.0**-400
"""A difference below this, in units of the terms, is none: to the fourth power of what is not LOST.

It is asked far away, too, as no tolerance is.
"""

TOO_LONG = "it is too long to be compared"
UNCERTAIN = "its values are known at too few points"
FAINT = "something in it is too small to be seen at any of the points that were tried"


@dataclass(frozen=True, eq=False)
class Function(Worked):
    """An expression on its ground, with what is worked out of it once."""

    tree: Node
    ground: Ground

    @cached_property
    def rough(self) -> Estimate:
        """Its values at the points."""
        return self.ground.points.roughly_at(self.tree)

    @cached_property
    def fine(self) -> Estimate:
        """Its values with more digits."""
        return self.ground.points.finely_at(self.tree)

    @property
    def hidden(self) -> Mask:
        """Where something in it is too small to be seen."""
        return np.asarray(self.fine.hidden)

    @cached_property
    def exact(self) -> Expr | None:
        """The same as an exact expression; None where it is too large."""
        with suppress(ExpressionError):
            return self.ground.exact(self.plain)
        return None

    @cached_property
    def plain(self) -> Node:
        """The tree with numbers for exponents that always have one value."""
        return with_plain_exponents(self.tree, self.ground.exact)

    @cached_property
    def sizes(self) -> list[Ball]:
        """At each point, the sizes of all terms of a sum together."""
        terms = self.tree.terms if isinstance(self.tree, Sum) else (self.tree,)
        balls = [self.ground.points.roughly_at(term).balls for term in terms]
        return [sum(abs(ball).mid() for ball in column) for column in zip(*balls, strict=True)]

    def sizes_of(self, constant: bool) -> list[Ball]:
        """The same, or those of the terms at both points of a pair."""
        half = len(self.sizes) // 2
        both = zip(self.sizes[:half], self.sizes[half:], strict=True)
        return [one + two for one, two in both] if constant else self.sizes

    @cached_property
    def edges(self) -> frozenset[Edge]:
        """Where it ends: what must not be negative for it to have a value."""
        found = [each for each, is_edge in boundaries(self.plain, self.ground.exact) if is_edge]
        return frozenset(edge_of(each) for each in found)

    def is_same(self, key: Function, *, constant: bool = False, relative: float | None = None) -> Told:
        """Whether it is the same function as the key, but for a `constant`.

        A tolerance `relative` to the size of all terms of the key may be given.
        """
        try:
            if relative is not None and key.rough.differs.any():
                return _is_near(self, key, constant, relative)
            if not seems_same(self.rough, key.rough, constant=constant):
                return False
            return _is_proved(self, key, constant)
        except ExpressionError:
            return TOO_LONG


def seems_same(answer: Estimate, key: Estimate, *, constant: bool) -> bool:
    """Whether no point tells two expressions apart."""
    gap = changes(answer.minus(key), constant)
    return not (np.any(answer.undefined & key.known) or gap.differs.any())


def changes(difference: Estimate, constant: bool) -> Estimate:
    """What must vanish."""
    return difference.changes if constant else difference


def _is_near(answer: Function, key: Function, constant: bool, relative: float) -> Told:
    """Whether the difference is small beside the terms of the key, at all points."""
    if np.any(answer.rough.undefined & key.rough.known):
        return False
    sizes = key.sizes_of(constant)
    asked = answer.ground.is_near() | (relative <= PROVED)
    near = np.zeros(len(sizes), dtype=bool)
    for precision in ("rough", "fine"):
        gap = changes(getattr(answer, precision).minus(getattr(key, precision)).where(asked), constant)
        pairs = [(abs(ball), relative * size) for ball, size in zip(gap.balls, sizes, strict=True)]
        if any(gap.known & [far > allowed for far, allowed in pairs]):
            return False
        near = gap.known & [far <= allowed for far, allowed in pairs]
        if near[gap.known].all():
            break
    if np.count_nonzero(near) < min(NEEDED, len(near)):
        return UNCERTAIN
    seen = asked & ~answer.hidden
    return FAINT if np.count_nonzero(seen) < NEEDED else _has_no_turn(answer, answer, key, seen)


def _is_proved(answer: Function, key: Function, constant: bool) -> Told:
    """Whether the difference vanishes, by exact algebra or to hundreds of digits."""
    if _is_identical(answer, key, constant):
        return _stays_inside(answer, key)
    if answer.exact is None or key.exact is None:
        return TOO_LONG
    told: Told = TOO_LONG
    tried: list[Expr] = []
    for rest in _rests(answer.exact - key.exact):
        if not (rest.names & answer.ground.changing if constant else rest.terms):
            return _stays_inside(answer, key)
        tried.append(rest)
    for rest in tried:
        told = _vanishes(Function(to_tree(rest), answer.ground), answer, key, constant)
        if isinstance(told, bool):
            break
    return told


def _is_identical(answer: Function, key: Function, constant: bool) -> bool:
    """Whether the difference is the same at two points of a finite field, or zero at one.

    The points follow from the answer, so that it cannot be made for them, and its numbers are too small for
    what is not zero to be a multiple of the number of elements. The chance that two expressions agree there
    that differ is below 1e-30; that they do not agree is no proof that they differ.
    """
    ground = answer.ground
    (above, below), (other, under) = (height(e.tree, ground.vocabulary.domains) for e in (answer, key))
    if not max(above + under, other + below) + 1 + constant * (below + under) < P.bit_length() - 1:
        return False
    seed = blake2b(repr((answer.tree, key.tree)).encode()).hexdigest()
    gaps = []
    for turn in range(1 + constant):
        point = Point(seed, {})
        for name, domain in ground.vocabulary.domains.items():
            what = (name, turn if name in ground.changing else 0)
            point.values[name] = point.square(*what) if domain == "positive" else point.element(*what)
        try:
            both = [point.of_tree(each.tree, ground.symbols) for each in (answer, key)]
        except (ValueError, ExpressionError):
            return False
        gaps.append((both[0] - both[1]) % P)
    return len(set(gaps)) == 1 if constant else gaps == [0]


def _rests(rest: Expr) -> Iterator[Expr]:
    """A difference, and what is left of it when more and more is cancelled by exact algebra."""
    yield rest
    for law in (_over_one_denominator, elementary_angles, _over_one_denominator):
        before = rest
        with suppress(ExpressionError):
            rest = law(rest, Allowance(STEPS))
        if rest != before:
            yield rest


def _over_one_denominator(e: Expr, allowance: Allowance) -> Expr:
    return lowest_terms(e, allowance)[0]


def _vanishes(difference: Function, answer: Function, key: Function, constant: bool) -> Told:
    """Whether a difference vanishes to hundreds of digits, and is analytic between the points."""
    if size_of(difference.tree) > MOST_NODES:
        return TOO_LONG
    both = answer.rough.known & key.rough.known
    for found in (difference.rough, difference.fine):
        if changes(found.where(both), constant).differs.any():
            return False
    if np.any(answer.fine.undefined & key.rough.known):
        return False
    limits = [size.mid() / 2**VANISHING for size in difference.sizes]
    small = [ball.rad() <= limit for ball, limit in zip(difference.fine.balls, limits, strict=True)]
    if np.count_nonzero(both & small) < min(NEEDED, len(small)):
        return UNCERTAIN
    seen = both & small & ~difference.hidden
    if np.count_nonzero(seen) < min(NEEDED, len(small)):
        return FAINT
    inside = _stays_inside(answer, key)
    return _has_no_turn(difference, answer, key, seen) if inside is True else inside


def _stays_inside(answer: Function, key: Function) -> Told:
    """Whether an answer certainly has a value wherever the key has one."""
    for e, is_edge in boundaries(answer.plain, answer.ground.exact):
        if is_edge and sign_of(e) != (1, True):
            edge = edge_of(e)
            if edge[1] and edge not in key.edges:
                return f"it may have no value where {_shown(edge[1])} has another sign than at all points"
    return True


def _has_no_turn(difference: Function, answer: Function, key: Function, asked: Mask) -> Told:
    """Whether a difference is analytic on no more sides of zeros than those with points that were `asked`."""
    found: dict[Expr, Floats] = {}
    for e, is_edge in boundaries(difference.tree, difference.ground.exact):
        for factor, exponent in () if sign_of(e)[1] else factors_of(e):
            sign, strict = sign_of(factor)
            is_thin = sign is not None and all(isinstance(atom, Symbol) for atom in factor.atoms)
            if strict or is_thin or (is_edge and exponent % 2 and edge_of(e) in key.edges):
                continue
            if any((side, frozenset([factor])) in key.edges for side in (1, -1)):
                continue  # the key has no value on the other side
            values = Function(to_tree(factor), difference.ground).rough
            found[factor] = np.where(values.differs & asked, np.sign(values.value), 0.0)
    if not found:
        return True
    seen = {column for column in zip(*found.values(), strict=True) if 0.0 not in column}
    if len(found) <= MOST_SIDES and len(seen) == 2 ** len(found):
        return True
    known = {factor for e, _ in boundaries(answer.tree, answer.ground.exact) for factor, _ in factors_of(e)}
    return f"no points are on all sides of {_shown(known & found.keys())}"


def _shown(factors: Iterable[Expr]) -> str:
    """Expressions of an answer, to be told."""
    return ", ".join(sorted(f"`{text(to_tree(factor))}`" for factor in factors)) or "something"
