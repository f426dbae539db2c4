"""The formats of judgements, written one answer file after another as far as the format allows."""

from __future__ import annotations

import io
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from csv import writer
from itertools import chain
from typing import TypeAlias
from xml.etree import ElementTree as ET

import orjson

from rigidcli.check import Feedback
from rigidcli.check.base import Judged, Judgement, Verdict, reported, sentence
from rigidcli.check.reports import Style
from rigidcli.check.reports.table import points, table
from rigidcli.errors import printable

Students: TypeAlias = Iterable[Judgement]
"""Hand-ins as the level of feedback allows to show them."""

Cell: TypeAlias = str | float | bool | tuple[str, ...] | None
"""A cell of csv: a text, a number, a truth, several words, or nothing."""

HEADER = ("student", "question", "verdict", "score", "max_score", "codes", "message", "source")
"""The columns of csv."""

FIELDS = ("id", "title", "answer", "read_as", "verdict", "score", "max_score")
"""What json says of a question, besides the feedback."""

# Where semicolons separate cells, as they do in much of Europe, one within a text begins a new cell.
_FORMULA = re.compile(r'(^|;)([\s"]*)(?=[=+\-@＝＋－＠﹦﹢﹣﹫])')

ELEMENTS: dict[Verdict, str] = {
    "review": "skipped",
    "partial": "failure",
    "incorrect": "failure",
    "missing": "failure",
    "invalid": "error",
}
"""The element of JUnit's XML that tells of an answer that is not right, or not judged."""


def csv_rows(header: Sequence[str], rows: Iterable[Sequence[Cell]], style: Style) -> Iterator[str]:
    """The header, then the rows, for spreadsheets and scripts: no text in them can become a formula."""
    for row in chain([header] if style.header else [], rows):
        target = io.StringIO()
        writer(target, lineterminator="\n").writerow(map(_written, row))
        yield target.getvalue()


def _written(cell: Cell) -> str | float | None:
    if isinstance(cell, bool):
        return str(cell).lower()
    text = " ".join(cell) if isinstance(cell, tuple) else cell
    return harmless(text) if isinstance(text, str) else text


def harmless(text: str) -> str:
    """A text that no spreadsheet takes for a formula: an apostrophe stands before what could begin one."""
    return _FORMULA.sub(r"\1\2'", printable(text))


def json_line(entry: object) -> str:
    """A compact object on a line of its own."""
    return orjson.dumps(entry).decode() + "\n"


def _csv(students: Students, style: Style) -> Iterator[str]:
    """A row for each question."""
    rows = (
        (
            *(student.student, question.id, question.verdict, question.score, question.max_score),
            *(question.codes, "; ".join(question.sentences), student.source),
        )
        for student in students
        for question in student.questions
    )
    return csv_rows(HEADER, rows, style)


def _json(students: Students, style: Style) -> Iterator[str]:
    """The contract `rigidcli.check/1`: a line for each answer file."""
    for student in students:
        line: dict[str, object] = {"schema": "rigidcli.check/1"}
        line |= {name: getattr(student, name) for name in ("student", "source", "score", "max_score")}
        line["questions"] = [
            {name: getattr(question, name) for name in FIELDS} | {"feedback": _feedback(question)}
            for question in student.questions
        ]
        yield json_line(line)


def _feedback(question: Judged) -> list[dict[str, str]]:
    return [{"code": finding.code, "message": sentence(finding)} for finding in question.findings]


def _gradescope(students: Students, style: Style) -> Iterator[str]:
    """The `results.json` of a Gradescope autograder: one object an answer file, one a line.

    Source: Gradescope's autograder specifications, "Output format". All texts are marked as plain text, for
    Gradescope would read HTML or Markdown in others. Where no feedback is given, it hides the results from
    students. A test either passes or fails there: its text says the rest.
    """
    silent = style.feedback is Feedback.none
    for student in students:
        yield json_line(
            {
                "score": student.score,
                "output_format": "text",
                "test_output_format": "text",
                "test_name_format": "text",
                "visibility": "hidden" if silent else "visible",
                "stdout_visibility": "hidden",
                "extra_data": {"student": student.student, "source": student.source},
                "tests": [
                    {
                        "name": question.id,
                        "score": question.score,
                        "max_score": question.max_score,
                        "status": "passed" if question.verdict == "correct" else "failed",
                        "output": "" if silent else _output(question),
                    }
                    for question in student.questions
                ],
            }
        )


def _output(question: Judged) -> str:
    """What a student reads of a question."""
    lines = {"": question.title, "your answer: ": question.answer, "read as: ": question.reading}
    given = [f"{head}{text}" for head, text in lines.items() if text]
    return "\n".join(filter(None, [_earned(question), *given, question.message]))


def _earned(question: Judged) -> str:
    """The verdict, and the points that the answer earns."""
    if question.verdict == "review":
        return "review (no points yet)"
    return f"{question.verdict} ({points(question.score)}/{points(question.max_score)})"


def _junit(students: Students, style: Style) -> Iterator[str]:
    """JUnit XML: a suite for each answer file, a case for each question."""
    yield '<?xml version="1.0" encoding="UTF-8"?>\n<testsuites>\n'
    for student in students:
        elements = [ELEMENTS.get(question.verdict) for question in student.questions]
        counts = {"failures": "failure", "errors": "error", "skipped": "skipped"}
        named = {"name": student.student.strip() or "-", "tests": str(len(elements))}
        named |= {name: str(elements.count(element)) for name, element in counts.items()}
        suite = ET.Element("testsuite", named, file=student.source)
        for question in student.questions:
            case = ET.SubElement(suite, "testcase", name=question.id, classname=student.student)
            if question.verdict in ELEMENTS:
                case.append(_result(question, silent=style.feedback is Feedback.none))
        ET.indent(suite, level=1)
        yield f"  {ET.tostring(suite, encoding='unicode')}\n"
    yield "</testsuites>\n"


def _result(question: Judged, *, silent: bool) -> ET.Element:
    """The verdict and the reasons of an answer that is not right."""
    element = ET.Element(ELEMENTS[question.verdict])
    if not silent:
        reasons = "; ".join(question.sentences)
        element.set("message", f"{_earned(question)}: {reasons}" if reasons else _earned(question))
        element.text = question.message
    return element


FORMATS: dict[str, Callable[[Students, Style], Iterator[str]]] = {
    "table": table,
    "json": _json,
    "csv": _csv,
    "junit": _junit,
    "gradescope": _gradescope,
}
"""The output formats of judgements."""


def render(name: str, judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """Judgements in a format."""
    return FORMATS[name]((reported(judgement, style.feedback) for judgement in judgements), style)
