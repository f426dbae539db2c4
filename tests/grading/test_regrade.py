"""What a new run changes: against runs that were written by hand, and by the program itself."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError
from rigidcli.grading import Feedback
from rigidcli.grading.judgement import Judged, Judgement
from rigidcli.grading.outcome import Finding
from rigidcli.grading.reports import Style, regrade
from rigidcli.grading.reports.formats import render
from rigidcli.grading.reports.regrade import Change, Mark, changes, parse
from rigidcli.render.terminal import cells

SIGN = (Finding("sign_error", reference="expected 6.28318"),)

AMY = Judgement("amy", "amy.yaml", (Judged("a", "correct", 3.0, 3.0), Judged("b", "missing", 0.0, 2.0)))
BOB = Judgement(
    "bob", "bob.yaml", (Judged("a", "incorrect", 0.0, 3.0, SIGN), Judged("b", "correct", 2.0, 2.0))
)


def written(*judgements: Judgement, feedback: Feedback = Feedback.hint) -> bytes:
    return "".join(render("json", judgements, Style(feedback))).encode()


OLD = parse(written(AMY, BOB), "old.json")


def test_the_same_run_changes_nothing() -> None:
    assert changes(OLD, [AMY, BOB]) == ()
    assert changes(OLD, [BOB, AMY]) == ()
    assert "".join(regrade.table((), Style())) == "nothing has changed\n"


def test_verdicts_scores_and_codes_are_compared() -> None:
    power = (Finding("power_of_ten"),)
    new = [
        Judgement("amy", "elsewhere/amy.yaml", (Judged("a", "correct", 4.0, 4.0), AMY.questions[1])),
        Judgement(
            "bob", "bob.yaml", (Judged("a", "incorrect", 0.0, 3.0, power), Judged("b", "partial", 1.0, 2.0))
        ),
    ]
    assert changes(OLD, new) == (
        Change("amy", "a", Mark("correct", 3.0, 3.0), Mark("correct", 4.0, 4.0)),
        Change(
            "bob",
            "a",
            Mark("incorrect", 0.0, 3.0, ("sign_error",)),
            Mark("incorrect", 0.0, 3.0, ("power_of_ten",)),
        ),
        Change("bob", "b", Mark("correct", 2.0, 2.0), Mark("partial", 1.0, 2.0)),
    )


def test_students_and_questions_come_and_go() -> None:
    new = [
        Judgement("amy", "amy.yaml", (AMY.questions[0], Judged("c", "correct", 1.0, 1.0))),
        Judgement("cy", "cy.yaml", (Judged("a", "correct", 3.0, 3.0),)),
    ]
    assert changes(OLD, new) == (
        Change("amy", "c", None, Mark("correct", 1.0, 1.0)),
        Change("amy", "b", Mark("missing", 0.0, 2.0), None),
        Change("cy", "", None, Mark("", 3.0, 3.0)),
        Change("bob", "", Mark("", 2.0, 5.0), None),
    )


def test_students_of_whom_an_answer_waits_come_first() -> None:
    waiting = Judgement("bob", "bob.yaml", (BOB.questions[0], Judged("b", "review", 0.0, 2.0)))
    better = Judgement("amy", "amy.yaml", (AMY.questions[0], Judged("b", "correct", 2.0, 2.0)))
    found = changes(OLD, [better, waiting])
    assert [(change.student, change.question) for change in found] == [("bob", "b"), ("amy", "b")]
    last = "".join(regrade.table(found, Style())).splitlines()[-1]
    assert last == "waiting for a person: 1, questions changed: 2, students concerned: 2"
    (again,) = changes(parse(written(better, waiting), "old"), [better, BOB])
    assert again.old == Mark("review", 0.0, 2.0)


def test_students_of_one_name_are_told_apart_by_their_files() -> None:
    def one(folder: str, verdict: str, score: float) -> Judgement:
        return Judgement("amy", f"{folder}/amy.yaml", (Judged("a", verdict, score, 3.0),))  # type: ignore[arg-type]

    old = parse(written(one("x", "correct", 3.0), one("y", "incorrect", 0.0)), "old")
    assert changes(old, [one("x", "correct", 3.0), one("y", "incorrect", 0.0)]) == ()
    (change,) = changes(old, [one("x", "correct", 3.0), one("y", "correct", 3.0)])
    assert (change.student, change.question) == ("amy (y/amy.yaml)", "a")


@pytest.mark.parametrize("level", [Feedback.none, Feedback.verdict])
def test_codes_count_only_where_both_runs_tell_them(level: Feedback) -> None:
    bare = parse(written(AMY, BOB, feedback=level), "old")
    assert changes(bare, [AMY, BOB]) == ()
    assert changes(OLD, [AMY, BOB], level) == ()
    named = Judgement("bob", "bob.yaml", (Judged("a", "correct", 3.0, 3.0, SIGN), BOB.questions[1]))
    (change,) = changes(OLD, [AMY, named], level)
    assert change == Change("bob", "a", Mark("incorrect", 0.0, 3.0), Mark("correct", 3.0, 3.0))


def test_an_old_run_is_lines_or_an_array() -> None:
    lines = written(AMY, BOB)
    array = b"[" + b",".join(lines.splitlines()) + b"]"
    pretty = json.dumps(json.loads(array), indent=2).encode()
    for data in (lines, lines.replace(b"\n", b"\r\n\r\n"), array, pretty, b"\xef\xbb\xbf" + lines):
        assert parse(data, "old") == OLD
    assert parse(lines.splitlines()[0], "old") == OLD[:1]
    assert parse(b"[]", "old") == parse(b"", "old") == ()


def test_keys_of_a_later_version_are_passed_over() -> None:
    tree = json.loads(written(AMY))
    tree["grader"] = {"name": "x"}
    tree["questions"][0]["seconds"] = 1
    assert parse(json.dumps(tree).encode(), "old") == OLD[:1]


def test_texts_by_hand() -> None:
    better = Judgement("bob", "bob.yaml", (Judged("a", "correct", 3.0, 3.0), BOB.questions[1]))
    found = changes(OLD, [better, Judgement("cy", "cy.yaml", (Judged("a", "partial", 1.5, 3.0),))])
    assert (
        "".join(regrade.table(found, Style()))
        == """\
bob
  a  incorrect 0/3 (sign_error) -> correct 3/3
cy
  new  1.5/3
amy
  gone  3/5
questions changed: 1, students concerned: 1, new students: 1, students gone: 1
"""
    )
    assert (
        "".join(regrade.csv(found, Style()))
        == """\
student,question,old_verdict,new_verdict,old_score,new_score,old_max_score,new_max_score,old_codes,new_codes
bob,a,incorrect,correct,0.0,3.0,3.0,3.0,sign_error,
cy,,,,,1.5,,3.0,,
amy,,,,3.0,,5.0,,,
"""
    )
    first, *_ = "".join(regrade.json(found, Style())).splitlines()
    assert first == (
        '{"schema":"rigidcli.regrade/1","student":"bob","question":"a",'
        '"old":{"verdict":"incorrect","score":0.0,"max_score":3.0,"codes":["sign_error"]},'
        '"new":{"verdict":"correct","score":3.0,"max_score":3.0,"codes":[]}}'
    )


GOOD = json.loads(written(BOB))


NONSENSE: list[dict[str, object]] = [
    {"schema": "rigidcli.inertia/1"},
    {"student": 3},
    {"questions": {}},
    {"questions": [GOOD["questions"][0] | {"verdict": "great"}]},
    {"score": "3"},
    {"score": True},
    {"score": None},
]


@pytest.mark.parametrize(
    "data",
    [
        *(b"hello", b"{}", b"3", b"null", b"[[]]", b"\xff\xfe", b"[" * 100_000, b'{"schema": NaN}'),
        *(json.dumps(GOOD | change).encode() for change in NONSENSE),
    ],
)
def test_nonsense_is_refused(data: bytes) -> None:
    with pytest.raises(DocumentError, match=r"^old\.json"):
        parse(data, "old.json")


def test_a_bad_line_is_told_by_its_number() -> None:
    with pytest.raises(DocumentError, match=r"^old\.json:2: questions: not an object of `rigidcli\.check/1`"):
        parse(written(AMY) + json.dumps(GOOD | {"questions": 0}).encode() + b"\n", "old.json")
    with pytest.raises(DocumentError, match=r"^old\.json:3: not JSON"):
        parse(written(AMY, BOB) + b"{\n", "old.json")


def test_files_are_read_whole_and_bounded(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "old.json"
    path.write_bytes(written(AMY, BOB))
    assert regrade.read(path) == OLD
    monkeypatch.setattr("rigidcli.grading.reports.reading.MAX_BYTES", 100)
    with pytest.raises(DocumentError, match="too long"):
        regrade.read(path)
    with pytest.raises(DocumentError, match="No such file"):
        regrade.read(tmp_path / "none.json")
    with pytest.raises(DocumentError, match="cannot be read"):
        regrade.read(tmp_path)


@given(
    st.text(st.characters(exclude_categories=["Cs"]), max_size=30),
    st.sampled_from([None, 40, 80]),
    st.booleans(),
)
@settings(max_examples=100, deadline=None)
def test_hostile_names_in_an_old_run_are_harmless(name: str, width: int | None, colour: bool) -> None:
    tree = GOOD | {"student": f"\x1b[31m{name}", "source": name}
    tree["questions"] = [GOOD["questions"][0] | {"id": name, "feedback": [{"code": f"\x1b{name}"}]}]
    old = parse(json.dumps([tree, tree | {"student": "amy"}]).encode(), "old")
    found = changes(old, [AMY])
    outputs = {form: "".join(tell(found, Style(width=width))) for form, tell in regrade.TEXTS.items()}
    for output in outputs.values():
        assert all(char.isprintable() for char in output.replace("\n", ""))
        assert "6.28318" not in output
    if width is not None:
        assert max(map(cells, outputs["table"].splitlines())) <= width
    coloured = "".join(regrade.table(found, Style(width=1000, colour=colour)))
    assert coloured.count("\x1b") == 2 * 2 * colour
