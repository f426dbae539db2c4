"""Proofs that entries in symbols are right whatever values the symbols have, and not at some points alone."""

from __future__ import annotations

from collections.abc import Sequence
from fractions import Fraction
from zlib import crc32

import numpy as np

from rigidcli.algebra.allowance import Allowance
from rigidcli.algebra.expansion import coefficients
from rigidcli.algebra.expressions import Expr, symbol
from rigidcli.algebra.fractions import lowest_terms
from rigidcli.algebra.reading import from_tree
from rigidcli.algebra.substitution import substitute
from rigidcli.algebra.trees import to_tree
from rigidcli.algebra.trigonometry import elementary_angles
from rigidcli.core.arithmetic import Array
from rigidcli.errors import ExpressionError, ValueProblem
from rigidcli.grading.arrays.entries import as_typed, filled, times
from rigidcli.grading.arrays.reference import Reference, Typed
from rigidcli.grading.expressions.agreement import Function
from rigidcli.grading.expressions.formula import Vocabulary
from rigidcli.grading.expressions.ground import ground
from rigidcli.grading.numbers import margin
from rigidcli.grading.question import Tolerance
from rigidcli.language.expression import Expression, parse

MAX_STEPS = 20_000
"""Steps that a proof may take, a few hundredths of a second."""


def are_numbers(entries: Array) -> bool:
    """Whether no entry holds a symbol."""
    return not any(isinstance(entry, Expression) for entry in entries.flat)


def exact(key: Reference, entries: Array) -> Array:
    """Entries of a key, or of an answer to it, as exact expressions. Raises ExpressionError."""
    real = {name for name, sign in (key.question.symbols or {}).items() if sign == "real"}
    values = {name: symbol(name, positive=name not in real) for name in key.names}
    for name, definition in key.derived.items():
        values[name] = from_tree(definition, values)
    return filled([from_tree(parse(as_typed(entry)).root, values) for entry in entries.flat], entries.shape)


def simple(e: Expr) -> Expr:
    """An expression multiplied out over one denominator. Raises ExpressionError where it is too large."""
    allowance = Allowance(MAX_STEPS)
    return lowest_terms(elementary_angles(lowest_terms(e, allowance)[0], allowance), allowance)[0]


def agree(one: Expr, other: Expr, tolerance: Tolerance, *, signs: Sequence[int] = (-1, 1)) -> bool:
    """Whether two expressions are the same, or polynomials whose coefficients are nearly so.

    Those of several terms may have these `signs`: where all have one, and the symbols are positive, no sum is
    less than a term. Raises ExpressionError where they are too large.
    """
    names = sorted(one.names | other.names)
    if not names or not simple(one - other).terms:
        return True
    told, right = (coefficients(simple(each), names) for each in (one, other))
    if told is None or right is None or told.keys() != right.keys():
        return False
    pairs = [(float(told[powers]), float(right[powers])) for powers in right]
    sure = len(pairs) == 1 or {int(np.sign(own)) for _, own in pairs} <= set(signs)
    return sure and all(abs(mine - own) <= margin(own, tolerance) for mine, own in pairs)


def are_proved(key: Reference, answer: Typed) -> bool:
    """Whether an answer that is right at all points is so whatever values the symbols have.

    Parameters that an entry leaves out may have the values that the document gives them.
    """
    if answer.entries is None or are_numbers(answer.entries):
        return True
    facing = key.facing(answer)
    try:
        told, right = exact(key, answer.entries), exact(key, times(facing.entries, facing.numbers))
        if "length" in key.symmetry:
            largest = np.unravel_index(np.abs(key.values[0]).argmax(), key.shape)
            told, right = told * right[largest], right * told[largest]
        given = {name: Expr({(): Fraction(repr(key.points[0][name]))}) for name in key.given}
        for mine, own in zip(told.flat, right.flat, strict=True):
            left_out = {name: value for name, value in given.items() if name not in mine.names}
            own = substitute(own, left_out)
            if not (agree(mine, own, key.tolerance) or _is_same_function(key, mine, own)):
                return False
    except (ExpressionError, ValueProblem):
        return False
    return True


def _is_same_function(key: Reference, one: Expr, other: Expr) -> bool:
    """Whether two expressions are proved to be the same as functions are, also in half angles and the like.

    Raises ValueProblem where the other has hardly any values.
    """
    real = {name for name, sign in (key.question.symbols or {}).items() if sign == "real"}
    names = Vocabulary({name: "real" if name in real else "positive" for name in sorted(key.names)})
    where = ground(to_tree(other), names, (), crc32(key.question.model_dump_json().encode()))
    return Function(to_tree(one), where).is_same(Function(to_tree(other), where)) is True
