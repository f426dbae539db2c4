"""A word, yes or no, or a set of words, in any spelling; the words of the program's own tables, too."""

from __future__ import annotations

import re
import unicodedata
from contextlib import suppress
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from rigidcli.check.base import Asked, Finding, Kind, Outcome, Reading, Tree, Unreadable
from rigidcli.errors import ValueProblem, shown
from rigidcli.language.latex import plain as without_latex

LONGEST = 1000
"""The most characters of an answer."""

TRUTH = {"yes": "true", "no": "false"}

_BETWEEN = re.compile("(?<=\\w)[\\s_\\-\N{HYPHEN}\N{NON-BREAKING HYPHEN}\N{EN DASH}]+(?=\\w)")
"""What stands between words: a hyphen before the first one may be a sign."""


@dataclass(frozen=True, slots=True)
class Key:
    """The right `text`, its `plain` form, to which answers are held, and the `words` of a table for it."""

    text: str
    plain: str | frozenset[str]
    words: str = ""


class Choice(Kind):
    """A word, yes or no, or a set of words."""

    name: ClassVar[str] = "choice"

    def key(self, asked: Asked) -> Key:
        """The text, the truth value or the set that is asked for. Raises ValueProblem."""
        value, fields = asked.value, () if asked.report is None else asked.report.fields
        words = next((field.words for field in fields if field.key == ".".join(asked.path[1:])), "")
        if isinstance(value, bool | np.bool_):
            value = "true" if value else "false"
        if isinstance(value, list | tuple) and all(isinstance(word, str) for word in value):
            return Key(", ".join(value) or "none", frozenset(map(_plain, value)), words)
        if not isinstance(value, str):
            raise ValueProblem("what is asked for is not a text")
        if not _plain(value) or len(value) > LONGEST:
            raise ValueProblem(f"the text of a choice has 1 to {LONGEST} characters")
        return Key(value, _plain(value), words)

    def read(self, key: Key, answer: Tree) -> Reading:
        """A text, or a set of texts where one is asked. Raises Unreadable."""
        if isinstance(key.plain, str):
            text = _text(answer)
            return Reading(text, text)
        words = answer if isinstance(answer, list) else re.split("[,;]|\\band\\b", _text(answer))
        if len(words) > LONGEST:
            raise Unreadable("too_large", f"{len(words)} words")
        nothing = {"none", _plain(key.words) if not key.plain else "none"}
        chosen = frozenset(map(_text, words)) - nothing
        return Reading(chosen, ", ".join(sorted(chosen)) or "none")

    def judge(self, key: Key, value: str | frozenset[str]) -> Outcome:
        """Whether the answer is the text, or the set, of the key."""
        is_right = value == key.plain or self._is_word_of_table(key, value)
        return Outcome.correct() if is_right else Outcome.earning(0.0, Finding("outside_tolerance"))

    def _is_word_of_table(self, key: Key, value: str | frozenset[str]) -> bool:
        """Whether the answer says what a table says, or the key with more of its words."""
        if not isinstance(value, str) or not isinstance(key.plain, str):
            return False
        if value.removesuffix(" body").removesuffix(" top").removesuffix(" symmetric") == key.plain:
            return True
        own, said = _plain(key.words.partition(":")[0]), set(value.split())
        return value in (own, _plain(key.words)) or set(key.plain.split()) <= said <= set(own.split())

    def typed(self, key: Key) -> Tree:
        """The text of the key."""
        return key.text


def _text(answer: Tree) -> str:
    if not isinstance(answer, str):
        raise Unreadable("wrong_shape", f"read {shown(answer)}, expected a text")
    if len(answer) > LONGEST:
        raise Unreadable("too_large", f"{len(answer)} characters")
    if not (plain := _plain(answer)):
        raise Unreadable("parse_error", "the text is blank")
    return plain


def _plain(text: str) -> str:
    """The text in small letters, with single blanks between words, and truth values in one spelling."""
    letters = unicodedata.normalize("NFKC", text)
    with suppress(ValueProblem):  # a brace may stand in a text that is no LaTeX
        letters = without_latex(letters)
    words = _BETWEEN.sub(" ", letters.casefold().strip().removesuffix(".").rstrip())
    return TRUTH.get(words, words)
