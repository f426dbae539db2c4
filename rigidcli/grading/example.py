"""Answers whose outcome is known, by which a key is tested."""

from __future__ import annotations

from dataclasses import dataclass

from rigidcli.grading.asked import Tree


@dataclass(frozen=True, slots=True)
class Example:
    """An answer whose outcome is known from how it was made: right where `code` is None, else with that code.

    `what` says how it was made, for the instructor who tests the key.
    """

    what: str
    answer: Tree
    code: str | None = None
