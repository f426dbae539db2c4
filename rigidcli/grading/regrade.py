"""What a new run changes in an old one, which is read back from its json."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass
from itertools import groupby
from typing import Annotated, Any, Literal, TypeAlias

import orjson
from pydantic import BaseModel, ConfigDict, Field, ValidationError

from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.grading.feedback import Feedback, codes, remarks
from rigidcli.grading.judgement import Judgement
from rigidcli.grading.outcome import Verdict
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.csv import row
from rigidcli.grading.reports.json import SCHEMA as CHECK
from rigidcli.grading.reports.layout import block, columns, padded, points
from rigidcli.grading.reports.reading import name_of, read_bytes
from rigidcli.render.terminal import Row

SCHEMA = "rigidcli.regrade/1"

_Score = Annotated[float, Field(allow_inf_nan=False)]


class _Entry(BaseModel):
    """An object of an old run; keys that a later version may add are passed over."""

    model_config = ConfigDict(frozen=True, strict=True)


class OldRemark(_Entry):
    """What was told of an answer."""

    code: str


class OldQuestion(_Entry):
    """A question as it was judged."""

    id: str
    verdict: Verdict
    score: _Score
    max_score: _Score
    feedback: list[OldRemark]


class OldJudgement(_Entry):
    """An answer file as it was judged."""

    schema_: Annotated[Literal["rigidcli.check/1"], Field(alias="schema")]
    student: str
    source: str
    score: _Score
    max_score: _Score
    questions: list[OldQuestion]


@dataclass(frozen=True, slots=True)
class Mark:
    """What a question was judged to be; the `verdict` of a whole answer file is empty."""

    verdict: Verdict | Literal[""]
    score: float
    max_score: float
    codes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Change:
    """A question whose mark is another one than it was: None where there is, or was, none.

    `question` is empty where a whole student is new, or gone.
    """

    student: str
    question: str
    old: Mark | None
    new: Mark | None


def read(path: str | os.PathLike[str]) -> tuple[OldJudgement, ...]:
    """The run that was written to a file with `-f json`. Raises DocumentError."""
    source = name_of(path)
    return parse(read_bytes(path, source), source)


def parse(data: bytes, source: str) -> tuple[OldJudgement, ...]:
    """The run in lines of JSON objects, or in one JSON array of them. Raises DocumentError."""
    data = data.removeprefix(b"\xef\xbb\xbf")
    try:
        tree: Any = orjson.loads(data)
    except orjson.JSONDecodeError:
        lines = [(number, line) for number, line in enumerate(data.splitlines(), 1) if line.strip()]
        return tuple(_judgement(_tree(line, source, number), source, number) for number, line in lines)
    return tuple(_judgement(entry, source) for entry in (tree if isinstance(tree, list) else [tree]))


def _tree(line: bytes, source: str, number: int) -> Any:
    try:
        return orjson.loads(line)
    except orjson.JSONDecodeError as error:
        raise DocumentError([Problem(source, f"not JSON: {error.msg}", number)]) from None


def _judgement(tree: Any, source: str, line: int | None = None) -> OldJudgement:
    try:
        return OldJudgement.model_validate(tree)
    except ValidationError as error:
        hint = "an old run is what `rigidcli check -f json` has printed"
        key = ".".join(map(str, error.errors()[0]["loc"]))
        message = f"not an object of `{CHECK}`"
        raise DocumentError([Problem(source, message, line, key, hint)]) from None


_Marks: TypeAlias = dict[str, Mark]
"""The marks of an answer file by question; that of the whole file is under an empty name."""

_Whose: TypeAlias = tuple[str, str]
"""The student and the source of an answer file."""


def changes(
    old: Sequence[OldJudgement], new: Iterable[Judgement], feedback: Feedback = Feedback.hint
) -> tuple[Change, ...]:
    """What has changed, student by student: those of the new run first, then those who are gone.

    Codes count where both runs tell them.
    """
    told = feedback in (Feedback.hint, Feedback.full) and any(
        q.feedback for each in old for q in each.questions
    )
    before = [((each.student, each.source), _old_marks(each, told)) for each in old]
    after = [((each.student, each.source), _new_marks(each, told)) for each in new]
    repeated = _repeated(before) | _repeated(after)
    was, now = _by_name(before, repeated), _by_name(after, repeated)
    return tuple(change for name in now | was for change in _of_student(name, was.get(name), now.get(name)))


def _old_marks(judgement: OldJudgement, told: bool) -> _Marks:
    marks = {"": Mark("", judgement.score, judgement.max_score)}
    for question in judgement.questions:
        given = dict.fromkeys(printable(remark.code) for remark in question.feedback) if told else ()
        mark = Mark(question.verdict, question.score, question.max_score, tuple(given))
        marks[printable(question.id)] = mark
    return marks


def _new_marks(judgement: Judgement, told: bool) -> _Marks:
    marks = {"": Mark("", judgement.score, judgement.max_score)}
    for question in judgement.questions:
        given = codes(remarks(question, Feedback.hint)) if told else ()
        mark = Mark(question.verdict, question.score, question.max_score, given)
        marks[printable(question.id)] = mark
    return marks


def _repeated(run: Sequence[tuple[_Whose, _Marks]]) -> set[str]:
    """Students of whom a run has several answer files."""
    counts = Counter(student for (student, _), _ in run)
    return {student for student, count in counts.items() if count > 1}


def _by_name(run: Sequence[tuple[_Whose, _Marks]], repeated: set[str]) -> dict[str, _Marks]:
    """The marks by student, told apart by their source where that is needed."""
    return {
        printable(f"{student} ({source})" if student in repeated else student): marks
        for (student, source), marks in run
    }


def _of_student(student: str, old: _Marks | None, new: _Marks | None) -> Iterator[Change]:
    if old is None or new is None:
        yield Change(student, "", old[""] if old else None, new[""] if new else None)
        return
    for question in new | old:
        if question and old.get(question) != new.get(question):
            yield Change(student, question, old.get(question), new.get(question))


def table(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A block for each student, and how much has changed below."""
    ids = max((columns(change.question) for change in found), default=0)
    for student, group in groupby(found, key=lambda change: change.student):
        yield block([(student, "bold")], [_row(change, ids) for change in group], style)
    yield block([(_summary(found), "")], [], style)


def _row(change: Change, ids: int) -> Row:
    if change.question:
        told = f"{_text(change.old)} -> {_text(change.new)}"
        return Row(((f"  {padded(change.question, ids)}", ""),), told)
    return Row((("  new" if change.old is None else "  gone", ""),), _text(change.new or change.old))


def _text(mark: Mark | None) -> str:
    if mark is None:
        return "nothing"
    score = f"{points(mark.score)}/{points(mark.max_score)}"
    given = f"({' '.join(mark.codes)})" if mark.codes else ""
    return " ".join(filter(None, [mark.verdict, score, given]))


def _summary(found: Sequence[Change]) -> str:
    """How much has changed, in one line."""
    if not found:
        return "nothing has changed"
    questions = [change for change in found if change.question]
    counts = [
        ("questions changed", len(questions)),
        ("students concerned", len({change.student for change in questions})),
        ("new students", sum(change.old is None for change in found if not change.question)),
        ("students gone", sum(change.new is None for change in found if not change.question)),
    ]
    return ", ".join(f"{name}: {count}" for name, count in counts if count)


def json(found: Sequence[Change], style: Style) -> Iterator[str]:
    """One compact object a change, one a line."""
    for change in found:
        yield orjson.dumps({"schema": SCHEMA} | asdict(change)).decode() + "\n"


HEADER = (
    *("student", "question", "old_verdict", "new_verdict"),
    *("old_score", "new_score", "old_max_score", "new_max_score", "old_codes", "new_codes"),
)


def csv(found: Sequence[Change], style: Style) -> Iterator[str]:
    """A row for each change; that of a whole student has an empty question."""
    if style.header:
        yield row(*HEADER)
    for change in found:
        pairs = zip(_cells(change.old), _cells(change.new), strict=True)
        yield row(change.student, change.question, *(cell for pair in pairs for cell in pair))


def _cells(mark: Mark | None) -> tuple[str | float | None, ...]:
    if mark is None:
        return (None,) * 4
    return mark.verdict, mark.score, mark.max_score, " ".join(mark.codes)


TEXTS = {"table": table, "json": json, "csv": csv}
"""The formats in which it is told."""
