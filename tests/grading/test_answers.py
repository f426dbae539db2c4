"""Answer files that are no YAML as a whole: what is no answer in them costs no other."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from rigidcli.grading.answers import MOST_ANSWERS, read_answers
from rigidcli.grading.asked import Tree
from rigidcli.grading.described import described
from rigidcli.grading.outcome import Unreadable
from tests.grading.asking import answers, cases

KNOWN = ("a", "b", "c")


def read(text: str) -> dict[str, Tree]:
    """The answers; in place of one that cannot be read, its code and what is said of it."""
    found = read_answers(text, "x.yaml", KNOWN)
    return {
        name: (answer.finding.code, answer.finding.detail) if isinstance(answer, Unreadable) else answer
        for name, answer in found.items()
    }


@cases(
    """
    code | cure | line
    parse_error | a text with a colon and a blank in it stands in quotes | omega: 20.8 rad/s
    parse_error | close the bracket | [1, 2  [[1, 2], [3, 4]  {xdot: p_x/m
    parse_error | write the answer in quotes | [1, 2]]  - k*x  @x  `x`  % 3
    parse_error | quotation marks stand round the whole answer | "p_x"/2  'it's'  "no end
    not_allowed | or quote the text | *x  &x 1
    not_allowed | leave out tags | !x 1
    """,
    ("parse_error", "quotation marks", '"\\omega"'),
    ("parse_error", "write the answer in quotes", "|T|"),
    ("too_deep", "nested", "[" * 60),
    ("parse_error", "control characters", "\x00"),
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_one_line_that_is_no_yaml_costs_one_answer(line: str, code: str, cure: str, end: str) -> None:
    text = end.join(["student: Ada", "answers:", "  a: 42", f"  b: {line}", "  c: [1, 2]", ""])
    found = read(text)
    assert (found["a"], found["c"]) == ("42", ["1", "2"])
    assert found["b"][0] == code
    assert found["b"][1].startswith("line 4: ")
    assert cure in found["b"][1]


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("student: Ada: L\nanswers:\n  a: 1\n", {"a": "1"}),
        ("student: 'Ada\nanswers: {a: 1}\n", {"a": "1"}),
        ("answers:\n  a: 1\n  b: 2\nnote: to: you\n", {"a": "1", "b": "2"}),
        ("# mine\nanswers: # all\n  # b: 3\n  a: 1\n\n   b: 2\n", {"a": "1", "b": "2"}),
        ("answers:\n  a: 1\n b: 2\n", {"a": "1", "b": "2"}),
        ("answers:\n    a: 1\n  b: 2\n", {"a": "1", "b": "2"}),
        ("answers:\n  a:\n  - x = 1\n  - y = 2\n  b: 2\nx: y: z", {"a": ["x = 1", "y = 2"], "b": "2"}),
        (
            "answers:\n  a:\n    csv: |\n      t,x\n      0,1\n  B : 2\nx: y: z",
            {"a": {"csv": "t,x\n0,1\n"}, "B": "2"},
        ),
        ("answers:\n  'a': 1\n  \"b\": 2\nx: y: z", {"a": "1", "b": "2"}),
    ],
)
def test_what_stands_elsewhere_or_is_indented_badly_costs_nothing(text: str, expected: Tree) -> None:
    assert read(text) == expected


@pytest.mark.parametrize(
    "value", ["[1, 2, 3] cm", "[1, 2, 3]cm", "[[1, 0], [0, 1]] kg m^2", "[1, 2] kg*m^2/s"]
)
def test_a_list_with_a_unit_behind_it_is_the_text_that_was_typed(value: str) -> None:
    assert read(f"answers:\n  a: {value}  # in all\n  b: 1\n") == {"a": value, "b": "1"}


def test_a_tab_is_told() -> None:
    found = read("answers:\n  a: 1\n\tb: 2\n  c: 3\n")
    assert (found["a"], found["c"]) == ("1", "3")
    assert "line 3" in found["b"][1]
    assert "tabs" in found["b"][1]


def test_what_stands_in_an_answer_is_no_other_answer() -> None:
    found = read("answers:\n  a: 1\n  b: 2\n  spring:\n    a: p: 1\n    x: 2\n")
    assert (found["a"], found["b"], found["spring"][0]) == ("1", "2", "parse_error")


def test_an_answer_that_stands_twice_is_none() -> None:
    assert read("answers:\n  a: 1\n  b: 2\n  a: 1\n") == {
        "a": ("duplicate_key", "line 4: the key `a` stands twice"),
        "b": "2",
    }


@pytest.mark.parametrize(
    "text",
    [
        '{"answers": {"a": 1, "b": 2: 3}}',
        '{\n"answers": {\n"a": 1,\n"b": 2: 3\n}}',
        "answers: {a: 1, b: 2: 3}",
        "answers:\na: 1\nb: 2: 3\n",
        "answers:\n  a: 1\n  b: 2: 3\nanswers:\n  c: 3\n",
        "answers:\n  a: 1\n---\nanswers:\n  b: 2\n",
        "answers: &x\n  a: *x\n",
        "answers:\n" + "".join(f"  q{n}: 1: 2\n" for n in range(MOST_ANSWERS + 1)),
        "- answers:\n    a: 1: 2\n",
        "Dear: grader: hello",
    ],
)
def test_a_file_of_which_no_answer_can_be_told_is_refused(text: str) -> None:
    with pytest.raises(Unreadable):
        read_answers(text, "x.yaml", KNOWN)


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
    ],
)
def test_no_text_takes_long(text: str) -> None:
    begin = time.process_time()
    with pytest.raises(Unreadable):
        raise next(
            (v for v in read_answers(text, "x", KNOWN).values() if isinstance(v, Unreadable)), None
        ) or (AssertionError("all is read"))
    assert time.process_time() - begin < 4


def test_any_line_may_be_broken_in_any_way() -> None:
    """Of many broken lines, each costs at most its own answer."""
    chance = random.Random(1)
    for _ in range(300):
        names = [f"q{n}" for n in range(6)]
        values = {name: chance.choice(["1", "[1, 2]", "{x: 1}", "p^2/(2*m)", "'a: b'"]) for name in names}
        broken = chance.choice(names)
        noise = "".join(chance.choice("[]{}:'\"&*!|>%@`,#-? x1") for _ in range(chance.randint(1, 12)))
        lines = [f"  {name}: {noise if name == broken else value}" for name, value in values.items()]
        whole = "answers:\n" + "".join(f"  {name}: {value}\n" for name, value in values.items())
        right = read_answers(whole, "x")
        found = read_answers("answers:\n" + "\n".join(lines), "x", names)
        assert {name: found.get(name) for name in names if name != broken} == {
            name: right[name] for name in names if name != broken
        }, lines


@answers(
    """
    told | answer
    a number with the unit `rad/s` | 20.8 rad/s
    a number | 2*pi/3
    a list of 3 with the unit `cm` | '[1, 2, 3] cm'
    a list of 3, each a number | [1, 2, 1/2]
    2 rows of 2, each a number | [[1, 0], [0, 1]]
    `Ixx`, `Iyy`: each a number or a number with the unit `kg m^2` | {Ixx: 1, Iyy: 2 kg m^2}
    1 pairs of a moment and an axis | [{moment: 5, axis: [0, 1, 1]}]
    an expression in `k`, `m`, `p_x`, `x` | p_x^2/(2*m) + k*x^2/2
    a list of 1, each an equation in `m`, `p_x`, `xdot` | [xdot = p_x/m]
    `xdot`, `p_xdot`: each an expression in | {xdot: p_x/m, p_xdot: -k*x}
    the text `the longest one` | the longest one
    an empty list | []
    an empty mapping | {}
    """,
    ("a table with 2 rows of `t`, `x`", {"csv": "t,x\n0,1\n1,2\n"}),
    ("no answer", None),
)
def test_what_an_answer_is_read_as(answer: Tree, told: str) -> None:
    found = described(answer, Path("x.yaml"))
    assert isinstance(found, str)
    assert found.startswith(told)


@answers("""
    code | place | answer
    not_a_number |  | 20,8 rad/s
    unit_incompatible |  | 5 metres per parsec
    not_a_finite_number |  | 9**9**9**9
    parse_error |  | ((((
    not_a_number | entry 2 | [1, 2 +]
    wrong_shape |  | [[1, 2], [3]]
    not_a_number | row 2 | [[1, 2], [3, 4 +]]
    missing_file | `nowhere.csv` | {file: nowhere.csv}
    path_outside | file | {file: /etc/passwd}
    parse_error | xdot | {xdot: p_x/}
    """)
def test_what_is_read_as_nothing(code: str, place: str, answer: Tree) -> None:
    found = described(answer, Path("x.yaml"))
    assert isinstance(found, Unreadable)
    assert (found.finding.code, found.finding.place) == (code, place)
