"""One answer file, judged question by question. It runs in a process of its own: see `batch`."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Any

from rigidcli.errors import nearest, shown
from rigidcli.grading.answers import folded, read_answers
from rigidcli.grading.asked import Tree
from rigidcli.grading.files import beside, is_contested, safe_name
from rigidcli.grading.judgement import Sheet, judged
from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.outcome import MISSING, Finding, Outcome, Unreadable, earning, review
from rigidcli.sandbox import ForbiddenError, LateError, timed

SECONDS = 2.0
"""Of the processor, that one answer may take: it must not use up those of the others."""

MOST_STRANGERS = 5
"""Answers to no question that are told one by one."""

LONGEST_ANSWER = 200
"""Characters of an answer that are kept, to tell one wrong answer from another."""

LONGEST_COMPARED = 2000
"""Characters of a text, or entries of a list, in which blanks and last digits are passed over."""


@dataclass(frozen=True, slots=True)
class Accepted:
    """The key of another answer, the share (0 to 1) of points that it earns, and what a student is told."""

    key: Any
    credit: float
    message: str = ""


@dataclass(frozen=True, slots=True)
class Item:
    """A question that is ready to judge answers: its kind, and the key that the kind has made.

    `reference` is the key in words, for those who are told all. `credit` and `accepted` are as the question
    has them.
    """

    kind: Kind
    key: Any
    points: float
    reference: str = ""
    credit: str | Mapping[str, float] = "parts"
    accepted: tuple[Accepted, ...] = ()


def judge(text: str, path: Path, items: Mapping[str, Item]) -> Sheet:
    """Judge the text of the answer file at `path`; files that it names are looked for beside it."""
    try:
        answers = read_answers(text, str(path), items)
    except Unreadable as unreadable:
        return same_for_all(items, unreadable.outcome)
    questions, files = [], set()
    for id, item in items.items():
        # The name itself comes before other spellings of it.
        names = [id] if id in answers else [name for name in answers if folded(name) == folded(id)]
        answer = answers[names[0]] if names else None
        found = outcome(item, answer, path) if len(names) < 2 else Unreadable("duplicate_key").outcome
        if isinstance(answer, dict) and "file" in answer:
            with suppress(Unreadable):
                file = beside(answer["file"], path)
                files.add(safe_name(file.name))
                if found.share and is_contested(file, path):
                    found = review("another student's answer names this file, too")
        text = "" if found.verdict in ("correct", "missing") else _fingerprint(answer)
        questions.append(judged(id, item.points, found, text))
    return Sheet(tuple(questions), tuple(_strangers(answers, items)), tuple(sorted(files)))


def same_for_all(items: Mapping[str, Item], found: Outcome) -> Sheet:
    """A file whose questions are not judged one by one."""
    return Sheet(tuple(judged(id, item.points, found) for id, item in items.items()))


def _strangers(answers: Iterable[str], items: Mapping[str, Item]) -> Iterator[str]:
    """Notes on answers that no question asks for."""
    known = {folded(id) for id in items}
    strange = [id for id in answers if folded(id) not in known]
    for id in strange[:MOST_STRANGERS]:
        near = nearest(id, list(items))
        guess = f" (did you mean {near}?)" if near else ""
        yield f"there is no question {shown(id)}{guess}"
    if len(strange) > MOST_STRANGERS:
        yield f"there are {len(strange) - MOST_STRANGERS:,} more answers that no question asks for"


def outcome(item: Item, answer: Tree | Unreadable, path: Path) -> Outcome:
    """The outcome of one answer, whatever goes wrong in judging it; the reference is in its findings."""
    if isinstance(answer, Unreadable):
        return answer.outcome
    if answer is None or (isinstance(answer, str) and not answer.strip()):
        return MISSING
    with suppress(LateError):
        with timed(SECONDS):
            found = _credited(item, _outcome(item, item.key, answer, path))
            found = found if found.verdict == "correct" else _best(item, answer, path, found)
        return _with_reference(found, item)
    return Unreadable("timeout").outcome


def _credited(item: Item, found: Outcome) -> Outcome:
    """The outcome with the share that the question gives for what was found."""
    if item.credit == "whole" and found.verdict == "partial":
        return replace(found, verdict="incorrect", share=0.0)
    if isinstance(item.credit, str) or found.verdict == "review":
        return found
    shares = [item.credit.get(finding.code) for finding in found.findings]
    told = [share for share in shares if share is not None]
    return earning(min(told), *found.findings) if told and len(told) == len(shares) else found


def _best(item: Item, answer: Tree, path: Path, found: Outcome) -> Outcome:
    """The best of an outcome and those of further answers that are accepted."""
    for other in item.accepted:
        if other.credit >= found.share and _outcome(item, other.key, answer, path).verdict == "correct":
            found = earning(other.credit, Finding("accepted", detail=other.message))
    return found


def _with_reference(found: Outcome, item: Item) -> Outcome:
    untold = not any(finding.reference for finding in found.findings)
    if found.verdict == "correct" or not item.reference or not found.findings or not untold:
        return found
    first, *others = found.findings
    return replace(found, findings=(replace(first, reference=f"expected {item.reference}"), *others))


def _outcome(item: Item, key: Any, answer: Tree, path: Path) -> Outcome:
    try:
        return item.kind.judge(key, item.kind.read_answer(key, answer, path))
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


def _fingerprint(answer: Tree | Unreadable) -> str:
    """A short text that is the same for answers that differ in blanks and in the last digits only."""
    text = "" if isinstance(answer, Unreadable) else _plain(answer)
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
