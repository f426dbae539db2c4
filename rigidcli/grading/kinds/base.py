"""What every kind of answers is: how a key and an answer are read, how they are compared, and what is said.

A kind tells whether an answer is right by a key. The named mistakes follow from that alone: `mistakes` has a
table of what each makes of a key, and an answer that is right by what exactly one of them makes is explained.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.mistakes import LEVELS, explaining, variants
from rigidcli.grading.outcome import Finding, Outcome


@dataclass(frozen=True, slots=True)
class Example:
    """An answer whose outcome is known from how it was made: right where `code` is None, else with that code.

    `what` says how it was made, for the instructor who tests the key.
    """

    what: str
    answer: Tree
    code: str | None = None


class Kind(ABC):
    """One kind of answers. It has no state: what a question is judged by is in its key.

    `name` is that by which the table of mistakes knows it; `options` are those of a question that mean
    something to it, besides those of every question. Keys are compared by identity, and can be pickled.
    """

    name: ClassVar[str]
    options: ClassVar[frozenset[str]] = frozenset()

    @abstractmethod
    def read_key(self, asked: Asked) -> Any:
        """The key of a question, worked once. Raises ValueProblem where what is asked is not of this kind."""

    def prepare(self, key: Any) -> None:
        """Work out what judging needs, before processes are forked that judge by the key."""
        variants(self.name, key)

    @abstractmethod
    def read_answer(self, key: Any, answer: Tree, folder: Path) -> Any:
        """An answer to that question; `folder` is the answer file, or the folder, beside which files lie.

        Raises Unreadable.
        """

    @abstractmethod
    def judge(self, key: Any, answer: Any) -> Outcome:
        """The outcome of an answer that has been read."""

    @abstractmethod
    def is_right(self, key: Any, answer: Any) -> bool:
        """Whether an answer is fully right by this key, which may be one that a mistake has made."""

    @abstractmethod
    def right_forms(self, key: Any) -> Iterator[tuple[str, Tree]]:
        """The key as it would be typed, then the same in other forms; each after what it is."""

    def used_names(self, key: Any) -> frozenset[str] | None:
        """The symbols that stand in a key; None for a kind without symbols, or where they are not known."""
        return None

    def wrong_forms(self, key: Any) -> Iterator[Example]:
        """Wrong answers that no named mistake makes, such as one without a unit."""
        return iter(())

    def typed(self, key: Any) -> Tree | None:
        """A key as it would be typed; None where it cannot be."""
        return next((form for _, form in self.right_forms(key)), None)

    def explanation(self, key: Any, answer: Any) -> Finding | None:
        """The one named mistake that explains a wrong answer; None where none does, or several do."""
        for level in LEVELS:
            found = {
                mistake.code: Finding(mistake.code, variant.place, variant.detail)
                for mistake, variant in explaining(self.name, key, answer, level)
                if self.is_right(variant.key, answer)
            }
            if found:
                return found.popitem()[1] if len(found) == 1 else None
        return None

    def examples(self, key: Any) -> Iterator[Example]:
        """Right answers, and wrong ones by every mistake that changes the key and looks like no other."""
        yield from (Example(what, form) for what, form in self.right_forms(key))
        yield from self.wrong_forms(key)
        for code, changed in self.mistaken(key):
            form = self.typed(changed)
            if form is None:
                continue
            answer = self.read_answer(key, form, Path())
            if not self.is_right(key, answer):
                first = self.judge(key, answer).findings[:1]
                if [found.code for found in first] == [code]:
                    yield Example(code.replace("_", " "), form, code)

    def mistaken(self, key: Any) -> Iterator[tuple[str, Any]]:
        """Codes of mistakes, and the keys that they make. A kind may add some that are otherwise fitted."""
        yield from ((mistake.code, variant.key) for mistake, variant in variants(self.name, key))
