"""Matrices of any shape: right in any spelling, wrong entries by their place, and matrices with symbols."""

from __future__ import annotations

from typing import Any

import pytest

from rigidcli.grading.arrays.reference import Reference as Key
from tests.grading.asking import Asking, answers, codes, require_examples, rows

asking = Asking("matrix")
literal, judged = asking.literal, asking.judged


def computed(text: str, ask: str = "hamilton.matrix", **options: Any) -> Key:
    key: Key = asking.computed(text, ask, **options)
    return key


MATRIX = rows([[1, 2, 0], [-3, 4, 5], [6, 7, 9]])


# --- matrices with symbols

SPRING = """
parameters: {m: 1 kg, k: 4 N/m}
system: {coordinates: [x], kinetic: m*xdot**2/2, potential: k*x**2/2}
"""
FREE = SPRING.replace("1 kg", "null").replace("4 N/m", "null")


@pytest.mark.parametrize(
    "answer",
    [
        [["0", "1/m"], ["-k", "0"]],
        [["0", "m**(-1)"], ["-k*m/m", "k - k"]],
        [["0", "k/(m*k)"], ["-sqrt(k)^2", "sin(0)"]],
    ],
)
def test_a_matrix_with_symbols(answer: list[list[str]]) -> None:
    """x' = p/m and p' = -k x."""
    assert judged(computed(SPRING), answer).verdict == "correct"
    assert judged(computed(FREE), answer).verdict == "correct"


def test_numbers_stand_for_parameters_that_have_values() -> None:
    assert judged(computed(SPRING), [["0", "1"], ["-4", "0"]]).verdict == "correct"
    assert judged(computed(SPRING), [["0", "1/m"], ["-4", "0"]]).verdict == "correct"
    assert judged(computed(SPRING), [["0", "1"], ["4", "0"]]).verdict == "partial"
    outcome = judged(computed(FREE), [["0", "1"], ["-4", "0"]])
    assert (outcome.verdict, codes(outcome)) == ("incorrect", ["number_for_symbol"])


@answers("""
    answer
    [[0, m], [-k, 0]]  [[0, 1/m], [-4*m, 0]]  [[0, 1/m], [-k*m, 0]]  [[0, 1/m^2], [-k, 0]]
      [[0, 1/m], [-k, m - 1]]  [[1/m, 0], [0, -k]]
    """)
def test_what_is_right_for_the_given_values_only_is_wrong(answer: list[list[str]]) -> None:
    """With m = 1 and k = 4 some of these have the right values."""
    assert judged(computed(SPRING), answer).verdict in ("partial", "incorrect")
    assert judged(computed(FREE), answer).verdict in ("partial", "incorrect")


def test_mistakes_with_symbols() -> None:
    for key in (computed(SPRING), computed(FREE)):
        assert codes(judged(key, [["0", "-k"], ["1/m", "0"]])) == ["transposed"]
        assert codes(judged(key, [["0", "1/m"], ["k", "0"]])) == ["sign_error"]
        assert codes(judged(key, [["0", "q/m"], ["-k", "0"]])) == ["unknown_symbol"]
        assert codes(judged(key, [["0", "2 1"], ["-k", "0"]])) == ["parse_error"]


def test_derived_parameters_follow_those_they_hang_on() -> None:
    text = SPRING.replace("k: 4 N/m", "w: 2, k: m*w**2")
    key = computed(text)
    assert judged(key, [["0", "1/m"], ["-k", "0"]]).verdict == "correct"
    assert judged(key, [["0", "1/m"], ["-m*w^2", "0"]]).verdict == "correct"
    assert judged(key, [["0", "1/m"], ["-4*m", "0"]]).verdict == "partial"


def test_a_rotation() -> None:
    key = literal([["cos(t1)", "-sin(t1)"], ["sin(t1)", "cos(t1)"]], symbols={"t1": "real"})
    right = [["sin(t1 + pi/2)", "-sin(t1)"], ["2*sin(t1/2)*cos(t1/2)", "1 - 2*sin(t1/2)^2"]]
    assert judged(key, right).verdict == "correct"
    assert codes(judged(key, [["cos(t1)", "sin(t1)"], ["-sin(t1)", "cos(t1)"]]))[0] in (
        "transposed",
        "component_wrong",
    )


# --- what cannot be read


# --- examples


@pytest.mark.parametrize("text", [SPRING, FREE])
def test_examples(text: str) -> None:
    for key in (computed(text), literal(MATRIX), literal(rows([[1, 2, 3], [4, 5, 6]]))):
        assert require_examples("matrix", key) >= {
            None,
            "transposed",
            "power_of_ten",
            "constant_factor",
            "sign_error",
        }


def test_parameters_of_which_some_have_values() -> None:
    """With m = 1 kg, 1 is as right as 1/m; k has no value, and no number can stand for it."""
    key = computed(SPRING.replace("4 N/m", "null"))
    for first in ("1/m", "1"):
        assert judged(key, [["0", first], ["-k", "0"]]).verdict == "correct"
    assert judged(key, [["0", "1"], ["-m*k", "0"]]).verdict == "partial"
    assert judged(key, [["0", "1/k"], ["-k", "0"]]).verdict == "partial"
    assert codes(judged(key, [["0", "1/m"], ["-4", "0"]])) == ["number_for_symbol"]
