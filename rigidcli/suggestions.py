"""Did you mean ...? The word that was probably meant by a misspelt one, and how a message proposes it."""

from __future__ import annotations

from collections.abc import Iterable
from itertools import islice

MOST_COMPARED = 200  # the most words among which a similar one is sought: it takes 5 ms
# Long words that have only an ending in common, such as `-hedron`, are less alike than this.
LONG, LEAST_OF_LONG = 8, 0.8


def nearest(word: str, words: Iterable[str], cutoff: float = 0.6) -> str | None:
    """The word that was probably meant, if one is at least `cutoff` alike (1 is equal)."""
    import difflib

    compared = list(islice(words, MOST_COMPARED + 1))
    if len(compared) > MOST_COMPARED:
        return None
    plain, folded = word.casefold(), {other.casefold(): other for other in compared}

    def unlike(other: str) -> tuple[float, int]:
        # Of equally alike words, one of nearly the same length is nearest: com, not corner, for con.
        return -difflib.SequenceMatcher(a=other, b=plain).ratio(), abs(len(other) - len(plain))

    cutoff = max(cutoff, LEAST_OF_LONG) if len(plain) > LONG else cutoff
    near = difflib.get_close_matches(plain, folded, cutoff=cutoff)
    return folded[min(near, key=unlike)] if near else None


def question(*words: str) -> str:
    """The question that proposes one of the words: `did you mean mass or size?`."""
    return f"did you mean {' or '.join(words)}?"


def did_you_mean(meant: str | None) -> str:
    """The end of a message that proposes a word: ` (did you mean mass?)`; empty without one."""
    return "" if meant is None else f" ({question(meant)})"


def guess(word: str, words: Iterable[str]) -> str:
    """The end of a message on a wrong `word`, which proposes the nearest one of the right `words`."""
    return did_you_mean(nearest(word, words))
