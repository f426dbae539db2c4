"""An assignment file -> items that are ready to judge answers, or everything that is wrong with it."""

from __future__ import annotations

import contextlib
import os
import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from pydantic import ValidationError

from rigidcli.document.load import explain
from rigidcli.document.places import Places
from rigidcli.document.syntax import read_tree
from rigidcli.errors import DocumentError, Problem, RigidError, ValueProblem, shown
from rigidcli.errors import Path as Keys
from rigidcli.fields.texts import STDIN, read_text
from rigidcli.grading.asked import Asked, Tree
from rigidcli.grading.feedback import sentence, sentences
from rigidcli.grading.judge import Accepted, Item
from rigidcli.grading.kinds import KINDS
from rigidcli.grading.kinds.base import Kind
from rigidcli.grading.library import Library, asked_by, known
from rigidcli.grading.outcome import Unreadable
from rigidcli.grading.question import EVERYWHERE, Assignment, Question

if TYPE_CHECKING:
    from rigidcli.grading.library import Study
    from rigidcli.report import Report

LONGEST_KEY = 500
"""Characters of a key that is told to those who are told all."""

DIGITS = 6
"""Of the numbers in it."""

DECIMALS = re.compile(r"[0-9]*\.[0-9]{7,}(?:e[-+]?[0-9]+)?")

_READ = re.compile(r"read `.*`,? (expected|(?=\())", re.DOTALL)

AS_TYPED = ("answer", "modulo")
"""Keys of a question, and of what it accepts, that are read by the rules of answers, digit by digit."""


WIDE = 0.2
"""A relative tolerance above this is told: it may have been meant in per cent."""


@dataclass(frozen=True, slots=True)
class Prepared:
    """An assignment with its keys worked out: `notes` on what in it does nothing, `files` that it reads.

    `solutions` are the reports, with their steps, that keys come from, by the names of the questions.
    """

    title: str
    source: str
    items: dict[str, Item]
    notes: tuple[Problem, ...] = ()
    files: tuple[Path, ...] = ()
    solutions: Mapping[str, Report] = field(default_factory=dict)


def prepare(path: str | os.PathLike[str], studies: Mapping[str, Study], text: str | None = None) -> Prepared:
    """Read an assignment, if its `text` is not read yet, and work out its keys by the `studies`.

    Raises DocumentError with all that is wrong with it, or with the documents that it names.
    """
    file = os.fspath(path)
    source = os.fsencode(file).decode(errors="backslashreplace")
    text = read_text(file, source) if text is None else text
    tree, places = _tree(text, source), Places(text, source)
    items, problems, notes = dict[str, Item](), list[Problem](), list[Problem]()
    solutions: dict[str, Report] = {}

    def placed(keys: Keys, message: str, hint: str | None = None) -> Problem:
        return places.problem(ValueProblem(message, path=keys, hint=hint))

    try:
        assignment = Assignment.model_validate(tree)
        title, questions = assignment.assignment, assignment.questions
    except ValidationError as error:
        problems += [
            placed(found.path, _discreet(found.path, found.message), found.hint) for found in explain(error)
        ]
        title, questions = "", _sound(tree.get("questions"))
    library = Library(Path() if file == STDIN else Path(file).parent, studies)
    for id, question in questions.items():
        try:
            asked, name = asked_by(question, library)
            items[id] = _item(replace(asked, name=id), name)
            if asked.report is not None:
                solutions[id] = asked.report
            notes += [
                placed(("questions", id, *keys), f"note: {what}")
                for keys, what in _notes(question, items[id], name)
            ]
        except DocumentError as error:
            problems.append(placed(("questions", id, "document"), f"{shown(question.document)} is refused"))
            problems += [each for each in error.problems if each not in problems]
        except RigidError as error:
            keys: Keys = ("questions", id, *getattr(error, "path", ()))
            problems.append(placed(keys, error.message, error.hint))
    if problems:
        raise DocumentError(problems)
    read = (Path(file), *library.files)
    return Prepared(title or Path(file).stem, source, items, tuple(notes), read, solutions)


def _notes(question: Question, item: Item, name: str) -> Iterator[tuple[Keys, str]]:
    """What in a question does nothing, or is probably not meant, with its place."""
    for option in sorted(question.model_fields_set - EVERYWHERE - item.kind.options):
        yield (option,), f"this means nothing to the kind `{name}`"
    if (question.tolerance.relative or 0.0) > WIDE:
        share = f"{question.tolerance.relative:.0%}"
        yield ("tolerance", "relative"), f"it is {share} of the value: per cent meant?"
    used = [item.kind.used_names(key) for key in (item.key, *(other.key for other in item.accepted))]
    for symbol in () if None in used else question.symbols or ():
        if not any(symbol in names for names in used if names is not None):
            yield ("symbols", symbol), "no key has this symbol"


def _tree(text: str, source: str) -> dict[str, Any]:
    """The assignment as it is written; AS_TYPED are texts."""
    tree, typed = read_tree(text, source), read_tree(text, source, typed=True)
    if not isinstance(tree, dict):
        read = "an empty file" if tree is None else shown(tree)
        raise DocumentError([Problem(source, f"read {read}, expected an assignment: a mapping", 1)])
    questions = tree.get("questions")
    for id, question in questions.items() if isinstance(questions, dict) else ():
        _keep_typed(question, typed["questions"][id])
    return tree


def _keep_typed(question: Any, typed: Any) -> None:
    """Put texts where a question, and what it accepts, has them AS_TYPED."""
    if isinstance(question, dict):
        question.update({key: typed[key] for key in AS_TYPED if key in question})
        if isinstance(accepted := question.get("accept"), list):
            for other, as_typed in zip(accepted, typed["accept"], strict=True):
                _keep_typed(other, as_typed)


def _discreet(keys: Keys, message: str) -> str:
    """A message without what was read where that may be a key, put in the wrong place."""
    option = keys[2:3] and keys[2] in Question.model_fields and keys[2] not in ("answer", "kind", "accept")
    return message if option or keys[:1] != ("questions",) else _READ.sub("expected", message)


def _sound(questions: object) -> dict[str, Question]:
    """The questions that are well-formed, where others are not: what else is wrong is told at once."""
    sound = {}
    for id, question in questions.items() if isinstance(questions, dict) else ():
        with contextlib.suppress(ValidationError):
            sound[id] = Question.model_validate(question)
    return sound


def _item(asked: Asked, name: str) -> Item:
    """A question with its key, and those of further answers. Raises ValueProblem."""
    kind, question = KINDS[name], asked.question
    key = _key(kind, asked, "ask" if asked.path else "answer")
    for code in question.credit if isinstance(question.credit, dict) else ():
        if code not in sentences():
            raise ValueProblem("there is no such code", path=("credit", code), hint=known(code, sentences()))
    accepted = []
    for place, other in enumerate(question.accept):
        also = replace(asked, value=other.answer, unit="", path=(), report=None, second=None)
        accepted.append(Accepted(_key(kind, also, "accept", place, "answer"), other.credit, other.message))
    typed = kind.typed(key)
    words = "" if typed is None else _flow(typed)
    told = words if len(words) <= LONGEST_KEY else ""
    return Item(kind, key, question.points, told, question.credit, tuple(accepted))


def _key(kind: Kind, asked: Asked, *place: str | int) -> Any:
    """A key; what is wrong with one is told without what was read. Raises ValueProblem."""
    try:
        key = kind.read_key(asked)
        kind.prepare(key)
        return key
    except ValueProblem as problem:
        raise problem if problem.path else problem.below(*place) from None
    except Unreadable as unreadable:
        found = unreadable.finding
        why = _READ.sub("expected", found.detail)
        told = sentence(replace(found, detail="" if "`" in why else why))
        raise ValueProblem(told if found.place else f"the key {told}", path=place) from None


def _flow(answer: Tree) -> str:
    """A key as it would be typed, in one line."""
    if isinstance(answer, dict):
        return f"{{{', '.join(f'{key}: {_flow(value)}' for key, value in answer.items())}}}"
    if isinstance(answer, list):
        return f"[{', '.join(map(_flow, answer))}]"
    return DECIMALS.sub(lambda number: f"{float(number[0]):.{DIGITS}g}", str(answer))
