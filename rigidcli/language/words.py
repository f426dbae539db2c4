"""The names that a formula may hold, in all the ways in which people spell them."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from functools import cached_property

from rigidcli.errors import ExpressionError, did_you_mean, nearest, shown
from rigidcli.language.functions import CALLED, CONSTANTS

LONGEST_PRODUCT = 40
"""The most letters of names that are run together: more is a sentence, and no product."""

MOST_LISTED = 40
"""The most names that a message lists."""


class Words:
    """The names that a formula may hold.

    Of `spellings`, each means a name. Underscores may be left out or added where that leaves one meaning.
    `moving` are the names that depend on the time, and may be written as `x(t)`. Where the list `is_open`, as
    that of a document, another name is taken whole.
    """

    def __init__(
        self,
        names: Iterable[str],
        spellings: Mapping[str, str] | None = None,
        moving: Collection[str] = (),
        *,
        is_open: bool = False,
    ) -> None:
        self.names = tuple(names)
        self.spellings = dict(spellings or {})
        self.moving = frozenset(moving)
        self.is_open = is_open

    @cached_property
    def _meanings(self) -> dict[str, str]:
        """The name that each spelling means."""
        if self.is_open:
            return {name: name for name in self.names}
        bare: dict[str, set[str]] = {}
        for word, name in (*((name, name) for name in self.names), *self.spellings.items()):
            bare.setdefault(word.replace("_", ""), set()).add(name)
        single = {word: meant.pop() for word, meant in bare.items() if len(meant) == 1}
        return single | self.spellings | {name: name for name in self.names}

    def meaning(self, word: str) -> str | None:
        """The name that a word is, or None."""
        meanings = self._meanings
        return meanings.get(word) or (None if self.is_open else meanings.get(word.replace("_", "")))

    def products(self, word: str, calls: bool = False) -> list[tuple[str, ...]]:
        """The products of names and functions, or pi, that a word spells: at most two that differ.

        The last may be a function where the word `calls` one: what stands behind it is its argument.

        From the end of the word: what its last letters spell is a name times what is spelled behind that.
        """
        end = len(word)
        spelled: dict[int, list[tuple[str, ...]]] = {end: [()]}
        for start in reversed(range(end if end <= LONGEST_PRODUCT else 0)):
            products: dict[tuple[str, ...], tuple[str, ...]] = {}
            for cut in range(start + 1, end + 1):
                part = word[start:cut]
                meant = part if part in CALLED or part in CONSTANTS else self.meaning(part)
                if meant is None or part[0] == "_":
                    continue
                if meant in CALLED and cut == end and (start == 0 or not calls):
                    continue
                for rest in spelled[cut]:
                    if meant in CALLED and CALLED.issuperset(rest) and rest:
                        continue
                    products.setdefault(tuple(sorted((meant, *rest))), (meant, *rest))
            spelled[start] = list(products.values())[:2]
        ways = spelled.get(0, [])
        return [way for way in ways if not self.is_open or way[0] in CALLED or CALLED.isdisjoint(way)]


def unknown(word: str, words: Words) -> ExpressionError:
    """The error for a name that the question does not have."""
    near = nearest(word, words.names) if len(word) <= LONGEST_PRODUCT else None
    listed = ", ".join(f"`{name}`" for name in words.names[:MOST_LISTED]) or "none"
    more = ", ..." if len(words.names) > MOST_LISTED else ""
    message = f"read {shown(word)}{did_you_mean(near and f'`{near}`')}"
    return ExpressionError(message, hint=f"the symbols are {listed}{more}", code="unknown_symbol")
