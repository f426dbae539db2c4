"""The key of principal axes: the eigen-problem that an answer must solve, and how near it must come.

Entries are numbers, or expressions in symbols where the question has any: a row of them is a moment with its
axis (4), or an axis (3). A tensor of numbers is one point; one with symbols is worked out at several.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from rigidcli.core.arithmetic import Array, Floats
from rigidcli.fields.units import Unit
from rigidcli.grading.arrays.entries import worked
from rigidcli.grading.arrays.reference import Reference
from rigidcli.grading.principal.eigen import Answer, Eigen, solve
from rigidcli.grading.question import Question, Tolerance

SMALLEST, LARGEST = 1e-290, 1e290
"""The range (kg m^2) in which the largest entry of a tensor must be."""

LAX = {
    "order": "free",
    "normalized": "optional",
    "orthogonal": "optional",
    "handed": "any",
    "unit": "optional",
}
"""Options under which a mistake explains an answer; what breaks a rule of the question is told besides."""


@dataclass(frozen=True, slots=True, eq=False)
class Key:
    """The solutions at each point, and how far off an axis may be in `angle` (rad) and `length`.

    `reference` has the entries of the tensor (3 by 3), or of pairs (3 by 4). Moments without a unit are in
    `unit`. `alone` says that axes need no moments. `solution` (3 by 4) has the moments, which ascend at the
    first point, and right-handed axes in entries, where they are known; `told` has it for those who may read
    it. `mistaken` has codes with the tensors (k by 3 by 3) under them. `columns` says that the axes of an
    answer stand in columns.
    """

    question: Question
    reference: Reference
    eigen: Eigen
    angle: float
    length: float
    unit: Unit
    alone: bool
    mistaken: tuple[tuple[str, Floats], ...]
    solution: Array | None = None
    told: str = ""
    columns: bool = False

    def typed(self, entries: Array, bare: tuple[int, ...] = ()) -> Answer:
        """Entries of an answer (n by 4, or by 3), worked out at each point."""
        values = worked(entries, self.reference.points)
        return Answer(values[..., 0] if values.shape[2] == 4 else None, values[..., -3:], bare, entries)

    def valued(self, tensors: Floats, tolerance: Tolerance | None = None) -> Key:
        """The key for other tensors (k by 3 by 3), and for nothing but their eigen-problem."""
        question = self.question.model_copy(update=LAX)
        eigen = solve(tensors, tolerance or question.tolerance, self.angle)
        solution = None if self.reference.names else eigen.solution
        return replace(self, question=question, eigen=eigen, solution=solution, mistaken=())

    def times(self, factor: float) -> Key:
        """The key for moments so many times as large.

        A factor below 1 takes an absolute tolerance with it, which would cover all that is small.
        """
        tolerance = self.question.tolerance
        smaller = tolerance.absolute and tolerance.absolute * min(1.0, abs(factor))
        return self.valued(self.eigen.tensors * factor, tolerance.model_copy(update={"absolute": smaller}))
