"""Statistics of the questions over a class, and the differences between two runs.

Many who err alone err differently. A wrong answer that several students share, and that no known mistake
leads to, is a reason to look at the key. Two students who share several wrong answers that hardly anybody
else has given are a reason to look at both. Only what students wrote is shown, never a reference value.
"""

from __future__ import annotations

import os
import re
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import combinations
from statistics import correlation, fmean
from typing import NamedTuple, TypeAlias

import orjson

from rigidcli.errors import DocumentError, Problem, printable
from rigidcli.fields.texts import safe_name
from rigidcli.homework.base import PLACES, VERDICTS, Judged, Judgement, Verdict
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
# A wrong answer is rare if at most three students gave it, or at most one in forty of a large class.
RARE, SHARE_OF_RARE = 3, 40
MANY_SHARED = 3  # questions with the same rare wrong answer from which on students are named
LEAST_CLASS = 3  # students for a correlation: of two it is always 1 or -1


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

    These begin with what waits for a person; the most frequent ones come first. `right` is the share of right
    answers, and `correlation` tells how they go with the rest of the score; None where there is none.
    """

    question: str
    verdicts: dict[Verdict, int]
    suspicious: bool
    answers: tuple[Taken, ...]
    right: float | None = None
    correlation: float | None = None


class Alike(NamedTuple):
    """Students who have given the same rare wrong answers to several questions."""

    students: tuple[str, ...]
    questions: tuple[str, ...]


def tally(judgements: Iterable[Judgement]) -> tuple[Tally, ...]:
    """The statistics of each question; those with answers that wait for a person come first."""
    students = [*judgements]
    names = dict.fromkeys(question.id for student in students for question in student.questions)
    tallies = (_tally(id, students) for id in names)
    return tuple(sorted(tallies, key=lambda tally: not tally.verdicts["review"]))


def _tally(id: str, students: Sequence[Judgement]) -> Tally:
    given = [(own, student) for student in students for own in student.questions if own.id == id]
    counts: dict[Verdict, int] = dict.fromkeys(VERDICTS, 0)
    counts |= Counter(each.verdict for each, _ in given)
    # A key is not wrong because one slip is popular: it must be half as popular as the key.
    least = max(3, counts["correct"] / 2)
    typed, taken = dict[str, str](), Counter[tuple[str, Verdict, tuple[str, ...], str]]()
    for each, _ in given:
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
    return Tally(printable(id), counts, doubted, tuple(answers), *_analysis(given))


def _analysis(given: Sequence[tuple[Judged, Judgement]]) -> tuple[float | None, float | None]:
    """The share of right answers to a question, and their correlation with the rest of the score.

    The latter is the point-biserial correlation of x, which is 1 for a right answer and else 0, and the score
    y in all other questions,

        r = (mean of y where x = 1 - mean of y where x = 0) / s * sqrt(p (1 - p)),

    where p is the share of right answers and s the standard deviation of y (the root of the mean square).
    It is Pearson's correlation of x and y: see the notes of scipy.stats.pointbiserialr. The question itself
    is not in y, as it would go with itself: S. Henrysson, Psychometrika 28 (1963) 211. It is None where x or
    y is the same for all, and for fewer than three students.

    Who has answered nothing does not count, nor, for this question, whose answer waits for a person. A partly
    right answer is not right.
    """
    right, rest = list[float](), list[float]()
    for own, student in given:
        took_part = any(each.answer or each.verdict in ("correct", "partial") for each in student.questions)
        if took_part and own.verdict != "review":
            right.append(float(own.verdict == "correct"))
            rest.append(round(student.score - own.score, PLACES))
    varies = len(right) >= LEAST_CLASS and len(set(right)) > 1 and len(set(rest)) > 1
    share = fmean(right) if right else None
    return share, round(correlation(right, rest), PLACES) if varies else None


def alike(judgements: Iterable[Judgement]) -> tuple[Alike, ...]:
    """The students who share rare wrong answers to MANY_SHARED questions or more, those first who share most.

    Values of variants do not matter: a wrong answer that belongs to the values of another says even more.
    """
    students = [*judgements]
    gave = defaultdict[tuple[str, str], set[int]](set)
    for number, student in enumerate(students):
        for question in student.questions:
            is_wrong = question.verdict in ("partial", "incorrect", "invalid") and bool(question.answer)
            if is_wrong and not question.answer.startswith(TRAJECTORY):
                gave[question.id, _same(question.answer)].add(number)
    most = max(RARE, len(students) // SHARE_OF_RARE)
    shared = defaultdict[tuple[int, int], list[tuple[str, str]]](list)
    for answer, who in gave.items():
        for pair in combinations(sorted(who), 2) if len(who) <= most else ():
            shared[pair].append(answer)
    found: dict[tuple[int, ...], tuple[str, ...]] = {}
    for answers in shared.values():
        if len(answers) >= MANY_SHARED:
            who = set.intersection(*(gave[answer] for answer in answers))
            found.setdefault(tuple(sorted(who)), tuple(printable(id) for id, _ in answers))
    return tuple(
        Alike(tuple(printable(students[number].student) for number in who), questions)
        for who, questions in sorted(found.items(), key=lambda entry: (-len(entry[1]), entry[0]))
    )


def _same(answer: str) -> str:
    """An answer without blanks and last digits, to compare answers by."""
    return _NUMBER.sub(lambda number: f"{float(number[0]):.3g}", "".join(answer.split()))


def table(tallies: Sequence[Tally], style: ReportStyle, pairs: Sequence[Alike] = ()) -> Iterator[str]:
    """A block for each question: its counts, then the answers that are not right; then who is alike."""
    for tally in tallies:
        said = [formats.counted(tally.verdicts)]
        said += [] if tally.right is None else [f"{tally.right:.0%} right of those who answered"]
        said += [] if tally.correlation is None else [f"correlation with the rest {tally.correlation:.2f}"]
        widest = max((len(str(taken.students)) for taken in tally.answers), default=0)
        rows = []
        for taken in tally.answers[:MOST_SHOWN]:
            notes = [" ".join(taken.codes), "no known mistake: the key may be wrong" * taken.suspicious]
            answer = excerpt(taken.answer) + f"  ({taken.values})" * bool(taken.values)
            lines = filter(None, [answer, ", ".join(filter(None, notes))])
            heads = ((f"  {taken.students:>{widest}} x", ""), painted(taken.verdict))
            rows.append(TextRow(heads, "\n".join(lines)))
        yield block(((tally.question, "bold"), (f"  {'; '.join(said)}", "")), rows, style)
        if len(tally.answers) > MOST_SHOWN:
            yield f"  and {len(tally.answers) - MOST_SHOWN} other answers\n"
    if doubted := ", ".join(tally.question for tally in tallies if tally.suspicious):
        doubt = "the key may be wrong: several gave the same answer, and no known mistake leads to it"
        yield "\n" + block((), [TextRow(((doubted, ""),), doubt)], style)
    for each in pairs:
        shared = f"the same rare wrong answers to {', '.join(each.questions)}: a hint to look, not a verdict"
        row = TextRow(((", ".join(each.students), ""),), shared)
        yield "\n" * (each is pairs[0]) + block((), [row], style)


def json(tallies: Sequence[Tally], style: ReportStyle, pairs: Sequence[Alike] = ()) -> Iterator[str]:
    """One compact object a question, one a line, and one for students who are alike."""
    names = _columns(tallies)
    for tally in tallies:
        entry = {"schema": "rigidcli.items/1", "question": tally.question} | tally.verdicts
        answers = [dict(zip(names, answer, strict=False)) for answer in tally.answers]
        analysis = {"right": tally.right, "correlation": tally.correlation}
        yield json_line(entry | {"suspicious": tally.suspicious, "answers": answers} | analysis)
    for each in pairs:
        yield json_line({"schema": "rigidcli.alike/1"} | each._asdict())


def _columns(tallies: Sequence[Tally]) -> Sequence[str]:
    """What is said of an answer: `values`, which come last, only where there are variants."""
    has_values = any(taken.values for tally in tallies for taken in tally.answers)
    return Taken._fields if has_values else Taken._fields[:-1]


def csv(tallies: Sequence[Tally], style: ReportStyle, pairs: Sequence[Alike] = ()) -> Iterator[str]:
    """A row for each answer that is not right, with the counts of its question; one where there is none."""
    names = _columns(tallies)
    rows = (
        (tally.question, *tally.verdicts.values(), *answer[: len(names)], tally.right, tally.correlation)
        for tally in tallies
        for answer in tally.answers or [(None,) * len(names)]
    )
    return formats.csv_rows(["question", *VERDICTS, *names, "right", "correlation"], rows, style)


TEXTS = {"table": table, "json": json, "csv": csv}


def render(format: str, judgements: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """The statistics of the questions, and students who are alike, in a format."""
    students = [*judgements]
    return TEXTS[format](tally(students), style, alike(students))


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
