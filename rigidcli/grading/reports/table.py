"""For people: each student with what is not right, then the class as a whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from rigidcli.errors import printable
from rigidcli.grading.feedback import remarks
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.outcome import VERDICTS, Verdict
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.layout import block, columns, padded, painted, points
from rigidcli.render.terminal import Row


def render(judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A block for each student, and a summary below when there are several."""
    scores: list[float] = []
    most = 0.0
    counts: dict[str, Counter[Verdict]] = {}
    for judgement in judgements:
        score = _score(judgement)
        if all(question.verdict == "correct" for question in judgement.questions):
            score += "  all correct"
        yield block(
            ((printable(judgement.student), "bold"), (f"  {score}", "")), _told(judgement, style), style
        )
        scores.append(judgement.score)
        most = judgement.max_score
        for question in judgement.questions:
            counts.setdefault(printable(question.id), Counter())[question.verdict] += 1
    if len(scores) > 1:
        mean = sum(scores) / len(scores)
        share = f" ({mean / most:.0%})" if most else ""
        head = f"{len(scores)} students, mean {points(mean)}/{points(most)}{share}"
        yield "\n" + block(((head, ""),), _summary(len(scores), counts), style)


def _told(judgement: Judgement, style: Style) -> list[Row]:
    """The questions that are not right, and those with a remark."""
    shown = [q for q in _as_one(judgement) if q.verdict != "correct" or remarks(q, style.feedback)]
    ids = max((columns(printable(question.id)) for question in shown), default=0)
    scores = max((len(_score(question)) for question in shown), default=0)
    return [
        Row(
            (
                (f"  {padded(printable(question.id), ids)}", ""),
                (f"{_score(question):>{scores}}", ""),
                painted(question.verdict),
            ),
            "\n".join(remark.message for remark in remarks(question, style.feedback)),
        )
        for question in shown
    ]


def _as_one(judgement: Judgement) -> Sequence[Judged]:
    """The questions, or a single one for all of them where the same is said of each."""
    kinds = {(question.verdict, question.findings) for question in judgement.questions}
    if len(kinds) > 1 or len(judgement.questions) < 2 or judgement.questions[0].verdict == "correct":
        return judgement.questions
    whole = replace(judgement.questions[0], score=judgement.score, max_score=judgement.max_score)
    return [replace(whole, id="every question")]


def _summary(students: int, counts: dict[str, Counter[Verdict]]) -> list[Row]:
    """Of each question, the share of right answers and the number with each verdict."""
    ids = max(map(columns, counts), default=0)
    return [
        Row(
            ((f"  {padded(id, ids)}", ""), (f"{verdicts['correct'] / students:>4.0%}", "")),
            ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in VERDICTS if verdicts[verdict]),
        )
        for id, verdicts in counts.items()
    ]


def _score(earned: Judgement | Judged) -> str:
    return f"{points(earned.score)}/{points(earned.max_score)}"
