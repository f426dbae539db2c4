"""A word, yes or no, or a set of words: as text, whatever its case, blanks, underscores and hyphens.

Greek letters stand for their names, and a dot at the end does not count. A set is a list of words in any
order, or one text with commas between them; `none` is the empty one. What a table says instead of a word is
right, too.
"""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar, get_args

import numpy as np

from rigidcli.core.free_body import Regime
from rigidcli.core.nutation import NutationKind
from rigidcli.core.principal import BodyClass
from rigidcli.core.top import Stability
from rigidcli.errors import ValueProblem, shown
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.outcome import Finding, Outcome, Unreadable, correct, wrong
from rigidcli.language.tokens import GREEK

LONGEST = 1000
"""Characters of an answer."""

EMPTY = "none"
"""The word for a set that has no members."""

TRUTH = {"yes": "true", "no": "false"}
"""Words for truth values."""

POSSIBLE: dict[str, tuple[str, ...]] = {
    "class": get_args(BodyClass),
    "motion": (*get_args(Regime), "driven"),
    "nutation_kind": get_args(NutationKind),
    "sleeping": get_args(Stability),
    "stability": get_args(Stability),
}
"""The words of results that are one of a few, by the last name of their path."""

_BETWEEN = re.compile("(?<=\\w)[\\s_\\-\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{EN DASH}]+(?=\\w)")
"""What stands between words: a hyphen before the first one may be a sign."""

_LETTERS = str.maketrans(dict(zip("αβγδεζηθικλμνξοπρστυφχψω", GREEK, strict=True)))


@dataclass(frozen=True, slots=True)
class Key:
    """The right answer: `text` as the key has it, and the `plain` form by which answers are compared.

    `words` are those of the table for it, and the `possible` answers are known where there are a few.
    """

    text: str
    plain: str | frozenset[str]
    words: str = ""
    possible: tuple[str, ...] = ()


class Choice(Kind):
    """A word, yes or no, or a set of words."""

    name: ClassVar[str] = "choice"

    def read_key(self, asked: Asked) -> Key:
        """The text, the truth value or the set that is asked for. Raises ValueProblem where there is none."""
        value, fields = asked.value, () if asked.report is None else asked.report.fields
        if value is None:
            raise ValueProblem("the document has no such value")
        words = next((field.words for field in fields if field.key == ".".join(asked.path[1:])), "")
        possible = POSSIBLE.get(asked.path[-1], ()) if asked.path else ()
        if isinstance(value, bool | np.bool_):
            value, possible = "true" if value else "false", tuple(TRUTH)
        if isinstance(value, list | tuple) and all(isinstance(word, str) for word in value):
            return Key(", ".join(value) or EMPTY, frozenset(map(_plain, value)), words)
        if not isinstance(value, str):
            raise ValueProblem("what is asked for is not a text")
        if not _plain(value) or len(value) > LONGEST:
            raise ValueProblem(f"the text of a choice has 1 to {LONGEST} characters")
        return Key(value, _plain(value), words, possible)

    def read_answer(self, key: Key, answer: Tree, folder: Path) -> str | frozenset[str]:
        """A text, or a set of them where one is asked. Raises Unreadable."""
        if isinstance(key.plain, str):
            return _text(answer)
        words = answer if isinstance(answer, list) else re.split("[,;]", _text(answer))
        if len(words) > LONGEST:
            raise Unreadable("too_large", f"{len(words)} words")
        return frozenset(map(_text, words)) - {EMPTY, _plain(key.words) if not key.plain else EMPTY}

    def judge(self, key: Key, answer: str | frozenset[str]) -> Outcome:
        """Whether the answer is the text, or the set, of the key."""
        if self.is_right(key, answer):
            return correct()
        known = {_plain(word) for word in key.possible}
        strange = bool(known) and answer not in known | {TRUTH.get(word, word) for word in known}
        detail = f"expected one of {', '.join(map(shown, key.possible))}" if strange else ""
        return wrong(Finding("outside_tolerance", detail=detail, reference=f"expected {shown(key.text)}"))

    def is_right(self, key: Key, answer: str | frozenset[str]) -> bool:
        """Whether the answer is that of the key, or has its word and others that the table has for it."""
        if answer == key.plain or not (isinstance(answer, str) and isinstance(key.plain, str)):
            return answer == key.plain
        own, said = _plain(key.words.partition(":")[0]), set(answer.split())
        return answer in (own, _plain(key.words)) or set(key.plain.split()) <= said <= set(own.split())

    def right_forms(self, key: Key) -> Iterator[tuple[str, Tree]]:
        """The text, and the same in other spellings."""
        yield "the key", key.text
        if isinstance(key.plain, frozenset):
            yield "as a list, in another order", sorted(key.plain, reverse=True) or EMPTY
            return
        spellings = {
            "in capitals": key.text.upper(),
            "with blanks around it": f"  {key.text}\t",
            "in small letters": key.plain,
            "with `_` between words": key.plain.replace(" ", "_"),
            "with `-` between words": key.plain.replace(" ", "-"),
            "with a dot at the end": f"{key.text}.",
            "another word for it": {value: word for word, value in TRUTH.items()}.get(key.plain, key.text),
            "as the table has it": key.words or key.text,
        }
        for what, text in spellings.items():
            if self.is_right(key, _plain(text)):  # punctuation beside a blank is no part of a word
                yield what, text

    def wrong_forms(self, key: Key) -> Iterator[Example]:
        """Another text, or one word too many."""
        if isinstance(key.plain, frozenset):
            yield Example("with another word", [*key.plain, f"not {key.text}"], "outside_tolerance")
        else:
            other = {"true": "false", "false": "true"}.get(key.plain, f"not {key.plain}")
            yield Example("another text", other, "outside_tolerance")


def _text(answer: Tree) -> str:
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a text")
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters")
    plain = _plain(answer)
    if not plain:
        raise Unreadable("parse_error", "the text is blank")
    return plain


def _plain(text: str) -> str:
    """The text in small letters, with single blanks between words, and truth values in one spelling."""
    letters = unicodedata.normalize("NFKC", text).casefold().translate(_LETTERS)
    words = _BETWEEN.sub(" ", letters.strip().removesuffix(".").rstrip())
    return TRUTH.get(words, words)
