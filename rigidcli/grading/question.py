"""An assignment as it is written: questions, what each asks for, and how its answers are judged."""

from __future__ import annotations

from decimal import Decimal
from typing import Annotated, Any, Literal

from pydantic import ConfigDict, Field, ValidationInfo

from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.quantities import AsList, Quantity
from rigidcli.fields.readers import Alternative, ReadBy, Title
from rigidcli.fields.section import Section

Positive = Annotated[float, Quantity(DIMENSIONLESS, "positive")]
NotNegative = Annotated[float, Quantity(DIMENSIONLESS, "nonnegative")]
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
    """How near an answer must be; with nothing given, the usual relative tolerance.

    `absolute` is in SI units, or has a unit; `angle` (rad) is between axes; `conserved` is the drift of
    conserved quantities along a trajectory, in units of their size.
    """

    relative: NotNegative | None = None
    absolute: Annotated[float, Quantity(None, "nonnegative")] | None = None
    significant_figures: Annotated[int, Field(ge=1, le=17)] | None = None
    figures: Literal["value", "written", "strict", "at_least"] = "value"
    angle: Annotated[float, Quantity(ANGLE, "positive")] | None = None
    conserved: Positive | None = None


AnyTolerance = Annotated[
    Tolerance,
    Alternative(
        int | float | Decimal,
        lambda raw, env: Tolerance.model_validate({"relative": raw}, context=env),
        otherwise=Tolerance,
        schema={"type": "number", "minimum": 0},
    ),
]
"""A tolerance; a number alone is a relative one."""

Share = Annotated[float, Field(ge=0, le=1)]
"""A part of the points of a question."""


def _read_credit(raw: object, info: ValidationInfo) -> str | dict[str, float]:
    """All by parts or as a whole, or the shares of codes."""
    if not isinstance(raw, dict):
        if raw not in ("parts", "whole"):
            raise ValueProblem(f"read {shown(raw)}, expected parts, whole, or a mapping from codes to shares")
        return str(raw)
    for code, share in raw.items():
        if isinstance(share, bool) or not isinstance(share, int | float) or not 0 <= share <= 1:
            raise ValueProblem(f"read {shown(share)}, expected a share from 0 to 1", path=(code,))
    return raw


_CREDIT = {
    "anyOf": [
        {"enum": ["parts", "whole"]},
        {"type": "object", "additionalProperties": {"type": "number", "minimum": 0, "maximum": 1}},
    ]
}


class Accepted(Section):
    """Another answer that earns a `credit`: literal, and of the kind of its question."""

    answer: Any
    credit: Share = 1.0
    message: str = ""


class Question(Section):
    """One question: what it asks of a document, or a literal answer of some kind."""

    model_config = ConfigDict(
        json_schema_extra={"oneOf": [{"required": ["document", "ask"]}, {"required": ["answer", "kind"]}]}
    )

    ONE_OF = ("ask", "answer")

    document: str | None = None
    ask: str | None = None
    answer: Any = None
    kind: KindName | None = None
    points: NotNegative = 1.0
    tolerance: AnyTolerance = Tolerance()
    order: Literal["free", "ascending"] = "free"
    direction: Literal["exact", "sense", "sign_free", "parallel"] = "exact"
    normalized: Literal["optional", "required"] = "optional"
    orthogonal: Literal["required", "optional"] = "required"
    handed: Literal["any", "right"] = "any"
    constant: Literal["allowed", "forbidden"] = "allowed"
    unit: Literal["optional", "required"] = "optional"
    modulo: Any = None
    symbols: dict[str, Literal["positive", "real"]] | None = None
    coordinates: Names = ()
    momenta: Names = ()
    velocities: Names = ()
    columns: Names = ()
    angles: Names = ()
    conserved: dict[str, str] | None = None
    form: Literal["any", "first_order"] = "any"
    numbers: Literal["symbols", "allowed"] = "symbols"
    products: Literal["minus", "plus"] = "minus"
    credit: Annotated[str | dict[str, float], ReadBy(_read_credit, _CREDIT)] = "parts"
    accept: Annotated[tuple[Accepted, ...], AsList] = ()


EVERYWHERE = frozenset({"document", "ask", "answer", "kind", "points", "tolerance", "credit", "accept"})
"""The options of every question."""


class Assignment(Section):
    """Questions by their names."""

    assignment: Title = ""
    questions: Annotated[dict[str, Question], Field(min_length=1)]


class AnswerFile(Section):
    """What a student hands in: answers by the names of their questions.

    Numbers may be texts or expressions, so that every answer is a text, a number, a list or a mapping.
    """

    student: Any = None
    answers: dict[str, Any] | None = None
