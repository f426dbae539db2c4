"""A class on a page of HTML, for the instructor, and a page for each student.

All texts of students and files pass through `sheet.own`, what is found in answers through `feedback.told`.
"""

from __future__ import annotations

import re
import unicodedata
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from itertools import starmap
from statistics import median
from urllib.parse import quote

from rigidcli.errors import shortened
from rigidcli.grading.feedback import Student, sentences, told
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.outcome import VERDICTS, Verdict
from rigidcli.grading.reports import Style
from rigidcli.grading.reports.items import LONGEST_ANSWER, MOST_TOLD, Tally, tally
from rigidcli.grading.reports.sheet import STYLE, Course, answers, lines, own, share, student_page
from rigidcli.grading.reports.table import as_one, counted, points, score
from rigidcli.render.web.page import page, resource, text

INDEX = "index.html"
"""The page of the class in a folder of pages."""

RESERVED = frozenset(
    ["index", "con", "prn", "aux", "nul", *(f"{name}{n}" for name in ("com", "lpt") for n in range(1, 10))]
)
"""Names, without their ending, that no page of a student has: the class's, and those of Windows' devices."""

LONGEST_NAME = 50
"""Characters of a file's name that are taken from a student's: 200 bytes at most, where systems allow 255."""

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

    Names are told apart as systems do that take capitals, or forms of a letter, for the same.
    """
    words = re.findall(r"\w+", unicodedata.normalize("NFKC", student))
    stem = name = "-".join(words)[:LONGEST_NAME] or "student"
    count = 1
    while name.casefold() in taken:
        count += 1
        name = f"{stem}-{count}"
    taken.add(name.casefold())
    return f"{name}.html"


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
        yield f"<h2>Files and notes</h2>\n{_list(map(lines, course.remarks))}"
    if folded and students:
        yield "<h2>Feedback</h2>\n"
        for number, student in enumerate(students, 1):
            yield f"<details><summary>{own(student.student)}, {score(student)}</summary>\n"
            yield f'<div id="student{number}">\n'
            yield from answers(student, course, solved=False)
            yield "</div></details>\n"


def _summary(students: Sequence[Student]) -> str:
    scores, most = [student.score for student in students], students[-1].max_score
    mean = sum(scores) / len(scores)
    count = "1 student" if len(students) == 1 else f"{len(students):,} students"
    told = f"{points(mean)}/{points(most)}{share(mean, most)}"
    return f"{count}; mean {told}, median {points(median(scores))}"


def _first(students: Sequence[Student], tallies: Sequence[Tally], links: Sequence[str]) -> Iterator[str]:
    """What a person must look at: answers that wait, keys in doubt, and files that could not be read."""
    waiting: dict[tuple[str, str], list[str]] = {}
    unread: dict[tuple[str, str], list[str]] = {}
    for student, link in zip(students, links, strict=True):
        who = f'<a href="{link}">{own(student.student)}</a>'
        for question in student.questions:
            if question.verdict == "review":
                waiting.setdefault((question.id, question.message), []).append(who)
        first, *others = as_one(student)
        if first.verdict == "invalid" and not others:
            unread.setdefault(("", first.message), []).append(who)
    doubted = [own(tally.question) for tally in tallies if tally.suspicious]
    if not (waiting or doubted or unread):
        return
    yield "<h2>To look at first</h2>\n"
    if waiting:
        yield "<h3>Answers that wait for a person to judge</h3>\n<p>They have no points yet.</p>\n"
        yield _list(starmap(_shared, waiting.items()))
    if doubted:
        yield "<h3>Keys that may be wrong</h3>\n<p>Several students gave the same answer, and no known "
        yield f"mistake leads to it.</p>\n{_list(doubted)}"
    if unread:
        yield "<h3>Files of which nothing could be read</h3>\n"
        yield _list(starmap(_shared, unread.items()))


def _shared(reason: tuple[str, str], who: Sequence[str]) -> str:
    """A question and what is told of the answers, and the students of whom it is told."""
    told = ": ".join(filter(None, [*map(lines, reason)]))
    count = f"{len(who)} students: " if len(who) > 1 else ""
    return f"{told}<br>{count}{', '.join(who)}" if told else f"{count}{', '.join(who)}"


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
    if any(each.answers for each in tallies):
        yield "<p>Answers that are not right, the most frequent ones first:</p>\n"
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
    yield '<th scope="col">What is told</th><th scope="col">Code</th><th scope="col">Questions</th></tr>\n'
    for code, where in sorted(found.items(), key=lambda entry: (-entry[1].total(), entry[0])):
        places = ", ".join(f"{own(id)} ({count})" for id, count in where.most_common())
        yield f'<tr><td class="number">{where.total()}</td><td class="words">{text(sentences()[code])}</td>'
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
