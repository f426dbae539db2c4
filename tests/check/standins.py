"""A kind of answer that stands for any, where what is tested is all around the kinds."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from rigidcli.check.base import Asked, Finding, Kind, Outcome, Reading, Tree, correct, earning


class Same(Kind):
    """A kind whose answer must be its key; `half` of a list of two is a part."""

    name = "same"

    def key(self, asked: Asked) -> Any:
        return asked.value

    def read(self, key: Any, answer: Tree, folder: Path) -> Reading:
        return Reading(answer, f"read {answer}")

    def judge(self, key: Any, value: Any) -> Outcome:
        return (
            correct() if value == key else earning(0.0, Finding("outside_tolerance", detail=f"read {value}"))
        )

    def typed(self, key: Any) -> Tree:
        return key
