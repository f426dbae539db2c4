"""One answer file, judged question by question. It runs in a process of its own: see `batch`."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rigidcli.errors import DocumentError
from rigidcli.grading.asked import Tree
from rigidcli.grading.judgement import Judged, judged, same_for_all
from rigidcli.grading.kinds import Kind
from rigidcli.grading.outcome import Finding, Outcome, Unreadable
from rigidcli.model.syntax import read_tree

MISSING = Outcome("missing", 0.0)

LONGEST_ANSWER = 200
"""Characters by which one wrong answer is told from another."""


@dataclass(frozen=True, slots=True)
class Item:
    """A question that is ready to judge answers: its kind, and the key that the kind has made."""

    kind: Kind
    key: Any
    points: float


def judge(text: str, source: str, folder: Path, items: Mapping[str, Item]) -> tuple[Judged, ...]:
    """Judge the answer file `text`; files that it names are looked for in `folder`."""
    try:
        answers = _answers(read_tree(text, source, typed=True))
    except DocumentError as error:
        problem = error.problems[0]
        place = "" if problem.line is None else f"line {problem.line}: "
        finding = Finding(problem.code or "parse_error", detail=f"{place}{problem.message}")
        return same_for_all(_points(items), Outcome("invalid", 0.0, (finding,)))
    except Unreadable as unreadable:
        return same_for_all(_points(items), unreadable.outcome)
    return tuple(
        judged(id, item.points, _outcome(item, answers.get(id), folder), _fingerprint(answers.get(id)))
        for id, item in items.items()
    )


def _points(items: Mapping[str, Item]) -> dict[str, float]:
    return {id: item.points for id, item in items.items()}


def _answers(tree: Tree) -> dict[str, Tree]:
    """The answers of a file by the names of their questions. Raises Unreadable."""
    answers = tree.get("answers", {}) if isinstance(tree, dict) else None
    if answers is None and isinstance(tree, dict):
        return {}
    if not isinstance(answers, dict):
        raise Unreadable("wrong_shape", "expected `answers`, a mapping from questions to answers")
    return answers


def _outcome(item: Item, answer: Tree, folder: Path) -> Outcome:
    if answer is None or answer == "":
        return MISSING
    try:
        return item.kind.judge(item.key, answer, folder)
    except Unreadable as unreadable:
        return unreadable.outcome
    except MemoryError:
        return Unreadable("too_large", "it takes too much memory").outcome
    except RecursionError:
        return Unreadable("too_deep").outcome


_NUMBER = re.compile(r"(?<![A-Za-z_0-9.])[0-9]*\.?[0-9]+(?:[eE][-+]?[0-9]{1,3})?(?![A-Za-z_0-9.])")


def _fingerprint(answer: Tree) -> str:
    """A short text that is the same for answers that differ in blanks and in the last digits only."""
    if isinstance(answer, dict):
        text = ", ".join(f"{key}: {_fingerprint(answer[key])}" for key in sorted(answer))
        return f"{{{text}}}"[:LONGEST_ANSWER]
    if isinstance(answer, list):
        return f"[{', '.join(map(_fingerprint, answer[:LONGEST_ANSWER]))}]"[:LONGEST_ANSWER]
    text = str(answer)[:LONGEST_ANSWER].replace(" ", "")
    return _NUMBER.sub(lambda number: f"{float(number[0]):.3g}", text)
