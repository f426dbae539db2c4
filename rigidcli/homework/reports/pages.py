"""A class on a page of HTML, a page for each student, and sheets with the values of each to hand out.

All texts of students and files are escaped (`own`), and isolated: letters from right to left move nothing.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from functools import cache, partial
from itertools import count
from pathlib import Path
from statistics import fmean
from typing import NamedTuple
from urllib.parse import quote

from rigidcli.errors import ExpressionError
from rigidcli.homework.base import Judged, Judgement, reported
from rigidcli.homework.judge import Item
from rigidcli.homework.reports import formats
from rigidcli.homework.reports.formats import ReportStyle, as_one, excerpt, points, score
from rigidcli.homework.variants import Values, words
from rigidcli.language.expression import parse
from rigidcli.language.text import latex
from rigidcli.render.plots import has_library
from rigidcli.render.web.mathml import formula
from rigidcli.render.web.page import page, resource, text

# Characters of a file's name that are taken from a student's: 200 bytes at most, where systems allow 255.
LONGEST_NAME = 50

# What is set as a formula: more than a word, and no number with its unit.
_FORMULA = re.compile(r"(?![-+]?[0-9.]+(?:e[-+]?[0-9]+)? [A-Za-z])(?=.*[A-Za-z])(?=.*[-+*/^=(]).*")


class Course(NamedTuple):
    """What pages say besides judgements: the title of the assignment, and remarks on files and students.

    The `remarks` may grow as long as there are judgements to come.
    """

    title: str
    remarks: Collection[str] = ()


def one_page(judgements: Iterable[Judgement], course: Course, style: ReportStyle) -> Iterator[str]:
    """The class on one page, with the feedback for each student folded in it."""
    judged = tuple(judgements)
    links = [f"#student{number}" for number in range(1, len(judged) + 1)]
    yield written(course.title, _class(judged, course, style, links, folded=True))


def pages(judgements: Iterable[Judgement], course: Course, style: ReportStyle) -> Iterator[tuple[str, str]]:
    """Files of a folder, each a name and what stands in it: a page for each student, then the class's."""
    judged, links, taken = [], [], {"index"}
    for judgement in judgements:
        name = file_name(judgement.student, taken)
        judged.append(judgement)
        links.append(quote(name))
        student = reported(judgement, style.feedback)
        body = [
            f"<h1>{own(student.student)}</h1>\n<p>{own(course.title)}: <strong>{score(student)}",
            f"{formats.share(student.score, student.max_score)}</strong></p>\n",
            your_values({name: text for each in student.questions for name, text in each.values.items()}),
            *_answers(student),
            f'<p class="quiet">{own(Path(student.source).name)}</p>\n' if student.source else "",
        ]
        yield name, written(f"{course.title}: {student.student}", body)
    yield "index.html", written(course.title, _class(judged, course, style, links, folded=False))


def written(title: str, body: Iterable[str]) -> str:
    """A page with this title."""
    return "".join(page(title, body, styles=[resource("classroom.css")]))


def your_values(values: Values) -> str:
    """The line that names the values of a student's variants, if there are any."""
    return f"<p>Your values: <strong>{own(words(values))}</strong></p>\n" if values else ""


def file_name(student: str, taken: set[str]) -> str:
    """A new file name for the page of a student, made of words alone; it is added to those `taken`.

    Names that differ in capitals or forms of Unicode are the same on some systems, and so here.
    """
    words = re.findall(r"\w+", unicodedata.normalize("NFKC", student))
    stem = "-".join(words)[:LONGEST_NAME] or "student"
    names = (f"{stem}-{number}" if number > 1 else stem for number in count(1))
    name = next(name for name in names if name.casefold() not in taken)
    taken.add(name.casefold())
    return f"{name}.html"


def own(words: str) -> str:
    """Words of somebody else, escaped, and isolated from the direction of what stands beside them."""
    return f"<bdi>{text(words)}</bdi>"


def _list(entries: Iterable[str]) -> str:
    return "<ul>\n" + "".join(f"<li>{entry}</li>\n" for entry in entries) + "</ul>\n"


# --- a student


def _answers(student: Judgement) -> Iterator[str]:
    for question in as_one(student):
        yield _head(question.id, f"{question.verdict}, {score(question)}", question.title, question.verdict)
        if question.answer:
            yield f"<p>Your answer: <code>{own(question.answer)}</code></p>\n"
        if question.read_as:
            yield f"<p>Read as: {typeset(question.read_as)}</p>\n"
        if question.findings:
            yield _list(map(own, question.sentences))
        yield "</section>\n"


def _head(id: str, said: str, title: str, *styles: str) -> str:
    """The beginning of the section of a question: its name with what is `said` of it, and its title."""
    task = f'<p class="title">{own(title)}</p>\n' if title else ""
    classes = " ".join(["answer", *styles])
    return f'<section class="{classes}">\n<h3>{own(id)} <span>{said}</span></h3>\n{task}'


_has_formulas = cache(partial(has_library, "formulas"))


def typeset(words: str) -> str:
    """An expression, or equations, as a formula where the library for it is there; other words as text."""
    # A long answer is read more easily as text.
    if len(words) > 300 or not _has_formulas() or not _FORMULA.fullmatch(words):
        return own(words)
    try:
        lines = [[latex(parse(side).root) for side in line.split("=")] for line in words.split("; ")]
    except ExpressionError:
        return own(words)
    return "<br>".join(formula(" = ".join(sides)) for sides in lines)


# --- the class


def _class(
    judged: Sequence[Judgement], course: Course, style: ReportStyle, links: Sequence[str], *, folded: bool
) -> Iterator[str]:
    """What needs a person, a table of scores, notes, and where it is `folded` in, the feedback."""
    students = [reported(judgement, style.feedback) for judgement in judged]
    yield f"<h1>{own(course.title)}</h1>\n"
    if students:
        yield f"<p>{formats.mean_of(students)}</p>\n"
        first = [_asked(students[place], links[place], each) for place, each in formats.urgent(students)]
        yield f"<h2>To look at first</h2>\n{_list(first)}" if first else ""
        yield from _scores(judged, links)
    else:
        yield "<p>There are no answers to judge.</p>\n"
    if course.remarks:
        remarks = ("<br>".join(map(own, remark.split("\n"))) for remark in course.remarks)
        yield f"<h2>Files and notes</h2>\n{_list(remarks)}"
    if folded and students:
        yield "<h2>Feedback</h2>\n"
        for number, student in enumerate(students, 1):
            yield f'<details id="student{number}"><summary>{own(student.student)}, '
            yield f"{score(student)}</summary>\n"
            yield from _answers(student)
            yield "</details>\n"


def _asked(student: Judgement, link: str, question: Judged) -> str:
    who = f'<a href="{link}">{own(student.student)}</a>, {own(question.id)}: {question.verdict}'
    typed = [f"<code>{own(excerpt(question.answer))}</code>"] if question.answer else []
    return "<br>".join([who, *typed, *map(own, question.sentences)])


def _scores(judged: Sequence[Judgement], links: Sequence[str]) -> Iterator[str]:
    yield '<h2>Scores</h2>\n<div class="wide"><table class="class">\n'
    ids = (f'<th scope="col">{own(question.id)}</th>' for question in judged[0].questions)
    yield f'<thead><tr><th scope="col">Student</th><th scope="col">Score</th>{"".join(ids)}</tr></thead>\n'
    for judgement, link in zip(judged, links, strict=True):
        yield f'<tr><th scope="row"><a href="{link}">{own(judgement.student)}</a></th>'
        yield f'<td class="number">{points(judgement.score)}</td>'
        for each in judgement.questions:
            says = points(each.score) if each.verdict in ("correct", "partial", "incorrect") else each.verdict
            yield f'<td><span class="mark {each.verdict}">{says}</span></td>'
        yield "</tr>\n"
    columns = zip(*(judgement.questions for judgement in judged), strict=True)
    means = [points(fmean(each.score for each in column)) for column in [judged, *columns]]
    yield f'<tr><th scope="row">mean</th><td class="number">{"</td><td>".join(means)}</td></tr>\n'
    yield "</table></div>\n"


# --- sheets to hand out


class Sheet(NamedTuple):
    """What one student gets: the values of all variants, and the questions with these values.

    `about` are the cells of the student in the roster.
    """

    student: str
    values: Mapping[str, str]
    items: Mapping[str, Item]
    about: Sequence[str] = ()


def sheet_pages(sheets: Sequence[Sheet], title: str) -> Iterator[tuple[str, str]]:
    """Files of a folder, each a name and what stands in it: a page for each student."""
    taken = set[str]()
    for sheet in sheets:
        body = [f"<h1>{own(title)}</h1>\n<p><strong>{own(sheet.student)}</strong></p>\n"]
        body.append(your_values(sheet.values))
        for id, item in sheet.items.items():
            worth = f"{points(item.points)} point{'s' * (item.points != 1)}"
            body.append(f"{_head(id, worth, item.title)}</section>\n")
        yield file_name(sheet.student, taken), written(f"{title}: {sheet.student}", body)


def sheet_rows(sheets: Sequence[Sheet], header: Sequence[str], style: ReportStyle) -> Iterator[str]:
    """A row for each student, for a mail merge: the columns of the list of students, values, and titles.

    The student is named as in results, in the first column.
    """
    names = [*sheets[0].values, *sheets[0].items] if sheets else []
    rows = (
        [
            sheet.student,
            *(*sheet.about, *[""] * len(header))[: len(header)],
            # A minus sign: no spreadsheet takes it for the beginning of a formula, and all readers know it.
            *(re.sub("^-", "−", value) for value in sheet.values.values()),
            *(item.title for item in sheet.items.values()),
        ]
        for sheet in sheets
    )
    return formats.csv_rows(["student", *header, *names], rows, style)
