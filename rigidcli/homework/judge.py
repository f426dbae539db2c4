"""One answer file, judged question by question, and many, each in a process that is confined.

One bad file is one bad row, and harms no other.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import chain
from pathlib import Path
from typing import Any, TypeAlias

from rigidcli.errors import ExpressionError, printable, shortened, shown
from rigidcli.fields.texts import safe_name
from rigidcli.homework.answers import as_typed, capped, read_answers
from rigidcli.homework.base import (
    CODES,
    MISSING,
    PLACES,
    AnswerKind,
    Finding,
    Judged,
    Judgement,
    Outcome,
    Progress,
    ReadAnswer,
    Tree,
    Unreadable,
)
from rigidcli.homework.doubts import (
    doubt_of_name,
    doubt_of_sides,
    doubt_of_words,
    is_defined_again,
    told_apart,
    with_definitions,
)
from rigidcli.homework.files import beside, read_file, whose_else
from rigidcli.homework.hand_ins import Paper
from rigidcli.homework.numbers import PURE
from rigidcli.homework.question import RELATIVE, Question
from rigidcli.homework.reading import odd_unit
from rigidcli.homework.variants import words
from rigidcli.homework.workers import each
from rigidcli.sandbox import LIMITS, ForbiddenError, LateError, Limits, timed, usable_cores
from rigidcli.suggestions import guess

SECONDS = 2.0  # of the processor that one answer may take, so that others have time, too
LONGEST_ANSWER = 2000  # characters of an answer that reports repeat
# Kinds of one value, and of several, in which what stands left of `=` is a name.
SINGLE = ("number", "quantity", "expression")
LISTS = ("vector", "moments", "matrix", "tensor")
LOST = Outcome.review("this student is not in the roster, and so the values of the questions are unknown")


@dataclass(frozen=True, slots=True)
class Item:
    """A question that is ready to judge answers: its kind, and the key that the kind has made.

    `changes` are the keys of mistaken problems with the codes of the mistakes; `reference` is the key in
    words, for feedback at the level `full`; `credit` is as the question has it. `accepted` has the keys of
    other answers, each with its share (0 to 1) of the points and what a student reads then. `values` are
    those of the student's variant that the question depends on, or names.
    """

    kind: AnswerKind
    key: Any
    points: float
    title: str = ""
    reference: str = ""
    credit: str | Mapping[Any, float] = "parts"
    accepted: tuple[tuple[Any, float, str], ...] = ()
    changes: tuple[tuple[str, Any], ...] = ()
    values: Mapping[str, str] = field(default_factory=dict)

    def judged(self, id: str, result: Outcome, answer: str = "", read_as: str = "") -> Judged:
        """The question of this name with the points that its outcome earns."""
        score = round(result.share * self.points, PLACES)
        marks = result.verdict, score, self.points, result.findings
        return Judged(id, self.title, answer, read_as, *marks, values=dict(self.values))


# Questions with answers that were judged before, for the many who answer alike.
Seen: TypeAlias = dict[tuple[str, str], Judged]


def judge(text: str, path: Path, items: Mapping[str, Item], seen: Seen | None = None) -> Judgement:
    """Judge the text of the answer file at `path`; files that it names are looked for beside it.

    What is `seen` is not judged again: the outcome follows from the question and the answer alone. Raises
    Unreadable where the text cannot be read.
    """
    seen = {} if seen is None else seen
    answers, notes = read_answers(text, items)
    if not answers and not notes:
        notes = ["there are no answers in it"]
    questions, files = list[Judged](), set[str]()
    for id, item in items.items():
        answer = answers.get(id)
        asked = id, f"{words(item.values)} {answer!r}"
        if asked in seen:
            questions.append(seen[asked])
            continue
        opened = list[Path]()
        result, read_as = outcome(item, answer, path, opened)
        files |= {safe_name(file.name) for file in opened}
        if result.share and (doubt := next(filter(None, (whose_else(file, path) for file in opened)), "")):
            result = Outcome.review(doubt)
        typed = shortened(as_typed(answer), LONGEST_ANSWER)
        questions.append(item.judged(id, result, typed, shortened(read_as, LONGEST_ANSWER)))
        # A file lies beside one answer only, and what cannot be read may be so for want of time or memory.
        is_lasting = not opened and result.verdict != "invalid"
        if is_lasting and len(asked[1]) <= LONGEST_ANSWER and len(seen) < 5000:  # some 30 MB
            seen[asked] = questions[-1]
    strange = [id for id in answers if id not in items]
    notes += capped(strange, lambda id: f"there is no question {shown(id)}{guess(id, items)}")
    return Judgement("", "", tuple(questions), tuple(notes), tuple(sorted(files)))


def same_for_all(items: Mapping[str, Item], result: Outcome) -> Judgement:
    """A hand-in with one outcome for all questions, such as of a file that cannot be read."""
    return Judgement("", "", tuple(item.judged(id, result) for id, item in items.items()))


def outcome(
    item: Item, answer: Tree | Unreadable, path: Path, opened: list[Path] | None = None
) -> tuple[Outcome, str]:
    """The outcome of one answer, whatever goes wrong in judging it, and how the answer was read.

    Files that it names lie beside the one at `path`, and are listed in `opened`.
    """
    if isinstance(answer, Unreadable):
        return answer.outcome, ""
    if answer is None or (isinstance(answer, str) and not answer.strip()):
        return MISSING, ""
    with suppress(LateError):
        with timed(SECONDS):
            try:
                text_of = partial(text_beside, path, [] if opened is None else opened)
                result, read_as = _judged(item, item.kind.loaded(answer, text_of))
            except Unreadable as unreadable:
                result, read_as = unreadable.outcome, ""
        return _with_reference(result, item), read_as
    return Unreadable("timeout").outcome, ""


def text_beside(path: Path, opened: list[Path], name: Tree) -> str:
    """The text of a file that lies beside the one at `path`; it is added to `opened`. Raises Unreadable."""
    opened.append(beside(name, path))
    return read_file(opened[-1], shown(name))


def _judged(item: Item, answer: Tree) -> tuple[Outcome, str]:
    outcome, read = _by_key(item.kind, item.key, answer)
    if outcome.verdict in ("partial", "incorrect"):
        named = {}
        for code, key in item.changes:
            with suppress(Unreadable, ArithmeticError, ValueError):
                if code not in named and item.kind.is_right(key, read.value):
                    named[code] = (Finding(code), *item.kind.judge(key, read.value).findings)
        if len(named) == 1:  # a mistake is named only where no other one explains the answer, too
            outcome = replace(outcome, findings=named.popitem()[1])
    outcome = _credited(item, outcome)
    for key, credit, message in item.accepted if outcome.verdict != "correct" else ():
        is_it = _by_key(item.kind, key, answer)[0].verdict == "correct"
        if is_it and credit >= outcome.share:
            outcome = Outcome.earning(credit, Finding("accepted", detail=message))
    return _doubted(item, answer, outcome), read.read_as


def _doubted(item: Item, answer: Tree, outcome: Outcome) -> Outcome:
    """The outcome, or `review` where words or a left side say that the value is not what was asked for."""
    kind = item.kind
    if kind.name in ("choice", "trajectory") or outcome.verdict in ("review", "invalid"):
        return outcome

    def is_right(side: str) -> bool:
        return _by_key(kind, item.key, side)[0].verdict == "correct"

    doubt = next(filter(None, map(doubt_of_words, _texts(answer))), "")
    if not doubt and isinstance(answer, str) and kind.name in LISTS:
        unit = item.key.ruler.unit or PURE
        doubt = doubt_of_sides(answer, unit, is_right) or doubt_of_name(answer, unit)
    if kind.name == "expression" and outcome.verdict == "correct" and not doubt:
        unit = odd_unit(told_apart(str(answer))[0], item.key.formulas.names)
        odd = f"this formula has another unit than {shown(unit)}" if unit else ""
        doubt = odd or doubt_of_name(str(answer), item.key.tree)
    return Outcome.review(doubt) if doubt else outcome


def _texts(answer: Tree) -> Iterator[str]:
    """The texts in an answer, the names in its mappings among them."""
    if isinstance(answer, str):
        yield answer
    elif isinstance(answer, list | dict):
        parts = [*answer, *answer.values()] if isinstance(answer, dict) else answer
        yield from chain.from_iterable(map(_texts, parts))


def _by_key(kind: AnswerKind, key: Any, answer: Tree) -> tuple[Outcome, ReadAnswer]:
    """The outcome by a key, and the answer as it was read."""
    read = ReadAnswer(None, "")
    try:
        read = _read(kind, key, answer)
        return Outcome.review(read.doubt) if read.doubt else kind.judge(key, read.value), read
    except Unreadable as unreadable:
        return unreadable.outcome, read
    except (MemoryError, RecursionError):
        return Unreadable("too_large", "it takes too much memory").outcome, read
    except ForbiddenError:
        return Unreadable("not_allowed").outcome, read
    except Exception as error:  # noqa: BLE001 - one answer on which a kind fails is no harm to the others
        return Outcome.review(f"it cannot be judged ({type(error).__name__})"), read


def _read(kind: AnswerKind, key: Any, answer: Tree) -> ReadAnswer:
    """An answer as its kind reads it; definitions of its letters behind it are not judged. Raises Unreadable.

    Where a letter is none of the question's, its definition is put in.
    """
    own, defined = answer, dict[str, str]()
    if isinstance(answer, str) and kind.name in (*SINGLE, *LISTS):
        own, defined = told_apart(answer)
    if defined and is_defined_again(own, defined):
        return ReadAnswer(None, "", "the name of the answer is defined again behind it")
    try:
        return kind.read(key, own)
    except Unreadable:
        if not defined:
            raise
        with suppress(Unreadable, ExpressionError):
            return kind.read(key, with_definitions(own, defined))
        raise


def _credited(item: Item, outcome: Outcome) -> Outcome:
    """The outcome by the option `credit`: whole points only, or shares for certain codes."""
    if item.credit == "whole" and outcome.verdict == "partial":
        return replace(outcome, verdict="incorrect", share=0.0)
    shares = {} if isinstance(item.credit, str) else item.credit
    codes = {finding.code for finding in outcome.findings}
    if codes and codes <= shares.keys() and outcome.verdict not in ("correct", "review"):
        return Outcome.earning(min(shares[code] for code in codes), *outcome.findings)
    return outcome


def _with_reference(outcome: Outcome, item: Item) -> Outcome:
    """The outcome with the key in its first finding, unless a finding tells it already."""
    has_reference = any(finding.reference for finding in outcome.findings)
    if outcome.verdict == "correct" or not item.reference or not outcome.findings or has_reference:
        return outcome
    first, *others = outcome.findings
    return replace(outcome, findings=(replace(first, reference=f"expected {item.reference}"), *others))


# --- many hand-ins


def run(
    items: Mapping[str, Item],
    papers: Sequence[Paper],
    jobs: int | None = None,
    progress: Progress = lambda share: None,
    limits: Limits = LIMITS,
    own: Mapping[str, Mapping[str, Item]] | None = None,
) -> Iterator[Judgement]:
    """Judge what was handed in, in that order, whatever is done first; `jobs` at a time, or one a core.

    `own` are the questions of each student, by the names of the students, where not all have the same
    `items`. Nobody knows the questions of a student who is not among them: a person must look. `progress`
    gets the share that is done. Raises ComputationError where no process can be started.
    """
    sheets = [items if own is None else own.get(paper.student) for paper in papers]
    both = list(zip(papers, sheets, strict=True))
    tasks = [
        (sheet, paper.file)
        for paper, sheet in both
        if sheet is not None and paper.file is not None and paper.outcome is None
    ]
    for item in items.values():  # forked workers find modules loaded and caches filled
        with suppress(Exception):  # what is wrong with a key, its own test says
            item.kind.judge(item.key, item.kind.read(item.key, item.kind.typed(item.key)).value)
    places = range(len(tasks))  # forks have the tasks, and need not be sent them
    results = each(partial(judge_file, tasks, {}), places, jobs or usable_cores(), limits, progress)
    for paper, sheet in both:
        result = paper.outcome or (LOST if sheet is None else next(results))
        if isinstance(result, bytes):
            judgement = Judgement.from_bytes(result)
        else:
            result = result.outcome if isinstance(result, Unreadable) else result
            judgement = same_for_all(sheet or items, result)
        yield replace(judgement, student=safe_name(paper.student), source=paper.source, late=paper.is_late)


def judge_file(tasks: Sequence[tuple[Mapping[str, Item], Path]], seen: Seen, place: int) -> bytes:
    """The judgement of an answer file, by the questions that it answers and its path."""
    items, path = tasks[place]
    try:
        return judge(read_file(path), path, items, seen).to_bytes()
    except Unreadable as unreadable:
        return same_for_all(items, unreadable.outcome).to_bytes()


# --- an assignment held against itself


def selftest(items: Mapping[str, Item], questions: Mapping[str, Question]) -> Iterator[tuple[str, bool]]:
    """For each question what it would do, in words, and whether its own key is judged to be right."""
    for id, item in items.items():
        result, read_as = outcome(item, item.kind.typed(item.key), Path())
        is_right = result.verdict == "correct"
        named = ", ".join(dict.fromkeys(code for code, _ in item.changes))
        # Formulas have a tolerance only where the question gives one: a decimal in them stands for all
        # numbers that round to it. Words have none.
        given = ", ".join(f"{key} {most:g}" for key, most in questions[id].tolerance if most is not None)
        tolerance = given or f"relative {RELATIVE:g}" * item.kind.has_tolerance
        lines = [
            f"{printable(id)}: {item.kind.name}, {item.points:.12g} point{'s' * (item.points != 1)}",
            f"  values     {printable(words(item.values))}" if item.values else "",
            f"  key        {printable(shortened(item.reference or read_as))}",
            f"  judged     {', '.join([result.verdict, *(CODES[each.code] for each in result.findings)])}",
            f"  tolerance  {tolerance}" if tolerance else "",
            f"  mistakes   {named}" if named else "",
        ]
        yield "".join(f"{line}\n" for line in lines if line), is_right
