"""What mistakes make of a key of principal axes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import replace
from math import log10

from rigidcli.grading.factors import CONSTANTS
from rigidcli.grading.principal.eigen import Answer, Eigen
from rigidcli.grading.principal.key import LARGEST, LAX, SMALLEST, Key

NO_FACTOR = 0.1
"""A common factor as near to 1 as this is no mistake with a name."""

FACTOR_SLACK = 1e-2
"""How near a factor must be to a power of ten, or to a constant, to be tried as one."""


def worked_out(code: str) -> Callable[[Key], Iterator[Key]]:
    """What makes the keys whose tensors come out under this mistake."""

    def changes(key: Key) -> Iterator[Key]:
        changed = (key.valued(tensors) for name, tensors in key.mistaken if name == code)
        # Where directions are free, axes by themselves tell little.
        return (each for each in changed if not key.alone or each.eigen.distinct)

    return changes


def in_columns(key: Key) -> Iterator[Key]:
    """The key of axes that stand in columns instead of rows."""
    if not key.alone or key.eigen.distinct:
        yield replace(key, question=key.question.model_copy(update=LAX), mistaken=(), columns=True)


def by_factor(code: str) -> Callable[[Key, Answer], Iterator[Key]]:
    """What makes the key with the common factor that the moments of an answer have, if it is this mistake."""

    def fits(key: Key, answer: Answer) -> Iterator[Key]:
        return (key.times(factor) for name, factor in _factors(key.eigen, answer) if name == code)

    return fits


def _factors(eigen: Eigen, answer: Answer) -> Iterator[tuple[str, float]]:
    """The common factor that moments may have, and the mistake that it is.

    Where moments differ any number may be one; else it is one that often stands for a mistake.
    """
    if answer.moments is None:
        return
    told, right = (max(each[0].tolist(), key=abs) for each in (answer.moments, eigen.moments))
    factor = told / right
    if not all(SMALLEST < abs(size) < LARGEST for size in (told, factor)) or abs(factor - 1) <= NO_FACTOR:
        return
    power = 10.0 ** round(log10(abs(factor)))
    if abs(factor + 1) <= NO_FACTOR:
        yield "sign_error", -1.0
    elif abs(factor / power - 1) <= FACTOR_SLACK:
        yield "power_of_ten", power
    elif not eigen.same[0][:, eigen.moments[0] != 0][eigen.moments[0] != 0].all():
        yield "constant_factor", factor
    else:
        named = (exact for size in CONSTANTS for exact in (size, 1 / size))
        yield from (("constant_factor", each) for each in named if abs(factor / each - 1) <= FACTOR_SLACK)
