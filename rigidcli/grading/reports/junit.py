"""JUnit XML: a suite for each answer file, a case for each question.

The elements and attributes are those of Jenkins' `junit-10.xsd`. Nothing is timed, for the same input gives
the same bytes; readers that want a `time` find zero.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from xml.etree import ElementTree as ET

from rigidcli.errors import printable
from rigidcli.grading.feedback import Feedback, remarks
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.outcome import Verdict
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.layout import points

RESULTS: dict[Verdict, str] = {
    "partial": "failure",
    "incorrect": "failure",
    "missing": "failure",
    "invalid": "error",
}
"""The element that tells of an answer that is not right."""


def render(judgements: Iterable[Judgement], style: Style) -> Iterator[str]:
    """One XML document, which counts the cases before it tells them."""
    root = ET.Element("testsuites")
    totals = {"tests": 0, "failures": 0, "errors": 0}
    for judgement in judgements:
        results = [RESULTS.get(question.verdict) for question in judgement.questions]
        counts = {
            "tests": len(results),
            "failures": results.count("failure"),
            "errors": results.count("error"),
        }
        totals = {name: totals[name] + count for name, count in counts.items()}
        student = printable(judgement.student)
        suite = ET.SubElement(root, "testsuite", _attributes(student, counts))
        for question in judgement.questions:
            suite.append(_case(question, student, style.feedback))
    root.attrib |= _attributes("rigidcli check", totals)
    ET.indent(root)
    text = ET.tostring(root, encoding="unicode")
    yield f'<?xml version="1.0" encoding="UTF-8"?>\n{text}\n'


def _attributes(name: str, counts: dict[str, int]) -> dict[str, str]:
    return {"name": name} | {key: str(count) for key, count in counts.items()} | {"time": "0"}


def _case(question: Judged, student: str, feedback: Feedback) -> ET.Element:
    name = printable(question.id)
    case = ET.Element("testcase", {"name": name, "classname": student, "time": "0"})
    if question.verdict not in RESULTS:
        return case
    result = ET.SubElement(case, RESULTS[question.verdict], {"message": "", "type": ""})
    if feedback is not Feedback.none:
        told = [remark.message for remark in remarks(question, feedback)]
        score = f"{question.verdict} ({points(question.score)}/{points(question.max_score)})"
        result.set("message", ": ".join(filter(None, [score, "; ".join(told)])))
        result.set("type", question.verdict)
        result.text = "\n".join(told)
    return case
