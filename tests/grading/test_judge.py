"""One answer file: which answers go to which question, and what cannot be read at all."""

from __future__ import annotations

import pickle
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.grading.asked import Tree
from rigidcli.grading.feedback import sentence
from rigidcli.grading.judge import Item, judge
from rigidcli.grading.judgement import Judged, Judgement, Sheet, from_bytes, to_bytes
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.sandbox import ForbiddenError
from tests.grading.asking import Same, cases

FAILURES = {
    "unreadable": Unreadable("not_a_number", "read `unreadable`", place="entry 1"),
    "memory": MemoryError(),
    "recursion": RecursionError(),
    "forbidden": ForbiddenError(1, "no"),
    "broken": ZeroDivisionError("the key is 41.99"),
}


class Failing(Same):
    """Some answers have it fail in one way or another."""

    def judge(self, key: Any, answer: Tree) -> Outcome:
        if isinstance(answer, str) and answer in FAILURES:
            raise FAILURES[answer]
        if isinstance(answer, list):
            right = sum(each == key for each in answer) / len(answer)
            return correct() if right == 1 else wrong(Finding("component_wrong"), share=right)
        return correct() if answer == key else wrong(Finding("outside_tolerance", reference=f"it is {key}"))


ITEMS = {id: Item(Failing(), "42", 2.0) for id in ("10.35a", "b", "c")}


def judged(text: str) -> dict[str, Judged]:
    questions = judge(text, Path("a.yaml"), ITEMS).questions
    assert [question.id for question in questions] == list(ITEMS)
    return {question.id: question for question in questions}


def refused(text: str) -> str:
    """The one code for which all questions of a file are invalid."""
    questions = judged(text).values()
    assert {question.verdict for question in questions} == {"invalid"}
    assert {question.score for question in questions} == {0}
    ((code,),) = {question.codes for question in questions}
    return code


def test_each_question_gets_its_own_answer_and_points() -> None:
    found = judged("student: Someone\nanswers: {10.35a: 42, c: 41, other: 42}")
    assert [question.verdict for question in found.values()] == ["correct", "missing", "incorrect"]
    assert [question.score for question in found.values()] == [2, 0, 0]
    assert [question.max_score for question in found.values()] == [2, 2, 2]


def test_a_share_of_the_points() -> None:
    question = judged("answers: {b: [42, 42, 0]}")["b"]
    assert question.verdict == "partial"
    assert question.score == pytest.approx(4 / 3, abs=1e-6)


def test_json_is_read_too() -> None:
    assert judged('{"student": "x", "answers": {"b": "42", "c": 42}}')["b"].verdict == "correct"


def test_scalars_are_judged_as_typed() -> None:
    item = Item(Failing(), "1e-3", 1.0)
    texts = ["1e-3", "'1e-3'", '"1e-3"']
    for text in texts:
        assert judge(f"answers: {{a: {text}}}", Path("a.yaml"), {"a": item}).questions[0].verdict == "correct"
    for text in ["0.001", "1.e-3", "1E-3"]:
        assert (
            judge(f"answers: {{a: {text}}}", Path("a.yaml"), {"a": item}).questions[0].verdict == "incorrect"
        )


@pytest.mark.parametrize("text", ["answers: {}", "answers:", "student: x", "{}", "answers: {b: , c: ''}"])
def test_no_answers_are_missing_answers(text: str) -> None:
    assert {question.verdict for question in judged(text).values()} == {"missing"}


@pytest.mark.parametrize("text", ["", "42", "[42]", "answers: 42", "answers: [42]", "10.35a: 42", "b: 42"])
def test_a_file_without_a_mapping_of_answers(text: str) -> None:
    assert refused(text) == "wrong_shape"


@cases(
    """
    code | text
    not_allowed | answers: {b: &x 42}  answers: {<<: {b: 42}}
      answers: {b: !!python/object/apply:os.system ['true']}  answers: {b: !!str 42}
    duplicate_key | answers: {b: 42, b: 42}
    parse_error | answers: {b: 42  answers: {[1]: 42}
    """,
    ("not_allowed", "a: &x [1]\nanswers: {b: *x}"),
    ("duplicate_key", "answers: {b: 42}\nanswers: {b: 42}"),
    ("too_deep", "answers: {b: " + "[" * 51 + "]" * 51 + "}"),
    ("too_deep", "[" * 100_000),
    ("too_deep", "- " * 100_000),
    ("parse_error", "? " * 100_000),
    ("parse_error", "answers: {b: 42}\n---\nanswers: {b: 42}"),
    ("parse_error", "answers: {b: '\x00'}"),
    ("parse_error", "\tanswers: {}"),
    ("parse_error", '{"answers": {"b": "\\ud800"}}'),
)
def test_files_that_are_refused(code: str, text: str) -> None:
    assert refused(text) == code


def test_fifty_levels_are_read() -> None:
    # The file and `answers` are two of them.
    text = f"answers: {{b: {'[' * 48}{']' * 48}}}"
    assert judged(text)["b"].verdict in ("incorrect", "partial")


def test_a_refusal_tells_the_line() -> None:
    finding = judged("answers:\n  b: 42\n  b: 43\n")["b"].findings[0]
    assert "line 3" in finding.detail
    assert "`b`" in finding.detail


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        ("unreadable", "not_a_number"),
        ("memory", "too_large"),
        ("recursion", "too_deep"),
        ("forbidden", "not_allowed"),
        ("broken", "parse_error"),
    ],
)
def test_an_answer_that_fails_harms_no_other(answer: str, code: str) -> None:
    found = judged(f"answers: {{10.35a: 42, b: {answer}, c: 42}}")
    assert [question.verdict for question in found.values()] == ["correct", "invalid", "correct"]
    assert found["b"].codes == (code,)
    # What an error says may hold the key.
    assert "41.99" not in sentence(found["b"].findings[0], full=True)


def test_answers_that_differ_in_blanks_and_last_digits_are_told_as_one() -> None:
    texts = ["[1.23401, x + 2]", "[ 1.23399,x+2 ]", "[1.234012345, 'x  +  2.0']"]
    assert len({judged(f"answers: {{b: {text}}}")["b"].answer for text in texts}) == 1
    mappings = ["{Ixx: 1, Iyy: 2}", "{Iyy: 2.0, Ixx: 1.00}"]
    assert len({judged(f"answers: {{b: {text}}}")["b"].answer for text in mappings}) == 1
    assert judged("answers: {b: x1 + 3}")["b"].answer != judged("answers: {b: x2 + 3}")["b"].answer


@given(
    st.recursive(
        st.text() | st.none(),
        lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(), inner, max_size=4),
        max_leaves=12,
    )
)
@settings(max_examples=50, deadline=None)
def test_what_is_told_of_an_answer_is_short(answer: Tree) -> None:
    import json

    questions = judge(
        json.dumps({"answers": {"b": answer}}, ensure_ascii=False), Path("a.yaml"), ITEMS
    ).questions
    assert all(len(question.answer) <= 400 for question in questions)


def test_what_is_told_of_a_long_answer_is_short() -> None:
    for answer in [
        "9" * 100_000,
        "[" + "1, " * 100_000 + "1]",
        "{" + "".join(f"a{k}: 1, " for k in range(10_000)),
    ]:
        text = f"answers: {{b: {answer}" + ("}}" if answer[0] == "{" else "}")
        assert len(judged(text)["b"].answer) <= 400


FINDINGS = st.builds(
    Finding, st.sampled_from(["parse_error", "too_large"]), st.text(), st.text(), reference=st.text()
)
QUESTIONS = st.builds(
    Judged,
    st.text(),
    st.sampled_from(["correct", "partial", "incorrect", "invalid", "missing"]),
    st.floats(0, 1e9),
    st.floats(0, 1e9),
    st.lists(FINDINGS, max_size=3).map(tuple),
    st.text(),
)


@given(st.lists(QUESTIONS, max_size=5).map(tuple))
@settings(max_examples=100, deadline=None)
def test_what_goes_through_a_pipe_comes_out_the_same(questions: tuple[Judged, ...]) -> None:
    assert from_bytes(to_bytes(Sheet(questions, ("a note",)))) == Sheet(questions, ("a note",))


def test_scores_add_up() -> None:
    questions = tuple(Judged(str(k), "partial", score, 1.0) for k, score in enumerate([0.1, 0.2, 0.333333]))
    judgement = Judgement("a", "a.yaml", questions)
    assert (judgement.score, judgement.max_score) == (0.633333, 3.0)


def test_an_item_is_pickled_with_its_kind() -> None:
    item = Item(KINDS["choice"], {"any": np.array([1.0])}, 2.0)
    copy = pickle.loads(pickle.dumps(item))
    assert copy.kind.name == "choice"
    assert copy.points == item.points
    assert (copy.key["any"] == item.key["any"]).all()


def test_a_question_has_its_name_in_any_spelling_and_others_are_told() -> None:
    sheet = judge("answers: {' B ': 42, bb: 1, x: 2}", Path("a.yaml"), ITEMS)
    assert {question.id: question.verdict for question in sheet.questions}["b"] == "correct"
    assert sheet.notes == ("there is no question `bb` (did you mean b?)", "there is no question `x`")


def test_many_answers_to_no_question_are_counted() -> None:
    text = "answers: {" + ", ".join(f"q{n}: 1" for n in range(1000)) + "}"
    notes = judge(text, Path("a.yaml"), ITEMS).notes
    assert len(notes) == 6
    assert "995 more" in notes[-1]


class Endless(Failing):
    """A kind that never comes to an end with one answer."""

    def judge(self, key: Any, answer: Tree) -> Outcome:
        while answer == "loop":
            pass
        return super().judge(key, answer)


def test_an_answer_that_takes_too_long_is_no_harm_to_others(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rigidcli.grading.judge.SECONDS", 0.1)
    items = {id: Item(Endless(), "42", 1.0) for id in ("a", "b", "c")}
    found = judge("answers: {a: 42, b: loop, c: 42}", Path("a.yaml"), items).questions
    assert [question.verdict for question in found] == ["correct", "invalid", "correct"]
    assert found[1].codes == ("timeout",)


def test_long_digits_that_are_no_number_are_told_apart_at_once() -> None:
    text = ", ".join(["1" * 1990 + "a"] * 490)
    begin = time.process_time()
    judge(f"answers: {{b: [{text}]}}", Path("a.yaml"), ITEMS)
    assert time.process_time() - begin < 3


def test_two_spellings_of_one_question_are_refused() -> None:
    def b(text: str) -> Judged:
        return next(each for each in judge(text, Path("a.yaml"), ITEMS).questions if each.id == "b")

    assert b("answers: {B: 42, ' b': 41}").codes == ("duplicate_key",)
    assert b("answers: {B: 41, b: 42}").verdict == "correct"
