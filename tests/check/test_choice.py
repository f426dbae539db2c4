"""Words, yes or no, and sets of words: right in every spelling."""

from __future__ import annotations

from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from rigidcli.errors import DocumentError
from tests.check.homework import Asking, cases

CHOICE = Asking("choice")
WORDS = st.lists(st.text("abcdefgxyzäöß", min_size=1, max_size=8), min_size=1, max_size=4)


def told(item: Any, answer: Any) -> str:
    """`correct`, or the code of what is wrong."""
    return CHOICE.told(item, answer).removeprefix("incorrect ").removeprefix("invalid ")


@settings(max_examples=100, deadline=None)
@given(st.data(), WORDS)
def test_spelling_does_not_count(data: st.DataObject, words: list[str]) -> None:
    item = CHOICE.literal(data.draw(st.sampled_from(" _-")).join(words))
    gaps = [data.draw(st.sampled_from([" ", "_", "-", "  ", " - ", "\t"])) for _ in words[1:]]
    text = words[0] + "".join(gap + word for gap, word in zip(gaps, words[1:], strict=True))
    text = "".join(letter.upper() if data.draw(st.booleans()) else letter for letter in text)
    assert told(item, f" {text}  ") == "correct"
    assert told(item, f"{text}x") == "outside_tolerance"


@cases(r"""
    key | expected | answer
    intermediate | correct | Intermediate  \text{intermediate}
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
    phi | correct | φ  Φ.  ϕ  \phi  $\varphi$
    p_theta | correct | p_θ  p_{\theta}
    θ | correct | theta
    theta | correct | ϑ
    phi | outside_tolerance | psi
    asymmetric | correct | Asymmetric.  ASYMMETRIC .  asymmetric top
    asymmetric | outside_tolerance | asymmetric rotor  symmetric top
    oblate | correct | Oblate symmetric top.
    oblate | outside_tolerance | symmetric top  prolate symmetric top
    3.5 | correct | 3.5.
    3.5 | outside_tolerance | 35
    """)
def test_choices(key: str, answer: str, expected: str) -> None:
    assert told(CHOICE.literal(key), answer) == expected


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


@settings(max_examples=50, deadline=None)
@given(st.lists(st.sampled_from(["theta", "phi", "x", "the time"]), unique=True, min_size=1), st.data())
def test_a_set_has_no_order(words: list[str], data: st.DataObject) -> None:
    item = CHOICE.literal(words)
    mixed = data.draw(st.permutations(words))
    assert told(item, mixed) == "correct"
    assert told(item, " , ".join(mixed).upper()) == "correct"
    others = data.draw(st.lists(st.sampled_from(["theta", "phi", "x", "the time", "t"]), unique=True))
    if others:
        assert (told(item, others) == "correct") == (set(others) == set(words))


PENDULUM = """
parameters: {m: null, g: null, l: null}
system:
  coordinates: [theta, phi]
  kinetic: m*l^2*(thetadot^2 + sin(theta)^2*phidot^2)/2
  potential: -m*g*l*cos(theta)
"""


@cases(r"""
    expected | answer
    correct | phi  \phi  φ
    outside_tolerance | theta  phi, theta  none
    """)
def test_the_cyclic_coordinates_are_a_set(answer: str, expected: str) -> None:
    assert told(CHOICE.computed(PENDULUM, "hamilton.cyclic", kind="choice"), answer) == expected


@cases("""
    body | expected | answer
    {shape: box, size: [1, 2, 3], mass: 12} | correct | asymmetric  asymmetric top  Asymmetric top.
      asymmetric top: three different moments
    {shape: box, size: [1, 2, 3], mass: 12} | outside_tolerance | top, asymmetric  top  symmetric top
      not asymmetric
    {shape: box, size: [1, 1, 3], mass: 1} | correct | prolate  prolate top  Prolate symmetric top
    {shape: box, size: [1, 1, 3], mass: 1} | outside_tolerance | symmetric top  oblate
    {shape: box, size: [1, 1, 1], mass: 1} | correct | spherical  spherical top
    {shape: box, size: [1, 1, 1], mass: 1} | outside_tolerance | sphere  top
    """)
def test_the_words_of_a_table_are_right(body: str, answer: str, expected: str) -> None:
    assert told(CHOICE.computed(f"body: {body}", "axes.class"), answer) == expected
