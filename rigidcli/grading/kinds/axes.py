"""Principal axes: pairs of a moment and its axis, judged by the eigen-problem that they solve.

Mechanics leaves open the order of the pairs, the sign of each axis, and every turn among axes to moments that
cannot be told apart: none of it is held against an answer, unless the question asks for it. With symbols, an
answer must solve the problem at every point at which they are given values. Where `ask: axes.axes` is asked,
the axes alone are an answer, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.outcome import Finding, Outcome, correct, wrong
from rigidcli.grading.principal.eigen import Match, match
from rigidcli.grading.principal.examples import examples
from rigidcli.grading.principal.findings import findings, has_length, of_set, with_reference
from rigidcli.grading.principal.key import Key, make, solutions
from rigidcli.grading.principal.pairs import Pairs

__all__ = ["examples", "judge", "read_key"]


def read_key(asked: Asked) -> Key:
    """The key of a question for principal axes. Raises ValueProblem."""
    key = make(asked)
    right = (each for each in solutions(asked, key) if _judged(key, key.typed(each)).verdict == "correct")
    key = replace(key, solution=next(right, None))
    if key.solution is None and asked.question.order == "ascending":
        raise ValueProblem(
            "the order of the moments depends on the symbols, or cannot be told", path=("order",)
        )
    return key


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """The outcome of a list of pairs, or of axes. Raises Unreadable."""
    return _judged(key, key.read(answer))


@np.errstate(over="ignore", invalid="ignore")
def _judged(key: Key, told: Sequence[Pairs]) -> Outcome:
    found = match(key.eigens, told)
    said = findings(key, told, found)
    if key.question.order == "ascending":
        ordered = match(key.eigens, told, ordered=True)
        if not ordered.complete and (found.complete or _is_descending(key, told)):
            said.append(Finding("wrong_order"))
        found = ordered
    if not said and found.complete:
        return correct()
    said = with_reference(key, said or [Finding("outside_tolerance")])
    return wrong(*said, share=_share(key, told, found))


def _is_descending(key: Key, told: Sequence[Pairs]) -> bool:
    """Whether a moment is less than the one before it."""
    moments = told[0].moments
    return moments is not None and bool((np.diff(moments) < -key.eigens[0].allowed.max()).any())


def _share(key: Key, told: Sequence[Pairs], found: Match) -> float:
    """The share of right pairs; one counts half where its moment or its axis alone is right."""
    right: list[int] = []
    for index, slot in found.places:
        if (
            found.axes[index, slot]
            and has_length(key, told, index)
            and not of_set(key, told, [*right, index])
        ):
            right.append(index)
    isotropic = all(eigen.isotropic for eigen in key.eigens)
    earned = 0.0
    for index, slot in found.places:
        moment = bool(found.moments[index, slot])
        # Where every direction is an axis, one is worth nothing without its moment.
        axis = index in right and (moment or not isotropic)
        earned += axis if told[0].moments is None else (moment + axis) / 2
    return earned / max(3, len(told[0]))
