"""What all kinds of answers share: keys, answers as they are read, marks, and findings."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from decimal import ROUND_HALF_UP, Decimal
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Literal, NamedTuple, TypeAlias, get_args

import orjson
from pydantic import TypeAdapter

from rigidcli.errors import printable, shortened
from rigidcli.homework import Feedback

if TYPE_CHECKING:
    from rigidcli.document.document import Document
    from rigidcli.homework.question import Question
    from rigidcli.report import Report

Tree: TypeAlias = Any  # an answer as it was typed: texts (numbers too), None, and lists and mappings of them
Tell: TypeAlias = Callable[[str, Sequence[str]], None]  # gets the name of a file, and the notes on it
Progress: TypeAlias = Callable[[float], None]  # gets the share that is done
# The verdicts in the order of reports: what waits for a person first.
Verdict: TypeAlias = Literal["review", "correct", "partial", "incorrect", "invalid", "missing"]
VERDICTS: tuple[Verdict, ...] = get_args(Verdict)
# Codes for programs, and the sentences that students read. A sentence may follow the name of the part that is
# meant (`Ixy: not right`). It holds no number, so that it cannot give a reference value away.
_LINES = Path(__file__).with_name("codes.csv").read_text("utf-8").splitlines()[1:]
CODES = dict(line.split(",", 1) for line in _LINES)


@dataclass(frozen=True, slots=True)
class Finding:
    """One remark on an answer.

    `place` names the part that is meant (`Ixy`, `row 2`), `detail` says more of what was read. Neither may
    hold a reference value or lead to one. `reference` may; only `--feedback full` shows it.
    """

    code: str
    place: str = ""
    detail: str = ""
    reference: str = ""


def verdict_of(earned: float, most: float) -> Verdict:
    """The verdict on an answer that earns so many of the points."""
    if earned >= most:
        return "correct"
    return "partial" if earned > 0 else "incorrect"


@dataclass(frozen=True, slots=True)
class Outcome:
    """The verdict on one answer, the share (0 to 1) of its points that it earns, and the remarks on it."""

    verdict: Verdict
    share: float
    findings: tuple[Finding, ...] = ()

    @classmethod
    def correct(cls, *findings: Finding) -> Outcome:
        """A right answer, perhaps with remarks."""
        return cls("correct", 1.0, findings)

    @classmethod
    def earning(cls, share: float, *findings: Finding) -> Outcome:
        """An answer that earns this share of its points."""
        return cls(verdict_of(share, 1.0), max(0.0, min(share, 1.0)), findings)

    @classmethod
    def review(cls, detail: str, *findings: Finding) -> Outcome:
        """An answer that a person must judge, with the reason."""
        return cls("review", 0.0, (Finding("undecided", detail=detail), *findings))


class Unreadable(Exception):  # noqa: N818 - it carries findings to their outcome
    """The answer cannot be read as one of its kind. `findings` has all that is wrong with it."""

    def __init__(
        self, code: str, detail: str = "", *, place: str = "", also: tuple[Finding, ...] = ()
    ) -> None:
        super().__init__(detail)
        self.findings = (Finding(code, place, detail), *also)

    @property
    def outcome(self) -> Outcome:
        """The outcome of an answer that cannot be read."""
        return Outcome("invalid", 0.0, self.findings)


@dataclass(frozen=True, slots=True, eq=False)
class KeySource:
    """The right answer of the question called `name`, and where it comes from.

    A literal key (`answer` of a question) is a `Tree` in `value`, read by the rules of a student's answer.
    A key from a document (`ask`) has the `document`, the `report` of its study, and the `path` of the ask,
    such as `("inertia", "tensor")`. Its `value` is that of the report, in the SI unit `unit`: a float, an
    array, a tree of an expression or a text.
    """

    name: str
    question: Question
    value: Any
    unit: str = ""
    path: tuple[str, ...] = ()
    document: Document | None = None
    report: Report | None = None


class ReadAnswer(NamedTuple):
    """An answer as it was read: the `value` for the judge, and `read_as`, the text that students see.

    A `doubt` says why a person must look at it, whatever the value is.
    """

    value: Any
    read_as: str
    doubt: str = ""


class AnswerKind(ABC):
    """One kind of answer. It has no state: all that judging needs is in the key, which can be pickled.

    `options` are the options of a question that this kind uses, besides those of every question. A kind that
    `has_tolerance` has one also where the question names none.
    """

    name: ClassVar[str]
    options: ClassVar[frozenset[str]] = frozenset()
    has_tolerance: ClassVar[bool] = True

    @abstractmethod
    def key(self, source: KeySource) -> Any:
        """The key of a question. Raises ValueProblem where what is asked is not of this kind."""

    def loaded(self, answer: Tree, text_of: Callable[[Tree], str]) -> Tree:
        """An answer with the texts of the files that it names, which `text_of` reads. Raises Unreadable."""
        return answer

    @abstractmethod
    def read(self, key: Any, answer: Tree) -> ReadAnswer:
        """An answer to the question of this key. Raises Unreadable."""

    @abstractmethod
    def judge(self, key: Any, value: Any) -> Outcome:
        """The outcome of an answer that has been read, with the share that `credit: parts` gives."""

    def is_right(self, key: Any, value: Any) -> bool:
        """Whether the outcome would be `correct`; a kind may say so sooner than it finds what is wrong."""
        return self.judge(key, value).verdict == "correct"

    def mistaken(self, source: KeySource, key: Any) -> Iterator[tuple[str, Any]]:
        """The codes of mistakes, and the keys of the problems that they lead to.

        The key about the centre of mass, with the products of inertia flipped, or with T - V for T + V: an
        answer that is right by the keys of exactly one mistake is explained by it.
        """
        return iter(())

    @abstractmethod
    def typed(self, key: Any) -> Tree:
        """The key as a student would type it; judging this answer gives `correct`."""


# --- marks

PLACES = 6  # decimal places of a score: shares such as 1/3 need an end
MISSING = Outcome("missing", 0.0)  # of a student, or a question, without an answer
# The codes of unreadable parts of an answer, such as one of several equations.
UNREAD = frozenset(["parse_error", "unknown_symbol", "too_large"])


@dataclass(frozen=True, slots=True)
class Judged:
    """One question of a hand-in: the `answer` as it was typed, `read_as`, how it was read, and its mark.

    `values` are those of the student's variant, in words by the names of the parameters.
    """

    id: str
    title: str
    answer: str
    read_as: str
    verdict: Verdict
    score: float
    max_score: float
    findings: tuple[Finding, ...] = ()
    values: Mapping[str, str] = field(default_factory=dict)

    @property
    def codes(self) -> tuple[str, ...]:
        """The codes of the findings, without repetition, in their order."""
        return tuple(dict.fromkeys(finding.code for finding in self.findings))

    @property
    def sentences(self) -> list[str]:
        """What is said of the answer, one sentence a finding."""
        return [sentence(finding) for finding in self.findings]

    @property
    def message(self) -> str:
        """The sentences, one a line."""
        return "\n".join(self.sentences)

    @property
    def reading(self) -> str:
        """How the answer was read, where that says more than what was typed: brackets and blanks do not."""
        typed, read = ([c for c in text if c not in " \n\t[]{}:;=,"] for text in (self.answer, self.read_as))
        return "" if typed == read else self.read_as

    @property
    def is_urgent(self) -> bool:
        """Whether a person must look at it first: it is not judged, or not read, or not all of it is read."""
        return not UNREAD.isdisjoint(self.codes) or self.verdict in ("review", "invalid")

    def overridden(self, score: float, reason: str) -> Judged:
        """The question as a person has judged it."""
        finding, verdict = Finding("overridden", detail=reason), verdict_of(score, self.max_score)
        return replace(self, verdict=verdict, score=score, findings=(finding,))


@dataclass(frozen=True, slots=True)
class Judgement:
    """What a student has handed in, judged; `source` is the answer file, empty where there is none.

    `notes` are for the instructor, and `files` lie beside the answer file, which names them. It is `late` if
    the platform says so.
    """

    student: str
    source: str
    questions: tuple[Judged, ...]
    notes: tuple[str, ...] = ()
    files: tuple[str, ...] = ()
    late: bool = False

    def to_bytes(self) -> bytes:
        """The judgement as one process hands it to another: plain JSON, never objects."""
        return orjson.dumps(self)

    @classmethod
    def from_bytes(cls, data: bytes) -> Judgement:
        """A judgement from another process."""
        return _reader().validate_json(data)

    @property
    def score(self) -> float:
        """Points earned."""
        return round(sum((question.score for question in self.questions), 0.0), PLACES)

    @property
    def max_score(self) -> float:
        """Points that could be earned."""
        return round(sum((question.max_score for question in self.questions), 0.0), PLACES)

    @property
    def beside(self) -> list[str]:
        """The files that the answers name, as reports name them."""
        return [str(Path(self.source).parent / name) for name in self.files]

    @property
    def is_overridden(self) -> bool:
        """Whether a person has given a score for any question."""
        return any("overridden" in question.codes for question in self.questions)

    def score_to(self, places: int) -> float:
        """Points earned, rounded half up to so many decimal places, as a gradebook has them."""
        return float(Decimal(str(self.score)).quantize(Decimal(1).scaleb(-places), ROUND_HALF_UP))


_reader = cache(lambda: TypeAdapter(Judgement))


def reported(judgement: Judgement, feedback: Feedback) -> Judgement:
    """A hand-in as reports show it, with what waits for a person before the other questions.

    All texts are safe to print, and only the level `full` has references.
    """
    questions = list[Judged]()
    for question in sorted(judgement.questions, key=lambda question: question.verdict != "review"):
        findings = question.findings if feedback.reasons else ()
        if feedback is not Feedback.full:
            findings = tuple(replace(finding, reference="") for finding in findings)
        safe = replace(question, id=printable(question.id), title=printable(question.title))
        answer, read_as = printable(question.answer), printable(question.read_as)
        questions.append(replace(safe, answer=answer, read_as=read_as, findings=findings))
    student, source = printable(judgement.student), printable(judgement.source)
    return replace(judgement, student=student, source=source, questions=tuple(questions))


def sentence(finding: Finding) -> str:
    """What a student reads of a finding."""
    text = f"{finding.place}: {CODES[finding.code]}" if finding.place else CODES[finding.code]
    text = f"{text}; {shortened(finding.detail, 500)}" if finding.detail else text
    return printable(f"{text}; {finding.reference}" if finding.reference else text)
