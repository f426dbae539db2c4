"""One answer file, judged question by question. It runs in a process of its own: see `batch`."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from rigidcli.errors import DocumentError, nearest, shown
from rigidcli.grading.asked import Tree
from rigidcli.grading.judgement import Sheet, judged, same_for_all
from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.outcome import Finding, Outcome, Unreadable
from rigidcli.grading.sandbox import ForbiddenError, LateError, timed
from rigidcli.model.syntax import read_tree

MISSING = Outcome("missing", 0.0)

SECONDS = 2.0
"""Of the processor, that one answer may take: it must not use up those of the others."""

MOST_STRANGERS = 5
"""Answers to no question that are told one by one."""

LONGEST_ANSWER = 200
"""Characters of an answer that are kept, to tell one wrong answer from another."""

LONGEST_COMPARED = 2000
"""Characters of a text, or entries of a list, in which blanks and last digits are passed over."""


@dataclass(frozen=True, slots=True)
class Item:
    """A question that is ready to judge answers: its kind, and the key that the kind has made.

    `reference` is the key in words, for those who are told all.
    """

    kind: Kind
    key: Any
    points: float
    reference: str = ""


def judge(text: str, source: str, folder: Path, items: Mapping[str, Item]) -> Sheet:
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
    questions = []
    for id, item in items.items():
        # The name itself comes before other spellings of it.
        names = [id] if id in answers else [name for name in answers if _folded(name) == _folded(id)]
        answer = answers[names[0]] if names else None
        found = outcome(item, answer, folder) if len(names) < 2 else Unreadable("duplicate_key").outcome
        text = "" if found.verdict in ("correct", "missing") else _fingerprint(answer)
        questions.append(judged(id, item.points, found, text))
    return Sheet(tuple(questions), tuple(_strangers(answers, items)))


def _folded(id: str) -> str:
    """The name of a question, however it is spelled."""
    return id.strip().casefold()


def _strangers(answers: Mapping[str, Tree], items: Mapping[str, Item]) -> Iterator[str]:
    """Notes on answers that no question asks for."""
    known = {_folded(id) for id in items}
    strange = [id for id in answers if _folded(id) not in known]
    for id in strange[:MOST_STRANGERS]:
        near = nearest(id, list(items))
        guess = f" (did you mean {near}?)" if near else ""
        yield f"there is no question {shown(id)}{guess}"
    if len(strange) > MOST_STRANGERS:
        yield f"there are {len(strange) - MOST_STRANGERS:,} more answers that no question asks for"


def _points(items: Mapping[str, Item]) -> dict[str, float]:
    return {id: item.points for id, item in items.items()}


def _answers(tree: Tree) -> dict[str, Tree]:
    """The answers of a file by the names of their questions. Raises Unreadable."""
    if isinstance(tree, dict) and tree.get("answers") is None and tree.keys() <= {"student", "answers"}:
        return {}
    answers = tree.get("answers") if isinstance(tree, dict) else None
    if not isinstance(answers, dict):
        raise Unreadable("wrong_shape", "expected `answers`, a mapping from questions to answers")
    return answers


def outcome(item: Item, answer: Tree, folder: Path) -> Outcome:
    """The outcome of one answer, whatever goes wrong in judging it; the reference is in its findings."""
    if answer is None or (isinstance(answer, str) and not answer.strip()):
        return MISSING
    with suppress(LateError):
        with timed(SECONDS):
            found = _outcome(item, answer, folder)
        return _with_reference(found, item)
    return Unreadable("timeout").outcome


def _with_reference(found: Outcome, item: Item) -> Outcome:
    untold = not any(finding.reference for finding in found.findings)
    if found.verdict == "correct" or not item.reference or not found.findings or not untold:
        return found
    first, *others = found.findings
    return replace(found, findings=(replace(first, reference=f"expected {item.reference}"), *others))


def _outcome(item: Item, answer: Tree, folder: Path) -> Outcome:
    try:
        return item.kind.judge(item.key, item.kind.read_answer(item.key, answer, folder))
    except Unreadable as unreadable:
        return unreadable.outcome
    except MemoryError:
        return Unreadable("too_large", "it takes too much memory").outcome
    except RecursionError:
        return Unreadable("too_deep").outcome
    except ForbiddenError:
        return Unreadable("not_allowed").outcome
    except Exception as error:  # noqa: BLE001 - one answer on which a kind fails is no harm to the others
        return Unreadable("parse_error", f"it cannot be judged ({type(error).__name__})").outcome


# Possessive, so that long digits are passed over once.
_NUMBER = re.compile(
    r"(?<![A-Za-z_0-9.])(?:[0-9]++(?:\.[0-9]*+)?+|\.[0-9]++)(?:[eE][-+]?[0-9]{1,3}+)?+(?![A-Za-z_0-9.])"
)
_BLANKS = re.compile(r"\s*([-+*/^=(),])\s*")


def _fingerprint(answer: Tree) -> str:
    """A short text that is the same for answers that differ in blanks and in the last digits only."""
    text = _plain(answer)
    if len(text) <= LONGEST_ANSWER:
        return text
    return f"{text[:LONGEST_ANSWER]}... ({sha256(text.encode(errors='replace')).hexdigest()[:8]})"


def _plain(answer: Tree) -> str:
    if isinstance(answer, dict):
        return f"{{{', '.join(f'{key}: {_plain(answer[key])}' for key in sorted(answer))}}}"
    if isinstance(answer, list):
        return f"[{', '.join(map(_plain, answer[:LONGEST_COMPARED]))}]"
    text = str(answer).strip()
    if len(text) > LONGEST_COMPARED:
        return text
    text = _BLANKS.sub(r"\1", text)
    return _NUMBER.sub(lambda number: f"{float(number[0]):.3g}", text)
