"""Words, yes or no, and sets of words: right in every spelling."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError
from tests.homework.asking import Asking

CHOICE = Asking("choice")
WORDS = st.lists(st.text("abcdefgxyzäöß", min_size=1, max_size=8), min_size=1, max_size=4)


def told(item: Any, answer: Any) -> str:
    """`correct`, or the code of what is wrong."""
    return CHOICE.told(item, answer).removeprefix("incorrect ").removeprefix("invalid ")


@settings(max_examples=100)
@given(st.data(), WORDS)
def test_spelling_does_not_count(data: st.DataObject, words: list[str]) -> None:
    item = CHOICE.literal(data.draw(st.sampled_from(" _-")).join(words))
    gaps = [data.draw(st.sampled_from([" ", "_", "-", "  ", " - ", "\t"])) for _ in words[1:]]
    text = words[0] + "".join(gap + word for gap, word in zip(gaps, words[1:], strict=True))
    text = "".join(letter.upper() if data.draw(st.booleans()) else letter for letter in text)
    assert told(item, f" {text}  ") == "correct"
    assert told(item, f"{text}x") in ("outside_tolerance", "review undecided")  # of a yes or no


@pytest.mark.parametrize(
    ("answer", "code"),
    [
        (["stable"], "wrong_shape"),
        ({"stable": "yes"}, "wrong_shape"),
        ("x" * 1001, "too_large"),
        (" . ", "parse_error"),
    ],
)
def test_what_is_no_text_is_invalid(answer: Any, code: str) -> None:
    assert told(CHOICE.literal("stable"), answer) == code


@pytest.mark.parametrize("value", [["a", {"b": 1}], {}, "  ", "x" * 1001])
def test_what_is_no_text_makes_no_key(value: object) -> None:
    with pytest.raises(DocumentError):
        CHOICE.literal(value)


@settings(max_examples=50)
@given(st.lists(st.sampled_from(["theta", "phi", "x", "the time"]), unique=True, min_size=1), st.data())
def test_a_set_has_no_order(words: list[str], data: st.DataObject) -> None:
    item = CHOICE.literal(words)
    mixed = data.draw(st.permutations(words))
    assert told(item, mixed) == "correct"
    assert told(item, " , ".join(mixed).upper()) == "correct"
    others = data.draw(st.lists(st.sampled_from(["theta", "phi", "x", "the time", "t"]), unique=True))
    if others:
        assert (told(item, others) == "correct") == (set(others) == set(words))
