"""The pages of a class: what stands in them, what never does, and what a hostile text cannot do."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence
from html.parser import HTMLParser

import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidcli.homework import Feedback
from rigidcli.homework.base import CODES, VERDICTS, Finding, Judged, Judgement
from rigidcli.homework.reports.formats import ReportStyle
from rigidcli.homework.reports.pages import Course, file_name, one_page, pages
from rigidcli.render.web.page import page
from tests.homework.asking import cases
from tests.homework.standins import mark, waiting
from tests.homework.test_reports import HOSTILE, SECRET, classes, few, require_harmless

SAYS = CODES

VOID = {"meta", "br"}


class Reader(HTMLParser):
    """Reads a page: its elements must close in order; `seen` are elements, `words` the text by element."""

    def __init__(self, source: str) -> None:
        super().__init__()
        self.open = list[str]()
        self.seen = list[tuple[str, dict[str, str | None]]]()
        self.words = list[tuple[str, str]]()
        self.feed(source)
        self.close()
        assert not self.open

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.seen.append((tag, dict(attrs)))
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.words.append((self.open[-1] if self.open else "", data))

    @property
    def text(self) -> str:
        """All words, with blanks as a reader sees them."""
        told = [data for tag, data in self.words if tag not in ("style", "title")]
        return " ".join("".join(told).split())


def student(name: str, *questions: Judged) -> Judgement:
    return Judgement(name, f"in/{name}.yaml", questions)


def one(*judgements: Judgement, style: ReportStyle | None = None, course: Course | None = None) -> Reader:
    return Reader("".join(one_page(judgements, course or Course("Homework"), style or ReportStyle())))


WRONG = Finding("sign_error", reference=SECRET)

CLASS = (
    student("amy", mark("a", "correct", 3.0, 3.0), mark("b", "correct", 1.0, 1.0)),
    student("bob", mark("a", "incorrect", 0.0, 3.0, (WRONG,), "-3"), mark("b", "partial", 0.5, 1.0)),
    student("cy", mark("a", "missing", 0.0, 3.0), waiting("b", 1.0)),
    student("dee", *(mark(id, "invalid", 0.0, n, (Finding("too_large"),)) for id, n in (("a", 3), ("b", 1)))),
)


def test_the_page_of_a_class_tells_scores_and_what_waits() -> None:
    told = one(*CLASS, course=Course("Homework", ["nowhere: cannot be read"])).text
    # Scores are 4, 0.5, 0 and 0 of 4.
    assert "4 students, mean 1.12/4 (28%)" in told
    waiting = f"cy, b: review{SAYS['undecided']}; it may be singular"
    assert f"To look at first {waiting} dee, every question: invalid{SAYS['too_large']}" in told
    assert "StudentScoreab amy431 bob0.500.5 cy0missingreview dee0invalidinvalid mean1.120.750.38" in told
    assert "nowhere: cannot be read" in told


def test_a_class_of_nobody_and_questions_without_points_are_told() -> None:
    assert "There are no answers to judge." in one().text
    told = one(student("x", mark("a", "correct", 0.0, 0.0))).text
    assert "1 student, mean 0/0" in told


def test_a_folder_has_a_page_for_each_student_and_links_to_it() -> None:
    files = dict(pages(CLASS, Course("Homework"), ReportStyle()))
    assert list(files) == ["amy.html", "bob.html", "cy.html", "dee.html", "index.html"]
    links = [found["href"] for tag, found in Reader(files["index.html"]).seen if tag == "a"]
    assert set(links) == set(files) - {"index.html"}
    bob = Reader(files["bob.html"]).text
    assert bob.startswith("bob Homework: 0.5/4 (12%)")
    assert f"a incorrect, 0/3 Your answer: -3 Read as: -3 {SAYS['sign_error']} b partial, 0.5/1" in bob
    assert not [name for name in ("amy", "cy", "dee") if name in bob]
    # What is true of all questions is told once.
    assert Reader(files["dee.html"]).text.count(SAYS["too_large"]) == 1


def test_on_one_page_the_links_lead_to_the_feedback_in_it() -> None:
    seen = one(*CLASS).seen
    links = {str(found["href"]) for tag, found in seen if tag == "a"}
    assert links == {f"#{found['id']}" for tag, found in seen if "id" in found}
    assert len(links) == len(CLASS)


@pytest.mark.parametrize("feedback", Feedback)
def test_a_page_tells_no_more_than_the_level_allows(feedback: Feedback) -> None:
    style = ReportStyle(feedback)
    sources = {"one": "".join(one_page(CLASS, Course("H"), style)), **dict(pages(CLASS, Course("H"), style))}
    for name, source in sources.items():
        told = Reader(source).text
        assert (SECRET in told) == (feedback is Feedback.full and name in ("one", "bob.html"))
        if not feedback.reasons:
            assert not [code for code in SAYS if code in told or SAYS[code] in told]


@given(classes(), st.sampled_from(list(Feedback)))
@few
def test_hostile_texts_stay_text(judgements: list[Judgement], feedback: Feedback) -> None:
    require_inert(judgements, feedback)


EVIL = [
    "<script>alert(1)</script>", "</script><script>alert(1)</script>", "</style><img src=x onerror=alert(1)>",
    "javascript:alert(1)", '" onclick="alert(1)', "'><svg/onload=alert(1)>", "&lt;b&gt;", "<!--", "]]>",
    "\u202eevil", "../../etc/passwd", "/etc/passwd", "..", ".", "", "con", "index", "a\0b", "\x1b[31m",
]  # fmt: skip


@pytest.mark.parametrize("evil", EVIL)
def test_an_evil_text_is_told_as_it_is(evil: str) -> None:
    finding = Finding("sign_error", evil, evil, evil)
    questions = [mark(evil or "q", verdict, 1.0, 2.0, (finding,), evil) for verdict in VERDICTS]
    require_inert([Judgement(evil, evil, (question,)) for question in questions], Feedback.full, evil)
    if evil.isprintable() and evil == " ".join(evil.split()):
        told = one(*(Judgement(evil, evil, (question,)) for question in questions)).text
        assert evil in told


def require_inert(judgements: Sequence[Judgement], feedback: Feedback, title: str = "H") -> None:
    """The elements are those of a harmless class, links lead to pages beside, and nothing is loaded."""
    course, style = Course(title, [title]), ReportStyle(feedback)
    files = list(pages(judgements, course, style))
    names = [name for name, _ in files]
    assert len({unicodedata.normalize("NFKC", name).casefold() for name in names}) == len(judgements) + 1
    assert all(re.fullmatch(r"[\w-]+\.html", name) and len(name.encode()) <= 255 for name in names)
    for source in ("".join(one_page(judgements, course, style)), *(source for _, source in files)):
        require_harmless(source)
        for tag, attributes in Reader(source).seen:
            assert tag not in ("script", "img", "svg", "iframe", "link", "b")
            assert not [name for name in attributes if name.startswith("on") or name in ("src", "srcset")]
            if tag == "a":
                assert re.fullmatch(r"#student[0-9]+|[\w%-]+\.html", str(attributes["href"]))
        policy = [found["content"] for tag, found in Reader(source).seen if "http-equiv" in found]
        assert policy == [found["content"] for _, found in Reader("".join(page("", []))).seen[3:4]]


@given(
    st.lists(HOSTILE | st.sampled_from(["Ada", "ada", "ADA", "ａｄａ", "ada-2", "é", "e\u0301"]), max_size=8)
)
@few
def test_names_of_files_are_words_and_never_twice_the_same(students: list[str]) -> None:
    taken = set[str]()
    names = [file_name(student, taken) for student in students]
    assert len({unicodedata.normalize("NFKC", name).casefold() for name in names}) == len(students)
    assert all(re.fullmatch(r"[\w-]+\.html", name) for name in names)


@cases(
    """
    name | student
    Ada-Lovelace.html | Ada Lovelace
    doe_4711.html | doe_4711
    a-b-org.html | a@b.org
    王小明.html | 王小明
    etc-passwd.html | ../../etc/passwd
    student.html | ...
    """,
    ("x" * 50 + ".html", "x" * 400),
)
def test_names_of_files_tell_the_student(student: str, name: str) -> None:
    assert file_name(student, set()) == name
