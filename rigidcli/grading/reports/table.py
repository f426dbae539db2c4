"""For people: each student with what is not right, then the class as a whole."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace

from rigidcli.errors import printable
from rigidcli.grading.feedback import remarks
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.outcome import VERDICTS
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.layout import beside, bold, columns, padded, painted, points, wrapped

_VERDICT = max(map(len, VERDICTS))


def render(judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A block for each student, and a summary below when there are several."""
    scores: list[float] = []
    most = 0.0
    counts: dict[str, Counter[str]] = {}
    for judgement in judgements:
        yield "".join(f"{line}\n" for line in _block(judgement, style))
        scores.append(judgement.score)
        most = judgement.max_score
        for question in judgement.questions:
            counts.setdefault(printable(question.id), Counter())[question.verdict] += 1
    if len(scores) > 1:
        yield "".join(f"{line}\n" for line in _summary(scores, most, counts, style.width))


def _block(judgement: Judgement, style: Style) -> Iterator[str]:
    """The student and the score, then the questions that are not right or have a remark."""
    name, score = printable(judgement.student), _score(judgement)
    if all(question.verdict == "correct" for question in judgement.questions):
        score += "  all correct"
    yield from _heading(name, score, style)
    shown = [q for q in _as_one(judgement) if q.verdict != "correct" or remarks(q, style.feedback)]
    ids = max((columns(printable(question.id)) for question in shown), default=0)
    scores = [_score(question) for question in shown]
    for question, score in zip(shown, scores, strict=True):
        left = f"  {padded(printable(question.id), ids)}  {score:>{max(map(len, scores))}}  "
        told = [remark.message for remark in remarks(question, style.feedback)]
        for line in beside(f"{left}{question.verdict:{_VERDICT}}", told, style.width):
            yield painted(line, len(left), question.verdict) if style.colour else line


def _heading(name: str, score: str, style: Style) -> Iterator[str]:
    if style.width is None or columns(name) + 2 + len(score) <= style.width:
        yield f"{bold(name) if style.colour else name}  {score}"
        return
    for line in wrapped(name, style.width):
        yield bold(line) if style.colour else line
    yield f"  {score}"


def _as_one(judgement: Judgement) -> Sequence[Judged]:
    """The questions, or a single one for all of them where the same is said of each."""
    kinds = {(question.verdict, question.findings) for question in judgement.questions}
    if len(kinds) > 1 or len(judgement.questions) < 2 or judgement.questions[0].verdict == "correct":
        return judgement.questions
    whole = replace(judgement.questions[0], score=judgement.score, max_score=judgement.max_score)
    return [replace(whole, id="every question")]


def _summary(
    scores: Sequence[float], most: float, counts: dict[str, Counter[str]], width: int | None
) -> Iterator[str]:
    """The mean score, and of each question the share of right answers and the number with each verdict."""
    mean = sum(scores) / len(scores)
    share = f" ({mean / most:.0%})" if most else ""
    yield ""
    yield f"{len(scores)} students, mean {points(mean)}/{points(most)}{share}"
    ids = max(map(columns, counts))
    for id, verdicts in counts.items():
        told = ", ".join(f"{verdicts[verdict]} {verdict}" for verdict in VERDICTS if verdicts[verdict])
        head = f"  {padded(id, ids)}  {verdicts['correct'] / len(scores):>4.0%}"
        yield from beside(head, [told], width)


def _score(earned: Judgement | Judged) -> str:
    return f"{points(earned.score)}/{points(earned.max_score)}"
