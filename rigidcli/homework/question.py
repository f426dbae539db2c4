"""An assignment as it is written: its questions, what each of them asks, and how its answers are judged.

The text below a field is what `rigidcli explain assignment` says of the key.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from decimal import Decimal
from typing import Annotated, Any, ClassVar, Literal

from pydantic import ConfigDict, Field

from rigidcli.errors import ValueProblem, shown
from rigidcli.fields.dimensions import ANGLE, DIMENSIONLESS
from rigidcli.fields.quantities import AsList, Quantity
from rigidcli.fields.section import Alternative, ReadBy, Section, Title
from rigidcli.homework.variants import SCHEMA, read_variants

NotNegative = Annotated[float, Quantity(DIMENSIONLESS, "nonnegative")]
Names = Annotated[tuple[str, ...], AsList]
KindName = Literal[
    "number", "quantity", "vector", "moments", "matrix", "tensor", "axes", "expression", "equations",
    "invariants", "trajectory", "choice",
]  # fmt: skip
# The tolerance of a question that names none: an answer of three figures may be wrong by half a percent.
RELATIVE = 0.01
# The codes that mean `right but for this`: a question may give a share of its points for them.
Credited = Literal[
    "unit_missing", "sign_error", "products_of_inertia_sign", "wrong_order", "axis_not_normalised",
    "additive_constant", "power_of_ten", "degrees_radians", "too_few_sig_figs", "second_order_form",
]  # fmt: skip


class Tolerance(Section, use_attribute_docstrings=True):
    """How near an answer must be to the key; a number alone is a relative tolerance."""

    relative: NotNegative | None = None
    """the largest error as a share of the value (default 0.01): `{relative: 0.02}`, or `tolerance: 0.02`"""
    absolute: Annotated[float, Quantity(None, "nonnegative")] | None = None
    """the largest error itself, in SI units or with a unit: `{absolute: 0.5 mm}`"""
    significant_figures: Annotated[int, Field(ge=1, le=17)] | None = None
    """the figures that must be typed, right to half a unit of the last: `{significant_figures: 3}`"""
    angle: Annotated[float, Quantity(ANGLE, "positive")] | None = None
    """the largest angle between an axis and the right one: `{angle: 1 deg}`"""


# A number alone is a relative tolerance.
AnyTolerance = Annotated[
    Tolerance,
    Alternative(
        int | float | Decimal,
        lambda raw, env: Tolerance.model_validate({"relative": raw}, context=env),
        otherwise=Tolerance,
        schema={"type": "number", "minimum": 0},
    ),
]
Share = Annotated[float, Field(ge=0, le=1)]  # a part of the points of a question


def _parts_or_whole(raw: str, _: object) -> str:
    if raw not in ("parts", "whole"):
        raise ValueProblem(f"read {shown(raw)}, expected parts, whole, or a mapping from codes to shares")
    return raw


# `parts`, `whole`, or the shares of codes that mean `right but for this`.
Credit = Annotated[
    str | dict[Credited, Share],
    Alternative(str, _parts_or_whole, otherwise=dict[Credited, Share], schema={"enum": ["parts", "whole"]}),
]


class Accepted(Section, use_attribute_docstrings=True):
    """Another answer that earns a share of the points."""

    answer: Any
    """the answer, of the kind of the question: `{answer: 9.8 m/s^2, credit: 0.5}`"""
    credit: Share = 1.0
    """the share of the points that it earns: `credit: 0.5`"""
    message: str = ""
    """what the student reads about it: `message: the spring is missing`"""


class Question(Section):
    """One question: what it asks of a document, or the answer itself with its kind."""

    model_config = ConfigDict(
        use_attribute_docstrings=True,
        json_schema_extra={"oneOf": [{"required": ["document", "ask"]}, {"required": ["answer", "kind"]}]},
    )

    ONE_OF = ("ask", "answer")
    NEEDS: ClassVar = {"document": "ask"}

    document: str | None = None
    """the file that the key is computed from, beside the assignment: `document: cube.yaml`"""
    ask: str | None = None
    """which result of the document is asked, by its path: `ask: inertia.tensor`, `ask: axes.moments.0`"""
    answer: Any = None
    """the key itself, as a student would type it: `answer: 20.8 rad/s`; it needs a `kind`"""
    kind: KindName | None = None
    """what is compared, and how: `kind: quantity`; a result of a document has one already"""
    points: NotNegative = 1.0
    """the points of a right answer: `points: 3`"""
    title: Title = ""
    """what students see above the feedback: `title: "Taylor 10.35 (a): the inertia tensor"`;
    `{m}` in it is the value of the variant m"""
    tolerance: AnyTolerance = Tolerance()
    """how near an answer must be: `tolerance: 0.02`, `tolerance: {absolute: 1 mm}`"""
    order: Literal["free", "ascending"] = "free"
    """whether a list of moments must be sorted: `order: ascending`"""
    direction: Literal["exact", "sense", "sign_free", "parallel"] = "exact"
    """what counts of a vector: all, its direction (`sense`), all but its sign (`sign_free`), its line"""
    normalized: Literal["optional", "required"] = "optional"
    """whether axes must be unit vectors: `normalized: required`"""
    orthogonal: Literal["required", "optional"] = "required"
    """whether axes of equal moments must be at right angles: `orthogonal: optional`"""
    constant: Literal["allowed", "forbidden"] = "allowed"
    """whether a Hamiltonian or Lagrangian is right up to a constant: `constant: forbidden`"""
    unit: Literal["optional", "required"] = "optional"
    """whether a number must have a unit; without one it is in the unit of the key: `unit: required`"""
    symbols: dict[str, Literal["positive", "real"]] | None = None
    """the letters of an expression, and what they stand for: `symbols: {m: positive, theta: real}`"""
    coordinates: Names = ()
    """the letters that are coordinates, whose velocities may be typed: `coordinates: [x, theta]`"""
    momenta: Names = ()
    """the letters that are their momenta, in the same order: `momenta: [p_x, p_theta]`"""
    velocities: Names = ()
    """the letters that are their velocities, in the same order: `velocities: [v, omega]`"""
    columns: Names = ()
    """the columns of a trajectory that are judged: `columns: [t, x]`"""
    angles: Names = ()
    """the columns that are angles, right up to full turns: `angles: [phi]`"""
    form: Literal["any", "first_order"] = "any"
    """whether equations of second order are accepted: `form: first_order` asks for Hamilton's"""
    numbers: Literal["symbols", "allowed"] = "symbols"
    """whether the document's values may stand for its letters: `numbers: allowed`"""
    products: Literal["minus", "plus"] = "minus"
    """the sign of products of inertia: `minus`, Ixy = -sum m x y (default), or `plus`"""
    credit: Credit = "parts"
    """points for a part: `parts` (default), `whole` (none), `{unit_missing: 0.5}` (right but for that)"""
    accept: Annotated[tuple[Accepted, ...], AsList] = ()
    """further answers and what they earn: `accept: [{answer: oblate, credit: 0.5, message: almost}]`"""


# The options of every question, and those of all kinds of answers that are formulas.
EVERYWHERE = frozenset(
    {"document", "ask", "answer", "kind", "points", "title", "tolerance", "credit", "accept"}
)
OF_FORMULAS = frozenset({"symbols", "coordinates", "momenta", "velocities", "numbers"})


class Assignment(Section, use_attribute_docstrings=True):
    """Questions by their names."""

    NEEDS: ClassVar = {"seed": "variants"}

    assignment: Title = ""
    """the name of the assignment, which reports show: `assignment: Homework 10`"""
    seed: Title | None = None
    """any text, from which the values of each student follow; keep it: `seed: autumn 2026`"""
    variants: Annotated[dict[str, tuple[str, ...]] | None, ReadBy(read_variants, SCHEMA)] = None
    """values of parameters of the documents, other ones for each student, which `{m}` in a `title` shows;
    a list or a range: `variants: {m: [1, 2, 3], a: {from: 2 cm, to: 5 cm, step: 5 mm}}`"""
    questions: Annotated[dict[str, Question], Field(min_length=1)]
    """the questions by the names that students answer: `10.35a: {document: cube.yaml, ask: axes}`"""

    @classmethod
    def _contradictions(cls, raw: Mapping[str, Any]) -> Iterator[ValueProblem]:
        yield from super()._contradictions(raw)
        if raw.get("variants") is not None and raw.get("seed") in (None, ""):
            hint = "write `seed: autumn 2026` above it, or any other text"
            message = "the values of students follow from a `seed`, which is missing"
            yield ValueProblem(message, path=("variants",), hint=hint)


class AnswerFile(Section, use_attribute_docstrings=True):
    """What a student hands in: answers by the names of their questions.

    Numbers may be texts or expressions, so that every answer is a text, a number, a list or a mapping.
    """

    student: Any = None
    """the name of the student, for people only: a mark goes to the name of the file or its folder"""
    answers: dict[str, Any] | None = None
    """the answers by the names of the questions: `10.3: 20.8 rad/s`"""
