"""For people: what needs a person, each student with what is not right, then the class as a whole."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from statistics import fmean

from rigidcli.check.base import VERDICTS, Judged, Judgement, Verdict
from rigidcli.check.reports import Style
from rigidcli.errors import shortened
from rigidcli.render.terminal import Page, Part, Row

NARROWEST = 30
"""Columns that remarks must have beside their heads on a terminal; otherwise they stand below them."""

LONGEST_ANSWER = 60
"""Characters of an answer that a table shows."""

COLOURS: dict[Verdict, str] = {
    "review": "magenta",
    "correct": "green",
    "partial": "yellow",
    "incorrect": "red",
    "invalid": "red",
    "missing": "yellow",
}
"""The colours of verdicts on a terminal."""

SHARED = ("review", "invalid", "missing")
"""Verdicts that stand in one row where all questions have them for the same reason: these earn no points."""

_VERDICT = max(map(len, VERDICTS))


def table(students: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A block for each student, and where there are several, a summary and all that needs a person.

    What needs a person is read first.
    """
    seen = list(students)
    parts = ["".join(_block(student, style) for student in seen)]
    if len(seen) > 1:
        parts = [_urgent(seen, style), *parts, _summary(seen, style)]
    yield "\n".join(filter(None, parts))


def _block(student: Judgement, style: Style) -> str:
    """A student, the questions that are not right, and those with a remark."""
    shown = [q for q in as_one(student) if q.verdict != "correct" or q.findings]
    widest = max((len(score(question)) for question in shown), default=0)
    rows = [
        Row(
            ((f"  {question.id}", ""), (f"{score(question):>{widest}}", ""), painted(question.verdict)),
            "\n".join(filter(None, [question.title, _answer(question, style), question.message])),
        )
        for question in shown
    ]
    right = all(question.verdict == "correct" for question in student.questions)
    earned = f"  {score(student)}{'  all correct' if right else ''}"
    return block(((student.student, "bold"), (earned, "")), rows, style)


def _answer(question: Judged, style: Style) -> str:
    """The answer as it was typed, and how it was read where that says more."""
    if not question.answer or not style.feedback.reasons:
        return ""
    typed, read_as = (shortened(text, LONGEST_ANSWER) for text in (question.answer, question.reading))
    return f"`{typed}`" + (f", read as `{read_as}`" if read_as else "")


def as_one(student: Judgement) -> Sequence[Judged]:
    """The questions, or one for all of them where they have the same remarks, no answer and no points."""
    first, said = student.questions[0], {(each.verdict, each.findings) for each in student.questions}
    answered = any(question.answer for question in student.questions)
    if len(student.questions) == 1 or len(said) > 1 or first.verdict not in SHARED or answered:
        return student.questions
    return [replace(first, id="every question", title="", max_score=student.max_score)]


def urgent(students: Sequence[Judgement]) -> list[tuple[int, Judged]]:
    """The answers that a person must look at, with the places of their students: first what is not judged."""
    hands = ((place, question) for place, student in enumerate(students) for question in as_one(student))
    return sorted((hand for hand in hands if hand[1].is_urgent), key=lambda hand: hand[1].verdict != "review")


def _urgent(students: Sequence[Judgement], style: Style) -> str:
    """The answers that a person must look at, if there are any."""
    rows = [
        Row(
            ((f"  {students[place].student}", "bold"), (question.id, ""), painted(question.verdict)),
            "\n".join(filter(None, [_answer(question, style), question.message])),
        )
        for place, question in urgent(students)
    ]
    if not rows:
        return ""
    count = "1 answer needs a person" if len(rows) == 1 else f"{len(rows)} answers need a person"
    return block(((f"{count}: not judged, or not readable", COLOURS["review"]),), rows, style)


def _summary(students: Sequence[Judgement], style: Style) -> str:
    """The mean, and of each question the share of right answers and the number with each verdict."""
    counts = defaultdict[str, Counter[Verdict]](Counter)
    for student in students:
        for question in student.questions:
            counts[question.id][question.verdict] += 1
    rows = [
        Row(((f"  {id}", ""), (f"{verdicts['correct'] / len(students):>4.0%}", "")), counted(verdicts))
        for id, verdicts in sorted(counts.items(), key=lambda entry: not entry[1]["review"])
    ]
    return block(((mean_of(students), ""),), rows, style)


def mean_of(students: Sequence[Judgement]) -> str:
    """How many students there are, and their mean."""
    mean, most = fmean(student.score for student in students), students[-1].max_score
    count = "1 student" if len(students) == 1 else f"{len(students)} students"
    return f"{count}, mean {points(mean)}/{points(most)}{share(mean, most)}"


def block(head: Sequence[Part], rows: Sequence[Row], style: Style) -> str:
    """A line, unless `head` is empty, and rows below it."""
    page = Page(style.width, style.colour)
    if head:
        page.line(*head)
    page.rows(rows, room=NARROWEST)
    return str(page)


def painted(verdict: Verdict) -> Part:
    """A verdict in its colour, as wide as the longest one."""
    return f"{verdict:{_VERDICT}}", COLOURS[verdict]


def counted(verdicts: Mapping[Verdict, int]) -> str:
    """How many have each verdict."""
    return ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in VERDICTS if verdicts[verdict])


def points(number: float) -> str:
    """A score for people: two decimals at most."""
    return f"{round(number, 2) or number:.12g}"


def share(part: float, most: float) -> str:
    """A share of the points in brackets, if there are points."""
    return f" ({part / most:.0%})" if most else ""


def score(earned: Judgement | Judged) -> str:
    """The points that are earned, of those that could be."""
    return f"{points(earned.score)}/{points(earned.max_score)}"
