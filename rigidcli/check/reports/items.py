"""The questions as a class has answered them, and what a new run changes in the marks of an old one.

Many who err alone err differently. A wrong answer that several students share, and that no known mistake
leads to, is a reason to look at the key. Only what students wrote is shown, never a reference value.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import astuple, dataclass, fields
from typing import TypeAlias

import orjson

from rigidcli.check.base import VERDICTS, Judged, Judgement, Verdict
from rigidcli.check.reports import Style, read
from rigidcli.check.reports.formats import LONGEST_ANSWER, block, counted, csv_rows, json_line, painted, score
from rigidcli.errors import DocumentError, Problem, printable, shortened
from rigidcli.render.terminal import Row

MOST_SHOWN = 10
"""Wrong answers of a question that people are shown."""

UNNAMED = {
    "component_wrong", "equation_wrong", "not_an_eigenvector", "outside_tolerance", "term_wrong",
    "wrong_initial_condition",
}  # fmt: skip
"""Codes that say what is wrong, but not by which mistake."""

# Possessive, so that long digits are passed over once.
_NUMBER = re.compile(
    r"(?<![A-Za-z_0-9.])(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][-+]?[0-9]{1,3}+)?+(?![A-Za-z_0-9.])"
)


@dataclass(frozen=True, slots=True)
class Taken:
    """An answer that is not right, how many students gave it, and whether it casts doubt on the key."""

    answer: str
    students: int
    verdict: Verdict
    codes: tuple[str, ...]
    suspicious: bool


@dataclass(frozen=True, slots=True)
class Tally:
    """The answers to one question: how many have each verdict, and those that are not right.

    These begin with what waits for a person; the most frequent ones come first.
    """

    question: str
    verdicts: dict[Verdict, int]
    suspicious: bool
    answers: tuple[Taken, ...]


def tally(judgements: Iterable[Judgement]) -> tuple[Tally, ...]:
    """What the class has made of each question, those first of which an answer waits for a person."""
    given: dict[str, list[Judged]] = {}
    for judgement in judgements:
        for question in judgement.questions:
            given.setdefault(question.id, []).append(question)
    tallies = (_tally(id, answers) for id, answers in given.items())
    return tuple(sorted(tallies, key=lambda tally: not tally.verdicts["review"]))


def _tally(id: str, given: Sequence[Judged]) -> Tally:
    counts: dict[Verdict, int] = dict.fromkeys(VERDICTS, 0)
    counts |= Counter(each.verdict for each in given)
    # A key is not wrong because one slip is popular: it must be half as popular as the key.
    least = max(3, counts["correct"] / 2)
    typed, alike = dict[str, str](), Counter[tuple[str, Verdict, tuple[str, ...]]]()
    for each in given:
        if each.answer and each.verdict not in ("correct", "missing"):
            # Answers that differ in blanks and in the last digits only are the same.
            same = _NUMBER.sub(lambda number: f"{float(number[0]):.3g}", "".join(each.answer.split()))
            alike[typed.setdefault(same, each.answer), each.verdict, each.codes] += 1
    # What waits for a person, then what many have in common.
    ranked = sorted(alike.items(), key=lambda entry: (entry[0][1] != "review", -entry[1], entry[0]))
    answers = tuple(
        # Of a trajectory only the name of a file is known here, or the first rows: it looks like others.
        Taken(
            printable(answer),
            count,
            verdict,
            codes,
            count >= least and set(codes) <= UNNAMED and not answer.startswith(("{file:", "{csv:")),
        )
        for (answer, verdict, codes), count in ranked
    )
    return Tally(printable(id), counts, any(answer.suspicious for answer in answers), answers)


def table(tallies: Sequence[Tally], style: Style) -> Iterator[str]:
    """A block for each question: its counts, then the answers that are not right."""
    for tally in tallies:
        yield block((), [Row(((tally.question, "bold"),), counted(tally.verdicts))], style)
        widest = max((len(str(taken.students)) for taken in tally.answers), default=0)
        rows = []
        for taken in tally.answers[:MOST_SHOWN]:
            notes = [" ".join(taken.codes), "no known mistake: the key may be wrong" * taken.suspicious]
            lines = filter(None, [shortened(taken.answer, LONGEST_ANSWER), ", ".join(filter(None, notes))])
            heads = ((f"  {taken.students:>{widest}} x", ""), painted(taken.verdict))
            rows.append(Row(heads, "\n".join(lines)))
        yield block((), rows, style)
        if len(tally.answers) > MOST_SHOWN:
            yield f"  and {len(tally.answers) - MOST_SHOWN} other answers\n"
    doubted = [tally.question for tally in tallies if tally.suspicious]
    if doubted:
        doubt = "the key may be wrong: several gave the same answer, and no known mistake leads to it"
        yield "\n" + block((), [Row(((", ".join(doubted), ""),), doubt)], style)


def json(tallies: Sequence[Tally], style: Style) -> Iterator[str]:
    """One compact object a question, one a line."""
    for tally in tallies:
        answers = {"suspicious": tally.suspicious, "answers": tally.answers}
        yield json_line({"schema": "rigidcli.items/1", "question": tally.question} | tally.verdicts | answers)


HEADER = ("question", *VERDICTS, *(field.name for field in fields(Taken)))
"""The columns of csv."""


def csv(tallies: Sequence[Tally], style: Style) -> Iterator[str]:
    """A row for each answer that is not right, with the counts of its question; one where there is none."""
    rows = (
        (tally.question, *tally.verdicts.values(), *answer)
        for tally in tallies
        for answer in (map(astuple, tally.answers) if tally.answers else [(None,) * len(fields(Taken))])
    )
    return csv_rows(HEADER, rows, style)


TEXTS = {"table": table, "json": json, "csv": csv}
"""The formats of these tallies."""


# --- two runs

Run: TypeAlias = dict[tuple[str, str], str]
"""Marks in words, such as `partial 1/2`, by student and question."""


def run_of(path: str | os.PathLike[str]) -> Run:
    """The run that was written to a file with `-f json`. Raises DocumentError."""
    text, source = read(path)
    run: Run = {}
    for number, line in enumerate(text.removeprefix("\ufeff").splitlines(), 1):
        try:
            entry = orjson.loads(line)
            if entry["schema"] != "rigidcli.check/1":
                raise ValueError
            questions = [
                Judged(each["id"], "", "", "", each["verdict"], each["score"], each["max_score"])
                for each in entry["questions"]
            ]
            run |= _marks([Judgement(entry["student"], "", tuple(questions))])
        except (TypeError, KeyError, ValueError, AttributeError):
            hint = "an old run is what `rigidcli check -f json` has printed"
            message = "not an object of `rigidcli.check/1`"
            raise DocumentError([Problem(source, message, number, hint=hint)]) from None
    return run


def _marks(judgements: Iterable[Judgement]) -> Run:
    return {
        (printable(each.student), printable(question.id)): printable(f"{question.verdict} {score(question)}")
        for each in judgements
        for question in each.questions
    }


def changes(old: Run, judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """A line for each mark that differs, what waits for a person first, and below how many there are.

    Students of the new run come before those who are gone.
    """
    new = _marks(judgements)
    changed = [place for place in new | old if old.get(place) != new.get(place)]
    waiting = [place for place in changed if new.get(place, "").startswith("review")]
    rows = [
        Row(((place[0], "bold"), (place[1], "")), f"{old.get(place, 'none')} -> {new.get(place, 'none')}")
        for place in sorted(changed, key=lambda place: place not in waiting)
    ]
    yield block([], rows, style)
    counts = {"waiting for a person": len(waiting), "questions changed": len(changed)}
    words = ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
    yield block([(words or "nothing has changed", "")], [], style)
