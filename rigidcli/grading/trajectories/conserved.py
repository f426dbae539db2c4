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
from rigidcli.language import evaluation
from rigidcli.language.expression import parse
from rigidcli.language.tree import Name, Node

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


def laws_of(source: Source, question: Question) -> list[Conserved]:
    """What the question says is conserved, or else what the document's study knows.

    It is not yet told how much each may drift. Raises ValueProblem for names that have no values.
    """
    laws = []
    for name, text in (question.conserved or {}).items():
        with at("conserved", name):
            root = parse(text).root
        # `H` is meant by its formula, so that answers need no column of it.
        law = _law(name, source.laws.get(root.name, root) if isinstance(root, Name) else root, source, True)
        if unknown := law.names - source.columns.keys():
            hint = f"there are {', '.join([*source.columns, *source.constants])}"
            raise ValueProblem(f"unknown name {shown(min(unknown))}", path=("conserved", name), hint=hint)
        laws.append(law)
    return laws or [_law(name, root, source, False) for name, root in source.laws.items()]


def _law(name: str, root: Node, source: Source, required: bool) -> Conserved:
    others = {TIME, *source.constants}.difference(source.columns)
    return Conserved(name, root, frozenset(names_in(root) - others), source.constants, required)


def conserved(
    laws: list[Conserved], source: Source, tolerance: Tolerance, margins: Mapping[str, float]
) -> tuple[Conserved, ...]:
    """The laws with the drift that is allowed, as far as answers must have the columns for them.

    `margins` are those of the columns that are asked for. Raises ValueProblem for a required law that the
    reference does not keep; another is left out.
    """
    columns = {**source.columns, TIME: source.times}
    kept = []
    for law in laws:
        if law.required or law.names <= margins.keys():
            bounded = replace(law, allowed=_allowed(law, columns, tolerance, margins))
            if bounded.is_kept(columns, KEPT):
                kept.append(bounded)
            elif law.required:
                problem = "the motion does not conserve this, or not within the tolerance"
                raise ValueProblem(problem, path=("conserved", law.name))
    return tuple(kept)


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
