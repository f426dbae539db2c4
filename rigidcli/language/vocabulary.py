"""The names that an answer may hold, in all the ways in which people spell them and run them together."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import cached_property

from rigidcli.errors import ExpressionError, nearest, shown
from rigidcli.language.functions import CONSTANTS, FUNCTIONS

LONGEST_PRODUCT = 40
"""The most letters of names that are run together: more is a sentence, and no product."""

MOST_LISTED = 40
"""The most names that a message lists."""


class Words:
    """The names that an answer may hold, in all the ways in which people spell them.

    Of `spellings`, each means a name. Underscores may be left out or added where that leaves one meaning.
    `moving` are the names that depend on the time, and may be written as `x(t)`.
    """

    def __init__(
        self, names: Iterable[str], spellings: Mapping[str, str] | None = None, moving: Collection[str] = ()
    ) -> None:
        self.names = tuple(names)
        self.spellings = dict(spellings or {})
        self.moving = frozenset(moving)

    @cached_property
    def _meanings(self) -> dict[str, str]:
        """What every spelling means."""
        bare: dict[str, set[str]] = {}
        for word, name in (*((name, name) for name in self.names), *self.spellings.items()):
            bare.setdefault(word.replace("_", ""), set()).add(name)
        single = {word: meant.pop() for word, meant in bare.items() if len(meant) == 1}
        return single | self.spellings | {name: name for name in self.names}

    def meaning(self, word: str) -> str | None:
        """The name that a word is, or None."""
        meanings = self._meanings
        return meanings.get(word) or meanings.get(word.replace("_", ""))

    def products(self, word: str) -> list[tuple[str, ...]]:
        """The products of names and functions that a word spells: at most two that differ."""
        found: dict[tuple[str, ...], tuple[str, ...]] = {}
        if len(word) <= LONGEST_PRODUCT:
            for way in self._ways(word):
                found.setdefault(tuple(sorted(way)), way)
                if len(found) == 2:
                    break
        return list(found.values())

    def _ways(self, word: str) -> Iterator[tuple[str, ...]]:
        """Every way to cut a word into names, and perhaps a function or pi; the dead ends are kept."""
        dead = set[int]()

        def from_place(start: int) -> Iterator[tuple[str, ...]]:
            if start == len(word):
                yield ()
                return
            if start in dead:
                return
            alive = False
            for end in range(start + 1, len(word) + 1):
                part = word[start:end]
                meant = part if part in FUNCTIONS or part in CONSTANTS else self.meaning(part)
                if meant is None or part[0] == "_":
                    continue
                for rest in from_place(end):
                    alive = True
                    yield (meant, *rest)
            if not alive:
                dead.add(start)

        return from_place(0)


def unknown(word: str, words: Words) -> ExpressionError:
    """What is wrong with a name that the question does not have."""
    near = nearest(word, words.names) if len(word) <= LONGEST_PRODUCT else None
    listed = ", ".join(f"`{name}`" for name in words.names[:MOST_LISTED]) or "none"
    more = ", ..." if len(words.names) > MOST_LISTED else ""
    hint = f"the symbols are {listed}{more}"
    message = f"read {shown(word)}" + (f" (did you mean `{near}`?)" if near else "")
    return ExpressionError(message, hint=hint, code="unknown_symbol")
