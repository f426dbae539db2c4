"""What a question says of its points: shares for what is found, further answers; and what does nothing."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import rigidcli
from rigidcli.errors import DocumentError
from rigidcli.grading.assignment import Prepared, prepare
from rigidcli.grading.feedback import sentence
from rigidcli.grading.judge import Accepted, Item, judge, outcome
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, review, wrong
from rigidcli.grading.selftest import trials
from tests.conftest import ROOT
from tests.grading.asking import Same, cases, codes

STUDIES = {name: getattr(rigidcli, name) for name in rigidcli.STUDIES}

FOUND: dict[str, Outcome] = {
    "right": correct(),
    "remark": correct(Finding("second_order_form")),
    "half": wrong(Finding("sign_error"), share=0.5),
    "two": wrong(Finding("sign_error"), Finding("unit_missing"), share=0.25),
    "wrong": wrong(Finding("outside_tolerance")),
    "silent": wrong(),
    "unsure": review("nobody knows"),
}


class Telling(Same):
    """A kind that finds in an answer what FOUND has under it; by any other key, the key itself is right."""

    def judge(self, key: Any, answer: Any) -> Outcome:
        if key != "key":
            return correct() if answer == key else wrong(Finding("outside_tolerance"))
        if answer == "unreadable":
            raise Unreadable("parse_error", also=[Finding("unit_missing", "entry 2")])
        return FOUND[answer]


def verdict(answer: str, **item: Any) -> tuple[str, float, list[str]]:
    found = outcome(Item(Telling(), "key", 1.0, **item), answer, Path("x.yaml"))
    return found.verdict, found.share, codes(found)


@pytest.mark.parametrize(
    ("answer", "credit", "expected"),
    [
        ("half", "parts", ("partial", 0.5)),
        ("half", "whole", ("incorrect", 0.0)),
        ("right", "whole", ("correct", 1.0)),
        ("remark", "whole", ("correct", 1.0)),
        ("unsure", "whole", ("review", 0.0)),
        ("half", {"sign_error": 0.8}, ("partial", 0.8)),
        ("half", {"sign_error": 0.1}, ("partial", 0.1)),
        ("half", {"sign_error": 0}, ("incorrect", 0.0)),
        ("half", {"sign_error": 1}, ("correct", 1.0)),
        ("half", {"unit_missing": 0.8}, ("partial", 0.5)),
        ("two", {"sign_error": 0.8}, ("partial", 0.25)),
        ("two", {"sign_error": 0.8, "unit_missing": 0.6}, ("partial", 0.6)),
        ("wrong", {"sign_error": 0.8}, ("incorrect", 0.0)),
        ("silent", {"sign_error": 0.8}, ("incorrect", 0.0)),
        ("right", {"sign_error": 0.8}, ("correct", 1.0)),
        ("remark", {"second_order_form": 0.5}, ("partial", 0.5)),
        ("unsure", {"undecided": 1}, ("review", 0.0)),
        ("unreadable", {"parse_error": 0.3}, ("invalid", 0.0)),
        ("unreadable", {"parse_error": 0.3, "unit_missing": 0.2}, ("partial", 0.2)),
    ],
)
def test_credit(answer: str, credit: Any, expected: tuple[str, float]) -> None:
    assert verdict(answer, credit=credit)[:2] == expected


@pytest.mark.parametrize(
    ("answer", "accepted", "expected"),
    [
        ("wrong", [Accepted("wrong", 0.5, "nearly")], ("partial", 0.5, ["accepted"])),
        ("wrong", [Accepted("wrong", 0.5), Accepted("wrong", 0.75)], ("partial", 0.75, ["accepted"])),
        ("wrong", [Accepted("wrong", 0.75), Accepted("wrong", 0.5)], ("partial", 0.75, ["accepted"])),
        ("wrong", [Accepted("wrong", 1.0)], ("correct", 1.0, ["accepted"])),
        ("wrong", [Accepted("wrong", 0.0, "no")], ("incorrect", 0.0, ["accepted"])),
        ("wrong", [Accepted("other", 1.0)], ("incorrect", 0.0, ["outside_tolerance"])),
        ("half", [Accepted("half", 0.25)], ("partial", 0.5, ["sign_error"])),
        ("right", [Accepted("right", 0.5)], ("correct", 1.0, [])),
        ("unsure", [Accepted("unsure", 0.5)], ("partial", 0.5, ["accepted"])),
        ("unreadable", [Accepted("unreadable", 0.5)], ("partial", 0.5, ["accepted"])),
        ("unreadable", [Accepted("other", 0.5)], ("invalid", 0.0, ["parse_error", "unit_missing"])),
    ],
)
def test_accept(answer: str, accepted: list[Accepted], expected: tuple[str, float, list[str]]) -> None:
    assert verdict(answer, accepted=tuple(accepted)) == expected


def test_all_problems_of_an_answer_are_told() -> None:
    (question,) = judge(
        "answers: {a: unreadable}", Path("x.yaml"), {"a": Item(Telling(), "key", 1.0)}
    ).questions
    assert [(finding.code, finding.place) for finding in question.findings] == [
        ("parse_error", ""),
        ("unit_missing", "entry 2"),
    ]


def prepared(folder: Path, questions: str) -> Prepared:
    (folder / "hw.yaml").write_text(f"questions:\n{questions}")
    return prepare(folder / "hw.yaml", STUDIES)


def judged(folder: Path, questions: str, answers: str) -> dict[str, Judged]:
    items = prepared(folder, questions).items
    return {each.id: each for each in judge(f"answers: {{{answers}}}", folder / "x.yaml", items).questions}


def test_credit_and_accept_in_an_assignment(tmp_path: Path) -> None:
    questions = f"""
  rate:
    answer: 20.8 rad/s
    kind: quantity
    points: 4
    unit: required
    credit: {{unit_missing: 0.5}}
    accept: [{{answer: 3.31 Hz, credit: 0.25, message: this is the frequency}}]
  fall:
    document: {ROOT}/configs/taylor_13_02.yaml
    ask: hamilton.hamiltonian
    accept: {{answer: p_x**2/(2*m) + m*g*x, credit: 0.5, message: x points down}}
  word: {{answer: oblate, kind: choice, accept: [{{answer: flat, credit: 1}}]}}
""".replace("accept: {answer", "accept: [{answer").replace("down}", "down}]")
    found = judged(tmp_path, questions, "rate: 20.8, fall: p_x^2/(2*m) + m*g*x, word: Flat")
    assert {id: (each.verdict, each.score) for id, each in found.items()} == {
        "rate": ("partial", 2.0),
        "fall": ("partial", 0.5),
        "word": ("correct", 1.0),
    }
    assert sentence(found["fall"].findings[0]) == "this answer was foreseen; x points down"
    assert judged(tmp_path, questions, "rate: 3.310 Hz")["rate"].score == 1.0


@pytest.mark.parametrize(("accepted", "passed"), [("2", True), ("1.0000001", False)])
def test_accepted_answers_are_in_the_selftest(tmp_path: Path, accepted: str, passed: bool) -> None:
    question = f"{{answer: 1, kind: number, credit: whole, accept: [{{answer: {accepted}, credit: 0.5}}]}}"
    done = list(trials(prepared(tmp_path, f"  a: {question}\n").items))
    assert [trial.passed for trial in done] == [*[True] * (len(done) - 1), passed]
    assert done[-1].example.code == "accepted"


@cases(
    """
    said | question
    a.credit.unit_mising: there is no such code | {answer: 1, kind: number, credit: {unit_mising: 0.5}}
    did you mean `unit_missing`? | {answer: 1, kind: number, credit: {unit_mising: 0.5}}
    a.credit.unit_missing | {answer: 1, kind: number, credit: {unit_missing: 2}}
    a.credit | {answer: 1, kind: number, credit: half}
    a.accept.0.answer: missing | {answer: 1, kind: number, accept: [{credit: 1}]}
    a.accept.0.credit | {answer: 1, kind: number, accept: [{answer: 2, credit: 3}]}
    a.accept | {answer: 1, kind: number, accept: 73737}
    a.accept.0 | {answer: 1, kind: number, accept: [73737]}
    a.accept.0.anser: unknown key | {answer: 1, kind: number, accept: [{anser: 73737}]}
    """,
    ("a.accept.1.answer: ", "{answer: 1, kind: number, accept: [{answer: 2}, {answer: 73737 +}]}"),
)
def test_what_is_wrong_with_credit_and_accept(tmp_path: Path, question: str, said: str) -> None:
    with pytest.raises(DocumentError) as refused:
        prepared(tmp_path, f"  a: {question}\n")
    assert said in str(refused.value)
    assert "73737" not in str(refused.value)


class Named(Same):
    """A kind whose keys hold the symbols m and x, and cannot be read if they are `bad`."""

    options = frozenset({"symbols"})

    def read_key(self, asked: Any) -> Any:
        if asked.value == "bad":
            raise Unreadable("not_a_number", "read `73737`, expected one number", place="row 2, entry 3")
        return asked.value

    def used_names(self, key: Any) -> frozenset[str] | None:
        return None if key == "unknown" else frozenset({"m", "x"})


@pytest.mark.parametrize(
    ("question", "notes"),
    [
        (
            "{answer: y, kind: number, symbols: {m: positive, X: real}}",
            ["symbols.X: note: no key has this symbol"],
        ),
        ("{answer: unknown, kind: number, symbols: {X: real}}", []),
        ("{answer: y, kind: number, tolerance: {relative: 0.2}}", []),
        (
            "{answer: y, kind: number, tolerance: {relative: 5}}",
            ["tolerance.relative: note: it is 500% of the value: per cent meant?"],
        ),
        ("{answer: y, kind: number, order: free}", ["order: note: this means nothing to the kind `number`"]),
    ],
)
def test_what_does_nothing_is_noted(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, question: str, notes: list[str]
) -> None:
    monkeypatch.setitem(KINDS, "number", Named())
    assert [
        str(note).partition("questions.a.")[2] for note in prepared(tmp_path, f"  a: {question}").notes
    ] == notes


def test_a_key_that_cannot_be_read_tells_where_and_why(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(KINDS, "number", Named())
    with pytest.raises(DocumentError) as refused:
        prepared(tmp_path, "  a:\n    kind: number\n    answer: bad")
    assert str(refused.value).endswith(
        "hw.yaml:4: questions.a.answer: row 2, entry 3: cannot be read as a number; expected one number"
    )


@pytest.mark.parametrize(
    ("score", "places", "told"), [(2.675, 2, 2.68), (2.5, 0, 3.0), (1 / 3, 2, 0.33), (6, 1, 6.0)]
)
def test_a_score_as_a_gradebook_has_it(score: float, places: int, told: float) -> None:
    assert Judgement("a", "a.yaml", (Judged("q", "partial", score, 9.0),)).score_to(places) == told
