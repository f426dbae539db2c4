"""Gradebooks in the forms in which Canvas and Moodle export them: one column changes, and nothing else."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError, UsageError
from rigidcli.homework.base import Judgement
from rigidcli.homework.reports import gradebooks
from rigidcli.homework.reports.formats import ReportStyle
from rigidcli.homework.spreadsheets import read_spreadsheet, spreadsheet_of
from tests.homework.standins import mark

BOOK = '''\
Student,ID,SIS User ID,SIS Login ID,Section,Notes,Homework 9 (11),Homework 10 (12),HW Final Score,Final Score
,,,,,,Manual Posting,,,
    Points Possible,,,,,,10.00,9.00,(read only),(read only)
"Doe, Jane",101,u-1,jdoe@example.edu,"A, and B",,10.00,,90.00,90.00
"O'Brien, Zoë",102,u-2,zob,A,=SUM(A1),8.00,,80.00,80.00
"Roe, ""Max""",103,u-3,,A,"two
lines",7.00,1.00,70.00,70.00
"Student, Test",104,,0123456789abcdef,A,,,,,
'''


class Filled(NamedTuple):
    """The text of a gradebook with the scores in it, and the notes on it."""

    text: str
    notes: tuple[str, ...]


def filled_in(
    book: gradebooks.Gradebook,
    judgements: Iterable[Judgement],
    aliases: Mapping[str, Sequence[str]] = MappingProxyType({}),
) -> Filled:
    notes = list[str]()
    pieces = gradebooks.fill(book, aliases, lambda _, said: notes.extend(said), judgements, ReportStyle())
    text = "".join(pieces)
    return Filled(text, tuple(notes))


def fill(text: str, judgements: Iterable[Judgement], column: str) -> Filled:
    return filled_in(gradebooks.canvas(spreadsheet_of(text), column), judgements)


def judged(student: str, score: float, most: float = 9.0) -> Judgement:
    return Judgement(student, f"{student}.yaml", (mark("a", "partial", score, most),))


def cells(text: str, delimiter: str = ",") -> list[list[str]]:
    return list(csv.reader(io.StringIO(text.removeprefix("\ufeff"), newline=""), delimiter=delimiter))


def column(text: str, place: int = 7) -> list[str]:
    return [row[place] for row in cells(text)[3:]]


@pytest.mark.parametrize(
    "stem",
    [
        *("jdoe@example.edu", "JDoe@Example.edu", "jdoe", "u-1", "U-1", "101", "Doe, Jane", "jane_doe"),
        *("Jane Doe", "doe_jane", "DOE-JANE", "jane.doe", "doejane", "janedoe"),
        *("doejane_101_98765_homework-10", "doejane_LATE_101_98765_hw_10-2"),
    ],
)
def test_students_are_known_by_any_of_their_names(stem: str) -> None:
    filled = fill(BOOK, [judged(stem, 7.5)], "Homework 10")
    assert column(filled.text) == ["7.5", "", "1.00", ""]
    assert filled.notes == ('no answer file, and the cell left as it was: `O\'Brien, Zoë`, `Roe, "Max"`',)


@pytest.mark.parametrize(
    "stem", ["zoe_obrien", "Zoë O'Brien", "Zoe\u0308 O’Brien", "zob", "obrienzoe_102_5_answers"]
)
def test_accents_and_apostrophes_do_not_matter(stem: str) -> None:
    assert column(fill(BOOK, [judged(stem, 9.0)], "Homework 10").text)[1] == "9"


def test_nothing_else_changes_byte_for_byte() -> None:
    scores = [judged("jdoe", 9.0), judged("zob", 0.0), judged("103", 8.333333)]
    assert fill(BOOK, scores, "Homework 10").text == (
        BOOK.replace("10.00,,90.00", "10.00,9,90.00")
        .replace("8.00,,80.00", "8.00,0,80.00")
        .replace("7.00,1.00,70.00", "7.00,8.33,70.00")
    )


@pytest.mark.parametrize(
    ("score", "written"), [(7.5, "7.5"), (8.999999, "9"), (1.005, "1.01"), (0.125, "0.13"), (0.004, "0")]
)
def test_scores_are_rounded_as_canvas_rounds_points(score: float, written: str) -> None:
    filled = fill(BOOK, [judged("103", score)], "Homework 10")
    assert column(filled.text)[2] == written
    assert ("replaced" in filled.notes[-1]) == (float(written) != 1)


def test_the_cell_of_a_student_whose_answer_waits_stays() -> None:
    waiting = Judgement("103", "103.yaml", (*judged("103", 8.0).questions, mark("b", "review", 0, 1)))
    filled = fill(BOOK, [waiting, judged("jdoe", 2.0)], "Homework 10")
    assert column(filled.text) == ["2", "", "1.00", ""]
    assert "an answer waits for a person to judge, and the cell left as it was: `103`" in filled.notes


def test_a_score_of_a_person_fills_the_cell_of_who_has_handed_in_nothing_or_two_files() -> None:
    several = (mark("a", "invalid", 0, 8), mark("b", "invalid", 0, 1))
    whole = tuple(question.overridden(1.0, "on paper") for question in several)
    answers = [Judgement("jdoe", "", whole), Judgement("zob", "", (whole[0], several[1]))]
    filled = fill(BOOK, [*answers, Judgement("103", "", several)], "Homework 10")
    assert column(filled.text) == ["2", "", "1.00", ""]
    assert "an answer waits for a person to judge, and the cell left as it was: `zob`" in filled.notes


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_byte_order_mark_and_ends_of_lines_stay(end: str, mark: str) -> None:
    book = mark + BOOK.replace("\n", end)
    filled = fill(book, [judged("jdoe", 2.0)], "Homework 10").text
    assert filled == book.replace("10.00,,90.00", "10.00,2,90.00")


def test_a_file_without_an_end_of_its_last_line() -> None:
    book = "Student,ID,SIS Login ID,Section,HW (1)\n    Points Possible,,,,9\nDoe,1,doe,A,"
    assert fill(book, [judged("doe", 2.0)], "HW").text == book + "2"


def test_a_row_that_is_too_short_is_filled_up() -> None:
    head = "Student,ID,SIS Login ID,Section,X (1),HW (2)\n    Points Possible,,,,1,9\n"
    book = f"{head}Doe,1,doe,A\nRoe,2,roe,A\n"
    filled = fill(book, [judged("doe", 2.0)], "HW").text
    assert filled.splitlines()[2:] == ["Doe,1,doe,A,,2", "Roe,2,roe,A"]


def test_semicolons_and_decimal_commas() -> None:
    book = (
        "Student;ID;SIS Login ID;Section;HW, the first (1)\n    Points Possible;;;;9,00\n"
        "Doe, Jane;1;doe;A;\nRoe, Max;2;roe;A;\n"
    )
    filled = fill(book, [judged("doe", 2.5), judged("roe", 3.0)], "HW, the first")
    assert [row[4] for row in cells(filled.text, ";")[2:]] == ["2,5", "3"]
    assert filled.notes == ()
    book = 'Student,ID,SIS Login ID,Section,HW (1)\n    Points Possible,,,,"9,00"\nDoe,1,doe,A,\n'
    assert cells(fill(book, [judged("doe", 2.5)], "HW").text)[2][4] == "2,5"
    book = book.replace("HW", '"a;b;c;d;e;f').replace("(1)", '(1)"')
    assert cells(fill(book, [judged("doe", 2.5)], "1").text)[2][4] == "2,5"


def test_names_in_two_columns() -> None:
    book = (
        "LastName,FirstName,ID,SIS User ID,SIS Login ID,Section,HW (1)\n    Points Possible,,,,,,9\n"
        "Doe,Jane,1,u1,x1,A,\nRoe,Max,2,u2,x2,A,\n"
    )
    filled = fill(book, [judged("max_roe", 4.0)], "HW")
    assert [row[6] for row in cells(filled.text)[2:]] == ["", "4"]
    assert filled.notes == ("no answer file, and the cell left as it was: `Doe, Jane`",)


def test_excused_students_stay_excused() -> None:
    book = BOOK.replace("10.00,,90.00", "10.00,EX,90.00").replace("8.00,,80.00", "8.00,N/A,80.00")
    filled = fill(book, [judged("jdoe", 2.0), judged("zob", 2.0), judged("103", 1.0)], "Homework 10")
    assert filled.text == book.replace("7.00,1.00,70.00", "7.00,1,70.00")
    assert filled.notes == ("excused, locked, or without this assignment, and left so: `jdoe`, `zob`",)


def test_what_an_instructor_should_know_is_noted() -> None:
    answers = [judged(stem, 3.0, 8.0) for stem in ("nobody", "jdoe", "jane_doe", "103")]
    filled = fill(BOOK, answers, "Homework 10")
    assert column(filled.text) == ["", "", "3", ""]
    assert filled.notes == (
        "not found in the gradebook: `nobody`",
        "several hand-ins of one student, and none of them taken: `jane_doe`, `jdoe`",
        "no answer file, and the cell left as it was: `O'Brien, Zoë`",
        "scores that stood in the column and are replaced: 1",
        "the column is worth 9 points, the assignment 8",
    )


def test_a_name_that_two_students_share_is_nobodys() -> None:
    book = BOOK.replace("O'Brien, Zoë", "Jane, Doe")
    filled = fill(book, [judged("jane_doe", 3.0)], "Homework 10")
    assert filled.text == book
    assert filled.notes[0] == "more than one student of the gradebook may be meant by: `jane_doe`"
    # A login tells them apart.
    assert column(fill(book, [judged("zob", 3.0)], "Homework 10").text)[1] == "3"


def test_a_number_that_means_two_students_is_nobodys() -> None:
    book = BOOK.replace("u-2", "101")
    assert fill(book, [judged("101", 3.0)], "Homework 10").text == book


@pytest.mark.parametrize("wanted", ["Homework 10", "homework  10", "Homework 10 (12)", "12"])
def test_a_column_is_known_by_title_or_number(wanted: str) -> None:
    assert column(fill(BOOK, [judged("jdoe", 5.0)], wanted).text)[0] == "5"


@pytest.mark.parametrize("wanted", ["Homework 1", "Final Score", "HW Final Score", "Section", "ID", ""])
def test_a_column_that_is_not_an_assignment_is_refused(wanted: str) -> None:
    with pytest.raises(UsageError, match=f"has no column `{wanted}`") as error:
        fill(BOOK, [], wanted)
    assert error.value.hint is not None
    assert "`Homework 9 (11)`, `Homework 10 (12)`" in error.value.hint
    assert "Final Score" not in error.value.hint


def test_a_column_that_is_read_only_is_refused() -> None:
    with pytest.raises(UsageError, match="has no column"):
        fill(BOOK.replace("10.00,9.00,(read", "10.00,(read only),(read"), [], "Homework 10")


def test_a_column_is_looked_for_before_anything_is_judged() -> None:
    def judging(stem: str) -> Judgement:
        raise AssertionError(f"{stem} is judged too early")

    with pytest.raises(UsageError):
        fill(BOOK, map(judging, ["jdoe"]), "Homework 1")


def test_two_columns_of_one_title_are_told_apart_by_number() -> None:
    book = BOOK.replace("Homework 9 (11)", "Homework 10 (11)")
    with pytest.raises(UsageError, match="has 2 columns `homework 10`") as error:
        fill(book, [], "homework 10")
    assert "`Homework 10 (11)`, `Homework 10 (12)`" in str(error.value.hint)
    assert column(fill(book, [judged("jdoe", 5.0)], "12").text)[0] == "5"


@pytest.mark.parametrize("text", ["", "\n", "a,b\n1,2\n", "student,id\n", "Student\nDoe\n"])
def test_other_files_are_refused(text: str) -> None:
    with pytest.raises(UsageError, match="not a gradebook"):
        fill(text, [], "Homework 10")


@pytest.mark.parametrize("code", ["utf-8", "utf-8-sig", "utf-16", "cp1252"])
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_file_in_the_codes_of_spreadsheets(code: str, end: str, tmp_path: Path) -> None:
    path = tmp_path / "book.csv"
    path.write_bytes(BOOK.replace("\n", end).encode(code))
    filled = filled_in(gradebooks.canvas(read_spreadsheet(path), "12"), [judged("zob", 3.0)])
    expected = BOOK.replace("8.00,,80.00", "8.00,3,80.00").replace("\n", end)
    assert filled.text == "\ufeff" * (code == "utf-8-sig") + expected


@pytest.mark.parametrize("text", ['name,login\n"Doe, Jane,jdoe\nRoe,roe\n', f"name\n{'x' * 200_000}\n"])
def test_a_table_that_is_broken_is_refused_with_its_line(text: str) -> None:
    with pytest.raises(DocumentError, match=r"x.csv:2: cannot be read as a table"):
        spreadsheet_of(text, "x.csv")


def test_a_cell_may_have_several_lines_and_end_with_one() -> None:
    table = spreadsheet_of('name,reason\nDoe,"on\npaper\n"\nRoe,late\n')
    assert table.rows == [["name", "reason"], ["Doe", "on\npaper\n"], ["Roe", "late"]]
    assert table.lines[:3] == [1, 2, 5]


WORKSHEET = """\
ID,Vollständiger Name,E-Mail-Adresse,Status,Bewertung,Bestwertung,Bewertung kann geändert werden
Teilnehmer/in5001,Max Roe,m1@x.de,Abgegeben,,"9,00",Ja
Teilnehmer/in5002,Max Roe,m2@x.de,Abgegeben,"1,00","9,00",Ja
Teilnehmer/in5003,Zoë O'Brien,z@x.de,Abgegeben,,"9,00",Nein
"""


@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_a_worksheet_of_moodle_is_filled_in_the_language_of_the_teacher(end: str) -> None:
    book = gradebooks.moodle(spreadsheet_of("\ufeff" + WORKSHEET.replace("\n", end)))
    hands = [judged("Max Roe_5002", 2.5), judged("m1", 3.0), judged("Zoë O'Brien", 9.0)]
    aliases = {"Max Roe_5002": ["m2@x.de"]}
    filled = filled_in(book, hands, aliases)
    expected = WORKSHEET.replace('"1,00"', '"2,5"').replace('Abgegeben,,"9,00",Ja', 'Abgegeben,3,"9,00",Ja')
    assert filled.text == "\ufeff" + expected.replace("\n", end)
    assert filled.notes == (
        "excused, locked, or without this assignment, and left so: `Zoë O'Brien`",
        "scores that stood in the column and are replaced: 1",
    )


# Python's own writer leaves a lone carriage return without quotes.
TEXTS = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\r"), max_size=12)


@given(
    st.lists(st.tuples(TEXTS, TEXTS, st.integers(0, 900).map(lambda score: score / 100)), max_size=6),
    st.sampled_from([csv.QUOTE_ALL, csv.QUOTE_MINIMAL]),
    st.sampled_from([",", ";"]),
    st.sampled_from(["\n", "\r\n"]),
)
@settings(max_examples=100)
def test_whatever_is_in_a_gradebook_stays(
    students: list[tuple[str, str, float]], quoting: int, mark: str, end: str
) -> None:
    """Cells as a CSV writer quotes them, among them formulas and line breaks, read back the same."""
    target = io.StringIO(newline="")
    writer = csv.writer(target, quoting=quoting, delimiter=mark, lineterminator=end)  # type: ignore[arg-type]
    writer.writerow(["Student", "ID", "SIS Login ID", "Section", "X (1)", "HW; 10, or so (2)", "Final Score"])
    writer.writerow(["    Points Possible", "", "", "", "1.00", "9.00", "(read only)"])
    for k, (name, other, _) in enumerate(students):
        writer.writerow([f"N{name}", 100 + k, f"s{k}", "A", other, "", other])
    answers = [judged(f"s{k}", score) for k, (_, _, score) in enumerate(students)]
    filled = fill(target.getvalue(), answers, "HW; 10, or so")
    assert filled.notes == ()
    before, after = cells(target.getvalue(), mark), cells(filled.text, mark)
    assert [row[:5] + row[6:] for row in before] == [row[:5] + row[6:] for row in after]
    assert [float(row[5]) for row in after[2:]] == [score for *_, score in students]
