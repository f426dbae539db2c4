"""A word, yes or no, or a set of words: as text, whatever its case, blanks, underscores and hyphens.

A set is a list of words in any order, or one text with commas between them; `none` is the empty one.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong

LONGEST = 1000
"""Characters of an answer."""

EMPTY = "none"
"""The word for a set that has no members."""

TRUTH = {"yes": "true", "no": "false"}
"""Words for truth values."""

_BETWEEN = re.compile("(?<=\\w)[\\s_\\-\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{EN DASH}]+(?=\\w)")
"""What stands between words: a hyphen before the first one may be a sign."""


@dataclass(frozen=True, slots=True)
class Key:
    """The right answer: `text` as the key has it, and the `plain` form by which answers are compared."""

    text: str
    plain: str | frozenset[str]


def read_key(asked: Asked) -> Key:
    """The text, the truth value or the set that is asked for. Raises ValueProblem where there is none."""
    value = asked.value
    if value is None:
        raise ValueProblem("the document has no such value")
    if isinstance(value, bool | np.bool_):
        value = "true" if value else "false"
    if isinstance(value, list | tuple) and all(isinstance(word, str) for word in value):
        return Key(", ".join(value) or EMPTY, frozenset(map(_plain, value)))
    if not isinstance(value, str):
        raise ValueProblem("what is asked for is not a text")
    plain = _plain(value)
    if not plain or len(value) > LONGEST:
        raise ValueProblem(f"the text of a choice has 1 to {LONGEST} characters")
    return Key(value, plain)


def judge(key: Key, answer: Tree, folder: Path) -> Outcome:
    """Whether the answer is the text, or the set, of the key. Raises Unreadable."""
    if (_set(answer) if isinstance(key.plain, frozenset) else _text(answer)) == key.plain:
        return correct()
    return wrong(Finding("outside_tolerance", reference=f"expected {shown(key.text)}"))


def _text(answer: Tree) -> str:
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a text")
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters")
    plain = _plain(answer)
    if not plain:
        raise Unreadable("parse_error", "the text is blank")
    return plain


def _set(answer: Tree) -> frozenset[str]:
    words = answer if isinstance(answer, list) else re.split("[,;]", _text(answer))
    if len(words) > LONGEST:
        raise Unreadable("too_large", f"{len(words)} words")
    return frozenset(map(_text, words)) - {EMPTY}


def _plain(text: str) -> str:
    """The text without case, with single blanks between its words, and truth values in one spelling."""
    words = _BETWEEN.sub(" ", unicodedata.normalize("NFKC", text).casefold().strip())
    return TRUTH.get(words, words)


def examples(key: Key) -> Iterator[Example]:
    """The text, the same in other spellings, and another one."""
    yield Example("the key", key.text)
    if isinstance(key.plain, frozenset):
        yield Example("as a list, in another order", sorted(key.plain, reverse=True) or EMPTY)
        yield Example("with another word", [*key.plain, f"not {key.text}"], "outside_tolerance")
        return
    spellings = {
        "in capitals": key.text.upper(),
        "with blanks around it": f"  {key.text}\t",
        "in small letters": key.plain,
        "with `_` between words": key.plain.replace(" ", "_"),
        "with `-` between words": key.plain.replace(" ", "-"),
    }
    for what, text in spellings.items():
        if _plain(text) == key.plain:  # punctuation beside a blank is no part of a word
            yield Example(what, text)
    for word, value in TRUTH.items():
        if key.plain == value:
            yield Example("another word for it", word.capitalize())
    other = {"true": "false", "false": "true"}.get(key.plain, f"not {key.plain}")
    yield Example("another text", other, "outside_tolerance")
