"""The questions as a class has answered them: which wrong answers are shared, and what they have in common.

Many who err alone err differently. A wrong answer that several students share, and that no known mistake
leads to, is a reason to look at the key. Only what students wrote is shown, never a reference value.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass

import orjson

from rigidcli.errors import printable
from rigidcli.grading.judgement import Judgement
from rigidcli.grading.outcome import VERDICTS, Verdict
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.csv import row
from rigidcli.grading.reports.layout import block, painted, shortened
from rigidcli.render.terminal import Row

SCHEMA = "rigidcli.items/1"


LEAST_SHARED = 3
"""Students who must share a wrong answer before the key is doubted."""

LEAST_SHARE = 0.05
"""The share that they must be of those who answered: in a large class, a few always agree."""

LEAST_BESIDE = 0.5
"""And beside those who answered as the key has it: a key is not wrong because one slip is popular."""

MOST_TOLD = 10
"""Wrong answers of a question that people are shown."""

LONGEST_ANSWER = 60
"""Characters of an answer that people are shown."""

UNNAMED = frozenset(
    [
        "component_wrong",
        "conserved_quantity_drift",
        "equation_wrong",
        "frequency_wrong",
        "kinetic_term_wrong",
        "not_an_eigenvector",
        "outside_tolerance",
        "potential_wrong",
        "term_wrong",
        "wrong_initial_condition",
    ]
)
"""Codes that tell what is wrong, but not by which mistake."""


@dataclass(frozen=True, slots=True)
class Taken:
    """A wrong answer, the number of students who gave it, and whether it casts doubt on the key."""

    answer: str
    students: int
    verdict: Verdict
    codes: tuple[str, ...]
    suspicious: bool


@dataclass(frozen=True, slots=True)
class Tally:
    """The answers to one question: how many have each verdict, and the wrong ones, most frequent first."""

    question: str
    correct: int
    partial: int
    incorrect: int
    invalid: int
    missing: int
    suspicious: bool
    answers: tuple[Taken, ...]


def tally(judgements: Iterable[Judgement]) -> tuple[Tally, ...]:
    """What the class has made of each question, in the order of the assignment."""
    verdicts: dict[str, Counter[Verdict]] = {}
    wrong: dict[str, Counter[tuple[str, Verdict, tuple[str, ...]]]] = {}
    for judgement in judgements:
        for question in judgement.questions:
            verdicts.setdefault(question.id, Counter())[question.verdict] += 1
            answers = wrong.setdefault(question.id, Counter())
            if question.answer and question.verdict not in ("correct", "missing"):
                answers[question.answer, question.verdict, tuple(dict.fromkeys(question.codes))] += 1
    return tuple(_tally(id, verdicts[id], wrong[id]) for id in verdicts)


def _tally(
    id: str, verdicts: Counter[Verdict], wrong: Counter[tuple[str, Verdict, tuple[str, ...]]]
) -> Tally:
    given = verdicts.total() - verdicts["missing"]
    least = max(LEAST_SHARED, LEAST_SHARE * given, LEAST_BESIDE * verdicts["correct"])
    answers = tuple(
        Taken(printable(answer), count, verdict, codes, count >= least and _is_unexplained(answer, codes))
        for (answer, verdict, codes), count in sorted(wrong.items(), key=lambda entry: (-entry[1], entry[0]))
    )
    counts = {verdict: verdicts[verdict] for verdict in VERDICTS}
    doubted = any(answer.suspicious for answer in answers)
    return Tally(printable(id), **counts, suspicious=doubted, answers=answers)


def _is_unexplained(answer: str, codes: tuple[str, ...]) -> bool:
    # Of a trajectory only the name of a file is known here, or the first rows: it looks like others.
    return set(codes) <= UNNAMED and not answer.startswith(("{file:", "{csv:"))


def table(tallies: Sequence[Tally], style: Style) -> Iterator[str]:
    """A block for each question: its counts, then wrong answers, the most frequent ones first."""
    for tally in tallies:
        counts = ", ".join(f"{count} {verdict}" for verdict, count in _counts(tally) if count)
        rows = [Row(((tally.question, "bold"),), counts)]
        yield block((), rows, style) + block((), _answers(tally), style)
        if len(tally.answers) > MOST_TOLD:
            yield f"  and {len(tally.answers) - MOST_TOLD} other wrong answers\n"
    doubted = [tally.question for tally in tallies if tally.suspicious]
    if doubted:
        told = "the key may be wrong: several gave the same answer, and no known mistake leads to it"
        yield "\n" + block((), [Row(((", ".join(doubted), ""),), told)], style)


def _answers(tally: Tally) -> list[Row]:
    """The most frequent wrong answers, and what they are judged to be."""
    widest = max((len(str(taken.students)) for taken in tally.answers), default=0)
    rows = []
    for taken in tally.answers[:MOST_TOLD]:
        note = "no known mistake: the key may be wrong" if taken.suspicious else ""
        why = ", ".join(filter(None, [" ".join(taken.codes), note]))
        told = [shortened(taken.answer, LONGEST_ANSWER), *filter(None, [why])]
        heads = ((f"  {taken.students:>{widest}} x", ""), painted(taken.verdict))
        rows.append(Row(heads, "\n".join(told)))
    return rows


def _counts(tally: Tally) -> list[tuple[Verdict, int]]:
    return [(verdict, getattr(tally, verdict)) for verdict in VERDICTS]


def json(tallies: Sequence[Tally], style: Style) -> Iterator[str]:
    """One compact object a question, one a line."""
    for tally in tallies:
        yield orjson.dumps({"schema": SCHEMA} | asdict(tally)).decode() + "\n"


HEADER = ("question", *VERDICTS, "answer", "students", "verdict", "codes", "suspicious")


def csv(tallies: Sequence[Tally], style: Style) -> Iterator[str]:
    """A row for each wrong answer, with the counts of its question; one for a question without any."""
    if style.header:
        yield row(*HEADER)
    for tally in tallies:
        counts = [count for _, count in _counts(tally)]
        for taken in tally.answers:
            codes = " ".join(taken.codes)
            answer = (taken.answer, taken.students, taken.verdict, codes, taken.suspicious)
            yield row(tally.question, *counts, *answer)
        if not tally.answers:
            yield row(tally.question, *counts, *[None] * 5)


TEXTS = {"table": table, "json": json, "csv": csv}
"""The formats in which it is told."""
