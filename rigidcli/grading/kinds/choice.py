"""A word, or yes and no: compared as text, whatever its case, blanks, underscores and hyphens."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds import Example
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong

LONGEST = 1000
"""Characters of an answer."""

TRUTH = {"yes": "true", "no": "false"}
"""Words for truth values."""

_BETWEEN = re.compile("(?<=\\w)[\\s_\\-\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{EN DASH}]+(?=\\w)")
"""What stands between words: a hyphen before the first one may be a sign."""


@dataclass(frozen=True, slots=True)
class Key:
    """The right answer: `text` as the key has it, and the `plain` form by which answers are compared."""

    text: str
    plain: str


def read_key(asked: Asked) -> Key:
    """The text or truth value that is asked for. Raises ValueProblem where there is none."""
    value = asked.value
    if value is None:
        raise ValueProblem("the document has no such value")
    if isinstance(value, bool | np.bool_):
        value = "true" if value else "false"
    if not isinstance(value, str):
        raise ValueProblem("what is asked for is not a text")
    plain = _plain(value)
    if not plain or len(value) > LONGEST:
        raise ValueProblem(f"the text of a choice has 1 to {LONGEST} characters")
    return Key(value, plain)


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """Whether the answer is the text of the key. Raises Unreadable."""
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a text")
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters")
    plain = _plain(answer)
    if not plain:
        raise Unreadable("parse_error", "the text is blank")
    if plain == key.plain:
        return correct()
    return wrong(Finding("outside_tolerance", reference=f"expected {shown(key.text)}"))


def _plain(text: str) -> str:
    """The text without case, with single blanks between its words, and truth values in one spelling."""
    words = _BETWEEN.sub(" ", unicodedata.normalize("NFKC", text).casefold().strip())
    return TRUTH.get(words, words)


def examples(key: Key) -> Iterator[Example]:
    """The text, the same in other spellings, and another one."""
    yield Example("the key", key.text)
    if _plain(key.text.upper()) == key.plain:
        yield Example("in capitals", key.text.upper())
    yield Example("with blanks around it", f"  {key.text}\t")
    yield Example("in small letters", key.plain)
    for sign in "_-":
        yield Example(f"with `{sign}` between words", key.plain.replace(" ", sign))
    for word, value in TRUTH.items():
        if key.plain == value:
            yield Example("another word for it", word.capitalize())
    other = {"true": "false", "false": "true"}.get(key.plain, f"not {key.plain}")
    yield Example("another text", other, "outside_tolerance")
