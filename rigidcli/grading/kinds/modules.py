"""A kind that is still a module with functions."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from importlib import import_module
from pathlib import Path
from typing import Any, TypeVar

from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.kinds.base import Example, Kind
from rigidcli.grading.outcome import Finding, Outcome
from rigidcli.grading.question import OPTIONS


@dataclass(frozen=True)
class Module(Kind):
    """A kind that is still a module with functions."""

    module: str

    @property
    def name(self) -> str:  # type: ignore[override]
        return self.module

    @property
    def options(self) -> frozenset[str]:  # type: ignore[override]
        return OPTIONS[self.module]

    @property
    def _module(self) -> Any:
        return import_module(f"rigidcli.grading.kinds.{self.module}")

    def read_key(self, asked: Asked) -> Any:
        return self._module.read_key(asked)

    def read_answer(self, key: Any, answer: Tree, folder: Path) -> Any:
        return answer, folder

    def judge(self, key: Any, answer: Any) -> Outcome:
        outcome: Outcome = self._module.judge(key, *answer)
        return outcome

    def is_right(self, key: Any, answer: Any) -> bool:
        return self.judge(key, answer).verdict == "correct"

    def right_forms(self, key: Any) -> Iterator[tuple[str, Tree]]:
        for example in self._module.examples(key):
            if example.code is None:
                yield example.what, example.answer

    def examples(self, key: Any) -> Iterator[Example]:
        yield from self._module.examples(key)


_Value = TypeVar("_Value")


def explained(
    mistaken: Iterable[tuple[str, _Value]], same: Callable[[_Value], bool], otherwise: str
) -> Finding:
    """The finding of the one mistake under which the reference is the `same` as the answer."""
    codes = {code for code, value in mistaken if same(value)}
    return Finding(codes.pop() if len(codes) == 1 else otherwise)
