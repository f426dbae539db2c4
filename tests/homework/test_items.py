"""What a class has made of its questions: counts, shared wrong answers, and doubts about the key."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from rigidcli.homework.base import CODES, Finding, Judgement, Verdict
from rigidcli.homework.reports.formats import ReportStyle
from rigidcli.homework.reports.items import MOST_SHOWN, UNNAMED, Alike, Taken, alike, csv, json, table, tally
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
q  1 correct, 4 incorrect; 20% right of those who answered
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
        '"verdict":"incorrect","codes":["sign_error"],"suspicious":false}],"right":0.2,"correlation":null}\n'
    )
    assert (
        "".join(csv(found, ReportStyle()))
        == """\
question,review,correct,partial,incorrect,invalid,missing,answer,students,verdict,codes,suspicious,right,correlation
q,0,1,0,4,0,0,7,3,incorrect,outside_tolerance,true,0.2,
q,0,1,0,4,0,0,'=1,1,incorrect,sign_error,false,0.2,
"""
    )


def test_a_question_that_all_got_right_is_told_too() -> None:
    found = tally(handed_in([("correct", "3", "")]))
    assert "".join(table(found, ReportStyle())) == "q  1 correct; 100% right of those who answered\n"
    assert "".join(csv(found, ReportStyle(header=False))) == "q,0,1,0,0,0,0,,,,,,1.0,\n"


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


@given(st.lists(st.lists(st.sampled_from([0.0, 0.5, 1.0]), min_size=3, max_size=3), min_size=3, max_size=30))
def test_the_correlation_is_that_of_right_answers_with_the_score_in_the_others(
    shares: list[list[float]],
) -> None:
    verdicts: dict[float, Verdict] = {0.0: "incorrect", 0.5: "partial", 1.0: "correct"}
    judgements = [
        Judgement(str(k), "", tuple(mark(str(n), verdicts[s], 3 * s, 3, (), "x") for n, s in enumerate(row)))
        for k, row in enumerate(shares)
    ]
    # Who has answered nothing does not count.
    nobody = Judgement("y", "", tuple(mark(str(n), "missing", 0, 3) for n in range(3)))
    for question, found in enumerate(tally([*judgements, nobody, nobody])):
        right = [row[question] == 1.0 for row in shares]
        rest = [sum(row) - row[question] for row in shares]
        assert found.right == pytest.approx(sum(right) / len(right))
        if len({*right}) == 1 or len({*rest}) == 1:
            assert found.correlation is None
        else:
            assert found.correlation == pytest.approx(np.corrcoef(right, rest)[0, 1], abs=1e-6)


def test_there_is_no_correlation_of_two_and_what_waits_does_not_count() -> None:
    def student(first: Verdict, second: float) -> Judgement:
        return Judgement("x", "", (mark("a", first, 0, 1, (), "1"), mark("b", "partial", second, 1, (), "2")))

    two = [student("correct", 1.0), student("incorrect", 0.2)]
    assert tally(two)[0].correlation is None
    (waiting, _) = tally([*two, student("review", 0.5)])
    assert (waiting.right, waiting.correlation) == (0.5, None)
    assert tally([*two, student("review", 0.5), student("incorrect", 0.4)])[0].correlation is not None


def sharing(*answers: str) -> list[Judgement]:
    """A class of students with their wrong answers to the questions 1, 2, ...; `=` is a right one."""
    return [
        Judgement(
            f"s{number}",
            "",
            tuple(
                mark(str(id), "correct" if answer == "=" else "incorrect", 0, 1, (), answer)
                for id, answer in enumerate(row.split(), 1)
            ),
        )
        for number, row in enumerate(answers)
    ]


@pytest.mark.parametrize(
    ("answers", "found"),
    [
        (["7 8 9 =", "7 8 9 1", "= = = ="], [Alike(("s0", "s1"), ("1", "2", "3"))]),
        (["7 8 = =", "7 8 9 1", "= = = ="], []),
        (["7.00001 8 9 =", "7 8.0 9 1"], [Alike(("s0", "s1"), ("1", "2", "3"))]),
        (["7 8 9 =", "7 8 9 1", "7 8 9 2"], [Alike(("s0", "s1", "s2"), ("1", "2", "3"))]),
        (["7 8 9 ="] * 4, []),  # four of four have made them: nothing rare
        (["7 8 9 ="] * 4 + ["= = = ="] * 156, [Alike(("s0", "s1", "s2", "s3"), ("1", "2", "3"))]),
        (["{csv: {csv: {csv: ="] * 2, []),  # trajectories look alike
    ],
)
def test_students_who_share_rare_wrong_answers_are_named(answers: list[str], found: list[Alike]) -> None:
    assert [*alike(sharing(*answers))] == found


def test_a_hint_to_look_is_one_line_and_one_object() -> None:
    judgements = sharing("7 8 9 =", "7 8 9 1", "= = = =")
    found, pairs = tally(judgements), alike(judgements)
    assert "".join(table(found, ReportStyle(), pairs)).endswith(
        "\n\ns0, s1  the same rare wrong answers to 1, 2, 3: a hint to look, not a verdict\n"
    )
    last = "".join(json(found, ReportStyle(), pairs)).splitlines()[-1]
    assert last == '{"schema":"rigidcli.alike/1","students":["s0","s1"],"questions":["1","2","3"]}'
