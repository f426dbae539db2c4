"""A class on a page of HTML for the instructor, and a page for each student.

All texts of students and files stay text (`own`), isolated from the direction of what stands beside them.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from statistics import median
from urllib.parse import quote

from rigidcli.check.base import VERDICTS, Verdict
from rigidcli.check.codes import CODES
from rigidcli.check.records import URGENT, Judged, Judgement, Student, Told, told
from rigidcli.check.reports import Style
from rigidcli.check.reports.items import LONGEST_ANSWER, MOST_TOLD, Tally, tally
from rigidcli.check.reports.table import as_one, counted, points, score
from rigidcli.errors import ExpressionError, printable, shortened
from rigidcli.render import Look
from rigidcli.render.web.page import page, resource, text
from rigidcli.report import Report

STYLE = "classroom.css"
"""The style of these pages, besides that of every page."""

INDEX = "index.html"
"""The page of the class in a folder of pages."""

RESERVED = frozenset(
    ["index", "con", "prn", "aux", "nul", *(f"{name}{n}" for name in ("com", "lpt") for n in range(1, 10))]
)
"""Names, without their ending, that no page of a student has: the class's, and those of Windows' devices."""

LONGEST_NAME = 50
"""Characters of a file's name that are taken from a student's: 200 bytes at most, where systems allow 255."""

LONGEST_TYPESET = 300
"""Characters of an answer that is set as a formula: a longer one is read more easily as text."""

_FORMULA = re.compile(r"(?![-+]?[0-9.]+(?:e[-+]?[0-9]+)? [A-Za-z])(?=.*[A-Za-z])(?=.*[-+*/^=(]).*")
"""What is set as a formula: more than a word, and no number with its unit."""

BINS = 10
"""Bars of the distribution of scores, each for a tenth of the points."""

MARKS: dict[Verdict, str] = {
    "review": "?",
    "correct": "✓",
    "partial": "◐",
    "incorrect": "✗",
    "invalid": "!",
    "missing": "–",
}
"""What stands for a verdict in the table of students, so that nobody depends on colours."""


@dataclass(frozen=True, slots=True)
class Course:
    """What pages say besides judgements: the title of the assignment, and solutions that are `worked`.

    `remarks` are on files and students; they may grow as long as there are judgements to come.
    """

    title: str
    remarks: Sequence[str] = ()
    solutions: Mapping[str, str] = field(default_factory=dict)


def one_page(judgements: Iterable[Judgement], course: Course, style: Style) -> Iterator[str]:
    """The class on one page, with the feedback for each student folded in it."""
    judged = tuple(judgements)
    links = [f"#student{number}" for number in range(1, len(judged) + 1)]
    return _class_page(judged, course, style, links, folded=True)


def pages(judgements: Iterable[Judgement], course: Course, style: Style) -> Iterator[tuple[str, str]]:
    """Files of a folder, each a name and what stands in it: a page for each student, then the class's."""
    judged, links = [], []
    taken = set(RESERVED)
    for judgement in judgements:
        name = file_name(judgement.student, taken)
        judged.append(judgement)
        links.append(quote(name))
        yield name, "".join(student_page(told(judgement, style.feedback), course))
    yield INDEX, "".join(_class_page(judged, course, style, links, folded=False))


def file_name(student: str, taken: set[str]) -> str:
    """A name for the page of a student, made of words alone, and none of those `taken`, to which it is added.

    Names count as the same where systems take capitals, or forms of a letter, for the same.
    """
    words = re.findall(r"\w+", unicodedata.normalize("NFKC", student))
    stem = name = "-".join(words)[:LONGEST_NAME] or "student"
    count = 1
    while name.casefold() in taken:
        count += 1
        name = f"{stem}-{count}"
    taken.add(name.casefold())
    return f"{name}.html"


# --- a student


def student_page(student: Student, course: Course) -> Iterator[str]:
    """The page of a student, piece by piece."""
    part = _share(student.score, student.max_score)
    body = [
        f"<h1>{own(student.student)}</h1>\n",
        f"<p>{own(course.title)}: <strong>{score(student)}{part}</strong></p>\n",
        *_answers(student, course.solutions),
        f'<p class="quiet">{own(Path(student.source).name)}</p>\n' if student.source else "",
    ]
    return page(f"{course.title}: {student.student}", body, styles=[resource(STYLE)])


def _answers(student: Student, solutions: Mapping[str, str]) -> Iterator[str]:
    """Each question with its title, the answer as typed and as read, its verdict, and what is said of it."""
    for question in as_one(student):
        yield f'<section class="answer {question.verdict}">\n<h3>{own(question.id)}'
        yield f" <span>{question.verdict}, {score(question)}</span></h3>\n"
        if question.title:
            yield f'<p class="title">{own(question.title)}</p>\n'
        if question.answer:
            yield f"<p>Your answer: <code>{own(question.answer)}</code></p>\n"
        if question.read_as:
            yield f"<p>Read as: {typeset(question.read_as)}</p>\n"
        if question.feedback:
            remarks = (f"<li>{own(remark.message)}</li>" for remark in question.feedback)
            yield f"<ul>{''.join(remarks)}</ul>\n"
        yield solutions.get(question.id, "")
        yield "</section>\n"


@cache
def _has_formulas() -> bool:
    from rigidcli.render.plots import has_library

    return has_library("formulas")


def typeset(words: str) -> str:
    """An expression, or equations, as a formula where the library for it is there; other words as text."""
    from rigidcli.language.expression import parse
    from rigidcli.language.text import latex

    if len(words) > LONGEST_TYPESET or not _has_formulas() or not _FORMULA.fullmatch(words):
        return own(words)
    from rigidcli.render.web.mathml import formula

    try:
        lines = [
            " = ".join(latex(parse(side).root) for side in line.split("=")) for line in words.split("; ")
        ]
        return "<br>".join(map(formula, lines))
    except ExpressionError:
        return own(words)


def worked(solutions: Mapping[str, Report]) -> dict[str, str]:
    """The working of questions, folded, by their names as they are shown."""
    tell = _as_formulas if _has_formulas() else _as_text
    return {
        printable(id): f'<details class="solution"><summary>Solution</summary>\n{tell(report)}</details>\n'
        for id, report in solutions.items()
    }


def _as_formulas(report: Report) -> str:
    from rigidcli.render.html import fragment

    return fragment(replace(report, pictures=()), Look(steps=True))


def _as_text(report: Report) -> str:
    from rigidcli.render.table import render

    lines = "\n".join(map(text, "".join(render([report], Look(steps=True))).split("\n")))
    return f"<pre>{lines}</pre>"


def own(words: str) -> str:
    """Words of somebody else: text, whose direction changes nothing beside it."""
    return f"<bdi>{text(words)}</bdi>"


def _lines(words: str) -> str:
    """The lines of somebody else's words."""
    return "<br>".join(map(own, words.split("\n"))) if words else ""


def _share(score: float, most: float) -> str:
    """A share of the points in brackets, if there are points."""
    return f" ({score / most:.0%})" if most else ""


# --- the class


def _class_page(
    judged: Sequence[Judgement], course: Course, style: Style, links: Sequence[str], *, folded: bool
) -> Iterator[str]:
    return page(course.title, _class(judged, course, style, links, folded=folded), styles=[resource(STYLE)])


def _class(
    judged: Sequence[Judgement], course: Course, style: Style, links: Sequence[str], *, folded: bool
) -> Iterator[str]:
    students = [told(judgement, style.feedback) for judgement in judged]
    tallies = tally(judged)
    yield f"<h1>{own(course.title)}</h1>\n"
    if students:
        yield f"<p>{_summary(students)}</p>\n"
        yield from _first(students, tallies, links)
        yield from _distribution(students)
        yield from _questions(tallies, course, style)
        yield from _mistakes(students)
        yield from _table(judged, links)
    else:
        yield "<p>There are no answers to judge.</p>\n"
    if course.remarks:
        yield f"<h2>Files and notes</h2>\n{_list(map(_lines, course.remarks))}"
    if folded and students:
        yield "<h2>Feedback</h2>\n"
        for number, student in enumerate(students, 1):
            yield f"<details><summary>{own(student.student)}, {score(student)}</summary>\n"
            yield f'<div id="student{number}">\n'
            yield from _answers(student, {})
            yield "</div></details>\n"


def _summary(students: Sequence[Student]) -> str:
    scores, most = [student.score for student in students], students[-1].max_score
    mean = sum(scores) / len(scores)
    count = "1 student" if len(students) == 1 else f"{len(students):,} students"
    return f"{count}; mean {points(mean)}/{points(most)}{_share(mean, most)}, median {points(median(scores))}"


def _first(students: Sequence[Student], tallies: Sequence[Tally], links: Sequence[str]) -> Iterator[str]:
    """What a person must look at: answers that the program cannot judge or read, and keys in doubt."""
    asked: dict[Verdict, list[str]] = {verdict: [] for verdict in URGENT}
    for student, link in zip(students, links, strict=True):
        who = f'<a href="{link}">{own(student.student)}</a>'
        for question in as_one(student):
            if question.verdict in URGENT:
                answer = _short_code(question)
                parts = [f"{who}, {own(question.id)}", answer, _lines(question.message)]
                asked[question.verdict].append("<br>".join(filter(None, parts)))
    doubted = [own(tally.question) for tally in tallies if tally.suspicious]
    if not (any(asked.values()) or doubted):
        return
    yield "<h2>To look at first</h2>\n"
    if asked["review"]:
        yield "<h3>Answers that wait for a person to judge</h3>\n<p>They have no points yet; "
        yield f"<code>--overrides</code> gives them some.</p>\n{_list(asked['review'])}"
    if asked["invalid"]:
        yield f"<h3>Answers that are not readable</h3>\n{_list(asked['invalid'])}"
    if doubted:
        yield "<h3>Keys that may be wrong</h3>\n<p>Several students gave the same answer, and no known "
        yield f"mistake leads to it.</p>\n{_list(doubted)}"


def _short_code(question: Told) -> str:
    answer = shortened(question.answer, LONGEST_ANSWER)
    return f"<code>{own(answer)}</code>" if answer else ""


def _distribution(students: Sequence[Student]) -> Iterator[str]:
    """How many students have each tenth of the points."""
    most = students[-1].max_score
    if not most:
        return
    counts = Counter(min(int(BINS * student.score / most), BINS - 1) for student in students)
    longest = max(counts.values())
    yield f"<h2>Scores</h2>\n<p>Students by their share of {points(most)} points.</p>\n"
    yield '<table class="bars">\n'
    for place in range(BINS):
        width = 85 * counts[place] / longest
        ends = f"{100 * place // BINS}–{100 * (place + 1) // BINS} %"
        yield f'<tr><th scope="row">{ends}</th>'
        yield f'<td><span class="bar" style="width:{width:.4g}%"></span>{counts[place] or ""}</td></tr>\n'
    yield "</table>\n"


def _questions(tallies: Sequence[Tally], course: Course, style: Style) -> Iterator[str]:
    """Each question with its facility, its verdicts, and below them answers that are not right."""
    yield "<h2>Questions</h2>\n<p>The facility is the mean share of the points, of the answers that are "
    yield 'judged.</p>\n<div class="wide"><table>\n<tr><th scope="col">Question</th>'
    yield '<th scope="col" class="number">Facility</th><th scope="col">Verdicts</th></tr>\n'
    for each in tallies:
        facility = "" if each.facility is None else f"{each.facility:.0%}"
        shares = "".join(
            f'<span class="{verdict}" style="flex-grow:{count}"></span>'
            for verdict, count in each.verdicts.items()
            if count
        )
        yield f'<tr><th scope="row">{own(each.question)}</th><td class="number">{facility}</td>'
        yield f'<td><div class="shares">{shares}</div>{counted(each.verdicts)}</td></tr>\n'
    yield "</table></div>\n"
    for each in tallies:
        solution = course.solutions.get(each.question, "")
        if each.answers or solution:
            yield f"<h3>{own(each.question)}</h3>\n"
        if each.answers:
            yield _list(_taken(each, style))
        yield solution


def _taken(each: Tally, style: Style) -> Iterator[str]:
    """The most frequent answers to a question that are not right."""
    for taken in each.answers[:MOST_TOLD]:
        # Codes are reasons, too.
        codes = " ".join(taken.codes) if style.feedback.reasons else ""
        doubt = "no known mistake: the key may be wrong" if taken.suspicious else ""
        why = ", ".join(filter(None, [taken.verdict, codes, doubt]))
        answer = own(shortened(taken.answer, LONGEST_ANSWER))
        yield f'{taken.students} × <code>{answer}</code> <span class="quiet">{why}</span>'
    if len(each.answers) > MOST_TOLD:
        yield f"and {len(each.answers) - MOST_TOLD} other answers"


def _mistakes(students: Sequence[Student]) -> Iterator[str]:
    """The codes of what is not right, in plain words, the most frequent first."""
    found: dict[str, Counter[str]] = defaultdict(Counter)
    for student in students:
        for question in as_one(student):
            for code in question.codes if question.verdict not in ("correct", "review") else ():
                found[code][question.id] += 1
    if not found:
        return
    yield '<h2>Mistakes</h2>\n<div class="wide"><table>\n<tr><th scope="col" class="number">Answers</th>'
    yield '<th scope="col">Meaning</th><th scope="col">Code</th><th scope="col">Questions</th></tr>\n'
    for code, where in sorted(found.items(), key=lambda entry: (-entry[1].total(), entry[0])):
        places = ", ".join(f"{own(id)} ({count})" for id, count in where.most_common())
        yield f'<tr><td class="number">{where.total()}</td><td class="words">{text(CODES[code])}</td>'
        yield f'<td><code>{code}</code></td><td class="words">{places}</td></tr>\n'
    yield "</table></div>\n"


def _table(judged: Sequence[Judgement], links: Sequence[str]) -> Iterator[str]:
    """The students, each with the verdict on every question, in the order of the assignment."""
    legend = (f'<span class="mark {verdict}">{MARKS[verdict]} {verdict}</span>' for verdict in VERDICTS)
    yield f'<h2>Students</h2>\n<p class="legend">{"".join(legend)}</p>\n'
    ids = (f'<th scope="col">{own(question.id)}</th>' for question in judged[0].questions)
    yield '<div class="wide"><table class="class">\n'
    yield f'<thead><tr><th scope="col">Student</th><th scope="col">Score</th>{"".join(ids)}</tr></thead>\n'
    for judgement, link in zip(judged, links, strict=True):
        yield f'<tr><th scope="row"><a href="{link}">{own(judgement.student)}</a></th>'
        yield f'<td class="number">{points(judgement.score)}</td>'
        yield f"{''.join(map(_cell, judgement.questions))}</tr>\n"
    yield "</table></div>\n"


def _cell(question: Judged) -> str:
    mark = f'<span role="img" aria-label="{question.verdict}">{MARKS[question.verdict]}</span>'
    return f'<td><span class="mark {question.verdict}">{mark} {points(question.score)}</span></td>'


def _list(entries: Iterable[str]) -> str:
    return "<ul>\n" + "".join(f"<li>{entry}</li>\n" for entry in entries) + "</ul>\n"
