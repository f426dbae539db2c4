"""The answers of a class, question by question, and the differences between two runs.

Only what students wrote is shown, never a reference value.
"""

from __future__ import annotations

import os
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

import orjson

from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.fields.texts import safe_name
from rigidcli.homework.base import Judged, Judgement, Verdict
from rigidcli.homework.reports import formats
from rigidcli.homework.reports.formats import ReportStyle, block, excerpt, painted
from rigidcli.homework.spreadsheets import read_own
from rigidcli.homework.variants import words
from rigidcli.language.numerals import UNSIGNED
from rigidcli.render.terminal import TextRow

MOST_SHOWN = 10  # wrong answers of a question that are shown
_NUMBER = re.compile(rf"(?<![A-Za-z_0-9.]){UNSIGNED}(?![A-Za-z_0-9.])")


class Taken(NamedTuple):
    """An answer that is not right; `values` are those of its students' variant, in words."""

    answer: str
    verdict: Verdict
    codes: tuple[str, ...]
    values: str


def table(judgements: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """A block for each question: how many have each verdict, then the answers that are not right.

    Questions and answers that wait for a person come first, then the answers that many have in common.
    """
    given = defaultdict[str, list[Judged]](list)
    for student in judgements:
        for question in student.questions:
            given[question.id].append(question)
    counts = {id: Counter(each.verdict for each in questions) for id, questions in given.items()}
    for id in sorted(given, key=lambda id: not counts[id]["review"]):
        taken = _taken(given[id])
        widest = max((len(str(number)) for _, number in taken), default=0)
        rows = []
        for (answer, verdict, codes, values), number in taken[:MOST_SHOWN]:
            typed = excerpt(answer) + f"  ({values})" * bool(values)
            heads = ((f"  {number:>{widest}} x", ""), painted(verdict))
            rows.append(TextRow(heads, "\n".join(filter(None, [typed, " ".join(codes)]))))
        yield block(((printable(id), "bold"), (f"  {formats.counted(counts[id])}", "")), rows, style)
        if len(taken) > MOST_SHOWN:
            yield f"  and {len(taken) - MOST_SHOWN} other answers\n"


def _taken(questions: Sequence[Judged]) -> list[tuple[Taken, int]]:
    """The answers that are not right, each with how often it was given."""
    typed, taken = dict[str, str](), Counter[Taken]()
    for each in questions:
        if each.answer and each.verdict not in ("correct", "missing"):
            answer = printable(typed.setdefault(_same(each.answer), each.answer))
            taken[Taken(answer, each.verdict, each.codes, printable(words(each.values)))] += 1
    return sorted(taken.items(), key=lambda entry: (entry[0].verdict != "review", -entry[1], entry[0]))


def _same(answer: str) -> str:
    """An answer without blanks and last digits, to compare answers by."""
    return _NUMBER.sub(lambda number: f"{float(number[0]):.3g}", "".join(answer.split()))


# --- two runs

# Marks in words, such as `partial 1/2`, by student and question.
Run: TypeAlias = dict[tuple[str, str], str]


def run_of(path: str | os.PathLike[str]) -> Run:
    """The run that was written to a file with `-f json`. Raises DocumentError."""
    run: Run = {}
    for number, line in enumerate(read_own(path).removeprefix("\ufeff").splitlines(), 1):
        try:
            entry = orjson.loads(line)
            if entry["schema"] != "rigidcli.check/1":
                raise ValueError
            for each in entry["questions"]:
                mark = _mark(each["verdict"], each["score"], each["max_score"])
                run[printable(entry["student"]), printable(each["id"])] = mark
        except (TypeError, KeyError, ValueError, AttributeError):
            hint = "an old run is what `rigidcli check -f json` has printed"
            message = "not an object of `rigidcli.check/1`"
            raise DocumentError([Problem(safe_name(path), message, number, hint=hint)]) from None
    return run


def _mark(verdict: str, score: float, most: float) -> str:
    return printable(f"{verdict} {formats.points(score)}/{formats.points(most)}")


def changes(old: Run, judgements: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """A line for each mark that differs, what waits for a person first, and below how many there are.

    Students of the new run come before those who are gone.
    """
    new = {
        (printable(each.student), printable(own.id)): _mark(own.verdict, own.score, own.max_score)
        for each in judgements
        for own in each.questions
    }
    changed = [place for place in new | old if old.get(place) != new.get(place)]
    waiting = [place for place in changed if new.get(place, "").startswith("review")]
    rows = [
        TextRow(((place[0], "bold"), (place[1], "")), f"{old.get(place, 'none')} -> {new.get(place, 'none')}")
        for place in sorted(changed, key=lambda place: place not in waiting)
    ]
    yield block([], rows, style)
    counts = {"waiting for a person": len(waiting), "questions changed": len(changed)}
    words = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    yield block([(words or "nothing has changed", "")], [], style)
