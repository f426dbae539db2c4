"""What is never zero, or has a value, wherever a motion is defined."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from contextlib import suppress
from functools import lru_cache
from typing import Any, Literal, TypeAlias

from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.truth import at_state, proportional, states, vanishes
from rigidcli.grading.expressions.formula import parts_of
from rigidcli.symbolic.algebra.allowance import Allowance
from rigidcli.symbolic.algebra.atoms import Applied, Group, Monomial, is_positive
from rigidcli.symbolic.algebra.expressions import ZERO, Expr, atomic, factored, total
from rigidcli.symbolic.algebra.fractions import factors
from rigidcli.symbolic.algebra.functions import apply
from rigidcli.symbolic.algebra.roots import Rational
from rigidcli.symbolic.algebra.trees import to_tree
from rigidcli.symbolic.language.tree import Call, Node, Power, Reciprocal

Need: TypeAlias = Literal["nonzero", "positive", "not negative"]

STEPS = 20_000
"""Steps that a search for factors may take, a few hundredths of a second."""

BOUNDED = frozenset(["sin", "cos", "tanh", "sign"])
"""Functions that lie between -1 and 1."""

FUNCTIONS: Mapping[str, tuple[Need, Callable[..., Expr]]] = {
    "log": ("positive", lambda x: x),
    "sqrt": ("not negative", lambda x: x),
    "asin": ("not negative", lambda x: 1 - x**2),
    "acos": ("not negative", lambda x: 1 - x**2),
    "acosh": ("not negative", lambda x: x - 1),
    "atanh": ("positive", lambda x: 1 - x**2),
    "tan": ("nonzero", lambda x: apply("cos", x)),
    "atan2": ("nonzero", lambda y, x: x**2 + y**2),
}
"""What must be so for a function to have a value."""


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
        if isinstance(atom, Applied) and atom.function in BOUNDED and exponent > 0:
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


def _sign(e: Expr) -> int | None:
    """The same by the signs of factors, where those of terms do not tell."""
    found = least_sign(e)
    if found is not None:
        return found
    sign, strict = 1, 1
    with suppress(ExpressionError):
        for part, exponent in factors(e, Allowance(STEPS)):
            up, down = least_sign(part), least_sign(-part)
            if exponent % 2 and up is None:
                sign = -sign
            if up is None and down is None and exponent % 2:
                return None
            strict *= 1 if exponent < 0 else (up or down or 0)
        return strict if sign > 0 else None
    return None


def open_factors(e: Expr, motion: Motion) -> list[Expr]:
    """The factors of an expression that may be zero where the motion is defined, as far as can be told.

    What stands in a denominator is not zero where there is a value.
    """
    coefficient, monomial = factored(e)
    bases = [atom.inner if isinstance(atom, Group) else atomic(atom) for atom, n in monomial if n > 0]
    found = [base for base in bases if not _is_never_zero(base, motion)]
    if found and coefficient:
        with suppress(ExpressionError):
            parts = factors(e, Allowance(STEPS))
            return [part for part, n in parts if n > 0 and part.names and not _is_never_zero(part, motion)]
    return found if coefficient else [e]


def _is_never_zero(e: Expr, motion: Motion) -> bool:
    sign = _sign if len(e.terms) > 1 else least_sign
    if sign(e) == 1 or sign(-e) == 1:
        return True
    return any(
        each.names == e.names and proportional(e, each, motion) for each in nonzero(motion.base or motion)
    )


@lru_cache(64)
def needs(motion: Motion) -> tuple[tuple[Need, Expr], ...]:
    """What is so wherever the derivatives have values."""
    return tuple(need for e in motion.rates.values() for need in conditions(to_tree(e), motion))


@lru_cache(64)
def nonzero(motion: Motion) -> tuple[Expr, ...]:
    """What is not zero wherever the derivatives have values: with sin, also 1 - cos and 1 + cos."""
    found: dict[Expr, None] = {}
    for need, e in needs(motion):
        parts = [atomic(atom) for atom, _ in factored(e)[1]] if need != "not negative" else []
        for part in parts:
            for power in (part, part**2):
                found[power] = None
                with suppress(ExpressionError):
                    found |= {factor: None for factor, _ in factors(power, Allowance(STEPS)) if factor.names}
    return tuple(found)


# --- where there is a value


VIOLATED: Mapping[Need, Callable[[Any], bool]] = {
    "nonzero": lambda x: x.is_zero(),
    "positive": lambda x: x <= 0,
    "not negative": lambda x: x < 0,
}
"""Whether a ball certainly is not what it has to be."""


def conditions(node: Node, motion: Motion) -> Iterator[tuple[Need, Expr]]:
    """What must be so for a tree to have a value, what is inside first. Raises ExpressionError.

    One over a tangent is read as the cotangent, which it is but where the tangent has no value.
    """
    if isinstance(node, Reciprocal) and isinstance(node.operand, Call) and node.operand.function == "tan":
        (angle,) = node.operand.arguments
        yield from conditions(angle, motion)
        yield "nonzero", apply("sin", motion.exact(angle))
        return
    for part in parts_of(node):
        yield from conditions(part, motion)
    match node:
        case Reciprocal(operand):
            yield "nonzero", motion.exact(operand)
        case Power(base, exponent):
            known = motion.exact(exponent).as_number
            if known is None or known.denominator != 1:
                yield "positive" if known is None or known < 0 else "not negative", motion.exact(base)
            elif known < 0:
                yield "nonzero", motion.exact(base)
        case Call(function, arguments) if function in FUNCTIONS:
            need, of = FUNCTIONS[function]
            yield need, of(*map(motion.exact, arguments))


def has_value(node: Node, motion: Motion) -> bool:
    """Whether it is proved that a tree has a value wherever the motion is defined."""
    try:
        return all(_is_met(need, e, motion) for need, e in conditions(node, motion))
    except ExpressionError:
        return False


def has_no_value(node: Node, motion: Motion) -> bool:
    """Whether it is proved that a tree has no value at some state where the motion is defined."""
    with suppress(ExpressionError):
        for need, e in conditions(node, motion):
            inner = motion.in_states(e)
            for place in states(motion):
                x = at_state(inner, motion, place)
                if x is not None and VIOLATED[need](x):
                    return True
    return False


def _is_met(need: Need, e: Expr, motion: Motion) -> bool:
    least = 0 if need == "not negative" else 1
    for form in dict.fromkeys((e, motion.in_states(e))):
        if need == "nonzero" and not open_factors(form, motion):
            return True
        sign = _sign(form)
        if sign is not None and sign >= least:
            return True
    return any(need == other and vanishes(e - each, motion) for other, each in needs(motion.base or motion))
