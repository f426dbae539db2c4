"""Words and truth values: the same in any spelling, and nothing else."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.document.load import load
from rigidcli.errors import ValueProblem
from rigidcli.grading.asked import Asked
from rigidcli.grading.codes import CODES
from rigidcli.grading.feedback import sentence
from rigidcli.grading.kinds.choice import Choice, Key
from rigidcli.grading.question import Question
from rigidcli.report import Report
from rigidcli.studies import hamilton, precess
from tests.conftest import ROOT
from tests.grading.asking import Asking, cases, require_examples

many = settings(max_examples=150, deadline=None)

WORDS = st.lists(
    st.text("abcdefghijklmnopqrstuvwxyz0123456789", min_size=1, max_size=8), min_size=1, max_size=4
)


CHOICE = Choice()
literal, judged = Asking("choice").literal, Asking("choice").judged


def computed(value: object) -> Key:
    question = Question.model_validate({"ask": "x.y"})
    return CHOICE.read_key(Asked(question, value, report=Report("test/1", "", "", "", ())))


def told(key: Key, answer: Any) -> str:
    outcome = judged(key, answer)
    assert outcome.share == (outcome.verdict == "correct")
    return " ".join(finding.code for finding in outcome.findings) or outcome.verdict


@many
@given(st.data(), WORDS)
def test_spelling_does_not_count(data: st.DataObject, words: list[str]) -> None:
    key = literal(data.draw(st.sampled_from(" _-")).join(words))
    gaps = [
        data.draw(st.sampled_from([" ", "_", "-", "  ", " - ", "\t", "\N{NO-BREAK SPACE}"]))
        for _ in words[1:]
    ]
    text = words[0] + "".join(gap + word for gap, word in zip(gaps, words[1:], strict=True))
    text = "".join(letter.upper() if data.draw(st.booleans()) else letter for letter in text)
    assert told(key, f" {text}  ") == "correct"


@many
@given(WORDS, WORDS)
def test_other_words_are_wrong(words: list[str], others: list[str]) -> None:
    same = [*words] == [*others] or {" ".join(words), " ".join(others)} in ({"yes", "true"}, {"no", "false"})
    assert (told(literal(" ".join(words)), " ".join(others)) == "correct") == same
    assert told(literal(" ".join(words)), f"{' '.join(words)}x") == "outside_tolerance"


@cases("""
    key | expected | answer
    intermediate | correct | Intermediate
    intermediate | outside_tolerance | the intermediate  e2
    sub-critical | correct | SUB CRITICAL
    sub-critical | outside_tolerance | subcritical
    -1 | outside_tolerance | 1
    -1 | correct | -1
    unstable | outside_tolerance | stable
    yes | correct | true  YES
    yes | outside_tolerance | no
    no | correct | False
    ﬁxed | correct | fixed
    phi | correct | φ  Φ.  ϕ
    p_theta | correct | p_θ
    θ | correct | theta
    theta | correct | ϑ
    phi | outside_tolerance | psi
    asymmetric | correct | Asymmetric.  ASYMMETRIC .
    asymmetric | outside_tolerance | asymmetric top
    3.5 | correct | 3.5.
    3.5 | outside_tolerance | 35
    """)
def test_choices(key: str, answer: str, expected: str) -> None:
    assert told(literal(key), answer) == expected


@pytest.mark.parametrize("value", [True, np.bool_(True), False, np.bool_(False)])
def test_a_truth_value(value: object) -> None:
    key = computed(value)
    right, wrong = (["true", "Yes", " TRUE"], ["false", "no"])
    if not value:
        right, wrong = wrong, right
    assert {told(key, answer) for answer in right} == {"correct"}
    assert {told(key, answer) for answer in [*wrong, "1", "maybe"]} == {"outside_tolerance"}


def test_a_key_from_a_document() -> None:
    document = load(ROOT / "configs/top_looping.yaml")
    report = precess.run(document)
    value = report["top"]["nutation_kind"]
    question = Question.model_validate({"document": "x", "ask": "precess.top.nutation_kind"})
    key = CHOICE.read_key(Asked(question, value, "", ("precess", "top", "nutation_kind"), document, report))
    assert told(key, "Looping") == "correct"
    assert told(key, "cuspidal") == "outside_tolerance"


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (None, "wrong_shape"),
        (["stable"], "wrong_shape"),
        ({"stable": "yes"}, "wrong_shape"),
        ("x" * 1001, "too_large"),
        (" \t ", "parse_error"),
    ],
)
def test_what_is_no_text_is_invalid(answer: Any, code: str) -> None:
    assert told(literal("stable"), answer) == code


@many
@given(st.text(max_size=100))
def test_any_text_is_judged(text: str) -> None:
    assert told(literal("\N{SNOWMAN} stable"), text) in ("outside_tolerance", "parse_error")


@pytest.mark.parametrize("value", [None, 3.5, np.float64(1), ["a", 1], {}, "", "  ", "x" * 1001])
def test_what_is_no_text_makes_no_key(value: object) -> None:
    with pytest.raises(ValueProblem) as caught:
        computed(value)
    assert "3.5" not in caught.value.message


@many
@given(st.lists(st.sampled_from(["theta", "phi", "x", "the time"]), unique=True), st.data())
def test_a_set_has_no_order(words: list[str], data: st.DataObject) -> None:
    key = literal(words)
    mixed = data.draw(st.permutations(words))
    assert told(key, mixed) == "correct"
    assert told(key, " , ".join(mixed).upper() or "None") == "correct"
    others = data.draw(st.lists(st.sampled_from(["theta", "phi", "x", "the time", "t"]), unique=True))
    assert (told(key, others) == "correct") == (set(others) == set(words))


def test_the_cyclic_coordinates_are_a_set() -> None:
    report = hamilton.run(load(ROOT / "configs/spherical_pendulum.yaml"))
    key = CHOICE.read_key(Asked(Question.model_validate({"ask": "hamilton.cyclic"}), report["cyclic"]))
    assert told(key, "phi") == told(key, ["phi"]) == "correct"
    assert told(key, "theta") == told(key, "phi, theta") == told(key, "none") == "outside_tolerance"
    assert told(key, [["phi"]]) == "wrong_shape"


@pytest.mark.parametrize("text", ["conserved: H, since L does not hold the time", "a - b_c, d", "no"])
def test_every_example_is_judged_as_made(text: str) -> None:
    require_examples("choice", literal(text))


def test_only_those_who_may_read_it_are_told_the_key() -> None:
    (finding,) = judged(literal("looping"), "wavy").findings
    assert sentence(finding) == CODES["outside_tolerance"]
    assert sentence(finding, full=True) == f"{CODES['outside_tolerance']}; expected `looping`"


@pytest.mark.parametrize("text", ["looping", "true", "No", "Sub-critical damping", "straße"])
def test_examples_are_judged_as_they_were_made(text: str) -> None:
    key = literal(text)
    assert pickle.loads(pickle.dumps(key)) == key
    assert require_examples("choice", key) == {None, "outside_tolerance"}


# --- in the words of the tables


def of_document(name: str, ask: str) -> Key:
    key: Key = Asking("choice").computed((ROOT / "configs" / name).read_text(), ask)
    return key


BOX = "body: {shape: box, size: [1, 2, 3], mass: 12}"


@cases("""
    expected | answer
    correct | asymmetric top  Asymmetric top.  asymmetric top: three different moments
    outside_tolerance | top, asymmetric  top  symmetric top  not asymmetric  asymmetric oblate top
    """)
def test_the_words_of_a_table_are_right(answer: str, expected: str) -> None:
    assert told(Asking("choice").computed(BOX, "axes.class"), answer) == expected


@pytest.mark.parametrize(
    ("size", "right", "wrong"),
    [
        ("[1, 1, 3]", ["prolate", "prolate top", "Prolate symmetric top"], ["symmetric top", "oblate"]),
        ("[3, 3, 1]", ["oblate", "oblate symmetric top"], ["prolate symmetric top"]),
        ("[1, 1, 1]", ["spherical", "spherical top"], ["sphere", "top"]),
    ],
)
def test_tops(size: str, right: list[str], wrong: list[str]) -> None:
    key = Asking("choice").computed(f"body: {{shape: box, size: {size}, mass: 1}}", "axes.class")
    assert {told(key, answer) for answer in right} == {"correct"}
    assert {told(key, answer) for answer in wrong} == {"outside_tolerance"}


def test_every_word_that_is_told_is_possible() -> None:
    """What was expected of all is told for a word that is none of them, and never which of them is right."""
    keys = [
        Asking("choice").computed(BOX, "axes.class"),
        of_document("top_looping.yaml", "precess.top.nutation_kind"),
        of_document("top_looping.yaml", "precess.top.sleeping"),
    ]
    for key in keys:
        assert key.text in key.possible
        (finding,) = judged(key, "something else").findings
        assert finding.detail == f"expected one of {', '.join(f'`{word}`' for word in key.possible)}"
        others = [word for word in key.possible if word != key.text]
        assert {judged(key, word).findings[0].detail for word in others} == {""}
    truth = computed(True)
    assert judged(truth, "maybe").findings[0].detail == "expected one of `yes`, `no`"
    assert judged(truth, "no").findings[0].detail == judged(truth, "false").findings[0].detail == ""
    assert judged(literal("asymmetric"), "something else").findings[0].detail == ""


def test_nothing_that_is_cyclic_in_its_own_words() -> None:
    key = Key("none", frozenset(), "nothing found")
    assert told(key, "nothing found") == told(key, "None.") == told(key, []) == "correct"
    assert told(key, "nothing") == "outside_tolerance"
