"""What is never zero, or has a value, wherever a motion is defined."""

from __future__ import annotations

from contextlib import suppress
from functools import lru_cache

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.atoms import Group
from rigidcli.algebra.expressions import Expr, atomic, factored, product
from rigidcli.algebra.fractions import factors
from rigidcli.algebra.trees import to_tree
from rigidcli.errors import ExpressionError
from rigidcli.grading.equations.motion import Motion
from rigidcli.grading.equations.truth import at_state, proportional, states, vanishes
from rigidcli.grading.expressions.domains import conditions, least_sign
from rigidcli.grading.values import VIOLATED, Need
from rigidcli.language.tree import Node

STEPS = 20_000
"""Steps that a search for factors may take, a few hundredths of a second."""


def _sign(e: Expr) -> int | None:
    """The least sign of an expression by the signs of its factors, where those of terms do not tell."""
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
    return tuple(
        (need, product(of()))
        for e in motion.rates.values()
        for need, of in conditions(to_tree(e), motion.exact)
    )


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


def has_value(node: Node, motion: Motion) -> bool:
    """Whether it is proved that a tree has a value wherever the motion is defined."""
    try:
        return all(_is_met(need, product(of()), motion) for need, of in conditions(node, motion.exact))
    except ExpressionError:
        return False


def has_no_value(node: Node, motion: Motion) -> bool:
    """Whether it is proved that a tree has no value at some state where the motion is defined."""
    with suppress(ExpressionError):
        for need, of in conditions(node, motion.exact):
            inner = motion.in_states(product(of()))
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
