"""Answer files as people write them: each line that is no entry costs its own question only."""

from __future__ import annotations

import contextlib
import random
import time
from pathlib import Path
from typing import Any

import pytest

from rigidcli.homework.answers import MOST_ANSWERS, as_typed, read_answers
from rigidcli.homework.base import Tree, Unreadable
from rigidcli.homework.reading import described
from tests.tables import rows_of

KNOWN = ("1", "2", "3", "10.35a", "a", "b", "c", "spring")


def read(text: str, known: Any = KNOWN) -> dict[str, Tree]:
    """The answers; in place of one that cannot be read, its code and its detail."""
    found, _ = read_answers(text, known)
    return {
        name: (answer.findings[0].code, answer.findings[0].detail)
        if isinstance(answer, Unreadable)
        else answer
        for name, answer in found.items()
    }


@pytest.mark.parametrize(
    "line",
    rows_of(__file__, "an entry may be written in many ways"),
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
@pytest.mark.parametrize(
    "head", ["answers:", "Answers:", "ANSWERS", "student: x\nanswers: # mine", "student: x"]
)
def test_an_entry_may_be_written_in_many_ways(line: str, end: str, head: str) -> None:
    lines = [head, "  1: 5", f"  {line}", "  2: 6", ""]
    if not head.casefold().endswith(("answers:", "answers", "mine")):
        lines = [head, "1: 5", line, "2: 6", ""]
    assert read(end.join(lines)) == {"1": "5", "3": "2.34 rad/s", "2": "6"}


@pytest.mark.parametrize(
    ("value", "expected"),
    rows_of(__file__, "an answer is the text that was typed or its lists and mappings"),
)
def test_an_answer_is_the_text_that_was_typed_or_its_lists_and_mappings(value: str, expected: Tree) -> None:
    assert read(f"answers:\n  a: 42\n  b: {value}\n  c: [1, 2]\n") == {
        "a": "42",
        "b": expected,
        "c": ["1", "2"],
    }


@pytest.mark.parametrize(
    ("value", "code"),
    rows_of(__file__, "what is not allowed costs its own question"),
)
def test_what_is_not_allowed_costs_its_own_question(value: str, code: str) -> None:
    found = read(f"answers:\n  a: 42\n  b: {value}\n  c: [1, 2]\n")
    assert (found["a"], found["b"][0], found["c"]) == ("42", code, ["1", "2"])
    assert found["b"][1].startswith("line 3: ")


@pytest.mark.parametrize(
    ("text", "expected"),
    rows_of(__file__, "files of many forms"),
)
def test_files_of_many_forms(text: str, expected: Tree) -> None:
    assert read(text) == expected


@pytest.mark.parametrize(
    ("known", "text", "expected"),
    rows_of(__file__, "files as people write them"),
)
def test_files_as_people_write_them(known: list[str], text: str, expected: Tree) -> None:
    assert {name: answer for name, answer in read(text, known).items() if answer is not None} == expected


def test_a_line_that_is_no_answer_is_told_and_takes_nothing_along() -> None:
    found, notes = read_answers("answers:\n  a: 1\n  I could not do b\n  c: 2\n", KNOWN)
    assert found == {"a": "1", "c": "2"}
    assert notes == ["line 3 is no answer: `I could not do b`"]
    _, notes = read_answers("answers:\n  a: 1\n" + "  what now\n" * 30, KNOWN)
    assert len(notes) == 6
    assert "25 more" in notes[-1]


def test_what_stands_in_an_answer_is_no_other_answer() -> None:
    found = read("answers:\n  a: 1\n  b: 2\n  spring:\n    c: p\n    x: 2\n")
    assert found == {"a": "1", "b": "2", "spring": {"c": "p", "x": "2"}}


def test_an_answer_that_stands_twice_is_none() -> None:
    found = read("answers:\n  a: 1\n  b: 2\n  A: 1\n")
    assert found == {"a": ("duplicate_key", "line 4: the key `A` stands twice"), "b": "2"}


@pytest.mark.parametrize(
    ("code", "text"),
    [
        ("wrong_shape", "Dear grader: hello"),
        ("wrong_shape", "Dear grader, please give me all points."),
        ("wrong_shape", "[42]"),
        ("wrong_shape", "42"),
        ("wrong_shape", "answers: 42"),
        ("wrong_shape", "answers: [42]"),
        ("wrong_shape", "- 1\n- 2"),
        ("parse_error", "answers: {a: 1, b: 2: 3}"),
        ("parse_error", '{"answers": {"a": 1, "b": 2: 3}}'),
        ("parse_error", "answers: {a: 1\0}"),
        ("parse_error", "a: \x1b[31m"),
        ("not_allowed", "answers: {<<: {a: 1}}"),
        ("duplicate_key", "answers: {a: 1, a: 2}"),
        ("too_large", "answers: {a: " + "[" * 100_000),
        ("too_large", "answers:\n" + "".join(f"  q{n}: 1: 2\n" for n in range(MOST_ANSWERS + 1))),
    ],
)
def test_a_file_of_which_no_answer_can_be_told_is_refused(code: str, text: str) -> None:
    with pytest.raises(Unreadable) as refused:
        read_answers(text, KNOWN)
    assert refused.value.findings[0].code == code


@pytest.mark.parametrize(
    "text",
    [
        "answers:\n  a: 1: 2\n" + "  b: [1,\n" * 100_000,
        "answers:\n  a: 1: 2\n" + " " * 900_000,
        "answers:\n  a: 1: 2\n" + "x" * 900_000,
        "answers:\n  a: 1: 2\n  " + ": " * 400_000,
        "answers:\n  a: [" + "[1," * 300_000,
        "answers:\n  a: [" + "1]" * 400_000,
        "answers:\n" + "  a: '\n" * 140_000,
        "answers:\n  a:" + "\n" * 200_000,
        "## a\n\n" * 100_000,
        "| a | 1 |\n" * 90_000,
        "answer " * 140_000,
        "answers:\n  a: " + '"' * 900_000,
        "answers:\n  a: " + "# " * 400_000,
        "? " * 100_000,
        "- " * 100_000,
    ],
)
def test_no_text_takes_long(text: str) -> None:
    begin = time.process_time()
    with contextlib.suppress(Unreadable):
        read_answers(text, KNOWN)
    assert time.process_time() - begin < 4


def test_any_line_may_be_broken_in_any_way() -> None:
    """Of many broken lines, each costs at most its own answer."""
    chance = random.Random(1)
    for _ in range(300):
        names = [f"q{n}" for n in range(6)]
        values = {name: chance.choice(["1", "[1, 2]", "{x: 1}", "p^2/(2*m)", "'a: b'"]) for name in names}
        broken = chance.choice(names)
        noise = "".join(chance.choice("]}:'\"&*!|>%@`,#-? x1") for _ in range(chance.randint(1, 12)))
        lines = [f"  {name}: {noise if name == broken else value}" for name, value in values.items()]
        whole = "answers:\n" + "".join(f"  {name}: {value}\n" for name, value in values.items())
        right, _ = read_answers(whole, names)
        found, _ = read_answers("answers:\n" + "\n".join(lines), names)
        assert {name: found.get(name) for name in names if name != broken} == {
            name: right[name] for name in names if name != broken
        }, lines


@pytest.mark.parametrize(
    ("answer", "typed"),
    [
        ("1,125e-3", "1,125e-3"),
        (["0.002455", ["1", None]], "[0.002455, [1, ]]"),
        ({"Ixx": "1 kg m^2"}, "{Ixx: 1 kg m^2}"),
        ("xdot = p/m\npdot = -k x", "xdot = p/m; pdot = -k x"),
        (None, ""),
    ],
)
def test_an_answer_is_shown_as_typed(answer: Tree, typed: str) -> None:
    assert as_typed(answer) == typed


@pytest.mark.parametrize(
    ("answer", "said"),
    rows_of(__file__, "an answer is described without its key"),
)
def test_an_answer_is_described_without_its_key(answer: Tree, said: str) -> None:
    assert said in described(answer, Path("x.yaml"))


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        ("((((", "parse_error"),
        ({"file": "nowhere.csv"}, "missing_file"),
        ({"file": "/etc/passwd"}, "path_outside"),
        (Unreadable("too_large"), "too_large"),
    ],
)
def test_what_no_question_reads_is_told(answer: Tree, code: str) -> None:
    with pytest.raises(Unreadable) as refused:
        described(answer, Path("x.yaml"))
    assert refused.value.findings[0].code == code


@pytest.mark.parametrize(
    "form",
    rows_of(__file__, "answers below headings and behind bullets"),
)
def test_answers_below_headings_and_behind_bullets(form: str) -> None:
    answers, _ = read_answers(form.format("m*g*z", "[[1, 2], [3, 4]]"), ["1", "2a"])
    read = {name.casefold(): answer for name, answer in answers.items()}
    assert read["1"] == "m*g*z"
    assert read["2a"] in ([["1", "2"], ["3", "4"]], "[[1, 2], [3, 4]]")


@pytest.mark.parametrize("text", ["T: 1 s\nt: 2 s\n", "answers: {T: 1 s, t: 2 s}", "- T: 1 s\n- t: 2 s\n"])
def test_names_of_questions_may_differ_in_capitals(text: str) -> None:
    assert read(text, ["T", "t"]) == {"T": "1 s", "t": "2 s"}
    assert read(text, ["T"]) == {"T": ("duplicate_key", read(text, ["T"])["T"][1])}


@pytest.mark.parametrize("text", ["answers:\n  s: 3 m\n", "answers: {s: 3 m}", "answer s: 3 m"])
def test_the_head_is_no_answer_to_a_question_named_s(text: str) -> None:
    assert read(text, ["s"]) == {"s": "3 m"}


@pytest.mark.parametrize("marks", [("- ", "- "), ("* ", "* "), ("• ", "• "), ("4. ", "5. "), ("4) ", "5) ")])
@pytest.mark.parametrize("head", ["", "answers:\n", "# mine\n"])
def test_a_file_of_bullets_answers_the_questions_that_they_name(marks: tuple[str, str], head: str) -> None:
    text = f"{head}{marks[0]}a: 20.8 rad/s\n{marks[1]}spring: 3/8\n"
    assert read(text) == {"a": "20.8 rad/s", "spring": "3/8"}


@pytest.mark.parametrize("text", ["spring:\n- a: 3\n- x: 2\n", "spring:\n* a: 3\n* 1: 2\n"])
def test_bullets_below_a_name_are_its_answer(text: str) -> None:
    with contextlib.suppress(Unreadable):
        assert read(text).keys().isdisjoint({"1", "a"})
