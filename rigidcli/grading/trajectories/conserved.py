"""What the motion of a trajectory conserves: functions of its columns and the time."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from rigidcli.core.arithmetic import Floats
from rigidcli.errors import ValueProblem, at, shown
from rigidcli.grading.expressions.formula import names_in
from rigidcli.grading.question import RELATIVE, Question, Tolerance
from rigidcli.grading.trajectories.source import Source, size_of_terms
from rigidcli.grading.trajectories.tables import TIME
from rigidcli.symbolic.language import evaluation
from rigidcli.symbolic.language.expression import parse
from rigidcli.symbolic.language.tree import Name, Node

DRIFT = 10
"""The drift that is allowed by default, in units of the relative tolerance and of the sum of all terms."""

KEPT = 0.25
"""The part of this that the reference may drift by itself."""


@dataclass(frozen=True, slots=True, eq=False)
class Conserved:
    """A function of the columns `names` that stays within `allowed` of its first value.

    One that the question lists is `required`; others are what a document's study knows.
    """

    name: str
    root: Node
    names: frozenset[str]
    constants: Mapping[str, float]
    required: bool
    allowed: float = 0.0

    def values(self, columns: Mapping[str, Floats]) -> Floats:
        """What it is along a trajectory (k), of which `columns` (k each) has the time, too."""
        values = evaluation.array(self.root, {**self.constants, **columns})
        return np.broadcast_to(values, columns[TIME].shape)

    def is_kept(self, columns: Mapping[str, Floats], part: float = 1.0) -> bool:
        """Whether it stays the same, within a part of what is allowed."""
        values = self.values(columns)
        return bool((np.abs(values - values[0]) <= part * self.allowed).all())


def listed(source: Source, question: Question) -> list[Conserved]:
    """What the question says is conserved. Raises ValueProblem for names that have no values."""
    laws = []
    for name, text in (question.conserved or {}).items():
        with at("conserved", name):
            root = parse(text).root
        if isinstance(root, Name):  # `H` by its formula, so that answers need no column of it
            root = source.laws.get(root.name, root)
        law = _law(name, root, source, required=True)
        if law is None:
            unknown = min(names_in(root) - source.columns.keys() - source.constants.keys() - {TIME})
            raise ValueProblem(
                f"unknown name {shown(unknown)}",
                path=("conserved", name),
                hint=f"there are {', '.join([*source.columns, *source.constants])}",
            )
        laws.append(law)
    return laws


def conserved(
    source: Source, question: Question, given: list[Conserved], margins: Mapping[str, float]
) -> tuple[Conserved, ...]:
    """What is `given`, or else what the document's study knows, with the drift that is allowed.

    `margins` are those of the judged columns. Raises ValueProblem for something given that the reference
    does not keep; of what is known, that is left out, and what needs columns that answers need not have.
    """
    known = [_law(name, root, source, required=False) for name, root in source.laws.items()]
    columns = {**source.columns, TIME: source.times}
    kept = []
    for law in given or [law for law in known if law is not None and law.names <= margins.keys()]:
        bounded = replace(law, allowed=_allowed(law, columns, question.tolerance, margins))
        if bounded.is_kept(columns, KEPT):
            kept.append(bounded)
        elif law.required:
            problem = "the motion does not conserve this, or not within the tolerance"
            raise ValueProblem(problem, path=("conserved", law.name))
    return tuple(kept)


def _law(name: str, root: Node, source: Source, *, required: bool) -> Conserved | None:
    """A law of which it is not yet told how much it may drift; None where a name has no value."""
    names = names_in(root)
    columns = names & source.columns.keys()
    constants = {each: source.constants[each] for each in names - columns if each in source.constants}
    if names - columns - constants.keys() - {TIME}:
        return None
    return Conserved(name, root, columns, constants, required)


def _allowed(
    law: Conserved, columns: Mapping[str, Floats], tolerance: Tolerance, margins: Mapping[str, float]
) -> float:
    """The drift that is allowed; by default not less than that of an answer that is just right.

    That is twice what the law changes by where every judged column is wrong by as much as is allowed.
    """
    size = size_of_terms(law.root, {**law.constants, **columns})
    if tolerance.conserved is not None:
        return tolerance.conserved * size
    middle, spread = law.values(columns), 0.0
    for name in law.names & margins.keys():
        for side in (margins[name], -margins[name]):
            change = np.abs(law.values({**columns, name: columns[name] + side}) - middle)
            spread += float(np.max(change, where=np.isfinite(change), initial=0.0)) / 2
    return max(DRIFT * (tolerance.relative or RELATIVE) * size, 2 * spread)
