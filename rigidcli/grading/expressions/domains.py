"""Where expressions have values, which signs they have, and between which zeros they are analytic."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import TypeAlias

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Applied, Group, Monomial, is_positive
from rigidcli.algebra.expressions import ZERO, Expr, total
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.functions import apply
from rigidcli.algebra.roots import Rational
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.trigonometry import elementary_angles
from rigidcli.algebra.values import enclosed
from rigidcli.errors import ExpressionError
from rigidcli.grading.expressions.formula import names_in, parts_of
from rigidcli.grading.values import BITS, CONDITIONS, Need
from rigidcli.language.tree import Call, Node, Power, Reciprocal, rebuilt

Exact: TypeAlias = Callable[[Node], Expr]
"""What makes an exact expression of a tree."""

STEPS = 4_000
"""Of exact algebra for one expression: some milliseconds."""

_BOUNDED = frozenset(["sin", "cos", "tanh", "sign"])
"""Functions that lie between -1 and 1."""

_SINGLE_VALUED = frozenset({"sin", "cos", "tan", "exp", "sinh", "cosh", "tanh"})
"""Functions that are analytic on all sides of a pole of their arguments together."""


# --- signs


def least_sign(e: Expr) -> int | None:
    """1 where an expression is above zero for all values of its symbols, 0 where it is never below.

    Each term is held against its least value, which it has where sines and cosines are 1 or -1; what is
    never negative is left out.
    """
    bounds = [_least(monomial, coefficient) for monomial, coefficient in e.terms.items()]
    known = [bound for bound in bounds if bound is not None]
    if len(known) < len(bounds):
        return None
    least = total(known)
    if any(coefficient < 0 for coefficient in least.terms.values()):
        return None
    return 1 if least.terms else 0


def _least(monomial: Monomial, coefficient: Rational) -> Expr | None:
    """A bound of a term from below, all of whose factors are positive; None where there is none."""
    kept, may_vanish, unbounded, any_sign = {}, False, False, False
    for atom, exponent in monomial:
        even = exponent.denominator == 1 and exponent.numerator % 2 == 0
        root_below = exponent < 0 and exponent.denominator % 2 == 0
        if root_below or is_positive(atom) or (isinstance(atom, Group) and least_sign(atom.inner) == 1):
            kept[atom] = exponent
            continue
        may_vanish = True
        if isinstance(atom, Applied) and atom.function in _BOUNDED and exponent > 0:
            any_sign = any_sign or not (even or exponent.denominator % 2 == 0)
        elif even or exponent.denominator % 2 == 0 or (isinstance(atom, Applied) and atom.function == "abs"):
            unbounded = True
        else:
            return None
    rest = Expr({tuple(kept.items()): coefficient})
    if not any_sign and coefficient > 0:
        return ZERO if may_vanish else rest
    if unbounded:
        return None
    return rest if coefficient < 0 else -rest


def sign_of(e: Expr) -> tuple[int | None, bool]:
    """The sign that an expression has unless it is zero, and whether it never is; None where that is open."""
    if not e.names:
        number = enclosed(e, {}, BITS[0])
        return (1 if number > 0 else -1 if number < 0 else None), True
    for sign in (1, -1):
        least = least_sign(sign * e)
        if least is not None:
            return sign, least == 1
    return None, False


# --- where there is a value


def conditions(node: Node, exact: Exact) -> Iterator[tuple[Need, Callable[[], Sequence[Expr]]]]:
    """What must be so for a tree to have a value, what is inside first, and of which expressions.

    These are worked out where they are asked for; two of them are never below zero together. Raises
    ExpressionError. One over a tangent is read as the cotangent, which it is but where the tangent has no
    value.
    """
    if isinstance(node, Reciprocal) and isinstance(node.operand, Call) and node.operand.function == "tan":
        (angle,) = node.operand.arguments
        yield from conditions(angle, exact)
        yield "nonzero", lambda: [apply("sin", exact(angle))]
        return
    for part in parts_of(node):
        yield from conditions(part, exact)
    match node:
        case Reciprocal(operand):
            yield "nonzero", lambda: [exact(operand)]
        case Power(base, exponent):
            known = exact(exponent).as_number
            if known is None or known.denominator != 1:
                yield "positive" if known is None or known < 0 else "not negative", lambda: [exact(base)]
            elif known < 0:
                yield "nonzero", lambda: [exact(base)]
        case Call("tan", (angle,)):
            yield "nonzero", lambda: [apply("cos", exact(angle))]
        case Call(function, arguments) if function in CONDITIONS:
            need, of = CONDITIONS[function]
            yield need, lambda: of(*map(exact, arguments))


# --- boundaries


def boundaries(node: Node, exact: Exact) -> Iterator[tuple[Expr, bool]]:
    """What is analytic on one side of zero only, and whether it has no value on the other side."""
    yield from ((e, True) for need, of in conditions(node, exact) if need != "nonzero" for e in of())
    yield from ((e, False) for e in _turns(node, exact))


def _turns(node: Node, exact: Exact) -> Iterator[Expr]:
    """The boundaries on both sides of which there are values."""
    match node:
        case Call("abs" | "sign" | "atan2", arguments):
            yield from map(exact, arguments)
        case Power(base, exponent):
            known = exact(exponent).as_number
            if known is None or known.denominator != 1:
                yield from _poles(base, exact)
    if isinstance(node, Call) and node.function not in _SINGLE_VALUED:
        yield from (pole for x in node.arguments for pole in _poles(x, exact))
    for part in parts_of(node):
        yield from _turns(part, exact)


def _poles(node: Node, exact: Exact) -> Iterator[Expr]:
    """What is zero where an expression is infinite."""
    match node:
        case Reciprocal(x) | Power(x, _):
            yield exact(x)
        case Call("tan", (x,)):
            yield apply("cos", exact(x))
    for part in parts_of(node):
        yield from _poles(part, exact)


Edge: TypeAlias = tuple[int, frozenset[Expr]]
"""A sign, and the factors whose product with it must not be negative."""


def plain_of(e: Expr) -> Expr:
    """An expression in sines and cosines of the terms of their arguments, if that is not too long."""
    with suppress(ExpressionError):
        return elementary_angles(e, Allowance(STEPS))
    return e


def factors_of(e: Expr) -> list[tuple[Expr, int]]:
    """The factors of an expression with their exponents."""
    plain = plain_of(e)
    try:
        return factors(plain, Allowance(STEPS))
    except ExpressionError:
        return [(plain, 1)]


def edge_of(e: Expr) -> Edge:
    """What of an expression decides its sign."""
    sign, left = 1, set()
    for factor, exponent in factors_of(e):
        known = sign_of(factor)[0]
        if exponent % 2:
            sign *= known or 1
            left |= set() if known else {factor}
    return sign, frozenset(left)


def with_plain_exponents(node: Node, exact: Exact) -> Node:
    """The tree with numbers for exponents that always have one value."""
    node = rebuilt(node, lambda part: with_plain_exponents(part, exact))
    if isinstance(node, Power) and names_in(node.exponent):
        exponent = plain_of(exact(node.exponent))
        return node if exponent.names else Power(node.base, to_tree(exponent))
    return node
