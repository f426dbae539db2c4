"""The formats of judgements: tables for people, and texts for programs, written hand-in by hand-in.

Besides marks there are the answers of a class question by question, and the differences between two runs.
"""

from __future__ import annotations

import io
import os
import re
from collections import Counter, defaultdict
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from csv import writer
from dataclasses import dataclass, replace
from itertools import chain
from statistics import fmean
from typing import NamedTuple, TypeAlias
from xml.etree import ElementTree as ET

import orjson

from rigidcli.errors import DocumentError, Problem, printable, shortened
from rigidcli.fields.texts import safe_name
from rigidcli.homework import Feedback
from rigidcli.homework.base import VERDICTS, Judged, Judgement, Verdict, reported, sentence
from rigidcli.homework.spreadsheets import read_own
from rigidcli.homework.variants import words
from rigidcli.language.numerals import UNSIGNED
from rigidcli.render.terminal import Page, Part, TextRow

Cell: TypeAlias = str | float | bool | tuple[str, ...] | None

HEADER = ("student", "question", "verdict", "score", "max_score", "codes", "message", "source")
# The fields of a question in json, besides the feedback.
FIELDS = ("id", "title", "answer", "read_as", "verdict", "score", "max_score")
# Where semicolons separate cells, as they do in much of Europe, one within a text begins a new cell.
_FORMULA = re.compile(r'(^|;)([\s"]*)(?=[=+\-@＝＋－＠﹦﹢﹣﹫])')
# The colour of each verdict on a terminal, and its element of JUnit's XML; a right answer has none.
STYLES: dict[Verdict, tuple[str, str]] = {
    "review": ("magenta", "skipped"),
    "correct": ("green", ""),
    "partial": ("yellow", "failure"),
    "incorrect": ("red", "failure"),
    "invalid": ("red", "error"),
    "missing": ("yellow", "failure"),
}


@dataclass(frozen=True, slots=True)
class ReportStyle:
    """How results look: how much students read, the header of csv, and width and colour of a table.

    A `width` of None is a file or a pipe, where no line is broken. With `late`, csv and json say which
    hand-ins are late: they do where any is.
    """

    feedback: Feedback = Feedback.hint
    header: bool = True
    width: int | None = None
    colour: bool = False
    late: bool = False


def csv_rows(header: Sequence[str], rows: Iterable[Sequence[Cell]], style: ReportStyle) -> Iterator[str]:
    """The header, then the rows, for spreadsheets and scripts: no text in them can become a formula."""
    for row in chain([header] if style.header else [], rows):
        target = io.StringIO()
        writer(target, lineterminator="\n").writerow(map(_written, row))
        yield target.getvalue()


def _written(cell: Cell) -> str | float | None:
    if isinstance(cell, bool):
        return str(cell).lower()
    text = " ".join(cell) if isinstance(cell, tuple) else cell
    # No spreadsheet takes a text for a formula if an apostrophe stands before what could begin one.
    return _FORMULA.sub(r"\1\2'", printable(text)) if isinstance(text, str) else text


def json_line(entry: object) -> str:
    """A compact object on a line of its own."""
    return orjson.dumps(entry).decode() + "\n"


def _csv(students: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    rows: Iterator[list[Cell]] = (
        [
            *(student.student, question.id, question.verdict, question.score, question.max_score),
            *(question.codes, "; ".join(question.sentences), student.source),
            *[student.late] * style.late,
        ]
        for student in students
        for question in student.questions
    )
    return csv_rows([*HEADER, *["late"] * style.late], rows, style)


def wide(ids: Sequence[str], students: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """A row for each student, with the points of each question; none where a person must judge it."""
    rows: Iterator[list[Cell]] = (
        [
            student.student,
            *(None if question.verdict == "review" else question.score for question in student.questions),
            *(student.score, student.max_score, student.source),
            *[student.late] * style.late,
        ]
        for student in students
    )
    head = ["student", *ids, "score", "max_score", "source", *["late"] * style.late]
    return csv_rows(head, rows, style)


def _json(students: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """The contract `rigidcli.check/1`: a line for each answer file."""
    for student in students:
        line: dict[str, object] = {"schema": "rigidcli.check/1"}
        line |= {name: getattr(student, name) for name in ("student", "source", "score", "max_score")}
        line |= {"late": student.late} if style.late else {}
        line["questions"] = [
            {name: getattr(question, name) for name in FIELDS}
            | ({"values": question.values} if question.values else {})
            | {"feedback": [{"code": each.code, "message": sentence(each)} for each in question.findings]}
            for question in student.questions
        ]
        yield json_line(line)


def _gradescope(students: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """The `results.json` of a Gradescope autograder: one object an answer file, one a line.

    Source: Gradescope's autograder specifications, "Output format". All texts are marked as plain text, for
    Gradescope would read HTML or Markdown in others. Where no feedback is given, it hides the results from
    students. A test either passes or fails there: its text says the rest.
    """
    silent = style.feedback is Feedback.none
    for student in students:
        tests = [
            {
                "name": question.id,
                "score": question.score,
                "max_score": question.max_score,
                "status": "passed" if question.verdict == "correct" else "failed",
                "output": "" if silent else _output(question),
            }
            for question in student.questions
        ]
        about = {"student": student.student, "source": student.source}
        seen = {"visibility": "hidden" if silent else "visible", "stdout_visibility": "hidden"}
        plain = dict.fromkeys(("output_format", "test_output_format", "test_name_format"), "text")
        yield json_line({"score": student.score, **plain, **seen, "extra_data": about, "tests": tests})


def _output(question: Judged) -> str:
    typed = f"your answer: {question.answer}" if question.answer else ""
    read = f"read as: {question.reading}" if question.reading else ""
    return "\n".join(filter(None, [_earned(question), question.title, typed, read, question.message]))


def _earned(question: Judged) -> str:
    if question.verdict == "review":
        return "review (no points yet)"
    return f"{question.verdict} ({points(question.score)}/{points(question.max_score)})"


def _junit(students: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n'
    for student in students:
        elements = [STYLES[question.verdict][1] for question in student.questions]
        counts = {"failures": "failure", "errors": "error", "skipped": "skipped"}
        named = {"name": student.student.strip() or "-", "tests": str(len(elements))}
        named |= {name: str(elements.count(element)) for name, element in counts.items()}
        suite = ET.Element("testsuite", named, file=student.source)
        for question, element in zip(student.questions, elements, strict=True):
            case = ET.SubElement(suite, "testcase", name=question.id, classname=student.student)
            if element:
                result = ET.SubElement(case, element)
                if style.feedback is not Feedback.none:
                    reasons = "; ".join(question.sentences)
                    result.set("message", ": ".join(filter(None, [_earned(question), reasons])))
                    result.text = question.message
        ET.indent(suite, level=1)
        yield f"  {ET.tostring(suite, encoding='unicode')}\n"
    yield "</testsuites>\n"


# --- for people

# Columns that remarks must have beside their heads on a terminal; otherwise they stand below them.
NARROWEST = 30

LONGEST_ANSWER = 60  # characters of an answer that a table shows

# Verdicts that stand in one row where all questions have them for the same reason: these earn no points.
SHARED = ("review", "invalid", "missing")


def table(students: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """A block for each student, and where there are several, a summary and all that needs a person.

    What needs a person is listed first; the blocks of students repeat only the marks of it.
    """
    seen = list(students)
    blocks = "".join(_block(student, style, len(seen) > 1) for student in seen)
    around = [_urgent(seen, style), blocks, _summary(seen, style)] if len(seen) > 1 else [blocks]
    yield "\n".join(filter(None, around))


def _block(student: Judgement, style: ReportStyle, brief: bool) -> str:
    """A student, the questions that are not right or have a remark, and in one row what has no answer."""
    shown = [q for q in as_one(student) if q.verdict != "correct" or q.findings]
    missing = [q for q in shown if q.verdict == "missing" and not q.findings]
    if len(missing) > 1:
        names, worth = ", ".join(q.id for q in missing), sum(q.max_score for q in missing)
        others = replace(missing[0], id="others", title=names, max_score=worth)
        shown = [*(q for q in shown if q not in missing), others]
    widest = max((len(score(question)) for question in shown), default=0)
    rows = []
    for question in shown:
        heads = ((f"  {question.id}", ""), (f"{score(question):>{widest}}", ""), painted(question.verdict))
        is_told = brief and question.is_urgent
        rows.append(TextRow(heads, question.title if is_told else _remarks(question, style, question.title)))
    right = all(question.verdict == "correct" for question in student.questions)
    earned = f"  {score(student)}{'  all correct' if right else ''}"
    return block(((student.student, "bold"), (earned, "")), rows, style)


def _remarks(question: Judged, style: ReportStyle, title: str = "") -> str:
    """The title, the answer as typed and, if that says more, as read, and the remarks."""
    typed, read_as = excerpt(question.answer), excerpt(question.reading)
    answer = f"`{typed}`" + (f", read as `{read_as}`" if read_as else "")
    shown = answer if question.answer and style.feedback.reasons else ""
    return "\n".join(filter(None, [title, shown, question.message]))


def as_one(student: Judgement) -> Sequence[Judged]:
    """The questions; one row for all of them if the whole hand-in failed for one reason."""
    first, said = student.questions[0], {(each.verdict, each.findings) for each in student.questions}
    answered = any(question.answer for question in student.questions)
    if len(student.questions) == 1 or len(said) > 1 or first.verdict not in SHARED or answered:
        return student.questions
    return [replace(first, id="every question", title="", max_score=student.max_score)]


def urgent(students: Sequence[Judgement]) -> list[tuple[int, Judged]]:
    """The answers that a person must look at, with the places of their students: first what is not judged."""
    hands = ((place, question) for place, student in enumerate(students) for question in as_one(student))
    return sorted((hand for hand in hands if hand[1].is_urgent), key=lambda hand: hand[1].verdict != "review")


def _urgent(students: Sequence[Judgement], style: ReportStyle) -> str:
    rows = []
    for place, question in urgent(students):
        heads = ((f"  {students[place].student}", "bold"), (question.id, ""), painted(question.verdict))
        rows.append(TextRow(heads, _remarks(question, style)))
    count = "1 answer needs a person" if len(rows) == 1 else f"{len(rows)} answers need a person"
    head = ((f"{count}: not judged, or not readable", STYLES["review"][0]),)
    return block(head, rows, style) if rows else ""


def _summary(students: Sequence[Judgement], style: ReportStyle) -> str:
    """The mean, and of each question the share of right answers and the number with each verdict."""
    counts = defaultdict[str, Counter[Verdict]](Counter)
    for student in students:
        for question in student.questions:
            counts[question.id][question.verdict] += 1
    rows = [
        TextRow(((f"  {id}", ""), (f"{verdicts['correct'] / len(students):>4.0%}", "")), counted(verdicts))
        for id, verdicts in sorted(counts.items(), key=lambda entry: not entry[1]["review"])
    ]
    return block(((mean_of(students), ""),), rows, style)


def mean_of(students: Sequence[Judgement]) -> str:
    """How many students there are, and their mean."""
    mean, most = fmean(student.score for student in students), students[-1].max_score
    count = "1 student" if len(students) == 1 else f"{len(students)} students"
    return f"{count}, mean {points(mean)}/{points(most)}{share(mean, most)}"


def block(head: Sequence[Part], rows: Sequence[TextRow], style: ReportStyle) -> str:
    """A line, unless `head` is empty, and rows below it."""
    page = Page(style.width, style.colour)
    if head:
        page.line(*head)
    page.rows(rows, room=NARROWEST)
    return str(page)


def painted(verdict: Verdict) -> Part:
    """A verdict in its colour, as wide as the longest one."""
    return verdict.ljust(max(map(len, VERDICTS))), STYLES[verdict][0]


def excerpt(answer: str) -> str:
    """An answer as a table shows it."""
    return shortened(answer, LONGEST_ANSWER)


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


FORMATS: dict[str, Callable[[Iterable[Judgement], ReportStyle], Iterator[str]]] = {
    "table": table,
    "json": _json,
    "csv": _csv,
    "junit": _junit,
    "gradescope": _gradescope,
}


def render(name: str, judgements: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
    """Judgements in a format."""
    return FORMATS[name]((reported(judgement, style.feedback) for judgement in judgements), style)


# --- the answers of a class

MOST_SHOWN = 10  # wrong answers of a question that are shown
_NUMBER = re.compile(rf"(?<![A-Za-z_0-9.]){UNSIGNED}(?![A-Za-z_0-9.])")


class Taken(NamedTuple):
    """An answer that is not right; `values` are those of its students' variant, in words."""

    answer: str
    verdict: Verdict
    codes: tuple[str, ...]
    values: str


def by_question(judgements: Iterable[Judgement], style: ReportStyle) -> Iterator[str]:
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
        yield block(((printable(id), "bold"), (f"  {counted(counts[id])}", "")), rows, style)
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
    return printable(f"{verdict} {points(score)}/{points(most)}")


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
