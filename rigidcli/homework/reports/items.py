"""Statistics of the questions over a class, and the differences between two runs.

Many who err alone err differently. A wrong answer that several students share, and that no known mistake
leads to, is a reason to look at the key. Only what students wrote is shown, never a reference value.
"""

from __future__ import annotations

import os
import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, TypeAlias

import orjson

from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.fields.texts import safe_name
from rigidcli.homework.base import VERDICTS, Judgement, Verdict
from rigidcli.homework.reports import formats
from rigidcli.homework.reports.formats import ReportStyle, block, excerpt, json_line, painted
from rigidcli.homework.spreadsheets import read_own
from rigidcli.homework.variants import words
from rigidcli.language.numerals import UNSIGNED
from rigidcli.render.terminal import TextRow

MOST_SHOWN = 10  # wrong answers of a question that people are shown
# Codes that name no mistake.
UNNAMED = {
    "component_wrong", "equation_wrong", "not_an_eigenvector", "outside_tolerance", "term_wrong",
    "wrong_initial_condition",
}  # fmt: skip
# How a trajectory begins. Only the name of its file is known here, or its first rows, and so two that look
# alike may differ.
TRAJECTORY = ("{file:", "{csv:")
_NUMBER = re.compile(rf"(?<![A-Za-z_0-9.]){UNSIGNED}(?![A-Za-z_0-9.])")


class Taken(NamedTuple):
    """An answer that is not right, how many students gave it, and whether it casts doubt on the key.

    `values` are those of the variant of the students who gave it, in words.
    """

    answer: str
    students: int
    verdict: Verdict
    codes: tuple[str, ...]
    suspicious: bool
    values: str = ""


class Tally(NamedTuple):
    """The answers to one question: how many have each verdict, and those that are not right.

    These begin with what waits for a person; the most frequent ones come first.
    """

    question: str
    verdicts: dict[Verdict, int]
    suspicious: bool
    answers: tuple[Taken, ...]


def tally(judgements: Iterable[Judgement]) -> tuple[Tally, ...]:
    """The statistics of each question; those with answers that wait for a person come first."""
    students = [*judgements]
    names = dict.fromkeys(question.id for student in students for question in student.questions)
    tallies = (_tally(id, students) for id in names)
    return tuple(sorted(tallies, key=lambda tally: not tally.verdicts["review"]))


def _tally(id: str, students: Sequence[Judgement]) -> Tally:
    given = [own for student in students for own in student.questions if own.id == id]
    counts: dict[Verdict, int] = dict.fromkeys(VERDICTS, 0)
    counts |= Counter(each.verdict for each in given)
    # A key is not wrong because one slip is popular: it must be half as popular as the key.
    least = max(3, counts["correct"] / 2)
    typed, taken = dict[str, str](), Counter[tuple[str, Verdict, tuple[str, ...], str]]()
    for each in given:
        if each.answer and each.verdict not in ("correct", "missing"):
            answer = typed.setdefault(_same(each.answer), each.answer)
            taken[answer, each.verdict, each.codes, words(each.values)] += 1
    # What waits for a person, then what many have in common.
    ranked = sorted(taken.items(), key=lambda entry: (entry[0][1] != "review", -entry[1], entry[0]))
    answers = list[Taken]()
    for (answer, verdict, codes, values), count in ranked:
        doubted = count >= least and set(codes) <= UNNAMED and not answer.startswith(TRAJECTORY)
        answers.append(Taken(printable(answer), count, verdict, codes, doubted, printable(values)))
    doubted = any(answer.suspicious for answer in answers)
    return Tally(printable(id), counts, doubted, tuple(answers))


def _same(answer: str) -> str:
    """An answer without blanks and last digits, to compare answers by."""
    return _NUMBER.sub(lambda number: f"{float(number[0]):.3g}", "".join(answer.split()))


def table(tallies: Sequence[Tally], style: ReportStyle) -> Iterator[str]:
    """A block for each question: its counts, then the answers that are not right."""
    for tally in tallies:
        widest = max((len(str(taken.students)) for taken in tally.answers), default=0)
        rows = []
        for taken in tally.answers[:MOST_SHOWN]:
            notes = [" ".join(taken.codes), "no known mistake: the key may be wrong" * taken.suspicious]
            answer = excerpt(taken.answer) + f"  ({taken.values})" * bool(taken.values)
            lines = filter(None, [answer, ", ".join(filter(None, notes))])
            heads = ((f"  {taken.students:>{widest}} x", ""), painted(taken.verdict))
            rows.append(TextRow(heads, "\n".join(lines)))
        yield block(((tally.question, "bold"), (f"  {formats.counted(tally.verdicts)}", "")), rows, style)
        if len(tally.answers) > MOST_SHOWN:
            yield f"  and {len(tally.answers) - MOST_SHOWN} other answers\n"
    if doubted := ", ".join(tally.question for tally in tallies if tally.suspicious):
        doubt = "the key may be wrong: several gave the same answer, and no known mistake leads to it"
        yield "\n" + block((), [TextRow(((doubted, ""),), doubt)], style)


def json(tallies: Sequence[Tally], style: ReportStyle) -> Iterator[str]:
    """One compact object a question, one a line."""
    names = _columns(tallies)
    for tally in tallies:
        entry = {"schema": "rigidcli.items/1", "question": tally.question} | tally.verdicts
        answers = [dict(zip(names, answer, strict=False)) for answer in tally.answers]
        yield json_line(entry | {"suspicious": tally.suspicious, "answers": answers})


def _columns(tallies: Sequence[Tally]) -> Sequence[str]:
    """What is said of an answer: `values`, which come last, only where there are variants."""
    has_values = any(taken.values for tally in tallies for taken in tally.answers)
    return Taken._fields if has_values else Taken._fields[:-1]


def csv(tallies: Sequence[Tally], style: ReportStyle) -> Iterator[str]:
    """A row for each answer that is not right, with the counts of its question; one where there is none."""
    names = _columns(tallies)
    rows = (
        (tally.question, *tally.verdicts.values(), *answer[: len(names)])
        for tally in tallies
        for answer in tally.answers or [(None,) * len(names)]
    )
    return formats.csv_rows(["question", *VERDICTS, *names], rows, style)


TEXTS = {"table": table, "json": json, "csv": csv}


def render(format: str, judgements: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """The statistics of the questions in a format."""
    return TEXTS[format](tally(judgements), style)


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
