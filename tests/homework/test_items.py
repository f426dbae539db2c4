"""What a class has made of its questions: counts, shared wrong answers, and doubts about the key."""

from __future__ import annotations

from collections.abc import Sequence

import pytest

from rigidcli.homework.base import CODES, Finding, Judgement, Verdict
from rigidcli.homework.reports.formats import ReportStyle
from rigidcli.homework.reports.items import MOST_SHOWN, UNNAMED, Taken, csv, json, table, tally
from tests.homework.standins import mark
from tests.tables import rows_of

SECRET = "expected 6.28318"


Answer = tuple[Verdict, str, str]


def several(count: int, verdict: Verdict, answer: str, code: str) -> list[Answer]:
    return [(verdict, answer, code)] * count


def handed_in(answers: Sequence[Answer]) -> list[Judgement]:
    """A class of one question: the verdict on each student, the answer, and the code of what was found."""
    return [
        Judgement(
            f"s{number}",
            f"s{number}.yaml",
            (mark("q", verdict, 0, 1, (Finding(code, reference=SECRET),) if code else (), answer),),
        )
        for number, (verdict, answer, code) in enumerate(answers)
    ]


def test_answers_are_counted_those_first_that_wait_then_the_most_frequent() -> None:
    (found,) = tally(
        handed_in(
            [
                *several(5, "correct", "3", ""),
                ("incorrect", "7", "outside_tolerance"),
                *several(4, "incorrect", "-3", "sign_error"),
                *several(2, "partial", "2", "component_wrong"),
                ("invalid", "x", "not_a_number"),
                *several(2, "review", "8", "undecided"),
                *several(3, "missing", "", ""),
            ]
        )
    )
    assert found.verdicts == {
        "review": 2,
        "correct": 5,
        "partial": 2,
        "incorrect": 5,
        "invalid": 1,
        "missing": 3,
    }
    assert found.answers == (
        Taken("8", 2, "review", ("undecided",), False),
        Taken("-3", 4, "incorrect", ("sign_error",), False),
        Taken("2", 2, "partial", ("component_wrong",), False),
        Taken("7", 1, "incorrect", ("outside_tolerance",), False),
        Taken("x", 1, "invalid", ("not_a_number",), False),
    )
    assert not found.suspicious


@pytest.mark.parametrize(
    ("sharing", "others", "code", "suspicious"),
    rows_of(__file__, "a key is doubted when several err alike without a known mistake"),
)
def test_a_key_is_doubted_when_several_err_alike_without_a_known_mistake(
    sharing: int, others: int, code: str, suspicious: bool
) -> None:
    answers = several(sharing, "incorrect", "7", code) + several(others, "correct", "3", "")
    (found,) = tally(handed_in(answers + several(500, "missing", "", "")))
    assert found.suspicious is suspicious
    assert [answer.suspicious for answer in found.answers] == [suspicious]


@pytest.mark.parametrize("answer", ["{file: orbit.csv}", "{csv: t,x\\n0,1\\n}"])
def test_trajectories_that_begin_alike_are_not_taken_for_the_same(answer: str) -> None:
    (found,) = tally(handed_in(several(5, "incorrect", answer, "outside_tolerance")))
    assert not found.suspicious


def test_codes_that_name_no_mistake_are_codes() -> None:
    assert set(CODES) > UNNAMED


def test_texts_by_hand() -> None:
    answers = several(3, "incorrect", "7", "outside_tolerance")
    answers += [("incorrect", "=1", "sign_error"), ("correct", "3", "")]
    found = tally(handed_in(answers))
    assert (
        "".join(table(found, ReportStyle()))
        == """\
q  1 correct, 4 incorrect
  3 x  incorrect  7
                  outside_tolerance, no known mistake: the key may be wrong
  1 x  incorrect  =1
                  sign_error

q  the key may be wrong: several gave the same answer, and no known mistake leads to it
"""
    )
    assert "".join(json(found, ReportStyle())) == (
        '{"schema":"rigidcli.items/1","question":"q","review":0,"correct":1,"partial":0,"incorrect":4,"invalid":0,'
        '"missing":0,"suspicious":true,"answers":[{"answer":"7","students":3,"verdict":"incorrect",'
        '"codes":["outside_tolerance"],"suspicious":true},{"answer":"=1","students":1,'
        '"verdict":"incorrect","codes":["sign_error"],"suspicious":false}]}\n'
    )
    assert (
        "".join(csv(found, ReportStyle()))
        == """\
question,review,correct,partial,incorrect,invalid,missing,answer,students,verdict,codes,suspicious
q,0,1,0,4,0,0,7,3,incorrect,outside_tolerance,true
q,0,1,0,4,0,0,'=1,1,incorrect,sign_error,false
"""
    )


def test_a_question_that_all_got_right_is_told_too() -> None:
    found = tally(handed_in([("correct", "3", "")]))
    assert "".join(table(found, ReportStyle())) == "q  1 correct\n"
    assert "".join(csv(found, ReportStyle(header=False))) == "q,0,1,0,0,0,0,,,,,\n"


def test_questions_of_which_an_answer_waits_come_first() -> None:
    questions = (mark("a", "incorrect", 0, 1), mark("b", "correct", 1, 1), mark("c", "review", 0, 1))
    found = tally([Judgement("x", "x.yaml", questions)])
    assert [each.question for each in found] == ["c", "a", "b"]


def test_a_table_tells_the_first_wrong_answers() -> None:
    found = tally(handed_in([("incorrect", f"{k:02}", "sign_error") for k in range(MOST_SHOWN + 5)]))
    lines = "".join(table(found, ReportStyle())).splitlines()
    assert lines[-1] == "  and 5 other answers"
    assert len([line for line in lines if " x  " in line]) == MOST_SHOWN


def test_a_long_answer_is_shortened_for_people() -> None:
    found = tally(handed_in([("incorrect", "1, " * 60, "sign_error")]))
    told = "".join(table(found, ReportStyle()))
    assert max(map(len, told.splitlines())) < 90
    assert "..." in told
    assert "1, " * 60 in "".join(json(found, ReportStyle()))
