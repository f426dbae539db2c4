"""The page of a student: each question with its verdict, its points and what is told of the answer.

All texts of students and files stay text (`render.web.page.text`), isolated from the direction of what stands
beside them. What is found in answers comes to a page by `feedback.told` alone, which keeps to the level that
is asked for.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from rigidcli.errors import printable
from rigidcli.grading.feedback import Student
from rigidcli.grading.reports.table import as_one, score
from rigidcli.render import Look
from rigidcli.render.web.page import page, resource, text
from rigidcli.report import Report

STYLE = "classroom.css"
"""The style of these pages, besides that of every page."""


@dataclass(frozen=True, slots=True)
class Course:
    """What pages tell besides judgements: the title of the assignment, and solutions that are `worked`.

    `remarks` are on files and students; they may grow as long as there are judgements to come.
    """

    title: str
    remarks: Sequence[str] = ()
    solutions: Mapping[str, str] = field(default_factory=dict)


def student_page(student: Student, course: Course) -> Iterator[str]:
    """The page of a student, piece by piece."""
    part = share(student.score, student.max_score)
    body = [
        f"<h1>{own(student.student)}</h1>\n",
        f"<p>{own(course.title)}: <strong>{score(student)}{part}</strong></p>\n",
        *answers(student, course),
        f'<p class="quiet">{own(Path(student.source).name)}</p>\n' if student.source else "",
    ]
    return page(f"{course.title}: {student.student}", body, styles=[resource(STYLE)])


def answers(student: Student, course: Course, *, solved: bool = True) -> Iterator[str]:
    """Each question of a student with its verdict, its points and what is told of the answer."""
    for question in as_one(student):
        yield f'<section class="answer {question.verdict}">\n<h3>{own(question.id)}'
        yield f" <span>{question.verdict}, {score(question)}</span></h3>\n"
        if question.feedback:
            remarks = (f"<li>{own(remark.message)}</li>" for remark in question.feedback)
            yield f"<ul>{''.join(remarks)}</ul>\n"
        yield course.solutions.get(question.id, "") if solved else ""
        yield "</section>\n"


def worked(solutions: Mapping[str, Report]) -> dict[str, str]:
    """The working of questions, folded, by their names as they are told.

    With the libraries of the extra `show` it is as on the page of the question's own command.
    """
    from rigidcli.render.plots import has_library

    tell = _formulas if has_library("formulas") else _plain
    return {
        printable(id): f'<details class="solution"><summary>Solution</summary>\n{tell(report)}</details>\n'
        for id, report in solutions.items()
    }


def _formulas(report: Report) -> str:
    from rigidcli.render.html import fragment

    return fragment(replace(report, pictures=()), Look(steps=True))


def _plain(report: Report) -> str:
    from rigidcli.render.table import render

    told = "\n".join(map(text, "".join(render([report], Look(steps=True))).split("\n")))
    return f"<pre>{told}</pre>"


def own(words: str) -> str:
    """Words of somebody else: text, whose direction changes nothing beside it."""
    return f"<bdi>{text(words)}</bdi>"


def lines(words: str) -> str:
    """The lines of somebody else's words."""
    return "<br>".join(map(own, words.split("\n"))) if words else ""


def share(score: float, most: float) -> str:
    """A share of the points in brackets, if there are points."""
    return f" ({score / most:.0%})" if most else ""
