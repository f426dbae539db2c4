"""Outputs by hand for a small class, and laws for hostile texts: nothing steers, computes or gives away."""

from __future__ import annotations

import csv
import io
import json
import re
import unicodedata
from collections.abc import Iterator, Sequence
from itertools import chain
from xml.etree import ElementTree as ET

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.homework import Feedback
from rigidcli.homework.base import CODES, VERDICTS, Finding, Judged, Judgement, reported, sentence
from rigidcli.homework.reports.formats import FORMATS, ReportStyle, by_question, csv_rows, points, render
from rigidcli.render.terminal import Page, cells
from tests.homework.standins import mark, waiting

few = settings(max_examples=100)

SAYS = CODES

SECRET = "expected 6.28318"

WRONG = Finding("sign_error", reference=SECRET)
UNLIKE = (Finding("component_wrong", "Ixy", "read `1, 2`", SECRET), Finding("not_symmetric"))
DEEP = (Finding("too_large"),)


def student(name: str, *questions: Judged) -> Judgement:
    return Judgement(name, f"answers/{name}.yaml", questions)


AMY = student(
    "amy", mark("a", "correct", 3.0, 3.0), mark("b", "correct", 2.0, 2.0, (Finding("second_order_form"),))
)
BOB = student("bob", mark("a", "incorrect", 0.0, 3.0, (WRONG,), "-3"), mark("b", "partial", 0.5, 2.0, UNLIKE))
CY = student("cy", mark("a", "missing", 0.0, 3.0), mark("b", "missing", 0.0, 2.0))
DEE = student("dee", mark("a", "invalid", 0.0, 3.0, DEEP), mark("b", "invalid", 0.0, 2.0, DEEP))
EVE = student("eve", mark("a", "incorrect", 0.0, 3.0, (WRONG,)), waiting("b", 2.0))
CLASS = (AMY, BOB, CY, DEE)

UNDECIDED = f"{SAYS['undecided']}; it may be singular"


def text(name: str, judgements: Sequence[Judgement] = CLASS, style: ReportStyle | None = None) -> str:
    return "".join(render(name, judgements, style or ReportStyle()))


def test_a_table_tells_what_is_not_right_and_how_the_class_did() -> None:
    expected = f"""\
1 answer needs a person: not judged, or not readable
  dee  every question  invalid    {SAYS["too_large"]}

amy  5/5  all correct
  b  2/2  correct    {SAYS["second_order_form"]}
bob  0.5/5
  a    0/3  incorrect  `-3`
                       {SAYS["sign_error"]}
  b  0.5/2  partial    Ixy: {SAYS["component_wrong"]}; read `1, 2`
                       {SAYS["not_symmetric"]}
cy  0/5
  every question  0/5  missing
dee  0/5
  every question  0/5  invalid

4 students, mean 1.38/5 (28%)
  a   25%  1 correct, 1 incorrect, 1 invalid, 1 missing
  b   25%  1 correct, 1 partial, 1 invalid, 1 missing
"""
    assert text("table") == expected


def test_a_table_of_one_student_has_no_summary() -> None:
    assert text("table", [CY]) == "cy  0/5\n  every question  0/5  missing\n"


def test_a_table_is_broken_at_the_edge_between_words() -> None:
    long = Finding("component_wrong", detail="one two three four five six seven eight nine ten eleven")
    eve = student("eve", mark("a", "incorrect", 0.0, 1.0, (long,)))
    wide, narrow = (text("table", [eve], ReportStyle(width=width)).splitlines() for width in (80, 40))
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
    coloured = text("table", style=ReportStyle(width=120, colour=True))
    assert "\x1b[1mbob\x1b[0m  0.5/5\n" in coloured
    assert "0/3  \x1b[31mincorrect\x1b[0m  " in coloured
    assert "0.5/2  \x1b[33mpartial\x1b[0m    " in coloured
    assert "2/2  \x1b[32mcorrect\x1b[0m    " in coloured
    assert re.sub("\x1b\\[[0-9]+m", "", coloured) == text("table", style=ReportStyle(width=120))


def test_json_is_the_contract() -> None:
    first, second = text("json", [AMY, BOB]).splitlines()
    assert first == (
        '{"schema":"rigidcli.check/1","student":"amy","source":"answers/amy.yaml","score":5.0,"max_score":5.0,'
        '"questions":[{"id":"a","title":"","answer":"","read_as":"","verdict":"correct","score":3.0,'
        '"max_score":3.0,"feedback":[]},'
        '{"id":"b","title":"","answer":"","read_as":"","verdict":"correct","score":2.0,"max_score":2.0,'
        f'"feedback":[{{"code":"second_order_form","message":"{SAYS["second_order_form"]}"}}]}}]}}'
    )
    assert json.loads(second)["questions"][1]["feedback"] == [
        {"code": "component_wrong", "message": f"Ixy: {SAYS['component_wrong']}; read `1, 2`"},
        {"code": "not_symmetric", "message": SAYS["not_symmetric"]},
    ]


def test_csv_has_a_row_a_question() -> None:
    table = text("csv", [BOB, CY])
    assert text("csv", [BOB, CY], ReportStyle(header=False)) == table.partition("\n")[2]
    assert table == f"""\
student,question,verdict,score,max_score,codes,message,source
bob,a,incorrect,0.0,3.0,sign_error,{SAYS["sign_error"]},answers/bob.yaml
bob,b,partial,0.5,2.0,component_wrong not_symmetric,"Ixy: {SAYS["component_wrong"]}; read `1, 2`; {SAYS["not_symmetric"]}",answers/bob.yaml
cy,a,missing,0.0,3.0,,,answers/cy.yaml
cy,b,missing,0.0,2.0,,,answers/cy.yaml
"""  # fmt: skip  # noqa: E501 - a row is a line


def test_junit_has_a_suite_a_student_and_a_case_a_question() -> None:
    root = ET.fromstring(text("junit", [*CLASS, EVE]))
    counted = ("name", "tests", "failures", "errors", "skipped")
    counts = ["".join(suite.attrib[name] for name in counted) for suite in root]
    assert counts == ["amy2000", "bob2200", "cy2200", "dee2020", "eve2101"]
    cases = {(case.get("classname"), case.get("name")): list(case) for case in root.iter("testcase")}
    assert not cases["amy", "b"]
    assert [each.tag for each in cases["cy", "a"]] == ["failure"]
    assert [each.tag for each in cases["dee", "a"]] == ["error"]
    (failure,), (skipped,) = cases["bob", "b"], cases["eve", "b"]
    said = [f"Ixy: {SAYS['component_wrong']}; read `1, 2`", SAYS["not_symmetric"]]
    assert failure.attrib == {"message": f"partial (0.5/2): {'; '.join(said)}"}
    assert failure.text == "\n".join(said)
    assert skipped.attrib == {"message": f"review (no points yet): {UNDECIDED}"}


def test_gradescope_has_a_test_a_question() -> None:
    (line,) = text("gradescope", [BOB]).splitlines()
    results = json.loads(line)
    assert results["score"] == 0.5
    assert results["visibility"] == "visible"
    assert {results[key] for key in results if key.endswith("_format")} == {"text"}
    assert results["tests"][0] == {
        "name": "a",
        "score": 0.0,
        "max_score": 3.0,
        "status": "failed",
        "output": f"incorrect (0/3)\nyour answer: -3\n{SAYS['sign_error']}",
    }
    right, partial, waiting = (json.loads(text("gradescope", [each]))["tests"] for each in (AMY, BOB, EVE))
    assert right[0]["status"] == "passed"
    # What is neither right nor wrong is told as such in the text.
    assert partial[1]["status"] == waiting[0]["status"] == "failed"
    assert partial[1]["output"].startswith("partial (0.5/2)\n")
    assert waiting[0]["output"] == f"review (no points yet)\n{UNDECIDED}"


def test_a_table_in_a_file_begins_with_what_waits_for_a_person() -> None:
    expected = f"""\
1 answer needs a person: not judged, or not readable
  eve  b  review     {UNDECIDED}

amy  5/5  all correct
  b  2/2  correct    {SAYS["second_order_form"]}
eve  0/5
  b  0/2  review
  a  0/3  incorrect  {SAYS["sign_error"]}

2 students, mean 2.5/5 (50%)
  b   50%  1 review, 1 correct
  a   50%  1 correct, 1 incorrect
"""
    assert text("table", [AMY, EVE]) == expected


def test_a_part_that_cannot_be_read_is_listed_for_a_person_where_it_costs_points() -> None:
    unread = Finding("parse_error", "equation 2")
    fay = student("fay", mark("a", "partial", 1.0, 3.0, (unread,)), mark("b", "correct", 2.0, 2.0, (unread,)))
    first, second, *_ = text("table", [AMY, fay, EVE]).splitlines()[1:]
    assert first.startswith("  eve  b  review")
    assert second == f"  fay  a  partial    equation 2: {SAYS['parse_error']}"


def test_what_waits_comes_first_in_every_format() -> None:
    assert [each["id"] for each in json.loads(text("json", [EVE]))["questions"]] == ["b", "a"]
    assert [line.split(",")[1] for line in text("csv", [EVE]).splitlines()] == ["question", "b", "a"]
    assert [case.get("name") for case in ET.fromstring(text("junit", [EVE])).iter("testcase")] == ["b", "a"]
    assert [test["name"] for test in json.loads(text("gradescope", [EVE]))["tests"]] == ["b", "a"]


def test_codes_are_told_once() -> None:
    question = mark("a", "incorrect", 0, 1, (Finding("sign_error", "x"), Finding("sign_error", "y")))
    assert reported(Judgement("x", "x", (question,)), Feedback.hint).questions[0].codes == ("sign_error",)


@pytest.mark.parametrize("name", FORMATS)
def test_references_are_told_at_full_only(name: str) -> None:
    for feedback in Feedback:
        assert (SECRET in text(name, style=ReportStyle(feedback))) == (feedback is Feedback.full)


@pytest.mark.parametrize("name", FORMATS)
def test_no_sentence_is_told_below_hint(name: str) -> None:
    for feedback in (Feedback.none, Feedback.verdict):
        told = text(name, style=ReportStyle(feedback))
        assert not [code for code in SAYS if code in told or SAYS[code] in told]


def test_at_level_none_texts_for_students_do_not_tell_the_verdict() -> None:
    style = ReportStyle(Feedback.none)
    for results in map(json.loads, text("gradescope", style=style).splitlines()):
        assert results["visibility"] == "hidden"
        assert {test["output"] for test in results["tests"]} == {""}
    junit = text("junit", style=style)
    assert not [verdict for verdict in VERDICTS if verdict in junit]
    # Scores and verdicts stay where programs read them.
    scores = [json.loads(line)["score"] for line in text("json", style=style).splitlines()]
    assert scores == [5, 0.5, 0, 0]
    assert "bob,b,partial,0.5,2.0,,,answers/bob.yaml\n" in text("csv", style=style)


def test_at_level_verdict_students_see_verdicts_and_no_more() -> None:
    style = ReportStyle(Feedback.verdict)
    results = json.loads(text("gradescope", [BOB], style))
    outputs = [test["output"] for test in results["tests"]]
    assert outputs == ["incorrect (0/3)\nyour answer: -3", "partial (0.5/2)"]
    (failure, _) = ET.fromstring(text("junit", [BOB], style)).iter("failure")
    assert failure.get("message") == "incorrect (0/3)"


def test_every_format_begins_before_the_class_is_judged() -> None:
    """But for a table, which begins with what waits for a person."""

    def judged_one() -> Iterator[Judgement]:
        yield AMY
        raise AssertionError("the second one is asked for too early")

    for name in FORMATS.keys() - {"table"}:
        pieces: list[str] = []
        with pytest.raises(AssertionError):
            pieces.extend(render(name, judged_one(), ReportStyle(width=80)))
        assert "amy" in "".join(pieces)


PUBLISHED = """
    additive_constant axes_not_orthogonal axis_not_normalised component_wrong components_permuted
    constant_factor degrees_radians duplicate_key equation_wrong euler_sign extra_solutions
    frequency_vs_angular_frequency hamilton_sign kinetic_factor lagrangian_or_potential_sign
    missing_axis missing_column missing_equation missing_file moment_axis_pairing not_a_number
    not_allowed not_an_eigenvector not_symmetric number_for_symbol other_frame outside_tolerance
    overridden parallel_axis_missing parallel_axis_sign parse_error path_outside potential_sign
    power_of_ten products_of_inertia_missing products_of_inertia_sign second_order_form sign_error
    term_wrong time_range_short timeout too_few_sig_figs too_large transposed trivial_equation
    unit_incompatible unit_missing unknown_symbol velocity_in_hamiltonian wrong_initial_condition
    wrong_order wrong_shape wrong_unit_right_number
"""
"""The codes that scripts depend on."""


def test_every_published_code_has_a_short_sentence_without_numbers() -> None:
    assert set(SAYS) == {*PUBLISHED.split(), "accepted", "undecided"}
    for code, says in SAYS.items():
        assert len(says) <= 80, code
        assert not re.search(r"[0-9.;\n]", says), code


PIECES = [
    "=1+1", "+1", "-2", "@SUM(A1)", "\t=1", "\r=1", " =1", "＝1", "；=1", ";=1", '";=1', ';"=1', "; -1",
    "\x1b[31m", "\x1b]8;;http://x\x07", "\u202e", "\u2066", "\x00", "\x85", "\u2028", "\ufeff", "\ud800",
    "]]>", "<!--", "&amp;", "<b>", '"', "'", ",", "\n", "\r\n", "\\", "日本", "é", "\ufffe", "[red]",
    "a" * 90,
]  # fmt: skip
LETTERS = st.text(st.characters(exclude_categories=()), max_size=6)
HOSTILE = st.lists(st.sampled_from(PIECES) | LETTERS, max_size=4).map("".join)


@st.composite
def classes(draw: st.DrawFn) -> list[Judgement]:
    def finding() -> Finding:
        return Finding(draw(st.sampled_from(sorted(SAYS))), draw(HOSTILE), draw(HOSTILE), SECRET)

    ids = draw(st.lists(HOSTILE.filter(bool), min_size=1, max_size=3, unique=True))
    students = []
    for _ in range(draw(st.integers(1, 3))):
        questions = tuple(
            mark(
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
    style = ReportStyle(feedback, width=width)
    outputs = {name: text(name, judgements, style) for name in FORMATS}
    outputs["items"] = "".join(by_question(judgements, style))
    for name, output in outputs.items():
        require_harmless(output)
        if feedback is not Feedback.full or name == "items":
            assert SECRET not in output, name
    if width is not None:
        lines = (outputs["table"] + outputs["items"]).splitlines()
        assert max(map(cells, lines)) <= width
    count = sum(len(judgement.questions) for judgement in judgements)
    assert len(ET.fromstring(outputs["junit"]).findall("./testsuite/testcase")) == count
    for name in ("json", "gradescope"):
        assert all(isinstance(json.loads(line), dict) for line in outputs[name].splitlines())
    rows = list(csv.reader(io.StringIO(outputs["csv"]), strict=True))
    assert set(map(len, rows)) == {8}
    assert len(rows) == count + 1
    for cell in chain.from_iterable(rows):
        assert not re.match(r"[\s\"]*[=+\-@＝＋－＠]", cell)


@given(HOSTILE)
@few
def test_a_cell_cannot_become_a_formula_where_semicolons_separate_cells(raw: str) -> None:
    (row,) = csv_rows((), [(raw, 1.0, (raw,))], ReportStyle(header=False))
    for cell in chain.from_iterable(csv.reader(io.StringIO(row), delimiter=";")):
        assert not re.match(r"[\s\"]*[=+\-@＝＋－＠]", cell)


@pytest.mark.parametrize("honest", ["jane_doe", "a = b", "x; y", "O'Neil", "3 - 2", "", "a;b = 1"])
def test_honest_texts_stay_as_they_are(honest: str) -> None:
    assert list(csv.reader(csv_rows((), [(honest,)], ReportStyle(header=False)))) == [[honest]]


@given(st.text(st.characters(exclude_categories=("Cc", "Cs", "Cf", "Zl", "Zp"))), st.integers(8, 60))
@few
def test_wrapping_keeps_every_letter_and_the_width(raw: str, width: int) -> None:
    page = Page(width, colour=False)
    page.line((raw, ""))
    lines = str(page).split("\n")
    assert max(map(cells, lines)) <= width
    assert "".join("".join(lines).split()) == "".join(raw.split())


@pytest.mark.parametrize(
    ("score", "written"),
    [(0, "0"), (3, "3"), (2.5, "2.5"), (8 / 3, "2.67"), (100, "100"), (0.001, "0.001"), (1e6, "1000000")],
)
def test_scores_for_people_are_short(score: float, written: str) -> None:
    assert points(score) == written
