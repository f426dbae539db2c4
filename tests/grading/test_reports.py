"""Outputs by hand for a small class, and laws for hostile texts: nothing steers, computes or gives away."""

from __future__ import annotations

import csv
import io
import json
import pkgutil
import re
import unicodedata
from collections.abc import Sequence
from xml.etree import ElementTree as ET

import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from rich.cells import cell_len

from rigidcli.grading import reports
from rigidcli.grading.codes import CODES
from rigidcli.grading.feedback import Feedback, codes, remarks, sentence
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.outcome import VERDICTS, Finding
from rigidcli.grading.reports import FORMATS, Style, items, renderer
from rigidcli.grading.reports.csv import harmless, row
from rigidcli.grading.reports.layout import columns, points, shortened
from rigidcli.render.terminal import Page

few = settings(max_examples=100, deadline=None)

SECRET = "expected 6.28318"

AMY = Judgement(
    "amy",
    "answers/amy.yaml",
    (Judged("a", "correct", 3.0, 3.0), Judged("b", "correct", 2.0, 2.0, (Finding("second_order_form"),))),
)
BOB = Judgement(
    "bob",
    "answers/bob.yaml",
    (
        Judged("a", "incorrect", 0.0, 3.0, (Finding("sign_error", reference=SECRET),), "-3"),
        Judged(
            "b",
            "partial",
            0.5,
            2.0,
            (Finding("component_wrong", "Ixy", "read `1, 2`", SECRET), Finding("not_symmetric")),
        ),
    ),
)
CY = Judgement(
    "cy", "answers/cy.yaml", tuple(Judged(id, "missing", 0.0, p) for id, p in (("a", 3.0), ("b", 2.0)))
)
DEE = Judgement(
    "dee",
    "answers/dee.yaml",
    tuple(Judged(id, "invalid", 0.0, p, (Finding("too_deep"),)) for id, p in (("a", 3.0), ("b", 2.0))),
)
CLASS = (AMY, BOB, CY, DEE)


def text(name: str, judgements: Sequence[Judgement] = CLASS, style: Style | None = None) -> str:
    return "".join(renderer(name)(judgements, style or Style()))


def test_a_table_tells_what_is_not_right_and_how_the_class_did() -> None:
    assert (
        text("table")
        == f"""\
amy  5/5  all correct
  b  2/2  correct    {CODES["second_order_form"]}
bob  0.5/5
  a    0/3  incorrect  {CODES["sign_error"]}
  b  0.5/2  partial    Ixy: {CODES["component_wrong"]}; read `1, 2`
                       {CODES["not_symmetric"]}
cy  0/5
  every question  0/5  missing
dee  0/5
  every question  0/5  invalid    {CODES["too_deep"]}

4 students, mean 1.38/5 (28%)
  a   25%  1 correct, 1 incorrect, 1 invalid, 1 missing
  b   25%  1 correct, 1 partial, 1 invalid, 1 missing
"""
    )


def test_a_table_of_one_student_has_no_summary() -> None:
    assert text("table", [CY]) == "cy  0/5\n  every question  0/5  missing\n"


def test_a_table_is_broken_at_the_edge_between_words() -> None:
    long = Finding("component_wrong", detail="one two three four five six seven eight nine ten eleven")
    student = Judgement("eve", "eve.yaml", (Judged("a", "incorrect", 0.0, 1.0, (long,)),))
    wide, narrow = (text("table", [student], Style(width=width)).splitlines() for width in (80, 40))
    indent = " " * len("  a  0/1  incorrect  ")
    assert len(wide) == 3
    assert wide[2].startswith(indent)
    assert wide[2][len(indent)] != " "
    # Below its head, where there is too little room beside it.
    assert narrow[1] == "  a  0/1  incorrect"
    assert all(re.match(r"    \S", line) for line in narrow[2:])
    words = " ".join(" ".join(wide).split())
    assert words == " ".join(" ".join(narrow).split())
    assert words.endswith(sentence(long))


def test_colours_are_on_verdicts_and_names_only() -> None:
    coloured = text("table", style=Style(width=120, colour=True))
    assert "\x1b[1mbob\x1b[0m  0.5/5\n" in coloured
    assert "0/3  \x1b[31mincorrect\x1b[0m  " in coloured
    assert "0.5/2  \x1b[33mpartial\x1b[0m    " in coloured
    assert "2/2  \x1b[32mcorrect\x1b[0m    " in coloured
    assert re.sub("\x1b\\[[0-9]+m", "", coloured) == text("table")


def test_json_is_the_contract() -> None:
    first, second = text("json", [AMY, BOB]).splitlines()
    assert first == (
        '{"schema":"rigidcli.check/1","student":"amy","source":"answers/amy.yaml","score":5.0,"max_score":5.0,'
        '"questions":[{"id":"a","verdict":"correct","score":3.0,"max_score":3.0,"feedback":[]},'
        '{"id":"b","verdict":"correct","score":2.0,"max_score":2.0,'
        f'"feedback":[{{"code":"second_order_form","message":"{CODES["second_order_form"]}"}}]}}]}}'
    )
    assert json.loads(second)["questions"][1]["feedback"] == [
        {"code": "component_wrong", "message": f"Ixy: {CODES['component_wrong']}; read `1, 2`"},
        {"code": "not_symmetric", "message": CODES["not_symmetric"]},
    ]


def test_csv_has_a_row_a_question() -> None:
    assert text("csv", [BOB, CY]) == f"""\
student,question,verdict,score,max_score,codes,message
bob,a,incorrect,0.0,3.0,sign_error,{CODES["sign_error"]}
bob,b,partial,0.5,2.0,component_wrong not_symmetric,"Ixy: {CODES["component_wrong"]}; read `1, 2`; {CODES["not_symmetric"]}"
cy,a,missing,0.0,3.0,,
cy,b,missing,0.0,2.0,,
"""  # fmt: skip  # noqa: E501 - a row is a line


def test_csv_may_be_without_a_header() -> None:
    assert text("csv", [CY], Style(header=False)) == "cy,a,missing,0.0,3.0,,\ncy,b,missing,0.0,2.0,,\n"


def test_junit_has_a_suite_a_student_and_a_case_a_question() -> None:
    root = ET.fromstring(text("junit"))
    counts = {"tests": "8", "failures": "4", "errors": "2"}
    assert root.tag == "testsuites"
    assert {name: root.get(name) for name in counts} == counts
    assert [suite.get("name") for suite in root] == ["amy", "bob", "cy", "dee"]
    assert [suite.get("errors") for suite in root] == ["0", "0", "0", "2"]
    cases = {(case.get("classname"), case.get("name")): list(case) for case in root.iter("testcase")}
    assert not cases["amy", "b"]
    assert [each.tag for each in cases["cy", "a"]] == ["failure"]
    assert [each.tag for each in cases["dee", "a"]] == ["error"]
    (failure,) = cases["bob", "b"]
    told = [f"Ixy: {CODES['component_wrong']}; read `1, 2`", CODES["not_symmetric"]]
    assert failure.attrib == {"message": f"partial (0.5/2): {'; '.join(told)}", "type": "partial"}
    assert failure.text == "\n".join(told)


def test_gradescope_has_a_test_a_question() -> None:
    (line,) = text("gradescope", [BOB]).splitlines()
    results = json.loads(line)
    assert results["score"] == 0.5
    assert results["visibility"] == "visible"
    assert {results[key] for key in results if key.endswith("_format")} == {"text"}
    assert [test["status"] for test in results["tests"]] == ["failed", "failed"]
    assert results["tests"][0] == {
        "name": "a",
        "score": 0.0,
        "max_score": 3.0,
        "status": "failed",
        "output": f"incorrect\n{CODES['sign_error']}",
    }
    assert json.loads(text("gradescope", [AMY]))["tests"][0]["status"] == "passed"


def test_feedback_levels_tell_more_and_more() -> None:
    question = BOB.questions[0]
    assert remarks(question, Feedback.none) == remarks(question, Feedback.verdict) == ()
    (hint,), (full,) = remarks(question, Feedback.hint), remarks(question, Feedback.full)
    assert (hint.code, hint.message) == ("sign_error", CODES["sign_error"])
    assert full.message == f"{CODES['sign_error']}; {SECRET}"


def test_codes_are_told_once() -> None:
    question = Judged("a", "incorrect", 0, 1, (Finding("sign_error", "x"), Finding("sign_error", "y")))
    assert codes(remarks(question, Feedback.hint)) == ("sign_error",)


@pytest.mark.parametrize("name", FORMATS)
def test_references_are_told_at_full_only(name: str) -> None:
    for feedback in Feedback:
        assert (SECRET in text(name, style=Style(feedback))) == (feedback is Feedback.full)


@pytest.mark.parametrize("name", FORMATS)
def test_no_sentence_is_told_below_hint(name: str) -> None:
    for feedback in (Feedback.none, Feedback.verdict):
        told = text(name, style=Style(feedback))
        assert not [code for code in CODES if code in told or CODES[code] in told]


def test_at_level_none_texts_for_students_do_not_tell_the_verdict() -> None:
    style = Style(Feedback.none)
    for results in map(json.loads, text("gradescope", style=style).splitlines()):
        assert results["visibility"] == "hidden"
        assert {test["output"] for test in results["tests"]} == {""}
    junit = text("junit", style=style)
    assert not [verdict for verdict in VERDICTS if verdict in junit]
    # Scores and verdicts stay where programs read them.
    assert [line["score"] for line in map(json.loads, text("json", style=style).splitlines())] == [
        5,
        0.5,
        0,
        0,
    ]
    assert "bob,b,partial,0.5,2.0,,\n" in text("csv", style=style)


def test_at_level_verdict_students_see_verdicts_and_no_more() -> None:
    style = Style(Feedback.verdict)
    results = json.loads(text("gradescope", [BOB], style))
    assert [test["output"] for test in results["tests"]] == ["incorrect", "partial"]
    (failure, _) = ET.fromstring(text("junit", [BOB], style)).iter("failure")
    assert failure.get("message") == "incorrect (0/3)"


def test_every_format_is_a_module_and_every_module_a_format() -> None:
    helpers = {"canvas", "items", "layout", "reading", "roster"}
    assert {found.name for found in pkgutil.iter_modules(reports.__path__)} - helpers == set(FORMATS)
    assert all(callable(renderer(name)) for name in FORMATS)


def test_every_format_begins_before_the_class_is_judged() -> None:
    """But for JUnit, which counts first."""

    def judged_one() -> object:
        yield AMY
        raise AssertionError("the second one is asked for too early")

    for name in set(FORMATS) - {"junit"}:
        assert next(renderer(name)(judged_one(), Style()))  # type: ignore[arg-type]


PIECES = st.sampled_from(
    [
        *(
            "=1+1",
            "+1",
            "-2",
            "@SUM(A1)",
            "\t=1",
            "\r=1",
            " =1",
            "＝1",
            "；=1",
            ";=1",
            '";=1',
            ';"=1',
            "; -1",
        ),
        *(
            "\x1b[31m",
            "\x1b]8;;http://x\x07",
            "\u202e",
            "\u2066",
            "\x00",
            "\x85",
            "\u2028",
            "\ufeff",
            "\ud800",
        ),
        *(
            "]]>",
            "<!--",
            "&amp;",
            "<b>",
            '"',
            "'",
            ",",
            "\n",
            "\r\n",
            "\\",
            "日本",
            "é",
            "\ufffe",
            "[red]",
            "a" * 90,
        ),
    ]
)
HOSTILE = st.lists(PIECES | st.text(st.characters(exclude_categories=()), max_size=6), max_size=4).map(
    "".join
)


@st.composite
def classes(draw: st.DrawFn) -> list[Judgement]:
    def finding() -> Finding:
        return Finding(draw(st.sampled_from(sorted(CODES))), draw(HOSTILE), draw(HOSTILE), SECRET)

    ids = draw(st.lists(HOSTILE.filter(bool), min_size=1, max_size=3, unique=True))
    students = []
    for _ in range(draw(st.integers(1, 3))):
        questions = tuple(
            Judged(
                id,
                draw(st.sampled_from(VERDICTS)),
                draw(st.sampled_from([0.0, 1 / 3, 2.0, 12.25])),
                draw(st.sampled_from([0.0, 1.0, 12.25])),
                tuple(finding() for _ in range(draw(st.integers(0, 2)))),
                draw(HOSTILE),
            )
            for id in ids
        )
        students.append(Judgement(draw(HOSTILE), draw(HOSTILE), questions))
    return students


def require_harmless(output: str) -> None:
    """No character that steers a terminal or the direction of text, and no half of a pair."""
    assert not [c for c in output if c != "\n" and unicodedata.category(c) in ("Cc", "Cf", "Cs", "Zl", "Zp")]
    output.encode()


@given(classes(), st.sampled_from(list(Feedback)), st.sampled_from([None, 60, 80, 120]))
@few
def test_hostile_texts_are_harmless_in_every_format(
    judgements: list[Judgement], feedback: Feedback, width: int | None
) -> None:
    style = Style(feedback, width=width)
    outputs = {name: text(name, judgements, style) for name in FORMATS}
    tallies = items.tally(judgements)
    outputs |= {f"items {name}": "".join(each(tallies, style)) for name, each in items.TEXTS.items()}
    for name, output in outputs.items():
        require_harmless(output)
        if feedback is not Feedback.full or name.startswith("items"):
            assert SECRET not in output, name
    if width is not None:
        lines = (outputs["table"] + outputs["items table"]).splitlines()
        assert max(map(columns, lines)) <= width
    count = sum(len(judgement.questions) for judgement in judgements)
    assert len(ET.fromstring(outputs["junit"]).findall("./testsuite/testcase")) == count
    for name in ("json", "gradescope", "items json"):
        assert all(isinstance(json.loads(line), dict) for line in outputs[name].splitlines())
    for name, width_of_row in (("csv", 7), ("items csv", len(items.HEADER))):
        rows = list(csv.reader(io.StringIO(outputs[name]), strict=True))
        assert {len(cells) for cells in rows} == {width_of_row}
        for cell in (cell for cells in rows for cell in cells):
            assert not re.match(r"[\s\"]*[=+\-@＝＋－＠]", cell)
    assert len(list(csv.reader(io.StringIO(outputs["csv"])))) == count + 1


@given(HOSTILE)
@few
def test_a_cell_cannot_become_a_formula_where_semicolons_separate_cells(raw: str) -> None:
    for cells in csv.reader(io.StringIO(row(raw, 1.0, raw)), delimiter=";"):
        assert not [cell for cell in cells if re.match(r"[\s\"]*[=+\-@＝＋－＠]", cell)]


@pytest.mark.parametrize("honest", ["jane_doe", "a = b", "x; y", "O'Neil", "3 - 2", "", "a;b = 1"])
def test_honest_texts_stay_as_they_are(honest: str) -> None:
    assert harmless(honest) == honest


@given(st.text(st.characters(exclude_categories=("Cc", "Cs", "Cf", "Zl", "Zp"))), st.integers(8, 60))
@few
def test_wrapping_keeps_every_letter_and_the_width(raw: str, width: int) -> None:
    # rich and Python may know different versions of Unicode, whose newest characters differ in width.
    assume(columns(raw) == cell_len(raw))
    page = Page(width, colour=False)
    page.line((raw, ""))
    lines = str(page).split("\n")
    assert max(map(columns, lines)) <= width
    assert "".join("".join(lines).split()) == "".join(raw.split())
    assert columns(shortened(raw, width)) <= width


@pytest.mark.parametrize(
    ("score", "written"),
    [
        (0.0, "0"),
        (3.0, "3"),
        (2.5, "2.5"),
        (8 / 3, "2.67"),
        (100.0, "100"),
        (0.001, "0.001"),
        (1e6, "1000000"),
    ],
)
def test_scores_for_people_are_short(score: float, written: str) -> None:
    assert points(score) == written
