"""What a class has answered to its questions: counts, and the wrong answers that several share."""

from __future__ import annotations

from collections.abc import Sequence

from rigidcli.homework.base import Finding, Judgement, Verdict
from rigidcli.homework.reports.formats import MOST_SHOWN, ReportStyle, by_question
from tests.homework.standins import mark

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


def shown(judgements: Sequence[Judgement]) -> str:
    return "".join(by_question(judgements, ReportStyle()))


def test_answers_are_counted_those_first_that_wait_then_the_most_frequent() -> None:
    answers = [
        *several(5, "correct", "3", ""),
        ("incorrect", "7", "outside_tolerance"),
        *several(3, "incorrect", "-3", "sign_error"),
        ("incorrect", "- 3.000", "sign_error"),
        *several(2, "partial", "2", "component_wrong"),
        ("invalid", "x", "not_a_number"),
        *several(2, "review", "8", "undecided"),
        *several(3, "missing", "", ""),
    ]
    assert (
        shown(handed_in(answers))
        == """\
q  2 review, 5 correct, 2 partial, 5 incorrect, 1 invalid, 3 missing
  2 x  review     8
                  undecided
  4 x  incorrect  -3
                  sign_error
  2 x  partial    2
                  component_wrong
  1 x  incorrect  7
                  outside_tolerance
  1 x  invalid    x
                  not_a_number
"""
    )


def test_a_question_that_all_got_right_is_told_too() -> None:
    assert shown(handed_in([("correct", "3", "")])) == "q  1 correct\n"


def test_questions_of_which_an_answer_waits_come_first() -> None:
    questions = (mark("a", "incorrect", 0, 1), mark("b", "correct", 1, 1), mark("c", "review", 0, 1))
    lines = shown([Judgement("x", "x.yaml", questions)]).splitlines()
    assert [line[0] for line in lines if line[0] != " "] == ["c", "a", "b"]


def test_a_table_tells_the_first_wrong_answers() -> None:
    lines = shown(
        handed_in([("incorrect", f"{k:02}", "sign_error") for k in range(MOST_SHOWN + 5)])
    ).splitlines()
    assert lines[-1] == "  and 5 other answers"
    assert len([line for line in lines if " x  " in line]) == MOST_SHOWN


def test_a_long_answer_is_shortened_for_people() -> None:
    told = shown(handed_in([("incorrect", "1, " * 60, "sign_error")]))
    assert max(map(len, told.splitlines())) < 90
    assert "..." in told
