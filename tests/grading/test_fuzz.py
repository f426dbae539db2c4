"""Random texts where answers, assignments and expressions are read: an outcome for each, and no traceback.

Answer files are made of pieces that mean something to some reader, right answers that are changed at random,
and plain noise. What SPEC refuses is never accepted: code, bombs, and whatever is no answer of the kind.
"""

from __future__ import annotations

import random
import string
import time
from contextlib import suppress
from functools import cache
from pathlib import Path

from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError, ExpressionError
from rigidcli.grading.assignment import prepare
from rigidcli.grading.feedback import sentence
from rigidcli.grading.judge import Item, judge
from rigidcli.language.expression import parse
from rigidcli.studies import axes, euler, hamilton, inertia, precess
from tests.conftest import ROOT

STUDIES = {
    "inertia": inertia.run,
    "axes": axes.run,
    "precess": precess.run,
    "euler": euler.run,
    "hamilton": hamilton.run,
}

SLOW = 5.0
"""Seconds that no answer file may take, with much room for a machine that is busy."""

many = settings(
    max_examples=200,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)

PIECES = [
    *("10.35a", "answers", "moment", "axis", "Ixx", "csv", "file", "xdot", "p_x", "m", "k", "t,x\\n0,1\\n"),
    *("0", "1", "-1", "1e308", "1e-320", "9**9**9**9", "1/0", "nan", ".inf", "0x10", "1_0", "10 cm", "5 kg"),
    *("sqrt(-1)", "sin(", ")", "(" * 40, "x" * 300, "**", "^", "=", "==", "+", "-", "*", "/", ",", "pi", "t"),
    *("[", "]", "{", "}", ":", ": ", "- ", "\n", "\n  ", "&a ", "*a", "!!python/name:os.system ", "<<", "# "),
    *('"', "'", "|", ">", "---", "...", "\t", "\0", "\x1b[31m", "\u202e", "\ud7ff", "é", "½", "²", "−", "λ"),
    *(
        "__import__('os').system('true')",
        "lambda: 0",
        "().__class__",
        "eval",
        "${HOME}",
        "../x",
        "/etc/passwd",
    ),
]


@cache
def items() -> dict[str, Item]:
    """The homework of the README, in which most kinds are."""
    return prepare(ROOT / "configs/homework/assignment.yaml", STUDIES).items


@cache
def honest() -> tuple[str, ...]:
    return tuple(path.read_text() for path in sorted((ROOT / "configs/homework/answers").glob("*.*[nl]")))


def changed(text: str, seed: int) -> str:
    """A text with some pieces put in, taken out, doubled or exchanged."""
    chance = random.Random(seed)
    for _ in range(chance.randint(1, 6)):
        place, length = chance.randrange(len(text) + 1), chance.choice([0, 1, 1, 3, 12])
        piece = chance.choice(
            [chance.choice(PIECES), text[place : place + 20], chance.choice(string.printable), ""]
        )
        text = text[:place] + piece + text[place + length :]
    return text


def judged(text: str) -> None:
    """Judge a text: an outcome for every question, in time, and none of them for an error of the program."""
    begin = time.process_time()
    found = judge(text, Path("/nonexistent/x.yaml"), items()).questions
    assert time.process_time() - begin < SLOW
    assert [question.id for question in found] == list(items())
    for question in found:
        assert 0 <= question.score <= question.max_score
        assert (question.verdict == "correct") == (question.score == question.max_score)
        assert question.verdict in ("correct", "missing") or question.findings
        for finding in question.findings:
            assert "cannot be judged" not in sentence(finding)
            sentence(finding, full=True)


@many
@given(st.sampled_from(range(5)), st.integers(0, 2**32))
def test_changed_answer_files(which: int, seed: int) -> None:
    judged(changed(honest()[which % len(honest())], seed))


@many
@given(st.lists(st.sampled_from(PIECES), max_size=30))
def test_pieces_of_answer_files(pieces: list[str]) -> None:
    judged("".join(pieces))


@many
@given(st.sampled_from(["10.35a", "10.35b", "10.39", "13.2", "spring", "orbit", "flip"]), st.data())
def test_pieces_as_answers(question: str, data: st.DataObject) -> None:
    pieces = data.draw(st.lists(st.sampled_from(PIECES), max_size=8))
    quoted = "".join(pieces).replace("'", "''").replace("\n", " ")
    judged(f"answers:\n  {question}: '{quoted}'\n")
    judged(f"answers:\n  {question}: ['{quoted}', '{quoted}', '1']\n")
    judged(f"answers:\n  {question}: {{xdot: '{quoted}', csv: '{quoted}', moment: '{quoted}'}}\n")


@many
@given(st.text(max_size=200))
def test_any_text_is_an_answer_file_or_none(text: str) -> None:
    judged(text)


@many
@given(st.one_of(st.text(max_size=60), st.lists(st.sampled_from(PIECES), max_size=12).map("".join)))
def test_any_text_is_an_expression_or_is_refused(text: str) -> None:
    begin = time.process_time()
    with suppress(ExpressionError):
        expression = parse(text)
        expression.evaluate(dict.fromkeys(expression.names, 0.7))
    assert time.process_time() - begin < 1


LITERAL = """
assignment: Literal keys
questions:
  n: {answer: 20.8 rad/s, kind: quantity, points: 2, credit: {sign_error: 0.5, unit_missing: 1}}
  v: {answer: [1, 0, 0], kind: vector, direction: sense}
  m: {answer: [2, 11, 11], kind: moments, order: ascending}
  i: {answer: {Ixx: 8, Iyy: 8, Izz: 8, Ixy: -3, Ixz: -3, Iyz: -3}, kind: tensor}
  a: {answer: {tensor: [[8, -3, -3], [-3, 8, -3], [-3, -3, 8]]}, kind: axes, handed: right}
  h: {answer: p_x**2/(2*m) + k*x**2/2, kind: expression, symbols: {m: positive, k: positive}}
  e: {answer: {xdot: p_x/m, p_xdot: -k*x}, kind: equations}
  o: {answer: {t: [0, 10, 0.1], columns: {x: cos(t)}}, kind: trajectory, tolerance: {absolute: 0.01}}
  c: {answer: oblate, kind: choice, credit: whole, accept: [{answer: flat, credit: 0.5, message: nearly}]}
"""


@settings(many, max_examples=100)
@given(st.integers(0, 2**32))
def test_changed_assignments(tmp_path: Path, seed: int) -> None:
    path = tmp_path / "hw.yaml"
    path.write_bytes(changed(LITERAL, seed).encode(errors="surrogatepass"))
    with suppress(DocumentError):
        assert prepare(path, STUDIES).items
