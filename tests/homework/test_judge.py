"""One answer file: which answer goes to which question, what a failure costs, and what is named."""

from __future__ import annotations

import pickle
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.homework.base import Finding, Judged, Judgement, Outcome, Unreadable, sentence
from rigidcli.homework.judge import Item, Seen, judge
from rigidcli.homework.kinds import KINDS
from rigidcli.sandbox import ForbiddenError
from tests.homework.standins import Same, mark
from tests.tables import rows_of

FAILURES = {
    "unreadable": Unreadable("not_a_number", "read `unreadable`", place="entry 1"),
    "memory": MemoryError(),
    "recursion": RecursionError(),
    "forbidden": ForbiddenError(1, "no"),
    "broken": ZeroDivisionError("the key is 41.99"),
}


class Failing(Same):
    """A kind that fails on some answers in one way or another, and never ends on `loop`."""

    def judge(self, key: Any, value: Any) -> Outcome:
        while value == "loop":
            pass
        if isinstance(value, str) and value in FAILURES:
            raise FAILURES[value]
        if isinstance(value, list):
            return Outcome.earning(
                sum(each == key for each in value) / len(value), Finding("component_wrong")
            )
        return (
            Outcome.correct()
            if value == key
            else Outcome.earning(0.0, Finding("outside_tolerance", reference=f"it is {key}"))
        )


ITEMS = {id: Item(Failing(), "42", 2.0, title=f"Question {id}") for id in ("10.35a", "b", "c")}


def judged(text: str, items: dict[str, Item] = ITEMS) -> dict[str, Judged]:
    questions = judge(text, Path("a.yaml"), items).questions
    assert [question.id for question in questions] == list(items)
    return {question.id: question for question in questions}


def test_each_question_gets_its_own_answer_title_and_points() -> None:
    found = judged("student: Someone\nanswers: {10.35a: 42, c: 41, other: 42}")
    assert [question.verdict for question in found.values()] == ["correct", "missing", "incorrect"]
    assert [question.score for question in found.values()] == [2, 0, 0]
    assert [question.max_score for question in found.values()] == [2, 2, 2]
    assert (found["c"].title, found["c"].answer, found["c"].read_as) == ("Question c", "41", "read 41")


def test_a_share_of_the_points() -> None:
    question = judged("answers: {b: [42, 42, 0]}")["b"]
    assert question.verdict == "partial"
    assert question.score == pytest.approx(4 / 3, abs=1e-6)


@pytest.mark.parametrize(
    ("answer", "verdict", "code"),
    rows_of(__file__, "an answer that fails harms no other"),
)
def test_an_answer_that_fails_harms_no_other(
    answer: str, verdict: str, code: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rigidcli.homework.judge.SECONDS", 0.2)
    found = judged(f"answers: {{10.35a: 42, b: {answer}, c: 42}}")
    assert [question.verdict for question in found.values()] == ["correct", verdict, "correct"]
    assert found["b"].codes == (code,)
    # What an error says may hold the key.
    assert "41.99" not in sentence(found["b"].findings[0])


def test_a_question_has_its_name_in_any_spelling_and_others_are_noted() -> None:
    sheet = judge("answers: {' B ': 42, bb: 1, x: 2}", Path("a.yaml"), ITEMS)
    assert {question.id: question.verdict for question in sheet.questions}["b"] == "correct"
    assert sheet.notes == ("there is no question `bb` (did you mean b?)", "there is no question `x`")
    text = "answers: {" + ", ".join(f"q{n}: 1" for n in range(1000)) + "}"
    notes = judge(text, Path("a.yaml"), ITEMS).notes
    assert len(notes) == 6
    assert "995 more" in notes[-1]
    assert judged("answers: {' b': 42, B: 41}")["b"].codes == ("duplicate_key",)


@pytest.mark.parametrize(
    ("changes", "expected"),
    [
        ([("sign_error", "-42")], ("sign_error",)),
        ([("sign_error", "-42"), ("sign_error", "-42")], ("sign_error",)),
        ([("sign_error", "-42"), ("other_frame", "-42")], ("outside_tolerance",)),
        ([("sign_error", "-41"), ("other_frame", "43")], ("outside_tolerance",)),
        ([], ("outside_tolerance",)),
    ],
)
def test_a_mistake_is_named_when_it_alone_explains_the_answer(
    changes: list[tuple[str, str]], expected: tuple[str, ...]
) -> None:
    items = {"a": replace(ITEMS["b"], changes=tuple(changes))}
    assert judged("answers: {a: -42}", items)["a"].codes == expected
    assert judged("answers: {a: 42}", items)["a"].verdict == "correct"


@pytest.mark.parametrize(
    ("answer", "accepted", "expected"),
    [
        ("41", [("41", 0.5, "nearly")], ("partial", 1.0, ("accepted",))),
        ("41", [("41", 0.5, ""), ("41", 0.75, "")], ("partial", 1.5, ("accepted",))),
        ("41", [("41", 0.75, ""), ("41", 0.5, "")], ("partial", 1.5, ("accepted",))),
        ("41", [("41", 1.0, "")], ("correct", 2.0, ("accepted",))),
        ("41", [("41", 0.0, "no")], ("incorrect", 0.0, ("accepted",))),
        ("41", [("40", 1.0, "")], ("incorrect", 0.0, ("outside_tolerance",))),
        ("42", [("42", 0.5, "")], ("correct", 2.0, ())),
        ("[42, 0]", [("41", 0.25, "")], ("partial", 1.0, ("component_wrong",))),
    ],
)
def test_accepted_answers_earn_their_credit(
    answer: str, accepted: list[tuple[str, float, str]], expected: tuple[str, float, tuple[str, ...]]
) -> None:
    question = judged(f"answers: {{a: {answer}}}", {"a": replace(ITEMS["b"], accepted=tuple(accepted))})["a"]
    assert (question.verdict, question.score, question.codes) == expected


FINDINGS = st.builds(
    Finding, st.sampled_from(["parse_error", "too_large"]), st.text(), st.text(), reference=st.text()
)
QUESTIONS = st.builds(
    Judged,
    st.text(),
    st.text(),
    st.text(),
    st.text(),
    st.sampled_from(["correct", "partial", "incorrect", "invalid", "missing"]),
    st.floats(0, 1e9),
    st.floats(0, 1e9),
    st.lists(FINDINGS, max_size=3).map(tuple),
)


@given(st.lists(QUESTIONS, max_size=5).map(tuple))
@settings(max_examples=100)
def test_what_goes_through_a_pipe_comes_out_the_same(questions: tuple[Judged, ...]) -> None:
    sheet = Judgement("ada", "ada.yaml", questions, ("a note",), ("a file",))
    assert Judgement.from_bytes(sheet.to_bytes()) == sheet


def test_scores_add_up_and_are_rounded_as_a_gradebook_has_them() -> None:
    questions = tuple(mark(str(k), "partial", score, 1.0) for k, score in enumerate([0.1, 0.2, 0.333333]))
    judgement = Judgement("a", "a.yaml", questions)
    assert (judgement.score, judgement.max_score) == (0.633333, 3.0)
    for score, places, rounded in ((2.675, 2, 2.68), (2.5, 0, 3.0), (1 / 3, 2, 0.33), (6, 1, 6.0)):
        assert Judgement("a", "a.yaml", (mark("q", "partial", score, 9.0),)).score_to(places) == rounded


def test_an_item_is_pickled_with_its_kind() -> None:
    copy = pickle.loads(pickle.dumps(Item(KINDS["choice"], {"any": 1.0}, 2.0)))
    assert (copy.kind.name, copy.points, copy.key) == ("choice", 2.0, {"any": 1.0})


def test_the_same_answer_to_a_question_is_judged_once() -> None:
    seen: Seen = {}
    first = judge("answers: {b: 42, c: [42, 1]}", Path("a.yaml"), ITEMS, seen)
    # A key that fails would show that the kind is asked again.
    broken = {id: replace(item, kind=Failing(), key=None) for id, item in ITEMS.items()}
    assert judge("answers: {b: 42, c: [42, 1]}", Path("b.yaml"), broken, seen) == first
    assert judge("answers: {b: 42}", Path("b.yaml"), broken).questions != first.questions
    assert (
        judge("answers: {b: '42', c: '[42, 1]'}", Path("c.yaml"), ITEMS, seen).questions[2]
        != first.questions[2]
    )
