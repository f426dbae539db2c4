"""An assignment as it is written: questions, what each asks for, and how its answers are judged."""

from __future__ import annotations

from typing import Annotated, Any, Literal

from pydantic import Field

from rigidcli.model.base import AsList, Section

Positive = Annotated[float, Field(gt=0, lt=1e100, strict=False, allow_inf_nan=False)]
NotNegative = Annotated[float, Field(ge=0, lt=1e100, strict=False, allow_inf_nan=False)]
Names = Annotated[tuple[str, ...], AsList]

KindName = Literal[
    "number",
    "quantity",
    "vector",
    "moments",
    "matrix",
    "tensor",
    "axes",
    "expression",
    "equations",
    "trajectory",
    "choice",
]

RELATIVE = 1e-3
"""The tolerance of a question that says nothing of it."""


class Tolerance(Section):
    """How near an answer must be; with nothing given, RELATIVE.

    `angle` (rad) is between axes; `conserved` is the drift of conserved quantities along a trajectory, in
    units of their size.
    """

    relative: NotNegative | None = None
    absolute: NotNegative | None = None
    significant_figures: Annotated[int, Field(ge=1, le=17)] | None = None
    figures: Literal["value", "written", "strict", "at_least"] = "value"
    angle: Positive | None = None
    conserved: Positive | None = None


class Question(Section):
    """One question: what it asks of a document, or a literal answer of some kind."""

    ONE_OF = ("ask", "answer")

    document: str | None = None
    ask: str | None = None
    answer: Any = None
    kind: KindName | None = None
    points: NotNegative = 1.0
    tolerance: Tolerance = Tolerance()
    order: Literal["free", "ascending"] = "free"
    direction: Literal["exact", "sense", "sign_free", "parallel"] = "exact"
    normalized: Literal["required", "optional"] = "required"
    orthogonal: Literal["required", "optional"] = "required"
    handed: Literal["any", "right"] = "any"
    constant: Literal["allowed", "forbidden"] = "allowed"
    unit: Literal["required", "optional"] = "required"
    modulo: Any = None
    symbols: dict[str, Literal["positive", "real"]] | None = None
    coordinates: Names = ()
    momenta: Names = ()
    velocities: Names = ()
    columns: Names = ()
    angles: Names = ()
    conserved: dict[str, str] | None = None


class Assignment(Section):
    """Questions by their names."""

    assignment: str = ""
    questions: Annotated[dict[str, Question], Field(min_length=1)]
